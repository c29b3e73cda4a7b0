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

/// Covariates by bins: covariate by covariate, every sample's bin.
struct Binned {
    bins: Vec<Vec<u8>>,
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
    let rows: Vec<usize> = (0..y.len()).collect();
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

/// Fits the given rows; the residuals of all rows are carried along, so that held-out ones are predicted in passing.
fn grow(
    edges: &[Vec<f64>],
    binned: &Binned,
    y: &[f64],
    weights: &[f64],
    rows: &[usize],
    options: Options,
) -> Forest {
    let total: f64 = rows.iter().map(|&i| weights[i]).sum();
    let sum: f64 = rows.iter().map(|&i| weights[i] * y[i]).sum();
    let lambda = options.shrinkage * total / rows.len().max(1) as f64;
    let base = if total > 0.0 {
        sum / (total + lambda)
    } else {
        0.0
    };
    let mut left: Vec<f64> = y.iter().map(|value| value - base).collect();
    let mut forest = Forest {
        base,
        trees: Vec::with_capacity(options.trees),
        edges: edges.to_vec(),
        gains: vec![0.0; edges.len()],
    };
    let mut node_of = vec![0u16; y.len()];
    for _ in 0..options.trees {
        let tree = grow_tree(
            binned,
            &left,
            weights,
            rows,
            lambda,
            options,
            &mut node_of,
            &mut forest.gains,
        );
        let first_leaf = tree.splits.len();
        for &i in rows {
            left[i] -= tree.leaves[usize::from(node_of[i]) - first_leaf];
        }
        forest.trees.push(tree);
    }
    forest
}

#[derive(Clone, Copy, Default)]
struct Cell {
    residual: f64,
    weight: f64,
    count: f64,
}

impl Cell {
    fn take(&mut self, other: Cell) {
        self.residual += other.residual;
        self.weight += other.weight;
        self.count += other.count;
    }

    fn less(self, other: Cell) -> Cell {
        Cell {
            residual: self.residual - other.residual,
            weight: self.weight - other.weight,
            count: self.count - other.count,
        }
    }

