//! The whole flow: endpoints, roadmap, search, plan, verifier, and the same again without wakes.

use std::cell::{Cell, RefCell};

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, Leg};
use rayon::prelude::*;

use crate::graph::agent::Agent;
use crate::graph::distances::UNREACHABLE;
use crate::graph::passage::Passages;
use crate::plan::cause::Exclusion;
use crate::plan::outcome::{
    Blocker, Control, Effort, EndpointConflict, EndpointConflicts, EndpointKind, Failure, Outcome,
    Planned, Progress,
};
use crate::plan::{IgnoringDownwash, Plan, Unplanned};
use crate::scenario::cell;
use crate::scenario::world::{PathMotion, World};
use crate::scenario::{Problems, WorldError};
use crate::sipp::conflicts::Steps;
use crate::sipp::search::{
    IMMOVABLE, Obstruction, Obstructor, SearchOutcome, SearchSetting, Searched, search,
};
use crate::solver::assemble::assemble;
use crate::solver::endpoints::{self, Excluded, Exclusions};
use crate::solver::explain::{Refusals, failures};
use crate::solver::prepare::{Job, prepare};
use crate::solver::priority::{
    FailureKind, FleetProblem, MOST_SMALL, Paths, note_of_pibt, plan_fleet,
};
use crate::solver::refusals::{RetriedGroup, planned_on_other_cells, retry_refused};
use crate::solver::relaxed::{Why, most_states, notes, weaker};
use crate::verify::{harm, judged, verify};

/// Plans a fleet out of its own downwash and verifies the plan.
///
/// Rules that the world leaves open ([`crate::scenario::world::Relaxable`]) are given up where
/// fewer drones are unplanned without them; [`Planned::notes`] says so.
///
/// Reads no clock and no file: `control` says when to stop. The same world gives the same plan on
/// any number of threads.
///
/// # Errors
/// What is wrong with a world that was built by hand ([`World::check`]); one that was read is in
/// order.
pub fn plan_world(world: &World, control: &Control<'_>) -> Result<Outcome, Problems<WorldError>> {
    world.check()?;
    let weaker = weaker(world);
    let Solved {
        mut run,
        paths,
        tried,
        mut notes,
    } = match by_open_rules(world, &weaker, control, FleetRun::solve) {
        Ok(solved) => solved,
        Err(conflicts) => return Ok(Outcome::Infeasible { conflicts }),
    };
    let world = run.world;
    notes.extend(note_of_pibt(&world.planning, &run.job, &paths, &run.effort));
    let trials = RemedyTrials::new(control);
    if let Some((changed, said)) = cell::with_room_to_pass(world)
        && !paths.unplanned.is_empty()
        && trials.is_planned(&changed)
    {
        notes.push(said);
    }
    run.endpoints.advise(world);
    trials.confirm(&mut run.endpoints, world);
    run.endpoints
        .confirm_together(world, |moved| trials.is_planned(moved));
    let failures = failures(&Refusals {
        world,
        job: &run.job,
        paths: &paths,
        endpoints: &run.endpoints,
        tried: &tried,
        control,
        effort: RefCell::default(),
    });

    let planned_m = |conflict: &EndpointConflict| {
        let name = &world.drones[conflict.drone].name;
        let meeting = conflict.meeting.as_ref();
        let mut causes = failures.iter().map(|it| &it.cause);
        causes.find_map(|it| it.goal_m(name, meeting))
    };
    (run.endpoints).confirm_goals(world, planned_m, |moved| trials.is_planned(moved));

    (control.progress)(Progress::Verifying);
    let plan = assemble(world, &run.job, &paths);
    let report = verify(&plan);
    let mut plan = judged(plan, report, unplanned_of(&failures));

    if control.contrast && !(control.stop)() {
        (control.progress)(Progress::IgnoringDownwash);
        plan.ignoring_downwash = ignoring_downwash(world, &run.job, &run.endpoints.goals, control);
    }
    Ok(run.answer(plan, failures, notes))
}

