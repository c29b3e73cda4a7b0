//! Whether every order of the fleet leads to a plan, shown without any search.
//!
//! Endpoints are well-formed if every drone has a way from its start to its goal that all others leave free, wherever each
//! of them is, at its start or at its goal: then whoever waits at its start until those before it are home has a way, in
//! any order (M. Čáp, P. Novák, A. Kleiner, M. Selecký, "Prioritized planning algorithms for trajectory coordination of
//! multiple mobile robots", IEEE Transactions on Automation Science and Engineering 12, 2015). Wake-well-formed: what is to be left
//! free is the room for the body and for both wakes, and no start lies in the wake of another's goal.
//!
//! Shown for steps along the axes of the lattice, with the tables of the crowd, and room to spare for the sums of wakes
//! farther off. What is not shown may be so all the same: a fleet that is not well-formed depends on order, and mostly has a plan.

use std::collections::BTreeSet;

use costmap::leg::KindId;
use rayon::prelude::*;

use crate::graph::agent::{Ending, Errand};
use crate::graph::roadmap::{Roadmap, Vertex};
use crate::plan::outcome::{Offence, OffenceKind, WellFormed};
use crate::sipp::conflicts::Steps;
use crate::sipp::conflicts::synchronous::SynchronousSteps;
use crate::solver::prepare::Job;

mod marks;
mod rooms;
#[cfg(test)]
mod tests;

use marks::Marks;
use rooms::Rooms;

/// Where somebody can be while another flies.
pub(crate) struct Endpoint {
    drone: usize,
    class: usize,
    place: Vertex,
    is_goal: bool,
}

/// Examines a fleet; `None` where somebody lands, and where a start or a task lies beside the lattice, which the tables do not know.
pub(crate) fn examine(job: &Job, steps: &Steps) -> Option<WellFormed> {
    let synchronous = SynchronousSteps::new(steps);
    let ends = endpoints(job, steps)?;
    let (marks, mut offences) = Marks::new(job, &synchronous, &ends);
    let rooms = |class: usize| {
        let of_class = |errand: &Errand| {
            let mut kinds = errand.kinds.iter();
            kinds.any(|kind| steps.class(errand.drone, *kind) == Some(class))
        };
        let errand = job.errands.iter().find(|errand| of_class(errand));
        errand.map(|errand| Rooms::new(&job.roadmap, &marks, class, errand))
    };
    let rooms: Option<Vec<Rooms>> = (0..steps.class_count()).map(rooms).collect();
    let rooms = rooms?;
    // Who stands around it, on one of its ways at least; `None`: it has them all.
    let enclosed = |errand: &Errand| -> Option<BTreeSet<u32>> {
        let goals = errand.stages.iter().map(|stage| stage.distances.goal());
        let starts = std::iter::once(errand.start).chain(goals.clone());
        let around = starts
            .zip(goals)
            .zip(&errand.kinds)
            .filter_map(
                |((from, to), kind)| match steps.class(errand.drone, *kind) {
                    Some(class) => rooms[class].between(&job.roadmap, &marks, errand, [from, to]),
                    None => Some(BTreeSet::new()),
                },
            );
        around.reduce(|all, more| &all | &more)
    };
    let enclosed: Vec<Option<BTreeSet<u32>>> = job.errands.par_iter().map(enclosed).collect();
    let mut waiting: BTreeSet<usize> = offences.iter().map(|offence| offence.drone).collect();
    waiting.extend((0..enclosed.len()).filter(|drone| enclosed[*drone].is_some()));
    for (drone, by) in enclosed.into_iter().enumerate() {
        offences.extend(by.into_iter().flatten().map(|other| Offence {
            drone,
            other: other as usize,
            kind: OffenceKind::Enclosed,
        }));
    }
    offences.sort_unstable();
    offences.dedup();
    Some(WellFormed {
        drones: job.errands.len(),
        waiting: waiting.into_iter().collect(),
        offences,
    })
}

/// Everybody's start and goal; those on the ground count as if they hovered. `None` where somebody lands: the way down is no step.
fn endpoints(job: &Job, steps: &Steps) -> Option<Vec<Endpoint>> {
    let mut ends = Vec::with_capacity(2 * job.errands.len());
    for (drone, errand) in job.errands.iter().enumerate() {
        let tasks = errand.stages.iter().map(|stage| stage.distances.goal());
        let mut places = std::iter::once(errand.start).chain(tasks);
        let lands = matches!(errand.ending, Ending::Land { .. });
        if lands || places.any(|place| job.roadmap.is_stop(place)) {
            return None;
        }
        let end = |place, kind: Option<&KindId>, is_goal| {
            Some(Endpoint {
                drone,
                class: steps.class(errand.drone, *kind?)?,
                place,
                is_goal,
            })
        };
        ends.push(end(errand.start, errand.kinds.first(), false)?);
        if errand.ending != Ending::Leave {
            ends.push(end(errand.last_vertex(), errand.kinds.last(), true)?);
        }
    }
    Some(ends)
}

/// Whether a drone of this errand can take a step along an axis.
fn is_open(roadmap: &Roadmap, errand: &Errand, place: Vertex, neighbour: usize) -> bool {
    let open = roadmap.open_steps(errand.mover.radius_m());
    open.is_some_and(|open| open[place as usize] >> neighbour & 1 != 0)
}
