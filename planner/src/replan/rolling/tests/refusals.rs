//! Evicted drones, drones without a path, what is wrong with a change, and loads and landings.

use super::*;

#[test]
fn a_blocking_drone_is_displaced() {
    // `b` does not wait: its goal is where `a` is told to hover for a while.
    let (world, plan) = planned(
        r#"Scenario(name: "corridor", bounds_m: (min: (0, 0, 0), max: (24, 5, 3)),
          drones: [
            (name: "a", airframe: "kolibri", start_m: (2.5, 1.5, 1.5), tasks: [(to_m: (20.5, 1.5, 1.5))]),
            (name: "b", airframe: "kolibri", start_m: (21.5, 3.5, 1.5), tasks: [(to_m: (3.5, 3.5, 1.5))]),
          ])"#,
    );
    let change = retasked(
        "a",
        vec![
            Task {
                dwell_s: 600.0,
                ..task(3.5, 3.5, 1.5)
            },
            task(20.5, 1.5, 1.5),
        ],
    );
    let (running, told) = replan(&world, &plan, 2.0, &[change], &Control::QUIET).expect("in order");
    sound(&running);
    // Either has to wait for the other, and it is not the one that was not asked.
    assert_eq!(told.refused.len() + told.changed.len(), 1, "{told:#?}");
    assert_eq!(
        find(running.plan(), "b").trajectory,
        find(&plan, "b").trajectory
    );
}

#[test]
fn a_drone_that_comes_where_another_will_end_is_refused_with_from_when_on() {
    let (world, plan) = planned(
        r#"Scenario(name: "line", bounds_m: (min: (0, 0, 0), max: (24, 5, 3)),
          drones: [(name: "a", airframe: "kolibri", start_m: (2.5, 2.5, 1.5), tasks: [(to_m: (12.5, 2.5, 1.5))])])"#,
    );
    let Change::Added(mut new) = another(&world, "new", [12.5, 2.5, 1.5], task(0.0, 0.0, 0.0))
    else {
        panic!("it is added");
    };
    new.tasks.clear();
    let change = Change::Added(new);
    let (_, told) = replan(&world, &plan, 1.0, &[change], &Control::QUIET).expect("in order");
    let reason = &told.refused.first().expect("its place is taken").reason;
    let arrives_s = find(&plan, "a").arrives_s;
    let told_s = reason
        .split(" from ")
        .nth(1)
        .and_then(|it| it.split(' ').next());
    let told_s: f64 = told_s.expect(reason).parse().expect(reason);
    assert!((told_s - arrives_s).abs() < 1.0, "{reason}; {arrives_s}");
}

#[test]
fn a_late_drone_that_is_in_conflict_already_is_reported() {
    // `b` follows `a` at a distance; `a` stops, and `b` is in its body before it can stop.
    let (world, plan) = planned(
        r#"Scenario(name: "behind", bounds_m: (min: (0, 0, 0), max: (24, 1, 1)),
          drones: [
            (name: "a", airframe: "kolibri", start_m: (1.5, 0.5, 0.5), tasks: [(to_m: (22.5, 0.5, 0.5))]),
            (name: "b", airframe: "kolibri", start_m: (0.5, 0.5, 0.5), tasks: [(to_m: (20.5, 0.5, 0.5))]),
          ])"#,
    );
    let (mut running, told) =
        replan(&world, &plan, 4.25, &[late("a", 0.5)], &Control::QUIET).expect("in order");
    assert!(!told.unavoidable.is_empty());
    assert_eq!(ahead(&running, 4.25), told.unavoidable);
    // Once it is over it is history.
    let told = running.replan(60.0, &[removed("a")], &Control::QUIET);
    assert_eq!(told.expect("in order").unavoidable, []);
    assert!(!running.plan().violations.is_empty());
}

/// In a corridor one drone comes down in front of another.
#[test]
fn a_drone_whose_way_is_closed_stops_before_it() {
    let (world, plan) = planned(
        r#"Scenario(name: "closed", bounds_m: (min: (0, 0, 0), max: (24, 0.5, 0.5)), planning: (cell_m: 0.5),
          drones: [
            (name: "a", airframe: "kolibri", start_m: (8.25, 0.25, 0.25), tasks: [(to_m: (22.25, 0.25, 0.25))]),
            (name: "b", airframe: "kolibri", start_m: (0.25, 0.25, 0.25), tasks: [(to_m: (20.25, 0.25, 0.25))]),
          ])"#,
    );
    let fails = Change::Failed {
        drone: "a".to_owned(),
        lies_m: Some([14.25, 0.25, 0.1].into()),
    };
    let (running, told) = replan(&world, &plan, 3.0, &[fails], &Control::QUIET).expect("in order");
    let [stops] = &told.refused[..] else {
        panic!("{:?}", told.refused);
    };
    assert_eq!(stops.name, "b");
    assert!(stops.reason.contains("it stops"), "{stops:?}");
    let cause = told.changed.iter().find(|one| one.drone == "b");
    assert_eq!(cause.map(|one| one.cause), Some(Cause::GaveWay));
    assert!(running.plan().unplanned.contains(stops));
    sound(&running);
}

