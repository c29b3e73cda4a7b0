//! From duty cycle and battery voltage to thrust, identified before any air is judged.
//!
//! A motor's thrust is a polynomial of its duty cycle `u` and the battery voltage over a reference, `v = V/V_ref`; what the rotor
//! gives follows it with a first-order lag, because a rotor has inertia:
//!
//! ```text
//! T_ref = Σ_motors Σ_k c_k u^i_k v^j_k,        λ dT/dt = T_ref - T
//! ```

use serde::{Deserialize, Serialize};

use crate::forward::low_pass;
use crate::record::recording::Track;

/// Highest power of either variable. Chosen here: a cubic in duty cycle already fits to the scatter of the flights.
pub const HIGHEST_POWER: u8 = 4;

/// One term of the polynomial, without its coefficient: `u^duty_power · v^battery_power`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
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
    fn over_motors(self, duty: [f64; 4], battery_over_reference: f64) -> f64 {
        let power = i32::from(self.duty_power);
        let motors: f64 = duty.iter().map(|u| u.powi(power)).sum();
        motors * battery_over_reference.powi(i32::from(self.battery_power))
    }
}

/// A cubic in duty cycle, its lower coefficients linear in the battery, and nothing at zero duty: a rotor at rest does not lift.
/// A constant term buys 1 % less scatter in free flight and an offset of the extrapolation to the duties under a downwash.
pub const CUBIC_FROM_ZERO: [Term; 5] = [
    Term::new(1, 0),
    Term::new(1, 1),
    Term::new(2, 0),
    Term::new(2, 1),
    Term::new(3, 0),
];

/// A quadratic in duty cycle with an offset, both linear in the battery: the form that is often published.
pub const QUADRATIC: [Term; 5] = [
    Term::new(0, 0),
    Term::new(1, 0),
    Term::new(0, 1),
    Term::new(2, 0),
    Term::new(1, 1),
];

/// Nothing but a constant: what is added to a published map.
pub const OFFSET: [Term; 1] = [Term::new(0, 0)];

/// Thrust of a quadrotor from the duty cycles of its motors and its battery voltage.
///
/// ```
/// use diagnosis::thrust::thrust_map::{Term, ThrustMap};
///
/// // 0.2 N a motor at full duty and a full cell, falling with the voltage; rotors that take 0.05 s to follow; fitted from 0.2 to 0.9.
/// let map = ThrustMap::new(vec![Term::new(2, 1)], vec![0.2], 4.2, 0.05, [0.2, 0.9])?;
/// assert!((map.steady_n([0.7; 4], 3.8) - 4.0 * 0.2 * 0.49 * 3.8 / 4.2).abs() < 1e-12);
/// assert!(map.covers([0.7; 4]) && !map.covers([0.7, 0.7, 0.7, 0.95]));
/// # Ok::<(), diagnosis::thrust::thrust_map::ThrustMapError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw", into = "Raw")]
pub struct ThrustMap {
    terms: Vec<Term>,
    coefficients_n: Vec<f64>,
    battery_reference_v: f64,
    lag_s: f64,
    duty_range: [f64; 2],
}

/// As it is written in files.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename = "ThrustMap")]
struct Raw {
    terms: Vec<RawTerm>,
    battery_reference_v: f64,
    lag_s: f64,
    duty_range: [f64; 2],
}

#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename = "Term")]
struct RawTerm {
    duty_power: u8,
    battery_power: u8,
    newtons: f64,
}

/// Why numbers do not make a thrust map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ThrustMapError {
    /// As many coefficients as terms are needed.
    #[error("{terms} terms, but {coefficients} coefficients")]
    Lengths {
        /// Terms given.
        terms: usize,
        /// Coefficients given.
        coefficients: usize,
    },
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

impl TryFrom<Raw> for ThrustMap {
    type Error = ThrustMapError;

    fn try_from(raw: Raw) -> Result<ThrustMap, ThrustMapError> {
        let terms = raw
            .terms
            .iter()
            .map(|term| Term::new(term.duty_power, term.battery_power));
        ThrustMap::new(
            terms.collect(),
            raw.terms.iter().map(|term| term.newtons).collect(),
            raw.battery_reference_v,
            raw.lag_s,
            raw.duty_range,
        )
    }
}

impl From<ThrustMap> for Raw {
    fn from(map: ThrustMap) -> Raw {
        let terms = map.terms.iter().zip(&map.coefficients_n);
        Raw {
            terms: terms
                .map(|(term, &newtons)| RawTerm {
                    duty_power: term.duty_power,
                    battery_power: term.battery_power,
                    newtons,
                })
                .collect(),
            battery_reference_v: map.battery_reference_v,
            lag_s: map.lag_s,
            duty_range: map.duty_range,
        }
    }
}

