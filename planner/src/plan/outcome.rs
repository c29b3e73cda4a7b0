//! What planning answers, and how a caller watches and stops it.

use std::collections::BTreeMap;

use nalgebra::Point3;
use serde::Serialize;

use crate::plan::cause::{Exclusion, FailureCause};
use crate::plan::{Plan, Status};

/// The answer to "plan this world".
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Every drone is planned, and the verifier found nothing.
    Safe(Box<Planned>),
    /// The verifier found nothing; the drones in [`Planned::failures`] stay at their starts. A run
    /// that is stopped early answers so, too: with every drone that has no path yet among them.
    Partial(Box<Planned>),
    /// The verifier found violations: the plan must not be flown. A fault of the search, worth a
    /// report.
    Unsafe(Box<Planned>),
    /// The starts themselves exclude one another: no plan can be safe.
    Infeasible {
        /// Of starts and of goals.
        conflicts: EndpointConflicts,
    },
}

/// A verified plan, and what was found on the way to it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Planned {
    /// The plan, with the verifier's findings in it.
    pub plan: Plan,
    /// Why drones have no path, in the order of [`Plan::unplanned`], whose sentences say the same.
    pub failures: Vec<Failure>,
    /// Goals that exclude one another; the drones dropped for it are among the failures.
    pub conflicts: EndpointConflicts,
    /// What the search did.
    pub effort: Effort,
    /// What a reader of the plan should know beside it: rules given up that the world leaves open.
    pub notes: Vec<String>,
}

/// A drone without a path.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Failure {
    /// Its name.
    pub drone: String,
    /// Why.
    pub cause: FailureCause,
}

impl Outcome {
    /// The answer that a verified plan is, by its status.
    pub(crate) fn of(planned: Planned) -> Outcome {
        let status = planned.plan.status;
        let planned = Box::new(planned);
        match status {
            Status::Safe => Outcome::Safe(planned),
            Status::Partial => Outcome::Partial(planned),
            Status::Unsafe => Outcome::Unsafe(planned),
        }
    }

    /// The plan with what was found beside it, safe or not; `None` where there can be none.
    pub fn planned(&self) -> Option<&Planned> {
        match self {
            Outcome::Safe(planned) | Outcome::Partial(planned) | Outcome::Unsafe(planned) => {
                Some(planned)
            }
            Outcome::Infeasible { .. } => None,
        }
    }

    /// The same, taken out.
    pub fn into_planned(self) -> Option<Planned> {
        match self {
            Outcome::Safe(planned) | Outcome::Partial(planned) | Outcome::Unsafe(planned) => {
                Some(*planned)
            }
            Outcome::Infeasible { .. } => None,
        }
    }
}

/// What the search did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Effort {
    /// Searches for one drone.
    pub searches: u64,
    /// States expanded over all searches.
    pub expansions: u64,
    /// Evictions: planned paths withdrawn for other drones.
    pub evictions: u64,
    /// PIBT rounds: first on crowded floors, elsewhere where the first order leaves a drone
    /// unplanned or takes long.
    pub rounds: u64,
    /// By how much the sum of costs fell once every drone had a path (ticks of 1/100 s); `None`:
    /// not asked for, and it did not.
    pub improved_ticks: Option<u64>,
}

impl Effort {
    /// Counts what another part of the same run did.
    pub(crate) fn add(&mut self, other: &Effort) {
        self.searches += other.searches;
        self.expansions += other.expansions;
        self.evictions += other.evictions;
        self.rounds += other.rounds;
    }

    /// By how much the sum of costs fell once every drone had a path (s); `None`: not asked
    /// for, and it did not.
    pub fn improved_s(&self) -> Option<f64> {
        let ticks = self.improved_ticks?;
        Some(ticks as f64 / costmap::leg::Tick::PER_SECOND)
    }
}

/// Endpoints that exclude one another: all, or of very many the worst.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct EndpointConflicts {
    /// By drone, starts before goals before tasks: all up to 200 of each, else the 40 worst. Bodies
    /// come before columns, these before air; the least gap and the most air for its limit first.
    pub worst: Vec<EndpointConflict>,
    /// How many more there are.
    pub more: usize,
}

impl EndpointConflicts {
    /// All of them.
    pub fn count(&self) -> usize {
        self.worst.len() + self.more
    }

    /// The limits of air, by drone of these names, that are raised in the plan that shows that they
    /// are enough.
    pub fn raised<'a>(&self, name: impl Fn(usize) -> &'a str) -> Vec<(String, f64)> {
        let raised = self.worst.iter().filter_map(|it| match it.why {
            Exclusion::Air { enough, .. } => Some((it.drone, enough?)),
            _ => None,
        });
        let raised: BTreeMap<usize, f64> = raised.collect();
        let raised = raised.into_iter();
        raised
            .map(|(drone, limit)| (name(drone).to_owned(), limit))
            .collect()
    }
}

/// Two places, or a place and a zone, that exclude one another.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EndpointConflict {
    /// Index in [`crate::scenario::world::World::drones`] of the affected one.
    pub drone: usize,
    /// What blocks it.
    pub blocker: Blocker,
    /// Both at their starts, at their goals, or at tasks.
    pub when: EndpointKind,
    /// Of tasks: which, and when.
    pub meeting: Option<Meeting>,
    /// How they exclude one another.
    pub why: Exclusion,
    /// A place for `drone` near its endpoint. Of an outcome: one with which all of the fleet were
    /// planned, each at its own, or, of goals, a drone that is left out for it; of
    /// [`crate::endpoint_conflicts`]: one where this pair is in order. `None`: none is known.
    pub nearest_fix_m: Option<Point3<f64>>,
}

