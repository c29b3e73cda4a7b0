//! A "no" is about the place, as far as it was looked at; and what is advised has been planned.

use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::Point3;
use planner::plan::cause::{ClosedBy, Exclusion, Extent, Remedy};
use planner::plan::outcome::Failure;
use planner::scenario::world::{
    AtStart, Obstacle, PathMotion, Relaxable, Solid, Vehicle, World, Zone,
};
use planner::verify::examination::examine;
use planner::{Control, FailureCause, Outcome, Planned, plan_world};

use super::assert_sound;
use super::worlds::{block, drone, room, task};

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

/// The same, too narrow and too low for the two to pass on any side: half a metre by four tenths
/// for centres that are seven tenths apart.
fn closed_corridor() -> World {
    let mut world = tall_corridor(8.0, 0.5, 0.25);
    world.bounds_m.max.z = 0.75;
    for drone in &mut world.drones {
        drone.start_m.z = 0.55;
        drone.tasks[0].to_m.z = 0.55;
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
    let planned = answered(&closed_corridor());
    assert!(!planned.failures.is_empty());
    for failure in &planned.failures {
        let FailureCause::Obstructed { extent, .. } = &failure.cause else {
            panic!("{:?}", failure.cause);
        };
        match extent.expect("it was tried again") {
            Extent::NotFound { cell_m } | Extent::BudgetEnded { cell_m, .. } => {
                assert!(cell_m < 1.0, "{cell_m}")
            }
            other => panic!("walls alone leave room, and time does not end: {other}"),
        }
    }
}

#[test]
fn a_refusal_that_was_not_looked_into_to_the_end_says_that_planning_was_stopped() {
    let world = closed_corridor();
    let asked = AtomicUsize::new(0);
    let extents = |most: usize| {
        asked.store(0, Ordering::Relaxed);
        let stop = || asked.fetch_add(1, Ordering::Relaxed) >= most;
        let control = Control {
            stop: &stop,
            ..Control::QUIET
        };
        let outcome = plan_world(&world, &control).expect("in order");
        let failures = outcome.into_planned().expect("a plan").failures;
        let extents = failures.into_iter().map(|it| match it.cause {
            FailureCause::Obstructed { extent, .. } => extent,
            _ => None,
        });
        extents.collect::<Vec<_>>()
    };
    let whole = extents(usize::MAX);
    let times = asked.load(Ordering::Relaxed);
    let is_stopped = |it: &Option<Extent>| matches!(it, Some(Extent::Stopped { .. }));
    let mut stopped = 0;
    for share in [4, 2] {
        let told = extents(times / share);
        stopped += told.iter().filter(|it| is_stopped(it)).count();
        let is_said = |it: &Option<Extent>| it.is_none() || is_stopped(it) || whole.contains(it);
        assert!(told.iter().all(is_said), "{told:?}, {whole:?}");
    }
    assert!(stopped > 0);
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

/// A wall across a room with a slit (m) that lies beside every lattice.
fn slit(begins_m: f64, wide_m: f64) -> World {
    let mut world = room(
        [10.0, 6.0, 3.0],
        vec![
            drone("there", "kolibri", [1.0, 5.0, 1.0], [9.0, 1.0, 2.0]),
            drone("back", "kolibri", [9.0, 5.0, 1.0], [1.0, 1.0, 2.0]),
        ],
    );
    let walls = [
        block("low", [4.0, 0.0, 0.0], [4.5, begins_m, 3.0]),
        block("high", [4.0, begins_m + wide_m, 0.0], [4.5, 6.0, 3.0]),
    ];
    world.obstacles.extend(walls);
    world
}

#[test]
fn drones_fly_through_a_slit_that_no_lattice_has_and_a_slit_that_is_too_narrow_is_proven_to_be() {
    for begins_m in [1.713, 2.137, 3.291] {
        let world = slit(begins_m, 0.43);
        let planned = answered(&world);
        assert!(planned.plan.is_safe(), "{begins_m}: {:?}", planned.failures);
        assert_sound(&world, &planned.plan);
        let narrow = answered(&slit(begins_m, 0.37));
        assert_eq!(narrow.failures.len(), 2);
        for failure in &narrow.failures {
            let FailureCause::NoPath(Some(missing)) = &failure.cause else {
                panic!("{:?}", failure.cause);
            };
            assert_eq!(missing.extent, Extent::Proven);
        }
    }
}

#[test]
fn what_closes_the_way_is_named() {
    let alley = || {
        room(
            [12.0, 4.0, 3.0],
            vec![drone("k", "kolibri", [1.0, 2.0, 1.5], [11.0, 2.0, 1.5])],
        )
    };
    let closed_by = |world: &World| match &answered(world).failures[..] {
        [failure] => match &failure.cause {
            FailureCause::NoPath(Some(missing)) => missing.closed_by.clone(),
            cause => panic!("{cause:?}"),
        },
        failures => panic!("{failures:?}"),
    };
    let zone = |name: &str, from_m: f64, to_m: f64| Zone {
        name: name.to_owned(),
        min_m: Point3::new(from_m, 0.0, 0.0),
        max_m: Point3::new(to_m, 4.0, 3.0),
        air_limit_mps: None,
        keep_out: true,
    };
    let mut people = alley();
    people.zones.push(zone("people", 5.0, 7.0));
    let named = |names: &[&str]| ClosedBy::Zones(names.iter().map(|it| (*it).into()).collect());
    assert_eq!(closed_by(&people), named(&["people"]));
    // Each of two closes the way by itself.
    people.zones.push(zone("more people", 8.0, 9.0));
    assert_eq!(closed_by(&people), named(&["people", "more people"]));
    let mut walled = alley();
    walled
        .obstacles
        .push(block("wall", [5.0, 0.0, 0.0], [5.5, 4.0, 3.0]));
    assert_eq!(closed_by(&walled), ClosedBy::Solids);
    assert_eq!(closed_by_gap(), ClosedBy::Gap);
    // A table over the pad, of which there is a way at the same height.
    let mut below = alley();
    below.drones[0].at_start = AtStart::Landed;
    below.drones[0].start_m.z = 0.0959;
    below
        .obstacles
        .push(block("table", [0.2, 1.0, 0.5], [2.0, 3.0, 0.6]));
    let ClosedBy::TakeOff(rises_m) = closed_by(&below) else {
        panic!("{:?}", closed_by(&below));
    };
    assert!((0.5..0.9).contains(&rises_m), "{rises_m}");
    let mut wide = alley();
    wide.planning.clearance_m = 3.0;
    wide.obstacles
        .push(block("post", [5.8, 1.8, 0.0], [6.2, 2.2, 3.0]));
    let ClosedBy::Clearance(clearance_m) = closed_by(&wide) else {
        panic!("{:?}", closed_by(&wide));
    };
    wide.planning.clearance_m = clearance_m;
    assert!(answered(&wide).failures.is_empty(), "{clearance_m}");
}

fn closed_by_gap() -> ClosedBy {
    let failures = answered(&slit(1.713, 0.3)).failures;
    let FailureCause::NoPath(Some(missing)) = &failures[0].cause else {
        panic!("{failures:?}");
    };
    missing.closed_by.clone()
}

#[test]
fn a_drone_that_cannot_be_there_in_time_is_offered_when_it_is_and_then_planned() {
    let mut world = room(
        [12.0, 6.0, 3.0],
        vec![drone("k", "kolibri", [1.0, 3.0, 1.0], [11.0, 5.0, 1.0])],
    );
    world.drones[0].tasks[0].during_s = Some([2.0, 4.0]);
    let planned = answered(&world);
    let FailureCause::TooLate { task, due_s, .. } = planned.failures[0].cause else {
        panic!("{:?}", planned.failures);
    };
    assert_eq!((task, due_s), (1, Some(2.0)));
    for motion in [PathMotion::Smooth, PathMotion::Straight] {
        world.planning.motion = motion;
        world.planning.relaxable = Relaxable::default();
        let mut due = |due_s: f64| {
            world.drones[0].tasks[0].during_s = Some([due_s, 20.0]);
            answered(&world)
        };
        let FailureCause::TooLate {
            at_s, is_proven, ..
        } = due(2.0).failures[0].cause
        else {
            panic!("late at all");
        };
        assert!(is_proven);
        // Along the lattice it is late still, though not in a straight line.
        let FailureCause::TooLate { is_proven, .. } = due(at_s - 0.1).failures[0].cause else {
            panic!("late by a little");
        };
        assert!(!is_proven);
        let planned = due((at_s * 10.0).ceil() / 10.0);
        assert!(planned.plan.is_safe(), "{:?}", planned.failures);
    }
}

#[test]
fn drones_fly_through_a_passage_at_thirty_degrees() {
    let mut world = room(
        [10.0, 8.0, 3.0],
        vec![drone("k", "kolibri", [1.0, 1.0, 1.0], [9.0, 7.0, 2.0])],
    );
    // A wall four metres thick with a straight passage of 0.46 m through its middle.
    let aside_m = 0.23 / 30.0_f64.to_radians().cos();
    let edge_m =
        |x_m: f64, side: f64| 4.013 + (x_m - 5.0) * 30.0_f64.to_radians().tan() + side * aside_m;
    for (name, side, end_m) in [("low", -1.0, 0.0), ("high", 1.0, 8.0)] {
        let mut floor_m = [
            [3.0, end_m],
            [7.0, end_m],
            [7.0, edge_m(7.0, side)],
            [3.0, edge_m(3.0, side)],
        ];
        if side > 0.0 {
            floor_m.reverse();
        }
        let corner = |[x, y]: [f64; 2], z: f64| Point3::new(x, y, z);
        let bottom = floor_m.iter().map(|it| corner(*it, 0.0));
        let vertices_m = bottom.chain(floor_m.iter().map(|it| corner(*it, 3.0)));
        let sides = (0..4).flat_map(|k| {
            let next = (k + 1) % 4;
            [[k, next, next + 4], [k, next + 4, k + 4]]
        });
        let ends = [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]];
        world.obstacles.push(Obstacle {
            name: name.to_owned(),
            shape: Solid::Mesh {
                mesh: format!("{name}.obj"),
                vertices_m: vertices_m.collect(),
                triangles: sides.chain(ends).collect(),
            },
        });
    }
    let planned = answered(&world);
    assert!(planned.plan.is_safe(), "{:?}", planned.failures);
    assert_sound(&world, &planned.plan);
}

#[test]
fn a_drone_whose_downwash_is_too_strong_at_its_task_is_offered_a_place_with_which_it_is_planned() {
    let mut world = room(
        [12.0, 6.0, 4.0],
        vec![drone("k", "kolibri", [1.0, 1.0, 1.0], [11.0, 5.0, 1.0])],
    );
    world.drones[0].tasks.insert(0, task([6.0, 3.2, 2.0], 5.0));
    world.zones.push(Zone {
        name: "belt".to_owned(),
        min_m: Point3::new(6.2, 2.0, 0.0),
        max_m: Point3::new(8.5, 4.0, 1.0),
        air_limit_mps: Some(1.0),
        keep_out: false,
    });
    let planned = answered(&world);
    let FailureCause::Obstructed { remedy, extent, .. } = &planned.failures[0].cause else {
        panic!("{:?}", planned.failures);
    };
    assert_eq!(*extent, Some(Extent::Proven));
    let Remedy::MoveTask(moved) = remedy else {
        panic!("{remedy:?}");
    };
    world.drones[0].tasks[moved.task - 1].to_m = moved.to_m;
    let outcome = plan_world(&world, &Control::QUIET).expect("in order");
    assert!(matches!(outcome, Outcome::Safe(_)));
}

/// A drone whose wake is too strong for a zone over the whole floor, under a low ceiling.
fn below_a_ceiling(tasks_m: &[[f64; 3]], zone: [[f64; 3]; 2]) -> World {
    let mut world = room(
        [20.0, 20.0, 4.0],
        vec![drone("k", "kolibri", [2.0, 10.0, 2.0], tasks_m[0])],
    );
    world.drones[0].tasks = tasks_m.iter().map(|to_m| task(*to_m, 0.0)).collect();
    world.zones.push(Zone {
        name: "belt".to_owned(),
        min_m: zone[0].into(),
        max_m: zone[1].into(),
        air_limit_mps: Some(1.0),
        keep_out: false,
    });
    world
}

#[test]
fn above_a_zone_bounds_that_reach_farther_up_are_reported_and_planned() {
    let task_above = below_a_ceiling(
        &[[10.0, 10.0, 2.0], [2.0, 10.0, 2.0]],
        [[6.0, 6.0, 0.0], [14.0, 14.0, 1.0]],
    );
    let across = below_a_ceiling(&[[18.0, 10.0, 2.0]], [[6.0, 0.0, 0.0], [14.0, 20.0, 1.0]]);
    for (mut world, moves) in [(task_above, true), (across, false)] {
        let planned = answered(&world);
        let FailureCause::Obstructed { remedy, .. } = &planned.failures[0].cause else {
            panic!("{:?}", planned.failures);
        };
        let Remedy::RaiseBounds(higher) = remedy else {
            panic!("{remedy:?}");
        };
        assert_eq!(higher.moved.is_some(), moves);
        world.bounds_m.max.z = higher.max_z_m;
        if let Some(moved) = &higher.moved {
            assert!(moved.to_m.z > 4.0, "{moved:?}");
            world.drones[0].tasks[moved.task - 1].to_m = moved.to_m;
        }
        let outcome = plan_world(&world, &Control::QUIET).expect("in order");
        assert!(matches!(outcome, Outcome::Safe(_)), "{higher}");
    }
}

/// So many drones, two metres apart in rows of ten, that fly over a zone to their tasks and back.
fn above_one_zone(drones: usize, is_beyond: bool) -> World {
    let rows = drones.div_ceil(10) as f64;
    let (wide_m, deep_m) = (24.0, 2.0 * rows + 2.0);
    let drones = (0..drones).map(|k| {
        let [x, y] = [k % 10, k / 10].map(|it| 2.0 + 2.0 * it as f64);
        let start_m = [x, y, 3.0];
        let beyond_m = if is_beyond { 10.0 } else { 0.0 };
        let mut drone = drone(&format!("d{k}"), "kolibri", start_m, start_m);
        drone.tasks = vec![task([x + wide_m + beyond_m, y, 3.0], 0.0)];
        if !is_beyond {
            drone.tasks.push(task(start_m, 0.0));
        }
        drone
    });
    let mut world = room([2.0 * wide_m + 10.0, deep_m, 8.0], drones.collect());
    let until_m = if is_beyond {
        wide_m + 8.0
    } else {
        2.0 * wide_m + 10.0
    };
    world.zones.push(Zone {
        name: "belt".to_owned(),
        min_m: Point3::new(wide_m, 0.0, 0.0),
        max_m: Point3::new(until_m, deep_m, 1.0),
        air_limit_mps: Some(0.3),
        keep_out: false,
    });
    world
}

/// The budget is one of states, so that the answer is the same anywhere.
#[test]
fn a_refusal_of_many_drones_by_one_zone_takes_few_states_and_says_what_was_not_tried() {
    for (drones, is_beyond, most) in [(60, false, 10_000), (60, true, 700_000)] {
        let planned = answered(&above_one_zone(drones, is_beyond));
        assert_eq!(planned.failures.len(), drones);
        let states = planned.effort.expansions;
        assert!(states < most, "{states}");
        let remedy = |cause: &FailureCause| match cause {
            FailureCause::Obstructed { remedy, extent, .. } => {
                assert!(extent.is_some(), "{cause}");
                remedy.clone()
            }
            other => panic!("{other}"),
        };
        let last = remedy(&planned.failures[drones - 1].cause);
        assert_eq!(last, Remedy::BudgetEnded);
    }
}

#[test]
fn of_more_goals_than_are_asked_about_one_by_one_all_are_moved_together() {
    let pairs = 45;
    let drones = (0..2 * pairs).map(|k| {
        let [x, y] = [k % 10, k / 10].map(|it| 2.0 + 2.0 * it as f64);
        // Every second goal is too near the one before it.
        let near_m = if k % 2 == 1 { -1.7 } else { 0.0 };
        let goal_m = [x + 24.0 + near_m, y, 3.0];
        drone(&format!("d{k}"), "kolibri", [x, y, 3.0], goal_m)
    });
    let mut world = room([48.0, 22.0, 6.0], drones.collect());
    let planned = answered(&world);
    let told = &planned.conflicts;
    assert_eq!((told.worst.len(), told.more), (pairs, 0));
    for conflict in &told.worst {
        let to_m = conflict.nearest_fix_m.expect("a place");
        world.drones[conflict.drone].tasks[0].to_m = to_m;
    }
    let outcome = plan_world(&world, &Control::QUIET).expect("in order");
    assert!(matches!(outcome, Outcome::Safe(_)));
}

#[test]
fn a_goal_above_a_zone_is_moved_to_where_it_is_planned_or_not_at_all() {
    let mut world = room(
        [12.0, 12.0, 8.0],
        vec![drone("b", "offboard-2", [1.0, 3.0, 4.0], [9.0, 5.0, 5.0])],
    );
    world.drones[0].tasks.insert(0, task([3.0, 9.0, 4.0], 0.0));
    world.zones.push(Zone {
        name: "desk".to_owned(),
        min_m: Point3::new(8.0, 4.0, 0.0),
        max_m: Point3::new(10.0, 6.0, 1.5),
        air_limit_mps: Some(1.0),
        keep_out: false,
    });
    let planned = answered(&world);
    let FailureCause::GoalConflict(Some(conflict)) = &planned.failures[0].cause else {
        panic!("{:?}", planned.failures);
    };
    let told = &planned.conflicts.worst[0];
    assert_eq!(told.nearest_fix_m, conflict.nearest_fix_m);
    let there_m = told.nearest_fix_m.expect("a place for it");
    world.drones[0].tasks[1].to_m = there_m;
    let outcome = plan_world(&world, &Control::QUIET).expect("in order");
    assert!(matches!(outcome, Outcome::Safe(_)), "{there_m}");
}

#[test]
fn a_tracking_margin_that_a_spacing_cannot_hold_is_named_with_one_that_is_planned() {
    let grid = |k: usize| [0.25 * (k % 3) as f64, 0.25 * (k / 3) as f64, 0.0];
    let drones = (0..9).map(|k| {
        let [x, y, _] = grid(k);
        drone(
            &format!("c{k}"),
            "crazyflie-2.1",
            [1.0 + x, 1.0 + y, 1.0],
            [4.0 + x, 4.0 + y, 1.0],
        )
    });
    let mut world = room([6.0, 6.0, 3.0], drones.collect());
    world.planning.cell_m = 0.25;
    world.planning.clearance_m = 0.05;
    let Ok(Outcome::Infeasible { conflicts }) = plan_world(&world, &Control::QUIET) else {
        panic!("starts within one another's margins");
    };
    let bears_m = conflicts.worst.iter().map(|it| match it.why {
        Exclusion::Bodies { tracking_m, .. } => tracking_m,
        _ => None,
    });
    let bears_m: Vec<Option<f64>> = bears_m.collect();
    let one_m = bears_m[0].expect("there is one that would do");
    assert!(bears_m.iter().all(|it| *it == Some(one_m)), "{bears_m:?}");
    world.planning.margins.tracking_m = one_m;
    let outcome = plan_world(&world, &Control::QUIET).expect("in order");
    assert!(matches!(outcome, Outcome::Safe(_)));
}

fn read(text: &str) -> World {
    let world = planner::read_world(text).unwrap_or_else(|problems| panic!("{problems:#?}"));
    world.relaxed().unwrap_or(world)
}

/// A wall with a gap half a metre wide, which no step of one metre passes: the way round it takes
/// three times as long as there is.
#[test]
fn a_place_is_reported_with_which_others_are_planned_by_a_closer_look_alone() {
    let world = read(
        r#"Scenario(name: "occupied", bounds_m: (min: (0, 0, 0), max: (10, 10, 5)), drones: [
            (name: "a", airframe: "kolibri", start_m: (1, 1, 1), tasks: [(to_m: (5, 5, 1))]),
            (name: "b", airframe: "kolibri", start_m: (5.2, 5, 1)),
            (name: "c", airframe: "kolibri", start_m: (9, 9, 1), tasks: [(to_m: (5, 5, 2))])])"#,
    );
    let refused = answered(&world);
    let [failure] = &refused.failures[..] else {
        panic!("{:?}", refused.failures);
    };
    let FailureCause::GoalConflict(Some(conflict)) = &failure.cause else {
        panic!("{:?}", failure.cause);
    };
    assert_eq!(conflict.drone, "a");
    let mut moved = world.clone();
    moved.drones[0].tasks[0].to_m = conflict.nearest_fix_m.expect("a place");
    let planned = answered(&moved);
    assert!(planned.plan.is_safe(), "{:#?}", planned.failures);
    assert_sound(&moved, &planned.plan);
}

