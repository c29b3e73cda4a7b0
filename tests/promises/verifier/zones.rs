//! The air in zones.

use planner::plan::{AtEnd, ViolationKind};
use planner::verify::verify;

use super::plans::{drone, kinds, plan, with_zone};
use super::{broken, refused};

#[test]
fn a_zone_is_judged_at_every_point_and_with_all_wakes_summed() {
    let above = |x_m: f64, end: AtEnd| {
        let mut one = drone(
            "a",
            "offboard-2",
            &[(0.0, [x_m, 5.0, 6.0]), (8.0, [x_m + 8.0, 5.0, 6.0])],
        );
        one.at_end = end;
        with_zone(plan(vec![one]), [9.0, 4.98, 0.0], [9.02, 5.0, 2.0], 1.5)
    };
    // A zone of 2 cm, thinner than any sampling, flown over at 1 m/s.
    refused(
        ViolationKind::Zone,
        &above(5.0, AtEnd::Hover),
        &above(20.0, AtEnd::Hover),
    );
    let stays = verify(&above(1.0, AtEnd::Hover));
    assert_eq!(stays.violations.len(), 1);
    assert_eq!(stays.violations[0].until_s, None);
    let two = |aside_m: f64| {
        let drones = vec![
            drone("a", "offboard-2", &[(0.0, [10.0 - aside_m, 10.0, 6.0])]),
            drone("b", "offboard-2", &[(0.0, [10.0 + aside_m, 10.0, 6.0])]),
        ];
        with_zone(plan(drones), [9.9, 9.9, 0.0], [10.1, 10.1, 2.0], 2.5)
    };
    let alone = broken(two(0.5), |plan| {
        plan.drones.pop();
    });
    refused(ViolationKind::Zone, &two(0.5), &alone);
    assert!(kinds(&two(1.5)).is_empty());
}
