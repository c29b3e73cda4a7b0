//! The body of every drone against every solid.
//!
//! The distance to a solid changes no faster than the drone moves, so a span is clear when the
//! distance at its middle exceeds the body's radius by more than half the path. This holds for any
//! solid and any motion.

use crate::plan::ViolationKind;
use crate::plan::trajectory::Motion;
use crate::verify::bounds::obstacles::Solid;
use crate::verify::extents::Span;
use crate::verify::scene::{Flight, Scene};
use crate::verify::time::spans::join;
use crate::verify::violation::{Found, Worst};

/// How deep two bodies may sink into one another before it counts (m), chosen here: the files carry
/// rounded numbers.
pub(crate) const TOUCH_M: f64 = 1e-3;

/// The same into a solid (m), chosen here: what stands on a surface touches it, and a scenario may
/// have it half a centimetre too low.
const SINK_M: f64 = 5e-3;

/// A path this short is judged by its middle (m): half of the depth allowed.
const SHORTEST_PATH_M: f64 = 0.5 * TOUCH_M;

/// When the body is in one solid, and when it is nearest to it.
struct Inside<'a> {
    /// Which one.
    solid: &'a Solid,
    /// From it to the rotor-plane centre (m).
    allowed_m: f64,
    /// In order of time (s).
    parts: Vec<Span>,
    /// s, m.
    nearest: (f64, f64),
}

/// The spans during which the body is in a solid, each with the deepest moment of all.
pub(crate) fn check(scene: &Scene<'_>, flight: &Flight) -> Vec<Found> {
    let mut found = Vec::new();
    for solid in &scene.obstacles.solids {
        let mut inside = Inside {
            solid,
            allowed_m: flight.body_radius_m - SINK_M,
            parts: Vec::new(),
            nearest: (0.0, f64::INFINITY),
        };
        for motion in flight.trajectory.pieces().iter().map(|piece| &piece.motion) {
            let box_m = motion.box_m(motion.from_s, motion.until_s);
            if solid.box_distance_m(&box_m) < inside.allowed_m {
                inside.search(motion, (motion.from_s, motion.until_s));
            }
        }
        for span_s in inside.parts {
            let (t_s, distance_m) = inside.nearest;
            let worst = Worst {
                with: Some(solid.name.clone()),
                position_m: flight.position_m(t_s),
                value: distance_m - flight.body_radius_m,
                limit: 0.0,
            };
            found.push(scene.violation(flight, ViolationKind::Obstacle, span_s, worst));
        }
    }
    found
}

impl Inside<'_> {
    /// Adds the parts of a span during which the solid is nearer than allowed.
    fn search(&mut self, motion: &Motion, span_s: Span) {
        let middle_s = 0.5 * (span_s.0 + span_s.1);
        let half_path_m = motion.half_path_m(span_s.0, span_s.1);
        let distance_m = self.solid.distance_m(&motion.at_m(middle_s));
        if distance_m - half_path_m >= self.allowed_m {
            return;
        }
        if 2.0 * half_path_m > SHORTEST_PATH_M {
            self.search(motion, (span_s.0, middle_s));
            self.search(motion, (middle_s, span_s.1));
        } else if distance_m < self.allowed_m {
            join(&mut self.parts, span_s);
            if distance_m < self.nearest.1 {
                self.nearest = (middle_s, distance_m);
            }
        }
    }
}
