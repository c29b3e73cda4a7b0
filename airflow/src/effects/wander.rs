//! Wander: the axis meanders, so the mean of many moments is wider and slower than any of them.
//!
//! The mean over an axis that is normally distributed is a convolution; it keeps the volume flux, not the momentum of the mean. An axis that
//! leaves at a changing angle strays in proportion to the depth `s`, the jet's own width grows with `s - s₀`:
//!
//! ```text
//! g² = 1 + w₂ (ς(s)/ς(6))²,   ς = s/(s - s₀),   r_half → g r_half,   U_C → U_C/g²
//! ```
//!
//! Range: `w₂` up to 3. Taken for: cant (the same change of sign, but the same at every depth and at the same momentum).

use serde::{Deserialize, Serialize};

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
