//! One instance of a benchmark: what is planned, and what came of it.

use std::num::NonZeroUsize;
use std::time::Duration;

use planner::Planned;
use planner::plan::{Plan, Status, TrajectoryEntry};
use serde::{Deserialize, Serialize};

use crate::instances::Floor;

/// What is to be planned, and how.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Where the fleet flies.
    pub place: Floor,
    /// How many drones.
    pub drones: usize,
    /// Draws starts and goals.
    pub seed: u64,
    /// Planning stops after it with the best plan so far.
    pub time_limit: Option<Duration>,
    /// Threads; `None`: one a core.
    pub jobs: Option<NonZeroUsize>,
    /// Whether the fleet is planned once more, ignoring downwash.
    pub contrast: bool,
    /// Whether it is planned in straight motion with quasi-static wakes from the start.
    pub relaxed: bool,
}

impl Instance {
    /// How it is planned, as words of a command line.
    #[must_use]
    pub fn options(&self) -> Vec<String> {
        let mut words = Vec::new();
        if let Some(limit) = self.time_limit {
            words.extend(["--time-limit".to_owned(), limit.as_secs_f64().to_string()]);
        }
        if let Some(jobs) = self.jobs {
            words.extend(["--jobs".to_owned(), jobs.to_string()]);
        }
        if !self.contrast {
            words.push("--without-contrast".to_owned());
        }
        if self.relaxed {
            words.push("--relaxed".to_owned());
        }
        words
    }
}

/// What came of an instance. Reading the scenario is not timed.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Figures {
    /// `safe`, `partial`, `unsafe` or `blocked`.
    pub status: String,
    /// By which rules it is planned: motion and wakes.
    pub rules: String,
    /// Drones without a path.
    pub left_out: usize,
    /// What the verifier found.
    pub violations: usize,
    /// Planning was told to stop, by the time limit or an interrupt.
    pub cut_short: bool,
    /// Endpoints, roadmap, search (s).
    pub planning_time_s: f64,
    /// The verifier (s).
    pub verification_time_s: f64,
    /// Searches for one drone.
    pub searches: u64,
    /// States expanded over all searches.
    pub expansions: u64,
    /// Evictions: paths withdrawn for other drones.
    pub evictions: u64,
    /// PIBT rounds, where the floor is crowded.
    pub steps_together: u64,
    /// Sum of costs (s).
    pub sum_of_arrivals_s: f64,
    /// Its lower bound (s): every drone with no other there, on the same roadmap.
    pub sum_alone_s: f64,
    /// What downwash costs the fleet (J).
    pub extra_energy_j: f64,
    /// What hovering in still air costs it over the same flights (J).
    pub hover_energy_j: f64,
    /// Drones over their limit in the plan that ignores downwash; absent where that plan was not
    /// made.
    pub over_limit_ignoring_downwash: Option<usize>,
    /// Highest resident memory of the process when the plan was verified, before the one that
    /// ignores downwash; absent where the system does not tell.
    pub peak_memory_bytes: Option<u64>,
}

/// What a caller measures around a run, as the planner reads no clock.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Endpoints, roadmap, search.
    pub planning: Duration,
    /// The verifier.
    pub verification: Duration,
    /// Whether planning was told to stop.
    pub cut_short: bool,
    /// Highest resident memory until the plan was verified.
    pub peak_memory_bytes: Option<u64>,
}

/// The rules of a plan, in words.
fn rules(plan: &Plan) -> String {
    let mut all = plan.drones.iter().map(|drone| &drone.trajectory);
    let motion = match all.any(TrajectoryEntry::is_smooth) {
        true => "smooth",
        false => "straight",
    };
    let wakes = match plan.quasi_static {
        true => "quasi-static",
        false => "advected",
    };
    format!("{motion}, {wakes}")
}

impl Figures {
    /// Of one run over a fleet of so many drones; `None`: its starts exclude one another.
    #[must_use]
    pub fn of(planned: Option<&Planned>, drones: usize, measured: Measured) -> Figures {
        let plan = planned.map(|planned| &planned.plan);
        let status = plan.map_or("blocked", |plan| plan.status.as_str());
        let effort = planned.map_or_else(Default::default, |planned| planned.effort);
        let fleet = plan.map(|plan| plan.fleet.clone()).unwrap_or_default();
        let ignoring = plan.and_then(|plan| plan.ignoring_downwash.as_ref());
        Figures {
            status: status.to_owned(),
            rules: plan.map_or(String::new(), rules),
            left_out: plan.map_or(drones, |plan| plan.unplanned.len()),
            violations: plan.map_or(0, |plan| plan.violations.len()),
            cut_short: measured.cut_short,
            planning_time_s: measured.planning.as_secs_f64(),
            verification_time_s: measured.verification.as_secs_f64(),
            searches: effort.searches,
            expansions: effort.expansions,
            evictions: effort.evictions,
            steps_together: effort.rounds,
            sum_of_arrivals_s: fleet.sum_of_arrivals_s,
            sum_alone_s: fleet.sum_alone_s,
            extra_energy_j: fleet.extra_energy_j,
            hover_energy_j: plan.map_or(0.0, hover_energy_j),
            over_limit_ignoring_downwash: ignoring.map(|ignoring| ignoring.drones_over_limit),
            peak_memory_bytes: measured.peak_memory_bytes,
        }
    }

    /// Every drone has a path, and the plan is verified.
    #[must_use]
    pub fn is_safe(&self) -> bool {
        self.status == Status::Safe.as_str() && self.left_out == 0 && self.violations == 0
    }

    /// Whether there is a plan, safe or not.
    #[must_use]
    pub(crate) fn has_plan(&self) -> bool {
        self.status != "blocked"
    }
}

/// Still air, every drone for the time of its flight, without payload: `m g U_H t` (J).
fn hover_energy_j(plan: &Plan) -> f64 {
    let each = plan.drones.iter().map(|drone| {
        let frame = &drone.airframe;
        let flight_s = drone.trajectory.t_s.last().copied().unwrap_or(0.0);
        let power_w = frame.mass_kg * airflow::GRAVITY_MPS2 * frame.hover_induced_velocity_mps;
        power_w * flight_s
    });
    each.sum()
}
