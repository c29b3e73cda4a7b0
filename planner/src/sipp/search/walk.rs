//! The search itself: states are expanded in the order of their f-values, which generates steps,
//! waits, dwells and the end.
//!
//! What leads to a state is judged when it is expanded: in brief by the reservation table where it
//! knows of it, in full by the costmap. A state stands for all the time for which its place is free
//! to hover at from then on. Its steps are tried for the first moment; one that is blocked then is
//! tried again for when it may be free, and one that is not for when the place it leads to is free
//! the next time. So is one to a place that was reached before, where a drone is to come back there
//! ([`SearchSetting::allows_revisits`]); mostly it only costs states.

use std::cell::RefCell;
use std::collections::BinaryHeap;
use std::rc::Rc;

use costmap::leg::{DroneId, KindId, Leg, Tick};
use costmap::verdict::{Blocker, Verdict};
use nalgebra::{Point3, Vector3};
use rustc_hash::FxHashMap;

use super::answer::{Obstruction, Obstructor, Path, SearchOutcome, joined};
use super::eviction_lists::EvictionLists;
use super::heuristic::Heuristic;
use super::label::{Label, OpenEntry, PartialExpansion, Step, weighted};
use super::memo::Memo;
use super::node::{HeadingDominance, Nodes};
use super::setting::{IMMOVABLE, Refuted, SearchSetting};
use crate::graph::agent::{Agent, Ending};
use crate::graph::distances::UNREACHABLE;
use crate::graph::lattice::neighbour;
use crate::graph::roadmap::Vertex;
use crate::graph::turns::{AT_REST, BEYOND, Heading, Smoothing};
use crate::sipp::conflicts::StepQuery;
use crate::sipp::goal_occupancy::GoalOccupancyCosts;

/// Departures after a wait are on whole multiples of this, so that a crowd does not make a state of
/// every moment: chosen here, a quarter second.
const WAIT_GRID_TICKS: u32 = 25;

/// From this weight on (see [`weighted`]) a drone that came earlier along another step counts as
/// one that comes now where it may turn likewise: chosen here, before a crowd makes a state of
/// every heading.
const ALIKE_HEADINGS_SHIFT: u32 = 5;
/// From this one on along any step: chosen here, after some thousand states.
const ANY_HEADING_SHIFT: u32 = 2;

/// What a turn in flight costs (ticks), so that of paths that are as short the straighter one is
/// flown, and no drone flies about where it may as well wait. Chosen here, a twentieth of a second:
/// halls and warehouses of 200 and 500 drones take a tenth to a fifth fewer curves than without, at
/// the same sum of costs within 1 %.
const TURN_TICKS: u32 = 5;

/// Flight that makes nothing late costs such a part of what being late does: chosen here, so that a
/// step of 1 m at 2 m/s is dearer than a turn.
const EARLY_SHARE: u32 = 2;

/// States after which it is asked whether to stop: chosen here, without tables some hundredths of a
/// second.
const STATES_A_LOOK: u64 = 64;

/// What is known of a step by the tables of reservations.
#[derive(Clone, Copy, Debug, PartialEq)]
enum TableAnswer {
    Unknown,
    /// Blockers of being where it leads to; there may be others on the way.
    DestinationOnly,
    WholeStep,
}

/// One search: its states, those open, and the drones they evict.
pub(super) struct PathSearch<'a> {
    /// What is searched among.
    setting: SearchSetting<'a>,
    /// The searching drone.
    agent: &'a Agent,
    /// Steps that the reservation table takes for free and are not.
    refuted: Rc<Refuted>,
    /// Every state so far, by index; none is taken out.
    labels: Vec<Label>,
    /// The open list: states to be expanded, or expanded further.
    open: BinaryHeap<OpenEntry>,
    /// What is known of places.
    pub(super) nodes: Nodes<'a>,
    /// Whether there is room for a turn, by heading, place and the next one, where it was asked.
    corners: FxHashMap<(Heading, Vertex, Vertex), bool>,
    /// Drones evicted on the way to each state.
    evictions: EvictionLists,
    /// Of dwelling at each task, and of the end.
    goal_costs: Rc<GoalOccupancyCosts>,
    /// What this search's tries have judged.
    memo: Rc<RefCell<Memo>>,
    /// Of the leg judged last.
    verdict: Verdict,
    /// Gathers the verdicts of all that leads to one state.
    all: Verdict,
    /// The obstruction nearest to the end.
    pub(super) obstruction: Option<Obstruction>,
    /// What remains counts one part in 2ⁿ more; see [`weighted`].
    weight_shift: u32,
    /// Appointments at so many of the first waypoints were kept on a way that meets no drone: every
    /// other way to the last of them leads to the same place at the same time.
    kept: u16,
    /// States expanded so far.
    pub(super) expansions: u64,
}

