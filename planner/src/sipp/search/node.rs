//! Places on the way to a task: how far they are from the end, when they have been reached, and
//! when they are free to hover at.

use std::rc::Rc;

use costmap::leg::{DroneId, Leg, Tick};
use costmap::verdict::{Blocker, Verdict};
use rustc_hash::FxHashMap;

use super::eviction_lists::EvictionLists;
use super::heuristic::Heuristic;
use super::label::{Label, Step};
use super::setting::{Refuted, SearchSetting};
use crate::graph::agent::Agent;
use crate::graph::roadmap::Vertex;
use crate::graph::scratch::ScratchBuffer;
use crate::graph::turns::{AT_REST, BEYOND, Heading};
use crate::sipp::conflicts::{Querier, ReservationTable};

/// A moment at which a place is known to be reached.
#[derive(Clone, Copy, Debug)]
struct PlaceVisit {
    /// Which place.
    vertex: Vertex,
    /// Its node.
    node: usize,
    /// When it was reached.
    from: Tick,
    /// Until when it is free to hover at; `None`: not known yet.
    to: Option<Tick>,
    /// Drones evicted by then, in `PathSearch::evictions`.
    evicted: u32,
    /// As of the state.
    heading: Heading,
    /// As of the state.
    turned: Tick,
    /// The visit before at the same place, or in the same column.
    before: u32,
}

/// What is known of the way on is raised by so much at a time: chosen here, half a step of 1 m at 2
/// m/s.
const BOUND_STEP_TICKS: u32 = 25;

/// No visit.
const NEVER: u32 = u32::MAX;

/// A place on the way to one waypoint.
#[derive(Clone, Copy)]
struct Node {
    /// Ticks to the end of the last dwell, as far as they are known.
    remaining: u32,
    /// Whether that is more than a bound.
    is_final: bool,
    /// Its last visit is there in `last`: one for each place, or for each column.
    visited: u32,
}

/// Which headings of a drone at a place count as one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HeadingDominance {
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
    setting: SearchSetting<'a>,
    /// The searching drone.
    agent: &'a Agent,
    /// Of these the reservation table is not asked.
    refuted: Rc<Refuted>,
    /// Bounds what remains.
    heuristic: Heuristic<'a>,
    /// By waypoint and vertex, one more than the index of the node; 0: none.
    flying: ScratchBuffer,
    /// On the ground, where it starts, and after the last waypoint, where it ends.
    standing: FxHashMap<(Vertex, u16, bool), usize>,
    /// By waypoint and column, one more than where its last visit is in `last`, where wakes fill
    /// their columns: where a drone is in one hardly matters to others, nor they to it, so that
    /// safe intervals are those of the column, and a state farther from the end that comes no
    /// earlier is dominated. Empty where they do not.
    columns: ScratchBuffer,
    /// By index; `flying` and `standing` lead here.
    all: Vec<Node>,
    /// Those of all places.
    visits: Vec<PlaceVisit>,
    /// The last visit of each place or column.
    last: Vec<u32>,
    /// Which headings count as one.
    pub(super) heading_dominance: HeadingDominance,
    /// By node, blockers of hovering there at any time, where they were asked for.
    hovers: FxHashMap<usize, Verdict>,
}

impl<'a> Nodes<'a> {
    /// No place is known yet.
    pub(super) fn new(
        setting: SearchSetting<'a>,
        agent: &'a Agent,
        refuted: Rc<Refuted>,
        heuristic: Heuristic<'a>,
    ) -> Nodes<'a> {
        // Drones under way look at every way out.
        let by_column = heuristic.uses_column_distances() && setting.under_way.is_empty();
        let columns = match by_column {
            true => column_count(setting) * agent.waypoints.len(),
            false => 0,
        };
        Nodes {
            heuristic,
            columns: ScratchBuffer::new(columns),
            last: Vec::new(),
            setting,
            agent,
            refuted,
            flying: ScratchBuffer::new(setting.roadmap.place_count() * agent.waypoints.len()),
            standing: FxHashMap::default(),
            all: Vec::new(),
            visits: Vec::new(),
            heading_dominance: HeadingDominance::None,
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
            let visited = self.unvisited();
            self.add(label.waypoint, label.vertex, visited);
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
        let visited = self.visited(waypoint, vertex);
        self.add(waypoint, vertex, visited);
        self.flying.set(index, self.all.len() as u32);
        self.all.len() - 1
    }

    /// Where in `last` the visits of a place are, or of its column.
    fn visited(&mut self, waypoint: u16, vertex: Vertex) -> u32 {
        let lattice = self.setting.roadmap.lattice();
        if self.columns.is_empty() || vertex as usize >= lattice.place_count() {
            return self.unvisited();
        }
        let column = lattice.column(vertex) + column_count(self.setting) * usize::from(waypoint);
        let known = self.columns.get(column as u32);
        if known > 0 {
            return known - 1;
        }
        let visited = self.unvisited();
        self.columns.set(column as u32, visited + 1);
        visited
    }

    /// Where no visit is yet.
    fn unvisited(&mut self) -> u32 {
        self.last.push(NEVER);
        self.last.len() as u32 - 1
    }

