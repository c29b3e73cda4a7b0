//! What a diagnosis found: plain data, for a person, a program, and a planner that flies through
//! the corrected air.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::forward::hypothesis::Hypothesis;
use crate::forward::simulate::Channel;
use crate::infer::candidates::Kind;
use crate::infer::outside::{Remains, Shape};

/// Of diagnosis.json.
pub const FORMAT: &str = "diagnosis/1";

/// What is missing in the simulation of a recording, and how that is known. Serialised it is the
/// body of `diagnosis/1`. Rows count from 0 and are those of probes.csv, or of receiver.csv where
/// there are no probes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Name of the recording.
    pub recording: String,
    /// Whether something is missing, and whether it has a name.
    pub verdict: Verdict,
    /// What was compared.
    pub channel: Channel,
    /// How many samples.
    pub samples: usize,
    /// Every how many-th of them was fitted, and held out: 1 for all. Region and prediction are of
    /// all.
    pub fitted_every: usize,
    /// What.
    pub effects: Vec<Effect>,
    /// What else points to, and was taken back: held-out readings are predicted no better with it.
    pub withdrawn: Option<Withdrawn>,
    /// Where.
    pub region: Region,
    /// p-value of as much structure in noise alone.
    #[serde(rename = "chance")]
    pub p: f64,
    /// The shape of what the library does not hold.
    pub shape: Option<Shape>,
    /// What something that knows no physics still predicts after all of it.
    pub remains: Remains,
    /// Whether errors that are large follow one another, after all that is named.
    pub errors_follow: bool,
    /// How much better what was not fitted is predicted.
    #[serde(rename = "heldout")]
    pub held_out: HeldOut,
    /// Everything that was tried alone, best first.
    pub candidates: Vec<Ranked>,
    /// Runner-up: a second effect that would predict more, by too small a part of the whole to be
    /// told from an error in the first one's form.
    #[serde(rename = "perhaps")]
    pub runner_up: Option<RunnerUp>,
    /// What it cannot tell apart, and what to measure.
    pub advice: Vec<String>,
    /// The minimum detectable effect of each candidate.
    #[serde(rename = "smallest")]
    pub detectable: Vec<Detectable>,
    /// The corrected simulation in the channel's unit, by row of the channel's file; not a number
    /// (null) where there is none.
    pub prediction: Vec<f64>,
    /// The baseline corrected: everything found, as a hypothesis.
    #[serde(skip)]
    pub correction: Hypothesis,
}

/// Whether something is missing, and whether it has a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The simulation explains the recording.
    None,
    /// Effects of the library are missing.
    Library,
    /// Something is missing that no effect of the library explains, or with the one that would,
    /// readings are predicted no better.
    OutsideLibrary,
    /// One of several effects is missing, and the recording cannot say which.
    Ambiguous,
}

impl Verdict {
    /// As in reports.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Verdict::None => "none",
            Verdict::Library => "library",
            Verdict::OutsideLibrary => "outside_library",
            Verdict::Ambiguous => "ambiguous",
        }
    }
}

/// What a shape outside the library and the effects that were named come to.
pub(crate) fn verdict(is_outside: bool, effects: &[Effect]) -> Verdict {
    let is_ambiguous = effects.iter().any(|effect| !effect.alternatives.is_empty());
    match (is_outside, effects.is_empty(), is_ambiguous) {
        (true, _, _) => Verdict::OutsideLibrary,
        (false, true, _) => Verdict::None,
        (false, false, true) => Verdict::Ambiguous,
        (false, false, false) => Verdict::Library,
    }
}

/// One effect that is missing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Effect {
    /// Canonical name.
    pub name: String,
    /// Of the air or of an instrument; `None`: outside the library.
    pub kind: Option<Kind>,
    /// Names that the recording cannot tell it from.
    pub alternatives: Vec<String>,
    /// Its equation.
    pub equation: String,
    /// What happens, in a sentence.
    #[serde(rename = "story")]
    pub description: String,
    /// Its parameters by name.
    pub parameters: BTreeMap<String, Estimate>,
    /// Present, and too small to matter for planning: a label, and no reason to take another.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub too_small: bool,
    /// The number of the one probe whose fault it is; `None`: it is not that of one of several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probe: Option<u32>,
}

impl Effect {
    /// `crossflow`, or `sensor_gain of probe 3`.
    #[must_use]
    pub fn label(&self) -> String {
        label(&self.name, self.probe)
    }
}

fn label(name: &str, probe: Option<u32>) -> String {
    match probe {
        Some(id) => format!("{name} of probe {id}"),
        None => name.to_owned(),
    }
}

