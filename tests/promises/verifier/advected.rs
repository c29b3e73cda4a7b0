//! Advected wakes, by a range of convection factors: they are judged at every delay from none
//! on, the same factor for all wakes at a time.

use airflow::Convection;
use planner::plan::{AirDelay, DronePlan, Plan, Violation, ViolationKind};
use planner::verify::lateness::of_all;
use planner::verify::verify;

use super::margins::bearing;
use super::plans::{drone, leaves, plan, with_zone};

/// The same plan with advected wakes.
fn late(mut plan: Plan, factors: [f64; 2]) -> Plan {
    let convection = Convection::new(factors).expect("a range");
    plan.quasi_static = false;
    plan.air_delay = Some(AirDelay { convection });
    plan
}

fn found(plan: &Plan) -> Vec<Violation> {
    verify(plan).violations
}

/// Who is over the limit, and by whose air.
fn over(plan: &Plan) -> Vec<(ViolationKind, String, Option<String>)> {
    let found = found(plan).into_iter();
    found.map(|it| (it.kind, it.drone, it.with)).collect()
}

/// An Offboard 2 that flies along x at 2 m/s, so high, ahead and aside of [`follower`] (m).
fn leader(name: &str, height_m: f64, ahead_m: f64, aside_m: f64) -> DronePlan {
    let at = |x: f64| [x, 10.0 + aside_m, 2.0 + height_m];
    let (from_m, to_m) = (5.0 + ahead_m, 29.0 + ahead_m);
    drone(name, "offboard-2", &[(0.0, at(from_m)), (12.0, at(to_m))])
}

/// A Kolibri that flies the same way at the same speed; it leaves at the end, since the air behind
/// it goes on.
fn follower(limit: f64) -> DronePlan {
    let at = |x: f64| [x, 10.0, 2.0];
    let mut drone = leaves(drone(
        "follower",
        "kolibri",
        &[(0.0, at(5.0)), (12.0, at(29.0))],
    ));
    drone.air_limit = limit;
    drone
}

#[test]
fn a_drone_that_follows_another_is_in_its_air_though_never_below_it() {
    // The leader's air takes 0.55 s down 4 m: it trails by 1.1 m.
    let trails = || plan(vec![leader("leader", 4.0, 1.1, 0.0), follower(0.3)]);
    let named = |kind| [(kind, "follower".to_owned(), Some("leader".to_owned()))];
    assert_eq!(over(&trails()), []);
    for factors in [[1.0, 1.0], [0.6, 1.0]] {
        assert_eq!(over(&late(trails(), factors)), named(ViolationKind::Air));
        let margin = bearing(late(trails(), factors), 0.1, 0.0);
        assert_eq!(over(&margin), named(ViolationKind::Air));
    }
    // Four metres behind it is out of its air, at any factor of these.
    let far = plan(vec![leader("leader", 4.0, 4.0, 0.0), follower(0.3)]);
    assert_eq!(over(&bearing(late(far, [0.6, 1.0]), 0.1, 0.0)), []);
}

#[test]
fn exposure_to_advected_wakes_is_reported_from_when_on_until_when_it_is_over_the_limit() {
    let stays = |name: &str, at: [f64; 3]| drone(name, "crazyflie-2.1", &[(0.0, at), (60.0, at)]);
    let hover = plan(vec![
        stays("below", [5.0, 5.0, 1.0]),
        stays("above", [5.0, 5.0, 2.2]),
    ]);
    let (quasi_static, hover) = (found(&hover), late(hover, [0.6, 1.0]));
    for told in [&quasi_static, &found(&hover)] {
        let spans: Vec<_> = told.iter().map(|it| (it.from_s, it.until_s)).collect();
        assert_eq!(spans, [(0.0, None)], "{told:?}");
    }
    // What is exceeded already leaves no room to be late.
    let room: Vec<_> = of_all(&hover, &|| false).into_iter().flatten().collect();
    assert_eq!(room.len(), 2);
    for it in room {
        assert_eq!(it.late_s, 0.0, "{it:?}");
        assert_eq!(it.breaks.map(|it| it.0), Some(ViolationKind::Air));
    }
    // One that comes, stays and goes: its air is there as soon as it is at the earliest, and until
    // it was carried down at the latest.
    let passes = [
        (0.0, [12.0, 5.0, 2.2]),
        (20.0, [12.0, 5.0, 2.2]),
        (24.0, [5.0, 5.0, 2.2]),
        (44.0, [5.0, 5.0, 2.2]),
        (48.0, [12.0, 5.0, 2.2]),
    ];
    let passing = plan(vec![
        stays("below", [5.0, 5.0, 1.0]),
        drone("above", "crazyflie-2.1", &passes),
    ]);
    let only = |plan: &Plan| {
        let found = found(plan);
        assert_eq!(found.len(), 1, "{found:?}");
        (found[0].from_s, found[0].until_s.expect("it goes"))
    };
    let (quasi_static, late) = (only(&passing), only(&late(passing.clone(), [0.6, 1.0])));
    assert!(
        (late.0 - quasi_static.0).abs() < 0.02,
        "{late:?} {quasi_static:?}"
    );
    assert!(
        (quasi_static.1..quasi_static.1 + 1.5).contains(&late.1),
        "{late:?} {quasi_static:?}"
    );
}

