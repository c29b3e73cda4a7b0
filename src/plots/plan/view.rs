//! The two views of a plan: where each world point lies on the sheet, and how the line of each
//! drone looks.

use nalgebra::Point3;
use planner::plan::Bounds;

use crate::plots::axes::Chart;
use crate::plots::canvas::{Area, HEAD, Spot, rectangle};
use crate::plots::colours::{Colour, SERIES, series_colour};

/// Largest drawing, both views together (px); chosen so that a README shows it without shrinking
/// much.
const WIDTH_PX: f64 = 880.0;
const HEIGHT_PX: f64 = 840.0;
const LEFT_PX: f64 = 64.0;
/// The caption of a view.
const TOP_PX: f64 = HEAD + 32.0;
/// Between the views: tick labels, axis title and the caption of the second.
const GAP_PX: f64 = 84.0;

/// How a drone's line looks: colour first; once the colours have gone round, dashes.
pub(super) fn line_style(index: usize) -> (Colour, &'static str) {
    let dashes = match index / SERIES.len() % 3 {
        0 => "",
        1 => r#" stroke-dasharray="6 3""#,
        _ => r#" stroke-dasharray="2 2.5""#,
    };
    (series_colour(index), dashes)
}

/// From where a view looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Eye {
    /// Down the z axis: x to the right, y up.
    Above,
    /// Along the y axis: x to the right, z up.
    Side,
}

/// One view: a chart with one scale across and upwards.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) eye: Eye,
    pub(super) chart: Chart,
    pub(super) px_per_m: f64,
}

impl View {
    /// A world point (m) on the sheet.
    pub(super) fn at(&self, point_m: &Point3<f64>) -> Spot {
        let is_above = self.eye == Eye::Above;
        let up_m = if is_above { point_m.y } else { point_m.z };
        self.chart.at((point_m.x, up_m))
    }

    /// The path around a box between two world points (m).
    pub(super) fn rectangle(&self, min_m: &Point3<f64>, max_m: &Point3<f64>) -> String {
        rectangle(self.at(min_m), self.at(max_m))
    }
}

/// Both views to one scale: the side view below the one from above, so that both share x; beside it
/// where the world is so tall that this gives the larger scale.
pub(super) fn views(bounds_m: &Bounds) -> [View; 2] {
    let size = bounds_m.max - bounds_m.min;
    let stacked = (WIDTH_PX / size.x).min((HEIGHT_PX - GAP_PX) / (size.y + size.z));
    let beside = ((WIDTH_PX - GAP_PX) / (2.0 * size.x)).min(HEIGHT_PX / size.y.max(size.z));
    let px_per_m = stacked.max(beside);
    let [width, above, side] = [size.x, size.y, size.z].map(|size_m| size_m * px_per_m);
    let below = (LEFT_PX, TOP_PX + above + GAP_PX);
    // Floors on one line.
    let right = LEFT_PX + width + GAP_PX;
    let floor = TOP_PX + above.max(side);
    let places = match stacked >= beside {
        true => [(LEFT_PX, TOP_PX), below],
        false => [(LEFT_PX, floor - above), (right, floor - side)],
    };
    let (low, high) = (&bounds_m.min, &bounds_m.max);
    let view = |eye, place, height, y| {
        let area = Area::new(place, (width, height));
        let x = (low.x, high.x);
        let chart = Chart { area, x, y };
        View {
            eye,
            chart,
            px_per_m,
        }
    };
    [
        view(Eye::Above, places[0], above, (low.y, high.y)),
        view(Eye::Side, places[1], side, (low.z, high.z)),
    ]
}
