//! A plan changed while it is flown: drones are late, come, are taken out, or are given something
//! else to do.
//!
//! [`Running`] is what a fleet manager keeps between changes. Up to the moment of a change the plan
//! is history. From there on only the drones asked to change and the drones they evict change; all
//! others keep their trajectories to the last byte. A drone between two places flies on to the next
//! one before it does anything else, and only a new task interrupts a dwell that has begun. A drone
//! without a path goes on with the one it had, or stops if that is none any more; a drone that
//! comes without a path is not let in.
//!
//! ```
//! use planner::replan::change::Change;
//! use planner::replan::rolling::Running;
//! use planner::{Control, Outcome, scenario::world::Task};
//!
//! let text = tools::instances::hall(12, 1)?;
//! let world = planner::read_world(&text).expect("in order");
//! let outcome = planner::plan_world(&world, &Control::QUIET)?;
//! let plan = outcome.into_planned().expect("a plan").plan;
//! let second = plan.drones[1].clone();
//!
//! let mut running = Running::new(world, plan)?;
//! let elsewhere = Task { to_m: [32.5, 32.5, 4.5].into(), dwell_s: 2.0, load_kg: None, during_s: None };
//! let changes = [
//!     Change::Late { drone: "d1".to_owned(), by_s: 1.5 },
//!     Change::Retasked { drone: "d3".to_owned(), tasks: vec![elsewhere] },
//! ];
//! let told = running.replan(5.0, &changes, &Control::QUIET).expect("changes in order");
//! for changed in &told.changed {
//!     println!("{}: {:?}", changed.drone, changed.cause);
//! }
//! assert!(running.plan().violations.is_empty());
//! assert_eq!(running.plan().drones[1].trajectory, second.trajectory);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, OnceLock};

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, KindId, Leg, Tick};
use costmap::reservations::over_time::BUCKET_TICKS;
use costmap::verdict::{Blocker, Verdict, Why};
use nalgebra::Point3;
use serde::Serialize;

use super::change::{self, Change, ChangeError};
use super::track::{Track, TrackState, cut, legs_of, path_deviation_m};
use super::{GivenError, given};
use crate::graph::agent::{Agent, Ending, FIRST_TOLERANCE_TICKS, TOLERANCE_TICKS};
use crate::graph::distances::{Distances, UNREACHABLE};
use crate::graph::lattice::Lattice;
use crate::graph::passage::Passages;
use crate::graph::roadmap::{Stop, Vertex};
use crate::plan::file::{arrival_s, arrivals_s};
use crate::plan::outcome::{Control, Effort, Progress};
use crate::plan::trajectory::SAME_PLACE_M;
use crate::plan::{AtEnd, DronePlan, Plan, TrajectoryEntry, Unplanned, Violation, ViolationKind};
use crate::scenario::Problems;
use crate::scenario::limits::BUSY_S;
use crate::scenario::placement::landing_place_m;
use crate::scenario::solid::Solids;
use crate::scenario::world::{AtStart, Drone, PathMotion, Task, World};
use crate::sipp::conflicts::Steps;
use crate::solver::assemble::{
    blank, fleet, rounded, stay_until_arrival, write_arrival, write_legs,
};
use crate::solver::explain::known_cause;
use crate::solver::prepare::{AgentTasks, Job, agent_of, ending_from, goals_of, prepare, start_of};
use crate::solver::priority::{Affected, Paths, Repair};
use crate::verify::{DroneExposure, Judgements, exposed, exposures, judged, verify_again};

/// Room for drones that come later: chosen here, so that the costmap is seldom made anew.
const SPARE_DRONES: usize = 64;

/// A plan that is being flown, and what planning on needs: the roadmap, the distances to every
/// goal, and all legs in the costmap. A copy plans on as the original would: keep one to take
/// changes back.
#[derive(Clone, Debug)]
pub struct Running {
    /// With the drones that came, and the last tasks of all.
    world: World,
    /// What has been flown and what will be, verified; without what air drones meet.
    plan: Plan,
    /// The same with it, once it is asked for.
    whole: OnceLock<Arc<Plan>>,
    /// What the verifier has found of it.
    judgements: Judgements,
    /// The world's obstacles and zones that keep bodies out, for places that are new.
    solids: Arc<Solids>,
    /// Its roadmap grows with new stops; its agents are those of the last change.
    job: Job,
    /// What every drone still flies.
    costmap: Costmap,
    /// The tables of the fleet's steps, where there are any and no costmap was made since.
    steps: Option<Steps>,
    /// By drone, in the plan's order.
    tracks: Vec<Track>,
    /// Everything before is history.
    known: Tick,
}

/// What became of some changes.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Replanned {
    /// The moment of the changes: `at_s` rounded up to whole hundredths of a second (s).
    pub from_s: f64,
    /// The drones that have another trajectory now, in the order of the plan.
    pub changed: Vec<Changed>,
    /// The drones without a path, in the order of the plan: one that was given another task goes on
    /// with what it had, one that is late follows its plan as late as it is, and one that comes is
    /// not let in. One that would conflict with others like that, or is evicted by one that stops,
    /// stops as well.
    pub refused: Vec<Unplanned>,
    /// Violations that are not over: those that begin before the drones in them can change their
    /// flight, as of a late drone already in another's way or margins; those of a drone that has no
    /// path and conflicts with others whether it stops or goes on; those with a drone that is gone,
    /// if the other has no path out. None that a drone was sent into. They are in the plan, too.
    pub unavoidable: Vec<Violation>,
    /// What the search did.
    pub effort: Effort,
}

/// A drone with another trajectory.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Changed {
    /// Its name.
    pub drone: String,
    /// Why.
    pub cause: Cause,
}

/// Why a drone has another trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// It is late.
    Late,
    /// It has come.
    Added,
    /// It was taken out.
    Removed,
    /// It has failed.
    Failed,
    /// It is what lies where a drone came down.
    Wreck,
    /// It is another planner's, and that has said what it flies.
    Fixed,
    /// It has something else to do, or is to land.
    Retasked,
    /// It was evicted by one of these.
    GaveWay,
}

impl Running {
    /// Takes over a plan and the world that it was made for. Rules that the world leaves open are
    /// the plan's.
    ///
    /// # Errors
    ///
    /// The world is not in order, the plan has other drones than it, or a trajectory that cannot be
    /// read.
    pub fn new(world: World, plan: Plan) -> Result<Running, GivenError> {
        let world = world.ruled_as(&plan);
        check(&world, &plan)?;
        let mut job = prepare(&world, &Passages::of(&world), &|| false);
        let agents = std::mem::take(&mut job.agents);
        let mut tracks = Vec::with_capacity(agents.len());
        for ((agent, drone), entry) in agents.into_iter().zip(&world.drones).zip(&plan.drones) {
            let planned = !plan.is_unplanned(&entry.name);
            let stops = agent.mover.stops().iter();
            let stops_m: Vec<_> = stops.map(|&stop| job.roadmap.position_m(stop)).collect();
            let path = path_of(entry, &agent, (job.roadmap.lattice(), &stops_m))?;
            let whole = legs_of(agent.drone, &path, !planned, |mass_kg| {
                job.kinds.kind(&drone.vehicle, mass_kg)
            });
            let cut = |leg: &Leg| cut(leg, job.roadmap.lattice(), &stops_m);
            tracks.push(Track {
                legs: whole.iter().flat_map(cut).collect(),
                agent,
                since: Tick(0),
                planned,
                is_fixed: false,
                is_gone: false,
                wake_persistence_ticks: 0,
            });
        }
        let drones = plan.drones.len();
        let known = Tick(0);
        let mut running = Running {
            solids: Arc::new(Solids::of(&world)),
            costmap: filled(&mut job, &world, &mut tracks, known),
            steps: None,
            judgements: Judgements::default(),
            world,
            whole: OnceLock::from(Arc::new(plan.clone())),
            plan: exposed(plan, vec![DroneExposure::default(); drones]),
            job,
            tracks,
            known,
        };
        running.tabulate();
        verify_again(&running.plan, &mut running.judgements);
        Ok(running)
    }