#[test]
fn of_many_that_are_late_at_once_none_stays_in_anothers_way() {
    let (world, plan) = planned(&tools::instances::hall(500, 2).expect("the hall has room"));
    let changes = [
        late("d115", 5.9),
        late("d317", 2.2),
        late("d338", 0.7),
        late("d339", 3.5),
        late("d363", 7.8),
        late("d404", 8.0),
        late("d407", 1.2),
        late("d455", 6.1),
        late("d46", 2.6),
        late("d52", 6.2),
    ];
    let (running, told) = replan(&world, &plan, 3.0, &changes, &Control::QUIET).expect("in order");
    assert_eq!(ahead(&running, 3.0), told.unavoidable);
    assert_eq!(verify(running.plan()).violations, running.plan().violations);
    for it in &told.unavoidable {
        assert!(it.until_s.is_some_and(|until_s| until_s < 15.0), "{it}");
    }
}

#[test]
fn a_drone_without_a_path_goes_on_with_what_it_had() {
    let (world, plan) = hall(20);
    let goal = find(&plan, "d2")
        .trajectory
        .position_m
        .last()
        .copied()
        .expect("it flies");
    let change = retasked(
        "d1",
        vec![Task {
            dwell_s: 0.0,
            ..task(goal.x, goal.y, goal.z)
        }],
    );
    let (running, told) =
        replan(&world, &plan, 30.0, &[change], &Control::QUIET).expect("in order");
    assert_eq!(told.refused[0].name, "d1");
    assert_eq!(told.changed, []);
    assert_eq!(
        find(running.plan(), "d1").trajectory,
        find(&plan, "d1").trajectory
    );
    sound(&running);
}

#[test]
fn a_drone_that_comes_and_has_no_path_is_not_let_in() {
    let (world, plan) = hall(20);
    let goal = |name: &str| {
        find(&plan, name)
            .trajectory
            .position_m
            .last()
            .copied()
            .expect("it flies")
    };
    let taken = goal("d2");
    let [x, y] = free_column(&plan, 1);
    let [u, v] = free_column(&plan, 4);
    let changes = [
        another(
            &world,
            "shut-out",
            [x, y, 6.5],
            task(taken.x, taken.y, taken.z),
        ),
        another(&world, "let-in", [u, v, 6.5], task(u, v, 2.5)),
        retasked("d5", vec![task(x, y, 3.5)]),
    ];
    let (running, told) = replan(&world, &plan, 30.0, &changes, &Control::QUIET).expect("in order");
    assert_eq!(told.refused.len(), 1, "{told:#?}");
    assert_eq!(told.refused[0].name, "shut-out");
    assert!(
        running
            .plan()
            .drones
            .iter()
            .all(|drone| drone.name != "shut-out")
    );
    assert_eq!(running.plan().drones.len(), running.world().drones.len());
    assert_eq!(find(running.plan(), "let-in").enters_s, Some(30.0));
    sound(&running);
}

#[test]
fn all_that_is_wrong_is_said_and_nothing_changes() {
    let (world, plan) = hall(10);
    let mut running = Running::new(world.clone(), plan.clone()).expect("its plan");
    let changes = [
        late("unknown", 1.0),
        late("d1", f64::NAN),
        removed("d1"),
        retasked("d2", vec![task(99.0, 1.5, 1.5)]),
        another(&world, "d3", [1.5, 1.5, 1.5], task(2.5, 2.5, 2.5)),
    ];
    let errors = running
        .replan(3.0, &changes, &Control::QUIET)
        .expect_err("five mistakes");
    assert_eq!(errors.len(), 5, "{errors:#?}");
    assert_eq!(*running.plan(), plan);
    assert!(running.replan(f64::INFINITY, &[], &Control::QUIET).is_err());
    running
        .replan(3.0, &[], &Control::QUIET)
        .expect("nothing to do");
    assert!(running.replan(2.0, &[], &Control::QUIET).is_err());
}

#[test]
fn of_a_drone_that_is_there_already_a_start_is_not_said_to_be_wrong() {
    let (world, plan) = hall(4);
    let running = Running::new(world, plan).expect("its plan");
    let landed = Change::Landed {
        drone: "d2".to_owned(),
        over_m: Some(Point3::new(f64::NAN, 1.5, 1.5)),
    };
    for change in [retasked("d1", vec![task(f64::NAN, 1.5, 1.5)]), landed] {
        let errors = running.check(1.0, &[change]).expect_err("no place");
        let told: Vec<String> = errors.iter().map(ToString::to_string).collect();
        assert!(
            told[0].contains("a task") && told[0].contains("NaN"),
            "{told:?}"
        );
        assert!(told.iter().all(|it| !it.contains("start")), "{told:?}");
    }
}

