//! The three constants of the jet: what a probe reads of a jet, and least squares through that.
//!
//! ```text
//! reading = √( (1 + 2 i²) U² + V² + a² )       a magnitude probe: ambient speed a, lateral turbulence i (0 unless wanted)
//! reading = U                                  an axial one
//! ```
//!
//! `U` and `V` are those of [`airflow::FarField`]; written once more here because the fit needs
//! their derivatives by `B`, `S` and `s₀`, and a test holds the two together. A scalar is never
//! taken off a reading.
//!
//! One jet serves all drones without cant. Every flight has a gain and a zero of its own within the
//! accuracy that its probe's maker states, half of which is taken as the standard deviation of a
//! normal prior. Both enter linearly and are eliminated exactly (variable projection, Golub &
//! Pereyra 1973, SIAM J. Numer. Anal. 10:413), so that Levenberg-Marquardt has three unknowns
//! however many flights there are.
//!
//! ```text
//! median of a cell = (1 + g) · mean of the predicted readings of the cell + b + noise,     g ~ N(0, (½ 5 %)²),  b ~ N(0, (½ 0.03 m/s)²)
//! ```

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, MinimizationReport};
use nalgebra::storage::Owned;
use nalgebra::{
    Const, DVector, Dyn, Matrix2, Matrix2x3, OMatrix, SMatrix, SVector, U3, Vector2, Vector3,
};

use super::samples::{Cell, ProbedFlight, Sample};

/// `a = √2 - 1` of the paper's profile.
const PROFILE_A: f64 = std::f64::consts::SQRT_2 - 1.0;

/// What one flight and its probe bring to a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Operator {
    /// `U_H` (m/s).
    pub(super) induced_velocity_mps: f64,
    /// Ambient speed (m/s); 0 for an axial probe.
    pub(super) ambient_mps: f64,
    /// 1 where the probe sees the radial flow, else 0.
    pub(super) radial: f64,
    /// Lateral turbulence over the local mean; 0 for an axial probe.
    pub(super) lateral: f64,
}

/// `B`, `S`, `s₀`.
pub(super) type Constants = Vector3<f64>;

/// A predicted reading.
#[derive(Clone, Copy, Debug)]
pub(super) struct Predicted {
    /// (m/s)
    pub(super) reading_mps: f64,
    /// By `B`, `S`, `s₀`.
    pub(super) gradient: Vector3<f64>,
}

/// `ξ` at a place.
pub(super) fn xi(constants: &Constants, s_over_l: f64, r_over_l: f64) -> f64 {
    r_over_l / (constants[1] * (s_over_l - constants[2]))
}

impl Operator {
    /// Speed on the axis (m/s).
    pub(super) fn centreline_mps(&self, constants: &Constants, s_over_l: f64) -> f64 {
        self.induced_velocity_mps * constants[0] / (s_over_l - constants[2])
    }

    /// Mean axial speed alone (m/s).
    pub(super) fn axial_mps(&self, constants: &Constants, s_over_l: f64, r_over_l: f64) -> f64 {
        let xi = xi(constants, s_over_l, r_over_l);
        self.centreline_mps(constants, s_over_l) / (1.0 + PROFILE_A * xi * xi).powi(2)
    }

    /// The reading at a depth and radius over the motor distance.
    pub(super) fn predict(&self, constants: &Constants, s_over_l: f64, r_over_l: f64) -> Predicted {
        let (centreline, spreading) = (constants[0], constants[1]);
        let sigma = s_over_l - constants[2];
        let centre_mps = self.centreline_mps(constants, s_over_l);
        let xi = xi(constants, s_over_l, r_over_l);
        let x = PROFILE_A * xi * xi;
        let inverse = 1.0 / (1.0 + x);
        let axial_mps = centre_mps * inverse * inverse;
        // ξ ∂/∂ξ of the two profiles: what a change of width does to them.
        let axial_slope_mps = -4.0 * x * axial_mps * inverse;
        let spread_mps = self.radial * centre_mps * spreading;
        let radial_mps = spread_mps * 0.5 * xi * (1.0 - x) * inverse * inverse;
        let radial_slope_mps =
            spread_mps * 0.5 * xi * (1.0 - 6.0 * x + x * x) * inverse * inverse * inverse;
        let axial_share = 1.0 + 2.0 * self.lateral * self.lateral;
        let reading_mps = (axial_share * axial_mps * axial_mps
            + radial_mps * radial_mps
            + self.ambient_mps * self.ambient_mps)
            .sqrt();
        let by = |axial: f64, radial: f64| match reading_mps {
            0.0 => 0.0,
            _ => (axial_share * axial_mps * axial + radial_mps * radial) / reading_mps,
        };
        let gradient = Vector3::new(
            by(axial_mps, radial_mps) / centreline,
            by(-axial_slope_mps, radial_mps - radial_slope_mps) / spreading,
            by(axial_mps + axial_slope_mps, radial_mps + radial_slope_mps) / sigma,
        );
        Predicted {
            reading_mps,
            gradient,
        }
    }
}

