use airflow::{Airframe, DiscPoints, Jet, Wake};

use super::*;

const DEEPEST_M: f64 = 8.0;
/// As of a limit of 0.3 and a share of two in ten thousand: below it a wake counts as still air.
const NEGLIGIBLE_SQUARE: f64 = 2e-4 * 0.09;
const PAIRS: [[&str; 2]; 5] = [
    ["offboard-2", "offboard-2"],
    ["kolibri", "offboard-1"],
    ["elios-3", "crazyflie-2.1"],
    ["mavic-3e", "kolibri"],
    ["crazyflie-2.1", "mavic-3e"],
];

/// Additive recurrence of the golden ratio's kin: even cover, the same places every time.
fn places(count: u32) -> impl Iterator<Item = [f64; 3]> {
    (1..=count).map(|i| {
        [0.819_172_513_396, 0.671_043_606_704, 0.549_700_477_902]
            .map(|step| (step * f64::from(i)).fract())
    })
}

fn pair([emitter, receiver]: [&str; 2]) -> (Wake, DiscPoints, Envelope) {
    let emitter = Airframe::preset(emitter).expect("a preset");
    let discs = Airframe::preset(receiver).expect("a preset").disc_points();
    let wake = Wake::new(&emitter, emitter.mass_kg(), 1.204, &Jet::default());
    let envelope = Envelope::new(&wake, &discs, DEEPEST_M, NEGLIGIBLE_SQUARE);
    (wake, discs, envelope)
}

fn at(envelope: &Envelope, offset_m: Vector3<f64>) -> f64 {
    envelope.along(&offset_m, &offset_m).peak_square
}

#[test]
fn no_place_meets_more_air_than_the_envelope_says() {
    let mut most = 0.0_f64;
    for names in PAIRS {
        let (wake, discs, envelope) = pair(names);
        let near_m = 2.0 * wake.near_field_depth_m();
        let mut worst = (0.0, Vector3::zeros(), 0.0);
        // Nearer than their rotor tips two drones cannot be.
        let tips = names.map(|name| Airframe::preset(name).expect("a preset").tip_radius_m());
        let bodies_m = tips[0] + tips[1];
        // Half the places in the near field and just below it, where the air is least smooth.
        for (i, [x, y, z]) in places(100_000).enumerate() {
            let deep_m = if i % 2 == 0 { near_m } else { DEEPEST_M };
            let reach_m = if i % 2 == 0 {
                near_reach_m(&wake, &discs)
            } else {
                envelope.reach_m()
            };
            let offset_m = Vector3::new(
                (2.0 * x - 1.0) * reach_m,
                (2.0 * y - 1.0) * reach_m,
                -z * deep_m,
            );
            if offset_m.norm() < bodies_m {
                continue;
            }
            let (square, _) = over_discs(&wake, &discs, offset_m.x, offset_m.y, -offset_m.z);
            let bound = at(&envelope, offset_m).max(NEGLIGIBLE_SQUARE);
            if square / bound > worst.0 {
                worst = (square / bound, offset_m, square);
            }
        }
        let (ratio, [x, y, z], square) = (worst.0, worst.1.into(), worst.2);
        println!(
            "{names:?}: {ratio:.4} of the bound at ({x:.4}, {y:.4}, {z:.4}) m, mean square {square:.5}"
        );
        most = most.max(ratio);
    }
    assert!(most <= 1.0, "{most} of the bound");
}

/// How far aside the receiver's nearest disc point may be from where the near field ends.
fn near_reach_m(wake: &Wake, discs: &DiscPoints) -> f64 {
    let points = discs.offsets_m.iter().map(|[x, y]| x.hypot(*y));
    2.0 * wake.tip_radius_m() + points.fold(0.0, f64::max)
}

