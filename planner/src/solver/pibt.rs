//! PIBT for the whole fleet, where prioritized planning finds no paths.
//!
//! On a crowded floor the drone planned last is obstructed by the rest, in any order: with half of
//! all columns held, drones waiting at their starts and drones at their goals leave hardly any path
//! free. Here all drones step synchronously, one cell along one axis or none, for as long as the
//! slowest needs; a drone in conflict with a step is displaced by priority inheritance, at its goal
//! or not. The paths are longer than those of [`crate::solver::priority`], which plans the drones
//! left at the end.
//!
//! Conflicts between two steps are read from the conflict tables, with room to spare for the sums
//! of many wakes.

use std::collections::VecDeque;

use costmap::costmap::Costmap;
use costmap::leg::{DroneId, Leg, Tick};
use rayon::prelude::*;

use crate::graph::agent::Agent;
use crate::plan::outcome::{Control, Effort};
use crate::sipp::conflicts::Steps;
use crate::sipp::conflicts::synchronous::StepInteractions;
use crate::sipp::search::{Path, joined};
use crate::solver::prepare::Job;

mod configuration;
mod far;
mod round;

use configuration::{AgentState, Configuration};
use round::{PastRound, Round};

/// Share of drones that may be away from their goals in the end: chosen here, a fiftieth. The last
/// few displace one another from there in turn, and are sooner planned one after another.
const LAST_SHARE: usize = 50;
/// Rounds without a new minimum of the steps left: chosen here, longer than a queue takes to
/// dissolve.
const MOST_IN_VAIN: usize = 60;

/// For every so many rounds in which a drone comes no nearer to its goal it may detour by one more
/// step. Chosen here, of a hundred drones that swap across a ring: with fewer, drones that only
/// wait make detours; with more it takes longer.
const ROUNDS_A_DETOUR_STEP: u32 = 4;
/// Longest detour (steps): chosen here, once around another drone.
const MOST_DETOUR: u32 = 4;

/// How far a fleet came by PIBT rounds.
pub(crate) struct PibtRun {
    /// What every drone has to do after the last step, begun with all of its legs up to then.
    pub(crate) agents: Vec<Agent>,
    /// Paths of drones at their final places; `None`: still on the way.
    pub(crate) settled: Vec<Option<Path>>,
    /// Whether each stays at its start whatever happens.
    pub(crate) fixed: Vec<bool>,
}

/// Moves every drone as far towards its goal as synchronous steps get it; drones in `fixed` and
/// drones without tasks stay at their starts.
///
/// `None` where it was told to stop, where that is too much to tabulate, and where steps along the
/// lattice, and to and from stops beside it, are not all that drones do: starts on the ground,
/// goals low over their pads, flights begun already, others' trajectories.
pub(crate) fn run_pibt(
    job: &Job,
    costmap: &Costmap,
    steps: &Steps,
    fixed: &[DroneId],
    seed: u64,
    control: &Control<'_>,
    effort: &mut Effort,
) -> Option<PibtRun> {
    if costmap.drone_count() != job.agents.len() {
        return None;
    }
    let ticks = job
        .agents
        .iter()
        .map(|agent| agent.mover.slowest_axis_ticks());
    let mut is_fixed: Vec<bool> = job.agents.iter().map(Agent::stays).collect();
    for drone in fixed {
        is_fixed[drone.0 as usize] = true;
    }
    // At that pace any step may follow any other.
    let smooth = job.agents.iter().filter_map(|agent| {
        let smoothing = agent.smoothing.as_ref()?;
        Some(smoothing.ticks_between_any(synchronous_m(job)))
    });
    let ticks = ticks.chain(smooth);
    let lead = job.agents.iter().map(Agent::lead_ticks).max().unwrap_or(0);
    let synchronous = StepInteractions::new(steps, ticks.max()?);
    let ticks = synchronous.ticks;
    let configuration = Configuration::new(job, &synchronous, &is_fixed, ticks)?;
    let starts = configuration.starts(&job.agents);
    let all = rounds(&configuration, starts, seed, control.stop)?;
    effort.rounds += all.len() as u64 - 1;
    let clock = RoundClock { ticks, lead };
    let at = clock.moment(all.len() - 1);
    let each = job.agents.par_iter().enumerate().map(|(drone, agent)| {
        let places: Vec<AgentState> = all.iter().map(|now| now[drone]).collect();
        let last = places[places.len() - 1];
        let is_home = configuration.is_home(drone, &last);
        let begun = legs(job, agent, &places, false, clock);
        let settled = if is_fixed[drone] {
            let stays = agent.stays_at_start(&job.roadmap);
            Some(Path::new(vec![stays], Tick(0)))
        } else {
            is_home.then(|| stay_home(job, agent, legs(job, agent, &places, true, clock)))
        };
        (rest_of(job, agent, &last, (at, begun)), settled)
    });
    let (agents, settled) = each.unzip();
    Some(PibtRun {
        agents,
        settled,
        fixed: is_fixed,
    })
}

