//! A "no" is about the place, as far as it was looked at; and what is advised has been planned.

use planner::plan::cause::{Extent, Remedy};
use planner::scenario::world::{Vehicle, World};
use planner::{Control, FailureCause, Outcome, Planned, plan_world};

use super::assert_sound;
use super::worlds::{drone, room};

fn answered(world: &World) -> Planned {
    let outcome = plan_world(world, &Control::QUIET).expect("in order");
    outcome.into_planned().expect("a plan")
}

/// Two drones trade the ends of a corridor of a width (m), 6 m high, cells of 1 m: side by side on
/// cells of a metre there is no room, on finer ones there is.
fn tall_corridor(length_m: f64, width_m: f64, body_radius_m: f64) -> World {
    let middle_m = 0.5 * width_m;
    let ends = [[1.0, middle_m, 3.0], [length_m - 1.0, middle_m, 3.0]];
    let mut world = room(
        [length_m, width_m, 6.0],
        vec![
            drone("there", "offboard-2", ends[0], ends[1]),
            drone("back", "offboard-2", ends[1], ends[0]),
        ],
    );
    world.planning.clearance_m = 0.0;
    for drone in &mut world.drones {
        drone.vehicle = Vehicle {
            body_radius_m,
            ..drone.vehicle.clone()
        };
    }
    world
}

#[test]
fn what_whole_cells_refuse_is_planned_on_finer_ones() {
    for (length_m, width_m, body_radius_m) in [(20.0, 1.2, 0.25), (14.0, 1.4, 0.3), (9.0, 1.0, 0.2)]
    {
        let world = tall_corridor(length_m, width_m, body_radius_m);
        let planned = answered(&world);
        assert!(planned.plan.is_safe(), "{:#?}", planned.failures);
        assert_sound(&world, &planned.plan);
    }
}

#[test]
fn a_refusal_says_how_far_it_was_looked() {
    // Too narrow for two bodies on whatever cells, and too low for one above the other.
    let mut world = tall_corridor(8.0, 0.9, 0.25);
    world.bounds_m.max.z = 1.0;
    for drone in &mut world.drones {
        drone.start_m.z = 0.5;
        drone.tasks[0].to_m.z = 0.5;
    }
    let planned = answered(&world);
    assert!(!planned.failures.is_empty());
    for failure in &planned.failures {
        let FailureCause::Obstructed { extent, .. } = &failure.cause else {
            panic!("{:?}", failure.cause);
        };
        match extent.expect("it was tried again") {
            Extent::NotFound { cell_m } | Extent::BudgetEnded { cell_m, .. } => {
                assert!(cell_m < 1.0, "{cell_m}")
            }
            Extent::Proven => panic!("walls alone leave room"),
        }
    }
}

#[test]
fn an_air_limit_that_is_advised_is_enough() {
    let corridor = include_str!("../../../scenarios/corridor.ron");
    let mut advised = 0;
    for air_limit in [0.2, 0.3, 0.4] {
        let mut world = planner::read_world(corridor).expect("in order");
        for drone in &mut world.drones {
            drone.air_limit = air_limit;
        }
        let planned = answered(&world);
        for failure in &planned.failures {
            let FailureCause::Obstructed {
                remedy: Remedy::RaiseLimits(pass),
                ..
            } = &failure.cause
            else {
                continue;
            };
            let Some(air_limit) = pass.air_limit else {
                continue;
            };
            let mut raised = world.clone();
            for drone in &mut raised.drones {
                if pass.drones.contains(&drone.name) {
                    drone.air_limit = air_limit;
                }
            }
            let outcome = plan_world(&raised, &Control::QUIET).expect("in order");
            assert!(matches!(outcome, Outcome::Safe(_)), "{}", failure.cause);
            advised += 1;
        }
    }
    assert!(advised > 0);
}
