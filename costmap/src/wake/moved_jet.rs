//! A slab of a jet that wind or tilt have moved, made round: the highest speed there is at each
//! distance from one vertical axis.
//!
//! A moved jet is not round, and within a slab its axis wanders. All of the slab is looked at from
//! one vertical line through its middle; what is kept is, for each distance from that line, the
//! highest speed at any bearing and any depth of the slab. To take the air to be that everywhere
//! errs outwards.

use airflow::Wake;
use nalgebra::Vector3;

/// Bearings looked at in the near field, whose lobes are a seventh of a circle wide at least; and
/// below it. Chosen here.
const BEARINGS: [u32; 2] = [48, 24];
/// The axis moves by no more than this part of the jet's extent between two depths looked at.
/// Chosen here: a jet moved by half of it is one percent slower at a place.
const AXIS_STEP: f64 = 0.2;
/// Most depths looked at in one slab: chosen here.
const MOST_DEPTHS: f64 = 32.0;
/// The thinnest slab, as a part of its depth: chosen here. A jet that lies down sweeps tens of
/// metres within centimetres of depth.
const THINNEST: f64 = 1e-7;
/// Highest speed beside the axis over that on it: 1.1 for the steepest of edges in range, and more
/// to spare.
const OFF_AXIS: f64 = 1.2;
/// Distances looked at in one spread. Chosen here: between two the profile is straight to a part in
/// a thousand.
const RADII_PER_SPREAD: f64 = 24.0;

/// A slab of one wake.
pub(crate) struct MovedSlab<'a> {
    wake: &'a Wake,
    /// Where its vertical axis is (m, from the drone).
    pub(crate) centre_m: [f64; 2],
    depths_m: Vec<f64>,
    bearings: Vec<[f64; 2]>,
    steps_per_m: f64,
    /// In units of the emitter's induced velocity, filled as far as asked for.
    speeds: Vec<f64>,
}

/// Cuts ranges of depths until the axis moves by no more than the extent of a level cut in each,
/// where the jet is not still air (mean squares up to `negligible_square` of the induced velocity),
/// and where the wind has taken it away.
pub(crate) fn slabs_m(wake: &Wake, depths_m: &[f64], negligible_square: f64) -> Vec<f64> {
    let mut cut_m = vec![depths_m.first().copied().unwrap_or_default()];
    let gone_m = wake.gone_from_m();
    for ends_m in depths_m.windows(2) {
        let within = |depth_m: &f64| ends_m[0] < *depth_m && *depth_m < ends_m[1];
        let cuts_m = [Some(ends_m[0]), gone_m.filter(within), Some(ends_m[1])];
        let cuts_m: Vec<f64> = cuts_m.into_iter().flatten().collect();
        for part_m in cuts_m.windows(2) {
            cut(wake, part_m[0], part_m[1], negligible_square, &mut cut_m);
        }
    }
    cut_m
}

fn cut(wake: &Wake, from_m: f64, to_m: f64, negligible_square: f64, cut_m: &mut Vec<f64>) {
    let moved_m = || {
        let (from_m, to_m) = (wake.axis_m(from_m)?, last_axis_m(wake, from_m, to_m)?);
        Some((to_m[0] - from_m[0]).hypot(to_m[1] - from_m[1]))
    };
    let moves = moved_m().is_some_and(|moved_m| moved_m > extent_m(wake, from_m));
    if !moves
        || to_m - from_m <= 10.0 * THINNEST * to_m
        || is_still(wake, from_m, negligible_square)
    {
        cut_m.push(to_m);
        return;
    }
    let middle_m = f64::midpoint(from_m, to_m);
    cut(wake, from_m, middle_m, negligible_square, cut_m);
    cut(wake, middle_m, to_m, negligible_square, cut_m);
}

/// Half-width of a level cross-section in the direction in which the jet leans and moves; at least
/// as in still air.
fn extent_m(wake: &Wake, depth_m: f64) -> f64 {
    let still_m = wake.half_width_m(depth_m);
    wake.spread_m(depth_m).unwrap_or(still_m).max(still_m)
}