/// In the far field, where the mean square is at least a fiftieth of the largest there: the bound
/// is one row too shallow and one column too near, each a few percent.
#[test]
fn the_envelope_is_not_much_more_than_the_air() {
    for names in PAIRS {
        let (wake, discs, envelope) = pair(names);
        let (mut excess, mut worst, mut count) = (0.0, 0.0_f64, 0);
        for [x, y, z] in places(20_000) {
            let depth_m = wake.near_field_depth_m() + z * (DEEPEST_M - wake.near_field_depth_m());
            let half_m = wake.half_width_m(depth_m);
            let offset_m =
                Vector3::new((2.0 * x - 1.0) * half_m, (2.0 * y - 1.0) * half_m, -depth_m);
            let (square, _) = over_discs(&wake, &discs, offset_m.x, offset_m.y, depth_m);
            let ratio = (at(&envelope, offset_m) / square).sqrt();
            excess += ratio - 1.0;
            worst = worst.max(ratio - 1.0);
            count += 1;
        }
        let mean = excess / f64::from(count);
        println!(
            "{names:?}: speed bound {:.1} % above on average, {:.1} % at most",
            100.0 * mean,
            100.0 * worst
        );
        assert!(mean < MEAN_EXCESS, "{names:?}: {mean}");
    }
}
/// Of the speed, averaged over the half-width's square: measured 0.09 to 0.12. Single places have
/// more, where the largest mean over all larger radii is not the one here: 0.3 for frames of one
/// size, 2 for a Crazyflie above a Mavic.
const MEAN_EXCESS: f64 = 0.15;

#[test]
fn a_way_meets_no_less_than_any_place_on_it() {
    let (_, _, envelope) = pair(PAIRS[0]);
    let ends: Vec<[f64; 3]> = places(4_000).collect();
    for two in ends.chunks_exact(2) {
        let end = |[x, y, z]: [f64; 3]| Vector3::new(3.0 * x - 1.5, 3.0 * y - 1.5, 1.0 - 7.0 * z);
        let (from_m, to_m) = (end(two[0]), end(two[1]));
        let whole = envelope.along(&from_m, &to_m).peak_square;
        for k in 0..=50 {
            let place_m = from_m + (to_m - from_m) * (f64::from(k) / 50.0);
            let here = at(&envelope, place_m);
            // Weak places are bounded by a coarser look, strong ones to rounding.
            assert!(
                here <= whole * (1.0 + 1e-9),
                "{here} at {place_m}, {whole} on the way"
            );
        }
    }
}

/// The volume that the conflict tables are sampled from: its cylinders hold the places at which the
/// table of a still wake is above the limit, and no others.
#[test]
fn an_iso_exposure_volume_holds_the_places_above_its_limit_and_no_others() {
    let mut held = 0;
    for names in PAIRS {
        let (_, _, envelope) = pair(names);
        for limit in [0.1, 0.2, 0.3, 0.6] {
            let sections = envelope.iso_exposure(limit * limit);
            for [x, y, z] in places(40_000) {
                let place_m = Vector3::new(4.0 * x - 2.0, 4.0 * y - 2.0, -DEEPEST_M * z);
                let is_above = at(&envelope, place_m) > limit * limit;
                let is_held = sections.iter().any(|section| section.holds(place_m));
                assert_eq!(is_held, is_above, "{names:?}, {limit}: {place_m}");
                held += u32::from(is_held);
            }
        }
    }
    assert!(held > 20_000, "{held}");
}

