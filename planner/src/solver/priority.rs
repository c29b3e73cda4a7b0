//! The order of the fleet, and what to do when a drone finds no path.
//!
//! Shortest agent first. A search never has to fail: a drone may cross what others hold, at a
//! price for each of them; the drone that is crossed is evicted, replanned next, and dearer from
//! then on. The growing prices end evictions: without growth two drones can evict each other until
//! the end. A drone that is evicted too often, or that has no path at all, stays at its start for
//! good; the rest is planned around it, and the fleet is tried again in other orders, the best
//! answer counting.

use std::borrow::Cow;
use std::collections::VecDeque;

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, Leg};
use costmap::verdict::{Blocker, Verdict, Why};
use rand_xoshiro::SplitMix64;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;

use crate::graph::agent::Agent;
use crate::graph::distances::UNREACHABLE;
use crate::plan::outcome::{Control, Effort};
use crate::scenario::world::{PathMotion, Planning};
use crate::sipp::conflicts::{ReservationTable, Steps};
use crate::sipp::search::IMMOVABLE;
use crate::solver::density;
use crate::solver::pibt::run_pibt;
use crate::solver::prepare::Job;
use attempt::{Attempt, PlanningRate};
pub(crate) use attempt::{FailureKind, Paths};
pub(crate) use repair::{Affected, Repair};

mod attempt;
mod lns;
mod repair;

/// States a drone, over the whole fleet, after which the plan that there is will do. Chosen here:
/// `plan bench warehouse --drones 1500 --seeds 1` is through after 840, 2000 drones never were.
const MOST_EXPANSIONS_A_DRONE: u64 = 1_500;
/// A search for smooth flights takes as many times as many states: chosen here, halls of 500 take
/// twice, of 1000 three times as many.
const SMOOTH_STATES: u64 = 3;
/// The same where air takes time: chosen here, a hall of 1000 that is given up after less takes
/// five times the sum of costs.
const LATE_STATES: u64 = 4;
/// States after which a plan that there may be is asked for, at least: chosen here, half a second
/// of work, in which a small fleet is through but for its hardest cases.
const FEWEST_EXPANSIONS: u64 = 100_000;
/// Where more than this share of all columns is held in the end, PIBT plans first. Chosen here:
/// where less is, prioritized planning nearly always finds paths, and better ones.
const CROWDED_SHARE: f64 = 0.4;
/// Orders tried when a drone is unplanned; chosen here.
const ORDERS: u64 = 4;
/// Fleets up to this size are improved without being asked: chosen here, what a window or a shaft
/// holds.
pub(crate) const MOST_SMALL: usize = 30;
/// Sum of costs over its lower bound from which a small fleet is planned in other orders and on
/// finer cells, too. Chosen here: windows and shafts that are shared over time stay below.
const FAR_FROM_BOUND_RATIO: f64 = 1.4;
/// The same from which it is told that a fleet was planned by PIBT. Chosen here.
const NOTED_RATIO: f64 = 3.0;
/// States that it takes. Chosen here: two tenths of a second of work.
const SMALL_EXPANSIONS: u64 = 100_000;
/// A state without tables takes as long as so many with them: chosen here, of random worlds with
/// zones, where one takes a tenth of a millisecond and more.
pub(crate) const UNTABULATED_STATES: u64 = 8;
/// And one without tables where air takes time so many times as long again: chosen here, of random
/// worlds, where one takes up to half a millisecond.
pub(crate) const UNTABULATED_LATE_STATES: u64 = 4;

