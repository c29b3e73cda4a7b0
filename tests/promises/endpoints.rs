//! Starts and goals that exclude one another are all found, named, and mended by the place
//! proposed.

use airflow::{Air, Airframe, Jet, Superposition};
use nalgebra::Point3;
use planner::plan::cause::{Exclusion, FailureCause};
use planner::plan::outcome::{Blocker, EndpointConflict, EndpointKind};
use planner::scenario::world::{
    AtEnd, AtStart, Bounds, Drone, Planning, Task, Vehicle, World, Zone,
};

fn drone(name: &str, start_m: [f64; 3], goal_m: Option<[f64; 3]>) -> Drone {
    let airframe = Airframe::preset("offboard-2").expect("a preset");
    let tasks = goal_m
        .map(|to_m| Task {
            to_m: to_m.into(),
            dwell_s: 0.0,
            load_kg: None,
            during_s: None,
        })
        .into_iter()
        .collect();
    Drone {
        name: name.to_owned(),
        vehicle: Vehicle::new(airframe, 2.0, Air::default().density_kg_per_m3()),
        start_m: start_m.into(),
        at_start: AtStart::Hover,
        tasks,
        at_end: AtEnd::Hover,
        air_limit: 0.3,
    }
}

fn world(drones: Vec<Drone>) -> World {
    World {
        name: "by hand".to_owned(),
        bounds_m: Bounds {
            min: Point3::origin(),
            max: Point3::new(40.0, 40.0, 12.0),
        },
        air: Air::default(),
        jet: Jet::default(),
        effects: airflow::effects::Effects::default(),
        convection: None,
        superposition: Superposition::Momentum,
        obstacles: Vec::new(),
        zones: Vec::new(),
        drones,
        formations: Vec::new(),
        origin: None,
        notes: Vec::new(),
        planning: Planning {
            motion: planner::scenario::world::PathMotion::Straight,
            cell_m: 1.0,
            clearance_m: 0.1,
            seed: 0,
            energy_weight: 0.0,
            ..Planning::default()
        },
    }
}

/// All of them: there are few.
fn check(world: &World) -> Vec<EndpointConflict> {
    let found = planner::endpoint_conflicts(world);
    assert_eq!(found.more, 0);
    found.worst
}

fn only(conflicts: &[EndpointConflict]) -> EndpointConflict {
    assert_eq!(conflicts.len(), 1, "{conflicts:#?}");
    conflicts[0].clone()
}

/// An offset (m) and the exclusion expected of it.
type Case = ([f64; 3], fn(&Exclusion) -> bool);

/// Two starts, the second `offset_m` from the first.
fn pair(offset_m: [f64; 3]) -> World {
    let place = [10.0 + offset_m[0], 10.0 + offset_m[1], 8.0 + offset_m[2]];
    world(vec![
        drone("a", [10.0, 10.0, 8.0], Some([30.0, 30.0, 5.0])),
        drone("b", place, Some([5.0, 30.0, 5.0])),
    ])
}

#[test]
fn starts_in_body_column_and_wake_are_distinguished_and_mended() {
    // Body radius 0.198 m twice and 0.1 m off each path: 0.595 m.
    assert!(check(&pair([0.60, 0.0, 0.0])).is_empty());
    let cases: [Case; 3] = [
        (
            [0.59, 0.0, 0.0],
            |why| matches!(why, Exclusion::Bodies { gap_m, needs_m, tracking_m: Some(0.097) } if gap_m < needs_m),
        ),
        ([0.1, 0.0, -0.6], |why| matches!(why, Exclusion::Column)),
        (
            [0.2, 0.0, -3.0],
            |why| matches!(why, Exclusion::Air { alpha, limit, .. } if alpha > limit),
        ),
    ];
    for (offset_m, expected) in cases {
        let mut broken = pair(offset_m);
        let conflict = only(&check(&broken));
        assert_eq!(
            (conflict.drone, conflict.blocker, conflict.when),
            (1, Blocker::Drone(0), EndpointKind::Starts)
        );
        assert!(expected(&conflict.why), "{:?}", conflict.why);
        broken.drones[1].start_m = conflict.nearest_fix_m.expect("a free place near");
        assert!(check(&broken).is_empty());
    }
}