#[test]
fn an_appointment_beyond_a_gap_that_whole_cells_miss_is_kept_on_finer_ones() {
    let world = read(
        r#"Scenario(name: "gap", bounds_m: (min: (0, 0, 0), max: (20, 20, 2)),
        obstacles: [
            (name: "low", min_m: (9.9, 0, 0), max_m: (10.1, 1.25, 2)),
            (name: "high", min_m: (9.9, 1.75, 0), max_m: (10.1, 18, 2)),
        ],
        drones: [(name: "k1", airframe: "kolibri", start_m: (9, 1, 1),
            tasks: [(to_m: (11, 1, 1), during_s: (6, 7))])],
        planning: (cell_m: 1))"#,
    );
    let planned = answered(&world);
    assert!(planned.plan.is_safe(), "{:#?}", planned.failures);
    assert_sound(&world, &planned.plan);
    // Nothing flies two metres in half a second.
    let mut hurried = world;
    hurried.drones[0].tasks[0].during_s = Some([0.5, 7.0]);
    let planned = answered(&hurried);
    let FailureCause::TooLate { is_proven, .. } = planned.failures[0].cause else {
        panic!("{:#?}", planned.failures);
    };
    assert!(is_proven);
}

/// The chords of smooth motion widen every gap by four centimetres, which side by side nothing
/// needs.
#[test]
fn drones_that_stand_hardly_farther_apart_than_they_must_fly_smooth() {
    let world = read(
        r#"Scenario(name: "beside", bounds_m: (min: (0, 0, 0), max: (6, 6, 3)),
        drones: [
            (name: "a", airframe: "crazyflie-2.1", start_m: (1, 1, 1), tasks: [(to_m: (1, 5, 1))]),
            (name: "b", airframe: "crazyflie-2.1", start_m: (1.36, 1, 1),
                tasks: [(to_m: (1.36, 5, 1))]),
        ],
        planning: (motion: Smooth))"#,
    );
    let planned = answered(&world);
    assert!(planned.plan.is_safe(), "{:#?}", planned.failures);
    assert_sound(&world, &planned.plan);
}

