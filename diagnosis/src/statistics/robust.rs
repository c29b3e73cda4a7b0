//! Losses and scales that a few gross errors cannot carry away.

/// Where the pseudo-Huber loss turns from square to straight (`c`), in standard deviations. Chosen
/// here: it costs 0.4 % of a signal in normal noise.
pub const GROSS: f64 = 3.0;

/// Pseudo-Huber loss of a whitened residual, `e²` for small errors and `2 c |e|` for gross ones.
///
/// ```text
/// ρ(e) = 2 c² (√(1 + e²/c²) - 1)
/// ```
///
/// Half of it, negated, is the log density that fits, folds and comparisons share.
#[must_use]
pub fn loss(e: f64) -> f64 {
    2.0 * GROSS * GROSS * (stretch(e) - 1.0)
}

/// Weight of a whitened residual in iteratively reweighted least squares, `ρ'(e)/(2 e)`: 1 for
/// small errors, `c/|e|` for gross ones.
#[must_use]
pub fn weight(e: f64) -> f64 {
    stretch(e).recip()
}

fn stretch(e: f64) -> f64 {
    (1.0 + (e / GROSS) * (e / GROSS)).sqrt()
}

/// Huber's bound `k` on a value, in standard deviations, with the mean of `min(z², k²)` for normal
/// `z`, which makes the scale consistent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HuberScale {
    k: f64,
    mean: f64,
}

impl HuberScale {
    /// `k` = 1.5, for first differences: a third of wild ones cannot carry the variance away.
    pub const OF_DIFFERENCES: HuberScale = HuberScale {
        k: 1.5,
        mean: 0.778_46,
    };
    /// `k` = 2, for scores of blocks, of which few are wild and many are few.
    pub const OF_BLOCKS: HuberScale = HuberScale {
        k: 2.0,
        mean: 0.920_51,
    };
    /// Rounds of the fixed point, which settles geometrically, at most, and the share of itself
    /// that it changes by when it has.
    const ROUNDS: usize = 60;
    const SETTLED: f64 = 1e-6;

    /// Variance `v` with `Σ min(d², k² v h) = v E[min(z², k²)] Σ h` ("Proposal 2", Huber 1964, Ann.
    /// Math. Stat. 35:73), of squares `d²` that are expected to be `v h`; iterated from above. In
    /// the unit of `d²/h`; not a number without any.
    #[must_use]
    pub fn variance(self, squares: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
        let sum = |(a, b): (f64, f64), (c, d): (f64, f64)| (a + c, b + d);
        let (square, total) = squares.clone().fold((0.0, 0.0), sum);
        let mut variance = square / total;
        for _ in 0..Self::ROUNDS {
            let most = self.k * self.k * variance;
            let bounded = squares.clone().map(|(square, h)| square.min(most * h));
            let before = variance;
            variance = bounded.sum::<f64>() / total / self.mean;
            if (before - variance).abs() <= Self::SETTLED * variance {
                break;
            }
        }
        variance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_residuals_are_squares_and_wild_ones_cost_in_proportion() {
        // Up to the next term of the root, e⁴/36.
        assert!((loss(0.01) - 1e-4).abs() < 1e-9);
        assert!((loss(600.0) / loss(300.0) - 2.0).abs() < 0.02);
        assert_eq!(weight(0.0), 1.0);
    }
}
