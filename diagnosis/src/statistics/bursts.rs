//! Stretches of time that differ from the others: a loose contact, something that stands in the way
//! for a while.
//!
//! What lasts for a block or two and never comes back in the same place cannot be predicted on
//! blocks that were held out, and the signs of two blocks prove nothing. It is told by its size:
//!
//! ```text
//! S_b = Σ_{i in b} eᵢ/√n_b,     z_b = (S_b - median)/max(1, 1.4826 · MAD)     among blocks of a like level
//! ```
//!
//! with `e` whitened and bounded. Blocks are parted by their mean level in thirds, for what the
//! noise model has wrong depends on it. The p-value is that of Student's law with `0.37 n` degrees
//! of freedom (the efficiency of the median absolute deviation, Huber & Ronchetti 2009, Robust
//! Statistics, section 5.1), times the number of blocks (Bonferroni).

use super::quantile::median;
use super::robust::weight;
use super::sequence::Blocks;
use super::tail::student_two_sided;

/// Blocks of a like level that a spread needs. Chosen here: fewer tell no spread.
const LEAST_BLOCKS: usize = 12;
/// Most parts by level.
const MOST_PARTS: usize = 3;
/// A median absolute deviation over a normal's standard deviation.
const MAD: f64 = 1.4826;
/// Efficiency of it.
const EFFICIENCY: f64 = 0.37;

/// Blocks that stand out.
#[derive(Clone, Debug, PartialEq)]
pub struct Bursts {
    /// p-value of one that stands out as much, in noise alone.
    pub p: f64,
    /// Blocks that stand out by themselves at the level asked for.
    pub blocks: Vec<usize>,
}

/// Looks for them in a whitened residual; `level` is what readings are expected to be. Each block
/// that is listed has a p-value of at most `accepted`, all blocks counted.
#[must_use]
pub fn bursts(whitened: &[f64], level: &[f64], blocks: &Blocks, accepted: f64) -> Bursts {
    let count = blocks.count();
    let sizes = blocks.sums(whitened.iter().map(|_| 1.0));
    let sums = blocks.sums(whitened.iter().map(|e| e * weight(*e)));
    let levels = blocks.sums(level.iter().copied());
    let score = |b: usize| sums[b] / sizes[b].max(1.0).sqrt();
    let mut by_level: Vec<usize> = (0..count).collect();
    let mean = |b: usize| levels[b] / sizes[b].max(1.0);
    by_level.sort_by(|&a, &b| mean(a).total_cmp(&mean(b)).then(a.cmp(&b)));
    let parts = (count / LEAST_BLOCKS).min(MOST_PARTS);
    let mut found = Bursts {
        p: 1.0,
        blocks: Vec::new(),
    };
    for part in 0..parts {
        let alike = &by_level[part * count / parts..(part + 1) * count / parts];
        let mut scores: Vec<f64> = alike.iter().map(|&b| score(b)).collect();
        let middle = median(&mut scores).unwrap_or(0.0);
        let mut away: Vec<f64> = scores.iter().map(|s| (s - middle).abs()).collect();
        let spread = (MAD * median(&mut away).unwrap_or(0.0)).max(1.0);
        let freedom = EFFICIENCY * alike.len() as f64;
        for &b in alike {
            let z = (score(b) - middle) / spread;
            let p = (student_two_sided(z, freedom) * count as f64).min(1.0);
            found.p = found.p.min(p);
            if p <= accepted {
                found.blocks.push(b);
            }
        }
    }
    found.blocks.sort_unstable();
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::draws::Draws;
    use crate::statistics::sequence::Sequence;

    fn blocks(count: usize) -> (Blocks, Vec<f64>) {
        let t_s: Vec<f64> = (0..count).map(|i| i as f64).collect();
        let level = t_s.iter().map(|t| (0.3 * t).sin().abs()).collect();
        (
            Blocks::new(&Sequence::new(&t_s, &vec![0; count]), &t_s),
            level,
        )
    }

    #[test]
    fn half_a_minute_of_a_loose_contact_stands_out_and_is_found() {
        let (blocks, level) = blocks(2700);
        let mut random = Draws::new(3);
        let loose = |i: usize| if (400..430).contains(&i) { -3.0 } else { 0.0 };
        let whitened: Vec<f64> = (0..2700).map(|i| random.normal() + loose(i)).collect();
        let found = bursts(&whitened, &level, &blocks, 0.05);
        assert!(found.p < 1e-3, "{}", found.p);
        let mut inside = found.blocks.iter();
        assert!(inside.all(|&b| (380..450).any(|i| blocks.of_sample[i] == b)));
    }

    #[test]
    fn noise_of_any_size_stands_out_as_often_as_its_p_value_says() {
        let (blocks, level) = blocks(900);
        for (size, tails) in [(1.0, false), (3.0, false), (1.0, true)] {
            let alarms = (0..400).filter(|&seed| {
                let mut random = Draws::new(seed);
                let draw = |random: &mut Draws| match tails {
                    true => random.normal() / random.uniform().sqrt().max(0.05),
                    false => size * random.normal(),
                };
                let whitened: Vec<f64> = (0..900).map(|_| draw(&mut random)).collect();
                bursts(&whitened, &level, &blocks, 0.05).p <= 0.01
            });
            // 1 % of 400, and three standard deviations.
            assert!(alarms.count() <= 10, "{size} {tails}");
        }
    }
}
