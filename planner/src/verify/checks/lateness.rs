//! How late each drone may be, all others on time, before the verdict breaks.
//!
//! A drone that is late by `d` is at its own time `t` when all others are at `t + d`: bodies and
//! columns follow in closed form over all `d` up to the least known, the air of the drone itself
//! and of those below it by parts of time and `d` on upper bounds (`Exposed`), the air of zones by
//! halves of `d`. Bodies keep to their radii alone: how far a drone may be off its path is the
//! plan's margin, not this one.

use std::sync::OnceLock;

use rayon::prelude::*;
use serde::Serialize;

use super::contents;
use super::shifted_air::{ShiftedEmitter, Slice, Subdomain, exceeds, slices, within_reach_s};
use super::shifted_pairs::{Broken, Pair};
use super::zone;
use crate::plan::{Plan, ViolationKind, Zone, failed};
use crate::verify::extents::Span;
use crate::verify::scene::{Flight, Scene};
use crate::verify::time::encounters::{Encounter, encounters};

/// Delays are looked at up to this (s), chosen here: a drone that is later than that is planned
/// again.
pub const LATEST_S: f64 = 3.0;
/// Resolution of delays (s): chosen here, a tick of the search.
pub const FINE_S: f64 = 0.01;
/// Delays are looked at up to each of these in turn (s): chosen here, many drones of dense fleets
/// may be late by half a second, and no more.
const UP_TO_S: [f64; 4] = [0.5, 1.0, 2.0, LATEST_S];

/// How late one drone may be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Lateness {
    /// Every delay below this keeps the verdict (s), to [`FINE_S`]; at least [`LATEST_S`] where
    /// nothing breaks it.
    pub late_s: f64,
    /// What breaks then: the rule, and the other side.
    pub breaks: Option<(ViolationKind, String)>,
}

/// How late each drone of a plan may be, in its order; `None`: it cannot be judged, or was not when
/// stopped.
pub fn of_all(plan: &Plan, stop: &(dyn Fn() -> bool + Sync)) -> Vec<Option<Lateness>> {
    let mut by_drone = vec![None; plan.drones.len()];
    let (Some(scene), _) = contents::read(plan) else {
        return by_drone;
    };
    let on_time = encounters(&scene, 0.0);
    let over = (scene.flights.par_iter().zip(&on_time))
        .map(|(flight, near)| exceeds(&scene, near, flight))
        .collect();
    of_each(&scene, (&on_time, over), &mut by_drone, stop);
    by_drone
}

/// The same of a plan as it was read, where it is known which flights are near which on time, and
/// which exceed their limit of air then.
pub(crate) fn of_each(
    scene: &Scene<'_>,
    (on_time, is_over): (&[Vec<Encounter>], Vec<bool>),
    by_drone: &mut [Option<Lateness>],
    stop: &(dyn Fn() -> bool + Sync),
) {
    let fleet = NearFlights::new(scene, on_time, is_over);
    let judged: Vec<(usize, Lateness)> = (scene.flights.par_iter().enumerate())
        .filter(|_| !stop())
        .map(|(k, flight)| (flight.index, fleet.lateness(k, LATEST_S)))
        .collect();
    for (index, lateness) in judged {
        by_drone[index] = Some(lateness);
    }
}

/// Flights whose lateness is looked for at a time; later ones know the least so far. Chosen here,
/// independent of threads: the answer is the same on any number.
const AT_A_TIME: usize = 16;

/// The same of that drone alone which may be late by the least; of several the first, those over
/// their limit on time before others.
pub(crate) fn of_least(
    scene: &Scene<'_>,
    (on_time, is_over): (&[Vec<Encounter>], Vec<bool>),
    by_drone: &mut [Option<Lateness>],
) {
    let mut flights: Vec<usize> = (0..scene.flights.len()).collect();
    flights.sort_by_key(|&k| !is_over[k]);
    let fleet = NearFlights::new(scene, on_time, is_over);
    let mut least: Option<(usize, Lateness)> = None;
    for some in flights.chunks(AT_A_TIME) {
        let below_s = least.as_ref().map_or(LATEST_S, |it| it.1.late_s);
        if below_s <= 0.0 {
            break;
        }
        let late: Vec<(usize, Lateness)> = (some.par_iter())
            .map(|&k| (k, fleet.lateness(k, below_s)))
            .collect();
        // Of equals the first.
        let all = least.into_iter().chain(late);
        least = all.reduce(|a, b| if b.1.late_s < a.1.late_s { b } else { a });
    }
    if let Some((k, lateness)) = least {
        by_drone[scene.flights[k].index] = Some(lateness);
    }
}

