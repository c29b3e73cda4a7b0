//! A figure's sheet: SVG by plotters, drawn on a fine grid and made smaller.

use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::FontStyle;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::compact;

/// plotters places everything at whole pixels: so many of them to a pixel of the picture keep curves smooth.
const FINE: u32 = 4;
/// plotters writes a font's height, SVG wants its size.
const FONT_HEIGHT_OVER_SIZE: f64 = 1.24;

/// Text and axes.
pub(super) const INK: RGBColor = RGBColor(0x1f, 0x29, 0x33);
/// Second to the ink.
pub(super) const SOFT: RGBColor = RGBColor(0x52, 0x60, 0x6d);
/// Grid lines, places without samples.
pub(super) const FAINT: RGBColor = RGBColor(0xdd, 0xe1, 0xe6);
/// The sheet itself.
pub(super) const PAPER: RGBColor = RGBColor(0xfc, 0xfc, 0xfa);

pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub(super) type Chart<'a, 'b> =
    ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
pub(super) type Drawn<T = ()> = Result<T, DrawingAreaErrorKind<std::io::Error>>;

/// A length of the picture (px) in the units of the sheet.
pub(super) fn px(length: f64) -> i32 {
    (length * f64::from(FINE)).round() as i32
}

/// A font of a size (px).
pub(super) fn font(size: f64, colour: RGBColor) -> TextStyle<'static> {
    ("sans-serif", size * FONT_HEIGHT_OVER_SIZE * f64::from(FINE))
        .into_font()
        .color(&colour)
}

pub(super) fn bold(size: f64, colour: RGBColor) -> TextStyle<'static> {
    let height = size * FONT_HEIGHT_OVER_SIZE * f64::from(FINE);
    ("sans-serif", height, FontStyle::Bold)
        .into_font()
        .color(&colour)
}

pub(super) fn anchored(
    style: TextStyle<'static>,
    horizontal: HPos,
    vertical: VPos,
) -> TextStyle<'static> {
    style.pos(Pos::new(horizontal, vertical))
}

/// Pixels around the drawing that the title takes on top.
pub(super) const HEAD: f64 = 66.0;

/// A light sheet `width` x `height` px with a title and a line below it; `draw` gets what is below these.
///
/// `title` and `subtitle` are also what a screen reader says.
pub(super) fn sheet(
    (width, height): (f64, f64),
    title: &str,
    subtitle: &str,
    draw: impl FnOnce(&Area) -> Drawn,
) -> String {
    let mut svg = String::new();
    let size = (px(width).unsigned_abs(), px(height).unsigned_abs());
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        paint(&area, title, subtitle, draw)
            .expect("memory takes every stroke, and all ranges are finite and not empty");
    }
    finish(&svg, (width, height), title, subtitle)
}

fn paint(area: &Area, title: &str, subtitle: &str, draw: impl FnOnce(&Area) -> Drawn) -> Drawn {
    area.fill(&PAPER)?;
    area.draw(&Text::new(
        title.to_owned(),
        (px(20.0), px(12.0)),
        bold(16.0, INK),
    ))?;
    area.draw(&Text::new(
        subtitle.to_owned(),
        (px(20.0), px(36.0)),
        font(12.0, SOFT),
    ))?;
    let (_, below) = area.split_vertically(px(HEAD));
    draw(&below)?;
    area.present()
}

/// Makes plotters' SVG smaller, and says what it is.
fn finish(svg: &str, (width, height): (f64, f64), title: &str, subtitle: &str) -> String {
    let body = svg.split_once('\n').map_or("", |(_, body)| body);
    // Quotes inside texts are escaped: none of these can be part of what a person wrote.
    let body = body
        .replace(" opacity=\"1\"", "")
        .replace(" stroke=\"none\"", "")
        .replace(" font-family=\"sans-serif\"", "")
        // A text's newlines would be spaces to whoever copies it.
        .replace("\">\n", "\">")
        .replace("\n</text>", "</text>");
    let body = compact::alike_in_one(&body);
    let (title, subtitle) = (escape(title), escape(subtitle));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {} {}\" \
         font-family=\"Helvetica, Arial, 'Liberation Sans', sans-serif\" stroke-linejoin=\"round\" role=\"img\" aria-label=\"{title}\">\n\
         <title>{title}</title><desc>{subtitle}</desc>\n{body}",
        px(width),
        px(height),
    )
}

/// Text as XML and HTML have it.
pub(crate) fn escape(text: &str) -> String {
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
