//! Stretches of time that differ from the others: a loose contact, something that stands in the way
//! for a while.
//!
//! What lasts for some readings and never comes back in the same place cannot be predicted on
//! blocks that were held out, and the signs of two blocks prove nothing. It is told by its size, in
//! windows of 8, 16, 32 readings and so on, each half over the one before it:
//!
//! ```text
//! S_w = Σ_{i in w} eᵢ/√n_w,     z_w = (S_w - median)/max(1, 1.4826 · MAD)     among windows of one length and a like level
//! ```
//!
//! with `e` whitened and bounded. Windows are parted by their mean level in thirds, for what the
//! noise model has wrong depends on it. The p-value is that of Student's law with `0.37 n/2`
//! degrees of freedom (the efficiency of the median absolute deviation, Huber & Ronchetti 2009,
//! Robust Statistics, section 5.1; half the windows are independent), times the number of all
//! windows (Bonferroni).

use std::ops::Range;

use super::quantile::median;
use super::robust::weight;
use super::sequence::Blocks;
use super::tail::student_two_sided;

/// Readings of the shortest window. Chosen here: as many steps as the shortest block.
const SHORTEST: usize = 8;
/// Windows of a like level that a spread needs. Chosen here: fewer tell no spread.
const LEAST_ALIKE: usize = 24;
/// Most parts by level.
const MOST_PARTS: usize = 3;
/// A median absolute deviation over a normal's standard deviation.
const MAD: f64 = 1.4826;
/// Efficiency of it, of windows that overlap by half.
const EFFICIENCY: f64 = 0.37 / 2.0;

/// Stretches that stand out.
#[derive(Clone, Debug, PartialEq)]
pub struct Bursts {
    /// p-value of one that stands out as much, in noise alone.
    pub p: f64,
    /// Samples of those that stand out by themselves at the level asked for, in order; none
    /// overlaps with another.
    pub windows: Vec<Range<usize>>,
}

/// Looks for them in a whitened residual, samples in the order of series and of time; `level` is
/// what readings are expected to be. Each window that is listed has a p-value of at most
/// `accepted`, all windows counted.
#[must_use]
pub fn bursts(whitened: &[f64], level: &[f64], blocks: &Blocks, accepted: f64) -> Bursts {
    let bounded: Vec<f64> = whitened.iter().map(|e| e * weight(*e)).collect();
    let runs = runs(blocks);
    let mut scored: Vec<(f64, Range<usize>)> = Vec::new();
    let mut length = SHORTEST;
    loop {
        let of_run = |run: &Range<usize>| {
            let starts = (run.start..run.end).step_by(length / 2);
            let windows = starts.map(|from| from..from + length);
            windows.take_while(|w| w.end <= run.end).collect::<Vec<_>>()
        };
        let windows: Vec<Range<usize>> = runs.iter().flat_map(of_run).collect();
        if windows.len() < LEAST_ALIKE {
            break;
        }
        scored.extend(p_values(windows, &bounded, level));
        length *= 2;
    }
    let count = scored.len() as f64;
    scored
        .iter_mut()
        .for_each(|(p, _)| *p = (*p * count).min(1.0));
    scored.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.start.cmp(&b.1.start)));
    let mut windows: Vec<Range<usize>> = Vec::new();
    for (_, window) in scored.iter().take_while(|(p, _)| *p <= accepted) {
        let meets = |other: &Range<usize>| other.start < window.end && window.start < other.end;
        if !windows.iter().any(meets) {
            windows.push(window.clone());
        }
    }
    windows.sort_by_key(|window| window.start);
    Bursts {
        p: scored.first().map_or(1.0, |(p, _)| *p),
        windows,
    }
}

/// Samples without a gap between them.
fn runs(blocks: &Blocks) -> Vec<Range<usize>> {
    let of_sample = &blocks.of_sample;
    let begins =
        |&i: &usize| i == 0 || of_sample[i] != of_sample[i - 1] && !blocks.follows[of_sample[i]];
    let mut starts: Vec<usize> = (0..of_sample.len()).filter(begins).collect();
    starts.push(of_sample.len());
    starts.windows(2).map(|pair| pair[0]..pair[1]).collect()
}

/// Of every window of one length, the p-value by itself.
fn p_values(
    mut windows: Vec<Range<usize>>,
    bounded: &[f64],
    level: &[f64],
) -> Vec<(f64, Range<usize>)> {
    let sum = |of: &[f64], window: &Range<usize>| of[window.clone()].iter().sum::<f64>();
    windows.sort_by(|a, b| {
        let by_level = sum(level, a).total_cmp(&sum(level, b));
        by_level.then(a.start.cmp(&b.start))
    });
    let count = windows.len();
    let parts = (count / LEAST_ALIKE).min(MOST_PARTS);
    let mut scored = Vec::with_capacity(count);
    for part in 0..parts {
        let alike = &windows[part * count / parts..(part + 1) * count / parts];
        let score = |window: &Range<usize>| sum(bounded, window) / (window.len() as f64).sqrt();
        let scores: Vec<f64> = alike.iter().map(score).collect();
        let middle = median(&mut scores.clone()).unwrap_or(0.0);
        let mut away: Vec<f64> = scores.iter().map(|s| (s - middle).abs()).collect();
        let spread = (MAD * median(&mut away).unwrap_or(0.0)).max(1.0);
        let freedom = EFFICIENCY * alike.len() as f64;
        let p = |score: &f64| student_two_sided((score - middle) / spread, freedom);
        scored.extend(scores.iter().map(p).zip(alike.iter().cloned()));
    }
    scored
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
        let told: usize = found.windows.iter().map(|window| window.len()).sum();
        assert!(told > 15 && found.windows.iter().all(|w| w.start > 380 && w.end < 450));
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
