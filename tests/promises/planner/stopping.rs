//! A caller that stops the planner gets a safe plan for those who have one by then.

use std::sync::atomic::{AtomicUsize, Ordering};

use planner::{Control, FailureCause, Outcome, plan_world};

use super::assert_sound;
use super::worlds::{block, drone, room};
use planner::scenario::world::World;

/// Ten drones that cross each other's paths around a pillar.
fn crossing() -> World {
    let mut drones = Vec::new();
    for k in 0..10 {
        let y_m = 1.5 + f64::from(k);
        let (from_m, to_m) = ([1.5, y_m, 2.5], [10.5, 12.0 - y_m, 4.5]);
        let (from_m, to_m) = if k % 2 == 0 {
            (from_m, to_m)
        } else {
            (to_m, from_m)
        };
        drones.push(drone(&format!("d{k}"), "offboard-1", from_m, to_m));
    }
    let mut world = room([12.0, 12.0, 6.0], drones);
    world
        .obstacles
        .push(block("pillar", [5.0, 5.0, 0.0], [7.0, 7.0, 6.0]));
    world
}

#[test]
fn a_planner_that_is_stopped_leaves_drones_unplanned_and_is_still_safe() {
    let world = crossing();
    let mut planned = Vec::new();
    for calls in [0, 1, 2, 3, 5, 8, 12, 40] {
        let asked = AtomicUsize::new(0);
        let control = Control {
            stop: &|| asked.fetch_add(1, Ordering::Relaxed) >= calls,
            ..Control::QUIET
        };
        let outcome = plan_world(&world, &control).expect("in order");
        let plan = outcome
            .into_planned()
            .expect("starts that bear one another")
            .plan;
        assert_sound(&world, &plan);
        planned.push(plan.drones.len() - plan.unplanned.len());
    }
    assert_eq!(planned[0], 0);
    assert!(planned.is_sorted(), "{planned:?}");
    assert!(planned[7] > 0, "{planned:?}");
}

#[test]
fn a_stopped_planner_says_so() {
    let control = Control {
        stop: &|| true,
        ..Control::QUIET
    };
    let Ok(Outcome::Partial(planned)) = plan_world(&crossing(), &control) else {
        panic!("a plan in which all drones stay");
    };
    assert_eq!(planned.plan.unplanned.len(), planned.plan.drones.len());
    for (failure, told) in planned.failures.iter().zip(&planned.plan.unplanned) {
        assert!(matches!(failure.cause, FailureCause::Stopped(_)));
        assert!(told.reason.contains("stopped"), "{}", told.reason);
        assert_eq!(
            (&failure.drone, &failure.cause.to_string()),
            (&told.name, &told.reason)
        );
    }
}
