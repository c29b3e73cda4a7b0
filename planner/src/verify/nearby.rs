//! Who can touch or blow on whom, and when: cells of the level plane, in slabs of time.

use std::sync::Arc;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::flight::{Flight, Scene, level_gap_m};
use super::wake_bound::BoundedWake;

/// Length of a slab of time (s), chosen here: at 2 m/s a drone moves by about the reach of a wake in it.
const SLAB_S: f64 = 1.0;
/// No more slabs than this, chosen here: what takes longer than an hour is cut into longer slabs.
const MOST_SLABS: usize = 4096;

/// Cells are no narrower than this (m), chosen here: where neither bodies nor wakes reach far, more cells would not help.
const LEAST_CELL_M: f64 = 1.0;
/// A flight in more cells than this is held against everybody, chosen here: it crosses a hall within one slab.
const MOST_CELLS: i64 = 256;
/// Cells farther out than this are one (cells from the origin), chosen here: indices stay small whatever a plan says.
const FARTHEST_CELL: f64 = 1e6;

/// Another drone near this one for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Near {
    /// Index in the scene's flights.
    pub(super) other: usize,
    /// s.
    pub(super) from_s: f64,
    /// s.
    pub(super) until_s: f64,
}

/// For every flight, the others near it, by drone and then by time.
pub(super) fn encounters(scene: &Scene<'_>) -> Vec<Vec<Near>> {
    let slabs = ((scene.last_s / SLAB_S).ceil() as usize).clamp(1, MOST_SLABS);
    let slab_s = scene.last_s / slabs as f64;
    let mut spans: Vec<(f64, f64)> = (0..slabs)
        .map(|k| (k as f64 * slab_s, (k + 1) as f64 * slab_s))
        .filter(|(a, b)| b > a)
        .collect();
    if let Some(last) = spans.last_mut() {
        last.1 = scene.last_s;
    }
    spans.push((scene.last_s, scene.horizon_s));
    let reach = Reach::new(scene);
    let pairs: Vec<Vec<(u32, u32)>> = spans
        .par_iter()
        // Air that comes late comes from where its drone was.
        .map(|&(from_s, until_s)| (from_s - scene.longest_lag_s, until_s))
        .map(|span_s| pairs_during(&scene.flights, span_s, &reach))
        .collect();

    let mut near: Vec<Vec<Near>> = vec![Vec::new(); scene.flights.len()];
    for (&(from_s, until_s), pairs) in spans.iter().zip(pairs) {
        for (a, b) in pairs {
            for (one, other) in [(a, b), (b, a)] {
                near[one as usize].push(Near {
                    other: other as usize,
                    from_s,
                    until_s,
                });
            }
        }
    }
    near.par_iter_mut().for_each(join);
    near
}

/// Sorts encounters by drone and then by time; those that follow on one another become one.
fn join(near: &mut Vec<Near>) {
    near.sort_by(|a, b| a.other.cmp(&b.other).then(a.from_s.total_cmp(&b.from_s)));
    near.dedup_by(|next, known| {
        let follows = next.other == known.other && known.until_s >= next.from_s;
        if follows {
            known.until_s = next.until_s;
        }
        follows
    });
}

/// How far the air of each flight reaches.
struct Reach {
    /// Different wakes of each flight.
    wakes: Vec<Vec<Arc<BoundedWake>>>,
    /// Greatest reach down to the floor (m).
    greatest_m: Vec<f64>,
    /// Two flights farther apart than this do not meet (m).
    farthest_m: f64,
}

impl Reach {
    fn new(scene: &Scene<'_>) -> Reach {
        let deepest_m = scene.bounds_m.max.z - scene.bounds_m.min.z;
        let wakes: Vec<_> = scene.flights.iter().map(Flight::different_wakes).collect();
        let greatest_m: Vec<f64> = wakes.iter().map(|each| reach_m(each, deepest_m)).collect();
        let own = |(flight, reach_m): (&Flight, &f64)| {
            (reach_m + 2.0 * flight.tip_radius_m).max(2.0 * flight.body_radius_m)
        };
        let own_m = scene.flights.iter().zip(&greatest_m).map(own);
        let tips_m = scene.flights.iter().map(|flight| flight.tip_radius_m);
        Reach {
            farthest_m: own_m.fold(0.0, f64::max) + tips_m.fold(0.0, f64::max),
            greatest_m,
            wakes,
        }
    }