/// A fleet to be planned, and what it is planned with.
pub(crate) struct FleetProblem<'a> {
    /// Roadmap and agents.
    pub(crate) job: &'a Job,
    /// With no drone of the fleet in it.
    pub(crate) costmap: &'a Costmap,
    /// The tables of its steps, if there are any.
    pub(crate) steps: Option<Steps>,
    /// Drones that stay at their starts from the beginning, and why.
    pub(crate) excluded: &'a [(DroneId, FailureKind)],
    /// Seed and price of energy.
    pub(crate) planning: &'a Planning,
    /// Says when to stop, and whether to improve a complete plan.
    pub(crate) control: &'a Control<'a>,
    /// States after which, in all, it gives up; `None`: as many as it takes.
    pub(crate) most_expansions: Option<u64>,
    /// Whether there is another answer where the states end: drones are planned one after another
    /// alone, for as long as it takes.
    pub(crate) is_tried: bool,
    /// Whether more is asked than which can be planned: other orders and LNS for a better plan.
    pub(crate) improves: bool,
}

/// Plans the whole fleet: in one order after another, or by PIBT where the floor is crowded; then
/// improves it while there is time, small fleets always. Adds what it did to `effort`. `None` only
/// where the budget of states ended first.
pub(crate) fn plan_fleet(problem: &FleetProblem<'_>, effort: &mut Effort) -> Option<Paths> {
    let (job, control) = (problem.job, problem.control);
    // As much work, where every step of every state is judged by the costmap.
    let share = match problem.steps {
        Some(_) => 1,
        None => UNTABULATED_STATES,
    };
    let gives_up_at = (problem.most_expansions).map(|most| effort.expansions + most / share);
    let hopeless = problem.hopeless();
    let has_all = |best: &Option<Paths>| {
        let unplanned = best.as_ref().map(|paths| paths.unplanned.len());
        unplanned == Some(hopeless)
    };
    let better = |one: Option<Paths>, other| one.into_iter().chain(other).min_by_key(score);
    let wakes = problem.costmap.fleet().conditions().wakes;
    let is_crowded = wakes && density::of_goals(job).share() > CROWDED_SHARE;
    let mut best = None;
    let mut first = None;
    if problem.is_tried {
        for order in 0..ORDERS {
            let found = problem.in_order(order, GiveUpRule::AtBudget, gives_up_at, effort);
            best = better(best, found.map(InOrder::into_paths));
            let is_spent = gives_up_at.is_some_and(|most| effort.expansions > most);
            if has_all(&best) || is_spent || (control.stop)() {
                break;
            }
        }
    }
    if is_crowded && !problem.is_tried {
        let mut own = Effort::default();
        let left = gives_up_at.map(|most| most.saturating_sub(effort.expansions));
        (best, first) = rayon::join(
            || plan_by_pibt(problem, left, &mut own),
            || problem.in_order(0, GiveUpRule::Soon, gives_up_at, effort),
        );
        effort.add(&own);
    }
    let orders = if problem.is_tried { 0 } else { ORDERS };
    for order in 0..orders {
        // Where the first takes long, PIBT is asked before it goes on.
        let is_first = order == 0 && !is_crowded;
        let give_up_rule = match best.is_some() || is_first {
            true => GiveUpRule::Soon,
            false => GiveUpRule::AtBudget,
        };
        let found = match first.take() {
            None => problem.in_order(order, give_up_rule, gives_up_at, effort),
            first => first,
        };
        let (found, begun) = match found {
            Some(InOrder::Through(paths)) => (Some(paths), None),
            Some(InOrder::Begun(paths)) => (None, Some(paths)),
            None => (None, None),
        };
        best = better(best, found);
        if is_first && !has_all(&best) && !(control.stop)() {
            best = better(best, plan_by_pibt(problem, gives_up_at, effort));
            if best.is_none() && !problem.lacks_tables() && !(control.stop)() {
                let whole = problem.in_order(order, GiveUpRule::AtBudget, gives_up_at, effort);
                best = whole.map(InOrder::into_paths);
            }
        }
        if best.is_none() || (control.stop)() {
            best = better(best, begun);
        }
        let is_spent = gives_up_at.is_some_and(|most| effort.expansions > most);
        let may_improve = |it: &Paths| problem.improves && is_far_from_bound(job, it);
        let is_done = has_all(&best) && !best.as_ref().is_some_and(may_improve);
        if is_done || is_spent || (control.stop)() {
            break;
        }
    }
    let best = best?;
    let left = gives_up_at.map_or(u64::MAX, |most| most.saturating_sub(effort.expansions));
    let states = match job.agents.len() {
        // A plan that is yet to be verified is left as it is.
        _ if problem.costmap.has_limits_raised() || !problem.improves => 0,
        ..=MOST_SMALL => (SMALL_EXPANSIONS / share).min(left),
        _ => 0,
    };
    let is_improved = best.unplanned.len() == hopeless && (states > 0 || (control.improve)());
    Some(match is_improved {
        true => problem.improved(best, states, effort),
        false => best,
    })
}

