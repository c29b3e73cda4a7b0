//! A plan that is being flown, changed while it is: drones that are late, that come or are taken out, or that
//! are given something else to do.
//!
//! [`Running`] is what a fleet manager keeps between changes. Up to the moment of a change the plan is
//! history. From there on only those change who are asked to, and whoever has to give way to them;
//! everybody else keeps their trajectory to the last byte. A drone between two places flies on to the next
//! one before it does anything else, and a dwell that has begun is not interrupted, but by a new task.
//! Whoever finds no way goes on with the one it had, or stops if that is no way any more; who comes and
//! finds none is not let in.
//!
//! ```
//! use planner::replan::rolling::{Change, Running};
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

mod apply;
mod changes;
pub(crate) mod legs;
mod outcome;
mod splice;
mod track;
mod turn;

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, Leg, Tick};
use thiserror::Error;

pub use changes::{Change, ChangeError};
use track::{State, Track};

use crate::plan::outcome::{Control, Effort};
use crate::plan::{Fleet, Plan, Unplanned, Violation};
use crate::scenario::solid::Solids;
use crate::scenario::world::World;
use crate::solver::assemble::{judged, rounded};
use crate::solver::prepare::{Job, Kinds, costmap_for, prepare};
use crate::verify::verify;

/// Room for drones that come later: chosen here, so that the costmap is seldom made anew.
const SPARE_DRONES: usize = 64;

/// A plan that is being flown, and what planning on needs: the roadmap, the ways home of every drone, and
/// everybody's legs in the costmap.
#[derive(Debug)]
pub struct Running {
    world: World,
    plan: Plan,
    solids: Solids,
    job: Job,
    kinds: Kinds,
    costmap: Costmap,
    tracks: Vec<Track>,
    /// Everything before is history.
    known: Tick,
}

/// Why a plan cannot be flown on.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum RunningError {
    /// Not the plan of this world.
    #[error("the plan has {plan} drones, the world {world}")]
    Count {
        /// In the plan.
        plan: usize,
        /// In the world.
        world: usize,
    },
    /// Not the plan of this world.
    #[error("drone {index} of the plan is `{plan}`, of the world `{world}`")]
    Name {
        /// In both.
        index: usize,
        /// In the plan.
        plan: String,
        /// In the world.
        world: String,
    },
    /// The plan contradicts itself.
    #[error("`{drone}`: {why}")]
    Malformed {
        /// Who.
        drone: String,
        /// How.
        why: String,
    },
}

/// What became of some changes.
#[derive(Clone, Debug, PartialEq)]
pub struct Replanned {
    /// Whose trajectory is another one now, in the order of the plan.
    pub changed: Vec<Changed>,
    /// For whom there is no way, in the order of the plan: who was given another task goes on with what it
    /// had, who is late follows its plan as late as it is, and who comes is not let in. Whoever would run into others
    /// like that, or had to give way to one who stops, stops as well.
    pub refused: Vec<Unplanned>,
    /// Violations that begin before those in them could be made to do anything else, as of a late drone that
    /// is in somebody's way already. They are in the plan, too.
    pub unavoidable: Vec<Violation>,
    /// What the search did.
    pub effort: Effort,
}

/// A drone with another trajectory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Changed {
    /// Its name.
    pub drone: String,
    /// Why.
    pub cause: Cause,
}

