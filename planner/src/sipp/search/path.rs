//! From the last state back to the first: the legs that were flown.

use costmap::leg::{Leg, Tick};

use super::Path;
use super::label::{Label, Step};
use super::walk::Search;

impl Search<'_> {
    pub(super) fn path(&self, end: u32) -> Path {
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
        let mut met: Vec<_> = self.met.of(last.met).collect();
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

    /// Where it stays between a state and a departure.
    pub(super) fn stay(&self, from: &Label, departs: Tick) -> Option<Leg> {
        let here_m = self.scene.roadmap.position_m(from.vertex);
        (from.at < departs).then(|| self.leg(from, here_m, departs.0 - from.at.0))
    }

    /// What it does from one state to the next, once it has departed.
    pub(super) fn doing(&self, from: &Label, to: &Label) -> Vec<Leg> {
        let departed = Label {
            at: to.departs,
            ..*from
        };
        let to_m = self.scene.roadmap.position_m(to.vertex);
        let mut leg = self.leg(&departed, to_m, to.at.0 - to.departs.0);
        match to.step {
            Step::End => return self.ending_legs(&departed),
            Step::Move => leg.flying = true,
            Step::Dwell => leg.kind = self.kind(to.waypoint),
            Step::Start | Step::Wait | Step::Later => {}
        }
        Vec::from_iter((leg.start < leg.end).then_some(leg))
    }

    /// What it does after its last dwell, from a state on.
    fn ending_legs(&self, label: &Label) -> Vec<Leg> {
        let here_m = self.scene.roadmap.position_m(label.vertex);
        let stay = Leg {
            end: Tick::FOREVER,
            ..self.leg(label, here_m, 0)
        };
        self.agent.ending.legs(stay)
    }
}

/// Joins stays that follow one another at one place.
pub(crate) fn joined(legs: Vec<Leg>) -> Vec<Leg> {
    let mut joined: Vec<Leg> = Vec::with_capacity(legs.len());
    for leg in legs {
        match joined.last_mut() {
            Some(last)
                if last.stays()
                    && leg.stays()
                    && last.from_m == leg.from_m
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
