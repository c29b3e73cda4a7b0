//! Margins, limits of climb and descent, take-off and landing, zones that keep bodies out: each
//! rule refuses a plan that breaks it, and no other.

use planner::plan::file::PlanFile;
use planner::plan::{AtStart, DronePlan, Margins, Plan, ViolationKind};
use planner::verify::examination::examine;
use planner::verify::lateness::{FINE_S, LATEST_S};
use planner::verify::verify;

use super::plans::{Knot, drone, kinds, lands, leaves, plan, preset, with_box, with_zone};
use super::{broken, refused};

pub(super) fn bearing(mut plan: Plan, time_s: f64, tracking_m: f64) -> Plan {
    plan.margins = Margins { time_s, tracking_m };
    plan
}

/// The same, later by so much; it holds its first place until then.
fn late(mut drone: DronePlan, by_s: f64) -> DronePlan {
    drone.trajectory.t_s.iter_mut().for_each(|t_s| *t_s += by_s);
    drone
}

/// Two Kolibris at 2 m/s whose paths cross at right angles, the second so much later (s).
fn crossing(behind_s: f64) -> Plan {
    let along: [Knot; 2] = [(0.0, [1.0, 5.0, 2.0]), (4.0, [9.0, 5.0, 2.0])];
    let across: [Knot; 2] = [(0.0, [5.0, 1.0, 2.0]), (4.0, [5.0, 9.0, 2.0])];
    plan(vec![
        drone("a", "kolibri", &along),
        late(drone("b", "kolibri", &across), behind_s),
    ])
}

/// Smallest lag of the second at which two bodies of a preset do not touch (s): they are nearest
/// at `lag v / √2`.
fn apart_s(room_m: f64) -> f64 {
    let bodies_m = 2.0 * preset("kolibri").body_radius_m + room_m;
    bodies_m * 2.0_f64.sqrt() / 2.0
}

#[test]
fn two_drones_that_meet_when_one_is_late_and_the_other_early_are_refused() {
    let needs_s = apart_s(0.0);
    for time_s in [0.05, 0.1, 0.4] {
        let at = |lag_s| bearing(crossing(lag_s), time_s, 0.0);
        let least_s = needs_s + 2.0 * time_s;
        refused(
            ViolationKind::CollisionMargin,
            &at(least_s - 0.005),
            &at(least_s + 0.002),
        );
        let found = &verify(&at(least_s - 0.005)).violations[0];
        let shift_s = found.shift_s.expect("of two clocks");
        assert!((shift_s.abs() - 2.0 * time_s).abs() < 1e-6, "{found}");
    }
    // Without the margin it holds.
    assert!(kinds(&crossing(needs_s + 0.002)).is_empty());
}

#[test]
fn two_drones_that_meet_when_both_are_off_their_paths_are_refused() {
    for tracking_m in [0.05, 0.1, 0.5] {
        let at = |lag_s| bearing(crossing(lag_s), 0.0, tracking_m);
        let least_s = apart_s(2.0 * tracking_m);
        refused(
            ViolationKind::CollisionMargin,
            &at(least_s - 0.005),
            &at(least_s + 0.002),
        );
    }
    // One that stands is where it is: half of the room will do.
    let beside = |gap_m: f64| {
        let body_m = preset("kolibri").body_radius_m;
        let mut standing = drone("b", "kolibri", &[(0.0, [5.0, 5.0, body_m])]);
        standing.at_start = AtStart::Landed;
        standing.airborne_s = (0.0, Some(0.0));
        let y_m = 5.0 + 2.0 * body_m + gap_m;
        let past = [
            (0.0, [1.0, y_m, body_m + 0.3]),
            (4.0, [9.0, y_m, body_m + 0.3]),
        ];
        bearing(plan(vec![drone("a", "kolibri", &past), standing]), 0.0, 0.2)
    };
    assert!(kinds(&beside(0.2)).is_empty());
    assert_eq!(kinds(&beside(-0.05)), [ViolationKind::CollisionMargin]);
}

