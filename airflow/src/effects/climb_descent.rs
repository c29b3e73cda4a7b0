//! Climb and descent: a climbing rotor takes in air that comes towards it, and its wake is weaker.
//!
//! ```text
//! climb:   v_i/v_h = -x/2 + √(x²/4 + 1),   x = V_z/v_h
//! descent: the same, to x = -0.5; below that lies the vortex ring state, where no mean jet exists
//! ```
//!
//! Momentum theory; the wake goes with `(v_i/v_h)^p`, physically `p = 1`. Taken for: transport,
//! since depth changes too.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, Parameter, Treatment};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "climb_descent",
    aliases: &[],
    equation: "U -> U (v_i/v_h)^p, v_i/v_h = -x/2 + sqrt(x^2/4 + 1), x = V_z/v_h",
    description: "a climbing drone has a weaker wake, a sinking one a stronger",
    parameters: &[Parameter::ratio("exponent", &["p"], 0.0, [0.0, 3.0])],
    essential: 1,
    home: Home::Surroundings,
    treatment: |_| {
        Treatment::Bounded(
            "while the plan is sought every wake is taken as of a drone that sinks at full speed; the check takes each as it is",
        )
    },
    get: |effects| Some(vec![effects.climb_descent?.exponent]),
    set: |effects, p| effects.climb_descent = Some(ClimbDescent { exponent: p[0] }),
};

/// Wake strength with vertical speed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClimbDescent {
    /// `p`, 0 to 3; 1: momentum theory.
    pub exponent: f64,
}

impl ClimbDescent {
    /// Factor on `U_H` at a vertical speed over it (up positive).
    pub(crate) fn factor(&self, climb: f64) -> f64 {
        let x = climb.max(-0.5);
        (-0.5 * x + (0.25 * x * x + 1.0).sqrt()).powf(self.exponent)
    }
}
