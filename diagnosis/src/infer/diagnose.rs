//! From a recording to a finding.
//!
//! Throttle and power first; then the noise; then every candidate alone, fitted and held out; two
//! together where one leaves too much; then where, how well, how surely, and what to measure next.
//! It never forces a winner.

use std::collections::BTreeMap;

use crate::forward::hypothesis::Hypothesis;
use crate::forward::mistakes::{Mistake, mistaken};
use crate::forward::observed::{COVARIATES, Explained, MOST_SAMPLES, Observed, PROBE};
use crate::forward::simulate::Channel;
use crate::infer::actuation::{self, Actuation, Cause, actuation};
use crate::infer::advice::advice;
use crate::infer::candidates::{Candidate, Kind, Scope, applicable};
use crate::infer::finding::{
    Detectable, Effect, Estimate, Finding, HeldOut, Ranked, Region, RunnerUp, Withdrawn, verdict,
};
use crate::infer::fit::{Fit, Setting, by_member};
use crate::infer::intervals::half_widths;
use crate::infer::noise::noise;
use crate::infer::outside::{
    Remains, Shape, global_test, is_beyond_doubt, is_sure, outside, standing,
};
use crate::infer::scopes::{self, SATURATION, in_parts};
use crate::infer::select::{Selection, Singles, Tried, flexible, select, singles};
use crate::record::baseline::ReceiverLaw;
use crate::record::recording::Recording;
use crate::statistics::bootstrap::intervals_95;
use crate::statistics::held_out::{FOLDS, Gain};
use crate::statistics::lack_of_fit::minimum_detectable;
use crate::statistics::noise::Noise;
use crate::statistics::quantile::{difference, nearest_rank, root_mean_square};
use crate::statistics::sequence::{Sequence, large_follow_large};
use crate::statistics::trees::{self, HeldOut as HeldOutTrees};

/// Why a recording cannot be diagnosed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DiagnoseError {
    /// Nothing recorded that could be simulated.
    /// It holds the recording's name, and what it lacks.
    #[error("\"{0}\" has nothing to compare: {1}")]
    NothingToCompare(String, String),
    /// Too little to split.
    /// It holds the recording's name, and how many blocks it has.
    #[error(
        "\"{0}\" has {1} blocks of independent readings; at least {FOLDS} are needed to hold any out"
    )]
    TooShort(String, usize),
    /// A slip of units or axes, which no physics explains.
    #[error("\"{0}\": {message}; {help}", message = .1.message, help = .1.help)]
    Mistaken(String, Mistake),
}

impl DiagnoseError {
    /// Of a channel, or of any: what the recording lacks.
    #[must_use]
    pub fn nothing_to_compare(recording: &Recording, channel: Option<Channel>) -> DiagnoseError {
        let any = [Channel::Speed, Channel::Throttle, Channel::Power];
        let asked = channel.as_ref().map_or(&any[..], std::slice::from_ref);
        let lacking = asked.iter().map(|channel| lacking(recording, *channel));
        let lacking: Vec<&str> = lacking.collect();
        DiagnoseError::NothingToCompare(recording.name.clone(), lacking.join("; "))
    }
}

/// Why nothing of a channel can be compared.
fn lacking(recording: &Recording, channel: Channel) -> &'static str {
    let holds_power = recording.baseline.receiver_law == ReceiverLaw::HoldsPower;
    let mut tracks = recording.vehicles.iter().map(|vehicle| &vehicle.track);
    match channel {
        Channel::Speed if recording.probes.is_none() => "no speed, for probes.csv is missing",
        Channel::Speed => "no speed of a probe at a time when every drone's place is known",
        Channel::Throttle | Channel::Power if recording.receivers.is_empty() => match channel {
            Channel::Throttle => "no throttle, for receiver.csv is missing",
            _ => "no power, for receiver.csv is missing",
        },
        Channel::Throttle if holds_power => {
            "no throttle, for by the baseline's `receiver_law` receivers hold theirs"
        }
        Channel::Power if holds_power => {
            "no power, for by the baseline's `receiver_law` receivers hold theirs"
        }
        Channel::Throttle => "no throttle of a receiver whose place is known",
        Channel::Power if tracks.all(|track| track.power_w.is_none()) => {
            "no power, for `power_w` is missing in vehicles.csv"
        }
        Channel::Power => "no power of a receiver that is out of all wakes for a while",
        Channel::VerticalForce => "no force: only flight logs tell of it",
    }
}

