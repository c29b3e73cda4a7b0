//! Density: the air is thinner or thicker than stated.
//!
//! ```text
//! U ~ √(ρ₀/ρ)
//! ```
//!
//! Throttle and power of a drone that hovers both go with the same root. The usual cause is a
//! pressure at the place that was not entered. Range: 0.6 to 1.4.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "air_density",
    aliases: &[],
    equation: "U -> U sqrt(rho0/rho)",
    description: "the air is thinner or thicker than stated",
    parameters: &[Parameter {
        // Throttle and power tell it; speeds cannot.
        fit: None,
        ..Parameter::ratio("density_factor", &["rho/rho0"], 1.0, [0.6, 1.4])
    }],
    essential: 1,
    home: Home::Jet,
    treatment: |_| Treatment::Exact,
    get: |effects| Some(vec![effects.air_density?.density_factor]),
    set: |effects, p| {
        effects.air_density = Some(AirDensity {
            density_factor: p[0],
        })
    },
};

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
