//! Outer edge: the algebraic profile has a tail that real jets have not.
//!
//! ```text
//! f(ξ) = (1 - τ)/(1 + a ξ²)² + τ exp(-ln2 ξ^(2+n))
//! ```
//!
//! The paper's profile entrains 58 % more than a Gaussian of the same width, and its residuals are
//! positive between 2 and 5 half-widths; jets are as well described by a Gaussian (`τ = 1`,
//! `n = 0`) within 1.5 half-widths (Pope, Turbulent Flows, 2000, section 5.1). Range: `τ` -0.6 to
//! 1.6, `n` -0.6 to 4. Zero change on the axis and at `ξ = 1`, at every depth. Taken for: an
//! ambient speed that was subtracted from a magnitude (an artefact that falls with `U_C`).

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "profile_tail",
    aliases: &["outer_edge"],
    equation: "f = (1 - tau)/(1 + a xi^2)^2 + tau exp(-ln2 xi^(2+n))",
    description: "the jet ends in an edge where the paper's profile has a long tail",
    parameters: &[
        Parameter::ratio("share", &["tau"], 0.0, [-0.6, 1.6]),
        Parameter::ratio("steepness", &["n"], 0.0, [-0.6, 4.0]),
    ],
    essential: 1,
    home: Home::Jet,
    treatment: |_| Treatment::Exact,
    get: |effects| (effects.profile_tail).map(|effect| vec![effect.share, effect.steepness]),
    set: |effects, p| {
        effects.profile_tail = Some(ProfileTail {
            share: p[0],
            steepness: p[1],
        });
    },
};

/// A mixture of the paper's profile and one with an edge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ProfileTail {
    /// `τ`: share of the profile with the edge.
    pub share: f64,
    /// `n`: how much steeper than a Gaussian.
    pub steepness: f64,
}

impl ProfileTail {
    /// The profile over the paper's at `ξ`; `algebraic` is the paper's there.
    pub(crate) fn profile(&self, xi: f64, algebraic: f64) -> f64 {
        let edged = (-std::f64::consts::LN_2 * xi.powf(2.0 + self.steepness)).exp();
        (1.0 - self.share) * algebraic + self.share * edged
    }
}
