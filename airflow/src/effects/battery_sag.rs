//! Battery: as its voltage falls, the same thrust takes more throttle.
//!
//! ```text
//! throttle → throttle (1 + k (V₀ - V)/V₀)
//! ```
//!
//! `V₀`: the voltage at the beginning of the recording. `k = 1` where thrust goes with the square of duty times voltage. Range: -2 to 4. Present outside every jet, and monotone in the voltage: that tells it from air.

use serde::{Deserialize, Serialize};

/// Throttle gained as the voltage falls.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BatterySag {
    /// `k`.
    pub sensitivity: f64,
}

impl BatterySag {
    /// Factor on the throttle at a voltage over that of the beginning.
    #[must_use]
    pub fn throttle_factor(&self, voltage_ratio: f64) -> f64 {
        1.0 + self.sensitivity * (1.0 - voltage_ratio)
    }
}