    /// The plan as it is now: what has been flown and what will be. What air drones meet in it is
    /// found when it is asked for first after a change: a patch does without.
    pub fn plan(&self) -> &Plan {
        self.whole.get_or_init(|| {
            let met = exposures(&self.plan);
            Arc::new(exposed(self.plan.clone(), met))
        })
    }

    /// The same without what air drones meet: its figures are 0.
    pub fn flown(&self) -> &Plan {
        &self.plan
    }

    /// The world as it is now: with the drones that came, and the last tasks of all.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// From when on a change at a time (s) has any effect: that, rounded up to whole hundredths.
    pub fn moment_s(at_s: f64) -> f64 {
        Tick(Tick::lasting(at_s)).seconds()
    }

    /// Plans on from a moment, with these changes, and verifies the whole plan. Times go on
    /// counting from where the plan began, in whole hundredths of a second: `at_s` is rounded up.
    ///
    /// The same changes to the same plan give the same bytes on any number of threads.
    ///
    /// # Errors
    ///
    /// All that is wrong with the changes; then nothing has changed.
    pub fn replan(
        &mut self,
        at_s: f64,
        changes: &[Change],
        control: &Control<'_>,
    ) -> Result<Replanned, Vec<ChangeError>> {
        self.check(at_s, changes)?;
        let at = self.moment(at_s).map_err(|error| vec![error])?;
        self.known = at;
        let (replanned, could_change) = apply_and_replan(self, at, changes, control);
        (control.progress)(Progress::Verifying);
        self.judge();
        // Within a margin of both clocks what is judged is where a drone was before, too.
        let margin_s = 2.0 * self.plan.margins.time_s;
        let early = |violation: &&Violation| {
            let released = |name: &str| could_change.iter().find(|it| it.drone == name);
            let names = [Some(violation.drone.as_str()), violation.with.as_deref()];
            let involved: Vec<_> = names.into_iter().flatten().filter_map(released).collect();
            let is_with_margin = violation.kind != violation.kind.without_margin();
            let early_s = if is_with_margin { margin_s } else { 0.0 };
            let is_early = |it: &Released| violation.from_s - early_s < it.at.seconds();
            // With one that is gone only the other can move, if it has another path.
            let has_none = |it: &Released| replanned.refused.iter().any(|out| out.name == it.drone);
            let stays = |it: &Released| it.is_gone || is_early(it) || has_none(it);
            let is_any_gone = involved.iter().any(|it| it.is_gone);
            let is_too_late = match is_any_gone {
                true => involved.iter().all(|it| stays(it)),
                false => involved.iter().any(|it| it.is_lost || is_early(it)),
            };
            // A plan that contradicts itself is never handed out.
            violation.kind != ViolationKind::Malformed
                && violation.from_s >= 0.0
                && violation.matters_from(at.seconds())
                && is_too_late
                // A drone sent into it could have stayed.
                && !involved.iter().any(|it| it.is_sent && !is_early(it))
        };
        let unavoidable = self.plan.violations.iter().filter(early).cloned().collect();
        Ok(Replanned {
            from_s: at.seconds(),
            unavoidable,
            ..replanned
        })
    }

    /// All that is wrong with changes at a moment, as [`Running::replan`] would say.
    ///
    /// # Errors
    ///
    /// What is wrong.
    pub fn check(&self, at_s: f64, changes: &[Change]) -> Result<(), Vec<ChangeError>> {
        let at = self.moment(at_s).map_err(|error| vec![error])?;
        match self.problems(at, changes) {
            problems if problems.is_empty() => Ok(()),
            problems => Err(problems),
        }
    }

    fn problems(&self, at: Tick, changes: &[Change]) -> Vec<ChangeError> {
        let roadmap = &self.job.roadmap;
        change::problems(
            &self.world,
            &self.solids,
            (at.seconds(), self.job.roadmap.widest_m()),
            changes,
            |index| self.tracks[index].is_there(roadmap, at),
            |index| {
                let state = self.tracks[index].state_without_tasks(roadmap, at);
                match state {
                    TrackState::Flies { at_m, grounded, .. } => Some((at_m, grounded)),
                    TrackState::Absent | TrackState::Ends => None,
                }
            },
            |index| self.tracks[index].is_fixed,
        )
    }

    /// Whether a drone, by its index in the plan, has come by a time (s), and has neither left nor
    /// been taken out; false where the plan has no such drone.
    pub fn is_there(&self, drone: usize, at_s: f64) -> bool {
        let at = Tick(Tick::lasting(at_s));
        let track = self.tracks.get(drone);
        track.is_some_and(|track| track.is_there(&self.job.roadmap, at))
    }

    /// Where a drone, by its index in the plan, stands on the ground at a time (s), if it does and
    /// can be kept there (m), and whether it takes off again.
    pub fn on_ground(&self, drone: usize, at_s: f64) -> Option<(Point3<f64>, bool)> {
        let at = Tick(Tick::lasting(at_s));
        let track = self.tracks.get(drone)?;
        let now = (track.legs.iter()).position(|leg| leg.start <= at && at < leg.end)?;
        let rises = track.legs[now..].iter().find(|leg| leg.flying);
        // What it flies until then is settled.
        let settled = at.after(track.agent.lead_ticks());
        let stays = !track.legs[now].flying && rises.is_none_or(|leg| settled <= leg.start);
        // It touches down that much after its path does.
        let flew = track.legs[..now].iter().rfind(|leg| leg.flying);
        let is_down = flew.is_none_or(|leg| leg.end.after(track.agent.lead_ticks()) <= at);
        let stays = stays && is_down;
        stays.then(|| (track.legs[now].from_m, rises.is_some()))
    }

    /// Takes note of what drones of other planners fly from a moment on, each by its whole
    /// trajectory, and verifies the whole plan. Unlike [`Change::Fixed`] it changes nothing that is
    /// planned here: what it breaks is among the plan's violations. A drone that was planned here
    /// is the other's from now on.
    ///
    /// # Errors
    ///
    /// All that is wrong with them; then nothing has changed.
    pub fn note(&mut self, at_s: f64, theirs: &[DronePlan]) -> Result<(), Vec<ChangeError>> {
        let at = self.moment(at_s).map_err(|error| vec![error])?;
        let wrong = theirs.iter().filter_map(|it| given(it, &self.world).err());
        let wrong = wrong.map(|it| ChangeError::Given(Box::new(it)));
        let mut names = BTreeSet::new();
        let twice = theirs.iter().filter(|it| !names.insert(it.name.as_str()));
        let twice = twice.map(|it| ChangeError::Twice(it.name.clone()));
        let wrong: Vec<_> = wrong.chain(twice).collect();
        if !wrong.is_empty() {
            return Err(wrong);
        }
        self.known = at;
        let fits = self.fit();
        for entry in theirs {
            let index = self.index(&entry.name);
            let mut attempt = ReplanAttempt {
                running: self,
                at,
                pending: BTreeMap::new(),
            };
            attempt.fix(index, entry, Cause::Fixed);
        }
        if self.has_outgrown(fits) {
            self.fill_costmap();
        } else {
            for entry in theirs {
                if let Some(index) = self.index(&entry.name) {
                    self.costmap.remove(id(index));
                    self.costmap.insert(self.tracks[index].flown_from(at));
                }
            }
        }
        self.judge();
        Ok(())
    }

