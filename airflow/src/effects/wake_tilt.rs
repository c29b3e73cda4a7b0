//! Tilt: the jet's axis leans by a constant angle, as when the rotor plane or the thrust does.
//!
//! ```text
//! x(s) = s tan χ
//! ```
//!
//! Range: a few tenths. Taken for: wind (drift grows with `s²` and leaves a draught far from the jet), a shifted probe or drone (constant in `s`).

use serde::{Deserialize, Serialize};

/// A lean of the axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WakeTilt {
    /// Tangent of the lean along x and y of the world: metres sideways for each metre down.
    pub lean: [f64; 2],
}

impl WakeTilt {
    /// Shift of the axis (l), x and y, at a depth (l).
    pub(crate) fn shift(&self, s: f64) -> [f64; 2] {
        self.lean.map(|lean| lean * s)
    }
}
