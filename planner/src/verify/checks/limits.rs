//! What one drone may not do by itself: jump, fly, climb or sink too fast, leave the bounds, go
//! sideways beside its pad or set down too fast.

use nalgebra::{Point3, Vector3};

use crate::plan::ViolationKind;
use crate::plan::trajectory::{Motion, SAME_PLACE_M, SAME_TIME_S};
use crate::verify::extents::Span;
use crate::verify::scene::{Flight, Scene};
use crate::verify::violation::{IndexedViolation, Worst};

/// Rounding of the times in the file, as a part of the highest speed.
const SPEED_ROUNDING: f64 = 1e-6;

/// Highest speed of the last stretch of a landing (m/s): the wake of a drone that comes down on its
/// own air is at its worst there.
const TOUCHDOWN_MPS: f64 = 0.5;
/// How long that stretch is, beyond the radius of the body, and how far a take-off goes straight up
/// (m).
const STRAIGHT_M: f64 = 0.5;

/// A limit of speed (m/s), and what of a velocity it limits.
type Speed<'a> = (ViolationKind, Option<f64>, &'a dyn Fn(&Vector3<f64>) -> f64);

/// Jumps, pieces that are too fast or leave the bounds, and pieces beside a pad that are not those
/// of a take-off or a landing.
pub(crate) fn check(scene: &Scene<'_>, flight: &Flight) -> Vec<IndexedViolation> {
    let mut found = Vec::new();
    let mut report = |kind, span_s: Span, position_m: Point3<f64>, (value, limit): (f64, f64)| {
        let worst = Worst {
            with: None,
            position_m,
            value,
            limit,
        };
        found.push(scene.violation(flight, kind, span_s, worst));
    };
    for (t_s, from_m, to_m) in flight.trajectory.jumps() {
        let apart_m = (to_m - from_m).norm();
        report(ViolationKind::Jump, (t_s, t_s), from_m, (apart_m, 0.0));
    }
    let (min_m, max_m) = (scene.bounds_m.min.coords, scene.bounds_m.max.coords);
    // How far a place lies outside the bounds along any axis (m).
    let beyond_m = |at_m: Vector3<f64>| (min_m - at_m).sup(&(at_m - max_m)).max();
    for motion in flight.trajectory.pieces().iter().map(|piece| &piece.motion) {
        let span_s = (motion.from_s, motion.until_s);
        let [climb, descent] = flight.vertical_mps;
        let speeds: [Speed; 3] = [
            (ViolationKind::Speed, Some(flight.max_speed_mps), &|v| {
                v.norm()
            }),
            (ViolationKind::Climb, climb, &|v| v.z),
            (ViolationKind::Descent, descent, &|v| -v.z),
        ];
        for (kind, limit, measure) in speeds {
            if let Some(most_mps) = limit
                && let Some((fast_mps, t_s)) =
                    motion.highest_over(measure, most_mps * (1.0 + SPEED_ROUNDING))
            {
                report(kind, span_s, motion.at_m(t_s).into(), (fast_mps, most_mps));
            }
        }
        let turns = motion.turns_s().map(|t_s| motion.at_m(t_s));
        let (outside_m, worst_m) = turns.map(|at_m| (beyond_m(at_m), at_m)).fold(
            (SAME_PLACE_M, Vector3::zeros()),
            |worst, it| {
                if it.0 > worst.0 { it } else { worst }
            },
        );
        if outside_m > SAME_PLACE_M {
            let values = (outside_m, 0.0);
            report(ViolationKind::Bounds, span_s, worst_m.into(), values);
        }
    }
    // A plan without limits of descent says nothing of how it lands.
    if flight.vertical_mps[1].is_some() {
        for Beside { motion, lands } in beside_pads(flight) {
            let span_s = (motion.from_s, motion.until_s);
            let at_m = Point3::from(motion.at_m(span_s.0));
            let (low_m, high_m) = motion.box_m(span_s.0, span_s.1);
            if (high_m - low_m).xy().norm() > SAME_PLACE_M {
                let sideways = motion.highest_over(&|v| v.xy().norm(), 0.0);
                let values = (sideways.map_or(0.0, |(mps, _)| mps), 0.0);
                report(ViolationKind::Sideways, span_s, at_m, values);
            }
            let most_mps = TOUCHDOWN_MPS * (1.0 + SPEED_ROUNDING);
            if lands && let Some((fast_mps, t_s)) = motion.highest_over(&|v| -v.z, most_mps) {
                let values = (fast_mps, TOUCHDOWN_MPS);
                report(
                    ViolationKind::Touchdown,
                    span_s,
                    motion.at_m(t_s).into(),
                    values,
                );
            }
        }
    }
    found
}

/// A motion at a pad.
struct Beside {
    motion: Motion,
    /// It ends on the pad; else it begins there.
    lands: bool,
}

/// The parts of the pieces at take-off and at landing that are low over the pad.
fn beside_pads(flight: &Flight) -> Vec<Beside> {
    let pieces = flight.trajectory.pieces();
    let straight_m = flight.body_radius_m + STRAIGHT_M - SAME_PLACE_M;
    let mut beside = Vec::new();
    let mut low = |motions: &mut dyn Iterator<Item = Motion>, pad_m: Point3<f64>, lands: bool| {
        let top_z_m = pad_m.z + straight_m;
        for motion in motions {
            let [far_s, near_s] = match lands {
                true => [motion.from_s, motion.until_s],
                false => [motion.until_s, motion.from_s],
            };
            let (far_z_m, near_z_m) = (motion.at_m(far_s).z, motion.at_m(near_s).z);
            if near_z_m >= top_z_m {
                break;
            }
            if far_z_m < top_z_m {
                beside.push(Beside { motion, lands });
                continue;
            }
            // By halves: a cubic rises and sinks between its ends.
            let (mut low_s, mut high_s) = (near_s, far_s);
            while (high_s - low_s).abs() > SAME_TIME_S {
                let middle_s = 0.5 * (low_s + high_s);
                match motion.at_m(middle_s).z < top_z_m {
                    true => low_s = middle_s,
                    false => high_s = middle_s,
                }
            }
            let motion = motion.during(low_s.min(near_s), low_s.max(near_s));
            beside.push(Beside { motion, lands });
            break;
        }
    };
    let motions = || pieces.iter().map(|piece| piece.motion);
    if let Some(pad_m) = flight.takes_off_m {
        low(&mut motions(), pad_m, false);
    }
    if let Some(pad_m) = flight.lands_m {
        low(&mut motions().rev(), pad_m, true);
    }
    for (pad_m, &(lands_s, rises_s)) in flight.rests_m().zip(&flight.landed_s) {
        let before = |it: &Motion| it.until_s <= lands_s + SAME_TIME_S;
        let after = |it: &Motion| it.from_s >= rises_s - SAME_TIME_S;
        low(&mut motions().rev().filter(before), pad_m, true);
        low(&mut motions().filter(after), pad_m, false);
    }
    beside
}
