//! Drones whose bodies touch very many others at one moment.
//!
//! The cost of judging pairs grows with the square of such a crowd, and no single drone can resolve
//! it. Of each drone a few pairs are judged, the others of that moment are counted, and the crowd
//! is left out of all other checks of pairs and of zones; the report gives its size.

use nalgebra::Point3;
use rayon::prelude::*;

use super::checks::collision;
use super::checks::obstacle::TOUCH_M;
use super::scene::Scene;
use super::time::encounters::{Encounter, slabs};
use super::violation::IndexedViolation;
use super::{CROWD, by_itself};

/// Pairs judged of a crowd, and the least per drone, with drones after it, even if that makes more:
/// chosen here, some megabytes, and enough to see what is wrong.
const PAIRS: usize = 8192;
const LEAST_PAIRS: usize = 4;

/// What is known of the crowds of a plan.
#[derive(Debug, Default)]
pub(super) struct Crowds {
    /// Violations by their drones.
    pub(super) found: Vec<IndexedViolation>,
    /// How many more pairs touched at the moments at which they were found.
    pub(super) omitted: usize,
    /// How many drones are in one.
    pub(super) drones: usize,
}

/// Removes from a scene the drones that touch very many others at the beginning of a slab of time,
/// each judged by itself and with a few of those.
pub(super) fn set_aside(scene: &mut Scene<'_>) -> Crowds {
    let mut crowds = Crowds::default();
    let flights = scene.flights.len();
    if flights <= CROWD {
        return crowds;
    }
    let mut is_out = vec![false; flights];
    for (from_s, _) in slabs(scene) {
        let mut count = vec![0_usize; flights];
        each_touching(scene, &is_out, from_s, |a, b| {
            count[a] += 1;
            count[b] += 1;
        });
        let out: Vec<usize> = (0..flights).filter(|k| count[*k] > CROWD).collect();
        if out.is_empty() {
            continue;
        }
        let most = (PAIRS / out.len()).clamp(LEAST_PAIRS, CROWD);
        let mut after: Vec<Vec<usize>> = vec![Vec::new(); flights];
        each_touching(scene, &is_out, from_s, |a, b| {
            let is_crowd = |k: usize| count[k] > CROWD;
            if is_crowd(a) && after[a].len() < most {
                after[a].push(b);
            } else if is_crowd(a) || is_crowd(b) {
                crowds.omitted += 1;
            }
        });
        after.iter_mut().for_each(|it| it.sort_unstable());
        let judged = out.par_iter().flat_map_iter(|&k| {
            let near = after[k].iter().map(|&other| Encounter {
                other,
                span_s: (f64::NEG_INFINITY, scene.horizon_s),
            });
            let near: Vec<Encounter> = near.collect();
            let mut found = by_itself(scene, &scene.flights[k]);
            found.extend(collision::check(scene, &near, k));
            found
        });
        crowds.found.par_extend(judged);
        out.iter().for_each(|k| is_out[*k] = true);
    }
    crowds.drones = is_out.iter().filter(|is_out| **is_out).count();
    let mut is_out = is_out.into_iter();
    scene.flights.retain(|_| !is_out.next().unwrap_or(false));
    crowds
}

/// Calls `touch` for each two remaining drones whose bodies touch at a moment (s), the earlier in
/// the plan first.
fn each_touching(
    scene: &Scene<'_>,
    is_out: &[bool],
    at_s: f64,
    mut touch: impl FnMut(usize, usize),
) {
    let there = scene.flights.iter().enumerate().filter_map(|(k, flight)| {
        let place_m = flight.trajectory.position_m(at_s)?;
        (!is_out[k]).then_some((k, place_m, flight.body_radius_m))
    });
    let mut by_x: Vec<(usize, Point3<f64>, f64)> = there.collect();
    by_x.sort_by(|a, b| a.1.x.total_cmp(&b.1.x));
    let largest_m = by_x.iter().map(|it| it.2).fold(0.0, f64::max);
    for (n, one) in by_x.iter().enumerate() {
        let until_m = one.1.x + one.2 + largest_m;
        let beside = by_x[n + 1..].iter();
        for other in beside.take_while(|it| it.1.x <= until_m) {
            let sum_m = one.2 + other.2 - TOUCH_M;
            if (one.1 - other.1).norm_squared() < sum_m * sum_m {
                touch(one.0.min(other.0), one.0.max(other.0));
            }
        }
    }
}
