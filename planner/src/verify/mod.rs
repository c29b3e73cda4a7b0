//! Judges a plan against the flow model, in continuous time and from the plan's data alone.
//!
//! The judge reads `airflow` and the geometry in the plan; it never asks the costmap, the roadmap or
//! the search, so a mistake there cannot hide here. What it decides, and to what tolerance:
//!
//! | check | rule | found by | tolerance |
//! | --- | --- | --- | --- |
//! | malformed | the plan contradicts itself, or claims no wake while it moves or hangs in the air | reading | |
//! | jump | in two places at one time | break points | 1 µm |
//! | speed | `max_speed_mps` | pieces | 1e-6 of it |
//! | bounds | rotor-plane centres inside `bounds_m` | pieces | 1 µm |
//! | obstacle | ball of `body_radius_m` clear of every solid | subdivision; distance grows no faster than the way flown | 5 mm |
//! | collision | balls of two drones apart | relative motion, closed form | 1 mm |
//! | column | no airborne centre in the near-field column of another airborne drone, as far down as its wake reaches | relative motion, closed form | 1 µm |
//! | air | mean over the rotor discs of all wakes superposed, at most `air_limit` U_H | subdivision on an upper bound | 0.001 U_H, 1 ms |
//! | zone | the wakes superposed at every point of the box, and the wall jets along the floor | subdivision of box and time on an upper bound | 0.5 %, 1 cm |
//!
//! `clearance_m` is the planner's margin, not a rule: bodies are judged by their radii alone, because
//! a landing drone comes within any clearance of what it lands on. The smallest gap between two bodies
//! is reported ([`Report::smallest_gap_m`]). Wakes weaker than [`FAINTEST_WAKE_MPS`] on their own are
//! left out of every sum.
//!
//! A drone that stays at its end (hovering for ever) is judged up to the last time of the whole plan
//! and at rest after it; its dose, energy and time over the limit count to its own last time
//! ([`AirMet`]).

pub(crate) mod air;
mod arrival;
mod blow;
mod clock;
mod collision;
mod column;
mod contents;
pub(crate) mod flight;
mod hangar;
mod late;
mod limits;
mod mean;
mod moved_wake;
mod near_table;
mod nearby;
pub(crate) mod obstacle;
mod passage;
pub(crate) mod solid;
pub(crate) mod wake_bound;
pub(crate) mod wake_end;
mod window;
mod words;
pub(crate) mod zone;

use rayon::prelude::*;

use crate::plan::{Plan, Violation};

/// A single wake below this axial speed is left out (m/s), chosen here: a tenth of the air that
/// drifts through a closed hall (0.06 to 0.12 m/s during the flights the jet was fitted to).
pub const FAINTEST_WAKE_MPS: f64 = 0.01;

/// What the verifier found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// By time, then kind, then drone.
    pub violations: Vec<Violation>,
    /// For each drone of the plan, in its order; zeros for one whose trajectory cannot be read.
    pub air_met: Vec<AirMet>,
    /// Smallest gap between two bodies (m); `None`: no two ever come near enough to blow on one another.
    pub smallest_gap_m: Option<f64>,
}

/// The air that one drone meets while it is airborne.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AirMet {
    /// Highest mean air over its rotor discs (m/s), for ever; to 0.1 %.
    pub worst_air_mps: f64,
    /// Whose wake contributed most to that.
    pub worst_air_from: Option<String>,
    /// When (s).
    pub worst_air_at_s: Option<f64>,
    /// Integral of the air met over its flight (m).
    pub dose_m: f64,
    /// Integral of (β − 1) m g U_H over its flight (J).
    pub extra_energy_j: f64,
    /// The same over the integral of m g U_H (%).
    pub extra_energy_percent: f64,
    /// Time over its limit (s), until the last time of the whole plan.
    pub time_over_limit_s: f64,
}

/// A violation with the index of its drone, for the order of the report.
type Found = (usize, Violation);

/// Judges a plan.
pub fn verify(plan: &Plan) -> Report {
    let (scene, mut found) = contents::read(plan);
    let mut air_met = vec![AirMet::default(); plan.drones.len()];
    let Some(scene) = scene else {
        return Report {
            violations: sorted(found),
            air_met,
            smallest_gap_m: None,
        };
    };
    let near = nearby::encounters(&scene);

    let alone: Vec<Vec<Found>> = (scene.flights.par_iter())
        .map(|flight| {
            let mut found = limits::check(&scene, flight);
            found.extend(obstacle::check(&scene, flight));
            found
        })
        .collect();
    found.extend(alone.into_iter().flatten());

    let met: Vec<_> = (near.par_iter().enumerate())
        .map(|(k, near)| {
            let collisions = collision::check(&scene, near, k);
            (collisions, air::judge(&scene, near, k))
        })
        .collect();
    let mut smallest_gap_m: Option<f64> = None;
    for (flight, ((collisions, gap_m), (air, met))) in scene.flights.iter().zip(met) {
        found.extend(collisions);
        found.extend(air);
        air_met[flight.index] = met;
        smallest_gap_m = smallest_gap_m.into_iter().chain(gap_m).reduce(f64::min);
    }

    let zones: Vec<Vec<Found>> = scene
        .zones
        .par_iter()
        .map(|zone| zone::check(&scene, zone))
        .collect();
    found.extend(zones.into_iter().flatten());
    Report {
        violations: sorted(found),
        air_met,
        smallest_gap_m,
    }
}

fn sorted(mut found: Vec<Found>) -> Vec<Violation> {
    found.sort_by(|(i, a), (j, b)| {
        a.from_s
            .total_cmp(&b.from_s)
            .then(a.kind.cmp(&b.kind))
            .then(i.cmp(j))
            .then_with(|| a.with.cmp(&b.with))
    });
    found.into_iter().map(|(_, violation)| violation).collect()
}
