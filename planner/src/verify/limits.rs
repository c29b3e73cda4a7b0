//! What one drone may not do by itself: jump, fly too fast, leave the bounds.

use nalgebra::{Point3, Vector3};

use super::Found;
use super::flight::{Flight, Scene};
use crate::plan::trajectory::SAME_PLACE_M;
use crate::plan::{Violation, ViolationKind};

pub(super) fn check(scene: &Scene<'_>, flight: &Flight) -> Vec<Found> {
    let mut found = Vec::new();
    let mut report =
        |kind, span_s: (f64, f64), position_m: Point3<f64>, value: f64, limit: f64, unit: &str| {
            found.push((
                flight.index,
                Violation {
                    kind,
                    drone: flight.name.clone(),
                    with: None,
                    from_s: span_s.0,
                    until_s: scene.until(span_s.1),
                    position_m,
                    value,
                    limit,
                    unit: unit.to_owned(),
                },
            ));
        };
    for (t_s, from_m, to_m) in flight.trajectory.jumps() {
        report(
            ViolationKind::Jump,
            (t_s, t_s),
            from_m,
            (to_m - from_m).norm(),
            0.0,
            "m",
        );
    }
    for piece in flight.trajectory.pieces() {
        let motion = &piece.motion;
        let span_s = (motion.from_s, motion.until_s);
        let speed_mps = motion.max_speed_mps();
        // A millionth of the limit is rounding of the times in the file.
        if speed_mps > flight.max_speed_mps * (1.0 + 1e-6) {
            let at_m = Point3::from(motion.at_m(motion.from_s));
            report(
                ViolationKind::Speed,
                span_s,
                at_m,
                speed_mps,
                flight.max_speed_mps,
                "m/s",
            );
        }
        let (low_m, high_m) = motion.box_m(span_s.0, span_s.1);
        let outside = (scene.bounds_m.min.coords - low_m)
            .sup(&(high_m - scene.bounds_m.max.coords))
            .max();
        if outside > SAME_PLACE_M {
            let worst_s = if beyond_m(scene, &motion.at_m(span_s.0)) >= outside {
                span_s.0
            } else {
                span_s.1
            };
            report(
                ViolationKind::Bounds,
                span_s,
                motion.at_m(worst_s).into(),
                outside,
                0.0,
                "m",
            );
        }
    }
    found
}

/// How far a place lies outside the bounds along any axis (m).
fn beyond_m(scene: &Scene<'_>, place_m: &Vector3<f64>) -> f64 {
    (scene.bounds_m.min.coords - place_m)
        .sup(&(place_m - scene.bounds_m.max.coords))
        .max()
}
