//! Stretches of time that differ from the others: a loose contact, something that stands in the way
//! for a while.
//!
//! What lasts for some readings and never comes back in the same place cannot be predicted on
//! blocks that were held out, and the signs of two blocks prove nothing. It is found by its size,
//! in windows of 8, 16, 32 readings and so on, each half over the one before it:
//!
//! ```text
//! amount:  S_w = Σ eᵢ/√n_w
//! part:    S_w = Σ eᵢ fᵢ/√(Σ fᵢ²)                          over the readings i of a window w
//! z_w = (S_w - median)/max(1, Q_n)              among windows of one length and a like level
//! ```
//!
//! with `e` whitened, in units of its spread at a like level, and bounded, and `f` what is
//! expected, whitened: a part of the reading shows where passes rise above nothing, an amount
//! anywhere. For amounts, windows are parted by their mean level in thirds, for what the noise
//! model has wrong depends on it.
//!
//! The p-value is that of Student's law with `0.82 n/2` degrees of freedom (the efficiency of
//! `Q_n`, see [`spread`]; half the windows are independent), times the number of windows of that
//! length, times the number of lengths for amounts and parts (Bonferroni, each of these with the
//! same share).

use std::ops::Range;

use super::quantile::median;
use super::robust::{spread, weight};
use super::sequence::Blocks;
use super::tail::student_two_sided;

/// Readings of the shortest window. Chosen here: as many steps as the shortest block.
const SHORTEST: usize = 8;
/// Mean square of what is expected in a window, over that of all, below which it tells of no part
/// of it. Chosen here: a tenth of the speed.
const LEAST_SQUARE: f64 = 0.01;
/// Parts of all samples by level, each of which has its own scale. Chosen here.
const LEVELS: usize = 12;
/// Windows of a like level that a spread needs. Chosen here: fewer tell no spread.
const LEAST_ALIKE: usize = 24;
/// Most parts by level.
const MOST_PARTS: usize = 3;
/// A median absolute deviation over a normal's standard deviation.
const MAD: f64 = 1.4826;
/// Efficiency of [`spread`], of windows that overlap by half.
const EFFICIENCY: f64 = 0.82 / 2.0;

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
/// what readings are expected to be, `along` the same whitened. Each window that is listed has a
/// p-value of at most `accepted`, all windows counted.
#[must_use]
pub fn bursts(
    whitened: &[f64],
    [level, along]: [&[f64]; 2],
    blocks: &Blocks,
    accepted: f64,
) -> Bursts {
    let bounded: Vec<f64> = (whitened.iter().zip(scales(whitened, level)))
        .map(|(e, scale)| e / scale)
        .map(|e| e * weight(e))
        .collect();
    let sum =
        |of: &dyn Fn(usize) -> f64, window: &Range<usize>| window.clone().map(of).sum::<f64>();
    let amount =
        |window: &Range<usize>| Some(sum(&|i| bounded[i], window) / (window.len() as f64).sqrt());
    let square = |window: &Range<usize>| sum(&|i| along[i] * along[i], window);
    let least = LEAST_SQUARE * square(&(0..along.len())) / along.len() as f64;
    let part = |window: &Range<usize>| {
        let square = square(window);
        let told = square > least * window.len() as f64;
        told.then(|| sum(&|i| bounded[i] * along[i], window) / square.sqrt())
    };
    let runs = runs(blocks);
    let mut scored: Vec<(f64, Range<usize>)> = Vec::new();
    let (mut length, mut kinds) = (SHORTEST, 0.0);
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
        let own = [
            p_values(&windows, amount, level, MOST_PARTS),
            p_values(&windows, part, level, 1),
        ];
        for own in own {
            let count = own.len() as f64;
            scored.extend(own.into_iter().map(|(p, window)| (p * count, window)));
            kinds += 1.0;
        }
        length *= 2;
    }
    scored
        .iter_mut()
        .for_each(|(p, _)| *p = (*p * kinds).min(1.0));
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

/// Samples without a gap between them. Where blocks span several series, the next of these begins
/// with an earlier block.
fn runs(blocks: &Blocks) -> Vec<Range<usize>> {
    let of_sample = &blocks.of_sample;
    let begins = |&i: &usize| {
        i == 0
            || of_sample[i] < of_sample[i - 1]
            || of_sample[i] > of_sample[i - 1] && !blocks.follows[of_sample[i]]
    };
    let mut starts: Vec<usize> = (0..of_sample.len()).filter(begins).collect();
    starts.push(of_sample.len());
    starts.windows(2).map(|pair| pair[0]..pair[1]).collect()
}

