//! Why a drone stays at its start: what is in its way, where and when, and what would help.
//! Whatever is advised has been planned.

use std::cell::RefCell;

use costmap::leg::{DroneId, Tick};
use costmap::verdict::Why;
use nalgebra::{Point3, Vector3};

use crate::graph::distances::UNREACHABLE;
use crate::graph::passage::{Passage, passage};
use crate::plan::cause::{
    ClosedBy, Exposure, Extent, FailureCause, GoalConflict, Hindrance, HindranceKind, MissingPath,
    Moved, Remedy,
};
use crate::plan::outcome::{Blocker, Control, Effort, EndpointKind, Failure};
use crate::plan::{Plan, Violation, ViolationKind};
use crate::scenario::solid::Solids;
use crate::scenario::world::{AtEnd, Drone, PathMotion, World, Zone};
use crate::sipp::search::{Obstruction, Obstructor};
use crate::solver::density;
use crate::solver::endpoints::{self, Excluded, Exclusions};
use crate::solver::fleet::tried;
use crate::solver::prepare::Job;
use crate::solver::priority::{FailureKind, MOST_SMALL, Paths};
use crate::solver::refusals::{LARGEST_GROUP, Retried, divided_cells_m, in_their_way, joined};
use crate::solver::subfleet::{Prepared, Subfleet, Terms};
use crate::verify::Report;

/// From this share of columns held on a crowd is named as a reason: chosen here, a quarter of them
/// costs a hall of a thousand drones seconds to plan, a half of them more than a minute.
const CROWDED_SHARE: f64 = 0.25;
/// For how many groups something that would help is looked for: chosen here, some dozens of
/// searches each.
const MOST_REMEDIES: usize = 3;
/// For how many drones it is asked whether another goal would do: chosen here.
const MOST_FIXES: i32 = 8;
/// For how many refused drones it is asked what is in their way in the end, and not only what was
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
/// States of all such plans times drones after which nothing more is looked for: chosen here, some
/// seconds of work. A state takes the longer, the more drones there are.
const MOST_EXPANSIONS_IN_ALL: u64 = 100_000;
/// A gentler pass may take so many times the states of the first: chosen here, three times as
/// many, each of which counts eight times without tables.
const PASS_STATES: u64 = 24;
/// What the limits that a pass was verified at are raised by in turn until the fleet is planned:
/// chosen here, the bounds of the search are some percent above the air itself.
const MARGINS: [f64; 3] = [1.02, 1.1, 1.25];
/// The same for a zone's limit, whose bounds are coarser: chosen here.
const ZONE_RAISES: [f64; 5] = [1.25, 1.6, 2.0, 3.0, 5.0];
/// How far tasks are raised in turn (m): chosen here.
const TASK_STEP_M: f64 = 0.5;
/// How often: chosen here.
const MOST_TASK_STEPS: usize = 12;
/// How far tasks are moved aside in turn (m): chosen here, what a person would move them by.
const ASIDE_M: [f64; 5] = [0.5, 1.0, 1.5, 2.0, 3.0];
/// Bearings of that: chosen here.
const BEARINGS: usize = 8;
/// Places of a task that are planned in turn until one will do: chosen here.
const MOST_PLACES: usize = 8;

