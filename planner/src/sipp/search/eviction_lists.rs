//! Drones evicted by the states of a search: lists with shared beginnings.

use costmap::leg::DroneId;

/// All lists; each is known by its last entry, 0 is the empty one.
pub(super) struct EvictionLists {
    /// Each drone with the index of the entry before it.
    entries: Vec<(DroneId, u32)>,
}

impl EvictionLists {
    /// The empty list alone.
    pub(super) fn new() -> EvictionLists {
        EvictionLists {
            entries: vec![(DroneId(u32::MAX), 0)],
        }
    }

    /// A list with one more.
    pub(super) fn with(&mut self, list: u32, drone: DroneId) -> u32 {
        self.entries.push((drone, list));
        self.entries.len() as u32 - 1
    }

    /// Whether a drone is in a list.
    pub(super) fn has(&self, list: u32, drone: DroneId) -> bool {
        self.of(list).any(|known| known == drone)
    }

    /// All of a list, the last first.
    pub(super) fn of(&self, list: u32) -> impl Iterator<Item = DroneId> + '_ {
        let mut at = list;
        std::iter::from_fn(move || {
            let (drone, before) = self.entries[at as usize];
            (at != 0).then(|| {
                at = before;
                drone
            })
        })
    }
}
