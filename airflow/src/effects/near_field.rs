//! Near field: above 2.5 motor distances there are four jets and a slow core, not one.
//!
//! For simulations that extrapolate the far field to the rotors. The four rotor jets of
//! [`crate::Wake`] take its place by a share, and the body's shadow takes away and reaches as far
//! as this body's does:
//!
//! ```text
//! U = (1 - λ) U_far + λ U_four(D₀, s_b),   s < 2.5 l
//! ```
//!
//! Taken for nothing else: only above 2.5 l, and with the period of the rotors around the axis.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};
use crate::rotor_jets::{SHADOW, Shadow};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "near_field",
    aliases: &["rotor_lobes"],
    equation: "U = (1 - lambda) U_far + lambda U_four(D0, s_b), s < 2.5 l",
    description: "close below the rotors there are four jets and a slow core, not one jet",
    parameters: &[
        Parameter::ratio("share", &["lambda"], 0.0, [-0.5, 2.0]).fit(-0.3, 1.8),
        Parameter::ratio("shadow", &["D0"], SHADOW.at_rotors, [0.0, 1.0]),
        // From the radius of the shadow itself to the depth of the near field.
        Parameter {
            is_optional: true,
            ..Parameter::ratio("shadow_depth_over_l", &["s_b"], SHADOW.depth, [0.2, 2.5])
        },
    ],
    essential: 1,
    home: Home::Jet,
    treatment: |_| Treatment::Exact,
    get: |effects| {
        (effects.near_field)
            .map(|effect| vec![effect.share, effect.shadow, effect.shadow_depth_over_l])
    },
    set: |effects, p| {
        effects.near_field = Some(NearFieldShape {
            share: p[0],
            shadow: p[1],
            shadow_depth_over_l: p[2],
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
    /// `s_b`, depth over which that fills, in motor distances; 0.7 in [`crate::Wake`], and where
    /// files leave it out.
    #[serde(default = "shadow_depth")]
    pub shadow_depth_over_l: f64,
}

fn shadow_depth() -> f64 {
    SHADOW.depth
}

impl NearFieldShape {
    pub(crate) fn shadow(&self) -> Shadow {
        Shadow {
            at_rotors: self.shadow,
            depth: self.shadow_depth_over_l,
        }
    }
}