/// All flights, and their encounters.
struct NearFlights<'a> {
    scene: &'a Scene<'a>,
    /// The encounters of each, with clocks that differ by up to [`LATEST_S`].
    near: Vec<Vec<Encounter>>,
    /// The flight of each in slices, with those near it on time.
    slices: Vec<Vec<Slice<'a>>>,
    /// Of each slice an upper bound of its air with all on time (m/s), once it is asked for.
    bounds_mps: Vec<Vec<OnceLock<f64>>>,
    /// Whether each exceeds its limit of air on time.
    is_over: Vec<bool>,
}

impl<'a> NearFlights<'a> {
    fn new(
        scene: &'a Scene<'a>,
        on_time: &[Vec<Encounter>],
        is_over: Vec<bool>,
    ) -> NearFlights<'a> {
        let near = encounters(scene, LATEST_S);
        let flights = scene.flights.par_iter().zip(&near).zip(on_time);
        let slices: Vec<Vec<Slice<'_>>> = flights
            .map(|((flight, near), on_time)| sliced(scene, near, on_time, flight))
            .collect();
        let unknown = |of: &Vec<Slice<'_>>| of.iter().map(|_| OnceLock::new()).collect();
        NearFlights {
            bounds_mps: slices.iter().map(unknown).collect(),
            scene,
            near,
            slices,
            is_over,
        }
    }

    /// How late a flight may be; as far as that is below so much (s).
    fn lateness(&self, k: usize, below_s: f64) -> Lateness {
        let (scene, near) = (self.scene, &self.near);
        let late = &scene.flights[k];
        let others: Vec<&[Encounter]> = near[k].chunk_by(|a, b| a.other == b.other).collect();
        let mut own = slices(scene, &near[k], late, f64::INFINITY);
        // What no delay below that brings about need not be asked for each.
        own.retain(|slice| {
            let ahead = slice.met.iter().map(|&from| ShiftedEmitter::new(from, 0));
            let whole = part_of(slice, (0.0, below_s), ahead.collect());
            slice.exposed.may_be_over(&whole)
        });
        let below = others.iter().map(|same| same[0].other);
        let below: Vec<usize> = below
            .filter(|other| self.may_reach(k, *other, below_s))
            .collect();
        let mut known = Lateness {
            late_s: 0.0,
            breaks: None,
        };
        for up_to_s in UP_TO_S {
            let from_s = known.late_s;
            known.late_s = up_to_s.min(below_s);
            for same in &others {
                if known.late_s <= 0.0 {
                    return known;
                }
                let other = &scene.flights[same[0].other];
                if is_wreck_of(other, late) {
                    continue;
                }
                known.by_pair(scene, (late, same), (other, with(near, same[0].other, k)));
            }
            for slice in &own {
                // All others are ahead by the same.
                let ahead = slice.met.iter().map(|&from| ShiftedEmitter::new(from, 0));
                let shift_s = (from_s.min(known.late_s), known.late_s);
                known.by_air(slice, ahead.collect(), shift_s, late);
            }
            for other in &below {
                if known.late_s <= 0.0 {
                    return known;
                }
                self.below(k, *other, from_s, &mut known);
            }
            if known.breaks.is_some() || known.late_s >= below_s {
                break;
            }
        }
        for zone in &scene.zones {
            known.by_zone(scene, zone, k);
        }
        known
    }

    /// Whether the air of a flight that is late by up to so much (s) may matter to another.
    fn may_reach(&self, k: usize, other: usize, most_s: f64) -> bool {
        let (scene, receiver) = (self.scene, &self.scene.flights[other]);
        let late = (k, (-most_s, 0.0));
        let together = with(&self.near, other, k);
        self.is_over[other] || !within_reach_s(scene, receiver, together, late).is_empty()
    }

    /// The air of another flight with this one late by as much and more (s), all others on time.
    fn below(&self, k: usize, other: usize, from_s: f64, known: &mut Lateness) {
        let (scene, receiver) = (self.scene, &self.scene.flights[other]);
        let shift_s = |late_s: f64| (-late_s, -from_s.min(late_s));
        let together = with(&self.near, other, k);
        let counts_s: Vec<Span> = match self.is_over[other] {
            true => together.iter().map(|it| it.span_s).collect(),
            // Where the late one's air does not count the others' is in order.
            false => within_reach_s(scene, receiver, together, (k, shift_s(known.late_s))),
        };
        if counts_s.is_empty() {
            return;
        }
        // Both are in order of time.
        let counts = |(from_s, until_s): Span| {
            let first = counts_s.partition_point(|it| it.1 <= from_s);
            counts_s.get(first).is_some_and(|it| it.0 < until_s)
        };
        let slices = self.slices[other].iter().zip(&self.bounds_mps[other]);
        for (slice, bound_mps) in slices.filter(|(it, _)| counts(it.span_s)) {
            let behind = ShiftedEmitter::new(k, 0);
            let shift_s = shift_s(known.late_s);
            let alone = part_of(slice, shift_s, Vec::new());
            let on_time_mps = *bound_mps.get_or_init(|| slice.bound_mps());
            if slice.exposed.bears(&alone, behind, on_time_mps) {
                continue;
            }
            let on_time = slice.met.iter().filter(|&&from| from != k);
            let on_time = on_time.map(|&from| ShiftedEmitter::new(from, 1));
            let emitters = std::iter::once(behind).chain(on_time);
            known.by_air(slice, emitters.collect(), shift_s, receiver);
        }
    }
}

