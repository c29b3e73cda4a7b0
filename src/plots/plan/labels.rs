//! Names that do not cover one another: a label without a free place is left out.

use crate::plots::canvas::{Area, CENTRED, Canvas, Letters, Spot};

/// Height of a line over the font's size.
const LINE: f64 = 1.1;
/// What it costs to cover a line, a marker or another label; chosen so that no number of lines in
/// sight outweighs a marker, nor markers a label.
const COVERS_LINE: u32 = 1;
const COVERS_MARKER: u32 = 1_000;
const COVERS_LABEL: u32 = 100_000;

/// How a label looks, and what it says.
pub(super) type Label<'a> = (Letters, &'a str);

/// The labels of one view and what they keep clear of; written last, above all else.
pub(super) struct Labels {
    within: Area,
    lines: Vec<(Spot, Spot)>,
    markers: Vec<Area>,
    placed: Vec<(Area, Letters, String)>,
}

impl Labels {
    pub(super) fn within(within: Area) -> Labels {
        Labels {
            within,
            lines: Vec::new(),
            markers: Vec::new(),
            placed: Vec::new(),
        }
    }

    /// Keeps a marker free.
    pub(super) fn keep_clear(&mut self, (x, y): Spot, radius_px: f64) {
        let (corner, side_px) = ((x - radius_px, y - radius_px), 2.0 * radius_px);
        self.markers.push(Area::new(corner, (side_px, side_px)));
    }

    /// Prefers places off the line through some spots.
    pub(super) fn avoid_line(&mut self, spots: &[Spot]) {
        let pieces = spots.windows(2).map(|pair| (pair[0], pair[1]));
        self.lines.extend(pieces);
    }

    /// Beside a place, where it covers least; unless it `must` be there, left out where it would
    /// cover a marker or a label.
    pub(super) fn beside(&mut self, at: Spot, gap_px: f64, (letters, text): Label, must: bool) {
        if let Some((cost, area)) = self.best(at, gap_px, extent_px(&letters, text))
            && (must || cost < COVERS_MARKER)
        {
            self.placed.push((area, letters, text.to_owned()));
        }
    }

    /// Centred on a place, whatever it covers.
    pub(super) fn centred(&mut self, (x, y): Spot, (letters, text): Label) {
        let (width, height) = extent_px(&letters, text);
        let corner = (x - width / 2.0, y - height / 2.0);
        let area = Area::new(corner, (width, height));
        self.placed.push((area, letters, text.to_owned()));
    }

    /// Puts all labels on the sheet.
    pub(super) fn write(self, canvas: &mut Canvas) {
        canvas.group("labels", |canvas| {
            for (area, letters, text) in self.placed {
                let middle = (area.left + area.width / 2.0, area.top + area.height / 2.0);
                canvas.text(middle, &text, &letters.with_halo().with(CENTRED));
            }
        });
    }

    /// Right, left, above, below, then the corners: the cheapest inside the view, the first of
    /// equals.
    fn best(&self, (x, y): Spot, gap_px: f64, size: (f64, f64)) -> Option<(u32, Area)> {
        let (width, height) = size;
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
        .map(|corner| Area::new(corner, size))
        .filter(|area| self.within.contains(area))
        .map(|area| (self.cost(&area), area))
        .min_by_key(|(cost, _)| *cost)
    }

    fn cost(&self, area: &Area) -> u32 {
        let is_covered = |other: &&Area| area.overlaps(other);
        let labels = self.placed.iter().map(|(other, ..)| other);
        let labels = labels.filter(is_covered);
        let markers = self.markers.iter().filter(is_covered);
        let is_crossed = |(from, to): &&(Spot, Spot)| crosses(*from, *to, area);
        let lines = self.lines.iter().filter(is_crossed);
        COVERS_LABEL * labels.count() as u32
            + COVERS_MARKER * markers.count() as u32
            + COVERS_LINE * (lines.count() as u32).min(COVERS_MARKER - 1)
    }
}

fn extent_px(letters: &Letters, text: &str) -> (f64, f64) {
    (letters.width_px(text), letters.size_px * LINE)
}

/// Whether a straight line passes through an area: the share of it inside every side's half-plane.
fn crosses(from: Spot, to: Spot, area: &Area) -> bool {
    let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
    for (start, length, low, high) in [
        (from.0, to.0 - from.0, area.left, area.right()),
        (from.1, to.1 - from.1, area.top, area.bottom()),
    ] {
        if length == 0.0 {
            if start <= low || start >= high {
                return false;
            }
            continue;
        }
        let (one, other) = ((low - start) / length, (high - start) / length);
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
        let area = Area::new((10.0, 10.0), (10.0, 10.0));
        assert!(crosses((0.0, 0.0), (30.0, 30.0), &area));
        assert!(crosses((12.0, 12.0), (13.0, 12.0), &area));
        assert!(!crosses((0.0, 0.0), (9.0, 30.0), &area));
        assert!(!crosses((0.0, 0.0), (5.0, 5.0), &area));
    }
}
