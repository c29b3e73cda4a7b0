//! Propeller size: the paper scales every jet with `U_H l`, momentum says `U_H d`; the truth may
//! lie between.
//!
//! ```text
//! U_C ~ U_H l ( d/(0.53 l) )^p,   p = 0: the paper; p = 1: momentum alone
//! ```
//!
//! 0.53 is the middle of the paper's four uncanted airframes. To be seen only with two airframes of
//! different `d/l`; with one it is a factor like any other.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "dl_ratio",
    aliases: &[],
    equation: "U_C ~ U_H l (d/(0.53 l))^p",
    description: "jets scale with the size of the propellers, not with the motor distance alone",
    parameters: &[Parameter::ratio("exponent", &["p"], 0.0, [-0.5, 1.5])],
    essential: 1,
    home: Home::Jet,
    treatment: |_| Treatment::Exact,
    get: |effects| Some(vec![effects.dl_ratio?.exponent]),
    set: |effects, p| effects.dl_ratio = Some(DlRatio { exponent: p[0] }),
};

/// The exponent of propeller size over motor distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DlRatio {
    /// `p`, -0.5 to 1.5.
    pub exponent: f64,
}

impl DlRatio {
    /// Factor on `U_H` for an airframe with propellers of `d/l`.
    pub(crate) fn factor(&self, diameter_over_l: f64) -> f64 {
        (diameter_over_l / 0.53).powf(self.exponent)
    }
}
