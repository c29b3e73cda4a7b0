//! The areas of a site, and what is near them.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};
use planner::plan::{AtEnd, Bounds, DronePlan};

/// What all planners of a site agree on.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// The worlds of the areas, by name: each with the strips that it shares with its neighbours.
    pub areas: BTreeMap<String, Bounds>,
    /// How far beside itself a drone's wake or body matters to another at most (m).
    pub reach_m: f64,
    /// How long after it is asked a change is to be flown (s): planning, and a message there and
    /// back.
    pub lead_s: f64,
    /// A planner that was not heard for so long is silent (s).
    pub silent_s: f64,
}

impl Site {
    /// Whether drones of two areas can matter to one another.
    pub(super) fn are_near(&self, a: &Bounds, b: &Bounds) -> bool {
        meet(&grown(a, 2.0 * self.reach_m), b)
    }

    /// Whether what a drone flies from a time on (s) comes near the world of an area.
    pub(super) fn matters(&self, entry: &DronePlan, area: &str, from_s: f64) -> bool {
        let world = self.areas.get(area);
        world.is_some_and(|it| self.comes_near(it, entry, from_s))
    }

    /// The same of a world.
    pub(super) fn comes_near(&self, world: &Bounds, entry: &DronePlan, from_s: f64) -> bool {
        let near = grown(world, self.reach_m);
        extent(entry, from_s).is_some_and(|it| meet(&near, &it))
    }

    /// How far beside the world of an area a drone stays from a time on (s), less than 0 within it
    /// (m); seen from above.
    pub(super) fn beside_m(&self, entry: &DronePlan, area: &str, from_s: f64) -> Option<f64> {
        let world = self.areas.get(area)?;
        let flown = extent(entry, from_s)?;
        let beside_m = |k| {
            let [below_m, above_m] = [world.min[k] - flown.max[k], flown.min[k] - world.max[k]];
            f64::max(below_m, above_m)
        };
        Some(beside_m(0).max(beside_m(1)))
    }
}

/// Where a drone is from a time on (s).
pub(super) fn extent(entry: &DronePlan, from_s: f64) -> Option<Bounds> {
    let flown = &entry.trajectory;
    let first = flown
        .t_s
        .partition_point(|t_s| *t_s <= from_s)
        .saturating_sub(1);
    let has_left = entry.at_end == AtEnd::Leave && flown.t_s.last().is_some_and(|it| *it < from_s);
    let points = flown.position_m.get(first..)?.iter();
    let inner = flown
        .control_m
        .get(first..)
        .unwrap_or_default()
        .iter()
        .flatten();
    let points = points.chain(inner).map(|it| Bounds { min: *it, max: *it });
    points.reduce(|a, b| both(&a, &b)).filter(|_| !has_left)
}

pub(super) fn both(a: &Bounds, b: &Bounds) -> Bounds {
    Bounds {
        min: a.min.inf(&b.min),
        max: a.max.sup(&b.max),
    }
}

/// Wider to all sides (m); heights do not matter.
pub(super) fn grown(it: &Bounds, by_m: f64) -> Bounds {
    let by = Vector3::repeat(by_m);
    Bounds {
        min: it.min - by,
        max: it.max + by,
    }
}

/// Seen from above.
pub(super) fn meet(a: &Bounds, b: &Bounds) -> bool {
    (0..2).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k])
}

pub(super) fn is_inside(it: &Bounds, at_m: &Point3<f64>) -> bool {
    (0..3).all(|k| it.min[k] <= at_m[k] && at_m[k] <= it.max[k])
}
