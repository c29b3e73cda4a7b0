//! Places that any drone of a group may take, all at one time.

use planner::scenario::missing;
use planner::{Control, Files, plan_world};

#[test]
fn fleets_are_in_place_together_for_as_long_as_they_are_to_be() {
    let control = Control::QUIET;
    for seed in 0..12_u32 {
        // Spread by the golden ratio's and the plastic number's fractions: no two are near.
        let place = |k: u32, z: f64| {
            let spread = |ratio: f64| 2.0 + 30.0 * (f64::from(k + 7 * seed + 1) * ratio).fract();
            [spread(0.618_034), spread(0.754_878), z]
        };
        let drone = |k: u32| {
            let [x, y, z] = place(k, 2.5);
            format!(r#"(name: "k{k}", airframe: "kolibri", start_m: ({x}, {y}, {z}))"#)
        };
        let drones: Vec<String> = (0..6).map(drone).collect();
        let to_m = |from: u32, z: f64| -> Vec<String> {
            let text = |k| {
                let [x, y, z] = place(from + k, z);
                format!("({x:.2}, {y:.2}, {z})")
            };
            (0..6).map(text).collect()
        };
        let formations = format!(
            "(to_m: [{}], during_s: (25, 30.5)), (to_m: [{}], during_s: (60, 61))",
            to_m(6, 6.5).join(", "),
            to_m(12, 3.5).join(", "),
        );
        let text = format!(
            r#"(name: "s", bounds_m: (min: (0, 0, 0), max: (40, 40, 10)), drones: [{}],
                formations: [{formations}])"#,
            drones.join(", ")
        );
        let mut world = planner::read_world(&text).unwrap();
        let outcome = plan_world(&world, &control).unwrap();
        let plan = outcome.into_planned().unwrap().plan;
        assert_eq!(
            (plan.unplanned.len(), plan.violations.len()),
            (0, 0),
            "{seed}"
        );
        assert_eq!(missing(&world, &plan), [""; 0], "{seed}");
        assert!(
            plan.drones.iter().all(|drone| drone.arrives_s == 61.0),
            "{seed}"
        );
        // Who is there before the others, or before the time, has waited for nothing.
        let waits_s = plan.drones.iter().map(|drone| drone.waits_s);
        assert_eq!(waits_s.sum::<f64>(), 0.0, "{seed}");
        // It is seen where a plan does not keep the time.
        for task in world.drones.iter_mut().flat_map(|drone| &mut drone.tasks) {
            task.during_s = task
                .during_s
                .map(|[from_s, until_s]| [from_s, until_s + 40.0]);
        }
        assert_eq!(missing(&world, &plan).len(), 6, "{seed}");
    }
}

