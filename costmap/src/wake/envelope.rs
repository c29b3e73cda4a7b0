//! The air that one airframe's wake brings to another's rotor discs, bounded from above, as a
//! table.
//!
//! The mean over a receiver's discs is not axisymmetric (four rotors, four lobes), and several
//! wakes add as the root of the sum of squares at every disc point, before the mean is taken. Two
//! bounds make that additive and quick:
//!
//! ```text
//! mean_p √(Σᵢ Uᵢ(p)²)  ≤  √(Σᵢ gᵢ²),      gᵢ² = mean_p Uᵢ(p)²          (Jensen)
//! gᵢ(depth, radius)  =  max over the azimuth, and over all larger radii
//! ```
//!
//! so one number `g²` per wake and place adds up against one budget, `(limit · U_H)²`. Everything
//! is in units of the emitter's induced velocity: payload scales a table, it does not change it.
//!
//! A wake that effects have moved or reshaped is tabulated about its own axis, row by row: see
//! `moved_jet`.

use airflow::{DiscPoints, Wake};
use nalgebra::Vector3;
use rayon::prelude::*;

use super::moved_jet::{MovedSlab, slabs_m};
use crate::volumes::downwash::{Section, clip_depth};
use crate::volumes::relative::nearest_radius_m;

/// Columns per row over a receiver's discs: chosen here, about a tenth of a half-width each.
const COLUMNS: usize = 48;
/// The same at single points, where nothing evens out what a column misses and few tables are made:
/// chosen here, a fortieth of a half-width.
const COLUMNS_AT_POINTS: usize = 192;
/// Points of the discs that are looked at together, chosen here: a quadrotor's 28 fit.
const CHUNK: usize = 32;
/// Azimuths over which means are taken, or more: chosen here, means are not bounds.
const MEAN_AZIMUTHS: usize = 5;
/// Below this a bound for a whole path will do, and the mean counts as nothing: chosen here, a
/// fiftieth of the induced velocity.
const WEAK_SQUARE: f64 = 4e-4;
/// Rows this close (in motor distances) down to [`FINE_UNTIL_L`]: chosen here, lobes merge within
/// 1.5 l.
const FINE_STEP_L: f64 = 0.125;
/// Where rows begin to grow with the jet (in motor distances): chosen here, below the near field.
const FINE_UNTIL_L: f64 = 3.0;
/// Growth of a row over the distance to the virtual origin, below that: chosen here, 4 % of decay a
/// row.
const ROW_GROWTH: f64 = 0.04;
/// The same at single points: chosen here, in the tail of a jet each row is 3 % above the next.
const ROW_GROWTH_AT_POINTS: f64 = 0.01;
/// What sampling may miss between nodes, on `g²`. Chosen here: a test compares random places.
const SLACK: f64 = 1.02;
/// The same for moved jets, between the bearings and depths looked at as well: chosen here.
const MOVED_SLACK: f64 = 1.05;

/// Upper bound and typical value of the air that one wake brings to one receiver.
#[derive(Clone, Debug)]
pub struct Envelope {
    /// Depths between rows (m), ascending from 0.
    depths_m: Vec<f64>,
    rows: Vec<EnvelopeRow>,
    /// By depth in steps as high as the lowest row, the row above or there; empty where rows are
    /// moved.
    row_of_step: Vec<u16>,
    steps_per_m: f64,
    /// Columns per row.
    columns: usize,
    /// Squares over columns, row by row.
    squares: Vec<f32>,
    /// Means at the same places.
    means: Vec<f32>,
    reach_m: f64,
    /// Rows stand about axes of their own.
    moved: bool,
    /// How much farther off than it seems a receiver may be in any direction (m).
    relative_deviation_m: f64,
}

#[derive(Clone, Copy, Debug)]
struct EnvelopeRow {
    columns_per_m: f64,
    reach_m: f64,
    /// Its axis, seen from the emitter (m).
    centre_m: [f64; 2],
}

/// Exposure along a path through one wake, in units of the emitter's induced velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathExposure {
    /// Bound on the mean square over the discs, anywhere on the path.
    pub peak_square: f64,
    /// Mean over the path of the mean over the discs.
    pub mean: f64,
}

impl Envelope {
    /// Beyond this horizontal distance the wake counts as still air (m).
    pub fn reach_m(&self) -> f64 {
        self.reach_m
    }

