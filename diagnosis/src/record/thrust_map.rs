//! From duty cycle and battery voltage to thrust, identified before any air is judged.
//!
//! A motor's thrust is a polynomial of its duty cycle `u` and the battery voltage over a reference,
//! `v = V/V_ref`; what the rotor gives follows it with a first-order lag, because a rotor has
//! inertia:
//!
//! ```text
//! T_ref = Σ_motors Σ_k c_k u^i_k v^j_k,        λ dT/dt = T_ref - T
//! ```

use serde::Serialize;

/// Highest power of either variable. Chosen here: a cubic in duty cycle already fits to the scatter
/// of the flights.
pub const HIGHEST_POWER: u8 = 4;

/// One term of the polynomial, without its coefficient: `u^duty_power · v^battery_power`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Term {
    /// Of the duty cycle, at most [`HIGHEST_POWER`].
    pub duty_power: u8,
    /// Of the battery voltage over the reference, at most [`HIGHEST_POWER`].
    pub battery_power: u8,
}

impl Term {
    /// `u^duty_power · v^battery_power`.
    #[must_use]
    pub const fn new(duty_power: u8, battery_power: u8) -> Term {
        Term {
            duty_power,
            battery_power,
        }
    }

    /// Its value, summed over four motors.
    pub(crate) fn over_motors(self, duty: [f64; 4], battery_over_reference: f64) -> f64 {
        let power = i32::from(self.duty_power);
        let motors: f64 = duty.iter().map(|u| u.powi(power)).sum();
        motors * battery_over_reference.powi(i32::from(self.battery_power))
    }
}

/// A cubic in duty cycle, its lower coefficients linear in the battery, and nothing at zero duty: a
/// rotor at rest does not lift. A constant term buys 1 % less scatter in free flight and an offset
/// of the extrapolation to the duties under a downwash.
pub const CUBIC_FROM_ZERO: [Term; 5] = [
    Term::new(1, 0),
    Term::new(1, 1),
    Term::new(2, 0),
    Term::new(2, 1),
    Term::new(3, 0),
];

/// Thrust of a propeller at the square of its speed: one coefficient, as long as its tips stay far
/// below the speed of sound.
pub const SQUARE: [Term; 1] = [Term::new(2, 0)];

/// One factor on a thrust that is logged.
pub const FACTOR: [Term; 1] = [Term::new(1, 0)];

/// Voltage (V) of a full lithium-polymer cell, that the battery is divided by where nothing else is
/// stated.
pub(crate) const FULL_CELL_V: f64 = 4.2;

/// Nothing but a constant: what is added to a published map.
pub const OFFSET: [Term; 1] = [Term::new(0, 0)];

/// Thrust of a quadrotor from the duty cycles of its motors and its battery voltage.
///
/// ```
/// use diagnosis::record::thrust_map::{Term, ThrustMap};
///
/// // 0.2 N a motor at full duty and a full cell, falling with the voltage; rotors that take 0.05 s to follow; fitted from 0.2 to 0.9.
/// let map = ThrustMap::new(vec![(Term::new(2, 1), 0.2)], 4.2, 0.05, [0.2, 0.9])?;
/// assert!((map.steady_n([0.7; 4], 3.8) - 4.0 * 0.2 * 0.49 * 3.8 / 4.2).abs() < 1e-12);
/// assert!(map.covers([0.7; 4]) && !map.covers([0.7, 0.7, 0.7, 0.95]));
/// # Ok::<(), diagnosis::record::thrust_map::ThrustMapError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ThrustMap {
    terms: Vec<Weighted>,
    battery_reference_v: f64,
    lag_s: f64,
    duty_range: [f64; 2],
}

/// A term with its coefficient (N a motor).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
struct Weighted {
    #[serde(flatten)]
    term: Term,
    newtons: f64,
}

/// Why numbers do not make a thrust map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ThrustMapError {
    /// A polynomial without a term.
    #[error("no term; a thrust map needs at least one")]
    Empty,
    /// A power above [`HIGHEST_POWER`].
    #[error("power {0} of a term is above {HIGHEST_POWER}")]
    Power(u8),
    /// A number outside what it may be.
    #[error("{field} is {value}; it must be {must_be}")]
    Number {
        /// The field at fault.
        field: &'static str,
        /// What it held.
        value: f64,
        /// What it may hold.
        must_be: &'static str,
    },
}

impl ThrustMap {
    /// A map from its terms with their coefficients (N a motor), the voltage that `v` is relative
    /// to (V, above 0), the lag (s, 0 or more) and the range of duty cycle, within 0 to 1, that it
    /// was fitted in.
    ///
    /// # Errors
    /// The first thing that keeps it from being one.
    pub fn new(
        terms: Vec<(Term, f64)>,
        battery_reference_v: f64,
        lag_s: f64,
        duty_range: [f64; 2],
    ) -> Result<ThrustMap, ThrustMapError> {
        if terms.is_empty() {
            return Err(ThrustMapError::Empty);
        }
        let mut powers = terms
            .iter()
            .flat_map(|(term, _)| [term.duty_power, term.battery_power]);
        if let Some(power) = powers.find(|&power| power > HIGHEST_POWER) {
            return Err(ThrustMapError::Power(power));
        }
        let [low, high] = duty_range;
        let number = |field, value: f64, holds: bool, must_be| {
            let fault = ThrustMapError::Number {
                field,
                value,
                must_be,
            };
            (value.is_finite() && holds).then_some(()).ok_or(fault)
        };
        for &(_, newtons) in &terms {
            number("newtons", newtons, true, "finite")?;
        }
        let v = battery_reference_v;
        number("battery_reference_v", v, v > 0.0, "finite and above 0")?;
        number("lag_s", lag_s, lag_s >= 0.0, "finite and 0 or more")?;
        let is_share = (0.0..=1.0).contains(&low);
        number("duty_range", low, is_share, "between 0 and 1")?;
        let must_be = "above its first number and at most 1";
        number("duty_range", high, high > low && high <= 1.0, must_be)?;
        let weighted = |(term, newtons)| Weighted { term, newtons };
        Ok(ThrustMap {
            terms: terms.into_iter().map(weighted).collect(),
            battery_reference_v,
            lag_s,
            duty_range,
        })
    }

