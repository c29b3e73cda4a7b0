//! Judges a plan against the flow model, in continuous time and from the plan's data alone.
//!
//! The verifier reads `airflow` and the geometry in the plan; it never asks the costmap, the
//! roadmap or the search, so a mistake there cannot hide here. What it decides, and to what
//! tolerance:
//!
//! | check | rule | found by | tolerance |
//! | --- | --- | --- | --- |
//! | malformed | the plan contradicts itself, or claims no wake while it moves or hangs in the air | reading | |
//! | jump | in two places at one time | break points | 1 µm |
//! | speed | `max_speed_mps` | pieces | 1e-6 of it |
//! | bounds | rotor-plane centres inside `bounds_m` | pieces | 1 µm |
//! | obstacle | ball of `body_radius_m` clear of every solid | subdivision; distance grows no faster than the path flown | 5 mm |
//! | collision | balls of two drones apart | relative motion, closed form; cubics by chords within 10 µm | 1 mm |
//! | column | no airborne centre in the near-field column of another airborne drone, as far down as its wake reaches | relative motion, closed form | 1 µm |
//! | air | mean over the rotor discs of all wakes superposed, at most `air_limit` U_H | subdivision on an upper bound | 0.001 U_H, 1 ms |
//! | zone | the wakes superposed at every point of the box, and the wall jets along the floor | subdivision of box and time on an upper bound | 0.5 %, 1 cm |
//! | climb, descent | `max_climb_mps`, `max_descent_mps` | pieces | 1e-6 of it |
//! | velocity jump, acceleration jump | continuous up to acceleration, from rest to rest; where `control_m` is listed | break points | 1 mm/s, 1 cm/s² |
//! | acceleration, jerk | `max_acceleration_mps2`, `max_jerk_mps3`; where `control_m` is listed | ends of pieces | 1e-3 of it |
//! | sideways, touchdown | `body_radius_m` + 0.5 m over its pad a drone goes straight up and down, at no more than 0.5 m/s to the ground | pieces | 1 µm, 1e-6 |
//! | keep-out | no body in the zone, `tracking_m` around one that flies | subdivision, as obstacles | 5 mm |
//! | collision, column with margins | each drone early or late by `time_s`, at any moment, and off its path by `tracking_m` while it flies (bodies) | both motions over time and shift, closed form | 1 mm, 1 µm |
//! | obstacle with margin | `tracking_m` more for a drone that flies; tops within 0.5 m of its own pad exempt | subdivision | 5 mm |
//! | air, zone with advected wakes | every delay from none to the longest: for drones one lag of all air at a time, for zones each drone's own | subdivision of time and lag on an upper bound | 0.002 U_H, 2 mm of path; 0.5 %, 1 cm |
//! | air, zone with margins | each drone early or late by `time_s` | subdivision of time and of every shift on an upper bound | 0.002 U_H, 2 mm of path; 0.5 %, 1 cm |
//!
//! `clearance_m` is the planner's margin, not a rule: bodies are judged by their radii alone,
//! because a landing drone comes within any clearance of what it lands on. Wakes weaker than
//! [`FAINTEST_WAKE_MPS`] on their own are left out of every sum.
//!
//! A drone that keeps hovering at its end is judged up to the last time of the whole plan and at
//! rest after it; its axial exposure and energy count to its own last time ([`DroneExposure`]).
//!
//! What is broken without margins is reported without; a margin violation is reported where it
//! alone breaks. [`examination`] verifies plans from anywhere: it recomputes what a file claims,
//! and says how much room a plan leaves.
//!
//! `scene` is the plan as the checks see it; `checks` holds one file for each of them, `bounds`
//! what bounds a wake over ranges of places, `time` what happens over spans of time.

mod again;
pub(crate) mod bounds;
pub(crate) mod checks;
mod crowd;
pub mod examination;
mod extents;
pub(crate) mod scene;
mod time;
mod violation;

use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::FxHashSet;
use serde::Serialize;

