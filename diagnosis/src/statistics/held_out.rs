//! Does a prediction hold where it was not fitted? Folds of whole blocks, and the gain in log density on what was held out.
//!
//! ```text
//! gain = Σ_blocks [ log p(held out | prediction) - log p(held out | nothing) ],     SE = √(K · var over blocks)
//! ```
//!
//! Leave-block-out in place of leave-one-out, since neighbours tell each other's values; the standard error is known to come out too small,
//! up to twofold, where the law is not the right one (Bengio & Grandvalet 2004; Sivula, Magnusson & Vehtari 2020), so ask for
//! 2.5 of them.

use super::noise::Whitener;
use super::sequence::Blocks;

/// Where pseudo-Huber losses turn from square to straight, in standard deviations.
pub const HUBER: f64 = 3.0;

/// How much better a prediction is than another on data that neither has seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Gain {
    /// In log density (natural), all blocks together.
    pub total: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Of every block.
    pub by_block: Vec<f64>,
}

impl Gain {
    /// Of what was gained in each block.
    #[must_use]
    pub fn new(by_block: Vec<f64>) -> Self {
        let count = by_block.len() as f64;
        let total: f64 = by_block.iter().sum();
        let mean = total / count.max(1.0);
        let squares: f64 = by_block.iter().map(|g| (g - mean) * (g - mean)).sum();
        // K · [squares/(K - 1)]; one block has no spread to be told.
        let variance = if by_block.len() > 1 {
            count * squares / (count - 1.0)
        } else {
            f64::INFINITY
        };
        Self {
            total,
            standard_error: variance.sqrt(),
            by_block,
        }
    }

    /// Of what is left after a prediction (`after`) against what was left before, both in the values' unit.
    #[must_use]
    pub fn between(whitener: &Whitener, blocks: &Blocks, before: &[f64], after: &[f64]) -> Self {
        let before = log_densities(&whitener.whiten(before));
        let after = log_densities(&whitener.whiten(after));
        Self::new(blocks.sums(after.iter().zip(&before).map(|(a, b)| a - b)))
    }

    /// This gain beyond another over the same blocks, with the standard error of the difference.
    #[must_use]
    pub fn beyond(&self, other: &Self) -> Self {
        let pairs = self.by_block.iter().zip(&other.by_block);
        Self::new(pairs.map(|(a, b)| a - b).collect())
    }
}

/// Log density of whitened residuals, up to a constant: pseudo-Huber, `-9 (√(1 + (e/3)²) - 1)`.
#[must_use]
pub fn log_densities(white: &[f64]) -> Vec<f64> {
    let of = |e: &f64| -HUBER * HUBER * ((1.0 + (e / HUBER) * (e / HUBER)).sqrt() - 1.0);
    white.iter().map(of).collect()
}

/// Of every sample, its fold: blocks are dealt in turn, so every fold sees all of the time.
#[must_use]
pub fn folds(blocks: &Blocks, count: usize) -> Vec<usize> {
    let count = count.max(1);
    blocks.of_sample.iter().map(|block| block % count).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::draws::Draws;

    #[test]
    fn the_standard_error_covers_the_spread_of_gains() {
        let (mut sum, mut squares, mut claimed) = (0.0, 0.0, 0.0);
        let runs = 400;
        for seed in 0..runs {
            let mut draws = Draws::new(seed);
            let gain = Gain::new((0..40).map(|_| 1.0 + 2.0 * draws.normal()).collect());
            sum += gain.total;
            squares += gain.total * gain.total;
            claimed += gain.standard_error;
        }
        let runs = runs as f64;
        let spread = (squares / runs - (sum / runs).powi(2)).sqrt();
        // Four standard errors of a standard deviation from 400.
        assert!((claimed / runs / spread - 1.0).abs() < 0.15);
        assert!((sum / runs - 40.0).abs() < 4.0 * spread / runs.sqrt());
    }

    #[test]
    fn small_residuals_are_normal_and_wild_ones_cost_in_proportion() {
        let log = log_densities(&[0.01, 300.0, 600.0]);
        // Up to the next term of the root, e⁴/72.
        assert!((log[0] + 0.5e-4).abs() < 1e-9);
        assert!((log[2] / log[1] - 2.0).abs() < 0.02);
    }
}
