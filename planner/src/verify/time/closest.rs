//! The two bodies that come nearest to one another, of all pairs of which at least one flies:
//! drones that stand side by side on the ground do not approach.
//!
//! In each slab of time the drones are compared whose boxes are within a distance of one another.
//! If none are that near in any slab, the distance grows.

use rayon::prelude::*;

use super::encounters::slabs;
use crate::verify::extents::{Places, Span};
use crate::verify::scene::{Part, Scene};

/// Gap within which bodies are looked for first (m): chosen here, dense fleets come nearer.
const WITHIN_M: f64 = 1.0;
/// How much wider next: chosen here.
const WIDER: f64 = 4.0;

/// Two bodies where they are nearest.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(crate) struct Nearest {
    /// Between the balls (m); negative: they overlap.
    pub(crate) gap_m: f64,
    /// Indices in the scene's flights, the lower first.
    pub(crate) flights: [usize; 2],
    /// When, first of all (s).
    pub(crate) at_s: f64,
}

/// The nearest of all; `None`: no drone flies while another is there.
pub(crate) fn closest(scene: &Scene<'_>) -> Option<Nearest> {
    let spans_s = slabs(scene);
    let whole_s = (spans_s.first()?.0, spans_s.last()?.1);
    let boxes = scene.flights.iter();
    let boxes = boxes.filter_map(|it| it.trajectory.box_m(whole_s.0, whole_s.1));
    let all_m = boxes.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))?;
    let farthest_m = (all_m.1 - all_m.0).norm();
    let mut within_m = WITHIN_M;
    loop {
        let found: Vec<Option<Nearest>> = (spans_s.par_iter())
            .map(|span_s| during(scene, *span_s, within_m))
            .collect();
        let nearest = found.into_iter().flatten().reduce(nearer);
        if nearest.is_some() || within_m > farthest_m {
            return nearest;
        }
        within_m *= WIDER;
    }
}

/// The nearer of two; of equals the first drones, then the earlier moment.
fn nearer(a: Nearest, b: Nearest) -> Nearest {
    if b < a { b } else { a }
}

/// A flight in one slab.
struct Body {
    flight: usize,
    places_m: Places,
    radius_m: f64,
    flies: bool,
}

/// The nearest two of a slab whose gap is at most so wide (m).
fn during(scene: &Scene<'_>, span_s: Span, within_m: f64) -> Option<Nearest> {
    let bodies = scene.flights.iter().enumerate().filter_map(|(flight, it)| {
        Some(Body {
            flight,
            places_m: it.trajectory.box_m(span_s.0, span_s.1)?,
            radius_m: it.body_radius_m,
            flies: it.airborne_s.0 < span_s.1 && span_s.0 < it.airborne_s.1,
        })
    });
    let mut by_x: Vec<Body> = bodies.collect();
    by_x.sort_by(|a, b| a.places_m.0.x.total_cmp(&b.places_m.0.x));
    let largest = |of: fn(&Body) -> f64| by_x.iter().map(of).fold(0.0, f64::max);
    let widest_m = largest(|it| it.places_m.1.x - it.places_m.0.x);
    let radius_m = largest(|it| it.radius_m);
    let mut nearest: Option<Nearest> = None;
    for one in by_x.iter().filter(|it| it.flies) {
        let reach_m = within_m + one.radius_m + radius_m;
        // No two are nearer than at one place.
        let is_least = |it: Nearest| it.gap_m <= -one.radius_m - radius_m;
        if nearest.is_some_and(is_least) {
            continue;
        }
        let (from_m, until_m) = (
            one.places_m.0.x - reach_m - widest_m,
            one.places_m.1.x + reach_m,
        );
        let first = by_x.partition_point(|it| it.places_m.0.x < from_m);
        let beside = by_x[first..]
            .iter()
            .take_while(|it| it.places_m.0.x <= until_m);
        for other in beside {
            let (a, b) = (&one.places_m, &other.places_m);
            let apart_m = (a.0 - b.1).sup(&(b.0 - a.1)).map(|it| it.max(0.0)).norm();
            let most_m = nearest.map_or(within_m, |it| it.gap_m);
            // Two flying drones are paired once.
            let is_seen = other.flight == one.flight || other.flies && other.flight < one.flight;
            let least_m = apart_m - one.radius_m - other.radius_m;
            if !is_seen && (least_m < most_m || nearest.is_none() && least_m == most_m) {
                let flights = [one.flight.min(other.flight), one.flight.max(other.flight)];
                let found = of_pair(scene, flights, span_s, most_m);
                nearest = nearest.into_iter().chain(found).reduce(nearer);
            }
        }
    }
    nearest
}

/// When two are nearest in a span of time, at least one of them flying, if their gap is at most so
/// wide (m).
fn of_pair(scene: &Scene<'_>, flights: [usize; 2], span_s: Span, most_m: f64) -> Option<Nearest> {
    let [one, other] = flights.map(|it| &scene.flights[it]);
    let bodies_m = one.body_radius_m + other.body_radius_m;
    let theirs: Vec<Part> = other.parts(span_s).collect();
    let mut nearest: Option<Nearest> = None;
    for mine in one.parts(span_s) {
        for it in theirs.iter().filter(|it| it.flies || mine.flies) {
            let Some(relative) = it.motion.seen_from(&mine.motion) else {
                continue;
            };
            let (low_m, high_m) = relative.box_m(relative.from_s, relative.until_s);
            let least_m = low_m.sup(&-high_m).map(|it| it.max(0.0)).norm();
            if least_m - bodies_m > most_m {
                continue;
            }
            let (at_s, apart_m) = relative.nearest_to_origin();
            let gap_m = apart_m - bodies_m;
            let found = Nearest {
                gap_m,
                flights,
                at_s,
            };
            nearest = Some(nearest.map_or(found, |it| nearer(it, found)));
        }
    }
    nearest.filter(|it| it.gap_m <= most_m)
}
