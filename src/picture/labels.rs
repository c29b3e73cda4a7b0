//! Names that do not cover one another: a label without a free place is left out.

use super::canvas::{Canvas, escape};
use super::view::View;

/// Advance of an average letter and height of a line, over the font size, for Helvetica and its kin.
const LETTER: f64 = 0.56;
const LINE: f64 = 1.1;

/// A rectangle on the sheet (px): left, top, right, bottom.
type Area = [f64; 4];

/// The labels of one view and what they must keep clear of.
pub(super) struct Labels {
    within: Area,
    taken: Vec<Area>,
}

impl Labels {
    pub(super) fn within(view: &View) -> Labels {
        let within = [
            view.left_px,
            view.top_px,
            view.left_px + view.width_px,
            view.top_px + view.height_px,
        ];
        Labels {
            within,
            taken: Vec::new(),
        }
    }

    /// Keeps a disc around a marker free.
    pub(super) fn keep_clear(&mut self, (x, y): (f64, f64), radius_px: f64) {
        self.taken
            .push([x - radius_px, y - radius_px, x + radius_px, y + radius_px]);
    }

    /// Writes beside a point: right, left, above, below, then the corners, where first there is
    /// room. Returns whether there was.
    pub(super) fn beside(
        &mut self,
        canvas: &mut Canvas,
        at: (f64, f64),
        gap_px: f64,
        style: &Style,
        text: &str,
    ) -> bool {
        let width = text.chars().count() as f64 * style.size_px * LETTER;
        let height = style.size_px * LINE;
        let (x, y) = at;
        let (right, left) = (x + gap_px, x - gap_px - width);
        let (over, under) = (y - gap_px - height, y + gap_px);
        let (middle_x, middle_y) = (x - width / 2.0, y - height / 2.0);
        let corners = [
            (right, middle_y),
            (left, middle_y),
            (middle_x, over),
            (middle_x, under),
            (right, over),
            (right, under),
            (left, over),
            (left, under),
        ];
        for (left, top) in corners {
            let area = [left, top, left + width, top + height];
            if !inside(&area, &self.within) || self.taken.iter().any(|other| overlap(&area, other))
            {
                continue;
            }
            self.taken.push(area);
            canvas.put(format_args!(
                r##"<text x="{left:.1}" y="{:.1}" font-size="{}" fill="{}" font-weight="{}" stroke="#fcfcfa" stroke-width="2.5" stroke-linejoin="round" paint-order="stroke">{}</text>"##,
                top + style.size_px * 0.88,
                style.size_px,
                style.colour,
                style.weight,
                escape(text)
            ));
            return true;
        }
        false
    }
}

/// How a label looks.
pub(super) struct Style {
    pub(super) size_px: f64,
    pub(super) colour: &'static str,
    pub(super) weight: &'static str,
}

fn inside(area: &Area, within: &Area) -> bool {
    area[0] >= within[0] && area[1] >= within[1] && area[2] <= within[2] && area[3] <= within[3]
}

fn overlap(a: &Area, b: &Area) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}
