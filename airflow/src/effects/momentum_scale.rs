//! Strength: all of the jet is faster or slower by one factor, for a reason that speeds alone
//! cannot tell.
//!
//! Mass, density, propeller size over motor distance, the share of the thrust that is found in the
//! jet, and a probe's gain all act alike:
//!
//! ```text
//! U ~ √(m/ρ) (d/l)^p g
//! ```
//!
//! Separated by throttle (`√(m/ρ)`), power (`m^1.5 ρ^-0.5`), a second drone of another `d/l`, or a
//! second probe.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "momentum_scale",
    aliases: &[],
    equation: "U -> f U",
    description: "the whole jet is stronger or weaker by one factor",
    parameters: &[Parameter::ratio("speed_factor", &["f"], 1.0, [0.1, 4.0]).fit(0.4, 1.9)],
    essential: 1,
    home: Home::Jet,
    treatment: |_| Treatment::Exact,
    get: |effects| Some(vec![effects.momentum_scale?.speed_factor]),
    set: |effects, p| effects.momentum_scale = Some(MomentumScale { speed_factor: p[0] }),
};

/// A factor on every speed of the jet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MomentumScale {
    /// 1: none.
    pub speed_factor: f64,
}
