//! Columns and wakes.

use nalgebra::Point3;
use planner::plan::{AtStart, Plan, Unplanned, ViolationKind};
use planner::verify::{FAINTEST_WAKE_MPS, verify};

use super::plans::{drone, kinds, leaves, plan, preset, sample, smooth, with_box, with_mesh_box};
use super::{broken, refused};

#[test]
fn a_drone_exactly_where_the_far_field_of_another_begins_is_in_its_air() {
    let exactly_below = |lower: &[(f64, [f64; 3])]| {
        let upper = drone("upper", "offboard-2", &[(0.0, [5.0, 5.0, 6.0])]);
        let mut plan = plan(vec![upper, drone("lower", "offboard-2", lower)]);
        // The near field ends 2.5 motor distances below the rotors: 1 m, exactly.
        for drone in &mut plan.drones {
            drone.airframe.motor_distance_m = 0.4;
        }
        plan
    };
    let hovering = exactly_below(&[(0.0, [5.0, 5.0, 5.0])]);
    let passing = exactly_below(&[(0.0, [2.0, 5.0, 5.0]), (4.0, [8.0, 5.0, 5.0])]);
    for plan in [&hovering, &passing] {
        assert_eq!(kinds(plan), [ViolationKind::Air]);
    }
}

#[test]
fn a_drone_that_stands_landed_between_flights_meets_no_air_and_has_to_stand() {
    // Down under another's wake, up again beside it.
    let radius_m = preset("kolibri").body_radius_m;
    let rests = |z_m: f64| {
        let upper = drone(
            "upper",
            "offboard-2",
            &[
                (0.0, [5.0, 5.0, 6.0]),
                (20.0, [5.0, 5.0, 6.0]),
                (30.0, [9.0, 5.0, 6.0]),
            ],
        );
        let comes = (10.0, [5.0, 5.0, z_m]);
        let mut lower = drone(
            "lower",
            "kolibri",
            &[
                (0.0, [5.0, 5.0, z_m + 0.5]),
                comes,
                (40.0, [5.0, 5.0, z_m]),
                (50.0, [5.0, 5.0, 2.0]),
            ],
        );
        lower.landed_s = vec![(10.0, 40.0)];
        let mut plan = plan(vec![upper, lower]);
        plan.drones[1].air_limit = 10.0;
        plan
    };
    let strict = |z_m: f64, landed_s: &[(f64, f64)]| {
        broken(rests(z_m), |plan| {
            plan.drones[1].air_limit = 0.01;
            plan.drones[1].landed_s = landed_s.to_vec();
        })
    };
    let air_s = |plan: &Plan| {
        let found = verify(plan).violations.into_iter();
        let air = found.filter(|it| it.kind == ViolationKind::Air && it.drone == "lower");
        air.map(|it| (it.from_s, it.until_s.unwrap_or(f64::INFINITY)))
            .collect::<Vec<_>>()
    };
    let hovering = air_s(&strict(radius_m, &[]));
    assert!(
        hovering.iter().any(|it| it.0 < 15.0 && it.1 > 15.0),
        "{hovering:?}"
    );
    let standing = air_s(&strict(radius_m, &[(10.0, 40.0)]));
    assert!(
        standing.iter().all(|it| it.1 <= 10.0 || it.0 >= 40.0),
        "{standing:?}"
    );
    assert!(!standing.is_empty(), "it is in the air before");
    let said = |plan: &Plan| {
        let found = verify(plan).violations.into_iter();
        let found = found.filter(|it| it.kind == ViolationKind::Malformed);
        found.map(|it| it.to_string()).collect::<String>()
    };
    assert_eq!(said(&rests(radius_m)), "");
    // In mid-air, in motion, and in no order of time: it is told, and the air counts.
    assert!(
        said(&rests(1.0)).contains("nothing is under it"),
        "{}",
        said(&rests(1.0))
    );
    for (landed_s, told) in [
        (&[(9.0, 40.0)][..], "but it moves"),
        (&[(20.0, 30.0), (12.0, 14.0)], "no span in the order"),
        (&[(f64::NAN, 14.0)], "no span in the order"),
        (&[(12.0, 12.0)], "no span in the order"),
        // Before it comes: what follows counts all the same.
        (&[(2.0, 3.0), (10.0, 40.0)], "but it is not there"),
    ] {
        let mut plan = strict(radius_m, landed_s);
        let mut counted = hovering.clone();
        if told == "but it is not there" {
            let comes = &mut plan.drones[1];
            comes.enters_s = Some(5.0);
            comes.trajectory.t_s[0] = 5.0;
            counted[0].0 = 5.0;
        }
        assert!(said(&plan).contains(told), "{told}: {}", said(&plan));
        assert_eq!(air_s(&plan), counted, "{told}");
    }
}

