//! The file of a finding: the effects that a diagnosis found, and that a plan is to be flown
//! through.
//!
//! `plan diagnose` writes more into it than is flown: verdict, evidence, advice. Of that a plan's
//! notes tell what bears on the air that is flown.

use std::collections::BTreeMap;
use std::ops::Range;

use airflow::effects::{EFFECTS, Effects, Parameter, Treatment};
use serde::Deserialize;

use super::fields::{Field, Reader, Record, cited};
use super::limits::Limits;
use super::problem::Problem;
use super::source::Value;
use super::written::{At, Written};
use crate::scenario::world::{Drone, World};

/// Where a scenario cites a finding, or that the command line does.
#[derive(Clone, Debug)]
pub(super) struct Citation {
    /// As the scenario or the command line names it.
    pub(super) file: String,
    /// In the scenario; `None`: the command line does.
    pub(super) at: Option<Range<usize>>,
}

/// The finding that is flown: the command line's before the scenario's.
pub(super) fn citation(written: &Written, finding: Option<&str>) -> Option<Citation> {
    let (file, at) = match (finding, &written.air.finding) {
        (Some(file), _) => (file.to_owned(), None),
        (None, cited) => {
            let At { value, at } = cited.clone()?;
            (value, Some(at))
        }
    };
    Some(Citation { file, at })
}

/// Why a finding cannot be flown by some drones in a world: the first reason of each kind.
pub(super) fn unfit(world: &World, drones: &[Drone]) -> Vec<String> {
    if airflow::Flown::of(&world.effects).is_err() {
        // Told at its place in the finding.
        return Vec::new();
    }
    let flown = world.flown();
    let density = world.air.density_kg_per_m3();
    let wind = (drones.iter()).find_map(|drone| flown.beyond(&drone.vehicle.airframe, density));
    let most_mps2 = world.most_acceleration_mps2();
    let leans = drones
        .iter()
        .find(|drone| flown.lean.is_some() && drone.vehicle.max_acceleration_mps2 > most_mps2);
    let leans = leans.map(|drone| {
        format!(
            "`wake_lean`: drone `{}` accelerates by up to {} m/s2, and the wakes of this fleet are flown as leaning by what {most_mps2} m/s2 \
             bring about",
            drone.name, drone.vehicle.max_acceleration_mps2
        )
    });
    let return_flow_mps = flown.return_flow_mps;
    let drone = drones.iter().find(|drone| {
        let airframe = &drone.vehicle.airframe;
        let own_mps = airframe.hover_induced_velocity_mps(airframe.mass_kg(), density);
        return_flow_mps > 0.0 && flown.receiver_gain * return_flow_mps >= drone.air_limit * own_mps
    });
    let drone = drone.map(|drone| format!("the air limit of drone `{}`", drone.name));
    let mut zones = world.zones.iter();
    let zone = zones.find(|zone| {
        return_flow_mps > 0.0 && zone.air_limit_mps.is_some_and(|mps| return_flow_mps >= mps)
    });
    let zone = zone.map(|zone| format!("the limit of zone `{}`", zone.name));
    let alone = [drone, zone]
        .into_iter()
        .flatten()
        .map(|limit| format!("a return flow of {return_flow_mps:.2} m/s alone exceeds {limit}"));
    wind.into_iter().chain(leans).chain(alone).collect()
}

impl Citation {
    /// A problem of the finding and the scenario together, at the citation where there is one.
    pub(super) fn problem(&self, message: String) -> Problem {
        Problem {
            message,
            span: self.at.clone(),
            ..Problem::default()
        }
    }
}

/// Reads the cited file: what it adds to the hover jet, all of which can be flown, and what a
/// reader of the plan should know of it.
///
/// # Errors
/// Everything that is wrong with it, each at its place in it; at the citation, where it cannot be
/// had at all.
pub(super) fn read(
    citation: &Citation,
    files: &super::Files<'_>,
) -> Result<(Effects, Vec<String>), Vec<Problem>> {
    let file = &citation.file;
    let text = files.text(file).map_err(|why| {
        let problem = citation.problem("the finding of `air` cannot be used".to_owned());
        vec![
            problem.label(why).help(
                "`plan diagnose` writes such a file; without `finding` the air of a hovering drone is flown",
            ),
        ]
    })?;
    cited(file, &text, |reader, value| finding(reader, value, file))
}

/// What of an effect that a finding names tells whether its fit ended within its range.
#[derive(Deserialize)]
#[serde(rename = "Effect")]
struct NamedEffect {
    name: String,
    #[serde(default)]
    parameters: BTreeMap<String, Fitted>,
}

/// One fitted parameter.
#[derive(Deserialize)]
#[serde(rename = "Estimate")]
struct Fitted {
    #[serde(default)]
    at_bound: bool,
}

