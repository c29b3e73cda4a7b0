//! Space-time A* for one drone among those already planned.
//!
//! A state is a place, a task and a moment. From there the drone steps to a neighbouring place, waits
//! until something near changes, dwells, or ends. What it meets is judged by the costmap. A drone in
//! the way does not forbid a step: it may be met, once, at a price, and gives way afterwards (ejection
//! chains: F. Glover, "Ejection chains, reference structures and alternating path methods for
//! traveling salesman problems", Discrete Applied Mathematics 65, 1996; here as penalties in the
//! search, as in PBS and LNS2 for multi-agent path finding). An immovable one forbids it.
//!
//! Arrivals at a place that could as well have been waited for there are dropped, as in safe-interval
//! path planning (M. Phillips and M. Likhachev, "SIPP", ICRA 2011): each visit covers the time for
//! which hovering there is known to be free.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use costmap::costmap::{Blocker, Costmap, Neighbour, Verdict, Why};
use costmap::leg::{DroneId, KindId, Leg, Tick};
use nalgebra::Point3;
use rustc_hash::FxHashMap;

use crate::distances::UNREACHABLE;
use crate::errand::{Ending, Errand};
use crate::roadmap::{Roadmap, Vertex};

/// A drone that nobody can make give way.
pub const IMMOVABLE: u32 = u32::MAX;

/// How far ahead neighbours are gathered, and the longest single wait: chosen here, a bucket of the timeline.
const WINDOW_TICKS: u32 = 100;

/// The shortest wait, so that a crowd does not make one of every moment: chosen here, a quarter second.
const SHORTEST_WAIT_TICKS: u32 = 25;

/// What is left to fly counts this part more than it takes: of ways that differ by less, the one found
/// first will do. Bounds the excess of a single search's answer over the best: 1/32, chosen here.
const IMPATIENCE_SHIFT: u32 = 5;

/// What a search works on.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    /// Ways through free space.
    pub roadmap: &'a Roadmap,
    /// Everybody planned so far.
    pub costmap: &'a Costmap,
    /// Price in ticks of meeting each drone, or [`IMMOVABLE`].
    pub weights: &'a [u32],
    /// Seconds of delay that a second's worth of hover energy is worth.
    pub energy_weight: f64,
    /// States after which the search gives up.
    pub most_expansions: u64,
    /// Asked now and then.
    pub stop: &'a (dyn Fn() -> bool + Sync),
}

/// A way from start to end.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Back to back from tick 0; the last one may last for ever.
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
    /// Who; `None`: a zone.
    pub by: Option<(DroneId, Why)>,
    /// Where the drone could get to (m).
    pub at_m: Point3<f64>,
    /// When it would have gone on.
    pub at: Tick,
    /// Ticks that were left to fly.
    remaining: u32,
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
    let mut search = Search::new(scene, errand);
    let found = search.run();
    Searched {
        found,
        expansions: search.expansions,
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Start,
    Move,
    Wait,
    Dwell,
    End,
}

#[derive(Clone, Copy, Debug)]
struct Label {
    vertex: Vertex,
    stage: u16,
    grounded: bool,
    step: Step,
    at: Tick,
    /// Prices paid so far, in ticks.
    paid: u32,
    parent: u32,
    /// Last of the drones met, in `Search::met`; 0: none.
    met: u32,
    /// The costmap has been asked about the step that leads here.
    judged: bool,
}

/// Cheapest first; among equals the nearest to the end, then the newest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Open {
    total: u32,
    remaining: u32,
    label: u32,
}

impl Ord for Open {
    fn cmp(&self, other: &Open) -> Ordering {
        let key = |open: &Open| (Reverse(open.total), Reverse(open.remaining), open.label);
        key(self).cmp(&key(other))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Open) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

struct Search<'a> {
    scene: Scene<'a>,
    errand: &'a Errand,
    labels: Vec<Label>,
    open: BinaryHeap<Open>,
    /// Times for which a place is known to be reached and free to hover at.
    covers: FxHashMap<(Vertex, u16, bool), Vec<(Tick, Tick)>>,
    met: Vec<(DroneId, u32)>,
    goal: GoalPrice,
    neighbours: Vec<Neighbour>,
    own: Vec<Neighbour>,
    verdict: Verdict,
    obstruction: Option<Obstruction>,
    expansions: u64,
}