    /// Of the drone that has a name.
    fn index(&self, name: &str) -> Option<usize> {
        self.world.drones.iter().position(|it| it.name == name)
    }

    /// For what the costmap is made: how many kinds, and how far off its legs others fly (m).
    fn fit(&self) -> (usize, f64) {
        (self.job.kinds.len(), self.job.fixed_path_deviation_m)
    }

    /// Whether the costmap has to be made anew for what has come since.
    fn has_outgrown(&self, (kinds, path_deviation_m): (usize, f64)) -> bool {
        let conditions = self.costmap.fleet().conditions();
        self.job.kinds.len() > kinds
            || self.job.fixed_path_deviation_m > path_deviation_m
            || self.tracks.len() > self.costmap.drone_count()
            || self.world.drones.iter().any(|drone| {
                drone.air_limit < conditions.lowest_air_limit
                    || drone.vehicle.max_speed_mps > conditions.fastest_mps
            })
    }

    /// Drops what was flown before a time (s), as far as nothing still depends on it: of each drone
    /// up to where it last stood still before, and drones that had left by then. What is left
    /// begins later (`enters_s`), and goes on as it was. Without this a plan grows for as long as
    /// it is flown. The same calls give the same bytes.
    pub fn forget(&mut self, before_s: f64) {
        if !BUSY_S.contain(before_s) {
            return;
        }
        let before = Tick(Tick::lasting(before_s)).min(self.known);
        let mut kept = Vec::with_capacity(self.tracks.len());
        for (index, track) in self.tracks.iter_mut().enumerate() {
            let is_there = !track.has_left(before);
            kept.push(is_there);
            if is_there
                && !track.is_fixed
                && let Some(since) = track.forget(&self.job.roadmap, before)
            {
                let entry = &mut self.plan.drones[index];
                entry.enters_s = Some(since.seconds());
                entry.at_start = if track.agent.grounded {
                    AtStart::Landed
                } else {
                    AtStart::Hover
                };
                let kinds = &self.job.kinds;
                write_legs(entry, &track.agent, &track.legs, |leg| {
                    kinds.mass_kg(leg.kind)
                });
                stay_until_arrival(entry);
                let left = track.agent.waypoints.len();
                let tasks = &mut self.world.drones[index].tasks;
                tasks.drain(..tasks.len().saturating_sub(left));
                self.world.drones[index].start_m = track.legs[0].from_m;
                self.world.drones[index].at_start = entry.at_start;
            }
        }
        if kept.contains(&false) {
            self.tracks = of_kept(std::mem::take(&mut self.tracks), &kept);
            self.plan.drones = of_kept(std::mem::take(&mut self.plan.drones), &kept);
            self.world.drones = of_kept(std::mem::take(&mut self.world.drones), &kept);
            let names: BTreeSet<&str> = self.plan.drones.iter().map(|it| &it.name[..]).collect();
            (self.plan.unplanned).retain(|one| names.contains(&one.name[..]));
            for (index, track) in self.tracks.iter_mut().enumerate() {
                track.agent.drone = id(index);
                track.agent.tolerated_drones.clear();
                let begun = track.agent.begun.iter_mut();
                for leg in track.legs.iter_mut().chain(begun) {
                    leg.drone = id(index);
                }
            }
        }
        self.forget_kinds();
        let flown = self.world.drones.iter().zip(&self.plan.drones);
        let fixed = flown.zip(&self.tracks).filter(|(_, track)| track.is_fixed);
        let path_deviation_m = fixed.map(|((drone, entry), _)| path_deviation_m(drone, entry));
        self.job.fixed_path_deviation_m = path_deviation_m.fold(0.0, f64::max);
        self.fill_costmap();
        self.judgements.forget(&self.plan);
        // What is told of it follows from what is left.
        self.judge();
    }

    /// Drops vehicles and masses that are not flown any more, nor will be.
    fn forget_kinds(&mut self) {
        let of_legs = |track: &Track| {
            let legs = track.legs.iter().chain(&track.agent.begun);
            let mut kinds: Vec<KindId> = legs.map(|leg| leg.kind).collect();
            kinds.extend(&track.agent.kinds);
            kinds
        };
        let used: BTreeSet<KindId> = self.tracks.iter().flat_map(of_legs).collect();
        let renumbered = self.job.kinds.keep(&used);
        for track in &mut self.tracks {
            let legs = track.legs.iter_mut().chain(&mut track.agent.begun);
            let kinds = legs.map(|leg| &mut leg.kind);
            for kind in kinds.chain(&mut track.agent.kinds) {
                *kind = renumbered[kind];
            }
        }
    }

    /// The whole tick of a time (s), rounded up.
    fn moment(&self, at_s: f64) -> Result<Tick, ChangeError> {
        if !BUSY_S.contain(at_s) {
            return Err(ChangeError::Time(at_s));
        }
        let at = Tick(Tick::lasting(at_s));
        if at < self.known {
            return Err(ChangeError::Past {
                at_s,
                known_s: self.known.seconds(),
            });
        }
        Ok(at)
    }

    /// A costmap with room for more, and what all drones still fly in it.
    fn fill_costmap(&mut self) {
        self.costmap = filled(&mut self.job, &self.world, &mut self.tracks, self.known);
        self.steps = None;
    }

    /// Tables for the fleet as it is in the costmap.
    fn tabulate(&mut self) {
        let (agents, costmap) = (&self.job.agents, &self.costmap);
        self.steps = match &self.steps {
            Some(steps) => steps.renewed(agents, costmap),
            None => Steps::new(self.job.roadmap.lattice(), agents, costmap),
        };
    }

    /// Judges the whole plan, and sums over the fleet anew. Verifies only drones that a change can
    /// affect.
    fn judge(&mut self) {
        let plan = &self.plan;
        let is_planned = |drone: &DronePlan| !plan.is_unplanned(&drone.name);
        self.plan.fleet = fleet(&plan.drones, is_planned);
        self.plan.ignoring_downwash = None;
        self.whole = OnceLock::new();
        let report = verify_again(&self.plan, &mut self.judgements);
        let unplanned = self.plan.unplanned.clone();
        self.plan = judged(self.plan.clone(), report, unplanned);
    }
}

/// Those that are to be kept.
fn of_kept<T>(all: Vec<T>, kept: &[bool]) -> Vec<T> {
    let kept = all.into_iter().zip(kept).filter(|(_, kept)| **kept);
    kept.map(|(it, _)| it).collect()
}

/// The costmap of what all drones fly from a moment on, with room for more.
fn filled(job: &mut Job, world: &World, tracks: &mut [Track], known: Tick) -> Costmap {
    // How far what they fly is from its legs.
    job.agents = tracks.iter().map(|it| it.agent.clone()).collect();
    let mut costmap = job.costmap(world, tracks.len() + SPARE_DRONES);
    for track in tracks {
        track.wake_persistence_ticks = costmap.wake_persistence_ticks();
        costmap.insert(track.flown_from(known));
    }
    costmap
}

