//! One turn of a running plan: the changes are applied, those affected planned, and the plan written on.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use costmap::costmap::Costmap;
use costmap::leg::{KindId, Leg, Tick};
use costmap::verdict::{Blocker, Verdict};
use nalgebra::Point3;

use super::splice::{at_end, blank, write_errand, write_legs};
use super::track::{State, Track};
use super::{Cause, Change, Changed, Replanned, Running, id};
use crate::assemble::rounded;
use crate::distances::{Distances, Mover, UNREACHABLE};
use crate::errand::{Ending, Errand, Stage};
use crate::outcome::{Control, Effort};
use crate::plan::{AtEnd, Unplanned};
use crate::prepare::{ending_from, with_lifts};
use crate::priority::{Affected, Paths, Stranded, plan_affected, stays_at_start};
use crate::reason::obstruction;
use crate::roadmap::{Roadmap, Stop, Vertex};
use crate::world::{AtStart, Drone, Task, World};

/// Names, and when each could be made to do something else.
pub(super) type Released = Vec<(String, Tick)>;

/// What is remembered of a drone until it is known whether its change can be.
struct Asked {
    cause: Cause,
    /// As it was, if it goes on with that when there is no way.
    before: Option<(Track, Vec<Task>)>,
    /// No way is looked for: what it flies is settled.
    settled: bool,
}

/// Applies the changes, which are in order, and plans those affected. Who comes and finds no way is not
/// let in: the others are planned without it.
pub(super) fn take(
    running: &mut Running,
    at: Tick,
    changes: &[Change],
    control: &Control<'_>,
) -> (Replanned, Released) {
    let comes = |change: &Change| matches!(change, Change::Added(_));
    let mut changes = changes.to_vec();
    let mut turned_away = Vec::new();
    loop {
        let before = changes.iter().any(comes).then(|| {
            (
                running.world.clone(),
                running.plan.clone(),
                running.tracks.clone(),
            )
        });
        match turn(running, at, &changes, control) {
            Ok((mut told, released)) => {
                told.refused.extend(turned_away);
                return (told, released);
            }
            Err(refused) => {
                changes.retain(|change| {
                    !(comes(change) && refused.iter().any(|out| out.name == change.drone()))
                });
                turned_away.extend(refused);
                if let Some((world, plan, tracks)) = before {
                    running.world = world;
                    running.plan = plan;
                    running.tracks = tracks;
                    renew_distances(running);
                }
            }
        }
    }
}

