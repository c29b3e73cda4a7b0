//! Sums of recorded against simulated force, from which figures of merit follow; those of several flights add up.

use std::ops::AddAssign;

use serde::Serialize;

/// Sums over rows from which the figures follow; those of several flights add up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ForceSums {
    /// Rows.
    pub rows: usize,
    /// Of these, rows with a motor outside the range of the thrust map.
    pub rows_outside: usize,
    /// `Σ F` (N).
    pub recorded_n: f64,
    /// `Σ F²` (N²).
    pub recorded_n2: f64,
    /// With the air met as mean over the rotor discs.
    pub disc_mean: AgainstSimulated,
    /// With that at the rotor plane's centre.
    pub centre: AgainstSimulated,
}

/// Sums of recorded against simulated force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct AgainstSimulated {
    /// `Σ (F - F_simulated)²` (N²).
    pub left_n2: f64,
    /// `Σ (F - F_simulated)` (N).
    pub left_n: f64,
    /// `Σ F F_simulated` (N²).
    pub product_n2: f64,
    /// `Σ F_simulated²` (N²).
    pub simulated_n2: f64,
}

impl AgainstSimulated {
    pub(crate) fn add(&mut self, recorded_n: f64, simulated_n: f64) {
        let left_n = recorded_n - simulated_n;
        self.left_n2 += left_n * left_n;
        self.left_n += left_n;
        self.product_n2 += recorded_n * simulated_n;
        self.simulated_n2 += simulated_n * simulated_n;
    }

    /// Factor on the simulated force that would leave least.
    #[must_use]
    pub fn slope(&self) -> f64 {
        self.product_n2 / self.simulated_n2
    }
}

impl AddAssign for AgainstSimulated {
    fn add_assign(&mut self, more: AgainstSimulated) {
        self.left_n2 += more.left_n2;
        self.left_n += more.left_n;
        self.product_n2 += more.product_n2;
        self.simulated_n2 += more.simulated_n2;
    }
}

impl AddAssign for ForceSums {
    fn add_assign(&mut self, more: ForceSums) {
        self.rows += more.rows;
        self.rows_outside += more.rows_outside;
        self.recorded_n += more.recorded_n;
        self.recorded_n2 += more.recorded_n2;
        self.disc_mean += more.disc_mean;
        self.centre += more.centre;
    }
}

impl ForceSums {
    /// `R²` against the mean of these rows; not a number without rows.
    #[must_use]
    pub fn r2(&self, against: &AgainstSimulated) -> f64 {
        let spread_n2 = self.recorded_n2 - self.recorded_n * self.recorded_n / self.rows as f64;
        1.0 - against.left_n2 / spread_n2
    }

    /// `R²` with the mean over the rotor discs.
    #[must_use]
    pub fn r2_disc_mean(&self) -> f64 {
        self.r2(&self.disc_mean)
    }

    /// `R²` with the air at the centre.
    #[must_use]
    pub fn r2_centre(&self) -> f64 {
        self.r2(&self.centre)
    }
}
