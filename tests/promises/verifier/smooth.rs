//! Trajectories that claim to be smooth: each rule broken on purpose.

use nalgebra::Point3;
use planner::plan::{Margins, Plan, ViolationKind};
use planner::verify::verify;

use super::plans::{drone, kinds, plan, smooth};
use super::{broken, refused};

/// 2 m/s, 4 m/s², 20 m/s³.
const LIMITS: [f64; 3] = [2.0, 4.0, 20.0];

/// Straight, a turn of 45 degrees, and to rest.
fn turn() -> Plan {
    let knots = [
        (0.0, [2.0, 2.0, 3.0]),
        (2.0, [6.0, 2.0, 3.0]),
        (4.0, [6.0 + 8.0_f64.sqrt(), 2.0 + 8.0_f64.sqrt(), 3.0]),
    ];
    plan(vec![smooth(drone("a", "offboard-2", &knots), LIMITS)])
}

#[test]
fn a_smooth_turn_within_its_limits_is_accepted() {
    let report = verify(&turn());
    assert_eq!(report.violations, []);
    let flown = &turn().drones[0].trajectory;
    assert!(flown.control_m.iter().any(|inner| inner.len() == 2));
    // At full speed between the turns, and at rest at both ends.
    let speed = |t_s: f64| flown.state(t_s).map(|it| it.velocity_mps.norm());
    assert!((speed(1.45).expect("it flies") - 2.0).abs() < 1e-9);
    assert!(speed(0.0).expect("it is there") < 1e-9 && speed(60.0) == Some(0.0));
}

#[test]
fn each_limit_that_it_exceeds_is_named() {
    let limit = |change: fn(&mut Plan)| broken(turn(), change);
    refused(
        ViolationKind::Acceleration,
        &limit(|plan| plan.drones[0].airframe.max_acceleration_mps2 = Some(3.9)),
        &turn(),
    );
    refused(
        ViolationKind::Jerk,
        &limit(|plan| plan.drones[0].airframe.max_jerk_mps3 = Some(9.9)),
        &turn(),
    );
    refused(
        ViolationKind::Speed,
        &limit(|plan| plan.drones[0].airframe.max_speed_mps = 1.99),
        &turn(),
    );
}

#[test]
fn velocity_and_acceleration_that_jump_are_named() {
    // A break point beside the path: the pieces on both sides end with other velocities.
    let beside = broken(turn(), |plan| {
        let flown = &mut plan.drones[0].trajectory;
        let middle = flown.t_s.len() / 2;
        flown.position_m[middle].z += 0.002;
    });
    assert!(
        kinds(&beside).contains(&ViolationKind::VelocityJump),
        "{:?}",
        kinds(&beside)
    );
    // An inner point farther along the velocity at its end: only acceleration jumps there.
    let bent = broken(turn(), |plan| {
        let flown = &mut plan.drones[0].trajectory;
        let cubic = flown
            .control_m
            .iter()
            .position(|it| it.len() == 2)
            .expect("it turns");
        let next = flown.control_m[cubic + 1].clone();
        let end_m = flown.position_m[cubic + 1];
        assert_eq!(next.len(), 2);
        let spans_s = [0, 1].map(|k| flown.t_s[cubic + k + 1] - flown.t_s[cubic + k]);
        // Both pieces leave the place between them with another, common velocity.
        let by_m = Point3::new(0.004, 0.0, 0.0).coords;
        flown.control_m[cubic][1] = end_m - (end_m - flown.control_m[cubic][1]) - by_m;
        flown.control_m[cubic + 1][0] += by_m * (spans_s[1] / spans_s[0]);
    });
    assert_eq!(
        kinds(&bent).first(),
        Some(&ViolationKind::AccelerationJump),
        "{:?}",
        kinds(&bent)
    );
    // Straight pieces among cubics turn in no time.
    let cornered = broken(turn(), |plan| {
        plan.drones[0]
            .trajectory
            .control_m
            .iter_mut()
            .for_each(Vec::clear);
    });
    assert!(kinds(&cornered).contains(&ViolationKind::VelocityJump));
    // Without any claim they may.
    let straight = broken(cornered.clone(), |plan| {
        plan.drones[0].trajectory.control_m = Vec::new();
    });
    let told = verify(&straight).violations;
    assert!(
        told.iter().all(|it| it.kind == ViolationKind::Speed),
        "{told:?}"
    );
}