/// Most times that the noise is read again around the best explanation so far, and what a clearly
/// smaller one is, as a share. Chosen here.
const NOISE_ROUNDS: usize = 2;
const CLEARLY_LESS: f64 = 0.95;
/// How much likelier (log density) the recording must become with it. Chosen here: noise alone
/// gives a few.
const LIKELIER: f64 = 20.0;
/// Readings that make a plateau. Chosen here: in still rising air three hardly agree to the
/// resolution.
const PLATEAU: usize = 3;
/// Coordinates that a region is described by: those whose box tells it best from the rest, each
/// less than this part of what the recording covers, and how much more of the union of box and
/// region must be in both with each. Chosen here.
const SAID: usize = 3;
const NARROW: f64 = 0.7;
const TELLS: f64 = 0.01;
/// Differences up to which two coordinates are the same: rounding.
const SAME: f64 = 1e-9;
/// Covariates that count from the drone above, and part of a region that lies below one, or below
/// none, for that to be said. Chosen here.
const OF_A_DRONE: [&str; 13] = [
    "s/l",
    "r/l",
    "xi",
    "cos az",
    "sin az",
    "emitter z m",
    "emitter speed m/s",
    "climb m/s",
    "height/half-width",
    "cos az body",
    "sin az body",
    "emitter x m",
    "emitter y m",
];
const MOSTLY: f64 = 0.8;
/// Part of the samples from which a region is no part of the recording, and part of what a
/// correction changes (squares over the noise) from which it is of one probe. Chosen here.
pub(crate) const NEARLY_ALL: f64 = 0.9;
/// Part of a coordinate's values at either end that a range leaves out. Chosen here.
const TAIL: f64 = 0.05;
/// p-value below which readings contradict what throttle and power say. Chosen here: a right name
/// of which readings show nothing is withdrawn once in twenty.
const CONTRADICTED_P: f64 = 0.05;
/// What settles an answer that throttle and power gave.
const WEIGH: &str =
    "each drone on a scale with its battery, and pressure and temperature where it flies";
