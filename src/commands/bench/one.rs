//! One instance, planned in this process, and what that took.

use std::num::NonZeroUsize;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use planner::plan::outcome::{Control, Effort, Outcome, Progress};
use planner::plan::{Plan, Status};
use serde::{Deserialize, Serialize};

use super::Place;
use crate::io::failure::Failure;
use crate::io::problems;
use crate::io::watch::{Durations, Watch, peak_memory_bytes};
use crate::report::words;

/// What is to be planned, and how.
pub(super) struct One {
    pub(super) place: Place,
    pub(super) drones: usize,
    pub(super) seed: u64,
    pub(super) time_limit: Option<Duration>,
    pub(super) jobs: Option<NonZeroUsize>,
    /// Plan once more, ignoring downwash.
    pub(super) contrast: bool,
}

/// What came of it. Reading the scenario is not timed.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Figures {
    /// `safe`, `partial`, `unsafe`, `blocked` or `stopped`.
    pub(super) status: String,
    /// Drones without a path.
    pub(super) left_out: usize,
    /// What the verifier found.
    pub(super) violations: usize,
    /// Planning was told to stop, by the time limit or an interrupt.
    pub(super) cut_short: bool,
    /// Endpoints, roadmap, search.
    pub(super) planning_time_s: f64,
    pub(super) verification_time_s: f64,
    /// Searches for one drone.
    pub(super) searches: u64,
    /// States expanded over all searches.
    pub(super) expansions: u64,
    /// Drones whose path was taken back for another's.
    pub(super) evictions: u64,
    /// Steps that everybody took at once, where the floor is crowded.
    pub(super) steps_together: u64,
    pub(super) sum_of_arrivals_s: f64,
    /// Of the same drones, each with nobody else there, on the same roadmap.
    pub(super) sum_alone_s: f64,
    /// What downwash costs the fleet.
    pub(super) extra_energy_j: f64,
    /// What hovering in still air costs it over the same flights.
    pub(super) hover_energy_j: f64,
    /// With nobody minding the air; absent where that plan was not made.
    pub(super) over_limit_ignoring_downwash: Option<usize>,
    /// Highest resident memory of the process when the plan was verified, before the one that ignores
    /// downwash; absent where the system does not tell.
    pub(super) peak_memory_bytes: Option<u64>,
}

impl Figures {
    pub(super) fn is_safe(&self) -> bool {
        self.status == words::status(Status::Safe) && self.left_out == 0 && self.violations == 0
    }

    /// There is a plan, whatever it is worth.
    pub(super) fn has_plan(&self) -> bool {
        !["blocked", "stopped"].contains(&self.status.as_str())
    }
}

pub(super) fn plan(one: &One) -> Result<Figures, Failure> {
    let text = one.place.floor().scenario(one.drones, one.seed)?;
    let no_files = |file: &str| Err(format!("there is no {file}"));
    let read = planner::scenario::read_world(&text, &no_files);
    let world = read.map_err(|found| {
        let name = one.place.word();
        let colour = problems::colour_on_stderr();
        Failure::Scenario(problems::draw(&found, name, &text, colour))
    })?;
    drop(text);
    if let Some(jobs) = one.jobs {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs.get());
        pool.build_global().map_err(|source| Failure::Threads {
            jobs: jobs.get(),
            source,
        })?;
    }
    let clock = Clock::start(one);
    let outcome = planner::plan_world(
        &world,
        &Control {
            stop: &|| clock.stop(),
            progress: &|progress| clock.progress(progress),
            ..Control::QUIET
        },
    );
    Ok(clock.figures(outcome, world.drones.len()))
}

/// Limits planning and, separately, the plan that ignores downwash; reads the memory between the two.
struct Clock {
    watch: Watch,
    limit: Option<Duration>,
    contrast: bool,
    cut_short: AtomicBool,
    now: Mutex<Now>,
}

#[derive(Clone, Copy)]
struct Now {
    until: Option<Instant>,
    in_contrast: bool,
    peak_memory_bytes: Option<u64>,
}

impl Clock {
    fn start(one: &One) -> Clock {
        Clock {
            watch: Watch::start(None),
            limit: one.time_limit,
            contrast: one.contrast,
            cut_short: AtomicBool::new(false),
            now: Mutex::new(Now {
                until: from_now(one.time_limit),
                in_contrast: false,
                peak_memory_bytes: None,
            }),
        }
    }

    fn stop(&self) -> bool {
        let now = *self.now();
        let late = now.until.is_some_and(|until| Instant::now() >= until);
        let stop = late || self.watch.stop() || (now.in_contrast && !self.contrast);
        if stop && !now.in_contrast {
            self.cut_short.store(true, Ordering::Relaxed);
        }
        stop
    }

    fn progress(&self, progress: Progress) {
        self.watch.progress(progress);
        if progress == Progress::IgnoringDownwash {
            *self.now() = Now {
                until: from_now(self.limit),
                in_contrast: true,
                peak_memory_bytes: peak_memory_bytes(),
            };
        }
    }

    fn now(&self) -> std::sync::MutexGuard<'_, Now> {
        // Written whole: a panic elsewhere cannot have left it half-written.
        self.now
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn figures(&self, outcome: Outcome, drones: usize) -> Figures {
        let Durations {
            planning,
            verification,
            ..
        } = self.watch.finish();
        let (status, plan, effort) = match outcome {
            Outcome::Planned { plan, effort, .. } => {
                (words::status(plan.status), Some(plan), effort)
            }
            Outcome::Blocked { .. } => ("blocked", None, Effort::default()),
            Outcome::Stopped => ("stopped", None, Effort::default()),
        };
        let fleet = plan.as_ref().map(|plan| &plan.fleet);
        Figures {
            status: status.to_owned(),
            left_out: plan.as_ref().map_or(drones, |plan| plan.unplanned.len()),
            violations: plan.as_ref().map_or(0, |plan| plan.violations.len()),
            cut_short: self.cut_short.load(Ordering::Relaxed),
            planning_time_s: planning.as_secs_f64(),
            verification_time_s: verification.as_secs_f64(),
            searches: effort.searches,
            expansions: effort.expansions,
            evictions: effort.evictions,
            steps_together: effort.rounds,
            sum_of_arrivals_s: fleet.map_or(0.0, |fleet| fleet.sum_of_arrivals_s),
            sum_alone_s: fleet.map_or(0.0, |fleet| fleet.sum_alone_s),
            extra_energy_j: fleet.map_or(0.0, |fleet| fleet.extra_energy_j),
            hover_energy_j: plan.as_ref().map_or(0.0, hover_energy_j),
            over_limit_ignoring_downwash: plan
                .as_ref()
                .and_then(|plan| plan.ignoring_downwash.as_ref())
                .map(|contrast| contrast.drones_over_limit),
            peak_memory_bytes: self.now().peak_memory_bytes.or_else(peak_memory_bytes),
        }
    }
}

/// A limit beyond the clock's range is no limit.
fn from_now(limit: Option<Duration>) -> Option<Instant> {
    limit.and_then(|limit| Instant::now().checked_add(limit))
}

/// Still air, every drone for the time of its flight, without payload: `m g U_H t`.
fn hover_energy_j(plan: &Plan) -> f64 {
    let each = plan.drones.iter().map(|drone| {
        let frame = &drone.airframe;
        let flight_s = drone.trajectory.t_s.last().copied().unwrap_or(0.0);
        let power_w = frame.mass_kg * airflow::GRAVITY_MPS2 * frame.hover_induced_velocity_mps;
        power_w * flight_s
    });
    each.sum()
}
