//! How well the parameters of a fit are known.
//!
//! Errors of neighbours are shared, so the covariance is the sandwich over blocks (Liang & Zeger 1986):
//!
//! ```text
//! V = H⁻¹ ( Σ_b g_b g_bᵀ ) H⁻¹ · K/(K - p),   g_b = Σ_{i in b} w_i e_i J_i
//! ```
//!
//! Where a closed form stands in for a mechanism, its own error comes on top: a tenth of the effect, chosen here after comparing such forms
//! with other closures of the same mechanism. These parameters are "effective".

use nalgebra::DMatrix;

use crate::candidates::{Candidate, Parameter};
use crate::fit::{Fit, TOLERANCE_SD, weight};
use crate::noise::Noise;

/// Closed forms that stand in for a mechanism.
pub(crate) const EFFECTIVE: [&str; 6] = [
    "crossflow",
    "ground_impingement",
    "jet_merging",
    "wander",
    "sensor_lag",
    "near_field",
];
/// Their own error, in parts of the effect.
const CLOSURE: f64 = 0.10;
/// Two-sided 95 % of a normal.
const NINETY_FIVE: f64 = 1.96;

/// Half-widths of 95 % intervals of a fit's parameters, in their order.
#[must_use]
pub fn half_widths(candidates: &[&Candidate], fit: &Fit, noise: &Noise) -> Vec<f64> {
    let count = fit.jacobian.ncols();
    let weights: Vec<f64> = fit.whitened.iter().map(|e| weight(*e)).collect();
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut scores = DMatrix::<f64>::zeros(count, noise.blocks.max(1));
    for i in 0..weights.len() {
        let row = fit.jacobian.row(i);
        normal += weights[i] * row.transpose() * row;
        let mut of_block = scores.column_mut(noise.block[i]);
        of_block += weights[i] * fit.whitened[i] * row.transpose();
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
        own.map(|parameter| (candidate.name, parameter))
    });
    parameters
        .enumerate()
        .map(|(j, (name, parameter))| {
            // Never less than what independent errors would leave.
            let variance = sandwich[(j, j)].max(inverse[(j, j)]);
            let closure = closure(name, parameter, fit.values[j]);
            NINETY_FIVE * (variance + closure * closure).sqrt()
        })
        .collect()
}

fn closure(name: &str, parameter: &Parameter, value: f64) -> f64 {
    if EFFECTIVE.contains(&name) {
        0.5 * CLOSURE * (value - parameter.neutral).abs()
    } else {
        0.0
    }
}
