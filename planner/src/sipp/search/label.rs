//! States of the search, and their order in the open list.

use std::cmp::{Ordering, Reverse};

use costmap::leg::Tick;

use crate::graph::roadmap::Vertex;
use crate::graph::turns::Heading;

/// What leads to a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    Start,
    Move,
    /// The step of its parent, later: when is asked when it is expanded.
    Later,
    Wait,
    Dwell,
    End,
}

/// Steps that have been generated: up to an f-value, as it was reckoned then.
#[derive(Clone, Copy, Debug)]
pub(super) struct PartialExpansion {
    /// Highest f-value (ticks) whose steps are among the states.
    pub(super) upto: u32,
    /// By which it was reckoned.
    pub(super) weight_shift: u32,
}

impl PartialExpansion {
    /// Whether a step that costs so much has not been generated.
    pub(super) fn leaves_out(&self, cost: u32, remaining: u32) -> bool {
        weighted(cost, remaining, self.weight_shift) > self.upto
    }
}

/// A cost with what is left to fly counted one part in 2ⁿ more.
pub(super) fn weighted(cost: u32, remaining: u32, weight_shift: u32) -> u32 {
    cost.saturating_add(remaining >> weight_shift)
}

/// A state: where the drone is, which waypoint is next, when, and how it came there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Label {
    /// Where it is.
    pub(super) vertex: Vertex,
    /// Index of the waypoint that is next.
    pub(super) waypoint: u16,
    /// It stands, without a wake.
    pub(super) grounded: bool,
    /// What led here.
    pub(super) step: Step,
    /// Until then it stays where its parent is.
    pub(super) departs: Tick,
    /// When it is there.
    pub(super) at: Tick,
    /// Along which step it came; at rest where corners are flown in no time.
    pub(super) heading: Heading,
    /// When that began to be its heading.
    pub(super) turned: Tick,
    /// Prices paid so far, in ticks.
    pub(super) paid: u32,
    /// Index of the state before; [`u32::MAX`] for the first.
    pub(super) parent: u32,
    /// Last of the evicted drones, in `PathSearch::evictions`; 0: none.
    pub(super) evicted: u32,
    /// The costmap has been asked about what leads here.
    pub(super) judged: bool,
    /// Which of its steps have been generated.
    pub(super) expanded: Option<PartialExpansion>,
}

/// An entry of the open list. Cheapest first; among equals what is known for good, then the nearest
/// to the end, then the newest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct OpenEntry {
    /// The f-value: what a path through it costs at least (ticks), what remains weighted.
    pub(super) total: u32,
    /// Ticks to the end of the last dwell.
    pub(super) remaining: u32,
    /// What remains may be more.
    pub(super) is_bound: bool,
    /// Index of the state.
    pub(super) label: u32,
}

impl Ord for OpenEntry {
    fn cmp(&self, other: &OpenEntry) -> Ordering {
        let key = |open: &OpenEntry| {
            (
                Reverse(open.total),
                !open.is_bound,
                Reverse(open.remaining),
                open.label,
            )
        };
        key(self).cmp(&key(other))
    }
}

impl PartialOrd for OpenEntry {
    fn partial_cmp(&self, other: &OpenEntry) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
