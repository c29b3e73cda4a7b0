//! Tilt: the jet's axis is off the vertical by a constant angle, as the rotor plane or the thrust
//! is.
//!
//! ```text
//! x(s) = s tan χ
//! ```
//!
//! Range: a few tenths. Taken for: wind (drift grows with `s²` and leaves a level flow far from the
//! jet), a shifted probe or drone (constant in `s`).

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "wake_tilt",
    aliases: &[],
    equation: "x(s) = s tan(lean)",
    description: "the jet leaves its drone at an angle",
    parameters: &[Parameter::ratio("lean", &["lean_x", "lean_y"], 0.0, [-1.0, 1.0]).fit(-0.4, 0.4)],
    essential: 2,
    home: Home::Jet,
    treatment: |_| Treatment::Exact,
    get: |effects| Some(effects.wake_tilt?.tilt.to_vec()),
    set: |effects, p| effects.wake_tilt = Some(WakeTilt { tilt: [p[0], p[1]] }),
};

/// A constant tilt of the axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WakeTilt {
    /// Tangent of the tilt along x and y of the world: metres sideways for each metre down. Files
    /// call it `lean`.
    #[serde(rename = "lean")]
    pub tilt: [f64; 2],
}

impl WakeTilt {
    /// Shift of the axis (l), x and y, at a depth (l).
    pub(crate) fn shift(&self, s: f64) -> [f64; 2] {
        self.tilt.map(|tilt| tilt * s)
    }
}
