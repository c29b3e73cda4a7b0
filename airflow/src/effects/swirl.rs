//! Swirl: the jet turns about its axis.
//!
//! ```text
//! W_θ = k U_C ξ/(1 + a ξ²)² · s₀/(s₀ - s)
//! ```
//!
//! Counter-rotating propellers cancel it but for yaw torque and failed rotors; it decays faster than the axial speed and enters a magnitude
//! squared, so a speed probe hardly sees it. Range: `k` 0 to 0.8.

use serde::{Deserialize, Serialize};

/// Speed around the axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Swirl {
    /// `k`: over the centreline speed, at the rotor plane.
    pub ratio: f64,
}

impl Swirl {
    /// Speed around the axis over the centreline's, at `ξ` and a depth (l), for a virtual origin `s₀` (l).
    pub(crate) fn speed(&self, xi: f64, s: f64, origin: f64) -> f64 {
        let profile = 1.0 + crate::jet::PROFILE_A * xi * xi;
        self.ratio * xi / (profile * profile) * origin / (origin - s)
    }
}