impl<'a> Search<'a> {
    fn new(scene: Scene<'a>, errand: &'a Errand) -> Search<'a> {
        Search {
            scene,
            errand,
            labels: Vec::new(),
            open: BinaryHeap::new(),
            covers: FxHashMap::default(),
            met: vec![(DroneId(u32::MAX), 0)],
            goal: GoalPrice::new(scene, errand),
            neighbours: Vec::new(),
            own: Vec::new(),
            verdict: Verdict::default(),
            obstruction: None,
            expansions: 0,
        }
    }

    fn run(&mut self) -> Found {
        self.push(Label {
            vertex: self.errand.start,
            stage: 0,
            grounded: self.errand.grounded,
            step: Step::Start,
            at: Tick(0),
            paid: 0,
            parent: u32::MAX,
            met: 0,
            judged: true,
        });
        while let Some(Open { label, .. }) = self.open.pop() {
            if self.labels[label as usize].step == Step::End {
                return Found::Path(self.path(label));
            }
            if self.is_covered(&self.labels[label as usize]) || !self.is_confirmed(label) {
                continue;
            }
            self.expansions += 1;
            if self.expansions > self.scene.most_expansions {
                break;
            }
            if self.expansions % 1024 == 0 && (self.scene.stop)() {
                return Found::Stopped;
            }
            self.expand(label);
        }
        Found::Blocked(self.obstruction)
    }

    fn push(&mut self, label: Label) {
        if label.step == Step::End || !self.is_covered(&label) {
            self.labels.push(label);
            self.enqueue(self.labels.len() as u32 - 1);
        }
    }

    fn enqueue(&mut self, index: u32) {
        let label = self.labels[index as usize];
        let remaining =
            self.errand
                .remaining(self.scene.roadmap, usize::from(label.stage), label.vertex);
        if remaining == UNREACHABLE {
            return;
        }
        let arrives = label.at.0.saturating_add(remaining);
        let bound = if label.met == 0 && label.step != Step::End {
            self.goal.bound(arrives)
        } else {
            arrives
        };
        self.open.push(Open {
            total: label
                .paid
                .saturating_add(bound)
                .saturating_add(remaining >> IMPATIENCE_SHIFT),
            remaining,
            label: index,
        });
    }

    fn is_covered(&self, label: &Label) -> bool {
        let key = (label.vertex, label.stage, label.grounded);
        let Some(covers) = self.covers.get(&key) else {
            return false;
        };
        covers.iter().any(|&(from, to)| match label.step {
            // A wait is worth while though its place is free: something near has changed.
            Step::Wait => from == label.at,
            _ => from <= label.at && label.at <= to,
        })
    }

    fn kind(&self, stage: u16) -> KindId {
        self.errand.kinds[usize::from(stage)]
    }

    fn leg(&self, label: &Label, to_m: Point3<f64>, ticks: u32) -> Leg {
        Leg {
            drone: self.errand.drone,
            kind: self.kind(label.stage),
            start: label.at,
            end: label.at.after(ticks),
            from_m: self.scene.roadmap.position_m(label.vertex),
            to_m,
            flying: !label.grounded,
            air_limit: self.errand.air_limit,
        }
    }

    /// Judges a step when its turn comes, not when it is thought of: most never have their turn.
    ///
    /// `false` if it is forbidden, or dearer than thought: then it waits for its turn again.
    fn is_confirmed(&mut self, index: u32) -> bool {
        let label = self.labels[index as usize];
        if label.judged {
            return true;
        }
        let came_from = self.labels[label.parent as usize];
        let to_m = self.scene.roadmap.position_m(label.vertex);
        let mut leg = self.leg(&came_from, to_m, label.at.0 - came_from.at.0);
        leg.flying = true;
        self.judge_afresh(&leg);
        let Some(settled) = self.settled(Label {
            judged: true,
            ..label
        }) else {
            return false;
        };
        self.labels[index as usize] = settled;
        if settled.paid == label.paid && settled.met == label.met {
            return true;
        }
        self.enqueue(index);
        false
    }

    fn expand(&mut self, index: u32) {
        let label = self.labels[index as usize];
        let here_m = self.scene.roadmap.position_m(label.vertex);
        let hover = self.leg(&label, here_m, WINDOW_TICKS);
        let reach_m = self.step_to_neighbours(index, &label);
        let mut neighbours = std::mem::take(&mut self.neighbours);
        self.scene.costmap.near(&hover, &mut neighbours);
        self.scene.costmap.judge(&hover, &neighbours, &mut self.verdict);
        let free_until = free_until(&hover, &self.verdict);
        self.cover(&label, free_until);

        match self.errand.stages.get(usize::from(label.stage)) {
            Some(stage) if stage.distances.goal() == label.vertex => {
                self.dwell(index, &label, stage.dwell_ticks);
            }
            None => self.end(index, &label),
            Some(_) => {}
        }
        let mut next = NextEvent::after(label.at);
        for neighbour in self.scene.costmap.gripping(&hover, reach_m, &neighbours) {
            next.see(neighbour.began(), neighbour.clear());
        }
        self.wait(index, &label, &neighbours, free_until, next);
        self.neighbours = neighbours;
    }

    fn cover(&mut self, label: &Label, until: Tick) {
        let key = (label.vertex, label.stage, label.grounded);
        self.covers.entry(key).or_default().push((label.at, until));
    }

    /// Steps to neighbouring places that are not known to be reached in time anyway; the longest of them (m).
    fn step_to_neighbours(&mut self, index: u32, label: &Label) -> f64 {
        let mut longest_m = 0.0_f64;
        if usize::from(label.stage) == self.errand.stages.len() {
            return longest_m;
        }
        let roadmap = self.scene.roadmap;
        for (to, way) in roadmap.ways(label.vertex) {
            let Some(ticks) = self.errand.mover.ticks(roadmap, to, way) else {
                continue;
            };
            longest_m = longest_m.max(f64::from(way.length_m));
            self.push(Label {
                vertex: to,
                grounded: false,
                step: Step::Move,
                at: label.at.after(ticks),
                parent: index,
                judged: false,
                ..*label
            });
        }
        longest_m
    }

    /// A label at the price that the verdict asks for; `None` if it is forbidden.
    fn settled(&mut self, mut label: Label) -> Option<Label> {
        let came_from = self.labels[label.parent as usize];
        if self.verdict.breaks_zone {
            self.obstructed(&came_from, None);
            return None;
        }
        let price = self.verdict.price_s * self.scene.energy_weight * Tick::PER_SECOND;
        label.paid = label.paid.saturating_add(price.round() as u32);
        for position in 0..self.verdict.blockers.len() {
            let Blocker { drone, why, .. } = self.verdict.blockers[position];
            if self.has_met(label.met, drone) {
                continue;
            }
            let weight = self.scene.weights[drone.0 as usize];
            if weight == IMMOVABLE {
                self.obstructed(&came_from, Some((drone, why)));
                return None;
            }
            label.paid = label.paid.saturating_add(weight);
            self.met.push((drone, label.met));
            label.met = self.met.len() as u32 - 1;
        }
        Some(label)
    }

    /// Pushes a label if the verdict allows it, at the price of those to be met if need be.
    fn settle(&mut self, label: Label) {
        if let Some(label) = self.settled(label) {
            self.push(label);
        }
    }

    fn has_met(&self, mut met: u32, drone: DroneId) -> bool {
        while met != 0 {
            let (known, before) = self.met[met as usize];
            if known == drone {
                return true;
            }
            met = before;
        }
        false
    }

    fn obstructed(&mut self, label: &Label, by: Option<(DroneId, Why)>) {
        let remaining =
            self.errand
                .remaining(self.scene.roadmap, usize::from(label.stage), label.vertex);
        if self.obstruction.is_none_or(|known| remaining < known.remaining) {
            self.obstruction = Some(Obstruction {
                by,
                at_m: self.scene.roadmap.position_m(label.vertex),
                at: label.at,
                remaining,
            });
        }
    }

    fn dwell(&mut self, index: u32, label: &Label, ticks: u32) {
        let done = Label {
            stage: label.stage + 1,
            step: Step::Dwell,
            at: label.at.after(ticks),
            parent: index,
            ..*label
        };
        if ticks == 0 {
            self.push(done);
            return;
        }
        let here_m = self.scene.roadmap.position_m(label.vertex);
        let mut leg = self.leg(label, here_m, ticks);
        leg.kind = self.kind(done.stage);
        self.judge_afresh(&leg);
        self.settle(done);
    }

    fn end(&mut self, index: u32, label: &Label) {
        let legs = self.ending_legs(label);
        let mut ended = Label {
            step: Step::End,
            parent: index,
            ..*label
        };
        let mut all = Verdict::default();
        for leg in &legs {
            self.judge_afresh(leg);
            all.breaks_zone |= self.verdict.breaks_zone;
            all.price_s += self.verdict.price_s;
            all.blockers.append(&mut self.verdict.blockers);
        }
        self.verdict = all;
        ended.at = label.at;
        self.settle(ended);
    }

    /// Judges a leg against its own neighbours.
    fn judge_afresh(&mut self, leg: &Leg) {
        let mut found = std::mem::take(&mut self.own);
        self.scene.costmap.near(leg, &mut found);
        self.scene.costmap.judge(leg, &found, &mut self.verdict);
        self.own = found;
    }

    fn ending_legs(&self, label: &Label) -> Vec<Leg> {
        let here_m = self.scene.roadmap.position_m(label.vertex);
        let stay = Leg {
            end: Tick::FOREVER,
            ..self.leg(label, here_m, 0)
        };
        match self.errand.ending {
            Ending::Leave => Vec::new(),
            Ending::Hover => vec![stay],
            Ending::Land { rest_m, ticks } => {
                let down = self.leg(label, rest_m, ticks);
                let rest = Leg {
                    start: down.end,
                    from_m: rest_m,
                    to_m: rest_m,
                    flying: false,
                    ..stay
                };
                if ticks == 0 || label.grounded {
                    return vec![Leg { start: label.at, ..rest }];
                }
                vec![down, rest]
            }
        }
    }

    fn wait(
        &mut self,
        index: u32,
        label: &Label,
        neighbours: &[Neighbour],
        free_until: Tick,
        mut next: NextEvent,
    ) {
        let settled = label.at >= self.scene.costmap.horizon();
        if settled && free_until >= label.at.after(WINDOW_TICKS) {
            // Nothing changes any more: to wait is to lose time.
            self.cover(label, Tick::FOREVER);
            return;
        }
        let remaining =
            self.errand
                .remaining(self.scene.roadmap, usize::from(label.stage), label.vertex);
        if label.met == 0 {
            let arrives = label.at.0.saturating_add(remaining);
            next.at(label.at.after(self.goal.slack(arrives)));
        }
        let until = next.earliest().min(label.at.after(WINDOW_TICKS));
        let here_m = self.scene.roadmap.position_m(label.vertex);
        let leg = self.leg(label, here_m, until.0 - label.at.0);
        self.scene.costmap.judge(&leg, neighbours, &mut self.verdict);
        let waited = Label {
            step: Step::Wait,
            at: until,
            parent: index,
            ..*label
        };
        self.settle(waited);
    }

    fn path(&self, end: u32) -> Path {
        let mut chain = vec![self.labels[end as usize]];
        while let Some(parent) = self.labels.get(chain[chain.len() - 1].parent as usize) {
            chain.push(*parent);
        }
        chain.reverse();
        let mut legs: Vec<Leg> = Vec::new();
        for pair in chain.windows(2) {
            let (from, to) = (&pair[0], &pair[1]);
            let to_m = self.scene.roadmap.position_m(to.vertex);
            let mut leg = self.leg(from, to_m, to.at.0 - from.at.0);
            match to.step {
                Step::Move => leg.flying = true,
                Step::Dwell => leg.kind = self.kind(to.stage),
                Step::End => {
                    legs.extend(self.ending_legs(from));
                    continue;
                }
                Step::Start | Step::Wait => {}
            }
            if leg.start < leg.end {
                legs.push(leg);
            }
        }
        let last = &self.labels[end as usize];
        let mut met = Vec::new();
        let mut at = last.met;
        while at != 0 {
            met.push(self.met[at as usize].0);
            at = self.met[at as usize].1;
        }
        met.sort_unstable();
        let arrives = chain
            .iter()
            .rev()
            .find(|label| matches!(label.step, Step::Dwell | Step::Start))
            .map_or(Tick(0), |label| label.at);
        Path {
            legs: joined(legs),
            arrives,
            met,
        }
    }
}