#[test]
fn air_is_judged_between_the_ends_of_the_range_and_at_once() {
    // Down 7 m it trails by 2.7 m at a factor of 1, by 4.5 m at 0.6, and the jet is 0.66 m wide at
    // half its speed.
    let between = || plan(vec![leader("leader", 7.0, 3.6, 0.0), follower(0.3)]);
    for ends in [[1.0, 1.0], [0.6, 0.6]] {
        let [factor, _] = ends;
        let told = over(&late(between(), ends));
        // Every delay from none to that of the factor is judged.
        assert_eq!(told.is_empty(), factor == 1.0, "{factor}: {told:?}");
    }
    assert!(!over(&late(between(), [0.6, 1.0])).is_empty());
    // Below it at once, and never in what trails.
    let below = || plan(vec![leader("leader", 4.0, 0.0, 0.0), follower(0.3)]);
    assert!(!over(&late(below(), [0.6, 1.0])).is_empty());
}

#[test]
fn all_air_has_one_factor_at_a_time() {
    // The air of one is there at a factor of 1, that of the other at 0.6; each alone is borne, both
    // together would not be.
    let two = |limit: f64| {
        let first = leader("first", 7.0, 2.7, 0.54);
        let second = leader("second", 7.0, 4.5, 0.54);
        late(plan(vec![first, second, follower(limit)]), [0.6, 1.0])
    };
    assert_eq!(over(&two(0.3)), []);
    let both: Vec<_> = over(&two(0.2)).into_iter().map(|it| it.2).collect();
    assert!(!both.is_empty());
    let worst_mps = |plan: &Plan| verify(plan).exposures[2].worst_air_mps;
    let alone = |name: &str| {
        let mut plan = two(0.3);
        plan.drones
            .retain(|it| it.name == name || it.name == "follower");
        verify(&plan).exposures[1].worst_air_mps
    };
    let (first_mps, second_mps) = (alone("first"), alone("second"));
    let together_mps = worst_mps(&two(0.3));
    let sum_mps = first_mps.hypot(second_mps);
    assert!(
        together_mps < 0.9 * sum_mps && together_mps > 0.97 * first_mps.max(second_mps),
        "{first_mps} {second_mps} {together_mps}"
    );
}

#[test]
fn air_that_left_before_its_drone_landed_or_left_is_still_under_way() {
    let hovers = [(0.0, [10.0, 10.0, 8.0]), (3.0, [10.0, 10.0, 8.0])];
    let gone = || leaves(drone("gone", "matrice-300", &hovers));
    let lower = || {
        let knots = [
            (0.0, [3.0, 10.0, 2.0]),
            (3.5, [10.0, 10.0, 2.0]),
            (7.0, [17.0, 10.0, 2.0]),
        ];
        drone("lower", "kolibri", &knots)
    };
    assert_eq!(over(&plan(vec![gone(), lower()])), []);
    let advected = over(&late(plan(vec![gone(), lower()]), [0.6, 1.0]));
    let named = (
        ViolationKind::Air,
        "lower".to_owned(),
        Some("gone".to_owned()),
    );
    assert_eq!(advected, [named]);
    // In a zone as well.
    let desk = |plan| with_zone(plan, [9.5, 9.5, 0.0], [10.5, 10.5, 1.5], 1.0);
    let until_s = |plan: Plan| found(&plan)[0].until_s.expect("it is gone");
    assert_eq!(until_s(desk(plan(vec![gone()]))), 3.0);
    assert!(until_s(late(desk(plan(vec![gone()])), [0.6, 1.0])) > 4.0);
}

#[test]
fn a_plan_that_contradicts_itself_about_delay_is_malformed() {
    let mut plan = late(plan(vec![follower(0.3)]), [0.6, 1.0]);
    plan.quasi_static = true;
    let kinds: Vec<ViolationKind> = found(&plan).iter().map(|it| it.kind).collect();
    assert_eq!(kinds, [ViolationKind::Malformed]);
}
