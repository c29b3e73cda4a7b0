//! What a search works on.

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, Leg, Tick};
use costmap::verdict::{Blocker, Verdict, Why};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::graph::roadmap::{Roadmap, Vertex};
use crate::sipp::conflicts::ReservationTable;

/// A drone that cannot be evicted.
pub(crate) const IMMOVABLE: u32 = u32::MAX;

/// Legs are judged in parts no shorter than this before they count as refuted (ticks): chosen here,
/// 0.1 m at 2 m/s.
const FINEST_TICKS: u32 = 5;

/// What looked free in brief and is not.
#[derive(Clone, Debug, Default)]
pub(crate) struct Refuted {
    /// By where from and where to, the blockers of departures between two moments.
    steps: FxHashMap<(Vertex, Vertex), Vec<Blocker>>,
    /// Refuted edges: steps and stays that have to be judged in full.
    edges: FxHashSet<(Vertex, Vertex)>,
    /// Drones whose budget is full at some time.
    full: Vec<DroneId>,
}

impl Refuted {
    /// Adds what is against a leg between two places; `false` if that is known.
    pub(super) fn add(&mut self, ends: (Vertex, Vertex), leg: &Leg, against: &Verdict) -> bool {
        let full = (against.blockers.iter()).filter(|it| it.why == Why::TheirLimit);
        self.full.extend(full.map(|it| it.drone));
        self.full.sort_unstable();
        self.full.dedup();
        if leg.stays() || against.breaks_zone.is_some() {
            return self.edges.insert(ends);
        }
        let known = self.steps.entry(ends).or_default();
        let ticks = leg.end.0 - leg.start.0;
        let mut is_new = false;
        for blocker in &against.blockers {
            let departures = Blocker {
                began: blocker.began.max(leg.start).before(ticks).min(leg.start),
                clear: blocker.clear.max(leg.start.after(1)),
                ..*blocker
            };
            let covers = |it: &Blocker| {
                it.drone == blocker.drone && it.began <= leg.start && leg.start < it.clear
            };
            if !known.iter().any(covers) {
                known.push(departures);
                is_new = true;
            }
        }
        is_new || self.edges.insert(ends)
    }

    /// Whether there is nothing of the kind.
    pub(super) fn is_empty(&self) -> bool {
        self.steps.is_empty() && self.edges.is_empty() && self.full.is_empty()
    }

    /// Whether a step or a stay is a refuted edge, which has to be judged in full.
    pub(super) fn has(&self, ends: (Vertex, Vertex)) -> bool {
        self.edges.contains(&ends)
    }

    /// Drones whose budget is full at some time.
    pub(super) fn full(&self) -> &[DroneId] {
        &self.full
    }

    /// Adds the blockers of a step that departs at a moment.
    pub(super) fn add_blockers(
        &self,
        ends: (Vertex, Vertex),
        departs: Tick,
        blockers: &mut Vec<Blocker>,
    ) {
        let known = self.steps.get(&ends).into_iter().flatten();
        blockers.extend(known.filter(|it| it.began <= departs && departs < it.clear));
    }
}

/// What a search works on.
#[derive(Clone, Copy)]
pub(crate) struct SearchSetting<'a> {
    /// Paths through free space.
    pub(crate) roadmap: &'a Roadmap,
    /// Every drone planned so far.
    pub(crate) costmap: &'a Costmap,
    /// The same in brief, for searches whose answer is judged afterwards.
    pub(crate) reservations: Option<&'a ReservationTable<'a>>,
    /// Price in ticks of meeting each drone, or [`IMMOVABLE`].
    pub(crate) weights: &'a [u32],
    /// Until when each drone's flight is fixed, whatever its price; empty: no drone is under way.
    pub(crate) under_way: &'a [Tick],
    /// Seconds of delay that a second's worth of hover energy is worth.
    pub(crate) energy_weight: f64,
    /// Whether the search tries detours around parked drones before it evicts any of them. Where
    /// half of the floor is held for good, drones on detours obstruct others, and evictions go on
    /// without end.
    pub(crate) detours: bool,
    /// Whether a drone stays at its last task's place once it is there with nothing else left to
    /// do.
    pub(crate) ends_at_goal: bool,
    /// Whether every step is judged in full, weak wakes on those far off included.
    pub(crate) judges_far_wakes: bool,
    /// A place that was reached before is tried again for its next safe interval, along any path to
    /// it, so that a drone steps aside and comes back. Else only along the first path.
    pub(crate) allows_revisits: bool,
    /// States after which the search gives up.
    pub(crate) most_expansions: u64,
    /// Of them without tables, where what the tables let it find does not hold.
    pub(crate) most_untabulated: u64,
    /// Steps that depart before are judged in full, whatever the tables say of them.
    pub(crate) judged_until: Tick,
    /// Asked now and then.
    pub(crate) stop: &'a (dyn Fn() -> bool + Sync),
}

