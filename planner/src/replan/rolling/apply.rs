//! What a change does to a running plan before anything is planned: tracks, tasks, and stops on the roadmap.

use std::collections::BTreeMap;
use std::sync::Arc;

use costmap::leg::{KindId, Leg, Tick};
use nalgebra::Point3;

use super::track::{State, Track};
use super::turn::Asked;
use super::{Cause, Change, Running, id};
use crate::graph::agent::{Ending, Errand};
use crate::graph::distances::Distances;
use crate::graph::roadmap::{Stop, Vertex};
use crate::scenario::world::{AtStart, Drone, Task};
use crate::solver::assemble::blank;
use crate::solver::assemble::rounded;
use crate::solver::prepare::{Duties, ending_from, errand_of};

/// Applies one change, which is in order.
pub(super) fn apply(
    running: &mut Running,
    at: Tick,
    change: &Change,
    asked: &mut BTreeMap<usize, Asked>,
) {
    let known = |name: &str| {
        running
            .world
            .drones
            .iter()
            .position(|drone| drone.name == name)
    };
    match change {
        Change::Late { drone, by_s } => {
            let Some(index) = known(drone) else { return };
            late(running, at, index, *by_s, asked);
        }
        Change::Added(drone) => add(running, at, drone, asked),
        Change::Removed { drone } => {
            let Some(index) = known(drone) else { return };
            running.tracks[index].cut(at);
            running.tracks[index].errand.stages.clear();
            running.tracks[index].errand.kinds.truncate(1);
            running.world.drones[index].tasks.clear();
            running.costmap.remove(id(index));
            asked.insert(
                index,
                Asked {
                    cause: Cause::Removed,
                    before: None,
                    settled: true,
                },
            );
        }
        Change::Retasked { drone, tasks } => {
            let Some(index) = known(drone) else { return };
            retask(running, at, index, tasks, asked);
        }
    }
}

fn late(
    running: &mut Running,
    at: Tick,
    index: usize,
    by_s: f64,
    asked: &mut BTreeMap<usize, Asked>,
) {
    let roadmap = &running.job.roadmap;
    let track = &mut running.tracks[index];
    let first = track.legs.first().map_or(at, |leg| leg.start);
    let by = Tick::lasting(by_s).min(at.0 - first.0);
    let was = Tick(at.0 - by);
    let rests = track.rest(was).iter().all(Leg::stays);
    if by == 0 || !track.planned || rests && track.state(roadmap, was, false) == State::Ends {
        // It is where it stays.
        return;
    }
    track.fall_behind(roadmap, at, by);
    let settled = track.state(roadmap, at, false) == State::Ends;
    let entry = &mut running.plan.drones[index];
    entry.arrives_s = rounded(entry.arrives_s + Tick(by).seconds());
    asked.insert(
        index,
        Asked {
            cause: Cause::Late,
            before: None,
            settled,
        },
    );
}

fn add(running: &mut Running, at: Tick, drone: &Drone, asked: &mut BTreeMap<usize, Asked>) {
    let index = running.tracks.len();
    let grounded = drone.at_start == AtStart::Landed;
    let radius_m = drone.vehicle.body_radius_m + running.world.planning.clearance_m;
    let start = connect(
        running,
        &[Stop {
            point_m: drone.start_m,
            radius_m,
            grounded,
        }],
    )[0];
    let kind = running
        .kinds
        .kind(&drone.vehicle, drone.vehicle.airframe.mass_kg());
    running.world.drones.push(drone.clone());
    let mut errand = errand(running, index, start, kind, &drone.tasks);
    errand.grounded = grounded;
    errand.departs = at;
    let stay = Leg {
        drone: id(index),
        kind,
        start: at,
        end: Tick::FOREVER,
        from_m: drone.start_m,
        to_m: drone.start_m,
        flying: !grounded,
        air_limit: drone.air_limit,
    };
    running.tracks.push(Track {
        legs: vec![stay],
        errand,
        since: at,
        planned: true,
    });
    let mut entry = blank(&running.world, drone);
    entry.enters_s = (at > Tick(0)).then(|| at.seconds());
    running.plan.drones.push(entry);
    asked.insert(
        index,
        Asked {
            cause: Cause::Added,
            before: None,
            settled: false,
        },
    );
}

