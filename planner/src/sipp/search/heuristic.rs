//! True-distance heuristic around parked drones: least time of the rest of the path.
//!
//! In a crowd most obstructing drones hover at their goals already. A place is closed where a drone
//! hovers until the end, and does before the searching drone can be there; distances around such
//! places are computed backwards from the goal on demand, which takes less than all the states of a
//! search that runs into them. Places of movable drones are closed as well: where the detour costs
//! more than the eviction, nothing is closed. Where parked drones close whole columns and nothing
//! solid is in between, it is enough to look at the floor.

use costmap::leg::Tick;

use super::setting::SearchSetting;
use crate::graph::agent::Agent;
use crate::graph::distances::{Backwards, Floor, UNREACHABLE};
use crate::graph::roadmap::Vertex;

/// What a search looks ahead by.
pub(super) struct Heuristic<'a> {
    /// What is searched among.
    setting: SearchSetting<'a>,
    /// The searching drone.
    agent: &'a Agent,
    /// By waypoint, where it pays.
    waypoints: Vec<Option<Ahead<'a>>>,
}

/// What lies ahead on the way to one waypoint.
struct Ahead<'a> {
    /// What is searched backwards from it.
    map: Map<'a>,
    /// From when on each place of the map is closed.
    closed: &'a [Tick],
    /// The least ticks until it begins.
    begins: u32,
}

/// What is searched backwards from the goal.
enum Map<'a> {
    /// All places of the roadmap: exact.
    Air(Backwards),
    /// Columns of the floor: a bound.
    Floor(Floor<'a>),
}

impl<'a> Heuristic<'a> {
    /// As if no drone were there.
    pub(super) fn plain(setting: SearchSetting<'a>, agent: &'a Agent) -> Heuristic<'a> {
        Heuristic {
            setting,
            agent,
            waypoints: Vec::new(),
        }
    }

    /// Around parked drones, but for detours dearer than evicting one of them.
    pub(super) fn new(setting: SearchSetting<'a>, agent: &'a Agent) -> Heuristic<'a> {
        let mut heuristic = Heuristic::plain(setting, agent);
        let least_weight = setting.weights.iter().copied().min().unwrap_or(0);
        if setting.reservations.is_none() || !setting.detours {
            return heuristic;
        }
        let mut begins = agent.departs.0;
        let mut from = agent.start;
        for (index, waypoint) in agent.waypoints.iter().enumerate() {
            let ahead = heuristic.ahead(index, from, begins);
            heuristic.waypoints.push(ahead);
            let plain = match agent.waypoints.len() {
                // Known; among zones it is past those that the drone's own wake is too strong for.
                1 if agent.smoothing.is_none() && !waypoint.is_timed() => {
                    agent.lower_bound_ticks.saturating_sub(waypoint.rest_ticks)
                }
                _ => waypoint.distances.ticks(setting.roadmap, from),
            };
            let past = heuristic.settled(index, from);
            if past.saturating_sub(waypoint.rest_ticks) > plain.saturating_add(least_weight) {
                heuristic.waypoints[index] = None;
            }
            let passed = plain.saturating_add(waypoint.dwell_ticks);
            begins = begins.saturating_add(passed).max(waypoint.until.0);
            from = waypoint.distances.goal();
        }
        heuristic
    }

    /// What lies ahead from a place to a waypoint, from a tick on; `None` where the reservation
    /// table does not know what flies there.
    fn ahead(&self, index: usize, from: Vertex, begins: u32) -> Option<Ahead<'a>> {
        let (agent, roadmap) = (self.agent, self.setting.roadmap);
        let reservations = self.setting.reservations?;
        let class = reservations.class(agent.drone, agent.kinds[index])?;
        let distances = &agent.waypoints[index].distances;
        let on_floor = || {
            let columns = reservations.closed_columns(class)?;
            Some((Map::Floor(distances.floor(roadmap, from)?), columns))
        };
        let (map, closed) = on_floor().unwrap_or_else(|| {
            let backwards = distances.backwards(roadmap, from);
            (Map::Air(backwards), reservations.closed_from(class))
        });
        Some(Ahead {
            map,
            closed,
            begins,
        })
    }

    /// Whether wakes fill their columns on the way to some waypoint, so that it looks at the floor.
    pub(super) fn uses_column_distances(&self) -> bool {
        let mut ahead = self.waypoints.iter().flatten();
        ahead.any(|it| matches!(it.map, Map::Floor(_)))
    }

    /// Ticks from a place to the end of the last dwell at least, and whether that is final.
    pub(super) fn at_least(&self, waypoint: usize, from: Vertex) -> (u32, bool) {
        let roadmap = self.setting.roadmap;
        let ahead = self.waypoints.get(waypoint).and_then(Option::as_ref);
        let Some((ahead, next)) = ahead.zip(self.agent.waypoints.get(waypoint)) else {
            return (self.agent.remaining(roadmap, waypoint, from), true);
        };
        let (ticks, is_final) = match &ahead.map {
            Map::Air(backwards) => backwards.at_least(roadmap, from),
            Map::Floor(floor) => floor.at_least(from),
        };
        let all = match ticks {
            UNREACHABLE => UNREACHABLE,
            _ => ticks.saturating_add(next.rest_ticks),
        };
        (all, is_final)
    }

    /// The same, final.
    fn settled(&mut self, waypoint: usize, from: Vertex) -> u32 {
        self.extend_bound(waypoint, from, u32::MAX);
        self.at_least(waypoint, from).0
    }

    /// Raises what is known of a place by so many ticks, if it is not final before.
    pub(super) fn extend_bound(&mut self, index: usize, from: Vertex, by: u32) {
        let ahead = self.waypoints.get_mut(index).and_then(Option::as_mut);
        let Some((ahead, waypoint)) = ahead.zip(self.agent.waypoints.get(index)) else {
            return;
        };
        let (closed, begins) = (ahead.closed, ahead.begins);
        let is_open = |place: Vertex, lead: u32| {
            let closed = closed.get(place as usize);
            closed.is_none_or(|closed| closed.0 > begins.saturating_add(lead))
        };
        match &mut ahead.map {
            Map::Air(backwards) => {
                let mover = waypoint.distances.mover();
                backwards.extend_bound(self.setting.roadmap, mover, from, by, is_open);
            }
            Map::Floor(floor) => floor.extend_bound(from, by, is_open),
        }
    }
}
