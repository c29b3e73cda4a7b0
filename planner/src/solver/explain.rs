//! Why a drone stays at its start: what obstructs it, where and when, and what would help. Whatever
//! is advised has been planned.

use std::cell::{Cell, RefCell};
use std::ops::Range;

use costmap::leg::{DroneId, Tick};
use costmap::verdict::Why;
use nalgebra::{Point3, Vector3};

use crate::graph::distances::UNREACHABLE;
use crate::graph::lattice::Spacing;
use crate::graph::passage::{Passage, passage};
use crate::plan::cause::{
    ClosedBy, Exposure, Extent, FailureCause, GoalConflict, Higher, Hindrance, HindranceKind,
    MissingPath, Moved, Remedy,
};
use crate::plan::outcome::{Blocker, Control, Effort, EndpointKind, Failure};
use crate::plan::{Plan, Violation, ViolationKind};
use crate::scenario::cell;
use crate::scenario::solid::Solids;
use crate::scenario::world::{AtEnd, Drone, PathMotion, World, Zone};
use crate::sipp::search::{Obstruction, Obstructor};
use crate::solver::density;
use crate::solver::endpoints::{self, Excluded, Exclusions, MOST_ALONE};
use crate::solver::fleet::{MOST_PARTS_LAST, tried};
use crate::solver::prepare::{Job, start_of};
use crate::solver::priority::{FailureKind, MOST_SMALL, Paths};
use crate::solver::refusals::{
    LARGEST_GROUP, RetriedGroup, divided_cells_m, joined, obstructions_of,
};
use crate::solver::subfleet::{Prepared, Subfleet, Terms};
use crate::verify::Report;

/// From this share of columns held on a crowd is named as a reason: chosen here, a quarter of them
/// costs a hall of a thousand drones seconds to plan, a half of them more than a minute.
const CROWDED_SHARE: f64 = 0.25;
/// For how many groups something that would help is looked for: chosen here, some dozens of
/// searches each.
const MOST_REMEDIES: usize = 3;
/// For how many refused drones it is asked what obstructs them in the end, and not only what did
/// when they were searched for: chosen here, up to a second of work each.
const MOST_ASKED: usize = 24;
/// Limits are raised at most this many times: chosen here, well past any flyable air.
const HIGHEST_RAISE: f64 = 8.0;
/// A body of this radius (m) is smaller than that of any drone: chosen here. Where it does not fit
/// through, nothing does.
const LEAST_BODY_M: f64 = 0.01;
/// States of one plan that only shows whether something would help: chosen here, a quarter of a
/// second of work.
const MOST_EXPANSIONS: u64 = 12_000;
/// The same of smooth flights: chosen here, as many times as many as they take in a corridor.
const MOST_SMOOTH_EXPANSIONS: u64 = 48_000;
/// States of all such plans times drones that are planned whole after which nothing more is looked
/// for: chosen here, some seconds of work. A state takes the longer, the more drones there are.
const MOST_EXPANSIONS_IN_ALL: u64 = 100_000;
/// A gentler pass may take so many times the states of the first: chosen here, three times as
/// many, each of which counts eight times without tables.
const PASS_STATES: u64 = 24;
/// Factors on the limits that a pass was verified at, in turn until the fleet is planned: chosen
/// here, the bounds of the search are some percent above the air itself.
const MARGINS: [f64; 3] = [1.02, 1.1, 1.25];
/// The same for a zone's limit, whose bounds are coarser: chosen here.
const ZONE_RAISES: [f64; 5] = [1.25, 1.6, 2.0, 3.0, 5.0];
/// How often what lies between the last that was too low and the first that will do is halved:
/// chosen here, to a few percent of it.
const ZONE_HALVINGS: usize = 4;
/// How far tasks are raised in turn (m): chosen here.
const TASK_STEP_M: f64 = 0.5;
/// How often: chosen here.
const MOST_TASK_STEPS: usize = 12;
/// So far above the bounds a height is looked for (m): the ceiling of the open category,
/// UAS.OPEN.010(2) of (EU) 2019/947.
const HIGHEST_M: f64 = 120.0;
/// How far above the least height that might do it is tried in turn (m): chosen here, drones need
/// room to fly.
const ABOVE_M: [f64; 6] = [0.0, 1.0, 2.0, 4.0, 8.0, 16.0];
/// Multiples of the distance to the nearest place in order by which a goal is moved, in turn:
/// chosen here, drones need room to fly.
const FARTHER: [f64; 3] = [1.0, 2.0, 4.0];
/// Of the states of a plan that shows whether something would help, each place of a goal gets one
/// in so many: chosen here, where the nearest asks for most of them another asks for few.
const SHARE_OF_PLACES: u64 = 4;
/// How far tasks are moved aside in turn (m): chosen here, what a person would move them by.
const ASIDE_M: [f64; 5] = [0.5, 1.0, 1.5, 2.0, 3.0];
/// Bearings of that: chosen here.
const BEARINGS: usize = 8;
/// Places of a task that are planned in turn until one will do: chosen here.
const MOST_PLACES: usize = 8;

/// A fleet with refused drones, and what was tried for them.
pub(crate) struct Refusals<'a> {
    /// The whole world.
    pub(crate) world: &'a World,
    /// Of the whole fleet.
    pub(crate) job: &'a Job,
    /// As they are in the end.
    pub(crate) paths: &'a Paths,
    pub(crate) endpoints: &'a Exclusions,
    /// What was tried again.
    pub(crate) tried: &'a [RetriedGroup],
    /// Says when to stop.
    pub(crate) control: &'a Control<'a>,
    /// Of what was planned to see whether it would help.
    pub(crate) effort: RefCell<Effort>,
}

