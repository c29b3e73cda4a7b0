//! Who can touch or blow on whom, and when: sweep and prune along x, in slabs of time.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::flight::{Flight, Scene, level_gap_m};

/// Length of a slab of time (s), chosen here: at 2 m/s a drone moves by about the reach of a wake in it.
const SLAB_S: f64 = 1.0;
/// No more slabs than this, chosen here: what takes longer than an hour is cut into longer slabs.
const MOST_SLABS: usize = 4096;

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
    let deepest_m = scene.bounds_m.max.z - scene.bounds_m.min.z;
    let reaches: Vec<f64> = scene
        .flights
        .iter()
        .map(|flight| flight.reach_m(deepest_m))
        .collect();
    let farthest = scene
        .flights
        .iter()
        .zip(&reaches)
        .map(|(flight, reach)| (reach + 2.0 * flight.tip_radius_m).max(2.0 * flight.body_radius_m))
        .fold(0.0, f64::max)
        + scene
            .flights
            .iter()
            .map(|flight| flight.tip_radius_m)
            .fold(0.0, f64::max);
    let pairs: Vec<Vec<(usize, usize)>> = spans
        .par_iter()
        // Air that comes late comes from where its drone was.
        .map(|&(from_s, until_s)| (from_s - scene.longest_lag_s, until_s))
        .map(|span_s| pairs_during(&scene.flights, span_s, farthest, &reaches))
        .collect();

    let mut near: Vec<Vec<Near>> = vec![Vec::new(); scene.flights.len()];
    let mut all: Vec<(usize, usize, usize)> = pairs
        .iter()
        .enumerate()
        .flat_map(|(k, pairs)| pairs.iter().map(move |&(a, b)| (a, b, k)))
        .collect();
    all.sort_unstable();
    for (a, b, slab) in all {
        let (from_s, until_s) = spans[slab];
        for (one, other) in [(a, b), (b, a)] {
            match near[one]
                .iter_mut()
                .rev()
                .find(|known| known.other == other)
            {
                Some(known) if known.until_s >= from_s => known.until_s = until_s,
                _ => near[one].push(Near {
                    other,
                    from_s,
                    until_s,
                }),
            }
        }
    }
    near
}

/// Lowest and highest corner (m).
type Places = (Vector3<f64>, Vector3<f64>);

/// Pairs near one another in one slab, by index.
fn pairs_during(
    flights: &[Flight],
    span_s: (f64, f64),
    farthest_m: f64,
    reaches_m: &[f64],
) -> Vec<(usize, usize)> {
    let mut boxes: Vec<(usize, Places)> = flights
        .iter()
        .enumerate()
        .filter_map(|(k, flight)| {
            flight
                .trajectory
                .box_m(span_s.0, span_s.1)
                .map(|places_m| (k, places_m))
        })
        .collect();
    boxes.sort_by(|a, b| a.1.0.x.total_cmp(&b.1.0.x).then(a.0.cmp(&b.0)));
    let mut pairs = Vec::new();
    for (k, (a, places_a)) in boxes.iter().enumerate() {
        for (b, places_b) in boxes[k + 1..]
            .iter()
            .take_while(|(_, other)| other.0.x <= places_a.1.x + farthest_m)
        {
            let gap_m = level_gap_m(places_a, places_b);
            if gap_m > farthest_m {
                continue;
            }
            let (one, two) = (&flights[*a], &flights[*b]);
            let bodies = gap_m <= one.body_radius_m + two.body_radius_m;
            let blows = |from: usize, on: &Flight, above: f64, below: f64| {
                above > below
                    && gap_m
                        <= reaches_m[from].min(flights[from].reach_m(above - below))
                            + on.tip_radius_m
            };
            if bodies
                || blows(*a, two, places_a.1.z, places_b.0.z)
                || blows(*b, one, places_b.1.z, places_a.0.z)
            {
                pairs.push((*a.min(b), *a.max(b)));
            }
        }
    }
    pairs.sort_unstable();
    pairs
}