/// Paths of a fleet, and the run that found them.
pub(crate) struct Solved<'a> {
    /// Of the world with their rules.
    pub(crate) run: FleetRun<'a>,
    /// Of all drones that have one.
    pub(crate) paths: Paths,
    /// What was planned again.
    tried: Vec<RetriedGroup>,
    /// What a reader of the plan should know.
    pub(crate) notes: Vec<String>,
}

impl Solved<'_> {
    fn unplanned(&self) -> usize {
        self.paths.unplanned.len()
    }
}

/// Paths by the rules of a world; where some drone has none, by those of the next of `weaker`
/// worlds, each the same with some of its rules. The first of those by which the fewest drones are
/// unplanned: no rule is given up for nothing.
///
/// # Errors
/// The conflicts of endpoints, where starts exclude one another by all of them.
pub(crate) fn by_open_rules<'a>(
    world: &'a World,
    weaker: &'a [World],
    control: &'a Control<'a>,
    solve: impl Fn(&mut FleetRun<'a>) -> Option<(Paths, Vec<RetriedGroup>)>,
) -> Result<Solved<'a>, EndpointConflicts> {
    let mut best: Option<Solved<'a>> = None;
    let mut excluded = None;
    let mut covered = None;
    let mut given_up = Vec::new();
    let mut effort = Effort::default();
    let mut is_tried_finer = false;
    let passages = Passages::of(world);
    let worlds: Vec<&World> = std::iter::once(world).chain(weaker).collect();
    for (index, &world) in worlds.iter().enumerate() {
        let next = worlds.get(index + 1);
        let rules = match (index, next) {
            (_, None) if is_tried_finer => Rules::Last(MOST_PARTS_LAST),
            (_, None) => Rules::Last(f64::INFINITY),
            (0, _) => Rules::First,
            _ => Rules::Between,
        };
        let still = covered.and_then(|share| Why::of_covered(world, share));
        let tried = match still.filter(|_| next.is_some()) {
            Some(why) => Ok(Err((why, Effort::default()))),
            None => by_rules(world, (rules, covered), (control, &passages), &solve),
        };
        let why = match tried {
            Ok(Ok(solved)) => {
                let unplanned = solved.unplanned();
                let fewest = best.as_ref().map(Solved::unplanned);
                effort.add(&solved.run.effort);
                is_tried_finer |= rules == Rules::First;
                if fewest.is_none_or(|fewest| unplanned < fewest) {
                    best = Some(solved);
                }
                if unplanned == 0 || (control.stop)() {
                    break;
                }
                Why::Unplanned(unplanned)
            }
            Ok(Err((why, spent))) => {
                effort.add(&spent);
                why
            }
            Err(endpoints) => {
                let why = Why::Excluded(endpoints.conflicts.count());
                excluded.get_or_insert((world, endpoints));
                why
            }
        };
        if let Why::Covered(share, _) = why {
            covered = Some(share);
        }
        given_up.push((world, why));
    }
    // What lies between was not looked at on finer cells, as the last was.
    let between = given_up.iter().skip(1).take(worlds.len().saturating_sub(2));
    for (world, _) in between.filter(|(_, why)| matches!(why, Why::Unplanned(_))) {
        let is_by_last =
            |best: &&Solved<'_>| std::ptr::eq(best.run.world, worlds[worlds.len() - 1]);
        let by_last = best.as_ref().filter(is_by_last).map(Solved::unplanned);
        let Some(most @ 1..) = by_last else { break };
        if effort.expansions > MOST_EXPANSIONS_BEFORE_AGAIN || (control.stop)() {
            break;
        }
        match by_rules(world, (Rules::Again, covered), (control, &passages), &solve) {
            Ok(Ok(solved)) => {
                effort.add(&solved.run.effort);
                if solved.unplanned() <= most {
                    best = Some(solved);
                }
            }
            Ok(Err((_, spent))) => effort.add(&spent),
            Err(_) => {}
        }
    }
    match (best, excluded) {
        (Some(mut best), _) => {
            best.notes = notes(&given_up, best.run.world);
            best.run.effort = Effort {
                improved_ticks: best.run.effort.improved_ticks,
                ..effort
            };
            Ok(best)
        }
        (None, Some((world, mut endpoints))) => {
            let trials = RemedyTrials::new(control);
            // Of very many no place is known to be enough.
            if endpoints.conflicts.more == 0 {
                endpoints.advise(world);
            }
            trials.confirm(&mut endpoints, world);
            endpoints.confirm_moves(world, |moved| trials.is_planned(moved));
            Err(endpoints.conflicts)
        }
        (None, None) => unreachable!("nothing limits the states of the last run"),
    }
}