/// A fleet of which some are refused, and what was done about it.
pub(crate) struct Refusals<'a> {
    /// The whole world.
    pub(crate) world: &'a World,
    /// Of the whole fleet.
    pub(crate) job: &'a Job,
    /// As they are in the end.
    pub(crate) paths: &'a Paths,
    /// Of endpoints.
    pub(crate) endpoints: &'a Exclusions,
    /// What was tried again.
    pub(crate) tried: &'a [Retried],
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
    // Others are not in the way of who is late without them.
    let late = |drone: DroneId| {
        let agent = Some(&job.agents[drone.0 as usize]).filter(|it| it.is_timed());
        agent.and_then(|it| it.comes_late_along_lattice(&job.roadmap))
    };
    let obstructed = |(drone, why): &&(DroneId, FailureKind)| {
        matches!(why, FailureKind::Obstructed(_)) && late(*drone).is_none()
    };
    let asked = paths.unplanned.iter().filter(obstructed).map(|it| it.0);
    let asked: Vec<DroneId> = asked.take(MOST_ASKED).collect();
    let stopped = in_their_way(job, paths, &asked, control);
    let mut groups = joined(&paths.unplanned, &stopped);
    groups.retain(|group| group.iter().any(|drone| late(*drone).is_none()));
    let remedy = |(index, group): (usize, &Vec<DroneId>)| {
        let small = index < MOST_REMEDIES && group.len() <= LARGEST_GROUP;
        small.then(|| refusals.gentlest_pass(group))
    };
    let remedies: Vec<Option<Remedy>> = groups.iter().enumerate().map(remedy).collect();
    // How crowded the floor is, where that counts as a reason.
    let crowding = Some(density::of(job, &paths.costmap)).filter(|it| it.share() >= CROWDED_SHARE);
    let obstructed = |drone: DroneId, known: Option<Obstruction>| {
        let by = stopped.get(&drone).map_or(known, |by| *by);
        let group = groups.iter().position(|group| group.contains(&drone));
        // Whose reason tells what the group could do.
        let mut drones = paths.unplanned.iter().map(|(drone, _)| *drone);
        let first = group.and_then(|group| drones.find(|drone| groups[group].contains(drone)));
        let remedy = match (group.and_then(|group| remedies[group].as_ref()), first) {
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
    let mut fixes_left = MOST_FIXES;
    let failures = paths.unplanned.iter().map(|&(drone, why)| Failure {
        drone: name(world, drone).to_owned(),
        cause: match why {
            FailureKind::NoPath => FailureCause::NoPath(refusals.missing_path(drone)),
            FailureKind::Late(task, at) => too_late(task, at, due_s(drone, task), true),
            FailureKind::EndpointConflict => {
                fixes_left -= 1;
                let mut conflict = goal_conflict(world, endpoints, drone);
                if let Some(conflict) = &mut conflict {
                    conflict.nearest_fix_m = match fixes_left >= 0 {
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
                        true => refusals.past_zone(drone, &by),
                        false => Remedy::Unknown,
                    },
                    extent: refusals.extent(drone),
                }
            }
            FailureKind::Landing(short_m) => FailureCause::NoRoomToLand {
                short_m,
                remedy: refusals
                    .past_landing(drone, Remedy::MoveTask)
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
        FailureKind::Late(task, at) => too_late(task, at, None, true),
        FailureKind::EndpointConflict => FailureCause::GoalConflict(None),
        FailureKind::Landing(short_m) => FailureCause::NoRoomToLand {
            short_m,
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
        extents.min_by(|a, b| {
            let known = is_known(a).cmp(&is_known(b));
            known.then(a.cell_m().total_cmp(&b.cell_m()))
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
        let radius_m = typed.vehicle.body_radius_m + world.planning.gap_to_solids_m();
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
                Some(_) => closed_by(world, radius_m, [from_m, to_m]),
                None => ClosedBy::Gap,
            },
        })
    }

    /// The least raise of all limits with which a whole group passes, found by bisection; the air
    /// that the verifier finds there, and limits with which it is planned.
    fn gentlest_pass(&self, group: &[DroneId]) -> Remedy {
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
                cell_m: self.world.planning.cell_m,
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
            None => return Remedy::Unknown,
            Some(found) if found.unplanned > 0 => return self.elsewhere(group),
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
        let Some(gentlest) = worst_exposure(&plan, &report) else {
            return Remedy::Unknown;
        };
        Remedy::RaiseLimits(Exposure {
            air_limit: self.enough(&gentlest, group),
            ..gentlest
        })
    }

    /// The air limit of those exposed with which the whole group is planned.
    fn enough(&self, gentlest: &Exposure, group: &[DroneId]) -> Option<f64> {
        let limits = MARGINS.map(|margin| (gentlest.alpha * margin * 100.0).ceil() / 100.0);
        limits.into_iter().find(|air_limit| {
            let mut raised = self.world.clone();
            for drone in &mut raised.drones {
                if gentlest.drones.contains(&drone.name) {
                    drone.air_limit = drone.air_limit.max(*air_limit);
                }
            }
            self.would_plan(&raised, group)
        })
    }

    /// What else helps where no air limit does: another place of the last task of the first of a
    /// group that is refused, or that it does not land.
    fn elsewhere(&self, group: &[DroneId]) -> Remedy {
        let mut unplanned = self.paths.unplanned.iter().map(|(drone, _)| *drone);
        let Some(drone) = unplanned.find(|drone| group.contains(drone)) else {
            return Remedy::NoneAtAnyLimit;
        };
        if let Some(remedy) = self.past_landing(drone, Remedy::MoveLanding) {
            return remedy;
        }
        let tasks = &self.world.drones[drone.0 as usize].tasks;
        let Some(task) = tasks.len().checked_sub(1) else {
            return Remedy::NoneAtAnyLimit;
        };
        let places_m = aside_m(tasks[task].to_m).chain(above_m(tasks[task].to_m));
        let planned = self.planned_at(drone, task, places_m);
        planned.map_or(Remedy::NoneAtAnyLimit, Remedy::MoveTask)
    }

    /// What helps where the landing is the cause: a place of the last task from which the drone
    /// lands, or that it stays in the air. `None` where it does not land, or is not planned without
    /// landing.
    fn past_landing(&self, drone: DroneId, moves: fn(Moved) -> Remedy) -> Option<Remedy> {
        let index = drone.0 as usize;
        if self.world.drones[index].at_end != AtEnd::Land {
            return None;
        }
        let mut hovering = self.world.clone();
        hovering.drones[index].at_end = AtEnd::Hover;
        if !self.would_plan(&hovering, &[drone]) {
            return None;
        }
        let tasks = &self.world.drones[index].tasks;
        let moved = tasks.len().checked_sub(1).and_then(|task| {
            let places_m = aside_m(tasks[task].to_m);
            self.planned_at(drone, task, places_m)
        });
        Some(moved.map_or(Remedy::StayUp, moves))
    }

    /// That its landing is the cause; or a height or place of a task, or a limit of the zone, with
    /// which a drone is planned that its wake keeps from its tasks.
    fn past_zone(&self, drone: DroneId, by: &Obstruction) -> Remedy {
        let Obstructor::Zone(zone) = by.by else {
            return Remedy::Unknown;
        };
        if let Some(remedy) = self.past_landing(drone, Remedy::MoveLanding) {
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
            self.planned_at(drone, task, places_m)
        });
        if let Some(moved) = moved {
            return Remedy::MoveTask(moved);
        }
        let limit_mps = self.world.zones[zone].air_limit_mps;
        let limits = limit_mps
            .map(|limit_mps| ZONE_RAISES.map(|times| (limit_mps * times * 10.0).ceil() / 10.0));
        let enough = limits.into_iter().flatten().find(|air_limit_mps| {
            let mut raised = self.world.clone();
            raised.zones[zone].air_limit_mps = Some(*air_limit_mps);
            self.would_plan(&raised, &[drone])
        });
        enough.map_or(Remedy::Unknown, |air_limit_mps| Remedy::RaiseZone {
            zone: self.world.zones[zone].name.clone(),
            air_limit_mps,
        })
    }

    /// The first of some places (m) of a task with which a drone is planned: of those where it may
    /// hover were no other drone there, so many are tried.
    fn planned_at(
        &self,
        drone: DroneId,
        task: usize,
        places_m: impl Iterator<Item = Point3<f64>>,
    ) -> Option<Moved> {
        let moved = places_m.filter_map(|to_m| {
            let mut moved = self.world.clone();
            moved.drones[drone.0 as usize].tasks[task].to_m = to_m;
            let is_free =
                moved.check().is_ok() && endpoints::alone_at(&moved, drone, task).count() == 0;
            is_free.then_some((to_m, moved))
        });
        let mut moved = moved.take(MOST_PLACES);
        let planned = moved.find(|(_, moved)| self.would_plan(moved, &[drone]));
        planned.map(|(to_m, _)| Moved {
            task: task + 1,
            to_m,
        })
    }

    /// A place (m) for the drone that a conflict would have moved, with which another is planned,
    /// or it itself: the one that the conflict proposes, or of itself one beside or above.
    fn fix_m(&self, conflict: &GoalConflict, drone: DroneId) -> Option<Point3<f64>> {
        let task_of = |it: &Drone| match conflict.meeting {
            Some(meeting) => meeting.task.map(|task| task - 1),
            None => it.tasks.len().checked_sub(1),
        };
        let is_planned = |fix_m: &Point3<f64>| {
            let mut changed = self.world.clone();
            let moved = changed.drones.iter_mut();
            let moved = moved.filter(|it| it.name == conflict.drone);
            for it in moved {
                match task_of(it) {
                    Some(task) => it.tasks[task].to_m = *fix_m,
                    None => it.start_m = *fix_m,
                }
            }
            self.would_plan(&changed, &[drone])
        };
        let elsewhere = || {
            // The task of a meeting is one of that drone.
            let own = &self.world.drones[drone.0 as usize];
            let task = task_of(own).filter(|_| own.name == conflict.drone)?;
            let goal_m = own.tasks[task].to_m;
            let places_m = aside_m(goal_m).chain(above_m(goal_m));
            let moved = self.planned_at(drone, task, places_m)?;
            Some(moved.to_m)
        };
        conflict.nearest_fix_m.filter(is_planned).or_else(elsewhere)
    }

    /// States of the next plan that only shows whether something would help; `None`: enough was
    /// looked for.
    fn most_expansions(&self) -> Option<u64> {
        let most = match self.world.planning.motion {
            PathMotion::Straight => MOST_EXPANSIONS,
            PathMotion::Smooth => MOST_SMOOTH_EXPANSIONS,
        };
        let spent = self.effort.borrow().expansions * self.world.drones.len() as u64;
        (spent < MOST_EXPANSIONS_IN_ALL).then_some(most)
    }

    /// Whether these drones are planned if the world is changed so: a small fleet is planned whole,
    /// as a run would; of a large one these alone among the rest.
    fn would_plan(&self, changed: &World, drones: &[DroneId]) -> bool {
        if (self.control.stop)() || changed.check().is_err() {
            return false;
        }
        let left_out = |paths: &Paths| {
            let mut unplanned = paths.unplanned.iter();
            unplanned.any(|(drone, _)| drones.contains(drone))
        };
        if changed.drones.len() <= MOST_SMALL {
            let Some(most) = self.most_expansions() else {
                return false;
            };
            let tried = tried(changed, self.control, most, &mut self.effort.borrow_mut());
            return tried.is_some_and(|paths| !left_out(&paths));
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
        own.chain(divided_cells_m(changed, 2.0)).any(|cell_m| {
            let Some(most_expansions) = self.most_expansions() else {
                return false;
            };
            let terms = Terms {
                cell_m,
                raised: [1.0; 2],
                most_expansions,
                improves: false,
            };
            let found = subfleet.replanned(&terms, &mut self.effort.borrow_mut());
            found.is_some_and(|found| found.unplanned == 0)
        })
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

/// What closes the way between two places (m) that is closed for a ball (m).
fn closed_by(world: &World, radius_m: f64, ends_m: [Point3<f64>; 2]) -> ClosedBy {
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
    match is_open(&world.zones, LEAST_BODY_M) {
        true => ClosedBy::Gap,
        false => ClosedBy::Solids,
    }
}
