//! Why a drone stays at its start: what is in its way, where and when, and what would help.

use std::collections::BTreeMap;

use costmap::assess::Worst;
use costmap::costmap::Costmap;
use costmap::leg::{DroneId, Leg};
use costmap::verdict::Why;
use nalgebra::Point3;

use crate::graph::distances::UNREACHABLE;
use crate::plan::cause::{
    Exposure, FailureCause, GoalConflict, Hindrance, HindranceKind, MissingPath, Remedy,
};
use crate::plan::outcome::{Blocker, Control, EndpointKind, Failure};
use crate::plan::{Plan, Violation, ViolationKind};
use crate::scenario::world::World;
use crate::sipp::search::{Found, IMMOVABLE, Obstruction, Obstructor, Setting, search};
use crate::solver::assemble::assemble;
use crate::solver::density;
use crate::solver::endpoints::Exclusions;
use crate::solver::prepare::Job;
use crate::solver::priority::{FailureKind, Paths, plan_group};
use crate::verify::verify;

/// From this share of columns held on a crowd is named as a reason: chosen here, a quarter of them
/// costs a hall of a thousand drones seconds to plan, a half of them more than a minute.
const CROWDED_SHARE: f64 = 0.25;
/// For how many groups the gentlest pass is looked for: chosen here, some dozens of searches each.
const MOST_PASSES: usize = 3;
/// Groups larger than this are not looked at as one: chosen here.
const LARGEST_GROUP: usize = 6;
/// Limits are raised at most this many times: chosen here, well past any flyable air.
const HIGHEST_RAISE: f64 = 8.0;
/// States of a search for a pass: chosen here, a second of work.
const MOST_EXPANSIONS: u64 = 60_000;

/// One cause per drone without a path.
pub(crate) fn failures(
    world: &World,
    job: &Job,
    paths: &Paths,
    endpoints: &Exclusions,
    control: &Control<'_>,
) -> Vec<Failure> {
    let obstructed = |(_, why): &&(DroneId, FailureKind)| matches!(why, FailureKind::Obstructed(_));
    let stopped = paths.unplanned.iter().filter(obstructed);
    let stopped = stopped.map(|&(drone, _)| (drone, in_the_way(job, paths, drone, control)));
    let stopped: BTreeMap<DroneId, Option<Obstruction>> = stopped.collect();
    let groups = groups(&paths.unplanned, &stopped);
    let pass = |(index, group): (usize, &Vec<DroneId>)| {
        let small = index < MOST_PASSES && group.len() <= LARGEST_GROUP;
        small.then(|| gentlest_pass(world, job, paths, group, control))
    };
    let passes: Vec<Option<Remedy>> = groups.iter().enumerate().map(pass).collect();
    // How crowded the floor is, where that counts as a reason.
    let crowding = Some(density::of(job, &paths.costmap)).filter(|it| it.share() >= CROWDED_SHARE);
    let obstructed = |drone: DroneId| {
        let by = stopped.get(&drone).copied().flatten();
        let group = groups.iter().position(|group| group.contains(&drone));
        // Whose reason tells what the group could do.
        let mut drones = paths.unplanned.iter().map(|(drone, _)| *drone);
        let first = group.and_then(|group| drones.find(|drone| groups[group].contains(drone)));
        let remedy = match (group.and_then(|group| passes[group].as_ref()), first) {
            (Some(_), Some(first)) if first != drone => {
                Remedy::SameAs(name(world, first).to_owned())
            }
            (Some(pass), _) => pass.clone(),
            (None, _) => crowding.map_or(Remedy::Unknown, Remedy::LessCrowding),
        };
        FailureCause::Obstructed {
            by: by.map(|by| hindrance(world, &by)),
            remedy,
        }
    };
    let failures = paths.unplanned.iter().map(|&(drone, why)| Failure {
        drone: name(world, drone).to_owned(),
        cause: match why {
            FailureKind::NoPath => FailureCause::NoPath(missing_path(world, job, drone)),
            FailureKind::EndpointConflict => {
                FailureCause::GoalConflict(goal_conflict(world, endpoints, drone))
            }
            FailureKind::Stopped => FailureCause::Stopped(crowding),
            FailureKind::Obstructed(_) => obstructed(drone),
            FailureKind::Landing(_) | FailureKind::Zone(_) => known_cause(world, why),
        },
    });
    failures.collect()
}

