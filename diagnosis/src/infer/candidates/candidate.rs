//! One thing that may be missing, and its parameters.

use airflow::effects::EffectSpec;
use serde::{Deserialize, Serialize};

use crate::forward::hypothesis::Hypothesis;

/// Whether an effect is one of the air or of an instrument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Of the air, or of how a drone answers to it.
    Physics,
    /// Of an instrument or a clock.
    Sensor,
}

/// One parameter of a candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// As in the equation.
    pub name: &'static str,
    /// Its unit; 1 for a ratio.
    pub unit: &'static str,
    /// Lowest value that the fit may take.
    pub low: f64,
    /// Highest.
    pub high: f64,
    /// The value that the simulation has: where the effect vanishes, or what is declared.
    pub neutral: f64,
    /// Distance from there below which it changes no decision.
    pub practical: f64,
    /// Whether its lowest and its highest value are all there can be: quasi-static air, a share of
    /// 1.
    pub is_all: [bool; 2],
}

/// One thing that may be missing.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Canonical name.
    pub name: &'static str,
    /// Of the air or of the sensor.
    pub kind: Kind,
    /// Its equation, with the parameters' names in it.
    pub equation: &'static str,
    /// What happens, in one sentence.
    pub description: &'static str,
    /// Its parameters. Those after the first `essential` shape the effect but cannot make it
    /// vanish.
    pub parameters: Vec<Parameter>,
    /// How many of the parameters make it vanish when they are neutral.
    pub essential: usize,
    /// Where fits begin.
    pub starts: Vec<Vec<f64>>,
    /// One standard deviation of what its law in closed form may be off from the mechanism, in
    /// parts of the effect: chosen here, as far as other closures of the same mechanism differ from
    /// it.
    pub closure_error: f64,
    /// The measurement that settles whether it is there, whatever the air; empty where none is
    /// known.
    pub settled_by: &'static str,
    /// What values of its parameters change.
    pub change: Change,
    /// In which part of the recording it is there.
    pub scope: Scope,
}

/// A part of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scope {
    /// All of it.
    Whole,
    /// From a moment on.
    Since(Onset),
    /// What one of several probes reads.
    Probe {
        /// Which of the instruments, from 0.
        index: usize,
        /// Its number in the recording.
        id: u32,
    },
}

impl Scope {
    /// Whether what an instrument reads at a time (s) is in it.
    #[must_use]
    pub fn holds(&self, t_s: f64, instrument: usize) -> bool {
        match *self {
            Scope::Whole => true,
            Scope::Since(onset) => t_s >= onset.at_s,
            Scope::Probe { index, .. } => instrument == index,
        }
    }

    /// When it begins, if not with the recording.
    #[must_use]
    pub fn onset(&self) -> Option<Onset> {
        match *self {
            Scope::Since(onset) => Some(onset),
            _ => None,
        }
    }

    /// Of which probe it is, by its number, if not of all.
    #[must_use]
    pub fn probe(&self) -> Option<u32> {
        match *self {
            Scope::Probe { id, .. } => Some(id),
            _ => None,
        }
    }
}

/// A moment at which something sets in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Onset {
    /// When (s).
    pub at_s: f64,
    /// The ends of its 95 % interval (s).
    pub ends_s: [f64; 2],
}

impl Onset {
    /// At a moment (s), within an interval.
    pub(crate) fn new(at_s: f64, ends_s: [f64; 2]) -> Onset {
        Onset { at_s, ends_s }
    }
}

/// Where the values of a candidate's parameters go.
#[derive(Clone, Copy, Debug)]
pub enum Change {
    /// Into an effect of the air or of a receiver.
    Effect(&'static EffectSpec),
    /// Into anything else that is assumed.
    Hypothesis(fn(&[f64], &mut Hypothesis)),
}

impl Parameter {
    /// Whether a value lies at an end of the range that is not neutral nor all there can be, within
    /// half a percent of the range: as near as a fit stops.
    #[must_use]
    pub fn is_at_end(&self, value: f64) -> bool {
        let margin = 0.005 * (self.high - self.low);
        let is_end = |end: f64| (value - end).abs() < margin && end != self.neutral;
        is_end(self.low) && !self.is_all[0] || is_end(self.high) && !self.is_all[1]
    }

    /// Of a fault: from `low` to `high` in its unit, neutral at 0.
    pub(crate) const fn new(
        name: &'static str,
        unit: &'static str,
        [low, high]: [f64; 2],
        practical: f64,
    ) -> Parameter {
        Parameter {
            name,
            unit,
            low,
            high,
            neutral: 0.0,
            practical,
            is_all: [false; 2],
        }
    }
}

impl Candidate {
    /// How large a fitted effect is, in units of what matters: below 1 it changes no decision.
    #[must_use]
    pub fn size(&self, values: &[f64]) -> f64 {
        let parts = self.parameters.iter().zip(values).take(self.essential);
        let squares = parts.map(|(parameter, value)| {
            let part = (value - parameter.neutral) / parameter.practical;
            part * part
        });
        squares.sum::<f64>().sqrt()
    }

    /// Whether a parameter that makes it up was driven to an end of what it may be: it would go
    /// further, so it mends the form of something else. What only shapes it may lie there.
    #[must_use]
    pub fn is_at_bound(&self, values: &[f64]) -> bool {
        let mut essential = self.parameters.iter().zip(values).take(self.essential);
        essential.any(|(parameter, &value)| parameter.is_at_end(value))
    }

    /// Puts values of the parameters into a hypothesis.
    pub(crate) fn set(&self, values: &[f64], hypothesis: &mut Hypothesis) {
        match self.change {
            Change::Effect(spec) => spec.set(&mut hypothesis.effects, values),
            Change::Hypothesis(set) => set(values, hypothesis),
        }
    }
}
