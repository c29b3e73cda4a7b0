//! What one drone may not do by itself: jump, fly too fast, leave the bounds.

use nalgebra::{Point3, Vector3};

use crate::plan::ViolationKind;
use crate::plan::trajectory::SAME_PLACE_M;
use crate::verify::extents::Span;
use crate::verify::scene::{Flight, Scene};
use crate::verify::violation::{Found, Worst};

/// Rounding of the times in the file, as a part of the highest speed.
const SPEED_ROUNDING: f64 = 1e-6;

/// Jumps, pieces that are too fast, and pieces that leave the bounds.
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
    found
}
