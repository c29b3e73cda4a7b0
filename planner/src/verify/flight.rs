//! One drone of a plan as the checks see it.

use std::sync::Arc;

use airflow::{DiscPoints, Superposition};
use nalgebra::Vector3;

use super::solid::Solid;
use super::wake_bound::BoundedWake;
use super::wake_end::Stops;
use crate::plan::trajectory::Trajectory;
use crate::plan::{Corners, ZoneEntry};

/// All that the checks need, read once.
pub(super) struct Scene<'a> {
    pub(super) bounds_m: Corners,
    pub(super) solids: Vec<Solid>,
    pub(super) stops: Stops,
    pub(super) zones: Vec<&'a ZoneEntry>,
    pub(super) superposition: Superposition,
    /// Factor on the air that receivers are exposed to.
    pub(super) receiver_gain: f64,
    /// Air without any wake (m/s), which every limit is lower by.
    pub(super) draught_mps: f64,
    /// What jets become along the floor, in zones.
    pub(super) wall: Option<airflow::effects::GroundImpingement>,
    /// Speed of the air that carries wakes down over that of the centreline, where it takes its time.
    pub(super) convection: Option<f64>,
    /// How long any wake outlasts its drone, at most (s).
    pub(super) longest_lag_s: f64,
    /// Last time of any drone (s): from here on everybody rests.
    pub(super) last_s: f64,
    /// Those who stay are judged up to here (s): `last_s`, the time for all air to come down, and a second of rest, which stands for ever.
    pub(super) horizon_s: f64,
    pub(super) flights: Vec<Flight>,
}

/// One drone whose trajectory could be read.
pub(super) struct Flight {
    /// In the plan.
    pub(super) index: usize,
    pub(super) name: String,
    pub(super) trajectory: Trajectory,
    /// When its wake is on and its air is limited (s); empty where the second is not after the first.
    pub(super) airborne_s: (f64, f64),
    pub(super) air_limit: f64,
    pub(super) max_speed_mps: f64,
    pub(super) body_radius_m: f64,
    pub(super) tip_radius_m: f64,
    pub(super) discs: Arc<DiscPoints>,
    /// One per piece of the trajectory, at its mass.
    pub(super) wakes: Vec<Arc<BoundedWake>>,
    /// Faces that may stop the wake during each piece.
    pub(super) stops: Vec<Vec<u32>>,
}

impl Flight {
    /// Whether it is airborne throughout a window that no switch of it divides.
    pub(super) fn airborne_during(&self, from_s: f64, until_s: f64) -> bool {
        let middle_s = 0.5 * (from_s + until_s);
        self.airborne_s.0 <= middle_s && middle_s < self.airborne_s.1
    }

    /// Its wakes without those that repeat.
    pub(super) fn different_wakes(&self) -> Vec<Arc<BoundedWake>> {
        let mut different: Vec<Arc<BoundedWake>> = Vec::new();
        // Consecutive pieces share one wake while the mass stays the same.
        for wake in &self.wakes {
            if !different.iter().rev().any(|known| Arc::ptr_eq(known, wake)) {
                different.push(Arc::clone(wake));
            }
        }
        different
    }

    /// Greatest radius of its near-field column over all its masses (m).
    pub(super) fn column_radius_m(&self) -> f64 {
        let radii_m = self.wakes.iter().map(|wake| wake.wake.column_radius_m());
        radii_m.fold(self.tip_radius_m, f64::max)
    }

    /// End of the flight that dose and energy count to (s).
    pub(super) fn flight_end_s(&self) -> f64 {
        self.airborne_s.1.min(self.trajectory.last_s())
    }
}

impl Scene<'_> {
    /// The end of a violation as the report states it: open if it lasts into the rest after the last time.
    pub(super) fn until(&self, until_s: f64) -> Option<f64> {
        (until_s < self.horizon_s).then_some(until_s)
    }

    /// Wakes one after another at a point, as one speed.
    pub(super) fn superpose(&self, speeds_mps: impl Iterator<Item = f64>) -> f64 {
        superpose(self.superposition, speeds_mps)
    }
}

/// Several speeds at one point as one.
pub(crate) fn superpose(
    superposition: Superposition,
    speeds_mps: impl Iterator<Item = f64>,
) -> f64 {
    match superposition {
        Superposition::Momentum => speeds_mps.map(|u| u * u).sum::<f64>().sqrt(),
        Superposition::Linear => speeds_mps.sum(),
        Superposition::Strongest => speeds_mps.fold(0.0, f64::max),
    }
}

/// Smallest horizontal distance between two boxes (m).
pub(crate) fn level_gap_m(
    a: &(Vector3<f64>, Vector3<f64>),
    b: &(Vector3<f64>, Vector3<f64>),
) -> f64 {
    let gap = |k: usize| (a.0[k] - b.1[k]).max(b.0[k] - a.1[k]).max(0.0);
    (gap(0) * gap(0) + gap(1) * gap(1)).sqrt()
}