/// Draws of blocks for an interval of an error: enough for two digits.
const DRAWS: usize = 200;

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
    let whole = Observed::of(recording, channel)
        .ok_or_else(|| DiagnoseError::nothing_to_compare(recording, channel))?;
    if let Some(mistake) = mistaken(recording) {
        return Err(DiagnoseError::Mistaken(recording.name.clone(), mistake));
    }
    let thinned = whole.thinned(MOST_SAMPLES);
    let every = thinned.as_ref().map_or(1, |(_, every)| *every);
    let mut observed = thinned.map_or_else(|| whole.clone(), |(thinned, _)| thinned);
    observed.look();
    let mut candidates = applicable(&observed);
    // A payload shows in the throttle and has been looked for there: where that is logged it is no
    // candidate any more.
    if actuation::is_logged(recording) {
        candidates.retain(|candidate| candidate.name != "payload_mass");
    }
    let Actuation {
        cause,
        is_confirmed,
        receiver_load,
        ..
    } = actuation(recording);
    let mut base = Hypothesis::default();
    if let Some(cause) = &cause {
        cause.set(&mut base);
    }
    let mut noise = noise(&observed, &observed.predict(&base));
    let blocks = noise.blocks.count();
    if blocks < FOLDS {
        return Err(DiagnoseError::TooShort(recording.name.clone(), blocks));
    }
    let mut tried = singles(&Setting::new(&observed, &noise, &candidates, base));
    // What is missing may itself look like noise from one sample to the next: a lag, a clock. The
    // best explanation decides.
    for _ in 0..NOISE_ROUNDS {
        let Some(clearer) = clearer(&observed, &noise, &tried) else {
            break;
        };
        noise = clearer;
        tried = singles(&Setting::new(&observed, &noise, &candidates, base));
    }
    let setting = Setting::new(&observed, &noise, &candidates, base);
    let test = global_test(&setting, &tried.nothing.fit);
    if test.is_significant {
        let parts = in_parts(&setting, &tried);
        candidates.extend(parts);
    }
    let setting = Setting::new(&observed, &noise, &candidates, base);
    scopes::add(&setting, &mut tried);
    // What sets in part-way passed for noise until now.
    if let Some(clearer) = clearer(&observed, &noise, &tried) {
        noise = clearer;
        let setting = Setting::new(&observed, &noise, &candidates, base);
        tried = singles(&setting);
        scopes::add(&setting, &mut tried);
    }
    let setting = Setting::new(&observed, &noise, &candidates, base);
    let mut selection = select(&setting, tried, test.p);
    if !test.is_significant && !is_beyond_doubt(&selection.chosen.gain) {
        selection.withdraw();
    }
    let left = flexible(&setting, &selection.chosen.fit);
    let is_of_probes = observed.channel == Channel::Speed;
    let shape = outside(&setting, &selection, &test, &left, is_of_probes);
    let shape = shape.and_then(|shape| standing(&setting, &selection, shape));
    // Beyond a shape that predicts something, what trees still take from what it leaves; beside one
    // that does not, nothing is named.
    let left = match &shape {
        Some(shape) if shape.is_predictable => {
            trees::held_out(&observed.covariates, &shape.left, &noise)
        }
        Some(_) => flexible(&setting, &selection.nothing.fit),
        None => left,
    };
    let remains = remains(&observed, &noise, &left);
    let chosen = &selection.chosen;
    let mut corrected = setting.predicted(&chosen.members(&candidates), &chosen.fit.values);
    let laws = (chosen.which.clone(), chosen.fit.values.clone());
    if let Some(shape) = &shape {
        // What the trees add lies on top of the nearest that the library has, with the gain and the
        // offset that it was fitted beside, and is good inside the sampled hull only.
        if shape.is_predictable {
            corrected.clone_from(&chosen.fit.predicted);
        }
        let both = corrected.iter_mut().zip(&shape.correction);
        both.for_each(|(f, more)| *f += more);
        selection.withdraw();
    }
    let mut next = advice(&setting, &observed, &selection, shape.as_ref());
    let is_of_two = |cause: &Cause| cause.alternative.is_some();
    if cause.is_some() && next.is_empty() || cause.as_ref().is_some_and(is_of_two) {
        next.push(WEIGH.to_owned());
    }
    let of_cause = |cause| from_actuation(cause, is_confirmed);
    let mut effects: Vec<Effect> = cause.iter().map(of_cause).collect();
    effects.extend(named(&setting, &observed, &selection));
    if receiver_load.is_some() && observed.channel != Channel::Speed {
        effects.iter_mut().for_each(or_a_load);
        next.push(WEIGH.to_owned());
    }
    let (mut held_out, less) = held_out(&setting, &selection, shape.as_ref());
    let mut correction = setting.explanation(&selection.chosen);
    let mut withdrawn = None;
    let mut plain = setting.clone();
    plain.base = Hypothesis::default();
    let mut laws = laws;
    // Throttle and power are readings of their own: what they say stands unless blocks of the
    // others agree that it makes them worse. Beside a term that was fitted it stands where both
    // say it, for the two may mask one another in the readings; what throttle alone says and a
    // term cancels is a column that reads wrong, unless blocks agree that they are better for it.
    let is_refuted = match selection.chosen.which.is_empty() {
        true => less.p_of_loss() < CONTRADICTED_P,
        false => cause.is_some() && !is_confirmed && less.p_of_gain() > CONTRADICTED_P,
    };
    if is_refuted && !effects.is_empty() {
        withdrawn = Some(Withdrawn {
            effects: std::mem::take(&mut effects),
            rms_after: held_out.rms_after,
            p: less.p_of_loss(),
        });
        if shape.is_none() {
            // Nothing of it stands: neither in the prediction nor in what is flown.
            selection.withdraw();
            selection.chosen.fit = plain.nothing();
            (held_out, _) = self::held_out(&plain, &selection, None);
            correction = Hypothesis::default();
            corrected = plain.predicted(&[], &[]);
            laws = (Vec::new(), Vec::new());
        }
    }
    // As it is read around the answer: what was missing passed for noise where it changes from one
    // reading to the next.
    let around = self::noise(&observed, &corrected);
    let mut sd = match is_clearly_less(&around, &noise) {
        true => around.sd().to_vec(),
        false => noise.sd().to_vec(),
    };
    held_out.noise_floor = root_mean_square(&sd).min(held_out.rms_after);
    let sequence = Sequence::new(&observed.times_s(), &observed.series_of);
    let after = difference(&observed.recorded(), &corrected);
    let errors_follow = large_follow_large(&sequence, &after, &sd);
    if every > 1 {
        // The laws at every sample, and what has none as at the nearest that was fitted.
        let (which, values) = laws;
        let members: Vec<&Candidate> = which.iter().map(|&k| &candidates[k]).collect();
        let under = if withdrawn.is_some() && shape.is_none() {
            &plain
        } else {
            &setting
        };
        let beyond = difference(&corrected, &under.predicted(&members, &values));
        corrected = under.of(&whole).predicted(&members, &values);
        let beyond = whole.carried(&observed, &beyond);
        corrected
            .iter_mut()
            .zip(beyond)
            .for_each(|(f, more)| *f += more);
        sd = whole.carried(&observed, &sd);
    }
    let last = whole.samples.iter().map(|sample| sample.row).max();
    let mut prediction = vec![f64::NAN; last.map_or(0, |last| last + 1)];
    for (sample, value) in whole.samples.iter().zip(&corrected) {
        prediction[sample.row] = *value;
    }
    let runner_up = selection.runner_up.as_ref().map(|(second, more)| RunnerUp {
        name: candidates[*second].name.into(),
        gain: more.total,
        gain_error: more.standard_error,
    });
    Ok(Finding {
        recording: recording.name.clone(),
        channel: observed.channel,
        samples: whole.samples.len(),
        fitted_every: every,
        verdict: verdict(shape.is_some() || withdrawn.is_some(), &effects),
        withdrawn,
        region: region(&whole, &sd, &corrected),
        errors_follow,
        held_out,
        candidates: ranked(&candidates, &selection),
        shape,
        remains,
        p: test.p,
        runner_up,
        advice: next,
        detectable: detectable(&setting),
        effects,
        prediction,
        correction,
    })
}

