//! The one canvas of all figures: SVG in drawing order, without network, script or style sheet.
//!
//! Lengths in pixels of a screen, x to the right, y down. Looks are SVG attributes, as [`fill`] and
//! [`stroke`] write them.

use std::fmt::Arguments;

use super::colours::{Colour, INK, PAPER, SOFT};
use crate::report::words::escape;

/// A place on the sheet (px).
pub(super) type Spot = (f64, f64);

/// Mean advance of a letter over the font's size: that of DejaVu Sans, which stands in where there
/// is no Helvetica (0.5).
const LETTER: f64 = 0.58;
/// From the middle of a line of text down to its baseline, over the font's size.
const BASELINE: f64 = 0.36;
/// What title and subtitle take on top (px).
pub(super) const HEAD: f64 = 66.0;
/// What is left free on both sides of titles and legends (px).
pub(super) const MARGIN: f64 = 20.0;

/// A rectangle of the sheet (px).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Area {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

impl Area {
    pub(super) fn new((left, top): Spot, (width, height): (f64, f64)) -> Area {
        Area {
            left,
            top,
            width,
            height,
        }
    }

    pub(super) fn right(&self) -> f64 {
        self.left + self.width
    }

    pub(super) fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// What is left without so much at each side: left, top, right, bottom.
    pub(super) fn inset(&self, [left, top, right, bottom]: [f64; 4]) -> Area {
        let corner = (self.left + left, self.top + top);
        let (width, height) = (self.width - left - right, self.height - top - bottom);
        Area::new(corner, (width, height))
    }

    /// The part so wide at the right end, after what remains.
    pub(super) fn split_right(&self, width: f64) -> (Area, Area) {
        let left = self.inset([0.0, 0.0, width, 0.0]);
        (left, self.inset([left.width, 0.0, 0.0, 0.0]))
    }

    /// Equal parts, row by row.
    pub(super) fn grid(&self, rows: usize, columns: usize) -> Vec<Area> {
        let (width, height) = (self.width / columns as f64, self.height / rows as f64);
        let part = |index: usize| {
            let left = self.left + width * (index % columns) as f64;
            let top = self.top + height * (index / columns) as f64;
            Area::new((left, top), (width, height))
        };
        (0..rows * columns).map(part).collect()
    }

    pub(super) fn contains(&self, other: &Area) -> bool {
        let across = self.left <= other.left && other.right() <= self.right();
        across && self.top <= other.top && other.bottom() <= self.bottom()
    }

    pub(super) fn overlaps(&self, other: &Area) -> bool {
        let across = self.left < other.right() && other.left < self.right();
        across && self.top < other.bottom() && other.top < self.bottom()
    }
}

/// How a text looks. The middle of its start lies at the place given, unless it is [`CENTRED`] or
/// [`TO_THE_LEFT`].
#[derive(Clone)]
pub(super) struct Letters {
    pub(super) size_px: f64,
    look: String,
}

pub(super) const BOLD: &str = r#" font-weight="bold""#;
pub(super) const CENTRED: &str = r#" text-anchor="middle""#;
pub(super) const TO_THE_LEFT: &str = r#" text-anchor="end""#;

impl Letters {
    pub(super) fn new(size_px: f64, colour: Colour) -> Letters {
        Letters {
            size_px,
            look: fill(colour, 1.0),
        }
    }

    /// With another attribute.
    pub(super) fn with(self, look: &str) -> Letters {
        Letters {
            look: self.look + look,
            ..self
        }
    }