#[test]
fn the_column_is_entered_where_samples_say_so() {
    let column = crate::volumes::downwash::column(&pair(PAIRS[0]).0);
    let inside = |at_m: &Vector3<f64>, margin_m: f64| {
        at_m.z < -margin_m
            && at_m.z > margin_m - column.to_depth_m
            && at_m.xy().norm() < column.to_radius_m - margin_m
    };
    let ends: Vec<[f64; 3]> = places(40_000).collect();
    let mut entered = 0;
    for two in ends.chunks_exact(2) {
        let end = |[x, y, z]: [f64; 3]| Vector3::new(1.2 * x - 0.6, 1.2 * y - 0.6, 0.5 - 1.7 * z);
        let (from_m, to_m) = (end(two[0]), end(two[1]));
        let along = |k: u32| from_m + (to_m - from_m) * (f64::from(k) / 400.0);
        let closed = column.is_entered(&from_m, &to_m);
        entered += u32::from(closed);
        if (0..=400).any(|k| inside(&along(k), 0.0)) {
            assert!(closed, "{from_m} to {to_m}");
        }
        // Steps of at most 6 mm cannot jump over a column that is 1 cm wider.
        if closed {
            assert!(
                (0..=400).any(|k| inside(&along(k), -0.01)),
                "{from_m} to {to_m}"
            );
        }
    }
    assert!((2_000..18_000).contains(&entered), "{entered}");
}

/// The air itself, not its bound: mean square and mean over the discs, in units of the induced
/// velocity.
fn over_discs(wake: &Wake, discs: &DiscPoints, x_m: f64, y_m: f64, depth_m: f64) -> (f64, f64) {
    let points = discs.offsets_m.iter().zip(&discs.weights);
    points.fold((0.0, 0.0), |(square, mean), (offset_m, weight)| {
        let point_m = Vector3::new(x_m + offset_m[0], y_m + offset_m[1], -depth_m);
        let speed = wake.axial_speed_mps(point_m) / wake.induced_velocity_mps();
        (square + weight * speed * speed, mean + weight * speed)
    })
}

/// Effects at random, several at once.
fn effects(seed: u32) -> airflow::effects::Effects {
    use airflow::effects::{
        Buoyancy, Crossflow, Effects, MomentumScale, ProfileTail, RotorCant, WakeLean, WakeTilt,
        Wander,
    };
    let at = |n: u32| (f64::from(16 * seed + n) * 0.754_877_666_246_69).fract();
    let between = |n: u32, low: f64, high: f64| low + (high - low) * at(n);
    let wind_mps = between(1, 0.1, 2.0);
    let (sin, cos) = (std::f64::consts::TAU * at(2)).sin_cos();
    Effects {
        crossflow: seed.is_multiple_of(2).then_some(Crossflow {
            wind_mps: [wind_mps * cos, wind_mps * sin],
        }),
        wake_tilt: seed.is_multiple_of(3).then_some(WakeTilt {
            tilt: [between(3, -0.3, 0.3), between(4, -0.3, 0.3)],
        }),
        rotor_cant: (seed % 3 == 1).then_some(RotorCant {
            width_factor: between(5, 0.7, 1.45),
        }),
        wander: (seed % 4 == 1).then_some(Wander {
            growth: between(6, -0.3, 3.0),
        }),
        profile_tail: (seed % 4 == 2).then_some(ProfileTail {
            share: between(7, -0.6, 1.6),
            steepness: between(8, -0.6, 4.0),
        }),
        momentum_scale: seed.is_multiple_of(5).then_some(MomentumScale {
            speed_factor: between(9, 0.7, 1.4),
        }),
        buoyancy: (seed % 5 == 3).then_some(Buoyancy {
            strength: between(10, -0.3, 0.3),
        }),
        wake_lean: (seed % 4 >= 2).then_some(WakeLean {
            share: between(11, 0.0, 1.0),
        }),
        ..Effects::default()
    }
}