use crate::plan::{Plan, Status, Unplanned, Violation, ViolationKind, Zone, ZoneAir};
pub(crate) use again::Judgements;
use again::{ValidJudgements, Validity};
pub use bounds::obstacles::NamedSolid;
pub use checks::air::DroneExposure;
pub use checks::contents::{COORDINATES_M, EXTENTS_M, SPEEDS_MPS, TIMES_S};
pub use checks::lateness;
pub use checks::obstacle::{PAD_M, SINK_M, TOUCH_M};
use checks::zone::ZoneQuestion;
use checks::{
    air, collision, contents, limits, obstacle, shifted_air, shifted_pairs, smooth, zone,
};
use crowd::Crowds;
pub use extents::FAINTEST_WAKE_MPS;
pub(crate) use extents::Places;
use extents::Span;
use scene::{Flight, Scene};
use time::encounters::{Encounter, encounters};
use violation::IndexedViolation;

/// What the verifier found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// By time, then kind, then drone; of a drone that collides with very many others, or is in
    /// very many columns, the worst.
    pub violations: Vec<Violation>,
    /// How many more violations such drones have.
    #[serde(rename = "untold")]
    pub omitted: usize,
    /// How many drones touch so many others at one moment that only a few of these pairs were
    /// judged, and otherwise only what each does by itself; no zone is judged then.
    pub crowded: usize,
    /// For each drone of the plan, in its order; zeros for one whose trajectory cannot be read.
    pub exposures: Vec<DroneExposure>,
    /// For each zone that limits its air.
    pub zone_air: Vec<ZoneAir>,
}

impl Report {
    /// The answer in one word, where these drones are unplanned.
    fn status(&self, unplanned: &[Unplanned]) -> Status {
        match (self.violations.is_empty(), unplanned.is_empty()) {
            (false, _) => Status::Unsafe,
            (true, false) => Status::Partial,
            (true, true) => Status::Safe,
        }
    }
}

/// Violations of one kind by one drone with others that are reported, and others that a drone
/// touches at once before most of these pairs are no longer judged: chosen here, no single drone
/// can resolve such a crowd.
pub const CROWD: usize = 64;

/// What a violation is of: the same for a rule with and without margins.
fn what(it: &Violation) -> (ViolationKind, Option<&str>) {
    let kind = it.kind.without_margin();
    let with = it.with.as_deref();
    (kind, with.filter(|_| kind != ViolationKind::Air))
}

/// Keeps of a drone's violations with others the worst of each kind, and returns how many it left
/// out.
fn thin_out(found: &mut Vec<IndexedViolation>) -> usize {
    let mut omitted = 0;
    for kind in [
        ViolationKind::Collision,
        ViolationKind::Column,
        ViolationKind::CollisionMargin,
        ViolationKind::ColumnMargin,
    ] {
        let of_kind = found.iter().filter(|(_, it)| it.kind == kind);
        // The nearer, the worse.
        let mut values: Vec<f64> = of_kind.map(|(_, it)| it.value).collect();
        if values.len() <= CROWD {
            continue;
        }
        omitted += values.len() - CROWD;
        let (_, last, _) = values.select_nth_unstable_by(CROWD, f64::total_cmp);
        let last = *last;
        let nearer = found
            .iter()
            .filter(|(_, it)| it.kind == kind && it.value < last);
        // Of equally near ones the first.
        let mut more = CROWD - nearer.count();
        found.retain(|(_, it)| {
            let is_as_near = it.kind == kind && it.value >= last;
            let is_kept = !is_as_near || it.value == last && more > 0;
            more -= usize::from(is_as_near && is_kept);
            is_kept
        });
    }
    omitted
}

/// The contradictions within a plan; nothing else is judged.
pub fn contradictions(plan: &Plan) -> Vec<Violation> {
    contents::read(plan)
        .1
        .into_iter()
        .map(|(_, it)| it)
        .collect()
}

/// Judges a plan, on as many threads as there are; their number changes nothing in the report.
pub fn verify(plan: &Plan) -> Report {
    anew(plan, ZoneQuestion::Spans)
}

