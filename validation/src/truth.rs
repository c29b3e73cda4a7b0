//! The injected effects of a recording, and the seal on it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use diagnosis::infer::candidates::is_sensor;

use crate::answer::Answer;

/// How large an effect was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Size {
    /// Near the limit of what can be seen.
    Weak,
    /// As met in practice.
    Mid,
    /// As bad as it gets.
    Strong,
}

impl Size {
    /// All, from small to large.
    pub const ALL: [Size; 3] = [Size::Weak, Size::Mid, Size::Strong];

    /// One of three values.
    pub(super) fn of(self, values: [f64; 3]) -> f64 {
        values[self as usize]
    }
}

/// One injected effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Injected {
    /// Canonical name; for effects outside the library, what it is.
    pub name: String,
    /// Every name that is right; empty outside the library.
    pub accepted: Vec<String>,
    /// Parameters that are defined as in the library, by its names, where there are any.
    pub parameters: BTreeMap<String, f64>,
}

/// What is true of a synthetic recording. Rows are those of `probes.csv`, or of `receiver.csv`
/// where there are no probes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// What kind of recording it is, with the size of its effects.
    pub family: String,
    /// Empty: none is injected.
    pub effects: Vec<Injected>,
    /// Whether the injected effect is in no library.
    pub is_outside: bool,
    /// Rows in which the true difference exceeds half a standard deviation of the noise.
    pub region: Vec<usize>,
    /// The reading without noise and without the error that the maker allows.
    pub truth_clean: Vec<f64>,
    /// The reading of the declared simulation.
    pub baseline_clean: Vec<f64>,
    /// Standard deviation of the noise.
    pub noise: Vec<f64>,
    /// Likelihood ratio of the true difference to nothing but calibration within the stated
    /// accuracy, the noise known: below 25 "none" is as right as the name.
    pub oracle_chi2: f64,
}

/// From here on (χ²) an effect has to be found; below, "none" is right as well.
pub const DETECTABLE_CHI2: f64 = 25.0;

impl Truth {
    /// Canonical names joined by `+`; `none`; `outside: ` and what it is.
    #[must_use]
    pub fn label(&self) -> String {
        let mut names: Vec<&str> = self
            .effects
            .iter()
            .map(|effect| effect.name.as_str())
            .collect();
        names.sort_unstable();
        match (names.is_empty(), self.is_outside) {
            (true, _) => "none".to_owned(),
            (false, true) => format!("outside: {}", names.join("+")),
            (false, false) => names.join("+"),
        }
    }

    /// Whether every injected effect is a fault of instruments.
    #[must_use]
    pub(crate) fn is_sensor_only(&self) -> bool {
        !self.effects.is_empty() && self.effects.iter().all(|effect| is_sensor(&effect.name))
    }
}

/// A truth that only an answer unblinds.
#[derive(Clone, Debug)]
pub struct Sealed(Truth);

impl Sealed {
    pub(super) fn new(truth: Truth) -> Sealed {
        Sealed(truth)
    }

    /// Unblinds it, now that the answer is given.
    #[must_use]
    pub fn unblind(self, _given: &Answer) -> Truth {
        self.0
    }
}
