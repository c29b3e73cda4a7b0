//! Changes of flights by the rules and margins that hold where a scenario names none.

use super::*;
use crate::plan::file::read;
use crate::verify::examination::examine;

/// A plan that is flown.
fn flown(text: &str) -> Running {
    let world = read_world(text).expect("in order");
    let outcome = crate::plan_world(&world, &Control::QUIET).expect("in order");
    let plan = outcome.into_planned().expect("a plan").plan;
    assert!(plan.violations.is_empty());
    assert!(plan.drones.iter().any(|it| it.trajectory.is_smooth()));
    Running::new(world, plan).expect("its plan")
}

/// Two drones that fly past one another.
fn yard(at_end: &str) -> Running {
    flown(&format!(
        r#"Scenario(name: "yard", bounds_m: (min: (0, 0, 0), max: (24, 12, 5)), drones: [
          (name: "left", airframe: "kolibri", start_m: (2.5, 2.5, 1.5), tasks: [(to_m: (20.5, 2.5, 1.5))], at_end: {at_end}),
          (name: "right", airframe: "kolibri", start_m: (20.5, 8.5, 1.5), tasks: [(to_m: (2.5, 8.5, 1.5))], at_end: {at_end})])"#
    ))
}

fn changed(running: &mut Running, at_s: f64, change: Change) -> Replanned {
    let told = running.replan(at_s, &[change], &Control::QUIET);
    told.expect("in order")
}

/// What its plan states of itself follows from it.
fn states_what_follows(running: &Running) {
    let text = serde_json::to_string(running.plan()).expect("a plan");
    let examined = examine(&read(&text).expect("a plan"), false);
    assert_eq!(examined.differences, []);
}

fn failed(drone: &str) -> Change {
    Change::Failed {
        drone: drone.to_owned(),
        lies_m: None,
    }
}

#[test]
fn a_drone_that_lands_and_drops_its_tasks_comes_to_rest_and_then_lands() {
    for at_s in [0.5, 3.0, 7.3] {
        let mut running = yard("Land");
        let told = changed(&mut running, at_s, retasked("left", Vec::new()));
        sound(&running);
        assert_eq!(told.refused, []);
        states_what_follows(&running);
        let left = find(running.plan(), "left");
        let lands_m = left.trajectory.position_m.last().expect("a place");
        assert!(left.at_end == AtEnd::Land && lands_m.z < 0.5, "{lands_m}");
    }
}

#[test]
fn a_late_drone_on_a_path_found_on_finer_cells_is_planned_on_with_those_in_its_way() {
    let flown = flown(include_str!("../../../../../scenarios/landing-pads.ron"));
    let mut ways_out = 0;
    for (half, drone) in (8..20).flat_map(|half| [(half, "home-4"), (half, "home-7")]) {
        let at_s = 0.5 * f64::from(half);
        let mut running = flown.clone();
        let told = changed(&mut running, at_s, late(drone, 1.0));
        let gave_way = told.changed.iter().any(|it| it.cause == Cause::GaveWay);
        if told.refused.is_empty() {
            ways_out += usize::from(gave_way);
            // It may be within another's wake already.
            assert_eq!(
                ahead(&running, at_s),
                told.unavoidable,
                "{drone} at {at_s} s"
            );
        }
        states_what_follows(&running);
    }
    assert!(ways_out > 0);
}

#[test]
fn a_late_drone_is_in_anothers_air_no_longer_than_it_takes_to_fly_out() {
    let mut running = flown(include_str!("../../../../../scenarios/warehouse.ron"));
    let mut exposed_s = 0.0;
    for (at_s, by_s) in [(3.0, 0.8), (9.0, 0.5)] {
        let told = changed(&mut running, at_s, late("scan-1", by_s));
        assert_eq!(ahead(&running, at_s), told.unavoidable);
        let air = told.unavoidable.iter();
        let air = air.filter(|it| it.kind == ViolationKind::Air);
        let lasting = |it: &Violation| {
            it.until_s
                .map_or(f64::INFINITY, |until_s| until_s - it.from_s)
        };
        exposed_s += air.map(lasting).sum::<f64>();
    }
    // Of up to 2 s that it may take.
    assert!(exposed_s < 0.5, "{exposed_s} s");
}

