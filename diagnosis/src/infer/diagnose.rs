//! From a recording to a finding: the whole way.
//!
//! Throttle and power first; then the noise; then every candidate alone, fitted and held out; two together where one leaves too much; then
//! where, how well, how surely, and what to measure next. It never forces a winner.

mod figures;
mod named;
mod region;

use figures::held_out;
pub(crate) use figures::{ranked, smallest};
pub(crate) use named::effect;
use named::{from_actuation, named};
use region::region;

use crate::forward::hypothesis::Hypothesis;
use crate::forward::observed::{Explained, Observed};
use crate::forward::simulate::Channel;
use crate::infer::actuation::{self, Actuation};
use crate::infer::advice::advice;
use crate::infer::candidates::{Candidate, applicable};
use crate::infer::finding::{Effect, Finding, Perhaps, verdict};
use crate::infer::fit::Setting;
use crate::infer::noise::{self, Noise};
use crate::infer::outside;
use crate::infer::select::{FOLDS, Selection, Singles, select, singles};
use crate::record::recording::Recording;

/// Why a recording cannot be diagnosed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DiagnoseError {
    /// Nothing recorded that could be simulated.
    #[error("\"{0}\" has no reading of a probe or a receiver that could be simulated")]
    NothingToCompare(String),
    /// Too little to split.
    #[error(
        "\"{name}\" has {blocks} blocks of independent readings; at least {least} are needed to hold any out"
    )]
    TooShort {
        /// The recording.
        name: String,
        /// Blocks in it.
        blocks: usize,
        /// Blocks needed.
        least: usize,
    },
}

/// A held-out gain from which a selection stands without the gate, and how many standard errors it must be: where the scatter is read
/// too small, a gain alone says little.
const BEYOND_DOUBT: f64 = 40.0;
const BEYOND_DOUBT_ERRORS: f64 = 4.0;

/// Whether a held-out gain needs no gate.
pub(crate) fn is_beyond_doubt(gain: f64, error: f64) -> bool {
    gain > BEYOND_DOUBT.max(BEYOND_DOUBT_ERRORS * error)
}

/// Most times that the noise is read again around the best explanation so far, and what a clearly smaller one is, as a share.
const NOISE_ROUNDS: usize = 2;
const CLEARLY_LESS: f64 = 0.95;
/// How much likelier (log density) the recording must become with it. Chosen here: noise alone gives a few.
const LIKELIER: f64 = 20.0;

/// Diagnoses one recording.
///
/// # Errors
/// Nothing that can be compared, or too little to hold any of it out.
pub fn diagnose(recording: &Recording) -> Result<Finding, DiagnoseError> {
    diagnose_channel(recording, None)
}

