//! How an envelope is made: rows from the rotor plane down, each sampled over radii.

use airflow::{DiscPoints, Wake};
use rayon::prelude::*;

use super::sample::{Diagonal, Sample, at_middle, at_radius, azimuths, farthest_m, sample_row};
use super::{COLUMNS, Envelope, Row};
use crate::moved_jet::{MovedSlab, slabs_m};

/// Rows this close (in motor distances) down to [`FINE_UNTIL_L`]: chosen here, lobes merge within 1.5 l.
const FINE_STEP_L: f64 = 0.125;
/// Where rows begin to grow with the jet (in motor distances).
const FINE_UNTIL_L: f64 = 3.0;
/// Growth of a row over the distance to the virtual origin, below that: chosen here, 4 % of decay a row.
const ROW_GROWTH: f64 = 0.04;
/// What sampling may miss between nodes, on `g²`. Chosen here: a test compares random places.
const SLACK: f64 = 1.02;
/// The same for moved jets, between the bearings and depths looked at as well.
const MOVED_SLACK: f64 = 1.05;

impl Envelope {
    /// Tabulates `wake` (any mass) over receivers with these disc points, from the rotor plane to
    /// `deepest_m`. Radii where the mean square falls below `negligible_square` (of the emitter's
    /// induced velocity) count as still air.
    pub fn new(
        wake: &Wake,
        discs: &DiscPoints,
        deepest_m: f64,
        negligible_square: f64,
    ) -> Envelope {
        let l = wake.motor_distance_m();
        let depths_m = row_depths_m(l, deepest_m);
        let azimuths = azimuths(wake, discs);
        if wake.is_shaped() {
            return Envelope::of_moved(wake, discs, depths_m, &azimuths, negligible_square);
        }
        let samples: Vec<(f64, Vec<Sample>)> = depths_m
            .par_iter()
            .map(|&depth_m| {
                let depth_m = depth_m.max(1e-9);
                let mut diagonal = Diagonal::new(wake, depth_m);
                // Nearer than its outermost disc points a large receiver may straddle a jet and meet less.
                let from_m = wake.half_width_m(depth_m) + farthest_m(discs);
                let speed = |radius_m: f64| diagonal.speed(radius_m);
                sample_row(speed, from_m, discs, &azimuths, negligible_square)
            })
            .collect();
        let mut envelope = Envelope {
            rows: Vec::with_capacity(depths_m.len() - 1),
            row_of_step: rows_of_steps(&depths_m, FINE_STEP_L * l),
            steps_per_m: 1.0 / (FINE_STEP_L * l),
            squares: Vec::new(),
            means: Vec::new(),
            reach_m: 0.0,
            column_depth_m: wake.near_field_depth_m(),
            column_radius_m: wake.tip_radius_m(),
            depths_m,
            moved: false,
        };
        for pair in samples.windows(2) {
            envelope.push_row(&pair[0], &pair[1], SLACK, [0.0; 2]);
        }
        envelope
    }

    fn of_moved(
        wake: &Wake,
        discs: &DiscPoints,
        depths_m: Vec<f64>,
        azimuths: &[(f64, f64)],
        negligible_square: f64,
    ) -> Envelope {
        let depths_m = slabs_m(wake, &depths_m, negligible_square);
        let rows: Vec<_> = depths_m
            .windows(2)
            .map(|ends_m| {
                let mut slab = MovedSlab::new(wake, ends_m[0], ends_m[1]);
                let from_m = slab.spread_m() + farthest_m(discs);
                let speed = |radius_m: f64| slab.speed(radius_m);
                let row = sample_row(speed, from_m, discs, azimuths, negligible_square);
                (row, slab.centre_m)
            })
            .collect();
        let mut envelope = Envelope {
            rows: Vec::with_capacity(rows.len()),
            squares: Vec::new(),
            means: Vec::new(),
            reach_m: 0.0,
            column_depth_m: wake.near_field_depth_m(),
            column_radius_m: wake.column_radius_m(),
            // Slabs may be thinner than any step.
            row_of_step: Vec::new(),
            steps_per_m: 0.0,
            depths_m,
            moved: true,
        };
        for (row, centre_m) in &rows {
            // Jets that the wind has laid down are faint long before they end, and far away by then.
            if MOVED_SLACK * row.1[0].square <= negligible_square {
                envelope.push_still_row();
            } else {
                envelope.push_row(row, row, MOVED_SLACK, *centre_m);
            }
        }
        envelope
    }

    /// A row of still air, which takes no room.
    fn push_still_row(&mut self) {
        self.squares.extend([0.0; COLUMNS]);
        self.means.extend([0.0; COLUMNS]);
        self.rows.push(Row {
            columns_per_m: 0.0,
            reach_m: 0.0,
            centre_m: [0.0; 2],
        });
    }

    fn push_row(
        &mut self,
        upper: &(f64, Vec<Sample>),
        lower: &(f64, Vec<Sample>),
        slack: f64,
        centre_m: [f64; 2],
    ) {
        let reach_m = upper.0.max(lower.0);
        let columns_per_m = COLUMNS as f64 / reach_m.max(1e-9);
        for column in 0..COLUMNS {
            let radius_m = column as f64 / columns_per_m;
            let (above, below) = (at_radius(upper, radius_m), at_radius(lower, radius_m));
            let middle_m = radius_m + 0.5 / columns_per_m;
            let mean = 0.5 * (at_middle(upper, middle_m) + at_middle(lower, middle_m));
            self.squares
                .push((slack * above.square.max(below.square)) as f32);
            self.means.push(mean as f32);
        }
        self.rows.push(Row {
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

fn row_depths_m(l: f64, deepest_m: f64) -> Vec<f64> {
    let mut depths_m = vec![0.0];
    let mut depth_l = 0.0;
    while depth_l * l < deepest_m {
        depth_l += if depth_l < FINE_UNTIL_L {
            FINE_STEP_L
        } else {
            // The paper's virtual origin, 5.8 l above the rotors, sets the scale; any jet's is near.
            ROW_GROWTH * (depth_l + 5.8)
        };
        depths_m.push(depth_l * l);
    }
    if depths_m.len() < 2 {
        depths_m.push(FINE_STEP_L * l);
    }
    depths_m
}
