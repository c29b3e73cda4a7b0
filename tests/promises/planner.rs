//! What the planner calls safe is safe: random worlds, judged by the verifier and by a sampler that
//! shares no formula with it; and worlds made for one promise each.

mod answers;
mod duties;
mod random;
mod sampler;
mod stopping;
mod worlds;

use planner::plan::Plan;
use planner::world::World;
use planner::{Control, Outcome, plan_world};

/// Plans and expects a plan.
fn planned(world: &World) -> Plan {
    match plan_world(world, &Control::QUIET) {
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
