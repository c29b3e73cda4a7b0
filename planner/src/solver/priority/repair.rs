//! Paths for a few drones of a fleet in flight: those affected by a change, and those they evict.
//! All other drones keep their paths.
//!
//! The same searches and evictions as for a whole fleet. Paths found stay when one more drone has
//! to stop, or may depart through others: only drones in conflict with that are replanned, and
//! drones evicted in vain return to their former paths.

use std::borrow::Cow;
use std::collections::{BTreeSet, VecDeque};

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, Leg, Tick};
use costmap::verdict::Verdict;

use super::attempt::{Attempt, FIRST_WEIGHT, FailureKind, Paths};
use crate::graph::agent::{Agent, TOLERANCE_TICKS};
use crate::plan::outcome::{Control, Effort};
use crate::sipp::conflicts::{ReservationTable, Steps};
use crate::sipp::search::{IMMOVABLE, Path};
use crate::solver::prepare::Job;

/// Price in ticks of evicting a drone outside the group. Chosen here: 20 s, so that a drone of the
/// group rather waits for a while.
const UNASKED_WEIGHT: u32 = 2_000;

/// A drone evicted more often keeps its former path. Chosen here, on halls of 500 drones of which
/// ten change each second: two that find paths only through each other evict each other in turn
/// until one is given up; the limit of a whole fleet takes a quarter more states.
const MOST_CHANGED_EVICTIONS: u32 = 6;

/// The input of a repair.
pub(crate) struct Affected<'a> {
    /// Drones to plan, wherever in the costmap.
    pub(crate) group: &'a [DroneId],
    /// Drones whose legs have changed, and are kept: no path is searched for.
    pub(crate) settled: &'a [DroneId],
    /// Every drone's legs as they are.
    pub(crate) costmap: Costmap,
    /// The tables of the fleet's steps, if there are any.
    pub(crate) steps: Option<&'a Steps>,
    /// Until when each drone's flight is fixed.
    pub(crate) under_way: Vec<Tick>,
    /// Legs of each drone if it finds no path; empty for drones that cannot be evicted, and for
    /// drones of the group that are not let in then.
    pub(crate) kept: Vec<Vec<Leg>>,
}

/// A few drones among all others, and what is found for them so far.
pub(crate) struct Repair<'a> {
    attempt: Attempt<'a>,
    group: &'a [DroneId],
    settled: &'a [DroneId],
    /// Drones (by index) without their former path.
    stopped: BTreeSet<usize>,
    /// Drones to search for.
    queue: VecDeque<DroneId>,
}