/// Where the axis is at the lower end of a slab; just above, if the wind has taken the jet away
/// there.
fn last_axis_m(wake: &Wake, from_m: f64, to_m: f64) -> Option<[f64; 2]> {
    let just_above_m = (to_m * (1.0 - THINNEST)).max(from_m);
    wake.axis_m(to_m).or_else(|| wake.axis_m(just_above_m))
}

/// Whether the air of a jet that wind has laid down is slower than what counts at a depth, and so
/// below it: on its axis it is fastest, but for an edge that effects have steepened, by less than a
/// fifth.
fn is_still(wake: &Wake, depth_m: f64, negligible_square: f64) -> bool {
    depth_m > wake.near_field_depth_m()
        && wake.axis_m(depth_m).is_none_or(|[x_m, y_m]| {
            let on_axis_mps = wake.axial_speed_mps(Vector3::new(x_m, y_m, -depth_m));
            let speed = OFF_AXIS * on_axis_mps / wake.induced_velocity_mps();
            speed * speed <= negligible_square
        })
}

impl MovedSlab<'_> {
    pub(crate) fn new(wake: &Wake, from_m: f64, to_m: f64) -> MovedSlab<'_> {
        // At the rotor plane itself there is no air yet.
        let from_m = from_m.max(1e-9);
        let spread_m = wake.spread_m(from_m).unwrap_or(wake.half_width_m(from_m));
        // Where the wind has taken the jet away there is nothing to look at: any centre will do.
        let first_m = wake.axis_m(from_m).unwrap_or_default();
        let last_m = last_axis_m(wake, from_m, to_m).unwrap_or(first_m);
        let moved_m = (last_m[0] - first_m[0]).hypot(last_m[1] - first_m[1]);
        let steps = (moved_m / (AXIS_STEP * extent_m(wake, from_m)))
            .ceil()
            .clamp(2.0, MOST_DEPTHS);
        let depths_m = (0..=steps as u32)
            .map(|k| from_m + f64::from(k) / steps * (to_m - from_m))
            .collect();
        let far = from_m >= wake.near_field_depth_m();
        let bearings = BEARINGS[usize::from(far)];
        // Where rotors are, and further down where the jet leans, and is longest.
        let first_bearing = if far {
            (last_m[1] - first_m[1]).atan2(last_m[0] - first_m[0])
        } else {
            std::f64::consts::FRAC_PI_4
        };
        MovedSlab {
            wake,
            centre_m: [0, 1].map(|axis| 0.5 * (first_m[axis] + last_m[axis])),
            depths_m,
            bearings: (0..bearings)
                .map(|k| std::f64::consts::TAU * f64::from(k) / f64::from(bearings))
                .map(|angle| (angle + first_bearing).sin_cos())
                .map(|(sin, cos)| [cos, sin])
                .collect(),
            steps_per_m: RADII_PER_SPREAD / spread_m.min(wake.half_width_m(from_m)),
            speeds: Vec::new(),
        }
    }

    /// How far from its centre a search for its edge begins (m).
    pub(crate) fn spread_m(&self) -> f64 {
        let spreads_m = self
            .depths_m
            .iter()
            .filter_map(|&depth_m| self.wake.spread_m(depth_m));
        spreads_m.fold(self.wake.tip_radius_m(), f64::max)
    }

    /// Highest speed at a distance from the centre, over the emitter's induced velocity.
    pub(crate) fn speed(&mut self, radius_m: f64) -> f64 {
        let place = radius_m * self.steps_per_m;
        let step = place as usize;
        while self.speeds.len() <= step + 1 {
            let highest_mps = self.highest_mps(self.speeds.len() as f64 / self.steps_per_m);
            self.speeds
                .push(highest_mps / self.wake.induced_velocity_mps());
        }
        let (inner, outer) = (self.speeds[step], self.speeds[step + 1]);
        inner + (outer - inner) * place.fract()
    }

    fn highest_mps(&self, radius_m: f64) -> f64 {
        let [x_m, y_m] = self.centre_m;
        let mut highest_mps = 0.0_f64;
        for &depth_m in &self.depths_m {
            for [cos, sin] in &self.bearings {
                let offset_m = Vector3::new(x_m + radius_m * cos, y_m + radius_m * sin, -depth_m);
                highest_mps = highest_mps.max(self.wake.axial_speed_mps(offset_m));
            }
        }
        highest_mps
    }
}