/// The cause as far as it is known without looking for a remedy.
pub(crate) fn known_cause(world: &World, why: FailureKind) -> FailureCause {
    let obstructed = |by: Option<Obstruction>| FailureCause::Obstructed {
        by: by.map(|by| hindrance(world, &by)),
        remedy: Remedy::Unknown,
    };
    match why {
        FailureKind::NoPath => FailureCause::NoPath(None),
        FailureKind::EndpointConflict => FailureCause::GoalConflict(None),
        FailureKind::Landing(short_m) => FailureCause::NoRoomToLand { short_m },
        FailureKind::Obstructed(by) => obstructed(by),
        FailureKind::Zone(by) => obstructed(Some(by)),
        FailureKind::Stopped => FailureCause::Stopped(None),
    }
}

/// Unplanned drones with those in their way, each group ascending and a question of its own; no
/// drone is in two of them. `stopped` says by drone what stops it while every other keeps to its
/// plan.
fn groups(
    unplanned: &[(DroneId, FailureKind)],
    stopped: &BTreeMap<DroneId, Option<Obstruction>>,
) -> Vec<Vec<DroneId>> {
    let mut groups: Vec<Vec<DroneId>> = Vec::new();
    for (&drone, by) in stopped {
        // Whom no other order would help is no part of the question.
        let helps = |other: &DroneId| {
            stopped.contains_key(other) || unplanned.iter().all(|(drone, _)| drone != other)
        };
        let other = by.and_then(|by| match by.by {
            Obstructor::Drone(other, _) => Some(other).filter(helps),
            Obstructor::Zone(_) => None,
        });
        let mut joined: Vec<DroneId> = std::iter::once(drone).chain(other).collect();
        let touches = |group: &mut Vec<DroneId>| group.iter().any(|it| joined.contains(it));
        let same: Vec<Vec<DroneId>> = groups.extract_if(.., touches).collect();
        joined.extend(same.into_iter().flatten());
        joined.sort_unstable();
        joined.dedup();
        groups.push(joined);
    }
    groups
}

/// What the scenario calls it.
fn name(world: &World, drone: DroneId) -> &str {
    &world.drones[drone.0 as usize].name
}

/// The first part of a drone's job that no path leads along; `None` where it has no task.
fn missing_path(world: &World, job: &Job, drone: DroneId) -> Option<MissingPath> {
    let agent = &job.agents[drone.0 as usize];
    let drone = &world.drones[drone.0 as usize];
    let mut from = agent.start;
    let mut to = 0;
    for (index, waypoint) in agent.waypoints.iter().enumerate() {
        to = index;
        if waypoint.distances.ticks(&job.roadmap, from) == UNREACHABLE {
            break;
        }
        from = waypoint.distances.goal();
    }
    Some(MissingPath {
        from_m: job.roadmap.position_m(from),
        task: to + 1,
        to_m: drone.tasks.get(to)?.to_m,
        body_radius_m: drone.vehicle.body_radius_m,
        clearance_m: world.planning.clearance_m,
        cell_m: world.planning.cell_m,
    })
}