/// One try; an error names those who come and find no way.
fn turn(
    running: &mut Running,
    at: Tick,
    changes: &[Change],
    control: &Control<'_>,
) -> Result<(Replanned, Released), Vec<Unplanned>> {
    let kinds_before = running.kinds.kinds.len();
    let conditions_before = *running.costmap.fleet().conditions();
    let mut asked: BTreeMap<usize, Asked> = BTreeMap::new();
    for change in changes {
        apply(running, at, change, &mut asked);
    }
    let limits = running.world.drones.iter().map(|drone| drone.air_limit);
    let speeds = running
        .world
        .drones
        .iter()
        .map(|drone| drone.vehicle.max_speed_mps);
    let outgrown = running.kinds.kinds.len() > kinds_before
        || running.tracks.len() > running.costmap.drone_count()
        || limits.fold(f64::INFINITY, f64::min) < conditions_before.lowest_air_limit
        || speeds.fold(0.0, f64::max) > conditions_before.fastest_mps;
    if outgrown {
        running.fill_costmap();
    }

    let states: Vec<State> = running
        .tracks
        .iter()
        .map(|track| track.state(&running.job.roadmap, at, false))
        .collect();
    let mut kept: Vec<Vec<Leg>> = Vec::with_capacity(states.len());
    let mut under_way = Vec::with_capacity(states.len());
    running.job.errands.clear();
    for (index, (track, state)) in running.tracks.iter().zip(states).enumerate() {
        let told = asked.get_mut(&index).filter(|asked| !asked.settled);
        let ready = match told {
            Some(Asked {
                cause: Cause::Added | Cause::Retasked,
                ..
            }) => Some(track.errand.clone()),
            told => {
                let ready = ready(running, track, state);
                if let Some(late) = told {
                    late.settled = ready.is_none();
                }
                ready
            }
        };
        kept.push(ready.as_ref().map_or_else(Vec::new, |_| track.rest(at)));
        let mut errand = ready.unwrap_or_else(|| Errand {
            begun: Vec::new(),
            ..track.errand.clone()
        });
        errand.alone_ticks = errand.alone(&running.job.roadmap);
        under_way.push(errand.departs.max(at));
        running.job.errands.push(errand);
    }
    let mut group = Vec::new();
    let mut settled = Vec::new();
    for (&index, asked) in &asked {
        if asked.cause == Cause::Removed {
            continue;
        }
        if let Some((before, _)) = &asked.before {
            kept[index] = before.rest(at);
        }
        if asked.cause == Cause::Added {
            kept[index].clear();
        }
        if asked.cause == Cause::Late && !asked.settled {
            let errand = &mut running.job.errands[index];
            fly_out_of_conflict(&running.costmap, errand, &kept[index], &mut under_way);
            let start = running.tracks[index].vertex_at(&running.job.roadmap, &last_m(errand));
            errand.start = start.unwrap_or(errand.start);
        }
        if asked.settled {
            kept[index] = running.tracks[index].rest(at);
            settled.push(id(index));
        } else {
            group.push(id(index));
        }
    }
    let released = under_way
        .iter()
        .zip(&running.world.drones)
        .map(|(tick, drone)| (drone.name.clone(), *tick))
        .collect();
    let mut effort = Effort::default();
    let mut affected = Affected {
        group: &group,
        settled: &settled,
        costmap: running.costmap.clone(),
        under_way,
        kept,
    };
    let weight = running.world.planning.energy_weight;
    let mut stopped = BTreeSet::new();
    let paths = loop {
        let paths = plan_affected(&running.job, affected.clone(), weight, control, &mut effort);
        let outside = |index: usize| asked.get(&index).is_some_and(|it| it.cause == Cause::Added);
        let turned_away = paths
            .stranded
            .iter()
            .filter(|(drone, _)| outside(drone.0 as usize));
        let turned_away: Vec<Unplanned> = turned_away
            .map(|(drone, why)| Unplanned {
                name: running.world.drones[drone.0 as usize].name.clone(),
                reason: format!("{}; it is not let in", words(&running.world, *why)),
            })
            .collect();
        if !turned_away.is_empty() {
            return Err(turned_away);
        }
        let stuck = clashing(&asked, &paths, &affected.under_way, &stopped);
        if stuck.is_empty() {
            break paths;
        }
        for index in stuck {
            affected.kept[index] = stops(&running.job.errands[index], &running.job.roadmap);
            stopped.insert(index);
        }
    };
    let (changed, refused) = write(running, &asked, &stopped, paths);
    let told = Replanned {
        changed,
        refused,
        unavoidable: Vec::new(),
        effort,
    };
    Ok((told, released))
}

/// What a drone that can be planned anew has to do from where it can.
fn ready(running: &Running, track: &Track, state: State) -> Option<Errand> {
    let State::Flies {
        done,
        begun,
        departs,
        at_m,
        grounded,
    } = state
    else {
        return None;
    };
    let start = track.vertex_at(&running.job.roadmap, &at_m)?;
    // Whoever has nothing left to do but to end cannot do that otherwise.
    (done < track.errand.stages.len()).then(|| Errand {
        start,
        departs,
        begun,
        grounded,
        ..track.errand_after(done)
    })
}

