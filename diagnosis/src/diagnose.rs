//! From a recording to a finding: the whole way.
//!
//! Throttle and power first; then the noise; then every candidate alone, fitted and held out; two together where one leaves too much; then
//! where, how well, how surely, and what to measure next. It never forces a winner.

use std::collections::BTreeMap;

use crate::actuation::{self, Actuation, Found};
use crate::advice::advice;
use crate::candidates::{Candidate, Kind, applicable};
use crate::finding::{Effect, Estimate, Finding, HeldOut, Ranked, Region, Smallest};
use crate::fit::{Fit, Setting, refit_without};
use crate::hypothesis::Hypothesis;
use crate::intervals;
use crate::noise::{self, Noise};
use crate::observed::{COVARIATES, Explained, Observed};
use crate::outside::{self, Shape};
use crate::prove::Verdict;
use crate::random::Random;
use crate::recording::Recording;
use crate::select::{FOLDS, Selection, Singles, select, singles};

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

/// A held-out gain from which a selection stands without the gate: a chance below e^-40.
pub(crate) const BEYOND_DOUBT: f64 = 40.0;

/// Readings that make a plateau. Chosen here: in still rising air three hardly agree to the resolution.
const PLATEAU: usize = 3;

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
    let observed = Observed::new(recording)
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
    let mut selection = select(&setting, &candidates, tried, gate.passed);
    if !gate.passed && selection.chosen.gain.total < BEYOND_DOUBT {
        selection.withdraw();
    }
    let shape = outside::outside(&setting, &candidates, &selection, &gate);
    let of_chosen = |selection: &Selection| {
        let which = selection.chosen.which.iter();
        let members: Vec<&Candidate> = which.map(|&k| &candidates[k]).collect();
        setting.hypothesis(&members, &selection.chosen.fit.values)
    };
    let mut corrected = observed.predict(&of_chosen(&selection));
    if let Some(shape) = &shape {
        // What the trees add lies on top of the nearest that the library has, and is good inside the sampled hull only.
        let both = corrected.iter_mut().zip(&shape.correction);
        both.for_each(|(f, more)| *f += more);
        selection.withdraw();
    }
    let correction = of_chosen(&selection);
    let members: Vec<&Candidate> = selection
        .chosen
        .which
        .iter()
        .map(|&k| &candidates[k])
        .collect();
    let mut effects: Vec<Effect> = actuation
        .and_then(|actuation| actuation.found)
        .map(from_actuation)
        .into_iter()
        .collect();
    effects.extend(named(
        &candidates, &members, &observed, &selection, &noise,
    ));
    let ambiguous = effects.iter().any(|effect| !effect.alternatives.is_empty());
    let verdict = match (shape.is_some(), effects.is_empty(), ambiguous) {
        (true, _, _) => Verdict::OutsideLibrary,
        (false, true, _) => Verdict::None,
        (false, false, true) => Verdict::Ambiguous,
        (false, false, false) => Verdict::Library,
    };
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
        verdict,
        region: region(&observed, &noise, &corrected),
        held_out: held_out(&setting, &members, &selection, shape.as_ref(), &noise),
        candidates: ranked(&candidates, &selection),
        shape,
        chance: gate.p,
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

fn from_actuation(found: Found) -> Effect {
    let estimate = |value: f64, error: f64| Estimate {
        value,
        low: value - 1.96 * error,
        high: value + 1.96 * error,
        unit: "1".into(),
    };
    let (name, equation, story, parameter, value) = match found {
        Found::Payload {
            mass_factor,
            error,
            since_s,
            ..
        } => (
            "payload_mass",
            if since_s.is_finite() {
                "U -> U sqrt(m/m0) from t0 on"
            } else {
                "U -> U sqrt(m/m0)"
            },
            "the drone is heavier or lighter than stated: its throttle and its power say so",
            "m/m0",
            estimate(mass_factor, error),
        ),
        Found::Density {
            density_factor,
            error,
        } => (
            "air_density",
            "U -> U sqrt(rho0/rho)",
            "the air is thinner or thicker than stated: throttle and power say so",
            "rho/rho0",
            estimate(density_factor, error),
        ),
    };
    let mut parameters = BTreeMap::from([(parameter.to_owned(), value)]);
    if let Found::Payload {
        since_s,
        since_within_s,
        ..
    } = found
        && since_s.is_finite()
    {
        let at = Estimate {
            value: since_s,
            low: since_s - since_within_s,
            high: since_s + since_within_s,
            unit: "s".into(),
        };
        parameters.insert("t0".to_owned(), at);
    }
    Effect {
        name: name.into(),
        kind: Some(Kind::Physics),
        alternatives: Vec::new(),
        equation: equation.into(),
        story: story.into(),
        parameters,
    }
}

/// The chosen candidates with their intervals, and what each cannot be told from.
fn named(
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
        story: candidate.story.into(),
        parameters: parameters.collect(),
    }
}