impl ThrustMap {
    /// A map from its terms with their coefficients (N a motor), the voltage `v` is relative to, the lag (s, 0 or more) and the range of
    /// duty cycle that it was fitted in.
    ///
    /// # Errors
    /// The first thing that keeps it from being one.
    pub fn new(
        terms: Vec<Term>,
        coefficients_n: Vec<f64>,
        battery_reference_v: f64,
        lag_s: f64,
        duty_range: [f64; 2],
    ) -> Result<ThrustMap, ThrustMapError> {
        if terms.len() != coefficients_n.len() {
            return Err(ThrustMapError::Lengths {
                terms: terms.len(),
                coefficients: coefficients_n.len(),
            });
        }
        if terms.is_empty() {
            return Err(ThrustMapError::Empty);
        }
        let powers = terms
            .iter()
            .flat_map(|term| [term.duty_power, term.battery_power]);
        if let Some(power) = powers.into_iter().find(|&power| power > HIGHEST_POWER) {
            return Err(ThrustMapError::Power(power));
        }
        let number = |field, value, holds: bool, must_be| match holds {
            true => Ok(()),
            false => Err(ThrustMapError::Number {
                field,
                value,
                must_be,
            }),
        };
        for &value in &coefficients_n {
            number("newtons", value, value.is_finite(), "finite")?;
        }
        let positive = battery_reference_v.is_finite() && battery_reference_v > 0.0;
        number(
            "battery_reference_v",
            battery_reference_v,
            positive,
            "finite and above 0",
        )?;
        number(
            "lag_s",
            lag_s,
            lag_s.is_finite() && lag_s >= 0.0,
            "finite and 0 or more",
        )?;
        let [low, high] = duty_range;
        number(
            "duty_range",
            low,
            (0.0..=1.0).contains(&low),
            "between 0 and 1",
        )?;
        let above = high > low && high <= 1.0;
        number(
            "duty_range",
            high,
            above,
            "above its first number and at most 1",
        )?;
        Ok(ThrustMap {
            terms,
            coefficients_n,
            battery_reference_v,
            lag_s,
            duty_range,
        })
    }

    /// Terms, and their coefficients (N a motor).
    pub fn terms(&self) -> impl Iterator<Item = (Term, f64)> + '_ {
        self.terms
            .iter()
            .copied()
            .zip(self.coefficients_n.iter().copied())
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

    /// Thrust (N) that four motors at zero duty would give at the reference voltage: the map's offset. A rotor at rest gives none, so
    /// anything else says how far the map can be trusted below its range.
    #[must_use]
    pub fn offset_n(&self) -> f64 {
        self.steady_n([0.0; 4], self.battery_reference_v)
    }

    /// Relative change of thrust per volt of battery, `(∂T/∂V)/T` (1/V), at a duty cycle of all motors and a voltage.
    #[must_use]
    pub fn battery_sensitivity_per_v(&self, duty: f64, battery_v: f64) -> f64 {
        let step_v = 1e-3; // a central difference of a polynomial of degree 4 in v, exact to 1e-6
        let [low_n, mid_n, high_n] =
            [-step_v, 0.0, step_v].map(|dv| self.steady_n([duty; 4], battery_v + dv));
        (high_n - low_n) / (2.0 * step_v * mid_n)
    }

    /// Thrust (N) at every entry of a track, lag and all; not a number where duty cycle or battery is not, and the lag starts afresh
    /// after such a row or a gap. `None` without duty cycles or battery voltage.
    #[must_use]
    pub fn thrust_n(&self, track: &Track) -> Option<Vec<f64>> {
        let (duty, battery_v) = (track.duty.as_ref()?, track.battery_v.as_ref()?);
        let mut thrust_n: Vec<f64> = duty
            .iter()
            .zip(battery_v)
            .map(|(&duty, &battery_v)| self.steady_n(duty, battery_v))
            .collect();
        let runs = low_pass::runs(&track.t_s, track.longest_step_s, |row| {
            thrust_n[row].is_finite()
        });
        for run in runs {
            low_pass::lag(self.lag_s, &track.t_s[run.clone()], &mut thrust_n[run]);
        }
        Some(thrust_n)
    }

    /// Rows of a track with a motor outside the range.
    #[must_use]
    pub fn rows_outside(&self, track: &Track) -> usize {
        let duty = track.duty.iter().flatten();
        duty.filter(|&&duty| !self.covers(duty)).count()
    }
}

/// What a term is worth at every entry of a track, summed over four motors.
pub(crate) fn column(
    term: Term,
    duty: &[[f64; 4]],
    battery_v: &[f64],
    reference_v: f64,
) -> Vec<f64> {
    duty.iter()
        .zip(battery_v)
        .map(|(&duty, &battery_v)| term.over_motors(duty, battery_v / reference_v))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(lag_s: f64) -> ThrustMap {
        let terms = vec![Term::new(1, 1), Term::new(2, 0)];
        ThrustMap::new(terms, vec![0.1, 0.05], 4.2, lag_s, [0.1, 0.9]).expect("valid")
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
    fn the_lag_starts_afresh_after_a_gap() {
        let track = Track {
            t_s: vec![0.0, 0.02, 1.0, 1.02],
            duty: Some(vec![[0.2; 4], [0.5; 4], [0.8; 4], [0.8; 4]]),
            battery_v: Some(vec![4.2; 4]),
            longest_step_s: 0.05,
            ..Track::default()
        };
        let map = map(0.05);
        let thrust_n = map.thrust_n(&track).expect("duty and battery");
        assert!(thrust_n[1] < map.steady_n([0.5; 4], 4.2));
        assert_eq!(thrust_n[2], map.steady_n([0.8; 4], 4.2));
        assert_eq!(map.rows_outside(&track), 0);
    }

    #[test]
    fn no_impossible_map_survives_reading() {
        let good = r#"{"terms":[{"duty_power":1,"battery_power":0,"newtons":0.2}],"battery_reference_v":4.2,"lag_s":0.04,"duty_range":[0.1,0.9]}"#;
        let map: ThrustMap = serde_json::from_str(good).expect("valid");
        assert_eq!(serde_json::to_string(&map).expect("plain data"), good);
        for (from, to) in [
            ("0.04", "-0.04"),
            ("4.2", "0.0"),
            ("[0.1,0.9]", "[0.9,0.1]"),
            (r#""duty_power":1"#, r#""duty_power":9"#),
        ] {
            assert!(serde_json::from_str::<ThrustMap>(&good.replace(from, to)).is_err());
        }
    }
}
