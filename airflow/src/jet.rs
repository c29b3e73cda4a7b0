//! The three numbers of the merged jet, and what follows from them alone.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

/// `a = √2 - 1`: makes the profile `1/(1 + a ξ²)²` fall to one half at `ξ = 1`.
pub(crate) const PROFILE_A: f64 = std::f64::consts::SQRT_2 - 1.0;

/// Depth below the rotor plane, in motor distances, from which the merged jet holds (the paper's
/// fit uses slices below it).
pub const FAR_FIELD_FROM_S_OVER_L: f64 = 2.5;

/// Constants of the merged jet, in motor distances `l` and induced velocities `U_H`. The default is
/// the paper's fit, over its four uncanted drones together.
///
/// Never metres: `centreline` is the paper's `B d` over `l`. The opening angle is `2 atan(S)`, 8.8°
/// for the paper's `S`; the 10° and 12° that the paper's text and captions mention do not agree
/// with its own fit, so only `S` is used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jet {
    /// Decay constant `B`: the centreline is `U_C/U_H = B/(s/l - s₀)`. Above 0.
    pub centreline: f64,
    /// Spreading rate `S`: the half-width is `r_half/l = S (s/l - s₀)`. Above 0.
    pub spreading: f64,
    /// Virtual origin `s₀` (the paper's "flow development-length") in motor distances below the
    /// rotor plane. Negative: the jet seems to start above the rotors.
    pub origin: f64,
}

/// Why three numbers do not make a jet.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum JetError {
    /// A decay or a spreading that is zero, negative, infinite or not a number.
    #[error("{field} is {value}; it must be finite and above 0")]
    NotPositive {
        /// `centreline` or `spreading`.
        field: &'static str,
        /// What it held.
        value: f64,
    },
    /// The jet would start inside the region where it is evaluated.
    #[error("origin is {0} motor distances; it must be finite and below 0, above the rotor plane")]
    Origin(f64),
}

impl Jet {
    /// Momentum flux over `ρ U_H² l²`, the same at every depth: the paper's 1.5194.
    ///
    /// ```text
    /// K = ∫ U² dA = π (B S)² / (3 a)
    /// ```
    #[must_use]
    pub fn momentum(&self) -> f64 {
        let speed_times_width = self.centreline * self.spreading;
        PI * speed_times_width * speed_times_width / (3.0 * PROFILE_A)
    }

    /// Everything that is wrong with it; empty when it can be used.
    #[must_use]
    pub fn problems(&self) -> Vec<JetError> {
        let mut problems = Vec::new();
        for (field, value) in [
            ("centreline", self.centreline),
            ("spreading", self.spreading),
        ] {
            if !(value.is_finite() && value > 0.0) {
                problems.push(JetError::NotPositive { field, value });
            }
        }
        if !(self.origin.is_finite() && self.origin < 0.0) {
            problems.push(JetError::Origin(self.origin));
        }
        problems
    }
}

/// The paper's joint fit.
impl Default for Jet {
    fn default() -> Jet {
        Jet {
            centreline: 10.11,
            spreading: 0.07668,
            origin: -5.817,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_jet_carries_1_5194() {
        // Half of the last digit of the number computed by hand.
        assert!((Jet::default().momentum() - 1.5194).abs() < 5e-5);
        assert!(Jet::default().problems().is_empty());
    }

    #[test]
    fn each_unusable_constant_is_named() {
        let broken = Jet {
            centreline: 0.0,
            spreading: f64::NAN,
            origin: 3.0,
        };
        let words: Vec<String> = broken.problems().iter().map(ToString::to_string).collect();
        assert_eq!(words.len(), 3);
        assert!(words[0].starts_with("centreline is 0;"));
        assert!(words[1].starts_with("spreading is NaN;"));
        assert!(words[2].starts_with("origin is 3 motor distances"));
    }
}