/// Between two walls, where bounds at lanes of halves of a metre keep the search off.
#[test]
fn drones_pass_one_another_between_walls_in_lanes_that_are_no_halves_of_a_metre() {
    let world = read(
        r#"Scenario(name: "walls", bounds_m: (min: (0, 0, 0), max: (20, 10, 6)), air: (),
        obstacles: [
            (min_m: (0, 0, 0), max_m: (20, 4.25, 6)), (min_m: (0, 5.75, 0), max_m: (20, 10, 6)),
        ],
        airframes: {"ox": (mass_kg: 1.207, propellers: 4, propeller_diameter_m: 0.1295,
            motor_distance_m: 0.266, body_radius_m: 0.25, max_speed_mps: 2.0)},
        drones: [
            (name: "there", airframe: "ox", start_m: (1, 5, 3), tasks: [(to_m: (19, 5, 3))]),
            (name: "back", airframe: "ox", start_m: (19, 5, 3), tasks: [(to_m: (1, 5, 3))]),
        ])"#,
    );
    let planned = answered(&world);
    assert!(planned.plan.is_safe(), "{:#?}", planned.failures);
    assert_sound(&world, &planned.plan);
}

/// In a tunnel 1 m wide with two bays, where the middle lane of cells of a quarter of a metre
/// leaves nothing to either side: on larger cells there are two.
#[test]
fn a_small_fleet_that_is_slow_on_the_cells_chosen_for_it_is_planned_on_larger_ones() {
    let world = read(
        r#"Scenario(name: "tunnel", bounds_m: (min: (0, 0, 0), max: (20, 5, 2.5)), obstacles: [
            (min_m: (2, 0, 0), max_m: (18, 2, 2.5)),
            (min_m: (2, 3, 0), max_m: (6, 5, 2.5)),
            (min_m: (7.2, 3, 0), max_m: (12, 5, 2.5)),
            (min_m: (13.2, 3, 0), max_m: (18, 5, 2.5)),
            (min_m: (6, 4.2, 0), max_m: (7.2, 5, 2.5)),
            (min_m: (12, 4.2, 0), max_m: (13.2, 5, 2.5)),
        ], drones: [
            (name: "e1", airframe: "offboard-1", start_m: (0.5, 0.8, 1),
                tasks: [(to_m: (19.5, 1.6, 1), dwell_s: 2)]),
            (name: "w1", airframe: "offboard-1", start_m: (19.5, 0.7, 1),
                tasks: [(to_m: (0.5, 1.7, 1), dwell_s: 2)]),
            (name: "e2", airframe: "kolibri", start_m: (1.4, 0.8, 1),
                tasks: [(to_m: (18.6, 1.6, 1), dwell_s: 2)]),
            (name: "w2", airframe: "kolibri", start_m: (18.6, 0.7, 1),
                tasks: [(to_m: (1.4, 1.7, 1), dwell_s: 2)]),
        ])"#,
    );
    let planned = answered(&world);
    assert!(planned.plan.is_safe(), "{:#?}", planned.failures);
    // Alone each takes some 11 s.
    let makespan_s = planned.plan.fleet.makespan_s;
    assert!(makespan_s < 30.0, "{makespan_s} s");
    assert_sound(&world, &planned.plan);
}

