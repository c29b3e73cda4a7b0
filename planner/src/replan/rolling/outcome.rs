//! What was found, written into tracks and plan.

use std::collections::{BTreeMap, BTreeSet};

use super::splice::{at_end, write_errand, write_legs};
use super::turn::Asked;
use super::{Cause, Changed, Running, id};
use crate::plan::{AtEnd, Unplanned};
use crate::solver::explain::known_cause;
use crate::solver::priority::Paths;

/// Writes what was found into tracks and plan: who has changed, and for whom there is no way.
pub(super) fn write(
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
        let left_out = paths
            .unplanned
            .iter()
            .find(|(drone, _)| *drone == id(index));
        let stops = left_out.is_some() && stopped.contains(&index);
        match (path, cause) {
            (Some(path), _) => {
                let job = &mut running.job;
                let errand = &mut job.errands[index];
                if cause.is_none() {
                    errand.measure_alone(&job.roadmap);
                }
                let errand = &job.errands[index];
                if path.legs.is_empty() {
                    track.cut(errand.departs);
                } else {
                    track.go_on(&path.legs);
                }
                write_legs(entry, &track.legs, &running.kinds);
                write_errand(entry, track, errand, path.arrives);
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
            (None, None) if !stops => continue,
            (None, cause) => {
                let before = asked.get(&index).and_then(|asked| asked.before.as_ref());
                let before = before.filter(|_| cause == Some(Cause::Retasked));
                if let Some((before, tasks)) = before {
                    *track = before.clone();
                    running.world.drones[index].tasks.clone_from(tasks);
                }
                if stops || before.is_none() {
                    track.go_on(running.costmap.legs(id(index)));
                    write_legs(entry, &track.legs, &running.kinds);
                }
                if let Some((_, why)) = left_out {
                    let reason = known_cause(&running.world, *why);
                    let out = Unplanned {
                        name: name.clone(),
                        reason: format!("{reason}; {}", instead(cause, stops)),
                    };
                    if stops {
                        track.planned = false;
                        entry.arrives_s = running.job.errands[index].departs.seconds();
                        let flying = track.legs.last().is_some_and(|leg| leg.flying);
                        entry.at_end = if flying { AtEnd::Hover } else { AtEnd::Land };
                        running.plan.unplanned.push(out.clone());
                    }
                    refused.push(out);
                }
                if cause == Some(Cause::Retasked) && !stops {
                    continue;
                }
            }
        }
        changed.push(Changed {
            drone: name,
            cause: cause.unwrap_or(Cause::GaveWay),
        });
    }
    (changed, refused)
}

fn instead(cause: Option<Cause>, stops: bool) -> &'static str {
    match cause {
        _ if stops => "it stops at the next place on its way",
        Some(Cause::Late) => "it follows its plan as late as it is",
        _ => "it goes on with what it had to do",
    }
}
