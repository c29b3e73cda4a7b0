//! The body of every drone against every solid, and against every zone that keeps bodies out.
//!
//! A drone that flies may be off its path by the tracking margin, but over its own pad. The
//! distance to a solid changes no faster than the drone moves, so a span is clear when the
//! distance at its middle exceeds the body's radius by more than half the path. This holds for any
//! solid and any motion.

use nalgebra::Point3;

use crate::plan::trajectory::Motion;
use crate::plan::{ViolationKind, Zone};
use crate::verify::bounds::obstacles::NamedSolid;
use crate::verify::extents::Span;
use crate::verify::scene::{Flight, Part, Scene};
use crate::verify::time::spans::join;
use crate::verify::violation::{IndexedViolation, Worst};

/// How deep two bodies may sink into one another before it counts (m), chosen here: the files carry
/// rounded numbers.
pub const TOUCH_M: f64 = 1e-3;

/// The same into a solid (m), chosen here: what stands on a surface touches it, and a scenario may
/// have it half a centimetre too low.
pub const SINK_M: f64 = 5e-3;

/// A path this short is judged by its middle (m): half of the depth allowed.
const SHORTEST_PATH_M: f64 = 0.5 * TOUCH_M;

/// Parts of a flight that are looked at beside one solid before what is left counts as found,
/// chosen here: a second or two of work, kilometres along a wall at half a millimetre from what is
/// allowed.
const MOST_PARTS: usize = 4_000_000;

/// Tops of obstacles this near to a drone's own pad, seen from above, bear no tracking margin (m):
/// it stands there. Chosen here.
pub const PAD_M: f64 = 0.5;

/// A rule about one body and one solid: which violation it is, and how near the centre may come.
struct Rule<'a> {
    /// What breaks it.
    kind: ViolationKind,
    solid: &'a NamedSolid,
    /// From it to the rotor-plane centre, standing and flying (m).
    allowed_m: [f64; 2],
    /// Pads near which the top of the solid is exempt (m).
    pads_m: &'a [Point3<f64>],
}

/// When the body breaks a rule.
struct Inside<'a> {
    rule: Rule<'a>,
    /// In order of time (s).
    spans_s: Vec<Span>,
    /// Time (s), distance (m), and what it had to be (m): where that is short by the most.
    nearest: (f64, f64, f64),
    /// Parts that may still be looked at.
    left: usize,
}

/// The spans during which the body is in a solid or in a zone that keeps bodies out, or nearer than
/// the tracking margin, each with the deepest moment of all.
pub(crate) fn check(scene: &Scene<'_>, flight: &Flight) -> Vec<IndexedViolation> {
    let parts: Vec<Part> = flight.parts((f64::NEG_INFINITY, f64::INFINITY)).collect();
    let body_m = flight.body_radius_m - SINK_M;
    let off_m = body_m + scene.margins.tracking_m;
    let pads_m: Vec<Point3<f64>> = [flight.takes_off_m, flight.lands_m]
        .into_iter()
        .flatten()
        .chain(flight.rests_m())
        .collect();
    let mut found = Vec::new();
    for solid in &scene.obstacles.solids {
        let mut rule = Rule {
            kind: ViolationKind::Obstacle,
            solid,
            allowed_m: [body_m; 2],
            pads_m: &[],
        };
        let before = found.len();
        found.extend(rule.broken(scene, flight, &parts));
        if found.len() == before && scene.margins.tracking_m > 0.0 {
            rule.kind = ViolationKind::ObstacleMargin;
            rule.allowed_m = [0.0, off_m];
            rule.pads_m = &pads_m;
            found.extend(rule.broken(scene, flight, &parts));
        }
    }
    for solid in &scene.keep_out {
        let rule = Rule {
            kind: ViolationKind::KeepOut,
            solid,
            allowed_m: [body_m, off_m],
            pads_m: &[],
        };
        found.extend(rule.broken(scene, flight, &parts));
    }
    found
}

