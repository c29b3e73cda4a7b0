//! Buoyancy: air warmer than the room rises against the jet, colder air helps it.
//!
//! ```text
//! U_C → U_C √(1 - c (s/10)²),   c = (10 l/L_M)², L_M = J^(3/4)/B₀^(1/2)
//! ```
//!
//! `B₀ = g P/(ρ c_p T)` with all electrical power ending as heat: for an Offboard 2 `L_M` is 78 m
//! and `c` 0.001, far too small to be told from noise within 10 m; tall cold stores and hot roofs
//! are another matter.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "buoyancy",
    aliases: &[],
    equation: "U_C -> U_C sqrt(1 - c (s/10l)^2)",
    description: "warm air slows on its way down, cold air gains",
    parameters: &[Parameter::ratio("strength", &["c"], 0.0, [-1.0, 1.0])],
    essential: 1,
    home: Home::Jet,
    treatment: |_| Treatment::Exact,
    get: |effects| Some(vec![effects.buoyancy?.strength]),
    set: |effects, p| effects.buoyancy = Some(Buoyancy { strength: p[0] }),
};

/// Slowing with depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Buoyancy {
    /// `c`: part of the squared centreline speed lost 10 motor distances down; negative: gained.
    pub strength: f64,
}

impl Buoyancy {
    /// Factor on speed at a depth (l).
    pub(crate) fn factor(&self, s: f64) -> f64 {
        (1.0 - self.strength * (s / 10.0) * (s / 10.0))
            .max(0.0)
            .sqrt()
    }
}