    /// Greatest distance at which the wake of a flight can matter down to a depth (m), over all its masses.
    fn down_to_m(&self, flight: usize, depth_m: f64) -> f64 {
        reach_m(&self.wakes[flight], depth_m).min(self.greatest_m[flight])
    }
}

fn reach_m(wakes: &[Arc<BoundedWake>], depth_m: f64) -> f64 {
    wakes
        .iter()
        .map(|wake| wake.reach_m(depth_m))
        .fold(0.0, f64::max)
}

/// Lowest and highest corner (m).
type Places = (Vector3<f64>, Vector3<f64>);

/// Pairs near one another in one slab, the lower index first, in order.
///
/// By square cells of the level plane, as wide as two flights may be apart: a flight is listed in every cell that its box touches, widened
/// by half of that, and a pair is looked at in the first cell that both are in. Flights in too many cells are held against everybody.
fn pairs_during(flights: &[Flight], span_s: (f64, f64), reach: &Reach) -> Vec<(u32, u32)> {
    let boxes: Vec<Option<Places>> = (flights.iter())
        .map(|flight| flight.trajectory.box_m(span_s.0, span_s.1))
        .collect();
    let cells = Cells {
        side_m: reach.farthest_m.max(LEAST_CELL_M),
    };
    let (mut listed, mut wide) = (Vec::with_capacity(4 * flights.len()), Vec::new());
    let mut pairs = Vec::new();
    let mut look_at = |a: u32, b: u32| {
        let (one, two) = (&boxes[a as usize], &boxes[b as usize]);
        let both = one.as_ref().zip(two.as_ref());
        if both.is_some_and(|both| meet(flights, (a as usize, b as usize), both, reach)) {
            pairs.push((a.min(b), a.max(b)));
        }
    };
    for (k, places_m) in (0_u32..).zip(&boxes) {
        let Some((from, until)) = places_m.as_ref().map(|places_m| cells.around(places_m)) else {
            continue;
        };
        if (until[0] - from[0] + 1) * (until[1] - from[1] + 1) > MOST_CELLS {
            wide.push(k);
            continue;
        }
        for x in from[0]..=until[0] {
            listed.extend((from[1]..=until[1]).map(|y| ([x, y], k, from)));
        }
    }
    listed.sort_unstable();
    for together in listed.chunk_by(|a, b| a.0 == b.0) {
        for (n, &(at, a, from_a)) in together.iter().enumerate() {
            for &(_, b, from_b) in &together[n + 1..] {
                if at == [from_a[0].max(from_b[0]), from_a[1].max(from_b[1])] {
                    look_at(a, b);
                }
            }
        }
    }
    for (n, &a) in wide.iter().enumerate() {
        let others = (0..flights.len() as u32).filter(|other| !wide[..=n].contains(other));
        others.for_each(|b| look_at(a, b));
    }
    pairs.sort_unstable();
    pairs
}

/// Square cells of the level plane.
struct Cells {
    side_m: f64,
}

impl Cells {
    /// First and last cell, along x and along y, that a box touches which is widened by half a cell.
    fn around(&self, (low_m, high_m): &Places) -> ([i64; 2], [i64; 2]) {
        let cell = |x_m: f64| {
            let cell = (x_m / self.side_m).floor();
            cell.clamp(-FARTHEST_CELL, FARTHEST_CELL) as i64
        };
        let half_m = 0.5 * self.side_m;
        (
            [cell(low_m.x - half_m), cell(low_m.y - half_m)],
            [cell(high_m.x + half_m), cell(high_m.y + half_m)],
        )
    }
}

/// Whether two flights may touch or blow on one another from somewhere in their boxes.
fn meet(
    flights: &[Flight],
    (a, b): (usize, usize),
    (places_a, places_b): (&Places, &Places),
    reach: &Reach,
) -> bool {
    let gap_m = level_gap_m(places_a, places_b);
    if gap_m > reach.farthest_m {
        return false;
    }
    let blows = |from: usize, on: &Flight, above: f64, below: f64| {
        above > below && gap_m <= reach.down_to_m(from, above - below) + on.tip_radius_m
    };
    gap_m <= flights[a].body_radius_m + flights[b].body_radius_m
        || blows(a, &flights[b], places_a.1.z, places_b.0.z)
        || blows(b, &flights[a], places_b.1.z, places_a.0.z)
}
