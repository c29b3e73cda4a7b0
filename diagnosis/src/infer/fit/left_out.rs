//! Fits without some of the blocks, and how well they predict these.

use nalgebra::DVector;

use super::bounded::bounded_step;
use super::{Fit, Setting, loss, weight};
use crate::infer::candidates::{Candidate, Parameter};

/// How well each sample is predicted by what was learnt from the others: blocks go out by turns, the linearised fit is solved again
/// without them. One log density (up to a constant) for each sample.
#[must_use]
pub fn held_out(setting: &Setting, candidates: &[&Candidate], fit: &Fit, folds: usize) -> Vec<f64> {
    let predicted = held_out_residuals(setting, candidates, fit, folds);
    predicted.iter().map(|e| -0.5 * loss(*e)).collect()
}

/// The whitened residuals of the same.
#[must_use]
pub fn held_out_residuals(
    setting: &Setting,
    candidates: &[&Candidate],
    fit: &Fit,
    folds: usize,
) -> Vec<f64> {
    let blocks = &setting.noise.block;
    let mut residuals = fit.whitened.clone();
    for fold in 0..folds {
        let step = step_without(setting, candidates, fit, fold, folds);
        for (i, residual) in residuals.iter_mut().enumerate() {
            if blocks[i] % folds == fold {
                let moved: f64 = (0..step.len())
                    .map(|j| fit.jacobian[(i, j)] * step[j])
                    .sum();
                *residual = fit.whitened[i] - moved;
            }
        }
    }
    residuals
}

/// Predicted readings, gain and offset included, by the fit without one fold's blocks.
#[must_use]
pub fn refit_without(
    setting: &Setting,
    candidates: &[&Candidate],
    fit: &Fit,
    fold: usize,
    folds: usize,
) -> Vec<f64> {
    let step = step_without(setting, candidates, fit, fold, folds);
    let at = fit.values.iter().chain(&fit.tolerance);
    let moved: Vec<f64> = at.zip(step.iter()).map(|(x, d)| x + d).collect();
    let (values, tolerance) = moved.split_at(fit.values.len());
    let plain = setting
        .observed
        .predict(&setting.hypothesis(candidates, values));
    let (gain, offset) = (tolerance[0], tolerance[1]);
    plain.iter().map(|f| (1.0 + gain) * f + offset).collect()
}

/// From the fit of everything to the linearised one without one fold's blocks: a step of values, gain and offset.
fn step_without(
    setting: &Setting,
    candidates: &[&Candidate],
    fit: &Fit,
    fold: usize,
    folds: usize,
) -> DVector<f64> {
    let parameters: Vec<Parameter> = candidates
        .iter()
        .flat_map(|candidate| candidate.parameters.iter().copied())
        .collect();
    let bounds = setting.bounds(&parameters);
    let at = [&fit.values[..], &fit.tolerance].concat();
    let of_sample = fit.whitened.iter().zip(&setting.noise.block);
    let weights: Vec<f64> = of_sample
        .map(|(e, block)| {
            if block % folds == fold {
                0.0
            } else {
                weight(*e)
            }
        })
        .collect();
    bounded_step(&fit.jacobian, &fit.whitened, &weights, &at, &bounds, 1e-9)
}