/// When planning in one order gives up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum GiveUpRule {
    /// Where it takes too long: there is something else or may be.
    Soon,
    /// Where the budget of states ends.
    AtBudget,
}

/// What planning in one order came to.
enum InOrder {
    /// It went through.
    Through(Paths),
    /// It gave up; as far as it got.
    Begun(Paths),
}

impl InOrder {
    fn into_paths(self) -> Paths {
        let (InOrder::Through(paths) | InOrder::Begun(paths)) = self;
        paths
    }
}

impl FleetProblem<'_> {
    /// Prioritized planning. `None` where the budget of states ended first.
    fn in_order(
        &self,
        order: u64,
        give_up_rule: GiveUpRule,
        gives_up_at: Option<u64>,
        effort: &mut Effort,
    ) -> Option<InOrder> {
        let mut attempt = self.attempt(self.costmap.clone(), effort);
        attempt.gives_up_at = gives_up_at;
        if give_up_rule == GiveUpRule::Soon {
            let most = MOST_EXPANSIONS_A_DRONE * self.job.agents.len() as u64;
            // Places are reached along several headings.
            let is_smooth = self.job.agents.iter().any(|it| it.smoothing.is_some());
            let smooth = if is_smooth { SMOOTH_STATES } else { 1 };
            let is_advected = self.costmap.wake_persistence_ticks() > 0;
            let is_small = self.job.agents.len() <= MOST_SMALL;
            let (late, untabulated) = match is_advected {
                true if self.lacks_tables() => (1, UNTABULATED_LATE_STATES * UNTABULATED_STATES),
                true => (LATE_STATES, 1),
                // A small fleet's states are those of its hardest cases.
                false if is_small => (1, UNTABULATED_LATE_STATES * UNTABULATED_STATES),
                false => (1, UNTABULATED_STATES),
            };
            let most = smooth * late * most;
            let share = match self.lacks_tables() {
                true if order > 0 => untabulated,
                true => untabulated / 4,
                false => 1,
            };
            let most = most.max(FEWEST_EXPANSIONS) / share;
            let enough = attempt.effort.expansions + most;
            attempt.gives_up_at = Some(gives_up_at.map_or(enough, |most| most.min(enough)));
            attempt.rate = (self.job.agents.len() > MOST_SMALL).then_some(PlanningRate {
                begun: attempt.effort.expansions,
                spans: 0,
                planned: 0,
            });
        }
        attempt.exclude(self.excluded);
        attempt.fix_stationary_drones();
        let is_through = attempt.run(order_of(self.job, order, self.planning.seed));
        if !is_through {
            if self.most_expansions.is_some() {
                return None;
            }
            let waiting = std::mem::take(&mut attempt.waiting);
            attempt.finalise(waiting);
        }
        let paths = attempt.into_paths();
        Some(match is_through {
            true => InOrder::Through(paths),
            false => InOrder::Begun(paths),
        })
    }

    /// The same plan, better by what so many states find, and by as much as there is time for.
    fn improved(&self, paths: Paths, states: u64, effort: &mut Effort) -> Paths {
        let legs = (paths.paths.iter()).map(|path| path.as_ref().map_or(&[][..], |it| &it.legs));
        let legs: Vec<Vec<Leg>> = legs.map(<[Leg]>::to_vec).collect();
        let mut attempt = self.attempt_from(paths.costmap, legs, effort);
        for (drone, _) in &paths.unplanned {
            attempt.weights[drone.0 as usize] = IMMOVABLE;
        }
        for agent in self.job.agents.iter().filter(|agent| agent.stays()) {
            attempt.weights[agent.drone.0 as usize] = IMMOVABLE;
        }
        (attempt.paths, attempt.unplanned) = (paths.paths, paths.unplanned);
        attempt.improve_by_lns(attempt.effort.expansions + states);
        attempt.into_paths()
    }

    /// A fleet of which nothing is planned yet, with a reservation table of what is in the costmap.
    fn attempt<'b>(&'b self, costmap: Costmap, effort: &'b mut Effort) -> Attempt<'b> {
        self.attempt_from(costmap, Vec::new(), effort)
    }

    /// The same with the legs of those that are planned, before they are smoothed.
    fn attempt_from<'b>(
        &'b self,
        costmap: Costmap,
        legs: Vec<Vec<Leg>>,
        effort: &'b mut Effort,
    ) -> Attempt<'b> {
        let energy_weight = self.planning.energy_weight;
        let mut attempt = Attempt::new(self.job, costmap, energy_weight, self.control, effort);
        for (known, legs) in attempt.legs.iter_mut().zip(legs) {
            if !legs.is_empty() {
                *known = legs;
            }
        }
        let table = |steps| ReservationTable::new(steps, &attempt.costmap, &attempt.legs);
        attempt.reservations = self.steps.as_ref().map(table);
        attempt.has_small_budget |= self.lacks_tables();
        attempt
    }

    /// Whether states take long: no table answers for its steps, or for some of them.
    fn lacks_tables(&self) -> bool {
        self.steps.is_none() || self.job.roadmap.has_channels()
    }

    /// Number of drones that no order can plan: the excluded, and those that no path leads to a
    /// task.
    fn hopeless(&self) -> usize {
        let known = |drone: DroneId| self.excluded.iter().any(|(other, _)| *other == drone);
        let unreachable =
            |agent: &&Agent| agent.lower_bound_ticks == UNREACHABLE && !known(agent.drone);
        self.excluded.len() + self.job.agents.iter().filter(unreachable).count()
    }
}

