//! Whether a ball fits from one place to another at all, on whatever lattice.
//!
//! Space is split into boxes, and only where a shortest path through what may be free leads: a box
//! is free where the ball fits at every place in it, closed where it fits at none, and else it is
//! split (S. Kambhampati, L. S. Davis, "Multiresolution path planning for mobile robots", IEEE
//! Journal of Robotics and Automation 2(3), 1986), along the side on which the distance to solids
//! changes most: along a slit boxes stay long. What is closed is closed for good.

use std::cell::RefCell;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::{Point3, Vector3};
use rustc_hash::FxHashMap;

use crate::scenario::solid::Solids;
use crate::scenario::world::{Bounds, World};

/// Boxes looked at: chosen here, some tenths of a second of work.
const MOST_BOXES: usize = 80_000;
/// Boxes passed by all searches for a path: chosen here, a second of work.
const MOST_STEPS: usize = 700_000;
/// Boxes are not split further (m): chosen here, below what a drone can hold its place to.
const SMALLEST_M: f64 = 0.02;
/// A ball this much smaller has to be stopped as well (m): what checks of plans forgive.
const FORGIVEN_M: f64 = 5e-3;
/// A side is split for its length as well, which counts so much of what the distance changes by on
/// it: chosen here, what is between two solids may change nothing half-way.
const LENGTH_FACTOR: f64 = 0.05;
/// How often a box is halved to find that the ball fits at none of its places: chosen here.
const MOST_HALVINGS: u32 = 4;
/// Steps of a search for a place on a face where the ball fits: chosen here.
const MOST_COMPASS_STEPS: usize = 24;
/// A box that may be free counts so many times its length: chosen here, so that detours through
/// free space come first.
const MIXED_FACTOR: f64 = 4.0;

/// What is known of a passage.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Passage {
    /// The ball fits through, along these places (m) with straight pieces between them, both ends
    /// among them.
    Open(Vec<Point3<f64>>),
    /// It fits through nowhere.
    Closed,
    /// Boxes, steps or sizes ended first.
    Undecided,
}

/// Passages among the solids of a world, each looked for once: a fleet that is planned by other
/// rules asks for the same again.
#[derive(Debug)]
pub(crate) struct Passages {
    /// Of the world.
    pub(crate) solids: Solids,
    known: RefCell<Vec<(PassageKey, Passage)>>,
}

/// Bounds, radius (m) and ends (m) of a passage.
type PassageKey = (Bounds, f64, [Point3<f64>; 2]);

impl Passages {
    /// None is known yet.
    pub(crate) fn of(world: &World) -> Passages {
        Passages {
            solids: Solids::of(world),
            known: RefCell::default(),
        }
    }

    /// [`passage`] among these solids.
    pub(crate) fn find(
        &self,
        bounds_m: &Bounds,
        radius_m: f64,
        ends_m: [Point3<f64>; 2],
    ) -> Passage {
        let key = (*bounds_m, radius_m, ends_m);
        let known = self.known.borrow();
        if let Some((_, passage)) = known.iter().find(|(other, _)| *other == key) {
            return passage.clone();
        }
        drop(known);
        let found = passage(bounds_m, &self.solids, radius_m, ends_m);
        self.known.borrow_mut().push((key, found.clone()));
        found
    }
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
struct PlaceBox {
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
        if let Some(places_m) = space.flown_m(&path, [from_m, to_m]) {
            return Passage::Open(space.taut_m(&places_m));
        }
        let is_mixed = |cell: &usize| space.cells[*cell].room == Room::Mixed;
        let sizes_m = path
            .iter()
            .filter(|it| is_mixed(it))
            .map(|it| space.size_m(*it));
        let Some(largest_m) = sizes_m.reduce(f64::max) else {
            // Free boxes whose faces the rounding of distances refuses.
            return Passage::Undecided;
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
    cells: Vec<PlaceBox>,
}

impl Space<'_> {
    /// Adds a box.
    fn add(&mut self, low_m: Vector3<f64>, high_m: Vector3<f64>) {
        let room = match self.distance_m(0.5 * (low_m + high_m)) {
            here_m if here_m >= self.radius_m => {
                let corners_m = [low_m, high_m].map(Point3::from);
                match self.solids.box_clearance_m(corners_m, self.radius_m) >= self.radius_m {
                    true => Room::Free,
                    false => Room::Mixed,
                }
            }
            _ if self.is_closed([low_m, high_m], MOST_HALVINGS) => Room::Closed,
            _ => Room::Mixed,
        };
        self.cells.push(PlaceBox {
            low_m,
            high_m,
            room,
        });
    }

