//! The most that any function of the covariates explains: gradient-boosted regression trees.
//!
//! A yardstick, not a law. Friedman 2001 (Ann. Stat. 29:1189) with squared loss, weights, and covariates sorted into at most 32 bins
//! of equal count (as in LightGBM, Ke et al. 2017): every tree is fitted to what the ones before it left,
//!
//! ```text
//! f(x) = f₀ + ν Σ_k tree_k(x),       a split gains  R_l²/(W_l + λ) + R_r²/(W_r + λ) - R²/(W + λ)
//! ```
//!
//! with R the sum of weight times residual and W of weight on a side. A covariate that is NaN has a bin of its own, below all
//! others.

mod growth;

use growth::{Binned, Ground, grow_tree};
use nalgebra::DMatrix;
use rayon::prelude::*;

use super::column::quantile_edges;
use super::held_out::{self, Gain};
use super::noise::Whitener;
use super::sequence::Blocks;

/// How trees grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// How many trees.
    pub trees: usize,
    /// Splits from root to leaf, at most 8.
    pub depth: usize,
    /// Share of each tree that is taken, ν.
    pub rate: f64,
    /// Samples that a leaf needs.
    pub least_leaf: usize,
    /// Weight added to every leaf, λ, in units of the mean weight of a sample: draws small leaves to 0.
    pub shrinkage: f64,
}

impl Default for Options {
    /// 120 trees of depth 3, a rate of 0.08, leaves of 20 samples, shrunk as by 10. Chosen here: an interaction of three covariates
    /// fits a tree, and 120 steps of 0.08 leave 5e-5 of a signal that every tree catches.
    fn default() -> Self {
        Self {
            trees: 120,
            depth: 3,
            rate: 0.08,
            least_leaf: 20,
            shrinkage: 10.0,
        }
    }
}

/// Bins of a covariate besides that of NaN.
const BINS: usize = 32;

/// A function of the covariates.
#[derive(Clone, Debug, PartialEq)]
pub struct Forest {
    base: f64,
    trees: Vec<Tree>,
    /// Of every covariate, the values that part its bins, ends left off.
    edges: Vec<Vec<f64>>,
    gains: Vec<f64>,
}

/// Complete binary tree: node k has children 2k + 1 and 2k + 2.
#[derive(Clone, Debug, PartialEq)]
struct Tree {
    /// Of every inner node, the covariate and the last bin that goes left; a node that does not split sends all left.
    splits: Vec<(usize, u8)>,
    leaves: Vec<f64>,
}

fn bin_of(edges: &[f64], value: f64) -> u8 {
    if value.is_nan() {
        return 0;
    }
    // At most 32 edges lie below.
    1 + edges.partition_point(|edge| *edge <= value) as u8
}

/// Fits values at covariates (samples by rows), with weights (1/variance).
#[must_use]
pub fn fit(x: &DMatrix<f64>, y: &[f64], weights: &[f64], options: Options) -> Forest {
    let rows: Vec<u32> = (0..y.len() as u32).collect();
    let (edges, binned) = binned(x);
    grow(&edges, &binned, y, weights, &rows, options)
}

fn binned(x: &DMatrix<f64>) -> (Vec<Vec<f64>>, Binned) {
    let columns: Vec<Vec<f64>> = x
        .column_iter()
        .map(|c| c.iter().copied().collect())
        .collect();
    let edges: Vec<Vec<f64>> = columns
        .iter()
        .map(|column| {
            let edges = quantile_edges(column, BINS);
            edges
                .get(1..edges.len().saturating_sub(1))
                .unwrap_or(&[])
                .to_vec()
        })
        .collect();
    let bins = columns
        .iter()
        .zip(&edges)
        .map(|(column, edges)| column.iter().map(|&value| bin_of(edges, value)).collect())
        .collect();
    (edges, Binned { bins })
}