/// The conflict of goals that a drone was dropped for, or is part of.
fn goal_conflict(world: &World, endpoints: &Exclusions, drone: DroneId) -> Option<GoalConflict> {
    let index = drone.0 as usize;
    let own = |of: usize, by: Blocker| of == index || by == Blocker::Drone(index);
    let mut goals = endpoints.goals.iter();
    let &(of, by, why) = goals.find(|&&(of, by, _)| own(of, by))?;
    let mut described = endpoints.conflicts.worst.iter();
    let described =
        described.find(|it| it.when == EndpointKind::Goals && (it.drone, it.blocker) == (of, by));
    Some(GoalConflict {
        drone: world.drones[of].name.clone(),
        with: match by {
            Blocker::Drone(other) => format!("`{}`", world.drones[other].name),
            Blocker::Zone(zone) => format!("zone `{}`", world.zones[zone].name),
        },
        why,
        nearest_fix_m: described.and_then(|it| it.nearest_fix_m),
    })
}

/// What is in the way, by the names of the scenario.
fn hindrance(world: &World, by: &Obstruction) -> Hindrance {
    let kind = match by.by {
        Obstructor::Zone(zone) => HindranceKind::Zone {
            zone: world.zones[zone].name.clone(),
            air_limit_mps: (world.zones[zone].air_limit_mps).unwrap_or(f64::INFINITY),
        },
        Obstructor::Drone(other, why) => {
            let other = name(world, other).to_owned();
            match why {
                Why::Bodies => HindranceKind::Body(other),
                Why::Column => HindranceKind::Column(other),
                Why::OwnLimit => HindranceKind::Downwash(other),
                Why::TheirLimit => HindranceKind::OwnDownwash(other),
                Why::Zone => HindranceKind::ZoneTogether(other),
            }
        }
    };
    Hindrance {
        kind,
        at_m: by.at_m,
        from_s: by.at.seconds(),
    }
}

/// What stops a drone if every other drone keeps to its plan.
fn in_the_way(
    job: &Job,
    paths: &Paths,
    drone: DroneId,
    control: &Control<'_>,
) -> Option<Obstruction> {
    let weights = vec![IMMOVABLE; job.agents.len()];
    let setting = Setting {
        most_expansions: MOST_EXPANSIONS,
        ..Setting::judged(&job.roadmap, &paths.costmap, &weights, control.stop)
    };
    match search(setting, &job.agents[drone.0 as usize]).found {
        Found::Blocked(by) => by,
        Found::Path(_) | Found::Stopped => None,
    }
}

/// The least raise of all limits that lets the whole group pass, found by bisection, and what it
/// means.
fn gentlest_pass(
    world: &World,
    job: &Job,
    paths: &Paths,
    group: &[DroneId],
    control: &Control<'_>,
) -> Remedy {
    let mut others = paths.costmap.clone();
    for &drone in group {
        others.remove(drone);
    }
    let raised = |times: f64| plan_group(job, &others.with_limits_raised(times), group, control);
    let Some(mut pass) = raised(HIGHEST_RAISE) else {
        return Remedy::NoneAtAnyLimit;
    };
    let (mut too_low, mut enough) = (1.0, HIGHEST_RAISE);
    while enough / too_low > 1.02 {
        let middle = f64::midpoint(too_low, enough);
        match raised(middle) {
            Some(found) => (pass, enough) = (found, middle),
            None => too_low = middle,
        }
    }
    if others.has_advected_wakes() {
        let mut with_pass = paths.clone();
        let is_left_out = |(drone, _): &(DroneId, FailureKind)| !group.contains(drone);
        with_pass.unplanned.retain(is_left_out);
        for path in pass {
            let drone = path.legs.first().map(|leg| leg.drone.0 as usize);
            if let Some(drone) = drone {
                with_pass.paths[drone] = Some(path);
            }
        }
        let plan = assemble(world, job, &with_pass);
        let mut violations = verify(&plan).violations;
        violations.retain(|violation| violation.kind == ViolationKind::Air);
        return raise_limits(violations.iter().map(|it| verified(&plan, it)).collect());
    }
    let mut costmap = others.with_limits_raised(enough);
    let flown: Vec<Leg> = pass.into_iter().flat_map(|path| path.legs).collect();
    for drone in group {
        let own = flown.iter().filter(|leg| leg.drone == *drone);
        costmap.insert(own.copied().collect());
    }
    // Those who pass, and those who meet their wakes.
    let near = flown.iter().flat_map(|leg| costmap.near(leg));
    let mut drones: Vec<DroneId> = near.map(|item| item.leg.drone).collect();
    drones.extend(group);
    drones.sort_unstable();
    drones.dedup();
    let assessed = drones.iter();
    let assessed = assessed.filter_map(|&drone| assessed_along(world, &costmap, drone));
    raise_limits(assessed.filter(|(over, _)| *over > 1.0).collect())
}