    /// The same for a receiver that may be so far (m) from where it seems, in every direction.
    #[must_use]
    pub(crate) fn grown(mut self, by_m: f64) -> Envelope {
        if by_m == 0.0 {
            return self;
        }
        let depths_m = &self.depths_m;
        let nearby = |row: usize| {
            let (above_m, below_m) = (depths_m[row] - by_m, depths_m[row + 1] + by_m);
            (0..depths_m.len() - 1)
                .filter(move |&it| depths_m[it] < below_m && depths_m[it + 1] > above_m)
        };
        let grown = |row: usize| {
            let of = |other: usize| {
                let aside_m = (self.aside_m(other) - self.aside_m(row)).norm();
                self.rows[other].reach_m + aside_m
            };
            let reach_m = nearby(row).map(of).fold(0.0, f64::max) + by_m;
            EnvelopeRow {
                reach_m,
                columns_per_m: self.columns as f64 / reach_m.max(1e-9),
                ..self.rows[row]
            }
        };
        let rows: Vec<EnvelopeRow> = (0..self.rows.len()).map(grown).collect();
        let square = |row: usize, column: usize| {
            let radius_m = column as f64 / rows[row].columns_per_m;
            let of = |other: usize| {
                // Its jet may be that much nearer.
                let aside_m = (self.aside_m(other) - self.aside_m(row)).norm();
                let radius_m = (radius_m - by_m - aside_m).max(0.0);
                Some(self.squares[self.cell(other, radius_m)?])
            };
            nearby(row).filter_map(of).fold(0.0, f32::max)
        };
        let mean = |row: usize, column: usize| {
            let radius_m = (column as f64 + 0.5) / rows[row].columns_per_m;
            self.cell(row, radius_m)
                .map_or(0.0, |cell| self.means[cell])
        };
        let cells = || (0..rows.len()).flat_map(|row| (0..self.columns).map(move |it| (row, it)));
        let squares = cells().map(|(row, column)| square(row, column)).collect();
        let means = cells().map(|(row, column)| mean(row, column)).collect();
        let of_row = |row: &EnvelopeRow| row.reach_m + row.centre_m[0].hypot(row.centre_m[1]);
        self.reach_m = rows.iter().map(of_row).fold(0.0, f64::max);
        (self.squares, self.means) = (squares, means);
        (self.rows, self.relative_deviation_m) = (rows, self.relative_deviation_m + by_m);
        self
    }

    /// The greatest mean square at this horizontal distance or beyond, at any depth.
    pub(crate) fn highest_square(&self, radius_m: f64) -> f64 {
        let square = |row| self.square_at_any_bearing(row, radius_m);
        (0..self.rows.len()).filter_map(square).fold(0.0, f64::max)
    }