#[test]
fn a_hover_below_a_hover_is_refused_at_zero_relative_velocity() {
    let stack = |below_m: f64, aside_m: f64| {
        plan(vec![
            drone("upper", "offboard-2", &[(0.0, [5.0, 5.0, 6.0])]),
            drone(
                "lower",
                "offboard-2",
                &[(0.0, [5.0 + aside_m, 5.0, 6.0 - below_m])],
            ),
        ])
    };
    assert_eq!(
        kinds(&stack(0.5, 0.0)),
        [ViolationKind::Column, ViolationKind::Air]
    );
    let report = verify(&stack(3.0, 0.0));
    assert_eq!(report.violations.len(), 1);
    assert_eq!(report.violations[0].until_s, None);
    assert_eq!(report.violations[0].with.as_deref(), Some("upper"));
    refused(ViolationKind::Air, &stack(3.0, 0.0), &stack(3.0, 2.0));
    // On the column's rim, where the discs reach in but the centre does not.
    assert!(!kinds(&stack(0.5, 0.2)).contains(&ViolationKind::Column));
    // A limit as high as any leaves the column.
    let tolerant =
        |aside_m: f64| broken(stack(0.5, aside_m), |plan| plan.drones[1].air_limit = 10.0);
    refused(ViolationKind::Column, &tolerant(0.0), &tolerant(0.2));
    // Carried along at the same velocity: still no relative motion.
    let carried = |aside_m: f64| {
        plan(vec![
            drone(
                "upper",
                "kolibri",
                &[(0.0, [5.0, 5.0, 6.0]), (6.0, [11.0, 5.0, 6.0])],
            ),
            drone(
                "lower",
                "kolibri",
                &[
                    (0.0, [5.0 + aside_m, 5.0, 5.8]),
                    (6.0, [11.0 + aside_m, 5.0, 5.8]),
                ],
            ),
        ])
    };
    assert_eq!(
        kinds(&carried(0.05)),
        [ViolationKind::Column, ViolationKind::Air]
    );
    assert!(kinds(&carried(2.0)).is_empty());
}

#[test]
fn a_fast_crossing_of_a_thin_wake_between_half_second_samples_is_refused() {
    // At 1.9 m/s across the wake of a Kolibri 0.6 m above: half-width 0.10 m, crossed within 0.3 s.
    let crossing = |aside_m: f64| {
        plan(vec![
            drone("upper", "kolibri", &[(0.0, [5.475, 5.0 + aside_m, 6.0])]),
            drone(
                "lower",
                "kolibri",
                &[(0.0, [5.0, 5.0, 5.4]), (0.5, [5.95, 5.0, 5.4])],
            ),
        ])
    };
    refused(ViolationKind::Air, &crossing(0.0), &crossing(0.5));
    let report = verify(&crossing(0.0));
    assert!(report.violations[0].from_s > 0.05 && report.violations[0].until_s < Some(0.45));
    assert!(
        (report.violations[0].position_m.x - 5.475).abs() < 2e-3,
        "worst on the axis, to a millisecond of path"
    );
}

