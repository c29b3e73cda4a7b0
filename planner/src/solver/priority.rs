//! The order of the fleet, and what to do when a drone finds no way.
//!
//! Shortest agent first. A search never has to fail: a drone may cross what others hold, at a
//! price for each of them; the drone that is crossed is evicted, replanned next, and dearer from
//! then on. The growing prices end quarrels: without growth two drones can evict each other until
//! the end. A drone that is evicted too often, or that has no way at all, stays at its start for
//! good; the rest is planned around it, and the fleet is tried again in other orders, the best
//! answer counting.

use std::collections::VecDeque;

use costmap::costmap::{Costmap, Reservation};
use costmap::leg::{DroneId, Leg, Tick};
use costmap::verdict::{Blocker, Verdict};

use crate::graph::agent::Agent;
use crate::graph::roadmap::Roadmap;
use crate::plan::outcome::{Control, Effort};
use crate::sipp::conflicts::ReservationTable;
use crate::sipp::search::{Found, IMMOVABLE, Obstruction, Path, Scene, Searched, search};
use crate::solver::prepare::Job;

/// First price of crossing a drone, in ticks: chosen here, 5 s, ten cells of a metre at 2 m/s.
const FIRST_WEIGHT: u32 = 500;
/// Added at every eviction: chosen here, half the first price.
const WEIGHT_GROWTH: u32 = 250;
/// A drone evicted more often than this stays at its start. Chosen here: fleets of 1000 that can be
/// planned evict no drone more than a few times.
const MOST_EVICTIONS: u32 = 24;
/// States of one search; chosen here, seconds of work.
const MOST_EXPANSIONS: u64 = 400_000;

/// Paths of a fleet.
#[derive(Clone, Debug)]
pub(crate) struct Paths {
    /// Per drone; `None`: it stays at its start.
    pub(crate) paths: Vec<Option<Path>>,
    /// Why those without a path have none.
    pub(crate) unplanned: Vec<(DroneId, FailureKind)>,
    /// Every drone's reservations, the stranded included.
    pub(crate) costmap: Costmap,
}

/// Why a drone stays at its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FailureKind {
    /// The roadmap has no way through free space to one of its tasks.
    NoWay,
    /// Its end excludes another drone's.
    EndpointConflict,
    /// What it would land on, or what is beside it, leaves too little room: how much is missing
    /// (m).
    Landing(f64),
    /// Others are in the way.
    Obstructed(Option<Obstruction>),
    /// Its wake is too strong for a zone whichever way it flies.
    Zone(Obstruction),
    /// Planning was stopped before its turn.
    Stopped,
}

/// Plans a few drones among others that stay as they are; `None` unless all of them find a way.
pub(crate) fn plan_group(
    job: &Job,
    others: &Costmap,
    group: &[DroneId],
    control: &Control<'_>,
) -> Option<Vec<Path>> {
    let mut effort = Effort::default();
    let quiet = Control {
        progress: &|_| {},
        ..*control
    };
    let mut attempt = Attempt::new(
        &job.roadmap,
        &job.agents,
        others.clone(),
        0.0,
        &quiet,
        &mut effort,
    );
    attempt.most_evictions = MOST_EVICTIONS / 3;
    attempt.weights.fill(IMMOVABLE);
    for drone in group {
        attempt.weights[drone.0 as usize] = FIRST_WEIGHT;
    }
    attempt.run(group.iter().copied().collect());
    let all = attempt.unplanned.is_empty();
    all.then(|| attempt.paths.into_iter().flatten().collect())
}

mod affected;
mod batch;
mod by_pibt;
mod finalise;
mod lns;
mod order;
mod whole;

pub(crate) use affected::{Affected, plan_affected};
pub(crate) use whole::plan_fleet;

