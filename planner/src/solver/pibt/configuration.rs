//! Starts and goals of the drones, in whole steps of the lattice.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rayon::prelude::*;

use super::far::{Far, links};
use crate::graph::agent::{Agent, Waypoint};
use crate::graph::roadmap::{Roadmap, Vertex};
use crate::sipp::conflicts::Steps;
use crate::sipp::conflicts::synchronous::{
    AMONG_NEIGHBOURS, DIRECTIONS, STAYS, StepDirection, StepInteractions, SynchronousStep,
};
use crate::solver::prepare::Job;

/// Places times goals; fleets with more are not planned together. Chosen here: half a gigabyte
/// where there are obstacles, none where not.
const MOST_ENTRIES: usize = 256 << 20;

/// Places next to a stop beside the lattice, at most: the corners of its cell, or those around
/// where some of these are blocked.
pub(super) const MOST_LINKS: usize = 32;

/// Where a drone is between two steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct AgentState {
    /// A lattice place, or a stop beside the lattice.
    pub(super) place: Vertex,
    /// Which of its tasks it is on the way to.
    pub(super) waypoint: u16,
    /// Steps for which it still dwells there.
    pub(super) rest: u16,
}

/// One drone.
struct ConfigurationMember {
    /// Where its tasks are; its start, if it has none.
    goals: Vec<Vertex>,
    /// Steps of dwelling at each but the last, where it stays until the end.
    rests: Vec<u16>,
    /// Steps to each of them.
    far: Vec<Arc<Far>>,
    /// Of those of its stops that are beside the lattice, the places next to each.
    links: BTreeMap<Vertex, Vec<Vertex>>,
    /// Steps from each of them to the last.
    after: Vec<u32>,
    /// By task, what flies towards it.
    classes: Vec<usize>,
    /// Of the ball that must stay clear (m).
    radius_m: f64,
    /// It stays at its start whatever happens.
    is_fixed: bool,
}

/// Every drone.
pub(super) struct Configuration<'a> {
    /// Steps that are open, and where places are.
    roadmap: &'a Roadmap,
    /// What two steps do to one another.
    pub(super) synchronous: &'a StepInteractions<'a>,
    /// By drone.
    members: Vec<ConfigurationMember>,
    /// Whether a drone may be beside the lattice.
    pub(super) is_beside: bool,
}

