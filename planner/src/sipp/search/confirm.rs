//! Whether what leads to a state may be done: in brief by the tables of reservations where they
//! know of it, in full by the costmap.

use costmap::leg::Tick;
use costmap::verdict::{Blocker, Verdict};

use super::label::{Label, Step};
use super::wait::clear_after;
use super::walk::Search;
use crate::graph::agent::Ending;
use crate::sipp::conflicts::StepQuery;

/// What is known of a step by the tables of reservations.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Brief {
    Nothing,
    /// Who is in the way of being where it leads to; there may be others on the way.
    WhereItLeads,
    Everything,
}

impl Search<'_> {
    /// Judges what leads to a state when its turn comes, not when it is thought of: most never have
    /// their turn. Thinks of the same later, too.
    ///
    /// `false` if it is forbidden, or dearer than thought: then it waits for its turn again.
    pub(super) fn is_confirmed(&mut self, index: u32) -> bool {
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
        let turn = self.turn(index, &settled);
        self.open.extend(turn);
        false
    }

    /// Judges what leads to a state by the tables of reservations, if they know of it.
    fn judge_in_brief(&self, from: &Label, label: &Label, verdict: &mut Verdict) -> Brief {
        let Some(reservations) = self.scene.reservations else {
            return Brief::Nothing;
        };
        let known = !from.grounded
            && reservations.knows(from.vertex)
            && reservations.knows(label.vertex)
            && !self.refuted.contains(&(from.vertex, label.vertex));
        let class = reservations.class(self.agent.drone, self.kind(label.waypoint));
        let Some(class) = class.filter(|_| known) else {
            return Brief::Nothing;
        };
        let time = [label.departs, label.at];
        match label.step {
            Step::Move => {
                // Mostly it is the place it leads to that is taken.
                reservations.arrive(class, label.vertex, time, verdict);
                if !verdict.blockers.iter().all(|it| self.passes(label.met, it)) {
                    return Brief::WhereItLeads;
                }
                verdict.clear();
                let way = [from.vertex, label.vertex];
                let query = StepQuery { class, way, time };
                if !reservations.step(self.scene.costmap, &query, verdict) {
                    return Brief::Nothing;
                }
            }
            Step::Dwell => reservations.stay(class, label.vertex, time, verdict),
            Step::End => match self.agent.ending {
                Ending::Hover => {
                    let time = [label.at, Tick::FOREVER];
                    reservations.stay(class, label.vertex, time, verdict);
                }
                Ending::Leave => {}
                Ending::Land { .. } => return Brief::Nothing,
            },
            Step::Start | Step::Wait | Step::Later => {}
        }
        Brief::Everything
    }
}