/// Noise of a cell's median that no averaging takes away (m/s). Chosen here: the steps of the probe
/// and what the ambient air does on its own. It enters weights only.
const FLOOR_MPS: f64 = 0.02;
/// Noise of one reading over the predicted one. Chosen here, from the turbulence of a round jet
/// (about 0.25 on its axis, Panchapakesan & Lumley 1993, J. Fluid Mech. 246:197) seen through a
/// slow probe. It enters weights only.
const NOISE: f64 = 0.15;
/// So many more readings within a cell are worth one more independent one. Chosen here, from a
/// memory of a second or two.
const READINGS_PER_INDEPENDENT: f64 = 3.0;
/// Times that the weights are renewed with the fit that they gave; the second renewal changes the
/// fit by less than 1e-3 of its intervals.
const ROUNDS: usize = 2;
/// Smallest accuracy that a maker can state (relative, and m/s): a prior needs some width.
const LEAST_ACCURACY: f64 = 1e-6;

/// What is fitted to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Data<'a> {
    pub(super) flights: &'a [ProbedFlight],
    pub(super) samples: &'a [Sample],
    pub(super) cells: &'a [Cell],
}

/// A cell at the constants of a fit.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct AtCell {
    /// Root of 1/variance ((m/s)⁻¹) as assumed.
    root_weight: f64,
    /// Mean predicted reading (m/s), without the flight's gain and zero.
    pub(super) predicted_mps: f64,
    /// By `B`, `S`, `s₀`, with the flight's gain.
    pub(super) gradient: Vector3<f64>,
    /// Measured minus predicted, gain and zero of the flight taken into account.
    pub(super) residual_mps: f64,
}

impl AtCell {
    /// 1/variance ((m/s)⁻²) as assumed.
    pub(super) fn weight(&self) -> f64 {
        self.root_weight * self.root_weight
    }
}

/// The joint fit: constants, and for them the best gain and zero of every flight.
#[derive(Clone, Debug)]
pub(super) struct Joint<'a> {
    pub(super) data: Data<'a>,
    pub(super) constants: Constants,
    /// In the order of the data's cells.
    pub(super) cells: Vec<AtCell>,
    /// Gain - 1 and zero (m/s) of each flight.
    pub(super) nuisances: Vec<Vector2<f64>>,
    /// Inverse of the normal matrix of gain and zero, of each flight.
    pub(super) nuisance_inverse: Vec<Matrix2<f64>>,
    /// Derivatives of the nuisances by the constants.
    slopes: Vec<Matrix2x3<f64>>,
    /// Whether Levenberg-Marquardt converged.
    pub(super) converged: bool,
}

