//! Length of the shortest path between two cells, as benchmarks of path finding state it beside
//! every pair.
//!
//! Steps go to the 26 cells around (8 on a plan), by 1, √2 or √3; a diagonal step needs every cell
//! of the box that it crosses to be free, so that no corner is cut.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use super::grid::Grid;

/// A*, with its tables kept from one pair to the next.
pub(super) struct Shortest<'a> {
    grid: &'a Grid,
    /// Nothing is in between, so that every path is straight.
    empty: bool,
    length: Vec<f64>,
    /// Cells whose length is not infinite.
    touched: Vec<usize>,
}

/// Length along a path through free space: least so far plus the least that remains.
#[derive(PartialEq)]
struct Open {
    estimate: f64,
    index: usize,
}

impl Eq for Open {}

impl Ord for Open {
    fn cmp(&self, other: &Open) -> Ordering {
        self.estimate
            .total_cmp(&other.estimate)
            .then(self.index.cmp(&other.index))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Open) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<'a> Shortest<'a> {
    pub(super) fn new(grid: &'a Grid) -> Shortest<'a> {
        Shortest {
            grid,
            empty: grid.blocked().next().is_none(),
            length: vec![f64::INFINITY; grid.cells()],
            touched: Vec::new(),
        }
    }

    /// Length in cells; `None` where there is no path.
    pub(super) fn between(&mut self, start: [usize; 3], goal: [usize; 3]) -> Option<f64> {
        if self.empty {
            return Some(unobstructed(start, goal));
        }
        for index in self.touched.drain(..) {
            self.length[index] = f64::INFINITY;
        }
        let mut open = BinaryHeap::new();
        self.reach(start, 0.0, goal, &mut open);
        while let Some(Reverse(Open { estimate, index })) = open.pop() {
            let here = self.grid.cell(index);
            let length = self.length[index];
            if here == goal {
                return Some(length);
            }
            if estimate > length + unobstructed(here, goal) {
                continue;
            }
            for (next, step) in steps(self.grid, here) {
                self.reach(next, length + step, goal, &mut open);
            }
        }
        None
    }

    fn reach(
        &mut self,
        cell: [usize; 3],
        length: f64,
        goal: [usize; 3],
        open: &mut BinaryHeap<Reverse<Open>>,
    ) {
        let index = self.grid.index(cell);
        if length < self.length[index] {
            if self.length[index].is_infinite() {
                self.touched.push(index);
            }
            self.length[index] = length;
            let estimate = length + unobstructed(cell, goal);
            open.push(Reverse(Open { estimate, index }));
        }
    }
}

/// Length of the path with nothing in between: diagonals first.
pub(super) fn unobstructed(a: [usize; 3], b: [usize; 3]) -> f64 {
    let mut along = [0, 1, 2].map(|axis| a[axis].abs_diff(b[axis]));
    along.sort_unstable();
    let [least, middle, most] = along.map(|cells| cells as f64);
    3_f64.sqrt() * least + 2_f64.sqrt() * (middle - least) + (most - middle)
}

fn steps(grid: &Grid, [x, y, z]: [usize; 3]) -> impl Iterator<Item = ([usize; 3], f64)> {
    let beside = |at: usize| at.saturating_sub(1)..=at + 1;
    let around =
        beside(z).flat_map(move |z| beside(y).flat_map(move |y| beside(x).map(move |x| [x, y, z])));
    around.filter_map(move |to| {
        let spans = |a: usize, b: usize| a.min(b)..=a.max(b);
        let clear = spans(z, to[2])
            .all(|z| spans(y, to[1]).all(|y| spans(x, to[0]).all(|x| !grid.is_blocked([x, y, z]))));
        (clear && to != [x, y, z]).then(|| (to, unobstructed([x, y, z], to)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_go_straight_where_they_can_and_around_corners_where_they_must() {
        let mut grid = Grid::open("test".to_owned(), [5, 5, 1]);
        // Far off: nothing is in between, but the search runs.
        grid.block([4, 0, 0], [5, 1, 1]);
        let length = Shortest::new(&grid).between([0, 1, 0], [3, 2, 0]);
        assert!((length.expect("a path") - (2.0 + 2_f64.sqrt())).abs() < 1e-12);
        // A wall from the top edge down to y = 3, at x = 2.
        grid.block([2, 0, 0], [3, 4, 1]);
        let mut shortest = Shortest::new(&grid);
        // Down beside the wall to y = 4, two steps below it, up again: no corner is cut.
        let length = shortest.between([1, 2, 0], [3, 2, 0]);
        assert!((length.expect("a path") - 6.0).abs() < 1e-12, "{length:?}");
        assert_eq!(shortest.between([1, 2, 0], [1, 2, 0]), Some(0.0));
        grid.block([2, 4, 0], [3, 5, 1]);
        assert_eq!(Shortest::new(&grid).between([1, 2, 0], [3, 2, 0]), None);
    }
}