/// A drone that takes off from a bay below a shelf, and lands there again.
fn below_a_shelf(height_m: f64) -> World {
    let shelf_m = 0.05 + height_m;
    let above_m = shelf_m + 0.05;
    read(&format!(
        r#"Scenario(name: "bay", bounds_m: (min: (0, 0, 0), max: (8, 5, 6)), obstacles: [
            (min_m: (3, 0, 0), max_m: (5, 0.1, 6)), (min_m: (2.9, 0, 0), max_m: (3, 1.2, 6)),
            (min_m: (5, 0, 0), max_m: (5.1, 1.2, 6)), (min_m: (3, 0.1, 0), max_m: (5, 1.2, 0.05)),
            (min_m: (3, 0.1, {shelf_m}), max_m: (5, 1.2, {above_m})),
        ], drones: [(name: "d0", airframe: "kolibri", start_m: (4, 0.65, 0.146), tasks: [
            (to_m: (3.4, 3.2, 0.8), dwell_s: 2), (to_m: (4, 0.65, 0.4))],
            at_start: Landed, at_end: Land)], planning: (motion: Smooth))"#
    ))
}

#[test]
fn the_height_that_a_landing_lacks_below_a_shelf_is_what_it_needs() {
    for height_m in [0.8, 0.95, 1.1] {
        let refused = answered(&below_a_shelf(height_m)).failures;
        let [
            Failure {
                cause: FailureCause::NoRoomToLand { lacks, .. },
                ..
            },
        ] = &refused[..]
        else {
            panic!("{height_m} m: {refused:#?}");
        };
        assert!(lacks.is_height, "{lacks:?}");
        let planned = answered(&below_a_shelf(height_m + lacks.short_m + 0.01));
        assert!(
            planned.plan.is_safe(),
            "{height_m} m: {:#?}",
            planned.failures
        );
    }
}

