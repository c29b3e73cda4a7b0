//! One attempt at a fleet's paths: a queue of drones, each searched for among those planned.
//!
//! Several drones are searched for at a time, as if the others of the batch were not there, and
//! taken in order. A search never has to fail: a drone may cross what others hold, at a price for
//! each of them; a drone crossed is evicted, replanned next, and dearer from then on.

use std::borrow::Cow;
use std::collections::VecDeque;

use costmap::costmap::{Costmap, Reservation};
use costmap::leg::{DroneId, Leg, Tick};
use costmap::verdict::{Blocker, Verdict};
use rayon::prelude::*;

use crate::graph::agent::{Agent, TOLERANCE_TICKS};
use crate::graph::distances::UNREACHABLE;
use crate::graph::roadmap::Roadmap;
use crate::plan::cause::MissingRoom;
use crate::plan::outcome::{Control, Effort, Progress};
use crate::sipp::conflicts::ReservationTable;
use crate::sipp::search::{
    IMMOVABLE, Obstruction, Path, SearchOutcome, SearchSetting, Searched, search,
};
use crate::solver::prepare::Job;
use crate::solver::priority::{MOST_SMALL, UNTABULATED_LATE_STATES, UNTABULATED_STATES};

/// First price of crossing a drone, in ticks: chosen here, 5 s, ten cells of a metre at 2 m/s.
pub(super) const FIRST_WEIGHT: u32 = 500;
/// Added at every eviction: chosen here, half the first price.
const WEIGHT_GROWTH: u32 = 250;
/// A drone evicted more often than this stays at its start. Chosen here: fleets of 1000 that can be
/// planned evict no drone more than a few times.
pub(super) const MOST_EVICTIONS: u32 = 24;
/// From so many evictions on a drone's search may step aside and come back. Chosen here: it reaches
/// two drones that find paths only through each other, and few in a hall.
const EVICTIONS_BEFORE_REVISITS: u32 = 3;
/// States of one search; chosen here, seconds of work.
const MOST_EXPANSIONS: u64 = 400_000;
/// The same in a small fleet, where refused drones are tried again, and without tables, where a
/// state takes longer: chosen here, half a second of work and more.
const MOST_SMALL_EXPANSIONS: u64 = 40_000;
/// Once such a fleet took so many states, its searches get no more than
/// [`LEAST_SMALL_EXPANSIONS`]: chosen here, two seconds of work.
const ALL_SMALL_EXPANSIONS: u64 = 120_000;
/// Chosen here: what most searches need.
const LEAST_SMALL_EXPANSIONS: u64 = 5_000;

/// States of one search among drones that are under way: chosen here, half a second of work. A
/// fifth of it misses existing paths of some late drones.
const MOST_CHANGED_EXPANSIONS: u64 = 100_000;

/// Drones searched for at a time. Chosen here: enough for the cores of a desk, few enough that
/// their paths seldom conflict.
const LARGEST_BATCH: usize = 16;
/// States of all searches after the stop: chosen here, about a tenth of a second of work.
const ALL_EXPANSIONS: u64 = 8_000;
/// States of one of them: chosen here, a quarter.
const MOST_FINAL_EXPANSIONS: u64 = 2_000;
/// A drone displaced more often than this stays at its start: chosen here.
const MOST_FINAL_EVICTIONS: u32 = 4;

/// Paths of a fleet.
#[derive(Clone, Debug)]
pub(crate) struct Paths {
    /// Per drone; `None`: it stays at its start.
    pub(crate) paths: Vec<Option<Path>>,
    /// Why those without a path have none.
    pub(crate) unplanned: Vec<(DroneId, FailureKind)>,
    /// Every drone's reservations, also of those without a path.
    pub(crate) costmap: Costmap,
    /// By drone, its legs before they are smoothed; none where they were there before.
    pub(crate) legs: Vec<Vec<Leg>>,
}

