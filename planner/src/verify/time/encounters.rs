//! The pairs of drones that can touch, or reach one another with their wakes, and when: slabs of
//! time, swept along x.
//!
//! Two drones are near one another in a slab if the boxes of their motions in it are: level
//! distance against the sum of body radii, and against the reach of either wake down to the other
//! and its rotor tips. No check of pairs looks at drones that are not near; a reach errs outwards.

use std::sync::Arc;

use rayon::prelude::*;

use crate::plan::trajectory::Piece;
use crate::verify::bounds::wake::BoundedWake;
use crate::verify::extents::{Places, Span};
use crate::verify::scene::{Flight, Scene, level_gap_m};

/// Length of a slab of time (s), chosen here: at 2 m/s a drone moves by about the reach of a wake
/// in it.
const SLAB_S: f64 = 1.0;
/// No more slabs than this, chosen here: what takes longer than an hour is cut into longer slabs.
const MOST_SLABS: usize = 4096;

/// Another drone near this one for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Encounter {
    /// Index in the scene's flights.
    pub(crate) other: usize,
    /// From, until (s).
    pub(crate) span_s: Span,
}

/// For every flight, the others near it, by drone and then by time; both clocks may differ by up to
/// `apart_s` (s), and the time is the flight's own.
pub(crate) fn encounters(scene: &Scene<'_>, apart_s: f64) -> Vec<Vec<Encounter>> {
    encounters_of(scene, apart_s, f64::NEG_INFINITY, &|_| true)
}

/// Encounters of pairs of which at least one flight is asked for, but for those that are over
/// before a time (s) by every clock; those that begin before may begin later here.
pub(crate) fn encounters_of(
    scene: &Scene<'_>,
    apart_s: f64,
    since_s: f64,
    is_asked: &(dyn Fn(usize) -> bool + Sync),
) -> Vec<Vec<Encounter>> {
    let mut spans_s = slabs(scene);
    spans_s.retain(|(_, until_s)| until_s + apart_s >= since_s);
    let reach = Reach::new(scene);
    let asked: Vec<bool> = (0..scene.flights.len()).map(is_asked).collect();
    let mut near: Vec<Vec<Encounter>> = vec![Vec::new(); scene.flights.len()];
    if !asked.contains(&true) {
        return near;
    }
    let mut meet = |((a, b), from_s): OpenEncounter, until_s: f64| {
        let span_s = (from_s, until_s);
        let [a, b] = [a, b].map(|it| it as usize);
        near[a].push(Encounter { other: b, span_s });
        near[b].push(Encounter { other: a, span_s });
    };
    let mut open: Vec<OpenEncounter> = Vec::new();
    for spans_s in spans_s.chunks(SLABS_AT_A_TIME) {
        let pairs: Vec<Vec<(u32, u32)>> = (spans_s.par_iter())
            .map(|&(from_s, until_s)| {
                let apart = (from_s - apart_s, until_s + apart_s);
                // Advected air comes from where its drone was.
                let since_s = apart.0 - scene.longest_lag_s;
                let since = (since_s, apart.1);
                let mut pairs = pairs_during(&scene.flights, &asked, since, &reach);
                if scene.longest_lag_s > 0.0 && !pairs.is_empty() {
                    let slab = Slab::new(scene, apart, &pairs);
                    pairs.retain(|pair| meet_advected(scene, *pair, &slab, &reach));
                }
                pairs
            })
            .collect();
        for (&(from_s, _), pairs) in spans_s.iter().zip(pairs) {
            let mut known = open.into_iter().peekable();
            open = Vec::with_capacity(pairs.len());
            for pair in pairs {
                while let Some(over) = known.next_if(|(it, _)| *it < pair) {
                    meet(over, from_s);
                }
                let goes_on = known.next_if(|(it, _)| *it == pair);
                open.push(goes_on.unwrap_or((pair, from_s)));
            }
            known.for_each(|over| meet(over, from_s));
        }
    }
    open.into_iter()
        .for_each(|over| meet(over, scene.horizon_s));
    // In order of time as they are.
    (near.par_iter_mut()).for_each(|near| near.sort_by_key(|encounter| encounter.other));
    near
}