/// The sum of costs of those that have a path over its lower bound.
fn suboptimality(job: &Job, paths: &Paths) -> f64 {
    let planned = job.agents.iter().zip(&paths.paths);
    let planned = planned.filter(|(_, path)| path.is_some());
    let lower_bound: u64 = planned
        .map(|(agent, _)| u64::from(agent.lower_bound_ticks))
        .sum();
    score(paths).1 as f64 / lower_bound.max(1) as f64
}

/// Whether a small fleet's sum of costs is so far above its lower bound that another order, or
/// finer cells, may well do better.
pub(crate) fn is_far_from_bound(job: &Job, paths: &Paths) -> bool {
    job.agents.len() <= MOST_SMALL && suboptimality(job, paths) > FAR_FROM_BOUND_RATIO
}

/// What to tell of a fleet that takes far longer than its drones alone, planned by PIBT.
pub(crate) fn note_of_pibt(
    planning: &Planning,
    job: &Job,
    paths: &Paths,
    effort: &Effort,
) -> Option<String> {
    let ratio = suboptimality(job, paths);
    let is_reported = effort.rounds > 0 && ratio > NOTED_RATIO && planning.margins.time_s > 0.0;
    let smooth = match planning.motion {
        PathMotion::Smooth => ", or `motion: Straight`,",
        PathMotion::Straight => "",
    };
    is_reported.then(|| {
        format!(
            "drones take {ratio:.0} times as long as each alone: all step at the same moments, so \
             slowly that one may be early and another late by `time_margin_s` ({} s); a smaller \
             margin{smooth} may be faster",
            planning.margins.time_s
        )
    })
}