#[test]
fn a_smooth_plan_begins_and_ends_at_rest() {
    let moves_on = broken(turn(), |plan| {
        let flown = &mut plan.drones[0].trajectory;
        let kept = flown.t_s.len() - 2;
        flown.t_s.truncate(kept);
        flown.position_m.truncate(kept);
        flown.mass_kg.truncate(kept);
        flown.control_m.truncate(kept - 1);
    });
    refused(ViolationKind::VelocityJump, &moves_on, &turn());
}

#[test]
fn control_points_that_fit_no_piece_are_malformed() {
    let faults: [fn(&mut Plan); 3] = [
        |plan| plan.drones[0].trajectory.control_m.truncate(1),
        |plan| {
            let controls = &mut plan.drones[0].trajectory.control_m;
            let cubic = controls
                .iter_mut()
                .find(|it| it.len() == 2)
                .expect("it turns");
            cubic.truncate(1);
        },
        |plan| {
            let controls = &mut plan.drones[0].trajectory.control_m;
            let cubic = controls
                .iter_mut()
                .find(|it| it.len() == 2)
                .expect("it turns");
            cubic[1].y = f64::NAN;
        },
    ];
    for fault in faults {
        refused(ViolationKind::Malformed, &broken(turn(), fault), &turn());
    }
}

#[test]
fn what_a_cubic_meets_between_its_ends_is_found() {
    // The path swings 0.15 m inside its corner: a post stands there, out of the corner's way.
    let knots = [
        (0.0, [2.0, 2.0, 3.0]),
        (2.0, [6.0, 2.0, 3.0]),
        (4.0, [6.0 + 8.0_f64.sqrt(), 2.0 + 8.0_f64.sqrt(), 3.0]),
    ];
    let body_m = 0.198;
    let inside_m = |gap_m: f64| {
        let (bearing, off_m) = (112.5_f64.to_radians(), body_m + 0.05 + gap_m);
        [
            6.0 + off_m * bearing.cos(),
            2.0 + off_m * bearing.sin(),
            0.0,
        ]
    };
    let straight = |gap_m| {
        super::with_cylinder(
            plan(vec![drone("a", "offboard-2", &knots)]),
            "post",
            inside_m(gap_m),
            0.05,
            6.0,
        )
    };
    let flown = |gap_m| {
        let flown = smooth(drone("a", "offboard-2", &knots), LIMITS);
        super::with_cylinder(plan(vec![flown]), "post", inside_m(gap_m), 0.05, 6.0)
    };
    // 45 degrees at 2 m/s: 1.53 m/s, 0.116 m inside.
    assert_eq!(kinds(&straight(0.05)), []);
    refused(ViolationKind::Obstacle, &flown(0.05), &flown(0.12));
}

#[test]
fn a_cubic_is_out_of_bounds_where_it_is_and_not_where_its_control_points_are() {
    let swings = |to_x_m: f64| {
        let at_m = [0.3, 5.0, 3.0];
        let mut flown = drone("a", "offboard-2", &[(0.0, at_m), (4.0, at_m)]);
        flown.trajectory.control_m = vec![vec![Point3::new(to_x_m, 5.0, 3.0); 2]];
        flown.trajectory.turns_at_once = true;
        plan(vec![flown])
    };
    // Three quarters of the way to the control points.
    let (out, within) = (swings(-0.2), swings(-0.1));
    refused(ViolationKind::Bounds, &out, &within);
    let told = &verify(&out).violations[0];
    assert!((told.value - 0.075).abs() < 1e-9 && (told.position_m.x + 0.075).abs() < 1e-9);
}

