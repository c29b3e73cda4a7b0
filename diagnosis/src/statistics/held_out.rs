//! Does a prediction hold where it was not fitted? Folds of whole blocks, and the gain in log
//! density on what was held out.
//!
//! ```text
//! gain = Σ_blocks [ log p(held out | prediction) - log p(held out | nothing) ],     SE = √(K · var over blocks)
//! ```
//!
//! Leave-block-out in place of leave-one-out, since neighbours tell each other's values; the
//! standard error is known to come out too small, up to twofold, where the law is not the right one
//! (Bengio & Grandvalet 2004; Sivula, Magnusson & Vehtari 2020), so ask for 2.5 of them.

use super::noise::Noise;
use super::quantile::difference;
use super::robust::loss;
use super::sequence::Blocks;
use super::tail::student_two_sided;

/// Folds that blocks are dealt to. Chosen here: five sixths of a recording fit a law as well as all
/// of it.
pub const FOLDS: usize = 6;

/// How much better a prediction is than another on data that neither has seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Gain {
    /// In log density (natural), all blocks together.
    pub total: f64,
    /// Its standard error.
    pub standard_error: f64,
    by_block: Vec<f64>,
}

impl Gain {
    /// Of what was gained in each block. One block has no spread: its standard error is infinite.
    #[must_use]
    pub fn new(by_block: Vec<f64>) -> Self {
        let count = by_block.len() as f64;
        let total: f64 = by_block.iter().sum();
        let mean = total / count.max(1.0);
        let squares: f64 = by_block.iter().map(|g| (g - mean) * (g - mean)).sum();
        let variance = if by_block.len() > 1 {
            squares / (count - 1.0)
        } else {
            f64::INFINITY
        };
        Self {
            total,
            standard_error: (count * variance).sqrt(),
            by_block,
        }
    }

    /// Of samples' log densities over others, one value a sample each.
    #[must_use]
    pub fn over(blocks: &Blocks, log_density: &[f64], other: &[f64]) -> Self {
        Self::over_each(blocks, log_density.iter().copied(), other.iter().copied())
    }

    /// Of anything that adds up over samples, beyond the same of another prediction.
    #[must_use]
    pub fn over_each(
        blocks: &Blocks,
        values: impl Iterator<Item = f64>,
        others: impl Iterator<Item = f64>,
    ) -> Self {
        Self::new(blocks.sums(values.zip(others).map(|(value, other)| value - other)))
    }

    /// Of what is left after a prediction (`after`) against what was left before, both in the
    /// values' unit.
    #[must_use]
    pub fn between(noise: &Noise, before: &[f64], after: &[f64]) -> Self {
        let [before, after] = [before, after].map(|left| log_densities(&noise.whiten(left)));
        Self::over(&noise.blocks, &after, &before)
    }

    /// This gain beyond another over the same blocks, with the standard error of the difference.
    #[must_use]
    pub fn beyond(&self, other: &Self) -> Self {
        Self::new(difference(&self.by_block, &other.by_block))
    }

    /// p-value of the total being below 0 by chance: of the paired differences of blocks by
    /// Student's law, on one side. 1 where it is not below 0, or there is no spread to go by.
    #[must_use]
    pub fn p_of_loss(&self) -> f64 {
        self.p_beyond(-self.total)
    }

    /// The same of the total being above 0.
    #[must_use]
    pub fn p_of_gain(&self) -> f64 {
        self.p_beyond(self.total)
    }

    fn p_beyond(&self, total: f64) -> f64 {
        let t = total / self.standard_error;
        match t > 0.0 {
            true => 0.5 * student_two_sided(t, self.by_block.len() as f64 - 1.0),
            false => 1.0,
        }
    }

    /// The total without the block that gains most.
    #[must_use]
    pub fn without_best(&self) -> f64 {
        self.total - self.by_block.iter().copied().fold(0.0, f64::max)
    }
}

/// Log densities of whitened residuals, up to a constant: pseudo-Huber, `-9 (√(1 + (e/3)²) - 1)`.
#[must_use]
pub fn log_densities(white: &[f64]) -> Vec<f64> {
    white.iter().map(|e| -0.5 * loss(*e)).collect()
}

/// Of every sample, its fold: blocks are dealt in turn, so every fold sees all of the time.
#[must_use]
pub fn folds(blocks: &Blocks) -> Vec<usize> {
    let of_sample = blocks.of_sample.iter();
    of_sample.map(|block| block % FOLDS).collect()
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
            let mut random = Draws::new(seed);
            let gain = Gain::new((0..40).map(|_| 1.0 + 2.0 * random.normal()).collect());
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
    fn what_changes_nothing_loses_as_often_as_its_p_value_says() {
        let runs = 2000;
        let gain = |seed: u64| {
            let mut random = Draws::new(seed);
            Gain::new((0..9).map(|_| random.normal()).collect())
        };
        let lost = (0..runs).filter(|&seed| gain(seed).p_of_loss() < 0.05);
        // Four standard errors of a share of 0.05 from 2000.
        assert!((lost.count() as f64 / runs as f64 - 0.05).abs() < 0.02);
        assert_eq!(Gain::new(vec![1.0, 2.0]).p_of_loss(), 1.0);
        assert_eq!(Gain::new(vec![-1.0]).p_of_loss(), 1.0);
    }
}