/// A value with its 95 % interval and unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Best value.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Unit; 1 for ratios.
    pub unit: String,
    /// Whether the fit ended at an end of the parameter's range: the interval then says little.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub at_bound: bool,
}

impl Estimate {
    /// `half` to either side of a value, all in this unit.
    pub(crate) fn around(value: f64, half: f64, unit: &str) -> Estimate {
        Estimate {
            value,
            low: value - half,
            high: value + half,
            unit: unit.into(),
            at_bound: false,
        }
    }
}

/// An answer that was taken back.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Withdrawn {
    /// What it was.
    pub effects: Vec<Effect>,
    /// Root mean square error with it on blocks that were not fitted, in the channel's unit.
    pub rms_after: f64,
    /// p-value: how often square errors of as many blocks would grow as much by chance.
    pub p: f64,
}

/// Where the corrected simulation differs from the baseline by more than half a standard deviation.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Region {
    /// In words.
    pub description: String,
    /// Intervals of the covariates that hold nine tenths of it, by name.
    pub bounds: BTreeMap<String, [f64; 2]>,
    /// Rows of the channel's file.
    pub sample_indices: Vec<usize>,
    /// Part of all samples.
    pub share: f64,
    /// Mean of recorded minus baseline there, in the channel's unit.
    pub mean_error: f64,
    /// The same over the recorded mean there.
    pub relative_error: f64,
    /// Root mean square of recorded minus baseline there, in the channel's unit.
    pub rms_error: f64,
    /// Root mean square of recorded minus baseline there over the noise.
    pub error_over_noise: f64,
}

impl Region {
    /// Figures of the samples inside, of recorded and simulated values and their standard
    /// deviations, all in the channel's unit; without words, bounds and rows.
    pub(crate) fn of(inside: &[usize], recorded: &[f64], simulated: &[f64], sd: &[f64]) -> Region {
        if inside.is_empty() {
            return Region::default();
        }
        let mean = |value: &dyn Fn(usize) -> f64| {
            inside.iter().map(|&i| value(i)).sum::<f64>() / inside.len() as f64
        };
        let error = |i: usize| recorded[i] - simulated[i];
        let mean_error = mean(&error);
        Region {
            share: inside.len() as f64 / recorded.len() as f64,
            mean_error,
            relative_error: mean_error / mean(&|i| recorded[i]),
            rms_error: mean(&|i| error(i).powi(2)).sqrt(),
            error_over_noise: mean(&|i| (error(i) / sd[i]).powi(2)).sqrt(),
            ..Region::default()
        }
    }
}

/// Root mean square errors on blocks that were not fitted, in the channel's unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct HeldOut {
    /// Of the baseline, within the instrument's tolerance.
    pub rms_before: f64,
    /// Of the corrected simulation.
    pub rms_after: f64,
    /// 95 % interval over blocks, lower end.
    pub rms_after_low: f64,
    /// Upper end.
    pub rms_after_high: f64,
    /// What the scatter of the readings alone leaves; at most what is left, which holds it.
    pub noise_floor: f64,
    /// How many instruments, each of which has a gain and an offset of its own within what its
    /// maker allows.
    pub instruments: usize,
    /// Gain (1) and offset (the channel's unit) that the baseline was read with, on average over
    /// the instruments.
    pub tolerance_before: [f64; 2],
    /// The same of the corrected simulation.
    pub tolerance_after: [f64; 2],
}

/// One candidate alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ranked {
    /// Canonical name.
    pub name: String,
    /// Gain in held-out log density over the baseline.
    pub gain: f64,
    /// Its standard error.
    pub gain_error: f64,
    /// Whether it is large enough to act on.
    pub practical: bool,
    /// Its fitted parameters by name.
    pub parameters: BTreeMap<String, f64>,
    /// Whether what makes it up was driven to an end of its range: then it is not named.
    pub at_bound: bool,
    /// As of [`Effect::probe`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probe: Option<u32>,
}

impl Ranked {
    /// As [`Effect::label`].
    #[must_use]
    pub fn label(&self) -> String {
        label(&self.name, self.probe)
    }
}

/// An effect that was not taken, and might be there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunnerUp {
    /// Canonical name.
    pub name: String,
    /// Gain in held-out log density beside what was taken.
    pub gain: f64,
    /// Its standard error.
    pub gain_error: f64,
}

/// A minimum detectable effect: 80 % power at the level of the global test.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Detectable {
    /// Canonical name.
    pub name: String,
    /// The parameter.
    pub parameter: String,
    /// Its smallest departure from neutral.
    pub departure: f64,
    /// Unit.
    pub unit: String,
}