#[test]
fn all_that_is_advised_can_be_done_together() {
    let mut broken = pair([0.0; 3]);
    let third = Drone {
        name: "third".to_owned(),
        ..broken.drones[1].clone()
    };
    broken.drones.push(third);
    for conflict in check(&broken) {
        let fix_m = conflict.nearest_fix_m.expect("a free place near");
        let drone = &mut broken.drones[conflict.drone];
        match conflict.when {
            EndpointKind::Starts => drone.start_m = fix_m,
            EndpointKind::Goals | EndpointKind::Tasks => drone.tasks[0].to_m = fix_m,
        }
    }
    assert_eq!(check(&broken), []);
}

#[test]
fn what_is_advised_to_mend_starts_was_planned() {
    let plan = |world: &World| planner::plan_world(world, &planner::Control::QUIET).unwrap();
    let is_planned = |world: &World| matches!(plan(world), planner::Outcome::Safe(_));
    for offset_m in [[0.59, 0.0, 0.0], [0.1, 0.0, -0.6], [0.2, 0.0, -3.0]] {
        let broken = pair(offset_m);
        let planner::Outcome::Infeasible { conflicts } = plan(&broken) else {
            panic!("planned at {offset_m:?}");
        };
        let conflict = only(&conflicts.worst);
        let mut moved = broken.clone();
        moved.drones[1].start_m = conflict.nearest_fix_m.expect("a place near");
        assert!(is_planned(&moved));
        let mut changed = broken;
        match conflict.why {
            Exclusion::Bodies { tracking_m, .. } => {
                changed.planning.margins.tracking_m = tracking_m.expect("a margin that does");
            }
            Exclusion::Air { enough, .. } => {
                changed.drones[1].air_limit = enough.expect("a limit that does");
            }
            _ => continue,
        }
        assert!(is_planned(&changed), "{:?}", conflict.why);
    }
}

#[test]
fn where_the_nearest_start_does_not_do_one_to_another_side_is_advised() {
    // Up is nearest, and does not do at any distance that is tried.
    let text = r#"Scenario(name: "beside", bounds_m: (min: (0, 0, 0), max: (12, 8, 9)), drones: [
        (name: "a", airframe: "kolibri", start_m: (4, 4, 2), tasks: [(to_m: (9, 2, 2))]),
        (name: "b", airframe: "crazyflie-2.1", start_m: (4.04, 4, 2.3), tasks: [(to_m: (9, 6, 3))])])"#;
    let mut world = planner::read_world(text).unwrap();
    let plan = |world: &World| planner::plan_world(world, &planner::Control::QUIET).unwrap();
    let planner::Outcome::Infeasible { conflicts } = plan(&world) else {
        panic!("planned too near to one another");
    };
    let place_m = only(&conflicts.worst).nearest_fix_m;
    world.drones[1].start_m = place_m.expect("a place to the side");
    assert!(matches!(plan(&world), planner::Outcome::Safe(_)));
}

#[test]
fn nothing_is_advised_for_starts_that_was_not_planned() {
    // Two whose starts alone could be mended, and a third that is walled in.
    let text = r#"Scenario(name: "walled", bounds_m: (min: (0, 0, 0), max: (20, 20, 8)),
        obstacles: [
          (name: "west", min_m: (14, 14, 0), max_m: (15, 19, 8)), (name: "east", min_m: (18, 14, 0), max_m: (19, 19, 8)),
          (name: "south", min_m: (15, 14, 0), max_m: (18, 15, 8)), (name: "north", min_m: (15, 18, 0), max_m: (18, 19, 8)),
        ],
        drones: [
          (name: "a", airframe: "offboard-2", start_m: (5, 5, 6), tasks: [(to_m: (5, 15, 6))]),
          (name: "b", airframe: "offboard-2", start_m: (5.2, 5, 3), tasks: [(to_m: (10, 15, 3))]),
          (name: "c", airframe: "offboard-2", start_m: (10, 2, 3), tasks: [(to_m: (16.5, 16.5, 3))]),
        ])"#;
    let world = planner::read_world(text).unwrap();
    assert!(only(&check(&world)).nearest_fix_m.is_some());
    let outcome = planner::plan_world(&world, &planner::Control::QUIET).unwrap();
    let planner::Outcome::Infeasible { conflicts } = outcome else {
        panic!("{outcome:?}");
    };
    let conflict = only(&conflicts.worst);
    assert_eq!(conflict.nearest_fix_m, None);
    assert!(matches!(conflict.why, Exclusion::Air { enough: None, .. }));
}