#[test]
fn two_windows_at_one_place_that_meet_are_one_stay() {
    let world = read(
        r#"Scenario(name: "windows", bounds_m: (min: (0, 0, 0), max: (12, 12, 6)),
        drones: [(name: "k1", airframe: "kolibri", start_m: (1, 1, 1),
            tasks: [(to_m: (5, 1, 1), during_s: (10, 20)), (to_m: (5, 1, 1), during_s: (20, 30))])],
        planning: (motion: Smooth))"#,
    );
    let planned = answered(&world);
    assert!(planned.plan.is_safe(), "{:#?}", planned.failures);
    let flown = &planned.plan.drones[0].trajectory;
    for at_s in [10.0, 19.9, 20.1, 30.0] {
        let at_m = flown.position_m(at_s).expect("it is there");
        assert!((at_m - Point3::new(5.0, 1.0, 1.0)).norm() < 1e-6, "{at_m}");
    }
}

/// The second is dwelt whole with its load, whichever other drone comes there in between.
#[test]
fn two_dwells_at_one_place_are_each_kept() {
    for (tasks, other) in [
        (
            "(to_m: (5.5, 2.5, 1.5), dwell_s: 2), (to_m: (5.5, 2.5, 1.5), dwell_s: 3, load_kg: 0.02)",
            "",
        ),
        (
            "(to_m: (5.5, 2.5, 1.5), dwell_s: 4), (to_m: (5.5, 2.5, 1.5), dwell_s: 6)",
            r#", (name: "b", airframe: "kolibri", start_m: (1.5, 6.5, 1.5),
                tasks: [(to_m: (5.5, 2.5, 1.5), during_s: (10, 14)), (to_m: (9.5, 6.5, 1.5))])"#,
        ),
    ] {
        let world = read(&format!(
            r#"Scenario(name: "dwells", bounds_m: (min: (0, 0, 0), max: (12, 8, 4)), drones: [
            (name: "a", airframe: "kolibri", start_m: (2.5, 2.5, 1.5),
                tasks: [{tasks}, (to_m: (8.5, 2.5, 1.5))]){other}])"#
        ));
        let planned = answered(&world);
        assert!(planned.plan.is_safe(), "{:#?}", planned.failures);
        assert_sound(&world, &planned.plan);
    }
}

