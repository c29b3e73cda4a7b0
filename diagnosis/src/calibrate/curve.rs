//! A curve with a few constants through weighted readings, and errors of the constants that allow for what readings share.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{Const, DVector, Dyn, OMatrix, SMatrix, SVector};

/// A curve at one reading.
#[derive(Clone, Copy, Debug)]
pub(super) struct AtReading<const N: usize> {
    /// Root of the weight.
    pub(super) root_weight: f64,
    /// Reading minus curve.
    pub(super) residual: f64,
    /// Of the curve, by its constants.
    pub(super) gradient: SVector<f64, N>,
}

/// A curve as fitted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fitted<const N: usize> {
    pub(super) constants: SVector<f64, N>,
    /// Half the sum of squares.
    pub(super) cost: f64,
    /// Sandwich over groups of readings (White 1980; Liang & Zeger 1986; recalled) with the factor G/(G - 1); `None` where the
    /// readings do not determine the constants.
    pub(super) covariance: Option<SMatrix<f64, N, N>>,
    pub(super) groups: usize,
}

struct Curve<'a, const N: usize, F> {
    readings: usize,
    at: &'a F,
    constants: SVector<f64, N>,
    now: Vec<AtReading<N>>,
}

impl<const N: usize, F: Fn(usize, &SVector<f64, N>) -> AtReading<N>> Curve<'_, N, F> {
    fn place(&mut self, constants: SVector<f64, N>) {
        self.constants = constants;
        self.now.clear();
        self.now
            .extend((0..self.readings).map(|row| (self.at)(row, &constants)));
    }
}

impl<const N: usize, F: Fn(usize, &SVector<f64, N>) -> AtReading<N>>
    LeastSquaresProblem<f64, Dyn, Const<N>> for Curve<'_, N, F>
{
    type ParameterStorage = Owned<f64, Const<N>>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Const<N>>;

    fn set_params(&mut self, x: &SVector<f64, N>) {
        self.place(*x);
    }

    fn params(&self) -> SVector<f64, N> {
        self.constants
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let rows = self.now.iter().map(|at| at.root_weight * at.residual);
        let residuals = DVector::from_iterator(self.readings, rows);
        residuals
            .iter()
            .all(|value| value.is_finite())
            .then_some(residuals)
    }

    fn jacobian(&self) -> Option<OMatrix<f64, Dyn, Const<N>>> {
        let mut jacobian = OMatrix::<f64, Dyn, Const<N>>::zeros(self.readings);
        for (row, at) in self.now.iter().enumerate() {
            jacobian.set_row(row, &(-at.root_weight * at.gradient).transpose());
        }
        Some(jacobian)
    }
}

/// Fits `readings` rows from `start`; rows of one `group` (numbered from 0) share their errors.
pub(super) fn fit<const N: usize>(
    readings: usize,
    start: SVector<f64, N>,
    at: impl Fn(usize, &SVector<f64, N>) -> AtReading<N>,
    group: impl Fn(usize) -> usize,
) -> Option<Fitted<N>> {
    if readings <= N {
        return None;
    }
    let mut curve = Curve {
        readings,
        at: &at,
        constants: start,
        now: Vec::new(),
    };
    curve.place(start);
    let (curve, report) = LevenbergMarquardt::new().minimize(curve);
    if !report.termination.was_successful() {
        return None;
    }
    let groups = (0..readings).map(&group).max().map_or(0, |last| last + 1);
    let mut information = SMatrix::<f64, N, N>::zeros();
    let mut pulls = vec![SVector::<f64, N>::zeros(); groups];
    for (row, at) in curve.now.iter().enumerate() {
        let weight = at.root_weight * at.root_weight;
        information += weight * at.gradient * at.gradient.transpose();
        pulls[group(row)] += weight * at.residual * at.gradient;
    }
    let spread: SMatrix<f64, N, N> = pulls.iter().map(|pull| pull * pull.transpose()).sum();
    let few = groups as f64 / (groups as f64 - 1.0);
    let covariance = information
        .try_inverse()
        .filter(|_| groups > N)
        .map(|inverse| few * inverse * spread * inverse);
    Some(Fitted {
        constants: curve.constants,
        cost: report.objective_function,
        covariance,
        groups,
    })
}
