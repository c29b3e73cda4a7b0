//! Radial flow: more or less air drawn in than the mean profile asks for.
//!
//! ```text
//! V → κ V
//! ```
//!
//! Range: 0 to 3. To a probe of magnitude it matters beyond 3 half-widths, where `V` exceeds a third of `U`. Taken for: the tail, the ambient.

use serde::{Deserialize, Serialize};

/// A factor on the radial flow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EntrainmentRadial {
    /// `κ`; 1: continuity of the paper's profile.
    pub factor: f64,
}

impl EntrainmentRadial {
    /// The factor.
    pub(crate) fn on_radial(&self) -> f64 {
        self.factor
    }
}
