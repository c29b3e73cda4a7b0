//! Near field: above 2.5 motor distances there are four jets and a slow core, not one.
//!
//! For simulations that extrapolate the far field to the rotors. The four rotor jets of
//! [`crate::Wake`] take its place by a share, and the body's shadow has a depth of its own:
//!
//! ```text
//! U = (1 - λ) U_far + λ U_four(D₀),   s < 2.5 l
//! ```
//!
//! Taken for nothing else: only above 2.5 l, and with the period of the rotors around the axis.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "near_field",
    aliases: &["rotor_lobes"],
    equation: "U = (1 - lambda) U_far + lambda U_four(D0), s < 2.5 l",
    description: "close below the rotors there are four jets and a slow core, not one jet",
    parameters: &[
        Parameter::ratio("share", &["lambda"], 0.0, [-0.5, 2.0]).fit(-0.3, 1.8),
        Parameter::ratio("shadow", &["D0"], 0.5, [0.0, 1.0]),
    ],
    essential: 1,
    home: Home::Jet,
    treatment: |_| Treatment::Exact,
    get: |effects| (effects.near_field).map(|effect| vec![effect.share, effect.shadow]),
    set: |effects, p| {
        effects.near_field = Some(NearFieldShape {
            share: p[0],
            shadow: p[1],
        });
    },
};

/// The four-rotor field in place of the extrapolated far field.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NearFieldShape {
    /// `λ`; 1: all of it.
    pub share: f64,
    /// `D₀`, share of the flow that the body takes away on the axis at the rotors; 0.5 in
    /// [`crate::Wake`].
    pub shadow: f64,
}
