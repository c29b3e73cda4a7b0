//! How well the parameters of a fit are known.
//!
//! Errors of neighbours are shared, so the covariance is the sandwich over blocks (Liang & Zeger 1986):
//!
//! ```text
//! V = H⁻¹ ( Σ_b g_b g_bᵀ ) H⁻¹ · K/(K - p),   g_b = Σ_{i in b} w_i e_i J_i
//! ```
//!
//! Where a closed form stands in for a mechanism, its own error comes on top. These parameters are "effective".

use nalgebra::DMatrix;

use crate::infer::candidates::{Candidate, Parameter};
use crate::infer::fit::{Fit, TOLERANCE_SD, weight};
use crate::infer::noise::Noise;

/// Two-sided 95 % of a normal.
const NINETY_FIVE: f64 = 1.96;

/// Half-widths of 95 % intervals of a fit's parameters, in their order.
#[must_use]
pub fn half_widths(candidates: &[&Candidate], fit: &Fit, noise: &Noise) -> Vec<f64> {
    let count = fit.jacobian.ncols();
    let weights: Vec<f64> = fit.whitened.iter().map(|e| weight(*e)).collect();
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut scores = DMatrix::<f64>::zeros(count, noise.blocks.max(1));
    for (i, weight) in weights.iter().enumerate() {
        let row = fit.jacobian.row(i);
        normal += *weight * row.transpose() * row;
        let mut of_block = scores.column_mut(noise.block[i]);
        of_block += weight * fit.whitened[i] * row.transpose();
    }
    for j in count.saturating_sub(2)..count {
        normal[(j, j)] += (TOLERANCE_SD * TOLERANCE_SD).recip();
    }
    // A direction that nothing constrains gets a huge variance, not an error.
    for j in 0..count {
        normal[(j, j)] += 1e-12 + 1e-10 * normal[(j, j)];
    }
    let Some(inverse) = normal.clone().try_inverse() else {
        return vec![f64::INFINITY; count.saturating_sub(2)];
    };
    let blocks = noise.blocks as f64;
    let small = blocks / (blocks - count as f64).max(1.0);
    let sandwich = &inverse * (&scores * scores.transpose()) * &inverse * small;
    let parameters = candidates.iter().flat_map(|candidate| {
        let own = candidate.parameters.iter();
        own.map(move |parameter| (*candidate, parameter))
    });
    parameters
        .enumerate()
        .map(|(j, (candidate, parameter))| {
            // Never less than what independent errors would leave.
            let variance = sandwich[(j, j)].max(inverse[(j, j)]);
            let closure = closure(candidate, parameter, &members(candidates, fit, candidate));
            NINETY_FIVE * (variance + closure * closure).sqrt()
        })
        .collect()
}

/// Departures from neutral of the parameters of one candidate, with their units.
fn members<'a>(
    candidates: &[&'a Candidate],
    fit: &Fit,
    own: &Candidate,
) -> Vec<(&'a Parameter, f64)> {
    let all = candidates
        .iter()
        .flat_map(|c| c.parameters.iter().map(|p| (c.name, p)));
    all.zip(&fit.values)
        .filter(|((of, _), _)| *of == own.name)
        .map(|((_, parameter), value)| (parameter, value - parameter.neutral))
        .collect()
}

/// A closure's own error of one parameter. Of a vector it is that of its length: the direction is off by as much.
fn closure(candidate: &Candidate, parameter: &Parameter, all: &[(&Parameter, f64)]) -> f64 {
    if candidate.closure_error == 0.0 {
        return 0.0;
    }
    let is_vector = parameter.name.ends_with("_x") || parameter.name.ends_with("_y");
    let squares = all
        .iter()
        .filter(|(other, _)| other.name == parameter.name || is_vector)
        .map(|(_, departure)| departure * departure);
    candidate.closure_error * squares.sum::<f64>().sqrt()
}
