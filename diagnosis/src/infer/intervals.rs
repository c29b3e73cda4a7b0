//! How well the parameters of a fit are known.
//!
//! Errors of neighbours are shared, so the covariance is the sandwich over blocks (Liang & Zeger
//! 1986; the factor of Cameron & Miller 2015):
//!
//! ```text
//! V = H⁻¹ ( Σ_b g_b g_bᵀ ) H⁻¹ · K/(K - p),   g_b = Σ_{i in b} w_i e_i J_i
//! ```
//!
//! Where a closed form stands in for a mechanism, its own error comes on top. These parameters are
//! "effective".

use nalgebra::DMatrix;

use crate::infer::candidates::Candidate;
use crate::infer::fit::{Fit, Setting, by_member, normal_equations};
use crate::statistics::robust::weight;

/// Half-width of a 95 % interval in standard errors, normal law.
pub(crate) const NINETY_FIVE: f64 = 1.96;

/// Half-widths of 95 % intervals of a fit's parameters, in their order and units; infinite where
/// nothing constrains them.
#[must_use]
pub fn half_widths(candidates: &[&Candidate], fit: &Fit, setting: &Setting) -> Vec<f64> {
    let count = fit.jacobian.ncols();
    let blocks = &setting.noise.blocks;
    let weights: Vec<f64> = fit.whitened.iter().map(|e| weight(*e)).collect();
    let at = [&fit.values[..], fit.tolerance.as_flattened()].concat();
    let errors = (&fit.whitened[..], &weights[..]);
    let (mut normal, _) = normal_equations(&fit.jacobian, errors, &at, &setting.spreads());
    let mut scores = DMatrix::<f64>::zeros(count, blocks.count().max(1));
    for (i, weight) in weights.iter().enumerate() {
        let mut of_block = scores.column_mut(blocks.of_sample[i]);
        of_block += weight * fit.whitened[i] * fit.jacobian.row(i).transpose();
    }
    // A direction that nothing constrains gets a huge variance, not an error.
    for j in 0..count {
        normal[(j, j)] += 1e-12 + 1e-10 * normal[(j, j)];
    }
    let Some(inverse) = normal.try_inverse() else {
        return vec![f64::INFINITY; fit.values.len()];
    };
    let number = blocks.count() as f64;
    let small = number / (number - count as f64).max(1.0);
    let sandwich = &inverse * (&scores * scores.transpose()) * &inverse * small;
    let mut half_widths = Vec::with_capacity(fit.values.len());
    for (candidate, own) in by_member(candidates, &fit.values) {
        let own = candidate.parameters.iter().zip(own);
        let departures: Vec<f64> = own.map(|(p, value)| value - p.neutral).collect();
        let length = departures.iter().map(|d| d * d).sum::<f64>().sqrt();
        for (parameter, departure) in candidate.parameters.iter().zip(departures) {
            // Of a vector the error is that of its length: the direction is off by as much.
            let is_vector = parameter.name.ends_with("_x") || parameter.name.ends_with("_y");
            let size = [departure.abs(), length][usize::from(is_vector)];
            let closure = candidate.closure_error * size;
            // Never less than what independent errors would leave.
            let j = half_widths.len();
            let variance = sandwich[(j, j)].max(inverse[(j, j)]);
            half_widths.push(NINETY_FIVE * (variance + closure * closure).sqrt());
        }
    }
    half_widths
}
