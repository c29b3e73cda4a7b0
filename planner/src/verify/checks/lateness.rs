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
    let (scene, _) = contents::read(plan);
    let judged = scene.map(|scene| of_scene(&scene, plan.drones.len(), stop));
    judged.unwrap_or_else(|| vec![None; plan.drones.len()])
}

/// The same of a plan with so many drones, as it was read.
pub(crate) fn of_scene(
    scene: &Scene<'_>,
    drones: usize,
    stop: &(dyn Fn() -> bool + Sync),
) -> Vec<Option<Lateness>> {
    let near = encounters(scene, LATEST_S);
    let on_time = encounters(scene, 0.0);
    let flights = || scene.flights.par_iter().enumerate();
    let slices: Vec<Vec<Slice<'_>>> = (flights().zip(&on_time))
        .map(|((k, flight), on_time)| sliced(scene, &near[k], on_time, flight))
        .collect();
    let unknown = |of: &Vec<Slice<'_>>| of.iter().map(|_| OnceLock::new()).collect();
    let fleet = NearFlights {
        scene,
        near: &near,
        bounds_mps: slices.iter().map(unknown).collect(),
        is_over: (flights().zip(&on_time))
            .map(|((_, flight), near)| exceeds(scene, near, flight))
            .collect(),
        slices,
    };
    let judged: Vec<(usize, Lateness)> = flights()
        .filter(|_| !stop())
        .map(|(k, flight)| (flight.index, fleet.lateness(k)))
        .collect();
    let mut by_drone = vec![None; drones];
    for (index, lateness) in judged {
        by_drone[index] = Some(lateness);
    }
    by_drone
}

/// All flights, and their encounters.
struct NearFlights<'a> {
    scene: &'a Scene<'a>,
    /// The encounters of each, with clocks that differ by up to [`LATEST_S`].
    near: &'a [Vec<Encounter>],
    /// The flight of each in slices, with those near it on time.
    slices: Vec<Vec<Slice<'a>>>,
    /// Of each slice an upper bound of its air with all on time (m/s), once it is asked for.
    bounds_mps: Vec<Vec<OnceLock<f64>>>,
    /// Whether each exceeds its limit of air on time.
    is_over: Vec<bool>,
}

impl NearFlights<'_> {
    /// How late a flight may be.
    fn lateness(&self, k: usize) -> Lateness {
        let (scene, near) = (self.scene, self.near);
        let late = &scene.flights[k];
        let others: Vec<&[Encounter]> = near[k].chunk_by(|a, b| a.other == b.other).collect();
        let mut own = slices(scene, &near[k], late, f64::INFINITY);
        // What no delay up to the latest brings about need not be asked for each.
        own.retain(|slice| {
            let ahead = slice.met.iter().map(|&from| ShiftedEmitter::new(from, 0));
            let whole = part_of(slice, (0.0, LATEST_S), ahead.collect());
            slice.exposed.may_be_over(&whole)
        });
        let below = others.iter().map(|same| same[0].other);
        let below: Vec<usize> = below.filter(|other| self.may_reach(k, *other)).collect();
        let mut known = Lateness {
            late_s: 0.0,
            breaks: None,
        };
        for up_to_s in UP_TO_S {
            let from_s = known.late_s;
            known.late_s = up_to_s;
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
            if known.breaks.is_some() {
                break;
            }
        }
        for zone in &scene.zones {
            known.by_zone(scene, zone, k);
        }
        known
    }

    /// Whether the air of a flight that is late may matter to another.
    fn may_reach(&self, k: usize, other: usize) -> bool {
        let (scene, receiver) = (self.scene, &self.scene.flights[other]);
        let late = (k, (-LATEST_S, 0.0));
        let together = with(self.near, other, k);
        self.is_over[other] || !within_reach_s(scene, receiver, together, late).is_empty()
    }

    /// The air of another flight with this one late by as much and more (s), all others on time.
    fn below(&self, k: usize, other: usize, from_s: f64, known: &mut Lateness) {
        let (scene, receiver) = (self.scene, &self.scene.flights[other]);
        let shift_s = |late_s: f64| (-late_s, -from_s.min(late_s));
        let together = with(self.near, other, k);
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