impl<'a> SearchSetting<'a> {
    /// Every step judged in full by the costmap, among drones that have these prices.
    pub(crate) fn judged(
        roadmap: &'a Roadmap,
        costmap: &'a Costmap,
        weights: &'a [u32],
        stop: &'a (dyn Fn() -> bool + Sync),
    ) -> SearchSetting<'a> {
        SearchSetting {
            roadmap,
            costmap,
            reservations: None,
            weights,
            under_way: &[],
            energy_weight: 0.0,
            detours: true,
            ends_at_goal: false,
            judges_far_wakes: true,
            allows_revisits: true,
            most_expansions: u64::MAX,
            most_untabulated: u64::MAX,
            judged_until: Tick(0),
            stop,
        }
    }

    /// Whether a blocker cannot be evicted: it is over before its drone can do something else. Of a
    /// leg that `departs` at a time from which on it could keep away also where what that drone
    /// flies until then blocks it itself.
    pub(super) fn is_under_way(&self, blocker: &Blocker, departs: Option<Tick>) -> bool {
        let Some(&until) = self.under_way.get(blocker.drone.0 as usize) else {
            return false;
        };
        let [begins, ends] = blocker.flown;
        let longer = blocker.clear.0.saturating_sub(ends.0);
        let is_flown =
            |departs: Tick| ends <= until || begins < until && departs < until.after(longer);
        blocker.clear <= until || departs.is_some_and(is_flown)
    }

    /// Price of a leg's blocker; see [`SearchSetting::is_under_way`].
    pub(crate) fn weight(&self, blocker: &Blocker, departs: Option<Tick>) -> u32 {
        if self.is_under_way(blocker, departs) {
            return IMMOVABLE;
        }
        self.weights[blocker.drone.0 as usize]
    }

    /// Adds the blockers of a leg that are not known, however finely it is divided: bounds depend
    /// on what is bounded at once, and any of them will do.
    pub(crate) fn add_unknown(
        &self,
        leg: &Leg,
        is_known: &mut impl FnMut(&Blocker) -> bool,
        against: &mut Verdict,
    ) {
        let mut verdict = Verdict::default();
        self.judge(leg, &mut verdict);
        verdict.blockers.retain(|it| !is_known(it));
        if verdict.is_allowed() {
            return;
        }
        let ticks = leg.end.0 - leg.start.0;
        if !leg.stays() && ticks >= 2 * FINEST_TICKS {
            let middle = leg.start.after(ticks / 2);
            for (from, until) in [(leg.start, middle), (middle, leg.end)] {
                self.add_unknown(&leg.between(from, until), is_known, against);
            }
            return;
        }
        against.breaks_zone = against.breaks_zone.or(verdict.breaks_zone);
        against.blockers.append(&mut verdict.blockers);
    }

    /// Blockers of a leg, by the costmap: far-off drones' weak wakes count only where it is
    /// careful. Where tables answer, something is left to drones that are planned later.
    pub(crate) fn judge(&self, leg: &Leg, verdict: &mut Verdict) {
        if self.judges_far_wakes {
            self.costmap.judge(leg, verdict);
        } else {
            let spares = self.reservations.is_some();
            self.costmap.judge_nearby(leg, spares, verdict);
        }
    }
}
