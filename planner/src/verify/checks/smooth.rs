//! Of a trajectory that claims to be smooth: whether it begins and ends at rest, whether velocity
//! and acceleration go on at every break point, and the limits of acceleration and jerk.
//!
//! Acceleration is linear in a piece and jerk constant: their ends decide. Trajectories of straight
//! pieces alone turn in no time and are not held to any of this.

use nalgebra::{Point3, Vector3};

use crate::plan::ViolationKind;
use crate::plan::trajectory::Motion;
use crate::verify::scene::{Flight, Scene, Smooth};
use crate::verify::violation::{IndexedViolation, Worst};

/// Velocities this near are one (m/s): chosen here, what a place that is a micrometre off changes
/// over a millisecond.
const SAME_VELOCITY_MPS: f64 = 1e-3;
/// Accelerations this near are one (m/s²): chosen here, a thousandth of a light vehicle's limit.
const SAME_ACCELERATION_MPS2: f64 = 1e-2;
/// Rounding, as a part of a limit of acceleration or jerk: chosen here.
const ROUNDING: f64 = 1e-3;

/// Jumps of velocity and acceleration, motion before the first and after the last point, and pieces
/// beyond the limits.
pub(crate) fn check(scene: &Scene<'_>, flight: &Flight) -> Vec<IndexedViolation> {
    let Some(Smooth {
        acceleration_mps2,
        jerk_mps3,
        rests,
    }) = flight.smooth
    else {
        return Vec::new();
    };
    let mut found = Vec::new();
    let mut report = |kind, t_s: f64, place_m: Vector3<f64>, (value, limit): (f64, f64)| {
        let worst = Worst {
            with: None,
            position_m: Point3::from(place_m),
            value,
            limit,
        };
        found.push(scene.violation(flight, kind, (t_s, t_s), worst));
    };
    let motions: Vec<&Motion> = (flight.trajectory.pieces().iter())
        .map(|piece| &piece.motion)
        .collect();
    let still = |at: Option<&&Motion>, end: fn(&Motion) -> f64| {
        at.map(|it| {
            Motion::straight(
                (end(it), end(it)),
                it.at_m(end(it)).into(),
                it.at_m(end(it)).into(),
            )
        })
    };
    let before = still(motions.first(), |it| it.from_s).filter(|_| rests[0]);
    let after = still(motions.last(), |it| it.until_s).filter(|_| rests[1]);
    let all = (before.iter())
        .chain(motions.iter().copied())
        .chain(after.iter());
    let all: Vec<&Motion> = all.collect();
    for pair in all.windows(2) {
        let t_s = pair[1].from_s;
        let jump = |of: &dyn Fn(&Motion) -> Vector3<f64>| (of(pair[1]) - of(pair[0])).norm();
        let (by_mps, by_mps2) = (
            jump(&|it| it.velocity_mps(t_s)),
            jump(&|it| it.acceleration_mps2(t_s)),
        );
        let place_m = pair[1].at_m(t_s);
        if by_mps > SAME_VELOCITY_MPS {
            report(ViolationKind::VelocityJump, t_s, place_m, (by_mps, 0.0));
        } else if by_mps2 > SAME_ACCELERATION_MPS2 {
            report(
                ViolationKind::AccelerationJump,
                t_s,
                place_m,
                (by_mps2, 0.0),
            );
        }
    }
    for motion in motions {
        let ends_s = [motion.from_s, motion.until_s];
        let accelerations = ends_s.map(|t_s| (motion.acceleration_mps2(t_s).norm(), t_s));
        let [first, last] = accelerations;
        let (value, t_s) = if first.0 >= last.0 { first } else { last };
        if let Some(most) = acceleration_mps2
            && value > most * (1.0 + ROUNDING)
        {
            report(
                ViolationKind::Acceleration,
                t_s,
                motion.at_m(t_s),
                (value, most),
            );
        }
        let value = motion.jerk_mps3().norm();
        if let Some(most) = jerk_mps3
            && value > most * (1.0 + ROUNDING)
        {
            report(
                ViolationKind::Jerk,
                ends_s[0],
                motion.at_m(ends_s[0]),
                (value, most),
            );
        }
    }
    found
}