/// How much larger residuals of a like level are than they should be, at least 1.
fn scales(whitened: &[f64], level: &[f64]) -> Vec<f64> {
    let mut by_level: Vec<usize> = (0..level.len()).collect();
    by_level.sort_by(|&a, &b| level[a].total_cmp(&level[b]).then(a.cmp(&b)));
    let mut scales = vec![1.0; level.len()];
    for alike in by_level.chunks(level.len().div_ceil(LEVELS).max(1)) {
        let mut sizes: Vec<f64> = alike.iter().map(|&i| whitened[i].abs()).collect();
        let scale = (MAD * median(&mut sizes).unwrap_or(0.0)).max(1.0);
        alike.iter().for_each(|&i| scales[i] = scale);
    }
    scales
}

/// Of every window of one length that has a score, the p-value by itself, among those of a like
/// level in so many parts at most.
fn p_values(
    windows: &[Range<usize>],
    score: impl Fn(&Range<usize>) -> Option<f64>,
    level: &[f64],
    most_parts: usize,
) -> Vec<(f64, Range<usize>)> {
    let level_of = |window: &Range<usize>| level[window.clone()].iter().sum::<f64>();
    let told = windows
        .iter()
        .filter_map(|window| Some((level_of(window), score(window)?, window)));
    let mut told: Vec<(f64, f64, &Range<usize>)> = told.collect();
    told.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.start.cmp(&b.2.start)));
    let count = told.len();
    let parts = (count / LEAST_ALIKE).min(most_parts);
    let mut scored = Vec::with_capacity(count);
    for part in 0..parts {
        let alike = &told[part * count / parts..(part + 1) * count / parts];
        let mut scores: Vec<f64> = alike.iter().map(|(_, score, _)| *score).collect();
        let middle = median(&mut scores).unwrap_or(0.0);
        let spread = spread(&scores).unwrap_or(0.0).max(1.0);
        let freedom = EFFICIENCY * alike.len() as f64;
        let p = |score: f64| student_two_sided((score - middle) / spread, freedom);
        scored.extend(
            alike
                .iter()
                .map(|&(_, score, window)| (p(score), window.clone())),
        );
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

    /// A pass of eight readings in twenty.
    fn passes() -> (Blocks, Vec<f64>) {
        let (blocks, _) = blocks(3000);
        let rise = |i: usize| (1.0 - ((i % 20) as f64 - 8.0).abs() / 4.0).max(0.0);
        (blocks, (0..3000).map(rise).collect())
    }

    #[test]
    fn half_a_minute_of_a_loose_contact_stands_out_and_is_found() {
        let (blocks, level) = blocks(2700);
        let mut random = Draws::new(3);
        let loose = |i: usize| if (400..430).contains(&i) { -3.0 } else { 0.0 };
        let whitened: Vec<f64> = (0..2700).map(|i| random.normal() + loose(i)).collect();
        let found = bursts(&whitened, [&level, &level], &blocks, 0.05);
        assert!(found.p < 1e-3, "{}", found.p);
        let told: usize = found.windows.iter().map(|window| window.len()).sum();
        assert!(told > 15 && found.windows.iter().all(|w| w.start > 380 && w.end < 450));
    }

    #[test]
    fn a_loose_contact_shows_in_passes_that_rise_above_nothing() {
        let (blocks, level) = passes();
        let mut random = Draws::new(5);
        // Gusts of a quarter of the flow, of which a fifth is read for a while.
        let read = |i: usize, random: &mut Draws| {
            let lost = if (1200..1440).contains(&i) { -0.8 } else { 0.0 };
            10.0 * level[i] * (lost + 0.25 * random.normal()) + random.normal()
        };
        let whitened: Vec<f64> = (0..level.len()).map(|i| read(i, &mut random)).collect();
        let found = bursts(&whitened, [&level, &level], &blocks, 0.05);
        assert!(found.p < 1e-3, "{}", found.p);
        let told = found.windows.iter();
        assert!(told.clone().any(|window| window.len() >= 32));
        assert!(told.clone().all(|w| w.start >= 1072 && w.end <= 1568));
    }

    #[test]
    fn gusts_in_passes_stand_out_as_often_as_their_p_value_says() {
        let (blocks, level) = passes();
        let alarms = (0..400).filter(|&seed| {
            let mut random = Draws::new(seed);
            let gust = |level: &f64| (3.0 * level).mul_add(random.normal(), random.normal());
            let whitened: Vec<f64> = level.iter().map(gust).collect();
            bursts(&whitened, [&level, &level], &blocks, 0.05).p <= 0.01
        });
        // 1 % of 400, and three standard deviations.
        assert!(alarms.count() <= 10);
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
                bursts(&whitened, [&level, &level], &blocks, 0.05).p <= 0.01
            });
            // 1 % of 400, and three standard deviations.
            assert!(alarms.count() <= 10, "{size} {tails}");
        }
    }
}