/// Joins stays that follow one another.
fn joined(legs: Vec<Leg>) -> Vec<Leg> {
    let mut joined: Vec<Leg> = Vec::with_capacity(legs.len());
    for leg in legs {
        match joined.last_mut() {
            Some(last)
                if last.stays()
                    && leg.stays()
                    && last.kind == leg.kind
                    && last.flying == leg.flying =>
            {
                last.end = leg.end;
            }
            _ => joined.push(leg),
        }
    }
    joined
}

/// How long a hover is free, at least.
fn free_until(hover: &Leg, verdict: &Verdict) -> Tick {
    if verdict.breaks_zone {
        return hover.start;
    }
    verdict
        .blockers
        .iter()
        .map(|blocker| blocker.began.max(hover.start))
        .fold(hover.end, Tick::min)
}

/// The next moment at which something near may have changed.
#[derive(Clone, Copy, Debug)]
struct NextEvent {
    now: Tick,
    earliest: Tick,
}

impl NextEvent {
    fn after(now: Tick) -> NextEvent {
        NextEvent {
            now,
            earliest: Tick::FOREVER,
        }
    }

    fn at(&mut self, moment: Tick) {
        if moment > self.now {
            let moment = moment.max(self.now.after(SHORTEST_WAIT_TICKS));
            self.earliest = self.earliest.min(moment);
        }
    }

