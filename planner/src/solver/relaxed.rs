//! Rules that a scenario leaves open: smooth motion through advected wakes, given up for straight
//! motion through quasi-static ones where a fleet finds no paths by them.

use std::f64::consts::PI;

use crate::scenario::limits::STOP_S;
use crate::scenario::world::{PathMotion, World};
use crate::solver::prepare::Job;
use crate::solver::priority::MOST_SMALL;

/// Share of the floor under the wakes of a larger fleet above which those rules are not tried.
/// Chosen here: halls of 400 (0.12) and warehouses of 500 (0.13) find their paths in some seconds,
/// halls of 500 (0.15) in up to half a minute, of 700 (0.21) not in a minute and a half.
const MOST_COVERED_SHARE: f64 = 0.14;
/// States a drone after which a larger fleet is planned without them: chosen here, somewhat more
/// than halls of 500 and warehouses of 200 take.
const STATES_A_DRONE: u64 = 3_000;

/// States of a try by all rules; `None`: a small fleet gets as many as it takes.
pub(crate) fn most_states(world: &World) -> Option<u64> {
    let drones = world.drones.len();
    (drones > MOST_SMALL).then(|| STATES_A_DRONE * drones as u64)
}

/// Why rules that a scenario leaves open are given up.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Why {
    /// A drone takes so long to stop (s).
    SlowToStop(String, f64),
    /// This share of the floor is under wakes at once.
    Covered(f64),
    /// So many pairs of starts exclude one another.
    Starts(usize),
    /// So many drones more are unplanned.
    Unplanned(usize),
    /// So many states were not enough.
    Spent(u64),
}

impl Why {
    /// What is known before anything is planned.
    pub(crate) fn before(world: &World, job: &Job) -> Option<Why> {
        let stops = |stop_s: f64| STOP_S.contain(stop_s);
        let mut slow = world.drones.iter().filter(|it| !stops(it.vehicle.stop_s()));
        if world.planning.motion == PathMotion::Smooth
            && let Some(slow) = slow.next()
        {
            return Some(Why::SlowToStop(slow.name.clone(), slow.vehicle.stop_s()));
        }
        if world.drones.len() <= MOST_SMALL {
            return None;
        }
        let share = covered_share(world, job);
        (share > MOST_COVERED_SHARE).then_some(Why::Covered(share))
    }

    /// As a note on the plan of a world by relaxed rules.
    pub(crate) fn note(&self, world: &World, relaxed: &World) -> String {
        let (motion, air) = (
            "planning: (motion: Smooth)",
            "air: (convection: (0.6, 1.0))",
        );
        let is_straight = world.planning.motion != relaxed.planning.motion;
        let is_quasi_static = world.convection != relaxed.convection;
        let (planned, without, keys) = match (is_straight, is_quasi_static) {
            (true, false) => ("in straight motion", "smooth motion", motion.to_owned()),
            (false, _) => ("with quasi-static wakes", "advected wakes", air.to_owned()),
            (true, true) => (
                "in straight motion with quasi-static wakes",
                "smooth motion through advected wakes",
                format!("{motion}, {air}"),
            ),
        };
        let why = match self {
            Why::SlowToStop(name, stop_s) => format!(
                "`{name}` takes {stop_s:.1} s to stop, {without} is for up to {:.0} s",
                STOP_S.high
            ),
            Why::Covered(share) => format!(
                "wakes cover {:.0} % of the floor at once, {without} is tried up to {:.0} %",
                100.0 * share,
                100.0 * MOST_COVERED_SHARE
            ),
            Why::Starts(1) => format!("with {without}, one pair of starts exclude one another"),
            Why::Starts(pairs) => {
                format!("with {without}, {pairs} pairs of starts exclude one another")
            }
            Why::Unplanned(1) => format!("with {without}, one drone more is unplanned"),
            Why::Unplanned(more) => format!("with {without}, {more} drones more are unplanned"),
            Why::Spent(states) => format!("with {without}, {states} states gave no plan"),
        };
        format!("planned {planned}: {why}; {keys} asks for it all the same")
    }
}