/// Who is late, has found no way, and would run into others if it followed its plan.
fn clashing(
    asked: &BTreeMap<usize, Asked>,
    paths: &Paths,
    under_way: &[Tick],
    stopped: &BTreeSet<usize>,
) -> Vec<usize> {
    let mut verdict = Verdict::default();
    let stranded = paths.stranded.iter().map(|(drone, _)| drone.0 as usize);
    let late = |index: &usize| {
        asked.get(index).is_some_and(|it| it.cause == Cause::Late) && !stopped.contains(index)
    };
    let mut clashes = |index: &usize| {
        let ahead = |leg: &&Leg| leg.end > under_way[*index];
        paths
            .costmap
            .legs(id(*index))
            .iter()
            .filter(ahead)
            .any(|leg| {
                paths.costmap.judge(leg, &mut verdict);
                let met = |it: &Blocker| it.clear > under_way[it.drone.0 as usize];
                verdict.blockers.iter().any(met)
            })
    };
    let mut found: Vec<usize> = stranded.filter(late).collect();
    found.retain(|index| clashes(index));
    found
}

/// A late drone that is in conflict with what others fly already follows its plan until that is over:
/// nothing else would be better.
fn fly_out_of_conflict(
    costmap: &Costmap,
    errand: &mut Errand,
    ahead: &[Leg],
    under_way: &mut [Tick],
) {
    let mut verdict = Verdict::default();
    let first = errand.departs;
    for leg in ahead.iter().filter(|leg| leg.start >= first) {
        let now = Leg {
            start: errand.departs,
            end: errand.departs.after(1),
            from_m: leg.from_m,
            to_m: leg.from_m,
            ..*leg
        };
        costmap.judge(&now, &mut verdict);
        let flown = |it: &Blocker| it.clear <= under_way[it.drone.0 as usize];
        if leg.stays() || leg.kind != errand.kinds[0] || !verdict.blockers.iter().any(flown) {
            return;
        }
        errand.begun.push(*leg);
        errand.departs = leg.end;
        under_way[errand.drone.0 as usize] = leg.end;
    }
}

/// Where a drone is when it can do something else (m), if it flies until then.
fn last_m(errand: &Errand) -> Point3<f64> {
    let far = Point3::new(f64::NAN, f64::NAN, f64::NAN);
    errand.begun.last().map_or(far, |leg| leg.to_m)
}

/// What a drone flies that stops where it can.
fn stops(errand: &Errand, roadmap: &Roadmap) -> Vec<Leg> {
    let stay = Leg {
        start: errand.departs,
        ..stays_at_start(errand, roadmap)
    };
    errand.begun.iter().copied().chain([stay]).collect()
}