#[test]
fn an_obstacle_within_the_tracking_margin_is_refused_but_not_under_the_drones_own_pad() {
    let body_m = preset("offboard-2").body_radius_m;
    let beside = |gap_m: f64| {
        let y_m = 12.0 + body_m + gap_m;
        let leg = plan(vec![drone(
            "a",
            "offboard-2",
            &[(0.0, [5.0, y_m, 1.0]), (8.0, [20.0, y_m, 1.0])],
        )]);
        let leg = with_box(leg, "rack", [10.0, 10.0, 0.0], [12.0, 12.0, 3.0]);
        bearing(leg, 0.0, 0.1)
    };
    refused(ViolationKind::ObstacleMargin, &beside(0.09), &beside(0.101));
    assert_eq!(kinds(&beside(-0.01)), [ViolationKind::Obstacle]);
    let onto = |shelf_m: [f64; 2]| {
        let landing = lands(drone(
            "a",
            "offboard-2",
            &[(0.0, [5.0, 5.0, 4.0]), (9.0, [5.0, 5.0, 1.0 + body_m])],
        ));
        let shelf = with_box(
            plan(vec![landing]),
            "shelf",
            [4.0, 4.0, 0.0],
            [6.0, 6.0, 1.0],
        );
        let [from_m, to_m] = shelf_m;
        let beside = with_box(shelf, "rack", [from_m, 4.0, 0.0], [to_m, 6.0, 3.0]);
        bearing(beside, 0.0, 0.1)
    };
    // The pad's own top bears nothing; a rack that rises beside it does.
    let near_m = 5.0 + body_m;
    refused(
        ViolationKind::ObstacleMargin,
        &onto([near_m + 0.09, 8.0]),
        &onto([near_m + 0.11, 8.0]),
    );
}

#[test]
fn a_body_in_a_zone_that_keeps_bodies_out_is_refused_with_its_tracking_margin() {
    let body_m = preset("kolibri").body_radius_m;
    let past = |gap_m: f64| {
        let y_m = 12.0 + body_m + gap_m;
        let leg = plan(vec![drone(
            "a",
            "kolibri",
            &[(0.0, [5.0, y_m, 1.0]), (8.0, [20.0, y_m, 1.0])],
        )]);
        let mut leg = with_zone(leg, [10.0, 10.0, 0.0], [12.0, 12.0, 2.0], 50.0);
        leg.zones[0].keep_out = true;
        leg.zones[0].air_limit_mps = None;
        leg
    };
    refused(ViolationKind::KeepOut, &past(-0.01), &past(0.001));
    let bearing = |gap_m| bearing(past(gap_m), 0.0, 0.1);
    refused(ViolationKind::KeepOut, &bearing(0.09), &bearing(0.101));
    // A zone that limits its air alone is told of the body that passes through.
    let report = verify(&broken(past(-0.5), |plan| {
        plan.zones[0].keep_out = false;
        plan.zones[0].air_limit_mps = Some(30.0);
    }));
    assert!(report.violations.is_empty(), "{:?}", report.violations);
    assert_eq!(report.zone_air[0].entered_by, ["a"]);
    assert_eq!(report.zone_air[0].worst_air_from.as_deref(), Some("a"));
    let wake_mps = preset("kolibri").hover_induced_velocity_mps;
    assert!(report.zone_air[0].worst_air_mps > wake_mps, "{report:?}");
}

/// A Matrice hovers; a Kolibri at 2 m/s reaches the place so far below and beside it at 3 s, and is
/// gone sideways at once.
fn below(depth_m: f64, beside_m: f64) -> Plan {
    let y_m = 10.0 + beside_m;
    let past = [
        (0.0, [4.0, y_m, 8.0 - depth_m]),
        (3.0, [10.0, y_m, 8.0 - depth_m]),
        (6.0, [10.0, y_m + 6.0, 8.0 - depth_m]),
    ];
    plan(vec![
        drone("k", "kolibri", &past),
        drone(
            "m",
            "matrice-300",
            &[(0.0, [10.0, 10.0, 8.0]), (4.0, [10.0, 2.0, 8.0])],
        ),
    ])
}

#[test]
fn a_column_that_is_entered_when_a_drone_is_late_is_refused() {
    // The emitter leaves at 2 m/s along y; the receiver waits beside its path.
    let at = |beside_m: f64| {
        let over = drone(
            "m",
            "matrice-300",
            &[(0.0, [10.0, 10.0, 8.0]), (4.0, [10.0, 2.0, 8.0])],
        );
        let waits = drone("k", "kolibri", &[(0.0, [10.0, 10.0 + beside_m, 6.5])]);
        plan(vec![waits, over])
    };
    let radius_m = 0.5 * (0.894 + 0.5334);
    let limits = |mut plan: Plan| {
        plan.drones[0].air_limit = 2.0;
        plan
    };
    let bears = |beside_m| limits(bearing(at(beside_m), 0.1, 0.0));
    // It moves away from the start on, so that nothing is earlier than it is.
    assert!(kinds(&bears(radius_m + 0.01)).is_empty());
    let crossing = |lag_s: f64| {
        let mut plan = at(-4.0);
        let leaves = [(0.0, [10.0, 6.0, 6.5]), (2.0 - lag_s, [10.0, 6.0, 6.5])];
        let gone = (3.0 - lag_s, [12.0, 6.0, 6.5]);
        plan.drones[0] = drone("k", "kolibri", &[leaves[0], leaves[1], gone]);
        limits(plan)
    };
    // It leaves at right angles, both at 2 m/s: they are nearest at `lag v / √2`.
    let least_s = radius_m * 2.0_f64.sqrt() / 2.0;
    assert!(kinds(&crossing(least_s + 0.4)).is_empty());
    let bears = |lag_s| bearing(crossing(lag_s), 0.1, 0.0);
    refused(
        ViolationKind::ColumnMargin,
        &bears(least_s + 0.1),
        &bears(least_s + 0.21),
    );
}

