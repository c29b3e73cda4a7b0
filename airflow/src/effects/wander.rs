//! Wander: the axis meanders, so the mean of many moments is wider and slower than any of them.
//!
//! The mean over an axis that is normally distributed is a convolution; it keeps the volume flux,
//! not the momentum of the mean. An axis that leaves at a changing angle strays in proportion to
//! the depth `s`, the jet's own width grows with `s - s₀`:
//!
//! ```text
//! g² = 1 + w₂ (ς(s)/ς(6))²,   ς = s/(s - s₀),   r_half → g r_half,   U_C → U_C/g²
//! ```
//!
//! Range: `w₂` up to 3. Taken for: cant (the same change of sign, but the same at every depth and
//! at the same momentum).

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "wander",
    aliases: &["meander", "unsteadiness"],
    equation: "g^2 = 1 + w2 (z(s)/z(6))^2, z = s/(s - s0), r_half -> g r_half, U_C -> U_C/g^2",
    description: "the jet's axis meanders, more with depth, so its mean is wider and slower",
    parameters: &[Parameter::ratio("growth", &["w2"], 0.0, [-1.0, 3.0]).fit(-0.4, 3.0)],
    essential: 1,
    home: Home::Jet,
    treatment: |_| Treatment::Exact,
    get: |effects| Some(vec![effects.wander?.growth]),
    set: |effects, p| effects.wander = Some(Wander { growth: p[0] }),
};

/// Growth of the mean width by a meandering axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wander {
    /// `w₂`: by how much the squared width has grown 6 motor distances down.
    pub growth: f64,
}

impl Wander {
    /// Factors on width and speed at a depth (l), with the virtual origin's depth (l).
    pub(crate) fn factors(&self, s: f64, origin: f64) -> [f64; 2] {
        let strays = |s: f64| s / (s - origin);
        let part = strays(s) / strays(6.0);
        let squared = (1.0 + self.growth * part * part).max(0.05);
        [squared.sqrt(), 1.0 / squared]
    }
}
