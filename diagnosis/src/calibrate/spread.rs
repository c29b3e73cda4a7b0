//! How far to trust the three constants: what each flight or block of time says about them, and 95
//! % intervals that cover with a handful of flights.
//!
//! Near the fit the constants answer linearly, so weighing flights anew needs no new fit: flight
//! `f` counted `n_f` times (0: left out) moves the constants by `(Σ n_f A_f)⁻¹ Σ n_f s_f`, three by
//! three. A flight's own gain and zero are eliminated within its `A_f` and `s_f`, so they go with
//! it.
//!
//! The standard error is the jackknife's (leave out one flight, or one block, at a time). With few
//! and unequal flights it is biased and Student's t with one degree less than flights is too
//! narrow, so both are put right as Bell & McCaffrey (2002, Survey Methodology 28:169) and Imbens &
//! Kolesár (2016, Rev. Econ. Stat. 98:701) do: under the assumed noise the expectation of the
//! squared error and its effective degrees of freedom are known sums over the flights.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::calibration::{Interval, Unit};
use super::jet_fit::{Joint, precisions};
use super::samples::Cell;

/// Shortest block (s): three of the paper's dwells, beyond the memory of gusts and of a hovering
/// drone's sway. Chosen here.
const SHORTEST_BLOCK_S: f64 = 15.0;
/// Fewest readings that a block spans. Chosen here, for slow probes.
const BLOCK_READINGS: f64 = 8.0;

/// One flight or one block.
#[derive(Clone, Debug, Default)]
pub(super) struct ResamplingUnit {
    /// `A`: what it knows about the constants.
    pub(super) information: Matrix3<f64>,
    /// `s`: where it pulls them.
    pub(super) pull: Vector3<f64>,
}

/// All units, and each cell's share in them.
#[derive(Clone, Debug)]
pub(super) struct Units {
    pub(super) unit: Unit,
    pub(super) block_s: Option<f64>,
    pub(super) units: Vec<ResamplingUnit>,
    /// `H⁻¹`, `H` the sum of all information.
    pub(super) inverse: Matrix3<f64>,
    /// Covariance that gain and zero of the flights bring where blocks within them are resampled; 0
    /// for flights.
    pub(super) instrument: Matrix3<f64>,
    /// Covariance if one gain with the stated accuracy were common to all flights.
    pub(super) common_gain: Matrix3<f64>,
    /// For each cell: its unit.
    pub(super) unit_of: Vec<usize>,
    /// For each cell: gradient freed of what the flight's gain and zero can take over.
    pub(super) freed: Vec<Vector3<f64>>,
}

