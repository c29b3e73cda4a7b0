//! The global lack-of-fit test: does a whitened residual hold more than noise? Three statistics,
//! each blind where another sees.
//!
//! With `e` the residual (bounded: `1.135 e/√(1 + (e/3)²)`, of variance 1 again) and `g` a column
//! (the tangent of a law, a step, a bin), both orthogonal to the nuisances, `|g| = 1`, and `S_b =
//! Σ_{i in b} gᵢ eᵢ` its score in block b:
//!
//! 1. *Spread*: `z = Σ_b S_b/√(Σ_b S_b²)`, which needs no noise model. The p-value of the largest
//!    |z| over all columns comes from flipping the signs of whole blocks (Westfall & Young 1993
//!    max-T with Rademacher signs, Wu 1986; Cameron, Gelbach & Miller 2008). Laws and bins each
//!    have their own largest |z|, and the smaller p-value is referred to the same flips: a hundred
//!    bins do not raise the bar for twenty laws.
//! 2. *Rare*: |z| above cannot exceed the root of the number of blocks that a column touches, so
//!    what shows in two blocks is lost. `z = Σ_b S_b/√φ`, where `φ` is how much blocks vary beyond
//!    independent noise (Huber's variance of block scores; its 95 % quantile over columns, after
//!    the strongest columns are taken off, and at least 1), against the normal law, times the
//!    number of columns (Bonferroni).
//! 3. *Rhythm*: the strongest [`spectrum`] line of what the samples weigh.
//!
//! Errors that outlast a block (a dwell's own) would make neighbours flip together: while the
//! scores of neighbouring blocks are correlated, blocks are joined in pairs; what correlation r is
//! left widens both scores by `√(1 + 2r)`.

use nalgebra::{DMatrix, DVector};

use super::column::Column;
use super::draws::Draws;
use super::quantile::nearest_rank;
use super::robust::{HuberScale, weight};
use super::sequence::{Blocks, correlation};
use super::spectrum::{self, Line};
use super::tail;

/// Accepted p-value, all three statistics together. Set on 3120 recordings without an effect (the
/// bench `false_alarms`, seeds 0 to 239 of thirteen kinds of noise): 0.45 % of them pass, at
/// most 2.5 % of a kind, since errors that outlast a block cost more than the p-values say.
pub const ACCEPTED: f64 = 0.004;
/// Shares of it: spread, rare, rhythm. Chosen here: most effects are spread, and its p-value is
/// exact.
const SHARES: [f64; 3] = [0.5, 0.25, 0.25];
/// Sign flips: p-values of the spread are multiples of 1/4000, an eighth of what it accepts.
const FLIPS: usize = 3999;
/// Seed of the signs.
const SEED: u64 = 1;
/// What makes the variance of bounded normal values 1 again: `E[z²/(1 + z²/9)]^(-1/2)`.
const BOUNDED_TO_ONE: f64 = 1.135_146;
/// Quantile over columns of the variance between blocks that the statistic for rare effects takes.
/// Chosen here: a wild column in twenty is signal.
const PHI_QUANTILE: f64 = 0.95;
/// A column that keeps less than this share of its length beside the nuisances is one of them.
const LEAST_KEPT: f64 = 1e-3;
/// Correlation of neighbouring blocks above which they are joined, and the blocks that must remain.
/// Chosen here; the bench `false_alarms` measures what they allow.
const MOST_CORRELATED: f64 = 0.05;
const LEAST_BLOCKS: usize = 16;
/// Columns that are taken off before noise is read, at most, and the score over independent noise
/// that each but the first needs. Chosen here: 5 standard deviations are no accident among
/// hundreds.
const MOST_TAKEN: usize = 4;
const LEAST_TAKEN: f64 = 5.0;
/// Quantile of the normal law, to three digits: 80 % power.
const POWER: f64 = 0.84;

/// What is tested.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a> {
    /// Residual, whitened.
    pub residual: &'a [f64],
    /// Columns, whitened.
    pub columns: &'a [Column],
    /// Columns that are no news (gain and offset of the instrument), whitened, samples by rows.
    /// Leave out one that the fit holds at its bound: it can take no more.
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
    /// Of each of them, how strongly it would show a pulsation: 1 or the flow, over the noise.
    pub weight: Vec<f64>,
    /// Whether periods longer than a block are looked for, or such up to one.
    pub is_slow: bool,
}

/// Which statistic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Statistic {
    /// Largest score over its own spread between blocks.
    Spread,
    /// Largest score over the noise.
    Rare,
    /// Strongest spectral line.
    Rhythm,
}