#[test]
fn a_drone_that_comes_and_hardly_stops_is_refused_as_in_a_scenario() {
    let (world, plan) = hall(4);
    let straight = Running::new(world, plan).expect("its plan");
    for (running, is_refused) in [(straight, false), (yard("Hover"), true)] {
        let mut world = running.world().clone();
        let mut barge = world.drones[0].clone();
        (barge.name, barge.vehicle.max_jerk_mps3) = ("barge".to_owned(), 0.1);
        let comes = [Change::Added(barge.clone())];
        let told = running.check(1.0, &comes).err().unwrap_or_default();
        world.drones.push(barge);
        let scenario = world.check().err().map_or(Vec::new(), |it| it.0);
        let is_slow = |it: &String| it.contains("time to stop");
        let in_scenario = scenario.iter().map(ToString::to_string);
        assert_eq!(in_scenario.filter(is_slow).count(), usize::from(is_refused));
        let of_change = told.iter().map(ToString::to_string);
        assert_eq!(of_change.filter(is_slow).count(), usize::from(is_refused));
    }
}

#[test]
fn a_drone_that_is_gone_soon_or_drops_its_tasks_states_when_it_comes_to_rest() {
    let changes = [
        removed("left"),
        failed("left"),
        retasked("left", Vec::new()),
    ];
    for (change, at_s) in changes.iter().flat_map(|it| [(it, 3.0), (it, 20.0)]) {
        let mut running = yard("Hover");
        changed(&mut running, at_s, change.clone());
        states_what_follows(&running);
    }
}

#[test]
fn a_drone_that_fails_on_the_ground_lies_where_it_stood() {
    let mut running = yard("Land");
    let told = changed(&mut running, 30.0, failed("left"));
    assert_eq!(told.unavoidable, []);
    sound(&running);
    states_what_follows(&running);
}

#[test]
fn a_drone_that_is_taken_out_of_a_pad_or_fails_there_has_landed_on_it() {
    let running = flown(
        r#"Scenario(name: "pad", bounds_m: (min: (0, 0, 0), max: (8, 8, 4)),
          obstacles: [(name: "pad", min_m: (3.5, 3.5, 0), max_m: (4.5, 4.5, 0.3))], drones: [
          (name: "a", airframe: "offboard-2", start_m: (1, 1, 2), tasks: [(to_m: (4, 4, 1.5))], at_end: Land),
          (name: "b", airframe: "kolibri", start_m: (7, 7, 2))])"#,
    );
    let landed = find(running.plan(), "a").clone();
    let landed_s = landed.airborne_s.1.expect("it lands");
    // Of those before it has landed some are too low over its pad to leave.
    for at_s in (0..16).map(|k| landed_s - 1.5 + 0.1 * f64::from(k)) {
        let mut running = running.clone();
        let told = changed(&mut running, at_s, removed("a"));
        assert_eq!(told.unavoidable, [], "{at_s} s");
        sound(&running);
        states_what_follows(&running);
    }
    let moments_s = [landed_s - 0.9, landed_s, landed_s + 0.01, 20.0];
    for (at_s, change) in moments_s
        .into_iter()
        .flat_map(|at_s| [(at_s, removed("a")), (at_s, failed("a"))])
    {
        let mut running = running.clone();
        let told = changed(&mut running, at_s, change);
        assert_eq!(told.unavoidable, [], "{at_s} s");
        sound(&running);
        states_what_follows(&running);
        let gone = find(running.plan(), "a");
        assert!(gone.at_end == AtEnd::Leave && gone.airborne_s == landed.airborne_s);
        assert!((gone.arrives_s - landed.arrives_s).abs() < 1e-9, "{at_s} s");
        // Its wreck comes as late as it does.
        let late = crate::verify::lateness::of_all(running.plan(), &|| false);
        assert_eq!(late[0].as_ref().expect("judged").breaks, None, "{at_s} s");
        // Another takes the plan over.
        let (world, plan) = (running.world().clone(), running.plan().clone());
        let mut taken = Running::new(world, plan).expect("its plan");
        let told = changed(
            &mut taken,
            at_s + 3.0,
            retasked("b", vec![task(7.0, 1.0, 2.0)]),
        );
        assert_eq!((told.refused, told.unavoidable), (Vec::new(), Vec::new()));
        sound(&taken);
    }
}

