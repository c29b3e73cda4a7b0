//! Whether a ball fits from one place to another at all, on whatever lattice.
//!
//! Space is split into boxes, and only where a shortest path through what may be free leads: a box
//! is free where the ball fits at every place in it, closed where it fits at none, and else it is
//! split (S. Kambhampati, L. S. Davis, "Multiresolution path planning for mobile robots", IEEE
//! Journal of Robotics and Automation 2(3), 1986). Distances to solids change no faster than the
//! place, so that one distance decides about a box. What is closed is closed for good.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::{Point3, Vector3};
use rustc_hash::FxHashMap;

use crate::scenario::solid::Solids;
use crate::scenario::world::Bounds;

/// Boxes looked at: chosen here, some tenths of a second of work.
const MOST_BOXES: usize = 200_000;
/// Boxes passed by all searches for a path: chosen here, a second of work.
const MOST_STEPS: usize = 700_000;
/// Boxes are not split further (m): chosen here, below what a drone can hold its place to.
const SMALLEST_M: f64 = 0.02;
/// A ball this much smaller has to be stopped as well (m): what checks of plans forgive.
const FORGIVEN_M: f64 = 5e-3;
/// A box that may be free counts so many times its length: chosen here, so that detours through
/// free space come first.
const MIXED_FACTOR: f64 = 4.0;

/// What is known of a passage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Passage {
    /// The ball fits through.
    Open,
    /// It fits through nowhere.
    Closed,
    /// Boxes, steps or sizes ended first.
    Undecided,
}

/// What is known of a box of places.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Room {
    Free,
    Mixed,
    Closed,
    /// Split in two, from this index on.
    Split(u32),
}

/// A box of places that the ball's centre may be at.
#[derive(Clone, Copy, Debug)]
struct Cell {
    low_m: Vector3<f64>,
    high_m: Vector3<f64>,
    room: Room,
}

/// Whether a ball (m) gets from one place (m) to another with its centre within the bounds.
pub(crate) fn passage(
    bounds_m: &Bounds,
    solids: &Solids,
    radius_m: f64,
    [from_m, to_m]: [Point3<f64>; 2],
) -> Passage {
    let mut space = Space {
        solids,
        radius_m,
        cells: Vec::new(),
    };
    space.add(bounds_m.min.coords, bounds_m.max.coords);
    let mut steps = 0;
    let mut is_sure = true;
    loop {
        let ends = [from_m, to_m].map(|place_m| space.cell_at(&place_m.coords));
        let Some((path, reached)) = space.path(ends, &mut steps) else {
            return match is_sure && steps <= MOST_STEPS {
                true => Passage::Closed,
                false => Passage::Undecided,
            };
        };
        let is_mixed = |cell: &usize| space.cells[*cell].room == Room::Mixed;
        let sizes_m = path
            .iter()
            .filter(|it| is_mixed(it))
            .map(|it| space.size_m(*it));
        let Some(largest_m) = sizes_m.reduce(f64::max) else {
            return Passage::Open;
        };
        // All of that size at once: where one path is closed, the one beside it mostly is, too.
        let is_split = |cell: &usize| is_mixed(cell) && space.size_m(*cell) >= largest_m;
        let split: Vec<usize> = reached.into_iter().filter(is_split).collect();
        for cell in split {
            if !space.split(cell) {
                // Whether it is free stays open; other paths are looked at as if it were not.
                space.cells[cell].room = Room::Closed;
                is_sure = false;
            }
        }
        if space.cells.len() > MOST_BOXES || steps > MOST_STEPS {
            return Passage::Undecided;
        }
    }
}

/// All boxes so far; the first holds all others.
struct Space<'a> {
    solids: &'a Solids,
    radius_m: f64,
    cells: Vec<Cell>,
}

