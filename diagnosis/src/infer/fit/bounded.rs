//! Steps of a fit that stay within bounds.

use nalgebra::{DMatrix, DVector};

use super::TOLERANCE_SD;

/// The damped step that lowers the linearised cost most without leaving the bounds: parameters that would leave are put on their
/// bound, the rest solved again.
pub(super) fn bounded_step(
    jacobian: &DMatrix<f64>,
    whitened: &[f64],
    weights: &[f64],
    at: &[f64],
    bounds: &[[f64; 2]],
    damping: f64,
) -> DVector<f64> {
    let (normal, gradient) = normal_equations(jacobian, whitened, weights, at);
    solve_bounded(&normal, &gradient, at, bounds, damping)
}

/// `JᵀWJ` and `JᵀWe` with the priors of gain and offset in the last two places.
fn normal_equations(
    jacobian: &DMatrix<f64>,
    whitened: &[f64],
    weights: &[f64],
    at: &[f64],
) -> (DMatrix<f64>, DVector<f64>) {
    let count = jacobian.ncols();
    let mut normal = DMatrix::zeros(count, count);
    let mut gradient = DVector::zeros(count);
    for a in 0..count {
        let column_a = jacobian.column(a);
        for b in a..count {
            let column_b = jacobian.column(b);
            let sum: f64 = (0..weights.len())
                .map(|i| weights[i] * column_a[i] * column_b[i])
                .sum();
            normal[(a, b)] = sum;
            normal[(b, a)] = sum;
        }
        gradient[a] = (0..weights.len())
            .map(|i| weights[i] * column_a[i] * whitened[i])
            .sum();
    }
    let prior = (TOLERANCE_SD * TOLERANCE_SD).recip();
    for j in count.saturating_sub(2)..count {
        normal[(j, j)] += prior;
        gradient[j] -= prior * at[j];
    }
    (normal, gradient)
}

fn solve_bounded(
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    at: &[f64],
    bounds: &[[f64; 2]],
    damping: f64,
) -> DVector<f64> {
    let count = gradient.len();
    let mut step = DVector::zeros(count);
    let mut fixed = vec![false; count];
    for _ in 0..=count {
        let free: Vec<usize> = (0..count).filter(|&j| !fixed[j]).collect();
        if free.is_empty() {
            break;
        }
        let mut matrix =
            DMatrix::from_fn(free.len(), free.len(), |a, b| normal[(free[a], free[b])]);
        let right = DVector::from_fn(free.len(), |a, _| {
            let pulled: f64 = (0..count)
                .filter(|&j| fixed[j])
                .map(|j| normal[(free[a], j)] * step[j])
                .sum();
            gradient[free[a]] - pulled
        });
        for a in 0..free.len() {
            // Marquardt's scaling, and a floor for parameters that change nothing.
            matrix[(a, a)] += damping * matrix[(a, a)] + 1e-12;
        }
        let Some(solved) = matrix.cholesky().map(|factor| factor.solve(&right)) else {
            break;
        };
        // One at a time, the furthest out for its range first: what it leaves undone may keep the others inside.
        let mut furthest: Option<(f64, usize)> = None;
        for (a, &j) in free.iter().enumerate() {
            let to = at[j] + solved[a];
            let [low, high] = bounds[j];
            step[j] = to.clamp(low, high) - at[j];
            let out = (low - to).max(to - high) / (high - low);
            if out > 0.0 && furthest.is_none_or(|(most, _)| out > most) {
                furthest = Some((out, j));
            }
        }
        match furthest {
            Some((_, j)) => fixed[j] = true,
            None => break,
        }
    }
    step
}
