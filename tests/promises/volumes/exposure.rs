//! Exposure of a leg against a midpoint sum over the model that shares no code with it.

use super::wake_of;
use airflow::{Airframe, DiscPoints, Superposition, Wake};
use costmap::wake::exposure::{Emitter, Exposure, Flight, Receiver, exposure};
use nalgebra::{Point3, Vector3};

/// What the issue asks for.
const ONE_PER_MILLE: f64 = 1e-3;

/// Midpoints of the reference sum.
const STEPS: usize = crate::samples(40_000, 200_000);

fn leg(from: [f64; 3], to: [f64; 3], start_s: f64, end_s: f64) -> Flight {
    Flight {
        start_m: from.into(),
        end_m: to.into(),
        start_s,
        end_s,
    }
}

struct Case {
    name: &'static str,
    receiver: Flight,
    emitters: Vec<(Flight, Wake, f64)>,
}

fn discs() -> DiscPoints {
    Airframe::preset("offboard-1")
        .expect("a preset")
        .disc_points()
}

const MASS_KG: f64 = 0.572;

fn own_velocity_mps() -> f64 {
    wake_of("offboard-1").induced_velocity_mps()
}

fn by_library(case: &Case, superposition: Superposition) -> Exposure {
    let discs = discs();
    let emitters: Vec<Emitter> = case
        .emitters
        .iter()
        .map(|(leg, wake, end_m)| Emitter {
            leg: *leg,
            wake,
            ends_at_z_m: *end_m,
        })
        .collect();
    let receiver = Receiver {
        leg: case.receiver,
        discs: &discs,
        mass_kg: MASS_KG,
        induced_velocity_mps: own_velocity_mps(),
    };
    exposure(&receiver, &emitters, superposition).expect("finite")
}

/// The air met at an instant; positions, superposition and disc mean written out again.
fn met_by_hand_mps(case: &Case, discs: &DiscPoints, superposition: Superposition, t: f64) -> f64 {
    let place = |leg: &Flight| {
        let part = if leg.end_m == leg.start_m {
            0.0
        } else {
            (t - leg.start_s) / (leg.end_s - leg.start_s)
        };
        Point3::from(leg.start_m.coords.lerp(&leg.end_m.coords, part))
    };
    let centre = place(&case.receiver);
    let mut mean = 0.0;
    for (offset, weight) in discs.offsets_m.iter().zip(&discs.weights) {
        let p = centre + Vector3::new(offset[0], offset[1], 0.0);
        let blowing = case.emitters.iter().filter(|(leg, _, end_m)| {
            t >= leg.start_s && t <= leg.end_s && centre.z >= end_m - 1e-6
        });
        let speeds = blowing.map(|(leg, wake, _)| wake.axial_speed_mps(p - place(leg)));
        mean += weight
            * match superposition {
                Superposition::Momentum => speeds.map(|u| u * u).sum::<f64>().sqrt(),
                Superposition::Linear => speeds.sum(),
                Superposition::Strongest => speeds.fold(0.0, f64::max),
            };
    }
    mean
}

/// Midpoint sum of axial exposure and energy.
fn by_hand(case: &Case, superposition: Superposition) -> Exposure {
    let (discs, own_mps) = (discs(), own_velocity_mps());
    let mut met = Exposure::default();
    let step_s = (case.receiver.end_s - case.receiver.start_s) / STEPS as f64;
    for i in 0..STEPS {
        let t = case.receiver.start_s + (i as f64 + 0.5) * step_s;
        let mean = met_by_hand_mps(case, &discs, superposition, t);
        met.axial_exposure_m += mean * step_s;
        let alpha = mean / own_mps;
        let beta = alpha / 2.0 + (alpha * alpha + 4.0).sqrt() / 2.0;
        met.extra_energy_j += (beta - 1.0) * MASS_KG * 9.81 * own_mps * step_s;
        met.worst_mps = met.worst_mps.max(mean);
    }
    met
}