/// Where the rules of a world come among those that are tried in turn.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rules {
    /// Others follow.
    First,
    Between,
    /// Those between once more, as the last.
    Again,
    /// The last, kept to at any cost, even if the only ones; cells are divided into so many parts
    /// at most.
    Last(f64),
}

/// States of all rules together after which those between are not tried again: chosen here, some
/// tenths of a second of work.
const MOST_EXPANSIONS_BEFORE_AGAIN: u64 = 20_000;

/// Into how many parts cells are divided by the last rules, where the first were tried on finer
/// ones: chosen here.
pub(crate) const MOST_PARTS_LAST: f64 = 2.0;

/// Paths by the rules of one world; why they are given up, and what that took, unless they are the
/// last. What lies between is tried within a budget of states, fewer where wakes are known to have
/// `covered` much of the floor, and what it would refuse is not looked at again.
fn by_rules<'a>(
    world: &'a World,
    (rules, covered): (Rules, Option<f64>),
    (control, passages): (&'a Control<'a>, &Passages),
    solve: &impl Fn(&mut FleetRun<'a>) -> Option<(Paths, Vec<RetriedGroup>)>,
) -> Result<Result<Solved<'a>, (Why, Effort)>, Exclusions> {
    let mut run = FleetRun::new(world, control, passages)?;
    if !matches!(rules, Rules::Last(_)) {
        let is_first = rules == Rules::First;
        match most_states(world, &run.job, is_first, covered) {
            Ok(most) => run.most_expansions = most,
            Err(why) => return Ok(Err((why, run.effort))),
        }
        run.is_tried = run.most_expansions.is_some();
    }
    run.parts = match rules {
        Rules::First => Some(f64::INFINITY),
        Rules::Between => None,
        Rules::Again => Some(MOST_PARTS_LAST),
        Rules::Last(most) => Some(most),
    };
    Ok(match solve(&mut run) {
        Some((paths, tried)) => Ok(Solved {
            run,
            paths,
            tried,
            notes: Vec::new(),
        }),
        None => Err((Why::Spent(run.effort.expansions), run.effort)),
    })
}

/// Larger fleets are not planned to see whether something would help: chosen here.
const MOST_CONFIRMED: usize = 1000;
/// States of one such plan, smooth and straight, and how many of them are spent in all: chosen
/// here, some seconds of work.
const MOST_SMOOTH_EXPANSIONS_CONFIRMED: u64 = 60_000;
const MOST_EXPANSIONS_CONFIRMED: u64 = 400_000;
const MOST_PLANS_CONFIRMED: f64 = 3.0;

/// Plans that only show whether something would help.
struct RemedyTrials<'a> {
    control: &'a Control<'a>,
    /// How many plans' states are left.
    left: Cell<f64>,
}

