//! The search itself: states have their turn in order, and lead to steps, waits, dwells and the end.

use std::collections::BinaryHeap;
use std::rc::Rc;

use costmap::leg::{KindId, Leg, Tick};
use costmap::verdict::{Blocker, Verdict};
use nalgebra::Point3;

use super::label::{Label, Offered, Open, Step, hurried};
use super::met::Met;
use super::node::Nodes;
use super::outlook::Outlook;
use super::wait::clear_after;
use super::{Doubts, Found, Hindrance, Obstruction, Scene};
use crate::crowd::Thought;
use crate::distances::UNREACHABLE;
use crate::errand::{Ending, Errand};
use crate::stay_price::StayPrice;

pub(super) struct Search<'a> {
    pub(super) scene: Scene<'a>,
    pub(super) errand: &'a Errand,
    doubts: Rc<Doubts>,
    pub(super) labels: Vec<Label>,
    open: BinaryHeap<Open>,
    pub(super) nodes: Nodes<'a>,
    pub(super) met: Met,
    /// Of dwelling at each task, and of the end.
    pub(super) stays: Rc<[StayPrice]>,
    pub(super) verdict: Verdict,
    all: Verdict,
    pub(super) obstruction: Option<Obstruction>,
    impatience_shift: u32,
    pub(super) expansions: u64,
}

/// What is known of a step by the crowd's tables.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Brief {
    Nothing,
    /// Who is in the way of being where it leads to; there may be others on the way.
    WhereItLeads,
    Everything,
}