    fn gain(self, lambda: f64) -> f64 {
        self.residual * self.residual / (self.weight + lambda)
    }
}

#[expect(
    clippy::too_many_arguments,
    reason = "one tree of `grow`, whose working space it shares"
)]
fn grow_tree(
    binned: &Binned,
    left: &[f64],
    weights: &[f64],
    rows: &[usize],
    lambda: f64,
    options: Options,
    node_of: &mut [u16],
    gains: &mut [f64],
) -> Tree {
    let depth = options.depth.min(8);
    let mut splits = vec![(0, u8::MAX); (1 << depth) - 1];
    rows.iter().for_each(|&i| node_of[i] = 0);
    for level in 0..depth {
        let first = (1 << level) - 1;
        let nodes = 1 << level;
        let mut best = vec![(0.0, 0, u8::MAX); nodes];
        for (covariate, bins) in binned.bins.iter().enumerate() {
            let mut cells = vec![[Cell::default(); BINS + 2]; nodes];
            for &i in rows {
                let weight = weights[i];
                cells[usize::from(node_of[i]) - first][usize::from(bins[i])].take(Cell {
                    residual: weight * left[i],
                    weight,
                    count: 1.0,
                });
            }
            for (cells, best) in cells.iter().zip(&mut best) {
                let mut all = Cell::default();
                cells.iter().for_each(|cell| all.take(*cell));
                let mut below = Cell::default();
                for (bin, cell) in cells.iter().enumerate() {
                    below.take(*cell);
                    let above = all.less(below);
                    let least = options.least_leaf as f64;
                    if below.count < least || above.count < least {
                        continue;
                    }
                    let gain = below.gain(lambda) + above.gain(lambda) - all.gain(lambda);
                    // Ties go to the earlier covariate and the lower bin.
                    if gain > best.0 {
                        *best = (gain, covariate, bin as u8);
                    }
                }
            }
        }
        for (node, &(gain, covariate, bin)) in best.iter().enumerate() {
            splits[first + node] = (covariate, bin);
            if let Some(gains) = gains.get_mut(covariate) {
                *gains += gain;
            }
        }
        for &i in rows {
            let node = usize::from(node_of[i]);
            let (covariate, bin) = splits[node];
            let goes_right = binned.bins.get(covariate).is_some_and(|bins| bins[i] > bin);
            node_of[i] = (2 * node + 1 + usize::from(goes_right)) as u16;
        }
    }
    let first_leaf = splits.len();
    let mut leaves = vec![Cell::default(); 1 << depth];
    for &i in rows {
        leaves[usize::from(node_of[i]) - first_leaf].take(Cell {
            residual: weights[i] * left[i],
            weight: weights[i],
            count: 1.0,
        });
    }
    let value = |leaf: &Cell| {
        let weight = leaf.weight + lambda;
        if weight > 0.0 {
            options.rate * leaf.residual / weight
        } else {
            0.0
        }
    };
    Tree {
        splits,
        leaves: leaves.iter().map(value).collect(),
    }
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
    let weights: Vec<f64> = whitener.sd().iter().map(|sd| 1.0 / (sd * sd)).collect();
    let fold_of = held_out::folds(blocks, folds);
    let (edges, binned) = binned(x);
    let parts: Vec<Vec<(usize, f64)>> = (0..folds)
        .into_par_iter()
        .map(|fold| {
            let seen: Vec<usize> = (0..y.len()).filter(|&i| fold_of[i] != fold).collect();
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
mod tests {
    use super::*;
    use crate::statistics::draws::Draws;
    use crate::statistics::noise::NoiseModel;
    use crate::statistics::sequence::Sequence;

    fn covariates(count: usize, seed: u64) -> DMatrix<f64> {
        let mut draws = Draws::new(seed);
        DMatrix::from_fn(count, 5, |_, _| draws.uniform())
    }

    #[test]
    fn an_interaction_of_two_covariates_is_learned() {
        let x = covariates(4000, 1);
        let law = |row: &[f64]| if row[0] > 0.5 { row[1] } else { -row[1] };
        let truth: Vec<f64> = (0..4000).map(|i| law(&[x[(i, 0)], x[(i, 1)]])).collect();
        let forest = fit(&x, &truth, &[1.0; 4000], Options::default());
        let fresh = covariates(1000, 2);
        let predicted = forest.predict(&fresh);
        let (mut left, mut all) = (0.0, 0.0);
        for i in 0..1000 {
            let value = law(&[fresh[(i, 0)], fresh[(i, 1)]]);
            left += (predicted[i] - value).powi(2);
            all += value * value;
        }
        // Bins of 1/32 leave an error of 1/(32 √12), and one bin in 32 straddles the jump.
        assert!(left / all < 0.05, "{}", left / all);
        let shares = forest.shares();
        assert!(shares[0] + shares[1] > 0.99, "{shares:?}");
    }

    #[test]
    fn the_partial_dependence_follows_the_law_of_its_covariate() {
        let x = covariates(4000, 3);
        let y: Vec<f64> = (0..4000).map(|i| x[(i, 2)].powi(2) + x[(i, 3)]).collect();
        let forest = fit(&x, &y, &[1.0; 4000], Options::default());
        let at = [0.1, 0.5, 0.9];
        let curve = forest.partial_dependence(&x, 2, &at);
        for pair in [(0, 1), (1, 2)] {
            let expected = at[pair.1].powi(2) - at[pair.0].powi(2);
            // A bin's width times the steepest slope, 2/32.
            assert!(
                (curve[pair.1] - curve[pair.0] - expected).abs() < 0.07,
                "{curve:?}"
            );
        }
    }

    #[test]
    fn weights_of_zero_do_not_count() {
        let x = covariates(1000, 4);
        let y: Vec<f64> = (0..1000).map(|i| if i < 500 { 1.0 } else { 9.0 }).collect();
        let weights: Vec<f64> = (0..1000).map(|i| if i < 500 { 1.0 } else { 0.0 }).collect();
        let forest = fit(&x, &y, &weights, Options::default());
        for value in forest.predict(&x) {
            // Shrinkage: 10 of 500, and less with every tree.
            assert!((value - 1.0).abs() < 0.02, "{value}");
        }
    }

    #[test]
    fn missing_covariates_are_a_regime_of_their_own() {
        let mut x = covariates(2000, 5);
        for i in (0..2000).step_by(4) {
            x[(i, 0)] = f64::NAN;
        }
        let y: Vec<f64> = (0..2000)
            .map(|i| if i % 4 == 0 { 2.0 } else { 0.0 })
            .collect();
        let forest = fit(&x, &y, &[1.0; 2000], Options::default());
        let predicted = forest.predict(&x);
        // What ten samples' weight of shrinkage leaves in leaves of 500.
        assert!((predicted[0] - 2.0).abs() < 0.05 && predicted[1].abs() < 0.05);
    }

    fn whitener(t_s: &[f64]) -> (Whitener, Blocks) {
        let sequence = Sequence::new(t_s, &vec![0; t_s.len()]);
        let noise = NoiseModel {
            s0: 1.0,
            s1: 0.0,
            rho: 0.0,
            step_s: 1.0,
        };
        let whitener = Whitener::new(&noise, &sequence, &vec![0.0; t_s.len()]);
        (whitener, Blocks::new(&sequence, t_s))
    }

    #[test]
    fn held_out_gain_is_positive_for_a_law_and_negative_for_noise() {
        let x = covariates(2000, 6);
        let t_s: Vec<f64> = (0..2000).map(f64::from).collect();
        let (whitener, blocks) = whitener(&t_s);
        let mut draws = Draws::new(7);
        let noise: Vec<f64> = (0..2000).map(|_| draws.normal()).collect();
        let gain = held_out(&x, &noise, &whitener, &blocks, 6, Options::default()).gain;
        assert!(gain.total < 0.0, "{}", gain.total);
        let law: Vec<f64> = (0..2000)
            .map(|i| noise[i] + 2.0 * (x[(i, 1)] - 0.5))
            .collect();
        let gain = held_out(&x, &law, &whitener, &blocks, 6, Options::default()).gain;
        // The law's own χ²/2 is 2000 · 4/12/2 = 333, of which pseudo-Huber keeps 0.88.
        assert!(
            gain.total > 200.0 && gain.total > 5.0 * gain.standard_error,
            "{gain:?}"
        );
    }

    #[test]
    fn one_thread_and_two_predict_the_same_bits() {
        let x = covariates(600, 8);
        let y: Vec<f64> = (0..600).map(|i| x[(i, 0)] - x[(i, 4)]).collect();
        let t_s: Vec<f64> = (0..600).map(f64::from).collect();
        let (whitener, blocks) = whitener(&t_s);
        let run = |threads| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .expect("a small pool")
                .install(|| held_out(&x, &y, &whitener, &blocks, 6, Options::default()))
        };
        assert_eq!(run(1), run(2));
    }
}
