//! One turn of a running plan: the changes are applied, those affected planned, and the plan written on.

use std::collections::{BTreeMap, BTreeSet};

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, Leg, Tick};
use costmap::reservations::timeline::BUCKET_TICKS;
use costmap::verdict::{Blocker, Verdict};

use super::apply::{apply, renew_distances};
use super::outcome::write;
use super::track::{State, Track};
use super::{Cause, Change, Replanned, Running, id};
use crate::graph::agent::{Errand, FORGIVEN_TICKS};
use crate::graph::roadmap::Roadmap;
use crate::plan::Unplanned;
use crate::plan::outcome::{Control, Effort};
use crate::scenario::world::Task;
use crate::solver::explain::known_cause;
use crate::solver::priority::{Affected, Paths, plan_affected, stays_at_start};

/// Names, and when each could be made to do something else.
pub(super) type Released = Vec<(String, Tick)>;

/// What is remembered of a drone until it is known whether its change can be.
pub(super) struct Asked {
    pub(super) cause: Cause,
    /// As it was, if it goes on with that when there is no way.
    pub(super) before: Option<(Track, Vec<Task>)>,
    /// No way is looked for: what it flies is settled.
    pub(super) settled: bool,
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
        if asked.contains_key(&index) {
            errand.measure_alone(&running.job.roadmap);
        } else {
            // Of those who are not asked hardly any is planned anew: measured then.
            errand.alone_ticks = 0;
        }
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
            let gives_way = |it: &Blocker| {
                let other = it.drone.0 as usize;
                it.clear > under_way[other] && !kept[other].is_empty()
            };
            let errand = &mut running.job.errands[index];
            errand.forgiven = in_its_way(&running.costmap, errand, &running.job.roadmap, gives_way);
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
        .zip(&running.job.errands)
        .map(|((tick, drone), errand)| {
            let out = if errand.forgiven.is_empty() {
                0
            } else {
                FORGIVEN_TICKS
            };
            (drone.name.clone(), tick.after(out))
        })
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
            .unplanned
            .iter()
            .filter(|(drone, _)| outside(drone.0 as usize));
        let turned_away: Vec<Unplanned> = turned_away
            .map(|(drone, why)| Unplanned {
                name: running.world.drones[drone.0 as usize].name.clone(),
                reason: format!("{}; it is not let in", known_cause(&running.world, *why)),
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

/// Who has found no way, and would run into others if it went on as it is to: late, or as it had to.
fn clashing(
    asked: &BTreeMap<usize, Asked>,
    paths: &Paths,
    under_way: &[Tick],
    stopped: &BTreeSet<usize>,
) -> Vec<usize> {
    let mut verdict = Verdict::default();
    let unplanned = paths.unplanned.iter().map(|(drone, _)| drone.0 as usize);
    let can_stop = |index: &usize| {
        let is_settled = asked.get(index).is_some_and(|it| it.settled);
        !is_settled && !stopped.contains(index)
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
    let mut found: Vec<usize> = unplanned.filter(can_stop).collect();
    found.retain(|index| clashes(index));
    found
}

/// Who is in the way of a late drone where it can do something else first, and does not give way: it has to
/// get away from them first.
fn in_its_way(
    costmap: &Costmap,
    errand: &Errand,
    roadmap: &Roadmap,
    gives_way: impl Fn(&Blocker) -> bool,
) -> Vec<DroneId> {
    let now = Leg {
        start: errand.departs,
        end: errand.departs.after(BUCKET_TICKS),
        ..stays_at_start(errand, roadmap)
    };
    let mut verdict = Verdict::default();
    costmap.judge(&now, &mut verdict);
    let firm = verdict
        .blockers
        .iter()
        .filter(|blocker| !gives_way(blocker));
    let mut found: Vec<DroneId> = firm.map(|blocker| blocker.drone).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// What a drone flies that stops where it can.
fn stops(errand: &Errand, roadmap: &Roadmap) -> Vec<Leg> {
    let stay = Leg {
        start: errand.departs,
        ..stays_at_start(errand, roadmap)
    };
    errand.begun.iter().copied().chain([stay]).collect()
}
