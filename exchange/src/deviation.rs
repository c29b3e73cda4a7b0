//! How far what files say is from the plan.

use planner::plan::DronePlan;
use serde::Serialize;

use crate::flown::Flown;

/// Between two samples (s): chosen here, 0.1 m of flight at 2 m/s.
const STEP_S: f64 = 0.05;

/// The largest distance between a file and the plan.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Deviation {
    /// m.
    pub largest_m: f64,
    /// Whose.
    pub drone: String,
    /// When (s).
    pub at_s: f64,
    /// Moments compared, of all drones.
    pub samples: usize,
}

/// Compares every drone with its file, every twentieth of a second and at every point of the plan,
/// while it is there; a drone without a file is off by infinity.
#[must_use]
pub fn of<'a>(pairs: impl Iterator<Item = (&'a DronePlan, Option<&'a Flown>)>) -> Deviation {
    let mut worst = Deviation::default();
    for (drone, flown) in pairs {
        let entry = &drone.trajectory;
        let from_s = drone.enters_s.unwrap_or(0.0);
        let until_s = entry.t_s.last().copied().unwrap_or(0.0);
        let steps = ((until_s - from_s) / STEP_S).ceil().max(0.0) as u64;
        let regular = (0..=steps).map(|k| (from_s + k as f64 * STEP_S).min(until_s));
        for t_s in regular.chain(entry.t_s.iter().copied()) {
            worst.samples += 1;
            let there = flown.and_then(|it| it.at_m(t_s));
            let off_m = match (entry.position_m(t_s), there) {
                (Some(planned_m), Some(said_m)) => (said_m - planned_m).norm(),
                _ => f64::INFINITY,
            };
            // NaN is off, too.
            if off_m > worst.largest_m || off_m.is_nan() {
                worst.largest_m = if off_m.is_nan() { f64::INFINITY } else { off_m };
                worst.drone.clone_from(&drone.name);
                worst.at_s = t_s;
            }
        }
    }
    worst
}