#[test]
fn no_place_meets_more_air_than_the_envelope_of_a_moved_jet_says() {
    for seed in 1..=24 {
        let names = PAIRS[seed as usize % PAIRS.len()];
        let (plain, discs, _) = pair(names);
        let wake = airflow::Flown::of(&effects(seed))
            .expect("all can be flown")
            .accelerating(4.0)
            .wake(&plain);
        let envelope = Envelope::new(&wake, &discs, DEEPEST_M, NEGLIGIBLE_SQUARE);
        let mut worst = (0.0, Vector3::zeros(), 0.0);
        for (i, [x, y, z]) in places(20_000).enumerate() {
            // A third of the places in the near field, the rest about the jet.
            let depth_m = if i % 3 == 0 {
                z * 1.2 * wake.near_field_depth_m()
            } else {
                z * DEEPEST_M
            };
            let Some([axis_x_m, axis_y_m]) = wake.axis_m(depth_m) else {
                continue;
            };
            let out = if i % 2 == 0 { 1.5 } else { 6.0 };
            let spread_m = out * wake.spread_m(depth_m).expect("it is there")
                + near_reach_m(&wake, &discs) / 2.0;
            let offset_m = Vector3::new(
                axis_x_m + (2.0 * x - 1.0) * spread_m,
                axis_y_m + (2.0 * y - 1.0) * spread_m,
                -depth_m,
            );
            let (square, _) = over_discs(&wake, &discs, offset_m.x, offset_m.y, depth_m);
            let bound = at(&envelope, offset_m).max(NEGLIGIBLE_SQUARE);
            if square / bound > worst.0 {
                worst = (square / bound, offset_m, square);
            }
        }
        let (ratio, [x, y, z], square) = (worst.0, worst.1.into(), worst.2);
        println!(
            "{names:?}, {seed}: {ratio:.4} at ({x:.3}, {y:.3}, {z:.3}) m, mean square {square:.5}"
        );
        assert!(
            ratio <= 1.0,
            "{ratio} of the bound under {:?}",
            effects(seed)
        );
    }
}

#[test]
fn a_way_through_a_moved_jet_meets_no_less_than_any_place_on_it() {
    for seed in 1..=8 {
        let (plain, discs, _) = pair(PAIRS[0]);
        let wake = airflow::Flown::of(&effects(seed))
            .expect("all can be flown")
            .accelerating(4.0)
            .wake(&plain);
        let envelope = Envelope::new(&wake, &discs, DEEPEST_M, NEGLIGIBLE_SQUARE);
        for two in places(600).collect::<Vec<_>>().chunks_exact(2) {
            let end =
                |[x, y, z]: [f64; 3]| Vector3::new(5.0 * x - 2.5, 5.0 * y - 2.5, 1.0 - 7.0 * z);
            let (from_m, to_m) = (end(two[0]), end(two[1]));
            let whole = envelope.along(&from_m, &to_m).peak_square;
            for k in 0..=20 {
                let place_m = from_m + (to_m - from_m) * (f64::from(k) / 20.0);
                let here = at(&envelope, place_m);
                assert!(
                    here <= whole * (1.0 + 1e-9),
                    "{here} at {place_m}, {whole} on the way"
                );
            }
        }
    }
}

#[test]
fn a_table_is_made_once_and_another_for_whatever_it_depends_on() {
    let of = |mass_kg: f64, terms: [f64; 2], still: f64| {
        let airframe = Airframe::preset("kolibri").expect("a preset");
        let wake = Wake::new(&airframe, mass_kg, 1.204, &Jet::default());
        tables::of_each(&wake, &[(&airframe.disc_points(), still)], terms).remove(0)
    };
    let first = of(0.5, [3.0, 0.1], 1e-5);
    assert!(std::sync::Arc::ptr_eq(&first, &of(0.5, [3.0, 0.1], 1e-5)));
    let others = [
        of(0.6, [3.0, 0.1], 1e-5),
        of(0.5, [4.0, 0.1], 1e-5),
        of(0.5, [3.0, 0.2], 1e-5),
        of(0.5, [3.0, 0.1], 2e-5),
    ];
    for other in others {
        assert!(!std::sync::Arc::ptr_eq(&first, &other));
    }
    let there_m = Vector3::new(0.05, 0.0, -1.0);
    assert!(at(&first, there_m) > 0.0);
}
