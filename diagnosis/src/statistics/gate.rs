//! Is anything there? Three tests of a whitened residual against noise, each blind where another sees.
//!
//! With `e` the residual (bounded: `1.135 e/√(1 + (e/3)²)`, of variance 1 again) and `g` a column (the tangent of a law, a step, a bin), both orthogonal to
//! the nuisances, `|g| = 1`, and `S_b = Σ_{i in b} gᵢ eᵢ` its score in block b:
//!
//! 1. *Spread*: `z = Σ_b S_b/√(Σ_b S_b²)`, which needs no noise model. The chance of the largest |z| over all columns comes from
//!    flipping the signs of whole blocks (Westfall & Young 1993 max-T with Rademacher signs, Wu 1986; Cameron, Gelbach & Miller
//!    2008). Laws and shapes each have their own largest |z|, and the smaller chance is referred to the same flips: a hundred bins do
//!    not raise the bar for twenty laws.
//! 2. *Rare*: |z| above cannot exceed the root of the number of blocks that a column touches, so what shows in two blocks is lost.
//!    `z = Σ_b S_b/√φ`, where `φ` is how much blocks vary beyond independent noise (Huber's variance of block scores; its 95 %
//!    quantile over columns, after the strongest columns are taken off, and at least 1), against the normal law, times the number of columns.
//! 3. *Rhythm*: the strongest [`spectrum`] line of what the samples weigh.
//!
//! Errors that outlast a block (a dwell's own) would make neighbours flip together: while the scores of neighbouring blocks are
//! correlated, blocks are joined in pairs; what correlation r is left widens both scores by `√(1 + 2r)`.

mod scores;

use nalgebra::DMatrix;
use scores::{Joined, Told, join, orthonormal, project};

use super::column::Column;
use super::draws::Draws;
use super::sequence::Blocks;
use super::spectrum::{self, Line};
use super::tail;

/// What is tested.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a> {
    /// Residual, whitened.
    pub residual: &'a [f64],
    /// Columns, whitened.
    pub columns: &'a [Column],
    /// Columns that are no news (gain and offset of the instrument), whitened, samples by rows. Leave away one that the fit holds at its
    /// bound: it can take no more.
    pub nuisances: &'a DMatrix<f64>,
    /// Blocks of samples.
    pub blocks: &'a Blocks,
    /// Where a pulsation is looked for.
    pub rhythms: &'a [Rhythm],
}

/// Samples of one series, on a clock.
#[derive(Clone, Debug)]
pub struct Rhythm {
    /// Which samples.
    pub samples: Vec<usize>,
    /// Of each of them, the time (s): as read, or of release at the rotors.
    pub clock_s: Vec<f64>,
    /// Of each of them, how strongly it would show a pulsation; 1 for all, or the flow over the noise.
    pub weight: Vec<f64>,
}

/// Numbers of the test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Flips.
    pub flips: usize,
    /// Seed of the signs.
    pub seed: u64,
    /// Chance of a false alarm that is accepted, all three tests together.
    pub accepted: f64,
}

impl Default for Options {
    /// 1999 flips; 0.4 %, since errors that outlast a block cost more than the chances say.
    fn default() -> Self {
        Self {
            flips: 1999,
            seed: 1,
            accepted: 0.004,
        }
    }
}

/// Shares of the accepted chance: spread, rare, rhythm. Chosen here: most effects are spread, and its chance is exact.
const SHARES: [f64; 3] = [0.5, 0.25, 0.25];
/// Where the residual is bounded, in standard deviations (pseudo-Huber), and what makes the variance of bounded normal values 1
/// again: `E[z²/(1 + z²/9)]^(-1/2)`. Costs 0.4 % of a signal.
const BOUND: f64 = 3.0;
const BOUNDED_TO_ONE: f64 = 1.135_146;
/// Quantile of the columns' variances that the second test takes.
const PHI_QUANTILE: f64 = 0.95;
/// Huber's bound for these variances, in standard deviations, the mean of `min(z², k²)` for normal z, and rounds to settle.
const HUBER_K: f64 = 2.0;
const HUBER_MEAN: f64 = 0.920_51;
const ROUNDS: usize = 30;

/// Which test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Statistic {
    /// Largest score over its own spread between blocks.
    Spread,
    /// Largest score over the noise.
    Rare,
    /// Strongest spectral line.
    Rhythm,
}

