//! Payload: the drone is heavier or lighter than stated, always, or from one moment to another.
//!
//! ```text
//! U ~ √(m/m₀)
//! ```
//!
//! Seen in the throttle too, `√(m/m₀)`, and in the power, `(m/m₀)^1.5`; that is what tells it from
//! a sensor's gain. Range: 0.4 to 2.5.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, FitOver, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "payload_mass",
    aliases: &[],
    equation: "U -> U sqrt(m/m0) from t0 on",
    description: "the drone is heavier or lighter than stated",
    parameters: &[
        Parameter::ratio("mass_factor", &["m/m0"], 1.0, [0.4, 2.5]),
        Parameter {
            neutral: f64::NEG_INFINITY,
            fit_over: FitOver::Recording,
            is_optional: true,
            ..Parameter::new("since_s", &["t0"], "s", [f64::NEG_INFINITY, f64::MAX]).fit(0.0, 1.0)
        },
        Parameter {
            neutral: f64::INFINITY,
            fit: None,
            is_optional: true,
            ..Parameter::new("until_s", &["t1"], "s", [f64::MIN, f64::INFINITY])
        },
    ],
    essential: 1,
    home: Home::Jet,
    treatment: |effects| match effects.payload_mass {
        Some(payload) if payload.is_constant() => Treatment::Exact,
        Some(payload) if payload.mass_factor > 1.0 => {
            Treatment::Bounded("the drones are taken as heavier from the beginning")
        }
        _ => Treatment::Bounded("the drones are taken as heavy as before it was dropped"),
    },
    get: |effects| {
        let payload = effects.payload_mass?;
        Some(vec![payload.mass_factor, payload.since_s, payload.until_s])
    },
    set: |effects, p| {
        effects.payload_mass = Some(PayloadMass {
            mass_factor: p[0],
            since_s: p[1],
            until_s: p[2],
        });
    },
};

/// Mass over the stated mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PayloadMass {
    /// `m/m₀`; 1: as stated.
    pub mass_factor: f64,
    /// From this moment on (s, the recording's clock); negative infinity, and left out in files:
    /// always.
    #[serde(default = "begin", skip_serializing_if = "is_unbounded")]
    pub since_s: f64,
    /// Until this moment (s); infinity, and left out in files: for good.
    #[serde(default = "end", skip_serializing_if = "is_unbounded")]
    pub until_s: f64,
}

fn is_unbounded(time_s: &f64) -> bool {
    time_s.is_infinite()
}

fn begin() -> f64 {
    f64::NEG_INFINITY
}

fn end() -> f64 {
    f64::INFINITY
}

impl PayloadMass {
    /// Another mass all the time.
    #[must_use]
    pub fn always(mass_factor: f64) -> PayloadMass {
        PayloadMass {
            mass_factor,
            since_s: f64::NEG_INFINITY,
            until_s: f64::INFINITY,
        }
    }

    /// Whether it never changes.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.since_s == f64::NEG_INFINITY && self.until_s == f64::INFINITY
    }

    /// Factor on `U_H` at a time (s).
    pub(crate) fn factor(&self, t_s: f64) -> f64 {
        if (self.since_s..self.until_s).contains(&t_s) {
            self.mass_factor.max(0.0).sqrt()
        } else {
            1.0
        }
    }
}