impl Space<'_> {
    /// Adds a box, by the distance of its middle from all solids.
    fn add(&mut self, low_m: Vector3<f64>, high_m: Vector3<f64>) {
        let middle_m = Point3::from(0.5 * (low_m + high_m));
        let half_m = 0.5 * (high_m - low_m).norm();
        let (distance_m, _) = self.solids.distance_to_point_m(middle_m);
        let room = match distance_m {
            far_m if far_m - half_m >= self.radius_m => Room::Free,
            near_m if near_m + half_m < self.radius_m - FORGIVEN_M => Room::Closed,
            _ => Room::Mixed,
        };
        self.cells.push(Cell {
            low_m,
            high_m,
            room,
        });
    }

    /// The longest side of a box (m).
    fn size_m(&self, cell: usize) -> f64 {
        let Cell { low_m, high_m, .. } = self.cells[cell];
        (high_m - low_m).max()
    }

    /// Halves a box along its longest side; `false` where it is too small for that.
    fn split(&mut self, cell: usize) -> bool {
        let Cell { low_m, high_m, .. } = self.cells[cell];
        let size_m = high_m - low_m;
        let axis = size_m.imax();
        if size_m[axis] < SMALLEST_M {
            return false;
        }
        let middle_m = 0.5 * (low_m[axis] + high_m[axis]);
        self.cells[cell].room = Room::Split(self.cells.len() as u32);
        let (mut below_m, mut above_m) = (high_m, low_m);
        (below_m[axis], above_m[axis]) = (middle_m, middle_m);
        self.add(low_m, below_m);
        self.add(above_m, high_m);
        true
    }

    /// The box that a place is in (m); of two that share it the first.
    fn cell_at(&self, place_m: &Vector3<f64>) -> usize {
        let mut cell = 0;
        while let Room::Split(first) = self.cells[cell].room {
            let low = &self.cells[first as usize];
            let is_low = (0..3).all(|axis| place_m[axis] <= low.high_m[axis]);
            cell = first as usize + usize::from(!is_low);
        }
        cell
    }

    /// A shortest path through boxes that are not closed (Dijkstra), and the boxes that it was
    /// looked for in, ascending; `None` where there is none.
    fn path(&self, [from, to]: [usize; 2], steps: &mut usize) -> Option<(Vec<usize>, Vec<usize>)> {
        let mut queue = BinaryHeap::from([(Reverse(0_u64), from)]);
        let mut known: FxHashMap<usize, (u64, usize)> = FxHashMap::default();
        known.insert(from, (0, from));
        while let Some((Reverse(cost), at)) = queue.pop() {
            if cost > known[&at].0 {
                continue;
            }
            if at == to {
                let before = |cell: &usize| Some(known[cell].1).filter(|it| it != cell);
                let path = std::iter::successors(Some(at), before).collect();
                let mut reached: Vec<usize> = known.keys().copied().collect();
                reached.sort_unstable();
                return Some((path, reached));
            }
            *steps += 1;
            if *steps > MOST_STEPS {
                return None;
            }
            self.beside(at, |next| {
                let total = cost + self.cost(at, next);
                if known.get(&next).is_none_or(|(least, _)| total < *least) {
                    known.insert(next, (total, at));
                    queue.push((Reverse(total), next));
                }
            });
        }
        None
    }

    /// From the middle of a box to that of another, in whole micrometres.
    fn cost(&self, from: usize, to: usize) -> u64 {
        let middle_m = |cell: &Cell| 0.5 * (cell.low_m + cell.high_m);
        let (from, to) = (&self.cells[from], &self.cells[to]);
        let factor = if to.room == Room::Mixed {
            MIXED_FACTOR
        } else {
            1.0
        };
        (factor * (middle_m(to) - middle_m(from)).norm() * 1e6) as u64 + 1
    }

    /// Calls `f` with the boxes that share a face with one and are not closed. Edges lead nowhere
    /// else: a place on an edge is in every box around it.
    fn beside(&self, cell: usize, mut f: impl FnMut(usize)) {
        let own = self.cells[cell];
        let mut stack = vec![0];
        while let Some(at) = stack.pop() {
            let other = &self.cells[at];
            let overlap = |axis: usize| {
                own.high_m[axis].min(other.high_m[axis]) - own.low_m[axis].max(other.low_m[axis])
            };
            let touching = (0..3).filter(|axis| overlap(*axis) == 0.0).count();
            if (0..3).any(|axis| overlap(axis) < 0.0) || touching > 1 {
                continue;
            }
            match other.room {
                Room::Split(first) => stack.extend([first as usize + 1, first as usize]),
                Room::Closed => {}
                _ if at != cell => f(at),
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::world::{Obstacle, Solid};

    fn block(min_m: [f64; 3], max_m: [f64; 3]) -> Obstacle {
        Obstacle {
            name: String::new(),
            shape: Solid::Box {
                min_m: min_m.into(),
                max_m: max_m.into(),
            },
        }
    }

    /// Through a slit (m) in a wall across a room, beside every lattice.
    fn through(slit_m: f64, radius_m: f64) -> Passage {
        let bounds_m = Bounds {
            min: Point3::origin(),
            max: Point3::new(10.0, 6.0, 3.0),
        };
        let begins_m = 2.137;
        let walls = [
            block([4.0, 0.0, 0.0], [4.5, begins_m, 3.0]),
            block([4.0, begins_m + slit_m, 0.0], [4.5, 6.0, 3.0]),
        ];
        let ends = [Point3::new(1.0, 5.0, 1.0), Point3::new(9.0, 1.0, 2.0)];
        passage(&bounds_m, &Solids::new(&walls), radius_m, ends)
    }

    #[test]
    fn a_slit_is_open_for_what_fits_and_closed_for_what_does_not() {
        for slit_m in [0.4, 0.7] {
            assert_eq!(
                through(slit_m, 0.5 * slit_m - 0.08),
                Passage::Open,
                "{slit_m}"
            );
            assert_eq!(
                through(slit_m, 0.5 * slit_m + 0.05),
                Passage::Closed,
                "{slit_m}"
            );
        }
    }

    #[test]
    fn what_is_too_close_to_call_is_not_called_closed() {
        assert_ne!(through(0.7, 0.35), Passage::Closed);
        assert_ne!(through(0.7, 0.352), Passage::Closed);
    }

    #[test]
    fn a_room_without_walls_is_open() {
        let bounds_m = Bounds {
            min: Point3::origin(),
            max: Point3::new(10.0, 6.0, 3.0),
        };
        let ends = [Point3::new(1.0, 5.0, 1.0), Point3::new(9.0, 1.0, 2.0)];
        assert_eq!(
            passage(&bounds_m, &Solids::new(&[]), 0.4, ends),
            Passage::Open
        );
    }
}