/// Why a drone stays at its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FailureKind {
    /// The roadmap has no path through free space to one of its tasks.
    NoPath,
    /// It cannot be at one of its tasks in time: which, counted from 0, and when it is there.
    Late(usize, Tick),
    /// Its end excludes another drone's.
    EndpointConflict,
    /// What it would land on, or what is beside or above it, leaves too little room.
    Landing(MissingRoom),
    /// Other drones obstruct it.
    Obstructed(Option<Obstruction>),
    /// Its wake is too strong for a zone whichever path it flies.
    Zone(Obstruction),
    /// Planning was stopped before its turn.
    Stopped,
}

/// How fast a fleet was planned up to the last look at it.
///
/// The more drones are planned, the more states the next one takes: an attempt that plans too few
/// in one span of states plans no more in the next.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlanningRate {
    /// States before the first.
    pub(super) begun: u64,
    /// Spans that are over, [`SPANS`] up to where it gives up.
    pub(super) spans: u64,
    /// Drones that had a path at the end of the last one.
    pub(super) planned: usize,
}

/// Spans of a [`PlanningRate`]: chosen here, of a fleet of a hundred each holds ten drones and
/// more.
const SPANS: u64 = 8;
/// How many times as many drones a later span may plan: chosen here, some drones take several times
/// as long as those after them.
const MOST_FASTER: usize = 2;

/// Searches for a path; of a drone that departs in others' air, first for one that soon leaves it.
fn search_out(setting: SearchSetting<'_>, agent: &Agent) -> Searched {
    let searched = search(setting, agent);
    let is_short = !agent.tolerated_drones.is_empty() && agent.tolerance_ticks < TOLERANCE_TICKS;
    if !is_short || !matches!(searched.found, SearchOutcome::Blocked(_)) {
        return searched;
    }
    let longer = Agent {
        tolerance_ticks: TOLERANCE_TICKS,
        ..agent.clone()
    };
    let again = search(setting, &longer);
    Searched {
        expansions: searched.expansions + again.expansions,
        ..again
    }
}

/// A fleet with the paths found so far, and the queue rules that make more of them.
pub(super) struct Attempt<'a> {
    /// Paths through free space.
    roadmap: &'a Roadmap,
    /// By drone.
    pub(super) agents: Cow<'a, [Agent]>,
    /// What every drone flies, as far as it is known.
    pub(super) costmap: Costmap,
    /// What the costmap says, in brief; `None`: searches ask the costmap itself.
    pub(super) reservations: Option<ReservationTable<'a>>,
    /// Seconds of delay that a second's worth of hover energy is worth.
    pub(super) energy_weight: f64,
    /// Says when to stop.
    pub(super) control: &'a Control<'a>,
    /// Counted up.
    pub(super) effort: &'a mut Effort,
    /// Price of crossing each drone (ticks), or [`IMMOVABLE`].
    pub(super) weights: Vec<u32>,
    /// How often each has been evicted.
    pub(super) evicted: Vec<u32>,
    /// Drones whose weak wakes overload another: their steps are judged in full.
    pub(super) judges_far_wakes: Vec<bool>,
    /// A drone evicted more often stays at its start.
    pub(super) most_evictions: u32,
    /// It is small, or its states take long: searches get fewer of them.
    pub(super) has_small_budget: bool,
    /// See [`SearchSetting::detours`].
    pub(super) detours: bool,
    /// States in all after which it gives up.
    pub(super) gives_up_at: Option<u64>,
    /// With a rate, it gives up earlier where those states will not do.
    pub(super) rate: Option<PlanningRate>,
    /// Drones still in the queue when it gave up.
    pub(super) waiting: VecDeque<DroneId>,
    /// See [`SearchSetting::under_way`].
    pub(super) under_way: Vec<Tick>,
    /// Legs of each drone if it finds no path; a drone without legs is absent. With an empty outer
    /// list every drone stays at its start.
    pub(super) kept: Vec<Vec<Leg>>,
    /// By drone, as far as they are found.
    pub(super) paths: Vec<Option<Path>>,
    /// By drone, the legs of what it flies, before they are smoothed; those of the costmap where
    /// nothing is known here.
    pub(super) legs: Vec<Vec<Leg>>,
    /// Unplanned drones, in the order in which they became so.
    pub(super) unplanned: Vec<(DroneId, FailureKind)>,
}

