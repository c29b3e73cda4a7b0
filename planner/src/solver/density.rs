//! How much of the floor is under drones that hover until the end: what makes a crowded scenario
//! hard.
//!
//! A wake in a hall of some metres fills its column from the drone down to the floor, so that room
//! grows with the floor and not with the height.

use std::collections::BTreeSet;

use costmap::costmap::Costmap;
use costmap::leg::{Leg, Tick};
use nalgebra::Point3;

use crate::graph::agent::{Agent, Ending};
use crate::plan::cause::Crowding;
use crate::solver::prepare::Job;

/// Columns held by what a fleet does in the end, with all of its legs in a costmap.
pub(crate) fn of(job: &Job, costmap: &Costmap) -> Crowding {
    let last = |agent: &Agent| costmap.legs(agent.drone).last();
    let hover = |leg: &&Leg| leg.flying && leg.end == Tick::FOREVER;
    let ends = job.agents.iter().filter_map(last).filter(hover);
    under(job, ends.map(|leg| leg.to_m))
}

/// Columns held by what a fleet is to do in the end.
pub(crate) fn of_goals(job: &Job) -> Crowding {
    let hovers = |agent: &&Agent| agent.ending == Ending::Hover;
    let goal_m = |agent: &Agent| job.roadmap.position_m(agent.last_vertex());
    under(job, job.agents.iter().filter(hovers).map(goal_m))
}

/// Columns of the lattice nearest to some places (m), and those in which a drone could be at all.
fn under(job: &Job, ends_m: impl Iterator<Item = Point3<f64>>) -> Crowding {
    let lattice = job.roadmap.lattice();
    let [nx, ny, nz] = lattice.counts().map(|count| count as i32);
    let is_open = |i: i32, j: i32| {
        let mut places = (0..nz).filter_map(|k| lattice.at([i, j, k]));
        places.any(|place| job.roadmap.edges(place).next().is_some())
    };
    let columns = (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j)));
    let column = |end_m: Point3<f64>| {
        let [i, j, _] = lattice.nearest(&end_m);
        [i, j]
    };
    let held: BTreeSet<[i32; 2]> = ends_m.map(column).collect();
    Crowding {
        held: held.len(),
        open: columns.filter(|(i, j)| is_open(*i, *j)).count(),
    }
}