#[test]
fn drones_blocked_by_one_that_fails_are_replanned_or_refused() {
    let flown = flown(include_str!("../../../../../scenarios/circle-16.ron"));
    let mut ways_out = 0;
    for (at_s, k) in [3.7, 4.3, 4.7]
        .into_iter()
        .flat_map(|at_s| (1..=16).map(move |k| (at_s, k)))
    {
        let mut running = flown.clone();
        let told = changed(&mut running, at_s, failed(&format!("d{k}")));
        assert_eq!(running.plan().violations, told.unavoidable, "{at_s} s");
        states_what_follows(&running);
        let gave_way = told.changed.iter().any(|it| it.cause == Cause::GaveWay);
        ways_out += usize::from(gave_way && told.unavoidable.is_empty());
    }
    assert!(ways_out > 0);
}

#[test]
fn what_a_drone_has_flown_stays_to_the_byte_when_it_is_taken_out_or_sent_elsewhere() {
    let rests = flown(
        r#"Scenario(name: "down", bounds_m: (min: (0, 0, 0), max: (18, 14, 7)), drones: [
          (name: "left", airframe: "kolibri", start_m: (8.5, 7.5, 5.5), at_end: Land)])"#,
    );
    let elsewhere = retasked("left", vec![task(10.5, 8.5, 2.5)]);
    for (running, at_s, change) in [
        (rests, 10.0, removed("left")),
        (yard("Land"), 7.3, removed("left")),
        (yard("Hover"), 7.3, elsewhere.clone()),
        (yard("Leave"), 3.1, elsewhere),
    ] {
        let mut running = running;
        let before = find(running.plan(), "left").trajectory.clone();
        changed(&mut running, at_s, change);
        sound(&running);
        let after = &find(running.plan(), "left").trajectory;
        let flown = before.t_s.partition_point(|t_s| *t_s <= at_s);
        assert!(flown > 1, "{:?}", before.t_s);
        assert_eq!(after.t_s[..flown], before.t_s[..flown]);
        assert_eq!(after.position_m[..flown], before.position_m[..flown]);
        assert_eq!(after.control_m[..flown - 1], before.control_m[..flown - 1]);
    }
}

#[test]
fn a_drone_that_cannot_do_its_new_tasks_goes_on_with_its_former_ones() {
    let flown = flown(
        r#"Scenario(name: "two", bounds_m: (min: (0, 0, 0), max: (24, 16, 7)),
          zones: [(name: "desk", min_m: (1, 12, 0), max_m: (5, 15, 2), air_limit_mps: 1.5)],
          drones: [
            (name: "e", airframe: "matrice-300", start_m: (13, 8, 5.5),
             tasks: [(to_m: (21, 2, 5.5), dwell_s: 1), (to_m: (4, 8, 5.5))]),
            (name: "a", airframe: "kolibri", start_m: (2, 2, 1.5),
             tasks: [(to_m: (21, 3, 2), dwell_s: 2), (to_m: (3, 4, 3))])])"#,
    );
    let above_the_desk = Task {
        to_m: [3.0, 13.5, 5.0].into(),
        dwell_s: 5.0,
        load_kg: None,
        during_s: None,
    };
    for at_s in [2.0, 5.0, 9.0] {
        let mut running = flown.clone();
        let told = changed(
            &mut running,
            at_s,
            retasked("e", vec![above_the_desk.clone()]),
        );
        let refused: Vec<&str> = told.refused.iter().map(|it| it.name.as_str()).collect();
        assert_eq!(refused, ["e"], "{at_s} s");
        assert!(
            told.refused[0].reason.contains("goes on"),
            "{:?}",
            told.refused
        );
        sound(&running);
        let (e, before) = (find(running.plan(), "e"), find(flown.plan(), "e"));
        assert_eq!(e.trajectory, before.trajectory, "{at_s} s");
    }
}

