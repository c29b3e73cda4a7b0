//! Propeller size: the paper scales every jet with `U_H l`, momentum says `U_H d`; the truth may lie between.
//!
//! ```text
//! U_C ~ U_H l ( d/(0.53 l) )^p,   p = 0: the paper; p = 1: momentum alone
//! ```
//!
//! 0.53 is the middle of the paper's four uncanted airframes. To be seen only with two airframes of different `d/l`; with one it is a factor like any other.

use serde::{Deserialize, Serialize};

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