/// Whether `wreck` lies where `late` came down, as late as that drone came.
fn is_wreck_of(wreck: &Flight, late: &Flight) -> bool {
    let (from_s, until_s) = wreck.airborne_s;
    failed(&wreck.name) == Some(&late.name)
        && until_s <= from_s
        && late.trajectory.last_s() <= from_s
}

/// A flight in slices wherever another is near it; a slice lists those near it with all on time.
fn sliced<'a>(
    scene: &'a Scene<'a>,
    near: &[Encounter],
    on_time: &[Encounter],
    flight: &'a Flight,
) -> Vec<Slice<'a>> {
    let mut slices = slices(scene, near, flight, f64::INFINITY);
    for slice in &mut slices {
        let (from_s, until_s) = slice.span_s;
        let is_met = |other: &usize| {
            let first = on_time.partition_point(|it| it.other < *other);
            let mut same = on_time[first..].iter().take_while(|it| it.other == *other);
            same.any(|it| it.span_s.0 < until_s && it.span_s.1 > from_s)
        };
        slice.met.retain(is_met);
        slice.met.shrink_to_fit();
    }
    slices
}

/// All of a slice with the first clock shifted, and the second on time.
fn part_of(slice: &Slice<'_>, shift_s: Span, emitters: Vec<ShiftedEmitter>) -> Subdomain {
    Subdomain {
        span_s: slice.span_s,
        shifts_s: vec![shift_s, (0.0, 0.0)],
        lags: slice.lags(),
        emitters,
    }
}

/// The encounters of one flight with another.
fn with(near: &[Vec<Encounter>], one: usize, other: usize) -> &[Encounter] {
    let from = near[one].partition_point(|it| it.other < other);
    let rest = &near[one][from..];
    &rest[..rest.partition_point(|it| it.other == other)]
}

impl Lateness {
    /// A delay that breaks a rule (s).
    fn lower(&mut self, late_s: f64, kind: ViolationKind, with: &str) {
        if late_s < self.late_s {
            self.late_s = late_s;
            self.breaks = Some((kind, with.to_owned()));
        }
    }

    /// The bodies of the late drone and of another, and each in the other's column.
    fn by_pair(
        &mut self,
        scene: &Scene<'_>,
        (late, near): (&Flight, &[Encounter]),
        (other, near_other): (&Flight, &[Encounter]),
    ) {
        let most_s = self.late_s;
        let ahead = Pair {
            scene,
            one: late,
            other,
            shift_s: (0.0, most_s),
            tracking_m: 0.0,
        };
        let behind = Pair {
            one: other,
            other: late,
            shift_s: (-most_s, 0.0),
            ..ahead
        };
        let mut lower = |kind, broken: &Broken| {
            self.lower(broken.least_shift_s(most_s, FINE_S), kind, &other.name);
        };
        ahead.broken(near, &Pair::bodies, &mut |it| {
            lower(ViolationKind::Collision, &it)
        });
        ahead.broken(near, &Pair::column, &mut |it| {
            lower(ViolationKind::Column, &it)
        });
        behind.broken(near_other, &Pair::column, &mut |it| {
            lower(ViolationKind::Column, &it)
        });
    }

    /// The air of a receiver in one slice, with the first clock shifted.
    fn by_air(
        &mut self,
        slice: &Slice<'_>,
        emitters: Vec<ShiftedEmitter>,
        shift_s: Span,
        receiver: &Flight,
    ) {
        let whole = part_of(slice, shift_s, emitters);
        if let Some(least_s) = slice.exposed.least_shift_s(whole, self.late_s, FINE_S) {
            self.lower(least_s, ViolationKind::Air, &receiver.name);
        }
    }

    /// The air of a zone.
    fn by_zone(&mut self, scene: &Scene<'_>, zone: &Zone, k: usize) {
        if let Some(least_s) = zone::least_delay_s(scene, zone, k, (self.late_s, FINE_S)) {
            self.lower(least_s, ViolationKind::Zone, &zone.name);
        }
    }
}