    /// A drone on its leg may be out of the way half-way already.
    fn see(&mut self, began: Tick, clear: Tick) {
        if clear != Tick::FOREVER {
            self.at(Tick(began.0.midpoint(clear.0)));
            self.at(clear);
        }
    }

    fn earliest(&self) -> Tick {
        self.earliest
    }
}

/// What ending costs at least, by when: others may still come through the goal.
struct GoalPrice {
    /// From when, and the price of all who come later still.
    steps: Vec<(u32, u32)>,
    /// Least total of any later step.
    later: Vec<u32>,
}

impl GoalPrice {
    fn new(scene: Scene<'_>, errand: &Errand) -> GoalPrice {
        let mut steps = vec![(0, 0)];
        if errand.ending == Ending::Hover {
            let at_m = scene.roadmap.position_m(errand.last_vertex());
            let stay = Leg {
                drone: errand.drone,
                kind: errand.kinds[errand.kinds.len() - 1],
                start: Tick(0),
                end: Tick::FOREVER,
                from_m: at_m,
                to_m: at_m,
                flying: !errand.stages.is_empty() || !errand.grounded,
                air_limit: errand.air_limit,
            };
            let mut found = Vec::new();
            let mut verdict = Verdict::default();
            scene.costmap.near(&stay, &mut found);
            scene.costmap.judge(&stay, &found, &mut verdict);
            steps = price_steps(scene.weights, &mut verdict.blockers);
        }
        let mut later = vec![u32::MAX; steps.len()];
        for index in (1..steps.len()).rev() {
            let (from, price) = steps[index];
            later[index - 1] = later[index].min(from.saturating_add(price));
        }
        GoalPrice { steps, later }
    }