/// Judges a plan without earlier judgements.
fn anew(plan: &Plan, of_zones: ZoneQuestion) -> Report {
    let (mut scene, malformed) = contents::read(plan);
    let crowds = scene.as_mut().map(crowd::set_aside).unwrap_or_default();
    let found = (malformed, crowds);
    report(plan, scene.as_ref(), found, (of_zones, None))
}

/// Judges a plan of which only drones have changed since the last time, without exposures: what
/// still holds of a drone is taken over. The judgements are kept for the next time.
pub(crate) fn verify_again(plan: &Plan, known: &mut Judgements) -> Report {
    let (scene, malformed) = contents::read(plan);
    let found = (malformed, Crowds::default());
    report(
        plan,
        scene.as_ref(),
        found,
        (ZoneQuestion::Spans, Some(known)),
    )
}

/// The exposure of each drone of a plan, in its order.
pub(crate) fn exposures(plan: &Plan) -> Vec<DroneExposure> {
    let mut exposures = vec![DroneExposure::default(); plan.drones.len()];
    let (Some(scene), _) = contents::read(plan) else {
        return exposures;
    };
    let near = encounters(&scene, 2.0 * scene.margins.time_s);
    let met: Vec<DroneExposure> = (scene.flights.par_iter().zip(&near))
        .map(|(flight, near)| air::exposure(&scene, near, flight))
        .collect();
    for (flight, met) in scene.flights.iter().zip(met) {
        exposures[flight.index] = met;
    }
    exposures
}

/// As [`verify`], without the highest air of zones: only whether their limits are kept, as far as
/// that is soon known.
pub(crate) fn verify_drones(plan: &Plan) -> Report {
    anew(plan, ZoneQuestion::IsKept)
}

/// The judgement of one flight.
#[derive(Clone, Debug)]
struct Judgement {
    found: Vec<Violation>,
    /// How many more there are.
    omitted: usize,
}

/// Judges one flight among those near it, and its exposure where that is asked for.
fn judgement(
    scene: &Scene<'_>,
    near: &[Encounter],
    k: usize,
    met: Option<&mut DroneExposure>,
) -> Judgement {
    let found = by_itself(scene, &scene.flights[k]);
    among(scene, (near, k), found, met)
}

/// What a flight breaks by itself.
fn by_itself(scene: &Scene<'_>, flight: &Flight) -> Vec<IndexedViolation> {
    let mut found = limits::check(scene, flight);
    found.extend(smooth::check(scene, flight));
    found.extend(obstacle::check(scene, flight));
    found
}

/// Whether a flight breaks something by itself.
fn breaks_alone(scene: &Scene<'_>, k: usize) -> bool {
    !by_itself(scene, &scene.flights[k]).is_empty()
}

/// Whether a flight breaks nothing among others during these spans; outside of them it and those
/// near it are unchanged.
fn breaks_nothing_during(
    scene: &Scene<'_>,
    near: &[Encounter],
    k: usize,
    spans_s: &[Span],
) -> bool {
    let within = |it: &Encounter| {
        let parts = spans_s
            .iter()
            .map(|during_s| (it.span_s.0.max(during_s.0), it.span_s.1.min(during_s.1)));
        let other = it.other;
        let parts = parts.filter(|(from_s, until_s)| from_s < until_s);
        parts
            .map(move |span_s| Encounter { other, span_s })
            .collect::<Vec<_>>()
    };
    let near: Vec<Encounter> = near.iter().flat_map(within).collect();
    let judged = among(scene, (&near, k), Vec::new(), None);
    judged.found.is_empty() && judged.omitted == 0
}

