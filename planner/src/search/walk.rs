//! The search itself: states have their turn in order, and lead to steps, waits, dwells and the end.

use std::collections::BinaryHeap;

use costmap::costmap::Neighbour;
use costmap::leg::{DroneId, KindId, Leg, Tick};
use costmap::verdict::Verdict;
use nalgebra::Point3;
use rustc_hash::FxHashMap;

use super::label::{Label, Open, Step};
use super::wait::{NextEvent, WAIT_GRID_TICKS, free_until};
use super::{Found, Hindrance, Obstruction, Scene};
use crate::distances::UNREACHABLE;
use crate::errand::Errand;
use crate::roadmap::Vertex;
use crate::stay_price::{StayPrice, stays};

/// How far ahead neighbours are gathered, and the longest single wait: chosen here, a bucket of the timeline.
const WINDOW_TICKS: u32 = 100;

pub(super) struct Search<'a> {
    pub(super) scene: Scene<'a>,
    pub(super) errand: &'a Errand,
    pub(super) labels: Vec<Label>,
    open: BinaryHeap<Open>,
    /// Times for which a place is known to be reached and free to hover at.
    covers: FxHashMap<(Vertex, u16, bool), Vec<(Tick, Tick)>>,
    pub(super) met: Vec<(DroneId, u32)>,
    /// Of dwelling at each task, and of the end.
    pub(super) stays: Vec<StayPrice>,
    neighbours: Vec<Neighbour>,
    own: Vec<Neighbour>,
    pub(super) verdict: Verdict,
    pub(super) obstruction: Option<Obstruction>,
    impatience_shift: u32,
    pub(super) expansions: u64,
}

impl<'a> Search<'a> {
    pub(super) fn new(scene: Scene<'a>, errand: &'a Errand, impatience_shift: u32) -> Search<'a> {
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

    pub(super) fn run(&mut self, most_expansions: u64) -> Found {
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
            if self.expansions.is_multiple_of(1024) && (self.scene.stop)() {
                return Found::Stopped;
            }
            self.expand(label);
        }
        Found::Blocked(self.obstruction)
    }

    pub(super) fn push(&mut self, label: Label) {
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

    pub(super) fn kind(&self, stage: u16) -> KindId {
        self.errand.kinds[usize::from(stage)]
    }

    pub(super) fn leg(&self, label: &Label, to_m: Point3<f64>, ticks: u32) -> Leg {
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
}