/// Pads in a rack, and between a rack and a post that is nearer than a drone may stray.
#[test]
fn where_a_landed_drone_cannot_stand_it_can_at_the_place_that_is_reported() {
    for (tasks, start) in [
        ("", (4.5, 4.3)),
        ("", (3.9, 5.0)),
        ("(to_m: (8, 8, 2))", (4.5, 4.3)),
        ("(to_m: (8, 8, 2))", (3.9, 5.0)),
    ] {
        let text = |x: f64, y: f64, z: f64| {
            format!(
                r#"Scenario(name: "pads", bounds_m: (min: (0, 0, 0), max: (10, 10, 4)),
                obstacles: [
                    (name: "rack", min_m: (4, 4, 0), max_m: (5, 6, 2)),
                    (name: "post", base_m: (3.4, 5, 0), radius_m: 0.3, height_m: 2),
                ],
                drones: [(name: "k1", airframe: "offboard-1", start_m: ({x}, {y}, {z}), at_start: Landed,
                    tasks: [{tasks}])])"#
            )
        };
        let problems = planner::read_world(&text(start.0, start.1, 0.198)).expect_err("no room");
        let [problem] = &problems.0[..] else {
            panic!("{problems:#?}");
        };
        let help = problem.help.as_deref().expect("a place is told");
        let place = help.split(['(', ')']).nth(1).expect("a place");
        let place: Vec<f64> = place.split(", ").filter_map(|it| it.parse().ok()).collect();
        let again = planner::read_world(&text(place[0], place[1], place[2]));
        assert!(again.is_ok(), "{help}: {again:#?}");
    }
}