/// What a flight breaks by itself, which is known, and among those near it.
fn among(
    scene: &Scene<'_>,
    (near, k): (&[Encounter], usize),
    mut found: Vec<IndexedViolation>,
    met: Option<&mut DroneExposure>,
) -> Judgement {
    let flight = &scene.flights[k];
    found.extend(collision::check(scene, near, k));
    let slices = shifted_air::bounded(scene, near, flight);
    found.extend(match met {
        Some(met) => {
            let (air, exposure) = air::check(scene, (near, &slices), flight);
            *met = exposure;
            air
        }
        None => air::violations(scene, (near, &slices), flight),
    });
    let collides = |(_, it): &&IndexedViolation| it.kind == ViolationKind::Collision;
    let shifted = match found.iter().filter(collides).count() > CROWD {
        // Its margin violations add nothing then.
        true => Vec::new(),
        false => shifted_pairs::check(scene, near, k),
    };
    let shifted = shifted
        .into_iter()
        .chain(shifted_air::check(scene, slices, flight));
    // What is broken without margins is reported without.
    let on_time = found.iter().map(|(_, it)| it);
    let known: FxHashSet<_> = on_time
        .filter(|it| it.kind == it.kind.without_margin())
        .map(what)
        .collect();
    let shifted: Vec<IndexedViolation> = shifted
        .filter(|(_, it)| !known.contains(&what(it)))
        .collect();
    found.extend(shifted);
    let omitted = thin_out(&mut found);
    Judgement {
        found: found.into_iter().map(|(_, it)| it).collect(),
        omitted,
    }
}

/// The report of a plan that was read, with what is wrong with its contents and known of crowds,
/// whose drones are not in the scene; without the air of zones if only their limits are asked for.
/// What still holds of a known flight is not judged again.
fn report(
    plan: &Plan,
    scene: Option<&Scene<'_>>,
    (malformed, crowds): (Vec<IndexedViolation>, Crowds),
    (of_zones, known): (ZoneQuestion, Option<&mut Judgements>),
) -> Report {
    let mut found = malformed;
    found.extend(crowds.found);
    let mut omitted = crowds.omitted;
    let mut zone_air = Vec::new();
    let mut exposures = vec![DroneExposure::default(); plan.drones.len()];
    if let Some(scene) = scene {
        let apart_s = 2.0 * scene.margins.time_s;
        let ValidJudgements { validity, near } = match &known {
            Some(known) => known.still_valid(plan, scene, apart_s),
            None => ValidJudgements {
                validity: scene.flights.iter().map(|_| Validity::Unknown).collect(),
                near: encounters(scene, apart_s),
            },
        };
        let is_reported = known.is_none();
        let judge = |(k, (validity, near)): (usize, (Validity, &Vec<Encounter>))| {
            let mut met = DroneExposure::default();
            let during = match validity {
                Validity::True(known) => return (known, met),
                Validity::During { another, .. } if another && breaks_alone(scene, k) => None,
                Validity::During {
                    before, spans_s, ..
                } => breaks_nothing_during(scene, near, k, &spans_s)
                    .then(|| Judgement::clone(&before)),
                Validity::Unknown => None,
            };
            let judged = during
                .unwrap_or_else(|| judgement(scene, near, k, is_reported.then_some(&mut met)));
            (Arc::new(judged), met)
        };
        let judged = validity.into_par_iter().zip(&near).enumerate().map(judge);
        let (judged, met): (Vec<Arc<Judgement>>, Vec<DroneExposure>) = judged.unzip();
        for ((flight, here), met) in scene.flights.iter().zip(&judged).zip(met) {
            found.extend(here.found.iter().map(|it| (flight.index, it.clone())));
            omitted += here.omitted;
            exposures[flight.index] = met;
        }
        if let Some(known) = known {
            known.keep(plan, scene, &near, &judged);
        }
        // Without the air of crowds a zone's air is known only to be perhaps worse.
        let limited =
            (scene.zones.par_iter()).filter(|it| it.air_limit_mps.is_some() && crowds.drones == 0);
        let judged: Vec<_> = limited
            .map(|zone| {
                let mut found = zone::check(scene, zone, of_zones);
                let on_time = |(_, it): &IndexedViolation| it.kind == ViolationKind::Zone;
                let is_kept = !found.iter().any(on_time);
                let is_reported = of_zones == ZoneQuestion::Spans;
                let air = is_reported.then(|| air_of(scene, zone, is_kept));
                if let Some(air) = &air {
                    found.iter_mut().for_each(|it| decide(scene, air, it));
                }
                (found, air)
            })
            .collect();
        for (here, air) in judged {
            found.extend(here);
            zone_air.extend(air);
        }
    }
    Report {
        violations: in_order(found),
        omitted,
        crowded: crowds.drones,
        exposures,
        zone_air,
    }
}

