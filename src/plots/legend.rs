//! What signs and colours mean: legends and colour bars.

use super::axes::{BAND, mark, mark_look};
use super::canvas::{Area, Canvas, Letters, MARGIN, TO_THE_LEFT, fill, rectangle, solid};
use super::colours::{Colour, INK, SOFT, Scale};
use crate::report::words::shortest;

/// Room of a sign, with the gap before its text; between entries; from line to line (px).
const SIGN: f64 = 30.0;
const GAP: f64 = 18.0;
pub(super) const LINE: f64 = 18.0;
/// Size of a legend's letters (px).
const LETTERS: f64 = 12.0;

/// One entry of a legend: a sign, as path and look around the middle of its left end, 22 px wide,
/// and what it means.
#[derive(Clone)]
pub(super) struct Entry {
    path: String,
    look: String,
    text: String,
}

impl Entry {
    pub(super) fn new(path: &str, look: &str, text: &str) -> Entry {
        let [path, look, text] = [path, look, text].map(str::to_owned);
        Entry { path, look, text }
    }

    pub(super) fn mark(series: usize, is_hollow: bool, text: &str) -> Entry {
        let path = mark((11.0, 0.0), series, 3.6);
        Entry::new(&path, &mark_look(series, is_hollow), text)
    }

    pub(super) fn line(look: &str, text: &str) -> Entry {
        Entry::new("M0 0H22", look, text)
    }

    pub(super) fn band(colour: Colour, text: &str) -> Entry {
        Entry::patch(&fill(colour, BAND), text)
    }

    pub(super) fn patch(look: &str, text: &str) -> Entry {
        Entry::new("M0 -6H22V6H0z", look, text)
    }

    /// A line of text without a sign.
    pub(super) fn text(text: &str) -> Entry {
        Entry::new("", "", text)
    }
}

/// A sheet with a title, a line and a legend below it, and what is left for the charts.
pub(super) fn sheet(size: (f64, f64), title: (&str, &str), entries: &[Entry]) -> (Canvas, Area) {
    let (mut canvas, below) = Canvas::new(size, title, "");
    let head = below.inset([MARGIN, 0.0, MARGIN, 0.0]);
    let taken = legend(&mut canvas, head, entries);
    (canvas, below.inset([0.0, taken + 8.0, 0.0, 0.0]))
}

/// Entries from the left to the right as far as they fit into a width, then on the next line; the
/// height they take (px).
pub(super) fn legend(canvas: &mut Canvas, area: Area, entries: &[Entry]) -> f64 {
    let letters = Letters::new(LETTERS, INK);
    let places = layout(area.width, entries);
    for (Entry { path, look, text }, &(right_px, line)) in entries.iter().zip(&places) {
        let (x, y) = (
            area.left + right_px,
            area.top + LINE * (f64::from(line) + 0.5),
        );
        let indent = if path.is_empty() { 0.0 } else { SIGN };
        let place = format!(r#"{look} transform="translate({x:.1} {y:.1})""#);
        canvas.path(path, &place);
        canvas.text((x + indent, y), text, &letters);
    }
    legend_height(area.width, entries)
}

/// The height that entries take in a width (px).
pub(super) fn legend_height(width_px: f64, entries: &[Entry]) -> f64 {
    let last = layout(width_px, entries)
        .last()
        .map_or(0, |&(_, line)| line + 1);
    LINE * f64::from(last)
}

/// How far to the right (px) and on which line each entry begins.
fn layout(width_px: f64, entries: &[Entry]) -> Vec<(f64, u32)> {
    let letters = Letters::new(LETTERS, INK);
    let (mut x, mut line) = (0.0, 0);
    let places = entries.iter().map(|Entry { path, text, .. }| {
        let indent = if path.is_empty() { 0.0 } else { SIGN };
        let width = indent + letters.width_px(text);
        if x > 0.0 && x + width > width_px {
            (x, line) = (0.0, line + 1);
        }
        let place = (x, line);
        x += width + GAP;
        place
    });
    places.collect()
}

/// The steps of a colour scale, upright, with their edges in numbers and a label above.
pub(super) fn colour_bar(canvas: &mut Canvas, area: Area, label: &str, scale: &Scale) {
    let letters = Letters::new(LETTERS, INK);
    canvas.text((area.left, area.top - 16.0), label, &letters);
    let edge = |step: usize| area.bottom() - area.height * step as f64 / scale.steps as f64;
    let right = area.left + 16.0;
    for step in 0..scale.steps {
        let path = rectangle((area.left, edge(step + 1)), (right, edge(step)));
        canvas.path(&path, &fill(scale.colour(step), 1.0));
    }
    let outline = rectangle((area.left, area.top), (right, area.bottom()));
    canvas.path(&outline, &solid(SOFT, 0.8));
    let letters = Letters::new(10.5, INK).with(TO_THE_LEFT);
    for step in 0..=scale.steps {
        let value = scale.edge(step);
        let is_signed = scale.low < 0.0 && value > 0.0;
        let sign = if is_signed { "+" } else { "" };
        let text = format!("{sign}{}", shortest(value, 3));
        canvas.text((right + 40.0, edge(step)), &text, &letters);
    }
}
