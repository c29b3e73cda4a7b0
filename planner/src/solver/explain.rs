//! Why a drone stays at its start, in words: who or what is in the way, where and when, and the way out.

use costmap::leg::DroneId;
use costmap::verdict::Why;
use nalgebra::Point3;

use crate::plan::outcome::{Blocker, Control, EndpointConflict, EndpointKind, Exclusion};
use crate::plan::{Plan, Unplanned, Violation, ViolationKind};
use crate::scenario::world::World;
use crate::sipp::search::{Found, Hindrance, IMMOVABLE, Obstruction, Scene, search};
use crate::solver::assemble::assemble;
use crate::solver::density::Density;
use crate::solver::prepare::Job;
use crate::solver::priority::{Paths, Stranded, plan_group};
use crate::verify::verify;

/// From this share of columns held on a crowd is named as a reason: chosen here, a quarter of them costs a hall of a
/// thousand drones seconds to plan, a half of them more than a minute.
const CROWDED_SHARE: f64 = 0.25;
/// For how many groups the gentlest pass is looked for: chosen here, some dozens of searches each.
const MOST_PASSES: usize = 3;
/// Groups larger than this are not looked at as one: chosen here.
const LARGEST_GROUP: usize = 6;
/// Limits are raised at most this many times: chosen here, well past any flyable air.
const HIGHEST_RAISE: f64 = 8.0;
/// States of a search for a pass: chosen here, a second of work.
const MOST_EXPANSIONS: u64 = 60_000;

/// One reason per stranded drone.
pub fn reasons(
    world: &World,
    job: &Job,
    paths: &Paths,
    conflicts: &[EndpointConflict],
    control: &Control<'_>,
) -> Vec<Unplanned> {
    let groups = Groups::of(job, paths, control);
    let passes: Vec<Option<String>> = groups
        .members
        .iter()
        .enumerate()
        .map(|(index, group)| {
            let small = index < MOST_PASSES && group.len() <= LARGEST_GROUP;
            small.then(|| gentlest_pass(world, job, paths, group, control))
        })
        .collect();
    let crowd = crowd(job, paths);
    paths
        .stranded
        .iter()
        .map(|&(drone, why)| {
            let reason = match why {
                Stranded::NoWay => no_way(world, job, drone),
                Stranded::EndpointConflict => endpoint(world, conflicts, drone),
                Stranded::Landing(_) | Stranded::Zone(_) => briefly(world, why),
                Stranded::Stopped => format!("{}{crowd}", briefly(world, why)),
                Stranded::Obstructed(_) => {
                    let (group, by) = groups.of_drone(drone);
                    let who = by.map_or_else(
                        || briefly(world, Stranded::Obstructed(None)),
                        |by| obstruction(world, &by),
                    );
                    let first = group.map(|group| groups.first_stranded(group, &paths.stranded));
                    match (group.and_then(|group| passes[group].as_ref()), first) {
                        (Some(_), Some(Some(first))) if first != drone => {
                            format!("{who}; see `{}`", name(world, first))
                        }
                        (Some(pass), _) => format!("{who}; {pass}"),
                        (None, _) => format!("{who}{crowd}"),
                    }
                }
            };
            Unplanned {
                name: name(world, drone).to_owned(),
                reason,
            }
        })
        .collect()
}

/// The reason as far as it is known without looking for a way out.
pub(crate) fn briefly(world: &World, why: Stranded) -> String {
    match why {
        Stranded::NoWay => {
            "there is no way through free space to one of its tasks that its body fits through"
                .to_owned()
        }
        Stranded::EndpointConflict => "its end and another's exclude one another".to_owned(),
        Stranded::Landing(short_m) => format!(
            "the descent from its last task lacks {short_m:.2} m of room beside an obstacle; \
             move the task sideways, or end with Hover or Leave"
        ),
        Stranded::Obstructed(Some(by)) | Stranded::Zone(by) => obstruction(world, &by),
        Stranded::Obstructed(None) => "it and others kept taking each other's way".to_owned(),
        Stranded::Stopped => "planning was stopped before its turn".to_owned(),
    }
}

/// What a crowd has to do with it; nothing where there is none.
fn crowd(job: &Job, paths: &Paths) -> String {
    let Density { held, open } = Density::of(job, paths);
    if (held as f64) < CROWDED_SHARE * open as f64 {
        return String::new();
    }
    let percent = 100.0 * held as f64 / open as f64;
    format!(
        "; {held} of the floor's {open} columns ({percent:.0} %) are under drones that hover for ever: \
         let some of them land or leave, or give the fleet more floor"
    )
}

/// Stranded drones with those in their way: each group is a question of its own.
struct Groups {
    members: Vec<Vec<DroneId>>,
    obstructions: Vec<(DroneId, Option<Obstruction>)>,
}

