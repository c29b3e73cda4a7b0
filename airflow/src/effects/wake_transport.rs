//! Transport: the air at a depth left its drone a while ago.
//!
//! ```text
//! τ(s) = m l (σ² - s₀²)/(2 B U_H),   m = 1/k_c
//! ```
//!
//! `m = 1` where everything moves at the centreline's speed; large eddies and the front of a
//! starting jet are assumed here to move at 0.5 to 0.65 of it, `m` 1.5 to 2. Range: 0 to 3. Taken
//! for: a clock that is off (the same at every depth and for every drone), a slow probe (only ever
//! later, and weaker).

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "wake_transport",
    aliases: &["emitter_motion", "transport_delay"],
    equation: "tau(s) = m l (sigma^2 - s0^2)/(2 B U_H)",
    description: "the air at a depth left its drone at another time than simulated, when the drone was elsewhere",
    parameters: &[Parameter::ratio("lag_factor", &["m"], 0.0, [0.0, 3.0])],
    essential: 1,
    home: Home::Surroundings,
    treatment: |_| {
        Treatment::Bounded(
            "planned and checked for every delay from none to its own: air from every place that it may have left",
        )
    },
    get: |effects| Some(vec![effects.wake_transport?.lag_factor]),
    set: |effects, p| effects.wake_transport = Some(WakeTransport { lag_factor: p[0] }),
};

/// Age of the air over that at the centreline's speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WakeTransport {
    /// `m`; 0: none.
    pub lag_factor: f64,
}

impl WakeTransport {
    /// Convection speed over the centreline's, where there is a lag at all.
    #[must_use]
    pub fn convection(&self) -> Option<f64> {
        (self.lag_factor > 0.0).then(|| self.lag_factor.recip())
    }
}