/// What trees predict of what the answer leaves.
fn remains(observed: &Observed, noise: &Noise, left: &HeldOutTrees) -> Remains {
    let simulated = vec![0.0; left.predictions.len()];
    let inside = departing(&simulated, &left.predictions, noise.sd());
    let (description, _) = bounds(observed, &inside);
    Remains {
        gain: left.gain.total,
        gain_error: left.gain.standard_error,
        is_sure: is_sure(&left.gain),
        rms: root_mean_square(&left.predictions),
        share: inside.len() as f64 / left.predictions.len() as f64,
        description,
    }
}

/// The scatter around the single explanation that makes the recording likeliest, each with its own
/// scatter; `None` where that is not clearly less than before.
fn clearer(observed: &Observed, before: &Noise, tried: &Singles) -> Option<Noise> {
    let recorded = observed.recorded();
    let likelihood = |noise: &Noise, predicted: &[f64]| {
        let left = difference(&recorded, predicted);
        noise.whitener.log_density(&left)
    };
    let likelihood_before = likelihood(before, &tried.nothing.fit.predicted);
    let singles = tried.singles.iter().map(|single| {
        let around = noise(observed, &single.fit.predicted);
        (likelihood(&around, &single.fit.predicted), around)
    });
    let (likelihood, around) = singles.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let is_less = is_clearly_less(&around, before);
    (is_less && likelihood - likelihood_before > LIKELIER).then_some(around)
}

fn is_clearly_less(around: &Noise, before: &Noise) -> bool {
    let pairs = around.sd().iter().zip(before.sd());
    let change: f64 = pairs.map(|(now, before)| (now / before).ln()).sum();
    change / (before.sd().len() as f64) < CLEARLY_LESS.ln()
}