/// The finding in a text that is RON, with notes for a reader of the plan.
fn finding<'t>(
    reader: &mut Reader<'t>,
    value: Value<'t>,
    file: &str,
) -> Option<(Effects, Vec<String>)> {
    let mut record = reader.record(value, "Finding", "the finding".to_owned())?;
    let uncertain = record.optional(reader, "verdict", |_, field| {
        match field.value.text.trim_matches('"') {
            "ambiguous" => Some(
                "ambiguous: what it writes under `effects` is flown, what would explain the \
                 recording as well is not",
            ),
            "outside_library" => Some(
                "outside the library: part of what it found in the air has no law here and is not \
                 flown; keep drones out of where it is with a zone, or by lower air limits",
            ),
            _ => None,
        }
    });
    let named = record.optional(reader, "named", |_, field| {
        field.value.plain::<Vec<NamedEffect>>()
    });
    let sensor = record.optional(reader, "sensor", |_, field| field.value.pairs("Sensor"));
    if !record.has("effects") {
        let problem = Problem::at(record.head(), "the finding has no `effects`");
        let problem = problem.label("required here");
        reader.report(problem.help("effects: () where it names nothing in the air"));
    }
    let effects = record.optional(reader, "effects", effects)?;
    let mut notes = Vec::new();
    notes.extend(uncertain.map(|how| format!("the finding of {file} is {how}")));
    let treatments = effects.treatments();
    let is_ignored =
        |(_, treatment): &(&str, Treatment)| matches!(treatment, Treatment::Ignored(_));
    if treatments.iter().all(is_ignored) {
        notes.push(format!(
            "the finding of {file} names nothing that moves the air a limit counts: the plan is flown in the air as it is"
        ));
    }
    notes.extend(treatments.into_iter().filter_map(|one| note(one, file)));
    let is_flown = |of: &&NamedEffect| effects.specs().any(|spec| spec.name == of.name);
    for NamedEffect { name, parameters } in named.iter().flatten().filter(is_flown) {
        let ends = parameters.iter().filter(|(_, fitted)| fitted.at_bound);
        let ends: Vec<&str> = ends.map(|(symbol, _)| symbol.as_str()).collect();
        if !ends.is_empty() {
            notes.push(format!(
                "`{name}` of {file} was fitted with {} at the end of its range: the air may go further than what is flown",
                ends.join(" and ")
            ));
        }
    }
    if sensor.is_some_and(|faults| !faults.is_empty()) {
        notes.push(format!(
            "`sensor` of {file} changes nothing here: it is about instruments, not about the air"
        ));
    }
    Some((effects, notes))
}

/// The effects of a finding, every key and number of which is in order and flown.
fn effects<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>) -> Option<Effects> {
    let found = field.value;
    let mut record = reader.record(found, "Effects", "`effects`".to_owned())?;
    let before = reader.problems.len();
    let mut places: Vec<(&'static str, Range<usize>)> = Vec::new();
    for spec in EFFECTS {
        record.optional(reader, spec.name, |reader, field| {
            places.push((spec.name, field.value.head()));
            let mut inner = reader.record(field.value, spec.name, format!("`{}`", spec.name))?;
            for parameter in spec.parameters {
                check(reader, &mut inner, parameter);
            }
            inner.close(reader).then_some(())
        });
    }
    record.close(reader);
    if reader.problems.len() > before {
        return None;
    }
    let Some(effects) = found.plain::<Effects>() else {
        // Every key and number has been looked at; what is left is how they are put together.
        let problem = Problem::at(&found.head(), "`effects` cannot be read");
        reader.report(problem.label("not as `plan diagnose` writes it"));
        return None;
    };
    let Err(refused) = airflow::Flown::of(&effects) else {
        return Some(effects);
    };
    for (name, why) in refused {
        let at = places.iter().find(|(known, _)| *known == name);
        let at = at.map_or_else(|| found.head(), |(_, at)| at.clone());
        let problem = Problem::at(&at, format!("the planner cannot fly `{name}` yet"));
        reader.report(problem.label(why).help(format!(
            "without `{name}` in the file the other effects are flown"
        )));
    }
    None
}

/// Holds one parameter of an effect against its range in the effect table.
fn check<'t>(reader: &mut Reader<'t>, record: &mut Record<'t>, parameter: &Parameter) {
    let [low, high] = parameter.range;
    let unit = if parameter.unit == "1" {
        ""
    } else {
        parameter.unit
    };
    let limits = Limits { low, high, unit };
    let read = |reader: &mut Reader<'t>, field: Field<'_, 't>| {
        // Since ever: a moment that no number is.
        if parameter.symbols.len() != 1 {
            reader.numbers(field, (2, "(x, y)"), &limits);
        } else if !(low.is_infinite() && field.value.text == "-inf") {
            reader.number(field, &limits);
        }
        Some(())
    };
    if parameter.is_optional {
        record.optional(reader, parameter.key, read);
    } else {
        record.required(reader, parameter.key, read);
    }
}

/// The note on an effect that is not followed exactly; `None` for one that is.
fn note((name, treatment): (&'static str, Treatment), file: &str) -> Option<String> {
    match treatment {
        Treatment::Bounded(how) => Some(format!(
            "`{name}` of {file} is bounded, not followed: {how}"
        )),
        Treatment::Ignored(why) => Some(format!("`{name}` of {file} changes nothing here: {why}")),
        Treatment::Exact | Treatment::Refused(_) => None,
    }
}
