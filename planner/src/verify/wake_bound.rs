//! The speed of one wake over a range of depths and distances, from above and from below.
//!
//! Far field: the centreline falls and the half-width grows with depth, the profile falls outwards, so
//!
//! ```text
//! U_C(s_hi) f(r_hi / r_half(s_lo)) <= U <= U_C(s_lo) f(r_lo / r_half(s_hi))
//! ```
//!
//! and both sides are one value of the field times a ratio of centreline speeds. Near field (and the
//! join, which is smooth): two tables per airframe, the highest speed and the steepest slope at or
//! beyond a radius, layer by layer; the speed over a short way differs from that at its middle by at
//! most slope times half the way. All of it closes in on the field as the ranges shrink.
//!
//! A wake that effects have moved or reshaped has tables at every depth: see [`super::moved_wake`].

use std::sync::Arc;

use airflow::Wake;
use airflow::effects::Flown;
use nalgebra::Vector3;

use super::FAINTEST_WAKE_MPS;
use super::moved_wake::MovedTable;

/// Layers of the near field, between the rotor plane and 2.5 motor distances: 0.1 motor distances each.
const LAYERS: usize = 25;
/// Rings, 30 to a motor distance; what is farther out than 4 counts as the last one.
const RINGS: usize = 120;
const RINGS_PER_MOTOR_DISTANCE: f64 = 30.0;
/// Samples per layer.
const FINE: usize = 3;
/// Samples between one diagonal and the next axis: the field of four rotors repeats every 90 degrees
/// and is its own mirror image about each diagonal.
const BEARINGS: usize = 9;
/// On sampled speeds, chosen here: the highest speed between samples 0.033 motor distances apart exceeds
/// the sampled by curvature (2 ln 2 / b² per rotor flow, half-width b >= 0.23) times step² / 8, 0.4 % of the peak,
/// and by 1.5 % between two bearings.
const BETWEEN_SAMPLES: f64 = 1.03;
/// On slopes taken as differences of neighbouring samples, for the same reason.
const SLOPE_MARGIN: f64 = 1.25;
/// Depth below the end of the near field from which the far-field bound is taken, as a factor on it:
/// rounding must not ask for a centreline above its range.
const JUST_BELOW: f64 = 1.0 + 1e-9;

/// Highest speed and steepest slope of the near field of one airframe, per unit of induced velocity.
#[derive(Debug)]
struct NearTable {
    layer_m: f64,
    ring_m: f64,
    /// `U / U_H` in a layer at or beyond the inner radius of each ring, and of the one after the last.
    speed: Vec<f64>,
    /// `|grad U| / U_H` there (1/m).
    slope_per_m: Vec<f64>,
}

/// A wake with its bounds.
#[derive(Clone, Debug)]
pub(crate) struct BoundedWake {
    pub(crate) wake: Wake,
    bounds: Bounds,
}

#[derive(Clone, Debug)]
enum Bounds {
    Round {
        near: Arc<NearTable>,
        /// Radius beyond which it is fainter than [`FAINTEST_WAKE_MPS`], at any depth up to each step (m).
        reach_m: Arc<[f64]>,
    },
    Moved {
        table: Arc<MovedTable>,
        deepest_m: f64,
        /// Factor on the table.
        gain: f64,
    },
}

/// Depth of one step of the table of reaches, in near-field depths.
const REACH_STEP: f64 = 0.5;
/// Steps of that table; below the last the greatest reach of all is taken.
const REACH_STEPS: usize = 128;

impl BoundedWake {
    /// Bounds down to a depth (m); only moved wakes end there.
    pub(crate) fn new(wake: Wake, deepest_m: f64) -> BoundedWake {
        let bounds = if wake.is_shaped() {
            Bounds::Moved {
                table: Arc::new(MovedTable::new(&wake, deepest_m)),
                deepest_m,
                gain: 1.0,
            }
        } else {
            Bounds::Round {
                near: Arc::new(NearTable::new(&wake)),
                reach_m: reaches(&wake),
            }
        };
        BoundedWake { wake, bounds }
    }

    /// The same airframe at another mass.
    pub(crate) fn with_mass(&self, mass_kg: f64) -> BoundedWake {
        let wake = self.wake.with_mass(mass_kg);
        match &self.bounds {
            Bounds::Round { near, .. } => BoundedWake {
                bounds: Bounds::Round {
                    near: Arc::clone(near),
                    reach_m: reaches(&wake),
                },
                wake,
            },
            // How far wind moves a jet depends on how heavy its drone is.
            Bounds::Moved { deepest_m, .. } => BoundedWake::new(wake, *deepest_m),
        }
    }

    /// The same drone while it climbs at a speed (m/s, up positive).
    pub(crate) fn climbing(&self, flown: &Flown, climb_mps: f64) -> BoundedWake {
        let Bounds::Moved {
            table, deepest_m, ..
        } = &self.bounds
        else {
            return self.clone();
        };
        let wake = flown.climbing(&self.wake, climb_mps);
        BoundedWake {
            bounds: Bounds::Moved {
                table: Arc::clone(table),
                deepest_m: *deepest_m,
                gain: wake.gain(),
            },
            wake,
        }
    }

