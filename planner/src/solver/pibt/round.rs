//! One PIBT round: drones of higher priority displace others.
//!
//! Priority inheritance with backtracking (K. Okumura, M. Machida, X. Défago, Y. Tamura, "Priority
//! inheritance with backtracking for iterative multi-agent path finding", Artificial Intelligence
//! 310, 2022), for drones that exclude others from more than their own place: one step may displace
//! several, so that the changes of a failed displacement are undone.

use std::collections::VecDeque;

use super::configuration::{AgentState, Configuration, MOST_LINKS};
use crate::graph::roadmap::Vertex;
use crate::sipp::conflicts::synchronous::{
    DIRECTIONS, MOST_LOADS, STAYS, StepDirection, StepInteraction, SynchronousStep,
};

/// Steps tried for one drone and all it displaces: chosen here, mostly a few are enough.
const MOST_TRIES: u32 = 200;
/// A drone that may make a detour makes one in so many rounds: chosen here, in between it goes on
/// from where that led.
const DETOUR_EVERY: u32 = 4;
/// What a drone could do: stay, step along an axis, or to or from a stop beside the lattice.
const MOST_OPTIONS: usize = DIRECTIONS.len() + MOST_LINKS;
/// No drone.
const NONE: u32 = u32::MAX;

/// Every drone's step of an earlier round: its air may still be under way.
pub(super) struct PastRound {
    steps: Vec<SynchronousStep>,
    /// By column of the floor, the first drone in it; by drone, the next in the same.
    first: Vec<u32>,
    next: Vec<u32>,
}

impl PastRound {
    /// From where every drone was, and what it did.
    pub(super) fn new(
        configuration: &Configuration<'_>,
        now: &[AgentState],
        directions: &[u8],
    ) -> PastRound {
        let [nx, ny, _] = configuration.synchronous.steps.counts();
        let mut past = PastRound {
            steps: Vec::with_capacity(now.len()),
            first: vec![NONE; nx * ny],
            next: vec![NONE; now.len()],
        };
        for (drone, (at, direction)) in now.iter().zip(directions).enumerate() {
            let direction = usize::from(*direction);
            past.steps.push(configuration.synchronous_step(
                drone,
                at,
                direction,
                StepDirection::STAY,
            ));
            let column = configuration.column(at.place);
            past.next[drone] = std::mem::replace(&mut past.first[column], drone as u32);
        }
        past
    }
}

/// Every drone's next step, as far as it is decided.
pub(super) struct Round<'a> {
    /// Tasks of the drones, and open steps.
    configuration: &'a Configuration<'a>,
    /// Where every drone is.
    now: &'a [AgentState],
    /// By drone, what led there in the round before.
    previous_directions: Vec<StepDirection>,
    /// Earlier rounds whose air may be under way, the last one first.
    past: &'a VecDeque<PastRound>,
    /// By column of the floor, the first drone in it, or [`NONE`].
    first: Vec<u32>,
    /// By drone, the next one in the same column, or [`NONE`].
    next: Vec<u32>,
    /// By drone; those not decided are taken to stay.
    directions: Vec<u8>,
    /// By drone: its step stands, unless a displacement fails.
    decided: Vec<bool>,
    /// By drone: it was displaced in vain.
    stuck: Vec<bool>,
    /// By drone, what wakes fill of its budget; see [`MOST_LOADS`].
    loads: Vec<i32>,
    /// Drones with a changed step, and the step before.
    trail: Vec<(u32, u8)>,
    /// Steps that may still be tried for the drone whose turn it is.
    tries: u32,
    /// By drone, the longest detour that it may make (steps).
    detours: &'a [u32],
    /// State of the tie-break's generator; never 0.
    random: u64,
}

impl<'a> Round<'a> {
    /// Every drone stays, as far as nothing else is decided; where each was `before` that, and is
    /// `now`.
    pub(super) fn new(
        configuration: &'a Configuration<'a>,
        ([before, now], past): ([&'a [AgentState]; 2], &'a VecDeque<PastRound>),
        detours: &'a [u32],
        random: u64,
    ) -> Round<'a> {
        let [nx, ny, _] = configuration.synchronous.steps.counts();
        let mut round = Round {
            configuration,
            now,
            previous_directions: (before.iter().zip(now))
                .map(|(before, now)| configuration.step_direction([before.place, now.place]))
                .collect(),
            past,
            first: vec![NONE; nx * ny],
            next: vec![NONE; now.len()],
            directions: vec![STAYS as u8; now.len()],
            decided: (0..now.len())
                .map(|drone| configuration.is_fixed(drone))
                .collect(),
            stuck: vec![false; now.len()],
            loads: vec![0; now.len()],
            trail: Vec::new(),
            tries: 0,
            detours,
            random,
        };
        for drone in (0..now.len()).rev() {
            let column = configuration.column(now[drone].place);
            round.next[drone] = std::mem::replace(&mut round.first[column], drone as u32);
        }
        for drone in 0..now.len() {
            let mut load = 0;
            round.around(drone, STAYS, |_, interaction| {
                if let StepInteraction::Loads([on_me, _]) = interaction {
                    load += i32::from(on_me);
                }
            });
            round.loads[drone] = load;
        }
        round
    }

