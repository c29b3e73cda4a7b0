//! How sure parameters are when neighbours err together: the cluster-robust sandwich.
//!
//! ```text
//! H = (Jᵀ diag(ψ'(e)) J + P)⁻¹,     Cov = K/(K - p) · H (Σ_b g_b g_bᵀ) H,     g_b = Σ_{i in b} Jᵢ ψ(eᵢ)
//! ```
//!
//! for a fit of whitened residuals e with pseudo-Huber loss (`ψ = e/√(1 + (e/3)²)`), Jacobian J = -∂e/∂θ, blocks b (K of them) and P the
//! precision of priors (Liang & Zeger 1986; Cameron & Miller 2015 for the factor). Priors say how a parameter scatters from recording to
//! recording; within this one they count as one more block of their own.

use nalgebra::{DMatrix, DVector};

use super::held_out::HUBER;
use super::sequence::Blocks;

/// Covariance of `p` parameters, and the degrees of freedom `K - p` of its intervals.
#[derive(Clone, Debug, PartialEq)]
pub struct Covariance {
    /// In the parameters' units.
    pub matrix: DMatrix<f64>,
    /// Blocks that score anything, less parameters; at least 1.
    pub degrees_of_freedom: f64,
}

/// Covariance of a fit; `None` where the data do not determine it (singular, or no more blocks than parameters).
///
/// `jacobian`: samples by parameters, whitened. `residual`: whitened, after the fit. `prior_precision`: 1/variance of each
/// parameter's prior, 0 for none. A parameter at its bound has no column.
#[must_use]
pub fn sandwich(
    jacobian: &DMatrix<f64>,
    residual: &[f64],
    blocks: &Blocks,
    prior_precision: &[f64],
) -> Option<Covariance> {
    let parameters = jacobian.ncols();
    let mut bread = DMatrix::zeros(parameters, parameters);
    let mut scores = DMatrix::zeros(blocks.count(), parameters);
    for (i, &e) in residual.iter().enumerate() {
        let stretch = 1.0 + (e / HUBER) * (e / HUBER);
        let psi = e / stretch.sqrt();
        let slope = stretch.powf(-1.5);
        for a in 0..parameters {
            scores[(blocks.of_sample[i], a)] += jacobian[(i, a)] * psi;
            for b in 0..=a {
                bread[(a, b)] += slope * jacobian[(i, a)] * jacobian[(i, b)];
            }
        }
    }
    for a in 0..parameters {
        for b in 0..a {
            bread[(b, a)] = bread[(a, b)];
        }
    }
    let mut filling = DMatrix::zeros(parameters, parameters);
    for score in scores.row_iter() {
        filling += score.transpose() * score;
    }
    for (a, precision) in prior_precision.iter().enumerate().take(parameters) {
        bread[(a, a)] += precision;
        filling[(a, a)] += precision;
    }
    let live = scores
        .row_iter()
        .filter(|row| row.norm_squared() > 0.0)
        .count();
    let degrees_of_freedom = live as f64 - parameters as f64;
    if degrees_of_freedom < 1.0 {
        return None;
    }
    let inverse = invert(&bread)?;
    let factor = live as f64 / degrees_of_freedom;
    let matrix = &inverse * filling * &inverse * factor;
    matrix.iter().all(|v| v.is_finite()).then_some(Covariance {
        matrix,
        degrees_of_freedom,
    })
}

/// Inverse of a symmetric positive matrix whose rows may differ in unit by orders of magnitude.
fn invert(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = DVector::from_iterator(
        matrix.nrows(),
        matrix.diagonal().iter().map(|d| 1.0 / d.sqrt()),
    );
    if !scale.iter().all(|s| s.is_finite()) {
        return None;
    }
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |a, b| {
        matrix[(a, b)] * scale[a] * scale[b]
    });
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |a, b| {
        inverse[(a, b)] * scale[a] * scale[b]
    }))
}

