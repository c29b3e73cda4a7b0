//! Linear least squares from sums, with standard errors clustered by flight.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Least squares solved from the sums of [`Trace::gram`].
pub(crate) struct Solved {
    pub(crate) newtons: DVector<f64>,
    /// Weights that turn a row of the sums into what is left: minus the coefficients, 1, 0.
    weights: DVector<f64>,
    pub(crate) square_n2: f64,
    cholesky: Cholesky<f64, Dyn>,
    /// Inverse lengths of the columns: the sums are solved in units in which each column has length 1.
    scale: DVector<f64>,
}

impl Solved {
    pub(crate) fn new(grams: &[&DMatrix<f64>], terms: usize) -> Option<Solved> {
        let mut sum = DMatrix::zeros(terms + 2, terms + 2);
        for gram in grams {
            sum += *gram;
        }
        let scale = DVector::from_fn(terms, |i, _| sum[(i, i)].sqrt().recip());
        let scaled = DMatrix::from_fn(terms, terms, |i, j| sum[(i, j)] * scale[i] * scale[j]);
        let cholesky = Cholesky::new(scaled)?;
        let right = DVector::from_fn(terms, |i, _| sum[(i, terms)] * scale[i]);
        let newtons = cholesky.solve(&right).component_mul(&scale);
        let mut weights = DVector::zeros(terms + 2);
        weights.rows_mut(0, terms).copy_from(&-&newtons);
        weights[terms] = 1.0;
        let square_n2 = weights.dot(&(&sum * &weights));
        Some(Solved {
            newtons,
            weights,
            square_n2,
            cholesky,
            scale,
        })
    }

    /// Rows, sum and sum of squares of what is left in one trace.
    pub(crate) fn rest(&self, gram: &DMatrix<f64>) -> [f64; 3] {
        let left = gram * &self.weights;
        let last = left.len() - 1;
        [gram[(last, last)], left[last], self.weights.dot(&left)]
    }

    /// `Xᵀe` of one trace, in the units of the scaled columns.
    fn score(&self, gram: &DMatrix<f64>) -> DVector<f64> {
        let left = gram * &self.weights;
        left.rows(0, self.scale.len()).component_mul(&self.scale)
    }

    pub(crate) fn standard_errors(
        &self,
        grams: &[&DMatrix<f64>],
        flights: &[usize],
    ) -> Option<Vec<f64>> {
        let scores = by_flight(grams.iter().map(|gram| self.score(gram)), flights)?;
        let mut variance = DVector::zeros(self.scale.len());
        for score in &scores {
            let shift = self.cholesky.solve(score).component_mul(&self.scale);
            variance += shift.component_mul(&shift);
        }
        let few = few_flights(scores.len());
        Some(
            variance
                .iter()
                .map(|variance| (few * variance).sqrt())
                .collect(),
        )
    }
}

/// Sums vectors over the traces of each flight; `None` with fewer than two flights.
fn by_flight(
    vectors: impl Iterator<Item = DVector<f64>>,
    flights: &[usize],
) -> Option<Vec<DVector<f64>>> {
    let mut sums: Vec<Option<DVector<f64>>> = vec![None; flights.iter().max()? + 1];
    for (vector, &flight) in vectors.zip(flights) {
        sums[flight] = Some(match sums[flight].take() {
            Some(sum) => sum + vector,
            None => vector,
        });
    }
    (sums.len() > 1).then(|| sums.into_iter().flatten().collect())
}

/// `F/(F - 1)`.
fn few_flights(flights: usize) -> f64 {
    flights as f64 / (flights as f64 - 1.0)
}

/// Standard error of the lag, from the sums `step_s` before and after it: the error's slope with the lag in each flight, freed of
/// what the coefficients take up, over its curvature.
pub(crate) fn lag_standard_error_s(
    solved: &Solved,
    before: &[&DMatrix<f64>],
    after: &[&DMatrix<f64>],
    flights: &[usize],
    step_s: f64,
) -> Option<f64> {
    let terms = solved.scale.len();
    let [square_before, square_after] =
        [before, after].map(|grams| Solved::new(grams, terms).map(|solved| solved.square_n2));
    let curvature =
        0.5 * (square_before? - 2.0 * solved.square_n2 + square_after?) / (step_s * step_s);
    let mut by_coefficient = DVector::zeros(terms);
    for (before, after) in before.iter().zip(after) {
        by_coefficient += (solved.score(after) - solved.score(before)) / (2.0 * step_s);
    }
    let taken_up = solved.cholesky.solve(&by_coefficient);
    let slopes = before.iter().zip(after).map(|(before, after)| {
        let [[.., before_n2], [.., after_n2]] = [solved.rest(before), solved.rest(after)];
        let of_lag = -0.5 * (after_n2 - before_n2) / (2.0 * step_s);
        let mid = 0.5 * (solved.score(before) + solved.score(after));
        DVector::from_element(1, of_lag + taken_up.dot(&mid))
    });
    let slopes = by_flight(slopes, flights)?;
    let square: f64 = slopes.iter().map(|slope| slope[0] * slope[0]).sum();
    (curvature > 0.0).then(|| (few_flights(slopes.len()) * square).sqrt() / curvature)
}