/// What lies under the wakes of a fleet at once over the floor, each as wide as it alone is too
/// strong for another of its kind.
fn covered_share(world: &World, job: &Job) -> f64 {
    let costmap = job.costmap(world, true, 0);
    let fleet = costmap.fleet();
    let mut known: Vec<((u16, f64), f64)> = Vec::new();
    let mut area_m2 = |index: usize| {
        let kind = job.agents[index].kinds[0];
        let key = (kind.0, world.drones[index].air_limit);
        if let Some((_, area_m2)) = known.iter().find(|(other, _)| *other == key) {
            return *area_m2;
        }
        let keep_out = fleet.keep_out([(kind, key.1); 2], [1.0; 2]);
        let hung = keep_out.hung().iter().map(|it| it.section);
        let radii_m = hung.map(|it| it.from_radius_m.max(it.to_radius_m));
        let radius_m = radii_m.fold(keep_out.body_radius(), f64::max);
        known.push((key, PI * radius_m.powi(2)));
        PI * radius_m.powi(2)
    };
    let size_m = world.bounds_m.max - world.bounds_m.min;
    let covered_m2: f64 = (0..world.drones.len()).map(&mut area_m2).sum();
    covered_m2 / (size_m.x * size_m.y)
}

#[cfg(test)]
mod tests {
    use crate::plan::outcome::{Control, Planned};
    use crate::scenario::read_world;

    fn planned(text: &str) -> Planned {
        let world = read_world(text).expect("in order");
        let outcome = crate::plan_world(&world, &Control::QUIET).expect("in order");
        outcome.into_planned().expect("a plan")
    }

    fn one(airframe: &str, planning: &str) -> String {
        format!(
            r#"(name: "one", bounds_m: (min: (0, 0, 0), max: (9, 9, 5)), airframes: {{"slow": (
            mass_kg: 1, propeller_diameter_m: 0.2, motor_distance_m: 0.4, max_acceleration_mps2: 0.1, max_jerk_mps3: 0.1)}},
            drones: [(name: "k", airframe: "{airframe}", start_m: (1, 1, 1), tasks: [(to_m: (8, 8, 3))])], {planning})"#
        )
    }

    #[test]
    fn what_is_not_named_is_smooth_and_advected() {
        let all = planned(&one("kolibri", ""));
        assert!(all.plan.drones[0].trajectory.is_smooth() && !all.plan.quasi_static);
        let planned = planned(&one(
            "kolibri",
            "planning: (motion: Straight), air: (convection: None)",
        ));
        assert!(!planned.plan.drones[0].trajectory.is_smooth() && planned.plan.quasi_static);
        assert!(all.notes.is_empty() && planned.notes.is_empty());
    }

    #[test]
    fn a_drone_that_is_slow_to_stop_flies_straight_unless_smooth_motion_is_named() {
        let planned = planned(&one("slow", "air: (convection: (0.6, 1.0))"));
        let plan = &planned.plan;
        assert!(plan.is_safe() && !plan.drones[0].trajectory.is_smooth() && !plan.quasi_static);
        let [note] = &planned.notes[..] else {
            panic!("{:?}", planned.notes);
        };
        assert!(note.contains("straight motion: `k` takes 2"), "{note}");
        assert!(read_world(&one("slow", "planning: (motion: Smooth)")).is_err());
    }

    #[test]
    fn wakes_that_cover_the_floor_follow_their_drones_and_the_note_says_how_much() {
        let text = tools::instances::hall(500, 1).expect("there is room");
        let planned = planned(&text);
        let plan = &planned.plan;
        assert!(plan.is_safe() && plan.quasi_static);
        assert!(!plan.drones.iter().any(|it| it.trajectory.is_smooth()));
        let notes = format!("{:?}", planned.notes);
        assert!(
            notes.contains("wakes cover 15 % of the floor at once"),
            "{notes}"
        );
        assert!(notes.contains("tried up to 14 %"), "{notes}");
    }

    #[test]
    fn a_payload_is_taken_up_where_the_drone_stands() {
        let text = one("kolibri", "").replace(
            "(8, 8, 3))",
            "(8, 8, 3), dwell_s: 2, load_kg: 0.05), (to_m: (1, 8, 3), load_kg: 0)",
        );
        let plan = planned(&text).plan;
        let flown = &plan.drones[0].trajectory;
        let steps = (1..flown.t_s.len()).filter(|&k| flown.mass_kg[k] != flown.mass_kg[k - 1]);
        let places_m: Vec<_> = steps.map(|k| flown.position_m[k]).collect();
        for (at_m, place_m) in places_m.iter().zip([[8.0, 8.0, 3.0], [1.0, 8.0, 3.0]]) {
            assert!(
                (at_m - nalgebra::Point3::from(place_m)).norm() < 1e-6,
                "{at_m}"
            );
        }
        assert_eq!(places_m.len(), 2);
    }
}