/// Whether this is the plan of this world, and can be flown.
fn check(world: &World, plan: &Plan) -> Result<(), GivenError> {
    if let Err(Problems(faults)) = world.check() {
        let first = faults.into_iter().next();
        return first.map_or(Ok(()), |it| Err(GivenError::World(Box::new(it))));
    }
    if world.drones.len() != plan.drones.len() {
        return Err(GivenError::Count {
            plan: plan.drones.len(),
            world: world.drones.len(),
        });
    }
    for (index, (drone, entry)) in world.drones.iter().zip(&plan.drones).enumerate() {
        if drone.name != entry.name {
            return Err(GivenError::Name {
                index,
                plan: entry.name.clone(),
                world: drone.name.clone(),
            });
        }
        given(entry, world)?;
    }
    Ok(())
}

/// A drone's part of a plan with the path that it is flown of, at the very places of the lattice
/// and of its stops (m); an error where its curves are of no such path.
fn path_of<'a>(
    entry: &'a DronePlan,
    agent: &Agent,
    (lattice, stops_m): (&Lattice, &[Point3<f64>]),
) -> Result<Cow<'a, DronePlan>, GivenError> {
    let Some(smoothing) = &agent.smoothing else {
        return Ok(Cow::Borrowed(entry));
    };
    let unusable = || GivenError::Unusable {
        drone: entry.name.clone(),
        why: "its trajectory is not one that it can be made to leave: no path averaged over time \
              within its limits"
            .to_owned(),
    };
    let path = smoothing.kernel.path_of(&entry.trajectory);
    let mut path = path.ok_or_else(unusable)?;
    for t_s in &mut path.t_s {
        // The search counts whole ticks.
        *t_s = (*t_s * Tick::PER_SECOND).round() / Tick::PER_SECOND;
    }
    for at_m in &mut path.position_m {
        let place = lattice.at(lattice.nearest(at_m));
        let place_m = place.map(|place| lattice.position_m(place));
        let mut known_m = stops_m.iter().copied().chain(place_m);
        let same = |known_m: &Point3<f64>| (known_m - *at_m).norm() < SAME_PLACE_M;
        *at_m = known_m.find(same).unwrap_or(*at_m);
    }
    let lead_s = Tick(smoothing.lead_ticks()).seconds();
    let (from_s, until_s) = entry.airborne_s;
    let from_s = match entry.at_start {
        // One that never rises is in the air for no time.
        AtStart::Landed if until_s.is_none_or(|until_s| until_s > from_s) => from_s + lead_s,
        _ => from_s,
    };
    let until_s = match entry.has_landed() {
        true => until_s.map(|until_s| until_s - lead_s),
        false => until_s,
    };
    let rests_s = entry.landed_s.iter();
    Ok(Cow::Owned(DronePlan {
        trajectory: path,
        airborne_s: (from_s, until_s),
        landed_s: rests_s.map(|it| (it.0 - lead_s, it.1 + lead_s)).collect(),
        ..entry.clone()
    }))
}

/// When a drone's flight can change.
struct Released {
    /// Its name.
    drone: String,
    /// From then on.
    at: Tick,
    /// It has a path now to what it was told to do.
    is_sent: bool,
    /// It stops, and is gone.
    is_gone: bool,
    /// It has no path, and conflicts with others whether it stops or goes on.
    is_lost: bool,
}

/// What is remembered of a drone until its change is known to be possible.
struct PendingChange {
    /// What the caller changed about it.
    cause: Cause,
    /// As it was, if it goes on with that when there is no path.
    before: Option<(Track, Drone)>,
    /// No path is looked for: what it flies is settled.
    settled: bool,
}

/// Applies the changes, which are in order, and plans the drones affected. A drone that comes and
/// finds no path is not let in: the others are planned without it.
fn apply_and_replan(
    running: &mut Running,
    at: Tick,
    changes: &[Change],
    control: &Control<'_>,
) -> (Replanned, Vec<Released>) {
    let comes = |change: &Change| matches!(change, Change::Added(_));
    let mut changes = changes.to_vec();
    let mut turned_away = Vec::new();
    loop {
        let before = (changes.iter().any(comes)).then(|| {
            let Running { world, plan, .. } = &*running;
            (world.clone(), plan.clone(), running.tracks.clone())
        });
        let attempt = ReplanAttempt {
            running,
            at,
            pending: BTreeMap::new(),
        };
        match attempt.plan(&changes, control) {
            Ok((mut replanned, released)) => {
                replanned.refused.extend(turned_away);
                return (replanned, released);
            }
            Err(refused) => {
                changes.retain(|change| {
                    !(comes(change) && refused.iter().any(|out| out.name == change.drone()))
                });
                turned_away.extend(refused);
                if let Some(before) = before {
                    (running.world, running.plan, running.tracks) = before;
                    renew_distances(running);
                    // Drones that come may be in it.
                    running.fill_costmap();
                }
            }
        }
    }
}

/// Distances to a goal are kept by place, and there are other places now.
fn renew_distances(running: &mut Running) {
    for track in &mut running.tracks {
        let mover = track.agent.mover.clone();
        let mut from = track.agent.start;
        for waypoint in &mut track.agent.waypoints {
            let goal = waypoint.distances.goal();
            let anew = Distances::new(&running.job.roadmap, goal, from, mover.clone());
            waypoint.distances = Arc::new(anew);
            from = goal;
        }
    }
}

/// One try, from a moment on.
struct ReplanAttempt<'a> {
    /// Changed in place; restored by the caller where a drone that comes finds no path.
    running: &'a mut Running,
    /// The moment of the changes.
    at: Tick,
    /// By index of the drone.
    pending: BTreeMap<usize, PendingChange>,
}

