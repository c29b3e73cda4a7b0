//! Effects as they are told: name, numbers, intervals, and what each cannot be told from.

use std::collections::BTreeMap;

use airflow::effects::EffectSpec;

use crate::forward::observed::{Explained, Observed};
use crate::infer::actuation::Found;
use crate::infer::candidates::{Candidate, Kind};
use crate::infer::finding::{Effect, Estimate};
use crate::infer::intervals;
use crate::infer::noise::Noise;
use crate::infer::select::Selection;

/// Readings that make a plateau. Chosen here: in still rising air three hardly agree to the resolution.
const PLATEAU: usize = 3;

pub(super) fn from_actuation(found: Found) -> Effect {
    let estimate = |value: f64, error: f64| Estimate {
        value,
        low: value - 1.96 * error,
        high: value + 1.96 * error,
        unit: "1".into(),
    };
    let (name, says, value) = match found {
        Found::Payload {
            mass_factor, error, ..
        } => (
            "payload_mass",
            "its throttle and its power say so",
            estimate(mass_factor, error),
        ),
        Found::Density {
            density_factor,
            error,
        } => (
            "air_density",
            "throttle and power say so",
            estimate(density_factor, error),
        ),
    };
    let spec = EffectSpec::named(name).expect("both are rows of the effect table");
    let symbols: Vec<&str> = spec.components().map(|(_, symbol)| symbol).collect();
    let mut parameters = BTreeMap::from([(symbols[0].to_owned(), value)]);
    let mut equation = spec.equation;
    if let Found::Payload {
        since_s,
        since_within_s,
        ..
    } = found
    {
        if since_s.is_finite() {
            let at = Estimate {
                value: since_s,
                low: since_s - since_within_s,
                high: since_s + since_within_s,
                unit: "s".into(),
            };
            parameters.insert(symbols[1].to_owned(), at);
        } else {
            equation = equation.trim_end_matches(" from t0 on");
        }
    }
    Effect {
        name: name.into(),
        kind: Some(Kind::Physics),
        alternatives: Vec::new(),
        equation: equation.into(),
        story: format!("{}: {says}", spec.description),
        parameters,
    }
}

/// The chosen candidates with their intervals, and what each cannot be told from.
pub(super) fn named(
    candidates: &[Candidate],
    members: &[&Candidate],
    observed: &Observed,
    selection: &Selection,
    noise: &Noise,
) -> Vec<Effect> {
    let fit = &selection.chosen.fit;
    let half_widths = intervals::half_widths(members, fit, noise);
    let mut place = 0;
    let mut effects = Vec::with_capacity(members.len());
    for (member, alternatives) in members.iter().zip(&selection.alternatives) {
        let span = place..place + member.parameters.len();
        place = span.end;
        let others = alternatives.iter();
        let others = others.map(|&k| candidates[k].name.to_owned()).collect();
        let values = &fit.values[span.clone()];
        if member.name == "sensor_saturation" {
            // Gusts blur the ceiling of a mean, not that of the readings: the highest of them, where several lie at it.
            if let Some(highest) = plateau(observed) {
                let resolution = observed.resolution();
                let exact = [resolution.max(1e-3)];
                effects.push(effect(member, &[highest], &exact, others));
                continue;
            }
        }
        let effect = effect(member, values, &half_widths[span], others);
        effects.push(effect);
    }
    effects
}

/// The reading that none exceeds and several reach.
fn plateau(observed: &Observed) -> Option<f64> {
    let recorded = observed.recorded();
    let highest = recorded.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let near = |value: &&f64| highest - **value < 1.5 * observed.resolution();
    (recorded.iter().filter(near).count() >= PLATEAU).then_some(highest)
}

pub(crate) fn effect(
    candidate: &Candidate,
    values: &[f64],
    half_widths: &[f64],
    alternatives: Vec<String>,
) -> Effect {
    let estimates = candidate.parameters.iter().zip(values).zip(half_widths);
    let parameters = estimates.map(|((parameter, &value), half)| {
        let estimate = Estimate {
            value,
            low: (value - half).max(parameter.low),
            high: (value + half).min(parameter.high),
            unit: parameter.unit.into(),
        };
        (parameter.name.to_owned(), estimate)
    });
    Effect {
        name: candidate.name.into(),
        kind: Some(candidate.kind),
        alternatives,
        equation: candidate.equation.into(),
        story: candidate.description.into(),
        parameters: parameters.collect(),
    }
}