/// Unplanned drones, then the sum of costs.
pub(crate) fn score(paths: &Paths) -> (usize, u64) {
    let known = paths.paths.iter().flatten();
    let arrivals = known.map(|path| u64::from(path.arrives.0));
    (paths.unplanned.len(), arrivals.sum())
}

/// By individual lower bound; later orders shuffle neighbours more and more.
fn order_of(job: &Job, order: u64, seed: u64) -> VecDeque<DroneId> {
    let key = |agent: &Agent| {
        let lower_bound = u64::from(agent.lower_bound_ticks);
        let seed = seed ^ (order << 32) ^ u64::from(agent.drone.0);
        let noise = SplitMix64::seed_from_u64(seed).next_u64() % 1000;
        // In the first order noise only breaks ties.
        let length = lower_bound * 1000 + order * lower_bound * noise / 2 + noise;
        (length, agent.drone)
    };
    let mut keyed: Vec<(u64, DroneId)> = job.agents.iter().map(key).collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, drone)| drone).collect()
}

/// Paths for every drone but the excluded, or `None`.
fn plan_by_pibt(
    problem: &FleetProblem<'_>,
    gives_up_at: Option<u64>,
    effort: &mut Effort,
) -> Option<Paths> {
    let FleetProblem {
        job,
        costmap,
        excluded,
        control,
        planning,
        ..
    } = *problem;
    let steps = problem.steps.as_ref()?;
    // PIBT asks the tables alone, which know of no zone.
    let has_zones = costmap.has_air_limits_of_zones();
    if problem.hopeless() > excluded.len() || job.roadmap.has_channels() || has_zones {
        return None;
    }
    let fixed: Vec<DroneId> = excluded.iter().map(|(drone, _)| *drone).collect();
    let run = run_pibt(job, costmap, steps, &fixed, planning.seed, control, effort)?;
    let most = effort.expansions + MOST_EXPANSIONS_A_DRONE * job.agents.len() as u64;
    let energy_weight = planning.energy_weight;
    let mut attempt = Attempt::new(job, costmap.clone(), energy_weight, control, effort);
    attempt.agents = Cow::Borrowed(&run.agents);
    attempt.gives_up_at = Some(gives_up_at.map_or(most, |until| until.min(most)));
    attempt.detours = false;
    attempt.reservations = Some(ReservationTable::new(steps, costmap, &[]));
    let mut waiting = Vec::new();
    for (index, agent) in run.agents.iter().enumerate() {
        if run.fixed[index] {
            attempt.weights[index] = IMMOVABLE;
        }
        if let Some(path) = &run.settled[index] {
            attempt.reserve(path.legs.clone());
            attempt.paths[index] = Some(path.clone());
        } else {
            attempt.reserve(agent.begun.clone());
            waiting.push((agent.lower_bound_ticks, agent.drone));
        }
    }
    waiting.sort_unstable();
    let is_through = attempt.run(waiting.into_iter().map(|(_, drone)| drone).collect());
    if !is_through || !attempt.unplanned.is_empty() {
        return None;
    }
    let costmap = &attempt.costmap;
    let is_free = |leg: &Leg| {
        let mut verdict = Verdict::default();
        costmap.judge(leg, &mut verdict);
        // What others bear of it is counted with their own legs: here it is among their loads
        // already, and would be counted twice.
        let is_own = |blocker: &Blocker| blocker.why != Why::TheirLimit;
        verdict.breaks_zone.is_none() && !verdict.blockers.iter().any(is_own)
    };
    let paths = attempt.paths.par_iter().zip(&run.agents);
    let legs = paths.filter_map(|(path, agent)| Some(agent.flown(&path.as_ref()?.legs)));
    if !legs.map(|legs| legs.iter().all(is_free)).all(|it| it) {
        return None;
    }
    for (drone, _) in excluded {
        attempt.paths[drone.0 as usize] = None;
    }
    attempt.unplanned = excluded.to_vec();
    Some(attempt.into_paths())
}