/// One cause per drone without a path.
pub(crate) fn failures(refusals: &Refusals<'_>) -> Vec<Failure> {
    let Refusals {
        world,
        job,
        paths,
        endpoints,
        control,
        ..
    } = *refusals;
    // Others do not obstruct a drone late without them.
    let late = |drone: DroneId| {
        let agent = Some(&job.agents[drone.0 as usize]).filter(|it| it.is_timed());
        agent.and_then(|it| it.comes_late_along_lattice(&job.roadmap))
    };
    let obstructed = |(drone, why): &&(DroneId, FailureKind)| {
        matches!(why, FailureKind::Obstructed(_)) && late(*drone).is_none()
    };
    let asked = paths.unplanned.iter().filter(obstructed).map(|it| it.0);
    let asked: Vec<DroneId> = asked.take(MOST_ASKED).collect();
    let stopped = obstructions_of(job, paths, &asked, control);
    let mut groups = joined(&paths.unplanned, &stopped);
    groups.retain(|group| group.iter().any(|drone| late(*drone).is_none()));
    let remedy = |(index, group): (usize, &Vec<DroneId>)| {
        let small = index < MOST_REMEDIES && group.len() <= LARGEST_GROUP;
        small.then(|| refusals.least_limit_raise(group))
    };
    let remedies: Vec<Option<Remedy>> = groups.iter().enumerate().map(remedy).collect();
    // How crowded the floor is, where that counts as a reason.
    let crowding = Some(density::of(job, &paths.costmap)).filter(|it| it.share() >= CROWDED_SHARE);
    let obstructed = |drone: DroneId, known: Option<Obstruction>| {
        let by = stopped.get(&drone).map_or(known, |by| *by);
        let group = groups.iter().position(|group| group.contains(&drone));
        // Its first drone states the group's remedy.
        let mut drones = paths.unplanned.iter().map(|(drone, _)| *drone);
        let first = group.and_then(|group| drones.find(|drone| groups[group].contains(drone)));
        let remedy = match (group.and_then(|group| remedies[group].as_ref()), first) {
            // What helps the first may leave others of the group as they are.
            (Some(Remedy::MoveTask(moved) | Remedy::MoveLanding(moved)), Some(first))
                if first != drone && moved.refused.iter().any(|it| it == name(world, drone)) =>
            {
                Remedy::NoneAtAnyLimit
            }
            (Some(_), Some(first)) if first != drone => {
                Remedy::SameAs(name(world, first).to_owned())
            }
            (Some(remedy), _) => remedy.clone(),
            (None, _) => crowding.map_or(Remedy::Unknown, Remedy::LessCrowding),
        };
        FailureCause::Obstructed {
            by: by.map(|by| hindrance(world, &by)),
            remedy,
            extent: refusals.extent(drone),
        }
    };
    let due_s = |drone: DroneId, task: usize| {
        let asked = world.drones[drone.0 as usize].tasks.get(task)?;
        asked.during_s.map(|[due_s, _]| due_s)
    };
    let mut zones_left = MOST_REMEDIES;
    let mut fixes_left = MOST_ALONE;
    let failures = paths.unplanned.iter().map(|&(drone, why)| Failure {
        drone: name(world, drone).to_owned(),
        cause: match why {
            FailureKind::NoPath => FailureCause::NoPath(refusals.missing_path(drone)),
            FailureKind::Late(task, at) => {
                let agent = &job.agents[drone.0 as usize];
                let is_proven = agent.comes_late(&job.roadmap).is_some();
                too_late(task, at, due_s(drone, task), is_proven)
            }
            FailureKind::EndpointConflict => {
                let asks = fixes_left > 0;
                fixes_left = fixes_left.saturating_sub(1);
                let mut conflict = goal_conflict(world, endpoints, drone);
                let is_known = endpoints.is_planned_together;
                if let Some(conflict) = conflict.as_mut().filter(|_| !is_known) {
                    conflict.nearest_fix_m = match asks {
                        true => refusals.fix_m(conflict, drone),
                        false => None,
                    };
                }
                FailureCause::GoalConflict(conflict)
            }
            FailureKind::Stopped => FailureCause::Stopped(crowding),
            FailureKind::Obstructed(by) => match late(drone) {
                Some((task, at)) => too_late(task, at, due_s(drone, task), false),
                None => obstructed(drone, by),
            },
            FailureKind::Zone(by) => {
                let looks = zones_left > 0;
                zones_left = zones_left.saturating_sub(1);
                FailureCause::Obstructed {
                    by: Some(hindrance(world, &by)),
                    remedy: match looks {
                        true => refusals.remedy_for_zone(drone, &by),
                        false => Remedy::BudgetEnded,
                    },
                    extent: refusals.extent(drone),
                }
            }
            FailureKind::Landing(lacks) => FailureCause::NoRoomToLand {
                lacks,
                remedy: refusals
                    .remedy_for_landing(drone, &[drone], Remedy::MoveTask)
                    .unwrap_or(Remedy::Unknown),
            },
        },
    });
    failures.collect()
}

/// A drone that is at a task, counted from 0, too late; with when it is due (s), where that is
/// known.
fn too_late(task: usize, at: Tick, due_s: Option<f64>, is_proven: bool) -> FailureCause {
    FailureCause::TooLate {
        task: task + 1,
        at_s: at.seconds(),
        due_s,
        is_proven,
    }
}

/// The cause as far as it is known without looking for a remedy.
pub(crate) fn known_cause(world: &World, why: FailureKind) -> FailureCause {
    let obstructed = |by: Option<Obstruction>| FailureCause::Obstructed {
        by: by.map(|by| hindrance(world, &by)),
        remedy: Remedy::Unknown,
        extent: None,
    };
    match why {
        FailureKind::NoPath => FailureCause::NoPath(None),
        // It may be that only a zone makes it late.
        FailureKind::Late(task, at) => too_late(task, at, None, false),
        FailureKind::EndpointConflict => FailureCause::GoalConflict(None),
        FailureKind::Landing(lacks) => FailureCause::NoRoomToLand {
            lacks,
            remedy: Remedy::Unknown,
        },
        FailureKind::Obstructed(by) => obstructed(by),
        FailureKind::Zone(by) => obstructed(Some(by)),
        FailureKind::Stopped => FailureCause::Stopped(None),
    }
}

