//! What the planner calls safe is safe: random worlds, judged by the verifier and by a sampler that
//! shares no formula with it; and worlds made for one promise each.

mod answers;
mod crowded;
mod duties;
mod improving;
mod random;
mod sampler;
mod stopping;
mod worlds;

use std::sync::atomic::{AtomicUsize, Ordering};

use planner::plan::Plan;
use planner::world::World;
use planner::{Control, Outcome, plan_world};

/// Plans and expects a plan, patiently: it may take seconds of searching, not minutes.
fn planned(world: &World) -> Plan {
    // Asked once a drone and once every 1024 states.
    const PATIENCE: usize = 60;
    let asked = AtomicUsize::new(0);
    let control = Control {
        stop: &|| asked.fetch_add(1, Ordering::Relaxed) >= PATIENCE,
        ..Control::QUIET
    };
    match plan_world(world, &control) {
        Outcome::Planned { plan, .. } => plan,
        other => panic!("no plan but {other:#?}"),
    }
}

/// Everything a plan must be, whoever is left out of it.
fn assert_sound(world: &World, plan: &Plan) {
    assert!(plan.violations.is_empty(), "{:#?}", plan.violations);
    duties::assert_done(world, plan);
    sampler::assert_safe(plan);
}
