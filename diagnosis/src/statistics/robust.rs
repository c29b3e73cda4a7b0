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

/// Standard deviation of normal values of which up to half are wild: `Q_n` of Rousseeuw & Croux
/// (1993, J. Am. Stat. Assoc. 88:1273), with their factors for ten values and more.
///
/// ```text
/// Q_n = d_n 2.2191 {|x_i - x_j|, i < j}_(k),   k = h (h - 1)/2,   h = n/2 + 1
/// ```
///
/// Its efficiency is 0.82 where that of the median absolute deviation is 0.37. `None` of fewer than
/// two values.
#[must_use]
pub fn spread(values: &[f64]) -> Option<f64> {
    let n = values.len();
    let pairs = (1..n).flat_map(|i| (0..i).map(move |j| (i, j)));
    let mut apart: Vec<f64> = pairs.map(|(i, j)| (values[i] - values[j]).abs()).collect();
    let h = n / 2 + 1;
    let k = (h * (h - 1) / 2).checked_sub(1)?;
    let more = if n.is_multiple_of(2) { 3.8 } else { 1.4 };
    let factor = 2.2191 * n as f64 / (n as f64 + more);
    (k < apart.len()).then(|| factor * *apart.select_nth_unstable_by(k, f64::total_cmp).1)
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

    #[test]
    fn a_spread_is_that_of_normal_values_though_a_third_are_wild() {
        let mut random = crate::statistics::draws::Draws::new(1);
        let values: Vec<f64> = (0..600).map(|_| 2.0 * random.normal()).collect();
        // Its standard error, 2/sqrt(2 * 0.82 * 600), four times.
        assert!((spread(&values).expect("many") - 2.0).abs() < 0.26);
        let wild = |(i, x): (usize, &f64)| if i < 200 { 500.0 + 100.0 * x } else { *x };
        let values: Vec<f64> = values.iter().enumerate().map(wild).collect();
        assert!(spread(&values).expect("many") < 6.0);
        assert_eq!(spread(&[1.0]), None);
    }
}
