//! A floor so full that no drone has a path past all others: every drone gets home all the same.

use planner::plan::Plan;
use planner::plan::outcome::Effort;
use planner::scenario::world::World;
use planner::{Control, plan_world};

use super::duties;

/// So many drones on a square floor, every other column theirs or nearly so.
fn full_floor(drones: usize, side: usize) -> World {
    super::packed(drones, 5, side, [53, 87])
}

fn planned(world: &World) -> (Plan, Effort) {
    let outcome = plan_world(world, &Control::QUIET).expect("in order");
    let planned = outcome.into_planned().expect("a plan");
    (planned.plan, planned.effort)
}

#[test]
fn with_half_of_all_columns_held_every_drone_gets_home_at_any_number_of_threads() {
    let world = full_floor(98, 14);
    let [one, three] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| planned(&world))
    });
    let (plan, effort) = &one;
    assert!(effort.rounds > 0, "PIBT was not used: {effort:?}");
    assert!(plan.unplanned.is_empty(), "{:?}", plan.unplanned);
    assert!(plan.violations.is_empty(), "{:#?}", plan.violations);
    duties::assert_done(&world, plan);
    let text = |plan: &Plan| serde_json::to_string(plan).unwrap();
    assert_eq!(text(plan), text(&three.0));
}

#[test]
fn what_is_to_be_done_on_the_way_is_done_on_a_full_floor_too() {
    let mut world = full_floor(60, 12);
    let places: Vec<_> = world.drones.iter().map(|drone| drone.start_m).collect();
    for (index, drone) in world.drones.iter_mut().enumerate() {
        // Past where another one started, for a while.
        let mut on_the_way = drone.tasks[0].clone();
        on_the_way.to_m = places[(index + 7) % places.len()];
        on_the_way.dwell_s = 0.5 * (index % 4) as f64;
        drone.tasks.insert(0, on_the_way);
        drone.tasks[1].dwell_s = 1.0;
    }
    let (plan, effort) = planned(&world);
    assert!(effort.rounds > 0, "PIBT was not used: {effort:?}");
    assert!(plan.unplanned.is_empty(), "{:?}", plan.unplanned);
    assert!(plan.violations.is_empty(), "{:#?}", plan.violations);
    duties::assert_done(&world, &plan);
}

#[test]
fn on_a_full_floor_air_that_takes_its_time_is_borne_too() {
    let mut world = full_floor(60, 12);
    world.convection = airflow::Convection::new([0.6, 1.0]).ok();
    let (plan, effort) = planned(&world);
    assert!(effort.rounds > 0, "PIBT was not used: {effort:?}");
    assert!(plan.unplanned.is_empty(), "{:?}", plan.unplanned);
    assert!(
        !plan.quasi_static && plan.violations.is_empty(),
        "{:#?}",
        plan.violations
    );
    duties::assert_done(&world, &plan);
}