    /// With an edge of paper around every letter: to be read above lines.
    pub(super) fn with_halo(self) -> Letters {
        self.with(&stroke(PAPER, 2.5))
            .with(r#" paint-order="stroke""#)
    }

    /// How wide a text becomes (px), nearly.
    pub(super) fn width_px(&self, text: &str) -> f64 {
        text.chars().count() as f64 * self.size_px * LETTER
    }
}

/// SVG under construction.
pub(super) struct Canvas {
    svg: String,
}

impl Canvas {
    /// A light sheet with a title and a line below it, which are also what a screen reader says;
    /// and what is left below these. `defs`: gradients that looks refer to.
    pub(super) fn new(
        (width, height): (f64, f64),
        (title, subtitle): (&str, &str),
        defs: &str,
    ) -> (Canvas, Area) {
        let mut canvas = Canvas { svg: String::new() };
        let (name, description) = (escape(title), escape(subtitle));
        canvas.put(format_args!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0}" height="{height:.0}" viewBox="0 0 {width:.0} {height:.0}" font-family="Helvetica, Arial, 'Liberation Sans', sans-serif" stroke-linejoin="round" role="img" aria-label="{name}">
<title>{name}</title><desc>{description}</desc>{defs}
<rect width="100%" height="100%" fill="{PAPER}"/>"#
        ));
        canvas.text((MARGIN, 24.0), title, &Letters::new(17.0, INK).with(BOLD));
        canvas.text((MARGIN, 46.0), subtitle, &Letters::new(12.0, SOFT));
        let below = Area::new((0.0, HEAD), (width, height - HEAD));
        (canvas, below)
    }

    /// Elements as SVG writes them, on a line of their own.
    pub(super) fn put(&mut self, elements: Arguments) {
        self.svg += &format!("{elements}\n");
    }

    /// A path, unless it is empty.
    pub(super) fn path(&mut self, path: &str, look: &str) {
        if !path.is_empty() {
            self.put(format_args!(r#"<path d="{path}"{look}/>"#));
        }
    }

    /// A path with a name that shows where a pointer rests on it.
    pub(super) fn named(&mut self, path: &str, look: &str, name: &str) {
        let name = format!("<title>{}</title>", escape(name));
        self.put(format_args!(r#"<path d="{path}"{look}>{name}</path>"#));
    }

    /// Elements that belong together.
    pub(super) fn group(&mut self, class: &str, draw: impl FnOnce(&mut Canvas)) {
        self.put(format_args!(r#"<g class="{class}">"#));
        draw(self);
        self.put(format_args!("</g>"));
    }

    pub(super) fn text(&mut self, (x, y): Spot, text: &str, letters: &Letters) {
        let baseline = y + BASELINE * letters.size_px;
        self.write(&format!(r#"x="{x:.1}" y="{baseline:.1}""#), text, letters);
    }

    /// Text that reads upwards, its middle at a place.
    pub(super) fn text_upwards(&mut self, (x, y): Spot, text: &str, letters: Letters) {
        let baseline = x + BASELINE * letters.size_px;
        let place = format!(r#"transform="translate({baseline:.1} {y:.1}) rotate(-90)""#);
        self.write(&place, text, &letters.with(CENTRED));
    }

    fn write(&mut self, place: &str, text: &str, Letters { size_px, look }: &Letters) {
        if !text.is_empty() {
            let text = escape(text);
            self.put(format_args!(
                r#"<text {place} font-size="{size_px}"{look}>{text}</text>"#
            ));
        }
    }

    pub(super) fn finish(mut self) -> String {
        self.svg += "</svg>\n";
        self.svg
    }
}

/// Filled, with an opacity from 0 to 1.
pub(super) fn fill(colour: Colour, opacity: f64) -> String {
    match opacity < 1.0 {
        true => format!(r#" fill="{colour}" fill-opacity="{opacity:.2}""#),
        false => format!(r#" fill="{colour}""#),
    }
}

/// A line so wide (px); goes with a [`fill`], or with [`HOLLOW`].
pub(super) fn stroke(colour: Colour, width: f64) -> String {
    format!(r#" stroke="{colour}" stroke-width="{width}""#)
}

/// Not filled.
pub(super) const HOLLOW: &str = r#" fill="none""#;

/// The look of a line so wide (px).
pub(super) fn solid(colour: Colour, width: f64) -> String {
    HOLLOW.to_owned() + &stroke(colour, width)
}

/// The look of a dashed line so wide (px).
pub(super) fn dashed(colour: Colour, width: f64) -> String {
    solid(colour, width) + r#" stroke-dasharray="5 3""#
}

/// The path through some places; empty where there are none.
pub(super) fn polyline(spots: impl IntoIterator<Item = Spot>) -> String {
    let mut path = String::new();
    for (x, y) in spots {
        let verb = if path.is_empty() { 'M' } else { 'L' };
        path += &format!("{verb}{x:.1} {y:.1}");
    }
    path
}

/// The path around a rectangle, between two opposite corners.
pub(super) fn rectangle((left, top): Spot, (right, bottom): Spot) -> String {
    format!("M{left:.1} {top:.1}H{right:.1}V{bottom:.1}H{left:.1}z")
}

/// The path around a circle.
pub(super) fn circle((x, y): Spot, radius: f64) -> String {
    let (left, across) = (x - radius, 2.0 * radius);
    format!(
        "M{left:.1} {y:.1}a{radius:.1} {radius:.1} 0 1 0 {across:.1} 0a{radius:.1} {radius:.1} 0 1 0 -{across:.1} 0z"
    )
}
