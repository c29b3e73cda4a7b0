//! Columns beside the nuisances, their scores by blocks, and blocks joined until neighbours are independent.

use nalgebra::DMatrix;

use super::{Detectable, Evidence};
use crate::statistics::column::{Column, Kind};
use crate::statistics::sequence::Blocks;

/// A column that keeps less than this share of its length beside the nuisances is one of them.
const LEAST_KEPT: f64 = 1e-3;
/// Correlation of neighbouring blocks above which they are joined, and the blocks that must remain. Chosen here; the benchmark
/// `false_alarms` measures what they allow.
const MOST_CORRELATED: f64 = 0.05;
const LEAST_BLOCKS: usize = 16;
/// Columns that are taken off before noise is read, at most, and the score over independent noise that each but the first needs.
const MOST_TAKEN: usize = 4;
const LEAST_TAKEN: f64 = 5.0;
/// Quantiles of the normal law: 5 % two-sided chance of a false alarm, 80 % of a detection.
const NOTICED: f64 = 1.959_964 + 0.841_621;

/// Orthonormal columns that span the same space (modified Gram-Schmidt, twice); dependent ones are dropped.
pub(super) fn orthonormal(columns: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for column in columns.column_iter() {
        let mut column: Vec<f64> = column.iter().copied().collect();
        let before = norm(&column);
        project(&basis, &mut column);
        project(&basis, &mut column);
        let after = norm(&column);
        if after > 1e-9 * before && after > 0.0 {
            column.iter_mut().for_each(|value| *value /= after);
            basis.push(column);
        }
    }
    basis
}

