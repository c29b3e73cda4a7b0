//! How sure an error before and after is: whole blocks drawn again, with replacement.
//!
//! Percentile intervals of 200 draws (Künsch 1989 for blocks; Efron & Tibshirani 1993, ch. 13). Before and after are drawn
//! together, so the interval of their ratio knows that hard blocks are hard for both.

use super::draws::Draws;
use super::sequence::Blocks;

/// A number with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// From the data as they are.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Root mean squares before and after, in the residuals' unit, and their ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Before.
    pub before: Estimate,
    /// After.
    pub after: Estimate,
    /// After over before: below 1, it helped.
    pub ratio: Estimate,
}

/// Draws. Chosen here: ends of an interval from 200 are off by a tenth of its width.
pub const DRAWS: usize = 200;

/// Compares residuals of held-out samples; divide them by a scale beforehand for a normalised error. `None` without samples.
#[must_use]
pub fn compare(blocks: &Blocks, before: &[f64], after: &[f64], seed: u64) -> Option<Comparison> {
    if before.is_empty() {
        return None;
    }
    let squares_before = blocks.sums(before.iter().map(|r| r * r));
    let squares_after = blocks.sums(after.iter().map(|r| r * r));
    let counts = blocks.sums(before.iter().map(|_| 1.0));
    let of = |drawn: &mut dyn Iterator<Item = usize>| {
        let (mut one, mut two, mut count) = (0.0, 0.0, 0.0);
        for b in drawn {
            one += squares_before[b];
            two += squares_after[b];
            count += counts[b];
        }
        let ratio = if one > 0.0 { (two / one).sqrt() } else { 1.0 };
        [(one / count).sqrt(), (two / count).sqrt(), ratio]
    };
    let seen = of(&mut (0..counts.len()));
    let mut draws = Draws::new(seed);
    let again: Vec<[f64; 3]> = (0..DRAWS)
        .map(|_| of(&mut (0..counts.len()).map(|_| draws.below(counts.len()))))
        .collect();
    let estimate = |k: usize| {
        let mut values: Vec<f64> = again.iter().map(|draw| draw[k]).collect();
        values.sort_by(f64::total_cmp);
        Estimate {
            value: seen[k],
            low: quantile(&values, 0.025),
            high: quantile(&values, 0.975),
        }
    };
    Some(Comparison {
        before: estimate(0),
        after: estimate(1),
        ratio: estimate(2),
    })
}

/// Of sorted values, linear between neighbours.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (sorted[above] - sorted[below]) * (place - below as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::sequence::Sequence;

    #[test]
    fn intervals_cover_in_about_95_of_100() {
        let count = 900;
        let t_s: Vec<f64> = (0..count).map(|i| i as f64).collect();
        let blocks = Blocks::new(&Sequence::new(&t_s, &vec![0; count]), &t_s);
        let mut covered = 0;
        for seed in 0..400 {
            let mut draws = Draws::new(1000 + seed);
            let shared: Vec<f64> = (0..blocks.count()).map(|_| draws.normal()).collect();
            let after: Vec<f64> = blocks
                .of_sample
                .iter()
                .map(|&b| shared[b] + draws.normal())
                .collect();
            let before: Vec<f64> = after.iter().map(|r| 2.0 * r).collect();
            let compared = compare(&blocks, &before, &after, seed).expect("samples");
            let truth = 2f64.sqrt();
            covered += usize::from(compared.after.low <= truth && truth <= compared.after.high);
            // Half in every draw.
            assert!((compared.ratio.low - 0.5).abs() < 1e-12);
            assert!((compared.ratio.high - 0.5).abs() < 1e-12);
        }
        // Percentile intervals from 60 blocks of skewed squares cover 92 to 95 %; three standard deviations of a count.
        assert!((352..=394).contains(&covered), "{covered}");
    }

    #[test]
    fn without_samples_there_is_no_comparison() {
        let blocks = Blocks::new(&Sequence::new(&[], &[]), &[]);
        assert_eq!(compare(&blocks, &[], &[], 1), None);
    }
}