#[test]
fn loads_landings_and_grounded_drones_go_on_as_they_are() {
    let (world, plan) = planned(
        r#"Scenario(name: "yard", bounds_m: (min: (0, 0, 0), max: (20, 14, 6)),
          drones: [
            (name: "carrier", airframe: "matrice-300", start_m: (2.5, 2.5, 3.5), at_end: Land,
             tasks: [(to_m: (8.5, 2.5, 3.5), dwell_s: 3, load_kg: 1.0), (to_m: (16.5, 2.5, 3.5), dwell_s: 2, load_kg: 0)]),
            (name: "sleeper", airframe: "kolibri", start_m: (4.5, 11.5, 0.1), at_start: Landed,
             tasks: [(to_m: (15.5, 11.5, 2.5))]),
            (name: "leaver", airframe: "kolibri", start_m: (2.5, 8.5, 2.5), at_end: Leave, tasks: [(to_m: (6.5, 8.5, 2.5))]),
          ])"#,
    );
    let mut running = Running::new(world, plan.clone()).expect("its plan");
    // Between its tasks it carries a kilogram, and goes on carrying it where it is sent instead.
    let carried = find(&plan, "carrier").clone();
    let loaded_s = carried.trajectory.t_s[carried
        .trajectory
        .mass_kg
        .iter()
        .position(|kg| *kg > 6.5)
        .unwrap_or(0)];
    let at_s = loaded_s + 4.5;
    let send = retasked("carrier", vec![task(12.5, 5.5, 3.5)]);
    running
        .replan(at_s, &[send, late("sleeper", 0.5)], &Control::QUIET)
        .expect("in order");
    sound(&running);
    let carrier = find(running.plan(), "carrier");
    let last_kg = carrier
        .trajectory
        .mass_kg
        .last()
        .copied()
        .expect("it flies");
    assert!((last_kg - carried.airframe.mass_kg - 1.0).abs() < 1e-9);
    assert_eq!(carrier.at_end, AtEnd::Land);
    // Once down it rises again.
    let down_s = carrier
        .airborne_s
        .1
        .expect("it lands")
        .max(find(&plan, "leaver").arrives_s)
        + 1.0;
    let gone = running.replan(down_s, &[late("leaver", 1.0)], &Control::QUIET);
    assert!(matches!(
        gone.as_ref().map_err(Vec::as_slice),
        Err([ChangeError::Gone(_)])
    ));
    let rise = retasked("carrier", vec![task(4.5, 5.5, 3.5)]);
    let told = running
        .replan(down_s, &[rise], &Control::QUIET)
        .expect("in order");
    assert_eq!(told.refused, []);
    sound(&running);
}

#[test]
fn a_landing_that_is_refused_is_named_with_where_it_meets_the_other() {
    let text = r#"(name: "w", bounds_m: (min: (0, 0, 0), max: (12, 8, 4)), drones: [
        (name: "a", airframe: "mavic-3e", start_m: (1, 4, 2.5), tasks: [(to_m: (11, 4, 2.5))], at_end: Land),
        (name: "b", airframe: "kolibri", start_m: (6.5, 4, 0.09585), at_start: Landed)])"#;
    let world = read_world(text).expect("in order");
    let outcome = crate::plan_world(&world, &Control::QUIET).expect("in order");
    let plan = outcome.into_planned().expect("a plan").plan;
    let fails = Change::Failed {
        drone: "b".to_owned(),
        lies_m: None,
    };
    let (mut running, _) = replan(&world, &plan, 1.0, &[fails], &Control::QUIET).expect("in order");
    let sent = [retasked("a", vec![task(6.6, 4.0, 2.0)])];
    let told = running
        .replan(2.3, &sent, &Control::QUIET)
        .expect("in order");
    let [refused] = &told.refused[..] else {
        panic!("{told:?}");
    };
    let words = "the body of `b (wreck)` is in its way as it lands, at (6.60, 4.00, 0.31)";
    assert!(refused.reason.starts_with(words), "{}", refused.reason);
    let at_m = refused.cause.as_ref().and_then(|it| it.at_m);
    assert!(at_m.expect("a place").z < 0.5);
}