#[test]
fn a_late_drone_does_not_stop_in_anothers_place_where_it_would_pass_it() {
    let mut running = flown(include_str!("../../../../../scenarios/window.ron"));
    let mut told = Replanned::default();
    for (at_s, changes) in [
        (0.3, vec![late("d3", 0.6)]),
        (1.8, vec![late("d20", 3.0), late("d7", 2.0)]),
        (
            4.1,
            vec![
                late("d17", 0.3),
                late("d18", 1.0),
                failed("d12"),
                failed("d15"),
            ],
        ),
        (
            6.4,
            vec![
                late("d6", 1.0),
                late("d20", 3.0),
                late("d8", 3.0),
                late("d4", 0.6),
            ],
        ),
    ] {
        let answer = running.replan(at_s, &changes, &Control::QUIET);
        told = answer.expect("in order");
        assert_eq!(ahead(&running, at_s), told.unavoidable, "{at_s} s");
    }
    let touches = |it: &&Violation| {
        it.kind == ViolationKind::Collision
            && (it.drone == "d8" || it.with.as_deref() == Some("d8"))
    };
    let touched: Vec<&Violation> = told.unavoidable.iter().filter(touches).collect();
    assert!(touched.is_empty(), "{touched:#?}");
}

#[test]
fn a_late_drone_is_held_to_no_arrival_and_leaves_as_planned() {
    let mut running = flown(
        r#"Scenario(name: "appointments", bounds_m: (min: (0, 0, 0), max: (24, 12, 6)), drones: [
          (name: "p", airframe: "kolibri", start_m: (2.5, 2.5, 2.5),
           tasks: [(to_m: (20.5, 2.5, 2.5), during_s: (18, 22)),
                   (to_m: (2.5, 4.5, 2.5), during_s: (36, 38))])])"#,
    );
    let planned_s = find(running.plan(), "p").arrives_s;
    let told = changed(&mut running, 10.0, late("p", 8.0));
    assert_eq!(told.refused, []);
    sound(&running);
    let leaves_s = find(running.plan(), "p").arrives_s;
    assert!(
        planned_s <= leaves_s && leaves_s < planned_s + 2.0,
        "{leaves_s} s"
    );
}

#[test]
fn a_drone_that_is_late_on_its_pad_stands_on_the_ground_however_long() {
    let mut running = flown(
        r#"Scenario(name: "held", bounds_m: (min: (0, 0, 0), max: (24, 12, 5)),
          obstacles: [(name: "table", min_m: (1, 1, 0), max_m: (5, 3, 0.8))], drones: [
          (name: "held", airframe: "kolibri", start_m: (2, 2, 0.9), at_start: Landed,
           tasks: [(to_m: (20, 2, 2))]),
          (name: "x", airframe: "kolibri", start_m: (3, 9, 1.5),
           tasks: [(to_m: (20, 9, 2), dwell_s: 300)])])"#,
    );
    for step in 1..16 {
        let at_s = 4.0 * f64::from(step);
        let told = changed(&mut running, at_s, late("held", 4.0));
        assert_eq!(told.unavoidable, [], "{at_s} s");
        running.forget(at_s - 10.0);
        sound(&running);
        let held = find(running.plan(), "held");
        assert_eq!(held.at_start, AtStart::Landed, "{at_s} s");
        assert!(held.airborne_s.0 >= at_s, "{at_s} s: {:?}", held.airborne_s);
    }
}

#[test]
fn a_wreck_does_not_lie_within_an_obstacle() {
    let running = flown(
        r#"Scenario(name: "rack", bounds_m: (min: (0, 0, 0), max: (24, 12, 6)),
          obstacles: [(name: "rack", min_m: (10, 5, 0), max_m: (11, 11, 4))], drones: [
          (name: "b", airframe: "kolibri", start_m: (3, 3, 2), tasks: [(to_m: (20, 3, 2))])])"#,
    );
    let lies = |z_m: f64| Change::Failed {
        drone: "b".to_owned(),
        lies_m: Some([10.5, 8.0, z_m].into()),
    };
    let told = running
        .check(2.0, &[lies(0.1)])
        .expect_err("it is in the rack");
    assert!(
        told[0].to_string().contains("in an obstacle"),
        "{}",
        told[0]
    );
    assert!(running.check(2.0, &[lies(4.05)]).is_ok());
}
