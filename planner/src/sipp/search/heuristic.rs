//! How long the rest of the way takes at least, past those who stay where they are for good.
//!
//! In a crowd most who are in the way hover at their goals already. A place where a drone hovers
//! until the end, and has begun to before one can be there, is closed; the distances around such
//! places are worked out from the goal as far as they are asked for, which takes less than all the
//! states of a search that runs into them. Who could be made to give way is closed as well: where
//! that is a detour dearer than the price, nothing is closed. Where the drone that stays closes
//! whole columns and nothing is solid in between, it is enough to look at the floor.

use costmap::leg::Tick;

use super::Scene;
use crate::graph::agent::{Errand, Stage};
use crate::graph::distances::{Backwards, Floor, UNREACHABLE};
use crate::graph::roadmap::{Roadmap, Vertex};
use crate::sipp::conflicts::ReservationTable;

/// What a search looks ahead by.
pub(super) struct Heuristic<'a> {
    scene: Scene<'a>,
    errand: &'a Errand,
    /// By stage, where it pays.
    stages: Vec<Option<Ahead<'a>>>,
}

struct Ahead<'a> {
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

impl<'a> Ahead<'a> {
    /// From a place to a task, from a moment on.
    fn new(
        roadmap: &'a Roadmap,
        (reservations, class): (&'a ReservationTable<'a>, usize),
        stage: &Stage,
        from: Vertex,
        begins: u32,
    ) -> Ahead<'a> {
        let columns = reservations.closed_columns(class);
        let floor = columns.and_then(|columns| {
            let floor = stage.distances.floor(roadmap, from)?;
            Some((Map::Floor(floor), columns))
        });
        let air = || {
            let backwards = stage.distances.backwards(roadmap, from);
            (Map::Air(backwards), reservations.closed_from(class))
        };
        let (map, closed) = floor.unwrap_or_else(air);
        Ahead {
            map,
            closed,
            begins,
        }
    }
}

impl<'a> Heuristic<'a> {
    /// As if no drone were there.
    pub(super) fn plain(scene: Scene<'a>, errand: &'a Errand) -> Heuristic<'a> {
        Heuristic {
            scene,
            errand,
            stages: Vec::new(),
        }
    }

    /// Around those who stay, but for detours that are dearer than making one of them give way.
    pub(super) fn new(scene: Scene<'a>, errand: &'a Errand) -> Heuristic<'a> {
        let mut heuristic = Heuristic::plain(scene, errand);
        let least_weight = scene.weights.iter().copied().min().unwrap_or(0);
        let Some(reservations) = scene.reservations.filter(|_| scene.detours) else {
            return heuristic;
        };
        let mut begins = errand.departs.0;
        let mut from = errand.start;
        for (index, stage) in errand.stages.iter().enumerate() {
            let class = reservations.class(errand.drone, errand.kinds[index]);
            let ahead = class
                .map(|class| Ahead::new(scene.roadmap, (reservations, class), stage, from, begins));
            heuristic.stages.push(ahead);
            let plain = match errand.stages.len() {
                // Known, but for air in zones, and then there is no reservation table.
                1 => errand.alone_ticks.saturating_sub(stage.rest_ticks),
                _ => stage.distances.ticks(scene.roadmap, from),
            };
            let past = heuristic.settled(index, from);
            if past.saturating_sub(stage.rest_ticks) > plain.saturating_add(least_weight) {
                heuristic.stages[index] = None;
            }
            begins = begins
                .saturating_add(plain)
                .saturating_add(stage.dwell_ticks);
            from = stage.distances.goal();
        }
        heuristic
    }

    /// Ticks from a place to the end of the last dwell at least, and whether that is final.
    pub(super) fn at_least(&self, stage: usize, from: Vertex) -> (u32, bool) {
        match (self.stages.get(stage), self.errand.stages.get(stage)) {
            (Some(Some(ahead)), Some(stage)) => {
                let (ticks, is_final) = match &ahead.map {
                    Map::Air(backwards) => backwards.at_least(self.scene.roadmap, from),
                    Map::Floor(floor) => floor.at_least(from),
                };
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
    fn settled(&mut self, stage: usize, from: Vertex) -> u32 {
        self.look_on(stage, from, u32::MAX);
        self.at_least(stage, from).0
    }

    /// Raises what is known of a place by so many ticks, if it is not final before.
    pub(super) fn look_on(&mut self, index: usize, from: Vertex, by: u32) {
        let (Some(Some(ahead)), Some(stage)) =
            (self.stages.get_mut(index), self.errand.stages.get(index))
        else {
            return;
        };
        let (closed, begins) = (ahead.closed, ahead.begins);
        let is_open = |place: Vertex, lead: u32| {
            let closed = closed.get(place as usize);
            closed.is_none_or(|closed| closed.0 > begins.saturating_add(lead))
        };
        match &mut ahead.map {
            Map::Air(backwards) => {
                let mover = stage.distances.mover();
                backwards.look_on(self.scene.roadmap, mover, from, by, is_open);
            }
            Map::Floor(floor) => floor.look_on(from, by, is_open),
        }
    }
}