/// What the scenario calls it.
fn name(world: &World, drone: DroneId) -> &str {
    &world.drones[drone.0 as usize].name
}

/// The conflict of goals that a drone was dropped for, or is part of.
fn goal_conflict(world: &World, endpoints: &Exclusions, drone: DroneId) -> Option<GoalConflict> {
    let index = drone.0 as usize;
    let own = |it: &&Excluded| it.drone == index || it.blocker == Blocker::Drone(index);
    let conflict = endpoints.goals.iter().find(own)?;
    let mut described = endpoints.conflicts.worst.iter();
    let described = described.find(|it| {
        let is_start = it.when == EndpointKind::Starts;
        !is_start
            && (it.drone, it.blocker, it.meeting)
                == (conflict.drone, conflict.blocker, conflict.meeting)
    });
    let own_task = conflict.meeting.map(|it| match conflict.drone == index {
        true => it.task,
        false => it.their_task,
    });
    let typed = &world.drones[index];
    let last = typed.tasks.len().checked_sub(1);
    // That it stays at its start, or where its tasks end.
    let own_task = own_task.map_or(last, |it| it.map_or(last, |task| Some(task - 1)));
    Some(GoalConflict {
        drone: world.drones[conflict.drone].name.clone(),
        meeting: conflict.meeting,
        with: match conflict.blocker {
            Blocker::Drone(other) => format!("`{}`", world.drones[other].name),
            Blocker::Zone(zone) => format!("zone `{}`", world.zones[zone].name),
        },
        why: conflict.why,
        nearest_fix_m: described.and_then(|it| it.nearest_fix_m),
        at_m: own_task.map_or(typed.start_m, |task| typed.tasks[task].to_m),
        raised: (endpoints.conflicts).raised(|drone| &world.drones[drone].name),
    })
}

/// The obstruction, by the names of the scenario.
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
        lands: by.lands,
        from_s: by.at.seconds(),
    }
}