/// The answer.
#[derive(Clone, Debug, PartialEq)]
pub struct LackOfFit {
    /// p-value of as much in noise alone: the smallest of the three over their shares, at most 1.
    pub p: f64,
    /// Whether that is at most what is accepted.
    pub is_significant: bool,
    /// Which statistic says so, or comes closest.
    pub statistic: Statistic,
    /// p-values of the three, each by itself: spread, rare, rhythm.
    pub p_values: [f64; 3],
    /// The strongest spectral line of all rhythms; its p-value counts them.
    pub line: Option<Line>,
}

/// Tests a residual.
#[must_use]
pub fn lack_of_fit(evidence: &Evidence<'_>) -> LackOfFit {
    let line = strongest_line(evidence.rhythms, evidence.residual);
    let [spread, rare] = scores_p_values(evidence);
    let p_values = [spread, rare, line.map_or(1.0, |line| line.p)];
    let over_shares = p_values.iter().zip(SHARES).map(|(p, share)| p / share);
    let kinds = [Statistic::Spread, Statistic::Rare, Statistic::Rhythm];
    let least = over_shares.zip(kinds).min_by(|a, b| a.0.total_cmp(&b.0));
    let (p, statistic) = least.expect("there are three statistics");
    LackOfFit {
        p: p.min(1.0),
        is_significant: p <= ACCEPTED,
        statistic,
        p_values,
        line,
    }
}

/// The least departure of a parameter that the test would notice four times in five, from the
/// whitened change of the prediction per unit of it; in that unit. `None` where nothing changes.
///
/// ```text
/// min over |a_k| <= b_k of |δ g - Σ a_k n_k| = z + 0.84
/// ```
///
/// `n_k`: what gains and offsets change, whitened, which may take `b_k`, those of one instrument
/// together and apart from all others'; `z`: the normal quantile of what the spread of laws
/// accepts, by Bonferroni over so many `laws`.
#[must_use]
pub fn minimum_detectable(
    whitened_tangent: &[f64],
    tolerated: &[[(Vec<f64>, f64); 2]],
    laws: usize,
) -> Option<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let g = whitened_tangent;
    let length = dot(g, g).sqrt();
    if length <= 0.0 {
        return None;
    }
    // Laws and bins share what the spread accepts.
    let level = 0.5 * ACCEPTED * SHARES[0] / laws.max(1) as f64;
    let noticed = tail::normal_two_sided_quantile(level) + POWER;
    // What changes nothing takes nothing.
    let over = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
    // By how much less an instrument's gain and offset make the square.
    let takes = |[(n0, b0), (n1, b1)]: &[(Vec<f64>, f64); 2]| {
        let [along0, along1, cross] = [dot(g, n0), dot(g, n1), dot(n0, n1)];
        let [square0, square1] = [dot(n0, n0), dot(n1, n1)];
        let (b0, b1) = (*b0, *b1);
        move |departure: f64| {
            let change = |a0: f64, a1: f64| {
                a0 * (a0 * square0 - 2.0 * departure * along0)
                    + a1 * (a1 * square1 - 2.0 * departure * along1)
                    + 2.0 * a0 * a1 * cross
            };
            // The best of one beside the other, within its bounds.
            let best0 = |a1: f64| over(departure * along0 - a1 * cross, square0).clamp(-b0, b0);
            let best1 = |a0: f64| over(departure * along1 - a0 * cross, square1).clamp(-b1, b1);
            let within = square0 * square1 - cross * cross;
            let a0 = over(departure * (along0 * square1 - along1 * cross), within).clamp(-b0, b0);
            let ends = [(a0, best1(a0)), (-b0, best1(-b0)), (b0, best1(b0))];
            let ends = ends.into_iter().chain([-b1, b1].map(|a1| (best0(a1), a1)));
            let changes = ends.map(|(a0, a1)| change(a0, a1));
            changes.fold(0.0, f64::min)
        }
    };
    let each: Vec<_> = tolerated.iter().map(takes).collect();
    let left = |departure: f64| {
        let taken: f64 = each.iter().map(|takes| takes(departure)).sum();
        (departure * departure * length * length + taken)
            .max(0.0)
            .sqrt()
    };
    // It rises with the departure: halved until it is known to all digits.
    let both = tolerated.as_flattened().iter();
    let taken: f64 = both.map(|(n, b)| b * dot(n, n).sqrt()).sum();
    let [mut low, mut high] = [0.0, (noticed + taken) / length];
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match left(middle) < noticed {
            true => low = middle,
            false => high = middle,
        }
    }
    Some(high)
}

/// A whitened residual of which no single one decides; of variance 1 in noise.
#[must_use]
pub fn bounded(e: f64) -> f64 {
    BOUNDED_TO_ONE * e * weight(e)
}