    /// Terms, and their coefficients (N a motor).
    pub fn terms(&self) -> impl Iterator<Item = (Term, f64)> + '_ {
        self.terms.iter().map(|one| (one.term, one.newtons))
    }

    /// Voltage (V) that the battery is divided by.
    #[must_use]
    pub fn battery_reference_v(&self) -> f64 {
        self.battery_reference_v
    }

    /// Time constant `λ` (s).
    #[must_use]
    pub fn lag_s(&self) -> f64 {
        self.lag_s
    }

    /// Duty cycles that it was fitted in. Outside it is an extrapolation.
    #[must_use]
    pub fn duty_range(&self) -> [f64; 2] {
        self.duty_range
    }

    /// Whether all motors are within the range that it was fitted in.
    #[must_use]
    pub fn covers(&self, duty: [f64; 4]) -> bool {
        let [low, high] = self.duty_range;
        duty.iter().all(|u| (low..=high).contains(u))
    }

    /// Thrust (N) of all four motors when duty cycle and battery stand still.
    #[must_use]
    pub fn steady_n(&self, duty: [f64; 4], battery_v: f64) -> f64 {
        let v = battery_v / self.battery_reference_v;
        self.terms()
            .map(|(term, newtons)| newtons * term.over_motors(duty, v))
            .sum()
    }

    /// Thrust (N) that four motors at zero duty would give at the reference voltage: the map's
    /// offset. A rotor at rest gives none, so anything else says how far the map can be trusted
    /// below its range.
    #[must_use]
    pub fn offset_n(&self) -> f64 {
        self.steady_n([0.0; 4], self.battery_reference_v)
    }

    /// Relative change of thrust per volt of battery, `(∂T/∂V)/T` (1/V), at a duty cycle of all
    /// motors and a voltage.
    #[must_use]
    pub fn battery_sensitivity_per_v(&self, duty: f64, battery_v: f64) -> f64 {
        let step_v = 1e-3; // a central difference of a polynomial of degree 4 in v, exact to 1e-6
        let [low_n, mid_n, high_n] =
            [-step_v, 0.0, step_v].map(|dv| self.steady_n([duty; 4], battery_v + dv));
        (high_n - low_n) / (2.0 * step_v * mid_n)
    }

    /// Of duty cycles, one entry a row, the rows with a motor outside the range.
    #[must_use]
    pub fn rows_outside(&self, duty: &[[f64; 4]]) -> usize {
        duty.iter().filter(|&&duty| !self.covers(duty)).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(lag_s: f64) -> ThrustMap {
        let terms = vec![(Term::new(1, 1), 0.1), (Term::new(2, 0), 0.05)];
        ThrustMap::new(terms, 4.2, lag_s, [0.1, 0.9]).expect("valid")
    }

    #[test]
    fn thrust_is_the_polynomial_of_each_motor() {
        let expected_n =
            0.1 * (0.2 + 0.4 + 0.6 + 0.8) * (3.7 / 4.2) + 0.05 * (0.04 + 0.16 + 0.36 + 0.64);
        // Rounding.
        assert!((map(0.0).steady_n([0.2, 0.4, 0.6, 0.8], 3.7) - expected_n).abs() < 1e-15);
        assert_eq!(map(0.0).offset_n(), 0.0);
    }

    #[test]
    fn no_impossible_map_is_made_and_a_good_one_is_written_with_all_its_numbers() {
        let one = |duty_power, newtons, reference_v, lag_s, range| {
            let terms = vec![(Term::new(duty_power, 0), newtons)];
            ThrustMap::new(terms, reference_v, lag_s, range)
        };
        let good = one(1, 0.2, 4.2, 0.04, [0.1, 0.9]).expect("valid");
        assert_eq!(
            serde_json::to_string(&good).expect("plain data"),
            r#"{"terms":[{"duty_power":1,"battery_power":0,"newtons":0.2}],"battery_reference_v":4.2,"lag_s":0.04,"duty_range":[0.1,0.9]}"#
        );
        for bad in [
            one(1, 0.2, 4.2, -0.04, [0.1, 0.9]),
            one(1, 0.2, 0.0, 0.04, [0.1, 0.9]),
            one(1, 0.2, 4.2, 0.04, [0.9, 0.1]),
            one(9, 0.2, 4.2, 0.04, [0.1, 0.9]),
            one(1, f64::NAN, 4.2, 0.04, [0.1, 0.9]),
            ThrustMap::new(Vec::new(), 4.2, 0.04, [0.1, 0.9]),
        ] {
            assert!(bad.is_err());
        }
    }
}
