//! One jet for all drones without cant: `B`, `S` and `s₀` by least squares over the cells, through the observation operator.
//!
//! Every flight has a gain and a zero of its own within the accuracy that its probe's maker states, half of which is taken as the
//! standard deviation of a normal prior. Both enter linearly and are eliminated exactly (variable projection, Golub & Pereyra
//! 1973, recalled), so that Levenberg and Marquardt see three unknowns however many flights there are.
//!
//! ```text
//! median of a cell = (1 + g) · mean of the predicted readings of the cell + b + noise,     g ~ N(0, (½ 5 %)²),  b ~ N(0, (½ 0.03 m/s)²)
//! ```

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DVector, Dyn, Matrix2, Matrix2x3, OMatrix, U3, Vector2, Vector3};

use super::cells::Cell;
use super::operator::Constants;
use super::samples::{Flight, Sample};

/// Noise of a cell's median that no averaging takes away (m/s). Chosen here: the steps of the probe and what the ambient air
/// does on its own. It enters weights only.
const FLOOR_MPS: f64 = 0.02;
/// Noise of one reading over the predicted one. Chosen here, from the turbulence of a round jet (0.25, recalled) seen through a
/// slow probe. It enters weights only.
const NOISE: f64 = 0.15;
/// So many more readings within a cell are worth one more independent one. Chosen here, from a memory of a second or two.
const READINGS_PER_INDEPENDENT: f64 = 3.0;
/// Times that the weights are renewed with the fit that they gave; the second renewal changes the fit by less than 1e-3 of
/// its intervals.
const ROUNDS: usize = 2;
/// Smallest accuracy that a maker can state (relative, and m/s): a prior needs some width.
const LEAST_ACCURACY: f64 = 1e-6;

/// What is fitted to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Data<'a> {
    pub(super) flights: &'a [Flight],
    pub(super) samples: &'a [Sample],
    pub(super) cells: &'a [Cell],
}

/// A cell as the fit leaves it.
#[derive(Clone, Copy, Debug)]
pub(super) struct FittedCell {
    /// 1/variance ((m/s)⁻²) as assumed.
    pub(super) weight: f64,
    /// Mean predicted reading (m/s), without the flight's gain and zero.
    pub(super) predicted_mps: f64,
    /// By `B`, `S`, `s₀`, with the flight's gain.
    pub(super) gradient: Vector3<f64>,
    /// Measured minus predicted, gain and zero of the flight taken into account.
    pub(super) residual_mps: f64,
}

/// The joint fit.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    pub(super) constants: Constants,
    /// Gain - 1 and zero (m/s) of each flight.
    pub(super) nuisances: Vec<Vector2<f64>>,
    /// In the order of the cells.
    pub(super) cells: Vec<FittedCell>,
    /// Whether Levenberg and Marquardt were content.
    pub(super) converged: bool,
}

pub(super) fn fit(data: Data<'_>, start: Constants) -> Joint {
    let mut constants = start;
    let mut converged = true;
    for _ in 0..ROUNDS {
        let mut problem = Problem::new(data, constants);
        problem.place(constants);
        let (fitted, report) = LevenbergMarquardt::new().minimize(problem);
        constants = fitted.constants;
        converged = report.termination.was_successful();
    }
    let mut problem = Problem::new(data, constants);
    problem.place(constants);
    let cells = data.cells.iter().zip(&problem.cells);
    let cells = cells
        .map(|(cell, at)| {
            let [gain, zero_mps] = problem.nuisances[cell.flight].into();
            FittedCell {
                weight: at.root_weight * at.root_weight,
                predicted_mps: at.predicted_mps,
                gradient: (1.0 + gain) * at.gradient,
                residual_mps: cell.median_mps - (1.0 + gain) * at.predicted_mps - zero_mps,
            }
        })
        .collect();
    Joint {
        constants,
        nuisances: problem.nuisances,
        cells,
        converged,
    }
}

/// Variance of a cell's median ((m/s)²) as assumed for its weight.
pub(super) fn assumed_variance(predicted_mps: f64, readings: usize) -> f64 {
    let independent = 1.0 + (readings as f64 - 1.0) / READINGS_PER_INDEPENDENT;
    FLOOR_MPS * FLOOR_MPS + (NOISE * predicted_mps).powi(2) / independent
}

/// Inverse variances of gain and zero of a flight.
pub(super) fn precisions(flight: &Flight) -> Vector2<f64> {
    Vector2::new(flight.accuracy_rel, flight.accuracy_abs_mps)
        .map(|accuracy| (0.5 * accuracy.max(LEAST_ACCURACY)).powi(-2))
}

#[derive(Clone, Copy, Debug)]
struct AtCell {
    root_weight: f64,
    predicted_mps: f64,
    gradient: Vector3<f64>,
}

struct Problem<'a> {
    data: Data<'a>,
    constants: Constants,
    cells: Vec<AtCell>,
    nuisances: Vec<Vector2<f64>>,
    /// Derivatives of the nuisances by the constants.
    slopes: Vec<Matrix2x3<f64>>,
}