impl<'a> Attempt<'a> {
    /// Nothing is planned yet; drones in the costmap that are not the job's are immovable.
    pub(super) fn new(
        job: &'a Job,
        costmap: Costmap,
        energy_weight: f64,
        control: &'a Control<'a>,
        effort: &'a mut Effort,
    ) -> Attempt<'a> {
        let drones = job.agents.len();
        let mut weights = vec![FIRST_WEIGHT; drones];
        weights.resize(costmap.drone_count().max(drones), IMMOVABLE);
        Attempt {
            roadmap: &job.roadmap,
            agents: Cow::Borrowed(&job.agents),
            costmap,
            reservations: None,
            energy_weight,
            control,
            effort,
            weights,
            evicted: vec![0; drones],
            judges_far_wakes: vec![false; drones],
            most_evictions: MOST_EVICTIONS,
            has_small_budget: drones <= MOST_SMALL,
            detours: true,
            gives_up_at: None,
            rate: None,
            waiting: VecDeque::new(),
            under_way: Vec::new(),
            kept: Vec::new(),
            paths: vec![None; drones],
            legs: vec![Vec::new(); drones],
            unplanned: Vec::new(),
        }
    }

    /// Leaves drones at their starts before any other is planned.
    pub(super) fn exclude(&mut self, excluded: &[(DroneId, FailureKind)]) {
        for &(drone, why) in excluded {
            self.leave_unplanned(drone, why, &mut VecDeque::new());
        }
    }

    /// Drones without tasks are planned first, and immovable: they stay where they are.
    pub(super) fn fix_stationary_drones(&mut self) {
        let weights = &self.weights;
        let stays = |agent: &&Agent| agent.stays() && weights[agent.drone.0 as usize] != IMMOVABLE;
        let staying = self.agents.iter().filter(stays);
        let staying = staying.map(|agent| agent.stays_at_start(self.roadmap));
        for leg in staying.collect::<Vec<Leg>>() {
            self.reserve(vec![leg]);
            self.weights[leg.drone.0 as usize] = IMMOVABLE;
            self.paths[leg.drone.0 as usize] = Some(Path::new(vec![leg], Tick(0)));
        }
    }

    /// What the next search works on: all that is planned so far.
    pub(super) fn setting(&self) -> SearchSetting<'_> {
        SearchSetting {
            roadmap: self.roadmap,
            costmap: &self.costmap,
            reservations: self.reservations.as_ref(),
            weights: &self.weights,
            under_way: &self.under_way,
            energy_weight: self.energy_weight,
            detours: self.detours,
            ends_at_goal: false,
            judges_far_wakes: false,
            allows_revisits: false,
            most_expansions: self.most_expansions(),
            most_untabulated: match self.kept.is_empty() {
                true => u64::MAX,
                false => MOST_CHANGED_EXPANSIONS / self.untabulated_states(),
            },
            judged_until: Tick(0),
            stop: self.control.stop,
        }
    }

    /// A state without tables takes as long as so many with them.
    fn untabulated_states(&self) -> u64 {
        match self.costmap.wake_persistence_ticks() {
            0 => UNTABULATED_STATES,
            _ => UNTABULATED_STATES * UNTABULATED_LATE_STATES,
        }
    }

    /// States of the next search.
    fn most_expansions(&self) -> u64 {
        let spent = self.effort.expansions;
        let most = match (self.kept.is_empty(), self.has_small_budget) {
            (true, true) => {
                // The same work, where every step is judged by the costmap and air takes time.
                let share = match self.reservations.is_none()
                    && self.costmap.wake_persistence_ticks() > 0
                {
                    true => UNTABULATED_LATE_STATES,
                    false => 1,
                };
                let left = ALL_SMALL_EXPANSIONS.saturating_sub(share * spent);
                left.clamp(LEAST_SMALL_EXPANSIONS, MOST_SMALL_EXPANSIONS) / share
            }
            (true, false) => MOST_EXPANSIONS,
            (false, _) => MOST_CHANGED_EXPANSIONS,
        };
        let left = self
            .gives_up_at
            .map(|until| until.saturating_sub(spent) + 1);
        left.map_or(most, |left| most.min(left))
    }

    /// Counts a search; the path that it found, if it found one.
    pub(super) fn counted(&mut self, searched: Searched) -> Option<Path> {
        self.effort.searches += 1;
        self.effort.expansions += searched.expansions;
        match searched.found {
            SearchOutcome::Path(path) => Some(path),
            SearchOutcome::Blocked(_) | SearchOutcome::Stopped => None,
        }
    }

    /// Evicts a drone for another's path: it is next in the queue, and dearer; beyond the eviction
    /// limit it is left unplanned.
    pub(super) fn evict(&mut self, drone: DroneId, queue: &mut VecDeque<DroneId>) {
        let index = drone.0 as usize;
        if self.paths[index].is_none() {
            // Already taken back, by a drone evicted before and given up.
            return;
        }
        self.take_back(drone);
        self.evicted[index] += 1;
        let weight = self.weights[index].saturating_add(WEIGHT_GROWTH);
        self.weights[index] = weight.min(IMMOVABLE - 1);
        if self.evicted[index] > self.most_evictions {
            self.leave_unplanned(drone, FailureKind::Obstructed(None), queue);
        } else {
            queue.push_front(drone);
        }
    }

    /// Leaves a drone without a path until the end, and replans the drones in conflict with that.
    pub(super) fn leave_unplanned(
        &mut self,
        drone: DroneId,
        why: FailureKind,
        queue: &mut VecDeque<DroneId>,
    ) {
        let stay = self.without_path(drone);
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
            for leg in self.agents[drone.0 as usize].flown(&stay).iter() {
                self.costmap.judge(leg, &mut verdict);
                let setting = self.setting();
                let takeable =
                    |b: &&Blocker| setting.weight(b, None) != IMMOVABLE || self.kept.is_empty();
                hit.extend(verdict.blockers.iter().filter(takeable).map(|b| b.drone));
                allowed &= verdict.is_allowed();
            }
            if !hit.iter().any(movable) && !allowed && self.kept.is_empty() {
                // The drones that stay would bear one another without others near.
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

    /// Puts legs of one drone in the place of those that it had.
    pub(super) fn reserve(&mut self, legs: Vec<Leg>) {
        let Some(first) = legs.first() else {
            return;
        };
        let flown = self.agents[first.drone.0 as usize].flown(&legs);
        let reservation = self.costmap.reservation(flown.into_owned());
        self.take_over(legs, reservation);
    }

    /// The same where what is flown of them is prepared already, in costmap and reservation table
    /// at a time.
    pub(super) fn take_over(&mut self, legs: Vec<Leg>, reservation: Reservation) {
        let Some(drone) = reservation.drone() else {
            return;
        };
        self.release(drone);
        let Some(reservations) = &mut self.reservations else {
            self.legs[drone.0 as usize] = legs;
            return self.costmap.reserve(reservation);
        };
        let costmap = &mut self.costmap;
        let insert = || reservations.insert(&legs);
        rayon::join(|| costmap.reserve(reservation), insert);
        self.legs[drone.0 as usize] = legs;
    }

    /// Takes a drone out of the costmap and the reservation table: its legs, and what it had
    /// reserved, for [`Attempt::take_over`].
    pub(super) fn release(&mut self, drone: DroneId) -> (Vec<Leg>, Option<Reservation>) {
        let legs = std::mem::take(&mut self.legs[drone.0 as usize]);
        let costmap = &mut self.costmap;
        let reservation = match &mut self.reservations {
            Some(table) => rayon::join(|| costmap.remove(drone), || table.remove(&legs)).0,
            None => costmap.remove(drone),
        };
        (legs, reservation)
    }

    /// What a drone flies that finds no path.
    fn without_path(&self, drone: DroneId) -> Vec<Leg> {
        match self.kept.get(drone.0 as usize) {
            Some(kept) => kept.clone(),
            None => vec![self.agents[drone.0 as usize].stays_at_start(self.roadmap)],
        }
    }

    /// Takes a drone's path back; it goes on with what it is flying.
    fn take_back(&mut self, drone: DroneId) {
        self.release(drone);
        self.reserve(self.agents[drone.0 as usize].begun.clone());
        self.paths[drone.0 as usize] = None;
        self.effort.evictions += 1;
    }

    /// Searches again for obstructed drones, one at a time, without evictions.
    fn retry(&mut self) {
        let immovable = vec![IMMOVABLE; self.weights.len()];
        let mut index = 0;
        while let Some(&(drone, why)) = self.unplanned.get(index) {
            index += 1;
            let keeps = self.evicted[drone.0 as usize] > 0 && !self.kept.is_empty();
            if keeps || !matches!(why, FailureKind::Obstructed(_)) || (self.control.stop)() {
                continue;
            }
            let stay = self.legs[drone.0 as usize].clone();
            self.release(drone);
            let setting = self.setting();
            let setting = SearchSetting {
                // Without tables a state takes twenty times as long, and among drones under way no
                // more of these searches find a path.
                reservations: setting.reservations.filter(|_| !self.kept.is_empty()),
                weights: &immovable,
                judges_far_wakes: true,
                most_expansions: setting.most_expansions.min(setting.most_untabulated),
                ..setting
            };
            let searched = search(setting, &self.agents[drone.0 as usize]);
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

    /// Discards all paths found in a repair: the group, and all drones that it evicted, keep their
    /// `kept` legs.
    pub(super) fn keep_all(&mut self, group: &[DroneId]) {
        self.waiting.clear();
        self.unplanned.retain(|(drone, _)| group.contains(drone));
        for index in 0..self.kept.len() {
            let drone = DroneId(index as u32);
            let kept = self.kept[index].clone();
            if group.contains(&drone) {
                if self.unplanned.iter().all(|(known, _)| *known != drone) {
                    self.unplanned.push((drone, FailureKind::Stopped));
                }
                self.paths[index] = None;
                self.release(drone);
            } else if kept.is_empty() || self.legs[index] == kept {
                continue;
            } else {
                self.paths[index] = Some(Path::new(kept.clone(), Tick(0)));
            }
            self.reserve(kept);
        }
    }

    /// What has been found, the unplanned by number.
    pub(super) fn into_paths(mut self) -> Paths {
        self.unplanned.sort_unstable_by_key(|(drone, _)| *drone);
        Paths {
            paths: self.paths,
            unplanned: self.unplanned,
            costmap: self.costmap,
            legs: self.legs,
        }
    }

    /// Plans all in the queue, several at a time as if the others of the batch were not there. They
    /// are taken in order; a drone in conflict with one taken before is planned again. The size of
    /// a batch depends on how that went before, and not on the number of threads. `false` if it
    /// gave up, or was stopped where all drones keep their former paths then.
    pub(super) fn run(&mut self, queue: VecDeque<DroneId>) -> bool {
        // Among the threads that share the work: little of it can be handed on from outside.
        rayon::scope(|_| self.run_here(queue))
    }

    /// The same on this thread's own pool.
    fn run_here(&mut self, mut queue: VecDeque<DroneId>) -> bool {
        let mut most = 1;
        loop {
            let is_spent = |most: u64| self.effort.expansions > most;
            if self.gives_up_at.is_some_and(is_spent) || self.is_too_slow() {
                self.waiting = queue;
                return false;
            }
            if (self.control.stop)() {
                if !self.kept.is_empty() {
                    self.waiting = queue;
                    return false;
                }
                self.finalise(queue);
                return true;
            }
            let batch = self.next_batch(&mut queue, most);
            if batch.is_empty() {
                break;
            }
            let setting = self.setting();
            let searched: Vec<(Searched, Option<Reservation>)> = batch
                .par_iter()
                // Some take a hundred times as long as others.
                .with_max_len(1)
                .map(|drone| {
                    let agent = &self.agents[drone.0 as usize];
                    let setting = SearchSetting {
                        judges_far_wakes: self.judges_far_wakes[drone.0 as usize],
                        allows_revisits: self.evicted[drone.0 as usize]
                            >= EVICTIONS_BEFORE_REVISITS,
                        ..setting
                    };
                    let searched = search_out(setting, agent);
                    let reservation = match &searched.found {
                        SearchOutcome::Path(path) => {
                            let flown = agent.flown(&path.legs).into_owned();
                            Some(setting.costmap.reservation(flown))
                        }
                        _ => None,
                    };
                    (searched, reservation)
                })
                .collect();
            let mut again = Vec::new();
            let mut is_first = true;
            for (drone, searched) in batch.into_iter().zip(searched) {
                if !self.accept(drone, searched, is_first, &mut queue) {
                    again.push(drone);
                }
                is_first = false;
            }
            most = if again.is_empty() {
                (2 * most).min(LARGEST_BATCH)
            } else {
                (most / 2).max(1)
            };
            for drone in again.into_iter().rev() {
                queue.push_front(drone);
            }
            (self.control.progress)(Progress::Searching {
                planned: self.paths.iter().flatten().count(),
                drones: self.paths.len(),
                evictions: self.effort.evictions,
            });
        }
        self.retry();
        true
    }

    /// Whether the states left will not do for the drones left.
    fn is_too_slow(&mut self) -> bool {
        let (Some(rate), Some(until)) = (&mut self.rate, self.gives_up_at) else {
            return false;
        };
        let span = until.saturating_sub(rate.begun).div_ceil(SPANS).max(1);
        let spans = (self.effort.expansions - rate.begun) / span;
        if spans == rate.spans {
            return false;
        }
        let planned = self.paths.iter().flatten().count();
        let gained = planned.saturating_sub(rate.planned) / (spans - rate.spans) as usize;
        (rate.spans, rate.planned) = (spans, planned);
        let ahead = SPANS.saturating_sub(spans) as usize;
        MOST_FASTER * gained * ahead < self.paths.len() - planned - self.unplanned.len()
    }

    /// The next drones of the queue, at most so many; unreachable ones are left unplanned.
    fn next_batch(&mut self, queue: &mut VecDeque<DroneId>, most: usize) -> Vec<DroneId> {
        let mut batch = Vec::new();
        while batch.len() < most {
            let Some(drone) = queue.pop_front() else {
                break;
            };
            if self.weights[drone.0 as usize] == IMMOVABLE {
                continue;
            }
            if self.agents[drone.0 as usize].lower_bound_ticks == UNREACHABLE {
                self.leave_unplanned(drone, FailureKind::NoPath, queue);
                continue;
            }
            let agent = &self.agents[drone.0 as usize];
            let timed = Some(agent).filter(|it| it.is_timed());
            if let Some((task, at)) = timed.and_then(|it| it.comes_late(self.roadmap)) {
                self.leave_unplanned(drone, FailureKind::Late(task, at), queue);
                continue;
            }
            batch.push(drone);
        }
        batch
    }

    /// Takes over what a search found; `false` if it conflicts with others of its batch.
    fn accept(
        &mut self,
        drone: DroneId,
        (searched, reservation): (Searched, Option<Reservation>),
        is_first: bool,
        queue: &mut VecDeque<DroneId>,
    ) -> bool {
        self.effort.searches += 1;
        self.effort.expansions += searched.expansions;
        if self.weights[drone.0 as usize] == IMMOVABLE {
            // It was left at its start meanwhile.
            return true;
        }
        match searched.found {
            // It waits for the next check of the stop signal.
            SearchOutcome::Stopped => queue.push_front(drone),
            SearchOutcome::Blocked(by) => {
                self.leave_unplanned(drone, FailureKind::Obstructed(by), queue)
            }
            SearchOutcome::Path(path) => {
                let (is_valid, are_loads_within_budget) = rayon::join(
                    || is_first || self.has_only_known_conflicts(drone, &path),
                    || self.are_loads_within_budget(drone, &path),
                );
                if !is_valid {
                    return false;
                }
                for &evicted in &path.evicted {
                    self.evict(evicted, queue);
                }
                let stuck = |evicted: &DroneId| self.weights[evicted.0 as usize] == IMMOVABLE;
                if path.evicted.iter().any(stuck) {
                    // A drone to be evicted is left unplanned instead, and immovable.
                    queue.push_front(drone);
                    return true;
                }
                // Evictions leave fewer to bear it.
                if !are_loads_within_budget && !self.are_loads_within_budget(drone, &path) {
                    self.judges_far_wakes[drone.0 as usize] = true;
                    queue.push_front(drone);
                    return true;
                }
                if let Some(reservation) = reservation {
                    self.take_over(path.legs.clone(), reservation);
                }
                self.paths[drone.0 as usize] = Some(path);
            }
        }
        true
    }

    /// Whether every drone farther off bears a path's wake; true where each step was judged in
    /// full.
    fn are_loads_within_budget(&self, drone: DroneId, path: &Path) -> bool {
        let flown = self.agents[drone.0 as usize].flown(&path.legs);
        self.judges_far_wakes[drone.0 as usize] || self.costmap.are_loads_within_budget(&flown)
    }

    /// Whether a path meets only drones its search knew, after others of its batch.
    fn has_only_known_conflicts(&self, drone: DroneId, path: &Path) -> bool {
        let setting = SearchSetting {
            judges_far_wakes: self.judges_far_wakes[drone.0 as usize],
            ..self.setting()
        };
        let flown = self.agents[drone.0 as usize].flown(&path.legs);
        flown.par_iter().all(|leg| {
            let mut against = Verdict::default();
            let mut is_known = |blocker: &Blocker| path.evicted.contains(&blocker.drone);
            setting.add_unknown(leg, &mut is_known, &mut against);
            against.is_allowed()
        })
    }

    /// Leaves queued drones at their starts, and as few others as a tenth of a second allows.
    pub(super) fn finalise(&mut self, waiting: VecDeque<DroneId>) {
        let why = match (self.control.stop)() {
            true => FailureKind::Stopped,
            // The states ended; that may be tried again.
            false => FailureKind::Obstructed(None),
        };
        let mut displaced = VecDeque::new();
        for drone in waiting {
            if self.weights[drone.0 as usize] != IMMOVABLE {
                self.leave_unplanned(drone, why, &mut displaced);
            }
        }
        let immovable = vec![IMMOVABLE; self.weights.len()];
        let mut times = vec![0; self.weights.len()];
        let mut left = match &self.reservations {
            Some(_) => ALL_EXPANSIONS,
            None => ALL_EXPANSIONS / self.untabulated_states(),
        };
        while let Some(drone) = displaced.pop_front() {
            let index = drone.0 as usize;
            if self.weights[index] == IMMOVABLE {
                continue;
            }
            times[index] += 1;
            if left > 0 && times[index] <= MOST_FINAL_EVICTIONS {
                let setting = SearchSetting {
                    weights: &immovable,
                    most_expansions: left.min(MOST_FINAL_EXPANSIONS),
                    stop: &|| false,
                    ..self.setting()
                };
                let searched = search(setting, &self.agents[index]);
                left = left.saturating_sub(searched.expansions);
                if let Some(path) = self.counted(searched)
                    && self
                        .costmap
                        .are_loads_within_budget(&self.agents[index].flown(&path.legs))
                {
                    self.reserve(path.legs.clone());
                    self.paths[index] = Some(path);
                    continue;
                }
            }
            self.leave_unplanned(drone, why, &mut displaced);
        }
    }

    /// Evicts the movable drones in conflict with legs that are flown in any case.
    pub(super) fn evict_conflicting(&mut self, begun: &[Leg], queue: &mut VecDeque<DroneId>) {
        let mut verdict = Verdict::default();
        let mut hit = Vec::new();
        for leg in begun {
            self.costmap.judge(leg, &mut verdict);
            let setting = self.setting();
            let movable = |b: &&Blocker| setting.weight(b, None) != IMMOVABLE;
            hit.extend(verdict.blockers.iter().filter(movable).map(|b| b.drone));
        }
        hit.sort_unstable();
        hit.dedup();
        for drone in hit {
            if self.paths[drone.0 as usize].is_some() {
                self.evict(drone, queue);
            }
        }
    }
}
