//! Worlds made for one answer each: blocked, left out and why, and drones that give way.

use nalgebra::Point3;
use planner::plan::outcome::EndpointKind;
use planner::plan::{Plan, Status, file};
use planner::scenario::missing;
use planner::verify::examination::examine;
use planner::{Control, Outcome, Planned, plan_world};

use super::worlds::{block, drone, room, task};
use super::{assert_sound, planned};
use planner::scenario::world::{AtEnd, PathMotion, World, Zone};

#[test]
fn starts_that_exclude_each_other_are_named_before_any_search() {
    let world = room(
        [10.0, 10.0, 6.0],
        vec![
            drone("upper", "offboard-2", [5.0, 5.0, 5.0], [2.5, 2.5, 3.5]),
            drone("lower", "offboard-2", [5.0, 5.0, 3.0], [7.5, 2.5, 3.5]),
        ],
    );
    match plan_world(&world, &Control::QUIET).expect("in order") {
        Outcome::Infeasible { conflicts } => {
            assert_eq!(
                (conflicts.worst[0].drone, conflicts.worst[0].when),
                (1, EndpointKind::Starts)
            );
        }
        other => panic!("{other:#?}"),
    }
}

#[test]
fn of_two_goals_that_exclude_each_other_one_is_unplanned_and_the_rest_flies() {
    let world = room(
        [12.0, 12.0, 6.0],
        vec![
            drone("upper", "offboard-2", [2.5, 2.5, 4.5], [8.5, 8.5, 5.0]),
            drone("lower", "offboard-2", [2.5, 8.5, 4.5], [8.5, 8.5, 3.0]),
            drone("other", "offboard-2", [5.5, 2.5, 4.5], [5.5, 9.5, 2.5]),
        ],
    );
    let Ok(Outcome::Partial(planned)) = plan_world(&world, &Control::QUIET) else {
        panic!("a plan for one of the two");
    };
    let Planned {
        plan, conflicts, ..
    } = *planned;
    assert_eq!(conflicts.count(), 1);
    assert_eq!(
        (conflicts.worst[0].drone, conflicts.worst[0].when),
        (1, EndpointKind::Goals)
    );
    assert_eq!(plan.unplanned.len(), 1);
    assert!(["upper", "lower"].contains(&plan.unplanned[0].name.as_str()));
    assert_eq!(plan.status, Status::Partial);
    assert_sound(&world, &plan);
}

#[test]
fn a_fleet_whose_paths_are_found_by_tables_keeps_the_air_of_a_zone() {
    // Two rows of eighteen fly from one side to the other and back, at one height.
    let places = (0..36).map(|k| [1.5 + 2.0 * f64::from(k % 2), 2.5 + f64::from(2 * (k / 2))]);
    let drones = places.enumerate().map(|(k, [x_m, y_m])| {
        let (start_m, goal_m) = ([x_m, y_m, 5.5], [40.0 - x_m, y_m, 5.5]);
        let ends_m = match k % 4 {
            0 | 3 => [start_m, goal_m],
            _ => [goal_m, start_m],
        };
        drone(&format!("d{k}"), "offboard-2", ends_m[0], ends_m[1])
    });
    let mut world = room([40.0, 40.0, 6.0], drones.collect());
    let air_mps = |world: &World| {
        let plan = planned(world);
        assert!(plan.unplanned.is_empty(), "{:?}", plan.unplanned);
        assert_sound(world, &plan);
        plan.zone_air[0].worst_air_mps
    };
    let mut desk = Zone {
        name: "desk".to_owned(),
        min_m: [18.0, 15.0, 0.0].into(),
        max_m: [22.0, 21.0, 2.0].into(),
        air_limit_mps: Some(20.0),
        keep_out: false,
    };
    world.zones = vec![desk.clone()];
    assert!(air_mps(&world) > 3.0);
    desk.air_limit_mps = Some(1.5);
    world.zones = vec![desk];
    assert!(air_mps(&world) < 1.5);
}