/// A zone across most of a hall lets one by at its far side alone: who is due before it can be
/// there that way is late, whatever zone it would be stopped by if it flew straight on.
#[test]
fn a_drone_that_crosses_a_zone_too_late_is_refused_with_when_it_is_there_and_not_with_the_zone() {
    let world = |due_s: f64, dwell_s: f64| {
        read(&format!(
            r#"Scenario(name: "late", bounds_m: (min: (0, 0, 0), max: (20, 20, 3)),
            zones: [(name: "belt", min_m: (8, 0, 0), max_m: (12, 14, 3), air_limit_mps: 0.3)],
            drones: [(name: "k1", airframe: "kolibri", start_m: (2, 2, 1), tasks: [
                (to_m: (2, 3, 1), dwell_s: {dwell_s}),
                (to_m: (18, 2, 1), during_s: ({due_s}, {due_s})),
            ])],
            planning: (cell_m: 1, motion: Straight))"#
        ))
    };
    for (due_s, dwell_s, is_sure) in [(14.0, 0.0, false), (14.0, 13.0, true)] {
        let planned = answered(&world(due_s, dwell_s));
        let FailureCause::TooLate {
            task,
            at_s,
            due_s: told_s,
            is_proven,
        } = planned.failures[0].cause
        else {
            panic!("{}", planned.failures[0].cause);
        };
        assert_eq!((task, told_s, is_proven), (2, Some(due_s), is_sure));
        // Sixteen metres at 2 m/s are far less than the way round, which it flies when it may.
        assert!(at_s > due_s, "{at_s}");
        let later = world((at_s + 1.0).ceil(), dwell_s);
        if !is_sure {
            let planned = answered(&later);
            assert!(planned.plan.is_safe(), "{:#?}", planned.failures);
            assert_sound(&later, &planned.plan);
        }
    }
}