    /// Of a place from all solids (m).
    fn distance_m(&self, place_m: Vector3<f64>) -> f64 {
        self.solids.distance_to_point_m(Point3::from(place_m)).0
    }

    /// Whether the ball fits at no place of a box (m): distances change no faster than the place.
    fn is_closed(&self, [low_m, high_m]: [Vector3<f64>; 2], halvings: u32) -> bool {
        let size_m = high_m - low_m;
        let middle_m = 0.5 * (low_m + high_m);
        let within_m = self.radius_m - FORGIVEN_M;
        let room_m = within_m - self.distance_m(middle_m);
        if room_m <= 0.0 || room_m > 0.5 * size_m.norm() {
            return room_m > 0.0;
        }
        if self
            .solids
            .cover_box([low_m, high_m].map(Point3::from), within_m)
        {
            return true;
        }
        let Some(left) = halvings.checked_sub(1) else {
            return false;
        };
        let axis = size_m.imax();
        let (mut below_m, mut above_m) = (high_m, low_m);
        (below_m[axis], above_m[axis]) = (middle_m[axis], middle_m[axis]);
        self.is_closed([low_m, below_m], left) && self.is_closed([above_m, high_m], left)
    }

    /// The longest side of a box (m).
    fn size_m(&self, cell: usize) -> f64 {
        let PlaceBox { low_m, high_m, .. } = self.cells[cell];
        (high_m - low_m).max()
    }

