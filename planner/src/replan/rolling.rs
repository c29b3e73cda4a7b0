//! A plan that is being flown, changed while it is: drones that are late, that come or are taken out, or that
//! are given something else to do.
//!
//! [`Running`] is what a fleet manager keeps between changes. Up to the moment of a change the plan is
//! history. From there on only those drones change that are asked to, and those that have to give way to
//! them; all others keep their trajectories to the last byte. A drone between two places flies on to the
//! next one before it does anything else, and a dwell that has begun is not interrupted, but by a new task.
//! A drone without a path goes on with the one it had, or stops if that is none any more; one that comes
//! and has none is not let in.
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
//! let elsewhere = Task { to_m: [32.5, 32.5, 4.5].into(), dwell_s: 2.0, load_kg: None };
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

use costmap::costmap::Costmap;
use costmap::leg::{Leg, Tick};
use serde::Serialize;

use super::change::{self, Change, ChangeError};
use super::track::{State, Track, cut, legs_of};
use super::{GivenError, given, turn};
use crate::plan::outcome::{Control, Effort, Progress};
use crate::plan::{Plan, Unplanned, Violation};
use crate::scenario::solid::Solids;
use crate::scenario::world::World;
use crate::solver::assemble::{fleet, judged};
use crate::solver::prepare::{Job, prepare};
use crate::verify::verify;

/// Room for drones that come later: chosen here, so that the costmap is seldom made anew.
const SPARE_DRONES: usize = 64;

/// A plan that is being flown, and what planning on needs: the roadmap, the distances to every goal, and
/// all legs in the costmap.
#[derive(Debug)]
pub struct Running {
    /// With the drones that came, and the last tasks of all.
    pub(super) world: World,
    /// What has been flown and what will be, verified.
    pub(super) plan: Plan,
    /// The world's obstacles, for places that are new.
    pub(super) solids: Solids,
    /// Its roadmap grows with new stops; its agents are those of the last change.
    pub(super) job: Job,
    /// What every drone still flies.
    pub(super) costmap: Costmap,
    /// By drone, in the plan's order.
    pub(super) tracks: Vec<Track>,
    /// Everything before is history.
    pub(super) known: Tick,
}

/// What became of some changes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Replanned {
    /// The drones that have another trajectory now, in the order of the plan.
    pub changed: Vec<Changed>,
    /// The drones without a path, in the order of the plan: one that was given another task goes on with
    /// what it had, one that is late follows its plan as late as it is, and one that comes is not let in.
    /// One that would run into others like that, or had to give way to one that stops, stops as well.
    pub refused: Vec<Unplanned>,
    /// Violations that begin before the drones in them could be made to do anything else, as of a late
    /// drone that is in another's way already. They are in the plan, too.
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
    /// It has something else to do.
    Retasked,
    /// It was in the way of one of these.
    GaveWay,
}

impl Running {
    /// Takes over a plan and the world that it was made for.
    ///
    /// # Errors
    ///
    /// The plan has other drones than the world, or a trajectory that cannot be read.
    pub fn new(world: World, plan: Plan) -> Result<Running, GivenError> {
        check(&world, &plan)?;
        let mut job = prepare(&world);
        let agents = std::mem::take(&mut job.agents);
        let mut tracks = Vec::with_capacity(agents.len());
        for ((agent, drone), entry) in agents.into_iter().zip(&world.drones).zip(&plan.drones) {
            let planned = !plan.unplanned.iter().any(|one| one.name == entry.name);
            let whole = legs_of(agent.drone, entry, !planned, |mass_kg| {
                job.kinds.kind(&drone.vehicle, mass_kg)
            });
            let stops = agent.mover.stops().iter();
            let stops_m: Vec<_> = stops.map(|&stop| job.roadmap.position_m(stop)).collect();
            let cut = |leg: &Leg| cut(leg, job.roadmap.lattice(), &stops_m);
            tracks.push(Track {
                legs: whole.iter().flat_map(cut).collect(),
                agent,
                since: Tick(0),
                planned,
            });
        }
        let mut running = Running {
            solids: Solids::new(&world.obstacles),
            costmap: job.costmap(&world, true, 0),
            world,
            plan,
            job,
            tracks,
            known: Tick(0),
        };
        running.fill_costmap();
        Ok(running)
    }

    /// The plan as it is now: what has been flown and what will be.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The world as it is now: with the drones that came, and the last tasks of all.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Plans on from a moment, with these changes, and verifies the whole plan. Times go on counting from
    /// where the plan began, in whole hundredths of a second: `at_s` is rounded up.
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
        let at = self.moment(at_s).map_err(|error| vec![error])?;
        let there =
            |index: usize| self.tracks[index].state(&self.job.roadmap, at, false) != State::Absent;
        let widest_m = self.job.roadmap.widest_m();
        let problems = change::problems(&self.world, &self.solids, widest_m, changes, there);
        if !problems.is_empty() {
            return Err(problems);
        }
        self.known = at;
        let (told, could_change) = turn::take(self, at, changes, control);
        (control.progress)(Progress::Verifying);
        self.judge();
        let early = |violation: &&Violation| {
            let released = |name: &str| could_change.iter().find(|(known, _)| known == name);
            let names = [Some(violation.drone.as_str()), violation.with.as_deref()];
            let mut released = names.into_iter().flatten().filter_map(released);
            violation.from_s >= 0.0 && released.any(|(_, tick)| violation.from_s < tick.seconds())
        };
        let unavoidable = self.plan.violations.iter().filter(early).cloned().collect();
        Ok(Replanned {
            unavoidable,
            ..told
        })
    }

    /// The whole tick of a time (s), rounded up.
    fn moment(&self, at_s: f64) -> Result<Tick, ChangeError> {
        // Ticks count to 2³² hundredths of a second; a plan of a year is a mistake.
        const LATEST_S: f64 = 3.2e7;
        if !(0.0..LATEST_S).contains(&at_s) {
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
    pub(super) fn fill_costmap(&mut self) {
        let room = self.tracks.len() + SPARE_DRONES;
        self.costmap = self.job.costmap(&self.world, true, room);
        for track in &self.tracks {
            self.costmap.insert(track.rest(self.known));
        }
    }

    /// The whole plan judged, the sums over the fleet made anew. All drones are verified, not only those
    /// that have changed.
    fn judge(&mut self) {
        let unplanned = self.plan.unplanned.clone();
        self.plan.fleet = fleet(&self.plan.drones, |drone| {
            unplanned.iter().all(|one| one.name != drone.name)
        });
        self.plan.ignoring_downwash = None;
        let report = verify(&self.plan);
        self.plan = judged(self.plan.clone(), report, unplanned);
    }
}

/// Whether this is the plan of this world, and can be flown.
fn check(world: &World, plan: &Plan) -> Result<(), GivenError> {
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
        given(entry, world.air.density_kg_per_m3())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