impl<'a> RemedyTrials<'a> {
    fn new(control: &'a Control<'a>) -> RemedyTrials<'a> {
        RemedyTrials {
            control,
            left: Cell::new(MOST_PLANS_CONFIRMED),
        }
    }

    /// Whether all of a fleet are planned by the last of the rules that it leaves open.
    fn is_planned(&self, world: &World) -> bool {
        if world.drones.len() > MOST_CONFIRMED || (self.control.stop)() {
            return false;
        }
        let world = world.relaxed().unwrap_or_else(|| world.clone());
        let world = &cell::chosen_anew(world);
        let whole = match world.planning.motion {
            PathMotion::Smooth => MOST_SMOOTH_EXPANSIONS_CONFIRMED,
            PathMotion::Straight => MOST_EXPANSIONS_CONFIRMED,
        } as f64;
        let most = (whole * self.left.get().min(1.0)) as u64;
        if most == 0 {
            return false;
        }
        let mut effort = Effort::default();
        let tried = tried(world, self.control, (most, None), &mut effort);
        let spent = effort.expansions as f64 / whole;
        self.left.set((self.left.get() - spent).max(0.0));
        tried.is_some_and(|paths| paths.unplanned.is_empty())
    }

    /// Of the smaller margins and higher limits proposed, keeps those that would help.
    fn confirm(&self, endpoints: &mut Exclusions, world: &World) {
        endpoints.confirm_tracking(|tracking_m| {
            let mut changed = world.clone();
            changed.planning.margins.tracking_m = tracking_m;
            tracking_m < world.planning.margins.tracking_m && self.is_planned(&changed)
        });
        endpoints.confirm_limits(world, |raised| self.is_planned(raised));
    }
}

/// Paths of a whole fleet within so many states, none of them better than the first that are found;
/// what would be refused is planned again on cells divided into so many `parts` at most.
/// `None` where starts exclude one another, or the states ended first. Adds what that took to
/// `effort`.
pub(crate) fn tried(
    world: &World,
    control: &Control<'_>,
    (most_expansions, parts): (u64, Option<f64>),
    effort: &mut Effort,
) -> Option<Paths> {
    let control = control.trying();
    let mut run = FleetRun::new(world, &control, &Passages::of(world)).ok()?;
    run.most_expansions = Some(most_expansions);
    (run.improves, run.parts) = (false, parts);
    let solved = run.solve();
    effort.add(&run.effort);
    solved.map(|(paths, _)| paths)
}

/// States of the search for one drone alone among zones: chosen here, a second or two of work.
const MOST_EXPANSIONS_ALONE: u64 = 50_000;
/// The same of smooth flights, whose states take as much longer: chosen here.
const MOST_SMOOTH_EXPANSIONS_ALONE: u64 = 10_000;
/// So many drones are searched for alone at a time; where a zone leaves none of that many a path,
/// each of the rest gets so many of the states, and in a small fleet one in so many of them if that
/// is more, and all that this zone stops are refused. All chosen here: what stops a few drones of a
/// fleet stops most of it, and a drone that flies elsewhere, or round it, is there within as many.
const AT_A_TIME: usize = 4;
const SHARE_OF_REST: u64 = 4;
const MOST_EXPANSIONS_OF_REST: u64 = 2_000;
/// The same in a larger fleet by rules that may be given up, where a refusal is not the last word:
/// chosen here, so that smooth flights of 200 drones take a second.
const MOST_EXPANSIONS_OF_REST_TRIED: u64 = 300;

/// A run of the planner, as far as it is the same for a world alone and among fixed trajectories.
pub(crate) struct FleetRun<'a> {
    /// Checked; by whose rules it is.
    pub(crate) world: &'a World,
    /// Says when to stop.
    control: &'a Control<'a>,
    /// Roadmap and agents of the world's drones.
    pub(crate) job: Job,
    /// Of endpoints: none of starts.
    endpoints: Exclusions,
    /// Of all searches of the run.
    pub(crate) effort: Effort,
    /// States after which it gives up; `None`: as many as it takes.
    pub(crate) most_expansions: Option<u64>,
    /// See [`FleetProblem::improves`].
    pub(crate) improves: bool,
    /// See [`FleetProblem::is_tried`].
    is_tried: bool,
    /// What would be refused is planned again, on cells divided into so many parts at most and
    /// beyond the lattice; `None`: it is not.
    parts: Option<f64>,
}

