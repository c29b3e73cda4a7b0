//! Places on the way to a task: how far they are from the end, when they have been reached, and
//! when they are free to hover at.

use std::rc::Rc;

use costmap::leg::{DroneId, Leg, Tick};
use costmap::verdict::{Blocker, Verdict};
use rustc_hash::FxHashMap;

use super::heuristic::Heuristic;
use super::label::{Label, Step};
use super::met::Met;
use super::setting::{Refuted, Setting};
use crate::graph::agent::Agent;
use crate::graph::roadmap::Vertex;
use crate::graph::scratch::ScratchBuffer;
use crate::graph::turns::{AT_REST, BEYOND, Heading};
use crate::sipp::conflicts::ReservationTable;

/// A moment at which a place is known to be reached.
#[derive(Clone, Copy, Debug)]
struct Visit {
    /// When it was reached.
    from: Tick,
    /// Until when it is free to hover at; `None`: no drone has asked.
    to: Option<Tick>,
    /// Who gives way by then, in `Search::met`.
    met: u32,
    /// As of the state.
    heading: Heading,
    /// As of the state.
    turned: Tick,
    /// The visit before at the same place.
    before: u32,
}

/// What is known of the way on is raised by so much at a time: chosen here, half a step of 1 m at 2
/// m/s.
const LOOK_TICKS: u32 = 25;

/// No visit.
const NEVER: u32 = u32::MAX;

/// A place on the way to one waypoint.
#[derive(Clone, Copy)]
struct Node {
    /// Ticks to the end of the last dwell, as far as they are known.
    remaining: u32,
    /// Whether that is more than a bound.
    is_final: bool,
    /// Its last visit.
    last: u32,
}

/// Which headings of a drone at a place count as one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Haste {
    /// None but equal ones.
    None,
    /// Those that may follow one another.
    Alike,
    /// All.
    Any,
}

/// All places of the states that a search has generated.
pub(super) struct Nodes<'a> {
    /// What is searched among.
    setting: Setting<'a>,
    /// Who searches.
    agent: &'a Agent,
    /// Of these the reservation table is not asked.
    refuted: Rc<Refuted>,
    /// Bounds what remains.
    heuristic: Heuristic<'a>,
    /// By waypoint and vertex, one more than the index of the node; 0: none.
    flying: ScratchBuffer,
    /// On the ground, where it starts, and after the last waypoint, where it ends.
    standing: FxHashMap<(Vertex, u16, bool), usize>,
    /// By index; `flying` and `standing` lead here.
    all: Vec<Node>,
    /// Those of all places.
    visits: Vec<Visit>,
    /// Which headings count as one.
    pub(super) haste: Haste,
    /// By node, who is in the way of hovering there, whenever, where a drone has asked.
    hovers: FxHashMap<usize, Verdict>,
}