/// By time, then kind, then drone.
fn in_order(mut found: Vec<IndexedViolation>) -> Vec<Violation> {
    found.sort_by(|(i, a), (j, b)| {
        (a.from_s.total_cmp(&b.from_s))
            .then(a.kind.cmp(&b.kind))
            .then(i.cmp(j))
            .then_with(|| a.with.cmp(&b.with))
    });
    found.into_iter().map(|(_, violation)| violation).collect()
}

/// What a plan's wakes do to its drones and zones, in a few figures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Harm {
    /// How many drones exceed their own limit or enter a column.
    pub(crate) drones_over_limit: usize,
    /// Highest mean air over the discs of any drone (m/s).
    pub(crate) worst_air_mps: f64,
    /// How many zones get more air than they allow.
    pub(crate) zones_over_limit: usize,
    /// Highest air in those zones (m/s).
    pub(crate) worst_zone_air_mps: f64,
}

/// Drones whose worst air is looked for at a time; later ones know what was found. Chosen here,
/// independent of threads: the answer is the same on any number.
const AT_A_TIME: usize = 64;

/// The harm that a plan's wakes do: the checks of air, columns and zones as far as these figures
/// need them.
pub(crate) fn harm(plan: &Plan) -> Harm {
    let (Some(scene), _) = contents::read(plan) else {
        return Harm::default();
    };
    let near = encounters(&scene, 0.0);
    let mut harm = Harm::default();
    let flights = scene.flights.chunks(AT_A_TIME).zip(near.chunks(AT_A_TIME));
    for (flights, near) in flights {
        let known_mps = harm.worst_air_mps;
        let judged: Vec<(bool, f64)> = (flights.par_iter().zip(near))
            .map(|(flight, near)| air::exceeds(&scene, near, flight, known_mps))
            .collect();
        for (is_over, worst_mps) in judged {
            harm.drones_over_limit += usize::from(is_over);
            harm.worst_air_mps = harm.worst_air_mps.max(worst_mps);
        }
    }
    let zones: Vec<f64> = (scene.zones.par_iter())
        .filter_map(|it| zone::worst_over_limit_mps(&scene, it))
        .collect();
    harm.zones_over_limit = zones.len();
    harm.worst_zone_air_mps = zones.into_iter().fold(0.0, f64::max);
    harm
}

/// The highest air of a zone, and the bodies that pass through it where they may; `is_kept`: no
/// drone on time breaks its limit.
fn air_of(scene: &Scene<'_>, zone: &Zone, is_kept: bool) -> ZoneAir {
    let zone::ZoneAirBounds { worst, at_most_mps } =
        zone::worst(scene, zone, is_kept, zone::ALWAYS_S);
    let name = |k: usize| scene.flights[k].name.clone();
    let enters = |it: &&Flight| !zone.keep_out && obstacle::enters(scene, it, zone);
    let entered_by = scene.flights.iter().filter(enters);
    ZoneAir {
        zone: zone.name.clone(),
        worst_air_mps: worst.map_or(0.0, |(air_mps, _, _)| air_mps),
        at_most_mps: Some(at_most_mps),
        worst_air_from: worst.map(|(_, _, from)| name(from)),
        worst_air_at_s: worst.map(|(_, t_s, _)| t_s),
        entered_by: entered_by.map(|it| it.name.clone()).collect(),
    }
}

/// Resolves a zone violation that bounds left open, where the highest air found in the zone is over
/// its limit at that time.
fn decide(scene: &Scene<'_>, air: &ZoneAir, (index, violation): &mut IndexedViolation) {
    let until_s = violation.until_s.unwrap_or(f64::INFINITY);
    let is_then = |t_s: &f64| (violation.from_s..=until_s).contains(t_s);
    let is_over = air.worst_air_mps > zone::VIOLATED * violation.limit;
    let is_open = violation.is_bound && violation.kind == ViolationKind::Zone;
    let at_s = air.worst_air_at_s.filter(is_then);
    let flight = |name: &String| scene.flights.iter().find(|it| it.name == *name);
    let from = air.worst_air_from.as_ref().and_then(flight);
    if let (true, Some(at_s), Some(flight)) = (is_open && is_over, at_s, from) {
        violation.drone = flight.name.clone();
        violation.position_m = flight.position_m(at_s);
        (violation.value, violation.is_bound) = (air.worst_air_mps, false);
        *index = flight.index;
    }
}

