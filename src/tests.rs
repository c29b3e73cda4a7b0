//! Plans for the tests of what is printed and drawn.

use planner::scenario::world::PathMotion;
use planner::{Control, Plan, World, read_world};

/// Four drones, two shelves, a column and a desk; plausible, unverified.
pub(crate) fn warehouse() -> Plan {
    serde_json::from_str(include_str!("sample.json")).expect("a plan")
}

/// Many drones in an empty hall, in straight motion with quasi-static wakes.
pub(crate) fn hall(drones: usize) -> Plan {
    let text = tools::instances::Floor::Hall.scenario(drones, 1);
    let mut world = world(&text.expect("they fit"));
    world.convection = None;
    world.planning.motion = PathMotion::Straight;
    let outcome = planner::plan_world(&world, &Control::QUIET);
    let planned = outcome.expect("in order").into_planned();
    planned.expect("a plan").plan
}

/// `k4` hovers four metres below `m1`, a little beside its axis.
pub(crate) fn two_above_each_other() -> World {
    world(
        r#"Scenario(
            name: "pair",
            bounds_m: (min: (0, 0, 0), max: (10, 10, 8)),
            drones: [
                (name: "m1", airframe: "matrice-300", start_m: (5.3, 6, 5), tasks: [(to_m: (6.3, 6, 5))]),
                (name: "k4", airframe: "kolibri", start_m: (5, 6, 1), tasks: [(to_m: (6, 6, 1))]),
            ],
        )"#,
    )
}

fn world(text: &str) -> World {
    read_world(text).expect("a scenario in order")
}
