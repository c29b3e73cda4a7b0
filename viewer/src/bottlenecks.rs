//! Where a fleet waits most, and for which drones, in words.

use std::collections::BTreeMap;

use nalgebra::Point3;
use planner::plan::Plan;
use serde::Serialize;

use crate::waits::Stop;

/// Waits within one cube of this size are at one place (m): chosen here, the lattice's usual cell
/// twice.
const PLACE_M: f64 = 2.0;
/// Bottlenecks of each kind that are listed, chosen here.
const MOST_LISTED: usize = 3;

/// Where a fleet waits most, and for which drones.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Bottlenecks {
    /// All waits together (s).
    pub waits_s: f64,
    /// Of that what is in none of their stops (s): in shorter ones than are shown, and in slower
    /// flight.
    pub elsewhere_s: f64,
    /// Drones that others wait for, the most first.
    pub drones: Vec<BottleneckDrone>,
    /// Places where drones wait, the most first.
    pub places: Vec<BottleneckPlace>,
}

/// A drone that others wait for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BottleneckDrone {
    /// Its name in the plan.
    pub name: String,
    /// How many others wait for it.
    pub drones: usize,
    /// All together (s).
    pub waits_s: f64,
}

/// A place where drones wait.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BottleneckPlace {
    /// The mean of their places (m).
    pub at_m: Point3<f64>,
    /// How many wait there.
    pub drones: usize,
    /// All together (s).
    pub waits_s: f64,
}

/// By drone, how long it waits in a place (s), and where it first did (m).
type WaitsByDrone = BTreeMap<usize, (f64, Point3<f64>)>;

impl Bottlenecks {
    /// From the stops of each drone of a plan.
    pub(crate) fn of(plan: &Plan, stops: &[Vec<Stop>]) -> Bottlenecks {
        let mut found = Bottlenecks::default();
        // Seconds by drone that waits, so that each counts once.
        let mut drones: BTreeMap<usize, BTreeMap<usize, f64>> = BTreeMap::new();
        let mut places: BTreeMap<[i64; 3], WaitsByDrone> = BTreeMap::new();
        for (drone, (k, stops)) in plan.drones.iter().zip(stops.iter().enumerate()) {
            if drone.waits_s <= 0.0 {
                // It stands for an appointment, or its wait is unknown.
                continue;
            }
            found.waits_s += drone.waits_s;
            let told_s: f64 = stops.iter().filter_map(|it| it.costs_s).sum();
            found.elsewhere_s += (drone.waits_s - told_s).max(0.0);
            for stop in stops {
                let Some(waits_s) = stop.costs_s.filter(|it| *it > 0.0) else {
                    continue;
                };
                if let Some(other) = stop.waits_for {
                    *drones.entry(other).or_default().entry(k).or_default() += waits_s;
                }
                let cube = |m: f64| (m / PLACE_M).floor() as i64;
                let key = [stop.at_m.x, stop.at_m.y, stop.at_m.z].map(cube);
                let there = places.entry(key).or_default();
                there.entry(k).or_insert((0.0, stop.at_m)).0 += waits_s;
            }
        }
        let drone = |(other, of): (usize, BTreeMap<usize, f64>)| BottleneckDrone {
            name: plan.drones[other].name.clone(),
            drones: of.len(),
            waits_s: of.values().sum(),
        };
        found.drones = drones.into_iter().map(drone).collect();
        let place = |of: WaitsByDrone| {
            let middle = of
                .values()
                .fold(Point3::origin(), |sum, it| sum + it.1.coords);
            BottleneckPlace {
                at_m: (middle / of.len() as f64).map(|m| (m * 100.0).round() / 100.0),
                drones: of.len(),
                waits_s: of.values().map(|it| it.0).sum(),
            }
        };
        found.places = places.into_values().map(place).collect();
        // In the plan's order, and by place, where they are the same.
        found.drones.sort_by(|a, b| b.waits_s.total_cmp(&a.waits_s));
        found.places.sort_by(|a, b| b.waits_s.total_cmp(&a.waits_s));
        found.drones.truncate(MOST_LISTED);
        found.places.truncate(MOST_LISTED);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_that_makes_no_drone_later_is_no_bottleneck() {
        let drones = ["a", "b"].map(|name| {
            serde_json::json!({
                "name": name, "airframe": "kolibri", "waits_s": 2.0,
                "trajectory": {"t_s": [0, 9], "position_m": [[1, 1, 1], [8, 1, 1]]},
            })
        });
        let plan = serde_json::json!({
            "format": "plan/1", "scenario": "two", "bounds_m": {"min": [0, 0, 0], "max": [9, 9, 9]},
            "drones": drones,
        });
        let plan: Plan = serde_json::from_value(plan).expect("a plan");
        let stop = |costs_s| Stop {
            from_s: 1.0,
            until_s: 3.0,
            what: "wait",
            waits_for: Some(1),
            costs_s: Some(costs_s),
            held_s: None,
            at_m: Point3::new(2.0, 1.0, 1.0),
        };
        let told = |costs_s| {
            let found = Bottlenecks::of(&plan, &[vec![stop(costs_s)], Vec::new()]);
            [found.drones.len(), found.places.len()]
        };
        assert_eq!((told(2.0), told(0.0)), ([1, 1], [0, 0]));
    }
}