struct Attempt<'a> {
    roadmap: &'a Roadmap,
    agents: &'a [Agent],
    costmap: Costmap,
    /// What the costmap says, in brief; `None`: searches ask the costmap itself.
    reservations: Option<ReservationTable<'a>>,
    energy_weight: f64,
    control: &'a Control<'a>,
    effort: &'a mut Effort,
    weights: Vec<u32>,
    evicted: Vec<u32>,
    /// Whose weak wakes were too much for a drone: their steps are judged in full.
    careful: Vec<bool>,
    most_evictions: u32,
    /// See [`Scene::detours`].
    detours: bool,
    /// After how many states in all it gives up.
    gives_up_at: Option<u64>,
    /// See [`Scene::under_way`].
    under_way: Vec<Tick>,
    /// What each drone flies if it finds no way: it is not there at all if that is nothing. Not
    /// even a list of them: every drone stays at the start.
    kept: Vec<Vec<Leg>>,
    paths: Vec<Option<Path>>,
    unplanned: Vec<(DroneId, FailureKind)>,
}

impl<'a> Attempt<'a> {
    fn new(
        roadmap: &'a Roadmap,
        agents: &'a [Agent],
        costmap: Costmap,
        energy_weight: f64,
        control: &'a Control<'a>,
        effort: &'a mut Effort,
    ) -> Attempt<'a> {
        let drones = agents.len();
        // The drone that is in the costmap without an agent gives way to no drone.
        let mut weights = vec![FIRST_WEIGHT; drones];
        weights.resize(costmap.drone_count().max(drones), IMMOVABLE);
        Attempt {
            roadmap,
            agents,
            costmap,
            reservations: None,
            energy_weight,
            control,
            effort,
            weights,
            evicted: vec![0; drones],
            careful: vec![false; drones],
            most_evictions: MOST_EVICTIONS,
            detours: true,
            gives_up_at: None,
            under_way: Vec::new(),
            kept: Vec::new(),
            paths: vec![None; drones],
            unplanned: Vec::new(),
        }
    }

    fn exclude(&mut self, excluded: &[(DroneId, FailureKind)]) {
        let mut queue = VecDeque::new();
        for &(drone, why) in excluded {
            self.leave_unplanned(drone, why, &mut queue);
        }
    }

    /// Drones without tasks are planned first, and for good: where they are is where they go.
    fn settle_who_stays(&mut self) {
        let weights = &self.weights;
        let stays = |agent: &&Agent| agent.stays() && weights[agent.drone.0 as usize] != IMMOVABLE;
        let staying: Vec<&Agent> = self.agents.iter().filter(stays).collect();
        for agent in staying {
            let legs = vec![stays_at_start(agent, self.roadmap)];
            self.reserve(legs.clone());
            self.weights[agent.drone.0 as usize] = IMMOVABLE;
            self.paths[agent.drone.0 as usize] = Some(Path {
                legs,
                arrives: Tick(0),
                met: Vec::new(),
            });
        }
    }

    fn scene(&self) -> Scene<'_> {
        Scene {
            roadmap: self.roadmap,
            costmap: &self.costmap,
            reservations: self.reservations.as_ref(),
            weights: &self.weights,
            under_way: &self.under_way,
            energy_weight: self.energy_weight,
            detours: self.detours,
            careful: false,
            most_expansions: MOST_EXPANSIONS,
            stop: self.control.stop,
        }
    }

    /// Counts a search; the path that it found, if it found one.
    fn counted(&mut self, searched: Searched) -> Option<Path> {
        self.effort.searches += 1;
        self.effort.expansions += searched.expansions;
        match searched.found {
            Found::Path(path) => Some(path),
            Found::Blocked(_) | Found::Stopped => None,
        }
    }

    fn evict(&mut self, drone: DroneId, queue: &mut VecDeque<DroneId>) {
        let index = drone.0 as usize;
        if self.paths[index].is_none() {
            // Already taken back, by one who was evicted before it and gave up.
            return;
        }
        self.take_back(drone);
        self.evicted[index] += 1;
        self.weights[index] = self.weights[index]
            .saturating_add(WEIGHT_GROWTH)
            .min(IMMOVABLE - 1);
        if self.evicted[index] > self.most_evictions {
            self.leave_unplanned(drone, FailureKind::Obstructed(None), queue);
        } else {
            queue.push_front(drone);
        }
    }

    /// Leaves a drone at its start until the end, and takes back the drone that is in conflict with
    /// that.
    fn leave_unplanned(&mut self, drone: DroneId, why: FailureKind, queue: &mut VecDeque<DroneId>) {
        let stay = self.without_way(drone);
        self.weights[drone.0 as usize] = IMMOVABLE;
        self.unplanned.push((drone, why));
        let mut verdict = Verdict::default();
        loop {
            let movable = |other: &DroneId| {
                let index = other.0 as usize;
                self.weights[index] != IMMOVABLE && self.paths[index].is_some()
            };
            let mut hit: Vec<DroneId> = Vec::new();
            let mut allowed = true;
            for leg in &stay {
                self.costmap.judge(leg, &mut verdict);
                let scene = self.scene();
                let takeable = |b: &&Blocker| scene.weight(b) != IMMOVABLE || self.kept.is_empty();
                hit.extend(verdict.blockers.iter().filter(takeable).map(|b| b.drone));
                allowed &= verdict.is_allowed();
            }
            if !hit.iter().any(movable) && !allowed && self.kept.is_empty() {
                // Those who stay would bear one another, were no other drone near them.
                for &other in &hit.clone() {
                    for leg in self.costmap.legs(other) {
                        hit.extend(self.costmap.near(leg).iter().map(|item| item.leg.drone));
                    }
                }
            }
            hit.retain(movable);
            hit.sort_unstable();
            hit.dedup();
            if hit.is_empty() {
                break;
            }
            for other in hit {
                self.take_back(other);
                queue.push_front(other);
            }
        }
        self.reserve(stay);
    }

    fn reserve(&mut self, legs: Vec<Leg>) {
        self.take_over(self.costmap.reservation(legs));
    }

    fn take_over(&mut self, reservation: Reservation) {
        let Some(drone) = reservation.drone() else {
            return;
        };
        self.release(drone);
        let Some(reservations) = &mut self.reservations else {
            return self.costmap.reserve(reservation);
        };
        let legs = reservation.legs().to_vec();
        let costmap = &mut self.costmap;
        rayon::join(
            || costmap.reserve(reservation),
            || reservations.insert(&legs),
        );
    }

    fn release(&mut self, drone: DroneId) {
        if let Some(reservations) = &mut self.reservations {
            reservations.remove(self.costmap.legs(drone));
        }
        self.costmap.remove(drone);
    }

    /// What a drone flies that finds no way.
    fn without_way(&self, drone: DroneId) -> Vec<Leg> {
        match self.kept.get(drone.0 as usize) {
            Some(kept) => kept.clone(),
            None => vec![stays_at_start(&self.agents[drone.0 as usize], self.roadmap)],
        }
    }

    fn take_back(&mut self, drone: DroneId) {
        self.release(drone);
        // What it is flying it goes on with.
        self.reserve(self.agents[drone.0 as usize].begun.clone());
        self.paths[drone.0 as usize] = None;
        self.effort.evictions += 1;
    }

    /// Lets those fly after all who were in others' way and are no more, one at a time.
    fn retry(&mut self) {
        let immovable = vec![IMMOVABLE; self.weights.len()];
        let mut index = 0;
        while let Some(&(drone, why)) = self.unplanned.get(index) {
            index += 1;
            let keeps = self.evicted[drone.0 as usize] > 0 && !self.kept.is_empty();
            if keeps || !matches!(why, FailureKind::Obstructed(_)) || (self.control.stop)() {
                continue;
            }
            let stay = self.costmap.legs(drone).to_vec();
            self.release(drone);
            let scene = Scene {
                reservations: None,
                weights: &immovable,
                careful: true,
                ..self.scene()
            };
            let searched = search(scene, &self.agents[drone.0 as usize]);
            if let Some(path) = self.counted(searched) {
                self.reserve(path.legs.clone());
                self.paths[drone.0 as usize] = Some(path);
                self.unplanned.remove(index - 1);
                index = 0;
            } else {
                self.reserve(stay);
            }
        }
    }

    fn into_paths(mut self) -> Paths {
        self.unplanned.sort_unstable_by_key(|(drone, _)| *drone);
        Paths {
            paths: self.paths,
            unplanned: self.unplanned,
            costmap: self.costmap,
        }
    }
}

/// The one leg of a drone that is not planned.
pub(crate) fn stays_at_start(agent: &Agent, roadmap: &crate::graph::roadmap::Roadmap) -> Leg {
    Leg {
        flying: !agent.grounded,
        ..agent.hover(roadmap.position_m(agent.start), agent.kinds[0])
    }
}