#[test]
fn a_shelf_stops_a_wake_and_a_mesh_or_a_narrow_shelf_does_not() {
    let stack = plan(vec![
        drone("upper", "offboard-2", &[(0.0, [5.0, 5.0, 6.0])]),
        drone("lower", "offboard-2", &[(0.0, [5.0, 5.0, 3.0])]),
    ]);
    let shelf = |half_m: f64| {
        with_box(
            stack.clone(),
            "shelf",
            [5.0 - half_m, 5.0 - half_m, 3.9],
            [5.0 + half_m, 5.0 + half_m, 4.0],
        )
    };
    // Half-width 2 m below: 0.07668 (2 / 0.266 + 5.817) 0.266 = 0.272 m.
    refused(ViolationKind::Air, &shelf(0.27), &shelf(0.275));
    assert_eq!(
        kinds(&with_mesh_box(
            stack.clone(),
            "net",
            [4.0, 4.0, 4.0],
            [6.0, 6.0, 4.1]
        )),
        [ViolationKind::Air]
    );
}

#[test]
fn a_wake_that_slides_off_a_shelf_reaches_below_from_there_on() {
    let sliding = plan(vec![
        drone(
            "upper",
            "offboard-2",
            &[(0.0, [5.0, 5.0, 6.0]), (2.0, [7.0, 5.0, 6.0])],
        ),
        drone("lower", "offboard-2", &[(0.0, [6.0, 5.0, 3.0])]),
    ]);
    let report = verify(&with_box(
        sliding,
        "shelf",
        [4.0, 4.0, 3.9],
        [6.2, 6.0, 4.0],
    ));
    assert_eq!(report.violations.len(), 1);
    // Covered until 0.272 m before the edge at 6.2 m, at 1 m/s from 5 m: 0.928 s.
    assert!(
        (report.violations[0].from_s - 0.928).abs() < 2e-3,
        "{}",
        report.violations[0]
    );
}

#[test]
fn landed_drones_have_no_wake_and_no_limit() {
    let body_m = preset("offboard-2").body_radius_m;
    let mut parked = drone("parked", "offboard-2", &[(0.0, [5.0, 5.0, body_m])]);
    parked.at_start = AtStart::Landed;
    let hovering = drone("hovering", "offboard-2", &[(0.0, [5.0, 5.0, 3.0])]);
    let awake = plan(vec![hovering.clone(), parked.clone()]);
    parked.airborne_s = (0.0, Some(0.0));
    refused(
        ViolationKind::Air,
        &awake,
        &plan(vec![hovering.clone(), parked.clone()]),
    );
    // Up to five centimetres above what it stands on, and no higher.
    parked.trajectory.position_m[0].z += 0.049;
    assert!(kinds(&plan(vec![hovering.clone(), parked.clone()])).is_empty());
    parked.trajectory.position_m[0].z = 6.0;
    let in_mid_air = kinds(&plan(vec![hovering, parked]));
    assert_eq!(in_mid_air, [ViolationKind::Malformed]);
}

#[test]
fn a_drone_that_leaves_takes_body_and_wake_along() {
    let pass = |end: fn(_) -> _| {
        plan(vec![
            end(drone(
                "first",
                "offboard-2",
                &[(0.0, [5.0, 5.0, 6.0]), (1.0, [5.0, 5.0, 6.0])],
            )),
            drone(
                "second",
                "offboard-2",
                &[
                    (0.0, [9.0, 5.0, 4.0]),
                    (3.0, [5.0, 5.0, 4.0]),
                    (4.0, [5.0, 5.0, 6.0]),
                ],
            ),
        ])
    };
    let stays = kinds(&pass(|drone| drone));
    assert_eq!(
        stays,
        [
            ViolationKind::Collision,
            ViolationKind::Column,
            ViolationKind::Air
        ]
    );
    assert!(kinds(&pass(leaves)).is_empty());
}

#[test]
fn an_unplanned_drone_stays_at_its_start_whatever_its_end_says() {
    let stuck = leaves(drone("stuck", "offboard-2", &[(0.0, [5.0, 5.0, 6.0])]));
    let below = drone(
        "below",
        "offboard-2",
        &[(0.0, [9.0, 5.0, 3.0]), (4.0, [5.0, 5.0, 3.0])],
    );
    let gone = plan(vec![stuck, below]);
    let there = broken(gone.clone(), |plan| {
        plan.drones[0].airborne_s.1 = None;
        plan.unplanned.push(Unplanned {
            name: "stuck".to_owned(),
            reason: "blocked".to_owned(),
            cause: None,
        });
    });
    refused(ViolationKind::Air, &there, &gone);
}