impl<'a> PathSearch<'a> {
    /// Nothing is expanded yet.
    pub(super) fn new(
        setting: SearchSetting<'a>,
        agent: &'a Agent,
        refuted: Rc<Refuted>,
        heuristic: Heuristic<'a>,
        (goal_costs, memo): (Rc<GoalOccupancyCosts>, Rc<RefCell<Memo>>),
        weight_shift: u32,
    ) -> PathSearch<'a> {
        PathSearch {
            setting,
            agent,
            refuted: refuted.clone(),
            labels: Vec::new(),
            open: BinaryHeap::new(),
            nodes: Nodes::new(setting, agent, refuted, heuristic),
            corners: FxHashMap::default(),
            evictions: EvictionLists::new(),
            goal_costs,
            memo,
            verdict: Verdict::default(),
            all: Verdict::default(),
            obstruction: None,
            weight_shift,
            kept: 0,
            expansions: 0,
        }
    }

    /// Looks until it has expanded so many states in all; `None` if it is to go on from there.
    pub(super) fn run(&mut self, most_expansions: u64) -> Option<SearchOutcome> {
        if let Some((drone, why, at)) = self.goal_costs.never {
            let above_m = self.setting.roadmap.position_m(self.agent.last_vertex());
            let (at_m, lands) = match self.agent.ending {
                Ending::Land { rest_m, .. } => (rest_m, true),
                Ending::Hover | Ending::Leave => (above_m, false),
            };
            return Some(SearchOutcome::Blocked(Some(Obstruction {
                by: Obstructor::Drone(drone, why),
                at_m,
                lands,
                at,
                remaining: 0,
            })));
        }
        if self.labels.is_empty() {
            self.begin();
        }
        while self.expansions < most_expansions {
            let Some(open) = self.open.pop() else {
                return Some(SearchOutcome::Blocked(self.obstruction));
            };
            if let Some(found) = self.expand_next(open) {
                return Some(found);
            }
        }
        None
    }

    /// The first state: at the start, when the agent departs.
    fn begin(&mut self) {
        self.push(Label {
            vertex: self.agent.start,
            waypoint: 0,
            grounded: self.agent.grounded,
            step: Step::Start,
            departs: self.agent.departs,
            at: self.agent.departs,
            heading: self.first_heading(),
            turned: self.agent.departs,
            paid: 0,
            parent: u32::MAX,
            evicted: 0,
            judged: true,
            expanded: None,
        });
    }

    /// Counts what is left to fly one part in 2ⁿ more from here on. What is known stays known; what
    /// is open is put in the order that this makes.
    pub(super) fn reweigh(&mut self, weight_shift: u32) {
        self.weight_shift = weight_shift;
        self.nodes.heading_dominance = match weight_shift {
            shift if shift <= ANY_HEADING_SHIFT => HeadingDominance::Any,
            shift if shift < ALIKE_HEADINGS_SHIFT => HeadingDominance::Alike,
            _ => HeadingDominance::None,
        };
        for open in std::mem::take(&mut self.open) {
            let label = self.labels[open.label as usize];
            let node = self.nodes.at(&label);
            self.open
                .extend(self.open_entry_at(node, open.label, &label));
        }
    }

    /// Expands the first state of the open list, or puts it back; the answer, if it is the end.
    fn expand_next(&mut self, open: OpenEntry) -> Option<SearchOutcome> {
        let OpenEntry { label, total, .. } = open;
        let found = self.labels[label as usize];
        if found.waypoint < self.kept {
            return None;
        }
        if found.expanded.is_some() {
            self.expand_partially(label, total);
            return None;
        }
        if found.step == Step::Later {
            self.step_later(label);
            return None;
        }
        let node = self.nodes.at(&found);
        let (remaining, is_final) = self.nodes.extend_bound(node, &found);
        if remaining > open.remaining || !is_final {
            // Its f-value was a bound.
            let entry = self.open_entry(label, &found);
            self.open.extend(entry);
            return None;
        }
        if self.nodes.is_reached(node, &found, &self.evictions) {
            if self.setting.allows_revisits && found.step == Step::Move {
                self.remember(label);
            }
            return None;
        }
        self.expansions += 1;
        if self.expansions.is_multiple_of(STATES_A_LOOK) && (self.setting.stop)() {
            return Some(SearchOutcome::Stopped);
        }
        if !self.is_confirmed(label) {
            return None;
        }
        if found.step == Step::End {
            return Some(SearchOutcome::Path(self.path(label)));
        }
        self.expand(label, total);
        None
    }

    /// Adds a state, if a path leads on from it.
    fn push(&mut self, label: Label) {
        let index = self.labels.len() as u32;
        if let Some(open) = self.open_entry(index, &label) {
            self.labels.push(label);
            self.open.push(open);
        }
    }

    /// The entry of a state in the open list. `None` if no path leads on, or there is no need to go
    /// there.
    fn open_entry(&mut self, index: u32, label: &Label) -> Option<OpenEntry> {
        let node = self.nodes.at(label);
        if self.nodes.is_covered(node, label) {
            return None;
        }
        self.open_entry_at(node, index, label)
    }

    /// The same whether there is need to go there or not.
    fn open_entry_at(&self, node: usize, index: u32, label: &Label) -> Option<OpenEntry> {
        let cost = self.cost(node, label)?;
        let remaining = self.nodes.remaining(node);
        Some(OpenEntry {
            total: weighted(cost, remaining, self.weight_shift),
            remaining,
            is_bound: !self.nodes.is_final(node),
            label: index,
        })
    }

    /// Least cost of a whole path through a state: its f-value, before it is weighted.
    fn cost(&self, node: usize, label: &Label) -> Option<u32> {
        let least = self.least(node, label.waypoint, label.paid, label.at)?;
        // A label with evicted drones still pays for the rest of its stays. To know that saves a
        // fleet in flight nearly all states of some searches, and none where a fleet is planned
        // from the beginning (halls and warehouses of 500).
        let is_enough = label.evicted != 0 && self.setting.under_way.is_empty();
        if is_enough || label.step == Step::End {
            return Some(least);
        }
        let ends = label.at.0.saturating_add(self.nodes.remaining(node));
        let is_paid = |drone| self.evictions.has(label.evicted, drone);
        let excess = self.goal_costs.excess(label.waypoint, ends, is_paid);
        // The highest: a drone that never leaves is where it has to stay.
        let all = label.paid.saturating_add(ends).checked_add(excess)?;
        let all = all.saturating_add(self.aloft(self.nodes.remaining(node)));
        Some(all.max(least)).filter(|cost| *cost < u32::MAX)
    }

    /// The same without goal-occupancy costs.
    ///
    /// `None` where it would come too late to the next waypoint as well.
    fn least(&self, node: usize, waypoint: u16, paid: u32, at: Tick) -> Option<u32> {
        let remaining = self.nodes.remaining(node);
        if remaining == UNREACHABLE {
            return None;
        }
        let next = usize::from(waypoint);
        if let Some(waypoint) = self.agent.waypoints.get(next) {
            let there = remaining.saturating_sub(waypoint.rest_ticks);
            if at.after(there) > waypoint.due {
                return None;
            }
        }
        let ends = at.0.saturating_add(remaining);
        let ends = ends.max(self.agent.ends_from(next).0);
        let least = paid.saturating_add(ends);
        let least = least.saturating_add(self.aloft(remaining));
        (least < u32::MAX).then_some(least)
    }

    /// What so long a flight costs a drone that has an appointment, be it early there or not: all
    /// that is in time would cost the same otherwise.
    fn aloft(&self, ticks: u32) -> u32 {
        match self.agent.ends_from(0) {
            Tick(0) => 0,
            _ => ticks / EARLY_SHARE,
        }
    }

    /// What flies towards a waypoint; after the last, what is left.
    fn kind(&self, waypoint: u16) -> KindId {
        self.agent.kinds[usize::from(waypoint)]
    }

    /// A leg from a state to a place (m) that takes so many ticks.
    fn leg(&self, label: &Label, to_m: Point3<f64>, ticks: u32) -> Leg {
        let from_m = self.setting.roadmap.position_m(label.vertex);
        Leg {
            start: label.at,
            end: label.at.after(ticks),
            to_m,
            flying: !label.grounded,
            ..self.agent.hover(from_m, self.kind(label.waypoint))
        }
    }

    /// Adds what can be done at a state: dwell or end, steps, and a wait.
    fn expand(&mut self, index: u32, total: u32) {
        let label = self.labels[index as usize];
        let node = self.nodes.at(&label);
        self.nodes.visit(node, &label);
        let past = usize::from(label.waypoint).checked_sub(1);
        let until = past.map(|past| self.agent.waypoints[past].until);
        if label.step == Step::Dwell && label.evicted == 0 && until == Some(label.at) {
            self.kept = label.waypoint;
        }
        let waypoint = self.agent.waypoints.get(usize::from(label.waypoint));
        let done = Label {
            departs: label.at,
            parent: index,
            judged: false,
            ..label
        };
        match waypoint {
            Some(waypoint) if waypoint.distances.goal() == label.vertex => {
                if let Some(at) = waypoint.dwells_until(label.at) {
                    self.push(Label {
                        waypoint: label.waypoint + 1,
                        step: Step::Dwell,
                        at,
                        heading: AT_REST,
                        ..done
                    });
                }
            }
            None => self.push(Label {
                step: Step::End,
                ..done
            }),
            Some(_) => {}
        }
        self.expand_partially(index, total);
        self.wait_for_stays(index);
    }

    /// Generates steps to neighbouring places that cost no more than this in all; the dearer ones
    /// when the state is expanded by its next f-value: mostly never (partial expansion: T.
    /// Yoshizumi, T. Miura, T. Ishida, "A* with partial expansion for large branching factor
    /// problems", AAAI 2000).
    fn expand_partially(&mut self, index: u32, most: u32) {
        let label = self.labels[index as usize];
        let left = &self.agent.waypoints[usize::from(label.waypoint)..];
        let is_there = |goal: Vertex| self.setting.ends_at_goal && goal == label.vertex;
        match left {
            [] => return,
            [last] if is_there(last.distances.goal()) => return,
            _ => {}
        }
        let roadmap = self.setting.roadmap;
        let mut next = u32::MAX;
        // What was expanded by another weight is expanded whole.
        let known = label.expanded;
        let most = match known {
            Some(known) if known.weight_shift != self.weight_shift => u32::MAX,
            _ => most,
        };
        let agent = self.agent;
        let mover = &agent.mover;
        mover.steps_from(roadmap, label.vertex, |to, ticks, n| {
            let (departs, heading, turned) = self.following(&label, to, ticks, n);
            let at = departs.after(ticks);
            let node = self.nodes.flying(label.waypoint, to);
            let paid = label.paid.saturating_add(self.aloft(ticks));
            let Some(least) = self.least(node, label.waypoint, paid, at) else {
                return;
            };
            // Mostly that alone is too dear.
            let remaining = self.nodes.remaining(node);
            let total = weighted(least, remaining, self.weight_shift);
            if total > most {
                next = next.min(total);
                return;
            }
            let step = Label {
                vertex: to,
                grounded: false,
                step: Step::Move,
                departs,
                at,
                heading,
                turned,
                paid,
                parent: index,
                judged: false,
                expanded: None,
                ..label
            };
            let is_covered = self.nodes.is_covered(node, &step);
            if is_covered && !self.setting.allows_revisits {
                return;
            }
            let Some(cost) = self.cost(node, &step) else {
                return;
            };
            let total = weighted(cost, remaining, self.weight_shift);
            if total > most {
                next = next.min(total);
            } else if known.is_none_or(|known| known.leaves_out(cost, remaining)) {
                let label = self.labels.len() as u32;
                self.labels.push(step);
                match is_covered {
                    true => self.remember(label),
                    false => self.open.push(OpenEntry {
                        total,
                        remaining,
                        is_bound: !self.nodes.is_final(node),
                        label,
                    }),
                }
            }
        });
        self.labels[index as usize].expanded = Some(PartialExpansion {
            upto: most,
            weight_shift: self.weight_shift,
        });
        if next < u32::MAX {
            let node = self.nodes.at(&label);
            self.open.push(OpenEntry {
                total: next,
                remaining: self.nodes.remaining(node),
                is_bound: true,
                label: index,
            });
        }
    }

    /// Along which step it comes to where it begins.
    fn first_heading(&self) -> Heading {
        match self.begun_moving() {
            Some(_) => BEYOND,
            None => AT_REST,
        }
    }

    /// What it flew last before it departs, if it has not stood for T₁ since.
    fn begun_moving(&self) -> Option<&'a Leg> {
        let agent = self.agent;
        let turn_ticks = agent.smoothing.as_ref()?.turn_ticks();
        let moving = agent.begun.iter().rfind(|leg| !leg.stays());
        moving.filter(|leg| leg.end.after(turn_ticks) > agent.departs)
    }

    /// Along which step a drone goes from a place to another.
    fn heading(&self, from: Vertex, to: Vertex) -> Heading {
        let roadmap = self.setting.roadmap;
        if roadmap.is_stop(from) || roadmap.is_stop(to) {
            return BEYOND;
        }
        let lattice = roadmap.lattice();
        let [a, b] = [from, to].map(|place| lattice.steps(place));
        neighbour([0, 1, 2].map(|axis| b[axis] - a[axis])).unwrap_or(BEYOND)
    }

    /// When a drone in a state can go on to another place at the earliest, where that takes so many
    /// ticks and is this one of its neighbours, if it is known; along which step, and since when it
    /// has that heading.
    fn following(
        &mut self,
        label: &Label,
        to: Vertex,
        ticks: u32,
        n: Option<usize>,
    ) -> (Tick, Heading, Tick) {
        let agent = self.agent;
        let leaves = match label.grounded {
            true => label.at.max(agent.takes_off),
            false => label.at,
        };
        let Some(smoothing) = &agent.smoothing else {
            return (leaves, AT_REST, Tick(0));
        };
        let heading = match n {
            Some(n) => n as Heading,
            None => self.heading(label.vertex, to),
        };
        if label.heading == AT_REST {
            // Its first motion takes so long to begin, however long it has waited before.
            let begins = match self.agent.begun.is_empty() {
                true => agent.departs.after(smoothing.lead_ticks()),
                false => label.at,
            };
            let departs = leaves.max(begins);
            return (departs, heading, departs);
        }
        if heading == label.heading && heading != BEYOND {
            return (label.at, heading, label.turned);
        }
        let turn_ticks = smoothing.turn_ticks();
        let rested = label.at.after(turn_ticks);
        let may_turn = self.may_turn(smoothing, label, (to, heading, ticks));
        let departs = match may_turn {
            true => label.turned.after(turn_ticks).clamp(label.at, rested),
            false => rested,
        };
        (departs, heading, departs)
    }

    /// Whether a drone in a state may turn towards another place without a stop: its velocity may
    /// change by so much, and there is room beside both legs.
    fn may_turn(
        &mut self,
        smoothing: &Smoothing,
        label: &Label,
        (to, heading, ticks): (Vertex, Heading, u32),
    ) -> bool {
        let roadmap = self.setting.roadmap;
        let is_on_lattice = label.heading != BEYOND && heading != BEYOND;
        if is_on_lattice && !smoothing.may_follow(label.heading, heading) {
            return false;
        }
        let radius_m = self.agent.mover.radius_m();
        let is_wide = || {
            let wide =
                roadmap.open_steps(radius_m + smoothing.corner_deviation_m)?[label.vertex as usize];
            let ends = [25 - label.heading, heading];
            Some(ends.iter().all(|step| wide >> step & 1 != 0))
        };
        if is_on_lattice && (roadmap.solids().is_none() || is_wide() == Some(true)) {
            return true;
        }
        let key = (label.heading, label.vertex, to);
        if is_on_lattice && let Some(known) = self.corners.get(&key) {
            return *known;
        }
        let [corner_m, to_m] = [label.vertex, to].map(|at| roadmap.position_m(at));
        let after_mps = (to_m - corner_m) / Tick(ticks).seconds();
        let before_mps = self.velocity_mps(label);
        let corner = (corner_m, radius_m);
        let has_room = |solids| smoothing.has_room(solids, corner, [before_mps, after_mps]);
        let may = smoothing.follows(before_mps, after_mps) && roadmap.solids().is_none_or(has_room);
        if is_on_lattice {
            self.corners.insert(key, may);
        }
        may
    }

    /// How fast a drone came to a state's place (m/s).
    fn velocity_mps(&self, label: &Label) -> Vector3<f64> {
        let before = match label.step {
            Step::Start => self.begun_moving().copied(),
            // It has not stood for T₁.
            Step::Wait if label.heading != AT_REST => {
                return self.velocity_mps(&self.labels[label.parent as usize]);
            }
            _ => self.before(label),
        };
        before.map_or(Vector3::zeros(), |leg| leg.velocity_mps())
    }

    /// What a drone flies up to a state.
    fn before(&self, label: &Label) -> Option<Leg> {
        let Some(parent) = self.labels.get(label.parent as usize) else {
            return self.agent.begun.last().copied();
        };
        match label.step {
            Step::Move => self.doing(parent, label).pop(),
            _ => self.stay(parent, label.at),
        }
    }

    /// By how much a drone is ahead of the step that leads to a state, and behind it, at most
    /// (ticks), as far as that is known when it steps.
    fn shifted(&self, from: &Label, label: &Label) -> [u32; 2] {
        let Some(smoothing) = &self.agent.smoothing else {
            return [0; 2];
        };
        let ahead = smoothing.ahead_ticks();
        if from.heading == AT_REST || from.at < label.departs {
            [ahead, 0]
        } else if from.heading != label.heading || label.heading == BEYOND {
            [ahead; 2]
        } else {
            [0; 2]
        }
    }

    /// What is flown from one state to the next, from where its path differs on.
    fn flown_to(&self, from: &Label, to: &Label) -> Vec<Leg> {
        let Some(smoothing) = &self.agent.smoothing else {
            return self.doing(from, to);
        };
        let since = from.at.before(smoothing.lead_ticks());
        // Changes of velocity before that are still felt then.
        let felt = since.before(smoothing.lead_ticks());
        let mut chain = vec![*to, *from];
        let mut first = from;
        while first.at > felt
            && let Some(parent) = self.labels.get(first.parent as usize)
        {
            chain.push(*parent);
            first = parent;
        }
        chain.reverse();
        let mut legs = self.up_to(first, felt);
        for pair in chain.windows(2) {
            legs.extend(self.stay(&pair[0], pair[1].departs));
            legs.extend(self.doing(&pair[0], &pair[1]));
        }
        let mut flown = smoothing.flown(&joined(legs));
        flown.retain(|leg| leg.end > since);
        flown
    }

    /// What a drone flies up to a state, at least from a moment on.
    fn up_to(&self, label: &Label, since: Tick) -> Vec<Leg> {
        if self.labels.get(label.parent as usize).is_some() {
            return self.before(label).into_iter().collect();
        }
        let begun = &self.agent.begun;
        let first = begun.partition_point(|leg| leg.end <= since);
        begun[first.saturating_sub(1)..].to_vec()
    }

    /// Judges what leads to a state when it is expanded, not when it is generated: most are never
    /// expanded. Generates the same for a later moment, too.
    ///
    /// `false` if it is forbidden, or dearer than its f-value: then it is back in the open list.
    fn is_confirmed(&mut self, index: u32) -> bool {
        let label = self.labels[index as usize];
        if label.judged {
            return true;
        }
        let from = self.labels[label.parent as usize];
        if self.changes(&from, &label) && !self.can_stop(label.parent) {
            return false;
        }
        let mut all = std::mem::take(&mut self.all);
        all.clear();
        let mut answer = self.judge_by_tables(&from, &label, &mut all);
        // What is tolerated depends on how a drone blocks.
        let is_tolerated = |it: &Blocker| self.agent.may_tolerate(it.drone, label.departs);
        if all.blockers.iter().any(is_tolerated) {
            answer = TableAnswer::Unknown;
        }
        let is_by_tables = answer != TableAnswer::Unknown;
        if !is_by_tables {
            all.clear();
            for leg in self.flown_to(&from, &label) {
                let mut memo = self.memo.borrow_mut();
                memo.judge(&self.setting, &leg, &mut all);
            }
            let ends = (from.vertex, label.vertex);
            if label.step == Step::Move && !self.refuted.has(ends) {
                // How it would go on was in the way.
                (self.refuted).add_blockers(ends, label.departs, &mut all.blockers);
            }
        }
        let is_evicted = |blocker: &Blocker| self.evicts(&label, blocker);
        let again = clear_after(label.departs, &all.blockers, !is_by_tables, is_evicted);
        // Off the ground it moves that much before it departs: a blocker that is gone by then may
        // still have obstructed that.
        let again = again.map(|again| match from.grounded && again <= label.departs {
            true => again.after(self.agent.lead_ticks()),
            false => again,
        });
        if from.at < label.departs {
            let node = self.nodes.at(&from);
            let time = [from.at, label.departs];
            self.nodes.judge_stay(node, &from, time, &mut all);
        }
        std::mem::swap(&mut self.verdict, &mut all);
        let settled = self.settled(Label {
            judged: answer != TableAnswer::DestinationOnly,
            ..label
        });
        self.all = all;
        if let Some(again) = again {
            self.postpone(&label, again);
        }
        let Some(settled) = settled else {
            return false;
        };
        self.labels[index as usize] = settled;
        if settled.step == Step::Move && again.is_none() {
            self.remember(index);
        }
        if settled.paid == label.paid && settled.evicted == label.evicted {
            return true;
        }
        let entry = self.open_entry(index, &settled);
        self.open.extend(entry);
        false
    }

    /// Judges what leads to a state by the tables of reservations, if they know of it.
    fn judge_by_tables(&self, from: &Label, label: &Label, verdict: &mut Verdict) -> TableAnswer {
        let Some(reservations) = self.setting.reservations else {
            return TableAnswer::Unknown;
        };
        let known = !from.grounded
            && reservations.knows(from.vertex)
            && reservations.knows(label.vertex)
            && !self.refuted.has((from.vertex, label.vertex))
            && label.departs >= self.setting.judged_until;
        let by = reservations.querier(self.agent.drone, self.kind(label.waypoint));
        let known = known && !(self.changes(from, label) && self.arrived_by_refuted_edge(from));
        let Some(by) = by.filter(|_| known) else {
            return TableAnswer::Unknown;
        };
        let time = [label.departs, label.at];
        match label.step {
            Step::Move => {
                // Mostly it is the place it leads to that is taken.
                reservations.arrive(by, label.vertex, time, verdict);
                if !verdict.blockers.iter().all(|it| self.evicts(label, it)) {
                    return TableAnswer::DestinationOnly;
                }
                verdict.clear();
                let ends = [from.vertex, label.vertex];
                let [early, late] = self.shifted(from, label);
                let query = StepQuery {
                    by,
                    ends,
                    time,
                    early,
                    late,
                };
                let mut memo = self.memo.borrow_mut();
                let costmap = self.setting.costmap;
                if !memo.step(reservations, costmap, &query, verdict) {
                    return TableAnswer::Unknown;
                }
                let ends = (from.vertex, label.vertex);
                (self.refuted).add_blockers(ends, label.departs, &mut verdict.blockers);
                let full = self.refuted.full();
                if !full.is_empty() || costmap.has_air_limits_of_zones() {
                    for leg in self.doing(from, label) {
                        for &full in full {
                            memo.judge_against(costmap, full, &leg, verdict);
                        }
                        costmap.judge_zones(&leg, verdict);
                    }
                }
            }
            Step::Dwell => reservations.stay(by, label.vertex, time, verdict),
            Step::End => match self.agent.ending {
                Ending::Hover => {
                    let time = [label.at, Tick::FOREVER];
                    reservations.stay(by, label.vertex, time, verdict);
                }
                Ending::Leave if self.agent.leaves_at_once(label.at) => {
                    return TableAnswer::Unknown;
                }
                Ending::Leave => {}
                Ending::Land { .. } => return TableAnswer::Unknown,
            },
            Step::Start | Step::Wait | Step::Later => {}
        }
        TableAnswer::WholeStep
    }

    /// Whether a drone's velocity changes between two states.
    fn changes(&self, from: &Label, label: &Label) -> bool {
        let goes_on = label.step == Step::Move
            && from.heading == label.heading
            && from.at == label.departs
            && label.heading != BEYOND;
        self.agent.smoothing.is_some() && !goes_on && from.heading != AT_REST
    }

    /// Whether a drone may stop or turn at the end of what led to a state, by the tables: it comes
    /// there later than it would pass.
    fn can_stop(&self, index: u32) -> bool {
        let label = &self.labels[index as usize];
        let (Some(smoothing), Some(reservations)) =
            (&self.agent.smoothing, self.setting.reservations)
        else {
            return true;
        };
        let Some(parent) = self.labels.get(label.parent as usize) else {
            return true;
        };
        let known = [parent.vertex, label.vertex].map(|it| reservations.knows(it)) == [true; 2];
        let by = reservations.querier(self.agent.drone, self.kind(label.waypoint));
        let is_step = known
            && label.step == Step::Move
            && label.departs >= self.setting.judged_until
            && !self.arrived_by_refuted_edge(label);
        let Some(by) = by.filter(|_| is_step) else {
            return true;
        };
        let query = StepQuery {
            by,
            ends: [parent.vertex, label.vertex],
            time: [label.departs, label.at],
            early: 0,
            late: smoothing.ahead_ticks(),
        };
        let mut verdict = Verdict::default();
        let mut memo = self.memo.borrow_mut();
        memo.step(reservations, self.setting.costmap, &query, &mut verdict);
        let mut blockers = verdict.blockers.iter();
        let is_tolerated = |drone| self.agent.may_tolerate(drone, label.departs);
        blockers.all(|it| self.evictions.has(label.evicted, it.drone) || is_tolerated(it.drone))
    }

    /// Whether the step that led to a state is a refuted edge, which has to be judged in full.
    fn arrived_by_refuted_edge(&self, from: &Label) -> bool {
        let before = self.labels.get(from.parent as usize);
        let step = before.map(|before| (before.vertex, from.vertex));
        step.is_some_and(|step| step.0 != step.1 && self.refuted.has(step))
    }

    /// A label at the price that the verdict asks for; `None` if it is forbidden.
    fn settled(&mut self, mut label: Label) -> Option<Label> {
        let came_from = self.labels[label.parent as usize];
        if let Some(zone) = self.verdict.breaks_zone {
            self.obstructed(&came_from, &label, Obstructor::Zone(zone));
            return None;
        }
        let price = self.verdict.price_s * self.setting.energy_weight * Tick::PER_SECOND;
        label.paid = label.paid.saturating_add(price.round() as u32);
        let goes_on = label.step == Step::Move && came_from.at == label.departs;
        if goes_on && came_from.heading != AT_REST && came_from.heading != label.heading {
            label.paid = label.paid.saturating_add(TURN_TICKS);
        }
        for position in 0..self.verdict.blockers.len() {
            let blocker = self.verdict.blockers[position];
            let Blocker { drone, why, .. } = blocker;
            if self.agent.tolerates(&blocker, label.departs) || self.evicts(&label, &blocker) {
                continue;
            }
            let free = self.agent.free_departure(label.departs);
            let weight = self.setting.weight(&blocker, free);
            if weight == IMMOVABLE {
                self.obstructed(&came_from, &label, Obstructor::Drone(drone, why));
                return None;
            }
            label.paid = label.paid.saturating_add(weight);
            label.evicted = self.evictions.with(label.evicted, drone);
        }
        Some(label)
    }

    /// Whether the path evicts a blocker already.
    fn evicts(&self, label: &Label, blocker: &Blocker) -> bool {
        let free = self.agent.free_departure(label.departs);
        self.evictions.has(label.evicted, blocker.drone)
            && !self.setting.is_under_way(blocker, free)
    }

    /// Notes what obstructed the step between two states, if no state nearer to the end was
    /// obstructed before.
    fn obstructed(&mut self, from: &Label, to: &Label, by: Obstructor) {
        let waypoint = usize::from(from.waypoint);
        let roadmap = self.setting.roadmap;
        let remaining = (self.agent).remaining(roadmap, waypoint, from.vertex);
        let known = self.obstruction;
        if known.is_none_or(|known| remaining < known.remaining) {
            let lands = to.step == Step::End && matches!(self.agent.ending, Ending::Land { .. });
            let there_m = roadmap.position_m(from.vertex);
            let at_m = match by {
                Obstructor::Drone(other, _) if lands => self.nearest_m(from, to, other),
                _ => None,
            };
            self.obstruction = Some(Obstruction {
                by,
                at_m: at_m.unwrap_or(there_m),
                lands,
                at: from.at,
                remaining,
            });
        }
    }

    /// Where it is nearest to another drone, by whole ticks, from one state to the next (m).
    fn nearest_m(&self, from: &Label, to: &Label, other: DroneId) -> Option<Point3<f64>> {
        let theirs = self.setting.costmap.legs(other);
        let their_m = |at: Tick| {
            let leg = theirs.get(theirs.partition_point(|leg| leg.end < at))?;
            (leg.start <= at).then(|| leg.position_m(at))
        };
        let flown = self.flown_to(from, to);
        let places = flown
            .iter()
            .filter(|leg| leg.end > from.at)
            .flat_map(|leg| {
                let until = if leg.stays() { leg.start } else { leg.end };
                (leg.start.0..=until.0).map(|tick| (Tick(tick), leg.position_m(Tick(tick))))
            });
        let apart = places.filter_map(|(at, own_m)| Some(((their_m(at)? - own_m).norm(), own_m)));
        let nearest = apart.reduce(|a, b| if b.0 < a.0 { b } else { a });
        nearest.map(|(_, own_m)| own_m)
    }

    /// Generates what a label does, but from a later moment on.
    fn postpone(&mut self, label: &Label, departs: Tick) {
        let Some(departs) = departs.0.checked_next_multiple_of(WAIT_GRID_TICKS) else {
            return;
        };
        let later = departs.saturating_sub(label.departs.0);
        let from = self.labels[label.parent as usize];
        let dwells = || {
            let waypoint = &self.agent.waypoints[usize::from(from.waypoint)];
            waypoint.dwells_until(Tick(departs))
        };
        let at = match label.step {
            Step::Dwell => dwells(),
            _ => Some(label.at.after(later)),
        };
        let Some(at) = at else { return };
        if later == 0 || at == Tick::FOREVER {
            return;
        }
        let mut later = Label {
            departs: Tick(departs),
            at,
            paid: match label.step {
                Step::Move => {
                    let ticks = label.at.0 - label.departs.0;
                    from.paid.saturating_add(self.aloft(ticks))
                }
                _ => from.paid,
            },
            evicted: from.evicted,
            judged: false,
            expanded: None,
            ..*label
        };
        if let Some(smoothing) = &self.agent.smoothing {
            let rested = from.at.after(smoothing.turn_ticks()) <= later.departs;
            let goes_on = from.heading == label.heading && label.heading != BEYOND;
            if label.step == Step::Move && (rested || !goes_on) {
                later.turned = later.departs;
            } else if label.step == Step::Wait && rested {
                later.heading = AT_REST;
            }
        }
        self.push(later);
    }

    /// Notes that the place of a label may be reached at another time as well.
    fn remember(&mut self, index: u32) {
        let label = self.labels[index as usize];
        self.push(Label {
            step: Step::Later,
            at: label.at.after(WAIT_GRID_TICKS),
            parent: index,
            ..label
        });
    }

    /// Steps to a place when it is free the next time, if it is not free for good.
    fn step_later(&mut self, index: u32) {
        let label = self.labels[self.labels[index as usize].parent as usize];
        let node = self.nodes.at(&label);
        let is_evicted = |drone| self.evictions.has(label.evicted, drone);
        let (until, again) = (self.nodes).free_until(node, &label, label.at, is_evicted);
        if until < Tick::FOREVER && again < Tick::FOREVER {
            let later = again.0.saturating_sub(label.at.0).max(1);
            self.postpone(&label, label.departs.after(later));
        }
    }

    /// Waits for drones that pass first where it has to stay in the end.
    fn wait_for_stays(&mut self, index: u32) {
        let label = self.labels[index as usize];
        if label.evicted != 0 {
            return;
        }
        let node = self.nodes.at(&label);
        let ends = label.at.0.saturating_add(self.nodes.remaining(node));
        let slack = self.goal_costs.slack(label.waypoint, ends);
        if slack > 0 {
            let at = label.at.after(slack);
            let smoothing = self.agent.smoothing.as_ref();
            let rested = smoothing.is_some_and(|it| slack >= it.turn_ticks());
            self.push(Label {
                step: Step::Wait,
                departs: at,
                at,
                heading: if rested { AT_REST } else { label.heading },
                parent: index,
                judged: false,
                expanded: None,
                ..label
            });
        }
    }

    /// The path that leads to a state.
    fn path(&self, end: u32) -> Path {
        let mut chain = vec![self.labels[end as usize]];
        while let Some(parent) = self.labels.get(chain[chain.len() - 1].parent as usize) {
            chain.push(*parent);
        }
        chain.reverse();
        let mut legs: Vec<Leg> = self.agent.begun.clone();
        for pair in chain.windows(2) {
            let (from, to) = (&pair[0], &pair[1]);
            legs.extend(self.stay(from, to.departs));
            legs.extend(self.doing(from, to));
        }
        let last = &self.labels[end as usize];
        let mut evicted: Vec<_> = self.evictions.of(last.evicted).collect();
        evicted.sort_unstable();
        let arrives = chain
            .iter()
            .rev()
            .find(|label| matches!(label.step, Step::Dwell | Step::Start))
            .map_or(Tick(0), |label| label.at);
        Path {
            legs: joined(legs),
            arrives,
            evicted,
        }
    }

    /// Where it stays between a state and a departure.
    fn stay(&self, from: &Label, departs: Tick) -> Option<Leg> {
        let here_m = self.setting.roadmap.position_m(from.vertex);
        (from.at < departs).then(|| self.leg(from, here_m, departs.0 - from.at.0))
    }

    /// What it does from one state to the next, once it has departed.
    fn doing(&self, from: &Label, to: &Label) -> Vec<Leg> {
        let departed = Label {
            at: to.departs,
            ..*from
        };
        let to_m = self.setting.roadmap.position_m(to.vertex);
        let mut leg = self.leg(&departed, to_m, to.at.0 - to.departs.0);
        match to.step {
            Step::End => {
                leg.end = Tick::FOREVER;
                return self.agent.ends(leg);
            }
            Step::Move => leg.flying = true,
            Step::Dwell => leg.kind = self.kind(to.waypoint),
            Step::Start | Step::Wait | Step::Later => {}
        }
        Vec::from_iter((leg.start < leg.end).then_some(leg))
    }
}

/// The first moment after `departs` at which none of these may block any more; `None` if one stays.
/// Times known `roughly` are those of whole legs.
fn clear_after(
    departs: Tick,
    blockers: &[Blocker],
    roughly: bool,
    is_evicted: impl Fn(&Blocker) -> bool,
) -> Option<Tick> {
    let mut latest = None;
    for blocker in blockers.iter().filter(|blocker| !is_evicted(blocker)) {
        if blocker.clear == Tick::FOREVER {
            return None;
        }
        // A drone on its leg may have cleared half-way already.
        let half = Tick(blocker.began.0.midpoint(blocker.clear.0));
        let early = roughly && half > departs;
        let clear = if early { half } else { blocker.clear };
        latest = latest.max(Some(clear));
    }
    latest
}