/// What blocks an endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Blocker {
    /// Index in [`crate::scenario::world::World::drones`].
    Drone(usize),
    /// Index in [`crate::scenario::world::World::zones`].
    Zone(usize),
}

/// Which endpoints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum EndpointKind {
    /// At time 0.
    Starts,
    /// After the last arrival.
    Goals,
    /// At tasks that are due at one time, or at one that another drone never leaves room for.
    Tasks,
}

impl EndpointConflict {
    /// The task, from 0, at which the affected drone is, of so many; `None`: at its start.
    pub fn task_of(&self, tasks: usize) -> Option<usize> {
        match self.when {
            EndpointKind::Starts => None,
            EndpointKind::Goals => tasks.checked_sub(1),
            EndpointKind::Tasks => self.meeting?.task?.checked_sub(1),
        }
    }

    /// The same of the other drone, where there is one.
    pub fn their_task_of(&self, tasks: usize) -> Option<usize> {
        match self.when {
            EndpointKind::Tasks => self.meeting?.their_task?.checked_sub(1),
            EndpointKind::Starts | EndpointKind::Goals => self.task_of(tasks),
        }
    }

    /// The affected drone, and its due task, from 0.
    pub(crate) fn place(&self) -> (usize, Option<usize>) {
        let task = self.meeting.and_then(|it| it.task);
        (self.drone, task.map(|task| task - 1))
    }
}

/// Two tasks at which drones are at one time, or a task and a place where another drone stays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Meeting {
    /// The affected drone's, from 1; `None`: it stays at its start.
    pub task: Option<usize>,
    /// The other's, in the same way.
    pub their_task: Option<usize>,
    /// Both are there from and until (s); `None`: whenever the task is done.
    pub during_s: Option<[f64; 2]>,
}

/// How a caller watches, stops and extends a run of a planner that reads no clock itself.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Asked often; once it says `true` the best safe plan so far is returned.
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Asked when every drone has a path: whether to go on and make the plan better, beyond what
    /// small fleets get without being asked.
    pub improve: &'a (dyn Fn() -> bool + Sync),
    /// Called now and then.
    pub progress: &'a (dyn Fn(Progress) + Sync),
    /// Whether the fleet is planned a second time, as if there were no wakes, and that plan judged
    /// with them: [`Plan::ignoring_downwash`]. It takes about as long again.
    pub contrast: bool,
}

/// How far planning has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Roadmap, heuristics, volumes.
    Preparing,
    /// Drones that have a path, of all.
    Searching {
        /// With a path now.
        planned: usize,
        /// In the fleet.
        drones: usize,
        /// Taken back so far.
        evictions: u64,
    },
    /// Every drone has a path; better ones are looked for.
    Improving,
    /// The continuous-time check.
    Verifying,
    /// The second plan, without wakes.
    IgnoringDownwash,
}

/// Share of a time limit after which a plan that is complete is not made better any more. Chosen
/// here: checks take less time than planning does.
pub const IMPROVING_SHARE: f64 = 0.6;
/// Share of a time limit after which planning stops with what it has. Chosen here: what is left is
/// for the check of the plan.
pub const PLANNING_SHARE: f64 = 0.85;

impl Control<'_> {
    /// Never stops, has no time left over to improve in, reports no progress, makes no contrast.
    /// Fleets of up to 30 drones are improved all the same.
    pub const QUIET: Control<'static> = Control {
        stop: &|| false,
        improve: &|| false,
        progress: &|_| {},
        contrast: false,
    };

    /// Stops as this one, without improvement, progress or contrast: for plans that only show what
    /// could be done.
    pub(crate) fn trying(&self) -> Control<'_> {
        Control {
            stop: self.stop,
            ..Control::QUIET
        }
    }

    /// Runs a planner for at most `limit_s` (s): it stops at [`PLANNING_SHARE`] of it to check what
    /// it has, and until [`IMPROVING_SHARE`] of it a plan that is complete is made better.
    /// `elapsed_s` says how long it has been running (s): libraries read no clock.
    ///
    /// ```
    /// # let text = r#"Scenario(name: "one", bounds_m: (min: (0, 0, 0), max: (9, 9, 6)),
    /// #     drones: [(name: "k1", airframe: "kolibri", start_m: (1, 1, 1), tasks: [(to_m: (8, 8, 3))])])"#;
    /// let world = planner::read_world(text)?;
    /// let started = std::time::Instant::now();
    /// let elapsed_s = || started.elapsed().as_secs_f64();
    /// let outcome = planner::Control::within(2.0, elapsed_s, |control| planner::plan_world(&world, control))?;
    /// # assert!(matches!(outcome, planner::Outcome::Safe(_)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn within<T>(
        limit_s: f64,
        elapsed_s: impl Fn() -> f64 + Sync,
        run: impl FnOnce(&Control<'_>) -> T,
    ) -> T {
        run(&Control {
            stop: &|| elapsed_s() >= PLANNING_SHARE * limit_s,
            improve: &|| elapsed_s() < IMPROVING_SHARE * limit_s,
            ..Control::QUIET
        })
    }
}