fn cases() -> Vec<Case> {
    let matrice = wake_of("matrice-300");
    let kolibri = wake_of("kolibri");
    let hover = |x: f64, y: f64, z: f64| Flight::hover([x, y, z].into(), 0.0, f64::INFINITY);
    vec![
        Case {
            name: "level pass through the cone",
            receiver: leg([-8.0, 0.3, 1.0], [9.0, 0.1, 1.0], 3.0, 20.0),
            emitters: vec![(hover(0.0, 0.0, 6.0), matrice.clone(), 0.0)],
        },
        Case {
            name: "climb through cone and column, and out above the rotor plane",
            receiver: leg([-1.0, -0.4, 0.5], [1.2, 0.5, 7.0], 0.0, 9.0),
            emitters: vec![(hover(0.1, 0.0, 6.0), matrice.clone(), 0.0)],
        },
        Case {
            name: "a long way past a small wake",
            receiver: leg([-60.0, 0.02, 1.0], [45.0, 0.02, 1.0], 0.0, 50.0),
            emitters: vec![(hover(0.0, 0.0, 1.5), kolibri.clone(), 0.0)],
        },
        Case {
            name: "straight down from above, to where a shelf ends the wake",
            receiver: leg([0.2, 0.1, 8.0], [0.2, 0.1, 1.0], 0.0, 7.0),
            emitters: vec![(hover(0.0, 0.0, 6.0), matrice.clone(), 2.3)],
        },
        Case {
            name: "three wakes, two of them on the move, one for a part of the time",
            receiver: leg([-3.0, 0.0, 2.0], [4.0, 1.0, 1.5], 0.0, 8.0),
            emitters: vec![
                (
                    leg([3.0, 0.5, 5.0], [-4.0, 0.2, 6.0], -1.0, 9.0),
                    matrice.clone(),
                    0.0,
                ),
                (
                    leg([-1.0, 0.0, 1.0], [1.0, 0.4, 4.0], 1.0, 6.5),
                    kolibri,
                    0.0,
                ),
                (hover(0.6, 0.4, 4.0), matrice, 0.0),
            ],
        },
    ]
}

#[test]
fn exposure_agrees_with_a_midpoint_sum_of_the_model() {
    for case in cases() {
        for superposition in [
            Superposition::Momentum,
            Superposition::Linear,
            Superposition::Strongest,
        ] {
            if superposition != Superposition::Momentum && case.emitters.len() == 1 {
                continue; // one wake: nothing to add
            }
            let (ours, reference) = (
                by_library(&case, superposition),
                by_hand(&case, superposition),
            );
            let name = case.name;
            println!(
                "{name}, {superposition}: axial exposure {:.5} m ({:+.1e}), energy {:.4} J ({:+.1e}), worst {:.4} m/s ({:+.1e})",
                ours.axial_exposure_m,
                ours.axial_exposure_m / reference.axial_exposure_m - 1.0,
                ours.extra_energy_j,
                ours.extra_energy_j / reference.extra_energy_j - 1.0,
                ours.worst_mps,
                ours.worst_mps / reference.worst_mps - 1.0
            );
            assert!(
                (ours.axial_exposure_m / reference.axial_exposure_m - 1.0).abs() < ONE_PER_MILLE,
                "{name}: {ours:?} {reference:?}"
            );
            assert!(
                (ours.extra_energy_j / reference.extra_energy_j - 1.0).abs() < ONE_PER_MILLE,
                "{name}"
            );
            assert!(
                (ours.worst_mps / reference.worst_mps - 1.0).abs() < ONE_PER_MILLE,
                "{name}: {ours:?} {reference:?}"
            );
            // Two peaks may be equally high: at the time named the air is the worst, whichever it
            // is.
            let then_mps = met_by_hand_mps(&case, &discs(), superposition, ours.worst_at_s);
            assert!(
                (then_mps / ours.worst_mps - 1.0).abs() < 1e-9,
                "{name}: rounding only"
            );
        }
    }
}

