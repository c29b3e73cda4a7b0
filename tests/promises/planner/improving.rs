//! Time that is left makes a plan better, and never less safe.

use std::sync::atomic::{AtomicUsize, Ordering};

use planner::plan::Plan;
use planner::plan::outcome::Effort;
use planner::scenario::world::World;
use planner::{Control, plan_world};

use super::duties;

/// A crowd: a hundred drones on a floor of twenty metres by twenty, a quarter of its columns in the
/// end.
fn crowd() -> World {
    super::packed(100, 3, 20, [77, 231])
}

/// Plans, and goes on for so many looks at the clock.
fn planned_for(world: &World, looks: usize) -> (Plan, Effort) {
    let asked = AtomicUsize::new(0);
    let control = Control {
        improve: &|| asked.fetch_add(1, Ordering::Relaxed) < looks,
        ..Control::QUIET
    };
    let outcome = plan_world(world, &control).expect("in order");
    let planned = outcome.into_planned().expect("a plan");
    (planned.plan, planned.effort)
}

/// By the verifier alone: a sampler would take minutes for so many.
fn assert_safe(world: &World, plan: &Plan) {
    assert!(plan.violations.is_empty(), "{:#?}", plan.violations);
    duties::assert_done(world, plan);
}

#[test]
fn time_that_is_left_makes_a_plan_better_by_what_is_reported() {
    let world = crowd();
    let (first, effort) = planned_for(&world, 0);
    assert_eq!(effort.improved_s(), None);
    assert!(first.unplanned.is_empty(), "{:?}", first.unplanned);
    let (better, effort) = planned_for(&world, 80);
    let gained_s = first.fleet.sum_of_arrivals_s - better.fleet.sum_of_arrivals_s;
    assert!(gained_s > 0.0, "{gained_s}");
    // Both sums are rounded to a millisecond or less.
    assert!((effort.improved_s().unwrap() - gained_s).abs() < 2e-3);
    assert_safe(&world, &better);
}

#[test]
fn no_drone_arrives_before_it_would_with_no_other_there() {
    // Beside zones the time alone is that of a path that was searched for, not of the shortest.
    let drones = (0..5).map(|k| {
        let (from, to) = (1.0 + 1.5 * f64::from(k), 7.0 - 1.5 * f64::from(k));
        format!(
            r#"(name: "k{k}", airframe: "kolibri", start_m: (1, {from}, 1), tasks: [(to_m: (11, {to}, 1))])"#
        )
    });
    let text = format!(
        r#"(name: "keep", bounds_m: (min: (0, 0, 0), max: (12, 8, 5)), zones: [
        (name: "crowd", min_m: (4, 2, 0), max_m: (8, 6, 2), keep_out: true, air_limit_mps: 1),
        (name: "nofly", min_m: (4, 0, 0), max_m: (8, 1, 5), keep_out: true)], drones: [{}])"#,
        drones.collect::<Vec<_>>().join(", ")
    );
    let world = planner::read_world(&text).expect("in order");
    let (plan, _) = planned_for(&world, 0);
    assert_safe(&world, &plan);
    for drone in &plan.drones {
        assert!(drone.arrives_s >= drone.alone_s, "{}", drone.name);
    }
}

#[test]
fn the_number_of_threads_does_not_change_how_a_plan_gets_better() {
    let world = crowd();
    let [one, four] = [1, 4].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let plan = || planned_for(&world, 30).0;
        serde_json::to_string(&pool.build().unwrap().install(plan)).unwrap()
    });
    assert_eq!(one, four);
}

#[test]
fn a_crowd_stopped_on_the_way_is_safe_and_leaves_most_of_those_flying_that_had_a_path() {
    let world = crowd();
    let mut planned = Vec::new();
    for looks in [0, 10, 4_000] {
        let asked = AtomicUsize::new(0);
        let control = Control {
            stop: &|| asked.fetch_add(1, Ordering::Relaxed) >= looks,
            ..Control::QUIET
        };
        let outcome = plan_world(&world, &control).expect("in order");
        let plan = outcome.into_planned().expect("a plan").plan;
        assert_safe(&world, &plan);
        planned.push(plan.drones.len() - plan.unplanned.len());
    }
    assert!(planned.is_sorted(), "{planned:?}");
    assert_eq!(planned[0], 0);
    assert!(planned[2] > world.drones.len() / 2, "{planned:?}");
}

/// Small fleets on floors so wide that a drone that has to make room may wait beside its goal.
#[test]
fn no_drone_of_a_small_fleet_leaves_its_goal_again() {
    for (seed, goals_on) in [(1, 11), (2, 23), (3, 29), (4, 37), (5, 41), (6, 53)] {
        let world = super::packed(12, seed, 9, [37, goals_on]);
        let plan = super::planned(&world);
        assert!(plan.unplanned.is_empty(), "{:?}", plan.unplanned);
        for (drone, flown) in world.drones.iter().zip(&plan.drones) {
            let goal_m = drone.tasks[0].to_m;
            let is_there = |at_m: &nalgebra::Point3<f64>| (at_m - goal_m).norm() < 1e-9;
            let places = &flown.trajectory.position_m;
            let first = places.iter().position(is_there).expect("it gets there");
            let stays = places[first..].iter().all(is_there);
            assert!(stays, "seed {seed}: {} leaves its goal", drone.name);
        }
    }
}
