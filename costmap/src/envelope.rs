//! The air that one airframe's wake brings to another's rotor discs, bounded from above, as a table.
//!
//! The mean over a receiver's discs is not axisymmetric (four rotors, four lobes), and several wakes
//! add as the root of the sum of squares at every disc point, before the mean is taken. Two bounds
//! make that additive and quick:
//!
//! ```text
//! mean_p √(Σᵢ Uᵢ(p)²)  ≤  √(Σᵢ gᵢ²),      gᵢ² = mean_p Uᵢ(p)²          (Jensen)
//! gᵢ(depth, radius)  =  max over the azimuth, and over all larger radii
//! ```
//!
//! so one number `g²` per wake and place adds up against one budget, `(limit · U_H)²`. Everything is
//! in units of the emitter's induced velocity: payload scales a table, it does not change it.
//!
//! A wake that effects have moved or reshaped is tabulated about its own axis, row by row: see `moved_jet`.

use nalgebra::Vector3;

/// Columns per row: chosen here, about a tenth of a half-width each.
const COLUMNS: usize = 48;
/// Below this a bound for a whole way will do, and the mean counts as nothing: chosen here, a
/// fiftieth of the induced velocity.
const WEAK_SQUARE: f64 = 4e-4;

/// Upper bound and typical value of the air that one wake brings to one receiver.
#[derive(Clone, Debug)]
pub struct Envelope {
    /// Depths between rows (m), ascending from 0.
    depths_m: Vec<f64>,
    rows: Vec<Row>,
    /// By depth in steps as high as the lowest row, the row above or there; empty where rows are moved.
    row_of_step: Vec<u16>,
    steps_per_m: f64,
    /// Squares over columns, row by row.
    squares: Vec<f32>,
    /// Means at the same places.
    means: Vec<f32>,
    reach_m: f64,
    column_depth_m: f64,
    column_radius_m: f64,
    /// Rows stand about axes of their own.
    moved: bool,
}

#[derive(Clone, Copy, Debug)]
struct Row {
    columns_per_m: f64,
    reach_m: f64,
    /// Its axis, seen from the emitter (m).
    centre_m: [f64; 2],
}

/// Air met along a way through one wake, in units of the emitter's induced velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Met {
    /// Bound on the mean square over the discs, anywhere on the way.
    pub peak_square: f64,
    /// Mean over the way of the mean over the discs.
    pub mean: f64,
}

impl Envelope {
    /// Beyond this horizontal distance the wake counts as still air (m).
    pub fn reach_m(&self) -> f64 {
        self.reach_m
    }

    /// The greatest mean square at this horizontal distance or beyond, at any depth.
    pub fn highest_square(&self, radius_m: f64) -> f64 {
        let square = |row: usize| {
            // The jet of this row may be that much nearer.
            let radius_m = (radius_m - self.aside_m(row).norm()).max(0.0);
            Some(f64::from(self.squares[self.cell(row, radius_m)?]))
        };
        (0..self.rows.len()).filter_map(square).fold(0.0, f64::max)
    }

