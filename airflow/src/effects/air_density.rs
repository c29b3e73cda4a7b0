//! Density: the air is thinner or thicker than stated.
//!
//! ```text
//! U ~ √(ρ₀/ρ)
//! ```
//!
//! Throttle goes with it, power with its square root only. The usual cause is a pressure at the place that was not entered. Range: 0.6 to 1.4.

use serde::{Deserialize, Serialize};

/// Density over the stated density.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AirDensity {
    /// `ρ/ρ₀`; 1: as stated.
    pub density_factor: f64,
}

impl AirDensity {
    /// Factor on `U_H`.
    pub(crate) fn factor(&self) -> f64 {
        self.density_factor.recip().max(0.0).sqrt()
    }
}