/// The same while the Matrice flies over that place at 3 s at 2 m/s.
fn passed_over(depth_m: f64, beside_m: f64) -> Plan {
    broken(below(depth_m, beside_m), |plan| {
        let over = [(0.0, [10.0, 16.0, 8.0]), (6.0, [10.0, 4.0, 8.0])];
        plan.drones[1] = drone("m", "matrice-300", &over);
        plan.drones[0].air_limit = 2.0;
    })
}

/// The highest mean over the limit that samples of all clocks find, within a margin.
fn sampled_alpha(plan: &Plan, time_s: f64) -> f64 {
    let steps = 16;
    let mut worst: f64 = 0.0;
    for early in -steps..=steps {
        let by_s = 2.0 * time_s * f64::from(early) / f64::from(steps);
        let mut shifted = plan.clone();
        shifted.margins = Margins::default();
        // Both clocks within the margin: their difference within twice the margin.
        let moved = usize::from(by_s < 0.0);
        let drone = shifted.drones[moved].clone();
        shifted.drones[moved] = late(drone, by_s.abs());
        let exposure = &verify(&shifted).exposures[0];
        worst =
            worst.max(exposure.worst_air_mps / plan.drones[0].airframe.hover_induced_velocity_mps);
    }
    worst
}

#[test]
fn air_that_is_too_strong_when_a_drone_is_early_or_late_is_refused_as_dense_samples_say() {
    let mut both = [0, 0];
    for k in 0..10 {
        let plan = passed_over(3.5 + 0.2 * f64::from(k % 3), 0.1 * f64::from(k));
        let alpha = sampled_alpha(&plan, 0.1);
        for (share, refuses) in [(0.97, true), (1.05, false)] {
            let mut plan = bearing(plan.clone(), 0.1, 0.0);
            plan.drones[0].air_limit = share * alpha;
            let kinds = kinds(&plan);
            let is_refused = kinds
                .iter()
                .any(|kind| kind.without_margin() == ViolationKind::Air);
            assert_eq!(is_refused, refuses, "{k}: alpha {alpha}, {kinds:?}");
            both[usize::from(refuses)] += 1;
        }
    }
    assert_eq!(both, [10, 10]);
}

#[test]
fn the_air_of_two_wakes_at_shifts_that_exclude_one_another_is_not_added_up() {
    // Two drones cross above a Kolibri that hovers, the second so much later.
    let over = |behind_s: f64, time_s: f64| {
        let over = |name, behind_s| {
            let knots = [(0.0, [2.0, 10.0, 11.0]), (8.0, [18.0, 10.0, 11.0])];
            let mut drone = late(drone(name, "kolibri", &knots), behind_s);
            drone.airframe = preset("offboard-2");
            drone.trajectory.mass_kg = vec![drone.airframe.mass_kg; 2];
            drone
        };
        let below = drone("k", "kolibri", &[(0.0, [10.0, 10.0, 7.0])]);
        let mut plan = plan(vec![below, over("a", 0.0), over("b", behind_s)]);
        plan.drones[0].air_limit = 2.0;
        bearing(plan, time_s, 0.0)
    };
    let alpha = |plan: &Plan| {
        let u_h_mps = plan.drones[0].airframe.hover_induced_velocity_mps;
        verify(plan).exposures[0].worst_air_mps / u_h_mps
    };
    // 0.6 s apart one of them alone is the worst; 0.1 s apart they add up.
    let limit = 1.05 * alpha(&over(0.6, 0.0));
    assert!(alpha(&over(0.1, 0.0)) > 1.1 * limit, "{limit}");
    let limited =
        |behind_s, time_s| broken(over(behind_s, time_s), |it| it.drones[0].air_limit = limit);
    let is_refused = |plan: &Plan| kinds(plan).contains(&ViolationKind::AirMargin);
    assert!(!is_refused(&limited(0.6, 0.0)));
    assert!(is_refused(&limited(0.6, 0.4)));
    // Each alone could be 0.8 s off the clock of the one below, but not both at once.
    assert!(!is_refused(&limited(1.2, 0.4)));
}

