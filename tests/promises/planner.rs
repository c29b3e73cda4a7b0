//! What the planner calls safe is safe: random worlds, judged by the verifier and by a sampler that
//! shares no formula with it; and worlds made for one promise each.

mod answers;
mod crowded;
mod duties;
mod formations;
mod improving;
mod random;
mod refusals;
pub(crate) mod sampler;
mod stopping;
mod worlds;

use std::sync::atomic::{AtomicUsize, Ordering};

use planner::plan::Plan;
use planner::scenario::world::World;
use planner::{Control, plan_world};

/// Plans and expects a plan, patiently: it may take seconds of searching, not minutes.
fn planned(world: &World) -> Plan {
    // Asked once a drone and once every 1024 states.
    const MOST_LOOKS: usize = 2_000;
    let asked = AtomicUsize::new(0);
    let control = Control {
        stop: &|| asked.fetch_add(1, Ordering::Relaxed) >= MOST_LOOKS,
        ..Control::QUIET
    };
    let outcome = plan_world(world, &control).expect("in order");
    outcome.into_planned().expect("a plan").plan
}

/// The drones of a hall moved to a smaller floor, each in a column of its own at the start and in
/// the end: every so many columns, the goals so many on. The first number has no factor in common
/// with the side.
fn packed(drones: usize, seed: u64, side: usize, [every, goals_on]: [usize; 2]) -> World {
    let text = tools::instances::hall(drones, seed).unwrap();
    let mut world = super::straight_and_quasi_static(planner::read_world(&text).unwrap());
    let place = |index: usize, on: usize| {
        let column = (index * every + on) % (side * side);
        [(column % side) as f64 + 0.5, (column / side) as f64 + 0.5]
    };
    for (index, drone) in world.drones.iter_mut().enumerate() {
        let ([x, y], [u, v]) = (place(index, 0), place(index, goals_on));
        (drone.start_m.x, drone.start_m.y) = (x, y);
        (drone.tasks[0].to_m.x, drone.tasks[0].to_m.y) = (u, v);
    }
    world.bounds_m.max.x = side as f64;
    world.bounds_m.max.y = side as f64;
    world
}

/// Everything a plan must be, whichever drones are unplanned.
fn assert_sound(world: &World, plan: &Plan) {
    assert!(plan.violations.is_empty(), "{:#?}", plan.violations);
    duties::assert_done(world, plan);
    sampler::assert_safe(plan);
}