/// Errors on blocks left out of the fit, fold by fold, and by how much their squares have become
/// less, block by block.
fn held_out(setting: &Setting, selection: &Selection, shape: Option<&Shape>) -> (HeldOut, Gain) {
    let of_fit = |setting: &Setting, members: &[&Candidate], fit: &Fit| {
        setting.left(&setting.predicted_held_out(members, fit))
    };
    let chosen = &selection.chosen;
    // Before: without what throttle and power have answered already.
    let mut plain = setting.clone();
    plain.base = Hypothesis::default();
    let nothing = plain.nothing();
    let before = of_fit(&plain, &[], &nothing);
    let after = match shape {
        // The trees' corrections are held out themselves; what they lie on is a handful of
        // parameters.
        Some(shape) if shape.is_predictable => shape.left.clone(),
        _ => of_fit(setting, &chosen.members(setting.candidates), &chosen.fit),
    };
    let blocks = &setting.noise.blocks;
    let [squares_before, squares] = [&before, &after].map(|left| left.iter().map(|e| e * e));
    let less = Gain::over_each(blocks, squares_before, squares.clone());
    let sums = blocks.sums(squares);
    let counts = blocks.sums(after.iter().map(|_| 1.0));
    let seed = blocks.count() as u64;
    let [[low, high]] = intervals_95(blocks.count(), DRAWS, seed, |picked| {
        let sum = |of: &[f64]| picked.iter().map(|&b| of[b]).sum::<f64>();
        [(sum(&sums) / sum(&counts).max(1.0)).sqrt()]
    });
    let held_out = HeldOut {
        rms_before: root_mean_square(&before),
        rms_after: root_mean_square(&after),
        rms_after_low: low,
        rms_after_high: high,
        noise_floor: root_mean_square(setting.noise.sd()),
        instruments: nothing.tolerance.len(),
        tolerance_before: mean(&nothing.tolerance),
        tolerance_after: match shape {
            Some(shape) if shape.is_predictable => mean(&shape.tolerance),
            _ => mean(&chosen.fit.tolerance),
        },
    };
    (held_out, less)
}

/// Gain and offset of instruments on average.
pub(crate) fn mean(tolerance: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|k| tolerance.iter().map(|it| it[k]).sum::<f64>() / tolerance.len() as f64)
}

/// Every candidate alone, best first.
pub(crate) fn ranked(candidates: &[Candidate], selection: &Selection) -> Vec<Ranked> {
    let of = |tried: &Tried| {
        let candidate = &candidates[tried.which[0]];
        let names = candidate.parameters.iter().map(|p| p.name.to_owned());
        let since = candidate.scope.onset();
        let since = since.map(|of| ("t0".to_owned(), of.at_s));
        Ranked {
            name: candidate.name.into(),
            gain: tried.gain.total,
            gain_error: tried.gain.standard_error,
            practical: tried.practical,
            parameters: names
                .zip(tried.fit.values.iter().copied())
                .chain(since)
                .collect(),
            at_bound: candidate.is_at_bound(&tried.fit.values),
            probe: candidate.scope.probe(),
        }
    };
    selection.singles.iter().map(of).collect()
}

/// Minimum detectable departures of the first parameter of every candidate that has one in its
/// range: 80 % power at the level of the global test, beside what gain and offset may take. A
/// ceiling, which changes nothing until it is reached, has none.
pub(crate) fn detectable(setting: &Setting) -> Vec<Detectable> {
    let clean = setting.observed.predict(&setting.base);
    let always = || {
        setting
            .candidates
            .iter()
            .filter(|of| of.scope == Scope::Whole)
    };
    let laws = always().map(|of| of.starts.len()).sum();
    let tolerated = setting.tolerated(&clean);
    let of = |candidate: &Candidate| {
        let parameter = candidate.parameters.first()?;
        let values = candidate.starts.first()?;
        let step = values[0] - parameter.neutral;
        let mut tangent = setting.change(candidate, values, &clean);
        tangent.iter_mut().for_each(|change| *change /= step);
        let tangent = setting.noise.whiten(&tangent);
        let departure = minimum_detectable(&tangent, &tolerated, laws)?;
        let ends = [parameter.low, parameter.high];
        let is_in_range = |end: f64| departure <= (end - parameter.neutral).abs();
        ends.into_iter().any(is_in_range).then(|| Detectable {
            name: candidate.name.into(),
            parameter: parameter.name.into(),
            departure,
            unit: parameter.unit.into(),
        })
    };
    let has_tangent = |of: &&Candidate| of.name != SATURATION;
    always().filter(has_tangent).filter_map(of).collect()
}