/// The slabs of time, from the first moment to the last. Until the first drone moves it is one: a
/// plan may go on long after it began, with what was flown before forgotten.
pub(in crate::verify) fn slabs(scene: &Scene<'_>) -> Vec<Span> {
    let last_s = scene.last_s;
    let pieces = || scene.flights.iter().map(|it| it.trajectory.pieces());
    let first = pieces().filter_map(|it| it.first());
    let begins_s = first.map(|it| it.motion.from_s).fold(last_s, f64::min);
    let moves = |it: &&Piece| it.motion.half_path_m(it.motion.from_s, it.motion.until_s) > 0.0;
    let moving = pieces().filter_map(|it| it.iter().find(moves));
    let moves_s = moving.map(|it| it.motion.from_s).fold(last_s, f64::min);
    let since_s = moves_s.floor().max(0.0).min(last_s);
    let slabs = (((last_s - since_s) / SLAB_S).ceil() as usize).clamp(1, MOST_SLABS);
    let slab_s = (last_s - since_s) / slabs as f64;
    let at_s = |k: usize| match k == slabs {
        true => last_s,
        false => since_s + k as f64 * slab_s,
    };
    let still = (begins_s, since_s);
    let moving = (0..slabs).map(|k| (at_s(k), at_s(k + 1)));
    let spans_s = std::iter::once(still).chain(moving);
    let mut spans_s: Vec<Span> = spans_s.filter(|(a, b)| b > a).collect();
    spans_s.push((last_s, scene.horizon_s));
    // A drone that leaves at once may still be there if it is late.
    spans_s[0].0 = begins_s.min(spans_s[0].0);
    spans_s
}

/// Slabs whose pairs are held at a time: chosen here, so that thousands of drones at one place take
/// megabytes, however long they are there.
const SLABS_AT_A_TIME: usize = 8;

/// A pair that is near since a time (s).
type OpenEncounter = ((u32, u32), f64);

/// How far the air of each flight reaches: beyond, it is too faint to count, at any of its masses.
struct Reach {
    /// Different wakes of each flight.
    wakes: Vec<Vec<Arc<BoundedWake>>>,
    /// Beyond both bodies, how far each may be off its path (m).
    tracking_m: f64,
    /// Two flights farther apart than this do not meet (m).
    farthest_m: f64,
}

impl Reach {
    /// The different wakes of every flight, and how far any of them matters.
    fn new(scene: &Scene<'_>) -> Reach {
        let mut reach = Reach {
            wakes: scene.flights.iter().map(Flight::different_wakes).collect(),
            tracking_m: 2.0 * scene.margins.tracking_m,
            farthest_m: 0.0,
        };
        let deepest_m = scene.bounds_m.max.z - scene.bounds_m.min.z;
        let own_m = scene.flights.iter().enumerate().map(|(k, flight)| {
            let air_m = reach.down_to_m(k, deepest_m) + 2.0 * flight.tip_radius_m;
            air_m.max(2.0 * flight.body_radius_m + reach.tracking_m)
        });
        let tips_m = scene.flights.iter().map(|flight| flight.tip_radius_m);
        reach.farthest_m = own_m.fold(0.0, f64::max) + tips_m.fold(0.0, f64::max);
        reach
    }

    /// Greatest distance at which the wake of a flight can matter down to a depth (m), over all its
    /// masses.
    fn down_to_m(&self, flight: usize, depth_m: f64) -> f64 {
        let wakes = self.wakes[flight].iter();
        wakes.map(|wake| wake.reach_m(depth_m)).fold(0.0, f64::max)
    }
}

/// Pairs near one another in one slab, of which at least one is asked for, in order, the lower
/// index first.
fn pairs_during(
    flights: &[Flight],
    asked: &[bool],
    span_s: Span,
    reach: &Reach,
) -> Vec<(u32, u32)> {
    let boxes = flights.iter().enumerate().filter_map(|(k, flight)| {
        let places_m = flight.trajectory.box_m(span_s.0, span_s.1)?;
        Some((k, places_m))
    });
    let mut by_x: Vec<(usize, Places)> = boxes.collect();
    by_x.sort_by(|a, b| a.1.0.x.total_cmp(&b.1.0.x));
    let mut pairs = Vec::new();
    for (n, one) in by_x.iter().enumerate() {
        let until_m = one.1.1.x + reach.farthest_m;
        let beside = by_x[n + 1..].iter().take_while(|two| two.1.0.x <= until_m);
        let met = beside
            .filter(|two| asked[one.0] || asked[two.0])
            .filter(|two| meet(flights, one, two, reach));
        pairs.extend(met.map(|two| (one.0.min(two.0) as u32, one.0.max(two.0) as u32)));
    }
    pairs.sort_unstable();
    pairs
}

/// Where the flights of some pairs are in a span of time.
struct Slab {
    /// From, until (s).
    span_s: Span,
    /// Of each flight the places in it (m).
    there_m: Vec<Option<Places>>,
    /// Of each flight its highest place in it or since the longest delay of all air before (m).
    top_m: Vec<Option<f64>>,
}

