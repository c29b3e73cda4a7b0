//! Own motion: a receiver that climbs meets air from above that is no other drone's wake, one that
//! flies forward finds fresh air.
//!
//! ```text
//! climb:    α → α + κ V_z/U_H
//! forward:  T → T (1 + b (V_h/U_H)²)
//! ```
//!
//! Momentum theory at constant power has `κ = 1`; Glauert's inflow in slow forward flight,
//! expanded, has `b = 1/6` (from `v_i √(V_h² + v_i²) = τ U_H²` and `τ v_i = U_H`). Range: `|V|`
//! below `U_H/2`. Taken for: a rotor lag, which sees changes of thrust and not speed.

use serde::{Deserialize, Serialize};

use super::spec::{EffectSpec, Home, OWN, Parameter};

/// Row of the effect table.
pub(super) const SPEC: EffectSpec = EffectSpec {
    name: "own_motion",
    aliases: &[],
    equation: "alpha -> alpha + kappa V_z/U_H, T -> T (1 + b (V_h/U_H)^2)",
    description: "a drone that climbs meets air from above, one that flies forward finds fresh air",
    parameters: &[
        Parameter::ratio("climb", &["kappa"], 0.0, [-2.0, 4.0]),
        Parameter::ratio("forward", &["b"], 0.0, [-3.0, 6.0]),
    ],
    essential: 2,
    home: Home::Receiver,
    treatment: |_| OWN,
    get: |effects| (effects.own_motion).map(|effect| vec![effect.climb, effect.forward]),
    set: |effects, p| {
        effects.own_motion = Some(OwnMotion {
            climb: p[0],
            forward: p[1],
        });
    },
};

/// What a receiver's own velocity does to its thrust.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OwnMotion {
    /// `κ`; 1: momentum theory.
    pub climb: f64,
    /// `b`; 1/6: Glauert.
    pub forward: f64,
}

impl OwnMotion {
    /// Air from above over `U_H`, with the drone's own climb over `U_H` added.
    #[must_use]
    pub fn alpha(&self, alpha: f64, climb: f64) -> f64 {
        alpha + self.climb * climb
    }

    /// Factor on the thrust at a horizontal speed over `U_H`.
    #[must_use]
    pub fn thrust_ratio(&self, forward: f64) -> f64 {
        1.0 + self.forward * forward * forward
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forward_flight_gains_what_glauerts_inflow_gives() {
        let motion = OwnMotion {
            climb: 1.0,
            forward: 1.0 / 6.0,
        };
        // τ from τ² √( x² + 1/τ² ) / τ = τ² ... solved by bisection: v = 1/τ, v √(x² + v²) = τ.
        let x: f64 = 0.2;
        let (mut low, mut high) = (1.0_f64, 1.5_f64);
        for _ in 0..60 {
            let tau = 0.5 * (low + high);
            let v = tau.recip();
            if v * (x * x + v * v).sqrt() > tau {
                low = tau;
            } else {
                high = tau;
            }
        }
        // The next term of the expansion is of order x⁴ = 1.6e-3 times a few hundredths.
        assert!((motion.thrust_ratio(x) - low).abs() < 2e-4);
        assert_eq!(motion.alpha(0.3, 0.1), 0.4);
    }
}