impl<'a> Repair<'a> {
    /// All others keep their paths, unless these conflict with what is settled.
    pub(crate) fn new(
        job: &'a Job,
        affected: Affected<'a>,
        energy_weight: f64,
        control: &'a Control<'a>,
        effort: &'a mut Effort,
    ) -> Repair<'a> {
        let (group, settled) = (affected.group, affected.settled);
        let mut attempt = Attempt::new(job, affected.costmap, energy_weight, control, effort);
        for (index, kept) in affected.kept.iter().enumerate() {
            if !kept.is_empty() && !group.contains(&DroneId(index as u32)) {
                attempt.paths[index] = Some(Path::new(kept.clone(), Tick(0)));
                attempt.legs[index].clone_from(kept);
            }
        }
        attempt.most_evictions = MOST_CHANGED_EVICTIONS;
        attempt.under_way = affected.under_way;
        attempt.kept = affected.kept;
        let mut queue: Vec<DroneId> = group.to_vec();
        queue
            .sort_unstable_by_key(|drone| (job.agents[drone.0 as usize].lower_bound_ticks, *drone));
        let mut queue = VecDeque::from(queue);
        for &drone in settled.iter().chain(group) {
            attempt.costmap.remove(drone);
            attempt.legs[drone.0 as usize].clear();
        }
        let table = |steps| ReservationTable::new(steps, &attempt.costmap, &attempt.legs);
        attempt.reservations = affected.steps.map(table);
        price(&mut attempt, group, settled);
        for &drone in settled {
            attempt.paths[drone.0 as usize] = None;
            attempt.leave_unplanned(drone, FailureKind::Stopped, &mut queue);
        }
        for &drone in group {
            let agent = &job.agents[drone.0 as usize];
            attempt.reserve(agent.begun.clone());
            let begun = agent.flown(&agent.begun).into_owned();
            attempt.evict_conflicting(&begun, &mut queue);
        }
        Repair {
            attempt,
            group,
            settled,
            stopped: BTreeSet::new(),
            queue,
        }
    }

    /// Searches for every queued drone; one without a path gets its `kept` legs.
    pub(crate) fn run(&mut self) {
        let queue = std::mem::take(&mut self.queue);
        if !self.attempt.run(queue) {
            self.attempt.keep_all(self.group);
        }
        self.go_back();
    }

    /// Searches once more for drones without a path, then for those that depart in others' air: the
    /// others' paths have changed.
    pub(crate) fn run_again(&mut self) {
        let (attempt, settled) = (&mut self.attempt, self.settled);
        let is_settled = |drone: &DroneId| settled.contains(drone);
        let unplanned = attempt.unplanned.iter().map(|(drone, _)| *drone);
        let mut again: Vec<DroneId> = unplanned.filter(|it| !is_settled(it)).collect();
        attempt.unplanned.retain(|(drone, _)| is_settled(drone));
        let departs_in_air = |drone: &&DroneId| {
            let index = drone.0 as usize;
            attempt.paths[index].is_some() && !attempt.agents[index].tolerated_drones.is_empty()
        };
        again.extend(self.group.iter().filter(departs_in_air));
        price(attempt, self.group, settled);
        for drone in again {
            let index = drone.0 as usize;
            attempt.release(drone);
            attempt.reserve(attempt.agents[index].begun.clone());
            attempt.paths[index] = None;
            self.queue.push_back(drone);
        }
        self.run();
    }

    /// Returns drones evicted in vain to their former paths.
    fn go_back(&mut self) {
        for index in 0..self.attempt.kept.len() {
            let drone = DroneId(index as u32);
            let is_free_to = !self.group.contains(&drone) && !self.stopped.contains(&index);
            if !is_free_to || !self.has_new_path(index) {
                continue;
            }
            let attempt = &mut self.attempt;
            let kept = attempt.kept[index].clone();
            let (legs, _) = attempt.release(drone);
            let flown = attempt.agents[index].flown(&kept);
            let mut verdict = Verdict::default();
            let mut is_free = |leg: &Leg| {
                attempt.costmap.judge(leg, &mut verdict);
                verdict.is_allowed()
            };
            if flown.iter().all(&mut is_free) && attempt.costmap.are_loads_within_budget(&flown) {
                attempt.paths[index] = Some(Path::new(kept.clone(), Tick(0)));
                attempt.reserve(kept);
            } else {
                attempt.reserve(legs);
            }
        }
    }

    /// Sets what a drone keeps if it finds no path; returns what it kept before.
    pub(crate) fn keep(&mut self, index: usize, legs: Vec<Leg>) -> Vec<Leg> {
        self.stopped.insert(index);
        std::mem::replace(&mut self.attempt.kept[index], legs)
    }

    /// A drone may conflict with these when it departs.
    pub(crate) fn tolerate(&mut self, index: usize, others: Vec<DroneId>) {
        let agent = &mut self.attempt.agents.to_mut()[index];
        (agent.tolerated_drones, agent.is_stopped_in_conflict) = (others, true);
        agent.tolerance_ticks = TOLERANCE_TICKS;
    }

    /// Every drone as it is searched for.
    pub(crate) fn agents(&self) -> &[Agent] {
        &self.attempt.agents
    }

    /// What every drone flies as far as it is found.
    pub(crate) fn costmap(&self) -> &Costmap {
        &self.attempt.costmap
    }

    /// Whether a drone has a new path.
    pub(crate) fn has_new_path(&self, index: usize) -> bool {
        let is_asked = self.group.contains(&DroneId(index as u32));
        let is_asked = is_asked || self.stopped.contains(&index);
        let is_new = |path: &Path| is_asked || path.legs != self.attempt.kept[index];
        self.attempt.paths[index].as_ref().is_some_and(is_new)
    }

    /// Drones without a path, by index.
    pub(crate) fn unplanned(&self) -> Vec<(usize, FailureKind)> {
        let unplanned = self.attempt.unplanned.iter();
        let unplanned = unplanned.filter(|(drone, _)| !self.settled.contains(drone));
        let mut unplanned: Vec<_> = unplanned.map(|&(it, why)| (it.0 as usize, why)).collect();
        unplanned.sort_unstable_by_key(|(index, _)| *index);
        unplanned
    }

    /// Until when each drone's flight is fixed.
    pub(crate) fn under_way(&self) -> &[Tick] {
        &self.attempt.under_way
    }

    /// The agents as they were searched for, if not as they were given, and the changed paths.
    /// Drones without a path keep their `kept` legs.
    pub(crate) fn into_paths(mut self) -> (Option<Vec<Agent>>, Paths) {
        for index in 0..self.attempt.paths.len() {
            if !self.has_new_path(index) {
                self.attempt.paths[index] = None;
            }
        }
        let settled = self.settled;
        let unplanned = &mut self.attempt.unplanned;
        unplanned.retain(|(drone, _)| !settled.contains(drone));
        let agents = match std::mem::take(&mut self.attempt.agents) {
            Cow::Owned(agents) => Some(agents),
            Cow::Borrowed(_) => None,
        };
        (agents, self.attempt.into_paths())
    }
}

/// Initial price of crossing each drone, before any eviction.
fn price(attempt: &mut Attempt<'_>, group: &[DroneId], settled: &[DroneId]) {
    attempt.evicted.fill(0);
    for index in 0..attempt.kept.len() {
        let drone = DroneId(index as u32);
        attempt.weights[index] = match group.contains(&drone) {
            true => FIRST_WEIGHT,
            false if attempt.kept[index].is_empty() || settled.contains(&drone) => IMMOVABLE,
            false => UNASKED_WEIGHT,
        };
    }
}
