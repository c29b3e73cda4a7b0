//! From paths to the plan that is written down.

use std::collections::BTreeSet;

use costmap::leg::{Leg, Tick};
use nalgebra::Point3;

use crate::graph::agent::{Agent, Ending, Waypoint};
use crate::graph::distances::UNREACHABLE;
use crate::plan::file::{TIME_S, arrival_s};
use crate::plan::trajectory::{SAME_PLACE_M, SAME_TIME_S};
use crate::plan::{AtEnd, AtStart, DronePlan, Fleet, Plan, TrajectoryEntry};
use crate::scenario::solid::TOUCHING_M;
use crate::scenario::world::{Drone, World};
use crate::solver::prepare::Job;
use crate::solver::priority::Paths;

/// A plan of these paths, not yet judged: no violations, no air met.
pub(crate) fn assemble(world: &World, job: &Job, paths: &Paths) -> Plan {
    let drones = (0..world.drones.len()).map(|index| drone_plan(world, job, paths, index));
    let drones: Vec<DronePlan> = drones.collect();
    let names =
        (paths.unplanned.iter()).map(|(drone, _)| world.drones[drone.0 as usize].name.as_str());
    let unplanned: BTreeSet<&str> = names.collect();
    let fleet = fleet(&drones, |drone| !unplanned.contains(drone.name.as_str()));
    Plan {
        fleet,
        ..world.plan_of(drones)
    }
}

/// Sums over the drones that are planned, before their air is known.
pub(crate) fn fleet(drones: &[DronePlan], is_planned: impl Fn(&DronePlan) -> bool) -> Fleet {
    let planned = || drones.iter().filter(|drone| is_planned(drone));
    Fleet {
        makespan_s: planned().map(|drone| drone.arrives_s).fold(0.0, f64::max),
        sum_of_arrivals_s: rounded(planned().map(|drone| drone.arrives_s).sum()),
        sum_alone_s: rounded(planned().map(|drone| drone.alone_s).sum()),
        extra_energy_j: 0.0,
    }
}

/// One drone's part of the plan; without a path it stays at its start.
fn drone_plan(world: &World, job: &Job, paths: &Paths, index: usize) -> DronePlan {
    let (drone, agent) = (&world.drones[index], &job.agents[index]);
    let path = paths.paths[index].as_ref();
    let stays = [agent.stays_at_start(&job.roadmap)];
    let legs = path.map_or(&stays[..], |path| &path.legs);
    let mut entry = blank(world, drone);
    write_legs(&mut entry, agent, legs, |leg| job.kinds.mass_kg(leg.kind));
    if legs.is_empty() {
        entry.trajectory = TrajectoryEntry {
            t_s: vec![0.0],
            position_m: vec![job.roadmap.position_m(agent.start)],
            mass_kg: vec![job.kinds.mass_kg(agent.kinds[0])],
            ..TrajectoryEntry::default()
        };
    }
    let arrives = path.map_or(Tick(0), |path| path.arrives);
    write_arrival(&mut entry, legs, agent, arrives);
    // A drone that stays at its start neither lands nor leaves.
    entry.at_end = match (path, drone.at_start) {
        (Some(_), _) => drone.at_end,
        (None, AtStart::Landed) => AtEnd::Land,
        (None, AtStart::Hover) => AtEnd::Hover,
    };
    entry
}

/// Writes down where a drone is when, and when its wake is on; `mass_kg` says what a leg weighs
/// (kg).
pub(crate) fn write_legs(
    entry: &mut DronePlan,
    agent: &Agent,
    legs: &[Leg],
    mass_kg: impl Fn(&Leg) -> f64,
) {
    let path = break_points(legs, lands_from(agent, legs), mass_kg);
    let before = std::mem::take(&mut entry.trajectory);
    entry.trajectory = match &agent.smoothing {
        // A path that begins in motion cannot be flown: said to be smooth, it fails the verifier.
        Some(smoothing) => smoothing.kernel.smooth(&path).unwrap_or(TrajectoryEntry {
            control_m: vec![Vec::new(); path.t_s.len().saturating_sub(1)],
            ..path
        }),
        None => path,
    };
    keep_known(&mut entry.trajectory, &before);
    let flown = agent.flown(legs);
    let flying = || flown.iter().filter(|leg| leg.flying);
    let finite = |tick: Tick| (tick != Tick::FOREVER).then(|| tick.seconds());
    // From the first flight to the end of the last, and what lies between two.
    let legs = || flown.iter();
    let last = legs().rposition(|leg| leg.flying).unwrap_or(0);
    let between = legs().take(last).skip_while(|leg| !leg.flying);
    entry.landed_s.clear();
    for leg in between.filter(|leg| !leg.flying) {
        let (from_s, until_s) = (leg.start.seconds(), leg.end.seconds());
        match entry.landed_s.last_mut() {
            Some(rest) if rest.1 == from_s => rest.1 = until_s,
            _ => entry.landed_s.push((from_s, until_s)),
        }
    }
    entry.airborne_s = match (flying().next(), flying().next_back()) {
        (Some(first), Some(last)) => (first.start.seconds(), finite(last.end)),
        _ => {
            let begins_s = entry.enters_s.unwrap_or(0.0);
            (begins_s, Some(begins_s))
        }
    };
}

