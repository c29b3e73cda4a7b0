//! Ceiling effect: below a ceiling the rotors draw themselves up.
//!
//! ```text
//! T/T_∞ = 1 / (1 - (1/a₁)(R/(z_c + a₂))²)
//! ```
//!
//! Sanchez-Cuevas, Heredia & Ollero (ICUAS 2017) with `a₁` about 7 and `a₂` about 4 cm for a small
//! quadrotor; here `a₂ = R/4`, chosen so that it scales. The jet at the same thrust does not
//! change.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, THRUST};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "ceiling_effect",
    aliases: &[],
    equation: "T/T_inf = 1/(1 - c (R/(z_c + R/4))^2)",
    description: "below a ceiling the rotors draw themselves up",
    parameters: &[Parameter::ratio("strength", &["c"], 0.0, [-10.0, 10.0]).fit(-0.2, 0.9)],
    essential: 1,
    home: Home::Receiver,
    treatment: |_| THRUST,
    get: |effects| Some(vec![effects.ceiling_effect?.strength]),
    set: |effects, p| effects.ceiling_effect = Some(CeilingEffect { strength: p[0] }),
};

/// Thrust gained below the ceiling.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CeilingEffect {
    /// `1/a₁`, about 0.15 for small quadrotors; 0: no effect. Range: -10 to 10.
    pub strength: f64,
}

impl CeilingEffect {
    /// Thrust over that in free air at a distance below the ceiling over the propeller's radius.
    #[must_use]
    pub fn thrust_ratio(&self, gap_over_radius: f64) -> f64 {
        let reach = (gap_over_radius.max(0.0) + 0.25).recip();
        (1.0 - self.strength * reach * reach).max(0.1).recip()
    }
}
