//! The air in a zone: all airborne wakes superposed, and the wall jets along the floor where a finding names them, highest over the box
//! and over time.
//!
//! The box and the time are divided together, always where the upper bound is highest, until no part of
//! them can exceed the limit or a place that does has been found.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::{Point3, Vector3};

pub(crate) use super::blow::{Blow, Field, Wall, high_mps, strongest};
use super::blow::{at_mps, together_mps};
use super::clock::join;
use super::flight::Scene;
use super::late::Late;
use super::{FAINTEST_WAKE_MPS, Found};
use crate::plan::trajectory::Motion;
use crate::plan::{Violation, ViolationKind, ZoneEntry};

/// A zone is violated above this part of its limit, chosen here.
const VIOLATED: f64 = 1.005;
/// What cannot exceed this part of the limit is not searched further: no point of a zone found in order
/// exceeds its limit by more.
const CLEARED: f64 = 1.0075;
/// A step of time ends when an emitter has moved by this (m), chosen here: the time of a violation is told
/// to one step.
const STEP_WAY_M: f64 = 0.1;
/// A part of box and time this small is judged by its middle (m), chosen here: a tenth of the half-width of
/// the narrowest wake known here.
const SMALLEST_M: f64 = 1e-2;
/// Parts searched in one step before the highest bound counts as found, chosen here: about a second of work.
const MOST_PARTS: usize = 500_000;
/// Parts searched once the limit is known to be broken, chosen here: the worst value told is then within a
/// few percent of the highest. Below a rotor plane, where the air begins at full speed, no more would help.
const PARTS_ONCE_VIOLATED: usize = 400;

type Places = (Vector3<f64>, Vector3<f64>);

/// The place and moment of the highest air found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Peak {
    pub(crate) air_mps: f64,
    pub(crate) t_s: f64,
    pub(crate) place_m: Point3<f64>,
}

/// The spans over the limit of a zone.
pub(super) fn check(scene: &Scene<'_>, zone: &ZoneEntry) -> Vec<Found> {
    let places_m = (zone.min_m.coords, zone.max_m.coords);
    let field = Field {
        stops: &scene.stops,
        superposition: scene.superposition,
        wall: scene.wall.map(|effect| Wall {
            effect,
            floor_z_m: scene.bounds_m.min.z,
        }),
    };
    let blows = blows(scene, &field, &places_m);
    let mut cuts_s: Vec<f64> = blows
        .iter()
        .flat_map(|blow| [blow.motion.from_s, blow.motion.until_s])
        .collect();
    cuts_s.push(scene.last_s.min(scene.horizon_s));
    cuts_s.sort_by(f64::total_cmp);
    cuts_s.dedup();

    let mut parts: Vec<(f64, f64)> = Vec::new();
    let mut worst: Vec<(Peak, usize)> = Vec::new();
    let mut by_start: Vec<usize> = (0..blows.len()).collect();
    by_start.sort_by(|&a, &b| {
        blows[a]
            .motion
            .from_s
            .total_cmp(&blows[b].motion.from_s)
            .then(a.cmp(&b))
    });
    let (mut next, mut under_way) = (0, Vec::<usize>::new());
    for span in cuts_s.windows(2) {
        let middle_s = 0.5 * (span[0] + span[1]);
        while next < by_start.len() && blows[by_start[next]].motion.from_s <= middle_s {
            under_way.push(by_start[next]);
            next += 1;
        }
        under_way.retain(|&k| blows[k].motion.until_s > middle_s);
        under_way.sort_unstable();
        let here: Vec<&Blow<'_>> = under_way.iter().map(|&k| &blows[k]).collect();
        let speed_mps = here
            .iter()
            .map(|blow| blow.max_speed_mps())
            .fold(0.0, f64::max);
        let steps = (speed_mps * (span[1] - span[0]) / STEP_WAY_M)
            .ceil()
            .max(1.0);
        let step_s = (span[1] - span[0]) / steps;
        for k in 0..steps as usize {
            let from_s = span[0] + k as f64 * step_s;
            let until_s = if k + 1 == steps as usize {
                span[1]
            } else {
                from_s + step_s
            };
            let peak = highest(
                &field,
                &here,
                &places_m,
                (from_s, until_s),
                zone.air_limit_mps - scene.draught_mps,
            );
            let Some(peak) = peak else { continue };
            let before = parts.len();
            join(&mut parts, (from_s, until_s));
            let from = strongest(&field, &here, &peak).unwrap_or_default();
            if parts.len() > before {
                worst.push((peak, from));
            } else if let Some(known) = worst.last_mut()
                && peak.air_mps > known.0.air_mps
            {
                *known = (peak, from);
            }
        }
    }
    parts
        .into_iter()
        .zip(worst)
        .map(|((from_s, until_s), (peak, from))| {
            let flight = &scene.flights[from];
            let violation = Violation {
                kind: ViolationKind::Zone,
                drone: flight.name.clone(),
                with: Some(zone.name.clone()),
                from_s,
                until_s: scene.until(until_s),
                position_m: flight
                    .trajectory
                    .position_m(peak.t_s)
                    .unwrap_or_else(|| flight.trajectory.last_m()),
                value: peak.air_mps + scene.draught_mps,
                limit: zone.air_limit_mps,
                unit: "m/s".to_owned(),
            };
            (flight.index, violation)
        })
        .collect()
}