impl Refusals<'_> {
    /// How far a path was looked for.
    fn extent(&self, drone: DroneId) -> Option<Extent> {
        if self.job.is_closed(drone) {
            return Some(Extent::Proven);
        }
        let tried = self.tried.iter().filter(|it| it.drones.contains(&drone));
        let extents = tried.map(|tried| tried.extent);
        // What was stopped is not known, however fine the rest.
        let is_known = |it: &Extent| !matches!(it, Extent::Stopped { .. });
        let finest = extents.min_by(|a, b| {
            let known = is_known(a).cmp(&is_known(b));
            known.then(a.cell_m().total_cmp(&b.cell_m()))
        });
        let ended = || self.job.ended.iter().find(|(ended, _)| *ended == drone);
        finest.or_else(|| {
            ended().map(|(_, states)| Extent::BudgetEnded {
                states: *states,
                cell_m: self.world.planning.cell_m,
            })
        })
    }

    /// The first part of a drone's job that no path leads along, one that is proven to be closed
    /// before all others; `None` where it has no task.
    fn missing_path(&self, drone: DroneId) -> Option<MissingPath> {
        let Refusals { world, job, .. } = *self;
        let agent = &job.agents[drone.0 as usize];
        let closed = job.closed.iter().find(|(it, _)| *it == drone);
        let from = |task: usize| match task.checked_sub(1) {
            Some(before) => agent.waypoints[before].distances.goal(),
            None => agent.start,
        };
        let is_missing = |task: &usize| {
            let distances = &agent.waypoints[*task].distances;
            distances.ticks(&job.roadmap, from(*task)) == UNREACHABLE
        };
        let last = agent.waypoints.len().checked_sub(1)?;
        let task = match closed {
            Some((_, task)) => *task,
            None => (0..last).find(is_missing).unwrap_or(last),
        };
        let own = Extent::NotFound {
            cell_m: world.planning.cell_m,
        };
        let typed = &world.drones[drone.0 as usize];
        let from_m = job.roadmap.position_m(from(task));
        let to_m = typed.tasks.get(task)?.to_m;
        let mut above = job.roadmap.edges_beyond(agent.start);
        let is_grounded = task == 0 && agent.grounded && !above.any(|(_, edge)| edge.is_lift);
        let pad = is_grounded.then(|| start_of(world, typed, from_m, true));
        let take_off = pad.and_then(|pad| pad.lift_m);
        Some(MissingPath {
            from_m,
            task: task + 1,
            to_m,
            body_radius_m: typed.vehicle.body_radius_m,
            clearance_m: world.planning.gap_to_solids_m(),
            extent: match closed {
                Some(_) => Extent::Proven,
                None => self.extent(drone).unwrap_or(own),
            },
            closed_by: match closed {
                Some(_) => closed_by(world, typed.vehicle.body_radius_m, [from_m, to_m]),
                None => take_off.map_or(ClosedBy::Gap, ClosedBy::TakeOff),
            },
        })
    }

    /// The least raise of all limits with which a whole group passes, found by bisection; the air
    /// that the verifier finds there, and limits with which it is planned.
    fn least_limit_raise(&self, group: &[DroneId]) -> Remedy {
        let subfleet = Subfleet {
            world: self.world,
            job: self.job,
            paths: self.paths,
            chosen: group,
            control: self.control,
            prepared: &Prepared::default(),
        };
        let spent = || self.effort.borrow().expansions;
        let raised = |times: f64, most_expansions: u64| {
            let terms = Terms {
                spacing: Spacing::of(self.world.planning.cell_m),
                raised: [times, 1.0],
                most_expansions: most_expansions.min(self.most_expansions()?),
                improves: false,
            };
            subfleet.replanned(&terms, &mut self.effort.borrow_mut())
        };
        if (self.control.stop)() {
            return Remedy::Unknown;
        }
        let begun = spent();
        let mut pass = match raised(HIGHEST_RAISE, u64::MAX) {
            // The budget of states ended, or the run was stopped.
            None if (self.control.stop)() => return Remedy::Unknown,
            None => return Remedy::BudgetEnded,
            Some(found) if found.unplanned > 0 => return self.remedy_by_moving(group),
            Some(found) => found,
        };
        let most_expansions = PASS_STATES * (spent() - begun);
        let (mut too_low, mut enough) = (1.0, HIGHEST_RAISE);
        while enough / too_low > 1.1 {
            let middle = f64::midpoint(too_low, enough);
            match raised(middle, most_expansions).filter(|found| found.unplanned == 0) {
                Some(found) => (pass, enough) = (found, middle),
                None => too_low = middle,
            }
        }
        let (plan, report) = subfleet.judged(&pass);
        let Some(least_exposure) = worst_exposure(&plan, &report) else {
            return Remedy::Unknown;
        };
        let air_limit = self.enough(&least_exposure, group);
        let mut drones = least_exposure.drones;
        if let Some(air_limit) = air_limit {
            let all = &self.world.drones;
            drones.retain(|name| {
                all.iter()
                    .any(|it| it.name == *name && it.air_limit < air_limit)
            });
        }
        Remedy::RaiseLimits(Exposure {
            air_limit: air_limit.filter(|_| !drones.is_empty()),
            drones,
            ..least_exposure
        })
    }

    /// The air limit of those exposed with which the whole group is planned.
    fn enough(&self, least_exposure: &Exposure, group: &[DroneId]) -> Option<f64> {
        let limits = MARGINS.map(|margin| (least_exposure.alpha * margin * 100.0).ceil() / 100.0);
        limits.into_iter().find(|air_limit| {
            let mut raised = self.world.clone();
            for drone in &mut raised.drones {
                if least_exposure.drones.contains(&drone.name) {
                    drone.air_limit = drone.air_limit.max(*air_limit);
                }
            }
            self.would_plan(&raised, group)
        })
    }

    /// What else helps where no air limit does: another place of the last task of the first of a
    /// group that is refused, or that it does not land.
    fn remedy_by_moving(&self, group: &[DroneId]) -> Remedy {
        let mut unplanned = self.paths.unplanned.iter().map(|(drone, _)| *drone);
        let Some(drone) = unplanned.find(|drone| group.contains(drone)) else {
            return Remedy::NoneAtAnyLimit;
        };
        if let Some(remedy) = self.remedy_for_landing(drone, group, Remedy::MoveLanding) {
            return remedy;
        }
        let tasks = &self.world.drones[drone.0 as usize].tasks;
        let Some(task) = tasks.len().checked_sub(1) else {
            return Remedy::NoneAtAnyLimit;
        };
        let places_m = aside_m(tasks[task].to_m).chain(above_m(tasks[task].to_m));
        let planned = self.planned_at((drone, task), (group, 1), places_m);
        planned.map_or(Remedy::NoneAtAnyLimit, Remedy::MoveTask)
    }

    /// What helps where the landing is the cause: a place of the last task from which the drone
    /// lands, or that it stays in the air. `None` where it does not land, or is not planned without
    /// landing.
    fn remedy_for_landing(
        &self,
        drone: DroneId,
        group: &[DroneId],
        moves: fn(Moved) -> Remedy,
    ) -> Option<Remedy> {
        let index = drone.0 as usize;
        if self.world.drones[index].at_end != AtEnd::Land {
            return None;
        }
        let mut hovering = self.world.clone();
        hovering.drones[index].at_end = AtEnd::Hover;
        if !self.would_plan(&hovering, group) {
            return None;
        }
        let tasks = &self.world.drones[index].tasks;
        let moved = tasks.len().checked_sub(1).and_then(|task| {
            let places_m = aside_m(tasks[task].to_m);
            self.planned_at((drone, task), (group, 1), places_m)
        });
        let moved = moved.filter(|it| it.refused.is_empty());
        Some(moved.map_or(Remedy::StayUp, moves))
    }

    /// That its landing is the cause; or a height or place of a task, or a limit of the zone, with
    /// which a drone is planned that its wake keeps from its tasks.
    fn remedy_for_zone(&self, drone: DroneId, by: &Obstruction) -> Remedy {
        let Obstructor::Zone(zone) = by.by else {
            return Remedy::Unknown;
        };
        if let Some(remedy) = self.remedy_for_landing(drone, &[drone], Remedy::MoveLanding) {
            return remedy;
        }
        let tasks = &self.world.drones[drone.0 as usize].tasks;
        let middle_m = {
            let zone = &self.world.zones[zone];
            nalgebra::center(&zone.min_m, &zone.max_m)
        };
        let beside_m = |task: usize| (tasks[task].to_m.xy() - middle_m.xy()).norm();
        let nearest = (0..tasks.len()).min_by(|a, b| beside_m(*a).total_cmp(&beside_m(*b)));
        let moved = nearest.and_then(|task| {
            let places_m = above_m(tasks[task].to_m).chain(aside_m(tasks[task].to_m));
            self.planned_at((drone, task), (&[drone], 1), places_m)
        });
        if let Some(moved) = moved {
            return Remedy::MoveTask(moved);
        }
        if let Some(higher) = self.above_bounds(drone) {
            return Remedy::RaiseBounds(higher);
        }
        let limit_mps = self.world.zones[zone].air_limit_mps;
        let limits = limit_mps
            .map(|limit_mps| ZONE_RAISES.map(|times| (limit_mps * times * 10.0).ceil() / 10.0));
        let is_enough = |air_limit_mps: f64| {
            let mut raised = self.world.clone();
            raised.zones[zone].air_limit_mps = Some(air_limit_mps);
            self.would_plan(&raised, &[drone])
        };
        let mut too_low_mps = limit_mps.unwrap_or_default();
        let mut limits = limits.into_iter().flatten();
        let mut enough = limits.find(|limit_mps| {
            let is_enough = is_enough(*limit_mps);
            if !is_enough {
                too_low_mps = *limit_mps;
            }
            is_enough
        });
        for _ in 0..ZONE_HALVINGS {
            let Some(known_mps) = enough else { break };
            let middle_mps = (f64::midpoint(too_low_mps, known_mps) * 10.0).ceil() / 10.0;
            match middle_mps < known_mps && is_enough(middle_mps) {
                true => enough = Some(middle_mps),
                false => too_low_mps = middle_mps.min(known_mps),
            }
        }
        enough.map_or_else(
            || self.none_found(),
            |air_limit_mps| Remedy::RaiseZone {
                zone: self.world.zones[zone].name.clone(),
                air_limit_mps,
            },
        )
    }

    /// What is said where nothing that helps was found.
    fn none_found(&self) -> Remedy {
        match (self.control.stop)() || self.most_expansions().is_some() {
            true => Remedy::Unknown,
            false => Remedy::BudgetEnded,
        }
    }

    /// Bounds that reach farther up, with which a drone is planned that its wake keeps from its
    /// tasks, and where above the bounds the first of those tasks would have to be at which it is
    /// too strong for a zone with no other drone there.
    fn above_bounds(&self, drone: DroneId) -> Option<Higher> {
        let index = drone.0 as usize;
        let (top_m, tasks) = (self.world.bounds_m.max.z, &self.world.drones[index].tasks);
        let at = |task: usize, z_m: f64| {
            let mut moved = self.world.clone();
            moved.bounds_m.max.z = moved.bounds_m.max.z.max(z_m);
            moved.drones[index].tasks[task].to_m.z = z_m;
            moved
        };
        let is_broken = |world: &World, tasks: Range<usize>| {
            endpoints::breaking_zones_alone(world, &[(drone, tasks)])[0]
        };
        let task = is_broken(self.world, 0..tasks.len()).map(|(task, _)| task);
        let least_m = match task {
            None => top_m,
            Some(task) => {
                // The least height at which it is no longer too strong, by halves.
                let is_low = |z_m: f64| is_broken(&at(task, z_m), task..task + 1).is_some();
                let (mut low_m, mut high_m) = (top_m, top_m + HIGHEST_M);
                if is_low(high_m) {
                    return None;
                }
                while high_m - low_m > TASK_STEP_M {
                    let middle_m = f64::midpoint(low_m, high_m);
                    match is_low(middle_m) {
                        true => low_m = middle_m,
                        false => high_m = middle_m,
                    }
                }
                high_m
            }
        };
        let heights_m = ABOVE_M
            .map(|above_m| typed_up_m(least_m + above_m))
            .into_iter();
        { heights_m }.filter(|z_m| *z_m > top_m).find_map(|z_m| {
            let raised = match task {
                Some(task) => at(task, z_m),
                None => {
                    let mut raised = self.world.clone();
                    raised.bounds_m.max.z = z_m;
                    raised
                }
            };
            self.would_plan(&raised, &[drone]).then(|| Higher {
                max_z_m: z_m,
                moved: task.map(|task| Moved {
                    task: task + 1,
                    to_m: raised.drones[index].tasks[task].to_m,
                    refused: Vec::new(),
                }),
            })
        })
    }

    /// The first of some places (m) of a task with which all of a group are planned, or the drone
    /// itself and as many others as with any: of those where it may hover were no other drone
    /// there, so many are tried.
    fn planned_at(
        &self,
        (drone, task): (DroneId, usize),
        (group, share): (&[DroneId], u64),
        places_m: impl Iterator<Item = Point3<f64>>,
    ) -> Option<Moved> {
        let moved = places_m.filter_map(|to_m| {
            let mut moved = self.world.clone();
            moved.drones[drone.0 as usize].tasks[task].to_m = to_m;
            let is_free = |moved: &World| {
                let asked = [(drone, task..task + 1)];
                endpoints::breaking_zones_alone(moved, &asked) == [None]
            };
            (moved.check().is_ok() && is_free(&moved)).then_some((to_m, moved))
        });
        let mut best: Option<(Point3<f64>, Vec<DroneId>)> = None;
        for (to_m, moved) in moved.take(MOST_PLACES) {
            let Some(refused) = self.refused_by(&moved, group, share) else {
                continue;
            };
            let fewest = best.as_ref().map(|(_, fewest)| fewest.len());
            let is_better = fewest.is_none_or(|fewest| refused.len() < fewest);
            if is_better && !refused.contains(&drone) {
                best = Some((to_m, refused));
            }
            if best.as_ref().is_some_and(|(_, refused)| refused.is_empty()) {
                break;
            }
        }
        let name = |drone: &DroneId| name(self.world, *drone).to_owned();
        best.map(|(to_m, refused)| Moved {
            task: task + 1,
            to_m,
            refused: refused.iter().map(name).collect(),
        })
    }

    /// A place (m) for the drone that a conflict would have moved, with which another is planned,
    /// or it itself: the one that the conflict proposes, or of itself one beside or above.
    fn fix_m(&self, conflict: &GoalConflict, drone: DroneId) -> Option<Point3<f64>> {
        let task_of = |it: &Drone| match conflict.meeting {
            Some(meeting) => meeting.task.map(|task| task - 1),
            None => it.tasks.len().checked_sub(1),
        };
        let moved = |to_m: &Point3<f64>| {
            let mut moved = self.world.clone();
            let drones = moved.drones.iter_mut();
            for it in drones.filter(|it| it.name == conflict.drone) {
                match task_of(it) {
                    Some(task) => it.tasks[task].to_m = *to_m,
                    None => it.start_m = *to_m,
                }
            }
            moved
        };
        // The first place with which only others are refused.
        let nearly_m = Cell::new(None);
        let is_planned = |fix_m: &Point3<f64>| {
            let refused = self.refused_by(&moved(fix_m), &[drone], SHARE_OF_PLACES);
            let helps = (refused.as_ref()).is_some_and(|refused| !refused.contains(&drone));
            nearly_m.set(nearly_m.get().or(helps.then_some(*fix_m)));
            refused.is_some_and(|refused| refused.is_empty())
        };
        let by_moving_its_task = || {
            // The task of a meeting is one of that drone.
            let own = &self.world.drones[drone.0 as usize];
            let task = task_of(own).filter(|_| own.name == conflict.drone)?;
            let goal_m = own.tasks[task].to_m;
            let places_m = aside_m(goal_m).chain(above_m(goal_m));
            let moved = self.planned_at((drone, task), (&[drone], SHARE_OF_PLACES), places_m)?;
            nearly_m.set(nearly_m.get().or(Some(moved.to_m)));
            moved.refused.is_empty().then_some(moved.to_m)
        };
        let by_a_closer_look = || {
            let to_m = nearly_m.get()?;
            self.is_planned_in_the_end(&moved(&to_m)).then_some(to_m)
        };
        let is_own = conflict.drone == name(self.world, drone);
        let nearest_m = conflict.nearest_fix_m.map(|nearest_m| {
            let (from_m, times) = match is_own {
                true => (conflict.at_m, &FARTHER[..]),
                false => (nearest_m, &FARTHER[..1]),
            };
            let farther = times.iter();
            farther.map(move |times| typed_m(from_m + *times * (nearest_m - from_m)))
        });
        let mut nearest_m = nearest_m.into_iter().flatten();
        (nearest_m.find(is_planned))
            .or_else(by_moving_its_task)
            .or_else(by_a_closer_look)
    }

    /// Whether all of a small fleet are planned in a changed world that is in order, where what
    /// would be refused is planned again as it is in a run.
    fn is_planned_in_the_end(&self, changed: &World) -> bool {
        let is_small = changed.drones.len() <= MOST_SMALL;
        let paths = is_small.then(|| self.planned_whole(changed, (1, Some(MOST_PARTS_LAST))));
        (paths.flatten()).is_some_and(|paths| paths.unplanned.is_empty())
    }

    /// Paths of a changed world's whole fleet within one in so many of the states of a plan that
    /// only shows whether something would help; see [`tried`].
    fn planned_whole(&self, changed: &World, (share, parts): (u64, Option<f64>)) -> Option<Paths> {
        let most = (self.most_expansions()? / share, parts);
        let changed = cell::chosen_anew(changed.clone());
        tried(&changed, self.control, most, &mut self.effort.borrow_mut())
    }

    /// States of the next plan that only shows whether something would help; `None`: enough was
    /// looked for.
    fn most_expansions(&self) -> Option<u64> {
        let most = match self.world.planning.motion {
            PathMotion::Straight => MOST_EXPANSIONS,
            PathMotion::Smooth => MOST_SMOOTH_EXPANSIONS,
        };
        // Of a larger fleet those that are asked about are planned, not all.
        let planned = self.world.drones.len().min(MOST_SMALL) as u64;
        let spent = self.effort.borrow().expansions * planned;
        (spent < MOST_EXPANSIONS_IN_ALL).then_some(most)
    }

    /// Whether these drones are planned if the world is changed so, and all that are now.
    fn would_plan(&self, changed: &World, drones: &[DroneId]) -> bool {
        let refused = self.refused_by(changed, drones, 1);
        refused.is_some_and(|refused| refused.is_empty())
    }

    /// Drones refused if the world is changed so, of these and all that are planned now: a small
    /// fleet is planned whole, as a run would; of a large one these alone among the rest. `None`:
    /// one in so many of its states did not tell.
    fn refused_by(&self, changed: &World, drones: &[DroneId], share: u64) -> Option<Vec<DroneId>> {
        if (self.control.stop)() || changed.check().is_err() {
            return None;
        }
        let refused = |paths: &Paths| {
            let is_now = |drone: &DroneId| self.paths.unplanned.iter().any(|it| it.0 == *drone);
            let unplanned = paths.unplanned.iter().map(|(drone, _)| *drone);
            let refused = unplanned.filter(|it| drones.contains(it) || !is_now(it));
            refused.collect::<Vec<_>>()
        };
        if changed.drones.len() <= MOST_SMALL {
            let planned = self.planned_whole(changed, (share, None));
            return planned.as_ref().map(refused);
        }
        let subfleet = Subfleet {
            world: changed,
            job: self.job,
            paths: self.paths,
            chosen: drones,
            control: self.control,
            prepared: &Prepared::default(),
        };
        let own = std::iter::once(changed.planning.cell_m);
        let mut known: Option<Vec<DroneId>> = None;
        for cell_m in own.chain(divided_cells_m(changed, 2.0)) {
            let Some(most_expansions) = self.most_expansions() else {
                break;
            };
            let terms = Terms {
                spacing: Spacing::of(cell_m),
                raised: [1.0; 2],
                most_expansions,
                improves: false,
            };
            let found = subfleet.replanned(&terms, &mut self.effort.borrow_mut());
            let Some(found) = found else {
                continue;
            };
            let refused = refused(&found.paths);
            if (known.as_ref()).is_none_or(|known| refused.len() < known.len()) {
                known = Some(refused);
            }
            if known.as_ref().is_some_and(Vec::is_empty) {
                break;
            }
        }
        known
    }
}

