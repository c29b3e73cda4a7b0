//! The most that any function of the covariates explains: gradient-boosted regression trees.
//!
//! A yardstick, not a law. Friedman 2001 (Ann. Stat. 29:1189) with squared loss, weights, and
//! covariates sorted into at most 32 bins of equal count (as in LightGBM, Ke et al. 2017): every
//! tree is fitted to what the ones before it left,
//!
//! ```text
//! f(x) = f₀ + ν Σ_k tree_k(x),       a split gains  R_l²/(W_l + λ) + R_r²/(W_r + λ) - R²/(W + λ)
//! ```
//!
//! with R the sum of weight times residual and W of weight on a side. A covariate that is NaN has a
//! bin of its own, below all others.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::held_out::{self, FOLDS, Gain};
use super::noise::Noise;
use super::quantile::{difference, quantile_edges};

/// Trees of a forest. Chosen here: 120 steps of 0.08 leave 5e-5 of a signal that every tree
/// catches.
const TREES: usize = 120;
/// Splits from root to leaf. Chosen here: an interaction of three covariates fits a tree.
const DEPTH: usize = 3;
/// Share of each tree that is taken, ν.
const RATE: f64 = 0.08;
/// Samples that a leaf needs. Chosen here.
const LEAST_LEAF: f64 = 20.0;
/// Weight added to every leaf, λ, in units of the mean weight of a sample: draws small leaves to 0.
/// Chosen here: as of ten samples.
const SHRINKAGE: f64 = 10.0;
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
    /// Of every inner node, the covariate and the last bin that goes left; a node that does not
    /// split sends all left.
    splits: Vec<(usize, u8)>,
    leaves: Vec<f64>,
}

/// Fits values `y` at covariates (one column each, one value a sample), with weights (1/variance).
#[must_use]
pub fn fit(covariates: &[Vec<f64>], y: &[f64], weights: &[f64]) -> Forest {
    let rows: Vec<u32> = (0..y.len() as u32).collect();
    Binned::new(covariates).grow(y, weights, &rows)
}

/// What trees predict for blocks they have not seen.
#[derive(Clone, Debug, PartialEq)]
pub struct HeldOut {
    /// Of every sample, by the forest that was grown without its fold, in the unit of the values.
    pub predictions: Vec<f64>,
    /// Against predicting 0.
    pub gain: Gain,
}

/// Grouped cross-validation of trees on a residual `y` (in the values' unit); folds run in
/// parallel, and the answer does not depend on the threads.
#[must_use]
pub fn held_out(covariates: &[Vec<f64>], y: &[f64], noise: &Noise) -> HeldOut {
    let weights = noise.weights();
    let fold_of = held_out::folds(&noise.blocks);
    let binned = Binned::new(covariates);
    let without = |fold: usize| {
        let seen = (0..y.len() as u32).filter(|&i| fold_of[i as usize] != fold);
        binned.grow(y, &weights, &seen.collect::<Vec<u32>>())
    };
    let forests: Vec<Forest> = (0..FOLDS).into_par_iter().map(without).collect();
    let predicted = |i: usize| forests[fold_of[i]].value(|covariate| binned.bins[covariate][i]);
    let predictions: Vec<f64> = (0..y.len()).map(predicted).collect();
    let gain = Gain::between(noise, y, &difference(y, &predictions));
    HeldOut { predictions, gain }
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

    /// Mean prediction over the samples with one covariate set to each of some values (Friedman
    /// 2001, § 8.2), in the unit of what was fitted. `covariates` are those of the fit.
    #[must_use]
    pub fn partial_dependence(
        &self,
        covariates: &[Vec<f64>],
        covariate: usize,
        at: &[f64],
    ) -> Vec<f64> {
        let mut binned = Binned::new(covariates);
        let rows = covariates.first().map_or(0, Vec::len);
        let mean_at = |&value: &f64| {
            binned.bins[covariate].fill(bin_of(&self.edges[covariate], value));
            let values = (0..rows).map(|row| self.value(|other| binned.bins[other][row]));
            values.sum::<f64>() / rows.max(1) as f64
        };
        at.iter().map(mean_at).collect()
    }

    /// Of every covariate, the share of the squares that its splits took away; 1 in all.
    #[must_use]
    pub fn shares(&self) -> Vec<f64> {
        let scale = share(1.0, self.gains.iter().sum());
        self.gains.iter().map(|gain| gain * scale).collect()
    }
}

/// A part of a whole; 0 of nothing.
fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 0.0 }
}

fn bin_of(edges: &[f64], value: f64) -> u8 {
    if value.is_nan() {
        return 0;
    }
    // At most 32 edges lie below.
    1 + edges.partition_point(|edge| *edge <= value) as u8
}

/// Covariates by bins.
struct Binned {
    edges: Vec<Vec<f64>>,
    /// Of every covariate, every sample's bin.
    bins: Vec<Vec<u8>>,
    /// The covariates that lie in more than one bin: no other splits anything.
    parted: Vec<usize>,
    /// Of every sample, the bin of each of these: the same, as sums are taken over it.
    of_samples: Vec<u8>,
}

impl Binned {
    fn new(covariates: &[Vec<f64>]) -> Self {
        let binned = covariates.iter().map(|values| {
            let edges = quantile_edges(values, BINS);
            let inner = edges.get(1..edges.len().saturating_sub(1)).unwrap_or(&[]);
            let bins = values.iter().map(|&value| bin_of(inner, value)).collect();
            (inner.to_vec(), bins)
        });
        let (edges, bins): (Vec<_>, Vec<Vec<u8>>) = binned.unzip();
        let samples = 0..bins.first().map_or(0, Vec::len);
        let is_parted = |of: &usize| bins[*of].iter().any(|bin| *bin != bins[*of][0]);
        let parted: Vec<usize> = (0..bins.len()).filter(is_parted).collect();
        let of_sample = |sample: usize| parted.iter().map(|&of| bins[of][sample]).collect();
        let of_samples: Vec<Vec<u8>> = samples.map(of_sample).collect();
        Self {
            edges,
            of_samples: of_samples.concat(),
            bins,
            parted,
        }
    }