#[test]
fn a_zone_whose_air_is_too_strong_when_two_drones_come_together_is_refused() {
    let over = |behind_s: f64, time_s: f64| {
        let over = |name, y_m: f64, behind_s| {
            late(
                drone(
                    name,
                    "offboard-2",
                    &[(0.0, [2.0, y_m, 7.0]), (8.0, [18.0, y_m, 7.0])],
                ),
                behind_s,
            )
        };
        let plan = plan(vec![over("a", 10.0, 0.0), over("b", 10.6, behind_s)]);
        bearing(
            with_zone(plan, [9.9, 10.2, 1.0], [10.1, 10.4, 1.5], 50.0),
            time_s,
            0.0,
        )
    };
    let worst_mps = |plan: &Plan| verify(plan).zone_air[0].worst_air_mps;
    let (apart_mps, together_mps) = (worst_mps(&over(0.8, 0.0)), worst_mps(&over(0.0, 0.0)));
    assert!(together_mps > 1.1 * apart_mps, "{apart_mps} {together_mps}");
    let limited = |behind_s, time_s, limit_mps| {
        broken(over(behind_s, time_s), |it| {
            it.zones[0].air_limit_mps = Some(limit_mps)
        })
    };
    let between_mps = 0.5 * (apart_mps + together_mps);
    refused(
        ViolationKind::ZoneMargin,
        &limited(0.8, 0.4, between_mps),
        &limited(0.8, 0.4, 1.02 * together_mps),
    );
    assert!(kinds(&limited(0.8, 0.0, between_mps)).is_empty());
}

#[test]
fn climbs_and_descents_beyond_the_limits_are_refused() {
    let leg = |dz_m: f64, up_mps: f64, down_mps: f64| {
        let knots = [(0.0, [5.0, 5.0, 6.0]), (2.0, [7.0, 5.0, 6.0 + dz_m])];
        broken(plan(vec![drone("a", "kolibri", &knots)]), |plan| {
            plan.drones[0].airframe.max_climb_mps = Some(up_mps);
            plan.drones[0].airframe.max_descent_mps = Some(down_mps);
        })
    };
    refused(
        ViolationKind::Climb,
        &leg(2.0, 0.999, 0.1),
        &leg(2.0, 1.0, 0.1),
    );
    refused(
        ViolationKind::Descent,
        &leg(-2.0, 0.1, 0.999),
        &leg(-2.0, 0.1, 1.0),
    );
}

#[test]
fn a_take_off_or_a_landing_askew_and_one_too_fast_are_refused() {
    let body_m = preset("offboard-2").body_radius_m;
    let limited = |mut drone: DronePlan| {
        drone.airframe.max_descent_mps = Some(2.0);
        plan(vec![drone])
    };
    let landing = |aside_m: f64, slow_mps: f64| {
        let above_m = 2.0 * body_m + 0.5;
        let from_m = [5.0 + aside_m, 5.0, above_m];
        let slow_s = (above_m - body_m) / slow_mps;
        let knots = [
            (0.0, [5.0 + aside_m, 5.0, 5.0]),
            (4.0, from_m),
            (4.0 + slow_s, [5.0, 5.0, body_m]),
        ];
        limited(lands(drone("a", "offboard-2", &knots)))
    };
    refused(
        ViolationKind::Sideways,
        &landing(0.01, 0.5),
        &landing(0.0, 0.5),
    );
    refused(
        ViolationKind::Touchdown,
        &landing(0.0, 0.51),
        &landing(0.0, 0.5),
    );
    let take_off = |aside_m: f64| {
        let straight_m = 2.0 * body_m + 0.5;
        let knots = [
            (0.0, [5.0, 5.0, body_m]),
            (4.0, [5.0 + aside_m, 5.0, straight_m]),
            (8.0, [9.0, 5.0, 5.0]),
        ];
        let mut drone = drone("a", "offboard-2", &knots);
        drone.at_start = AtStart::Landed;
        limited(drone)
    };
    refused(ViolationKind::Sideways, &take_off(0.01), &take_off(0.0));
    // Standing in between makes no landing of what leads there low.
    let low_m = body_m + 0.1;
    let low = |from_m: [f64; 3]| {
        let knots = [
            (0.0, from_m),
            (4.0, [5.0, 5.0, low_m]),
            (5.0, [5.0, 5.0, low_m]),
            (6.0, [5.0, 5.0, body_m]),
        ];
        limited(lands(drone("a", "offboard-2", &knots)))
    };
    refused(
        ViolationKind::Sideways,
        &low([8.0, 5.0, low_m]),
        &low([5.0, 5.0, low_m + 1.0]),
    );
    // A plan that states no limit of descent says nothing of how it lands.
    let mut askew = landing(0.01, 1.5);
    askew.drones[0].airframe.max_descent_mps = None;
    assert!(kinds(&askew).is_empty());
}