impl Groups {
    fn of(job: &Job, paths: &Paths, control: &Control<'_>) -> Groups {
        let mut groups = Groups {
            members: Vec::new(),
            obstructions: Vec::new(),
        };
        for &(drone, why) in &paths.stranded {
            if let Stranded::Obstructed(_) = why {
                let by = in_the_way(job, paths, drone, control);
                groups.obstructions.push((drone, by));
                // Whom no other order would help is no part of the question.
                let hopeless = |other: DroneId| {
                    let known = paths.stranded.iter().find(|(drone, _)| *drone == other);
                    known.is_some_and(|(_, why)| !matches!(why, Stranded::Obstructed(_)))
                };
                let other = by.and_then(|by| match by.by {
                    Hindrance::Drone(other, _) if !hopeless(other) => Some(other),
                    Hindrance::Drone(..) | Hindrance::Zone(_) => None,
                });
                groups.join(drone, other);
            }
        }
        groups
    }

    fn join(&mut self, drone: DroneId, other: Option<DroneId>) {
        let mut joined: Vec<DroneId> = std::iter::once(drone).chain(other).collect();
        let touches = |group: &Vec<DroneId>| group.iter().any(|member| joined.contains(member));
        let (same, apart): (Vec<_>, Vec<_>) = std::mem::take(&mut self.members)
            .into_iter()
            .partition(touches);
        joined.extend(same.into_iter().flatten());
        joined.sort_unstable();
        joined.dedup();
        self.members = apart;
        self.members.push(joined);
    }

    /// Whose reason tells what the group could do.
    fn first_stranded(&self, group: usize, stranded: &[(DroneId, Stranded)]) -> Option<DroneId> {
        let members = &self.members[group];
        let mut drones = stranded.iter().map(|(drone, _)| *drone);
        drones.find(|drone| members.contains(drone))
    }

    fn of_drone(&self, drone: DroneId) -> (Option<usize>, Option<Obstruction>) {
        let group = self.members.iter().position(|group| group.contains(&drone));
        let by = self.obstructions.iter().find(|(known, _)| *known == drone);
        (group, by.and_then(|(_, by)| *by))
    }
}

fn name(world: &World, drone: DroneId) -> &str {
    &world.drones[drone.0 as usize].name
}

fn place(point_m: &Point3<f64>) -> String {
    format!("({:.2}, {:.2}, {:.2})", point_m.x, point_m.y, point_m.z)
}

fn no_way(world: &World, job: &Job, drone: DroneId) -> String {
    let errand = &job.errands[drone.0 as usize];
    let tasks = &world.drones[drone.0 as usize].tasks;
    let mut from = errand.start;
    let mut to = 0;
    for (index, stage) in errand.stages.iter().enumerate() {
        to = index;
        if stage.distances.ticks(&job.roadmap, from) == crate::graph::distances::UNREACHABLE {
            break;
        }
        from = stage.distances.goal();
    }
    format!(
        "no way through free space from {} to task {} at {} for a body of {:.2} m radius with {:.2} m \
         clearance, on a lattice of {:.2} m; widen the gap, or set a smaller cell_m",
        place(&job.roadmap.position_m(from)),
        to + 1,
        tasks
            .get(to)
            .map_or_else(String::new, |task| place(&task.to_m)),
        world.drones[drone.0 as usize].vehicle.body_radius_m,
        world.planning.clearance_m,
        world.planning.cell_m,
    )
}

fn endpoint(world: &World, conflicts: &[EndpointConflict], drone: DroneId) -> String {
    let index = drone.0 as usize;
    let own = |c: &&EndpointConflict| {
        c.when == EndpointKind::Goals && (c.drone == index || c.blocker == Blocker::Drone(index))
    };
    let Some(conflict) = conflicts.iter().find(own) else {
        return "its goal excludes another's".to_owned();
    };
    let sufferer = &world.drones[conflict.drone].name;
    let blocker = match conflict.blocker {
        Blocker::Drone(other) => format!("`{}`", world.drones[other].name),
        Blocker::Zone(zone) => format!("zone `{}`", world.zones[zone].name),
    };
    let how = match conflict.why {
        Exclusion::Bodies { gap_m, needs_m } if gap_m < 0.0 => format!(
            "at its goal the body of `{sufferer}` overlaps that of {blocker} by {:.2} m, between them must be {needs_m:.2} m",
            -gap_m
        ),
        Exclusion::Bodies { gap_m, needs_m } => {
            format!(
                "the goal of `{sufferer}` is {gap_m:.2} m from the body of {blocker}, it needs {needs_m:.2} m"
            )
        }
        Exclusion::Column => {
            format!("the goal of `{sufferer}` is in the near-field column of {blocker}")
        }
        Exclusion::Air {
            air_mps,
            alpha,
            limit,
        } => format!(
            "the goal of `{sufferer}` is in the downwash of {blocker}: {air_mps:.1} m/s, alpha {alpha:.2}, its limit is {limit:.2}"
        ),
        Exclusion::Zone { air_mps, limit_mps } => format!(
            "the goal of `{sufferer}` blows {air_mps:.1} m/s into {blocker}, which allows {limit_mps:.1} m/s"
        ),
    };
    match conflict.nearest_fix_m {
        Some(fix_m) => format!("{how}; move `{sufferer}`'s goal to {}", place(&fix_m)),
        None => how,
    }
}