/// p-values of spread and rare.
fn scores_p_values(evidence: &Evidence<'_>) -> [f64; 2] {
    let basis = orthonormal(evidence.nuisances);
    let residual = evidence.residual.iter().map(|e| bounded(*e));
    let mut residual = DVector::from_iterator(evidence.residual.len(), residual);
    project(&basis, &mut residual);
    let tested = Tested::new(evidence, &basis);
    if tested.unit.is_empty() {
        return [1.0, 1.0];
    }
    let (noise, taken) = tested.without_strongest(&residual);
    let blocks = evidence.blocks;
    let joined = Joined {
        scores: tested.block_sums(blocks, |g, i| g * residual[i]),
        without: tested.block_sums(blocks, |g, i| g * noise[i]),
        squares: tested.block_sums(blocks, |g, _| g * g),
        widening: 1.0,
    }
    .until_independent(&blocks.follows);
    // Columns that were taken off took some of the noise along.
    let freedom = (1.0 - 2.0 * taken as f64 / joined.scores.nrows() as f64).max(0.5);
    let phi = joined.widening * variance_beyond_noise(&joined) / freedom;
    let z = joined.scores.column_iter().map(|s| s.sum() / phi.sqrt());
    let most_rare = z.fold(0.0f64, |most, z| most.max(z.abs()));
    let rare = tail::normal_two_sided(most_rare) * tested.unit.len() as f64;
    [spread(&tested, &joined), rare.min(1.0)]
}

fn spread(tested: &Tested, joined: &Joined) -> f64 {
    let mut scaled = joined.scores.clone();
    for mut column in scaled.column_iter_mut() {
        column.try_normalize_mut(0.0);
    }
    let widening = joined.widening.sqrt();
    let z = scaled.column_iter().map(|column| column.sum() / widening);
    let z: Vec<f64> = z.collect();
    let mut random = Draws::new(SEED);
    let signs = DMatrix::from_fn(FLIPS, scaled.nrows(), |_, _| random.sign());
    let flipped = signs * &scaled;
    let largest = |wanted: bool, of: &dyn Fn(usize) -> f64| {
        let members = (0..z.len()).filter(|&k| tested.is_law[k] == wanted);
        members.fold(0.0f64, |most, k| most.max(of(k).abs()))
    };
    // Row 0 is what was seen, the others are flips; each row's p-value is its rank among all.
    // Without members all are 0, and every rank is 1.
    let p_values = [true, false].map(|family| {
        let mut most = vec![largest(family, &|k| z[k])];
        most.extend((0..FLIPS).map(|f| largest(family, &|k| flipped[(f, k)])));
        upper_ranks(&most)
    });
    let [laws, bins] = &p_values;
    let smallest: Vec<f64> = laws.iter().zip(bins).map(|(a, b)| a.min(*b)).collect();
    let as_small = smallest.iter().filter(|p| **p <= smallest[0]).count();
    as_small as f64 / smallest.len() as f64
}

/// Of every value, the share of values at least as large.
fn upper_ranks(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let below = |value: &f64| sorted.partition_point(|other| other < value);
    let rank = |value: &f64| (sorted.len() - below(value)) as f64 / sorted.len() as f64;
    values.iter().map(rank).collect()
}

/// φ: how much more block scores vary than independent noise of variance 1 would. Of every column
/// Huber's variance of `S_b/√h_b`, weighted by `h_b` (the column's square in block b, 1 in all), so
/// that the few blocks of a rare effect do not hide it.
fn variance_beyond_noise(joined: &Joined) -> f64 {
    let scores = joined.without.column_iter();
    let mut variances: Vec<f64> = scores
        .zip(joined.squares.column_iter())
        .map(|(score, square)| {
            let blocks = (0..score.len()).filter(|&b| square[b] > 0.0);
            HuberScale::OF_BLOCKS.variance(blocks.map(|b| (score[b] * score[b], square[b])))
        })
        .collect();
    variances.sort_by(f64::total_cmp);
    nearest_rank(&variances, PHI_QUANTILE).map_or(1.0, |phi| phi.max(1.0))
}

/// The strongest line of all rhythms in a whitened residual; its p-value counts them.
#[must_use]
pub fn strongest_line(rhythms: &[Rhythm], residual: &[f64]) -> Option<Line> {
    let of_rhythm = |rhythm: &Rhythm| {
        let weighed = rhythm.samples.iter().zip(&rhythm.weight);
        let values: Vec<f64> = weighed.map(|(&i, w)| w * bounded(residual[i])).collect();
        match rhythm.is_slow {
            true => spectrum::slow_line(&rhythm.clock_s, &values),
            false => spectrum::strongest_line(&rhythm.clock_s, &values),
        }
    };
    let lines = rhythms.iter().filter_map(of_rhythm);
    let line = lines.min_by(|a, b| a.p.total_cmp(&b.p))?;
    let p = (line.p * rhythms.len() as f64).min(1.0);
    Some(Line { p, ..line })
}