/// Whether a body is ever in a box of a zone that does not keep it out.
pub(crate) fn enters(scene: &Scene<'_>, flight: &Flight, zone: &Zone) -> bool {
    let solid = NamedSolid::of_zone(zone);
    let rule = Rule {
        kind: ViolationKind::KeepOut,
        solid: &solid,
        allowed_m: [flight.body_radius_m - SINK_M; 2],
        pads_m: &[],
    };
    let parts: Vec<Part> = flight.parts((f64::NEG_INFINITY, f64::INFINITY)).collect();
    !rule.broken(scene, flight, &parts).is_empty()
}

impl<'a> Rule<'a> {
    /// The spans during which the drone breaks it.
    fn broken(&self, scene: &Scene<'_>, flight: &Flight, parts: &[Part]) -> Vec<IndexedViolation> {
        let mut inside = Inside {
            rule: Rule { ..*self },
            spans_s: Vec::new(),
            nearest: (0.0, 0.0, f64::NEG_INFINITY),
            left: MOST_PARTS,
        };
        for Part { motion, flies, .. } in parts {
            let allowed_m = self.allowed_m[usize::from(*flies)];
            let span_s = (motion.from_s, motion.until_s);
            let box_m = motion.box_m(span_s.0, span_s.1);
            if self.solid.box_distance_m(&box_m) < allowed_m {
                inside.search(motion, span_s, allowed_m);
            }
        }
        let (t_s, distance_m, allowed_m) = inside.nearest;
        let found = inside.spans_s.into_iter().map(|span_s| {
            let worst = Worst {
                with: Some(self.solid.name.clone()),
                position_m: flight.position_m(t_s),
                value: distance_m - flight.body_radius_m,
                limit: allowed_m + SINK_M - flight.body_radius_m,
            };
            scene.violation(flight, self.kind, span_s, worst)
        });
        found.collect()
    }

    /// Whether a place (m) is above the top of the solid and near a pad of the drone's own.
    fn is_exempt(&self, place_m: &Point3<f64>) -> bool {
        self.is_near_pad(place_m, 0.0) && self.solid.is_below(place_m)
    }

    /// Whether a pad of the drone's own is near some place this far (m) from here, seen from above.
    fn is_near_pad(&self, place_m: &Point3<f64>, within_m: f64) -> bool {
        let near = |pad_m: &Point3<f64>| (pad_m - place_m).xy().norm() < PAD_M + within_m;
        self.pads_m.iter().any(near)
    }
}

impl Inside<'_> {
    /// Adds the parts of a span during which the solid is nearer than allowed (m).
    fn search(&mut self, motion: &Motion, span_s: Span, allowed_m: f64) {
        let middle_s = 0.5 * span_s.0 + 0.5 * span_s.1;
        let half_path_m = motion.half_path_m(span_s.0, span_s.1);
        let middle_m = motion.at_m(middle_s);
        let distance_m = self.rule.solid.distance_m(&middle_m);
        if distance_m - half_path_m >= allowed_m {
            return;
        }
        let deepest_m = allowed_m - (distance_m - half_path_m).max(0.0);
        let is_inside = distance_m + half_path_m < allowed_m;
        let is_found = deepest_m <= self.nearest.2 - self.nearest.1;
        if is_inside && is_found && !self.rule.is_near_pad(&middle_m.into(), half_path_m) {
            join(&mut self.spans_s, span_s);
            return;
        }
        let ends_m = [span_s.0, span_s.1].map(|t_s| Point3::from(motion.at_m(t_s)));
        let is_vertical = (ends_m[1] - ends_m[0]).xy().norm() == 0.0;
        if is_vertical && ends_m.iter().all(|end_m| self.rule.is_exempt(end_m)) {
            return;
        }
        let is_divisible = span_s.0 < middle_s && middle_s < span_s.1 && self.left > 0;
        self.left = self.left.saturating_sub(1);
        if is_divisible && 2.0 * half_path_m > SHORTEST_PATH_M {
            self.search(motion, (span_s.0, middle_s), allowed_m);
            self.search(motion, (middle_s, span_s.1), allowed_m);
        } else if (distance_m < allowed_m || self.left == 0)
            && !self.rule.is_exempt(&middle_m.into())
        {
            join(&mut self.spans_s, span_s);
            if allowed_m - distance_m > self.nearest.2 - self.nearest.1 {
                self.nearest = (middle_s, distance_m, allowed_m);
            }
        }
    }
}
