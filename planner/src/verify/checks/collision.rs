//! Two bodies: relative motion of two pieces, in closed form where both are straight.
//!
//! The distance of two balls on straight paths is the root of a parabola in time: where it is
//! smallest, and when it is below the sum of the radii less [`TOUCH_M`], follows without sampling.
//! On cubics the same holds of chords, of parts so short that they are as good.

use super::obstacle::TOUCH_M;
use crate::plan::ViolationKind;
use crate::verify::scene::Scene;
use crate::verify::time::encounters::Encounter;
use crate::verify::time::spans::join;
use crate::verify::violation::{IndexedViolation, Worst};

/// Collisions of one flight with those after it.
pub(crate) fn check(scene: &Scene<'_>, near: &[Encounter], k: usize) -> Vec<IndexedViolation> {
    let one = &scene.flights[k];
    let mut found = Vec::new();
    // By drone and then by time: see `encounters`.
    let after = near.partition_point(|encounter| encounter.other <= k);
    for same in near[after..].chunk_by(|a, b| a.other == b.other) {
        let other = &scene.flights[same[0].other];
        let (mine, theirs) = (&one.trajectory, &other.trajectory);
        let sum_m = one.body_radius_m + other.body_radius_m;
        let mut parts = Vec::new();
        let mut worst = (0.0, f64::INFINITY);
        for &Encounter { span_s, .. } in same {
            for piece in &mine.pieces()[mine.pieces_during(span_s.0, span_s.1)] {
                let from_s = piece.motion.from_s.max(span_s.0);
                let until_s = piece.motion.until_s.min(span_s.1);
                let here = piece.motion.during(from_s, until_s);
                let there = &theirs.pieces()[theirs.pieces_during(from_s, until_s)];
                for relative in there.iter().filter_map(|it| it.motion.seen_from(&here)) {
                    let (low_m, high_m) = relative.box_m(relative.from_s, relative.until_s);
                    if low_m.sup(&-high_m).max() >= sum_m {
                        continue;
                    }
                    let (t_s, distance_m) = relative.nearest_to_origin();
                    if distance_m < worst.1 {
                        worst = (t_s, distance_m);
                    }
                    if let Some(span_s) = relative.inside_ball_s(sum_m - TOUCH_M) {
                        join(&mut parts, span_s);
                    }
                }
            }
        }
        for span_s in parts {
            let worst = Worst {
                with: Some(other.name.clone()),
                position_m: one.position_m(worst.0),
                value: worst.1 - sum_m,
                limit: 0.0,
            };
            found.push(scene.violation(one, ViolationKind::Collision, span_s, worst));
        }
    }
    found
}