/// Places straight above one (m), nearest first.
fn above_m(from_m: Point3<f64>) -> impl Iterator<Item = Point3<f64>> {
    let up_m = (1..=MOST_TASK_STEPS).map(|step| TASK_STEP_M * step as f64);
    up_m.map(move |up_m| typed_m(from_m + Vector3::z() * up_m))
}

/// Places beside one (m), nearest first.
fn aside_m(from_m: Point3<f64>) -> impl Iterator<Item = Point3<f64>> {
    let beside = move |aside_m: f64| {
        (0..BEARINGS).map(move |k| {
            let (sin, cos) = (k as f64 / BEARINGS as f64 * std::f64::consts::TAU).sin_cos();
            typed_m(from_m + Vector3::new(cos, sin, 0.0) * aside_m)
        })
    };
    ASIDE_M.into_iter().flat_map(beside)
}

/// A height as it is printed and typed back: to the next half metre (m).
fn typed_up_m(height_m: f64) -> f64 {
    (height_m / TASK_STEP_M).ceil() * TASK_STEP_M
}

/// As it is printed, and typed back: to the centimetre (m).
fn typed_m(place_m: Point3<f64>) -> Point3<f64> {
    place_m.map(|coordinate_m| (coordinate_m * 100.0).round() / 100.0)
}