impl<'a> FleetRun<'a> {
    /// Prepares a world that has been checked; `passages` are those of its solids.
    ///
    /// # Errors
    /// The conflicts of endpoints, where starts exclude one another.
    pub(crate) fn new(
        world: &'a World,
        control: &'a Control<'a>,
        passages: &Passages,
    ) -> Result<FleetRun<'a>, Exclusions> {
        (control.progress)(Progress::Preparing);
        let endpoints = endpoints::find(world);
        let mut conflicts = endpoints.conflicts.worst.iter();
        if conflicts.any(|c| c.when == EndpointKind::Starts) {
            return Err(endpoints);
        }
        Ok(FleetRun {
            world,
            control,
            job: prepare(world, passages, control.stop),
            endpoints,
            effort: Effort::default(),
            most_expansions: None,
            improves: true,
            is_tried: false,
            parts: Some(f64::INFINITY),
        })
    }

    /// The same within so many states, improved after or not, of a world that is prepared already
    /// and where no two starts exclude one another.
    pub(crate) fn limited(
        world: &'a World,
        control: &'a Control<'a>,
        job: Job,
        (most_expansions, improves): (u64, bool),
    ) -> FleetRun<'a> {
        FleetRun {
            world,
            control,
            job,
            endpoints: Exclusions::default(),
            effort: Effort::default(),
            most_expansions: Some(most_expansions),
            improves,
            is_tried: false,
            parts: None,
        }
    }

    /// Paths of the fleet alone; what would be refused is tried again, if that is asked for.
    /// `None` where the budget of states ended first.
    pub(crate) fn solve(&mut self) -> Option<(Paths, Vec<RetriedGroup>)> {
        let costmap = self.job.costmap(self.world, self.world.drones.len());
        let paths = self.paths(costmap, Vec::new())?;
        let Some(most_parts) = self.parts else {
            return Some((paths, Vec::new()));
        };
        let (world, control) = (self.world, self.control);
        let paths = planned_on_other_cells(world, &mut self.job, paths, control, &mut self.effort);
        Some(retry_refused(
            world,
            &mut self.job,
            paths,
            (control, most_parts),
            &mut self.effort,
        ))
    }

    /// Paths of the fleet in a costmap without drones, around the legs of drones that are fixed.
    /// `None` where the budget of states ended first.
    pub(crate) fn paths(&mut self, mut costmap: Costmap, fixed: Vec<Vec<Leg>>) -> Option<Paths> {
        let mut excluded = excluded(&self.job, &self.endpoints.goals, |_| true);
        let mut zones = self.world.zones.iter();
        if zones.any(|zone| zone.air_limit_mps.is_some()) {
            let more = self.kept_out_by_zones(&costmap, &excluded);
            excluded.extend(more);
        }
        for legs in fixed {
            costmap.insert(legs);
        }
        let problem = FleetProblem {
            job: &self.job,
            costmap: &costmap,
            steps: (!costmap.has_limits_raised())
                .then(|| Steps::new(self.job.roadmap.lattice(), &self.job.agents, &costmap))
                .flatten(),
            excluded: &excluded,
            planning: &self.world.planning,
            control: self.control,
            most_expansions: self.most_expansions,
            is_tried: self.is_tried,
            improves: self.improves,
        };
        plan_fleet(&problem, &mut self.effort)
    }

    /// Plans every drone alone among the zones: how long that takes, and which have no path.
    fn kept_out_by_zones(
        &mut self,
        empty: &Costmap,
        excluded: &[(DroneId, FailureKind)],
    ) -> Vec<(DroneId, FailureKind)> {
        let job = &mut self.job;
        let weights = vec![IMMOVABLE; job.agents.len()];
        let alone = match self.world.planning.motion {
            PathMotion::Smooth => MOST_SMOOTH_EXPANSIONS_ALONE,
            PathMotion::Straight => MOST_EXPANSIONS_ALONE,
        };
        let most = self.most_expansions.map_or(alone, |most| most.min(alone));
        let setting = SearchSetting {
            most_expansions: most,
            ..SearchSetting::judged(&job.roadmap, empty, &weights, self.control.stop)
        };
        let known = |drone: DroneId| excluded.iter().any(|(other, _)| *other == drone);
        let is_asked = |agent: &&Agent| {
            // A drone late without any zone is told so.
            let is_late = || agent.is_timed() && agent.comes_late(&job.roadmap).is_some();
            let is_open = agent.lower_bound_ticks != UNREACHABLE && !known(agent.drone);
            !agent.stays() && is_open && !is_late()
        };
        let asked = job.agents.iter().filter(is_asked).map(|it| it.drone);
        let asked: Vec<DroneId> = asked.collect();
        let tasks = |drone: &DroneId| self.world.drones[drone.0 as usize].tasks.len();
        let tasks: Vec<_> = asked.iter().map(|it| (*it, 0..tasks(it))).collect();
        let broken = endpoints::breaking_zones_alone(self.world, &tasks);
        let mut out = Vec::new();
        let mut open = Vec::new();
        for (drone, broken) in asked.into_iter().zip(broken) {
            let Some((task, zone)) = broken else {
                open.push(drone);
                continue;
            };
            if !job.is_closed(drone) {
                job.closed.push((drone, task));
            }
            let at_m = self.world.drones[drone.0 as usize].tasks[task].to_m;
            let at = job.agents[drone.0 as usize].reaches(&job.roadmap, task);
            out.push((
                drone,
                FailureKind::Zone(Obstruction::at_task(zone, at_m, at)),
            ));
        }
        let rest = match job.agents.len() <= MOST_SMALL {
            true => MOST_EXPANSIONS_OF_REST.max(most / SHARE_OF_REST),
            false if self.is_tried => MOST_EXPANSIONS_OF_REST_TRIED,
            false => MOST_EXPANSIONS_OF_REST,
        };
        let rest = rest.min(most);
        let mut in_vain = vec![0; self.world.zones.len()];
        let mut stopped = Vec::new();
        for some in open.chunks(AT_A_TIME) {
            let is_known = in_vain.iter().any(|drones| *drones >= AT_A_TIME);
            let setting = SearchSetting {
                most_expansions: if is_known { rest } else { most },
                ..setting
            };
            let found = some.par_iter();
            let found = found.map(|drone| {
                let agent = &job.agents[drone.0 as usize];
                let on_time = search(setting, agent);
                match on_time.found {
                    SearchOutcome::Blocked(Some(_)) if agent.is_timed() => {
                        let at_any = search(setting, &agent.at_any_time());
                        (on_time, Some(at_any))
                    }
                    _ => (on_time, None),
                }
            });
            let found: Vec<(Searched, Option<Searched>)> = found.collect();
            for (drone, (on_time, at_any)) in some.iter().zip(found) {
                let Searched { found, expansions } = on_time;
                self.effort.expansions += expansions;
                if let Some(Searched { found, expansions }) = at_any {
                    self.effort.expansions += expansions;
                    // If it has a path when late, no zone stops it.
                    if let SearchOutcome::Path(path) = found {
                        let agent = &mut job.agents[drone.0 as usize];
                        match agent.comes_late_on(&job.roadmap, &path.legs) {
                            Some((task, at)) => out.push((*drone, FailureKind::Late(task, at))),
                            None => agent.lower_bound_ticks = path.arrives.0,
                        }
                        continue;
                    }
                }
                match found {
                    SearchOutcome::Path(path) => {
                        job.agents[drone.0 as usize].lower_bound_ticks = path.arrives.0;
                    }
                    SearchOutcome::Blocked(Some(by)) => {
                        let Obstructor::Zone(zone) = by.by else {
                            continue;
                        };
                        in_vain[zone] += 1;
                        let ended = (expansions >= setting.most_expansions).then_some(expansions);
                        stopped.push((*drone, zone, by, ended));
                    }
                    SearchOutcome::Blocked(None) | SearchOutcome::Stopped => {}
                }
            }
        }
        for (drone, zone, by, ended) in stopped {
            // Where the states ended first, the zone may leave a path: the fleet's search tells,
            // but of drones that it stops like many others.
            if ended.is_none() || in_vain[zone] >= AT_A_TIME {
                out.push((drone, FailureKind::Zone(by)));
                job.ended.extend(ended.map(|states| (drone, states)));
            }
        }
        out.sort_unstable_by_key(|(drone, _)| *drone);
        out
    }

    /// The outcome of a judged plan.
    pub(crate) fn answer(self, plan: Plan, failures: Vec<Failure>, notes: Vec<String>) -> Outcome {
        Outcome::of(Planned {
            plan,
            failures,
            conflicts: self.endpoints.conflicts,
            effort: self.effort,
            notes,
        })
    }
}