/// Keeps how a trajectory was written where it is as before: smoothed as part of another path, or
/// without what was flown first, it differs in its last digits.
fn keep_known(trajectory: &mut TrajectoryEntry, before: &TrajectoryEntry) {
    let is_near = |(a, b): (&Point3<f64>, &Point3<f64>)| (a - b).norm() < TOUCHING_M;
    let mut last: Option<usize> = None;
    for new in 0..trajectory.t_s.len() {
        let (t_s, at_m) = (trajectory.t_s[new], trajectory.position_m[new]);
        let old = before.t_s.partition_point(|it| *it <= t_s - SAME_TIME_S);
        let known = before.t_s.get(old).zip(before.position_m.get(old));
        let known =
            known.filter(|(it, known_m)| *it - t_s < SAME_TIME_S && is_near((known_m, &at_m)));
        let goes_on = known.is_some() && last.is_some_and(|last| last + 1 == old);
        last = known.map(|_| old);
        if let Some((&known_s, &known_m)) = known {
            (trajectory.t_s[new], trajectory.position_m[new]) = (known_s, known_m);
        }
        if goes_on
            && let Some(bends) = trajectory.control_m.get_mut(new - 1)
            && let Some(known) = before.control_m.get(old - 1)
            && known.len() == bends.len()
            && known.iter().zip(&*bends).all(is_near)
        {
            bends.clone_from(known);
        }
    }
}

/// Writes down how an agent goes from its departure on: when it arrives, and what the others cost
/// it.
pub(crate) fn write_arrival(entry: &mut DronePlan, legs: &[Leg], agent: &Agent, arrives: Tick) {
    let lower_bound = agent.lower_bound_ticks;
    // It sinks as late as its motion takes to begin, which is no whole number of ticks.
    let sinks_later_s = match (&agent.smoothing, agent.ending) {
        (Some(it), Ending::Land { .. }) if legs.iter().any(|leg| leg.flying) => {
            Tick(it.lead_ticks()).seconds() - it.kernel.half_s()
        }
        _ => 0.0,
    };
    entry.arrives_s = rounded(arrives.seconds() + sinks_later_s);
    stay_until(&mut entry.trajectory, entry.arrives_s);
    let there = agent.departs.after(lower_bound);
    entry.alone_s = match lower_bound {
        UNREACHABLE => 0.0,
        // The path alone was found by another search, and need not be shorter.
        _ if arrives > agent.departs => there.min(arrives).seconds(),
        _ => there.seconds(),
    };
    let ahead = |leg: &&Leg| leg.start >= agent.departs && leg.start < arrives;
    // Where it hovers already it may wait from its departure on.
    let ahead_of = |leg: &Leg| {
        leg.end
            .min(arrives)
            .0
            .saturating_sub(leg.start.max(agent.departs).0)
    };
    let still: u32 = legs.iter().filter(|leg| leg.stays()).map(ahead_of).sum();
    let dwells = agent.waypoints.iter().map(Waypoint::stay_ticks);
    let flown = legs.iter().filter(ahead);
    let flown_m: f64 = flown.map(|leg| (leg.to_m - leg.from_m).norm()).sum();
    let dwells: u32 = dwells.sum();
    // Before it first moves it stands for as long as its motion takes to begin.
    let still = still.saturating_sub(dwells.saturating_add(agent.lead_ticks()));
    // In place before an appointment, a drone is no later for it.
    let is_timed = lower_bound != UNREACHABLE && agent.waypoints.iter().any(Waypoint::is_timed);
    let later = is_timed.then(|| arrives.0.saturating_sub(there.0));
    entry.waits_s = Tick(later.map_or(still, |it| still.min(it))).seconds();
    entry.detour_m = rounded((flown_m - agent.lower_bound_m).max(0.0));
}

