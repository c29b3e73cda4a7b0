//! The search itself: states have their turn in order, and lead to steps, waits, dwells and the
//! end.

use std::collections::BinaryHeap;
use std::rc::Rc;

use costmap::leg::{KindId, Leg, Tick};
use costmap::verdict::Verdict;
use nalgebra::Point3;

use super::heuristic::Heuristic;
use super::label::{Label, Open, PartialExpansion, Step, weighted};
use super::met::Met;
use super::node::Nodes;
use super::{Found, Obstruction, Obstructor, RefutedEdges, Scene};
use crate::graph::agent::Agent;
use crate::graph::distances::UNREACHABLE;
use crate::sipp::goal_occupancy::Stays;

pub(super) struct Search<'a> {
    pub(super) scene: Scene<'a>,
    pub(super) agent: &'a Agent,
    pub(super) refuted: Rc<RefutedEdges>,
    pub(super) labels: Vec<Label>,
    pub(super) open: BinaryHeap<Open>,
    pub(super) nodes: Nodes<'a>,
    pub(super) met: Met,
    /// Of dwelling at each task, and of the end.
    pub(super) stays: Rc<Stays>,
    pub(super) verdict: Verdict,
    pub(super) all: Verdict,
    pub(super) obstruction: Option<Obstruction>,
    weight_shift: u32,
    pub(super) expansions: u64,
}