impl<'a> Nodes<'a> {
    /// No place is known yet.
    pub(super) fn new(
        setting: Setting<'a>,
        agent: &'a Agent,
        refuted: Rc<Refuted>,
        heuristic: Heuristic<'a>,
    ) -> Nodes<'a> {
        Nodes {
            heuristic,
            setting,
            agent,
            refuted,
            flying: ScratchBuffer::new(setting.roadmap.place_count() * agent.waypoints.len()),
            standing: FxHashMap::default(),
            all: Vec::new(),
            visits: Vec::new(),
            haste: Haste::None,
            hovers: FxHashMap::default(),
        }
    }

    /// The node of a state.
    pub(super) fn at(&mut self, label: &Label) -> usize {
        let is_over = usize::from(label.waypoint) == self.agent.waypoints.len();
        if !label.grounded && !is_over {
            return self.flying(label.waypoint, label.vertex);
        }
        let next = self.all.len();
        let key = (label.vertex, label.waypoint, label.grounded);
        let known = *self.standing.entry(key).or_insert(next);
        if known == next {
            self.add(label.waypoint, label.vertex);
        }
        known
    }

    /// The node of flying at a place before the last waypoint is over.
    pub(super) fn flying(&mut self, waypoint: u16, vertex: Vertex) -> usize {
        let index = u32::from(waypoint) * self.setting.roadmap.place_count() as u32 + vertex;
        let known = self.flying.get(index);
        if known > 0 {
            return known as usize - 1;
        }
        self.add(waypoint, vertex);
        self.flying.set(index, self.all.len() as u32);
        self.all.len() - 1
    }

    /// A node, with what is known of its way on.
    fn add(&mut self, waypoint: u16, vertex: Vertex) {
        let (remaining, is_final) = self.heuristic.at_least(usize::from(waypoint), vertex);
        self.all.push(Node {
            remaining,
            is_final,
            last: NEVER,
        });
    }

    /// Ticks from there to the end of the last dwell, as far as they are known.
    pub(super) fn remaining(&self, node: usize) -> u32 {
        self.all[node].remaining
    }

    /// Whether they are known for good.
    pub(super) fn is_final(&self, node: usize) -> bool {
        self.all[node].is_final
    }

    /// The same, more than is known so far, or for good.
    pub(super) fn look_on(&mut self, node: usize, label: &Label) -> (u32, bool) {
        let known = self.all[node];
        if !known.is_final {
            let waypoint = usize::from(label.waypoint);
            let (mut remaining, mut is_final) = self.heuristic.at_least(waypoint, label.vertex);
            if !is_final && remaining <= known.remaining {
                self.heuristic.look_on(waypoint, label.vertex, LOOK_TICKS);
                (remaining, is_final) = self.heuristic.at_least(waypoint, label.vertex);
            }
            (self.all[node].remaining, self.all[node].is_final) = (remaining, is_final);
        }
        (self.all[node].remaining, self.all[node].is_final)
    }

    /// What was looked ahead by, for the next search.
    pub(super) fn into_heuristic(self) -> Heuristic<'a> {
        self.heuristic
    }

    /// Notes that a place is reached by a state.
    pub(super) fn visit(&mut self, node: usize, label: &Label) {
        let next = self.visits.len() as u32;
        let before = std::mem::replace(&mut self.all[node].last, next);
        self.visits.push(Visit {
            from: label.at,
            to: None,
            met: label.met,
            heading: label.heading,
            turned: label.turned,
            before,
        });
    }

    /// When a place was reached, the last time first.
    fn visits(&self, node: usize) -> impl Iterator<Item = &Visit> + '_ {
        let last = self.visits.get(self.all[node].last as usize);
        std::iter::successors(last, |visit| self.visits.get(visit.before as usize))
    }

    /// Whether a state is known to be no news.
    pub(super) fn is_covered(&self, node: usize, label: &Label) -> bool {
        let mut visits = self
            .visits(node)
            .filter(|visit| self.may_do_as(visit, label));
        match label.step {
            Step::Later | Step::End => false,
            // A wait is news though its place is free: a drone will have passed elsewhere.
            Step::Wait => visits.any(|visit| visit.from == label.at),
            _ => visits.any(|visit| {
                visit.from == label.at
                    || visit.from < label.at && visit.to.is_some_and(|to| label.at <= to)
            }),
        }
    }

    /// Whether a drone that came earlier can go on as one that comes now, once it has waited.
    fn may_do_as(&self, visit: &Visit, label: &Label) -> bool {
        let Some(smoothing) = &self.agent.smoothing else {
            return true;
        };
        let rests = |since: Tick| since.after(smoothing.turn_ticks()) <= label.at;
        let is_same = visit.heading == label.heading
            && visit.heading != BEYOND
            && (visit.turned <= label.turned || rests(visit.turned));
        let is_alike = || {
            let is_known = visit.heading != BEYOND && label.heading < AT_REST;
            self.haste == Haste::Alike
                && is_known
                && smoothing.may_follow(visit.heading, label.heading)
        };
        is_same
            || visit.heading == AT_REST
            || rests(visit.from)
            || self.haste == Haste::Any
            || is_alike()
    }

    /// Whether a state can as well be reached by waiting there.
    pub(super) fn is_reached(&mut self, node: usize, label: &Label, met: &Met) -> bool {
        let mut next = self.all[node].last as usize;
        while label.step != Step::Wait
            && let Some(&visit) = self.visits.get(next)
        {
            if visit.to.is_none() && visit.from < label.at {
                let gives_way = |drone| met.has(visit.met, drone);
                let to = self.free_until(node, label, visit.from, gives_way).0;
                self.visits[next].to = Some(to);
            }
            next = visit.before as usize;
        }
        self.is_covered(node, label)
    }

    /// Until when a state's place is free to hover at from a moment on, and when it is again.
    pub(super) fn free_until(
        &mut self,
        node: usize,
        label: &Label,
        from: Tick,
        gives_way: impl Fn(DroneId) -> bool,
    ) -> (Tick, Tick) {
        if let Some((reservations, class)) = self.reservations_at(label) {
            return reservations.free_until(class, label.vertex, from, gives_way);
        }
        let hover = self.hover(node, label);
        if hover.breaks_zone.is_some() {
            return (from, Tick::FOREVER);
        }
        let ahead = (hover.blockers.iter())
            .filter(|blocker| blocker.clear > from && !gives_way(blocker.drone));
        let first = ahead.min_by_key(|blocker| (blocker.began, blocker.clear));
        first.map_or((Tick::FOREVER, Tick::FOREVER), |blocker| {
            (blocker.began.max(from), blocker.clear)
        })
    }

    /// Adds to a verdict who is in the way of hovering at a state's place between two moments.
    pub(super) fn judge_stay(
        &mut self,
        node: usize,
        label: &Label,
        [from, to]: [Tick; 2],
        verdict: &mut Verdict,
    ) {
        if let Some((reservations, class)) = self.reservations_at(label) {
            return reservations.stay(class, label.vertex, [from, to], verdict);
        }
        let hover = self.hover(node, label);
        verdict.breaks_zone = verdict.breaks_zone.or(hover.breaks_zone);
        let meets = |it: &&Blocker| it.began < to && from < it.clear;
        verdict.blockers.extend(hover.blockers.iter().filter(meets));
    }

    /// What is known of a state's place in brief, if anything is.
    fn reservations_at(&self, label: &Label) -> Option<(&'a ReservationTable<'a>, usize)> {
        let stay = (label.vertex, label.vertex);
        let reservations = self.setting.reservations?;
        let known = !label.grounded && reservations.knows(label.vertex) && !self.refuted.has(stay);
        let kind = self.agent.kinds[usize::from(label.waypoint)];
        let class = known.then(|| reservations.class(self.agent.drone, kind))?;
        Some((reservations, class?))
    }

    /// Who is in the way of hovering at a state's place: judged once for each node.
    fn hover(&mut self, node: usize, label: &Label) -> &Verdict {
        let (setting, agent) = (self.setting, self.agent);
        self.hovers.entry(node).or_insert_with(|| {
            let here_m = setting.roadmap.position_m(label.vertex);
            let stay = Leg {
                flying: !label.grounded,
                ..agent.hover(here_m, agent.kinds[usize::from(label.waypoint)])
            };
            let mut verdict = Verdict::default();
            setting.judge(&stay, &mut verdict);
            verdict
        })
    }
}
