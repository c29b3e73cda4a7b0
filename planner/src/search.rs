//! Space-time A* for one drone among those already planned.
//!
//! A state is a place, a task and a moment. From there the drone steps to a neighbouring place, dwells, or
//! ends. What it meets is judged by the costmap. A drone in the way does not forbid a step: it may be met,
//! once, at a price, and gives way afterwards (ejection chains: F. Glover, "Ejection chains, reference
//! structures and alternating path methods for traveling salesman problems", Discrete Applied Mathematics
//! 65, 1996; here as penalties in the search, as in PBS and LNS2 for multi-agent path finding). An
//! immovable one forbids it. Or the step is taken later.
//!
//! A state stands for all the time for which hovering at its place is free from then on, as in
//! safe-interval path planning (M. Phillips and M. Likhachev, "SIPP", ICRA 2011): later arrivals within it
//! are dropped, and the neighbouring places are reached in each of their own intervals.

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, Leg, Tick};
use costmap::verdict::{Blocker, Verdict, Why};
use nalgebra::Point3;

use crate::errand::Errand;
use crate::roadmap::Roadmap;

mod label;
mod node;
mod path;
mod settle;
mod wait;
mod walk;

use walk::Search;

/// A drone that nobody can make give way.
pub const IMMOVABLE: u32 = u32::MAX;

/// How hard to look: what is left to fly counts one part in 2ⁿ more than it takes, so that of ways that
/// differ by less the one found first will do; and after how many states to be less choosy. The part
/// bounds the excess of an answer over the best: 1/32, then 1/4, then twice. Chosen here: the first
/// level answers nearly always, and the others keep a crowd from costing seconds a drone.
const PATIENCE: [(u32, u64); 3] = [(5, 1_000), (2, 4_000), (0, u64::MAX)];

/// What a search works on.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Ways through free space.
    pub roadmap: &'a Roadmap,
    /// Everybody planned so far.
    pub costmap: &'a Costmap,
    /// Price in ticks of meeting each drone, or [`IMMOVABLE`].
    pub weights: &'a [u32],
    /// Until when each drone goes on as it does, whatever its price; empty: nobody is under way.
    pub under_way: &'a [Tick],
    /// Seconds of delay that a second's worth of hover energy is worth.
    pub energy_weight: f64,
    /// Whether every step is judged in full, weak wakes on those far off included.
    pub careful: bool,
    /// States after which the search gives up.
    pub most_expansions: u64,
    /// Asked now and then.
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

impl Scene<'_> {
    /// What is in the way is flown already, and cannot be taken back.
    fn is_under_way(&self, blocker: &Blocker) -> bool {
        let until = self.under_way.get(blocker.drone.0 as usize);
        until.is_some_and(|until| blocker.clear <= *until)
    }

    /// Price of what is in the way.
    pub(crate) fn weight(&self, blocker: &Blocker) -> u32 {
        if self.is_under_way(blocker) {
            return IMMOVABLE;
        }
        self.weights[blocker.drone.0 as usize]
    }

    pub(crate) fn judge(&self, leg: &Leg, verdict: &mut Verdict) {
        if self.careful {
            self.costmap.judge(leg, verdict);
        } else {
            self.costmap.judge_nearby(leg, verdict);
        }
    }
}

/// A way from start to end.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Back to back from where its errand begins; the last one may last for ever.
    pub legs: Vec<Leg>,
    /// End of the last dwell.
    pub arrives: Tick,
    /// Who must give way.
    pub met: Vec<DroneId>,
}

/// What a search found.
#[derive(Clone, Debug, PartialEq)]
pub enum Found {
    /// The cheapest way.
    Path(Path),
    /// None, and what was in the way closest to the goal.
    Blocked(Option<Obstruction>),
    /// Told to stop.
    Stopped,
}

/// What was in the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstruction {
    /// Who or what.
    pub by: Hindrance,
    /// Where the drone could get to (m).
    pub at_m: Point3<f64>,
    /// When it would have gone on.
    pub at: Tick,
    /// Ticks that were left to fly.
    remaining: u32,
}

/// Who or what can be in the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hindrance {
    /// Another drone, and how.
    Drone(DroneId, Why),
    /// A zone (its index) that the drone's own wake is too strong for.
    Zone(usize),
}

/// Result and effort of one search.
#[derive(Clone, Debug, PartialEq)]
pub struct Searched {
    /// What was found.
    pub found: Found,
    /// States expanded.
    pub expansions: u64,
}

/// Finds the cheapest way for one errand.
pub fn search(scene: Scene<'_>, errand: &Errand) -> Searched {
    let mut expansions = 0;
    for (impatience_shift, most_expansions) in PATIENCE {
        let most_expansions = most_expansions.min(scene.most_expansions);
        let mut search = Search::new(scene, errand, impatience_shift);
        let found = search.run(most_expansions);
        expansions += search.expansions;
        let gave_up = search.expansions > most_expansions;
        if !gave_up || most_expansions == scene.most_expansions {
            return Searched { found, expansions };
        }
    }
    Searched {
        found: Found::Blocked(None),
        expansions,
    }
}