#[test]
fn limits_that_are_raised_together_are_named_together() {
    let world = read(
        r#"Scenario(name: "pairs", bounds_m: (min: (0, 0, 0), max: (20, 8, 4)), drones: [
            (name: "a", airframe: "offboard-1", start_m: (2, 2, 3), tasks: [(to_m: (5, 5, 3))]),
            (name: "b", airframe: "kolibri", start_m: (5, 2, 1), tasks: [(to_m: (5, 5, 1))]),
            (name: "c", airframe: "offboard-1", start_m: (12, 2, 3), tasks: [(to_m: (15, 5, 3))]),
            (name: "d", airframe: "kolibri", start_m: (15, 2, 1), tasks: [(to_m: (15, 5, 1))]),
        ])"#,
    );
    let planned = answered(&world);
    assert_eq!(planned.failures.len(), 2);
    for (failure, other) in planned.failures.iter().zip(["d", "b"]) {
        let FailureCause::GoalConflict(Some(conflict)) = &failure.cause else {
            panic!("{}", failure.cause);
        };
        let mut raised = world.clone();
        for drone in &mut raised.drones {
            let mut limits = conflict.raised.iter();
            let limit = limits.find(|(name, _)| *name == drone.name);
            drone.air_limit = limit.map_or(drone.air_limit, |(_, limit)| *limit);
        }
        let outcome = plan_world(&raised, &Control::QUIET).expect("in order");
        assert!(matches!(outcome, Outcome::Safe(_)), "{}", failure.cause);
        let [own, of_other] = [&failure.drone, other].map(|name| {
            let mut limits = conflict.raised.iter();
            let limit = limits.find(|it| it.0 == *name).expect("both").1;
            format!("`{name}` to {limit:.2}")
        });
        let told = format!(
            "(with the air_limits of {own} and {of_other} raised together all are planned)"
        );
        assert!(
            failure.cause.to_string().contains(&told),
            "{}",
            failure.cause
        );
    }
}

/// A drone above the limit that would do for the others is not told to raise its own to it.
#[test]
fn no_limit_is_raised_to_less_than_it_is() {
    let world = read(
        r#"Scenario(name: "lower", bounds_m: (min: (0, 0, 0), max: (8, 8, 4)), air: (convection: None),
        drones: [
            (name: "a", airframe: "offboard-1", start_m: (1, 1, 3), tasks: [(to_m: (7, 7, 3)), (to_m: (1, 1, 3))]),
            (name: "b", airframe: "offboard-2", start_m: (7, 1, 2), tasks: [(to_m: (1, 7, 2), dwell_s: 2), (to_m: (7, 1, 2))]),
            (name: "c", airframe: "kolibri", start_m: (1, 7, 1), tasks: [(to_m: (7, 1, 1), dwell_s: 1)], air_limit: 1.39),
            (name: "d", airframe: "crazyflie-2.1", start_m: (4, 4, 0.5), tasks: [(to_m: (4, 7, 0.5), dwell_s: 1), (to_m: (4, 1, 0.5))]),
            (name: "x", airframe: "crazyflie-2.1", start_m: (7, 7, 1)),
        ],
        planning: (motion: Straight, time_margin_s: 0, tracking_m: 0, clearance_m: 0, air_limit: 0.3))"#,
    );
    let planned = answered(&world);
    let mut passes = planned.failures.iter().filter_map(|it| match &it.cause {
        FailureCause::Obstructed {
            remedy: Remedy::RaiseLimits(pass),
            ..
        } => Some(pass),
        _ => None,
    });
    let pass = passes.next().expect("a pass");
    let to = pass.air_limit.expect("a limit that does");
    for drone in world
        .drones
        .iter()
        .filter(|it| pass.drones.contains(&it.name))
    {
        assert!(
            drone.air_limit < to,
            "{}: {} to {to}",
            drone.name,
            drone.air_limit
        );
    }
}

/// It hovers on above another that is below, and lands when that has gone.
#[test]
fn when_a_drone_arrives_that_waits_before_it_lands_is_in_its_trajectory() {
    for motion in ["Straight", "Smooth"] {
        let world = read(&format!(
            r#"Scenario(name: "waits", bounds_m: (min: (0, 0, 0), max: (10, 10, 5)), drones: [
                (name: "c", airframe: "crazyflie-2.1", start_m: (2, 2, 4),
                    tasks: [(to_m: (5, 5, 4), dwell_s: 2)], at_end: Land),
                (name: "b", airframe: "offboard-1", start_m: (8, 5, 1),
                    tasks: [(to_m: (5, 5, 1), during_s: (8, 20)), (to_m: (8, 8, 1))]),
            ], planning: (motion: {motion}))"#
        ));
        let plan = answered(&world).plan;
        assert!(plan.is_safe());
        let waits = &plan.drones[0];
        let landed_s = waits.airborne_s.1.expect("it lands");
        assert!(landed_s > 20.0 && waits.arrives_s < 8.0, "{landed_s}");
        let text = serde_json::to_string(&plan).expect("numbers");
        let file = planner::plan::file::read(&text).expect("a plan");
        let found = examine(&file, false);
        assert!(found.differences.is_empty(), "{:#?}", found.differences);
        assert_eq!(found.plan.violations, []);
        assert_eq!(found.plan.drones[0].arrives_s, waits.arrives_s);
    }
}