/// The worst of some exposures, each with its air over its limit, and all whose limits have to be
/// raised.
fn raise_limits(mut exposed: Vec<(f64, Exposure)>) -> Remedy {
    exposed.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let names = exposed.iter().map(|(_, it)| it.drone.clone());
    let mut drones: Vec<String> = names.collect();
    // As they are quoted.
    drones.sort_unstable_by_key(|name| format!("{name}`"));
    drones.dedup();
    let worst = exposed.into_iter().next();
    worst.map_or(Remedy::JustWithinLimits, |(_, worst)| {
        Remedy::RaiseLimits(Exposure { drones, ..worst })
    })
}

/// The worst air along the whole path of a drone, over its limit, and what the whole path costs;
/// `None` where it meets none.
fn assessed_along(world: &World, costmap: &Costmap, drone: DroneId) -> Option<(f64, Exposure)> {
    let mut worst: Option<(f64, Worst)> = None;
    let (mut axial_exposure_m, mut extra_energy_j) = (0.0, 0.0);
    for leg in costmap.legs(drone) {
        let assessment = costmap.assess(leg).ok()?;
        axial_exposure_m += assessment.own.axial_exposure_m;
        extra_energy_j += assessment.own.extra_energy_j;
        let here = assessment.worst.map(|it| (it.alpha / leg.air_limit, it));
        worst = match (worst, here) {
            (Some(known), Some(here)) if here.0 <= known.0 => Some(known),
            (known, here) => here.or(known),
        };
    }
    let (over, worst) = worst?;
    let exposure = Exposure {
        beside: Some(beside(name(world, worst.from), worst.from_m, worst.at_m)),
        whole: Some((axial_exposure_m, extra_energy_j)),
        ..exposure(name(world, drone), worst.at_m, worst.alpha)
    };
    Some((over, exposure))
}

/// The same of a violation where wakes are advected: as the verifier found it.
fn verified(plan: &Plan, violation: &Violation) -> (f64, Exposure) {
    let at_m = violation.position_m;
    let emitter = violation.with.as_ref().and_then(|with| {
        let other = plan.drones.iter().find(|other| other.name == *with)?;
        let from_m = other.trajectory.position_m(violation.from_s)?;
        Some(beside(with, from_m, at_m))
    });
    let exposure = Exposure {
        beside: emitter,
        ..exposure(&violation.drone, at_m, violation.value)
    };
    (violation.value / violation.limit, exposure)
}

/// A drone, how far above a place it is (m), and how far aside (m).
fn beside(name: &str, from_m: Point3<f64>, at_m: Point3<f64>) -> (String, f64, f64) {
    let aside_m = (from_m.xy() - at_m.xy()).norm();
    (name.to_owned(), from_m.z - at_m.z, aside_m)
}

/// The air that a drone is exposed to at a place (m), in induced velocities.
fn exposure(drone: &str, at_m: Point3<f64>, alpha: f64) -> Exposure {
    Exposure {
        drone: drone.to_owned(),
        at_m,
        beside: None,
        alpha,
        extra_percent: 100.0 * (airflow::power::beta(alpha) - 1.0),
        whole: None,
        drones: Vec::new(),
        // The search's bounds are a few percent above the air itself.
        air_limit: (alpha * 105.0).ceil() / 100.0,
    }
}
