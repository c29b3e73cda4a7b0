//! One wake with what bounds it: how far it reaches, and how fast it is over ranges of places.
//!
//! A hover jet is round in the far field, which has closed forms, and has a table in the near field ([`super::near_table`]). A wake that
//! effects have moved or reshaped has tables at every depth: see [`super::moved_wake`]. [`super::passage`] asks them.

use std::sync::Arc;

use airflow::Wake;
use airflow::effects::Flown;
use nalgebra::{Vector2, Vector3};

use super::FAINTEST_WAKE_MPS;
use super::moved_wake::MovedTable;
use super::near_table::NearTable;
use super::passage::{Far, Passage};

/// Depth below the end of the near field from which the far-field bound is taken, as a factor on it:
/// rounding must not ask for a centreline above its range.
pub(super) const JUST_BELOW: f64 = 1.0 + 1e-9;

/// A wake with its bounds.
#[derive(Clone, Debug)]
pub(crate) struct BoundedWake {
    pub(crate) wake: Wake,
    bounds: Bounds,
}

#[derive(Clone, Debug)]
pub(super) enum Bounds {
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

    /// The wake over a range of depths below the rotor plane (m), along a way of which half the length and the depth of the middle are
    /// known.
    pub(crate) fn passage(
        &self,
        depth_m: (f64, f64),
        half_path_m: f64,
        middle_depth_m: f64,
    ) -> Passage<'_> {
        Passage::new(
            &self.wake,
            &self.bounds,
            depth_m,
            half_path_m,
            middle_depth_m,
        )
    }

    /// Highest axial speed (m/s) over a range of depths below the rotor plane and beyond a distance from the axis (m), along a way of which
    /// the middle and half the length are known. A moved wake goes by the box of offsets instead of the distance.
    pub(crate) fn high_mps(
        &self,
        depth_m: (f64, f64),
        off_axis_m: f64,
        places_m: &(Vector3<f64>, Vector3<f64>),
        middle_m: &Vector3<f64>,
        half_path_m: f64,
    ) -> f64 {
        let mut passage = self.passage(depth_m, half_path_m, -middle_m.z);
        passage.highest_mps(Vector2::new(off_axis_m, 0.0), places_m, middle_m.xy())
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
        let unit_mps = self.wake.induced_velocity_mps();
        let near = match &self.bounds {
            Bounds::Moved { table, gain, .. } => {
                return table.highest(places_m).0 * unit_mps * gain;
            }
            Bounds::Round { near, .. } => near,
        };
        let near_depth_m = self.wake.near_field_depth_m();
        let mut high_mps = 0.0_f64;
        if depth_m.1 > near_depth_m {
            high_mps = Far::new(&self.wake, depth_m).highest_mps(Vector2::new(off_axis_m, 0.0));
        }
        if depth_m.0 < near_depth_m {
            let layers = near.layers(depth_m.0.max(0.0), depth_m.1.min(near_depth_m));
            high_mps = high_mps.max(near.highest(layers, off_axis_m).0 * unit_mps);
        }
        high_mps
    }

    /// `u'²/u + |u''|` over the speed `u` (1/m²) along any straight way in the far field at and below a depth (m); `None` elsewhere.
    pub(crate) fn bent_over_speed_per_m2(&self, depth_m: f64) -> Option<f64> {
        if self.is_moved() {
            return None;
        }
        self.wake.far_field().bent_over_speed_per_m2(depth_m)
    }

    /// Steepest change of the axial speed with place (1/s) over a range of depths below the rotor plane and beyond a distance from the
    /// axis (m); a moved wake goes by the box of offsets. It holds along ways that stay below the rotor plane.
    pub(crate) fn steepest_per_s(
        &self,
        depth_m: (f64, f64),
        off_axis_m: f64,
        places_m: &(Vector3<f64>, Vector3<f64>),
    ) -> f64 {
        let unit_mps = self.wake.induced_velocity_mps();
        let near = match &self.bounds {
            Bounds::Moved { table, gain, .. } => {
                return table.highest(places_m).1 * unit_mps * gain;
            }
            Bounds::Round { near, .. } => near,
        };
        let near_depth_m = self.wake.near_field_depth_m();
        let mut steepest = 0.0_f64;
        if depth_m.1 > near_depth_m {
            let top_m = depth_m.0.max(near_depth_m * JUST_BELOW);
            let far_mps = self.highest_mps((top_m, depth_m.1), off_axis_m, places_m);
            let over_speed = self.wake.far_field().steepest_over_speed_per_m(top_m);
            steepest = far_mps * over_speed.unwrap_or(f64::INFINITY);
        }
        if depth_m.0 < near_depth_m {
            let layers = near.layers(depth_m.0.max(0.0), depth_m.1.min(near_depth_m));
            steepest = steepest.max(near.highest(layers, off_axis_m).1 * unit_mps);
        }
        steepest
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