    /// A node, with what is known of its way on.
    fn add(&mut self, waypoint: u16, vertex: Vertex, visited: u32) {
        let (remaining, is_final) = self.heuristic.at_least(usize::from(waypoint), vertex);
        self.all.push(Node {
            remaining,
            is_final,
            visited,
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
    pub(super) fn extend_bound(&mut self, node: usize, label: &Label) -> (u32, bool) {
        let known = self.all[node];
        if !known.is_final {
            let waypoint = usize::from(label.waypoint);
            let (mut remaining, mut is_final) = self.heuristic.at_least(waypoint, label.vertex);
            if !is_final && remaining <= known.remaining {
                self.heuristic
                    .extend_bound(waypoint, label.vertex, BOUND_STEP_TICKS);
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
        let last = &mut self.last[self.all[node].visited as usize];
        let before = std::mem::replace(last, next);
        self.visits.push(PlaceVisit {
            vertex: label.vertex,
            node,
            from: label.at,
            to: None,
            evicted: label.evicted,
            heading: label.heading,
            turned: label.turned,
            before,
        });
    }

    /// When a place or its column was reached, the last time first.
    fn visits(&self, node: usize) -> impl Iterator<Item = &PlaceVisit> + '_ {
        let last = self.last[self.all[node].visited as usize];
        let last = self.visits.get(last as usize);
        std::iter::successors(last, |visit| self.visits.get(visit.before as usize))
    }

    /// Whether a state is known to be dominated.
    pub(super) fn is_covered(&self, node: usize, label: &Label) -> bool {
        let remaining = self.all[node].remaining;
        let mut visits = (self.visits(node))
            .filter(|visit| visit.vertex == label.vertex || self.remaining(visit.node) <= remaining)
            .filter(|visit| self.may_do_as(visit, label));
        match label.step {
            Step::Later | Step::End => false,
            // A wait is not dominated though its place is free: a drone will have passed elsewhere.
            Step::Wait => visits.any(|it| it.vertex == label.vertex && it.from == label.at),
            _ => visits.any(|visit| {
                visit.from == label.at
                    || visit.from < label.at && visit.to.is_some_and(|to| label.at <= to)
            }),
        }
    }

    /// Whether a drone that came earlier can go on as one that comes now, once it has waited.
    fn may_do_as(&self, visit: &PlaceVisit, label: &Label) -> bool {
        let Some(smoothing) = &self.agent.smoothing else {
            return true;
        };
        let rests = |since: Tick| since.after(smoothing.turn_ticks()) <= label.at;
        let is_same = visit.heading == label.heading
            && visit.heading != BEYOND
            && (visit.turned <= label.turned || rests(visit.turned));
        let is_alike = || {
            let is_known = visit.heading != BEYOND && label.heading < AT_REST;
            self.heading_dominance == HeadingDominance::Alike
                && is_known
                && smoothing.may_follow(visit.heading, label.heading)
        };
        is_same
            || visit.heading == AT_REST
            || rests(visit.from)
            || self.heading_dominance == HeadingDominance::Any
            || is_alike()
    }

    /// Whether a state can as well be reached by waiting there.
    pub(super) fn is_reached(
        &mut self,
        node: usize,
        label: &Label,
        evictions: &EvictionLists,
    ) -> bool {
        let mut next = self.last[self.all[node].visited as usize] as usize;
        while label.step != Step::Wait
            && let Some(&visit) = self.visits.get(next)
        {
            if visit.to.is_none() && visit.from < label.at {
                let is_evicted = |drone| evictions.has(visit.evicted, drone);
                let there = Label {
                    vertex: visit.vertex,
                    ..*label
                };
                let to = self
                    .free_until(visit.node, &there, visit.from, is_evicted)
                    .0;
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
        is_evicted: impl Fn(DroneId) -> bool,
    ) -> (Tick, Tick) {
        if let Some((reservations, by)) = self.reservations_at(label) {
            return reservations.free_until(by, label.vertex, from, is_evicted);
        }
        let hover = self.hover(node, label);
        if hover.breaks_zone.is_some() {
            return (from, Tick::FOREVER);
        }
        let ahead = (hover.blockers.iter())
            .filter(|blocker| blocker.clear > from && !is_evicted(blocker.drone));
        let first = ahead.min_by_key(|blocker| (blocker.began, blocker.clear));
        first.map_or((Tick::FOREVER, Tick::FOREVER), |blocker| {
            (blocker.began.max(from), blocker.clear)
        })
    }

    /// Adds to a verdict the blockers of hovering at a state's place between two moments.
    pub(super) fn judge_stay(
        &mut self,
        node: usize,
        label: &Label,
        [from, to]: [Tick; 2],
        verdict: &mut Verdict,
    ) {
        if let Some((reservations, by)) = self.reservations_at(label) {
            return reservations.stay(by, label.vertex, [from, to], verdict);
        }
        let hover = self.hover(node, label);
        verdict.breaks_zone = verdict.breaks_zone.or(hover.breaks_zone);
        let meets = |it: &&Blocker| it.began < to && from < it.clear;
        verdict.blockers.extend(hover.blockers.iter().filter(meets));
    }

    /// What is known of a state's place in brief, if anything is.
    fn reservations_at(&self, label: &Label) -> Option<(&'a ReservationTable<'a>, Querier)> {
        let stay = (label.vertex, label.vertex);
        let reservations = self.setting.reservations?;
        let known = !label.grounded
            && reservations.knows(label.vertex)
            && !self.refuted.has(stay)
            && label.at >= self.setting.judged_until;
        let kind = self.agent.kinds[usize::from(label.waypoint)];
        let by = known.then(|| reservations.querier(self.agent.drone, kind))?;
        Some((reservations, by?))
    }

    /// Blockers of hovering at a state's place: judged once for each node.
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

/// Columns of the floor.
fn column_count(setting: SearchSetting<'_>) -> usize {
    let [nx, ny, _] = setting.roadmap.lattice().counts();
    nx * ny
}