#[test]
fn a_payload_strengthens_the_wake_and_the_carrier() {
    // 3 m below and off the axis so that the bare wake is just in order: alpha 0.26 bare.
    let carrying = |mass_kg: f64| {
        let mut upper = drone(
            "upper",
            "offboard-2",
            &[
                (0.0, [5.0, 5.0, 6.0]),
                (1.0, [5.0, 5.0, 6.0]),
                (3.0, [5.0, 5.0, 6.0]),
            ],
        );
        upper.trajectory.mass_kg[1] = mass_kg;
        plan(vec![
            upper,
            drone(
                "lower",
                "offboard-2",
                &[(0.0, [5.5, 5.0, 3.0]), (4.0, [5.5, 5.0, 3.0])],
            ),
        ])
    };
    let bare = carrying(1.207);
    let alpha = |plan: &Plan| {
        verify(plan).exposures[1].worst_air_mps / preset("offboard-2").hover_induced_velocity_mps
    };
    let heavy = carrying(4.0 * 1.207);
    // Four times the mass, twice the induced velocity, twice the wake.
    assert!((alpha(&heavy) / alpha(&bare) - 2.0).abs() < 2e-3);
    refused(ViolationKind::Air, &heavy, &bare);
    let report = verify(&heavy);
    assert!(
        (report.violations[0].from_s - 1.0).abs() < 1e-6
            && (report.violations[0].until_s.unwrap_or(0.0) - 3.0).abs() < 1e-6
    );
}

#[test]
fn three_wakes_of_which_none_alone_exceeds_the_limit_are_refused_together() {
    let around = |count: usize| {
        let mut drones = vec![drone("lower", "offboard-2", &[(0.0, [10.0, 10.0, 3.0])])];
        for k in 0..count {
            let bearing = k as f64 * std::f64::consts::TAU / 3.0;
            let place = [
                10.0 + 0.48 * bearing.cos(),
                10.0 + 0.48 * bearing.sin(),
                6.5,
            ];
            drones.push(drone(&format!("u{k}"), "offboard-2", &[(0.0, place)]));
        }
        plan(drones)
    };
    refused(ViolationKind::Air, &around(3), &around(1));
    let worst = |count| verify(&around(count)).exposures[0].worst_air_mps;
    // At each point of the discs momentum adds; the mean of square roots makes it a few percent
    // less or more.
    assert!(
        (worst(3) / worst(1) / 3.0_f64.sqrt() - 1.0).abs() < 0.05,
        "{} {}",
        worst(1),
        worst(3)
    );
}