/// Lets a drone's trajectory last until it arrives as stated, which is at a break point then.
pub(crate) fn stay_until_arrival(entry: &mut DronePlan) {
    stay_until(&mut entry.trajectory, entry.arrives_s);
    entry.arrives_s = arrival_s(entry, Some(entry.arrives_s));
}

/// Lets a trajectory last until the end of its last dwell (s), and have a break point there where
/// it stands on.
fn stay_until(entry: &mut TrajectoryEntry, arrives_s: f64) {
    let last = entry
        .t_s
        .last()
        .zip(entry.position_m.last().zip(entry.mass_kg.last()));
    if let Some((&last_s, (&last_m, &last_kg))) = last
        && last_s < arrives_s
    {
        if entry.is_smooth() {
            entry.control_m.push(Vec::new());
        }
        entry.t_s.push(arrives_s);
        entry.position_m.push(last_m);
        entry.mass_kg.push(last_kg);
        return;
    }
    let next = entry.t_s.partition_point(|at_s| *at_s <= arrives_s);
    let Some(before) = next.checked_sub(1).filter(|_| next < entry.t_s.len()) else {
        return;
    };
    let stands_m = entry.position_m[before];
    let stands = (entry.position_m[next] - stands_m).norm() <= SAME_PLACE_M
        && entry.control_m.get(before).is_none_or(Vec::is_empty);
    let is_apart = |k: usize| (entry.t_s[k] - arrives_s).abs() > TIME_S;
    if stands && is_apart(before) && is_apart(next) {
        if entry.is_smooth() {
            entry.control_m.insert(next, Vec::new());
        }
        entry.t_s.insert(next, arrives_s);
        entry.position_m.insert(next, stands_m);
        let mass_kg = entry.mass_kg[before];
        entry.mass_kg.insert(next, mass_kg);
    }
}

/// One drone's part of the plan before anything is known of its flight.
pub(crate) fn blank(world: &World, drone: &Drone) -> DronePlan {
    DronePlan {
        name: drone.name.clone(),
        airframe: drone.vehicle.entry(world.air.density_kg_per_m3()),
        air_limit: drone.air_limit,
        at_start: drone.at_start,
        ..DronePlan::default()
    }
}

/// When a drone that lands has arrived where its last task is, and begins to sink.
fn lands_from(agent: &Agent, legs: &[Leg]) -> Option<Tick> {
    let Ending::Land { ticks, .. } = agent.ending else {
        return None;
    };
    let touches_down = legs.iter().rfind(|leg| leg.flying)?.end;
    Some(touches_down.before(ticks[0] + ticks[1]))
}

/// Legs back to back as break points; there is one where it arrives, if it goes on from there.
fn break_points(
    legs: &[Leg],
    arrives: Option<Tick>,
    mass_kg: impl Fn(&Leg) -> f64,
) -> TrajectoryEntry {
    let mut entry = TrajectoryEntry::default();
    let mut push = |at: Tick, position_m: Point3<f64>, mass_kg: f64| {
        entry.t_s.push(at.seconds());
        entry.position_m.push(position_m);
        entry.mass_kg.push(mass_kg);
    };
    let mut previous: Option<&Leg> = None;
    for leg in legs {
        // One straight flight at one speed is one piece, however many cells it crosses.
        let goes_on = previous.is_some_and(|last| {
            last.kind == leg.kind
                && !leg.stays()
                && arrives != Some(leg.start)
                && (last.velocity_mps() - leg.velocity_mps()).norm() < 1e-9
        });
        if !goes_on {
            push(leg.start, leg.from_m, mass_kg(leg));
        }
        previous = Some(leg);
    }
    if let Some(last) = previous
        && last.end != Tick::FOREVER
    {
        push(last.end, last.to_m, mass_kg(last));
    }
    entry
}

/// Sums of ticks and lengths, without the digits that only adding made.
pub(crate) fn rounded(value: f64) -> f64 {
    // Without the sign of what is zero.
    (value * 1e6).round() / 1e6 + 0.0
}