#[cfg(test)]
impl<'a> FleetProblem<'a> {
    /// The whole fleet of a world, without a budget.
    pub(crate) fn of(world: &'a crate::World, job: &'a Job, costmap: &'a Costmap) -> Self {
        FleetProblem {
            job,
            costmap,
            steps: Steps::new(job.roadmap.lattice(), &job.agents, costmap),
            excluded: &[],
            planning: &world.planning,
            control: &Control::QUIET,
            most_expansions: None,
            is_tried: false,
            improves: true,
        }
    }
}

#[cfg(test)]
mod tests {
    use costmap::leg::Tick;

    use super::*;
    use crate::graph::agent::Ending;
    use crate::graph::passage::Passages;
    use crate::scenario::world::AtEnd;
    use crate::solver::assemble::assemble;
    use crate::solver::prepare::prepare;
    use crate::verify::verify;

    /// Sixty drones on twelve metres by twelve, two tasks each, the first with a dwell.
    #[test]
    fn steps_together_and_those_left_make_a_plan_that_the_verifier_finds_nothing_in() {
        let text = tools::instances::hall(60, 2).expect("there is room");
        let world = crate::scenario::read_world(&text).expect("in order");
        let mut world = world.relaxed().expect("it leaves rules open");
        let column = |index: usize| {
            (
                (index * 53 % 144 % 12) as f64 + 0.5,
                (index * 53 % 144 / 12) as f64 + 0.5,
            )
        };
        for (index, drone) in world.drones.iter_mut().enumerate() {
            (drone.start_m.x, drone.start_m.y) = column(index);
            let mut first = drone.tasks[0].clone();
            (first.to_m.x, first.to_m.y) = column(index + 31);
            first.dwell_s = 0.7 * (index % 3) as f64;
            (drone.tasks[0].to_m.x, drone.tasks[0].to_m.y) = column(index + 83);
            drone.tasks.insert(0, first);
            drone.at_end = match index % 6 {
                0 => AtEnd::Land,
                3 => AtEnd::Leave,
                _ => AtEnd::Hover,
            };
            if drone.at_end == AtEnd::Land {
                // Not so low that it is reached from straight above.
                let last = drone.tasks.last_mut().expect("it has two");
                last.to_m.z = last.to_m.z.max(1.0);
            }
        }
        world.drones[7].tasks.clear();
        (world.bounds_m.max.x, world.bounds_m.max.y) = (12.0, 12.0);
        let job = prepare(&world, &Passages::of(&world), &|| false);
        let costmap = job.costmap(&world, world.drones.len());
        let problem = FleetProblem::of(&world, &job, &costmap);
        let mut effort = Effort::default();
        let paths = plan_by_pibt(&problem, None, &mut effort).expect("every drone comes home");
        assert!(effort.rounds > 0);
        let report = verify(&assemble(&world, &job, &paths));
        assert!(report.violations.is_empty(), "{:#?}", report.violations);
        for (path, agent) in paths.paths.iter().flatten().zip(&job.agents) {
            let last = path.legs.last().expect("it flies");
            let goal_m = job.roadmap.position_m(agent.last_vertex());
            match agent.ending {
                Ending::Hover => assert_eq!((last.to_m, last.end), (goal_m, Tick::FOREVER)),
                Ending::Leave => assert_eq!(last.to_m, goal_m),
                Ending::Land { rest_m, .. } => {
                    assert_eq!((last.to_m, last.flying), (rest_m, false))
                }
            }
            if agent.waypoints.is_empty() {
                assert_eq!(path.legs.len(), 1, "no drone without a task is displaced");
                continue;
            }
            let passes = |leg: &Leg| {
                leg.stays()
                    && leg.from_m == job.roadmap.position_m(agent.waypoints[0].distances.goal())
            };
            let dwells = path.legs.iter().filter(|leg| passes(leg));
            let longest = dwells.map(|leg| leg.end.0 - leg.start.0).max();
            assert!(longest.unwrap_or(0) >= agent.waypoints[0].dwell_ticks);
        }
    }