fn grow(
    edges: &[Vec<f64>],
    binned: &Binned,
    y: &[f64],
    weights: &[f64],
    rows: &[u32],
    options: Options,
) -> Forest {
    let total: f64 = rows.iter().map(|&i| weights[i as usize]).sum();
    let sum: f64 = rows
        .iter()
        .map(|&i| weights[i as usize] * y[i as usize])
        .sum();
    let lambda = options.shrinkage * total / rows.len().max(1) as f64;
    let base = if total > 0.0 {
        sum / (total + lambda)
    } else {
        0.0
    };
    let of_sample = y.iter().zip(weights);
    let mut weighted: Vec<(f64, f64)> = of_sample.map(|(y, &w)| (w * (y - base), w)).collect();
    let mut forest = Forest {
        base,
        trees: Vec::with_capacity(options.trees),
        edges: edges.to_vec(),
        gains: vec![0.0; edges.len()],
    };
    for _ in 0..options.trees {
        let ground = Ground {
            binned,
            weighted: &weighted,
            lambda,
            least_leaf: options.least_leaf.max(1) as f64,
        };
        let (tree, leaves) = grow_tree(&ground, rows, options, &mut forest.gains);
        for (rows, value) in leaves.iter().zip(&tree.leaves) {
            for &i in rows {
                let (residual, weight) = &mut weighted[i as usize];
                *residual -= *weight * value;
            }
        }
        forest.trees.push(tree);
    }
    forest
}

impl Forest {
    fn value(&self, bin_of: impl Fn(usize) -> u8) -> f64 {
        let mut value = self.base;
        for tree in &self.trees {
            let mut node = 0;
            while let Some(&(covariate, bin)) = tree.splits.get(node) {
                node = 2 * node + 1 + usize::from(bin < u8::MAX && bin_of(covariate) > bin);
            }
            value += tree.leaves[node - tree.splits.len()];
        }
        value
    }

    /// At every row of covariates.
    #[must_use]
    pub fn predict(&self, x: &DMatrix<f64>) -> Vec<f64> {
        x.row_iter()
            .map(|row| self.value(|covariate| bin_of(&self.edges[covariate], row[covariate])))
            .collect()
    }

    /// Mean prediction over samples with one covariate set to each of some values (Friedman 2001, § 8.2).
    #[must_use]
    pub fn partial_dependence(&self, x: &DMatrix<f64>, covariate: usize, at: &[f64]) -> Vec<f64> {
        let rows: Vec<Vec<u8>> = x
            .row_iter()
            .map(|row| {
                (0..row.len())
                    .map(|c| bin_of(&self.edges[c], row[c]))
                    .collect()
            })
            .collect();
        at.iter()
            .map(|&value| {
                let set = bin_of(&self.edges[covariate], value);
                let of_row = |row: &Vec<u8>| {
                    self.value(|other| if other == covariate { set } else { row[other] })
                };
                rows.iter().map(of_row).sum::<f64>() / rows.len().max(1) as f64
            })
            .collect()
    }

    /// Of every covariate, the share of the squares that its splits took away; 1 in all.
    #[must_use]
    pub fn shares(&self) -> Vec<f64> {
        let total: f64 = self.gains.iter().sum();
        let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
        self.gains.iter().map(|gain| gain * scale).collect()
    }
}

/// What trees predict for blocks they have not seen.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// Of every sample, by the forest that was grown without its fold.
    pub predictions: Vec<f64>,
    /// Against predicting 0.
    pub gain: Gain,
}

/// Grouped cross-validation of trees on a residual `y` (in the values' unit); folds run in parallel, and the answer does not
/// depend on the threads.
#[must_use]
pub fn held_out(
    x: &DMatrix<f64>,
    y: &[f64],
    whitener: &Whitener,
    blocks: &Blocks,
    folds: usize,
    options: Options,
) -> HeldOut {
    let folds = folds.max(1);
    let weights: Vec<f64> = whitener.sd().iter().map(|sd| 1.0 / (sd * sd)).collect();
    let fold_of = held_out::folds(blocks, folds);
    let (edges, binned) = binned(x);
    let parts: Vec<Vec<(usize, f64)>> = (0..folds)
        .into_par_iter()
        .map(|fold| {
            let seen: Vec<u32> = (0..y.len() as u32)
                .filter(|&i| fold_of[i as usize] != fold)
                .collect();
            let forest = grow(&edges, &binned, y, &weights, &seen, options);
            (0..y.len())
                .filter(|&i| fold_of[i] == fold)
                .map(|i| (i, forest.value(|covariate| binned.bins[covariate][i])))
                .collect()
        })
        .collect();
    let mut predictions = vec![0.0; y.len()];
    for (i, value) in parts.into_iter().flatten() {
        predictions[i] = value;
    }
    let after: Vec<f64> = y.iter().zip(&predictions).map(|(y, f)| y - f).collect();
    let gain = Gain::between(whitener, blocks, y, &after);
    HeldOut { predictions, gain }
}

#[cfg(test)]
mod tests;