/// A column's score.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// The column, by its place in the list.
    pub column: usize,
    /// Its name.
    pub name: String,
    /// Score over its spread between blocks; signed.
    pub z_spread: f64,
    /// Score over the noise; signed.
    pub z_rare: f64,
}

/// The least value of a law's parameter that would have been noticed.
#[derive(Clone, Debug, PartialEq)]
pub struct Detectable {
    /// The column, by its place in the list.
    pub column: usize,
    /// Its name.
    pub name: String,
    /// `(1.96 + 0.84)` standard errors, in the parameter's unit: noticed four times in five.
    pub least: f64,
}

/// The answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Gate {
    /// Chance of as much where there is only noise: the smallest of the three over their shares, at most 1.
    pub p: f64,
    /// Whether that is below what is accepted.
    pub passed: bool,
    /// Which test says so, or comes closest.
    pub statistic: Statistic,
    /// Chances of the three, each by itself: spread, rare, rhythm.
    pub chances: [f64; 3],
    /// All columns that could be told from the nuisances, strongest first.
    pub scores: Vec<Score>,
    /// The strongest spectral line, of the rhythm at that place in the list.
    pub line: Option<(usize, Line)>,
    /// Of every tangent that could be told from the nuisances.
    pub detectable: Vec<Detectable>,
    /// Blocks after joining.
    pub blocks: usize,
}

/// Tests a residual.
#[must_use]
pub fn gate(evidence: &Evidence<'_>, options: Options) -> Gate {
    let basis = orthonormal(evidence.nuisances);
    let mut residual: Vec<f64> = evidence.residual.iter().map(|e| bounded(*e)).collect();
    project(&basis, &mut residual);
    let told = Told::new(evidence, &basis);
    let line = strongest_line(evidence.rhythms, evidence.residual);
    let rhythm_p = line.as_ref().map_or(1.0, |(_, line)| line.p);
    if told.columns.is_empty() {
        return answer(
            [1.0, 1.0, rhythm_p],
            options,
            Vec::new(),
            line,
            Vec::new(),
            evidence.blocks.count(),
        );
    }
    let (noise, taken) = told.without_strongest(&residual);
    let joined = join(
        told.scores(evidence.blocks, &residual),
        told.scores(evidence.blocks, &noise),
        told.squares(evidence.blocks),
        evidence.blocks,
    );
    // Columns that were taken off took some of the noise along.
    let blocks = joined.scores.nrows() as f64;
    let freedom = (1.0 - 2.0 * taken as f64 / blocks).max(0.5);
    let spread = spread(&told, &joined, options);
    let phi = joined.widening * variance_beyond_noise(&joined.without, &joined.squares) / freedom;
    let total: Vec<f64> = joined.scores.column_iter().map(|s| s.sum()).collect();
    let z_rare: Vec<f64> = total.iter().map(|sum| sum / phi.sqrt()).collect();
    let most_rare = z_rare.iter().fold(0.0f64, |most, z| most.max(z.abs()));
    let rare_p = (tail::normal_two_sided(most_rare) * z_rare.len() as f64).min(1.0);
    let mut named: Vec<Score> = told
        .columns
        .iter()
        .enumerate()
        .map(|(k, &column)| Score {
            column,
            name: evidence.columns[column].name.clone(),
            z_spread: spread.z[k],
            z_rare: z_rare[k],
        })
        .collect();
    let size = |score: &Score| score.z_spread.abs().max(score.z_rare.abs());
    named.sort_by(|a, b| size(b).total_cmp(&size(a)).then(a.column.cmp(&b.column)));
    answer(
        [spread.p, rare_p, rhythm_p],
        options,
        named,
        line,
        told.detectable(evidence.columns, &joined, &total),
        joined.scores.nrows(),
    )
}

fn answer(
    chances: [f64; 3],
    options: Options,
    scores: Vec<Score>,
    line: Option<(usize, Line)>,
    detectable: Vec<Detectable>,
    blocks: usize,
) -> Gate {
    const STATISTICS: [Statistic; 3] = [Statistic::Spread, Statistic::Rare, Statistic::Rhythm];
    let mut p = f64::INFINITY;
    let mut statistic = Statistic::Spread;
    for (which, (chance, share)) in STATISTICS.iter().zip(chances.iter().zip(SHARES)) {
        if chance / share < p {
            (p, statistic) = (chance / share, *which);
        }
    }
    Gate {
        p: p.min(1.0),
        passed: p <= options.accepted,
        statistic,
        chances,
        scores,
        line,
        detectable,
        blocks,
    }
}