    /// Twenty drones in a hall, every other one beside the lattice where it starts and where it is
    /// sent.
    #[test]
    fn starts_and_goals_beside_the_lattice_take_part_in_steps_together() {
        let text = tools::instances::hall(20, 5).expect("there is room");
        let mut world = crate::scenario::read_world(&text).expect("in order");
        let aside = nalgebra::Vector3::new(0.3, 0.2, 0.1);
        for drone in world.drones.iter_mut().step_by(2) {
            drone.start_m += aside;
            drone.tasks.iter_mut().for_each(|task| task.to_m += aside);
        }
        let job = prepare(&world, &Passages::of(&world), &|| false);
        let beside = |agent: &&Agent| job.roadmap.is_stop(agent.start);
        assert_eq!(job.agents.iter().filter(beside).count(), 10);
        let costmap = job.costmap(&world, world.drones.len());
        let problem = FleetProblem::of(&world, &job, &costmap);
        let mut effort = Effort::default();
        let paths = plan_by_pibt(&problem, None, &mut effort).expect("there is room for all");
        assert!(effort.rounds > 0);
        let report = verify(&assemble(&world, &job, &paths));
        assert!(report.violations.is_empty(), "{:#?}", report.violations);
        for (path, drone) in paths.paths.iter().flatten().zip(&world.drones) {
            let last = path.legs.last().expect("it flies");
            let goal_m = drone.tasks.last().map(|task| task.to_m);
            assert!((last.to_m - goal_m.expect("it has a task")).norm() < 1e-9);
        }
    }

    /// Small drones on a ring, a quarter of a metre from one to the next, each sent across to the
    /// other side: those at their goals close the ring before the last are there.
    #[test]
    fn drones_that_trade_places_across_a_ring_all_come_home() {
        const DRONES: usize = 49;
        let turn = std::f64::consts::TAU / DRONES as f64;
        let radius_m = 0.25 / (2.0 * (0.5 * turn).sin());
        let drone = |index: usize| {
            let angle = turn * index as f64;
            let [x, y] = [angle.cos(), angle.sin()].map(|part| radius_m * part);
            format!(
                r#"(name: "d{index}", airframe: "crazyflie-2.1",
                start_m: ({:.3}, {:.3}, 1.25), tasks: [(to_m: ({:.3}, {:.3}, 1.25))])"#,
                3.0 + x,
                3.0 + y,
                3.0 - x,
                3.0 - y
            )
        };
        let drones: Vec<String> = (0..DRONES).map(drone).collect();
        let text = format!(
            r#"(name: "ring", bounds_m: (min: (0, 0, 0), max: (6, 6, 3)), drones: [{}],
            planning: (cell_m: 0.25, time_margin_s: 0, tracking_m: 0))"#,
            drones.join(", ")
        );
        let world = crate::scenario::read_world(&text).expect("in order");
        let world = world.relaxed().expect("it leaves rules open");
        let job = prepare(&world, &Passages::of(&world), &|| false);
        let costmap = job.costmap(&world, world.drones.len());
        let problem = FleetProblem::of(&world, &job, &costmap);
        let mut effort = Effort::default();
        let paths = plan_by_pibt(&problem, None, &mut effort).expect("every drone comes home");
        let report = verify(&assemble(&world, &job, &paths));
        assert!(report.violations.is_empty(), "{:#?}", report.violations);
    }
}