/// What throttle says, and power where it is logged, as an effect.
fn from_actuation(cause: &Cause, is_confirmed: bool) -> Effect {
    let spec = cause.spec();
    let known = cause.values.iter().zip(&cause.half_widths);
    let known = spec.components().zip(known);
    // A moment that is not finite is none.
    let known = known.filter(|(_, (value, _))| value.is_finite());
    let estimates = known.map(|((parameter, symbol), (value, half))| {
        let estimate = Estimate::around(*value, *half, parameter.unit);
        (symbol.to_owned(), estimate)
    });
    let parameters: BTreeMap<String, Estimate> = estimates.collect();
    let always = spec.equation.trim_end_matches(" from t0 on");
    let span = match ["t0", "t1"].map(|of| parameters.contains_key(of)) {
        [false, false] => "",
        [true, false] => " from t0 on",
        [false, true] => " until t1",
        [true, true] => " from t0 to t1",
    };
    let equation = format!("{always}{span}");
    Effect {
        name: spec.name.into(),
        kind: Some(Kind::Physics),
        alternatives: cause
            .alternative
            .iter()
            .map(|of| (*of).to_owned())
            .collect(),
        equation,
        description: match is_confirmed {
            true => format!("{}: throttle and power say so", spec.description),
            false => format!("{}: throttle says so", spec.description),
        },
        parameters,
        too_small: false,
        probe: None,
    }
}

/// What makes a receiver's readings too large or too small by a factor or an amount, where its own
/// throttle and power say that it is heavier or lighter.
fn or_a_load(effect: &mut Effect) {
    let scales = [
        "sensor_gain",
        "sensor_offset",
        "receiver_inflow",
        "momentum_scale",
    ];
    if scales.contains(&effect.name.as_str()) {
        effect.alternatives.push("payload_mass".to_owned());
    }
}

/// The chosen candidates with their intervals, and what each cannot be told from.
fn named(setting: &Setting, observed: &Observed, selection: &Selection) -> Vec<Effect> {
    let alternatives = selection.rivals.iter();
    let alternatives = alternatives.map(|rivals| rivals.iter().map(|(k, _)| *k).collect());
    let mut effects = effects(setting, &selection.chosen, alternatives);
    // Gusts blur the ceiling of a mean, not that of the readings: the highest of them, where
    // several lie at it.
    let is_of_all = |effect: &&mut Effect| effect.probe.is_none();
    let mut saturation = effects.iter_mut().filter(is_of_all);
    let saturation = saturation.find(|e| e.name == "sensor_saturation");
    if let Some(effect) = saturation {
        let since_s = effect.parameters.get("t0").map(|moment| moment.value);
        let level = effect.parameters.get_mut("y_max");
        if let (Some(level), Some(value)) = (level, plateau(observed, since_s)) {
            *level = Estimate::around(value, observed.resolution().max(1e-3), &level.unit);
        }
    }
    effects
}

/// The terms of a fit with their intervals, and for each the candidates that it cannot be told
/// from.
pub(crate) fn effects(
    setting: &Setting,
    chosen: &Tried,
    alternatives: impl Iterator<Item = Vec<usize>>,
) -> Vec<Effect> {
    let candidates = setting.candidates;
    let members = chosen.members(candidates);
    let half_widths = half_widths(&members, &chosen.fit, setting);
    let mut estimates = chosen.fit.values.iter().zip(half_widths);
    let effect = |((candidate, own), alternatives): ((&Candidate, &[f64]), Vec<usize>)| {
        let parameters = candidate.parameters.iter().zip(estimates.by_ref());
        let parameters = parameters.map(|(parameter, (&value, half))| {
            let mut estimate = Estimate::around(value, half, parameter.unit);
            estimate.low = estimate.low.max(parameter.low);
            estimate.high = estimate.high.min(parameter.high);
            estimate.at_bound = parameter.is_at_end(value);
            (parameter.name.to_owned(), estimate)
        });
        let since = candidate.scope.onset().map(|of| {
            let [low, high] = of.ends_s;
            let moment = Estimate {
                low,
                high,
                ..Estimate::around(of.at_s, 0.0, "s")
            };
            ("t0".to_owned(), moment)
        });
        let parameters = parameters.chain(since).collect();
        let described = candidate.description;
        let description = match candidate.scope {
            Scope::Whole => described.to_owned(),
            Scope::Since(of) => format!("{described}, from {:.0} s on", of.at_s),
            Scope::Probe { id, .. } => format!("{described}, that of probe {id} alone"),
        };
        let names = alternatives.iter().map(|&k| candidates[k].name.to_owned());
        Effect {
            name: candidate.name.into(),
            kind: Some(candidate.kind),
            alternatives: names.collect(),
            equation: candidate.equation.into(),
            description,
            parameters,
            too_small: candidate.size(own) < 1.0,
            probe: candidate.scope.probe(),
        }
    };
    let with_values = by_member(&members, &chosen.fit.values);
    with_values.zip(alternatives).map(effect).collect()
}

