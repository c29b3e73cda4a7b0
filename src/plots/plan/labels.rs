//! Names that do not cover one another: a label without a free place is left out.

use super::canvas::{Canvas, escape};
use super::view::View;

/// Advance of an average letter and height of a line, over the font size, for Helvetica and its kin.
const LETTER: f64 = 0.56;
const LINE: f64 = 1.1;
/// What it costs to cover a line, a marker or another label; chosen so that no number of lines in
/// sight outweighs a marker, nor markers a label.
const COVERS_LINE: u32 = 1;
const COVERS_MARKER: u32 = 1_000;
const COVERS_LABEL: u32 = 100_000;

/// A rectangle on the sheet (px): left, top, right, bottom.
type Area = [f64; 4];
/// A place on the sheet (px).
pub(super) type Spot = (f64, f64);

/// The labels of one view and what they keep clear of; written last, above all else.
pub(super) struct Labels {
    within: Area,
    lines: Vec<(Spot, Spot)>,
    markers: Vec<Area>,
    placed: Vec<Area>,
    texts: Vec<String>,
}

/// How a label looks.
#[derive(Clone, Copy)]
pub(super) struct Style {
    pub(super) size_px: f64,
    pub(super) colour: &'static str,
    pub(super) weight: &'static str,
}

impl Labels {
    pub(super) fn within(view: &View) -> Labels {
        Labels {
            within: [
                view.left_px,
                view.top_px,
                view.left_px + view.width_px,
                view.top_px + view.height_px,
            ],
            lines: Vec::new(),
            markers: Vec::new(),
            placed: Vec::new(),
            texts: Vec::new(),
        }
    }

    /// Keeps a marker free.
    pub(super) fn keep_clear(&mut self, (x, y): Spot, radius_px: f64) {
        self.markers
            .push([x - radius_px, y - radius_px, x + radius_px, y + radius_px]);
    }

    /// Prefers places off this line.
    pub(super) fn avoid_line(&mut self, from: Spot, to: Spot) {
        self.lines.push((from, to));
    }

    /// Beside a place, where it covers least; left out where it would cover a marker or a label.
    pub(super) fn beside(&mut self, at: Spot, gap_px: f64, style: Style, text: &str) {
        if let Some((cost, area)) = self.best(at, gap_px, style, text)
            && cost < COVERS_MARKER
        {
            self.place(area, style, text);
        }
    }

    /// Beside a place, whatever it covers.
    pub(super) fn beside_at_any_price(&mut self, at: Spot, gap_px: f64, style: Style, text: &str) {
        if let Some((_, area)) = self.best(at, gap_px, style, text) {
            self.place(area, style, text);
        }
    }

    /// Centred on a place, whatever it covers.
    pub(super) fn centred(&mut self, (x, y): Spot, style: Style, text: &str) {
        let (width, height) = extent_px(style, text);
        self.place(
            [
                x - width / 2.0,
                y - height / 2.0,
                x + width / 2.0,
                y + height / 2.0,
            ],
            style,
            text,
        );
    }

    /// Puts all labels on the sheet.
    pub(super) fn write(self, canvas: &mut Canvas) {
        canvas.group("labels", |canvas| {
            for text in &self.texts {
                canvas.put(format_args!("{text}"));
            }
        });
    }

    /// Right, left, above, below, then the corners: the cheapest inside the view, the first of equals.
    fn best(&self, (x, y): Spot, gap_px: f64, style: Style, text: &str) -> Option<(u32, Area)> {
        let (width, height) = extent_px(style, text);
        let (right, left) = (x + gap_px, x - gap_px - width);
        let (over, under) = (y - gap_px - height, y + gap_px);
        let (middle_x, middle_y) = (x - width / 2.0, y - height / 2.0);
        // Corners may come closer: their nearest point is on the diagonal.
        let (high, low) = (over + 0.4 * gap_px, under - 0.4 * gap_px);
        [
            (right, middle_y),
            (left, middle_y),
            (middle_x, over),
            (middle_x, under),
            (right, high),
            (right, low),
            (left, high),
            (left, low),
        ]
        .into_iter()
        .map(|(left, top)| [left, top, left + width, top + height])
        .filter(|area| inside(area, &self.within))
        .map(|area| (self.cost(&area), area))
        .min_by_key(|(cost, _)| *cost)
    }

    fn cost(&self, area: &Area) -> u32 {
        let covered =
            |areas: &[Area]| areas.iter().filter(|other| overlap(area, other)).count() as u32;
        let crossed = self
            .lines
            .iter()
            .filter(|(from, to)| crosses(*from, *to, area))
            .count() as u32;
        COVERS_LABEL * covered(&self.placed)
            + COVERS_MARKER * covered(&self.markers)
            + COVERS_LINE * crossed.min(COVERS_MARKER - 1)
    }

    fn place(&mut self, area: Area, style: Style, text: &str) {
        let Style {
            size_px,
            colour,
            weight,
        } = style;
        self.texts.push(format!(
            r##"<text x="{:.1}" y="{:.1}" font-size="{size_px}" fill="{colour}" font-weight="{weight}" stroke="#fcfcfa" stroke-width="2.5" stroke-linejoin="round" paint-order="stroke">{}</text>"##,
            area[0],
            area[1] + size_px * 0.88,
            escape(text)
        ));
        self.placed.push(area);
    }
}

fn extent_px(style: Style, text: &str) -> (f64, f64) {
    (
        text.chars().count() as f64 * style.size_px * LETTER,
        style.size_px * LINE,
    )
}

fn inside(area: &Area, within: &Area) -> bool {
    area[0] >= within[0] && area[1] >= within[1] && area[2] <= within[2] && area[3] <= within[3]
}

fn overlap(a: &Area, b: &Area) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Whether a straight line passes through an area: the share of it inside every side's half-plane.
fn crosses(from: Spot, to: Spot, area: &Area) -> bool {
    let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
    for (start, way, low, high) in [
        (from.0, to.0 - from.0, area[0], area[2]),
        (from.1, to.1 - from.1, area[1], area[3]),
    ] {
        if way == 0.0 {
            if start <= low || start >= high {
                return false;
            }
            continue;
        }
        let (one, other) = ((low - start) / way, (high - start) / way);
        enters = enters.max(one.min(other));
        leaves = leaves.min(one.max(other));
    }
    enters < leaves
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_crosses_an_area_only_where_it_enters_it() {
        let area = [10.0, 10.0, 20.0, 20.0];
        assert!(crosses((0.0, 0.0), (30.0, 30.0), &area));
        assert!(crosses((12.0, 12.0), (13.0, 12.0), &area));
        assert!(!crosses((0.0, 0.0), (9.0, 30.0), &area));
        assert!(!crosses((0.0, 0.0), (5.0, 5.0), &area));
    }
}