    /// Decides for all in this order, and says what every drone does.
    pub(super) fn decide_all(mut self, order: &[u32]) -> Vec<u8> {
        for &drone in order {
            if !self.decided[drone as usize] {
                self.tries = MOST_TRIES;
                self.trail.clear();
                self.decide(drone as usize);
                // A drone without a step stays: no decided step is too near to that.
                self.decided[drone as usize] = true;
            }
        }
        self.directions
    }

    /// Displaces a drone; one whose displacement failed does not try again.
    fn displace(&mut self, drone: usize) -> bool {
        let done = !self.stuck[drone] && self.decide(drone);
        self.stuck[drone] |= !done;
        done
    }

    /// Whether a drone finds a step for which all that it displaces find one.
    fn decide(&mut self, drone: usize) -> bool {
        for direction in self.options(drone).into_iter().flatten() {
            if self.tries == 0 {
                return false;
            }
            self.tries -= 1;
            let mark = self.trail.len();
            if self.attempt(drone, usize::from(direction)) {
                return true;
            }
            self.undo(mark);
        }
        false
    }

    /// A drone's options, nearest to its goal first, then those that displace no drone. A drone
    /// that may make a detour at times takes one that leads away.
    fn options(&mut self, drone: usize) -> [Option<u8>; MOST_OPTIONS] {
        let (configuration, at) = (self.configuration, self.now[drone]);
        let mut keyed = [(u32::MAX, true, 0, 0); MOST_OPTIONS];
        let mut count = 0;
        let most = self.detours[drone];
        let makes_one = most > 0 && self.tie_break().is_multiple_of(DETOUR_EVERY);
        let detour = if makes_one { most } else { 0 };
        configuration.options(drone, &at, |direction, to| {
            let is_taken = to != at.place && self.is_taken(drone, to);
            let tie_break = self.tie_break();
            keyed[count] = (
                configuration.steps_from(drone, &at, to) + tie_break % (detour + 1),
                is_taken,
                tie_break,
                direction as u8,
            );
            count += 1;
        });
        keyed[..count].sort_unstable();
        std::array::from_fn(|index| (index < count).then(|| keyed[index].3))
    }

    /// Whether another drone is in the column of a place.
    fn is_taken(&self, drone: usize, place: Vertex) -> bool {
        let first = self.first[self.configuration.column(place)];
        first != NONE && (first as usize != drone || self.next[drone] != NONE)
    }

    /// A random number for steps that lead equally far.
    fn tie_break(&mut self) -> u32 {
        // Xorshift: G. Marsaglia, "Xorshift RNGs", Journal of Statistical Software 8, 2003.
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random as u32
    }

    /// Takes a step for decided, and displaces drones that cannot stay then.
    fn attempt(&mut self, drone: usize, direction: usize) -> bool {
        if self.advected_load(drone, direction).is_none() {
            return false;
        }
        self.trail.push((drone as u32, self.directions[drone]));
        self.decided[drone] = true;
        self.set(drone, direction);
        let mut pushed: Vec<u32> = Vec::new();
        let mut is_possible = true;
        self.around(drone, direction, |other, interaction| match interaction {
            StepInteraction::Loads(_) => {}
            StepInteraction::TooNearBefore => is_possible = false,
            StepInteraction::TooNear => {
                is_possible &= !self.decided[other] && !self.stuck[other];
                pushed.push(other as u32);
            }
        });
        is_possible
            && pushed.into_iter().all(|other| {
                let other = other as usize;
                self.decided[other] || self.displace(other)
            })
            && self.are_loads_within_budget(drone)
    }

    /// Takes steps back until the trail is as long as it was.
    fn undo(&mut self, mark: usize) {
        while self.trail.len() > mark {
            let Some((drone, direction)) = self.trail.pop() else {
                return;
            };
            self.decided[drone as usize] = false;
            self.set(drone as usize, usize::from(direction));
        }
    }