/// A corridor one drone wide and high, 12 m long between two rooms, with a bay in the middle for
/// one more.
fn corridor_with_bay(bay: bool) -> World {
    let drones = vec![
        // The shorter path goes first, and ends at the mouth of the bay's corridor for good.
        drone("short", "kolibri", [1.5, 1.5, 0.5], [8.5, 1.5, 0.5]),
        drone("long", "kolibri", [2.5, 1.5, 0.5], [15.5, 1.5, 0.5]),
    ];
    let mut world = room([17.0, 4.0, 1.0], drones);
    let side_m = 2.0;
    let walls = if bay {
        vec![("west", 0.0, 8.0), ("east", 9.0, 17.0)]
    } else {
        vec![("all", 0.0, 17.0)]
    };
    for (name, from_m, to_m) in walls {
        world
            .obstacles
            .push(block(name, [from_m, side_m, 0.0], [to_m, 4.0, 1.0]));
    }
    world
        .obstacles
        .push(block("south", [0.0, 0.0, 0.0], [17.0, 1.0, 1.0]));
    world
}

#[test]
fn a_drone_whose_goal_blocks_another_lets_it_pass_first() {
    // The drone with the shorter path is planned first and stops where the other must pass.
    let mut world = corridor_with_bay(true);
    world.drones[1].start_m.x = 0.5;
    let Ok(Outcome::Safe(planned)) = plan_world(&world, &Control::QUIET) else {
        panic!("a safe plan");
    };
    let Planned { plan, effort, .. } = *planned;
    assert!(plan.unplanned.is_empty(), "{:#?}", plan.unplanned);
    assert_sound(&world, &plan);
    assert!(effort.evictions > 0, "{effort:?}");
    let short = &plan.drones[0];
    assert!(short.arrives_s > short.alone_s, "it gave way to no drone");
}

#[test]
fn a_drone_steps_aside_for_one_with_an_appointment_and_returns() {
    // They trade places through a corridor that neither can pass the other in.
    let mut world = room(
        [20.0, 6.0, 3.0],
        vec![
            drone("due", "kolibri", [1.0, 3.0, 1.0], [19.0, 3.0, 1.0]),
            drone("other", "offboard-1", [19.0, 3.0, 1.0], [1.0, 3.0, 1.0]),
        ],
    );
    world.drones[0].tasks[0].during_s = Some([15.0, 16.0]);
    world.obstacles = vec![
        block("south", [4.0, 0.0, 0.0], [16.0, 2.6, 3.0]),
        block("north", [4.0, 3.4, 0.0], [16.0, 6.0, 3.0]),
    ];
    let plan = planned(&world);
    assert!(plan.unplanned.is_empty(), "{:#?}", plan.unplanned);
    assert_sound(&world, &plan);
}

#[test]
fn without_room_to_pass_the_unplanned_drone_names_its_blocker_with_place_and_time() {
    let mut world = corridor_with_bay(false);
    // Too low to pass above one that hovers.
    world.bounds_m.max.z = 0.75;
    // It has nowhere to go, and it is in the middle of the corridor.
    world.drones[0].start_m.x = 8.5;
    world.drones[0].tasks.clear();
    let plan = planned(&world);
    assert_sound(&world, &plan);
    let unplanned = plan.unplanned.iter().find(|it| it.name == "long");
    // What it would take alone is known all the same.
    assert!(plan.drones[1].name == "long" && plan.drones[1].alone_s > 5.0);
    let reason = &unplanned.expect("no path past").reason;
    assert!(reason.contains("`short`"), "{reason}");
    // A place in brackets and a time in seconds.
    assert!(
        reason.contains(", 1.50, 0.50)") && reason.contains(" s"),
        "{reason}"
    );
}

#[test]
fn a_gap_too_narrow_for_the_body_is_named_with_the_way_out() {
    let mut world = room(
        [10.0, 4.0, 3.0],
        vec![
            drone("wide", "offboard-2", [1.5, 1.5, 1.5], [8.5, 1.5, 1.5]),
            drone("narrow", "crazyflie-2.1", [1.5, 2.5, 1.5], [8.5, 2.5, 1.5]),
        ],
    );
    world.planning.cell_m = 0.5;
    // A slit of 0.5 m: wide enough for 2 (0.069 + 0.1) m, too narrow for 2 (0.198 + 0.1) m.
    world
        .obstacles
        .push(block("left", [4.0, 0.0, 0.0], [5.0, 2.25, 3.0]));
    world
        .obstacles
        .push(block("right", [4.0, 2.75, 0.0], [5.0, 4.0, 3.0]));
    let plan = planned(&world);
    assert_sound(&world, &plan);
    let names: Vec<&str> = plan.unplanned.iter().map(|it| it.name.as_str()).collect();
    assert_eq!(names, ["wide"]);
    let reason = &plan.unplanned[0].reason;
    assert!(
        reason.contains("no path through free space") && reason.contains("proven"),
        "{reason}"
    );
}

