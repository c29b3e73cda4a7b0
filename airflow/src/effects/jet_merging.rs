//! Merging: how the speeds of several jets add up.
//!
//! ```text
//! U = ( Σ U_i^q )^(1/q)
//! ```
//!
//! `q = 1`: the linear sum; `q = 2`: momentum adds, which Reichardt's hypothesis gives for jets
//! side by side (VDI-Forschungsheft 414, 1942). Between aligned drones the difference is 29 %. To
//! be seen only where two jets are alike (the weaker above 0.3 of the stronger).

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "jet_merging",
    aliases: &["superposition"],
    equation: "U = (sum U_i^q)^(1/q)",
    description: "jets side by side add up otherwise than simulated",
    parameters: &[Parameter::ratio("exponent", &["q"], 1.0, [0.7, 4.0])],
    essential: 1,
    home: Home::Surroundings,
    treatment: |effects| match effects.jet_merging.map_or(2.0, |merging| merging.exponent) {
        q if q == 1.0 || q == 2.0 => Treatment::Exact,
        q if q > 2.0 => Treatment::Bounded("jets add up by momentum, which is more"),
        q if q > 1.0 => Treatment::Bounded("jets add up linearly, which is more"),
        _ => Treatment::Refused("jets that add up to more than their sum have no bound here"),
    },
    get: |effects| Some(vec![effects.jet_merging?.exponent]),
    set: |effects, p| effects.jet_merging = Some(JetMerging { exponent: p[0] }),
};

/// The exponent of the sum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JetMerging {
    /// `q`, 0.7 to 4.
    pub exponent: f64,
}

impl JetMerging {
    /// One more jet on a gathered sum of powers.
    #[must_use]
    pub fn gather(&self, so_far: f64, speed: f64) -> f64 {
        so_far + speed.max(0.0).powf(self.exponent)
    }

    /// From the gathered sum to a speed.
    #[must_use]
    pub fn finish(&self, gathered: f64) -> f64 {
        gathered.powf(1.0 / self.exponent)
    }
}
