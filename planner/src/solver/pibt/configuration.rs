//! Who flies from where to where, in whole steps of the lattice.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rayon::prelude::*;

use super::far::Far;
use crate::graph::agent::{Agent, Waypoint};
use crate::graph::roadmap::{Roadmap, Vertex};
use crate::sipp::conflicts::Steps;
use crate::sipp::conflicts::steps::Pace;
use crate::sipp::conflicts::synchronous::{AMONG_NEIGHBOURS, DIRECTIONS, STAYS, SynchronousSteps};
use crate::solver::prepare::Job;

/// Places times goals; fleets with more are not planned together. Chosen here: half a gigabyte
/// where there are obstacles, none where not.
const MOST_ENTRIES: usize = 256 << 20;

/// Where a drone is between two steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct AgentState {
    /// A lattice place.
    pub(super) place: Vertex,
    /// Which of its tasks it is on the way to.
    pub(super) waypoint: u16,
    /// Steps for which it still dwells there.
    pub(super) rest: u16,
}

/// One drone.
struct Member {
    /// Where its tasks are; its start, if it has none.
    goals: Vec<Vertex>,
    /// Steps of dwelling at each but the last, where it stays until the end.
    rests: Vec<u16>,
    /// Steps to each of them.
    far: Vec<Arc<Far>>,
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
    pub(super) synchronous: &'a SynchronousSteps<'a>,
    /// By drone.
    members: Vec<Member>,
}

impl<'a> Configuration<'a> {
    /// `None` where a drone's path is not one along the lattice from the beginning to the end.
    pub(super) fn new(
        job: &'a Job,
        synchronous: &'a SynchronousSteps<'a>,
        fixed: &[bool],
        step_ticks: u32,
    ) -> Option<Configuration<'a>> {
        let roadmap = &job.roadmap;
        let members = job.agents.iter().zip(fixed);
        let members = members
            .map(|(agent, fixed)| member(roadmap, synchronous.steps, agent, *fixed, step_ticks));
        let mut members: Vec<Member> = members.collect::<Option<_>>()?;
        let of_member = |member: &Member| {
            let radius = member.radius_m.to_bits();
            let goals = member.goals.iter();
            goals.map(move |goal| (*goal, radius)).collect::<Vec<_>>()
        };
        let wanted: BTreeSet<(Vertex, u64)> = members.iter().flat_map(of_member).collect();
        if wanted.len() * roadmap.lattice().place_count() > MOST_ENTRIES {
            return None;
        }
        let far = |(goal, radius): &(Vertex, u64)| {
            let far = Far::new(roadmap, *goal, f64::from_bits(*radius))?;
            Some(((*goal, *radius), Arc::new(far)))
        };
        let far: Option<BTreeMap<_, _>> = wanted.par_iter().map(far).collect();
        let far = far?;
        for member in &mut members {
            let keys = of_member(member);
            member.far = keys.iter().map(|key| far[key].clone()).collect();
            for waypoint in (1..keys.len()).rev() {
                let (from, to) = (member.goals[waypoint - 1], &member.far[waypoint]);
                let steps =
                    to.steps(roadmap.lattice(), from) + u32::from(member.rests[waypoint - 1]);
                member.after[waypoint - 1] = steps + member.after[waypoint];
            }
        }
        Some(Configuration {
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
        self.members[drone].far[usize::from(at.waypoint)].steps(self.roadmap.lattice(), place)
    }

    /// A drone as others meet it.
    pub(super) fn pace(&self, drone: usize, at: &AgentState, direction: usize) -> Pace {
        let classes = &self.members[drone].classes;
        let waypoint = usize::from(at.waypoint) + usize::from(at.rest > 0);
        Pace {
            class: classes[waypoint.min(classes.len() - 1)],
            at: self.roadmap.lattice().steps(at.place),
            by: DIRECTIONS[direction],
        }
    }

    /// Calls `f` with all that a drone could do next, and with where it would be.
    pub(super) fn options(&self, drone: usize, at: &AgentState, mut f: impl FnMut(usize, Vertex)) {
        let member = &self.members[drone];
        f(STAYS, at.place);
        if member.is_fixed || at.rest > 0 {
            return;
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
        let stride = match direction {
            STAYS => 0,
            _ => self.roadmap.lattice().strides()[AMONG_NEIGHBOURS[direction]],
        };
        let place = at.place.wrapping_add_signed(stride);
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

/// A drone's goals and dwells in whole steps; `None` unless all of its job is on the lattice, in
/// the air and still ahead.
fn member(
    roadmap: &Roadmap,
    steps: &Steps,
    agent: &Agent,
    is_fixed: bool,
    step_ticks: u32,
) -> Option<Member> {
    let goals: Vec<Vertex> = if agent.waypoints.is_empty() || is_fixed {
        vec![agent.start]
    } else {
        agent.goals().collect()
    };
    let on_lattice = goals.iter().all(|goal| !roadmap.is_stop(*goal));
    let is_plain = agent.departs.0 == 0 && agent.begun.is_empty() && agent.forgiven.is_empty();
    if !on_lattice || roadmap.is_stop(agent.start) || agent.grounded || !is_plain {
        return None;
    }
    let class = |kind| steps.class(agent.drone, kind);
    let classes: Option<Vec<usize>> = agent.kinds.iter().map(|kind| class(*kind)).collect();
    let rest = |it: &Waypoint| u16::try_from(it.dwell_ticks.div_ceil(step_ticks)).ok();
    let rests: Option<Vec<u16>> = agent.waypoints.iter().map(rest).collect();
    Some(Member {
        after: vec![0; goals.len()],
        far: Vec::new(),
        goals,
        rests: rests?,
        classes: classes?,
        radius_m: agent.mover.radius_m(),
        is_fixed,
    })
}