/// The highest air that a zone may have during the steps that contain a moment (m/s).
fn most_air_mps(scene: &Scene<'_>, zone: &str, at_s: f64) -> f64 {
    let zone = scene.zones.iter().find(|it| it.name == zone);
    let told = zone.map(|zone| zone::worst(scene, zone, false, (at_s, at_s)));
    told.map_or(0.0, |told| {
        let worst_mps = told.worst.map_or(0.0, |(air_mps, _, _)| air_mps);
        told.at_most_mps.max(worst_mps)
    })
}

/// Writes the verifier's findings, and why drones are unplanned, into a plan.
pub(crate) fn judged(mut plan: Plan, report: Report, unplanned: Vec<Unplanned>) -> Plan {
    plan.status = report.status(&unplanned);
    plan.zone_air = report.zone_air;
    plan.violations = report.violations;
    plan.unplanned = unplanned;
    exposed(plan, report.exposures)
}

/// What downwash costs a fleet (J).
pub(crate) fn extra_energy_j(exposures: &[DroneExposure]) -> f64 {
    exposures.iter().map(|it| it.extra_energy_j).sum()
}

/// Writes the exposures of its drones into a plan.
pub(crate) fn exposed(mut plan: Plan, exposures: Vec<DroneExposure>) -> Plan {
    plan.fleet.extra_energy_j = extra_energy_j(&exposures);
    for (drone, met) in plan.drones.iter_mut().zip(exposures) {
        drone.worst_air_mps = met.worst_air_mps;
        drone.worst_air_from = met.worst_air_from;
        drone.worst_air_at_s = met.worst_air_at_s;
        drone.dose_m = met.dose_m;
        drone.extra_energy_j = met.extra_energy_j;
        drone.extra_energy_percent = met.extra_energy_percent;
        // Of another plan.
        drone.may_be_late_s = None;
    }
    plan
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_found_over_the_limit_of_a_zone_is_not_left_open() {
        let text = r#"{"format": "plan/2", "scenario": "one", "bounds_m": {"min": [0, 0, 0], "max": [20, 8, 8]},
            "zones": [{"name": "z", "min_m": [8, 3, 0], "max_m": [10, 5, 1], "air_limit_mps": 1}],
            "drones": [{"name": "a", "airframe": "offboard-2",
            "trajectory": {"t_s": [0, 16], "position_m": [[1, 4, 5], [17, 4, 5]]}}]}"#;
        let plan = crate::plan::file::read(text).expect("a plan").plan;
        let (scene, _) = contents::read(&plan);
        let scene = scene.expect("it can be judged");
        let air = air_of(&scene, scene.zones[0], false);
        let known = zone::check(&scene, scene.zones[0], ZoneQuestion::Spans);
        let mut open = known[0].clone();
        (open.1.is_bound, open.1.value) = (true, 9.0);
        decide(&scene, &air, &mut open);
        assert!(
            !open.1.is_bound && open.1.value == air.worst_air_mps,
            "{open:?}"
        );
        assert!(open.1.to_string().contains("at worst"), "{}", open.1);
        // At another time, or within the limit, nothing is known.
        for (from_s, limit) in [(15.9, 1.0), (0.0, 8.0)] {
            let mut open = known[0].clone();
            (open.1.is_bound, open.1.value) = (true, 9.0);
            (open.1.from_s, open.1.until_s, open.1.limit) = (from_s, None, limit);
            decide(&scene, &air, &mut open);
            let told = open.1.to_string();
            assert!(told.contains("could not be decided"), "{told}");
            assert!(!told.contains("others"), "{told}");
        }
    }
}