impl<'a> Configuration<'a> {
    /// `None` where a drone's path is not one along the lattice from the beginning to the end.
    pub(super) fn new(
        job: &'a Job,
        synchronous: &'a StepInteractions<'a>,
        fixed: &[bool],
        step_ticks: u32,
    ) -> Option<Configuration<'a>> {
        let roadmap = &job.roadmap;
        let members = job.agents.iter().zip(fixed);
        let members = members
            .map(|(agent, fixed)| member(roadmap, synchronous.steps, agent, *fixed, step_ticks));
        let mut members: Vec<ConfigurationMember> = members.collect::<Option<_>>()?;
        let of_member = |member: &ConfigurationMember| {
            let radius = member.radius_m.to_bits();
            let goals = member.goals.iter();
            goals.map(move |goal| (*goal, radius)).collect::<Vec<_>>()
        };
        let wanted: BTreeSet<(Vertex, u64)> = members.iter().flat_map(of_member).collect();
        if wanted.len() * roadmap.lattice().place_count() > MOST_ENTRIES {
            return None;
        }
        let layer = layer(roadmap, &members);
        let far = |(goal, radius): &(Vertex, u64)| {
            let far = Far::new(roadmap, *goal, f64::from_bits(*radius), layer)?;
            Some(((*goal, *radius), Arc::new(far)))
        };
        let far: Option<BTreeMap<_, _>> = wanted.par_iter().map(far).collect();
        let far = far?;
        for member in &mut members {
            let keys = of_member(member);
            member.far = keys.iter().map(|key| far[key].clone()).collect();
            for waypoint in (1..keys.len()).rev() {
                let (from, to) = (member.goals[waypoint - 1], &member.far[waypoint]);
                let goal = member.goals[waypoint];
                let steps = steps(roadmap, member, to, [from, goal]);
                let rest = u32::from(member.rests[waypoint - 1]);
                member.after[waypoint - 1] = steps + rest + member.after[waypoint];
            }
        }
        Some(Configuration {
            is_beside: members.iter().any(|member| !member.links.is_empty()),
            roadmap,
            synchronous,
            members,
        })
    }

    /// Drones.
    pub(super) fn len(&self) -> usize {
        self.members.len()
    }

    /// Whether a drone stays at its start whatever happens.
    pub(super) fn is_fixed(&self, drone: usize) -> bool {
        self.members[drone].is_fixed
    }

    /// Where every drone is at first.
    pub(super) fn starts(&self, agents: &[Agent]) -> Vec<AgentState> {
        let start = |(drone, agent): (usize, &Agent)| {
            let at = AgentState {
                place: agent.start,
                waypoint: 0,
                rest: 0,
            };
            self.arrived(drone, at)
        };
        agents.iter().enumerate().map(start).collect()
    }

    /// Whether a drone is where it stays until the end.
    pub(super) fn is_home(&self, drone: usize, at: &AgentState) -> bool {
        let member = &self.members[drone];
        usize::from(at.waypoint) + 1 == member.goals.len() && Some(&at.place) == member.goals.last()
    }

    /// Steps to the drone's last task past all before it, with no other drone there.
    pub(super) fn steps_left(&self, drone: usize, at: &AgentState) -> u32 {
        let after = self.members[drone].after[usize::from(at.waypoint)];
        self.steps_from(drone, at, at.place) + after
    }

    /// Steps to its next task from a place nearby.
    pub(super) fn steps_from(&self, drone: usize, at: &AgentState, place: Vertex) -> u32 {
        let (member, waypoint) = (&self.members[drone], usize::from(at.waypoint));
        let ends = [place, member.goals[waypoint]];
        steps(self.roadmap, member, &member.far[waypoint], ends)
    }

    /// A drone's step as others meet it, after its last.
    pub(super) fn synchronous_step(
        &self,
        drone: usize,
        at: &AgentState,
        direction: usize,
        previous_direction: StepDirection,
    ) -> SynchronousStep {
        let classes = &self.members[drone].classes;
        let waypoint = usize::from(at.waypoint) + usize::from(at.rest > 0);
        let lattice = self.roadmap.lattice();
        let is_stop = self.roadmap.is_stop(at.place);
        SynchronousStep {
            class: classes[waypoint.min(classes.len() - 1)],
            at: match is_stop {
                true => lattice.nearest(&self.roadmap.position_m(at.place)),
                false => lattice.steps(at.place),
            },
            direction: match is_stop || direction >= DIRECTIONS.len() {
                true => self.step_direction([at.place, self.target(drone, at, direction)]),
                false => StepDirection::Axis(direction),
            },
            previous_direction,
        }
    }

    /// How a step leads from a place to another, which may be the same.
    pub(super) fn step_direction(&self, ends: [Vertex; 2]) -> StepDirection {
        let lattice = self.roadmap.lattice();
        if !ends.iter().any(|place| self.roadmap.is_stop(*place)) {
            let [from, to] = ends.map(|place| lattice.steps(place));
            let by = [0, 1, 2].map(|axis| to[axis] - from[axis]);
            let known = DIRECTIONS.iter().position(|steps| *steps == by);
            return StepDirection::Axis(known.unwrap_or(STAYS));
        }
        let [from, to] = ends.map(|it| lattice.in_cells(&self.roadmap.position_m(it)));
        let by = [0, 1, 2].map(|axis| to[axis] - from[axis]);
        StepDirection::Beside { from, by }
    }

    /// The column of the floor that a place is in, or next to.
    pub(super) fn column(&self, place: Vertex) -> usize {
        let lattice = self.roadmap.lattice();
        if !self.roadmap.is_stop(place) {
            return lattice.column(place);
        }
        let [i, j, _] = lattice.nearest(&self.roadmap.position_m(place));
        i as usize + lattice.counts()[0] * j as usize
    }

    /// Where a step leads. Beyond [`DIRECTIONS`] they are: from a stop beside the lattice, the
    /// places next to it in turn; from a lattice place, the goal that is beside.
    fn target(&self, drone: usize, at: &AgentState, direction: usize) -> Vertex {
        let member = &self.members[drone];
        match direction.checked_sub(DIRECTIONS.len()) {
            Some(beside) => match member.links.get(&at.place) {
                Some(links) => links[beside],
                None => member.goals[usize::from(at.waypoint)],
            },
            None if direction == STAYS => at.place,
            None => {
                let stride = self.roadmap.lattice().strides()[AMONG_NEIGHBOURS[direction]];
                at.place.wrapping_add_signed(stride)
            }
        }
    }

    /// Calls `f` with all that a drone could do next, and with where it would be.
    pub(super) fn options(&self, drone: usize, at: &AgentState, mut f: impl FnMut(usize, Vertex)) {
        let member = &self.members[drone];
        f(STAYS, at.place);
        if member.is_fixed || at.rest > 0 {
            return;
        }
        if let Some(links) = member.links.get(&at.place) {
            let links = links.iter().enumerate();
            return links.for_each(|(beside, to)| f(DIRECTIONS.len() + beside, *to));
        }
        let goal = member.goals[usize::from(at.waypoint)];
        if (member.links.get(&goal)).is_some_and(|links| links.contains(&at.place)) {
            f(DIRECTIONS.len(), goal);
        }
        let open = self.roadmap.open_steps(member.radius_m);
        let open = open.map_or(0, |open| open[at.place as usize]);
        let lattice = self.roadmap.lattice();
        for (direction, n) in AMONG_NEIGHBOURS.iter().enumerate() {
            if direction != STAYS && open >> n & 1 != 0 {
                f(
                    direction,
                    at.place.wrapping_add_signed(lattice.strides()[*n]),
                );
            }
        }
    }

    /// Where a drone is after a step.
    pub(super) fn after(&self, drone: usize, at: &AgentState, direction: usize) -> AgentState {
        if at.rest > 0 {
            let rest = at.rest - 1;
            let waypoint = at.waypoint + u16::from(rest == 0);
            return AgentState {
                waypoint,
                rest,
                ..*at
            };
        }
        let place = self.target(drone, at, direction);
        self.arrived(drone, AgentState { place, ..*at })
    }

    /// The next task, if this one is reached.
    fn arrived(&self, drone: usize, at: AgentState) -> AgentState {
        let member = &self.members[drone];
        let mut at = at;
        while usize::from(at.waypoint) + 1 < member.goals.len()
            && at.place == member.goals[usize::from(at.waypoint)]
            && at.rest == 0
        {
            at.rest = member.rests[usize::from(at.waypoint)];
            at.waypoint += u16::from(at.rest == 0);
        }
        at
    }
}