    /// A forest on some rows.
    fn grow(&self, y: &[f64], weights: &[f64], rows: &[u32]) -> Forest {
        let total: f64 = rows.iter().map(|&i| weights[i as usize]).sum();
        let products = rows.iter().map(|&i| weights[i as usize] * y[i as usize]);
        let sum: f64 = products.sum();
        let lambda = SHRINKAGE * total / rows.len().max(1) as f64;
        let base = share(sum, total + lambda);
        let of_sample = y.iter().zip(weights);
        let mut weighted: Vec<(f64, f64)> = of_sample.map(|(y, &w)| (w * (y - base), w)).collect();
        let mut forest = Forest {
            base,
            trees: Vec::with_capacity(TREES),
            edges: self.edges.clone(),
            gains: vec![0.0; self.edges.len()],
        };
        for _ in 0..TREES {
            let ground = Ground {
                binned: self,
                weighted: &weighted,
                lambda,
            };
            let (tree, leaves) = ground.grow_tree(rows, &mut forest.gains);
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
}

/// Sums over the samples of a bin: of weight times residual (x), of weight (y), and their number
/// (z).
type Cell = Vector3<f64>;

/// Of every covariate that parts samples, of every bin: one node's sums.
type Cells = Vec<[Cell; BINS + 2]>;

/// What one tree is grown on.
struct Ground<'a> {
    binned: &'a Binned,
    /// Weight times residual, and weight, of every sample.
    weighted: &'a [(f64, f64)],
    lambda: f64,
}

impl Ground<'_> {
    fn cell(&self, i: u32) -> Cell {
        let (residual, weight) = self.weighted[i as usize];
        Cell::new(residual, weight, 1.0)
    }

    fn cells(&self, rows: &[u32]) -> Cells {
        let covariates = self.binned.parted.len();
        let mut cells = vec![[Cell::zeros(); BINS + 2]; covariates];
        for &i in rows {
            let cell = self.cell(i);
            let bins = &self.binned.of_samples[i as usize * covariates..][..covariates];
            for (bin, cells) in bins.iter().zip(&mut cells) {
                cells[usize::from(*bin)] += cell;
            }
        }
        cells
    }

    /// The covariate and the last bin on the left that gain most; ties go to the earlier covariate
    /// and the lower bin.
    fn best_split(&self, cells: &Cells) -> Option<(f64, usize, u8)> {
        let of = |cell: Cell| cell.x * cell.x / (cell.y + self.lambda);
        let mut best: Option<(f64, usize, u8)> = None;
        for (&covariate, cells) in self.binned.parted.iter().zip(cells) {
            let all: Cell = cells.iter().sum();
            let mut below = Cell::zeros();
            for (bin, cell) in cells.iter().enumerate() {
                below += cell;
                let above = all - below;
                if below.z < LEAST_LEAF || above.z < LEAST_LEAF {
                    continue;
                }
                let gain = of(below) + of(above) - of(all);
                if gain > best.map_or(0.0, |(most, _, _)| most) {
                    best = Some((gain, covariate, bin as u8));
                }
            }
        }
        best
    }

    /// Grows one tree, level by level; returns it with the rows of every leaf. Sums of the larger
    /// child are those of the node less the smaller's.
    fn grow_tree(&self, rows: &[u32], gains: &mut [f64]) -> (Tree, Vec<Vec<u32>>) {
        let mut splits = Vec::with_capacity((1 << DEPTH) - 1);
        let mut nodes = vec![(rows.to_vec(), self.cells(rows))];
        for level in 1..=DEPTH {
            // Leaves are not split: nothing asks for their bins.
            let cells_of = |rows: &[u32]| match level < DEPTH {
                true => self.cells(rows),
                false => Vec::new(),
            };
            let mut children = Vec::with_capacity(2 * nodes.len());
            for (rows, mut cells) in nodes {
                let Some((gain, covariate, bin)) = self.best_split(&cells) else {
                    splits.push((0, u8::MAX));
                    children.extend([(rows, cells), (Vec::new(), cells_of(&[]))]);
                    continue;
                };
                gains[covariate] += gain;
                splits.push((covariate, bin));
                let bins = &self.binned.bins[covariate];
                let (left, right): (Vec<u32>, Vec<u32>) =
                    rows.into_iter().partition(|&i| bins[i as usize] <= bin);
                let left_is_small = left.len() <= right.len();
                let small = cells_of(if left_is_small { &left } else { &right });
                for (large, small) in cells.iter_mut().flatten().zip(small.iter().flatten()) {
                    *large -= small;
                }
                children.extend(if left_is_small {
                    [(left, small), (right, cells)]
                } else {
                    [(left, cells), (right, small)]
                });
            }
            nodes = children;
        }
        let leaf = |rows: &Vec<u32>| {
            let sum: Cell = rows.iter().map(|&i| self.cell(i)).sum();
            share(RATE * sum.x, sum.y + self.lambda)
        };
        let rows: Vec<Vec<u32>> = nodes.into_iter().map(|(rows, _)| rows).collect();
        let leaves = rows.iter().map(leaf).collect();
        (Tree { splits, leaves }, rows)
    }
}

#[cfg(test)]
mod tests;
