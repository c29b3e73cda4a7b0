//! How long the rest of the path takes: the search's heuristic, exact on an empty roadmap.
//!
//! Between two lattice places with nothing in the box between them the answer is closed (diagonal
//! steps first). Otherwise it comes from a Dijkstra search backwards from the goal that is led
//! towards the place the drone comes from and stops as soon as it knows what is asked: "reverse
//! resumable A*" (D. Silver, "Cooperative pathfinding", AIIDE 2005). Its queue is an array of
//! buckets, one a tick (R. Dial, "Algorithm 360", Communications of the ACM 12, 1969): durations
//! are small whole numbers.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::graph::roadmap::{Edge, Roadmap, Vertex};

mod backwards;
mod buckets;
mod floor;
mod mover;

pub(crate) use backwards::Backwards;
use backwards::Lead;
pub(crate) use floor::Floor;
use mover::diagonals_first;
pub(crate) use mover::{Mover, Speeds, UNREACHABLE};

/// Ticks from anywhere to one goal for one drone with no other drone there.
#[derive(Debug)]
pub(crate) struct Distances {
    /// Where every distance leads.
    goal: Vertex,
    /// What moves there: its speed, size and stops.
    mover: Mover,
    /// Lattice places next to the goal, and the ticks from there.
    anchors: Vec<([i32; 3], u32)>,
    /// Where the answer is closed, ticks of a step along one, two and three axes.
    closed_form: Option<[u32; 3]>,
    /// What the search is led by towards where the drone comes from.
    lead: Lead,
    /// The search from the goal as far as it went; asked by several threads.
    backwards: Mutex<Backwards>,
}

impl Distances {
    /// Nothing is computed yet; the drone will come from `towards`.
    pub(crate) fn new(roadmap: &Roadmap, goal: Vertex, towards: Vertex, mover: Mover) -> Distances {
        let lattice = roadmap.lattice();
        let anchors = if roadmap.is_stop(goal) {
            let edges = roadmap.edges(goal).filter(|(to, _)| !roadmap.is_stop(*to));
            let anchor = |(from, edge): (Vertex, Edge)| {
                Some((
                    lattice.steps(from),
                    mover.ticks(roadmap, goal, edge.reversed())?,
                ))
            };
            edges.filter_map(anchor).collect()
        } else {
            vec![(lattice.steps(goal), 0)]
        };
        // A stop with edges to other stops is left to the search, and so are paths beyond the
        // lattice.
        let plain = (!roadmap.is_stop(goal)
            || roadmap.edges(goal).all(|(to, _)| !roadmap.is_stop(to)))
            && !mover.stops.iter().any(|it| roadmap.is_in_channel(*it));
        Distances {
            goal,
            closed_form: mover.diagonal_steps().filter(|_| plain),
            lead: Lead::new(roadmap, towards, &mover),
            backwards: Mutex::default(),
            mover,
            anchors,
        }
    }

    pub(crate) fn goal(&self) -> Vertex {
        self.goal
    }

    /// Ticks to the goal, or [`UNREACHABLE`].
    pub(crate) fn ticks(&self, roadmap: &Roadmap, from: Vertex) -> u32 {
        if from == self.goal {
            return 0;
        }
        if let Some(ticks) = self.straight(roadmap, from) {
            return ticks;
        }
        let mut backwards = self.worked_out();
        backwards.lead = self.lead;
        backwards.ticks(roadmap, &self.mover, self.goal, from, |_, _| true)
    }

    /// Length of a shortest path (m) from a place that has been asked about already; as far as it
    /// is known.
    pub(crate) fn length_m(&self, roadmap: &Roadmap, from: Vertex) -> f64 {
        let backwards = self.worked_out();
        let known = |at: Vertex| match backwards.known(at) {
            _ if at == self.goal => Some(0),
            None => self.straight(roadmap, at),
            known => known,
        };
        let mut length_m = 0.0;
        let mut at = from;
        while at != self.goal {
            let mut next = None;
            self.mover.steps_from(roadmap, at, |to, ticks, _| {
                let edge = known(to).map(|rest| (ticks.saturating_add(rest), to));
                next = next.into_iter().chain(edge).min();
            });
            let Some((_, to)) = next else { break };
            length_m += (roadmap.position_m(to) - roadmap.position_m(at)).norm();
            at = to;
        }
        length_m
    }

    /// Whether the answer from there is closed.
    pub(crate) fn is_straight(&self, roadmap: &Roadmap, from: Vertex) -> bool {
        self.straight(roadmap, from).is_some()
    }

    /// Forgets what was worked out; it is worked out anew when it is asked for.
    pub(crate) fn forget(&self) {
        *self.worked_out() = Backwards::default();
    }

    /// The search as far as it went, locked for this thread.
    fn worked_out(&self) -> MutexGuard<'_, Backwards> {
        // A panic elsewhere leaves at worst a search begun anew.
        let backwards = self.backwards.lock();
        backwards.unwrap_or_else(PoisonError::into_inner)
    }

    /// The same search from the goal from its beginning, for the drone that comes from a place and
    /// knows more places that are closed.
    pub(crate) fn backwards(&self, roadmap: &Roadmap, from: Vertex) -> Backwards {
        let mut backwards = Backwards::default();
        backwards.lead = Lead::new(roadmap, from, &self.mover);
        backwards.begin(roadmap, self.goal);
        backwards
    }

    /// A search on the floor for a drone that comes from a place, where nothing solid is in
    /// between.
    pub(crate) fn floor<'a>(&self, roadmap: &'a Roadmap, from: Vertex) -> Option<Floor<'a>> {
        let steps = self.closed_form.filter(|_| self.mover.stops.is_empty())?;
        let is_straight = self.is_straight(roadmap, from);
        is_straight.then(|| Floor::new(roadmap.lattice(), [from, self.goal], steps))
    }

    /// What moves.
    pub(crate) fn mover(&self) -> &Mover {
        &self.mover
    }

    /// Closed form, where nothing is in between.
    fn straight(&self, roadmap: &Roadmap, from: Vertex) -> Option<u32> {
        if !roadmap.is_stop(from) {
            return self.straight_from_lattice(roadmap, from);
        }
        let edges = roadmap.edges(from);
        let edges = edges.filter_map(|(to, edge)| Some((to, self.mover.ticks(roadmap, to, edge)?)));
        let totals = edges.map(|(to, ticks)| match roadmap.is_stop(to) {
            true => None,
            false => Some(ticks + self.straight_from_lattice(roadmap, to)?),
        });
        // `None` is the least: where one of them is not closed, none is.
        totals.min().flatten()
    }

    /// The same from a lattice place: over the nearest anchor of the goal.
    fn straight_from_lattice(&self, roadmap: &Roadmap, from: Vertex) -> Option<u32> {
        let steps = self.closed_form?;
        let narrow = roadmap.narrow(self.mover.radius_m)?;
        let from = roadmap.lattice().steps(from);
        let totals = self.anchors.iter().map(|(anchor, ticks)| {
            let is_free = narrow.is_free(from, *anchor);
            is_free.then(|| ticks + diagonals_first(from, *anchor, steps))
        });
        totals.min().flatten()
    }
}

#[cfg(test)]
mod tests;