impl<'a> Search<'a> {
    pub(super) fn new(
        scene: Scene<'a>,
        errand: &'a Errand,
        doubts: Rc<Doubts>,
        outlook: Outlook<'a>,
        stays: Rc<[StayPrice]>,
        impatience_shift: u32,
    ) -> Search<'a> {
        Search {
            scene,
            errand,
            doubts: doubts.clone(),
            labels: Vec::new(),
            open: BinaryHeap::new(),
            nodes: Nodes::new(scene, errand, doubts, outlook),
            met: Met::new(),
            stays,
            verdict: Verdict::default(),
            all: Verdict::default(),
            obstruction: None,
            impatience_shift,
            expansions: 0,
        }
    }

    /// Looks until it has expanded so many states in all; `None` if it is to go on from there.
    pub(super) fn run(&mut self, most_expansions: u64) -> Option<Found> {
        if let Some(never) = self.stays.iter().find_map(|stay| stay.never) {
            return Some(Found::Blocked(Some(Obstruction {
                by: Hindrance::Drone(never.0, never.1),
                at_m: self.scene.roadmap.position_m(self.errand.last_vertex()),
                at: Tick(0),
                remaining: 0,
            })));
        }
        if self.labels.is_empty() {
            self.begin();
        }
        while self.expansions < most_expansions {
            let Some(open) = self.open.pop() else {
                return Some(Found::Blocked(self.obstruction));
            };
            if let Some(found) = self.take_turn(open) {
                return Some(found);
            }
        }
        None
    }

    fn begin(&mut self) {
        self.push(Label {
            vertex: self.errand.start,
            stage: 0,
            grounded: self.errand.grounded,
            step: Step::Start,
            departs: self.errand.departs,
            at: self.errand.departs,
            paid: 0,
            parent: u32::MAX,
            met: 0,
            judged: true,
            offered: None,
        });
    }

    /// Counts what is left to fly one part in 2ⁿ more from here on. What is known stays known; what is open is put in the
    /// order that this makes.
    pub(super) fn hurry(&mut self, impatience_shift: u32) {
        self.impatience_shift = impatience_shift;
        for open in std::mem::take(&mut self.open) {
            let label = self.labels[open.label as usize];
            let node = self.nodes.at(&label);
            if let Some((cost, remaining)) = self.cost(node, &label) {
                self.open.push(Open {
                    total: hurried(cost, remaining, impatience_shift),
                    remaining,
                    is_bound: !self.nodes.is_final(node),
                    label: open.label,
                });
            }
        }
    }

    fn take_turn(&mut self, open: Open) -> Option<Found> {
        let Open { label, total, .. } = open;
        let found = self.labels[label as usize];
        if found.offered.is_some() {
            self.offer(label, total);
            return None;
        }
        if found.step == Step::Later {
            self.step_later(label);
            return None;
        }
        let node = self.nodes.at(&found);
        if self.nodes.settle(node, &found) > open.remaining {
            // It was thought of by a bound.
            if let Some((total, remaining)) = self.total(&found) {
                self.open.push(Open {
                    total,
                    remaining,
                    is_bound: false,
                    label,
                });
            }
            return None;
        }
        if self.nodes.is_reached(node, &found, &self.met) {
            return None;
        }
        self.expansions += 1;
        if self.expansions.is_multiple_of(1024) && (self.scene.stop)() {
            return Some(Found::Stopped);
        }
        if !self.is_confirmed(label) {
            return None;
        }
        if found.step == Step::End {
            return Some(Found::Path(self.path(label)));
        }
        self.expand(label, total);
        None
    }

    pub(super) fn push(&mut self, label: Label) {
        if let Some((total, remaining)) = self.total(&label) {
            self.push_at(label, total, remaining);
        }
    }

    fn push_at(&mut self, label: Label, total: u32, remaining: u32) {
        self.labels.push(label);
        let is_bound = self.is_bound(&label);
        self.open.push(Open {
            total,
            remaining,
            is_bound,
            label: self.labels.len() as u32 - 1,
        });
    }

    fn is_bound(&mut self, label: &Label) -> bool {
        let node = self.nodes.at(label);
        !self.nodes.is_final(node)
    }

    /// What a way through this state costs at least, and how long the rest takes; `None` if there is no
    /// way, or no need to go there.
    fn total(&mut self, label: &Label) -> Option<(u32, u32)> {
        let node = self.nodes.at(label);
        if self.nodes.is_covered(node, label) {
            return None;
        }
        let (cost, remaining) = self.cost(node, label)?;
        Some((hurried(cost, remaining, self.impatience_shift), remaining))
    }

    /// The same whether there is need to go there or not, and without haste.
    fn cost(&self, node: usize, label: &Label) -> Option<(u32, u32)> {
        let remaining = self.nodes.remaining(node);
        if remaining == UNREACHABLE {
            return None;
        }
        let ends = label.at.0.saturating_add(remaining);
        let excess = if label.met == 0 && label.step != Step::End {
            let excess = |(stay, arrives): (&StayPrice, u32)| stay.excess(arrives);
            self.stays_ahead(label.stage, ends).map(excess).max()
        } else {
            None
        };
        let cost = label
            .paid
            .saturating_add(ends)
            .saturating_add(excess.unwrap_or(0));
        // The highest: somebody who never leaves is where it has to stay.
        (cost < u32::MAX).then_some((cost, remaining))
    }

    /// Prices of the stays that are still to come, each with the least tick at which it can begin.
    pub(super) fn stays_ahead(
        &self,
        stage: u16,
        ends: u32,
    ) -> impl Iterator<Item = (&StayPrice, u32)> {
        let priced = self.stays.iter().enumerate().skip(usize::from(stage));
        priced
            .filter(|(_, stay)| !stay.is_free())
            .map(move |(index, stay)| {
                let stage = self.errand.stages.get(index);
                let rest = stage.map_or(0, |stage| stage.rest_ticks);
                (stay, ends.saturating_sub(rest))
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

    /// Judges what leads to a state when its turn comes, not when it is thought of: most never have their
    /// turn. Thinks of the same later, too.
    ///
    /// `false` if it is forbidden, or dearer than thought: then it waits for its turn again.
    fn is_confirmed(&mut self, index: u32) -> bool {
        let label = self.labels[index as usize];
        if label.judged {
            return true;
        }
        let from = self.labels[label.parent as usize];
        let mut all = std::mem::take(&mut self.all);
        all.clear();
        let brief = self.judge_in_brief(&from, &label, &mut all);
        let in_brief = brief != Brief::Nothing;
        if !in_brief {
            all.clear();
            for leg in self.doing(&from, &label) {
                self.scene.judge(&leg, &mut self.verdict);
                all.breaks_zone = all.breaks_zone.or(self.verdict.breaks_zone);
                all.price_s += self.verdict.price_s;
                all.blockers.append(&mut self.verdict.blockers);
            }
        }
        let is_met = |blocker: &Blocker| self.passes(label.met, blocker);
        let again = clear_after(label.departs, &all.blockers, !in_brief, is_met);
        if from.at < label.departs {
            let node = self.nodes.at(&from);
            let time = [from.at, label.departs];
            self.nodes.judge_stay(node, &from, time, &mut all);
        }
        std::mem::swap(&mut self.verdict, &mut all);
        let settled = self.settled(Label {
            judged: brief != Brief::WhereItLeads,
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
        if settled.paid == label.paid && settled.met == label.met {
            return true;
        }
        if let Some((total, remaining)) = self.total(&settled) {
            self.open.push(Open {
                total,
                remaining,
                is_bound: false,
                label: index,
            });
        }
        false
    }

    /// Judges what leads to a state by the crowd's tables, if they know of it.
    fn judge_in_brief(&self, from: &Label, label: &Label, verdict: &mut Verdict) -> Brief {
        let Some(crowd) = self.scene.crowd else {
            return Brief::Nothing;
        };
        let known = !from.grounded
            && crowd.knows(from.vertex)
            && crowd.knows(label.vertex)
            && !self.doubts.contains(&(from.vertex, label.vertex));
        let class = crowd.class(self.errand.drone, self.kind(label.stage));
        let Some(class) = class.filter(|_| known) else {
            return Brief::Nothing;
        };
        let time = [label.departs, label.at];
        match label.step {
            Step::Move => {
                // Mostly it is the place it leads to that is taken.
                crowd.arrive(class, label.vertex, time, verdict);
                if !verdict.blockers.iter().all(|it| self.passes(label.met, it)) {
                    return Brief::WhereItLeads;
                }
                verdict.clear();
                let way = [from.vertex, label.vertex];
                let thought = Thought { class, way, time };
                if !crowd.step(self.scene.costmap, &thought, verdict) {
                    return Brief::Nothing;
                }
            }
            Step::Dwell => crowd.stay(class, label.vertex, time, verdict),
            Step::End => match self.errand.ending {
                Ending::Hover => {
                    let time = [label.at, Tick::FOREVER];
                    crowd.stay(class, label.vertex, time, verdict);
                }
                Ending::Leave => {}
                Ending::Land { .. } => return Brief::Nothing,
            },
            Step::Start | Step::Wait | Step::Later => {}
        }
        Brief::Everything
    }

    fn expand(&mut self, index: u32, total: u32) {
        let label = self.labels[index as usize];
        let node = self.nodes.at(&label);
        self.nodes.visit(node, &label);
        let stage = self.errand.stages.get(usize::from(label.stage));
        let done = Label {
            departs: label.at,
            parent: index,
            judged: false,
            ..label
        };
        match stage {
            Some(stage) if stage.distances.goal() == label.vertex => self.push(Label {
                stage: label.stage + 1,
                step: Step::Dwell,
                at: label.at.after(stage.dwell_ticks),
                ..done
            }),
            None => self.push(Label {
                step: Step::End,
                ..done
            }),
            Some(_) => {}
        }
        self.offer(index, total);
        self.wait_for_stays(index);
    }

    /// Steps to neighbouring places that cost no more than this in all. The dearer ones have their turn
    /// when it comes to them: mostly never (partial expansion: T. Yoshizumi, T. Miura, T. Ishida, "A* with
    /// partial expansion for large branching factor problems", AAAI 2000).
    fn offer(&mut self, index: u32, most: u32) {
        let label = self.labels[index as usize];
        if usize::from(label.stage) == self.errand.stages.len() {
            return;
        }
        let roadmap = self.scene.roadmap;
        let mut next = u32::MAX;
        // What was offered in less haste is offered whole.
        let known = label.offered;
        let most = match known {
            Some(known) if known.impatience_shift != self.impatience_shift => u32::MAX,
            _ => most,
        };
        let errand = self.errand;
        errand.mover.steps_from(roadmap, label.vertex, |to, ticks| {
            let step = Label {
                vertex: to,
                grounded: false,
                step: Step::Move,
                departs: label.at,
                at: label.at.after(ticks),
                parent: index,
                judged: false,
                offered: None,
                ..label
            };
            let node = self.nodes.at(&step);
            if self.nodes.is_covered(node, &step) {
                return;
            }
            let Some((cost, remaining)) = self.cost(node, &step) else {
                return;
            };
            let total = hurried(cost, remaining, self.impatience_shift);
            if total > most {
                next = next.min(total);
            } else if known.is_none_or(|known| known.leaves_out(cost, remaining)) {
                self.push_at(step, total, remaining);
            }
        });
        self.labels[index as usize].offered = Some(Offered {
            upto: most,
            impatience_shift: self.impatience_shift,
        });
        if next < u32::MAX {
            let node = self.nodes.at(&label);
            self.open.push(Open {
                total: next,
                remaining: self.nodes.remaining(node),
                is_bound: true,
                label: index,
            });
        }
    }
}
