//! What one drone may not do by itself: jump, fly, climb or sink too fast, leave the bounds, go
//! sideways beside its pad or set down too fast.

use nalgebra::{Point3, Vector3};

use crate::plan::ViolationKind;
use crate::plan::trajectory::{Motion, SAME_PLACE_M};
use crate::verify::extents::Span;
use crate::verify::scene::{Flight, Scene};
use crate::verify::violation::{Found, Worst};

/// Rounding of the times in the file, as a part of the highest speed.
const SPEED_ROUNDING: f64 = 1e-6;

/// Highest speed of the last stretch of a landing (m/s): the wake of a drone that comes down on its
/// own air is at its worst there.
const TOUCHDOWN_MPS: f64 = 0.5;
/// How long that stretch is, beyond the radius of the body, and how far a take-off goes straight up
/// (m).
const STRAIGHT_M: f64 = 0.5;

/// Jumps, pieces that are too fast or leave the bounds, and pieces beside a pad that are not those
/// of a take-off or a landing.
pub(crate) fn check(scene: &Scene<'_>, flight: &Flight) -> Vec<Found> {
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
    // How far a box lies outside the bounds along any axis (m).
    let beyond_m =
        |low_m: Vector3<f64>, high_m: Vector3<f64>| (min_m - low_m).sup(&(high_m - max_m)).max();
    for motion in flight.trajectory.pieces().iter().map(|piece| &piece.motion) {
        let span_s = (motion.from_s, motion.until_s);
        let (speed_mps, most_mps) = (motion.max_speed_mps(), flight.max_speed_mps);
        let first_m = motion.at_m(span_s.0);
        if speed_mps > most_mps * (1.0 + SPEED_ROUNDING) {
            let values = (speed_mps, most_mps);
            report(ViolationKind::Speed, span_s, first_m.into(), values);
        }
        let climb_mps = motion.climb_mps();
        let vertical = [ViolationKind::Climb, ViolationKind::Descent].into_iter();
        for ((kind, limit), fast_mps) in vertical
            .zip(flight.vertical_mps)
            .zip([climb_mps, -climb_mps])
        {
            if let Some(most_mps) = limit
                && fast_mps > most_mps * (1.0 + SPEED_ROUNDING)
            {
                report(kind, span_s, first_m.into(), (fast_mps, most_mps));
            }
        }
        let (low_m, high_m) = motion.box_m(span_s.0, span_s.1);
        let outside_m = beyond_m(low_m, high_m);
        if outside_m > SAME_PLACE_M {
            let worst_m = match beyond_m(first_m, first_m) >= outside_m {
                true => first_m,
                false => motion.at_m(span_s.1),
            };
            let values = (outside_m, 0.0);
            report(ViolationKind::Bounds, span_s, worst_m.into(), values);
        }
    }
    // A plan without limits of descent says nothing of how it lands.
    if flight.vertical_mps[1].is_some() {
        for Beside { motion, lands } in beside_pads(flight) {
            let span_s = (motion.from_s, motion.until_s);
            let at_m = Point3::from(motion.at_m(span_s.0));
            let velocity_mps =
                (motion.at_m(span_s.1) - motion.at_m(span_s.0)) / (span_s.1 - span_s.0);
            let sideways_mps = velocity_mps.xy().norm();
            if sideways_mps * (span_s.1 - span_s.0) > SAME_PLACE_M {
                report(ViolationKind::Sideways, span_s, at_m, (sideways_mps, 0.0));
            }
            if lands && -velocity_mps.z > TOUCHDOWN_MPS * (1.0 + SPEED_ROUNDING) {
                let values = (-velocity_mps.z, TOUCHDOWN_MPS);
                report(ViolationKind::Touchdown, span_s, at_m, values);
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
            let edge_s = near_s + (far_s - near_s) * (top_z_m - near_z_m) / (far_z_m - near_z_m);
            let motion = motion.during(edge_s.min(near_s), edge_s.max(near_s));
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
    beside
}