/// Steps to a goal from a place, both of which may be beside the lattice.
fn steps(
    roadmap: &Roadmap,
    member: &ConfigurationMember,
    far: &Far,
    [from, goal]: [Vertex; 2],
) -> u32 {
    let of = |place: Vertex| far.steps(roadmap.lattice(), place);
    match member.links.get(&from) {
        _ if from == goal => 0,
        Some(links) => links.iter().map(|place| of(*place)).min().unwrap_or(0) + 1,
        None => of(from),
    }
}

/// The layer that all fly in where no step is blocked: that of more than half of all goals, or the
/// middle one.
fn layer(roadmap: &Roadmap, members: &[ConfigurationMember]) -> i32 {
    let lattice = roadmap.lattice();
    let goals = members.iter().filter_map(|member| member.goals.last());
    let layers = goals.map(|goal| lattice.nearest(&roadmap.position_m(*goal))[2]);
    let mut layers: Vec<i32> = layers.collect();
    layers.sort_unstable();
    // What more than half of them share is the one in the middle.
    let median = layers.get(layers.len() / 2).copied().unwrap_or_default();
    let sharing = layers.iter().filter(|layer| **layer == median).count();
    match 2 * sharing > layers.len() {
        true => median,
        false => lattice.counts()[2] as i32 / 2,
    }
}

/// A drone's goals and dwells in whole steps; `None` unless all of its job is in the air and still
/// ahead.
fn member(
    roadmap: &Roadmap,
    steps: &Steps,
    agent: &Agent,
    is_fixed: bool,
    step_ticks: u32,
) -> Option<ConfigurationMember> {
    let goals: Vec<Vertex> = if agent.waypoints.is_empty() || is_fixed {
        vec![agent.start]
    } else {
        agent.goals().collect()
    };
    let radius_m = agent.mover.radius_m();
    let stops = goals.iter().chain(std::iter::once(&agent.start));
    let beside = stops.filter(|stop| roadmap.is_stop(**stop));
    let linked = beside.map(|stop| (*stop, links(roadmap, *stop, radius_m)));
    let links: BTreeMap<Vertex, Vec<Vertex>> = linked.collect();
    let is_linked = (links.values()).all(|links| (1..=MOST_LINKS).contains(&links.len()));
    let is_plain =
        agent.departs.0 == 0 && agent.begun.is_empty() && agent.tolerated_drones.is_empty();
    if !(is_fixed || is_linked) || agent.grounded || agent.is_timed() || !is_plain {
        return None;
    }
    let class = |kind| steps.class(agent.drone, kind);
    let classes: Option<Vec<usize>> = agent.kinds.iter().map(|kind| class(*kind)).collect();
    let rest = |it: &Waypoint| u16::try_from(it.dwell_ticks.div_ceil(step_ticks)).ok();
    let rests: Option<Vec<u16>> = agent.waypoints.iter().map(rest).collect();
    Some(ConfigurationMember {
        after: vec![0; goals.len()],
        far: Vec::new(),
        goals,
        rests: rests?,
        classes: classes?,
        links,
        radius_m,
        is_fixed,
    })
}
