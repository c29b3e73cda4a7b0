//! Linear least squares from sums, with standard errors clustered by flight.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::thrust::free_flight::scale;

/// Steps in which traces' own factors and the coefficients are found, at most, and the share of
/// what is left by which a step must lessen it. Chosen here: Gauss-Newton takes a handful.
const MOST_STEPS: usize = 30;
const LEAST_GAIN: f64 = 1e-9;

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

/// Least squares solved from the sums of `Trace::gram`.
pub(crate) struct Solved {
    pub(crate) newtons: DVector<f64>,
    /// By trace, what its rows are times, of the fit; 1 where all share one.
    factors: Vec<f64>,
    pub(crate) square_n2: f64,
    normal: Normal,
}

impl Solved {
    pub(crate) fn new(grams: &[&DMatrix<f64>], terms: usize) -> Option<Solved> {
        let mut sum = DMatrix::zeros(terms + 2, terms + 2);
        for &gram in grams {
            sum += gram;
        }
        let normal = Normal::new(&sum.view((0, 0), (terms, terms)).into_owned())?;
        let newtons = normal.solve(&sum.view((0, terms), (terms, 1)).column(0).into_owned());
        let mut solved = Solved {
            newtons,
            factors: vec![1.0; grams.len()],
            square_n2: 0.0,
            normal,
        };
        solved.square_n2 = solved.left_n2(1.0, &sum);
        Some(solved)
    }

    /// With a factor of its own for every trace of enough free flight (s), which are 1 on the
    /// average: `Σ_t |y_t - s_t Z_t b|²` is least. Gauss-Newton steps in `b`, the factors
    /// eliminated:
    ///
    /// ```text
    /// s_t = f_t·y_t / f_t·f_t,   f_t = Z_t b,     P_t = 1 - f_t f_tᵀ / f_t·f_t
    /// (Σ s_t² Z_tᵀ P_t Z_t) db = Σ s_t Z_tᵀ (y_t - s_t f_t)
    /// ```
    pub(crate) fn scaled(grams: &[&DMatrix<f64>], free_s: &[f64], terms: usize) -> Option<Solved> {
        let parts: Vec<(DMatrix<f64>, DVector<f64>)> = grams
            .iter()
            .map(|gram| {
                let lift = gram.view((0, terms), (terms, 1)).column(0).into_owned();
                (gram.view((0, 0), (terms, terms)).into_owned(), lift)
            })
            .collect();
        let factors = |newtons: &DVector<f64>| -> Vec<Option<f64>> {
            let own = |((square, lift), free_s): (&(DMatrix<f64>, DVector<f64>), &f64)| {
                let sums = [lift.dot(newtons), newtons.dot(&(square * newtons))];
                scale(*free_s, sums)
            };
            parts.iter().zip(free_s).map(own).collect()
        };
        let start = Solved::new(grams, terms)?.newtons;
        let mut solved = Solved {
            factors: vec![1.0; grams.len()],
            square_n2: f64::INFINITY,
            normal: Normal::new(&DMatrix::identity(terms, terms))?,
            newtons: start.clone(),
        };
        let mut next = start;
        for _ in 0..MOST_STEPS {
            let own = factors(&next);
            let known = own.iter().flatten();
            let mean = known.clone().sum::<f64>() / known.count().max(1) as f64;
            let mean = if mean > 0.0 { mean } else { 1.0 };
            let newtons = &next * mean;
            let factor = |own: &Option<f64>| own.map_or(1.0, |own| own / mean);
            let (mut all, mut normal) =
                (DMatrix::zeros(terms, terms), DMatrix::zeros(terms, terms));
            let mut right = DVector::zeros(terms);
            for ((square, lift), own) in parts.iter().zip(&own) {
                let s = factor(own);
                let fitted = square * &newtons;
                all += square * (s * s);
                right += (lift - &fitted * s) * s;
                if own.is_some() {
                    normal -= &fitted * fitted.transpose() * (s * s / newtons.dot(&fitted));
                }
            }
            // Along `b` itself the factors give way: there it stays as it is.
            let along = &all * &newtons;
            normal += all + &along * along.transpose() / newtons.dot(&along);
            let mut tried = Solved {
                normal: Normal::new(&normal)?,
                factors: own.iter().map(factor).collect(),
                square_n2: 0.0,
                newtons,
            };
            let both = grams.iter().zip(&tried.factors);
            tried.square_n2 = both.map(|(gram, s)| tried.left_n2(*s, gram)).sum();
            if tried.square_n2 >= solved.square_n2 * (1.0 - LEAST_GAIN) {
                if tried.square_n2 < solved.square_n2 {
                    return Some(tried);
                }
                // A step too far, or none any more.
                next = (&solved.newtons + &tried.newtons) * 0.5;
                continue;
            }
            next = &tried.newtons + tried.normal.solve(&right);
            solved = tried;
        }
        Some(solved)
    }

