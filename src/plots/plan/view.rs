//! Two views to one scale, and where they lie on the sheet.

use nalgebra::Point3;
use planner::plan::Corners;

/// Largest drawing, both views together (px); chosen so that a README shows it without shrinking much.
const WIDTH_PX: f64 = 880.0;
const HEIGHT_PX: f64 = 840.0;
const LEFT_PX: f64 = 64.0;
const TOP_PX: f64 = 104.0;
const RIGHT_PX: f64 = 36.0;
/// Between the views: tick labels, axis title and the caption of the second.
const GAP_PX: f64 = 84.0;
/// Tick labels, axis title and the legend.
const BOTTOM_PX: f64 = 128.0;
/// Title and legend want this much, however narrow the drawing.
const NARROWEST_SHEET_PX: f64 = 760.0;

/// From where a view looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Eye {
    /// Down the z axis: x to the right, y up.
    Above,
    /// Along the y axis: x to the right, z up.
    Side,
}

/// One view: a rectangle of the sheet and its scale.
#[derive(Clone, Debug)]
pub(super) struct View {
    pub(super) eye: Eye,
    pub(super) left_px: f64,
    pub(super) top_px: f64,
    pub(super) width_px: f64,
    pub(super) height_px: f64,
    pub(super) px_per_m: f64,
    /// World bounds (m).
    pub(super) bounds_m: Corners,
}

impl View {
    /// A world point on the sheet (px).
    pub(super) fn at(&self, point_m: &Point3<f64>) -> (f64, f64) {
        let low = &self.bounds_m.min;
        let up_m = self.up(point_m) - self.up(low);
        (
            self.left_px + (point_m.x - low.x) * self.px_per_m,
            self.top_px + self.height_px - up_m * self.px_per_m,
        )
    }

    /// The coordinate that this view draws upwards (m).
    pub(super) fn up(&self, point_m: &Point3<f64>) -> f64 {
        match self.eye {
            Eye::Above => point_m.y,
            Eye::Side => point_m.z,
        }
    }
}

/// The sheet and its two views.
pub(super) struct Layout {
    pub(super) width_px: f64,
    pub(super) height_px: f64,
    pub(super) above: View,
    pub(super) side: View,
}

impl Layout {
    /// The side view below the one from above, so that both share x; beside it where the world is
    /// so tall that this gives the larger scale.
    pub(super) fn of(bounds_m: &Corners) -> Layout {
        let size = bounds_m.max - bounds_m.min;
        let stacked = (WIDTH_PX / size.x).min((HEIGHT_PX - GAP_PX) / (size.y + size.z));
        let beside = ((WIDTH_PX - GAP_PX) / (2.0 * size.x)).min(HEIGHT_PX / size.y.max(size.z));
        let px_per_m = stacked.max(beside);
        let view = |eye, left_px, top_px, up_m: f64| View {
            eye,
            left_px,
            top_px,
            width_px: size.x * px_per_m,
            height_px: up_m * px_per_m,
            px_per_m,
            bounds_m: *bounds_m,
        };
        let mut above = view(Eye::Above, LEFT_PX, TOP_PX, size.y);
        let mut side = view(Eye::Side, LEFT_PX, TOP_PX, size.z);
        if stacked >= beside {
            side.top_px += above.height_px + GAP_PX;
        } else {
            side.left_px += above.width_px + GAP_PX;
            // Floors on one line.
            above.top_px += (side.height_px - above.height_px).max(0.0);
            side.top_px += (above.height_px - side.height_px).max(0.0);
        }
        Layout {
            width_px: (side.left_px + side.width_px + RIGHT_PX).max(NARROWEST_SHEET_PX),
            height_px: side.top_px + side.height_px + BOTTOM_PX,
            above,
            side,
        }
    }
}