/// Flights where there are at least `fewest_flights`, else blocks. `None` where the cells do not
/// determine the constants.
pub(super) fn units(joint: &Joint<'_>, fewest_flights: usize) -> Option<Units> {
    let data = joint.data;
    let flights = data.flights.len();
    let mut cross = vec![Matrix3x2::zeros(); flights];
    let mut own = vec![Matrix3::zeros(); flights];
    let mut used = vec![false; flights];
    for (cell, fitted) in data.cells.iter().zip(&joint.cells) {
        let columns = Vector2::new(fitted.predicted_mps, 1.0);
        cross[cell.flight] += fitted.weight() * fitted.gradient * columns.transpose();
        own[cell.flight] += fitted.weight() * fitted.gradient * fitted.gradient.transpose();
        used[cell.flight] = true;
    }
    let inverses = joint.nuisance_inverse.iter();
    let taken = inverses.zip(&cross).map(|(inverse, cross)| cross * inverse);
    let taken: Vec<Matrix3x2<f64>> = taken.collect();
    let information: Vec<Matrix3<f64>> = (0..flights)
        .map(|f| own[f] - taken[f] * cross[f].transpose())
        .collect();
    let inverse = information.iter().sum::<Matrix3<f64>>().try_inverse()?;

    let by_flight = used.iter().filter(|used| **used).count() >= fewest_flights;
    let unit = if by_flight { Unit::Flight } else { Unit::Block };
    let block_s = (!by_flight).then(|| {
        let flights = data.flights.iter();
        let spanned_s = flights.map(|flight| BLOCK_READINGS * flight.step_s);
        spanned_s.fold(SHORTEST_BLOCK_S, f64::max)
    });
    let unit_of = blocks(data.cells, block_s.unwrap_or(f64::INFINITY));
    let mut units = vec![ResamplingUnit::default(); unit_of.last().map_or(0, |last| last + 1)];
    let mut freed = Vec::with_capacity(data.cells.len());
    for ((cell, fitted), unit) in data.cells.iter().zip(&joint.cells).zip(&unit_of) {
        let gradient =
            fitted.gradient - taken[cell.flight] * Vector2::new(fitted.predicted_mps, 1.0);
        if by_flight {
            // With gain and zero at their best, the slope of the eliminated problem is that of the
            // cells alone.
            units[*unit].pull += fitted.weight() * fitted.residual_mps * fitted.gradient;
            units[*unit].information = information[cell.flight];
        } else {
            units[*unit].pull += fitted.weight() * fitted.residual_mps * gradient;
            units[*unit].information += fitted.weight() * gradient * gradient.transpose();
        }
        freed.push(gradient);
    }
    let mut prior = Matrix3::zeros();
    let mut towards_gain = Vector3::zeros();
    for (f, flight) in data.flights.iter().enumerate().filter(|(f, _)| used[*f]) {
        let precision = precisions(flight);
        prior += taken[f] * Matrix2::from_diagonal(&precision) * taken[f].transpose();
        // A gain of the whole flight pulls by C M⁻¹ Λ; a common one by the sum over flights of
        // standard deviations.
        towards_gain += taken[f].column(0) * precision[0].sqrt();
    }
    let shift = inverse * towards_gain;
    Some(Units {
        unit,
        block_s,
        units,
        inverse,
        instrument: match unit {
            Unit::Flight => Matrix3::zeros(),
            Unit::Block => inverse * prior * inverse,
        },
        common_gain: shift * shift.transpose(),
        unit_of,
        freed,
    })
}

/// The unit of each cell, numbered in order: its flight's block of time, of at most so many
/// seconds.
fn blocks(cells: &[Cell], block_s: f64) -> Vec<usize> {
    // Cells come in order of flight and time.
    let mut starts: Vec<(usize, f64)> = Vec::new();
    let of_cell = |cell: &Cell| {
        let goes_on = starts
            .last()
            .is_some_and(|&(flight, t_s)| flight == cell.flight && cell.t_s < t_s + block_s);
        if !goes_on {
            starts.push((cell.flight, cell.t_s));
        }
        starts.len() - 1
    };
    cells.iter().map(of_cell).collect()
}

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
    let without = units.units.iter();
    let without = without.map(|unit| (total - unit.information).try_inverse());
    let without = without.collect::<Option<Vec<Matrix3<f64>>>>()?;
    let shifts = units.units.iter().zip(&without);
    let shifts = shifts.map(|(unit, without)| without * unit.pull);
    let jackknife: Matrix3<f64> = shifts.map(|shift| shift * shift.transpose()).sum();
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

/// Expectation of the jackknife's squared error of constant `k` under the assumed noise, and its
/// degrees of freedom.
///
/// ```text
/// Ω_fg = u_f (δ_fg A_f - A_f H⁻¹ A_g) u_g,   u_f = (H - A_f)⁻¹ e_k;     E = tr Ω,   ν = (tr Ω)² / tr Ω²
/// ```
fn moments(units: &Units, without: &[Matrix3<f64>], k: usize) -> (f64, f64) {
    let pair = |(unit, without): (&ResamplingUnit, &Matrix3<f64>)| {
        let u = without.column(k).into_owned();
        let through = unit.information * u;
        (through, u.dot(&through))
    };
    let pairs: Vec<(Vector3<f64>, f64)> = units.units.iter().zip(without).map(pair).collect();
    let (mut trace, mut squares) = (0.0, 0.0);
    for (f, (a, own)) in pairs.iter().enumerate() {
        let towards = units.inverse * a;
        trace += own - towards.dot(a);
        for (g, (b, _)) in pairs.iter().enumerate() {
            let covariance = if f == g { *own } else { 0.0 } - towards.dot(b);
            squares += covariance * covariance;
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
        let error = (self.covariance[(k, k)].max(0.0) + extra_variance).sqrt();
        Interval::around(value, student_quantile(self.freedom[k]) * error)
    }
}
