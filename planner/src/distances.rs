//! How long the rest of the way takes: the search's heuristic, exact on an empty roadmap.
//!
//! Between two lattice places with nothing in the box between them the answer is closed (diagonal
//! steps first). Otherwise it comes from a Dijkstra search backwards from the goal, made once when
//! first asked for. Its queue is an array of buckets, one a tick (R. Dial, "Algorithm 360",
//! Communications of the ACM 12, 1969): durations are small whole numbers.

use std::sync::OnceLock;

use costmap::leg::Tick;

use crate::roadmap::{Roadmap, Vertex, Way};

/// What limits a drone on a roadmap.
#[derive(Clone, Debug, PartialEq)]
pub struct Mover {
    /// m/s.
    pub speed_mps: f64,
    /// Radius of the ball that must fit (m).
    pub radius_m: f64,
    /// The stops it may use; others' are not for it.
    pub stops: Vec<Vertex>,
}

impl Mover {
    /// Whole ticks that a way takes; `None` where it may not go.
    pub fn ticks(&self, roadmap: &Roadmap, to: Vertex, way: Way) -> Option<u32> {
        if !way.fits(self.radius_m) || (roadmap.is_stop(to) && !self.stops.contains(&to)) {
            return None;
        }
        Some(self.duration(f64::from(way.length_m)))
    }

    /// Whole ticks that a length takes, at least one.
    pub fn duration(&self, length_m: f64) -> u32 {
        Tick::lasting(length_m / self.speed_mps).max(1)
    }
}

/// Ticks from anywhere to one goal for one drone with nobody else there.
#[derive(Debug)]
pub struct Distances {
    goal: Vertex,
    mover: Mover,
    /// Lattice places next to the goal, and the ticks from there.
    anchors: Vec<([i32; 3], u32)>,
    /// Ticks of a step along one, two and three axes; `None` where diagonals first is not shortest.
    steps: Option<[u32; 3]>,
    table: OnceLock<Vec<u32>>,
}

/// No way at all.
pub const UNREACHABLE: u32 = u32::MAX;

impl Distances {
    /// Nothing is computed yet.
    pub fn new(roadmap: &Roadmap, goal: Vertex, mover: Mover) -> Distances {
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
        let [a, b, c] = [1.0_f64, 2.0, 3.0].map(|square| {
            let length_m = (square.sqrt() * lattice.cell_m()) as f32;
            mover.duration(f64::from(length_m))
        });
        let diagonals_first = b <= 2 * a && c <= a + b && a + c <= 2 * b;
        // A stop with ways to other stops is left to the table.
        let plain = !roadmap.is_stop(goal) || roadmap.ways(goal).all(|(to, _)| !roadmap.is_stop(to));
        Distances {
            goal,
            mover,
            anchors,
            steps: (diagonals_first && plain).then_some([a, b, c]),
            table: OnceLock::new(),
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
        if let Some(table) = self.table.get() {
            return table[from as usize];
        }
        if let Some(ticks) = self.straight(roadmap, from) {
            return ticks;
        }
        self.table.get_or_init(|| self.search(roadmap))[from as usize]
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
            if to == self.goal || roadmap.is_stop(to) {
                return None;
            }
            let total = ticks + self.straight_from_lattice(roadmap, to)?;
            best = Some(best.map_or(total, |known: u32| known.min(total)));
        }
        best
    }

    fn straight_from_lattice(&self, roadmap: &Roadmap, from: Vertex) -> Option<u32> {
        let steps = self.steps?;
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

    fn search(&self, roadmap: &Roadmap) -> Vec<u32> {
        let mut ticks = vec![UNREACHABLE; roadmap.len()];
        let mut buckets: Vec<Vec<Vertex>> = vec![vec![self.goal]];
        ticks[self.goal as usize] = 0;
        let mut now = 0;
        while now < buckets.len() {
            for vertex in std::mem::take(&mut buckets[now]) {
                if ticks[vertex as usize] < now as u32 {
                    continue;
                }
                for (to, way) in roadmap.ways(vertex) {
                    let Some(duration) = self.mover.ticks(roadmap, to, way) else {
                        continue;
                    };
                    let then = now as u32 + duration;
                    if then < ticks[to as usize] {
                        ticks[to as usize] = then;
                        if buckets.len() <= then as usize {
                            buckets.resize_with(then as usize + 1, Vec::new);
                        }
                        buckets[then as usize].push(to);
                    }
                }
            }
            now += 1;
        }
        ticks
    }
}

fn diagonals_first(a: [i32; 3], b: [i32; 3], [one, two, three]: [u32; 3]) -> u32 {
    let mut d = [0, 1, 2].map(|axis| a[axis].abs_diff(b[axis]));
    d.sort_unstable();
    d[0] * three + (d[1] - d[0]) * two + (d[2] - d[1]) * one
}
