//! Ground effect: near the floor the same throttle lifts more.
//!
//! ```text
//! T/T_∞ = 1 + c_a exp(-c_b z/R)
//! ```
//!
//! The exponential form (He, Kou, Calaf & Leang 2019, J. Dyn. Syst. Meas. Control 141:071013) has
//! no pole, unlike Cheeseman & Bennett's `1/(1 - (R/4z)²)`. `R`: propeller radius. Range: `z` below
//! 5 R.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, THRUST};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "ground_effect_thrust",
    aliases: &[],
    equation: "T/T_inf = 1 + c_a exp(-c_b z/R)",
    description: "near the floor the same throttle lifts more",
    parameters: &[
        Parameter::ratio("gain", &["c_a"], 0.0, [-10.0, 10.0]).fit(-0.5, 3.0),
        Parameter::ratio("decay", &["c_b"], 0.5, [0.0, 100.0]).fit(0.05, 3.0),
    ],
    essential: 1,
    home: Home::Receiver,
    treatment: |_| THRUST,
    get: |effects| (effects.ground_effect_thrust).map(|effect| vec![effect.gain, effect.decay]),
    set: |effects, p| {
        effects.ground_effect_thrust = Some(GroundEffectThrust {
            gain: p[0],
            decay: p[1],
        });
    },
};

/// Thrust gained near the floor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroundEffectThrust {
    /// `c_a`: at the floor.
    pub gain: f64,
    /// `c_b`: per propeller radius of height.
    pub decay: f64,
}

impl GroundEffectThrust {
    /// Thrust over that in free air at a height over the propeller's radius.
    #[must_use]
    pub fn thrust_ratio(&self, height_over_radius: f64) -> f64 {
        1.0 + self.gain * (-self.decay * height_over_radius.max(0.0)).exp()
    }
}