impl<'a> Search<'a> {
    pub(super) fn new(
        scene: Scene<'a>,
        agent: &'a Agent,
        refuted: Rc<RefutedEdges>,
        heuristic: Heuristic<'a>,
        stays: Rc<Stays>,
        weight_shift: u32,
    ) -> Search<'a> {
        Search {
            scene,
            agent,
            refuted: refuted.clone(),
            labels: Vec::new(),
            open: BinaryHeap::new(),
            nodes: Nodes::new(scene, agent, refuted, heuristic),
            met: Met::new(),
            stays,
            verdict: Verdict::default(),
            all: Verdict::default(),
            obstruction: None,
            weight_shift,
            expansions: 0,
        }
    }

    /// Looks until it has expanded so many states in all; `None` if it is to go on from there.
    pub(super) fn run(&mut self, most_expansions: u64) -> Option<Found> {
        if let Some(never) = self.stays.never {
            return Some(Found::Blocked(Some(Obstruction {
                by: Obstructor::Drone(never.0, never.1),
                at_m: self.scene.roadmap.position_m(self.agent.last_vertex()),
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
            vertex: self.agent.start,
            waypoint: 0,
            grounded: self.agent.grounded,
            step: Step::Start,
            departs: self.agent.departs,
            at: self.agent.departs,
            paid: 0,
            parent: u32::MAX,
            met: 0,
            judged: true,
            expanded: None,
        });
    }

    /// Counts what is left to fly one part in 2ⁿ more from here on. What is known stays known; what
    /// is open is put in the order that this makes.
    pub(super) fn reweigh(&mut self, weight_shift: u32) {
        self.weight_shift = weight_shift;
        for open in std::mem::take(&mut self.open) {
            let label = self.labels[open.label as usize];
            let node = self.nodes.at(&label);
            self.open.extend(self.turn_at(node, open.label, &label));
        }
    }

    fn take_turn(&mut self, open: Open) -> Option<Found> {
        let Open { label, total, .. } = open;
        let found = self.labels[label as usize];
        if found.expanded.is_some() {
            self.expand_partially(label, total);
            return None;
        }
        if found.step == Step::Later {
            self.step_later(label);
            return None;
        }
        let node = self.nodes.at(&found);
        let (remaining, is_final) = self.nodes.look_on(node, &found);
        if remaining > open.remaining || !is_final {
            // It was thought of by a bound.
            let turn = self.turn(label, &found);
            self.open.extend(turn);
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
        let index = self.labels.len() as u32;
        if let Some(open) = self.turn(index, &label) {
            self.labels.push(label);
            self.open.push(open);
        }
    }

    /// When a state has its turn: by what a way through it costs at least. `None` if there is no
    /// way, or no need to go there.
    pub(super) fn turn(&mut self, index: u32, label: &Label) -> Option<Open> {
        let node = self.nodes.at(label);
        if self.nodes.is_covered(node, label) {
            return None;
        }
        self.turn_at(node, index, label)
    }

    /// The same whether there is need to go there or not.
    fn turn_at(&self, node: usize, index: u32, label: &Label) -> Option<Open> {
        let cost = self.cost(node, label)?;
        let remaining = self.nodes.remaining(node);
        Some(Open {
            total: weighted(cost, remaining, self.weight_shift),
            remaining,
            is_bound: !self.nodes.is_final(node),
            label: index,
        })
    }

    /// Without haste.
    fn cost(&self, node: usize, label: &Label) -> Option<u32> {
        let least = self.least(node, label.paid, label.at)?;
        if label.met != 0 || label.step == Step::End {
            return Some(least);
        }
        let excess = self.stays.excess(label.waypoint, least - label.paid);
        // The highest: a drone who never leaves is where it has to stay.
        least.checked_add(excess).filter(|cost| *cost < u32::MAX)
    }

    /// The same but for stays that others are in the way of.
    fn least(&self, node: usize, paid: u32, at: Tick) -> Option<u32> {
        let remaining = self.nodes.remaining(node);
        if remaining == UNREACHABLE {
            return None;
        }
        let least = paid.saturating_add(at.0).saturating_add(remaining);
        (least < u32::MAX).then_some(least)
    }

    pub(super) fn kind(&self, waypoint: u16) -> KindId {
        self.agent.kinds[usize::from(waypoint)]
    }

    pub(super) fn leg(&self, label: &Label, to_m: Point3<f64>, ticks: u32) -> Leg {
        let from_m = self.scene.roadmap.position_m(label.vertex);
        Leg {
            start: label.at,
            end: label.at.after(ticks),
            to_m,
            flying: !label.grounded,
            ..self.agent.hover(from_m, self.kind(label.waypoint))
        }
    }

    fn expand(&mut self, index: u32, total: u32) {
        let label = self.labels[index as usize];
        let node = self.nodes.at(&label);
        self.nodes.visit(node, &label);
        let waypoint = self.agent.waypoints.get(usize::from(label.waypoint));
        let done = Label {
            departs: label.at,
            parent: index,
            judged: false,
            ..label
        };
        match waypoint {
            Some(waypoint) if waypoint.distances.goal() == label.vertex => self.push(Label {
                waypoint: label.waypoint + 1,
                step: Step::Dwell,
                at: label.at.after(waypoint.dwell_ticks),
                ..done
            }),
            None => self.push(Label {
                step: Step::End,
                ..done
            }),
            Some(_) => {}
        }
        self.expand_partially(index, total);
        self.wait_for_stays(index);
    }

    /// Steps to neighbouring places that cost no more than this in all. The dearer ones have their
    /// turn when it comes to them: mostly never (partial expansion: T. Yoshizumi, T. Miura, T.
    /// Ishida, "A* with partial expansion for large branching factor problems", AAAI 2000).
    fn expand_partially(&mut self, index: u32, most: u32) {
        let label = self.labels[index as usize];
        if usize::from(label.waypoint) == self.agent.waypoints.len() {
            return;
        }
        let roadmap = self.scene.roadmap;
        let mut next = u32::MAX;
        // What was offered in less haste is offered whole.
        let known = label.expanded;
        let most = match known {
            Some(known) if known.weight_shift != self.weight_shift => u32::MAX,
            _ => most,
        };
        let agent = self.agent;
        agent.mover.steps_from(roadmap, label.vertex, |to, ticks| {
            let at = label.at.after(ticks);
            let node = self.nodes.flying(label.waypoint, to);
            let Some(least) = self.least(node, label.paid, at) else {
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
                departs: label.at,
                at,
                parent: index,
                judged: false,
                expanded: None,
                ..label
            };
            if self.nodes.is_covered(node, &step) {
                return;
            }
            let Some(cost) = self.cost(node, &step) else {
                return;
            };
            let total = weighted(cost, remaining, self.weight_shift);
            if total > most {
                next = next.min(total);
            } else if known.is_none_or(|known| known.leaves_out(cost, remaining)) {
                self.open.push(Open {
                    total,
                    remaining,
                    is_bound: !self.nodes.is_final(node),
                    label: self.labels.len() as u32,
                });
                self.labels.push(step);
            }
        });
        self.labels[index as usize].expanded = Some(PartialExpansion {
            upto: most,
            weight_shift: self.weight_shift,
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