/// Diagnoses one channel of a recording: the first that it has where none is named.
///
/// # Errors
/// Nothing of that channel that can be compared, or too little to hold any of it out.
pub fn diagnose_channel(
    recording: &Recording,
    channel: Option<Channel>,
) -> Result<Finding, DiagnoseError> {
    let observed = Observed::of(recording, channel)
        .ok_or_else(|| DiagnoseError::NothingToCompare(recording.name.clone()))?;
    let actuation = actuation::actuation(recording);
    let mut base = Hypothesis::default();
    if let Some(found) = actuation.and_then(|actuation| actuation.found) {
        found.set(&mut base);
    }
    let candidates: Vec<Candidate> = applicable(&observed)
        .into_iter()
        .filter(|candidate| possible(candidate, actuation.as_ref()))
        .collect();
    let simulated = observed.predict(&base);
    let mut noise = noise::noise(&observed, &simulated);
    if noise.blocks < FOLDS {
        return Err(DiagnoseError::TooShort {
            name: recording.name.clone(),
            blocks: noise.blocks,
            least: FOLDS,
        });
    }
    let mut tried = singles(&Setting::new(&observed, &noise, base), &candidates);
    // What is missing may itself look like noise from one sample to the next: a lag, a clock. The best explanation tells.
    for _ in 0..NOISE_ROUNDS {
        let Some(clearer) = clearer(&observed, &noise, &tried) else {
            break;
        };
        noise = clearer;
        tried = singles(&Setting::new(&observed, &noise, base), &candidates);
    }
    let setting = Setting::new(&observed, &noise, base);
    let gate = outside::anything(&setting, &candidates, &tried.nothing.fit);
    let mut selection = select(&setting, &candidates, tried, gate.p);
    let gain = &selection.chosen.gain;
    if !gate.passed && !is_beyond_doubt(gain.total, gain.error) {
        selection.withdraw();
    }
    let shape = outside::outside(&setting, &candidates, &selection, &gate);
    let of_chosen = |selection: &Selection| {
        let chosen = &selection.chosen;
        setting.hypothesis(&chosen.members(&candidates), &chosen.fit.values)
    };
    let mut corrected = observed.predict(&of_chosen(&selection));
    if let Some(shape) = &shape {
        // What the trees add lies on top of the nearest that the library has, and is good inside the sampled hull only.
        let both = corrected.iter_mut().zip(&shape.correction);
        both.for_each(|(f, more)| *f += more);
        selection.withdraw();
    }
    let correction = of_chosen(&selection);
    let members = selection.chosen.members(&candidates);
    let mut effects: Vec<Effect> = actuation
        .and_then(|actuation| actuation.found)
        .map(from_actuation)
        .into_iter()
        .collect();
    effects.extend(named(&candidates, &members, &observed, &selection, &noise));
    let rows = observed
        .samples
        .iter()
        .map(|sample| sample.row + 1)
        .max()
        .unwrap_or(0);
    let mut prediction = vec![f64::NAN; rows];
    for (sample, value) in observed.samples.iter().zip(&corrected) {
        prediction[sample.row] = *value;
    }
    Ok(Finding {
        recording: recording.name.clone(),
        channel: observed.channel,
        samples: observed.samples.len(),
        verdict: verdict(shape.is_some(), &effects),
        region: region(&observed, &noise, &corrected),
        held_out: held_out(&setting, &members, &selection, shape.as_ref(), &noise),
        candidates: ranked(&candidates, &selection),
        shape,
        chance: gate.p,
        perhaps: selection.withheld.map(|(second, more)| Perhaps {
            name: candidates[second].name.into(),
            gain: more.total,
            gain_error: more.error,
        }),
        advice: advice(&setting, &observed, &candidates, &selection),
        smallest: smallest(&setting, &candidates, &noise),
        effects,
        prediction,
        correction,
    })
}

/// The scatter around the single explanation that makes the recording likeliest, each with its own scatter; `None` where that is not
/// clearly less than before.
fn clearer(observed: &Observed, noise: &Noise, tried: &Singles) -> Option<Noise> {
    let recorded = observed.recorded();
    let likelihood = |noise: &Noise, predicted: &[f64]| {
        let left: Vec<f64> = recorded.iter().zip(predicted).map(|(y, f)| y - f).collect();
        noise.whitener.log_density(&left)
    };
    let before = likelihood(noise, &tried.nothing.fit.predicted);
    let (now, around) = tried
        .singles
        .iter()
        .map(|single| {
            let around = noise::noise(observed, &single.fit.predicted);
            (likelihood(&around, &single.fit.predicted), around)
        })
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    let change: f64 = around
        .sd
        .iter()
        .zip(&noise.sd)
        .map(|(now, before)| (now / before).ln())
        .sum();
    let is_less = change / (noise.sd.len() as f64) < CLEARLY_LESS.ln();
    (is_less && now - before > LIKELIER).then_some(around)
}

/// A payload shows in the throttle and has been looked for there: where that is logged it is no candidate any more.
fn possible(candidate: &Candidate, actuation: Option<&Actuation>) -> bool {
    actuation.is_none() || candidate.name != "payload_mass"
}