pub(super) fn project(basis: &[Vec<f64>], values: &mut [f64]) {
    for direction in basis {
        let along = dot(direction, values);
        for (value, d) in values.iter_mut().zip(direction) {
            *value -= along * d;
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn norm(values: &[f64]) -> f64 {
    dot(values, values).sqrt()
}

/// The columns that can be told from the nuisances, orthogonal to these and of length 1.
pub(super) struct Told {
    /// Places in the list of columns.
    pub(super) columns: Vec<usize>,
    /// Whether each is a law rather than a shape.
    pub(super) is_law: Vec<bool>,
    /// Lengths before they were set to 1.
    length: Vec<f64>,
    unit: Vec<Vec<f64>>,
}

impl Told {
    pub(super) fn new(evidence: &Evidence<'_>, basis: &[Vec<f64>]) -> Self {
        let mut told = Self {
            columns: Vec::new(),
            is_law: Vec::new(),
            length: Vec::new(),
            unit: Vec::new(),
        };
        for (index, column) in evidence.columns.iter().enumerate() {
            let mut values = column.values.clone();
            let before = norm(&values);
            project(basis, &mut values);
            let length = norm(&values);
            if !(length.is_finite() && length > 0.0 && length > LEAST_KEPT * before) {
                continue;
            }
            values.iter_mut().for_each(|value| *value /= length);
            told.columns.push(index);
            told.is_law.push(!matches!(column.kind, Kind::Bin { .. }));
            told.length.push(length);
            told.unit.push(values);
        }
        told
    }

    /// Block sums of every column's score: blocks by rows.
    pub(super) fn scores(&self, blocks: &Blocks, residual: &[f64]) -> DMatrix<f64> {
        self.block_sums(blocks, |unit, i| unit[i] * residual[i])
    }

    /// Block sums of every column's square.
    pub(super) fn squares(&self, blocks: &Blocks) -> DMatrix<f64> {
        self.block_sums(blocks, |unit, i| unit[i] * unit[i])
    }

    fn block_sums(&self, blocks: &Blocks, of: impl Fn(&[f64], usize) -> f64) -> DMatrix<f64> {
        let mut sums = DMatrix::zeros(blocks.count(), self.unit.len());
        for (k, unit) in self.unit.iter().enumerate() {
            let products = (0..unit.len()).map(|i| of(unit, i));
            for (b, sum) in blocks.sums(products).into_iter().enumerate() {
                sums[(b, k)] = sum;
            }
        }
        sums
    }

    /// The residual without what the strongest columns explain, one after the other while one exceeds what independent noise
    /// would show: that is signal, or noise that outlasts blocks, and would pass for a spread between blocks. And how many.
    pub(super) fn without_strongest(&self, residual: &[f64]) -> (Vec<f64>, usize) {
        let mut left = residual.to_vec();
        for taken in 0..MOST_TAKEN {
            let mut strongest: Option<(f64, &Vec<f64>)> = None;
            for unit in &self.unit {
                let z = dot(unit, &left).abs();
                if strongest.is_none_or(|(most, _)| z > most) {
                    strongest = Some((z, unit));
                }
            }
            match strongest {
                Some((z, unit)) if taken == 0 || z > LEAST_TAKEN => {
                    project(std::slice::from_ref(unit), &mut left);
                }
                _ => return (left, taken),
            }
        }
        (left, MOST_TAKEN)
    }

    /// From each tangent's own spread between blocks once its fit is taken off: `Σ_b (S_b - β h_b)²` with `h_b` its square in block b.
    pub(super) fn detectable(
        &self,
        columns: &[Column],
        joined: &Joined,
        total: &[f64],
    ) -> Vec<Detectable> {
        let mut detectable = Vec::new();
        for (k, &column) in self.columns.iter().enumerate() {
            let of = &columns[column];
            if of.kind != Kind::Tangent {
                continue;
            }
            let left = joined.scores.column(k) - joined.squares.column(k) * total[k];
            let variance = joined.widening * left.norm_squared();
            detectable.push(Detectable {
                column,
                name: of.name.clone(),
                // In few blocks the spread may be small by accident; noise is at least as large as it was measured to be.
                least: NOTICED * variance.max(1.0).sqrt() / self.length[k],
            });
        }
        detectable
    }
}

/// Scores by joined blocks.
pub(super) struct Joined {
    pub(super) scores: DMatrix<f64>,
    /// The same without the strongest columns.
    pub(super) without: DMatrix<f64>,
    /// Squares of the columns, instead of products with the residual.
    pub(super) squares: DMatrix<f64>,
    /// Variance of a sum of blocks over the sum of their variances, 1 + 2r; at least 1.
    pub(super) widening: f64,
}

/// Joins neighbours while their scores, less what the strongest columns explain, are correlated.
pub(super) fn join(
    scores: DMatrix<f64>,
    without: DMatrix<f64>,
    squares: DMatrix<f64>,
    blocks: &Blocks,
) -> Joined {
    let mut joined = Joined {
        scores,
        without,
        squares,
        widening: 1.0,
    };
    let mut follows = blocks.follows.clone();
    loop {
        let (into, next) = Blocks::pairs(&follows);
        let correlation = neighbours_correlation(&joined.without, &follows);
        let nothing_to_join = next.len() == follows.len();
        if nothing_to_join || next.len() < LEAST_BLOCKS || correlation <= MOST_CORRELATED {
            joined.widening = 1.0 + 2.0 * correlation.max(0.0);
            return joined;
        }
        joined.scores = sum_rows(&joined.scores, &into, next.len());
        joined.without = sum_rows(&joined.without, &into, next.len());
        joined.squares = sum_rows(&joined.squares, &into, next.len());
        follows = next;
    }
}

fn neighbours_correlation(scores: &DMatrix<f64>, follows: &[bool]) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for column in scores.column_iter() {
        for b in 1..follows.len() {
            if follows[b] {
                product += column[b] * column[b - 1];
                square += 0.5 * (column[b] * column[b] + column[b - 1] * column[b - 1]);
            }
        }
    }
    if square > 0.0 { product / square } else { 0.0 }
}

fn sum_rows(scores: &DMatrix<f64>, into: &[usize], count: usize) -> DMatrix<f64> {
    let mut sums = DMatrix::zeros(count, scores.ncols());
    for (from, &to) in into.iter().enumerate() {
        for k in 0..scores.ncols() {
            sums[(to, k)] += scores[(from, k)];
        }
    }
    sums
}
