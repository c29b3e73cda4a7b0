//! How long the rest of the way takes: the search's heuristic, exact on an empty roadmap.
//!
//! Between two lattice places with nothing in the box between them the answer is closed (diagonal
//! steps first). Otherwise it comes from a Dijkstra search backwards from the goal that is led towards
//! the place the drone comes from and stops as soon as it knows what is asked: "reverse resumable A*"
//! (D. Silver, "Cooperative pathfinding", AIIDE 2005). Its queue is an array of buckets, one a tick
//! (R. Dial, "Algorithm 360", Communications of the ACM 12, 1969): durations are small whole numbers.

use std::sync::{Mutex, PoisonError};

use costmap::leg::Tick;
use nalgebra::Point3;

use crate::lattice::Lattice;
use crate::roadmap::{Roadmap, Vertex, Way};

/// What limits a drone on a roadmap.
#[derive(Clone, Debug, PartialEq)]
pub struct Mover {
    speed_mps: f64,
    radius_m: f64,
    /// The stops it may use; others' are not for it.
    stops: Vec<Vertex>,
    /// Lengths of the lattice's steps along one, two and three axes (m), and their ticks.
    steps: [(f32, u32); 3],
}

impl Mover {
    /// A ball of `radius_m` at `speed_mps` that may use these stops beyond the lattice.
    pub fn new(lattice: &Lattice, speed_mps: f64, radius_m: f64, stops: Vec<Vertex>) -> Mover {
        let mut mover = Mover {
            speed_mps,
            radius_m,
            stops,
            steps: [(0.0, 0); 3],
        };
        mover.steps = lattice
            .step_lengths_m()
            .map(|length_m| (length_m, mover.duration(f64::from(length_m))));
        mover
    }

    /// The stops beyond the lattice that it may use.
    pub(crate) fn stops(&self) -> &[Vertex] {
        &self.stops
    }

    /// Whole ticks that a way takes; `None` where it may not go.
    pub fn ticks(&self, roadmap: &Roadmap, to: Vertex, way: Way) -> Option<u32> {
        if !way.fits(self.radius_m) || (roadmap.is_stop(to) && !self.stops.contains(&to)) {
            return None;
        }
        let step = self
            .steps
            .iter()
            .find(|(length_m, _)| *length_m == way.length_m);
        Some(step.map_or_else(
            || self.duration(f64::from(way.length_m)),
            |(_, ticks)| *ticks,
        ))
    }

    /// Whole ticks that a length takes, at least one.
    fn duration(&self, length_m: f64) -> u32 {
        Tick::lasting(length_m / self.speed_mps).max(1)
    }

    /// Ticks of a step along one, two and three axes, if diagonals first is always shortest.
    fn diagonal_steps(&self) -> Option<[u32; 3]> {
        let [a, b, c] = self.steps.map(|(_, ticks)| ticks);
        (b <= 2 * a && c <= a + b && a + c <= 2 * b).then_some([a, b, c])
    }
}

/// Ticks from anywhere to one goal for one drone with nobody else there.
#[derive(Debug)]
pub struct Distances {
    goal: Vertex,
    mover: Mover,
    /// Lattice places next to the goal, and the ticks from there.
    anchors: Vec<([i32; 3], u32)>,
    /// Where the answer is closed, ticks of a step along one, two and three axes.
    closed_form: Option<[u32; 3]>,
    backwards: Mutex<Backwards>,
}

/// No way at all.
pub const UNREACHABLE: u32 = u32::MAX;

impl Distances {
    /// Nothing is computed yet; the drone will come from `towards`.
    pub fn new(roadmap: &Roadmap, goal: Vertex, towards: Vertex, mover: Mover) -> Distances {
        let lattice = roadmap.lattice();
        let anchors = if roadmap.is_stop(goal) {
            roadmap
                .ways(goal)
                .filter(|(to, _)| !roadmap.is_stop(*to))
                .filter_map(|(to, way)| {
                    let ticks = mover.ticks(roadmap, to, way)?;
                    Some((lattice.steps(to), ticks))
                })
                .collect()
        } else {
            vec![(lattice.steps(goal), 0)]
        };
        // A stop with ways to other stops is left to the search.
        let plain =
            !roadmap.is_stop(goal) || roadmap.ways(goal).all(|(to, _)| !roadmap.is_stop(to));
        Distances {
            goal,
            closed_form: mover.diagonal_steps().filter(|_| plain),
            backwards: Mutex::new(Backwards::new(roadmap, towards, &mover)),
            mover,
            anchors,
        }
    }

    /// The goal.
    pub fn goal(&self) -> Vertex {
        self.goal
    }

    /// Ticks to the goal, or [`UNREACHABLE`].
    pub fn ticks(&self, roadmap: &Roadmap, from: Vertex) -> u32 {
        if from == self.goal {
            return 0;
        }
        if let Some(ticks) = self.straight(roadmap, from) {
            return ticks;
        }
        // A panic elsewhere leaves at worst a search begun anew.
        let mut backwards = self
            .backwards
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        backwards.ticks(roadmap, &self.mover, self.goal, from)
    }

