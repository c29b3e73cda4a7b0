//! How far it is at least to a goal past columns that are closed from bottom to top: a search on
//! the floor.
//!
//! Seen from above a path through the air is a path from column to column, each of them open
//! somewhere. No step takes less than its part along the floor, and every layer that it climbs or
//! descends takes some more. So the shortest path on the floor, and the height, bound the path
//! through the air from below, for an eighth of the work in a hall of eight layers.

use super::buckets::Buckets;
use super::mover::{UNREACHABLE, diagonals_first};
use crate::graph::lattice::{Lattice, NEIGHBOURS};

/// A search backwards from the goal's column that can be resumed, led towards where the drone comes
/// from.
#[derive(Debug)]
pub(crate) struct Floor<'a> {
    /// Whose columns are walked.
    lattice: &'a Lattice,
    from: [i32; 3],
    goal: [i32; 3],
    /// Ticks of a step along one, two and three axes.
    steps: [u32; 3],
    /// By column, ticks known so far; exact where `done`, and nothing where it is closed.
    ticks: Vec<u32>,
    /// By column, whether its ticks are exact.
    done: Vec<bool>,
    /// Columns by ticks so far plus the least that may be missing to where the drone comes from.
    buckets: Buckets,
    /// The bucket whose columns are expanded.
    now: usize,
}

impl<'a> Floor<'a> {
    /// From a place to a goal on a lattice, given the ticks of a step along one, two and three
    /// axes.
    pub(super) fn new(lattice: &'a Lattice, [from, goal]: [u32; 2], steps: [u32; 3]) -> Floor<'a> {
        let [nx, ny, _] = lattice.counts();
        let mut floor = Floor {
            lattice,
            from: lattice.steps(from),
            goal: lattice.steps(goal),
            steps,
            ticks: vec![UNREACHABLE; nx * ny],
            done: vec![false; nx * ny],
            buckets: Buckets::default(),
            now: 0,
        };
        let column = lattice.column(goal);
        floor.ticks[column] = 0;
        let lead = floor.lead(floor.goal);
        floor.buckets.push(lead as usize, column as u32);
        floor
    }

    /// Raises what is known of a place by so many ticks, if it is not known for good before.
    /// Whether a column is open is asked with the least ticks to it from where the drone comes.
    pub(crate) fn extend_bound(&mut self, place: u32, by: u32, is_open: impl Fn(u32, u32) -> bool) {
        let column = self.lattice.column(place);
        let until = self.now.saturating_add(by as usize);
        while !self.done[column] && self.now < until.min(self.buckets.len()) {
            match self.buckets.pop(self.now) {
                Some(column) => self.settle(column, &is_open),
                None => self.now += 1,
            }
        }
    }

    /// Ticks from a place to the goal at least, or [`UNREACHABLE`], as far as they are known, and
    /// whether that is for good.
    pub(crate) fn at_least(&self, place: u32) -> (u32, bool) {
        let column = self.lattice.column(place);
        let at = self.lattice.steps(place);
        if self.done[column] {
            (self.in_the_air(at, self.ticks[column]), true)
        } else if self.now < self.buckets.len() {
            let ticks = (self.now as u32).saturating_sub(self.lead(at));
            (self.in_the_air(at, ticks), false)
        } else {
            (UNREACHABLE, true)
        }
    }

    /// What the ticks on the floor, the height, and the goal beyond it bound together.
    fn in_the_air(&self, at: [i32; 3], ticks: u32) -> u32 {
        let [one, two, three] = self.steps;
        let a_layer = one.min(two - one).min(three - two);
        let climb = at[2].abs_diff(self.goal[2]) * a_layer;
        (ticks + climb).max(diagonals_first(at, self.goal, self.steps))
    }

    /// Ticks on the floor from where the drone comes, at least.
    fn lead(&self, [x, y, _]: [i32; 3]) -> u32 {
        diagonals_first([x, y, 0], [self.from[0], self.from[1], 0], self.steps)
    }

    /// Makes the ticks of a column exact, and passes them on to the eight around it.
    fn settle(&mut self, column: u32, is_open: &impl Fn(u32, u32) -> bool) {
        if std::mem::replace(&mut self.done[column as usize], true) {
            return;
        }
        let here = self.ticks[column as usize];
        // Of the lowest layer, they are numbered alike.
        let [x, y, _] = self.lattice.steps(column);
        // The eight in one layer.
        for [dx, dy, _] in &NEIGHBOURS[9..17] {
            let at = [x + dx, y + dy, 0];
            let Some(to) = self.lattice.at(at) else {
                continue;
            };
            let axes = (dx * dx + dy * dy) as usize;
            let ticks = here + self.steps[axes - 1];
            // What is done is not farther.
            if ticks < self.ticks[to as usize] {
                let lead = self.lead(at);
                if is_open(to, lead) {
                    self.ticks[to as usize] = ticks;
                    self.buckets.push((ticks + lead) as usize, to);
                } else {
                    // Nothing is less: it is not asked for again.
                    self.ticks[to as usize] = 0;
                }
            }
        }
    }
}
