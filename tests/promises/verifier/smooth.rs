//! Trajectories that claim to be smooth: each rule broken on purpose.

use nalgebra::Point3;
use planner::plan::{Plan, ViolationKind};
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
