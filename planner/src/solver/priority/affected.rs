//! A few drones planned anew among others that fly already, and may have to give way.

use std::collections::VecDeque;

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, Leg, Tick};
use costmap::verdict::Verdict;

use super::{Attempt, FailureKind, Paths};
use crate::plan::outcome::{Control, Effort};
use crate::sipp::search::{IMMOVABLE, Path};
use crate::solver::prepare::Job;

/// Price in ticks of changing the way of a drone that no drone asked to change. Chosen here: 20 s,
/// so that those who are asked rather wait for a while.
const UNASKED_WEIGHT: u32 = 2_000;

/// What is given when a few are planned anew.
#[derive(Clone)]
pub(crate) struct Affected<'a> {
    /// Who is planned, wherever they are in the costmap.
    pub(crate) group: &'a [DroneId],
    /// Whose legs are others now, and what they keep: no way is looked for.
    pub(crate) settled: &'a [DroneId],
    /// Every drone's legs as they are.
    pub(crate) costmap: Costmap,
    /// Until when each drone goes on as it does.
    pub(crate) under_way: Vec<Tick>,
    /// What each drone goes on with if it finds no way; nothing for those who cannot be made to
    /// give way, and in the group for those who are not let in then.
    pub(crate) kept: Vec<Vec<Leg>>,
}

/// Plans those in the group; the drone that gives way to them is planned again.
///
/// Paths are those of drones whose way has changed. Those who find none keep what they are to keep.
pub(crate) fn plan_affected(
    job: &Job,
    affected: Affected<'_>,
    energy_weight: f64,
    control: &Control<'_>,
    effort: &mut Effort,
) -> Paths {
    let group = affected.group;
    let mut attempt = Attempt::new(
        &job.roadmap,
        &job.agents,
        affected.costmap,
        energy_weight,
        control,
        effort,
    );
    for (index, kept) in affected.kept.iter().enumerate() {
        let drone = DroneId(index as u32);
        if group.contains(&drone) {
            continue;
        }
        attempt.weights[index] = if kept.is_empty() {
            IMMOVABLE
        } else {
            UNASKED_WEIGHT
        };
        attempt.paths[index] = (!kept.is_empty()).then(|| Path {
            legs: kept.clone(),
            arrives: Tick(0),
            met: Vec::new(),
        });
    }
    attempt.under_way = affected.under_way;
    attempt.kept = affected.kept;
    let mut queue = shortest_first(job, group);
    let settled = affected.settled;
    for &drone in settled {
        attempt.weights[drone.0 as usize] = IMMOVABLE;
        attempt.paths[drone.0 as usize] = None;
        attempt.costmap.remove(drone);
        attempt.leave_unplanned(drone, FailureKind::Stopped, &mut queue);
    }
    for &drone in group {
        attempt.costmap.remove(drone);
        let begun = job.agents[drone.0 as usize].begun.clone();
        attempt.costmap.insert(begun.clone());
        attempt.clear_the_way(&begun, &mut queue);
    }
    attempt.run(queue);
    attempt
        .unplanned
        .retain(|(drone, _)| !settled.contains(drone));
    for (index, path) in attempt.paths.iter_mut().enumerate() {
        // Those who never had to give way.
        let kept = |path: &Path| path.legs == attempt.kept[index];
        if !group.contains(&DroneId(index as u32)) && path.as_ref().is_some_and(kept) {
            *path = None;
        }
    }
    attempt.into_paths()
}

fn shortest_first(job: &Job, group: &[DroneId]) -> VecDeque<DroneId> {
    let mut keyed: Vec<(u32, DroneId)> = group
        .iter()
        .map(|&drone| (job.agents[drone.0 as usize].alone_ticks, drone))
        .collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, drone)| drone).collect()
}

impl Attempt<'_> {
    /// Takes back the drone that is in conflict with legs that are flown in any case, and can still
    /// be moved.
    fn clear_the_way(&mut self, begun: &[Leg], queue: &mut VecDeque<DroneId>) {
        let mut verdict = Verdict::default();
        let mut hit = Vec::new();
        for leg in begun {
            self.costmap.judge(leg, &mut verdict);
            let scene = self.scene();
            let movable = verdict
                .blockers
                .iter()
                .filter(|b| scene.weight(b) != IMMOVABLE);
            hit.extend(movable.map(|blocker| blocker.drone));
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
