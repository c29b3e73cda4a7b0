//! Drones that give way, drones without a path, what is wrong with a change, and loads and
//! landings.

use super::*;

#[test]
fn a_drone_in_the_way_gives_way() {
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
fn a_late_drone_that_is_in_conflict_already_is_told_of() {
    // `b` follows `a` at a distance; `a` stops, and `b` is in its body before it can stop.
    let (world, plan) = planned(
        r#"Scenario(name: "behind", bounds_m: (min: (0, 0, 0), max: (24, 1, 1)),
          drones: [
            (name: "a", airframe: "kolibri", start_m: (1.5, 0.5, 0.5), tasks: [(to_m: (22.5, 0.5, 0.5))]),
            (name: "b", airframe: "kolibri", start_m: (0.5, 0.5, 0.5), tasks: [(to_m: (20.5, 0.5, 0.5))]),
          ])"#,
    );
    let (running, told) =
        replan(&world, &plan, 4.25, &[late("a", 1.0)], &Control::QUIET).expect("in order");
    assert!(!told.unavoidable.is_empty());
    assert_eq!(running.plan().violations, told.unavoidable);
}

/// A late drone finds no path and stops, above the goal of another: that one stops before it gets
/// there.
#[test]
fn a_drone_that_would_end_under_one_that_stops_stops_as_well() {
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
    let asked = |name: &str| changes.iter().any(|change| change.drone() == name);
    let stops = told.refused.iter().find(|out| !asked(&out.name));
    let stops = stops.expect("d293, where this was written");
    assert!(stops.reason.contains("it stops"), "{stops:?}");
    let cause = told.changed.iter().find(|one| one.drone == stops.name);
    assert_eq!(cause.map(|one| one.cause), Some(Cause::GaveWay));
    assert!(running.plan().unplanned.contains(stops));
    assert_eq!(running.plan().violations, told.unavoidable);
    assert_eq!(verify(running.plan()).violations, told.unavoidable);
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
        late("nobody", 1.0),
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