    /// Whether a way relative to the emitter (receiver minus emitter, z up) enters the near-field
    /// column: 0 to 2.5 l below, radius to the rotor tips. Closed form.
    pub fn enters_column(&self, from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> bool {
        let Some((from_m, to_m)) = clip_depth(from_m, to_m, 0.0, self.column_depth_m) else {
            return false;
        };
        // A way that only touches the rotor plane or the column's floor is outside it.
        if from_m.z.max(to_m.z) <= -self.column_depth_m || from_m.z.min(to_m.z) >= 0.0 {
            return false;
        }
        nearest_radius_m(&from_m, &to_m) < self.column_radius_m
    }

    /// Air met along a straight way relative to the emitter (receiver minus emitter, z up), at
    /// constant speed.
    pub fn along(&self, from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> Met {
        if from_m.z >= 0.0 && to_m.z >= 0.0 {
            return Met::default();
        }
        if nearest_radius_m(from_m, to_m) >= self.reach_m {
            return Met::default();
        }
        let deepest_m = *self.depths_m.last().unwrap_or(&0.0);
        let Some((first_m, last_m)) = clip_depth(from_m, to_m, 0.0, deepest_m) else {
            return Met::default();
        };
        let peak_square = self.peak_square(&first_m, &last_m);
        if peak_square < WEAK_SQUARE {
            return Met {
                peak_square,
                mean: 0.0,
            };
        }
        let whole_m = (to_m - from_m).norm();
        let share = if whole_m > 0.0 {
            (last_m - first_m).norm() / whole_m
        } else {
            1.0
        };
        let lateral_m = (last_m.xy() - first_m.xy()).norm();
        let row = &self.rows[self.row_at(-first_m.z)];
        let pieces = (lateral_m * row.columns_per_m * 0.25)
            .ceil()
            .clamp(1.0, 16.0);
        let step_m = (last_m - first_m) / pieces;
        let mut met = Met::default();
        for piece in 0..pieces as usize {
            let a_m = first_m + step_m * piece as f64;
            let b_m = a_m + step_m;
            met.peak_square = met.peak_square.max(self.peak_square(&a_m, &b_m));
            let middle_m = (a_m + b_m) * 0.5;
            met.mean += self.mean_at(&middle_m);
        }
        met.mean *= share / pieces;
        met
    }

    /// Bound on the mean square at any place as far from the emitter's axis as a way and between its depths, at whatever bearing.
    pub fn highest_beyond(&self, from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> f64 {
        if !self.moved {
            return self.along(from_m, to_m).peak_square;
        }
        let radius_m = nearest_radius_m(from_m, to_m);
        let (first, last) = (
            self.row_at(-from_m.z.max(to_m.z)),
            self.row_at(-from_m.z.min(to_m.z)),
        );
        let square = |row: usize| {
            // The jet of this row may be that much nearer.
            let radius_m = (radius_m - self.aside_m(row).norm()).max(0.0);
            Some(f64::from(self.squares[self.cell(row, radius_m)?]))
        };
        (first..=last).filter_map(square).fold(0.0, f64::max)
    }

    /// Bound on the mean square between two depths (m), given how near any of the places there comes to a vertical axis (m, x and y from
    /// the emitter).
    pub(crate) fn highest_among(
        &self,
        depths_m: (f64, f64),
        nearest_m: impl Fn([f64; 2]) -> f64,
    ) -> f64 {
        if depths_m.1 <= 0.0 {
            return 0.0;
        }
        let rows = self.row_at(depths_m.0.max(0.0))..=self.row_at(depths_m.1);
        let below_m = nearest_m([0.0; 2]);
        if below_m >= self.reach_m {
            return 0.0;
        }
        let square = |row: usize| {
            let radius_m = if self.moved {
                nearest_m(self.rows[row].centre_m)
            } else {
                below_m
            };
            Some(f64::from(self.squares[self.cell(row, radius_m)?]))
        };
        rows.filter_map(square).fold(0.0, f64::max)
    }

    fn peak_square(&self, from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> f64 {
        let shallow_m = -from_m.z.max(to_m.z);
        let deep_m = -from_m.z.min(to_m.z);
        let (first, last) = (self.row_at(shallow_m), self.row_at(deep_m));
        if self.moved {
            let square = |row: usize| {
                let aside_m = self.aside_m(row);
                let radius_m = nearest_radius_m(&(from_m - aside_m), &(to_m - aside_m));
                Some(f64::from(self.squares[self.cell(row, radius_m)?]))
            };
            return (first..=last).filter_map(square).fold(0.0, f64::max);
        }
        let radius_m = nearest_radius_m(from_m, to_m);
        (first..=last)
            .filter_map(|row| Some(f64::from(self.squares[self.cell(row, radius_m)?])))
            .fold(0.0, f64::max)
    }

    fn mean_at(&self, at_m: &Vector3<f64>) -> f64 {
        let row = self.row_at(-at_m.z);
        let radius_m = (at_m - self.aside_m(row)).xy().norm();
        self.cell(row, radius_m)
            .map_or(0.0, |cell| f64::from(self.means[cell]))
    }

    /// The axis of a row, seen from the emitter (m).
    fn aside_m(&self, row: usize) -> Vector3<f64> {
        let [x_m, y_m] = self.rows[row].centre_m;
        Vector3::new(x_m, y_m, 0.0)
    }

    fn row_at(&self, depth_m: f64) -> usize {
        if self.moved {
            let above = self.depths_m.partition_point(|&edge_m| edge_m <= depth_m);
            return above.saturating_sub(1).min(self.rows.len() - 1);
        }
        let step = (depth_m * self.steps_per_m) as usize;
        let mut row = usize::from(self.row_of_step[step.min(self.row_of_step.len() - 1)]);
        while row + 1 < self.rows.len() && self.depths_m[row + 1] <= depth_m {
            row += 1;
        }
        row
    }

    fn cell(&self, row: usize, radius_m: f64) -> Option<usize> {
        if radius_m >= self.rows[row].reach_m {
            return None;
        }
        let column = (radius_m * self.rows[row].columns_per_m) as usize;
        Some(row * COLUMNS + column.min(COLUMNS - 1))
    }
}

/// The part of a way whose depth below the emitter lies in a range, both ends included.
pub(crate) fn clip_depth(
    from_m: &Vector3<f64>,
    to_m: &Vector3<f64>,
    shallow_m: f64,
    deep_m: f64,
) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let (from_depth_m, to_depth_m) = (-from_m.z, -to_m.z);
    let fall_m = to_depth_m - from_depth_m;
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    if fall_m.abs() < 1e-12 {
        if from_depth_m < shallow_m || from_depth_m > deep_m {
            return None;
        }
    } else {
        let a = (shallow_m - from_depth_m) / fall_m;
        let b = (deep_m - from_depth_m) / fall_m;
        first = first.max(a.min(b));
        last = last.min(a.max(b));
    }
    if first > last {
        return None;
    }
    let way_m = to_m - from_m;
    Some((from_m + way_m * first, from_m + way_m * last))
}

/// Smallest horizontal distance of a way from the vertical axis.
pub(crate) fn nearest_radius_m(from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> f64 {
    let (from_m, way_m) = (from_m.xy(), to_m.xy() - from_m.xy());
    let length_square = way_m.norm_squared();
    if length_square < 1e-18 {
        return from_m.norm();
    }
    let at = (-from_m.dot(&way_m) / length_square).clamp(0.0, 1.0);
    (from_m + way_m * at).norm()
}

mod sample;
mod tabulate;
#[cfg(test)]
mod tests;