/// The worst air over a limit that the verifier found in a plan, and all whose limits it is over;
/// `None` where it found none, or anything else.
fn worst_exposure(plan: &Plan, report: &Report) -> Option<Exposure> {
    let violations = &report.violations;
    if violations.iter().any(|it| it.kind != ViolationKind::Air) {
        return None;
    }
    let over = |it: &Violation| it.value / it.limit;
    let worst = violations
        .iter()
        .max_by(|a, b| over(a).total_cmp(&over(b)))?;
    let mut drones: Vec<String> = violations.iter().map(|it| it.drone.clone()).collect();
    // As they are quoted.
    drones.sort_unstable_by_key(|name| format!("{name}`"));
    drones.dedup();
    let at_m = worst.position_m;
    let index = plan.drones.iter().position(|it| it.name == worst.drone)?;
    let met = &report.exposures[index];
    let beside = worst.with.as_ref().and_then(|with| {
        let other = plan.drones.iter().find(|other| other.name == *with)?;
        let from_m = other.trajectory.position_m(met.worst_air_at_s?)?;
        Some(beside(with, from_m, at_m))
    });
    Some(Exposure {
        drone: worst.drone.clone(),
        at_m,
        beside,
        alpha: worst.value,
        extra_percent: 100.0 * (airflow::power::beta(worst.value) - 1.0),
        whole: (met.dose_m, met.extra_energy_j),
        drones,
        air_limit: None,
    })
}