/// Orthonormal columns that span the same space (modified Gram-Schmidt, twice); dependent ones are
/// dropped.
fn orthonormal(columns: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for column in columns.column_iter() {
        let mut rest = column.into_owned();
        project(&basis, &mut rest);
        project(&basis, &mut rest);
        let after = rest.norm();
        if after > 1e-9 * column.norm() && after > 0.0 {
            basis.push(rest / after);
        }
    }
    basis
}

/// Takes off what lies along each of some orthonormal directions.
fn project(basis: &[DVector<f64>], values: &mut DVector<f64>) {
    for direction in basis {
        values.axpy(-direction.dot(values), direction, 1.0);
    }
}

/// The columns identifiable beside the nuisances, orthogonal to these and of length 1.
struct Tested {
    is_law: Vec<bool>,
    unit: Vec<DVector<f64>>,
}

impl Tested {
    fn new(evidence: &Evidence<'_>, basis: &[DVector<f64>]) -> Self {
        let (mut is_law, mut unit) = (Vec::new(), Vec::new());
        for column in evidence.columns {
            let mut values = DVector::from_column_slice(&column.values);
            let before = values.norm();
            project(basis, &mut values);
            let length = values.norm();
            if length.is_finite() && length > 0.0 && length > LEAST_KEPT * before {
                is_law.push(column.is_law);
                unit.push(values / length);
            }
        }
        Self { is_law, unit }
    }

    /// Of every block (row) and column, the sum of something over the block's samples.
    fn block_sums(&self, blocks: &Blocks, of: impl Fn(f64, usize) -> f64) -> DMatrix<f64> {
        let mut sums = DMatrix::zeros(blocks.count(), self.unit.len());
        for (unit, mut sums) in self.unit.iter().zip(sums.column_iter_mut()) {
            let products = unit.iter().enumerate().map(|(i, g)| of(*g, i));
            sums.copy_from_slice(&blocks.sums(products));
        }
        sums
    }

    /// The residual without what the strongest columns explain, one after the other while one
    /// exceeds what independent noise would show: that is signal, or noise that outlasts blocks,
    /// and would pass for a spread between blocks. And how many.
    fn without_strongest(&self, residual: &DVector<f64>) -> (DVector<f64>, usize) {
        let mut left = residual.clone();
        for taken in 0..MOST_TAKEN {
            let scored = self.unit.iter().map(|unit| (unit.dot(&left).abs(), unit));
            // The first of equals.
            match scored.reduce(|best, other| if other.0 > best.0 { other } else { best }) {
                Some((z, unit)) if taken == 0 || z > LEAST_TAKEN => {
                    project(std::slice::from_ref(unit), &mut left);
                }
                _ => return (left, taken),
            }
        }
        (left, MOST_TAKEN)
    }
}

/// Scores by blocks (rows), which may be several of the sequence's joined.
struct Joined {
    scores: DMatrix<f64>,
    /// The same without the strongest columns.
    without: DMatrix<f64>,
    /// Squares of the columns, instead of products with the residual.
    squares: DMatrix<f64>,
    /// Variance of a sum of blocks over the sum of their variances, 1 + 2r; at least 1.
    widening: f64,
}

impl Joined {
    /// Joins neighbours while their scores, less what the strongest columns explain, are
    /// correlated.
    fn until_independent(mut self, follows: &[bool]) -> Joined {
        let mut follows = follows.to_vec();
        loop {
            let (into, next) = Blocks::pairs(&follows);
            let correlation = neighbours_correlation(&self.without, &follows);
            let nothing_to_join = next.len() == follows.len();
            if nothing_to_join || next.len() < LEAST_BLOCKS || correlation <= MOST_CORRELATED {
                self.widening = 1.0 + 2.0 * correlation.max(0.0);
                return self;
            }
            for sums in [&mut self.scores, &mut self.without, &mut self.squares] {
                let mut joined = DMatrix::zeros(next.len(), sums.ncols());
                for (row, &to) in sums.row_iter().zip(&into) {
                    let mut joined = joined.row_mut(to);
                    joined += row;
                }
                *sums = joined;
            }
            follows = next;
        }
    }
}

fn neighbours_correlation(scores: &DMatrix<f64>, follows: &[bool]) -> f64 {
    let pairs = scores.column_iter().flat_map(|column| {
        let later = (1..follows.len()).filter(|&b| follows[b]);
        later.map(move |b| (column[b - 1], column[b]))
    });
    correlation(pairs).unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
