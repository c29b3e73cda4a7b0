//! The body of every drone against every solid.
//!
//! The distance to a solid changes no faster than the drone moves, so a window is clear when the
//! distance at its middle exceeds the body's radius by more than half the way. This holds for any solid
//! and any motion.

use super::Found;
use super::clock::join;
use super::flight::{Flight, Scene};
use super::solid::Solid;
use crate::plan::trajectory::Motion;
use crate::plan::{Violation, ViolationKind};

/// How deep two bodies may sink into one another before it counts (m), chosen here: the files carry
/// rounded numbers.
pub(crate) const TOUCH_M: f64 = 1e-3;

/// The same into a solid (m), chosen here: what stands on a surface touches it, and a scenario may
/// have it half a centimetre too low.
const SINK_M: f64 = 5e-3;

/// A way this short is judged by its middle (m): half of the depth allowed.
const SHORTEST_WAY_M: f64 = 0.5 * TOUCH_M;

pub(super) fn check(scene: &Scene<'_>, flight: &Flight) -> Vec<Found> {
    let mut found = Vec::new();
    let allowed_m = flight.body_radius_m - SINK_M;
    for solid in &scene.solids {
        let mut parts = Vec::new();
        let mut worst = (0.0, f64::INFINITY);
        for piece in flight.trajectory.pieces() {
            let span_s = (piece.motion.from_s, piece.motion.until_s);
            if solid.box_distance_m(&piece.motion.box_m(span_s.0, span_s.1)) < allowed_m {
                inside(
                    solid,
                    &piece.motion,
                    span_s,
                    allowed_m,
                    &mut parts,
                    &mut worst,
                );
            }
        }
        for (from_s, until_s) in parts {
            let position_m = flight
                .trajectory
                .position_m(worst.0)
                .unwrap_or_else(|| flight.trajectory.last_m());
            found.push((
                flight.index,
                Violation {
                    kind: ViolationKind::Obstacle,
                    drone: flight.name.clone(),
                    with: Some(solid.name.clone()),
                    from_s,
                    until_s: scene.until(until_s),
                    position_m,
                    value: worst.1 - flight.body_radius_m,
                    limit: 0.0,
                    unit: "m".to_owned(),
                },
            ));
        }
    }
    found
}

/// Appends the parts of a span during which the solid is nearer than allowed, and keeps the nearest
/// moment (time, distance).
fn inside(
    solid: &Solid,
    motion: &Motion,
    span_s: (f64, f64),
    allowed_m: f64,
    parts: &mut Vec<(f64, f64)>,
    worst: &mut (f64, f64),
) {
    let (from_s, until_s) = span_s;
    let middle_s = 0.5 * (from_s + until_s);
    let half_way_m = motion.half_path_m(from_s, until_s);
    let distance_m = solid.distance_m(&motion.at_m(middle_s));
    if distance_m - half_way_m >= allowed_m {
        return;
    }
    if 2.0 * half_way_m <= SHORTEST_WAY_M {
        if distance_m < allowed_m {
            join(parts, span_s);
            if distance_m < worst.1 {
                *worst = (middle_s, distance_m);
            }
        }
        return;
    }
    inside(solid, motion, (from_s, middle_s), allowed_m, parts, worst);
    inside(solid, motion, (middle_s, until_s), allowed_m, parts, worst);
}