/// The reading that none exceeds and several reach, from a moment on or always.
fn plateau(observed: &Observed, since_s: Option<f64>) -> Option<f64> {
    let pairs = observed.recorded().into_iter().zip(observed.times_s());
    let is_late = |t_s: f64| since_s.is_none_or(|since_s| t_s >= since_s);
    let late = pairs.filter(|(_, t_s)| is_late(*t_s));
    let recorded: Vec<f64> = late.map(|(value, _)| value).collect();
    let highest = recorded.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let near = |value: &&f64| highest - **value < 1.5 * observed.resolution();
    (recorded.iter().filter(near).count() >= PLATEAU).then_some(highest)
}

/// Where baseline and corrected simulation differ by more than half a standard deviation.
fn region(observed: &Observed, sd: &[f64], corrected: &[f64]) -> Region {
    let simulated = observed.simulated();
    let mut inside = departing(&simulated, corrected, sd);
    if inside.is_empty() {
        return Region::default();
    }
    let of_one = one_probe(observed, &inside, |i| {
        ((corrected[i] - simulated[i]) / sd[i]).powi(2)
    });
    if let Some(probe) = of_one {
        inside.retain(|&i| observed.samples[i].subject == probe);
    }
    let (description, bounds) = bounds(observed, &inside);
    let mut region = Region::of(&inside, &observed.recorded(), &simulated, sd);
    region.description = description;
    region.bounds = bounds;
    region.sample_indices = inside.iter().map(|&i| observed.samples[i].row).collect();
    region.sample_indices.sort_unstable();
    region
}

/// The one of several probes that has nearly all of the weight of some samples.
fn one_probe(observed: &Observed, inside: &[usize], weight: impl Fn(usize) -> f64) -> Option<u32> {
    if observed.channel != Channel::Speed {
        return None;
    }
    let mut of_probes: BTreeMap<u32, f64> = BTreeMap::new();
    for sample in &observed.samples {
        of_probes.entry(sample.subject).or_default();
    }
    for &i in inside {
        *of_probes.entry(observed.samples[i].subject).or_default() += weight(i);
    }
    let all: f64 = of_probes.values().sum();
    let is_most = |(_, own): &(&u32, &f64)| **own > NEARLY_ALL * all;
    let mut most = of_probes.iter().filter(is_most);
    most.next()
        .filter(|_| of_probes.len() > 1)
        .map(|(probe, _)| *probe)
}