fn bounded(e: f64) -> f64 {
    BOUNDED_TO_ONE * e / (1.0 + (e / BOUND) * (e / BOUND)).sqrt()
}

struct Spread {
    z: Vec<f64>,
    p: f64,
}

/// The first test.
fn spread(told: &Told, joined: &Joined, options: Options) -> Spread {
    let mut scaled = joined.scores.clone();
    for mut column in scaled.column_iter_mut() {
        let length = column.norm();
        if length > 0.0 {
            column /= length;
        }
    }
    let widening = joined.widening.sqrt();
    let z: Vec<f64> = scaled
        .column_iter()
        .map(|column| column.sum() / widening)
        .collect();
    let mut draws = Draws::new(options.seed);
    let signs = DMatrix::from_fn(options.flips, scaled.nrows(), |_, _| draws.sign());
    let flipped = signs * &scaled;
    let largest = |wanted: bool, of: &dyn Fn(usize) -> f64| {
        let members = (0..z.len()).filter(|&k| told.is_law[k] == wanted);
        members.fold(0.0f64, |most, k| most.max(of(k).abs()))
    };
    // Row 0 is what was seen, the others are flips; each row's chance is its rank among all.
    let chances: Vec<Vec<f64>> = [true, false]
        .into_iter()
        .filter(|&family| told.is_law.contains(&family))
        .map(|family| {
            let mut most = vec![largest(family, &|k| z[k])];
            most.extend((0..options.flips).map(|f| largest(family, &|k| flipped[(f, k)])));
            upper_ranks(&most)
        })
        .collect();
    let smallest: Vec<f64> = (0..=options.flips)
        .map(|row| chances.iter().fold(1.0f64, |least, of| least.min(of[row])))
        .collect();
    let as_small = smallest.iter().filter(|p| **p <= smallest[0]).count();
    Spread {
        z,
        p: as_small as f64 / smallest.len() as f64,
    }
}

/// Of every value, the share of values at least as large.
fn upper_ranks(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at_least = |value: &f64| sorted.len() - sorted.partition_point(|other| other < value);
    values
        .iter()
        .map(|value| at_least(value) as f64 / sorted.len() as f64)
        .collect()
}

/// φ: how much more block scores vary than independent noise of variance 1 would. Of every column Huber's variance of `S_b/√h_b`,
/// weighted by `h_b` (the column's square in block b, 1 in all), so that the few blocks of a rare effect do not hide it.
fn variance_beyond_noise(scores: &DMatrix<f64>, squares: &DMatrix<f64>) -> f64 {
    let columns = scores.column_iter().zip(squares.column_iter());
    let mut variances: Vec<f64> = columns
        .map(|(score, square)| {
            let blocks = || score.iter().zip(square.iter()).filter(|(_, h)| **h > 0.0);
            let mut variance = score.norm_squared();
            for _ in 0..ROUNDS {
                let most = HUBER_K * HUBER_K * variance;
                let bounded = blocks().map(|(s, h)| (s * s).min(most * h)).sum::<f64>();
                variance = bounded / HUBER_MEAN;
            }
            variance
        })
        .collect();
    variances.sort_by(f64::total_cmp);
    let at = (PHI_QUANTILE * (variances.len() - 1) as f64).round() as usize;
    variances[at].max(1.0)
}

fn strongest_line(rhythms: &[Rhythm], residual: &[f64]) -> Option<(usize, Line)> {
    let mut strongest: Option<(usize, Line)> = None;
    for (index, rhythm) in rhythms.iter().enumerate() {
        let weighed = rhythm.samples.iter().zip(&rhythm.weight);
        let values: Vec<f64> = weighed.map(|(&i, w)| w * bounded(residual[i])).collect();
        if let Some(line) = spectrum::strongest_line(&rhythm.clock_s, &values)
            && strongest.is_none_or(|(_, other)| line.p < other.p)
        {
            strongest = Some((index, line));
        }
    }
    strongest.map(|(index, line)| {
        let p = (line.p * rhythms.len() as f64).min(1.0);
        (index, Line { p, ..line })
    })
}

#[cfg(test)]
mod tests;
