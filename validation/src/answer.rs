//! What a diagnosis answers, as far as it is assessed: plain data.

use std::collections::BTreeMap;

use diagnosis::infer::candidates::essential;
use diagnosis::infer::diagnose::diagnose;
use diagnosis::infer::finding::{Effect, Estimate, Finding, Verdict};
use diagnosis::record::recording::Recording;
use serde::{Deserialize, Serialize};

/// What a diagnosis says of one recording.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Whether something is missing.
    pub verdict: Verdict,
    /// What, ambiguous or not: the name put first of each effect, and with it those that it cannot
    /// be told from.
    pub effects: Vec<Named>,
    /// Rows of `probes.csv`, or of `receiver.csv` where there are no probes, in which it says the
    /// difference lies.
    pub region: Vec<usize>,
    /// The corrected simulation of each of those files' rows; not a number where it has none.
    /// Empty: the simulation as it was.
    pub prediction: Vec<f64>,
    /// Whether an effect is named although its correction predicts held-out readings worse than
    /// the simulation as it is.
    pub rises: bool,
    /// Whether a parameter that makes up an effect that is named sits at an end of its range.
    pub at_bound: bool,
    /// How long it took (s), as its caller measured.
    pub seconds: f64,
}

/// One effect that is named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Named {
    /// The name put first.
    pub name: String,
    /// Names that it cannot be told from.
    pub alternatives: Vec<String>,
    /// Its parameters by name.
    pub parameters: BTreeMap<String, Estimate>,
}

impl Answer {
    /// "Nothing is missing", at once.
    #[must_use]
    pub fn nothing() -> Answer {
        Answer {
            verdict: Verdict::None,
            effects: Vec::new(),
            region: Vec::new(),
            prediction: Vec::new(),
            rises: false,
            at_bound: false,
            seconds: 0.0,
        }
    }
}

/// What [`diagnose`] answers; a recording that cannot be diagnosed is one in which nothing was
/// found.
#[must_use]
pub fn ask(recording: &Recording) -> Answer {
    diagnose(recording).map_or_else(|_| Answer::nothing(), |finding| answer(&finding))
}

/// Whether what makes up an effect was driven to an end of its range.
fn is_at_bound(effect: &Effect) -> bool {
    let essential = essential(&effect.name);
    let mut parameters = effect.parameters.iter();
    parameters.any(|(name, of)| of.at_bound && essential.contains(&name.as_str()))
}

/// The part of a finding that is assessed.
#[must_use]
pub fn answer(finding: &Finding) -> Answer {
    let named = |effect: &Effect| Named {
        name: effect.name.clone(),
        alternatives: effect.alternatives.clone(),
        parameters: effect.parameters.clone(),
    };
    Answer {
        verdict: finding.verdict,
        effects: finding.effects.iter().map(named).collect(),
        region: finding.region.sample_indices.clone(),
        prediction: finding.prediction.clone(),
        rises: !finding.effects.is_empty()
            && finding.held_out.rms_after > finding.held_out.rms_before,
        at_bound: finding.effects.iter().any(is_at_bound),
        seconds: 0.0,
    }
}