/// Where some samples lie, in words and by covariate: empty without any. Those of one probe among
/// several are described by its number, and by where of its own samples they lie.
fn bounds(observed: &Observed, inside: &[usize]) -> (String, BTreeMap<String, [f64; 2]>) {
    let mut bounds = BTreeMap::new();
    if inside.is_empty() {
        return (String::new(), bounds);
    }
    let subject = |i: usize| observed.samples[i].subject;
    let is_first = |i: usize| subject(i) == subject(inside[0]);
    let is_of_one = inside.iter().all(|&i| is_first(i));
    let probe = (observed.channel == Channel::Speed
        && is_of_one
        && !(0..observed.samples.len()).all(is_first))
    .then(|| subject(inside[0]));
    let all: Vec<usize> = (0..observed.samples.len())
        .filter(|&i| probe.is_none_or(|probe| subject(i) == probe))
        .collect();
    // What counts from a drone says nothing of samples that are below none.
    let is_placed = |i: usize| observed.samples[i].place.is_some();
    let placed: Vec<usize> = inside.iter().copied().filter(|&i| is_placed(i)).collect();
    let all_placed: Vec<usize> = all.iter().copied().filter(|&i| is_placed(i)).collect();
    let is_part = (inside.len() as f64) < NEARLY_ALL * all.len() as f64;
    let are_placed = placed.len() as f64 > MOSTLY * inside.len() as f64;
    let mut marked = vec![false; observed.samples.len()];
    inside.iter().for_each(|&i| marked[i] = true);
    let marked: Vec<bool> = all.iter().map(|&i| marked[i]).collect();
    let mut known: Vec<&[f64]> = Vec::new();
    let mut boxes: Vec<(Vec<bool>, String)> = Vec::new();
    for ((name, _), column) in COVARIATES.iter().zip(&observed.covariates) {
        let is_of_a_drone = OF_A_DRONE.contains(name);
        if is_of_a_drone && !are_placed || !is_part || *name == PROBE {
            continue;
        }
        let (within, whole) = match is_of_a_drone {
            true => (&placed[..], &all_placed),
            false => (inside, &all),
        };
        let is_same = |other: &&[f64]| {
            let mut pairs = whole.iter().map(|&i| (column[i], other[i]));
            pairs.all(|(a, b)| (a - b).abs() <= SAME)
        };
        if known.iter().any(is_same) {
            continue;
        }
        known.push(column);
        let of = |rows: &[usize]| span(rows.iter().map(|&i| column[i]).collect());
        let (within, whole) = (of(within), of(whole));
        let part = (within[1] - within[0]) / (whole[1] - whole[0]);
        // A coordinate that the region covers as widely as the recording says nothing about it.
        if part < NARROW {
            bounds.insert((*name).to_owned(), within);
            let counts = |i: usize| is_placed(i) || !is_of_a_drone;
            let is_within = |&i: &usize| counts(i) && (within[0]..=within[1]).contains(&column[i]);
            boxes.push((
                all.iter().map(is_within).collect(),
                format!("{name} {:.2} to {:.2}", within[0], within[1]),
            ));
        }
    }
    let below_none = inside.len() - placed.len();
    let is_below_none = below_none as f64 > MOSTLY * inside.len() as f64;
    let none = (is_below_none && !all_placed.is_empty()).then(|| "below no drone".to_owned());
    let told = telling(&boxes, &marked).into_iter();
    let words = none.into_iter().chain(told.map(|at| boxes[at].1.clone()));
    let words: Vec<String> = words.take(SAID).collect();
    let words = probe
        .map(|probe| format!("probe {probe}"))
        .into_iter()
        .chain(words);
    let words: Vec<String> = words.collect();
    let description = match (words.is_empty(), is_part) {
        (true, false) => "everywhere".into(),
        (true, true) => "scattered over all that was covered".into(),
        (false, _) => words.join(", "),
    };
    (description, bounds)
}

/// Which of some boxes together tell what is marked best from the rest, by the part of the union of
/// both that lies in both; one after another, none that tells hardly more.
fn telling(boxes: &[(Vec<bool>, String)], marked: &[bool]) -> Vec<usize> {
    let overlap = |in_box: &dyn Fn(usize) -> bool| {
        let (mut both, mut either) = (0usize, 0usize);
        for (i, &is_marked) in marked.iter().enumerate() {
            let is_in = in_box(i);
            both += usize::from(is_in && is_marked);
            either += usize::from(is_in || is_marked);
        }
        both as f64 / either.max(1) as f64
    };
    let mut taken: Vec<usize> = Vec::new();
    let mut so_far = overlap(&|_| true);
    while taken.len() < SAID {
        let with = |k: usize| {
            let in_all = |i: usize| taken.iter().chain([&k]).all(|&k| boxes[k].0[i]);
            overlap(&in_all)
        };
        let others = (0..boxes.len()).filter(|k| !taken.contains(k));
        // The first of those that tell as much.
        let best = others
            .map(|k| (with(k), k))
            .reduce(|a, b| if b.0 > a.0 { b } else { a });
        let Some((tells, k)) = best.filter(|(tells, _)| *tells > so_far + TELLS) else {
            break;
        };
        so_far = tells;
        taken.push(k);
    }
    taken
}

/// The samples that a correction moves by more than half a standard deviation.
pub(crate) fn departing(simulated: &[f64], corrected: &[f64], sd: &[f64]) -> Vec<usize> {
    (0..corrected.len())
        .filter(|&i| (corrected[i] - simulated[i]).abs() > 0.5 * sd[i])
        .collect()
}

/// The ends of the values without the outermost.
fn span(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    [TAIL, 1.0 - TAIL].map(|share| nearest_rank(&values, share).unwrap_or(0.0))
}

#[cfg(test)]
pub(crate) mod tests;