#[test]
fn landed_starts_have_no_wake_and_no_limit() {
    let mut below = pair([0.2, 0.0, -3.0]);
    below.drones[1].at_start = AtStart::Landed;
    assert!(check(&below).is_empty());
    let mut above = pair([0.2, 0.0, -3.0]);
    above.drones[0].at_start = AtStart::Landed;
    assert!(check(&above).is_empty());
}

#[test]
fn a_drone_that_leaves_at_once_is_at_its_start_all_the_same() {
    let mut above = pair([0.2, 0.0, -3.0]);
    above.drones[0].tasks.clear();
    above.drones[0].at_end = AtEnd::Leave;
    assert!(matches!(only(&check(&above)).why, Exclusion::Air { .. }));
    above.drones[1].start_m.x += 2.0;
    let outcome = planner::plan_world(&above, &planner::Control::QUIET).expect("in order");
    let planner::Outcome::Safe(planned) = outcome else {
        panic!("{outcome:?}");
    };
    let left = &planned.plan.drones[0];
    assert_eq!(left.arrives_s, 0.0);
    assert_eq!(left.trajectory.t_s, [0.0, 0.01]);
}

#[test]
fn goals_are_judged_by_how_each_drone_ends() {
    let goals = |first: AtEnd, second: AtEnd| {
        let mut world = world(vec![
            drone("a", [2.0, 2.0, 5.0], Some([20.0, 20.0, 8.0])),
            drone("b", [2.0, 30.0, 5.0], Some([20.0, 20.0, 5.0])),
        ]);
        world.drones[0].at_end = first;
        world.drones[1].at_end = second;
        check(&world)
    };
    let conflict = only(&goals(AtEnd::Hover, AtEnd::Hover));
    assert_eq!((conflict.drone, conflict.when), (1, EndpointKind::Goals));
    assert!(goals(AtEnd::Leave, AtEnd::Hover).is_empty());
    assert!(goals(AtEnd::Hover, AtEnd::Leave).is_empty());
    assert!(goals(AtEnd::Hover, AtEnd::Land).is_empty());
    // Both on the same spot of the floor.
    assert!(matches!(
        only(&goals(AtEnd::Land, AtEnd::Land)).why,
        Exclusion::Bodies { .. }
    ));
}

/// Two drones with a task above the other's, each with the time it is due.
fn stacked(lower_s: Option<[f64; 2]>, upper_s: Option<[f64; 2]>) -> World {
    let mut world = world(vec![
        drone("lower", [2.0, 2.0, 5.0], Some([20.0, 20.0, 5.0])),
        drone("upper", [2.0, 30.0, 5.0], Some([20.0, 20.0, 8.0])),
    ]);
    for (drone, during_s) in world.drones.iter_mut().zip([lower_s, upper_s]) {
        drone.tasks[0].during_s = during_s;
        let mut home = drone.tasks[0].clone();
        (home.to_m, home.during_s) = (drone.start_m, None);
        drone.tasks.push(home);
    }
    world
}