impl Covariance {
    /// Half of a parameter's 95 % interval, by Student's law.
    #[must_use]
    pub fn half_width_95(&self, parameter: usize) -> f64 {
        student_97_5(self.degrees_of_freedom) * self.matrix[(parameter, parameter)].max(0.0).sqrt()
    }
}

/// What Student's law with some degrees of freedom exceeds one time in forty: Fisher & Cornish's expansion about the normal
/// law (Abramowitz & Stegun 26.7.5); off by less than 2e-3 of itself from 4 degrees on, 8 % at 1.5.
#[must_use]
pub fn student_97_5(degrees_of_freedom: f64) -> f64 {
    const Z: f64 = 1.959_963_985;
    let n = degrees_of_freedom;
    let power = |k: i32| Z.powi(k);
    Z + (power(3) + Z) / (4.0 * n)
        + (5.0 * power(5) + 16.0 * power(3) + 3.0 * Z) / (96.0 * n * n)
        + (3.0 * power(7) + 19.0 * power(5) + 17.0 * power(3) - 15.0 * Z) / (384.0 * n.powi(3))
        + (79.0 * power(9) + 776.0 * power(7) + 1482.0 * power(5) - 1920.0 * power(3) - 945.0 * Z)
            / (92_160.0 * n.powi(4))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::draws::Draws;
    use crate::statistics::sequence::Sequence;

    #[test]
    fn student_quantiles_match_tables() {
        for (n, t) in [(4.0, 2.7764), (10.0, 2.2281), (30.0, 2.0423), (1e6, 1.96)] {
            assert!((student_97_5(n) / t - 1.0).abs() < 2e-3, "{n}");
        }
    }

    /// A line through 900 samples whose errors are half shared by their block.
    #[test]
    fn intervals_cover_in_95_of_100_when_blocks_err_together() {
        let count = 900;
        let t_s: Vec<f64> = (0..count).map(|i| i as f64).collect();
        let sequence = Sequence::new(&t_s, &vec![0; count]);
        let blocks = Blocks::new(&sequence, &t_s);
        let mut covered = 0;
        let runs = 400;
        for seed in 0..runs {
            let mut draws = Draws::new(seed);
            let shared: Vec<f64> = (0..blocks.count()).map(|_| draws.normal()).collect();
            let place: Vec<f64> = (0..blocks.count()).map(|_| draws.uniform()).collect();
            let jacobian = DMatrix::from_fn(count, 2, |i, j| {
                if j == 0 {
                    1.0
                } else {
                    100.0 * place[blocks.of_sample[i]]
                }
            });
            let y = DVector::from_iterator(
                count,
                (0..count).map(|i| 0.7 * shared[blocks.of_sample[i]] + 0.7 * draws.normal()),
            );
            let normal = jacobian.transpose() * &jacobian;
            let fit = normal
                .cholesky()
                .expect("two columns")
                .solve(&(jacobian.transpose() * &y));
            let left = &y - &jacobian * &fit;
            let covariance =
                sandwich(&jacobian, left.as_slice(), &blocks, &[0.0, 0.0]).expect("60 blocks");
            covered += usize::from(fit[1].abs() <= covariance.half_width_95(1));
        }
        // 380 expected; three standard deviations of a count below, and a percent for leverage that the factor leaves.
        assert!((363..=393).contains(&covered), "{covered}");
    }

    #[test]
    fn two_columns_that_are_alike_have_no_covariance_unless_priors_tell_them_apart() {
        let t_s: Vec<f64> = (0..300).map(f64::from).collect();
        let blocks = Blocks::new(&Sequence::new(&t_s, &[0; 300]), &t_s);
        let alike = DMatrix::from_element(300, 2, 1.0);
        let residual: Vec<f64> = (0..300).map(|i| (f64::from(i) * 1.7).sin()).collect();
        assert!(sandwich(&alike, &residual, &blocks, &[0.0, 0.0]).is_none());
        assert!(sandwich(&alike, &residual, &blocks, &[1.0, 1.0]).is_some());
    }
}