/// The sentences of a plan about drones without a path.
pub(crate) fn unplanned_of(failures: &[Failure]) -> Vec<Unplanned> {
    let failures = failures.iter().map(|failure| Unplanned {
        name: failure.drone.clone(),
        reason: failure.cause.to_string(),
        cause: Some(failure.cause.data(&failure.drone)),
    });
    failures.collect()
}

/// What the fleet would do if it were planned without wakes, judged with them: the contrast alone,
/// for worlds that [`plan_world`] finds blocked, and so in order. `None` where even the bodies
/// exclude one another at the start.
pub fn contrast(world: &World, control: &Control<'_>) -> Option<IgnoringDownwash> {
    let endpoints = endpoints::find(world);
    // The worst come first, and bodies are.
    let stuck = |c: &EndpointConflict| {
        c.when == EndpointKind::Starts && matches!(c.why, Exclusion::Bodies { .. })
    };
    if endpoints.conflicts.worst.iter().any(stuck) {
        return None;
    }
    (control.progress)(Progress::IgnoringDownwash);
    ignoring_downwash(
        world,
        &prepare(world, &Passages::of(world), control.stop),
        &endpoints.goals,
        control,
    )
}

/// The same fleet on the same roadmap planned without wakes, judged with them; `None` if
/// it was stopped before the end.
fn ignoring_downwash(
    world: &World,
    job: &Job,
    goals: &[Excluded],
    control: &Control<'_>,
) -> Option<IgnoringDownwash> {
    let bodies = |why: &Exclusion| matches!(why, Exclusion::Bodies { .. });
    let excluded = excluded(job, goals, bodies);
    let costmap = job.costmap_ignoring_downwash(world, world.drones.len());
    // This phase is one to the caller that watches.
    let quiet = Control {
        progress: &|_| {},
        ..*control
    };
    let problem = FleetProblem {
        job,
        costmap: &costmap,
        steps: Steps::new(job.roadmap.lattice(), &job.agents, &costmap),
        excluded: &excluded,
        planning: &world.planning,
        control: &quiet,
        most_expansions: None,
        is_tried: false,
        improves: true,
    };
    let paths = plan_fleet(&problem, &mut Effort::default())?;
    let mut reasons = paths.unplanned.iter().map(|(_, why)| why);
    if reasons.any(|why| *why == FailureKind::Stopped) {
        return None;
    }
    let plan = assemble(world, job, &paths);
    let harm = harm(&plan);
    Some(IgnoringDownwash {
        makespan_s: plan.fleet.makespan_s,
        drones_over_limit: harm.drones_over_limit,
        worst_air_mps: harm.worst_air_mps,
        zones_over_limit: harm.zones_over_limit,
        worst_zone_air_mps: harm.worst_zone_air_mps,
        unplanned: paths.unplanned.len(),
    })
}