#[test]
fn a_drone_without_tasks_stays_and_one_that_leaves_at_once_is_gone() {
    use planner::scenario::world::AtStart;
    for (at_start, at_end) in [
        (AtStart::Hover, AtEnd::Hover),
        (AtStart::Hover, AtEnd::Land),
        (AtStart::Hover, AtEnd::Leave),
        (AtStart::Landed, AtEnd::Hover),
        (AtStart::Landed, AtEnd::Land),
        (AtStart::Landed, AtEnd::Leave),
    ] {
        let mut idle = drone("idle", "offboard-1", [2.0, 2.0, 2.0], [0.0; 3]);
        idle.tasks.clear();
        idle.at_start = at_start;
        idle.at_end = at_end;
        if at_start == AtStart::Landed {
            idle.start_m.z = idle.vehicle.body_radius_m;
        }
        let busy = drone("busy", "offboard-1", [0.5, 0.5, 3.5], [5.5, 5.5, 1.5]);
        let world = room([6.0, 6.0, 5.0], vec![idle, busy]);
        let plan = planned(&world);
        assert!(plan.unplanned.is_empty(), "{at_start:?} {at_end:?}");
        assert_sound(&world, &plan);
    }
}

#[test]
fn a_task_at_the_start_and_the_same_task_twice_are_done() {
    let mut once = drone("once", "offboard-1", [2.5, 2.5, 2.5], [2.5, 2.5, 2.5]);
    once.tasks = vec![
        task([2.5, 2.5, 2.5], 2.0),
        task([2.5, 2.5, 2.5], 0.0),
        task([4.5, 2.5, 2.5], 1.0),
        task([4.5, 2.5, 2.5], 1.0),
        task([2.5, 2.5, 2.5], 0.0),
    ];
    once.tasks[3].load_kg = Some(0.2);
    let world = room([6.0, 6.0, 5.0], vec![once]);
    let plan = planned(&world);
    assert_sound(&world, &plan);
    // 2 + 1 + 1 s of dwells, 2 m there and back at 2 m/s.
    assert_eq!(plan.drones[0].arrives_s, 6.0);
}

/// Distance from the axis (m) at which an Offboard 2 hovering `above_m` higher brings this mean
/// air, over the induced velocity, to another.
fn aside_m(above_m: f64, alpha: f64) -> f64 {
    use airflow::{Air, Airframe, Jet, Source, Superposition, Wake, mean_over_discs_mps};
    let airframe = Airframe::preset("offboard-2").expect("a preset");
    let density = Air::default().density_kg_per_m3();
    let wake = Wake::new(&airframe, airframe.mass_kg(), density, &Jet::default());
    let met = |aside_m: f64| {
        let source = Source {
            wake: &wake,
            position_m: [aside_m, 0.0, above_m].into(),
            ends_at_z_m: -10.0,
        };
        let discs = airframe.disc_points();
        mean_over_discs_mps(&[source], &discs, [0.0; 3].into(), Superposition::Momentum)
            / wake.induced_velocity_mps()
    };
    let (mut near_m, mut far_m) = (0.0, 3.0);
    for _ in 0..60 {
        let middle_m = f64::midpoint(near_m, far_m);
        if met(middle_m) > alpha {
            near_m = middle_m;
        } else {
            far_m = middle_m;
        }
    }
    far_m
}

/// `lower` and `upper` cannot leave their starts, where the wake of one reaches the other with
/// three quarters of what it may; a drone that hovers at a goal beside them must not add to that.
#[test]
fn no_drone_ends_where_it_adds_too_much_to_those_that_stay() {
    let aside_m = aside_m(3.5, 0.23);
    let behind = [10.5, 6.5, 3.0];
    let mut drones = vec![
        drone("lower", "offboard-2", [5.0, 5.0, 1.5], behind),
        drone(
            "upper",
            "offboard-2",
            [5.0 - aside_m, 5.0, 5.0],
            [10.5, 2.5, 3.0],
        ),
        drone(
            "guest",
            "offboard-2",
            [1.5, 10.5, 5.0],
            [5.0 + aside_m, 5.0, 5.0],
        ),
    ];
    drones[1].air_limit = 1.0;
    let mut world = room([12.0, 12.0, 6.0], drones);
    // No drone gets past this wall, and two have their goals behind it.
    world
        .obstacles
        .push(block("wall", [9.0, 0.0, 0.0], [9.5, 12.0, 6.0]));
    for seed in 0..4 {
        world.planning.seed = seed;
        let plan = planned(&world);
        assert_sound(&world, &plan);
    }
}

