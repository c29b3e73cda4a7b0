//! Places that any drone of a group may take, all at one time.

use planner::scenario::missing;
use planner::{Control, plan_world};

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