fn apply(running: &mut Running, at: Tick, change: &Change, asked: &mut BTreeMap<usize, Asked>) {
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
fn renew_distances(running: &mut Running) {
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
    let mover = Mover::new(
        roadmap.lattice(),
        drone.vehicle.max_speed_mps,
        radius_m,
        with_lifts(roadmap, &vertices),
    );
    let stages = tasks
        .iter()
        .zip(vertices.windows(2))
        .map(|(task, way)| Stage {
            distances: Arc::new(Distances::new(roadmap, way[1], way[0], mover.clone())),
            dwell_ticks: Tick::lasting(task.dwell_s),
            rest_ticks: 0,
        });
    let stages = stages.collect();
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
    let mut errand = Errand {
        drone: id(index),
        start,
        departs: Tick(0),
        begun: Vec::new(),
        grounded: false,
        stages,
        kinds,
        // Checked before for the last task; above whatever it passes now it may have to stay.
        ending: ending.unwrap_or(Ending::Hover),
        mover,
        air_limit: drone.air_limit,
        alone_ticks: UNREACHABLE,
    };
    errand.chain(roadmap);
    errand
}

/// Writes what was found into tracks and plan: who has changed, and for whom there is no way.
fn write(
    running: &mut Running,
    asked: &BTreeMap<usize, Asked>,
    stopped: &BTreeSet<usize>,
    mut paths: Paths,
) -> (Vec<Changed>, Vec<Unplanned>) {
    let mut changed = Vec::new();
    let mut refused = Vec::new();
    running.costmap = paths.costmap;
    for index in 0..running.tracks.len() {
        let path = paths.paths.get_mut(index).and_then(Option::take);
        let cause = asked.get(&index).map(|asked| asked.cause);
        let name = running.world.drones[index].name.clone();
        let entry = &mut running.plan.drones[index];
        let track = &mut running.tracks[index];
        let left_out = paths.stranded.iter().find(|(drone, _)| *drone == id(index));
        match (path, cause) {
            (Some(path), _) => {
                let errand = &running.job.errands[index];
                if path.legs.is_empty() {
                    track.cut(errand.departs);
                } else {
                    track.go_on(&path.legs);
                }
                write_legs(entry, &track.legs, &running.kinds);
                write_errand(entry, &running.job.roadmap, track, errand, path.arrives);
                entry.at_end = at_end(&running.world.drones[index]);
                running.plan.unplanned.retain(|one| one.name != name);
            }
            (None, Some(Cause::Removed)) => {
                if track.legs.is_empty() {
                    // Gone before it began.
                    entry.trajectory.t_s.truncate(1);
                    entry.trajectory.position_m.truncate(1);
                    entry.trajectory.mass_kg.truncate(1);
                    entry.airborne_s = (0.0, Some(0.0));
                } else {
                    write_legs(entry, &track.legs, &running.kinds);
                }
                entry.at_end = AtEnd::Leave;
                entry.arrives_s = entry.arrives_s.min(running.known.seconds());
                running.plan.unplanned.retain(|one| one.name != name);
            }
            (None, Some(cause)) => {
                let why = left_out.map(|(_, why)| *why);
                if let (Cause::Retasked, Some((before, tasks))) = (cause, &asked[&index].before) {
                    *track = before.clone();
                    running.world.drones[index].tasks.clone_from(tasks);
                } else {
                    track.go_on(running.costmap.legs(id(index)));
                    write_legs(entry, &track.legs, &running.kinds);
                }
                if let Some(why) = why {
                    let reason = words(&running.world, why);
                    let reason = format!("{reason}; {}", instead(cause, stopped.contains(&index)));
                    let out = Unplanned {
                        name: name.clone(),
                        reason,
                    };
                    if stopped.contains(&index) {
                        track.planned = false;
                        entry.arrives_s = running.job.errands[index].departs.seconds();
                        let flying = track.legs.last().is_some_and(|leg| leg.flying);
                        entry.at_end = if flying { AtEnd::Hover } else { AtEnd::Land };
                        running.plan.unplanned.push(out.clone());
                    }
                    refused.push(out);
                }
                if cause == Cause::Retasked {
                    continue;
                }
            }
            (None, None) => continue,
        }
        changed.push(Changed {
            drone: name,
            cause: cause.unwrap_or(Cause::GaveWay),
        });
    }
    (changed, refused)
}

fn instead(cause: Cause, stops: bool) -> &'static str {
    match cause {
        Cause::Late if stops => "it stops at the next place on its way",
        Cause::Late => "it follows its plan as late as it is",
        _ => "it goes on with what it had to do",
    }
}

pub(crate) fn words(world: &World, why: Stranded) -> String {
    match why {
        Stranded::NoWay => {
            "there is no way through free space to one of its tasks that its body fits through"
                .to_owned()
        }
        Stranded::Obstructed(Some(by)) | Stranded::Zone(by) => obstruction(world, &by),
        Stranded::Stopped => "planning was stopped before its turn".to_owned(),
        Stranded::EndpointConflict | Stranded::Landing(_) | Stranded::Obstructed(None) => {
            "it and others kept taking each other's way".to_owned()
        }
    }
}
