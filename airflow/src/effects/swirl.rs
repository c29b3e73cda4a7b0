//! Swirl: the jet turns about its axis.
//!
//! ```text
//! W_θ = k U_C ξ/(1 + a ξ²)² · s₀/(s₀ - s)
//! ```
//!
//! Counter-rotating propellers cancel it but for yaw torque and failed rotors; it decays faster
//! than the axial speed and enters a magnitude squared, so a speed probe hardly sees it. Range: `k`
//! 0 to 1.8, assumed here: air that turns as a solid body, at its edge with `G` of its axial speed,
//! has the swirl number `(G/2)/(1 - G²/4)`, and jets turn back inside from about 0.6 (Gupta, Lilley
//! & Syred 1984, Swirl Flows), `G` = 0.94. The fastest air around this axis has `0.505 k U_C`.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, SIDEWAYS};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "swirl",
    aliases: &[],
    equation: "W_theta = k U_C xi/(1 + a xi^2)^2 s0/(s0 - s)",
    description: "the jet turns about its axis",
    parameters: &[Parameter::ratio("ratio", &["k"], 0.0, [-1.8, 1.8]).fit(0.0, 1.8)],
    essential: 1,
    home: Home::Jet,
    treatment: |_| SIDEWAYS,
    get: |effects| Some(vec![effects.swirl?.ratio]),
    set: |effects, p| effects.swirl = Some(Swirl { ratio: p[0] }),
};

/// Speed around the axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Swirl {
    /// `k`: over the centreline speed, at the rotor plane.
    pub ratio: f64,
}

impl Swirl {
    /// Speed around the axis over the centreline's, at `ξ` and a depth (l), for a virtual origin
    /// `s₀` (l).
    pub(crate) fn speed(&self, xi: f64, s: f64, origin: f64) -> f64 {
        let profile = 1.0 + crate::jet::PROFILE_A * xi * xi;
        self.ratio * xi / (profile * profile) * origin / (origin - s)
    }
}
