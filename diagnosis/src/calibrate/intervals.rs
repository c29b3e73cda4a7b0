//! 95 % intervals of the three constants that stay honest with a handful of flights.
//!
//! The standard error is the jackknife's (leave out one flight, or one block, at a time). With few and unequal flights it is biased
//! and Student's t with one degree less than flights is too narrow, so both are put right as Bell & McCaffrey (2002) and Imbens &
//! Kolesár (2016) do (recalled): under the assumed noise the expectation of the squared error and its effective degrees of freedom
//! are known sums over the flights.

use nalgebra::{Matrix3, Vector3};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::calibration::Interval;
use super::units::Units;

/// Above so many units their number is freedom enough, and a sum over all pairs would be wasted.
const MANY_UNITS: usize = 400;

/// Standard errors and intervals' half-widths in standard errors.
#[derive(Clone, Debug)]
pub(super) struct Spread {
    /// Covariance of `B`, `S`, `s₀`.
    pub(super) covariance: Matrix3<f64>,
    /// Effective degrees of freedom of each standard error.
    pub(super) freedom: Vector3<f64>,
}

/// `None` where a single unit decides alone: no error can then be told.
pub(super) fn spread(units: &Units) -> Option<Spread> {
    let total = units.inverse.try_inverse()?;
    let without: Option<Vec<Matrix3<f64>>> = units
        .units
        .iter()
        .map(|unit| (total - unit.information).try_inverse())
        .collect();
    let without = without?;
    let shifts: Vec<Vector3<f64>> = units
        .units
        .iter()
        .zip(&without)
        .map(|(unit, without)| without * unit.pull)
        .collect();
    let jackknife: Matrix3<f64> = shifts.iter().map(|shift| shift * shift.transpose()).sum();
    let mut scale = Vector3::repeat(1.0);
    let mut freedom = Vector3::repeat(units.units.len() as f64 - 1.0);
    if units.units.len() <= MANY_UNITS {
        for k in 0..3 {
            let (expected, degrees) = moments(units, &without, k);
            let true_variance = units.inverse[(k, k)] - units.instrument[(k, k)];
            if !(expected > 0.0 && true_variance > 0.0) {
                return None;
            }
            scale[k] = (true_variance / expected).sqrt();
            freedom[k] = degrees;
        }
    }
    let scale = Matrix3::from_diagonal(&scale);
    Some(Spread {
        covariance: scale * jackknife * scale + units.instrument,
        freedom,
    })
}

/// Expectation of the jackknife's squared error of constant `k` under the assumed noise, and its degrees of freedom.
///
/// ```text
/// Ω_fg = u_f (δ_fg A_f - A_f H⁻¹ A_g) u_g,   u_f = (H - A_f)⁻¹ e_k;     E = tr Ω,   ν = (tr Ω)² / tr Ω²
/// ```
fn moments(units: &Units, without: &[Matrix3<f64>], k: usize) -> (f64, f64) {
    let pairs: Vec<(Vector3<f64>, f64)> = units
        .units
        .iter()
        .zip(without)
        .map(|(unit, without)| {
            let u = without.column(k).into_owned();
            let through = unit.information * u;
            (through, u.dot(&through))
        })
        .collect();
    let (mut trace, mut squares) = (0.0, 0.0);
    for (f, (a, own)) in pairs.iter().enumerate() {
        let towards = units.inverse * a;
        for (g, (b, _)) in pairs.iter().enumerate() {
            let covariance = if f == g { *own } else { 0.0 } - towards.dot(b);
            squares += covariance * covariance;
            if f == g {
                trace += covariance;
            }
        }
    }
    (trace, trace * trace / squares)
}

/// 97.5 % quantile of Student's t; the normal's for very many degrees of freedom.
pub(super) fn student_quantile(freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom.clamp(1.0, 1e6)).map_or(1.96, |t| t.inverse_cdf(0.975))
}

impl Spread {
    pub(super) fn interval(&self, k: usize, value: f64, extra_variance: f64) -> Interval {
        let half = student_quantile(self.freedom[k])
            * (self.covariance[(k, k)].max(0.0) + extra_variance).sqrt();
        Interval {
            low: value - half,
            high: value + half,
        }
    }
}
