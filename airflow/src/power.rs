//! What hovering in a downwash costs: induced velocity, power, throttle, thrust, energy.
//!
//! `alpha` is the mean axial speed over the discs over the rotors' own hover value, `α = U_D/U_H`,
//! positive downwards. Momentum theory at the rotor disc, so the rotor is assumed to see one
//! uniform speed: average it over the discs first.

use crate::air::GRAVITY_MPS2;

/// Exponent on `β` for throttle: the paper measures power growing with throttle squared, for one
/// motor controller.
pub const THROTTLE_EXPONENT: f64 = 0.5;

/// Power to keep the thrust in a downwash, over the power in still air: `β = P'/P`.
///
/// ```text
/// β = α/2 + √(α² + 4)/2
/// ```
///
/// It answers "what does it cost to stay", not "how far do I sink": see
/// [`thrust_ratio_at_constant_power`].
#[must_use]
pub fn beta(alpha: f64) -> f64 {
    0.5 * alpha + 0.5 * alpha.hypot(2.0)
}

/// Factor on the throttle that keeps the thrust, `β^exponent`; [`THROTTLE_EXPONENT`] where power
/// grows with throttle squared.
#[must_use]
pub fn throttle_factor(alpha: f64, exponent: f64) -> f64 {
    beta(alpha).powf(exponent)
}

/// Thrust `τ = T'/T` that is left in a downwash when the aerodynamic power stays what it was in
/// still air.
///
/// The rotor's own induced velocity shrinks with its thrust, so the loss is smaller than `1 - 1/β`.
/// Squaring away the root leaves a cubic:
///
/// ```text
/// τ ( α/2 + √(α²/4 + τ) ) = 1   ⇔   τ³ + α τ - 1 = 0,  τ > 0
/// ```
///
/// Defined for upwash too (`α < 0`, `τ > 1`); not a number for an alpha that is not one.
#[must_use]
pub fn thrust_ratio_at_constant_power(alpha: f64) -> f64 {
    // Newton from a point right of the root, where the cubic is convex and rising, falls towards it
    // without overshoot.
    let mut tau = if alpha > 1.0 {
        alpha.recip()
    } else {
        1.0 + (-alpha).max(0.0)
    };
    loop {
        let next = tau - (tau * (tau * tau + alpha) - 1.0) / (3.0 * tau * tau + alpha);
        let falls = next < tau; // false at rounding level, and for a NaN: both end the search
        if !falls {
            return if alpha.is_nan() { alpha } else { tau };
        }
        tau = next;
    }
}

/// Power (W) above that of still air, to hover `mass_kg` in a downwash: `(β - 1) m g U_H`. Ideal,
/// as [`crate::Airframe::hover_power_w`].
#[must_use]
pub fn extra_power_w(mass_kg: f64, u_h_mps: f64, alpha: f64) -> f64 {
    (beta(alpha) - 1.0) * mass_kg * GRAVITY_MPS2 * u_h_mps
}

/// Energy (J) above that of still air, for `duration_s` in a steady downwash: [`extra_power_w`]
/// times the time.
#[must_use]
pub fn extra_energy_j(mass_kg: f64, u_h_mps: f64, alpha: f64, duration_s: f64) -> f64 {
    extra_power_w(mass_kg, u_h_mps, alpha) * duration_s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beta_is_the_ratio_of_induced_velocities() {
        for (u_h, u_d) in [(7.41, 10.2), (5.36, 0.0), (9.66, -2.0)] {
            // Rounding of values near 10.
            let in_downwash: f64 = 0.5 * u_d + f64::hypot(0.5 * u_d, u_h);
            assert!((in_downwash / u_h - beta(u_d / u_h)).abs() < 1e-14);
        }
        assert_eq!(beta(0.0), 1.0);
    }

    #[test]
    fn thrust_ratio_solves_its_equation_to_rounding() {
        for alpha in [-3.0, -0.5, 0.0, 1e-9, 0.3, 1.0, 1.0001, 2.5, 40.0, 1e6] {
            let tau = thrust_ratio_at_constant_power(alpha);
            // A difference of two terms of size alpha² cancels in the root for alpha >> 1: scale
            // with it.
            let left = tau * (0.5 * alpha + (0.25 * alpha * alpha + tau).sqrt());
            assert!(
                (left - 1.0).abs() < 8.0 * f64::EPSILON * (1.0 + alpha.abs()),
                "alpha {alpha}: {left}"
            );
        }
        assert_eq!(thrust_ratio_at_constant_power(0.0), 1.0);
        assert!(thrust_ratio_at_constant_power(f64::NAN).is_nan());
    }

    #[test]
    fn less_thrust_is_lost_than_power_is_needed() {
        for alpha in [0.1, 0.3, 1.0, 3.0] {
            let tau = thrust_ratio_at_constant_power(alpha);
            assert!(tau < 1.0 && tau > 1.0 / beta(alpha));
        }
    }

    #[test]
    fn holding_the_default_limit_costs_sixteen_percent() {
        // The limit 0.3 stands for +16 %, printed to a percent.
        assert!((beta(0.3) - 1.16).abs() < 0.005);
        let still_w = 2.0 * GRAVITY_MPS2 * 5.0;
        assert!((extra_power_w(2.0, 5.0, 0.3) / still_w - (beta(0.3) - 1.0)).abs() < 1e-15);
        assert_eq!(
            extra_energy_j(2.0, 5.0, 0.3, 4.0),
            4.0 * extra_power_w(2.0, 5.0, 0.3)
        );
    }
}
