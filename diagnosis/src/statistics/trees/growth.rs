//! One tree: the splits that take most off the squares, level by level.

use super::{BINS, Options, Tree};

/// Covariates by bins: covariate by covariate, every sample's bin.
pub(super) struct Binned {
    pub(super) bins: Vec<Vec<u8>>,
}

/// Sums over the samples of a bin.
#[derive(Clone, Copy, Default)]
struct Cell {
    residual: f64,
    weight: f64,
    count: f64,
}

/// Of every covariate, of every bin: one node's sums.
type Cells = Vec<[Cell; BINS + 2]>;

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

/// What a tree is grown on.
pub(super) struct Ground<'a> {
    pub(super) binned: &'a Binned,
    /// Weight times residual, and weight, of every sample.
    pub(super) weighted: &'a [(f64, f64)],
    pub(super) lambda: f64,
    pub(super) least_leaf: f64,
}

impl Ground<'_> {
    fn cells(&self, rows: &[u32]) -> Cells {
        let mut cells = vec![[Cell::default(); BINS + 2]; self.binned.bins.len()];
        for (bins, cells) in self.binned.bins.iter().zip(&mut cells) {
            for &i in rows {
                let (residual, weight) = self.weighted[i as usize];
                cells[usize::from(bins[i as usize])].take(Cell {
                    residual,
                    weight,
                    count: 1.0,
                });
            }
        }
        cells
    }

    /// The covariate and the last bin on the left that gain most; ties go to the earlier covariate and the lower bin.
    fn best_split(&self, cells: &Cells) -> Option<(f64, usize, u8)> {
        let mut best: Option<(f64, usize, u8)> = None;
        for (covariate, cells) in cells.iter().enumerate() {
            let mut all = Cell::default();
            cells.iter().for_each(|cell| all.take(*cell));
            let mut below = Cell::default();
            for (bin, cell) in cells.iter().enumerate() {
                below.take(*cell);
                let above = all.less(below);
                if below.count < self.least_leaf || above.count < self.least_leaf {
                    continue;
                }
                let gain =
                    below.gain(self.lambda) + above.gain(self.lambda) - all.gain(self.lambda);
                if gain > best.map_or(0.0, |(most, _, _)| most) {
                    best = Some((gain, covariate, bin as u8));
                }
            }
        }
        best
    }
}

/// Grows one tree; returns it with the rows of every leaf. Sums of the larger child are those of the node less the smaller's.
pub(super) fn grow_tree(
    ground: &Ground<'_>,
    rows: &[u32],
    options: Options,
    gains: &mut [f64],
) -> (Tree, Vec<Vec<u32>>) {
    let depth = options.depth.min(8);
    let mut splits = Vec::with_capacity((1 << depth) - 1);
    let mut nodes = vec![rows.to_vec()];
    let mut cells = vec![ground.cells(rows)];
    for level in 0..depth {
        let is_last = level + 1 == depth;
        let mut children = Vec::with_capacity(2 * nodes.len());
        let mut of_children = Vec::with_capacity(2 * nodes.len());
        for (rows, cells) in nodes.into_iter().zip(cells) {
            let Some((gain, covariate, bin)) = ground.best_split(&cells) else {
                splits.push((0, u8::MAX));
                children.extend([rows, Vec::new()]);
                if !is_last {
                    of_children.extend([cells, ground.cells(&[])]);
                }
                continue;
            };
            gains[covariate] += gain;
            splits.push((covariate, bin));
            let bins = &ground.binned.bins[covariate];
            let (left, right): (Vec<u32>, Vec<u32>) =
                rows.into_iter().partition(|&i| bins[i as usize] <= bin);
            if !is_last {
                let left_is_small = left.len() <= right.len();
                let small = ground.cells(if left_is_small { &left } else { &right });
                let mut large = cells;
                for (large, small) in large.iter_mut().zip(&small) {
                    for (large, small) in large.iter_mut().zip(small) {
                        *large = large.less(*small);
                    }
                }
                of_children.extend(if left_is_small {
                    [small, large]
                } else {
                    [large, small]
                });
            }
            children.extend([left, right]);
        }
        nodes = children;
        cells = of_children;
    }
    let leaf = |rows: &Vec<u32>| {
        let mut sum = Cell::default();
        for &i in rows {
            let (residual, weight) = ground.weighted[i as usize];
            sum.residual += residual;
            sum.weight += weight;
        }
        let weight = sum.weight + ground.lambda;
        if weight > 0.0 {
            options.rate * sum.residual / weight
        } else {
            0.0
        }
    };
    let leaves = nodes.iter().map(leaf).collect();
    (Tree { splits, leaves }, nodes)
}