    /// Halves a box on the side on which the distance changes most; `false` where it is too small
    /// for that.
    fn split(&mut self, cell: usize) -> bool {
        let PlaceBox { low_m, high_m, .. } = self.cells[cell];
        let size_m = high_m - low_m;
        let middle_m = 0.5 * (low_m + high_m);
        let here_m = self.distance_m(middle_m);
        let weight_m = |axis: &usize| {
            let changes_m = [-0.5, 0.5].map(|share| {
                let mut end_m = middle_m;
                end_m[*axis] += share * size_m[*axis];
                (self.distance_m(end_m) - here_m).abs()
            });
            changes_m[0].max(changes_m[1]) + LENGTH_FACTOR * size_m[*axis]
        };
        let axes = (0..3).filter(|axis| size_m[*axis] >= SMALLEST_M);
        let Some(axis) = axes.max_by(|a, b| weight_m(a).total_cmp(&weight_m(b))) else {
            return false;
        };
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

    /// Places (m) on the faces between boxes, given from the last to the first, that the ball flies
    /// straight between from one place to another; `None` where it does not fit there, as far as
    /// that is looked for.
    fn flown_m(
        &self,
        path: &[usize],
        [from_m, to_m]: [Point3<f64>; 2],
    ) -> Option<Vec<Point3<f64>>> {
        let mut places_m = vec![from_m];
        for pair in path.windows(2).rev() {
            let [a, b] = [pair[0], pair[1]].map(|cell| &self.cells[cell]);
            let face_m = [a.low_m.sup(&b.low_m), a.high_m.inf(&b.high_m)];
            places_m.push(self.roomiest_m(face_m)?);
        }
        places_m.push(to_m);
        let is_free = |pair: &[Point3<f64>]| self.is_free(pair[0], pair[1]);
        places_m.windows(2).all(is_free).then_some(places_m)
    }

    /// A place on a face between two boxes (m) where the ball fits, found by compass search.
    fn roomiest_m(&self, [low_m, high_m]: [Vector3<f64>; 2]) -> Option<Point3<f64>> {
        let mut best_m = 0.5 * (low_m + high_m);
        let mut room_m = self.distance_m(best_m);
        let mut step_m = 0.5 * (high_m - low_m);
        for _ in 0..MOST_COMPASS_STEPS {
            // Too little room for steps of this length.
            if room_m >= self.radius_m || room_m + 2.0 * step_m.norm() < self.radius_m {
                break;
            }
            let mut moved = false;
            for (axis, sign) in [
                (0, 1.0),
                (0, -1.0),
                (1, 1.0),
                (1, -1.0),
                (2, 1.0),
                (2, -1.0),
            ] {
                let mut there_m = best_m;
                there_m[axis] += sign * step_m[axis];
                there_m[axis] = there_m[axis].clamp(low_m[axis], high_m[axis]);
                let there_room_m = self.distance_m(there_m);
                if there_room_m > room_m {
                    (best_m, room_m, moved) = (there_m, there_room_m, true);
                }
            }
            if !moved {
                step_m *= 0.5;
            }
        }
        (room_m >= self.radius_m).then(|| Point3::from(best_m))
    }

    /// Whether the ball flies straight from one place to another (m).
    fn is_free(&self, from_m: Point3<f64>, to_m: Point3<f64>) -> bool {
        let clear_m = (self.solids).segment_clearance_m(from_m, to_m, self.radius_m);
        clear_m >= self.radius_m
    }

    /// As few of some places (m) as the ball can fly straight between.
    fn taut_m(&self, all_m: &[Point3<f64>]) -> Vec<Point3<f64>> {
        let mut taut_m = vec![all_m[0]];
        let mut at = 0;
        while at + 1 < all_m.len() {
            let mut seen = (at + 2..all_m.len()).rev();
            let seen = seen.find(|next| self.is_free(all_m[at], all_m[*next]));
            at = seen.unwrap_or(at + 1);
            taut_m.push(all_m[at]);
        }
        taut_m.dedup();
        taut_m
    }

    /// From the middle of a box to that of another, in whole micrometres.
    fn cost(&self, from: usize, to: usize) -> u64 {
        let middle_m = |cell: &PlaceBox| 0.5 * (cell.low_m + cell.high_m);
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

    const ROOM: Bounds = Bounds {
        min: Point3::new(0.0, 0.0, 0.0),
        max: Point3::new(10.0, 6.0, 3.0),
    };
    const ENDS_M: [Point3<f64>; 2] = [Point3::new(1.0, 5.0, 1.0), Point3::new(9.0, 1.0, 2.0)];

    /// A wall across the room with a slit (m) in it, beside every lattice.
    fn walls(slit_m: f64) -> [Obstacle; 2] {
        let begins_m = 2.137;
        [
            block([4.0, 0.0, 0.0], [4.5, begins_m, 3.0]),
            block([4.0, begins_m + slit_m, 0.0], [4.5, 6.0, 3.0]),
        ]
    }

    fn through(slit_m: f64, radius_m: f64) -> Passage {
        passage(&ROOM, &Solids::new(&walls(slit_m)), radius_m, ENDS_M)
    }

    #[test]
    fn a_slit_is_open_for_what_fits_and_closed_for_what_does_not() {
        for slit_m in [0.4, 0.7] {
            let radius_m = 0.5 * slit_m - 0.08;
            let Passage::Open(path_m) = through(slit_m, radius_m) else {
                panic!("{slit_m}");
            };
            let walls = walls(slit_m);
            let solids = Solids::new(&walls);
            assert!(path_m.len() < 8, "{path_m:?}");
            for pair in path_m.windows(2) {
                let clear_m = solids.segment_clearance_m(pair[0], pair[1], 1.0);
                assert!(clear_m >= radius_m - 1e-6, "{clear_m} {path_m:?}");
            }
            let wide_m = 0.5 * slit_m + 0.05;
            assert_eq!(through(slit_m, wide_m), Passage::Closed, "{slit_m}");
        }
    }

    #[test]
    fn what_is_too_close_to_call_is_not_called_closed() {
        assert_ne!(through(0.7, 0.35), Passage::Closed);
        assert_ne!(through(0.7, 0.352), Passage::Closed);
    }

    #[test]
    fn a_room_without_walls_is_flown_through_straight() {
        let none = Solids::new(&[]);
        let path = passage(&ROOM, &none, 0.4, ENDS_M);
        assert_eq!(path, Passage::Open(ENDS_M.to_vec()));
    }
}