#[test]
fn tasks_that_are_due_at_one_time_exclude_one_another() {
    let together = stacked(Some([20.0, 30.0]), Some([25.0, 40.0]));
    let conflict = only(&check(&together));
    assert_eq!(
        (conflict.drone, conflict.blocker, conflict.when),
        (0, Blocker::Drone(1), EndpointKind::Tasks)
    );
    let meeting = conflict.meeting.expect("of tasks");
    assert_eq!((meeting.task, meeting.their_task), (Some(1), Some(1)));
    assert_eq!(meeting.during_s, Some([25.0, 30.0]));
    assert!(matches!(conflict.why, Exclusion::Air { alpha, .. } if alpha > 0.3));
    let mut mended = together.clone();
    mended.drones[0].tasks[0].to_m = conflict.nearest_fix_m.expect("a free place near");
    assert!(check(&mended).is_empty());
    // One after the other, or whenever they come, they do not.
    assert!(check(&stacked(Some([20.0, 30.0]), Some([30.0, 40.0]))).is_empty());
    assert!(check(&stacked(Some([20.0, 30.0]), None)).is_empty());

    let outcome = planner::plan_world(&together, &planner::Control::QUIET).expect("in order");
    let planner::Outcome::Partial(planned) = outcome else {
        panic!("one stays: {outcome:?}");
    };
    assert_eq!(planned.failures.len(), 1);
    let refused = &planned.plan.unplanned[0];
    let own = together.drones.iter().find(|it| it.name == refused.name);
    let cause = refused.cause.as_ref().expect("known");
    let goal_m = own.map(|it| it.tasks[0].to_m);
    assert_eq!((cause.at_m, cause.at_s), (goal_m, Some(25.0)));
    let reason = planned.failures[0].cause.to_string();
    let said = "task 1 of `lower` is in the downwash of `upper` at its task 1 (25 to 30 s)";
    assert!(reason.starts_with(said), "{reason}");
}

#[test]
fn a_task_beside_a_drone_that_stays_is_reported() {
    let above = |at_end: AtEnd| {
        let mut world = stacked(None, None);
        let stays = &mut world.drones[0];
        stays.start_m = stays.tasks[0].to_m;
        stays.tasks.clear();
        stays.at_end = at_end;
        check(&world)
    };
    let conflict = only(&above(AtEnd::Hover));
    assert_eq!((conflict.drone, conflict.when), (0, EndpointKind::Tasks));
    let meeting = conflict.meeting.expect("of tasks");
    assert_eq!((meeting.task, meeting.their_task), (None, Some(1)));
    assert_eq!(meeting.during_s, None);
    assert!(above(AtEnd::Land).is_empty());
}

/// Of wakes that are too much together, those count that are there at one time.
#[test]
fn only_wakes_of_one_time_add_up() {
    let rings = |due_s: [f64; 3]| {
        let mut drones = vec![drone("lower", [10.0, 10.0, 3.0], None)];
        for (k, due_s) in due_s.into_iter().enumerate() {
            let (off_m, start) = (0.48, k as f64);
            let bearing = start * std::f64::consts::TAU / 3.0;
            let (x_m, y_m) = (10.0 + off_m * bearing.cos(), 10.0 + off_m * bearing.sin());
            let mut upper = drone("u", [4.0 + 6.0 * start, 30.0, 6.5], Some([x_m, y_m, 6.5]));
            upper.name = format!("u{k}");
            upper.tasks[0].during_s = Some([due_s, due_s + 10.0]);
            upper.at_end = AtEnd::Leave;
            drones.push(upper);
        }
        check(&world(drones))
    };
    let conflict = only(&rings([40.0, 45.0, 48.0]));
    assert_eq!((conflict.drone, conflict.when), (0, EndpointKind::Tasks));
    assert!(rings([40.0, 45.0, 50.0]).is_empty());
}

#[test]
fn a_drone_that_takes_off_beside_another_keeps_the_gap_of_one_that_flies() {
    let beside = |gap_m: f64| {
        let radius_m = drone("any", [0.0; 3], None).vehicle.body_radius_m;
        let along_m = 10.0 + 2.0 * radius_m + gap_m;
        let mut world = world(vec![
            drone("a", [10.0, 10.0, radius_m], Some([30.0, 30.0, 5.0])),
            drone("b", [along_m, 10.0, radius_m], Some([5.0, 30.0, 5.0])),
        ]);
        world.planning.clearance_m = 0.05;
        for drone in &mut world.drones {
            drone.at_start = AtStart::Landed;
        }
        world
    };
    assert!(check(&beside(0.101)).is_empty());
    let mut narrow = beside(0.06);
    let conflict = only(&check(&narrow));
    assert_eq!(conflict.when, EndpointKind::Starts);
    assert!(matches!(
        conflict.why,
        Exclusion::Bodies { needs_m, tracking_m: Some(0.06), .. } if (needs_m - 0.1).abs() < 1e-9
    ));
    // Who never flies needs no room for it.
    narrow.drones.iter_mut().for_each(|it| it.tasks.clear());
    assert!(check(&narrow).is_empty());
}

