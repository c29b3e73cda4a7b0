//! Where the flying drones could land, all together.

use std::collections::BTreeSet;

use nalgebra::Point3;
use planner::plan::{AtEnd, DronePlan, Violation};
use planner::scenario::world::World;
use planner::{Plan, Running};

use crate::message::{Land, OneChange};

/// How far off a landing place is looked for (cells of the lattice to each side). Chosen here: in a
/// fleet whose landing places fill every second column, 72 of them.
const REACH_CELLS: i32 = 8;
/// How far ahead a drone is looked for (s). Chosen here: about what it takes to the next place.
const AHEAD_S: f64 = 0.5;
/// Where a coordinate is rounded (1/m): as the lattice's are, so that its places are met exactly.
const PER_METRE: f64 = 1e9;

/// Landing places for all drones that fly at a moment.
pub(crate) struct Landings {
    all: Vec<Landing>,
    /// Drones that stand on the ground and are to stay there.
    grounded: Vec<String>,
    /// Columns that stay taken: where, and the body's radius (m).
    taken: Vec<(Point3<f64>, f64)>,
    /// What stays clear between two bodies (m).
    gap_m: f64,
}

/// The landing of one drone.
struct Landing {
    drone: String,
    radius_m: f64,
    /// Over which it can land (m), the nearest first.
    places: Vec<Point3<f64>>,
    /// Of these, the unsuitable ones.
    banned: BTreeSet<usize>,
    chosen: Option<usize>,
}

impl Landings {
    /// Of a plan at a time (s), without drones that already land, have left or are yet to come.
    pub(crate) fn of(running: &Running, at_s: f64) -> Landings {
        let (plan, world) = (running.flown(), running.world());
        let planning = &world.planning;
        let mut landings = Landings {
            all: Vec::new(),
            grounded: Vec::new(),
            taken: Vec::new(),
            gap_m: planning.clearance_m + 2.0 * planning.margins.tracking_m,
        };
        for (index, entry) in plan.drones.iter().enumerate() {
            let radius_m = entry.airframe.body_radius_m;
            if !running.is_there(index, at_s) {
                continue;
            }
            let Some(last_m) = entry.trajectory.position_m.last() else {
                continue;
            };
            if let Some((at_m, takes_off)) = running.on_ground(index, at_s) {
                landings.taken.push((at_m, radius_m));
                if takes_off {
                    landings.grounded.push(entry.name.clone());
                }
            } else if lands(entry, world, at_s) {
                landings.taken.push((*last_m, radius_m));
            } else {
                landings.all.push(Landing {
                    drone: entry.name.clone(),
                    radius_m,
                    places: places(plan, entry, planning.cell_m, at_s),
                    banned: BTreeSet::new(),
                    chosen: None,
                });
            }
        }
        landings
    }

    /// The nearest free place for each drone that has none, in the order of the plan.
    pub(crate) fn choose(&mut self) {
        for index in 0..self.all.len() {
            let one = &self.all[index];
            if one.chosen.is_none() {
                let free = |place: &usize| {
                    !one.banned.contains(place) && self.is_free(one, &one.places[*place])
                };
                self.all[index].chosen = (0..one.places.len()).find(free);
            }
        }
    }

    fn is_free(&self, one: &Landing, place_m: &Point3<f64>) -> bool {
        let chosen = self
            .all
            .iter()
            .filter_map(|it| Some((it.places[it.chosen?], it.radius_m)));
        let mut taken = self.taken.iter().copied().chain(chosen);
        taken.all(|(other_m, radius_m)| {
            let apart_m = (other_m.xy() - place_m.xy()).norm();
            apart_m >= one.radius_m + radius_m + self.gap_m
        })
    }

    /// The place of a drone will not do; whether it had one.
    pub(crate) fn ban(&mut self, drone: &str) -> bool {
        let one = self.all.iter_mut().find(|it| it.drone == drone);
        let place = one.and_then(|it| Some((it.chosen.take()?, &mut it.banned)));
        place.is_some_and(|(place, banned)| banned.insert(place))
    }

    /// In each violation that the verifier has found one drone gives up its place, once for all of
    /// that drone's; whether any had one.
    pub(crate) fn give_up(&mut self, found: &[Violation]) -> bool {
        let mut given_up: BTreeSet<&str> = BTreeSet::new();
        for it in found {
            let names = [Some(&it.drone[..]), it.with.as_deref()];
            let mut names = names.into_iter().flatten();
            if !names.clone().any(|name| given_up.contains(name)) {
                given_up.extend(names.find(|name| self.ban(name)));
            }
        }
        !given_up.is_empty()
    }

    /// A drone is not there.
    pub(crate) fn leave_out(&mut self, drone: &str) {
        self.all.retain(|it| it.drone != drone);
        self.grounded.retain(|it| it != drone);
    }

