//! What a diagnosis found: plain data, for a person, a program, and a planner that flies through the corrected air.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::forward::hypothesis::Hypothesis;
use crate::forward::simulate::Channel;
use crate::infer::candidates::Kind;
use crate::infer::outside::Shape;

/// What is missing in the simulation of a recording, and how that is known.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Name of the recording.
    pub recording: String,
    /// What was compared.
    pub channel: Channel,
    /// How many samples.
    pub samples: usize,
    /// Whether something is missing, and whether it has a name.
    pub verdict: Verdict,
    /// What.
    pub effects: Vec<Effect>,
    /// Where.
    pub region: Region,
    /// The shape of what the library does not hold.
    pub shape: Option<Shape>,
    /// Chance of as much structure in noise alone.
    pub chance: f64,
    /// The corrected simulation, by row of the channel's file; not a number where there is none.
    pub prediction: Vec<f64>,
    /// How much better what was not fitted is predicted.
    #[serde(rename = "heldout")]
    pub held_out: HeldOut,
    /// Everything that was tried alone, best first.
    pub candidates: Vec<Ranked>,
    /// A second effect that would predict more, by too small a part of the whole to be told from an error in the first one's form.
    pub perhaps: Option<Perhaps>,
    /// What it cannot tell apart, and what to measure.
    pub advice: Vec<String>,
    /// The smallest effect of each kind that would have been noticed.
    pub smallest: Vec<Smallest>,
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
    /// Something is missing that no effect of the library explains.
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
    pub story: String,
    /// Its parameters by name.
    pub parameters: BTreeMap<String, Estimate>,
}

/// A value and its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Best value.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
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
}

impl Estimate {
    /// Value and ends alone.
    #[must_use]
    pub fn interval(&self) -> Interval {
        Interval {
            value: self.value,
            low: self.low,
            high: self.high,
        }
    }
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
    /// Root mean square of recorded minus baseline there over the noise.
    pub error_over_noise: f64,
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
    /// What the scatter of the readings alone leaves.
    pub noise_floor: f64,
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
}

/// An effect that was not taken, and might be there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Perhaps {
    /// Canonical name.
    pub name: String,
    /// Gain in held-out log density beside what was taken.
    pub gain: f64,
    /// Its standard error.
    pub gain_error: f64,
}

/// What would have been noticed: 80 % power at the 5 % level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Smallest {
    /// Canonical name.
    pub name: String,
    /// The parameter.
    pub parameter: String,
    /// Its smallest departure from neutral.
    pub departure: f64,
    /// Unit.
    pub unit: String,
}