fn obstruction(world: &World, by: &Obstruction) -> String {
    let at = format!("at {} from {:.1} s on", place(&by.at_m), by.at.seconds());
    match by.by {
        Hindrance::Zone(zone) => {
            let zone = &world.zones[zone];
            format!(
                "its own downwash is too strong for zone `{}`, which allows {:.1} m/s, {at}; fly \
                 higher or around, or raise the zone's air_limit_mps",
                zone.name, zone.air_limit_mps,
            )
        }
        Hindrance::Drone(other, why) => {
            let other = name(world, other);
            let what = match why {
                Why::Bodies => format!("the body of `{other}` is in its way"),
                Why::Column => {
                    format!("the near-field column between it and `{other}` is in its way")
                }
                Why::OwnLimit => format!("the downwash of `{other}` is in its way"),
                Why::TheirLimit => format!("its downwash would fall on `{other}`"),
                Why::Zone => format!("its downwash and that of `{other}` are too much for a zone"),
            };
            format!("{what} {at}")
        }
    }
}

/// What stops a drone if everybody else keeps to its plan.
fn in_the_way(
    job: &Job,
    paths: &Paths,
    drone: DroneId,
    control: &Control<'_>,
) -> Option<Obstruction> {
    let weights = vec![IMMOVABLE; job.errands.len()];
    let scene = Scene {
        roadmap: &job.roadmap,
        costmap: &paths.costmap,
        crowd: None,
        weights: &weights,
        under_way: &[],
        energy_weight: 0.0,
        detours: true,
        careful: true,
        most_expansions: MOST_EXPANSIONS,
        stop: control.stop,
    };
    match search(scene, &job.errands[drone.0 as usize]).found {
        Found::Blocked(by) => by,
        Found::Path(_) | Found::Stopped => None,
    }
}

/// The least raise of all limits that lets the whole group pass, found by bisection, and what it means.
fn gentlest_pass(
    world: &World,
    job: &Job,
    paths: &Paths,
    group: &[DroneId],
    control: &Control<'_>,
) -> String {
    let mut others = paths.costmap.clone();
    for &drone in group {
        others.remove(drone);
    }
    let raised = |times: f64| plan_group(job, &others.with_limits_raised(times), group, control);
    let Some(mut pass) = raised(HIGHEST_RAISE) else {
        return "no pass at any air limit: bodies, columns or zones are in the way".to_owned();
    };
    let (mut too_low, mut enough) = (1.0, HIGHEST_RAISE);
    while enough / too_low > 1.02 {
        let middle = f64::midpoint(too_low, enough);
        match raised(middle) {
            Some(found) => (pass, enough) = (found, middle),
            None => too_low = middle,
        }
    }
    let mut with_pass = paths.clone();
    with_pass
        .stranded
        .retain(|(drone, _)| !group.contains(drone));
    for path in pass {
        let drone = path.legs.first().map(|leg| leg.drone.0 as usize);
        if let Some(drone) = drone {
            with_pass.paths[drone] = Some(path);
        }
    }
    let plan = assemble(world, job, &with_pass);
    let mut exposed = verify(&plan).violations;
    exposed.retain(|violation| violation.kind == ViolationKind::Air);
    let over = |violation: &Violation| violation.value / violation.limit;
    exposed.sort_by(|a, b| over(b).total_cmp(&over(a)));
    exposed.first().map_or_else(
        || "there is a pass just within the limits, which this search keeps off".to_owned(),
        |worst| describe(&plan, worst, &exposed),
    )
}

fn describe(plan: &Plan, worst: &Violation, exposed: &[Violation]) -> String {
    let alpha = worst.value;
    let extra_percent = 100.0 * (airflow::power::beta(alpha) - 1.0);
    let mut names: Vec<String> = exposed.iter().map(|v| format!("`{}`", v.drone)).collect();
    names.sort_unstable();
    names.dedup();
    let from = worst.with.as_deref().unwrap_or("the others");
    let geometry = worst
        .with
        .as_ref()
        .and_then(|with| plan.drones.iter().find(|other| other.name == *with))
        .and_then(|other| other.trajectory.position_m(worst.from_s))
        .map_or_else(String::new, |at_m| {
            let below_m = at_m.z - worst.position_m.z;
            let aside_m = (at_m.xy() - worst.position_m.xy()).norm();
            format!(", {below_m:.1} m below and {aside_m:.1} m beside `{from}`")
        });
    format!(
        "no pass without exposure: the gentlest puts `{}` at {}{geometry}, alpha {alpha:.2}, \
         +{extra_percent:.0} % power; raise the air_limit of {} to {:.2}, with a margin",
        worst.drone,
        place(&worst.position_m),
        names.join(", "),
        // The search's bounds are a few percent above the air itself.
        (alpha * 105.0).ceil() / 100.0,
    )
}