fn retask(
    running: &mut Running,
    at: Tick,
    index: usize,
    tasks: &[Task],
    asked: &mut BTreeMap<usize, Asked>,
) {
    let track = &running.tracks[index];
    let State::Flies {
        begun,
        departs,
        at_m,
        grounded,
        ..
    } = track.state(&running.job.roadmap, at, true)
    else {
        return;
    };
    let now = track.legs.iter().find(|leg| leg.end > at);
    let kind = begun
        .last()
        .or(now)
        .map_or(track.errand.kinds[0], |leg| leg.kind);
    let before = (track.clone(), running.world.drones[index].tasks.clone());
    let radius_m =
        running.world.drones[index].vehicle.body_radius_m + running.world.planning.clearance_m;
    let start = match track.vertex_at(&running.job.roadmap, &at_m) {
        Some(vertex) => vertex,
        None => {
            let stop = Stop {
                point_m: at_m,
                radius_m,
                grounded,
            };
            connect(running, &[stop])[0]
        }
    };
    running.world.drones[index].tasks = tasks.to_vec();
    let errand = errand(running, index, start, kind, tasks);
    let track = &mut running.tracks[index];
    track.errand = Errand {
        departs,
        begun: begun.clone(),
        grounded,
        ..errand
    };
    track.since = departs;
    track.planned = true;
    // Until there is a way it is one that ends where it can turn.
    track.cut(departs);
    let stay = Leg {
        start: departs,
        end: Tick::FOREVER,
        from_m: at_m,
        to_m: at_m,
        flying: !grounded,
        kind,
        drone: id(index),
        air_limit: running.world.drones[index].air_limit,
    };
    track.go_on(&[stay]);
    asked.insert(
        index,
        Asked {
            cause: Cause::Retasked,
            before: Some(before),
            settled: false,
        },
    );
}

/// Vertices of these stops; those that are new to the roadmap are connected.
fn connect(running: &mut Running, stops: &[Stop]) -> Vec<Vertex> {
    let roadmap = &mut running.job.roadmap;
    let known = roadmap.place_count();
    let solids = (!running.world.obstacles.is_empty()).then_some(&running.solids);
    let vertices = roadmap.connect(&running.world.bounds_m, solids, stops);
    if roadmap.place_count() > known {
        renew_distances(running);
    }
    vertices
}

/// What is known of ways to a goal is kept by place, and there are more places now.
pub(super) fn renew_distances(running: &mut Running) {
    for track in &mut running.tracks {
        let mover = track.errand.mover.clone();
        let mut from = track.errand.start;
        for stage in &mut track.errand.stages {
            let goal = stage.distances.goal();
            let anew = Distances::new(&running.job.roadmap, goal, from, mover.clone());
            stage.distances = Arc::new(anew);
            from = goal;
        }
    }
}

/// What a drone has to do from a vertex on, carrying what it carries.
fn errand(
    running: &mut Running,
    index: usize,
    start: Vertex,
    kind: KindId,
    tasks: &[Task],
) -> Errand {
    let drone = running.world.drones[index].clone();
    let radius_m = drone.vehicle.body_radius_m + running.world.planning.clearance_m;
    let stops: Vec<Stop> = tasks
        .iter()
        .map(|task| Stop {
            point_m: task.to_m,
            radius_m,
            grounded: false,
        })
        .collect();
    let mut vertices = vec![start];
    vertices.extend(connect(running, &stops));
    let roadmap = &running.job.roadmap;
    let mut kinds = vec![kind];
    for task in tasks {
        let before = kinds[kinds.len() - 1];
        let bare_kg = drone.vehicle.airframe.mass_kg();
        kinds.push(task.load_kg.map_or(before, |load_kg| {
            running.kinds.kind(&drone.vehicle, bare_kg + load_kg)
        }));
    }
    let last = vertices[vertices.len() - 1];
    let last_m: Point3<f64> = roadmap.position_m(last);
    let ending = ending_from(&running.world, &running.solids, &drone, last_m);
    let duties = Duties {
        roadmap,
        tasks,
        vertices: &vertices,
        clearance_m: running.world.planning.clearance_m,
    };
    // Checked before for the last task; above whatever it passes now it may have to stay.
    let ending = ending.unwrap_or(Ending::Hover);
    let mut errand = errand_of(id(index), &drone, &duties, kinds, ending);
    errand.chain(roadmap);
    errand
}
