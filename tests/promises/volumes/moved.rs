//! Column, cone and volume of jets that a finding has moved or reshaped.

use airflow::Wake;
use airflow::effects::{
    Crossflow, Effects, MomentumScale, ProfileTail, RotorCant, WakeLean, WakeTilt, Wander,
};
use costmap::volumes::downwash::{column, cone};
use costmap::volumes::iso_speed::IsoSpeedVolume;
use diagnosis::statistics::draws::Draws;
use nalgebra::Vector3;
use std::f64::consts::TAU;

use super::{holds, wake_of};

/// A wake under random effects, several at once.
fn wake(random: &mut Draws, preset: &str) -> Wake {
    let plain = wake_of(preset);
    let wind_mps = random.between(0.05, 0.3) * plain.induced_velocity_mps();
    let (sin, cos) = (TAU * random.uniform()).sin_cos();
    let crossflow = Crossflow {
        wind_mps: [wind_mps * cos, wind_mps * sin],
    };
    let wake_tilt = WakeTilt {
        tilt: [random.between(-0.3, 0.3), random.between(-0.3, 0.3)],
    };
    let rotor_cant = RotorCant {
        width_factor: random.between(0.7, 1.45),
    };
    let wander = Wander {
        growth: random.between(0.0, 3.0),
    };
    let profile_tail = ProfileTail {
        share: random.between(-0.6, 1.6),
        steepness: random.between(-0.6, 4.0),
    };
    let momentum_scale = MomentumScale {
        speed_factor: random.between(0.7, 1.4),
    };
    let wake_lean = WakeLean {
        share: random.between(0.0, 1.0),
    };
    let mut maybe = || random.uniform() < 0.5;
    let effects = Effects {
        crossflow: maybe().then_some(crossflow),
        wake_tilt: maybe().then_some(wake_tilt),
        rotor_cant: maybe().then_some(rotor_cant),
        wander: maybe().then_some(wander),
        profile_tail: maybe().then_some(profile_tail),
        momentum_scale: Some(momentum_scale),
        wake_lean: maybe().then_some(wake_lean),
        ..Effects::default()
    };
    airflow::Flown::of(&effects)
        .expect("all can be flown")
        .accelerating(4.0)
        .wake(&plain)
}

/// Points for one jet.
const POINTS: usize = crate::samples(4_000, 20_000);

#[test]
fn no_point_above_the_limit_lies_outside_the_volume_of_a_moved_jet() {
    let mut random = Draws::new(77);
    for case in 0..24 {
        let preset = ["kolibri", "offboard-2", "matrice-300"][case % 3];
        let wake = wake(&mut random, preset);
        let limit_mps = random.between(0.15, 0.8) * wake.induced_velocity_mps();
        let volume = IsoSpeedVolume::new(&wake, limit_mps).expect("a positive limit");
        let end_m = volume
            .sections
            .iter()
            .map(|s| s.to_depth_m)
            .fold(0.0, f64::max);
        let mut above = 0;
        for _ in 0..POINTS {
            let depth_m = random.between(0.0, 1.3) * end_m;
            let (Some([x_m, y_m]), Some(spread_m)) = (wake.axis_m(depth_m), wake.spread_m(depth_m))
            else {
                continue;
            };
            let radius_m = 3.0 * spread_m * random.uniform();
            let (sin, cos) = (TAU * random.uniform()).sin_cos();
            let offset_m = Vector3::new(x_m + radius_m * cos, y_m + radius_m * sin, -depth_m);
            if wake.axial_speed_mps(offset_m) > limit_mps {
                above += 1;
                assert!(
                    holds(&volume.sections, offset_m),
                    "case {case}, {preset}: {offset_m:?}"
                );
            }
        }
        assert!(
            above > POINTS / 100,
            "case {case}: only {above} points tested anything"
        );
    }
}

#[test]
fn rotor_tips_lie_in_the_column_of_a_moved_jet_and_it_has_no_cone() {
    let mut random = Draws::new(78);
    for case in 0..40 {
        let wake = wake(&mut random, ["kolibri", "matrice-300"][case % 2]);
        let near_m = wake.near_field_depth_m();
        let column = column(&wake);
        assert!(cone(&wake, 2.0 * near_m).is_none());
        for _ in 0..2000 {
            let depth_m = random.uniform() * near_m;
            let Some([x_m, y_m]) = wake.axis_m(depth_m) else {
                continue;
            };
            let (sin, cos) = (TAU * random.uniform()).sin_cos();
            // Just inside: where nothing moves the axis the tips are the column's edge, to the last
            // bit.
            let radius_m = wake.tip_radius_m() * (1.0 - 1e-12);
            let offset_m = Vector3::new(x_m + radius_m * cos, y_m + radius_m * sin, -depth_m);
            assert!(holds(&[column], offset_m), "case {case}: {offset_m:?}");
        }
    }
}