/// Fits `B`, `S`, `s₀` with every flight's gain and zero, from a start.
pub(super) fn fit_jet(data: Data<'_>, start: Constants) -> Joint<'_> {
    let mut constants = start;
    let mut converged = true;
    for _ in 0..ROUNDS {
        let mut joint = Joint::new(data, constants);
        let start = Vector3::new(constants[0].ln(), constants[1].ln(), constants[2]);
        let of = |x: &Vector3<f64>| Vector3::new(x[0].exp(), x[1].exp(), x[2]);
        let (minimum, report) = minimise(start, |x| {
            joint.place(of(x));
            joint.evaluate()
        });
        constants = of(&minimum.unknowns);
        converged = report.termination.was_successful();
    }
    let mut joint = Joint::new(data, constants);
    joint.place(constants);
    joint.converged = converged;
    joint
}

/// Variance of a cell's median ((m/s)²) as assumed for its weight.
pub(super) fn assumed_variance(predicted_mps: f64, readings: usize) -> f64 {
    let independent = 1.0 + (readings as f64 - 1.0) / READINGS_PER_INDEPENDENT;
    FLOOR_MPS * FLOOR_MPS + (NOISE * predicted_mps).powi(2) / independent
}

/// Inverse variances of gain and zero of a flight.
pub(super) fn precisions(flight: &ProbedFlight) -> Vector2<f64> {
    Vector2::new(flight.accuracy_rel, flight.accuracy_abs_mps)
        .map(|accuracy| (0.5 * accuracy.max(LEAST_ACCURACY)).powi(-2))
}

impl<'a> Joint<'a> {
    /// With weights as `constants` predict them; nothing is fitted yet.
    fn new(data: Data<'a>, constants: Constants) -> Joint<'a> {
        let mut joint = Joint {
            data,
            constants,
            cells: vec![AtCell::default(); data.cells.len()],
            nuisances: Vec::new(),
            nuisance_inverse: Vec::new(),
            slopes: Vec::new(),
            converged: false,
        };
        joint.predict();
        for (at, cell) in joint.cells.iter_mut().zip(data.cells) {
            let variance = assumed_variance(at.predicted_mps, cell.count());
            at.root_weight = variance.sqrt().recip();
        }
        joint
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
        let flights = self.data.flights;
        let prior = |flight: &ProbedFlight| Matrix2::from_diagonal(&precisions(flight));
        let mut normal: Vec<Matrix2<f64>> = flights.iter().map(prior).collect();
        let mut right = vec![Vector2::zeros(); flights.len()];
        // Σ w p ∇p, Σ w ∇p and Σ w (y - 2 p) ∇p of each flight.
        let mut sums = vec![[Vector3::zeros(); 3]; flights.len()];
        for (at, cell) in self.cells.iter().zip(self.data.cells) {
            let weight = at.weight();
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
        self.nuisance_inverse.clear();
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
            self.nuisance_inverse.push(inverse);
            self.slopes.push(inverse * slope);
        }
        for (at, cell) in self.cells.iter_mut().zip(self.data.cells) {
            let [gain, zero_mps] = self.nuisances[cell.flight].into();
            at.gradient *= 1.0 + gain;
            at.residual_mps = cell.median_mps - (1.0 + gain) * at.predicted_mps - zero_mps;
        }
    }

    /// Residuals and their derivatives by `ln B`, `ln S`, `s₀`: no step can make the first two
    /// negative.
    fn evaluate(&self) -> Evaluated<3> {
        let rows = self.cells.len() + 2 * self.nuisances.len();
        let scale = Vector3::new(self.constants[0], self.constants[1], 1.0);
        let mut residuals = DVector::zeros(rows);
        let mut jacobian = OMatrix::<f64, Dyn, U3>::zeros(rows);
        for (row, (at, cell)) in self.cells.iter().zip(self.data.cells).enumerate() {
            let slope = &self.slopes[cell.flight];
            residuals[row] = at.root_weight * at.residual_mps;
            for k in 0..3 {
                let moved = at.gradient[k] + at.predicted_mps * slope[(0, k)] + slope[(1, k)];
                jacobian[(row, k)] = -at.root_weight * moved * scale[k];
            }
        }
        for (flight, (nuisance, slope)) in self.nuisances.iter().zip(&self.slopes).enumerate() {
            let precision = precisions(&self.data.flights[flight]);
            for which in 0..2 {
                let row = self.cells.len() + 2 * flight + which;
                let root = precision[which].sqrt();
                residuals[row] = root * nuisance[which];
                for k in 0..3 {
                    jacobian[(row, k)] = root * slope[(which, k)] * scale[k];
                }
            }
        }
        (residuals, jacobian)
    }
}

/// A curve at one reading.
#[derive(Clone, Copy, Debug)]
pub(super) struct AtReading<const N: usize> {
    pub(super) root_weight: f64,
    /// Reading minus curve.
    pub(super) residual: f64,
    /// Of the curve, by its constants.
    pub(super) gradient: SVector<f64, N>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct FittedCurve<const N: usize> {
    pub(super) constants: SVector<f64, N>,
    /// Half the sum of squares.
    pub(super) cost: f64,
    /// Sandwich over groups of readings (White 1980; Liang & Zeger 1986) with the factor G/(G - 1);
    /// `None` where the readings do not determine the constants.
    pub(super) covariance: Option<SMatrix<f64, N, N>>,
    pub(super) groups: usize,
}

/// Fits `readings` rows from `start`; rows of one `group` (numbered from 0) share their errors.
pub(super) fn fit_curve<const N: usize>(
    readings: usize,
    start: SVector<f64, N>,
    at: impl Fn(usize, &SVector<f64, N>) -> AtReading<N>,
    group: impl Fn(usize) -> usize,
) -> Option<FittedCurve<N>> {
    if readings <= N {
        return None;
    }
    let (minimum, report) = minimise(start, |x| {
        let mut residuals = DVector::zeros(readings);
        let mut jacobian = OMatrix::<f64, Dyn, Const<N>>::zeros(readings);
        for row in 0..readings {
            let at = at(row, x);
            residuals[row] = at.root_weight * at.residual;
            jacobian.set_row(row, &(-at.root_weight * at.gradient).transpose());
        }
        (residuals, jacobian)
    });
    if !report.termination.was_successful() {
        return None;
    }
    let groups = (0..readings).map(&group).max().map_or(0, |last| last + 1);
    let (residuals, jacobian) = &minimum.now;
    let information = jacobian.tr_mul(jacobian);
    let mut pulls = vec![SVector::<f64, N>::zeros(); groups];
    for row in 0..readings {
        pulls[group(row)] -= residuals[row] * jacobian.row(row).transpose();
    }
    let spread: SMatrix<f64, N, N> = pulls.iter().map(|pull| pull * pull.transpose()).sum();
    let few = groups as f64 / (groups as f64 - 1.0);
    let inverse = information.try_inverse().filter(|_| groups > N);
    let covariance = inverse.map(|inverse| few * inverse * spread * inverse);
    Some(FittedCurve {
        constants: minimum.unknowns,
        cost: report.objective_function,
        covariance,
        groups,
    })
}

/// Residuals at some unknowns, and their derivatives: rows by unknowns.
type Evaluated<const N: usize> = (DVector<f64>, OMatrix<f64, Dyn, Const<N>>);

/// Levenberg-Marquardt without bounds, as MINPACK has it: the problem where it ended, and how.
fn minimise<F, const N: usize>(
    start: SVector<f64, N>,
    evaluate: F,
) -> (LeastSquares<F, N>, MinimizationReport<f64>)
where
    F: FnMut(&SVector<f64, N>) -> Evaluated<N>,
{
    let mut problem = LeastSquares {
        unknowns: start,
        now: (DVector::zeros(0), OMatrix::<f64, Dyn, Const<N>>::zeros(0)),
        evaluate,
    };
    problem.set_params(&start);
    LevenbergMarquardt::new().minimize(problem)
}

/// A sum of squares and where it stands.
struct LeastSquares<F, const N: usize> {
    unknowns: SVector<f64, N>,
    now: Evaluated<N>,
    evaluate: F,
}

impl<F, const N: usize> LeastSquaresProblem<f64, Dyn, Const<N>> for LeastSquares<F, N>
where
    F: FnMut(&SVector<f64, N>) -> Evaluated<N>,
{
    type ParameterStorage = Owned<f64, Const<N>>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Const<N>>;

    fn set_params(&mut self, x: &SVector<f64, N>) {
        self.unknowns = *x;
        self.now = (self.evaluate)(x);
    }

    fn params(&self) -> SVector<f64, N> {
        self.unknowns
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let is_finite = self.now.0.iter().all(|value| value.is_finite());
        is_finite.then(|| self.now.0.clone())
    }

    fn jacobian(&self) -> Option<OMatrix<f64, Dyn, Const<N>>> {
        Some(self.now.1.clone())
    }
}

#[cfg(test)]
mod tests {
    use airflow::{Airframe, Jet, Wake};
    use nalgebra::Vector3;

    use super::*;

    const OPERATOR: Operator = Operator {
        induced_velocity_mps: 7.41,
        ambient_mps: 0.09,
        radial: 1.0,
        lateral: 0.0,
    };
    const PLACES: [(f64, f64); 5] = [(2.6, 0.0), (3.0, 0.5), (6.0, 1.4), (12.0, 3.0), (20.0, 9.0)];

    fn constants() -> Constants {
        let jet = Jet::default();
        Constants::new(jet.centreline, jet.spreading, jet.origin)
    }

    #[test]
    fn a_reading_is_made_of_the_speeds_of_airflow() {
        let kolibri = Airframe::preset("kolibri").expect("a preset");
        let wake = Wake::new(&kolibri, kolibri.mass_kg(), 1.2, &Jet::default());
        let l_m = wake.motor_distance_m();
        let operator = Operator {
            induced_velocity_mps: wake.induced_velocity_mps(),
            ..OPERATOR
        };
        for (s, r) in PLACES {
            let air_mps = wake.velocity_mps(Vector3::new(r * l_m, 0.0, -s * l_m));
            let expected_mps = air_mps.norm().hypot(0.09);
            let found_mps = operator.predict(&constants(), s, r).reading_mps;
            assert!(
                (found_mps - expected_mps).abs() < 1e-12,
                "{found_mps} {expected_mps}"
            );
        }
    }

    #[test]
    fn the_gradient_is_that_of_the_reading() {
        let turbulent = Operator {
            lateral: 0.2,
            ..OPERATOR
        };
        for operator in [OPERATOR, turbulent] {
            for (s, r) in PLACES {
                let at = operator.predict(&constants(), s, r);
                for k in 0..3 {
                    let step = 1e-5 * constants()[k].abs();
                    let moved = |by: f64| {
                        let mut moved = constants();
                        moved[k] += by;
                        operator.predict(&moved, s, r).reading_mps
                    };
                    let slope = (moved(step) - moved(-step)) / (2.0 * step);
                    // Central differences: (1e-5)² of the third derivative, and rounding over the
                    // step.
                    let off = (slope - at.gradient[k]).abs();
                    assert!(
                        off < 1e-7 * (1.0 + slope.abs()),
                        "{s} {r} {k}: {slope} {}",
                        at.gradient[k]
                    );
                }
            }
        }
    }
}