/// A drone, how far above a place it is (m), and how far aside (m).
fn beside(name: &str, from_m: Point3<f64>, at_m: Point3<f64>) -> (String, f64, f64) {
    let aside_m = (from_m.xy() - at_m.xy()).norm();
    (name.to_owned(), from_m.z - at_m.z, aside_m)
}

/// What closes the way between two places (m) that is closed for a body of this radius (m).
fn closed_by(world: &World, body_radius_m: f64, ends_m: [Point3<f64>; 2]) -> ClosedBy {
    let radius_m = body_radius_m + world.planning.gap_to_solids_m();
    let is_open = |zones: &[Zone], radius_m: f64| {
        let among = World {
            zones: zones.to_vec(),
            ..world.clone()
        };
        let solids = Solids::of(&among);
        matches!(
            passage(&world.bounds_m, &solids, radius_m, ends_m),
            Passage::Open(_)
        )
    };
    if is_open(&[], radius_m) {
        let closing = world.zones.iter().filter(|it| it.keep_out);
        let (mut alone, closing): (Vec<Zone>, Vec<Zone>) = closing.cloned().partition(|it| {
            let others = world.zones.iter().filter(|other| other.name != it.name);
            is_open(&others.cloned().collect::<Vec<_>>(), radius_m)
        });
        // Where none of them does alone, all of them do together.
        if alone.is_empty() {
            alone = closing;
        }
        return ClosedBy::Zones(alone.into_iter().map(|it| it.name).collect());
    }
    // Halved, and to the centimetre: it is typed. The tracking margin is kept in any case.
    let least_m = world.planning.margins.tracking_m;
    let halved = |clearance_m: &f64| Some((0.5e2 * clearance_m).floor() / 1e2);
    let smaller_m = std::iter::successors(halved(&world.planning.clearance_m), halved);
    let mut smaller_m = smaller_m.take_while(|clearance_m| *clearance_m > least_m);
    match smaller_m.find(|it| is_open(&world.zones, body_radius_m + it)) {
        Some(clearance_m) => ClosedBy::Clearance(clearance_m),
        None if is_open(&world.zones, LEAST_BODY_M) => ClosedBy::Gap,
        None => ClosedBy::Solids,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::HIGHEST_M;
    use crate::plan::cause::{Exclusion, FailureCause, Remedy};
    use crate::plan::outcome::{Control, EndpointKind, Planned};
    use crate::scenario::read_world;
    use crate::scenario::world::{Obstacle, Solid, World};

    fn planned(world: &World) -> Planned {
        let outcome = crate::plan_world(world, &Control::QUIET).expect("in order");
        outcome.into_planned().expect("starts are apart")
    }

    const RULES: &str = "planning: (motion: Straight), air: (convection: None)";

    /// A drone that has to cross a zone as wide as its hall, which is so high (m).
    fn across(height_m: f64, air_limit_mps: f64) -> World {
        let text = format!(
            r#"(name: "across", bounds_m: (min: (0, 0, 0), max: (12, 4, {height_m})),
            zones: [(name: "z", min_m: (4, 0, 0), max_m: (7, 4, 1), air_limit_mps: {air_limit_mps})],
            drones: [(name: "m", airframe: "matrice-300", start_m: (1, 2, 5), tasks: [(to_m: (11, 2, 5))])], {RULES})"#
        );
        read_world(&text).expect("in order")
    }

    #[test]
    fn a_zone_is_crossed_as_high_as_it_has_to_be_and_bounds_allow() {
        // 4.75 m/s from the highest place, 5.2 from the height of start and goal.
        for air_limit_mps in [4.7969, 4.85] {
            let planned = planned(&across(6.0, air_limit_mps));
            let plan = &planned.plan;
            assert!(plan.is_safe(), "{air_limit_mps}: {:?}", planned.failures);
            let places_m = &plan.drones[0].trajectory.position_m;
            assert!(places_m.iter().any(|it| it.z == 6.0), "{places_m:?}");
        }
    }

    #[test]
    fn a_limit_of_a_zone_that_would_do_is_not_far_above_one_that_does_not() {
        let mut world = across(5.0, 4.7);
        // Under a roof no bounds that reach farther up help.
        world.obstacles.push(Obstacle {
            name: "roof".to_owned(),
            shape: Solid::Box {
                min_m: Point3::new(0.0, 0.0, 6.0),
                max_m: Point3::new(12.0, 4.0, 6.0 + HIGHEST_M),
            },
        });
        let failures = planned(&world).failures;
        let FailureCause::Obstructed {
            remedy: Remedy::RaiseZone { air_limit_mps, .. },
            ..
        } = failures[0].cause
        else {
            panic!("{failures:?}");
        };
        assert!(air_limit_mps < 1.13 * 5.2, "{air_limit_mps}");
        world.zones[0].air_limit_mps = Some(air_limit_mps);
        assert!(planned(&world).plan.is_safe());
    }

    #[test]
    fn all_tasks_of_a_drone_that_ends_where_it_breaks_a_limit_are_reported_at_once() {
        let text = format!(
            r#"(name: "over", bounds_m: (min: (0, 0, 0), max: (10, 8, 9)),
            zones: [(name: "z0", min_m: (5.3, 1, 0), max_m: (7.7, 2.7, 1.1), air_limit_mps: 1.5)],
            drones: [(name: "m", airframe: "matrice-300", start_m: (1, 7, 4),
            tasks: [(to_m: (7.5, 2.5, 8.3), dwell_s: 5), (to_m: (1, 6, 4)), (to_m: (4.5, 0.8, 8.1))])], {RULES})"#
        );
        let mut world = read_world(&text).expect("in order");
        let conflicts = planned(&world).conflicts.worst;
        let places = conflicts.iter().map(|it| (it.when, it.task_of(3)));
        let places: Vec<_> = places.collect();
        assert_eq!(
            places,
            [
                (EndpointKind::Goals, Some(2)),
                (EndpointKind::Tasks, Some(0))
            ]
        );
        // What is advised of both is planned together.
        for conflict in &conflicts {
            let task = conflict.task_of(3).expect("of a task");
            world.drones[0].tasks[task].to_m = conflict.nearest_fix_m.expect("a place near");
        }
        assert!(planned(&world).plan.is_safe());
    }

    #[test]
    fn what_a_drone_brings_to_a_zone_is_reported_of_it_and_not_of_those_that_bring_more() {
        // Alone each of two breaks the limit; then neither, but both together.
        let told = |drones: &[(&str, &str, &str, &str)], limit_mps: f64| {
            let drones = drones.iter().map(|(name, airframe, start, to)| {
                format!(
                    r#"(name: "{name}", airframe: "{airframe}", start_m: {start}, tasks: [(to_m: {to})])"#
                )
            });
            let text = format!(
                r#"(name: "z", bounds_m: (min: (0, 0, 0), max: (20, 12, 6)),
                zones: [(name: "people", min_m: (8, 4, 0), max_m: (10, 8, 2), air_limit_mps: {limit_mps})],
                drones: [{}])"#,
                drones.collect::<Vec<_>>().join(", ")
            );
            let worst = planned(&read_world(&text).expect("in order"))
                .conflicts
                .worst;
            let told = worst.into_iter().map(|it| match it.why {
                Exclusion::Zone {
                    air_mps, together, ..
                } => (air_mps, together, it.nearest_fix_m),
                why => panic!("{why:?}"),
            });
            told.collect::<Vec<_>>()
        };
        let large = ("m", "matrice-300", "(1, 6, 5)", "(6.5, 6, 5)");
        let small = ("k", "kolibri", "(1, 1, 1)", "(9, 6, 3)");
        let [both, alone] = [told(&[large, small], 0.5), told(&[large], 0.5)];
        assert_eq!(both[0], alone[0]);
        assert!(!both[0].1 && both[0].0 < 1.0 && both[1].0 > 4.0, "{both:?}");
        let beside = [
            ("k", "kolibri", "(1, 1, 1)", "(9, 6, 5)"),
            ("l", "kolibri", "(1, 4, 1)", "(9.45, 6, 5)"),
        ];
        let together = told(&beside, 2.4);
        assert!(
            matches!(together[..], [(2.4..2.6, true, _)]),
            "{together:?}"
        );
    }

    #[test]
    fn a_pad_beside_another_is_moved_by_about_as_much_as_is_missing() {
        let lands = |name: &str, from: &str, to: &str| {
            format!(
                r#"(name: "{name}", airframe: "kolibri", start_m: {from}, tasks: [(to_m: {to})], at_end: Land)"#
            )
        };
        let text = format!(
            r#"(name: "pads", bounds_m: (min: (0, 0, 0), max: (8, 8, 4)), drones: [{}, {}], {RULES})"#,
            lands("a", "(1, 1, 2)", "(4, 4, 2)"),
            lands("c", "(7, 1, 2)", "(4, 4.25, 1.8)")
        );
        let world = read_world(&text).expect("in order");
        let conflicts = planned(&world).conflicts.worst;
        let to_m = conflicts[0].nearest_fix_m.expect("a place near");
        // 4 cm are missing, in steps of 10.
        assert!((to_m - Point3::new(4.0, 4.25, 1.8)).norm() < 0.21, "{to_m}");
        // It is planned as it is printed.
        assert_eq!(to_m, super::typed_m(to_m));
        let text = text.replace(
            "(4, 4.25, 1.8)",
            &format!("({}, {}, {})", to_m.x, to_m.y, to_m.z),
        );
        assert!(
            planned(&read_world(&text).expect("in order"))
                .plan
                .is_safe()
        );
    }
}