    /// Changes a drone's step, and the loads on it and on those around it.
    fn set(&mut self, drone: usize, direction: usize) {
        for sign in [-1, 1] {
            let mut changes: Vec<(usize, [u8; 2])> = Vec::new();
            self.around(
                drone,
                usize::from(self.directions[drone]),
                |other, interaction| {
                    if let StepInteraction::Loads(loads) = interaction {
                        changes.push((other, loads));
                    }
                },
            );
            for (other, [on_me, on_them]) in changes {
                self.loads[drone] += sign * i32::from(on_me);
                self.loads[other] += sign * i32::from(on_them);
            }
            self.directions[drone] = direction as u8;
        }
    }

    /// Whether loads on a drone and on those around it are within their budgets.
    fn are_loads_within_budget(&self, drone: usize) -> bool {
        let is_within_budget = |drone: usize| {
            let late = self.advected_load(drone, usize::from(self.directions[drone]));
            self.loads[drone] + late.unwrap_or(0) <= MOST_LOADS
        };
        let mut are_within_budget = is_within_budget(drone);
        self.around(
            drone,
            usize::from(self.directions[drone]),
            |other, interaction| {
                let is_exposed =
                    matches!(interaction, StepInteraction::Loads([_, on_them]) if on_them > 0);
                are_within_budget = are_within_budget && (!is_exposed || is_within_budget(other));
            },
        );
        are_within_budget
    }

    /// What air of earlier rounds fills of a drone's budget on a step, each drone's at its most;
    /// `None`: some of it is too much.
    fn advected_load(&self, drone: usize, direction: usize) -> Option<i32> {
        if self.past.is_empty() {
            return Some(0);
        }
        let synchronous = self.configuration.synchronous;
        let mine = self.synchronous_step(drone, direction);
        let mut loads: Vec<(usize, u8)> = Vec::new();
        for (class, column) in self.columns_near(&mine) {
            for (past, rounds) in self.past.iter().zip(1..) {
                let mut other = past.first[column];
                while other != NONE {
                    let index = other as usize;
                    other = past.next[index];
                    let theirs = &past.steps[index];
                    if index == drone || theirs.class != class {
                        continue;
                    }
                    let load = synchronous.meets_air(&mine, theirs, rounds)?;
                    match loads.iter_mut().find(|(known, _)| *known == index) {
                        _ if load == 0 => {}
                        Some((_, known)) => *known = load.max(*known),
                        None => loads.push((index, load)),
                    }
                }
            }
        }
        // What one does now counts already; of both the greater counts.
        let more = loads.into_iter().map(|(other, load)| {
            let theirs = self.synchronous_step(other, usize::from(self.directions[other]));
            let now = match synchronous.meet(&mine, &theirs) {
                StepInteraction::Loads([on_me, _]) => on_me,
                StepInteraction::TooNear | StepInteraction::TooNearBefore => 0,
            };
            i32::from(load.saturating_sub(now))
        });
        Some(more.sum())
    }

    /// Calls `f` with every drone that a step of this drone could affect, and what the two do to
    /// one another.
    fn around(&self, drone: usize, direction: usize, mut f: impl FnMut(usize, StepInteraction)) {
        let mine = self.synchronous_step(drone, direction);
        for (class, column) in self.columns_near(&mine) {
            let mut other = self.first[column];
            while other != NONE {
                let index = other as usize;
                other = self.next[index];
                if index == drone {
                    continue;
                }
                let others = usize::from(self.directions[index]);
                let theirs = self.synchronous_step(index, others);
                if theirs.class == class {
                    f(index, self.configuration.synchronous.meet(&mine, &theirs));
                }
            }
        }
    }

    /// The columns of places in which a drone could matter to a step, class by class.
    fn columns_near(&self, mine: &SynchronousStep) -> impl Iterator<Item = (usize, usize)> {
        let (configuration, synchronous) = (self.configuration, self.configuration.synchronous);
        let [nx, ny, _] = synchronous.steps.counts();
        (0..synchronous.steps.class_count()).flat_map(move |class| {
            let near = synchronous.near(mine, class, configuration.is_beside);
            near.iter().filter_map(move |aside| {
                let [i, j] = [mine.at[0] + aside[0], mine.at[1] + aside[1]];
                let is_there = i >= 0 && j >= 0 && (i as usize) < nx && (j as usize) < ny;
                is_there.then(|| (class, i as usize + nx * j as usize))
            })
        })
    }

    fn synchronous_step(&self, drone: usize, direction: usize) -> SynchronousStep {
        let (at, previous_direction) = (&self.now[drone], self.previous_directions[drone]);
        self.configuration
            .synchronous_step(drone, at, direction, previous_direction)
    }
}