    /// What turns a row of the sums into what is left: minus the coefficients times a trace's
    /// factor, 1, 0.
    fn weights(&self, factor: f64) -> DVector<f64> {
        let terms = self.newtons.len();
        let mut weights = DVector::zeros(terms + 2);
        weights
            .rows_mut(0, terms)
            .copy_from(&(&self.newtons * -factor));
        weights[terms] = 1.0;
        weights
    }

    /// Sum of squares (N²) of what is left in one trace.
    fn left_n2(&self, factor: f64, gram: &DMatrix<f64>) -> f64 {
        let weights = self.weights(factor);
        weights.dot(&(gram * &weights))
    }

    /// `Xᵀe` of one trace.
    fn score(&self, factor: f64, gram: &DMatrix<f64>) -> DVector<f64> {
        (gram * self.weights(factor)).rows(0, self.newtons.len()) * factor
    }

    pub(crate) fn standard_errors(
        &self,
        grams: &[DMatrix<f64>],
        flights: &[usize],
    ) -> Option<Vec<f64>> {
        let scores = self.factors.iter().zip(grams);
        let scores = by_flight(scores.map(|(s, gram)| self.score(*s, gram)), flights)?;
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

/// Standard error of the lag, from the sums `step_s` before and after it and the squares left
/// there: the error's slope with the lag in each flight, freed of what the coefficients take up,
/// over its curvature.
pub(crate) fn lag_standard_error_s(
    solved: &Solved,
    [before, after]: [&[DMatrix<f64>]; 2],
    [before_n2, after_n2]: [f64; 2],
    flights: &[usize],
    step_s: f64,
) -> Option<f64> {
    let curvature = 0.5 * (before_n2 - 2.0 * solved.square_n2 + after_n2) / (step_s * step_s);
    let each = || solved.factors.iter().zip(before.iter().zip(after));
    let mut by_coefficient = DVector::zeros(solved.newtons.len());
    for (&s, (before, after)) in each() {
        by_coefficient += (solved.score(s, after) - solved.score(s, before)) / (2.0 * step_s);
    }
    let taken_up = solved.normal.solve(&by_coefficient);
    let slopes = each().map(|(&s, (before, after))| {
        let of_lag = -0.5 * (solved.left_n2(s, after) - solved.left_n2(s, before)) / (2.0 * step_s);
        let mid = 0.5 * (solved.score(s, before) + solved.score(s, after));
        DVector::from_element(1, of_lag + taken_up.dot(&mid))
    });
    let slopes = by_flight(slopes, flights)?;
    let square: f64 = slopes.iter().map(|slope| slope[0] * slope[0]).sum();
    (curvature > 0.0).then(|| (few_clusters(slopes.len()) * square).sqrt() / curvature)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums of rows `y = factor (2 x + 3 x²)`, `x` about `middle`.
    fn sums(factor: f64, middle: f64) -> DMatrix<f64> {
        let mut sums = DMatrix::zeros(4, 4);
        for row in 0..200 {
            let x = middle + 0.05 * (0.37 * f64::from(row)).sin();
            let y = factor * (2.0 * x + 3.0 * x * x);
            let values = DVector::from_vec(vec![x, x * x, y, 1.0]);
            sums.ger(1.0, &values, &values, 1.0);
        }
        sums
    }

    #[test]
    fn drones_that_differ_do_not_bend_the_map_of_their_kind() {
        // The stronger a drone, the less it is given: taken for one they look as if thrust hardly
        // followed what motors are given.
        let drones = [(0.9, 0.55), (1.0, 0.5), (1.1, 0.46)].map(|(f, x)| sums(f, x));
        let all: Vec<&DMatrix<f64>> = drones.iter().collect();
        let shared = Solved::new(&all, 2).expect("told apart");
        let scaled = Solved::scaled(&all, &[20.0; 3], 2).expect("told apart");
        let slope = |of: &Solved| of.newtons[0] + of.newtons[1];
        assert!((slope(&shared) - 5.0).abs() > 1.0, "{}", shared.newtons);
        assert!((slope(&scaled) - 5.0).abs() < 1e-3, "{}", scaled.newtons);
        for (found, is) in scaled.factors.iter().zip([0.9, 1.0, 1.1]) {
            assert!((found - is).abs() < 1e-4, "{:?}", scaled.factors);
        }
        assert!(scaled.square_n2 < 1e-6 * shared.square_n2);
        // In too little flight none has a factor of its own.
        let few = Solved::scaled(&all, &[2.0; 3], 2).expect("told apart");
        assert!(
            (&few.newtons - &shared.newtons).norm() < 1e-6,
            "{}",
            few.newtons
        );
        assert_eq!(few.factors, [1.0; 3]);
    }
}
