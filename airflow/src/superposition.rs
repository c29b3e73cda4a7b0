//! How the jets of several drones add up.
//!
//! How mean jets add is not settled. The momentum sum is the default: for jets side by side
//! momentum adds, not speed (Reichardt's hypothesis, VDI-Forschungsheft 414, 1942), and in measured
//! pairs above a third drone it fits without a scale where the linear sum is a third too strong.
//! The linear sum bounds it from above, the strongest jet alone from below.

use std::fmt;
use std::str::FromStr;

/// How the axial speeds `U_i` of several wakes add up at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Superposition {
    /// `√(Σ U_i²)`: momentum adds.
    #[default]
    Momentum,
    /// `Σ U_i`: speed adds; never less than the others.
    Linear,
    /// `max U_i`: never more than the others.
    Strongest,
}

/// A name that is no superposition.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("superposition \"{0}\" is not known; use \"momentum\", \"linear\" or \"strongest\"")]
pub struct UnknownSuperposition(String);

impl Superposition {
    /// All of them, the default first.
    pub const ALL: [Superposition; 3] = [
        Superposition::Momentum,
        Superposition::Linear,
        Superposition::Strongest,
    ];

    /// Its name in files: `momentum`, `linear`, `strongest`.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Superposition::Momentum => "momentum",
            Superposition::Linear => "linear",
            Superposition::Strongest => "strongest",
        }
    }

    /// One more wake on what has been gathered so far.
    #[inline]
    #[must_use]
    pub fn gather(self, so_far: f64, speed_mps: f64) -> f64 {
        match self {
            Superposition::Momentum => so_far + speed_mps * speed_mps,
            Superposition::Linear => so_far + speed_mps,
            Superposition::Strongest => {
                if speed_mps > so_far {
                    speed_mps
                } else {
                    so_far
                }
            }
        }
    }

    /// From what has been gathered to a speed (m/s).
    #[inline]
    #[must_use]
    pub fn finish(self, gathered: f64) -> f64 {
        match self {
            Superposition::Momentum => gathered.sqrt(),
            Superposition::Linear | Superposition::Strongest => gathered,
        }
    }
}

impl fmt::Display for Superposition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl FromStr for Superposition {
    type Err = UnknownSuperposition;

    fn from_str(name: &str) -> Result<Superposition, UnknownSuperposition> {
        let known = Superposition::ALL
            .into_iter()
            .find(|known| known.as_str() == name);
        known.ok_or_else(|| UnknownSuperposition(name.to_owned()))
    }
}