/// When rounds begin.
#[derive(Clone, Copy)]
struct RoundClock {
    /// How long each lasts.
    ticks: u32,
    /// Before the first.
    lead: u32,
}

impl RoundClock {
    /// When the n-th round ends.
    fn moment(self, round: usize) -> Tick {
        Tick(self.lead + round as u32 * self.ticks)
    }
}

/// The longest step (m).
fn synchronous_m(job: &Job) -> f64 {
    let ends = |agent: &Agent| {
        job.roadmap.is_stop(agent.start) || agent.goals().any(|it| job.roadmap.is_stop(it))
    };
    let lengths_m = job.roadmap.lattice().step_lengths_m();
    f64::from(lengths_m[if job.agents.iter().any(ends) { 2 } else { 0 }])
}

/// Legs of a drone that is at these places after each round; at its goal they end with the last
/// step there.
fn legs(
    job: &Job,
    agent: &Agent,
    places: &[AgentState],
    is_home: bool,
    clock: RoundClock,
) -> Vec<Leg> {
    let last = places.len() - 1;
    let moves = |step: &usize| places[*step].place != places[last].place;
    let until = match is_home {
        true => (0..last).rev().find(moves).map_or(0, |step| step + 1),
        false => last,
    };
    let legs = (0..until).map(|step| {
        let (at, to) = (&places[step], &places[step + 1]);
        let kind = usize::from(at.waypoint) + usize::from(at.rest > 0);
        let kind = agent.kinds[kind.min(agent.kinds.len() - 1)];
        Leg {
            start: clock.moment(step),
            end: clock.moment(step + 1),
            to_m: job.roadmap.position_m(to.place),
            ..agent.hover(job.roadmap.position_m(at.place), kind)
        }
    });
    let first_m = job.roadmap.position_m(places[0].place);
    let waits = Leg {
        end: clock.moment(0),
        ..agent.hover(first_m, agent.kinds[0])
    };
    let waits = (until > 0 && clock.lead > 0).then_some(waits);
    joined(waits.into_iter().chain(legs).collect())
}

/// A drone's remaining tasks from there; a dwell that has begun restarts.
fn rest_of(job: &Job, agent: &Agent, last: &AgentState, (at, begun): (Tick, Vec<Leg>)) -> Agent {
    let waypoint = usize::from(last.waypoint);
    let mut rest = Agent {
        start: last.place,
        departs: at,
        begun,
        waypoints: agent.waypoints[waypoint..].to_vec(),
        kinds: agent.kinds[waypoint..].to_vec(),
        ..agent.clone()
    };
    rest.lower_bound_ticks = rest.remaining(&job.roadmap, 0, rest.start);
    rest.forget();
    rest
}