/// Every piece of every airborne flight whose wake may be felt in the box.
fn blows<'a>(scene: &'a Scene<'_>, field: &Field<'_>, places_m: &Places) -> Vec<Blow<'a>> {
    let mut blows = Vec::new();
    for (from, flight) in scene.flights.iter().enumerate() {
        if let Some(late) = Late::new(scene, from) {
            blows.extend(lasting(scene, late, from));
            continue;
        }
        for (k, piece) in flight.trajectory.pieces().iter().enumerate() {
            let from_s = piece.motion.from_s.max(flight.airborne_s.0);
            let until_s = piece.motion.until_s.min(flight.airborne_s.1);
            if from_s >= until_s {
                continue;
            }
            let blow = Blow {
                from,
                wake: &flight.wakes[k],
                motion: piece.motion.during(from_s, until_s),
                stops: &flight.stops[k],
                late: None,
            };
            if high_mps(field, &blow, places_m, (from_s, until_s)) > FAINTEST_WAKE_MPS {
                blows.push(blow);
            }
        }
    }
    blows.retain(|blow| {
        let span_s = (blow.motion.from_s, blow.motion.until_s);
        blow.late.is_none() || high_mps(field, blow, places_m, span_s) > FAINTEST_WAKE_MPS
    });
    blows
}

/// A whole flight for as long as its air is anywhere.
fn lasting<'a>(scene: &'a Scene<'_>, late: Late<'a>, from: usize) -> Option<Blow<'a>> {
    let flight = &scene.flights[from];
    let (from_s, until_s) = late.lasts_s()?;
    let at_m = flight.trajectory.pieces().first()?.motion.at_m(from_s);
    Some(Blow {
        from,
        wake: flight.wakes.first()?,
        motion: Motion::still((from_s, until_s.min(scene.horizon_s)), at_m.into()),
        stops: &[],
        late: Some(late),
    })
}

/// A part of box and time, ordered by its upper bound.
struct Part {
    high_mps: f64,
    places_m: Places,
    span_s: (f64, f64),
    number: usize,
}

impl PartialEq for Part {
    fn eq(&self, other: &Part) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Part {}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Part) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Part {
    fn cmp(&self, other: &Part) -> Ordering {
        self.high_mps
            .total_cmp(&other.high_mps)
            .then(other.number.cmp(&self.number))
    }
}

/// The highest air over the box and the span, if it violates the limit.
pub(crate) fn highest(
    field: &Field<'_>,
    blows: &[&Blow<'_>],
    places_m: &Places,
    span_s: (f64, f64),
    limit_mps: f64,
) -> Option<Peak> {
    let bound =
        |places_m: &Places, span_s: (f64, f64)| together_mps(field, blows, places_m, span_s);
    let speed_mps = blows
        .iter()
        .map(|blow| blow.max_speed_mps())
        .fold(0.0, f64::max);
    let mut parts = BinaryHeap::new();
    let mut number = 0;
    parts.push(Part {
        high_mps: bound(places_m, span_s),
        places_m: *places_m,
        span_s,
        number,
    });
    let mut best: Option<Peak> = None;
    while let Some(part) = parts.pop() {
        let violated = best.is_some_and(|peak| peak.air_mps > VIOLATED * limit_mps);
        let enough_mps = CLEARED * best.map_or(limit_mps, |peak| peak.air_mps.max(limit_mps));
        if part.high_mps <= enough_mps || violated && number > PARTS_ONCE_VIOLATED {
            break;
        }
        let t_s = 0.5 * (part.span_s.0 + part.span_s.1);
        let place_m = Point3::from(0.5 * (part.places_m.0 + part.places_m.1));
        let given_up = number >= MOST_PARTS;
        let air_mps = if given_up {
            part.high_mps
        } else {
            at_mps(field, blows, t_s, place_m)
        };
        if best.is_none_or(|peak| air_mps > peak.air_mps) {
            best = Some(Peak {
                air_mps,
                t_s,
                place_m,
            });
        }
        if given_up {
            break;
        }
        let extent_m = part.places_m.1 - part.places_m.0;
        let way_m = speed_mps * (part.span_s.1 - part.span_s.0);
        if extent_m.max().max(way_m) <= SMALLEST_M {
            continue;
        }
        for (places_m, span_s) in halves(&part, extent_m, way_m, t_s) {
            number += 1;
            parts.push(Part {
                high_mps: bound(&places_m, span_s).min(part.high_mps),
                places_m,
                span_s,
                number,
            });
        }
    }
    best.filter(|peak| peak.air_mps > VIOLATED * limit_mps)
}

/// A part cut in two where it is longest.
fn halves(
    part: &Part,
    extent_m: Vector3<f64>,
    way_m: f64,
    middle_s: f64,
) -> [(Places, (f64, f64)); 2] {
    if way_m > extent_m.max() {
        return [
            (part.places_m, (part.span_s.0, middle_s)),
            (part.places_m, (middle_s, part.span_s.1)),
        ];
    }
    let axis = extent_m.imax();
    let middle_m = 0.5 * (part.places_m.0[axis] + part.places_m.1[axis]);
    let (mut first, mut second) = (part.places_m, part.places_m);
    first.1[axis] = middle_m;
    second.0[axis] = middle_m;
    [(first, part.span_s), (second, part.span_s)]
}
