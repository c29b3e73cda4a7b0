//! Things by the cell of floor and height they are in: what may be near a place.

use nalgebra::Point3;
use planner::plan::Bounds;

/// Side of a cell of floor (m); chosen here, about the reach of a small drone's wake.
const FLOOR_M: f64 = 4.0;
/// No more cells than this; chosen here. Wider ones where a place has more.
const MOST_CELLS: f64 = 65_536.0;

/// A regular grid; what lies outside counts in the outermost cells.
#[derive(Clone, Debug)]
pub(crate) struct Bins {
    low_m: [f64; 3],
    /// Cells a metre (1/m).
    per_m: [f64; 3],
    cells: [usize; 3],
    /// Where the entries of each cell begin.
    starts: Vec<u32>,
    entries: Vec<u32>,
    /// The farthest reach of any entry of a layer (m).
    reach_m: Vec<f64>,
}

/// One thing: where, between which heights, and how far from there it matters (m).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub(crate) middle_m: [f64; 2],
    pub(crate) z_m: [f64; 2],
    pub(crate) reach_m: f64,
}

impl Bins {
    /// Over a place; `layer_m` infinite: a single layer.
    pub(crate) fn new(bounds: &Bounds, layer_m: f64) -> Bins {
        let size = bounds.max - bounds.min;
        let mut cell_m = [FLOOR_M, FLOOR_M, layer_m];
        let count = |cell_m: &[f64; 3], k: usize| (size[k] / cell_m[k]).ceil().max(1.0);
        while (0..3).map(|k| count(&cell_m, k)).product::<f64>() > MOST_CELLS {
            cell_m = cell_m.map(|side_m| 1.5 * side_m);
        }
        let cells = [0, 1, 2].map(|k| count(&cell_m, k) as usize);
        Bins {
            low_m: bounds.min.coords.into(),
            per_m: cell_m.map(f64::recip),
            cells,
            starts: vec![0; cells.iter().product::<usize>() + 1],
            entries: Vec::new(),
            reach_m: vec![0.0; cells[2]],
        }
    }

    fn index(&self, axis: usize, at_m: f64) -> usize {
        let cell = (at_m - self.low_m[axis]) * self.per_m[axis];
        // Below the first cell and NaN: 0.
        (cell as usize).min(self.cells[axis] - 1)
    }

    fn layers(&self, [a_m, b_m]: [f64; 2]) -> std::ops::RangeInclusive<usize> {
        self.index(2, a_m.min(b_m))..=self.index(2, a_m.max(b_m))
    }

    fn cell(&self, x: usize, y: usize, layer: usize) -> usize {
        (layer * self.cells[1] + y) * self.cells[0] + x
    }

    /// Takes other entries in; of each cell they keep their order.
    pub(crate) fn fill(&mut self, entries: impl Iterator<Item = Entry> + Clone) {
        self.starts.fill(0);
        self.reach_m.fill(0.0);
        for entry in entries.clone() {
            let [x, y] = [0, 1].map(|k| self.index(k, entry.middle_m[k]));
            for layer in self.layers(entry.z_m) {
                let cell = self.cell(x, y, layer);
                self.starts[cell + 1] += 1;
                self.reach_m[layer] = self.reach_m[layer].max(entry.reach_m);
            }
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        let total = self.starts[self.starts.len() - 1] as usize;
        self.entries.clear();
        self.entries.resize(total, 0);
        // Every cell's first entry moves on by one with each that is put in.
        for (number, entry) in (0..).zip(entries) {
            let [x, y] = [0, 1].map(|k| self.index(k, entry.middle_m[k]));
            for layer in self.layers(entry.z_m) {
                let cell = self.cell(x, y, layer);
                self.entries[self.starts[cell] as usize] = number;
                self.starts[cell] += 1;
            }
        }
        // Now each says where the next begins.
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }

    /// How many entries the fullest cell has.
    pub(crate) fn fullest(&self) -> usize {
        let each = self.starts.windows(2).map(|two| two[1] - two[0]);
        each.max().unwrap_or(0) as usize
    }

    /// Numbers of all entries that may matter at a place (m), and some more; in the order of cells.
    pub(crate) fn near(&self, place_m: &Point3<f64>) -> impl Iterator<Item = usize> + '_ {
        let layer = self.index(2, place_m.z);
        self.within(place_m, self.reach_m[layer])
    }

    /// Those of its layer whose middle may be within a level distance of it (m), however far they
    /// reach themselves.
    pub(crate) fn within(
        &self,
        place_m: &Point3<f64>,
        reach_m: f64,
    ) -> impl Iterator<Item = usize> + '_ {
        let layer = self.index(2, place_m.z);
        let span =
            |k: usize| self.index(k, place_m[k] - reach_m)..=self.index(k, place_m[k] + reach_m);
        let columns = span(0);
        span(1).flat_map(move |y| {
            let first = self.starts[self.cell(*columns.start(), y, layer)] as usize;
            let end = self.starts[self.cell(*columns.end(), y, layer) + 1] as usize;
            self.entries[first..end].iter().map(|&it| it as usize)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_is_within_its_reach_is_found_once() {
        let bounds = Bounds {
            min: Point3::new(-3.0, 0.0, 0.0),
            max: Point3::new(40.0, 30.0, 9.0),
        };
        let mut bins = Bins::new(&bounds, 0.5);
        let spread = |k: usize, step: f64| (k as f64 * step).fract();
        let entries: Vec<Entry> = (0..300)
            .map(|k| Entry {
                middle_m: [50.0 * spread(k, 0.618) - 5.0, 32.0 * spread(k, 0.414)],
                z_m: [9.5 * spread(k, 0.732), 9.5 * spread(k, 0.732) - 0.8],
                reach_m: 6.0 * spread(k, 0.236),
            })
            .collect();
        for _ in 0..2 {
            bins.fill(entries.iter().copied());
        }
        for k in 0..200 {
            let [x, y, z] = [
                44.0 * spread(k, 0.7),
                31.0 * spread(k, 0.3),
                9.0 * spread(k, 0.9),
            ];
            let place_m = Point3::new(x, y, z);
            let found: Vec<usize> = bins.near(&place_m).collect();
            let mut once = found.clone();
            once.sort_unstable();
            once.dedup();
            assert_eq!(once.len(), found.len());
            for (number, entry) in entries.iter().enumerate() {
                let [x_m, y_m] = entry.middle_m;
                let is_level = entry.z_m[1] <= z && z <= entry.z_m[0];
                if is_level && (x - x_m).hypot(y - y_m) <= entry.reach_m {
                    assert!(found.contains(&number));
                }
            }
        }
    }
}
