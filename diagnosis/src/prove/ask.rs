//! The diagnosis as the proof asks it.

use std::collections::BTreeMap;

use super::answer::{Answer, Named};
use crate::infer::diagnose::diagnose;
use crate::infer::finding::{Effect, Finding};
use crate::record::recording::Recording;

/// What [`diagnose`] answers; a recording that cannot be diagnosed is one in which nothing was found.
#[must_use]
pub fn ask(recording: &Recording) -> Answer {
    diagnose(recording).map_or_else(|_| Answer::nothing(), |finding| answer(&finding))
}

/// The part of a finding that is marked.
#[must_use]
pub fn answer(finding: &Finding) -> Answer {
    let named = |effect: &Effect| Named {
        name: effect.name.clone(),
        alternatives: effect.alternatives.clone(),
        parameters: effect
            .parameters
            .iter()
            .map(|(name, estimate)| (name.clone(), estimate.interval()))
            .collect::<BTreeMap<_, _>>(),
    };
    Answer {
        verdict: finding.verdict,
        effects: finding.effects.iter().map(named).collect(),
        region: finding.region.sample_indices.clone(),
        prediction: finding.prediction.clone(),
        seconds: 0.0,
    }
}