    /// Exposure along a straight path relative to the emitter (receiver minus emitter, z up), at
    /// constant speed.
    pub fn along(&self, from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> PathExposure {
        if from_m.z >= self.relative_deviation_m && to_m.z >= self.relative_deviation_m {
            return PathExposure::default();
        }
        if nearest_radius_m(from_m, to_m) >= self.reach_m {
            return PathExposure::default();
        }
        let deepest_m = *self.depths_m.last().unwrap_or(&0.0);
        let depths_m = [
            -self.relative_deviation_m,
            deepest_m + self.relative_deviation_m,
        ];
        let Some((first_m, last_m)) = clip_depth(from_m, to_m, depths_m[0], depths_m[1]) else {
            return PathExposure::default();
        };
        let peak_square = self.peak_square(&first_m, &last_m);
        if peak_square < WEAK_SQUARE {
            return PathExposure {
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
        let mut exposure = PathExposure::default();
        for piece in 0..pieces as usize {
            let a_m = first_m + step_m * piece as f64;
            let b_m = a_m + step_m;
            exposure.peak_square = exposure.peak_square.max(self.peak_square(&a_m, &b_m));
            let middle_m = (a_m + b_m) * 0.5;
            exposure.mean += self.mean_at(&middle_m);
        }
        exposure.mean *= share / pieces;
        exposure
    }

    /// The iso-exposure volume: outside of it no place has a mean square above `square` (in units
    /// of the emitter's induced velocity, squared).
    ///
    /// Upright cylinders about the vertical through the emitter, from above: one for each range of
    /// depths over which the table's edge stays where it is.
    pub(crate) fn iso_exposure(&self, square: f64) -> Vec<Section> {
        let mut sections: Vec<Section> = Vec::new();
        for (row, depths_m) in self.depths_m.windows(2).enumerate() {
            let squares = &self.squares[row * self.columns..(row + 1) * self.columns];
            let Some(last) = squares.iter().rposition(|&it| f64::from(it) > square) else {
                continue;
            };
            let edge_m = (last + 1) as f64 / self.rows[row].columns_per_m;
            let radius_m = edge_m + self.aside_m(row).norm();
            match sections.last_mut() {
                Some(upper) if upper.to_depth_m == depths_m[0] && upper.to_radius_m == radius_m => {
                    upper.to_depth_m = depths_m[1];
                }
                _ => sections.push(Section {
                    from_depth_m: depths_m[0],
                    to_depth_m: depths_m[1],
                    from_radius_m: radius_m,
                    to_radius_m: radius_m,
                }),
            }
        }
        sections
    }

    /// Whether it is the same at every bearing.
    pub(crate) fn is_round(&self) -> bool {
        !self.moved
    }

    /// Bound on the mean square at any place as far from the emitter's axis as a path and between
    /// its depths, at any bearing.
    pub(crate) fn highest_beyond(&self, from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> f64 {
        if !self.moved {
            return self.along(from_m, to_m).peak_square;
        }
        let radius_m = nearest_radius_m(from_m, to_m);
        let (first, last) = (
            self.row_at(-from_m.z.max(to_m.z)),
            self.row_at(-from_m.z.min(to_m.z)),
        );
        let square = |row| self.square_at_any_bearing(row, radius_m);
        (first..=last).filter_map(square).fold(0.0, f64::max)
    }

    /// Bound on the mean square between two depths (m), given how near any of the places there
    /// comes to a vertical axis (m, x and y from the emitter).
    pub(crate) fn highest_among(
        &self,
        depths_m: [f64; 2],
        nearest_m: impl Fn([f64; 2]) -> f64,
    ) -> f64 {
        if depths_m[1] <= -self.relative_deviation_m {
            return 0.0;
        }
        let rows = self.row_at(depths_m[0].max(0.0))..=self.row_at(depths_m[1]);
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
            self.square(row, radius_m)
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
                self.square(row, radius_m)
            };
            return (first..=last).filter_map(square).fold(0.0, f64::max);
        }
        let radius_m = nearest_radius_m(from_m, to_m);
        (first..=last)
            .filter_map(|row| self.square(row, radius_m))
            .fold(0.0, f64::max)
    }

    /// Bound on the mean square in a row so far from its axis (m), or farther.
    fn square(&self, row: usize, radius_m: f64) -> Option<f64> {
        Some(f64::from(self.squares[self.cell(row, radius_m)?]))
    }

    /// The same so far from the vertical through the emitter: the jet may be that much nearer.
    fn square_at_any_bearing(&self, row: usize, radius_m: f64) -> Option<f64> {
        self.square(row, (radius_m - self.aside_m(row).norm()).max(0.0))
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
        Some(row * self.columns + column.min(self.columns - 1))
    }

    /// Tabulates `wake` (any mass) over receivers with these disc points, from the rotor plane to
    /// `deepest_m`. Radii where the mean square falls below `negligible_square` (of the emitter's
    /// induced velocity) count as still air.
    pub fn new(
        wake: &Wake,
        discs: &DiscPoints,
        deepest_m: f64,
        negligible_square: f64,
    ) -> Envelope {
        let one = Envelope::of_each(wake, &[(discs, negligible_square)], deepest_m);
        one.into_iter().next().expect("one for each receiver")
    }

    /// The same for several receivers, each with what counts as still air to it.
    fn of_each(wake: &Wake, receivers: &[(&DiscPoints, f64)], deepest_m: f64) -> Vec<Envelope> {
        if wake.is_shaped() {
            return Envelope::of_moved(wake, receivers, deepest_m);
        }
        let of_one = |&(discs, still): &(&DiscPoints, f64)| {
            Envelope::of_hover_jet(wake, discs, deepest_m, still)
        };
        receivers.iter().map(of_one).collect()
    }

    fn of_hover_jet(
        wake: &Wake,
        discs: &DiscPoints,
        deepest_m: f64,
        negligible_square: f64,
    ) -> Envelope {
        let l = wake.motor_distance_m();
        let (columns, growth) = match discs.offsets_m.len() {
            1 => (COLUMNS_AT_POINTS, ROW_GROWTH_AT_POINTS),
            _ => (COLUMNS, ROW_GROWTH),
        };
        let depths_m = row_depths_m(l, deepest_m, growth);
        let points = Points::new(discs);
        let samples: Vec<(f64, Vec<EnvelopeSample>)> = depths_m
            .par_iter()
            .map(|&depth_m| {
                let depth_m = depth_m.max(1e-9);
                let diagonal = Diagonal::new(wake, depth_m, negligible_square);
                // Nearer than its outermost disc points a large receiver may straddle a jet and
                // meet less.
                let from_m = wake.half_width_m(depth_m) + farthest_m(discs);
                let sampling = Sampling {
                    azimuths: azimuths(diagonal.width_m, discs),
                    columns,
                    negligible_square,
                };
                let over_discs = |at_m, with_mean| match with_mean {
                    true => diagonal.over_discs(&points, at_m),
                    false => (diagonal.square_over_discs(&points, at_m), 0.0),
                };
                sample_row(over_discs, from_m, &sampling)
            })
            .collect();
        let mut envelope = Envelope {
            columns,
            rows: Vec::with_capacity(depths_m.len() - 1),
            row_of_step: rows_of_steps(&depths_m, FINE_STEP_L * l),
            steps_per_m: 1.0 / (FINE_STEP_L * l),
            squares: Vec::new(),
            means: Vec::new(),
            reach_m: 0.0,
            depths_m,
            moved: false,
            relative_deviation_m: 0.0,
        };
        for pair in samples.windows(2) {
            envelope.push_row(&pair[0], &pair[1], SLACK, [0.0; 2]);
        }
        envelope
    }

    /// The same of one jet that effects have moved, for several receivers, each with what counts as
    /// still air to it: what it is like, which takes longest, is worked out once for all of them.
    fn of_moved(wake: &Wake, receivers: &[(&DiscPoints, f64)], deepest_m: f64) -> Vec<Envelope> {
        let depths_m = row_depths_m(wake.motor_distance_m(), deepest_m, ROW_GROWTH);
        let negligible = receivers.iter().map(|(_, square)| *square);
        let depths_m = slabs_m(wake, &depths_m, negligible.fold(f64::INFINITY, f64::min));
        let samplings = receivers
            .iter()
            .map(|&(discs, negligible_square)| Sampling {
                azimuths: azimuths(wake.tip_radius_m(), discs),
                columns: COLUMNS,
                negligible_square,
            });
        let samplings: Vec<_> = samplings.collect();
        let slabs: Vec<_> = depths_m
            .par_windows(2)
            .map(|ends_m| {
                let mut slab = MovedSlab::new(wake, ends_m[0], ends_m[1]);
                let rows = receivers.iter().zip(&samplings);
                let rows = rows.map(|(&(discs, _), sampling)| {
                    let from_m = slab.spread_m() + farthest_m(discs);
                    let mut speed = |radius_m: f64| slab.speed(radius_m);
                    let over_discs = |at_m, _| over_discs(&mut speed, discs, at_m);
                    sample_row(over_discs, from_m, sampling)
                });
                (rows.collect::<Vec<_>>(), slab.centre_m)
            })
            .collect();
        let envelope = |(receiver, &(_, negligible_square)): (usize, &(&DiscPoints, f64))| {
            let mut envelope = Envelope {
                columns: COLUMNS,
                rows: Vec::with_capacity(slabs.len()),
                squares: Vec::new(),
                means: Vec::new(),
                reach_m: 0.0,
                // Slabs may be thinner than any step.
                row_of_step: Vec::new(),
                steps_per_m: 0.0,
                depths_m: depths_m.clone(),
                moved: true,
                relative_deviation_m: 0.0,
            };
            for (rows, centre_m) in &slabs {
                let row = &rows[receiver];
                // Jets that the wind has laid down are weak long before they end, and far away by
                // then.
                if MOVED_SLACK * row.1[0].square <= negligible_square {
                    envelope.push_still_row();
                } else {
                    envelope.push_row(row, row, MOVED_SLACK, *centre_m);
                }
            }
            envelope
        };
        receivers.iter().enumerate().map(envelope).collect()
    }

    /// A row of still air, which takes no room.
    fn push_still_row(&mut self) {
        self.squares.extend(std::iter::repeat_n(0.0, self.columns));
        self.means.extend(std::iter::repeat_n(0.0, self.columns));
        self.rows.push(EnvelopeRow {
            columns_per_m: 0.0,
            reach_m: 0.0,
            centre_m: [0.0; 2],
        });
    }

    fn push_row(
        &mut self,
        upper: &(f64, Vec<EnvelopeSample>),
        lower: &(f64, Vec<EnvelopeSample>),
        slack: f64,
        centre_m: [f64; 2],
    ) {
        let reach_m = upper.0.max(lower.0);
        let columns_per_m = self.columns as f64 / reach_m.max(1e-9);
        for column in 0..self.columns {
            let radius_m = column as f64 / columns_per_m;
            let (above, below) = (at_radius(upper, radius_m), at_radius(lower, radius_m));
            let middle_m = radius_m + 0.5 / columns_per_m;
            let mean = 0.5 * (at_middle(upper, middle_m) + at_middle(lower, middle_m));
            self.squares
                .push((slack * above.square.max(below.square)) as f32);
            self.means.push(mean as f32);
        }
        self.rows.push(EnvelopeRow {
            columns_per_m,
            reach_m,
            centre_m,
        });
        self.reach_m = self.reach_m.max(reach_m + centre_m[0].hypot(centre_m[1]));
    }
}

fn rows_of_steps(depths_m: &[f64], step_m: f64) -> Vec<u16> {
    let deepest_m = depths_m.last().copied().unwrap_or(0.0);
    let rows = depths_m.len().saturating_sub(2);
    (0..=(deepest_m / step_m) as usize)
        .map(|step| {
            // A part in 10⁹ keeps a division's rounding from skipping a row.
            let depth_m = step as f64 * step_m * (1.0 - 1e-9);
            let above = depths_m.partition_point(|&edge_m| edge_m <= depth_m);
            above.saturating_sub(1).min(rows) as u16
        })
        .collect()
}

fn row_depths_m(l: f64, deepest_m: f64, growth: f64) -> Vec<f64> {
    let mut depths_m = vec![0.0];
    let mut depth_l = 0.0;
    while depth_l * l < deepest_m {
        depth_l += if depth_l < FINE_UNTIL_L {
            FINE_STEP_L
        } else {
            // The paper's virtual origin, 5.8 l above the rotors, sets the scale; any jet's is
            // near.
            growth * (depth_l + 5.8)
        };
        depths_m.push(depth_l * l);
    }
    if depths_m.len() < 2 {
        depths_m.push(FINE_STEP_L * l);
    }
    depths_m
}

#[derive(Clone, Copy, Debug, Default)]
struct EnvelopeSample {
    /// Greatest mean square over azimuth, at this radius or any larger one.
    square: f64,
    /// Mean over azimuth of the mean over the discs.
    mean: f64,
}

/// Four rotors on the diagonals with six points around each hub look alike mirrored along and
/// across: a quarter turn is all. The farther the receiver's rotors are out, in widths of the
/// emitter's jet (m), the finer the lobes.
fn azimuths(width_m: f64, discs: &DiscPoints) -> Vec<(f64, f64)> {
    // Chosen here, so that the comparison with random places below holds for the least alike of the
    // presets.
    let larger = (farthest_m(discs) / width_m - 1.0).max(0.0);
    let steps = 4 + (12.0 * larger).ceil() as u32;
    let quarter = std::f64::consts::FRAC_PI_2;
    let (turn, steps) = match discs.offsets_m.len() {
        1 => (0.0, 0),
        28 => (quarter, steps),
        _ => (4.0 * quarter, 4 * steps),
    };
    (0..=steps)
        .map(|k| turn * f64::from(k) / f64::from(steps.max(1)))
        .map(|azimuth| (azimuth.cos(), azimuth.sin()))
        .collect()
}

fn farthest_m(discs: &DiscPoints) -> f64 {
    let radii_m = discs.offsets_m.iter().map(|o| o[0].hypot(o[1]));
    radii_m.fold(0.0, f64::max)
}

/// Where a row is sampled.
struct Sampling {
    /// Bearings of the receiver, as cosine and sine.
    azimuths: Vec<(f64, f64)>,
    /// Columns between the axis and the reach.
    columns: usize,
    /// Up to here a mean square counts as still air.
    negligible_square: f64,
}

/// Samples at one radius more than there are columns, from the axis to the reach, which comes first
/// and is at least `from_m`. `over_discs` gives the mean square over a receiver's discs at a place
/// beside the axis (m), and the mean where it is asked for that, or else 0.
fn sample_row(
    mut over_discs: impl FnMut([f64; 2], bool) -> (f64, f64),
    from_m: f64,
    sampling: &Sampling,
) -> (f64, Vec<EnvelopeSample>) {
    let (azimuths, columns) = (&sampling.azimuths, sampling.columns);
    let counts = |square: f64| square > sampling.negligible_square;
    let at_m = |radius_m: f64, (cos, sin): &(f64, f64)| [radius_m * cos, radius_m * sin];
    let mut reach_m = from_m;
    while (azimuths.iter()).any(|it| counts(over_discs(at_m(reach_m, it), false).0)) {
        reach_m *= 1.25;
    }
    // The mean hardly changes with the azimuth.
    let each = (azimuths.len() / MEAN_AZIMUTHS).max(1);
    let sample = |column: usize| {
        let radius_m = reach_m * column as f64 / columns as f64;
        let mut worst = EnvelopeSample::default();
        let mut means = 0;
        for (k, azimuth) in azimuths.iter().enumerate() {
            let with_mean = k % each == 0;
            let (square, mean) = over_discs(at_m(radius_m, azimuth), with_mean);
            worst.square = worst.square.max(square);
            worst.mean += mean;
            means += i32::from(with_mean);
        }
        worst.mean /= f64::from(means.max(1));
        worst
    };
    let mut row: Vec<EnvelopeSample> = (0..=columns).map(sample).collect();
    for column in (0..columns).rev() {
        row[column].square = row[column].square.max(row[column + 1].square);
    }
    (reach_m, row)
}

/// The speed along the emitter's diagonal at one depth, in units of its induced velocity: at every
/// radius the highest there is, because rotors sit on the diagonals. Tabulated out to where it is
/// faint.
struct Diagonal {
    /// The radius to the rotor tips, widened as the jet has widened down to here (m).
    width_m: f64,
    steps_per_m: f32,
    /// The last is that of all radii beyond.
    speeds: Vec<f32>,
    /// Of these.
    squares: Vec<f32>,
}

/// Speeds whose square is below this part of what counts as still air are taken to be that all the
/// same; chosen here, it lengthens no reach by a column.
const FAINT_PART: f64 = 0.01;

impl Diagonal {
    fn new(wake: &Wake, depth_m: f64, negligible_square: f64) -> Diagonal {
        let widened = wake.half_width_m(depth_m) / wake.half_width_m(0.0);
        let width_m = wake.tip_radius_m() * widened;
        // Chosen here: a 48th of the column's radius, an order finer than any jet is wide.
        let step_m = width_m / 48.0;
        let faint = (FAINT_PART * negligible_square).sqrt() * wake.induced_velocity_mps();
        let mut speeds = Vec::new();
        loop {
            let radius_m = speeds.len() as f64 * step_m;
            let along_m = radius_m * std::f64::consts::FRAC_1_SQRT_2;
            let at_m = Vector3::new(along_m, along_m, -depth_m);
            let speed_mps = wake.axial_speed_mps(at_m);
            let is_faint = speed_mps <= faint && radius_m > 2.0 * width_m;
            speeds.push((speed_mps.max(faint) / wake.induced_velocity_mps()) as f32);
            if is_faint {
                break;
            }
        }
        Diagonal {
            width_m,
            steps_per_m: (1.0 / step_m) as f32,
            squares: speeds.iter().map(|speed| speed * speed).collect(),
            speeds,
        }
    }

    /// Mean square and mean over the discs of a receiver at a place beside the axis.
    fn over_discs(&self, points: &Points, at_m: [f64; 2]) -> (f64, f64) {
        let (mut square, mut mean) = (0.0, 0.0);
        let mut left = 1.0;
        points.near(self.cut_m2(), at_m, |square_m2, weight| {
            let (step, share) = self.place(square_m2);
            let (inner, outer) = (self.speeds[step], self.speeds[step + 1]);
            let speed = inner + (outer - inner) * share;
            square += weight * speed * speed;
            mean += weight * speed;
            left -= weight;
        });
        let faint = self.speeds[self.speeds.len() - 1];
        (f64::from(square + left * faint * faint), f64::from(mean))
    }

    /// The mean square alone.
    fn square_over_discs(&self, points: &Points, at_m: [f64; 2]) -> f64 {
        let faint = self.squares[self.squares.len() - 1];
        let mut square = faint;
        points.near(self.cut_m2(), at_m, |square_m2, weight| {
            let (step, share) = self.place(square_m2);
            let (inner, outer) = (self.squares[step], self.squares[step + 1]);
            square += weight * (inner + (outer - inner) * share);
        });
        f64::from(square)
    }

    /// Beyond it all is faint (m²): a step less, so that rounding asks for none beyond the last.
    fn cut_m2(&self) -> f32 {
        ((self.speeds.len() - 2) as f32 / self.steps_per_m).powi(2)
    }

    /// Where a squared distance (m²) lies in the tables: the place before, and the share of the way
    /// to the next.
    #[inline]
    fn place(&self, square_m2: f32) -> (usize, f32) {
        let place = square_m2.sqrt() * self.steps_per_m;
        let step = place as u32;
        (step as usize, place - step as f32)
    }
}

/// Points of a receiver's discs, in chunks that the processor takes together.
struct Points {
    /// Along x and along y (m), and weights; those that fill up the last chunk are nowhere near.
    chunks: Vec<[[f32; CHUNK]; 3]>,
}

impl Points {
    fn new(discs: &DiscPoints) -> Points {
        let chunk = |(offsets_m, weights): (&[[f64; 2]], &[f64])| {
            let mut chunk = [[f32::INFINITY; CHUNK], [0.0; CHUNK], [0.0; CHUNK]];
            for (k, (offset_m, weight)) in offsets_m.iter().zip(weights).enumerate() {
                chunk[0][k] = offset_m[0] as f32;
                chunk[1][k] = offset_m[1] as f32;
                chunk[2][k] = *weight as f32;
            }
            chunk
        };
        let chunks = discs.offsets_m.chunks(CHUNK);
        Points {
            chunks: chunks.zip(discs.weights.chunks(CHUNK)).map(chunk).collect(),
        }
    }

    /// Calls `f` with the squared distance (m²) from the axis of each point that is nearer to it
    /// than the root of a limit (m²), and with its weight; the receiver's centre is at a place (m).
    #[inline]
    fn near(&self, limit_m2: f32, [x_m, y_m]: [f64; 2], mut f: impl FnMut(f32, f32)) {
        let (x_m, y_m) = (x_m as f32, y_m as f32);
        for [xs_m, ys_m, weights] in &self.chunks {
            let mut squares_m2 = [0.0_f32; CHUNK];
            for k in 0..CHUNK {
                let (dx_m, dy_m) = (x_m + xs_m[k], y_m + ys_m[k]);
                squares_m2[k] = dx_m * dx_m + dy_m * dy_m;
            }
            for (square_m2, weight) in squares_m2.iter().zip(weights) {
                if *square_m2 < limit_m2 {
                    f(*square_m2, *weight);
                }
            }
        }
    }
}

/// Mean square and mean of the axial speed over the discs, in units of the induced velocity.
fn over_discs(
    speed_at: &mut impl FnMut(f64) -> f64,
    discs: &DiscPoints,
    [x_m, y_m]: [f64; 2],
) -> (f64, f64) {
    let mut square = 0.0;
    let mut mean = 0.0;
    for (offset_m, weight) in discs.offsets_m.iter().zip(&discs.weights) {
        let (dx_m, dy_m) = (x_m + offset_m[0], y_m + offset_m[1]);
        let speed = speed_at((dx_m * dx_m + dy_m * dy_m).sqrt());
        square += weight * speed * speed;
        mean += weight * speed;
    }
    (square, mean)
}

/// The greatest sample at this radius or beyond, on the safe side between two samples.
fn at_radius(row: &(f64, Vec<EnvelopeSample>), radius_m: f64) -> EnvelopeSample {
    let column = (radius_m / row.0 * (row.1.len() - 1) as f64 + 1e-9) as usize;
    row.1.get(column).copied().unwrap_or_default()
}

fn at_middle(row: &(f64, Vec<EnvelopeSample>), radius_m: f64) -> f64 {
    let place = radius_m / row.0 * (row.1.len() - 1) as f64;
    let column = place as usize;
    match (row.1.get(column), row.1.get(column + 1)) {
        (Some(inner), Some(outer)) => inner.mean + (outer.mean - inner.mean) * place.fract(),
        _ => 0.0,
    }
}

pub(crate) mod tables;
#[cfg(test)]
mod tests;
