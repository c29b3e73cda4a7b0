//! The air in zones.

use airflow::{Air, Airframe, Jet, Wake};
use nalgebra::Vector3;
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

#[test]
fn the_corner_of_a_zone_beside_the_jets_of_a_drone_is_judged() {
    // Below the near field of a kolibri, where the air falls by a tenth within a centimetre.
    let hovers = drone("k", "kolibri", &[(0.0, [5.0, 5.0, 2.0])]);
    let zone = |air_limit_mps: f64| {
        let plan = plan(vec![hovers.clone()]);
        with_zone(plan, [5.12, 5.12, 1.6], [6.0, 6.0, 1.65], air_limit_mps)
    };
    let airframe = Airframe::preset("kolibri").unwrap();
    let density = Air::default().density_kg_per_m3();
    let wake = Wake::new(&airframe, airframe.mass_kg(), density, &Jet::default());
    let along_edge = (0..=50).map(|k| Vector3::new(0.12, 0.12, -0.4 + 1e-3 * f64::from(k)));
    let highest_mps = along_edge
        .map(|beside_m| wake.axial_speed_mps(beside_m))
        .fold(0.0, f64::max);
    refused(
        ViolationKind::Zone,
        &zone(highest_mps / 1.01),
        &zone(highest_mps),
    );
    let most_mps = verify(&zone(2.0 * highest_mps)).zone_air[0].at_most_mps;
    assert!(most_mps.unwrap() >= highest_mps * (1.0 - 1e-9));
}

#[test]
fn air_just_over_the_limit_of_a_zone_hides_none_that_is_farther_over_it() {
    let hovers = drone("a", "offboard-2", &[(0.0, [10.0, 10.0, 7.0])]);
    let zone = |air_limit_mps: f64| {
        let plan = plan(vec![hovers.clone()]);
        with_zone(plan, [8.9, 9.9, 0.0], [10.9, 11.1, 4.0], air_limit_mps)
    };
    let airframe = Airframe::preset("offboard-2").unwrap();
    let density = Air::default().density_kg_per_m3();
    let wake = Wake::new(&airframe, airframe.mass_kg(), density, &Jet::default());
    let highest_mps = wake.axial_speed_mps(Vector3::new(0.0, 0.0, -3.0));
    // Above 0.75 % a violation, whatever is found first.
    for over in [1.0076, 1.009, 1.0122, 1.02] {
        let kinds = kinds(&zone(highest_mps / over));
        assert_eq!(kinds, [ViolationKind::Zone], "{over}");
    }
    for over in [1.0, 1.004] {
        let report = verify(&zone(highest_mps / over));
        assert!(report.violations.is_empty(), "{over}");
        let most_mps = report.zone_air[0].at_most_mps.unwrap();
        assert!(most_mps >= highest_mps * (1.0 - 1e-9), "{over}: {most_mps}");
    }
}

#[test]
fn an_upper_bound_is_not_reported_as_air_that_was_reached() {
    let hovers = drone("a", "offboard-2", &[(0.0, [5.0, 5.0, 6.0])]);
    let over = with_zone(plan(vec![hovers]), [4.0, 4.0, 0.0], [6.0, 6.0, 2.0], 0.5);
    let mut found = verify(&over).violations.remove(0);
    assert!(!found.is_bound);
    assert!(found.to_string().contains("at worst"), "{found}");
    found.is_bound = true;
    let told = found.to_string();
    assert!(told.contains("could not be decided"), "{told}");
    assert!(!told.contains("at worst"), "{told}");
}

#[test]
fn no_point_of_a_zone_has_more_air_than_is_said_to_be_most() {
    let crosses = drone(
        "a",
        "offboard-2",
        &[(0.0, [4.0, 5.0, 6.0]), (8.0, [14.0, 6.0, 5.0])],
    );
    let limit_mps = 9.0;
    let zone = with_zone(
        plan(vec![crosses]),
        [8.0, 4.0, 0.0],
        [10.0, 7.0, 2.0],
        limit_mps,
    );
    let report = verify(&zone);
    assert!(report.violations.is_empty());
    let at_most_mps = report.zone_air[0].at_most_mps.unwrap();
    assert!(
        at_most_mps < 1.2 * report.zone_air[0].worst_air_mps,
        "{report:?}"
    );
    // A limit above what is most is kept, and one below what was found is not.
    let with_limit = |limit_mps: f64| {
        broken(zone.clone(), |plan| {
            plan.zones[0].air_limit_mps = Some(limit_mps)
        })
    };
    let found_mps = report.zone_air[0].worst_air_mps;
    refused(
        ViolationKind::Zone,
        &with_limit(0.98 * found_mps),
        &with_limit(at_most_mps),
    );
}

#[test]
fn below_many_drones_the_most_air_is_found_too() {
    // Forty cross the floor in turn, each a little farther from the zone, and one comes late.
    let crosses = |k: usize| {
        let (begins_s, y_m) = (3.0 * k as f64, 1.0 + 0.9 * k as f64);
        let [from_m, to_m] = [[1.0, y_m, 6.0], [39.0, y_m, 6.0]];
        let knots = [(0.0, from_m), (begins_s, from_m), (begins_s + 19.0, to_m)];
        drone(&format!("d{k}"), "offboard-2", &knots)
    };
    let mut drones: Vec<_> = (0..40).map(crosses).collect();
    let [from_m, to_m] = [[20.0, 38.0, 5.0], [20.0, 2.0, 5.0]];
    let knots = [(0.0, from_m), (150.0, from_m), (168.0, to_m)];
    drones.push(drone("late", "offboard-2", &knots));
    let zone = with_zone(plan(drones), [19.0, 9.0, 0.0], [21.0, 11.0, 2.0], 20.0);
    let report = verify(&zone);
    let air = &report.zone_air[0];
    assert_eq!(air.worst_air_from.as_deref(), Some("late"));
    let (found_mps, at_most_mps) = (air.worst_air_mps, air.at_most_mps.unwrap());
    assert!(at_most_mps < 1.03 * found_mps, "{air:?}");
    let with_limit = |limit_mps: f64| {
        broken(zone.clone(), |plan| {
            plan.zones[0].air_limit_mps = Some(limit_mps)
        })
    };
    let of_zones = |plan: &planner::plan::Plan| kinds(plan).contains(&ViolationKind::Zone);
    assert!(of_zones(&with_limit(0.98 * found_mps)));
    assert!(!of_zones(&with_limit(at_most_mps)));
}
