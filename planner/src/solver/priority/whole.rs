//! The whole fleet: in one order after another, or all at once where the floor is crowded.

use costmap::costmap::Costmap;
use costmap::leg::DroneId;

use super::by_pibt::plan_by_pibt;
use super::order::order_of;
use super::{Attempt, FailureKind, Paths};
use crate::graph::agent::Agent;
use crate::graph::distances::UNREACHABLE;
use crate::plan::outcome::{Control, Effort};
use crate::scenario::world::Planning;
use crate::sipp::conflicts::{ReservationTable, Steps};
use crate::sipp::search::IMMOVABLE;
use crate::solver::density::Density;
use crate::solver::prepare::Job;

/// States a drone, over the whole fleet, after which the plan that there is will do. Chosen here:
/// `plan bench warehouse --drones 1500 --seeds 1` is through after 840, 2000 drones never were.
pub(super) const MOST_EXPANSIONS_A_DRONE: u64 = 1_500;
/// Where more than this share of all columns is held in the end, every drone is planned at once
/// first. Chosen here: where less is, one after another nearly always find ways, and better ones.
const CROWDED_SHARE: f64 = 0.4;
/// Orders tried when a drone is left out; chosen here.
const ORDERS: u64 = 4;

/// Plans the whole fleet, with the tables of its steps if there are any; those in `excluded` stay
/// at their starts from the beginning.
pub(crate) fn plan_fleet(
    job: &Job,
    costmap: &Costmap,
    steps: Option<&Steps>,
    excluded: &[(DroneId, FailureKind)],
    planning: &Planning,
    control: &Control<'_>,
    effort: &mut Effort,
) -> Paths {
    let hopeless = known_hopeless(job, excluded);
    let setting = Setting {
        job,
        costmap,
        steps,
        excluded,
        planning,
        control,
    };
    let has_all = |best: &Option<Paths>| {
        let left_out = best.as_ref().map(|paths| paths.unplanned.len());
        left_out == Some(hopeless)
    };
    let better = |one: Option<Paths>, other| one.into_iter().chain(other).min_by_key(score);
    let wakes = costmap.fleet().conditions().wakes;
    let is_crowded = wakes && Density::of_goals(job).share() > CROWDED_SHARE;
    let mut best = None;
    if is_crowded {
        best = plan_by_pibt(&setting, effort);
    }
    for order in 0..ORDERS {
        let found = setting.in_order(order, best.is_some(), effort);
        best = better(best, found);
        if order == 0 && !is_crowded && !has_all(&best) && !(control.stop)() {
            best = better(best, plan_by_pibt(&setting, effort));
        }
        if has_all(&best) || (control.stop)() {
            break;
        }
    }
    let best = best.unwrap_or_else(|| Paths {
        paths: Vec::new(),
        unplanned: Vec::new(),
        costmap: costmap.clone(),
    });
    if best.unplanned.len() == hopeless && (control.improve)() {
        setting.improved(best, effort)
    } else {
        best
    }
}

/// What a fleet is planned with.
pub(super) struct Setting<'a> {
    pub(super) job: &'a Job,
    /// With no drone in it.
    pub(super) costmap: &'a Costmap,
    pub(super) steps: Option<&'a Steps>,
    pub(super) excluded: &'a [(DroneId, FailureKind)],
    pub(super) planning: &'a Planning,
    pub(super) control: &'a Control<'a>,
}

impl Setting<'_> {
    /// One after another; `None` if that takes too long for one that `has_another` plan.
    fn in_order(&self, order: u64, has_another: bool, effort: &mut Effort) -> Option<Paths> {
        let mut attempt = self.attempt(self.costmap.clone(), effort);
        if has_another {
            let most = MOST_EXPANSIONS_A_DRONE * self.job.agents.len() as u64;
            attempt.gives_up_at = Some(attempt.effort.expansions + most);
        }
        attempt.exclude(self.excluded);
        attempt.settle_who_stays();
        let is_through = attempt.run(order_of(self.job, order, self.planning.seed));
        is_through.then(|| attempt.into_paths())
    }

    /// The same plan, better by as much as there is time for.
    fn improved(&self, paths: Paths, effort: &mut Effort) -> Paths {
        let mut attempt = self.attempt(paths.costmap, effort);
        for (drone, _) in &paths.unplanned {
            attempt.weights[drone.0 as usize] = IMMOVABLE;
        }
        for agent in self.job.agents.iter().filter(|agent| agent.stays()) {
            attempt.weights[agent.drone.0 as usize] = IMMOVABLE;
        }
        (attempt.paths, attempt.unplanned) = (paths.paths, paths.unplanned);
        attempt.improve_by_lns();
        attempt.into_paths()
    }

    fn attempt<'b>(&'b self, costmap: Costmap, effort: &'b mut Effort) -> Attempt<'b> {
        let (roadmap, agents) = (&self.job.roadmap, &self.job.agents);
        let energy_weight = self.planning.energy_weight;
        let mut attempt = Attempt::new(
            roadmap,
            agents,
            costmap,
            energy_weight,
            self.control,
            effort,
        );
        attempt.reservations = self
            .steps
            .map(|steps| ReservationTable::new(steps, &attempt.costmap));
        attempt
    }
}

pub(super) fn known_hopeless(job: &Job, excluded: &[(DroneId, FailureKind)]) -> usize {
    let unreachable = |agent: &&Agent| {
        agent.alone_ticks == UNREACHABLE && !excluded.iter().any(|(drone, _)| *drone == agent.drone)
    };
    excluded.len() + job.agents.iter().filter(unreachable).count()
}

/// Those left out, then the sum of arrivals.
fn score(paths: &Paths) -> (usize, u64) {
    let known = paths.paths.iter().flatten();
    let arrivals = known.map(|path| u64::from(path.arrives.0));
    (paths.unplanned.len(), arrivals.sum())
}
