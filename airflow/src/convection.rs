//! How fast air is carried down a wake, over the speed on its axis: a range, and at once.
//!
//! ```text
//! air at depth s left its rotors between 0 and τ(s)/k ago,   τ(s) = l (σ² - s0²)/(2 B U_H)
//! ```
//!
//! ([`FarField::transport_time_s`](crate::FarField::transport_time_s)). The mean flow on the axis
//! moves at `k = 1`; large eddies are assumed here to move at 0.5 to 0.65 of it.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A range of convection factors `k` (ratios to the centreline's speed), lowest first.
///
/// What is flown with it has to hold for every delay from none to that of the lowest factor, the
/// same factor for all wakes at a time. The highest stands for the mean flow: exposure and energy
/// are summed at its delay.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "[f64; 2]", into = "[f64; 2]")]
pub struct Convection {
    lowest: f64,
    highest: f64,
}

/// Lowest and highest convection factor that can be: chosen here. Below the first, air would take
/// minutes down a hall; above the second it is there at once.
pub const CONVECTION_FACTORS: [f64; 2] = [0.05, 1000.0];

/// Why two numbers are no range of convection factors.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum NoConvection {
    /// Not finite, not positive, or beyond [`CONVECTION_FACTORS`].
    #[error(
        "a convection factor is {0}: not within {low} to {high}",
        low = CONVECTION_FACTORS[0],
        high = CONVECTION_FACTORS[1]
    )]
    Factor(f64),
    /// The first is above the second.
    #[error("the range of convection factors is upside down: from {0} to {1}")]
    UpsideDown(f64, f64),
}

impl Convection {
    /// From the lowest to the highest factor.
    ///
    /// # Errors
    ///
    /// What is wrong with them.
    pub fn new([lowest, highest]: [f64; 2]) -> Result<Convection, NoConvection> {
        let [least, most] = CONVECTION_FACTORS;
        for factor in [lowest, highest] {
            if !(least..=most).contains(&factor) {
                return Err(NoConvection::Factor(factor));
            }
        }
        if lowest > highest {
            return Err(NoConvection::UpsideDown(lowest, highest));
        }
        Ok(Convection { lowest, highest })
    }

    /// Lowest and highest factor.
    #[must_use]
    pub fn factors(self) -> [f64; 2] {
        [self.lowest, self.highest]
    }

    /// The longest delay over that at the centreline's speed.
    #[must_use]
    pub fn longest_lag(self) -> f64 {
        self.lowest.recip()
    }

    /// The delay of the mean flow over that at the centreline's speed.
    #[must_use]
    pub fn mean_lag(self) -> f64 {
        self.highest.recip()
    }

    /// The smallest range that holds both.
    #[must_use]
    pub fn hull(self, other: Convection) -> Convection {
        Convection {
            lowest: self.lowest.min(other.lowest),
            highest: self.highest.max(other.highest),
        }
    }
}

impl TryFrom<[f64; 2]> for Convection {
    type Error = NoConvection;

    fn try_from(factors: [f64; 2]) -> Result<Convection, NoConvection> {
        Convection::new(factors)
    }
}

impl From<Convection> for [f64; 2] {
    fn from(convection: Convection) -> [f64; 2] {
        convection.factors()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_that_are_none_are_refused() {
        assert_eq!(
            Convection::new([1.0, 0.6]),
            Err(NoConvection::UpsideDown(1.0, 0.6))
        );
        for wrong in [0.0, -0.6, f64::NAN, f64::INFINITY, 1e4, 1e-3] {
            assert!(matches!(
                Convection::new([wrong, wrong]),
                Err(NoConvection::Factor(_))
            ));
        }
        let whole = Convection::new([0.6, 1.0]).expect("a range");
        assert_eq!((whole.longest_lag(), whole.mean_lag()), (1.0 / 0.6, 1.0));
        let single = Convection::new([0.5, 0.5]).expect("a range");
        assert_eq!(whole.hull(single).factors(), [0.5, 1.0]);
    }
}
