//! Climb and descent: a climbing rotor breathes air that comes towards it, and blows less.
//!
//! ```text
//! climb:   v_i/v_h = -x/2 + √(x²/4 + 1),   x = V_z/v_h
//! descent: the same, to x = -0.5; below that lies the vortex ring state, where no mean jet exists
//! ```
//!
//! Momentum theory; the wake goes with `(v_i/v_h)^p`, physically `p = 1`. Taken for: transport, since depth changes too.

use serde::{Deserialize, Serialize};

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