#[test]
fn no_drone_takes_a_place_that_only_another_can_take() {
    let planned = |place: &str, drones: &[(&str, [f64; 3])], formation: &str| {
        let drone = |(k, (airframe, [x, y, z])): (usize, &(&str, [f64; 3]))| {
            format!(r#"(name: "d{k}", airframe: "{airframe}", start_m: ({x}, {y}, {z}))"#)
        };
        let drones: Vec<String> = drones.iter().enumerate().map(drone).collect();
        let text = format!(
            r#"(name: "s", bounds_m: (min: (0, 0, 0), max: (14, 10, 6)), {place}
                drones: [{}], formations: [({formation})])"#,
            drones.join(", ")
        );
        let leans =
            |_: &str| Ok("Finding(verdict: library, effects: (wake_lean: (share: 1)))".to_owned());
        let world = planner::read_world_with(&text, &Files::new(&leans)).unwrap();
        let outcome = plan_world(&world, &Control::QUIET).unwrap();
        let planner::Outcome::Safe(planned) = outcome else {
            panic!("{formation} in {place}");
        };
        // Not at the price of a rule.
        let mut paths = planned.plan.drones.iter().map(|it| &it.trajectory);
        assert!(paths.any(|it| it.is_smooth()), "{formation} in {place}");
    };
    let pair = [
        ("matrice-300", [6.0, 2.0, 4.0]),
        ("crazyflie-2.1", [13.0, 2.0, 4.0]),
    ];
    let apart = "to_m: [(6, 6, 4), (12, 6, 4)], dwell_s: 3";
    // For the large one too near to an obstacle, or above a zone that it is too strong for.
    for place in [
        r#"obstacles: [(name: "o", min_m: (6.3, 5, 0), max_m: (7, 7, 6))],"#,
        r#"zones: [(name: "z", min_m: (5, 5, 0), max_m: (7, 7, 1), air_limit_mps: 2)],"#,
        r#"zones: [(name: "z", min_m: (6.3, 5, 0), max_m: (7, 7, 6), keep_out: true)],"#,
    ] {
        planned(place, &pair, apart);
    }
    // Its wake leans towards a zone as far as the fleet accelerates.
    planned(
        r#"air: (finding: "lean.ron"),
            zones: [(name: "z", min_m: (13, 4, 0), max_m: (14, 6, 1), air_limit_mps: 1)],"#,
        &[
            ("matrice-300", [6.0, 5.0, 5.0]),
            ("kolibri", [4.0, 9.0, 5.0]),
        ],
        "to_m: [(10, 5, 5), (3, 5, 5)], dwell_s: 1",
    );
    // Too near to the next place.
    let three = [
        ("matrice-300", [2.0, 5.0, 3.0]),
        ("crazyflie-2.1", [2.0, 2.0, 3.0]),
        ("crazyflie-2.1", [10.0, 5.0, 3.0]),
    ];
    planned(
        "",
        &three,
        "to_m: [(4, 5, 3), (4.5, 5, 3), (9, 5, 3)], dwell_s: 4",
    );
    // In time, but not in smooth motion.
    let late = [
        ("crazyflie-2.1", [1.0, 2.0, 2.0]),
        ("crazyflie-2.1", [5.0, 3.0, 2.0]),
    ];
    planned(
        "",
        &late,
        "to_m: [(5, 3, 2), (11, 3, 2)], during_s: (5.3, 8)",
    );
}

/// Where another is to hover above it from then on, it takes off before.
#[test]
fn a_drone_that_is_due_late_waits_on_the_ground_and_flies_straight_there() {
    let text = |due_s: f64, others: &str| {
        format!(
            r#"(name: "late", bounds_m: (min: (0, 0, 0), max: (20, 10, 6)), drones: [
                (name: "k1", airframe: "kolibri", start_m: (2, 2, 0.1), at_start: Landed, at_end: Land,
                    tasks: [(to_m: (15, 5, 2), during_s: ({due_s}, 42)), (to_m: (10, 5, 2))]),
                {others}])"#
        )
    };
    let planned = |due_s: f64, others: &str| {
        let world = planner::read_world(&text(due_s, others)).unwrap();
        let outcome = plan_world(&world, &Control::QUIET).unwrap();
        let plan = outcome.into_planned().unwrap().plan;
        assert_eq!((plan.unplanned.len(), plan.violations.len()), (0, 0));
        assert_eq!(missing(&world, &plan), [""; 0]);
        plan
    };
    for due_s in [10.0, 14.0, 40.0] {
        let plan = planned(due_s, "");
        let (from_s, _) = plan.drones[0].airborne_s;
        // Its flight takes 10 s; it is early by 3 s and a quarter of that.
        assert!((from_s - (due_s - 16.0).max(0.0)).abs() < 0.5, "{from_s}");
        assert!(plan.drones[0].detour_m < 0.2, "{plan:#?}");
    }
    // One comes to hover above it, from when it would take off on.
    let above = r#"(name: "o1", airframe: "offboard-2", start_m: (2, 8, 3),
        tasks: [(to_m: (2, 2, 3), during_s: (15, 60))])"#;
    let plan = planned(40.0, above);
    let (from_s, _) = plan.drones[0].airborne_s;
    assert!(from_s < 15.0, "{from_s}");
}
