//! A search from the goal that can be resumed, led towards where the drone comes from.

use costmap::leg::Tick;
use nalgebra::Point3;

use super::buckets::Buckets;
use super::mover::{Mover, UNREACHABLE, diagonals_first};
use crate::graph::lattice::{Lattice, NEIGHBOURS};
use crate::graph::roadmap::{Roadmap, Vertex};
use crate::graph::scratch::ScratchBuffer;

/// A search from the goal that can be resumed.
#[derive(Debug, Default)]
pub(crate) struct Backwards {
    /// By what places nearer to where the drone comes from are expanded first.
    pub(super) lead: Lead,
    /// Ticks known so far, twice one more than these, one more where they are exact; nothing where
    /// it is closed.
    known: ScratchBuffer,
    /// Places by ticks so far plus the least that may be missing to where the drone comes from.
    buckets: Buckets,
    /// The bucket whose places are expanded: no place still open has less.
    now: usize,
}

/// A consistent lower bound of the ticks from where the drone comes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) enum Lead {
    /// Nothing is known.
    #[default]
    None,
    /// On the lattice alone: diagonals first.
    Steps([i32; 3], [u32; 3]),
    /// With stops beyond it: the straight line (m, ticks per metre).
    Line(Point3<f64>, f64),
}

impl Lead {
    /// For a drone that comes from `towards`; the line where stops make steps of other lengths.
    pub(super) fn new(roadmap: &Roadmap, towards: Vertex, mover: &Mover) -> Lead {
        match mover.diagonal_steps() {
            Some(steps) if mover.stops.is_empty() => {
                Lead::Steps(roadmap.lattice().steps(towards), steps)
            }
            // A part in 10⁶ forgives lengths kept in single precision.
            _ => Lead::Line(
                roadmap.position_m(towards),
                (1.0 - 1e-6) * Tick::PER_SECOND / mover.speeds.along_mps,
            ),
        }
    }

    /// Ticks from where the drone comes to a place, at least.
    fn ticks(&self, roadmap: &Roadmap, place: Vertex) -> u32 {
        match self {
            Lead::None => 0,
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
    /// Begins at the goal, with nothing else known.
    pub(super) fn begin(&mut self, roadmap: &Roadmap, goal: Vertex) {
        self.known = ScratchBuffer::new(roadmap.place_count());
        self.set(goal, 0);
        let lead = self.lead.ticks(roadmap, goal);
        self.buckets.push(lead as usize, goal);
    }

    /// Ticks to the goal through places that are open, or [`UNREACHABLE`]. Whether a place is,
    /// `is_open` is asked with the least ticks to it from where the drone comes.
    pub(crate) fn ticks(
        &mut self,
        roadmap: &Roadmap,
        mover: &Mover,
        goal: Vertex,
        from: Vertex,
        is_open: impl Fn(Vertex, u32) -> bool,
    ) -> u32 {
        if self.known.is_empty() {
            self.begin(roadmap, goal);
        }
        self.extend_bound(roadmap, mover, from, u32::MAX, is_open);
        self.at_least(roadmap, from).0
    }

    /// Raises what is known of a place by so many ticks, if it is not known for good before.
    pub(crate) fn extend_bound(
        &mut self,
        roadmap: &Roadmap,
        mover: &Mover,
        from: Vertex,
        by: u32,
        is_open: impl Fn(Vertex, u32) -> bool,
    ) {
        let until = self.now.saturating_add(by as usize);
        while !self.is_done(from) && self.now < until.min(self.buckets.len()) {
            match self.buckets.pop(self.now) {
                Some(place) => self.settle(roadmap, mover, place, &is_open),
                None => self.now += 1,
            }
        }
    }

    /// Ticks to the goal, if they are worked out.
    pub(super) fn known(&self, from: Vertex) -> Option<u32> {
        let is_done = !self.known.is_empty() && self.is_done(from);
        is_done.then(|| self.least(from))
    }

    /// What has been found so far, or [`UNREACHABLE`].
    #[inline]
    fn least(&self, place: Vertex) -> u32 {
        (self.known.get(place) / 2).wrapping_sub(1)
    }

    /// Whether the ticks of a place are exact.
    #[inline]
    fn is_done(&self, place: Vertex) -> bool {
        self.known.get(place) % 2 == 1
    }

    /// Notes ticks of a place that may still become less.
    fn set(&mut self, place: Vertex, ticks: u32) {
        self.known.set(place, 2 * (ticks + 1));
    }

    /// What [`Backwards::ticks`] will say at least, and whether it is known.
    pub(crate) fn at_least(&self, roadmap: &Roadmap, from: Vertex) -> (u32, bool) {
        if self.is_done(from) {
            return (self.least(from), true);
        }
        if self.now >= self.buckets.len() {
            return (UNREACHABLE, true);
        }
        let lead = self.lead.ticks(roadmap, from);
        ((self.now as u32).saturating_sub(lead), false)
    }

    /// Makes the ticks of a place exact, and passes them on to the places that open steps lead to.
    fn settle(
        &mut self,
        roadmap: &Roadmap,
        mover: &Mover,
        place: Vertex,
        is_open: &impl Fn(Vertex, u32) -> bool,
    ) {
        if self.is_done(place) {
            return;
        }
        self.known.set(place, self.known.get(place) + 1);
        let here = self.least(place);
        if let Some(open) = mover.open_steps(roadmap) {
            return self.settle_on_lattice(roadmap.lattice(), mover, place, open, is_open);
        }
        mover.steps_to(roadmap, place, |to, duration| {
            // What is done is not farther.
            if here + duration < self.least(to) {
                let lead = self.lead.ticks(roadmap, to);
                if is_open(to, lead) {
                    self.set(to, here + duration);
                    let bucket = here + duration + lead;
                    self.buckets.push(bucket as usize, to);
                }
            }
        });
    }

    /// The same where there are no stops: twice as fast.
    fn settle_on_lattice(
        &mut self,
        lattice: &Lattice,
        mover: &Mover,
        place: Vertex,
        open: &[u32],
        is_open: &impl Fn(Vertex, u32) -> bool,
    ) {
        let here = self.least(place);
        let [i, j, k] = lattice.steps(place);
        for (n, to) in lattice.stepped(place, open[place as usize]) {
            let d = NEIGHBOURS[n];
            let ticks = here + mover.step_ticks()[n];
            // What is done is not farther.
            if ticks < self.least(to) {
                let lead = match &self.lead {
                    Lead::Steps(towards, steps) => {
                        diagonals_first([i + d[0], j + d[1], k + d[2]], *towards, *steps)
                    }
                    _ => 0,
                };
                if is_open(to, lead) {
                    self.set(to, ticks);
                    self.buckets.push((ticks + lead) as usize, to);
                } else {
                    // Nothing is less: it is not asked for again.
                    self.set(to, 0);
                }
            }
        }
    }
}
