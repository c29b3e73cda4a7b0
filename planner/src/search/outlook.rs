//! How long the rest of the way takes at least, past those who stay where they are for good.
//!
//! In a crowd most who are in the way hover at their goals already. A place where somebody hovers for ever, and has
//! begun to before one can be there, is closed; the distances around such places are worked out from the goal as far as
//! they are asked for, which takes less than all the states of a search that runs into them. Who could be made
//! to give way is closed as well: where that is a detour dearer than the price, nothing is closed.

use super::Scene;
use crate::distances::{Backwards, UNREACHABLE};
use crate::errand::Errand;
use crate::roadmap::Vertex;

/// What a search looks ahead by.
pub(super) struct Outlook<'a> {
    scene: Scene<'a>,
    errand: &'a Errand,
    /// By stage, where it pays.
    stages: Vec<Option<Ahead>>,
}

struct Ahead {
    backwards: Backwards,
    class: usize,
    /// The least ticks until it begins.
    begins: u32,
}

impl<'a> Outlook<'a> {
    /// As if nobody were there.
    pub(super) fn plain(scene: Scene<'a>, errand: &'a Errand) -> Outlook<'a> {
        Outlook {
            scene,
            errand,
            stages: Vec::new(),
        }
    }

    /// Around those who stay, but for detours that are dearer than making one of them give way.
    pub(super) fn new(scene: Scene<'a>, errand: &'a Errand) -> Outlook<'a> {
        let mut outlook = Outlook::plain(scene, errand);
        let patience = scene.weights.iter().copied().min().unwrap_or(0);
        let Some(crowd) = scene.crowd else {
            return outlook;
        };
        let mut begins = errand.departs.0;
        let mut from = errand.start;
        for (index, stage) in errand.stages.iter().enumerate() {
            let ahead = crowd
                .class(errand.drone, errand.kinds[index])
                .map(|class| Ahead {
                    backwards: stage.distances.backwards(scene.roadmap),
                    class,
                    begins,
                });
            outlook.stages.push(ahead);
            let plain = match errand.stages.len() {
                // Known, but for air in zones, and then there is no crowd.
                1 => errand.alone_ticks.saturating_sub(stage.rest_ticks),
                _ => stage.distances.ticks(scene.roadmap, from),
            };
            let past = outlook.settled(index, from);
            if past.saturating_sub(stage.rest_ticks) > plain.saturating_add(patience) {
                outlook.stages[index] = None;
            }
            begins = begins
                .saturating_add(plain)
                .saturating_add(stage.dwell_ticks);
            from = stage.distances.goal();
        }
        outlook
    }

    /// Ticks from a place to the end of the last dwell at least, and whether that is final.
    pub(super) fn at_least(&self, stage: usize, from: Vertex) -> (u32, bool) {
        match (self.stages.get(stage), self.errand.stages.get(stage)) {
            (Some(Some(ahead)), Some(stage)) => {
                let (ticks, is_final) = ahead.backwards.at_least(self.scene.roadmap, from);
                let all = match ticks {
                    UNREACHABLE => UNREACHABLE,
                    _ => ticks.saturating_add(stage.rest_ticks),
                };
                (all, is_final)
            }
            _ => (self.errand.remaining(self.scene.roadmap, stage, from), true),
        }
    }

    /// The same, final.
    pub(super) fn settled(&mut self, index: usize, from: Vertex) -> u32 {
        let roadmap = self.scene.roadmap;
        let (Some(Some(ahead)), Some(stage)) =
            (self.stages.get_mut(index), self.errand.stages.get(index))
        else {
            return self.errand.remaining(roadmap, index, from);
        };
        let goal = stage.distances.goal();
        let crowd = self.scene.crowd;
        let (class, begins) = (ahead.class, ahead.begins);
        let closed = crowd.map_or(&[][..], |crowd| crowd.closed_from(class));
        let is_open = |place: Vertex, lead: u32| {
            let closed = closed.get(place as usize);
            closed.is_none_or(|closed| closed.0 > begins.saturating_add(lead))
        };
        let mover = stage.distances.mover();
        let ticks = (ahead.backwards).ticks(roadmap, mover, goal, from, is_open);
        match ticks {
            UNREACHABLE => UNREACHABLE,
            _ => ticks.saturating_add(stage.rest_ticks),
        }
    }
}
