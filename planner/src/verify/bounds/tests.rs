use airflow::effects::{
    Buoyancy, Crossflow, Effects, ProfileTail, RotorCant, WakeLean, WakeTilt, Wander,
};
use airflow::{Airframe, Jet, Wake};
use nalgebra::Vector3;

use crate::verify::bounds::wake::BoundedWake;

const DEEPEST_M: f64 = 9.0;

/// The same even cover of numbers every time.
fn at(index: u32) -> f64 {
    (f64::from(index) * 0.754_877_666_246_69).fract()
}

fn wakes() -> Vec<Wake> {
    let found = [
        Effects {
            crossflow: Some(Crossflow {
                wind_mps: [0.4, -0.3],
            }),
            ..Effects::default()
        },
        Effects {
            crossflow: Some(Crossflow {
                wind_mps: [-1.6, 0.2],
            }),
            rotor_cant: Some(RotorCant { width_factor: 0.75 }),
            ..Effects::default()
        },
        Effects {
            wake_tilt: Some(WakeTilt { tilt: [0.2, 0.3] }),
            wander: Some(Wander { growth: 2.0 }),
            buoyancy: Some(Buoyancy { strength: -0.2 }),
            ..Effects::default()
        },
        Effects {
            profile_tail: Some(ProfileTail {
                share: 1.3,
                steepness: 3.0,
            }),
            ..Effects::default()
        },
        Effects {
            wake_lean: Some(WakeLean { share: 0.7 }),
            ..Effects::default()
        },
    ];
    let frames = ["offboard-2", "kolibri"].map(|name| Airframe::preset(name).expect("a preset"));
    let made = frames.iter().flat_map(|frame| {
        let plain = Wake::new(frame, frame.mass_kg(), 1.204, &Jet::default());
        found
            .iter()
            .map(|effects| {
                airflow::Flown::of(effects)
                    .expect("can be flown")
                    .accelerating(4.0)
                    .wake(&plain)
            })
            .collect::<Vec<_>>()
    });
    made.collect()
}

#[test]
fn the_speed_along_a_path_lies_within_the_bounds_of_a_moved_wake() {
    for (w, wake) in (0_u32..).zip(wakes()) {
        let bounded = BoundedWake::new(wake.clone(), DEEPEST_M);
        for path in 0..1500_u32 {
            let pick = |n: u32| at(7919 * w + 11 * path + n);
            // Short and long paths, in and about the jet.
            let depth_m = 0.02 + (DEEPEST_M - 1.0) * pick(1) * pick(1);
            // A strong wind takes a small drone's jet away before.
            let (Some([x_m, y_m]), Some(spread_m)) = (wake.axis_m(depth_m), wake.spread_m(depth_m))
            else {
                continue;
            };
            let out_m = 3.0 * spread_m;
            let middle_m = Vector3::new(
                x_m + out_m * (2.0 * pick(2) - 1.0),
                y_m + out_m * (2.0 * pick(3) - 1.0),
                -depth_m,
            );
            let length_m = 0.5_f64.powf(1.0 + 9.0 * pick(4));
            let towards = Vector3::new(pick(5) - 0.5, pick(6) - 0.5, pick(7) - 0.5);
            let half_m = 0.5 * length_m * towards.normalize();
            let (from_m, to_m) = (middle_m - half_m, middle_m + half_m);
            let places_m = (from_m.inf(&to_m), from_m.sup(&to_m));
            let high_mps = bounded.highest_along_mps(&places_m, 0.0, &middle_m, 0.5 * length_m);
            let change_mps = 0.5 * length_m * bounded.steepest_per_s(&places_m, 0.0);
            let low_mps = wake.axial_speed_mps(middle_m) - change_mps;
            let below = places_m.1.z < 0.0;
            for k in 0..=16 {
                let here_m = from_m + (to_m - from_m) * (f64::from(k) / 16.0);
                let speed_mps = wake.axial_speed_mps(here_m);
                // A millionth of U_H for rounding.
                let slack_mps = 1e-6 * wake.induced_velocity_mps();
                assert!(
                    speed_mps <= high_mps + slack_mps
                        && (!below || speed_mps >= low_mps - slack_mps),
                    "{speed_mps} outside {low_mps} to {high_mps} at {here_m}, path {path} of wake {w}"
                );
            }
        }
    }
}

#[test]
fn beyond_its_reach_a_moved_wake_is_fainter_than_what_is_counted() {
    for wake in wakes() {
        let bounded = BoundedWake::new(wake.clone(), DEEPEST_M);
        for k in 0..4000_u32 {
            let depth_m = DEEPEST_M * at(5 * k + 1);
            let reach_m = bounded.reach_m(depth_m) * (1.0 + at(5 * k + 2));
            let (sin, cos) = (std::f64::consts::TAU * at(5 * k + 3)).sin_cos();
            let offset_m = Vector3::new(reach_m * cos, reach_m * sin, -depth_m);
            assert!(wake.axial_speed_mps(offset_m) <= crate::verify::FAINTEST_WAKE_MPS);
        }
    }
}
