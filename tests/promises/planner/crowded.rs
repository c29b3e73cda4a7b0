//! A floor so full that nobody has a way past all others: everybody gets home all the same.

use planner::outcome::Effort;
use planner::plan::Plan;
use planner::world::World;
use planner::{Control, Outcome, plan_world};

use super::duties;

/// Side of the floor (m), and drones on it: one on every other column, at the start and in the end.
const SIDE: usize = 14;
const DRONES: usize = 98;

fn full_floor() -> World {
    let text = planner::instances::hall(DRONES, 5).unwrap();
    let mut world = planner::scenario::read_world(&text, &|file| Err(file.to_owned())).unwrap();
    let place = |index: usize, salt: usize| {
        // 53 and the number of columns have no factor in common: each has a column of its own.
        let column = (index * 53 + salt) % (SIDE * SIDE);
        [(column % SIDE) as f64 + 0.5, (column / SIDE) as f64 + 0.5]
    };
    for (index, drone) in world.drones.iter_mut().enumerate() {
        let ([x, y], [u, v]) = (place(index, 0), place(index, 87));
        (drone.start_m.x, drone.start_m.y) = (x, y);
        (drone.tasks[0].to_m.x, drone.tasks[0].to_m.y) = (u, v);
    }
    world.bounds_m.max.x = SIDE as f64;
    world.bounds_m.max.y = SIDE as f64;
    world
}

fn planned(world: &World) -> (Plan, Effort) {
    match plan_world(world, &Control::QUIET) {
        Outcome::Planned { plan, effort, .. } => (plan, effort),
        other => panic!("no plan but {other:#?}"),
    }
}

#[test]
fn with_half_of_all_columns_held_everybody_gets_home_at_any_number_of_threads() {
    let world = full_floor();
    let [one, three] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| planned(&world))
    });
    let (plan, effort) = &one;
    assert!(effort.rounds > 0, "nobody had to step together: {effort:?}");
    assert!(plan.unplanned.is_empty(), "{:?}", plan.unplanned);
    assert!(plan.violations.is_empty(), "{:#?}", plan.violations);
    duties::assert_done(&world, plan);
    let text = |plan: &Plan| serde_json::to_string(plan).unwrap();
    assert_eq!(text(plan), text(&three.0));
}
