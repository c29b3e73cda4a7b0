//! Recirculation: the jets set a closed room in motion.
//!
//! ```text
//! u_r(t) = u_∞ (1 - exp(-(t - t₀)/τ_r))
//! ```
//!
//! A draught that grows after take-off, everywhere; for a hall of 25 x 25 x 7 m some 0.1 m/s after ten minutes (order of magnitude, recalled). It has no direction that a
//! speed probe could tell, so it adds in squares. Taken for: a probe's offset or drift, which do not grow with flight time and stay after landing; wind.

use serde::{Deserialize, Serialize};

/// A growing draught.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recirculation {
    /// `u_∞` (m/s).
    pub speed_mps: f64,
    /// `τ_r` (s).
    pub time_s: f64,
}

impl Recirculation {
    /// The draught (m/s) at a time since take-off (s).
    #[must_use]
    pub fn draught_mps(&self, since_takeoff_s: f64) -> f64 {
        self.speed_mps * -(-since_takeoff_s.max(0.0) / self.time_s).exp_m1()
    }
}