#[test]
fn hovering_under_a_hover_costs_the_same_every_second() {
    let wake = wake_of("matrice-300");
    let case = Case {
        name: "hover",
        receiver: Flight::hover([0.3, 0.0, 2.0].into(), 5.0, 15.0),
        emitters: vec![(
            Flight::hover([0.0, 0.0, 6.0].into(), 0.0, f64::INFINITY),
            wake,
            0.0,
        )],
    };
    let met = by_library(&case, Superposition::Momentum);
    // Rounding only: the integrand is constant.
    assert!((met.axial_exposure_m / (10.0 * met.worst_mps) - 1.0).abs() < 1e-12);
    assert_eq!(met.from, Some(0));
    assert!(
        (5.0..5.1).contains(&met.worst_at_s),
        "the earliest of equals: {}",
        met.worst_at_s
    );
}

#[test]
fn nothing_is_met_above_beside_in_time_or_below_the_end_of_a_wake() {
    let wake = wake_of("matrice-300");
    let above = leg([-3.0, 0.0, 7.0], [3.0, 0.0, 6.0], 0.0, 5.0);
    let below = leg([-3.0, 0.0, 2.0], [3.0, 0.0, 2.0], 0.0, 5.0);
    let at = [0.0, 0.0, 6.0].into();
    let cases = [
        (above, Flight::hover(at, 0.0, 9.0), 0.0),
        (below, Flight::hover(at, 5.0, 9.0), 0.0),
        (below, Flight::hover(at, 0.0, 9.0), 2.1),
    ];
    for (receiver, emitter, end_m) in cases {
        let case = Case {
            name: "nothing",
            receiver,
            emitters: vec![(emitter, wake.clone(), end_m)],
        };
        let nothing = Exposure {
            worst_at_s: receiver.start_s,
            ..Exposure::default()
        };
        assert_eq!(by_library(&case, Superposition::Momentum), nothing);
    }
    // Exactly at the end of the wake it is still felt.
    let case = Case {
        name: "end",
        receiver: below,
        emitters: vec![(Flight::hover(at, 0.0, 9.0), wake, 2.0)],
    };
    assert!(by_library(&case, Superposition::Momentum).worst_mps > 1.0);
}

#[test]
fn the_worst_air_is_blamed_on_the_strongest_wake() {
    let kolibri = wake_of("kolibri");
    let matrice = wake_of("matrice-300");
    let case = Case {
        name: "two",
        receiver: leg([-4.0, 0.0, 1.0], [4.0, 0.0, 1.0], 0.0, 8.0),
        emitters: vec![
            (
                Flight::hover([-2.0, 0.0, 4.0].into(), 0.0, 9.0),
                kolibri,
                0.0,
            ),
            (
                Flight::hover([2.0, 0.0, 4.0].into(), 0.0, 9.0),
                matrice,
                0.0,
            ),
        ],
    };
    let met = by_library(&case, Superposition::Momentum);
    assert_eq!(met.from, Some(1));
    assert!((met.worst_at_s - 6.0).abs() < 0.05, "{met:?}");
}

#[test]
fn legs_that_are_no_numbers_are_refused() {
    let (wake, discs) = (wake_of("kolibri"), discs());
    let good = Flight::hover(Point3::origin(), 0.0, 1.0);
    let bad_place = Flight::hover(Point3::new(f64::NAN, 0.0, 0.0), 0.0, 1.0);
    let bad_time = Flight::hover(Point3::origin(), 0.0, f64::NAN);
    let endless = Flight::hover(Point3::origin(), 0.0, f64::INFINITY);
    let ask = |receiver: Flight, emitter: Flight, end_m: f64| {
        let receiver = Receiver {
            leg: receiver,
            discs: &discs,
            mass_kg: 1.0,
            induced_velocity_mps: 5.0,
        };
        let emitter = Emitter {
            leg: emitter,
            wake: &wake,
            ends_at_z_m: end_m,
        };
        exposure(&receiver, &[emitter], Superposition::Momentum).is_ok()
    };
    assert!(ask(good, endless, f64::NEG_INFINITY));
    for (receiver, emitter, end_m) in [
        (bad_place, good, 0.0),
        (bad_time, good, 0.0),
        (endless, good, 0.0),
        (good, bad_place, 0.0),
        (good, bad_time, 0.0),
        (good, good, f64::NAN),
    ] {
        assert!(
            !ask(receiver, emitter, end_m),
            "{receiver:?} {emitter:?} {end_m}"
        );
    }
}