#[test]
fn what_a_library_hands_in_is_held_against_the_rules_of_a_scenario() {
    let (world, plan) = hall(6);
    let mut running = Running::new(world.clone(), plan.clone()).expect("its plan");
    let mut refused = |change: Change, at_s: f64| -> Vec<ChangeError> {
        let errors = running.replan(at_s, &[change], &Control::QUIET);
        let errors = errors.expect_err("no scenario may say so");
        assert_eq!(*running.plan(), plan);
        errors
    };
    let dwelling = |dwell_s: f64| Task {
        dwell_s,
        ..task(5.5, 5.5, 3.5)
    };
    let is_number = |errors: &[ChangeError]| matches!(errors, [ChangeError::Number { .. }, ..]);
    for dwell_s in [f64::NAN, f64::INFINITY, -1.0, 1e9] {
        assert!(is_number(&refused(
            retasked("d1", vec![dwelling(dwell_s)]),
            1.0
        )));
    }
    // Each dwell is in range; together they outlast the clock, from the moment on as well.
    let months = vec![dwelling(86_400.0); 300];
    assert!(is_number(&refused(
        retasked("d1", vec![dwelling(86_400.0); 400]),
        1.0
    )));
    assert!(is_number(&refused(retasked("d1", months), 1e7)));
    let heavy = Task {
        load_kg: Some(900.0),
        ..task(5.5, 5.5, 3.5)
    };
    assert!(is_number(&refused(retasked("d1", vec![heavy]), 1.0)));
    let Change::Added(sound) = another(&world, "x", [1.5, 1.5, 6.5], task(2.5, 2.5, 6.5)) else {
        panic!("it comes");
    };
    let spoilt: [fn(&mut Drone); 5] = [
        |drone| drone.name = "a\nb".to_owned(),
        |drone| drone.name = "x".repeat(101),
        |drone| drone.air_limit = f64::NAN,
        |drone| drone.vehicle.max_speed_mps = 0.0,
        |drone| drone.vehicle.body_radius_m = f64::INFINITY,
    ];
    for spoil in spoilt {
        let mut drone = sound.clone();
        spoil(&mut drone);
        refused(Change::Added(drone), 1.0);
    }
}

#[test]
fn a_world_or_a_plan_that_is_not_in_order_is_refused() {
    let (world, plan) = hall(4);
    let mut broken = world.clone();
    broken.planning.cell_m = f64::NAN;
    let refused = Running::new(broken, plan.clone());
    assert!(matches!(refused, Err(GivenError::World(_))));
    let spoilt: [fn(&mut crate::plan::DronePlan); 6] = [
        |entry| entry.trajectory.t_s[0] = f64::NAN,
        |entry| *entry.trajectory.t_s.last_mut().expect("it flies") = 1e12,
        |entry| entry.airborne_s.1 = Some(f64::INFINITY),
        |entry| entry.enters_s = Some(-5.0),
        |entry| entry.trajectory.position_m[1].x = 1e9,
        |entry| entry.trajectory.mass_kg[1] = 900.0,
    ];
    let ours = crate::scenario::read_world(
        r#"(name: "o", bounds_m: (min: (0, 0, 0), max: (64, 64, 8)),
            drones: [(name: "ours", airframe: "kolibri", start_m: (60.5, 60.5, 7.5))])"#,
    );
    let ours = ours.expect("in order");
    for spoil in spoilt {
        let mut spoilt = plan.clone();
        spoil(&mut spoilt.drones[1]);
        let others = &spoilt.drones[1..2];
        let region = crate::replan::region::plan_region(&ours, others, &Control::QUIET);
        assert!(region.is_err());
        assert!(Running::new(world.clone(), spoilt).is_err());
    }
}

/// One that comes and finds no path leaves nothing behind, though its load made the costmap anew.
#[test]
fn a_drone_that_is_turned_away_blocks_no_other() {
    let (world, plan) = planned(
        r#"Scenario(name: "blind alley", bounds_m: (min: (0, 0, 0), max: (24, 1, 1)),
          obstacles: [(name: "wall", min_m: (20, 0, 0), max_m: (20.5, 1, 1))],
          drones: [
            (name: "b", airframe: "kolibri", start_m: (2.5, 0.5, 0.5), tasks: [(to_m: (3.5, 0.5, 0.5))]),
          ])"#,
    );
    let mut running = Running::new(world.clone(), plan).expect("its plan");
    let beyond = Task {
        load_kg: Some(0.05),
        ..task(22.5, 0.5, 0.5)
    };
    let comes = another(&world, "x", [12.5, 0.5, 0.5], beyond);
    let on = retasked("b", vec![task(18.5, 0.5, 0.5)]);
    let told = running
        .replan(10.0, &[comes, on], &Control::QUIET)
        .expect("in order");
    let refused: Vec<&str> = told.refused.iter().map(|it| &it.name[..]).collect();
    assert_eq!(refused, ["x"], "{told:#?}");
    sound(&running);
    let flown = &find(running.plan(), "b").trajectory.position_m;
    assert!(flown.last().is_some_and(|it| it.x > 18.0), "{flown:?}");
}