/// Where baseline and corrected simulation differ by more than half a standard deviation.
fn region(observed: &Observed, noise: &Noise, corrected: &[f64]) -> Region {
    let inside: Vec<usize> = (0..corrected.len())
        .filter(|&i| (corrected[i] - observed.samples[i].simulated).abs() > 0.5 * noise.sd[i])
        .collect();
    if inside.is_empty() {
        return Region::default();
    }
    let count = inside.len() as f64;
    let error = |i: usize| observed.samples[i].residual();
    let mean_error = inside.iter().map(|&i| error(i)).sum::<f64>() / count;
    let recorded = inside
        .iter()
        .map(|&i| observed.samples[i].recorded)
        .sum::<f64>()
        / count;
    let square = inside
        .iter()
        .map(|&i| (error(i) / noise.sd[i]).powi(2))
        .sum::<f64>()
        / count;
    let mut bounds = BTreeMap::new();
    let mut narrow: Vec<(f64, String)> = Vec::new();
    for (name, column) in COVARIATES.iter().zip(&observed.covariates) {
        let within = span(inside.iter().map(|&i| column[i]).collect(), 0.05);
        let whole = span(column.clone(), 0.0);
        let part = (within[1] - within[0]) / (whole[1] - whole[0]);
        // A coordinate that the region covers as widely as the recording says nothing about it.
        if part < 0.7 {
            bounds.insert((*name).to_owned(), within);
            narrow.push((part, format!("{name} {:.2} to {:.2}", within[0], within[1])));
        }
    }
    narrow.sort_by(|a, b| a.0.total_cmp(&b.0));
    let words: Vec<String> = narrow.into_iter().take(SAID).map(|(_, text)| text).collect();
    let mut sample_indices: Vec<usize> = inside.iter().map(|&i| observed.samples[i].row).collect();
    sample_indices.sort_unstable();
    Region {
        description: if words.is_empty() {
            "everywhere".into()
        } else {
            words.join(", ")
        },
        bounds,
        sample_indices,
        share: count / corrected.len() as f64,
        mean_error,
        relative_error: mean_error / recorded,
        error_over_noise: square.sqrt(),
    }
}

/// Coordinates that a region is described by: those that narrow it most.
const SAID: usize = 3;

/// The values without so much at either end.
fn span(mut values: Vec<f64>, tail: f64) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    let at = |share: f64| {
        values
            .get((share * last as f64).round() as usize)
            .copied()
            .unwrap_or(0.0)
    };
    [at(tail), at(1.0 - tail)]
}

/// Errors on blocks by turns left out of the fit.
fn held_out(
    setting: &Setting,
    members: &[&Candidate],
    selection: &Selection,
    shape: Option<&Shape>,
    noise: &Noise,
) -> HeldOut {
    let squares = |setting: &Setting, members: &[&Candidate], fit: &Fit| {
        let recorded = setting.observed.recorded();
        let mut squares = vec![0.0; recorded.len()];
        for fold in 0..FOLDS {
            let predicted = refit_without(setting, members, fit, fold, FOLDS);
            for i in 0..recorded.len() {
                if noise.block[i] % FOLDS == fold {
                    squares[i] = (recorded[i] - predicted[i]).powi(2);
                }
            }
        }
        squares
    };
    let rms = |squares: &[f64]| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    // Before: without what throttle and power have answered already.
    let mut plain = setting.clone();
    plain.base = Hypothesis::default();
    let before = squares(&plain, &[], &plain.nothing());
    let after = match shape {
        // The trees' corrections are held out themselves; what they lie on is a handful of parameters.
        Some(shape) => shape.left.iter().map(|left| left * left).collect(),
        None => squares(setting, members, &selection.chosen.fit),
    };
    let mut blocks = vec![(0.0, 0.0); noise.blocks];
    for (square, &block) in after.iter().zip(&noise.block) {
        blocks[block].0 += square;
        blocks[block].1 += 1.0;
    }
    // Blocks drawn with replacement; 200 are enough for two digits of a 95 % interval.
    let mut random = Random::new(noise.blocks as u64);
    let mut drawn: Vec<f64> = (0..200)
        .map(|_| {
            let picked = (0..blocks.len()).map(|_| blocks[random.index(blocks.len())]);
            let (sum, count) = picked.fold((0.0, 0.0), |(s, c), (a, b)| (s + a, c + b));
            (sum / f64::max(count, 1.0)).sqrt()
        })
        .collect();
    drawn.sort_by(f64::total_cmp);
    let variances: Vec<f64> = noise.sd.iter().map(|sd| sd * sd).collect();
    HeldOut {
        rms_before: rms(&before),
        rms_after: rms(&after),
        rms_after_low: drawn[4],
        rms_after_high: drawn[195],
        noise_floor: rms(&variances),
    }
}

pub(crate) fn ranked(candidates: &[Candidate], selection: &Selection) -> Vec<Ranked> {
    let of = |tried: &crate::select::Tried| {
        let candidate = &candidates[tried.which[0]];
        let names = candidate
            .parameters
            .iter()
            .map(|parameter| parameter.name.to_owned());
        Ranked {
            name: candidate.name.into(),
            gain: tried.gain.total,
            gain_error: tried.gain.error,
            practical: tried.practical,
            parameters: names.zip(tried.fit.values.iter().copied()).collect(),
        }
    };
    selection.singles.iter().map(of).collect()
}

/// Minimal departures that this recording would have shown: 80 % power at 5 %.
pub(crate) fn smallest(
    setting: &Setting,
    candidates: &[Candidate],
    noise: &Noise,
) -> Vec<Smallest> {
    let clean = setting.observed.predict(&setting.base);
    candidates
        .iter()
        .filter_map(|candidate| {
            let parameter = candidate.parameters.first()?;
            let mut values = candidate.starts.first()?.clone();
            let step = values[0] - parameter.neutral;
            let changed = setting
                .observed
                .predict(&candidate.on(&setting.base, &values));
            values[0] = parameter.neutral;
            let change: Vec<f64> = changed
                .iter()
                .zip(&clean)
                .map(|(to, from)| (to - from) / step)
                .collect();
            let square: f64 = noise.whiten(&change).iter().map(|g| g * g).sum();
            (square > 0.0).then(|| Smallest {
                name: candidate.name.into(),
                parameter: parameter.name.into(),
                departure: (1.96 + 0.84) / square.sqrt(),
                unit: parameter.unit.into(),
            })
        })
        .collect()
}