/// A number in 0..1 that depends on an index alone.
fn at(k: u64) -> f64 {
    let mixed = (k + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    ((mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 11) as f64 / (1_u64 << 53) as f64
}

#[test]
fn two_smooth_flights_early_or_late_are_judged_as_dense_samples_of_both_clocks_judge_them() {
    const MARGIN_S: f64 = 0.1;
    const TRACKING_M: f64 = 0.1;
    let (mut apart, mut touching, mut in_column) = (0, 0, 0);
    for case in 0..120 {
        let flight = |nth: u64, airframe: &str| {
            let knots: Vec<_> = (0..3_u64)
                .map(|k| {
                    let place = |axis: u64| at(1000 * case + 100 * nth + 10 * k + axis);
                    let place_m = [
                        2.0 + 3.0 * place(0),
                        2.0 + 3.0 * place(1),
                        2.0 + 1.5 * place(2),
                    ];
                    (1.7 * k as f64, place_m)
                })
                .collect();
            smooth(
                drone(["a", "b"][nth as usize], airframe, &knots),
                [4.0, 4.0, 20.0],
            )
        };
        let mut both = plan(vec![flight(0, "offboard-2"), flight(1, "kolibri")]);
        for drone in &mut both.drones {
            drone.airframe.max_acceleration_mps2 = None;
            drone.airframe.max_jerk_mps3 = None;
            drone.airframe.max_speed_mps = 100.0;
            drone.air_limit = 50.0;
        }
        both.margins = Margins {
            time_s: MARGIN_S,
            tracking_m: TRACKING_M,
        };
        let [one, other] = &both.drones[..] else {
            unreachable!()
        };
        let sum_m = one.airframe.body_radius_m + other.airframe.body_radius_m;
        let column_m = one.airframe.body_radius_m;
        let depth_m = 2.5 * one.airframe.motor_distance_m;
        let (mut gap_m, mut inside_m) = (f64::INFINITY, f64::NEG_INFINITY);
        for step in 0..500 {
            let t_s = f64::from(step) * 0.01;
            let here_m = one.trajectory.position_m(t_s).expect("it is there");
            for shift in -20..=20 {
                let u_s = t_s + f64::from(shift) * 0.01;
                let there_m = other.trajectory.position_m(u_s).expect("it is there");
                let off_m = there_m - here_m;
                gap_m = gap_m.min(off_m.norm() - sum_m - 2.0 * TRACKING_M);
                let in_it = (column_m - off_m.xy().norm())
                    .min(-off_m.z)
                    .min(depth_m + off_m.z);
                inside_m = inside_m.max(in_it);
            }
        }
        let kinds = kinds(&both);
        let touches = kinds.contains(&ViolationKind::Collision)
            || kinds.contains(&ViolationKind::CollisionMargin);
        let below =
            kinds.contains(&ViolationKind::Column) || kinds.contains(&ViolationKind::ColumnMargin);
        // Samples a hundredth of a second apart on both clocks: within 0.06 m of path.
        assert!(touches || gap_m > -2e-3, "{case}: {gap_m} {kinds:?}");
        assert!(!touches || gap_m < 0.06, "{case}: {gap_m} {kinds:?}");
        assert!(below || inside_m < 1e-4, "{case}: {inside_m} {kinds:?}");
        assert!(!below || inside_m > -0.06, "{case}: {inside_m} {kinds:?}");
        touching += usize::from(touches);
        apart += usize::from(!touches);
        in_column += usize::from(below);
    }
    assert!(
        apart > 20 && touching > 20 && in_column > 5,
        "{apart} {touching} {in_column}"
    );
}

#[test]
fn the_outline_of_a_smooth_flight_stays_near_it() {
    let flown = turn().drones[0].trajectory.clone();
    let places_m = flown.outline_m(0.01);
    assert!(places_m.len() > flown.t_s.len() && places_m.len() < 100);
    for step in 0..500 {
        let here_m = flown
            .position_m(f64::from(step) * 0.01)
            .expect("it is there");
        let near_m = places_m.windows(2).map(|ends| {
            let along_m = ends[1] - ends[0];
            let share = (here_m - ends[0]).dot(&along_m) / along_m.norm_squared().max(1e-12);
            (here_m - (ends[0] + along_m * share.clamp(0.0, 1.0))).norm()
        });
        assert!(near_m.fold(f64::INFINITY, f64::min) < 0.0101);
    }
}