impl Slab {
    fn new(scene: &Scene<'_>, span_s: Span, pairs: &[(u32, u32)]) -> Slab {
        let (from_s, until_s) = span_s;
        let since_s = from_s - scene.longest_lag_s;
        let mut is_near = vec![false; scene.flights.len()];
        for &(a, b) in pairs {
            is_near[a as usize] = true;
            is_near[b as usize] = true;
        }
        let box_m = |from_s: f64| -> Vec<Option<Places>> {
            let flights = scene.flights.iter().zip(&is_near);
            let of_one = |(flight, near): (&Flight, &bool)| {
                let places_m = near.then(|| flight.trajectory.box_m(from_s, until_s));
                places_m.flatten()
            };
            flights.map(of_one).collect()
        };
        let since_m = box_m(since_s).into_iter();
        Slab {
            span_s,
            there_m: box_m(from_s),
            top_m: since_m.map(|it| it.map(|it| it.1.z)).collect(),
        }
    }
}

/// Whether two flights may touch in a span of time, or air that left no longer ago than its delay
/// down to the other may reach it.
fn meet_advected(scene: &Scene<'_>, (a, b): (u32, u32), slab: &Slab, reach: &Reach) -> bool {
    let flights = &scene.flights;
    let [a, b] = [a, b].map(|it| it as usize);
    let (from_s, until_s) = slab.span_s;
    let place = |k: usize, late_s: f64| {
        let places_m = flights[k].trajectory.box_m(from_s - late_s, until_s);
        places_m.map(|it| (k, it))
    };
    let longest_lag = scene.lags().1;
    let reaches = |from: usize, to: usize| {
        let (Some(top_m), Some(there_m)) = (slab.top_m[from], slab.there_m[to]) else {
            return false;
        };
        let below = (to, there_m);
        let depth_m = top_m - below.1.0.z;
        let lags_s = reach.wakes[from].iter().map(|wake| {
            let far = wake.wake.far_field();
            longest_lag * far.transport_time_s(depth_m, 1.0)
        });
        let above = place(from, lags_s.fold(0.0, f64::max));
        above.is_some_and(|above| meet(flights, &above, &below, reach))
    };
    reaches(a, b) || reaches(b, a)
}

/// Whether two flights may touch, or reach one another with their wakes, from somewhere in their
/// boxes.
fn meet(
    flights: &[Flight],
    (a, places_a): &(usize, Places),
    (b, places_b): &(usize, Places),
    reach: &Reach,
) -> bool {
    let gap_m = level_gap_m(places_a, places_b);
    if gap_m > reach.farthest_m {
        return false;
    }
    let reaches = |from: usize, to: usize, above_m: f64, below_m: f64| {
        let far_m = || reach.down_to_m(from, above_m - below_m) + flights[to].tip_radius_m;
        above_m > below_m && gap_m <= far_m()
    };
    gap_m <= flights[*a].body_radius_m + flights[*b].body_radius_m + reach.tracking_m
        || reaches(*a, *b, places_a.1.z, places_b.0.z)
        || reaches(*b, *a, places_b.1.z, places_a.0.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verify::checks::contents;

    #[test]
    fn a_plan_that_begins_late_has_no_more_slabs_than_it_flies() {
        let text = r#"{"format": "plan/2", "scenario": "one", "bounds_m": {"min": [0, 0, 0], "max": [20, 8, 8]},
            "drones": [
            {"name": "wreck", "airframe": "kolibri", "enters_s": 70, "at_start": "landed", "at_end": "land", "airborne_s": [70, 70],
            "trajectory": {"t_s": [70], "position_m": [[1, 4, 0.1]]}},
            {"name": "a", "airframe": "kolibri", "enters_s": 5000.5,
            "trajectory": {"t_s": [5000.5, 5020, 5030], "position_m": [[1, 2, 5], [1, 2, 5], [9, 2, 5]]}}]}"#;
        let plan = crate::plan::file::read(text).expect("a plan").plan;
        let (scene, found) = contents::read(&plan);
        let scene = scene.unwrap_or_else(|| panic!("{found:?}"));
        let slabs = slabs(&scene);
        assert_eq!(slabs[0], (70.0, 5020.0));
        assert_eq!(slabs.len(), 12);
        assert!(slabs.windows(2).all(|it| it[0].1 == it[1].0));
        assert_eq!(slabs[11].0, 5030.0);
    }
}