#[test]
fn random_plans_are_judged_as_dense_samples_judge_them() {
    let mut state = 7_u64;
    let mut random = move || {
        // Knuth's MMIX generator.
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let (mut refused_air, mut accepted_air) = (0, 0);
    for nth in 0..60 {
        let is_smooth = nth >= 30;
        let drones = (0..4)
            .map(|k| {
                let mut knots = Vec::new();
                let mut t_s = 0.0;
                for _ in 0..3 {
                    knots.push((
                        t_s,
                        [
                            1.0 + 3.0 * random(),
                            1.0 + 3.0 * random(),
                            1.0 + 4.0 * random(),
                        ],
                    ));
                    t_s += 1.0 + 2.0 * random();
                }
                let airframe = ["kolibri", "offboard-1", "offboard-2"][k % 3];
                let flown = drone(&format!("d{k}"), airframe, &knots);
                match is_smooth {
                    true => smooth(flown, [4.0, 4.0, 20.0]),
                    false => flown,
                }
            })
            .collect();
        let mut random_plan = plan(drones);
        random_plan.drones.iter_mut().for_each(|drone| {
            drone.airframe.max_speed_mps = 100.0;
            // Turns come as they come.
            drone.airframe.max_acceleration_mps2 = None;
            drone.airframe.max_jerk_mps3 = None;
        });
        let report = verify(&random_plan);
        let dense = sample(&random_plan, 1e-3);
        for (k, (met, dense)) in report.exposures.iter().zip(&dense).enumerate() {
            let u_h = dense.induced_velocity_mps;
            // Up to 10 m/s of relative speed and a slope of 4 U_H per motor distance: samples 1 ms
            // apart may miss the top by 0.01 U_H, and a rotor plane crossed between two of them by
            // more.
            assert!(
                met.worst_air_mps >= dense.worst_mps * (1.0 - 1e-3) - 1e-3 * u_h,
                "drone {k}: {met:?} {dense:?}"
            );
            assert!(
                met.worst_air_mps <= dense.worst_mps * 1.02 + 0.02 * u_h,
                "drone {k}: {met:?} {dense:?}"
            );
            // The verifier's own 0.1 % and 1e-4 U_H, and the samples' first-order rule. Smooth
            // flights last long enough for the wakes that are too faint to count.
            let faint_m = match (is_smooth, random_plan.drones[k].trajectory.t_s.last()) {
                (true, Some(last_s)) => FAINTEST_WAKE_MPS * last_s,
                _ => 0.0,
            };
            assert!(
                (met.dose_m - dense.dose_m).abs() <= 3e-3 * dense.dose_m + 1e-3 * u_h + faint_m,
                "drone {k}: {met:?} {dense:?}"
            );
            let name = format!("d{k}");
            let has = |kind| {
                report
                    .violations
                    .iter()
                    .any(|v| v.kind == kind && (v.drone == name || v.with.as_ref() == Some(&name)))
            };
            let over = report
                .violations
                .iter()
                .any(|v| v.kind == ViolationKind::Air && v.drone == name);
            let alpha = dense.worst_mps / u_h;
            assert!(over || alpha <= 0.302, "drone {k} alpha {alpha}");
            assert!(!over || alpha >= 0.28, "drone {k} alpha {alpha}");
            if over {
                refused_air += 1
            } else {
                accepted_air += 1
            }
            assert!(dense.gap_m > -0.002 || has(ViolationKind::Collision));
            assert!(dense.gap_m < 0.01 || !has(ViolationKind::Collision));
            assert!(
                dense.in_column_m < 1e-3 || has(ViolationKind::Column),
                "{dense:?}"
            );
        }
    }
    assert!(
        refused_air > 10 && accepted_air > 10,
        "{refused_air} refused, {accepted_air} accepted"
    );
}

#[test]
fn violations_come_in_order_of_time_and_read_as_sentences() {
    let report = verify(&plan(vec![
        drone("upper", "offboard-2", &[(0.0, [5.0, 5.0, 6.0])]),
        drone(
            "lower",
            "offboard-2",
            &[
                (0.0, [9.0, 5.0, 3.0]),
                (1.0, [9.0, 5.0, 12.5]),
                (2.0, [5.0, 5.0, 3.0]),
            ],
        ),
    ]));
    assert!(report.violations.is_sorted_by(|a, b| a.from_s <= b.from_s));
    let sentence = report
        .violations
        .iter()
        .find(|violation| violation.kind == ViolationKind::Air)
        .map(ToString::to_string);
    let sentence = sentence.expect("an air violation");
    assert!(
        sentence.starts_with("`lower` is exposed to downwash of alpha ")
            && sentence.contains("`upper`")
            && sentence.contains("its limit is 0.300"),
        "{sentence}"
    );
    // The top is flat: within 0.1 % of the highest air, 0.1 m from where the descent ends.
    let place_m = report
        .violations
        .iter()
        .find(|v| v.kind == ViolationKind::Air)
        .map(|v| v.position_m);
    assert!(
        place_m.is_some_and(|place_m| (place_m - Point3::new(5.0, 5.0, 3.0)).norm() < 0.2),
        "{place_m:?}"
    );
}