    fn step(&self, arrives: u32) -> usize {
        self.steps.partition_point(|(from, _)| *from <= arrives) - 1
    }

    /// Least time plus price of ending, arriving no earlier than this.
    fn bound(&self, arrives: u32) -> u32 {
        let step = self.step(arrives);
        arrives
            .saturating_add(self.steps[step].1)
            .min(self.later[step])
    }

    /// How much later it is best to arrive.
    fn slack(&self, arrives: u32) -> u32 {
        let step = self.step(arrives);
        if arrives.saturating_add(self.steps[step].1) <= self.later[step] {
            return 0;
        }
        let best = (step + 1..self.steps.len())
            .min_by_key(|&index| self.steps[index].0.saturating_add(self.steps[index].1));
        best.map_or(0, |index| self.steps[index].0 - arrives)
    }
}

/// Moments at which somebody has gone for good, and the price of those still to come.
fn price_steps(weights: &[u32], blockers: &mut [Blocker]) -> Vec<(u32, u32)> {
    let mut last: Vec<(DroneId, Tick)> = Vec::new();
    blockers.sort_unstable_by_key(|blocker| (blocker.drone, blocker.clear));
    for blocker in blockers.iter() {
        match last.last_mut() {
            Some((drone, clear)) if *drone == blocker.drone => *clear = blocker.clear,
            _ => last.push((blocker.drone, blocker.clear)),
        }
    }
    last.sort_unstable_by_key(|(drone, clear)| (*clear, *drone));
    let price = |from: usize| {
        last[from..]
            .iter()
            .fold(0_u32, |sum, (drone, _)| sum.saturating_add(weights[drone.0 as usize]))
    };
    let mut steps = vec![(0, price(0))];
    for (index, (_, clear)) in last.iter().enumerate() {
        if *clear == Tick::FOREVER {
            break;
        }
        match steps.last_mut() {
            Some((from, known)) if *from == clear.0 => *known = price(index + 1),
            _ => steps.push((clear.0, price(index + 1))),
        }
    }
    steps
}
