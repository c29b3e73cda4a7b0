//! The air over a receiver's discs at one depth, sampled outwards from the axis.

use airflow::{DiscPoints, Wake};
use nalgebra::Vector3;

use super::COLUMNS;

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sample {
    /// Greatest mean square over azimuth, at this radius or any larger one.
    pub(super) square: f64,
    /// Mean over azimuth of the mean over the discs.
    pub(super) mean: f64,
}

/// Four rotors on the diagonals with six points around each hub look alike mirrored along and across:
/// a quarter turn is all. The farther the receiver's rotors are out, in jets of the emitter, the finer
/// the lobes.
pub(super) fn azimuths(wake: &Wake, discs: &DiscPoints) -> Vec<(f64, f64)> {
    // Chosen here, so that the comparison with random places below holds for the least alike of the presets.
    let larger = (farthest_m(discs) / wake.tip_radius_m() - 1.0).max(0.0);
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

pub(super) fn farthest_m(discs: &DiscPoints) -> f64 {
    let radii_m = discs.offsets_m.iter().map(|o| o[0].hypot(o[1]));
    radii_m.fold(0.0, f64::max)
}

/// Samples at `COLUMNS + 1` radii from the axis to the reach, which comes first and is at least `from_m`.
pub(super) fn sample_row(
    mut speed: impl FnMut(f64) -> f64,
    from_m: f64,
    discs: &DiscPoints,
    azimuths: &[(f64, f64)],
    negligible_square: f64,
) -> (f64, Vec<Sample>) {
    let mut sample = |radius_m: f64| -> Sample {
        let mut worst = Sample::default();
        for (cos, sin) in azimuths {
            let (square, mean) = over_discs(&mut speed, discs, radius_m * cos, radius_m * sin);
            worst.square = worst.square.max(square);
            worst.mean += mean / azimuths.len() as f64;
        }
        worst
    };
    let mut reach_m = from_m;
    while sample(reach_m).square > negligible_square {
        reach_m *= 1.25;
    }
    let mut row: Vec<Sample> = (0..=COLUMNS)
        .map(|column| sample(reach_m * column as f64 / COLUMNS as f64))
        .collect();
    for column in (0..COLUMNS).rev() {
        row[column].square = row[column].square.max(row[column + 1].square);
    }
    (reach_m, row)
}

/// The speed along the emitter's diagonal at one depth, in units of its induced velocity: at every
/// radius the highest there is, because rotors sit on the diagonals. Tabulated as far as asked for.
pub(super) struct Diagonal<'a> {
    wake: &'a Wake,
    depth_m: f64,
    steps_per_m: f64,
    speeds: Vec<f64>,
}

impl Diagonal<'_> {
    pub(super) fn new(wake: &Wake, depth_m: f64) -> Diagonal<'_> {
        Diagonal {
            wake,
            depth_m,
            // Chosen here: a 48th of the column's radius, an order finer than any jet is wide.
            steps_per_m: 48.0 / wake.tip_radius_m(),
            speeds: Vec::new(),
        }
    }

    pub(super) fn speed(&mut self, radius_m: f64) -> f64 {
        let place = radius_m * self.steps_per_m;
        let step = place as usize;
        while self.speeds.len() <= step + 1 {
            let radius_m = self.speeds.len() as f64 / self.steps_per_m;
            let along_m = radius_m * std::f64::consts::FRAC_1_SQRT_2;
            let speed_mps =
                self.wake
                    .axial_speed_mps(Vector3::new(along_m, along_m, -self.depth_m));
            self.speeds
                .push(speed_mps / self.wake.induced_velocity_mps());
        }
        let (inner, outer) = (self.speeds[step], self.speeds[step + 1]);
        inner + (outer - inner) * place.fract()
    }
}

/// Mean square and mean of the axial speed over the discs, in units of the induced velocity.
fn over_discs(
    speed_at: &mut impl FnMut(f64) -> f64,
    discs: &DiscPoints,
    x_m: f64,
    y_m: f64,
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
pub(super) fn at_radius(row: &(f64, Vec<Sample>), radius_m: f64) -> Sample {
    let column = (radius_m / row.0 * COLUMNS as f64 + 1e-9) as usize;
    row.1.get(column).copied().unwrap_or_default()
}

pub(super) fn at_middle(row: &(f64, Vec<Sample>), radius_m: f64) -> f64 {
    let place = radius_m / row.0 * COLUMNS as f64;
    let column = place as usize;
    match (row.1.get(column), row.1.get(column + 1)) {
        (Some(inner), Some(outer)) => inner.mean + (outer.mean - inner.mean) * place.fract(),
        _ => 0.0,
    }
}
