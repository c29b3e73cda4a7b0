//! Several drones searched for at a time, taken in order.

use std::collections::VecDeque;

use costmap::costmap::Reservation;
use costmap::leg::DroneId;
use costmap::verdict::{Blocker, Verdict};
use rayon::prelude::*;

use super::{Attempt, FailureKind};
use crate::graph::distances::UNREACHABLE;
use crate::plan::outcome::Progress;
use crate::sipp::search::{Found, IMMOVABLE, Path, Scene, Searched, search};

/// Drones searched for at a time. Chosen here: enough for the cores of a desk, few enough that they
/// are seldom in one another's way.
const LARGEST_BATCH: usize = 16;

impl Attempt<'_> {
    /// Plans all in the queue, several at a time as if the others of the batch were not there. They
    /// are taken in order, and the drone that is in the way of one before it is planned again. How
    /// many there are in a batch depends on how that went before, and not on the number of threads.
    /// `false` if it gave up.
    pub(super) fn run(&mut self, queue: VecDeque<DroneId>) -> bool {
        // Among the threads that share the work: little of it can be handed on from outside.
        rayon::scope(|_| self.run_here(queue))
    }

    fn run_here(&mut self, mut queue: VecDeque<DroneId>) -> bool {
        let mut most = 1;
        loop {
            let is_spent = |most: u64| self.effort.expansions > most || (self.control.stop)();
            if self.gives_up_at.is_some_and(is_spent) {
                return false;
            }
            if (self.control.stop)() {
                self.finalise(queue);
                return true;
            }
            let batch = self.next_batch(&mut queue, most);
            if batch.is_empty() {
                break;
            }
            let scene = self.scene();
            let searched: Vec<(Searched, Option<Reservation>)> = batch
                .par_iter()
                // Some take a hundred times as long as others.
                .with_max_len(1)
                .map(|drone| {
                    let careful = self.careful[drone.0 as usize];
                    let agent = &self.agents[drone.0 as usize];
                    let searched = search(Scene { careful, ..scene }, agent);
                    let reservation = match &searched.found {
                        Found::Path(path) => Some(scene.costmap.reservation(path.legs.clone())),
                        _ => None,
                    };
                    (searched, reservation)
                })
                .collect();
            let mut again = Vec::new();
            let mut is_first = true;
            for (drone, searched) in batch.into_iter().zip(searched) {
                if !self.take(drone, searched, is_first, &mut queue) {
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

    fn next_batch(&mut self, queue: &mut VecDeque<DroneId>, most: usize) -> Vec<DroneId> {
        let mut batch = Vec::new();
        while batch.len() < most {
            let Some(drone) = queue.pop_front() else {
                break;
            };
            if self.weights[drone.0 as usize] == IMMOVABLE {
                continue;
            }
            if self.agents[drone.0 as usize].alone_ticks == UNREACHABLE {
                self.leave_unplanned(drone, FailureKind::NoWay, queue);
                continue;
            }
            batch.push(drone);
        }
        batch
    }

    /// Takes over what a search found; `false` if others of its batch are in the way by now.
    fn take(
        &mut self,
        drone: DroneId,
        (searched, reservation): (Searched, Option<Reservation>),
        is_first: bool,
        queue: &mut VecDeque<DroneId>,
    ) -> bool {
        self.effort.searches += 1;
        self.effort.expansions += searched.expansions;
        if self.weights[drone.0 as usize] == IMMOVABLE {
            // Stranded meanwhile.
            return true;
        }
        match searched.found {
            // It waits for the next look at whether to stop.
            Found::Stopped => queue.push_front(drone),
            Found::Blocked(by) => self.leave_unplanned(drone, FailureKind::Obstructed(by), queue),
            Found::Path(path) => {
                let (is_valid, is_borne) = rayon::join(
                    || is_first || self.meets_only_those_it_knows(drone, &path),
                    || self.is_borne(drone, &path),
                );
                if !is_valid {
                    return false;
                }
                for &met in &path.met {
                    self.evict(met, queue);
                }
                let stuck = |met: &DroneId| self.weights[met.0 as usize] == IMMOVABLE;
                if path.met.iter().any(stuck) {
                    // The drone that was to give way has given up instead, and is in the way for
                    // good.
                    queue.push_front(drone);
                    return true;
                }
                // Fewer are left to bear it now.
                if !is_borne && !self.is_borne(drone, &path) {
                    self.careful[drone.0 as usize] = true;
                    queue.push_front(drone);
                    return true;
                }
                if let Some(reservation) = reservation {
                    self.take_over(reservation);
                }
                self.paths[drone.0 as usize] = Some(path);
            }
        }
        true
    }

    /// Whether every drone farther off bears what a path brings them, so far as that was not asked
    /// of every step.
    fn is_borne(&self, drone: DroneId, path: &Path) -> bool {
        self.careful[drone.0 as usize] || self.costmap.is_borne(&path.legs)
    }

    /// Whether a path is as its search thought, now that others of its batch are there.
    fn meets_only_those_it_knows(&self, drone: DroneId, path: &Path) -> bool {
        let scene = Scene {
            careful: self.careful[drone.0 as usize],
            ..self.scene()
        };
        let mut verdict = Verdict::default();
        path.legs.iter().all(|leg| {
            scene.judge(leg, &mut verdict);
            let known = |blocker: &Blocker| path.met.contains(&blocker.drone);
            verdict.breaks_zone.is_none() && verdict.blockers.iter().all(known)
        })
    }
}
