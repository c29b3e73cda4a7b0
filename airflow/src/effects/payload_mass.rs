//! Payload: the drone is heavier or lighter than stated, always or from one moment on.
//!
//! ```text
//! U ~ √(m/m₀)
//! ```
//!
//! Seen in the throttle too, `√(m/m₀)`, and in the power, `(m/m₀)^1.5`; that is what tells it from a sensor's gain. Range: 0.4 to 2.5.

use serde::{Deserialize, Serialize};

/// Mass over the stated mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PayloadMass {
    /// `m/m₀`; 1: as stated.
    pub mass_factor: f64,
    /// From this moment on (s, the recording's clock); negative infinity, and left out in files: always.
    #[serde(default = "always", skip_serializing_if = "is_always")]
    pub since_s: f64,
}

fn always() -> f64 {
    f64::NEG_INFINITY
}

fn is_always(since_s: &f64) -> bool {
    *since_s == always()
}

impl PayloadMass {
    /// Factor on `U_H` at a time (s).
    pub(crate) fn factor(&self, t_s: f64) -> f64 {
        if t_s >= self.since_s {
            self.mass_factor.max(0.0).sqrt()
        } else {
            1.0
        }
    }
}