#[test]
fn a_drone_may_be_as_late_as_is_reported_and_no_later() {
    let cases = [
        crossing(0.4),
        crossing(1.0),
        below(3.5, 0.3),
        below(5.0, 0.0),
    ];
    let mut told = 0;
    for case in cases {
        assert!(kinds(&case).is_empty(), "{:?}", verify(&case).violations);
        let file = PlanFile {
            plan: case.clone(),
            claims: Default::default(),
            filled: Vec::new(),
            remarks: Vec::new(),
        };
        let found = examine(&file, true);
        for (k, lateness) in found.late.iter().enumerate() {
            let late_s = lateness.as_ref().expect("asked for").late_s;
            let later = |by_s: f64| {
                broken(case.clone(), |plan| {
                    plan.drones[k] = late(plan.drones[k].clone(), by_s)
                })
            };
            for share in [0.25, 0.5, 0.75, 1.0] {
                let by_s = share * (late_s - FINE_S).max(0.0);
                assert!(
                    kinds(&later(by_s)).is_empty(),
                    "{k} late by {by_s} of {late_s}"
                );
            }
            if late_s < LATEST_S {
                told += 1;
                let breaks = kinds(&later(late_s + 2.0 * FINE_S));
                assert!(!breaks.is_empty(), "{k} may be later than {late_s}");
                let (kind, _) = lateness
                    .as_ref()
                    .and_then(|it| it.breaks.clone())
                    .expect("named");
                assert!(breaks.contains(&kind), "{breaks:?} and not {kind:?}");
            }
        }
    }
    assert!(told >= 3, "{told}");
}

#[test]
fn a_jump_at_the_first_or_the_last_moment_is_refused() {
    let body_m = preset("offboard-2").body_radius_m;
    let knots = [
        (0.0, [5.0, 5.0, body_m]),
        (0.0, [5.0, 5.0, 4.0]),
        (100.0, [5.0, 5.0, 4.0]),
        (110.0, [9.0, 5.0, 4.0]),
    ];
    let mut hangs = drone("a", "offboard-2", &knots);
    hangs.at_start = AtStart::Landed;
    hangs.airborne_s.0 = 100.0;
    let knots = [
        (0.0, [5.0, 5.0, 4.0]),
        (10.0, [9.0, 5.0, 4.0]),
        (10.0, [9.0, 5.0, body_m]),
    ];
    let falls = leaves(drone("a", "offboard-2", &knots));
    for broken in [hangs, falls] {
        assert!(kinds(&plan(vec![broken])).contains(&ViolationKind::Jump));
    }
}

#[test]
fn a_drone_that_leaves_at_once_may_leave_late_and_is_still_there() {
    let below = |off_axis_m: f64, depth_m: f64| {
        let gone = leaves(drone("a", "offboard-2", &[(0.0, [5.0, 5.0, 6.0])]));
        let under = [5.0 + off_axis_m, 5.0, 6.0 - depth_m];
        let moves = [(0.0, under), (2.0, [9.0, under[1], under[2]])];
        plan(vec![gone, drone("b", "kolibri", &moves)])
    };
    let body_m = preset("offboard-2").body_radius_m + preset("kolibri").body_radius_m;
    for (plan, kind) in [
        (below(0.0, 0.5), ViolationKind::ColumnMargin),
        (below(0.0, 3.0), ViolationKind::AirMargin),
        (below(body_m - 0.02, 0.0), ViolationKind::CollisionMargin),
    ] {
        assert!(kinds(&plan).is_empty(), "on time it is gone");
        let found = kinds(&bearing(plan, 0.1, 0.0));
        assert!(found.contains(&kind), "{found:?} and not {kind:?}");
    }
    assert!(kinds(&bearing(below(3.0, 3.0), 0.1, 0.0)).is_empty());
}
