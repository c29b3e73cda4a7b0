//! The sheet: SVG text, written in drawing order.

use std::fmt::{Arguments, Write as _};

/// Text on the sheet.
const INK: &str = "#1f2933";
/// The sheet itself.
const PAPER: &str = "#fcfcfa";

/// SVG under construction; lengths in pixels, y down.
pub(super) struct Canvas {
    text: String,
}

impl Canvas {
    /// A light sheet with a title and one line below it.
    pub(super) fn new(width_px: f64, height_px: f64, title: &str, subtitle: &str) -> Canvas {
        let (title, subtitle) = (escape(title), escape(subtitle));
        let mut canvas = Canvas {
            text: String::new(),
        };
        canvas.put(format_args!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width_px:.0} {height_px:.0}" width="{width_px:.0}" height="{height_px:.0}" font-family="Helvetica, Arial, 'Liberation Sans', sans-serif" font-size="12" fill="{INK}" role="img" aria-label="{title}">"#
        ));
        canvas.put(format_args!("<desc>{subtitle}</desc>"));
        canvas.put(format_args!(
            r##"<defs>
<linearGradient id="air" x1="0" y1="0" x2="0" y2="1"><stop offset="0" stop-color="#2b7bba"/><stop offset="1" stop-color="#2b7bba" stop-opacity="0.35"/></linearGradient>
<linearGradient id="worst-air" x1="0" y1="0" x2="0" y2="1"><stop offset="0" stop-color="#d1495b" stop-opacity="0.5"/><stop offset="1" stop-color="#d1495b" stop-opacity="0.15"/></linearGradient>
</defs>"##
        ));
        canvas.put(format_args!(
            r#"<rect width="100%" height="100%" fill="{PAPER}"/>"#
        ));
        canvas.put(format_args!(
            r#"<text x="28" y="36" font-size="20" font-weight="bold">{title}</text>"#
        ));
        canvas.put(format_args!(
            r##"<text x="28" y="58" font-size="13" fill="#52606d">{subtitle}</text>"##
        ));
        canvas
    }

    /// One element, or several, on a line of its own.
    pub(super) fn put(&mut self, element: Arguments) {
        // Writing to a String cannot fail.
        let _ = self.text.write_fmt(element);
        self.text.push('\n');
    }

    /// Elements that belong together.
    pub(super) fn group(&mut self, class: &str, draw: impl FnOnce(&mut Canvas)) {
        self.put(format_args!(r#"<g class="{class}">"#));
        draw(self);
        self.put(format_args!("</g>"));
    }

    pub(super) fn finish(mut self) -> String {
        self.text.push_str("</svg>\n");
        self.text
    }
}

/// Text as XML has it.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            // XML 1.0 has no other control characters.
            control if control.is_control() => escaped.push(' '),
            other => escaped.push(other),
        }
    }
    escaped
}