    /// Closed form, where nothing is in between.
    fn straight(&self, roadmap: &Roadmap, from: Vertex) -> Option<u32> {
        if !roadmap.is_stop(from) {
            return self.straight_from_lattice(roadmap, from);
        }
        let mut best = None;
        for (to, way) in roadmap.ways(from) {
            let Some(ticks) = self.mover.ticks(roadmap, to, way) else {
                continue;
            };
            if roadmap.is_stop(to) {
                return None;
            }
            let total = ticks + self.straight_from_lattice(roadmap, to)?;
            best = Some(best.map_or(total, |known: u32| known.min(total)));
        }
        best
    }

    fn straight_from_lattice(&self, roadmap: &Roadmap, from: Vertex) -> Option<u32> {
        let steps = self.closed_form?;
        let narrow = roadmap.narrow(self.mover.radius_m)?;
        let from = roadmap.lattice().steps(from);
        let mut best = None;
        for (anchor, ticks) in &self.anchors {
            if !narrow.is_free(from, *anchor) {
                return None;
            }
            let total = ticks + diagonals_first(from, *anchor, steps);
            best = Some(best.map_or(total, |known: u32| known.min(total)));
        }
        best
    }
}

/// A search from the goal that can be resumed.
#[derive(Debug)]
struct Backwards {
    lead: Lead,
    /// Ticks known so far; exact where `done`.
    ticks: Vec<u32>,
    done: Vec<bool>,
    /// Places by ticks so far plus the least that may be missing to where the drone comes from.
    buckets: Vec<Vec<Vertex>>,
    now: usize,
}

/// A consistent lower bound of the ticks from where the drone comes.
#[derive(Clone, Copy, Debug)]
enum Lead {
    /// On the lattice alone: diagonals first.
    Steps([i32; 3], [u32; 3]),
    /// With stops beyond it: the straight line (m, ticks per metre).
    Line(Point3<f64>, f64),
}

impl Lead {
    fn ticks(&self, roadmap: &Roadmap, place: Vertex) -> u32 {
        match self {
            Lead::Steps(towards, steps) => {
                diagonals_first(roadmap.lattice().steps(place), *towards, *steps)
            }
            Lead::Line(towards_m, ticks_per_m) => {
                ((roadmap.position_m(place) - towards_m).norm() * ticks_per_m) as u32
            }
        }
    }
}

impl Backwards {
    fn new(roadmap: &Roadmap, towards: Vertex, mover: &Mover) -> Backwards {
        let lead = match mover.diagonal_steps() {
            Some(steps) if mover.stops.is_empty() => {
                Lead::Steps(roadmap.lattice().steps(towards), steps)
            }
            // A part in 10⁶ forgives lengths kept in single precision.
            _ => Lead::Line(
                roadmap.position_m(towards),
                (1.0 - 1e-6) * Tick::PER_SECOND / mover.speed_mps,
            ),
        };
        Backwards {
            lead,
            ticks: Vec::new(),
            done: Vec::new(),
            buckets: Vec::new(),
            now: 0,
        }
    }

    fn ticks(&mut self, roadmap: &Roadmap, mover: &Mover, goal: Vertex, from: Vertex) -> u32 {
        if self.ticks.is_empty() {
            self.ticks = vec![UNREACHABLE; roadmap.place_count()];
            self.done = vec![false; roadmap.place_count()];
            self.ticks[goal as usize] = 0;
            self.queue(roadmap, goal, 0);
        }
        while !self.done[from as usize] && self.now < self.buckets.len() {
            match self.buckets[self.now].pop() {
                Some(place) => self.settle(roadmap, mover, place),
                None => self.now += 1,
            }
        }
        self.ticks[from as usize]
    }

    fn settle(&mut self, roadmap: &Roadmap, mover: &Mover, place: Vertex) {
        if std::mem::replace(&mut self.done[place as usize], true) {
            return;
        }
        let here = self.ticks[place as usize];
        for (to, way) in roadmap.ways(place) {
            if self.done[to as usize] {
                continue;
            }
            let Some(duration) = mover.ticks(roadmap, to, way) else {
                continue;
            };
            if here + duration < self.ticks[to as usize] {
                self.ticks[to as usize] = here + duration;
                self.queue(roadmap, to, here + duration);
            }
        }
    }

    fn queue(&mut self, roadmap: &Roadmap, place: Vertex, ticks: u32) {
        let bucket = (ticks + self.lead.ticks(roadmap, place)) as usize;
        if self.buckets.len() <= bucket {
            self.buckets.resize_with(bucket + 1, Vec::new);
        }
        self.buckets[bucket].push(place);
    }
}

fn diagonals_first(a: [i32; 3], b: [i32; 3], [one, two, three]: [u32; 3]) -> u32 {
    let mut d = [0, 1, 2].map(|axis| a[axis].abs_diff(b[axis]));
    d.sort_unstable();
    d[0] * three + (d[1] - d[0]) * two + (d[2] - d[1]) * one
}

#[cfg(test)]
mod tests;
