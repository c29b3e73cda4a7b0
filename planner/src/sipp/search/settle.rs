//! What a verdict makes of a state: forbidden, dearer, or as thought.

use costmap::leg::Tick;
use costmap::verdict::Blocker;

use super::label::Label;
use super::walk::Search;
use super::{IMMOVABLE, Obstruction, Obstructor};

impl Search<'_> {
    /// A label at the price that the verdict asks for; `None` if it is forbidden.
    pub(super) fn settled(&mut self, mut label: Label) -> Option<Label> {
        let came_from = self.labels[label.parent as usize];
        if let Some(zone) = self.verdict.breaks_zone {
            self.obstructed(&came_from, Obstructor::Zone(zone));
            return None;
        }
        let price = self.verdict.price_s * self.scene.energy_weight * Tick::PER_SECOND;
        label.paid = label.paid.saturating_add(price.round() as u32);
        for position in 0..self.verdict.blockers.len() {
            let blocker = self.verdict.blockers[position];
            let Blocker { drone, why, .. } = blocker;
            if self.agent.forgives(&blocker, label.departs) {
                continue;
            }
            if self.passes(label.met, &blocker) {
                continue;
            }
            let weight = self.scene.weight(&blocker);
            if weight == IMMOVABLE {
                self.obstructed(&came_from, Obstructor::Drone(drone, why));
                return None;
            }
            label.paid = label.paid.saturating_add(weight);
            label.met = self.met.with(label.met, drone);
        }
        Some(label)
    }

    /// Whether what is in the way is to give way already.
    pub(super) fn passes(&self, met: u32, blocker: &Blocker) -> bool {
        self.met.has(met, blocker.drone) && !self.scene.is_under_way(blocker)
    }

    fn obstructed(&mut self, label: &Label, by: Obstructor) {
        let remaining = self.agent.remaining(
            self.scene.roadmap,
            usize::from(label.waypoint),
            label.vertex,
        );
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
}