/// Why a drone has another trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    pub fn new(world: World, plan: Plan) -> Result<Running, RunningError> {
        check(&world, &plan)?;
        let mut job = prepare(&world);
        let mut kinds = Kinds::of(&world);
        let errands = std::mem::take(&mut job.errands);
        let mut tracks = Vec::with_capacity(errands.len());
        for ((errand, drone), entry) in errands.into_iter().zip(&world.drones).zip(&plan.drones) {
            let planned = !plan.unplanned.iter().any(|one| one.name == entry.name);
            let vehicle = &drone.vehicle;
            let whole = legs::legs_of(errand.drone, entry, !planned, |mass_kg| {
                kinds.kind(vehicle, mass_kg)
            });
            let stops = errand.mover.stops().iter();
            let stops_m: Vec<_> = stops.map(|&stop| job.roadmap.position_m(stop)).collect();
            let lattice = job.roadmap.lattice();
            let cut = |leg: &Leg| legs::cut(leg, lattice, &stops_m);
            tracks.push(Track {
                legs: whole.iter().flat_map(cut).collect(),
                errand,
                since: Tick(0),
                planned,
            });
        }
        let mut running = Running {
            solids: Solids::new(&world.obstacles),
            costmap: costmap_for(&world, &kinds, job.roadmap.lattice(), true, 0),
            world,
            plan,
            job,
            kinds,
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

    /// The world as it is now: with those who came, and everybody's last tasks.
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
        let problems = changes::problems(&self.world, &self.solids, widest_m, changes, there);
        if !problems.is_empty() {
            return Err(problems);
        }
        self.known = at;
        let (told, could_change) = turn::take(self, at, changes, control);
        (control.progress)(crate::plan::outcome::Progress::Verifying);
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

    /// A costmap with room for more, and what everybody still flies in it.
    fn fill_costmap(&mut self) {
        let room = self.tracks.len() + SPARE_DRONES;
        let lattice = self.job.roadmap.lattice();
        self.costmap = costmap_for(&self.world, &self.kinds, lattice, true, room);
        for track in &self.tracks {
            self.costmap.insert(track.rest(self.known));
        }
    }

    /// The whole plan judged, the sums over the fleet made anew. Everybody is verified, not only those who
    /// have changed.
    fn judge(&mut self) {
        let unplanned = std::mem::take(&mut self.plan.unplanned);
        let left_out = |name: &str| unplanned.iter().any(|one| one.name == name);
        let flying = || {
            self.plan
                .drones
                .iter()
                .filter(|drone| !left_out(&drone.name))
        };
        self.plan.fleet = Fleet {
            makespan_s: flying().map(|drone| drone.arrives_s).fold(0.0, f64::max),
            sum_of_arrivals_s: rounded(flying().map(|drone| drone.arrives_s).sum()),
            sum_alone_s: rounded(flying().map(|drone| drone.alone_s).sum()),
            extra_energy_j: 0.0,
        };
        self.plan.ignoring_downwash = None;
        self.plan.unplanned = unplanned.clone();
        let report = verify(&self.plan);
        self.plan = judged(self.plan.clone(), report, unplanned);
    }
}

/// Plans on once, from a plan and the world that it was made for: [`Running::new`] and [`Running::replan`].
///
/// # Errors
///
/// As of both.
pub fn replan(
    world: &World,
    plan: &Plan,
    at_s: f64,
    changes: &[Change],
    control: &Control<'_>,
) -> Result<(Running, Replanned), ReplanError> {
    let mut running = Running::new(world.clone(), plan.clone())?;
    let told = running.replan(at_s, changes, control)?;
    Ok((running, told))
}

/// Why [`replan`] did not answer.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ReplanError {
    /// About the plan.
    #[error(transparent)]
    Running(#[from] RunningError),
    /// About the changes, all of them.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Changes(Vec<ChangeError>),
}

impl From<Vec<ChangeError>> for ReplanError {
    fn from(errors: Vec<ChangeError>) -> ReplanError {
        ReplanError::Changes(errors)
    }
}

fn check(world: &World, plan: &Plan) -> Result<(), RunningError> {
    if world.drones.len() != plan.drones.len() {
        return Err(RunningError::Count {
            plan: plan.drones.len(),
            world: world.drones.len(),
        });
    }
    for (index, (drone, entry)) in world.drones.iter().zip(&plan.drones).enumerate() {
        if drone.name != entry.name {
            return Err(RunningError::Name {
                index,
                plan: entry.name.clone(),
                world: drone.name.clone(),
            });
        }
        let tail = crate::plan::trajectory::Tail::Gone;
        crate::plan::trajectory::Trajectory::new(&entry.trajectory, tail).map_err(|error| {
            RunningError::Malformed {
                drone: entry.name.clone(),
                why: error.to_string(),
            }
        })?;
    }
    Ok(())
}

/// Index of a drone as the costmap counts.
fn id(index: usize) -> DroneId {
    DroneId(index as u32)
}

#[cfg(test)]
mod tests;
