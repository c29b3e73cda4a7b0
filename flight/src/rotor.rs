//! What rotors give in axial air: thrust and power at a speed and an inflow.
//!
//! Everything over its value at hover in still air: thrust `t`, rotor speed `Ω`, induced velocity
//! `v`, air from above `a` (own climb included). Momentum theory ties them, `t = v (v + a)`; what a
//! rotor does at a given speed is a model of its own:
//!
//! ```text
//! blade: t = (1 + κ) Ω² - κ Ω (v + a)         dt/da = -κ/(2 + κ) at hover
//! power: t (v + a) = Ω³                       dt/da = -1/3
//! ```
//!
//! `blade` is blade-element theory with a constant lift slope: lift falls with the inflow angle
//! (J. G. Leishman, Principles of Helicopter Aerodynamics, 2006, ch. 3). `κ = 0.5`, a loss of 0.20,
//! explains best why the paper's feed-forward over-compensates; see `docs/flight.md`. `power` is a
//! motor controller that holds the power.

use airflow::power::thrust_ratio_at_constant_power;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Air from below stronger than this part of the induced velocity counts as this much: vortex ring
/// state is not modelled.
const MOST_UPWARD: f64 = 1.0;

/// How thrust at a rotor speed changes with the air through the rotor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Rotor {
    /// Blades at a constant speed.
    Blade {
        /// `κ`: 0: thrust does not change; above 0.
        kappa: f64,
    },
    /// Constant aerodynamic power.
    Power,
}

/// `κ` of [`Rotor::Blade`] unless a file says otherwise; see the module's first lines.
const KAPPA: f64 = 0.5;

impl Default for Rotor {
    fn default() -> Rotor {
        Rotor::Blade { kappa: KAPPA }
    }
}

impl Rotor {
    /// Thrust and aerodynamic power, over those of hover in still air, at a speed over that of
    /// hover and with air from above over the induced velocity.
    #[must_use]
    pub(crate) fn thrust_and_power(&self, speed: f64, inflow: f64) -> (f64, f64) {
        let inflow = inflow.max(-MOST_UPWARD);
        match *self {
            Rotor::Power => {
                let ratio = thrust_ratio_at_constant_power(inflow / speed);
                (ratio * speed * speed, speed.powi(3))
            }
            Rotor::Blade { kappa } => {
                // v² + (a + κ Ω) v = (1 + κ) Ω² - κ Ω a
                let half = 0.5 * (inflow + kappa * speed);
                let rest = (1.0 + kappa) * speed * speed - kappa * speed * inflow;
                let induced = (half * half + rest).max(0.0).sqrt() - half;
                let through = induced + inflow;
                let thrust = (induced * through).max(0.0);
                (thrust, thrust * through)
            }
        }
    }

    /// Factor on the speed that holds the thrust of still air in air from above over the induced
    /// velocity at that thrust: the inverse of [`Rotor::thrust_and_power`].
    #[must_use]
    pub(crate) fn holding_factor(&self, inflow: f64) -> f64 {
        // What passes through the rotor at the thrust of hover.
        let through = 0.5 * inflow + (0.5 * inflow).hypot(1.0);
        match *self {
            Rotor::Power => through.cbrt(),
            Rotor::Blade { kappa } => {
                let half = 0.5 * kappa * through;
                (half + (half * half + 1.0 + kappa).sqrt()) / (1.0 + kappa)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Central difference of the thrust with the inflow at hover.
    fn loss(rotor: Rotor) -> f64 {
        let at = |inflow: f64| rotor.thrust_and_power(1.0, inflow).0;
        (at(1e-4) - at(-1e-4)) / 2e-4
    }

    #[test]
    fn rotors_lose_what_their_model_says() {
        let blade = Rotor::default();
        for rotor in [blade, Rotor::Power] {
            let (thrust, power) = rotor.thrust_and_power(1.0, 0.0);
            assert!((thrust - 1.0).abs() < 1e-12 && (power - 1.0).abs() < 1e-12);
        }
        // The second order of the difference is of 1e-8.
        assert!((loss(blade) + 0.2).abs() < 1e-6);
        assert!((loss(Rotor::Power) + 1.0 / 3.0).abs() < 1e-6);
        assert!((loss(Rotor::Blade { kappa: 0.0 })).abs() < 1e-6);
    }

    #[test]
    fn the_factor_that_holds_the_thrust_does() {
        for rotor in [Rotor::default(), Rotor::Power] {
            for inflow in [-0.5, 0.0, 0.3, 1.4] {
                let factor = rotor.holding_factor(inflow);
                let (thrust, _) = rotor.thrust_and_power(factor, inflow);
                assert!((thrust - 1.0).abs() < 1e-9, "{rotor:?} {inflow}: {thrust}");
            }
        }
    }

    #[test]
    fn momentum_theory_holds_at_every_speed_and_inflow() {
        for rotor in [Rotor::default(), Rotor::Power] {
            for (speed, inflow) in [(0.7, 0.0), (1.3, 1.4), (1.0, -0.6), (1.9, 0.3)] {
                let (thrust, power) = rotor.thrust_and_power(speed, inflow);
                let through = power / thrust;
                assert!((thrust - (through - inflow) * through).abs() < 1e-9);
            }
        }
    }
}