#[test]
fn a_load_kept_to_the_goal_counts_there() {
    let carrying = |load_kg: f64| {
        let mut world = world(vec![
            drone("a", [2.0, 2.0, 5.0], Some([20.0, 20.0, 8.0])),
            drone("b", [2.0, 30.0, 5.0], Some([20.5, 20.0, 5.0])),
        ]);
        world.drones[0].tasks[0].load_kg = Some(load_kg);
        check(&world)
    };
    assert!(carrying(0.0).is_empty());
    only(&carrying(3.6));
}

#[test]
fn where_only_a_sum_exceeds_the_limit_the_strongest_is_named() {
    let mut drones = vec![drone("lower", [10.0, 10.0, 3.0], None)];
    for (k, off_m) in [0.47, 0.48, 0.48].into_iter().enumerate() {
        let bearing = k as f64 * std::f64::consts::TAU / 3.0;
        drones.push(drone(
            &format!("u{k}"),
            [
                10.0 + off_m * bearing.cos(),
                10.0 + off_m * bearing.sin(),
                6.5,
            ],
            None,
        ));
    }
    let conflicts = check(&world(drones));
    // Without tasks a start is a goal too.
    assert_eq!(conflicts.len(), 2, "{conflicts:#?}");
    assert!(
        conflicts
            .iter()
            .all(|conflict| conflict.drone == 0 && conflict.blocker == Blocker::Drone(1))
    );
}

#[test]
fn a_drone_that_hovers_over_a_zone_is_named_with_a_place_beside_it() {
    let mut world = world(vec![drone("a", [2.0, 2.0, 5.0], Some([20.0, 20.0, 6.0]))]);
    world.zones.push(Zone {
        name: "desk".to_owned(),
        min_m: Point3::new(19.0, 19.5, 0.0),
        max_m: Point3::new(20.2, 20.5, 2.0),
        air_limit_mps: Some(1.5),
        keep_out: false,
    });
    let conflict = only(&check(&world));
    assert_eq!(
        (conflict.drone, conflict.blocker, conflict.when),
        (0, Blocker::Zone(0), EndpointKind::Goals)
    );
    world.drones[0].tasks[0].to_m = conflict.nearest_fix_m.expect("a free place near");
    assert!(check(&world).is_empty());
}

/// Every pair is counted; the worst are named, each with a place that would do.
#[test]
fn of_a_crowd_at_one_place_the_worst_pairs_are_named_and_the_rest_counted() {
    let mut drones: Vec<Drone> = (0..300)
        .map(|k| {
            let goal_m = [
                1.0 + 0.6 * f64::from(k % 60),
                1.0 + 0.6 * f64::from(k / 60),
                2.0,
            ];
            drone(&format!("d{k}"), [5.0, 5.0, 5.0], Some(goal_m))
        })
        .collect();
    // Beside the crowd: too close to it, by less.
    drones.push(drone("beside", [5.45, 5.0, 5.0], Some([30.0, 30.0, 2.0])));
    let mut world = world(drones);
    let found = planner::endpoint_conflicts(&world);
    assert_eq!(found.count(), 300 * 299 / 2 + 300);
    assert!(found.worst.len() <= 80);
    for conflict in &found.worst {
        assert_eq!(conflict.when, EndpointKind::Starts);
        let overlaps =
            |why: &Exclusion| matches!(why, Exclusion::Bodies { gap_m, .. } if *gap_m < -0.3);
        assert!(overlaps(&conflict.why), "{conflict:?}");
        assert!(conflict.nearest_fix_m.is_some());
    }
    // The same crowd as goals: all but one stay, and each says why.
    for drone in &mut world.drones {
        let start_m = std::mem::replace(&mut drone.start_m, drone.tasks[0].to_m);
        drone.tasks[0].to_m = start_m;
    }
    world.drones.pop();
    let outcome = planner::plan_world(&world, &planner::Control::QUIET).expect("in order");
    let planner::Outcome::Partial(planned) = outcome else {
        panic!("all but one stay");
    };
    assert_eq!(planned.conflicts.count(), 300 * 299 / 2);
    assert_eq!(planned.failures.len(), 299);
    let told = |cause: &FailureCause| matches!(cause, FailureCause::GoalConflict(Some(_)));
    assert!(planned.failures.iter().all(|failure| told(&failure.cause)));
}