    /// Whether it need not be round, nor below its drone.
    pub(crate) fn is_moved(&self) -> bool {
        matches!(self.bounds, Bounds::Moved { .. })
    }

    /// Radius beyond which it is fainter than [`FAINTEST_WAKE_MPS`] anywhere down to a depth (m).
    pub(crate) fn reach_m(&self, depth_m: f64) -> f64 {
        match &self.bounds {
            Bounds::Round { reach_m, .. } => {
                let step = depth_m / (REACH_STEP * self.wake.near_field_depth_m());
                reach_m[(step.max(0.0) as usize).min(REACH_STEPS)]
            }
            Bounds::Moved { table, gain, .. } => {
                let faintest = FAINTEST_WAKE_MPS / (gain * self.wake.induced_velocity_mps());
                table.reach_m(faintest, depth_m)
            }
        }
    }

    /// Lowest and highest axial speed (m/s) over ranges of depth below the rotor plane and of distance
    /// from the axis (m), along a way of which the middle and half the length are known. A moved wake
    /// goes by the box of offsets instead of the distances.
    pub(crate) fn range_mps(
        &self,
        depth_m: (f64, f64),
        off_axis_m: (f64, f64),
        places_m: &(Vector3<f64>, Vector3<f64>),
        middle_m: &Vector3<f64>,
        half_path_m: f64,
    ) -> (f64, f64) {
        if depth_m.1 <= 0.0 {
            return (0.0, 0.0);
        }
        let near = match &self.bounds {
            Bounds::Round { near, .. } => near,
            Bounds::Moved { table, gain, .. } => {
                let unit_mps = gain * self.wake.induced_velocity_mps();
                let (speed, slope_per_m) = table.highest(places_m);
                return self.closed_in(
                    speed * unit_mps,
                    slope_per_m * unit_mps * half_path_m,
                    depth_m,
                    middle_m,
                );
            }
        };
        let near_depth_m = self.wake.near_field_depth_m();
        let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
        if depth_m.1 > near_depth_m {
            let top_m = depth_m.0.max(near_depth_m * JUST_BELOW);
            let bottom_m = depth_m.1.max(top_m);
            let ratio = match (
                self.wake.centreline_mps(top_m),
                self.wake.centreline_mps(bottom_m),
            ) {
                (Some(top), Some(bottom)) if bottom > 0.0 => top / bottom,
                _ => 1.0,
            };
            let at = |r_m: f64, s_m: f64| self.wake.axial_speed_mps(Vector3::new(r_m, 0.0, -s_m));
            high = at(off_axis_m.0, bottom_m) * ratio;
            low = at(off_axis_m.1, top_m) / ratio;
        }
        if depth_m.0 < near_depth_m {
            let u_h = self.wake.induced_velocity_mps();
            let (speed, slope_per_m) = near.highest(
                depth_m.0.max(0.0),
                depth_m.1.min(near_depth_m),
                off_axis_m.0,
            );
            high = high.max(speed * u_h);
            low = 0.0;
            let change = slope_per_m * u_h * half_path_m;
            // A way so long that the slope tells no more than the table is not looked at.
            if depth_m.0 > 0.0 && change < high {
                let middle = self.wake.axial_speed_mps(*middle_m);
                high = high.min(middle + change);
                low = (middle - change).max(0.0);
            }
        }
        (low.min(high), high)
    }

    /// The range about the speed at the middle of a way, along which it changes by so much at most and is so high nowhere.
    fn closed_in(
        &self,
        highest_mps: f64,
        change_mps: f64,
        depth_m: (f64, f64),
        middle_m: &Vector3<f64>,
    ) -> (f64, f64) {
        // A way so long that the slope tells no more than the table is not looked at; nor one through the rotor plane, where air begins.
        if depth_m.0 <= 0.0 || change_mps.is_nan() || change_mps >= highest_mps {
            return (0.0, highest_mps);
        }
        let middle_mps = self.wake.axial_speed_mps(*middle_m);
        let high_mps = highest_mps.min(middle_mps + change_mps);
        ((middle_mps - change_mps).clamp(0.0, high_mps), high_mps)
    }

    /// An upper bound over a box of places below it, without a middle to go by (m/s).
    pub(crate) fn highest_mps(
        &self,
        depth_m: (f64, f64),
        off_axis_m: f64,
        places_m: &(Vector3<f64>, Vector3<f64>),
    ) -> f64 {
        if depth_m.1 <= 0.0 {
            return 0.0;
        }
        let nowhere = Vector3::new(0.0, 0.0, -depth_m.1);
        let off_axis_m = (off_axis_m, off_axis_m);
        self.range_mps(depth_m, off_axis_m, places_m, &nowhere, f64::INFINITY)
            .1
    }
}

