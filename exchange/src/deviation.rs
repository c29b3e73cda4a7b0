//! How far what files say is from the plan.

use nalgebra::Point3;
use planner::plan::DronePlan;
use serde::Serialize;

use crate::flown::Flown;

/// Samples a second: chosen here, one every 0.1 m of flight at 2 m/s.
pub(crate) const RATE_HZ: f64 = 20.0;

/// The largest distance between a file and the plan.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Deviation {
    /// m.
    pub largest_m: f64,
    /// The drone.
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
        for t_s in moments_s(drone).chain(entry.t_s.iter().copied()) {
            let there = flown.and_then(|it| it.at_m(t_s));
            let off_m = match (entry.position_m(t_s), there) {
                (Some(planned_m), Some(said_m)) => (said_m - planned_m).norm(),
                _ => f64::INFINITY,
            };
            worst.sample(&drone.name, t_s, off_m);
        }
    }
    worst
}

/// Compares every drone with the line through the places of a file without times, in its order:
/// each place of the plan with that part of the line, none before that of an earlier place, which
/// keeps the largest distance least (the discrete Fréchet distance of T. Eiter and H. Mannila,
/// 1994, to parts in place of points).
#[must_use]
pub fn along<'a>(pairs: impl Iterator<Item = (&'a DronePlan, &'a [Point3<f64>])>) -> Deviation {
    let mut worst = Deviation::default();
    for (drone, line) in pairs {
        let mut parts: Vec<[Point3<f64>; 2]> = line.windows(2).map(|it| [it[0], it[1]]).collect();
        if parts.is_empty() {
            parts.extend(line.first().map(|only| [*only; 2]));
        }
        // The least of the largest distances so far, if this place lies along that part.
        let mut least_m: Vec<f64> = vec![0.0; parts.len()];
        for t_s in moments_s(drone) {
            let at_m = drone.trajectory.position_m(t_s);
            let mut before_m = f64::INFINITY;
            for (part, so_far_m) in parts.iter().zip(&mut least_m) {
                before_m = before_m.min(*so_far_m);
                let off_m = at_m.map_or(f64::INFINITY, |at_m| distance_m(at_m, *part));
                *so_far_m = before_m.max(off_m);
            }
            let so_far_m = least_m.iter().copied().fold(f64::INFINITY, f64::min);
            worst.sample(&drone.name, t_s, so_far_m);
        }
    }
    worst
}

/// Every twentieth of a second while a drone is there (s).
fn moments_s(drone: &DronePlan) -> impl Iterator<Item = f64> {
    let from_s = drone.enters_s.unwrap_or(0.0);
    let until_s = ends_s(drone);
    (0..moments(drone)).map(move |k| (from_s + k as f64 / RATE_HZ).min(until_s))
}

/// How many they are.
pub(crate) fn moments(drone: &DronePlan) -> usize {
    let lasts_s = ends_s(drone) - drone.enters_s.unwrap_or(0.0);
    1 + (lasts_s * RATE_HZ).ceil().max(0.0) as usize
}

fn ends_s(drone: &DronePlan) -> f64 {
    drone.trajectory.t_s.last().copied().unwrap_or(0.0)
}

/// Of a place from what lies between two others (m).
pub(crate) fn distance_m(at_m: Point3<f64>, [a, b]: [Point3<f64>; 2]) -> f64 {
    let along = b - a;
    let length_m2 = along.dot(&along);
    let share = match length_m2 > 0.0 {
        true => ((at_m - a).dot(&along) / length_m2).clamp(0.0, 1.0),
        false => 0.0,
    };
    (at_m - (a + along * share)).norm()
}

impl Deviation {
    fn sample(&mut self, drone: &str, t_s: f64, off_m: f64) {
        self.samples += 1;
        // NaN is off, too.
        if off_m > self.largest_m || off_m.is_nan() {
            self.largest_m = if off_m.is_nan() { f64::INFINITY } else { off_m };
            drone.clone_into(&mut self.drone);
            self.at_s = t_s;
        }
    }
}