impl ReplanAttempt<'_> {
    /// Remembers a change, and what was `before`, for a drone without a path.
    fn ask(&mut self, index: usize, cause: Cause, settled: bool, before: Option<(Track, Drone)>) {
        let pending = PendingChange {
            cause,
            before,
            settled,
        };
        self.pending.insert(index, pending);
    }

    /// Applies one change, which is in order, to tracks, tasks and the roadmap's stops.
    fn apply(&mut self, change: &Change) {
        let mut drones = self.running.world.drones.iter();
        let index = drones.position(|drone| drone.name == change.drone());
        match (change, index) {
            (Change::Added(drone), index) => self.add(index, drone),
            (Change::Fixed(entry), index) => self.fix(index, entry, Cause::Fixed),
            (Change::Late { by_s, .. }, Some(index)) => self.fall_behind(index, *by_s),
            (Change::Retasked { tasks, .. }, Some(index)) => {
                let at_end = self.running.world.drones[index].at_end;
                self.retask(index, tasks, at_end);
            }
            (Change::Landed { over_m, .. }, Some(index)) => {
                self.retask(index, &change::landing(*over_m), AtEnd::Land);
            }
            (Change::Removed { .. }, Some(index)) => self.remove(index, Cause::Removed),
            (Change::Failed { lies_m, .. }, Some(index)) => {
                let lies_m = lies_m.unwrap_or_else(|| self.below(index));
                self.remove(index, Cause::Failed);
                self.leave_wreck(index, lies_m);
            }
            (_, None) => {}
        }
    }

    /// Takes a drone out.
    fn remove(&mut self, index: usize, cause: Cause) {
        let track = &mut self.running.tracks[index];
        // It stops before it is gone; one that falls needs about as long to come down. Low over its
        // pad it lands.
        let tracking_m = self.running.plan.margins.tracking_m;
        let lands = track.lands_next(self.at.after(track.agent.lead_ticks()), tracking_m);
        let stops = lands.map(|it| it.after(1).before(track.agent.lead_ticks()));
        track.stop(stops.unwrap_or(self.at));
        track.is_gone = true;
        track.agent.waypoints.clear();
        track.agent.kinds.truncate(1);
        self.running.world.drones[index].tasks.clear();
        // Its air is still under way.
        let rest = track.flown_from(self.at);
        self.running.costmap.remove(id(index));
        self.running.costmap.insert(rest);
        self.ask(index, cause, true, None);
    }

    /// On the highest surface below where the plan has a drone (m).
    fn below(&self, index: usize) -> Point3<f64> {
        let Running { world, plan, .. } = &*self.running;
        let at_m = plan.drones[index].trajectory.position_m(self.at.seconds());
        let at_m = at_m.unwrap_or(world.drones[index].start_m);
        let radius_m = world.drones[index].vehicle.body_radius_m;
        landing_place_m(&world.bounds_m, &self.running.solids, at_m, radius_m)
    }

    /// Leaves the body of a drone where it lies.
    fn leave_wreck(&mut self, index: usize, lies_m: Point3<f64>) {
        let failed = &self.running.world.drones[index];
        // Not before the drone itself is gone, nor, where it lies at the drone's own place, while
        // that may still be there by another clock.
        let last = self.running.tracks[index].legs.last();
        let at = last.map_or(self.at, |last| last.end.max(self.at));
        let reach_m = 2.0 * (failed.vehicle.body_radius_m + self.running.plan.margins.tracking_m);
        let touches = last.is_some_and(|last| (last.to_m - lies_m).norm() < reach_m);
        let apart = Tick::lasting(2.0 * self.running.plan.margins.time_s);
        let at = match touches && apart > 0 {
            true => at.after(apart + 1),
            false => at,
        };
        let at_s = at.seconds();
        let trajectory = TrajectoryEntry {
            t_s: vec![at_s],
            position_m: vec![lies_m],
            mass_kg: vec![failed.vehicle.airframe.mass_kg()],
            ..TrajectoryEntry::default()
        };
        let wreck = DronePlan {
            name: change::wreck_of(&failed.name, &self.running.world.drones),
            enters_s: (at > Tick(0)).then_some(at_s),
            at_start: AtStart::Landed,
            at_end: AtEnd::Land,
            airborne_s: (at_s, Some(at_s)),
            trajectory,
            arrives_s: at_s,
            ..blank(&self.running.world, failed)
        };
        self.fix(None, &wreck, Cause::Wreck);
    }

    /// Takes what is flown here, whatever is planned; it cannot be evicted.
    fn fix(&mut self, index: Option<usize>, entry: &DronePlan, cause: Cause) {
        let running = &mut *self.running;
        // It is held against the world's rules before.
        let Ok(drone) = given(entry, &running.world) else {
            return;
        };
        let index = index.unwrap_or(running.tracks.len());
        let kinds = &mut running.job.kinds;
        let own = vec![kinds.kind(&drone.vehicle, drone.vehicle.airframe.mass_kg())];
        let mut legs = legs_of(id(index), entry, false, |kg| kinds.kind(&drone.vehicle, kg));
        running.job.fixed_path_deviation_m = running
            .job
            .fixed_path_deviation_m
            .max(path_deviation_m(&drone, entry));
        // Where it starts is not asked of what is not planned.
        let agent_tasks = AgentTasks {
            roadmap: &running.job.roadmap,
            tasks: &[],
            vertices: &[0],
            clearance_m: running.world.planning.gap_to_solids_m(),
            motion: PathMotion::Straight,
        };
        let agent = agent_of(id(index), &drone, &agent_tasks, own, Ending::Hover);
        legs.retain(|leg| leg.end > self.at.before(running.costmap.wake_persistence_ticks()));
        let track = Track {
            legs,
            agent,
            since: self.at,
            planned: true,
            is_fixed: true,
            is_gone: false,
            wake_persistence_ticks: running.costmap.wake_persistence_ticks(),
        };
        if index < running.tracks.len() {
            running.tracks[index] = track;
            running.world.drones[index] = drone;
            running.plan.drones[index] = entry.clone();
        } else {
            running.tracks.push(track);
            running.world.drones.push(drone);
            running.plan.drones.push(entry.clone());
        }
        running.plan.unplanned.retain(|one| one.name != entry.name);
        self.ask(index, cause, true, None);
    }

    /// Sets a drone back by a time (s), at most to where its track begins; nothing to do for one at
    /// rest.
    fn fall_behind(&mut self, index: usize, by_s: f64) {
        let (at, roadmap) = (self.at, &self.running.job.roadmap);
        let track = &mut self.running.tracks[index];
        let first = track.legs.first().map_or(at, |leg| leg.start);
        let by = Tick::lasting(by_s).min(at.0 - first.0);
        let was = Tick(at.0 - by);
        // What is flown at a moment depends on the path this much earlier, too.
        let since = was.before(track.agent.lead_ticks());
        let mut ahead = track.legs.iter().filter(|leg| leg.end > since);
        if by == 0 || ahead.all(Leg::stays) && track.state(roadmap, was) == TrackState::Ends {
            // It is where it stays.
            return;
        }
        track.fall_behind(roadmap, at, by);
        let settled = track.state(roadmap, at) == TrackState::Ends;
        let entry = &mut self.running.plan.drones[index];
        if entry.arrives_s > was.seconds() {
            entry.arrives_s = rounded(entry.arrives_s + Tick(by).seconds());
        }
        self.ask(index, Cause::Late, settled, None);
    }

    /// Lets a drone in at its start; it stays there until it has a path. One that another planner
    /// has flown there hovers there before, too.
    fn add(&mut self, known: Option<usize>, drone: &Drone) {
        let index = known.unwrap_or(self.running.tracks.len());
        let grounded = drone.at_start == AtStart::Landed;
        let start = self.start(drone, drone.start_m, grounded);
        let hovers = known.and_then(|it| self.hovers(it, drone));
        let (since, mass_kg) = hovers.unwrap_or((self.at, drone.vehicle.airframe.mass_kg()));
        let kind = self.running.job.kinds.kind(&drone.vehicle, mass_kg);
        match known {
            Some(index) => self.running.world.drones[index] = drone.clone(),
            None => self.running.world.drones.push(drone.clone()),
        }
        let agent = Agent {
            grounded,
            is_sent: true,
            departs: self.at,
            ..self.agent(index, start, kind, &drone.tasks)
        };
        let track = Track {
            legs: vec![Leg {
                start: since,
                ..agent.stays_from_departure(&self.running.job.roadmap)
            }],
            agent,
            since: self.at,
            planned: true,
            is_fixed: false,
            is_gone: false,
            wake_persistence_ticks: self.running.costmap.wake_persistence_ticks(),
        };
        let mut entry = blank(&self.running.world, drone);
        entry.enters_s = (since > Tick(0)).then(|| since.seconds());
        match known {
            Some(index) => {
                self.running.tracks[index] = track;
                self.running.plan.drones[index] = entry;
            }
            None => {
                self.running.tracks.push(track);
                self.running.plan.drones.push(entry);
            }
        }
        self.ask(index, Cause::Added, false, None);
    }

    /// Since when a drone that another planner has flown to where it starts here hovers there, and
    /// its mass (kg) with what it carries.
    fn hovers(&self, index: usize, drone: &Drone) -> Option<(Tick, f64)> {
        let entry = &self.running.plan.drones[index];
        let TrajectoryEntry {
            t_s,
            position_m,
            mass_kg,
            ..
        } = &entry.trajectory;
        let since = Tick(Tick::lasting(*t_s.last()?));
        let is_there = entry.at_end == AtEnd::Hover
            && since <= self.at
            && (position_m.last()? - drone.start_m).norm() < SAME_PLACE_M;
        mass_kg.last().filter(|_| is_there).map(|kg| (since, *kg))
    }

    /// Gives a drone other tasks, and another end, from where its flight can change; its track ends
    /// there until it has a path.
    fn retask(&mut self, index: usize, tasks: &[Task], at_end: AtEnd) {
        let roadmap = &self.running.job.roadmap;
        let track = &self.running.tracks[index];
        let TrackState::Flies {
            begun,
            departs,
            at_m,
            grounded,
            ..
        } = track.state_without_tasks(roadmap, self.at)
        else {
            return;
        };
        let now = track.legs.iter().find(|leg| leg.end > self.at);
        let last = begun.last().or(now);
        let kind = last.map_or(track.agent.kinds[0], |leg| leg.kind);
        let drone = self.running.world.drones[index].clone();
        let before = (track.clone(), drone.clone());
        let rest = change::resting(at_end, at_m, grounded);
        let tasks = if tasks.is_empty() { &rest } else { tasks };
        // On the ground there is no way down.
        let ends = match at_end {
            AtEnd::Land if tasks.is_empty() => AtEnd::Hover,
            _ => at_end,
        };
        let known = track.vertex_at(roadmap, &at_m);
        let start = known.unwrap_or_else(|| self.start(&drone, at_m, grounded));
        self.running.world.drones[index].tasks = tasks.to_vec();
        self.running.world.drones[index].at_end = ends;
        let agent = Agent {
            departs,
            begun,
            grounded,
            is_sent: true,
            ..self.agent(index, start, kind, tasks)
        };
        self.running.world.drones[index].at_end = at_end;
        let stay = agent.stays_from_departure(&self.running.job.roadmap);
        let track = &mut self.running.tracks[index];
        track.agent = agent;
        track.since = departs;
        track.planned = true;
        // Until there is a path it is one that ends where it can turn.
        track.cut(departs);
        track.go_on(&[stay]);
        self.ask(index, Cause::Retasked, false, Some(before));
    }

    /// The vertex where a drone begins (m).
    fn start(&mut self, drone: &Drone, at_m: Point3<f64>, grounded: bool) -> Vertex {
        let start = start_of(&self.running.world, drone, at_m, grounded);
        self.connect(&[start])[0]
    }

    /// Vertices of stops; those that are new to the roadmap are connected.
    fn connect(&mut self, stops: &[Stop]) -> Vec<Vertex> {
        if stops.is_empty() {
            return Vec::new();
        }
        let running = &mut *self.running;
        let roadmap = &mut running.job.roadmap;
        let known = roadmap.place_count();
        let solids = (!running.solids.is_empty()).then_some(&*running.solids);
        let vertices = roadmap.connect(&running.world.bounds_m, solids, stops);
        if roadmap.place_count() > known {
            renew_distances(running);
        }
        vertices
    }

    /// What a drone has to do from a vertex on, carrying what it carries.
    fn agent(&mut self, index: usize, start: Vertex, kind: KindId, tasks: &[Task]) -> Agent {
        let drone = self.running.world.drones[index].clone();
        let mut vertices = vec![start];
        let goals = goals_of(&self.running.world, &self.running.solids, &drone, tasks);
        let goals: Vec<Stop> = goals.collect();
        vertices.extend(self.connect(&goals));
        let running = &mut *self.running;
        let kinds = running.job.kinds.along(&drone.vehicle, kind, tasks);
        let roadmap = &running.job.roadmap;
        let last_m = roadmap.position_m(vertices[vertices.len() - 1]);
        let ending = ending_from(&running.world, &running.solids, &drone, last_m);
        let agent_tasks = AgentTasks {
            roadmap,
            tasks,
            vertices: &vertices,
            clearance_m: running.world.planning.gap_to_solids_m(),
            motion: running.world.planning.motion,
        };
        // Whether it can land there was asked before.
        let ending = ending.unwrap_or(Ending::Hover);
        let mut agent = agent_of(id(index), &drone, &agent_tasks, kinds, ending);
        agent.chain(roadmap);
        if agent.remaining(roadmap, 0, start) == UNREACHABLE {
            agent.use_channels(roadmap);
        }
        agent
    }

    /// Applies the changes and plans; an error names the drones that come and find no path.
    fn plan(
        mut self,
        changes: &[Change],
        control: &Control<'_>,
    ) -> Result<(Replanned, Vec<Released>), Vec<Unplanned>> {
        let fits = self.running.fit();
        changes.iter().for_each(|change| self.apply(change));
        let running = &mut *self.running;
        if running.has_outgrown(fits) {
            running.fill_costmap();
        }

        let (agents, mut kept) = self.agents();
        let running = &mut *self.running;
        let under_way = agents.iter().map(|agent| agent.departs.max(self.at));
        let under_way: Vec<Tick> = under_way.collect();
        running.job.agents = agents;
        running.tabulate();
        let (mut group, mut settled) = (Vec::new(), Vec::new());
        for (&index, pending) in &self.pending {
            let is_gone = running.tracks[index].is_gone;
            if is_gone || pending.settled {
                kept[index] = running.tracks[index].rest(self.at);
                if !is_gone || !kept[index].is_empty() {
                    settled.push(id(index));
                }
                continue;
            }
            group.push(id(index));
            if let Some((before, _)) = &pending.before {
                kept[index] = before.rest(self.at);
            }
            if pending.cause == Cause::Added {
                kept[index].clear();
            }
            if pending.cause == Cause::Late {
                // A drone cannot be evicted from what began before its flight can change.
                let is_evictable = |it: &Blocker| {
                    let other = it.drone.0 as usize;
                    it.began >= under_way[other] && !kept[other].is_empty()
                };
                let blockers = blockers_at_departure(running, index);
                let firm = blockers.into_iter().filter(|it| !is_evictable(it));
                let firm: BTreeSet<DroneId> = firm.map(|it| it.drone).collect();
                let agent = &mut running.job.agents[index];
                agent.tolerated_drones = firm.into_iter().collect();
                agent.tolerance_ticks = FIRST_TOLERANCE_TICKS;
            }
        }
        let running = &*self.running;
        let affected = Affected {
            group: &group,
            settled: &settled,
            costmap: running.costmap.clone(),
            steps: running.steps.as_ref(),
            under_way,
            kept,
        };
        let weight = running.world.planning.energy_weight;
        let mut effort = Effort::default();
        let (mut stopped, mut went_on) = (BTreeSet::new(), BTreeMap::new());
        let mut repair = Repair::new(&running.job, affected, weight, control, &mut effort);
        repair.run();
        loop {
            let unplanned = repair.unplanned();
            let turned_away = unplanned.iter().filter_map(|(index, why)| {
                let pending = self.pending.get(index);
                pending.filter(|it| it.cause == Cause::Added)?;
                let name = running.world.drones[*index].name.clone();
                let cause = known_cause(&running.world, *why);
                Some(Unplanned {
                    reason: format!("{cause}; it is not let in"),
                    cause: Some(cause.data(&name)),
                    name,
                })
            });
            let turned_away: Vec<Unplanned> = turned_away.collect();
            if !turned_away.is_empty() {
                return Err(turned_away);
            }
            let stuck = self.in_conflict_if_continuing(&repair, &went_on);
            let stopped_in_conflict = match stuck.is_empty() {
                true => stopped_in_conflict(&repair, &stopped),
                false => Vec::new(),
            };
            if stuck.is_empty() && stopped_in_conflict.is_empty() {
                let better = better_continuing(&repair, &stopped, &went_on);
                if better.is_empty() {
                    break;
                }
                for index in better {
                    repair.keep(index, went_on[&index].clone());
                    stopped.remove(&index);
                }
                repair.run_again();
                continue;
            }
            // However near, these drones may depart and fly apart.
            for (index, others) in stopped_in_conflict {
                repair.tolerate(index, others);
            }
            for index in stuck {
                // It stops where it can.
                let agent = &repair.agents()[index];
                let stay = agent.stays_from_departure(&running.job.roadmap);
                let stops = agent.begun.iter().copied().chain([stay]).collect();
                went_on.insert(index, repair.keep(index, stops));
                stopped.insert(index);
            }
            repair.run_again();
        }
        let unplanned = repair.unplanned();
        let unplanned = unplanned.into_iter().map(|(index, _)| index);
        let lost: BTreeSet<usize> = unplanned
            .filter(|index| went_on.contains_key(index) && !stopped.contains(index))
            .collect();
        let under_way = repair.under_way().to_vec();
        let (agents, paths) = repair.into_paths();
        if let Some(agents) = agents {
            self.running.job.agents = agents;
        }
        let mut released = self.released(&under_way, &lost);
        let replanned = Replanned {
            effort,
            ..self.write(&stopped, paths)
        };
        for it in &mut released {
            it.is_sent &= replanned.refused.iter().all(|out| out.name != it.drone);
        }
        Ok((replanned, released))
    }

    /// When each drone's flight can change, of those under way until then; some are lost.
    fn released(&self, under_way: &[Tick], lost: &BTreeSet<usize>) -> Vec<Released> {
        let running = &*self.running;
        let drones = running.world.drones.iter().zip(&running.job.agents);
        let released = |(tick, (drone, agent)): (&Tick, (&Drone, &Agent))| {
            let is_tolerated = !agent.tolerated_drones.is_empty();
            let out = if is_tolerated { TOLERANCE_TICKS } else { 0 };
            // A fixed drone's flight never changes.
            let index = agent.drone.0 as usize;
            let track = &running.tracks[index];
            let at = match track.is_fixed {
                true => Tick::FOREVER,
                false => tick.after(out),
            };
            let pending = self.pending.get(&index).map(|it| it.cause);
            Released {
                drone: drone.name.clone(),
                at,
                is_sent: matches!(pending, Some(Cause::Added | Cause::Retasked)),
                is_gone: track.is_gone,
                is_lost: lost.contains(&index),
            }
        };
        under_way.iter().zip(drones).map(released).collect()
    }

    /// What each drone has to do from where its flight can change, and what it keeps if it finds no
    /// path; nothing is kept of drones that cannot be planned anew.
    fn agents(&mut self) -> (Vec<Agent>, Vec<Vec<Leg>>) {
        let ready = self.ready();
        let roadmap = &self.running.job.roadmap;
        let (mut agents, mut kept) = (Vec::new(), Vec::new());
        for ((index, track), ready) in self.running.tracks.iter().enumerate().zip(ready) {
            if let Some(change) = self
                .pending
                .get_mut(&index)
                .filter(|pending| !pending.settled)
            {
                change.settled = ready.is_none();
            }
            kept.push((ready.as_ref()).map_or_else(Vec::new, |_| track.rest(self.at)));
            let mut agent = ready.unwrap_or_else(|| Agent {
                begun: Vec::new(),
                ..track.agent.clone()
            });
            let cause = self.pending.get(&index).map(|pending| pending.cause);
            if !matches!(cause, Some(Cause::Added | Cause::Retasked)) {
                agent.drop_missed_deadlines(roadmap);
            }
            if cause.is_some() {
                agent.find_lower_bound(roadmap);
            } else {
                // Of the others hardly any is planned anew: measured then.
                agent.lower_bound_ticks = 0;
            }
            agents.push(agent);
        }
        (agents, kept)
    }

    /// What each drone has to do from where its flight can change; `None` where it cannot be
    /// planned anew. Places that the roadmap lacks are connected.
    fn ready(&mut self) -> Vec<Option<Agent>> {
        let is_changed = |index: usize| {
            let change = self.pending.get(&index).filter(|pending| !pending.settled);
            change.is_some_and(|pending| matches!(pending.cause, Cause::Added | Cause::Retasked))
        };
        let changed: Vec<bool> = (0..self.running.tracks.len()).map(is_changed).collect();
        let Running {
            world, job, tracks, ..
        } = &*self.running;
        let states = tracks.iter().map(|it| it.state(&job.roadmap, self.at));
        let states: Vec<TrackState> = states.collect();
        let beyond = |(index, state): (usize, &TrackState)| {
            let turns = tracks[index].turns_beyond(&job.roadmap, state);
            let (at_m, grounded) = turns.filter(|_| !changed[index])?;
            Some(start_of(world, &world.drones[index], at_m, grounded))
        };
        let beyond: Vec<Option<Stop>> = states.iter().enumerate().map(beyond).collect();
        let stops: Vec<Stop> = beyond.iter().flatten().copied().collect();
        let mut vertices = self.connect(&stops).into_iter();
        let Running { job, tracks, .. } = &*self.running;
        let tracks = tracks
            .iter()
            .zip(&changed)
            .zip(states.into_iter().zip(beyond));
        let ready = tracks.map(|((track, changed), (state, beyond))| match changed {
            true => Some(track.agent.clone()),
            false => track.ready(&job.roadmap, state, beyond.and_then(|_| vertices.next())),
        });
        ready.collect()
    }

    /// The drones without a path that would conflict with others if they went on as they are to:
    /// late, or as they had to. Each may stop once.
    fn in_conflict_if_continuing(
        &self,
        repair: &Repair<'_>,
        stopped_before: &BTreeMap<usize, Vec<Leg>>,
    ) -> Vec<usize> {
        let (costmap, under_way) = (repair.costmap(), repair.under_way());
        let mut verdict = Verdict::default();
        // Two on their former paths are as the verifier found them.
        let is_as_it_was = |index: usize| {
            let is_changed = self.pending.get(&index);
            let is_changed = is_changed.is_some_and(|it| it.settled || it.before.is_none());
            !repair.has_new_path(index) && !is_changed && !stopped_before.contains_key(&index)
        };
        let mut is_in_conflict = |index: usize| {
            let legs = costmap.legs(id(index)).iter();
            let mut ahead = legs.filter(|leg| leg.end > under_way[index]);
            let is_known = is_as_it_was(index);
            ahead.any(|leg| {
                costmap.judge(leg, &mut verdict);
                verdict.blockers.iter().any(|it| {
                    let other = it.drone.0 as usize;
                    it.flown[1] > under_way[other] && !(is_known && is_as_it_was(other))
                })
            })
        };
        let can_stop = |index: usize| {
            let is_settled = self.pending.get(&index).is_some_and(|it| it.settled);
            !is_settled && !stopped_before.contains_key(&index)
        };
        let unplanned = repair.unplanned().into_iter().map(|(index, _)| index);
        unplanned
            .filter(|&index| can_stop(index) && is_in_conflict(index))
            .collect()
    }

    /// Writes what was found into tracks and plan, and reports the drones changed, and those
    /// without a path.
    fn write(self, stopped: &BTreeSet<usize>, mut paths: Paths) -> Replanned {
        let mut replanned = Replanned::default();
        let Running {
            world,
            plan,
            job,
            costmap,
            tracks,
            known,
            ..
        } = self.running;
        *costmap = paths.costmap;
        let kinds = &job.kinds;
        let mass_kg = |leg: &Leg| kinds.mass_kg(leg.kind);
        for (index, track) in tracks.iter_mut().enumerate() {
            let path = paths.paths.get_mut(index).and_then(Option::take);
            let pending = self.pending.get(&index);
            let cause = pending.map(|pending| pending.cause);
            let name = world.drones[index].name.clone();
            let entry = &mut plan.drones[index];
            let mut unplanned = paths.unplanned.iter();
            let unplanned = unplanned.find(|(drone, _)| *drone == id(index));
            let stops = unplanned.is_some() && stopped.contains(&index);
            match (path, cause) {
                (Some(path), _) => {
                    if cause.is_none() {
                        job.agents[index].find_lower_bound(&job.roadmap);
                    }
                    let agent = &job.agents[index];
                    if path.legs.is_empty() {
                        track.cut(agent.departs);
                    } else {
                        track.go_on(&path.legs);
                    }
                    write_legs(entry, &track.agent, &track.legs, mass_kg);
                    entry.at_end = world.drones[index].at_end;
                    // On the ground for good, it arrives with its landing.
                    let stays_down = agent.grounded && agent.stays();
                    let landed_s = arrivals_s(entry).first().copied();
                    let has_flown = entry.airborne_s.1 > Some(entry.airborne_s.0);
                    match landed_s {
                        _ if stays_down && entry.arrives_s <= known.seconds() => {}
                        Some(landed_s) if stays_down && has_flown => entry.arrives_s = landed_s,
                        _ => write_arrival(entry, &track.legs, agent, path.arrives),
                    }
                    // A drone that drops tasks comes to rest first.
                    entry.arrives_s = arrival_s(entry, Some(entry.arrives_s));
                    plan.unplanned.retain(|one| one.name != name);
                }
                (None, Some(Cause::Removed | Cause::Failed)) => {
                    if track.legs.is_empty() {
                        // Gone before it began.
                        entry.trajectory.t_s.truncate(1);
                        entry.trajectory.position_m.truncate(1);
                        entry.trajectory.mass_kg.truncate(1);
                        entry.airborne_s = (0.0, Some(0.0));
                    } else {
                        write_legs(entry, &track.agent, &track.legs, mass_kg);
                    }
                    entry.at_end = AtEnd::Leave;
                    entry.arrives_s = arrival_s(entry, Some(entry.arrives_s));
                    plan.unplanned.retain(|one| one.name != name);
                }
                (None, None) if !stops => continue,
                (None, cause) => {
                    let before = pending.and_then(|pending| pending.before.as_ref());
                    if let Some((before, drone)) = before {
                        *track = before.clone();
                        world.drones[index].clone_from(drone);
                    }
                    // What is fixed stays as it was said.
                    if !track.is_fixed && (stops || before.is_none()) {
                        let legs = paths.legs.get(index).filter(|legs| !legs.is_empty());
                        track.go_on(legs.map_or(costmap.legs(id(index)), |legs| legs));
                        write_legs(entry, &track.agent, &track.legs, mass_kg);
                    }
                    if let Some((_, why)) = unplanned {
                        let instead = match cause {
                            _ if stops => "it stops at the next place on its path",
                            Some(Cause::Late) => "it follows its plan as late as it is",
                            _ => "it goes on with what it had to do",
                        };
                        let why = known_cause(world, *why);
                        let out = Unplanned {
                            name: name.clone(),
                            reason: format!("{why}; {instead}"),
                            cause: Some(why.data(&name)),
                        };
                        if stops {
                            track.planned = false;
                            entry.arrives_s = job.agents[index].departs.seconds();
                            let flying = track.legs.last().is_some_and(|leg| leg.flying);
                            entry.at_end = if flying { AtEnd::Hover } else { AtEnd::Land };
                            plan.unplanned.push(out.clone());
                        }
                        replanned.refused.push(out);
                    }
                    if !track.is_fixed {
                        stay_until_arrival(entry);
                    }
                    if cause == Some(Cause::Retasked) && !stops {
                        continue;
                    }
                }
            }
            replanned.changed.push(Changed {
                drone: name,
                cause: cause.unwrap_or(Cause::GaveWay),
            });
        }
        replanned
    }
}

