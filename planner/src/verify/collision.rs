//! Two bodies: relative motion of two straight pieces, in closed form.

use super::Found;
use super::clock::join;
use super::flight::Scene;
use super::nearby::Near;
use super::obstacle::TOUCH_M;
use crate::plan::{Violation, ViolationKind};

/// Collisions of one flight with those after it, and the smallest gap between their bodies (m).
pub(super) fn check(scene: &Scene<'_>, near: &[Near], k: usize) -> (Vec<Found>, Option<f64>) {
    let one = &scene.flights[k];
    let mut found = Vec::new();
    let mut smallest_m: Option<f64> = None;
    // By drone and then by time: see `nearby`.
    let after = near.partition_point(|encounter| encounter.other <= k);
    for same in near[after..].chunk_by(|a, b| a.other == b.other) {
        let other = &scene.flights[same[0].other];
        let sum_m = one.body_radius_m + other.body_radius_m;
        let mut parts = Vec::new();
        let mut worst = (0.0, f64::INFINITY);
        for encounter in same {
            for piece in &one.trajectory.pieces()[one
                .trajectory
                .pieces_during(encounter.from_s, encounter.until_s)]
            {
                let (from_s, until_s) = (
                    piece.motion.from_s.max(encounter.from_s),
                    piece.motion.until_s.min(encounter.until_s),
                );
                let mine = piece.motion.during(from_s, until_s);
                for theirs in
                    &other.trajectory.pieces()[other.trajectory.pieces_during(from_s, until_s)]
                {
                    let Some(relative) = theirs.motion.seen_from(&mine) else {
                        continue;
                    };
                    let (t_s, distance_m) = relative.nearest_to_origin();
                    smallest_m = Some(
                        smallest_m
                            .map_or(distance_m - sum_m, |known| known.min(distance_m - sum_m)),
                    );
                    if distance_m < worst.1 {
                        worst = (t_s, distance_m);
                    }
                    for span_s in relative.inside_ball_s(sum_m - TOUCH_M) {
                        join(&mut parts, span_s);
                    }
                }
            }
        }
        for (from_s, until_s) in parts {
            found.push((
                one.index,
                Violation {
                    kind: ViolationKind::Collision,
                    drone: one.name.clone(),
                    with: Some(other.name.clone()),
                    from_s,
                    until_s: scene.until(until_s),
                    position_m: one
                        .trajectory
                        .position_m(worst.0)
                        .unwrap_or_else(|| one.trajectory.last_m()),
                    value: worst.1 - sum_m,
                    limit: 0.0,
                    unit: "m".to_owned(),
                },
            ));
        }
    }
    (found, smallest_m)
}
