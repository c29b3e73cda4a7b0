//! Linear least squares from sums, with standard errors clustered by flight.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Normal equations `XᵀX b = Xᵀy`, solved in units in which each column of `X` has length 1.
pub(crate) struct Normal {
    cholesky: Cholesky<f64, Dyn>,
    /// Inverse lengths of the columns.
    scale: DVector<f64>,
}

impl Normal {
    /// From `XᵀX`; `None` where its columns depend on one another.
    pub(crate) fn new(square: &DMatrix<f64>) -> Option<Normal> {
        let scale = DVector::from_fn(square.nrows(), |i, _| square[(i, i)].sqrt().recip());
        let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
            square[(i, j)] * scale[i] * scale[j]
        });
        let cholesky = Cholesky::new(scaled)?;
        Some(Normal { cholesky, scale })
    }

    /// `(XᵀX)⁻¹ right`.
    pub(crate) fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let scaled = self.cholesky.solve(&right.component_mul(&self.scale));
        scaled.component_mul(&self.scale)
    }

    /// Variances of the solution from `Xᵀe` of each cluster of rows, of which there are at least
    /// two.
    pub(crate) fn clustered_variance(&self, scores: &[DVector<f64>]) -> DVector<f64> {
        let mut variance = DVector::zeros(self.scale.len());
        for score in scores {
            let shift = self.solve(score);
            variance += shift.component_mul(&shift);
        }
        variance * few_clusters(scores.len())
    }
}

/// `F/(F - 1)`.
fn few_clusters(clusters: usize) -> f64 {
    clusters as f64 / (clusters as f64 - 1.0)
}

/// Least squares solved from the sums of [`Trace::gram`].
pub(crate) struct Solved {
    pub(crate) newtons: DVector<f64>,
    /// Weights that turn a row of the sums into what is left: minus the coefficients, 1, 0.
    weights: DVector<f64>,
    pub(crate) square_n2: f64,
    normal: Normal,
}

impl Solved {
    pub(crate) fn new<'g>(
        grams: impl IntoIterator<Item = &'g DMatrix<f64>>,
        terms: usize,
    ) -> Option<Solved> {
        let mut sum = DMatrix::zeros(terms + 2, terms + 2);
        for gram in grams {
            sum += gram;
        }
        let normal = Normal::new(&sum.view((0, 0), (terms, terms)).into_owned())?;
        let newtons = normal.solve(&sum.view((0, terms), (terms, 1)).column(0).into_owned());
        let mut weights = DVector::zeros(terms + 2);
        weights.rows_mut(0, terms).copy_from(&-&newtons);
        weights[terms] = 1.0;
        let square_n2 = weights.dot(&(&sum * &weights));
        Some(Solved {
            newtons,
            weights,
            square_n2,
            normal,
        })
    }

    /// Sum of squares (N²) of what is left in one trace.
    fn left_n2(&self, gram: &DMatrix<f64>) -> f64 {
        self.weights.dot(&(gram * &self.weights))
    }

    /// `Xᵀe` of one trace.
    fn score(&self, gram: &DMatrix<f64>) -> DVector<f64> {
        (gram * &self.weights)
            .rows(0, self.newtons.len())
            .into_owned()
    }

    pub(crate) fn standard_errors(
        &self,
        grams: &[DMatrix<f64>],
        flights: &[usize],
    ) -> Option<Vec<f64>> {
        let scores = by_flight(grams.iter().map(|gram| self.score(gram)), flights)?;
        let variance = self.normal.clustered_variance(&scores);
        Some(variance.iter().map(|variance| variance.sqrt()).collect())
    }
}

/// Sums vectors over the traces of each flight; `None` with fewer than two flights.
fn by_flight(
    vectors: impl Iterator<Item = DVector<f64>>,
    flights: &[usize],
) -> Option<Vec<DVector<f64>>> {
    let mut sums: BTreeMap<usize, DVector<f64>> = BTreeMap::new();
    for (vector, &flight) in vectors.zip(flights) {
        let sum = sums.entry(flight).or_insert(DVector::zeros(vector.len()));
        *sum += vector;
    }
    (sums.len() > 1).then(|| sums.into_values().collect())
}

/// Standard error of the lag, from the sums `step_s` before and after it: the error's slope with
/// the lag in each flight, freed of what the coefficients take up, over its curvature.
pub(crate) fn lag_standard_error_s(
    solved: &Solved,
    before: &[DMatrix<f64>],
    after: &[DMatrix<f64>],
    flights: &[usize],
    step_s: f64,
) -> Option<f64> {
    let terms = solved.newtons.len();
    let [square_before, square_after] =
        [before, after].map(|grams| Solved::new(grams, terms).map(|solved| solved.square_n2));
    let curvature =
        0.5 * (square_before? - 2.0 * solved.square_n2 + square_after?) / (step_s * step_s);
    let mut by_coefficient = DVector::zeros(terms);
    for (before, after) in before.iter().zip(after) {
        by_coefficient += (solved.score(after) - solved.score(before)) / (2.0 * step_s);
    }
    let taken_up = solved.normal.solve(&by_coefficient);
    let slopes = before.iter().zip(after).map(|(before, after)| {
        let of_lag = -0.5 * (solved.left_n2(after) - solved.left_n2(before)) / (2.0 * step_s);
        let mid = 0.5 * (solved.score(before) + solved.score(after));
        DVector::from_element(1, of_lag + taken_up.dot(&mid))
    });
    let slopes = by_flight(slopes, flights)?;
    let square: f64 = slopes.iter().map(|slope| slope[0] * slope[0]).sum();
    (curvature > 0.0).then(|| (few_clusters(slopes.len()) * square).sqrt() / curvature)
}