#[test]
fn a_plan_says_of_a_landing_what_its_trajectories_do() {
    let low = |start_m: &str, to_m: &str, planning: &str| {
        planner::read_world(&format!(
            r#"Scenario(name: "low", bounds_m: (min: (0, 0, 0), max: (7, 7, 6)), {planning}
            drones: [(name: "d", airframe: "offboard-1", start_m: {start_m},
                tasks: [(to_m: {to_m})], at_end: Land)])"#
        ))
        .unwrap_or_else(|problems| panic!("{problems:#?}"))
    };
    let straight = "planning: (motion: Straight),";
    for world in [
        low("(0.8, 3.5, 2)", "(3.5, 3.3, 0.45)", ""),
        low("(0.8, 3.5, 2)", "(3.5, 3.3, 0.9)", ""),
        // Down to the goal it is as slow as from there on.
        low("(3.5, 3.3, 2)", "(3.5, 3.3, 0.6)", straight),
        low("(0.8, 3.5, 2)", "(3.5, 3.3, 0.6)", straight),
    ] {
        let examined = |plan: &Plan| {
            let text = serde_json::to_string(plan).unwrap();
            examine(&file::read(&text).unwrap(), false)
        };
        let mut plan = planned(&world);
        let found = examined(&plan);
        assert!(found.differences.is_empty(), "{:?}", found.differences);
        assert_eq!(missing(&world, &found.plan), [""; 0]);
        plan.drones[0].airborne_s.1 = None;
        assert!(!examined(&plan).plan.violations.is_empty());
    }
}

#[test]
fn a_clearance_of_zero_is_held_against_the_scenario() {
    let place = |clearance_m: f64| {
        planner::read_world(&format!(
            r#"Scenario(name: "c", bounds_m: (min: (0, 0, 0), max: (6, 6, 4)),
            planning: (clearance_m: {clearance_m}),
            drones: [(name: "d", airframe: "kolibri", start_m: (1, 1, 1),
                tasks: [(to_m: (4, 4, 1))])])"#
        ))
        .unwrap()
    };
    let mut plan = planned(&place(0.0));
    let told = missing(&place(0.3), &plan);
    assert_eq!(told, ["clearance_m is 0.3 m, the plan has 0 m"]);
    plan.clearance_m = None;
    assert_eq!(missing(&place(0.3), &plan), [""; 0]);
}

#[test]
fn a_last_task_as_high_as_a_landing_is_straight_is_reached_from_the_side_without_a_stop() {
    for preset in ["offboard-2", "crazyflie-2.1", "matrice-300"] {
        // A hair above the body's radius and 0.5 m over its pad, and as far above as is plain.
        let [low, high] = [0.505, 1.0].map(|over_m| {
            let mut lone = drone("a", preset, [1.0; 3], [1.0; 3]);
            let z_m = 2.0 * lone.vehicle.body_radius_m + over_m;
            (lone.start_m, lone.tasks[0].to_m) =
                (Point3::new(1.0, 7.0, z_m), Point3::new(19.0, 7.0, z_m));
            lone.at_end = AtEnd::Land;
            let mut world = room([20.0, 14.0, 6.0], vec![lone]);
            world.planning.motion = PathMotion::Smooth;
            let outcome = plan_world(&world, &Control::QUIET).expect("in order");
            let Outcome::Safe(planned) = outcome else {
                panic!("{preset}: {outcome:?}");
            };
            planned.plan.drones[0].clone()
        });
        assert_eq!(low.waits_s, 0.0, "{preset}");
        assert!(
            (low.arrives_s - high.arrives_s).abs() < 0.1,
            "{preset}: {}",
            low.arrives_s
        );
    }
}