impl<'a> Problem<'a> {
    /// With weights as `constants` predict them.
    fn new(data: Data<'a>, constants: Constants) -> Problem<'a> {
        let blank = AtCell {
            root_weight: 0.0,
            predicted_mps: 0.0,
            gradient: Vector3::zeros(),
        };
        let mut problem = Problem {
            data,
            constants,
            cells: vec![blank; data.cells.len()],
            nuisances: Vec::new(),
            slopes: Vec::new(),
        };
        problem.predict();
        for (at, cell) in problem.cells.iter_mut().zip(data.cells) {
            at.root_weight = assumed_variance(at.predicted_mps, cell.count())
                .sqrt()
                .recip();
        }
        problem
    }

    fn predict(&mut self) {
        for (at, cell) in self.cells.iter_mut().zip(self.data.cells) {
            let operator = &self.data.flights[cell.flight].operator;
            let (mut sum_mps, mut gradient) = (0.0, Vector3::zeros());
            for sample in &self.data.samples[cell.from..cell.to] {
                let predicted = operator.predict(&self.constants, sample.s, sample.r);
                sum_mps += predicted.reading_mps;
                gradient += predicted.gradient;
            }
            at.predicted_mps = sum_mps / cell.count() as f64;
            at.gradient = gradient / cell.count() as f64;
        }
    }

    /// Moves to constants, and gives every flight its best gain and zero there.
    fn place(&mut self, constants: Constants) {
        self.constants = constants;
        self.predict();
        let flights = self.data.flights.len();
        let mut normal: Vec<Matrix2<f64>> = self
            .data
            .flights
            .iter()
            .map(|flight| Matrix2::from_diagonal(&precisions(flight)))
            .collect();
        let mut right = vec![Vector2::zeros(); flights];
        // Σ w p ∇p, Σ w ∇p and Σ w (y - 2 p) ∇p of each flight.
        let mut sums = vec![[Vector3::zeros(); 3]; flights];
        for (at, cell) in self.cells.iter().zip(self.data.cells) {
            let weight = at.root_weight * at.root_weight;
            let p = at.predicted_mps;
            let columns = Vector2::new(p, 1.0);
            normal[cell.flight] += weight * columns * columns.transpose();
            right[cell.flight] += weight * (cell.median_mps - p) * columns;
            let sums = &mut sums[cell.flight];
            sums[0] += weight * p * at.gradient;
            sums[1] += weight * at.gradient;
            sums[2] += weight * (cell.median_mps - 2.0 * p) * at.gradient;
        }
        self.nuisances.clear();
        self.slopes.clear();
        for ((normal, right), sums) in normal.iter().zip(&right).zip(&sums) {
            let inverse = normal.try_inverse().unwrap_or_else(Matrix2::zeros);
            let nuisance = inverse * right;
            let [gain, zero_mps] = nuisance.into();
            // ∂ν = M⁻¹ (∂n - ∂M ν)
            let slope = Matrix2x3::from_rows(&[
                (sums[2] - 2.0 * gain * sums[0] - zero_mps * sums[1]).transpose(),
                (-sums[1] - gain * sums[1]).transpose(),
            ]);
            self.nuisances.push(nuisance);
            self.slopes.push(inverse * slope);
        }
    }

    fn rows(&self) -> usize {
        self.cells.len() + 2 * self.nuisances.len()
    }
}

impl LeastSquaresProblem<f64, Dyn, U3> for Problem<'_> {
    type ParameterStorage = Owned<f64, U3>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, U3>;

    /// `ln B`, `ln S`, `s₀`: no step can make the first two negative.
    fn set_params(&mut self, x: &Vector3<f64>) {
        self.place(Vector3::new(x[0].exp(), x[1].exp(), x[2]));
    }

    fn params(&self) -> Vector3<f64> {
        Vector3::new(
            self.constants[0].ln(),
            self.constants[1].ln(),
            self.constants[2],
        )
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let mut residuals = DVector::zeros(self.rows());
        for (row, (at, cell)) in self.cells.iter().zip(self.data.cells).enumerate() {
            let [gain, zero_mps] = self.nuisances[cell.flight].into();
            residuals[row] =
                at.root_weight * (cell.median_mps - (1.0 + gain) * at.predicted_mps - zero_mps);
        }
        for (flight, nuisance) in self.nuisances.iter().enumerate() {
            let precision = precisions(&self.data.flights[flight]);
            let row = self.cells.len() + 2 * flight;
            residuals[row] = precision[0].sqrt() * nuisance[0];
            residuals[row + 1] = precision[1].sqrt() * nuisance[1];
        }
        residuals
            .iter()
            .all(|value| value.is_finite())
            .then_some(residuals)
    }

    fn jacobian(&self) -> Option<OMatrix<f64, Dyn, U3>> {
        let scale = Vector3::new(self.constants[0], self.constants[1], 1.0);
        let mut jacobian = OMatrix::<f64, Dyn, U3>::zeros(self.rows());
        for (row, (at, cell)) in self.cells.iter().zip(self.data.cells).enumerate() {
            let slope = &self.slopes[cell.flight];
            let gain = self.nuisances[cell.flight][0];
            for k in 0..3 {
                let moved = (1.0 + gain) * at.gradient[k]
                    + at.predicted_mps * slope[(0, k)]
                    + slope[(1, k)];
                jacobian[(row, k)] = -at.root_weight * moved * scale[k];
            }
        }
        for (flight, slope) in self.slopes.iter().enumerate() {
            let precision = precisions(&self.data.flights[flight]);
            let row = self.cells.len() + 2 * flight;
            for k in 0..3 {
                jacobian[(row, k)] = precision[0].sqrt() * slope[(0, k)] * scale[k];
                jacobian[(row + 1, k)] = precision[1].sqrt() * slope[(1, k)] * scale[k];
            }
        }
        Some(jacobian)
    }
}

/// Flights that have a cell, each once, in order.
pub(super) fn flights_of(cells: &[Cell]) -> Vec<usize> {
    let mut flights: Vec<usize> = cells.iter().map(|cell| cell.flight).collect();
    flights.dedup();
    flights
}