/// The drones that stop for good in conflict with others, and those others: the first time, where
/// they could fly out of it.
fn stopped_in_conflict(
    repair: &Repair<'_>,
    stopped: &BTreeSet<usize>,
) -> Vec<(usize, Vec<DroneId>)> {
    let mut verdict = Verdict::default();
    let costmap = repair.costmap();
    let mut others = |index: usize| {
        costmap.judge(costmap.legs(id(index)).last()?, &mut verdict);
        let met: BTreeSet<DroneId> = verdict.blockers.iter().map(|it| it.drone).collect();
        (!met.is_empty()).then(|| (index, met.into_iter().collect()))
    };
    let unplanned = repair.unplanned().into_iter().map(|(index, _)| index);
    let unplanned =
        unplanned.filter(|it| stopped.contains(it) && !repair.agents()[*it].is_stopped_in_conflict);
    unplanned.filter_map(&mut others).collect()
}

/// The drones that stop in conflict with others, without any path, and would touch fewer of them,
/// or for less time, if they went on as they were to.
fn better_continuing(
    repair: &Repair<'_>,
    stopped: &BTreeSet<usize>,
    went_on: &BTreeMap<usize, Vec<Leg>>,
) -> Vec<usize> {
    let (agents, costmap) = (repair.agents(), repair.costmap());
    let touched = |index: usize, flown: &[Leg]| {
        let (mut verdict, mut touched) = (Verdict::default(), BTreeSet::new());
        let mut ticks = 0;
        for leg in flown.iter().filter(|it| it.end > agents[index].departs) {
            costmap.judge(leg, &mut verdict);
            for it in verdict.blockers.iter().filter(|it| it.why == Why::Bodies) {
                touched.insert(it.drone);
                let until = leg.end.min(it.clear).0;
                ticks += u64::from(until.saturating_sub(leg.start.max(it.began).0));
            }
        }
        (touched.len(), ticks)
    };
    let is_better = |index: &usize| {
        let goes_on = agents[*index].flown(&went_on[index]);
        touched(*index, &goes_on) < touched(*index, costmap.legs(id(*index)))
    };
    let unplanned = repair.unplanned().into_iter().map(|(index, _)| index);
    let unplanned =
        unplanned.filter(|it| stopped.contains(it) && agents[*it].is_stopped_in_conflict);
    unplanned.filter(is_better).collect()
}

/// Blockers of a late drone where its flight can change first: it has to get away from the
/// immovable ones.
fn blockers_at_departure(running: &Running, index: usize) -> Vec<Blocker> {
    let agent = &running.job.agents[index];
    let now = Leg {
        end: agent.departs.after(BUCKET_TICKS),
        ..agent.stays_from_departure(&running.job.roadmap)
    };
    let mut verdict = Verdict::default();
    running.costmap.judge(&now, &mut verdict);
    verdict.blockers
}

/// Index of a drone as the costmap counts.
fn id(index: usize) -> DroneId {
    DroneId(index as u32)
}

#[cfg(test)]
mod tests;
