//! Told to stop: the drone that has no way yet stays at its start, and those who would have flown
//! past it find another way, or stay as well.

use std::collections::VecDeque;

use costmap::leg::DroneId;

use super::{Attempt, FailureKind};
use crate::sipp::search::{IMMOVABLE, Scene, search};

/// States of all searches after the stop: chosen here, about a second of work.
const ALL_EXPANSIONS: u64 = 60_000;
/// States of one of them.
const MOST_EXPANSIONS: u64 = 4_000;
/// The drone that is in the way more often than this stays at its start.
const MOST_EVICTIONS: u32 = 4;

impl Attempt<'_> {
    /// Leaves those in the queue at their starts, and as few others as a second allows.
    pub(super) fn finalise(&mut self, waiting: VecDeque<DroneId>) {
        let mut displaced = VecDeque::new();
        for drone in waiting {
            if self.weights[drone.0 as usize] != IMMOVABLE {
                self.leave_unplanned(drone, FailureKind::Stopped, &mut displaced);
            }
        }
        let immovable = vec![IMMOVABLE; self.weights.len()];
        let mut times = vec![0; self.weights.len()];
        let mut left = ALL_EXPANSIONS;
        while let Some(drone) = displaced.pop_front() {
            let index = drone.0 as usize;
            if self.weights[index] == IMMOVABLE {
                continue;
            }
            times[index] += 1;
            if left > 0 && times[index] <= MOST_EVICTIONS {
                let scene = Scene {
                    weights: &immovable,
                    most_expansions: left.min(MOST_EXPANSIONS),
                    stop: &|| false,
                    ..self.scene()
                };
                let searched = search(scene, &self.agents[index]);
                left = left.saturating_sub(searched.expansions);
                if let Some(path) = self.counted(searched)
                    && self.costmap.is_borne(&path.legs)
                {
                    self.reserve(path.legs.clone());
                    self.paths[index] = Some(path);
                    continue;
                }
            }
            self.leave_unplanned(drone, FailureKind::Stopped, &mut displaced);
        }
    }
}
