//! Places on the way to a task: how far they are from the end, and when they have been reached.

use costmap::leg::Tick;
use rustc_hash::FxHashMap;

use super::label::{Label, Step};
use crate::errand::Errand;
use crate::roadmap::{Roadmap, Vertex};

/// A time for which a place is known to be reached, and perhaps free to hover at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Visit {
    /// The state that reached it.
    pub(super) label: u32,
    pub(super) from: Tick,
    /// Until when it is free to hover at; `None`: nobody has asked.
    pub(super) to: Option<Tick>,
}

struct Node {
    remaining: u32,
    visits: Vec<Visit>,
}

/// All places that a search has thought of.
pub(super) struct Nodes<'a> {
    roadmap: &'a Roadmap,
    errand: &'a Errand,
    /// By stage and vertex, one more than the index of the node; 0: none.
    flying: Vec<u32>,
    /// On the ground, where it starts.
    grounded: FxHashMap<(Vertex, u16), usize>,
    all: Vec<Node>,
}

impl<'a> Nodes<'a> {
    pub(super) fn new(roadmap: &'a Roadmap, errand: &'a Errand) -> Nodes<'a> {
        Nodes {
            roadmap,
            errand,
            flying: vec![0; roadmap.place_count() * (errand.stages.len() + 1)],
            grounded: FxHashMap::default(),
            all: Vec::new(),
        }
    }

    /// The node of a state.
    pub(super) fn at(&mut self, label: &Label) -> usize {
        let next = self.all.len();
        let known = if label.grounded {
            *self.grounded.entry((label.vertex, label.stage)).or_insert(next)
        } else {
            let place = usize::from(label.stage) * self.roadmap.place_count();
            let node = &mut self.flying[place + label.vertex as usize];
            if *node == 0 {
                *node = next as u32 + 1;
            }
            *node as usize - 1
        };
        if known == next {
            let stage = usize::from(label.stage);
            self.all.push(Node {
                remaining: self.errand.remaining(self.roadmap, stage, label.vertex),
                visits: Vec::new(),
            });
        }
        known
    }

    /// Ticks from there to the end of the last dwell.
    pub(super) fn remaining(&self, node: usize) -> u32 {
        self.all[node].remaining
    }

    pub(super) fn visit(&mut self, node: usize, label: u32, from: Tick) {
        self.all[node].visits.push(Visit {
            label,
            from,
            to: None,
        });
    }

    pub(super) fn visits(&mut self, node: usize) -> &mut Vec<Visit> {
        &mut self.all[node].visits
    }

    /// Whether a state is known to be no news. A wait is news though its place is free, for something near
    /// has changed.
    pub(super) fn is_covered(&self, node: usize, label: &Label) -> bool {
        self.all[node].visits.iter().any(|visit| match label.step {
            Step::Linger => false,
            Step::Wait => visit.from == label.at,
            _ => {
                visit.from == label.at
                    || visit.from < label.at && visit.to.is_some_and(|to| label.at <= to)
            }
        })
    }
}
