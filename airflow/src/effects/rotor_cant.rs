//! Canted propellers: a wider jet, or a narrower one, of the same momentum.
//!
//! ```text
//! r_half → q r_half,   U_C → U_C/q
//! ```
//!
//! `q > 1` for propellers canted outwards, `q < 1` inwards. Range: 0.7 to 1.45. The paper shows the
//! sign for two drones (a slightly narrower jet for a Mavic 3E, a wider one for an Elios 3) and no
//! number. Taken for: a width error alone (leaves the axis as it is), wander (grows with depth), a
//! change of mass (no change of sign across the jet).

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "rotor_cant",
    aliases: &["width_scale"],
    equation: "r_half -> q r_half, U_C -> U_C/q",
    description: "canted propellers make the jet wider or narrower at the same momentum",
    parameters: &[Parameter::ratio("width_factor", &["q"], 1.0, [0.7, 1.45])],
    essential: 1,
    home: Home::Jet,
    treatment: |_| Treatment::Exact,
    get: |effects| Some(vec![effects.rotor_cant?.width_factor]),
    set: |effects, p| effects.rotor_cant = Some(RotorCant { width_factor: p[0] }),
};

/// A factor on the half-width at constant momentum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RotorCant {
    /// `q`; 1: none.
    pub width_factor: f64,
}

impl RotorCant {
    /// Factors on width and speed.
    pub(crate) fn factors(&self) -> [f64; 2] {
        [self.width_factor, 1.0 / self.width_factor]
    }
}