/// The legs of a drone with its stay at its goal.
fn stay_home(job: &Job, agent: &Agent, mut legs: Vec<Leg>) -> Path {
    let home = legs.last().map_or(Tick(0), |last| last.end);
    let at_m = job.roadmap.position_m(agent.last_vertex());
    let dwell = agent.waypoints.last().map_or(0, |it| it.dwell_ticks);
    let arrives = home.after(dwell);
    let stay = Leg {
        start: home,
        ..agent.hover(at_m, agent.kinds[agent.kinds.len() - 1])
    };
    if dwell > 0 {
        legs.push(Leg {
            end: arrives,
            ..stay
        });
    }
    legs.extend(agent.ends(Leg {
        start: arrives,
        ..stay
    }));
    Path::new(joined(legs), arrives)
}

/// Where every drone is after each round, up to the one that left the fewest steps; `None` if it
/// was told to stop.
fn rounds(
    configuration: &Configuration<'_>,
    starts: Vec<AgentState>,
    seed: u64,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<Vec<AgentState>>> {
    let drones = configuration.len();
    let left = |all: &[AgentState]| -> u32 {
        let of = |drone: usize| configuration.steps_left(drone, &all[drone]);
        (0..drones).map(of).sum()
    };
    // PIBT priorities: rounds since each drone was last at its goal; at first, drones with farther
    // to go precede others.
    let far = |drone: usize| configuration.steps_left(drone, &starts[drone]);
    let farthest = (0..drones).map(far).max().unwrap_or(0);
    let first = |drone: usize| far(drone) as f32 / (farthest + 1) as f32;
    let mut urgency: Vec<f32> = (0..drones).map(first).collect();
    let mut order: Vec<u32> = (0..drones as u32).collect();
    // The fewest steps that each was from its goal, and for how many rounds it has come no nearer.
    let mut nearest: Vec<(u32, u32)> = (0..drones).map(|drone| (far(drone), 0)).collect();
    let mut detours = vec![0; drones];
    let (mut fewest, mut best) = (left(&starts), 0);
    let mut all = vec![starts];
    let rounds_back = configuration.synchronous.rounds_back();
    let mut past: VecDeque<PastRound> = VecDeque::new();
    while fewest > 0 && all.len() - best <= MOST_IN_VAIN {
        if stop() {
            return None;
        }
        let now = &all[all.len() - 1];
        order.sort_by(|a, b| urgency[*b as usize].total_cmp(&urgency[*a as usize]));
        let random = seed ^ (all.len() as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let before = &all[all.len().saturating_sub(2)];
        let round = Round::new(configuration, ([before, now], &past), &detours, random);
        let directions = round.decide_all(&order);
        let after = |(drone, direction): (usize, &u8)| {
            configuration.after(drone, &now[drone], usize::from(*direction))
        };
        let next: Vec<AgentState> = directions.iter().enumerate().map(after).collect();
        if rounds_back > 0 {
            past.truncate(rounds_back - 1);
            past.push_front(PastRound::new(configuration, now, &directions));
        }
        for (drone, urgency) in urgency.iter_mut().enumerate() {
            *urgency = if configuration.is_home(drone, &next[drone]) {
                urgency.fract()
            } else {
                *urgency + 1.0
            };
        }
        for (drone, (least, rounds)) in nearest.iter_mut().enumerate() {
            let left = configuration.steps_left(drone, &next[drone]);
            let is_home = configuration.is_home(drone, &next[drone]);
            (*least, *rounds) = match left {
                // Displaced from there it begins anew.
                _ if is_home => (u32::MAX, 0),
                left if left < *least => (left, 0),
                _ => (*least, *rounds + 1),
            };
            detours[drone] = (*rounds / ROUNDS_A_DETOUR_STEP).min(MOST_DETOUR);
        }
        let now_left = left(&next);
        let away = (0..drones).filter(|&drone| !configuration.is_home(drone, &next[drone]));
        let away = away.count();
        all.push(next);
        if now_left < fewest {
            (fewest, best) = (now_left, all.len() - 1);
            if away * LAST_SHARE <= drones {
                break;
            }
        }
    }
    all.truncate(best + 1);
    Some(all)
}