/// Greatest radius of the faintest wake counted, at any depth up to each step.
fn reaches(wake: &Wake) -> Arc<[f64]> {
    let near_depth_m = wake.near_field_depth_m();
    let end_m = wake.spindle_end_m(FAINTEST_WAKE_MPS).max(near_depth_m);
    let at = |depth_m: f64| {
        wake.radius_at_speed_m(depth_m, FAINTEST_WAKE_MPS)
            .unwrap_or(0.0)
    };
    // The near field reaches as far as the far field at its end: 5 motor distances against 2 for a Gaussian.
    let mut greatest = at(near_depth_m * JUST_BELOW);
    let mut table = Vec::with_capacity(REACH_STEPS + 1);
    for step in 0..REACH_STEPS {
        let depth_m =
            ((step + 1) as f64 * REACH_STEP * near_depth_m).max(near_depth_m * JUST_BELOW);
        greatest = greatest.max(at(depth_m));
        table.push(greatest);
    }
    // The spindle is one arch: 64 samples miss its greatest radius by far less than the 2 % added.
    let over_all = (1..64)
        .map(|k| at(near_depth_m * JUST_BELOW + f64::from(k) / 64.0 * (end_m - near_depth_m)));
    table.push(over_all.fold(greatest, f64::max));
    table.iter().map(|reach| 1.02 * reach).collect()
}

impl NearTable {
    fn new(wake: &Wake) -> NearTable {
        let depth_m = wake.near_field_depth_m();
        let layer_m = depth_m / LAYERS as f64;
        let ring_m = wake.motor_distance_m() / RINGS_PER_MOTOR_DISTANCE;
        let (depths, radii) = (LAYERS * FINE + 1, RINGS + 1);
        let (step_s_m, step_r_m) = (layer_m / FINE as f64, ring_m);
        let step_bearing = std::f64::consts::FRAC_PI_4 / (BEARINGS - 1) as f64;
        let u_h = wake.induced_velocity_mps();
        let at = |s: usize, r: usize, b: usize| {
            // Just below the rotor plane: at it the field jumps to zero.
            let s_m = (s as f64 * step_s_m).max(1e-6 * depth_m);
            let (r_m, bearing) = (r as f64 * step_r_m, b as f64 * step_bearing);
            wake.axial_speed_mps(Vector3::new(r_m * bearing.cos(), r_m * bearing.sin(), -s_m)) / u_h
        };
        let mut sampled = vec![0.0; depths * radii * BEARINGS];
        for s in 0..depths {
            for r in 0..radii {
                for b in 0..BEARINGS {
                    sampled[(s * radii + r) * BEARINGS + b] = at(s, r, b);
                }
            }
        }
        let value = |s: usize, r: usize, b: usize| sampled[(s * radii + r) * BEARINGS + b];
        let slope = |s: usize, r: usize, b: usize| {
            let here = value(s, r, b);
            let along_s = if s + 1 < depths {
                (value(s + 1, r, b) - here) / step_s_m
            } else {
                0.0
            };
            let along_r = if r + 1 < radii {
                (value(s, r + 1, b) - here) / step_r_m
            } else {
                0.0
            };
            let around = if b + 1 < BEARINGS && r > 0 {
                (value(s, r, b + 1) - here) / (r as f64 * step_r_m * step_bearing)
            } else {
                0.0
            };
            Vector3::new(along_s, along_r, around).norm()
        };
        let nodes = LAYERS * (RINGS + 1);
        let mut table = NearTable {
            layer_m,
            ring_m,
            speed: vec![0.0; nodes],
            slope_per_m: vec![0.0; nodes],
        };
        for layer in 0..LAYERS {
            let (mut speed, mut slope_per_m) = (0.0_f64, 0.0_f64);
            for r in (0..radii).rev() {
                for s in layer * FINE..=(layer + 1) * FINE {
                    for b in 0..BEARINGS {
                        speed = speed.max(value(s, r, b));
                        slope_per_m = slope_per_m.max(slope(s, r, b));
                    }
                }
                table.speed[layer * radii + r] = BETWEEN_SAMPLES * speed;
                table.slope_per_m[layer * radii + r] = SLOPE_MARGIN * slope_per_m;
            }
        }
        table
    }

    /// Highest speed over U_H and steepest slope over U_H (1/m) between two depths, at or beyond a radius.
    fn highest(&self, from_m: f64, until_m: f64, off_axis_m: f64) -> (f64, f64) {
        let rings = (off_axis_m / self.ring_m).min(RINGS as f64);
        let ring = (rings as usize).min(RINGS - 1);
        let beyond = rings - ring as f64;
        let layer = |depth_m: f64| ((depth_m / self.layer_m) as usize).min(LAYERS - 1);
        (layer(from_m)..=layer(until_m)).fold((0.0, 0.0), |(speed, slope), k| {
            let at = k * (RINGS + 1) + ring;
            // The highest speed beyond a radius falls with it; its chord lies within the margin of it.
            let here = self.speed[at] + beyond * (self.speed[at + 1] - self.speed[at]);
            (here.max(speed), self.slope_per_m[at].max(slope))
        })
    }
}