    /// What is asked of the planner.
    pub(crate) fn changes(&self) -> Vec<OneChange> {
        let flying = self.all.iter().filter_map(|it| {
            let over_m = it.places[it.chosen?];
            Some((&it.drone, Some(over_m.coords.into())))
        });
        let grounded = self.grounded.iter().map(|it| (it, None));
        let land = |(drone, over_m): (&String, _)| {
            let drone = drone.clone();
            OneChange::Land(Land { drone, over_m })
        };
        flying.chain(grounded).map(land).collect()
    }

    /// Flying drones without a place.
    pub(crate) fn without(&self) -> Vec<String> {
        let without = self.all.iter().filter(|it| it.chosen.is_none());
        without.map(|it| it.drone.clone()).collect()
    }
}

/// Whether a drone lands already at a time (s): it descends, or goes to no other place any more
/// than the one over which it lands, no farther away than it could be sent to land.
fn lands(entry: &DronePlan, world: &World, at_s: f64) -> bool {
    let drone = world.drones.iter().find(|it| it.name == entry.name);
    let ahead_m = entry.trajectory.position_m(at_s + AHEAD_S);
    let is_last = || {
        let [last] = &drone?.tasks[..] else {
            return None;
        };
        let over_m = last.to_m - ahead_m?;
        let reach_m = (f64::from(REACH_CELLS) + 0.5) * world.planning.cell_m;
        let is_near = over_m.xy().amax() <= reach_m && over_m.z <= world.planning.cell_m;
        Some(is_near && last.dwell_s == 0.0 && last.during_s.is_none())
    };
    let is_done = at_s >= entry.arrives_s;
    entry.at_end == AtEnd::Land && (is_done || is_last().unwrap_or(false))
}

/// Where a drone could land (m), the nearest to where it soon is first, at its height there.
fn places(plan: &Plan, entry: &DronePlan, cell_m: f64, at_s: f64) -> Vec<Point3<f64>> {
    let trajectory = &entry.trajectory;
    let next = trajectory.t_s.partition_point(|t_s| *t_s <= at_s);
    let next = next.min(trajectory.position_m.len().saturating_sub(1));
    let ahead_m = trajectory.position_m(at_s + AHEAD_S);
    let (Some(known_m), Some(ahead_m)) = (trajectory.position_m.get(next), ahead_m) else {
        return Vec::new();
    };
    // Break points are places of the lattice, all but starts and goals.
    let cells = (ahead_m - known_m) / cell_m;
    let mut from_m = known_m + cells.map(f64::round) * cell_m;
    let radius_m = entry.airframe.body_radius_m;
    let (min, max) = (plan.bounds_m.min, plan.bounds_m.max);
    from_m.z = from_m.z.min(max.z - radius_m).max(min.z + radius_m);
    let rounded = |to_m: f64| (to_m * PER_METRE).round() / PER_METRE;
    let reach = -REACH_CELLS..=REACH_CELLS;
    let mut steps: Vec<[i32; 2]> = reach
        .clone()
        .flat_map(|x| reach.clone().map(move |y| [x, y]))
        .collect();
    steps.sort_by_key(|[x, y]| (x * x + y * y, *x, *y));
    let place = |[x, y]: [i32; 2]| {
        let moved = |from_m: f64, cells: i32| rounded(from_m + f64::from(cells) * cell_m);
        Point3::new(moved(from_m.x, x), moved(from_m.y, y), rounded(from_m.z))
    };
    let is_inside = |at_m: &Point3<f64>| {
        (0..2).all(|axis| min[axis] + radius_m <= at_m[axis] && at_m[axis] <= max[axis] - radius_m)
    };
    steps.into_iter().map(place).filter(is_inside).collect()
}

#[cfg(test)]
mod tests {
    use planner::plan::ViolationKind;

    use super::*;

    #[test]
    fn of_two_drones_that_meet_twice_one_gives_up_its_place() {
        let landing = |drone: &str| Landing {
            drone: drone.to_owned(),
            radius_m: 0.1,
            places: vec![Point3::origin()],
            banned: BTreeSet::new(),
            chosen: Some(0),
        };
        let mut landings = Landings {
            all: ["a", "b", "c"].map(landing).into(),
            grounded: Vec::new(),
            taken: Vec::new(),
            gap_m: 0.1,
        };
        let meets = |drone: &str, with: &str| Violation {
            kind: ViolationKind::CollisionMargin,
            drone: drone.to_owned(),
            with: Some(with.to_owned()),
            from_s: 1.0,
            until_s: None,
            shift_s: None,
            position_m: Point3::origin(),
            value: 0.1,
            is_bound: false,
            limit: 0.3,
            unit: "m".to_owned(),
        };
        let found = [meets("a", "b"), meets("a", "b"), meets("x", "c")];
        assert!(landings.give_up(&found));
        assert_eq!(landings.without(), ["a", "c"]);
        assert!(!landings.give_up(&[meets("a", "x")]));
    }
}