/// Drones that stay at their starts whatever the search finds: blocked landings, and enough drones
/// that no two goals exclude each other any more, those in most conflicts first.
fn excluded(
    job: &Job,
    goals: &[Excluded],
    counts: impl Fn(&Exclusion) -> bool,
) -> Vec<(DroneId, FailureKind)> {
    let blocked = |&(drone, lacks)| (DroneId(drone as u32), FailureKind::Landing(lacks));
    let landings = job.blocked_landings.iter().map(blocked);
    let mut out: Vec<(DroneId, FailureKind)> = landings.collect();
    let mut is_out = vec![false; job.agents.len()];
    for (drone, _) in &out {
        is_out[drone.0 as usize] = true;
    }
    // Drones by drone; with a zone, each excludes itself.
    let mut others: Vec<Vec<u32>> = vec![Vec::new(); job.agents.len()];
    for it in goals.iter().filter(|it| counts(&it.why)) {
        let drone = it.drone;
        match it.blocker {
            Blocker::Drone(other) if !is_out[drone] && !is_out[other] => {
                others[drone].push(other as u32);
                others[other].push(drone as u32);
            }
            Blocker::Zone(_) if !is_out[drone] => others[drone].push(drone as u32),
            _ => {}
        }
    }
    let mut open: Vec<usize> = others.iter().map(Vec::len).collect();
    loop {
        let worst = (0..open.len()).max_by_key(|&drone| (open[drone], drone));
        let Some(worst) = worst.filter(|&drone| open[drone] > 0) else {
            break;
        };
        out.push((DroneId(worst as u32), FailureKind::EndpointConflict));
        is_out[worst] = true;
        open[worst] = 0;
        for &other in &others[worst] {
            let other = other as usize;
            if !is_out[other] {
                open[other] -= 1;
            }
        }
    }
    out.sort_unstable_by_key(|(drone, _)| *drone);
    out
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::plan::ViolationKind;
    use crate::scenario::read_world;

    /// The plan of a world without wakes, and its contrast.
    fn without_wakes(text: &str) -> (Plan, IgnoringDownwash) {
        let world = read_world(text).expect("in order");
        let job = prepare(&world, &Passages::of(&world), &|| false);
        let costmap = job.costmap_ignoring_downwash(&world, world.drones.len());
        let problem = FleetProblem::of(&world, &job, &costmap);
        let paths = plan_fleet(&problem, &mut Effort::default()).expect("no budget");
        let plan = assemble(&world, &job, &paths);
        let contrast = contrast(&world, &Control::QUIET).expect("bodies are apart");
        (plan, contrast)
    }

    #[test]
    fn the_contrast_has_the_figures_of_the_whole_verifier() {
        for text in [tools::instances::hall(40, 3), tools::instances::hall(90, 7)] {
            let (plan, contrast) = without_wakes(&text.expect("there is room"));
            let report = verify(&plan);
            let air = [ViolationKind::Air, ViolationKind::Column];
            let violations = report.violations.iter();
            let over = violations.filter(|violation| air.contains(&violation.kind));
            let over: BTreeSet<&str> = over.map(|violation| violation.drone.as_str()).collect();
            assert!(over.len() > 3, "{}", over.len());
            assert_eq!(contrast.drones_over_limit, over.len());
            let worst_mps = report.exposures.iter().map(|met| met.worst_air_mps);
            let worst_mps = worst_mps.fold(0.0, f64::max);
            // Both to a part in a thousand and 0.0001 of an induced velocity.
            let apart = (contrast.worst_air_mps / worst_mps - 1.0).abs();
            assert!(apart < 1.5e-3, "{contrast:?} {worst_mps}");
            assert_eq!(contrast.makespan_s, plan.fleet.makespan_s);
        }
    }

    #[test]
    fn the_contrast_counts_a_drone_that_ends_hovering_under_another() {
        let drone = |name: &str, y: f64, z: f64| {
            format!(
                r#"(name: "{name}", airframe: "offboard-2", start_m: (1.5, {y}, {z}), tasks: [(to_m: (9.5, 3.5, {z}))])"#
            )
        };
        // The upper one arrives last, and stays.
        let text = format!(
            r#"(name: "stacked", bounds_m: (min: (0, 0, 0), max: (12, 8, 8)), drones: [{}, {}])"#,
            drone("lower", 3.5, 1.5),
            drone("upper", 6.5, 4.5)
        );
        let (_, contrast) = without_wakes(&text);
        assert_eq!(contrast.drones_over_limit, 1, "{contrast:?}");
        assert!(contrast.worst_air_mps > 4.0, "{contrast:?}");
    }
}
