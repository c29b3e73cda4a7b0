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
use crate::stay_price::StayPrice;

/// A drone that nobody can make give way.
pub const IMMOVABLE: u32 = u32::MAX;

/// How far ahead neighbours are gathered, and the longest single wait: chosen here, a bucket of the timeline.
const WINDOW_TICKS: u32 = 100;

/// Waits end on whole multiples of this, so that a crowd does not make a state of every moment: chosen
/// here, a quarter second.
const WAIT_GRID_TICKS: u32 = 25;

/// How hard to look: what is left to fly counts one part in 2ⁿ more than it takes, so that of ways that
/// differ by less the one found first will do; and after how many states to be less choosy. The part
/// bounds the excess of an answer over the best: 1/32, then 1/8, then 1/2. Chosen here: the first
/// level answers nearly always, and the others keep a crowd from costing seconds a drone.
const PATIENCE: [(u32, u64); 3] = [(5, 3_000), (3, 9_000), (1, u64::MAX)];

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
    /// Of dwelling at each task, and of the end.
    stays: Vec<StayPrice>,
    neighbours: Vec<Neighbour>,
    own: Vec<Neighbour>,
    verdict: Verdict,
    obstruction: Option<Obstruction>,
    impatience_shift: u32,
    expansions: u64,
}

impl<'a> Search<'a> {
    fn new(scene: Scene<'a>, errand: &'a Errand, impatience_shift: u32) -> Search<'a> {
        Search {
            scene,
            errand,
            labels: Vec::new(),
            open: BinaryHeap::new(),
            covers: FxHashMap::default(),
            met: vec![(DroneId(u32::MAX), 0)],
            stays: stays(&scene, errand),
            neighbours: Vec::new(),
            own: Vec::new(),
            verdict: Verdict::default(),
            obstruction: None,
            impatience_shift,
            expansions: 0,
        }
    }

    fn run(&mut self, most_expansions: u64) -> Found {
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
        if let Some(never) = self.stays.iter().find_map(|stay| stay.never) {
            return Found::Blocked(Some(Obstruction {
                by: Hindrance::Drone(never.0, never.1),
                at_m: self.scene.roadmap.position_m(self.errand.last_vertex()),
                at: Tick(0),
                remaining: 0,
            }));
        }
        while let Some(Open { label, .. }) = self.open.pop() {
            if self.labels[label as usize].step == Step::End {
                return Found::Path(self.path(label));
            }
            if self.is_covered(&self.labels[label as usize]) || !self.is_confirmed(label) {
                continue;
            }
            self.expansions += 1;
            if self.expansions > most_expansions {
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
        let ends = label.at.0.saturating_add(remaining);
        let excess = if label.met == 0 && label.step != Step::End {
            let excess = |(stay, arrives): (&StayPrice, u32)| stay.excess(arrives);
            self.stays_ahead(label.stage, ends).map(excess).max()
        } else {
            None
        };
        let total = label
            .paid
            .saturating_add(ends)
            .saturating_add(excess.unwrap_or(0))
            .saturating_add(remaining >> self.impatience_shift);
        if total == u32::MAX {
            // Somebody who never leaves is where it has to stay.
            return;
        }
        self.open.push(Open {
            total,
            remaining,
            label: index,
        });
    }

    /// Prices of the stays that are still to come, each with the least tick at which it can begin.
    fn stays_ahead(&self, stage: u16, ends: u32) -> impl Iterator<Item = (&StayPrice, u32)> {
        let ahead = usize::from(stage)..;
        self.stays
            .iter()
            .zip(0..)
            .skip(ahead.start)
            .map(move |(stay, index): (_, usize)| {
                let rest = self
                    .errand
                    .stages
                    .get(index)
                    .map_or(0, |stage| stage.rest_ticks);
                (stay, ends.saturating_sub(rest))
            })
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
        self.scene
            .costmap
            .judge(&hover, &neighbours, &mut self.verdict);
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
        if let Some(zone) = self.verdict.breaks_zone {
            self.obstructed(&came_from, Hindrance::Zone(zone));
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
                self.obstructed(&came_from, Hindrance::Drone(drone, why));
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

    fn obstructed(&mut self, label: &Label, by: Hindrance) {
        let remaining =
            self.errand
                .remaining(self.scene.roadmap, usize::from(label.stage), label.vertex);
        if self
            .obstruction
            .is_none_or(|known| remaining < known.remaining)
        {
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
            all.breaks_zone = all.breaks_zone.or(self.verdict.breaks_zone);
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
                    return vec![Leg {
                        start: label.at,
                        ..rest
                    }];
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
            let ends = label.at.0.saturating_add(remaining);
            let slack = self
                .stays_ahead(label.stage, ends)
                .max_by_key(|(stay, arrives)| stay.excess(*arrives))
                .map_or(0, |(stay, arrives)| stay.slack(arrives));
            next.at(label.at.after(slack));
        }
        next.at(Tick(label.at.0 + WINDOW_TICKS - WAIT_GRID_TICKS + 1));
        let until = next.earliest();
        let here_m = self.scene.roadmap.position_m(label.vertex);
        let leg = self.leg(label, here_m, until.0 - label.at.0);
        self.scene
            .costmap
            .judge(&leg, neighbours, &mut self.verdict);
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
    if verdict.breaks_zone.is_some() {
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
            let moment = moment.0.checked_next_multiple_of(WAIT_GRID_TICKS);
            self.earliest = self.earliest.min(moment.map_or(Tick::FOREVER, Tick));
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

/// What it costs to dwell at each task, and to end.
fn stays(scene: &Scene<'_>, errand: &Errand) -> Vec<StayPrice> {
    let stay = |at: Vertex, kind: KindId, flying: bool| {
        let at_m = scene.roadmap.position_m(at);
        Leg {
            drone: errand.drone,
            kind,
            start: Tick(0),
            end: Tick::FOREVER,
            from_m: at_m,
            to_m: at_m,
            flying,
            air_limit: errand.air_limit,
        }
    };
    let mut stays: Vec<StayPrice> = errand
        .stages
        .iter()
        .zip(&errand.kinds[1..])
        .map(|(stage, &kind)| match stage.dwell_ticks {
            0 => StayPrice::default(),
            ticks => StayPrice::new(scene, stay(stage.distances.goal(), kind, true), ticks),
        })
        .collect();
    let flies = !errand.stages.is_empty() || !errand.grounded;
    stays.push(match (errand.ending, errand.kinds.last()) {
        (Ending::Hover, Some(&kind)) => {
            StayPrice::new(scene, stay(errand.last_vertex(), kind, flies), u32::MAX)
        }
        _ => StayPrice::default(),
    });
    stays
}
