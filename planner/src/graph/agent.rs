//! One drone's job on the roadmap: where it starts, what it passes, how it ends, and how long that
//! takes with no other drone there.

use std::borrow::Cow;
use std::sync::Arc;

use costmap::leg::{DroneId, KindId, Leg, Tick};
use costmap::verdict::{Blocker, Why};
use nalgebra::Point3;

use crate::graph::distances::{Distances, Mover, UNREACHABLE};
use crate::graph::roadmap::{Roadmap, Vertex};
use crate::graph::turns::Smoothing;
use crate::plan::trajectory::SAME_PLACE_M;

/// One drone's job.
#[derive(Clone, Debug)]
pub(crate) struct Agent {
    /// The drone.
    pub(crate) drone: DroneId,
    pub(crate) start: Vertex,
    /// When: its legs begin then.
    pub(crate) departs: Tick,
    /// What it is flying until then, whatever is planned; empty where planning begins with it.
    pub(crate) begun: Vec<Leg>,
    /// It starts on the ground, without a wake.
    pub(crate) grounded: bool,
    /// It leaves the ground no earlier than then.
    pub(crate) takes_off: Tick,
    /// Drones in whose air it departs, which it must fly out of; see [`Agent::tolerates`].
    pub(crate) tolerated_drones: Vec<DroneId>,
    /// How long after it departs it may take for that, at first.
    pub(crate) tolerance_ticks: u32,
    /// It comes, or is told to do something else, and could stay where it is.
    pub(crate) is_sent: bool,
    /// It stops in conflict with those it tolerates if it does not fly out.
    pub(crate) is_stopped_in_conflict: bool,
    /// Its tasks in order.
    pub(crate) waypoints: Vec<Waypoint>,
    /// What flies towards each task, and after the last.
    pub(crate) kinds: Vec<KindId>,
    /// What it does after the last dwell.
    pub(crate) ending: Ending,
    /// Its speed, size and stops.
    pub(crate) mover: Mover,
    /// How its path is smoothed; `None`: corners are flown in no time.
    pub(crate) smoothing: Option<Smoothing>,
    /// Highest mean air over its discs, over its induced velocity.
    pub(crate) air_limit: f64,
    /// Ticks to the end of its last dwell with no other drone there, its wake kept out of the
    /// zones; [`UNREACHABLE`] if there is no path.
    pub(crate) lower_bound_ticks: u32,
    /// Length of that path (m).
    pub(crate) lower_bound_m: f64,
}

/// A task on the roadmap.
#[derive(Clone, Debug)]
pub(crate) struct Waypoint {
    /// Ticks to it from anywhere.
    pub(crate) distances: Arc<Distances>,
    /// How long it hovers there.
    pub(crate) dwell_ticks: u32,
    /// When it has to be there at the latest; [`Tick::FOREVER`]: whenever.
    pub(crate) due: Tick,
    /// Until when it stays at least, however early it came.
    pub(crate) until: Tick,
    /// When its last dwell ends at the earliest, by the moments until which it stays here and at
    /// the waypoints to come.
    pub(crate) ends: Tick,
    /// From arriving there to the end of the last dwell, with no other drone there.
    pub(crate) rest_ticks: u32,
}

impl Waypoint {
    /// Whether it is to be reached, or left, by a time of the plan.
    pub(crate) fn is_timed(&self) -> bool {
        self.due != Tick::FOREVER || self.until != Tick(0)
    }

    /// How long it has to be there, whenever it comes.
    pub(crate) fn stay_ticks(&self) -> u32 {
        let held = self.until.0.saturating_sub(self.due.0);
        self.dwell_ticks.max(held)
    }

    /// Of its dwell this much is over (ticks).
    pub(crate) fn dwell_for_less(&mut self, ticks: u32) {
        let gone = ticks.min(self.dwell_ticks);
        self.dwell_ticks -= gone;
        self.rest_ticks = self.rest_ticks.saturating_sub(gone);
    }

    /// When a dwell ends that begins at a moment; `None` where that is too late.
    pub(crate) fn dwells_until(&self, begins: Tick) -> Option<Tick> {
        let until = begins.after(self.dwell_ticks).max(self.until);
        (begins <= self.due).then_some(until)
    }
}

/// What a drone does after its last dwell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ending {
    /// Stays in the air until the end.
    Hover,
    /// Descends straight down, slowly at last, and rests without a wake.
    Land {
        /// From where on it goes slowly (m).
        approach_m: Point3<f64>,
        /// Where it comes to rest (m).
        rest_m: Point3<f64>,
        /// Duration of both parts of the descent.
        ticks: [u32; 2],
        /// How long it stands above before it descends.
        rest_ticks: u32,
    },
    /// Body and wake vanish.
    Leave,
}

impl Ending {
    /// The same once a drone has stood still for so long, where it goes on at all.
    #[must_use]
    pub(crate) fn after_rest(mut self, ticks: u32) -> Ending {
        if let Ending::Land { rest_ticks, .. } = &mut self {
            *rest_ticks = ticks;
        }
        self
    }

    /// What is flown after the last dwell, given how it would stay where that ended until the end.
    fn legs(&self, stay: Leg) -> Vec<Leg> {
        match *self {
            Ending::Leave => Vec::new(),
            Ending::Hover => vec![stay],
            Ending::Land {
                approach_m,
                rest_m,
                ticks,
                rest_ticks,
            } => {
                let mut legs = Vec::with_capacity(4);
                let mut here = Leg { ..stay };
                if rest_ticks > 0 && stay.flying {
                    let end = here.start.after(rest_ticks);
                    legs.push(Leg { end, ..here });
                    here.start = end;
                }
                for (to_m, ticks) in [approach_m, rest_m].into_iter().zip(ticks) {
                    if ticks > 0 && stay.flying {
                        let end = here.start.after(ticks);
                        legs.push(Leg { end, to_m, ..here });
                        here = Leg {
                            start: end,
                            from_m: to_m,
                            ..here
                        };
                    }
                }
                legs.push(Leg {
                    from_m: rest_m,
                    to_m: rest_m,
                    flying: false,
                    ..here
                });
                legs
            }
        }
    }
}

/// How long after it departs a drone may take at most to get clear of those that it is near then:
/// chosen here, 2 s, two to four cells.
pub(crate) const TOLERANCE_TICKS: u32 = 200;
/// How long it may take at first: chosen here, a quarter of that.
pub(crate) const FIRST_TOLERANCE_TICKS: u32 = 50;

/// A drone that waits on the ground for an appointment is there so long before it, if it flies
/// alone: chosen here, 3 s to avoid others, or to be late, in.
const EARLY_TICKS: u32 = 300;
/// And for such a part of the flight more: chosen here.
const EARLY_PART: u32 = 4;

impl Agent {
    /// Whether a leg from `departs` on may conflict with a drone because it did before: body to
    /// body only where they would stay so.
    pub(crate) fn tolerates(&self, blocker: &Blocker, departs: Tick) -> bool {
        (blocker.why != Why::Bodies || self.is_stopped_in_conflict)
            && self.may_tolerate(blocker.drone, departs)
    }

    /// Whether it tolerates conflicts of some kind with a drone, of a leg from `departs` on.
    pub(crate) fn may_tolerate(&self, drone: DroneId, departs: Tick) -> bool {
        departs < self.departs.after(self.tolerance_ticks) && self.tolerated_drones.contains(&drone)
    }

    /// A departure from which on it could keep out of what others fly already: it is sent there, or
    /// is long enough under way. `None`: it may conflict with them however it goes on.
    pub(crate) fn free_departure(&self, departs: Tick) -> Option<Tick> {
        let is_free = self.is_sent || departs >= self.departs.after(TOLERANCE_TICKS);
        is_free.then_some(departs)
    }

    /// What is flown of its path.
    pub(crate) fn flown<'a>(&self, legs: &'a [Leg]) -> Cow<'a, [Leg]> {
        match &self.smoothing {
            Some(smoothing) => Cow::Owned(smoothing.flown(legs)),
            None => Cow::Borrowed(legs),
        }
    }

    /// How long before and after a change of velocity another path is flown than its own; 0 where
    /// corners are flown in no time.
    pub(crate) fn lead_ticks(&self) -> u32 {
        self.smoothing.as_ref().map_or(0, Smoothing::lead_ticks)
    }

    /// Hovering at a place (m) as one of its kinds, from tick 0 until the end.
    pub(crate) fn hover(&self, at_m: Point3<f64>, kind: KindId) -> Leg {
        Leg {
            drone: self.drone,
            kind,
            start: Tick(0),
            end: Tick::FOREVER,
            from_m: at_m,
            to_m: at_m,
            flying: true,
            air_limit: self.air_limit,
        }
    }

    /// The one leg of a drone that is not planned: it stays at its start until the end.
    pub(crate) fn stays_at_start(&self, roadmap: &Roadmap) -> Leg {
        Leg {
            flying: !self.grounded,
            ..self.hover(roadmap.position_m(self.start), self.kinds[0])
        }
    }

    /// The same from its departure on.
    pub(crate) fn stays_from_departure(&self, roadmap: &Roadmap) -> Leg {
        Leg {
            start: self.departs,
            ..self.stays_at_start(roadmap)
        }
    }

    /// It has nothing to do but to stay where it is, in the air or on the ground.
    pub(crate) fn stays(&self) -> bool {
        self.waypoints.is_empty()
            && match self.ending {
                Ending::Hover => true,
                Ending::Land { .. } => self.grounded,
                Ending::Leave => false,
            }
    }

    /// What it flies after the last dwell, given how it would stay where that ended until the end.
    /// A drone that leaves where and when it starts is there for a tick all the same: where it may
    /// be late, that counts.
    pub(crate) fn ends(&self, stay: Leg) -> Vec<Leg> {
        match self.leaves_at_once(stay.start) {
            true => vec![Leg {
                end: stay.start.after(1),
                ..stay
            }],
            false => self.ending.legs(stay),
        }
    }

    /// Whether it leaves at a moment at which it has only just come.
    pub(crate) fn leaves_at_once(&self, at: Tick) -> bool {
        self.ending == Ending::Leave && at == self.departs && self.begun.is_empty()
    }

    /// Where it is after its last dwell.
    pub(crate) fn last_vertex(&self) -> Vertex {
        self.goals().last().unwrap_or(self.start)
    }

    /// Where its tasks are, in order.
    pub(crate) fn goals(&self) -> impl DoubleEndedIterator<Item = Vertex> + '_ {
        self.waypoints.iter().map(|it| it.distances.goal())
    }

    /// Works out, from the last task backwards, how long the rest takes; unreachable tasks stay so.
    pub(crate) fn chain(&mut self, roadmap: &Roadmap) {
        let mut rest: u32 = 0;
        for index in (0..self.waypoints.len()).rev() {
            if let Some(next) = self.waypoints.get(index + 1) {
                let from = self.waypoints[index].distances.goal();
                rest = add(rest, next.distances.ticks(roadmap, from));
            }
            let onward = match self.waypoints[index].until {
                Tick(0) => Tick(0),
                until => until.after(rest),
            };
            let later = self.waypoints.get(index + 1);
            self.waypoints[index].ends = later.map_or(onward, |it| it.ends.max(onward));
            rest = add(rest, self.waypoints[index].dwell_ticks);
            self.waypoints[index].rest_ticks = rest;
        }
    }

    /// Ticks from a vertex, on the way to a waypoint, to the end of the last dwell; [`UNREACHABLE`]
    /// if there is no path.
    pub(crate) fn remaining(&self, roadmap: &Roadmap, waypoint: usize, from: Vertex) -> u32 {
        match self.waypoints.get(waypoint) {
            Some(waypoint) => add(waypoint.distances.ticks(roadmap, from), waypoint.rest_ticks),
            None => 0,
        }
    }

    /// When it is at a waypoint along the lattice with no other drone there.
    pub(crate) fn reaches(&self, roadmap: &Roadmap, waypoint: usize) -> Tick {
        let goal = self.waypoints[waypoint].distances.goal();
        let left = self.remaining(roadmap, waypoint, goal);
        self.departs
            .after(self.lower_bound_ticks.saturating_sub(left))
    }

    /// When its last dwell ends at the earliest, by the moments until which it has to stay at this
    /// waypoint and at those to come.
    pub(crate) fn ends_from(&self, waypoint: usize) -> Tick {
        let waypoint = self.waypoints.get(waypoint);
        waypoint.map_or(Tick(0), |it| it.ends)
    }

    /// Whether it has to be somewhere at a time of the plan.
    pub(crate) fn is_timed(&self) -> bool {
        self.waypoints.iter().any(Waypoint::is_timed)
    }

    /// The same drone if it stands on the ground for so long that, alone, it comes to its first
    /// task not much too early; `None` where it is not due there, or does so anyway.
    pub(crate) fn takes_off_late(&self, roadmap: &Roadmap) -> Option<Agent> {
        let first = self.waypoints.first()?;
        let flies = first.distances.ticks(roadmap, self.start);
        if !self.grounded || first.due == Tick::FOREVER || flies == UNREACHABLE {
            return None;
        }
        let early = EARLY_TICKS + flies / EARLY_PART + 2 * self.lead_ticks();
        let takes_off = Tick(first.due.0.saturating_sub(add(flies, early)));
        (takes_off > self.departs).then(|| Agent {
            takes_off,
            ..self.clone()
        })
    }

    /// The first waypoint that it would reach too late if nothing obstructed it: its index, and
    /// when it is there, and at rest, along the lattice.
    pub(crate) fn comes_late(&self, roadmap: &Roadmap) -> Option<(usize, Tick)> {
        let speeds = &self.mover.speeds;
        self.is_late(roadmap, |from, to, _| {
            let way_m = roadmap.position_m(to) - roadmap.position_m(from);
            speeds.ticks(way_m.norm(), way_m.z).saturating_sub(1)
        })
    }

    /// The same of one that flies along the lattice with no other drone there.
    pub(crate) fn comes_late_along_lattice(&self, roadmap: &Roadmap) -> Option<(usize, Tick)> {
        self.is_late(roadmap, |_, _, ticks| ticks)
    }

    /// The same of one that flies these legs.
    pub(crate) fn comes_late_on(&self, roadmap: &Roadmap, legs: &[Leg]) -> Option<(usize, Tick)> {
        // Where it is, from and until when.
        let mut stops: Vec<(Point3<f64>, Tick, Tick)> = Vec::new();
        for leg in legs {
            match stops.last_mut() {
                Some((_, _, until)) if leg.stays() => *until = leg.end,
                None if leg.stays() => stops.push((leg.from_m, leg.start, leg.end)),
                None => stops.push((leg.from_m, leg.start, leg.start)),
                Some(_) => {}
            }
            if !leg.stays() {
                stops.push((leg.to_m, leg.end, leg.end));
            }
        }
        let (mut before, mut at) = (0, self.departs);
        for (index, waypoint) in self.waypoints.iter().enumerate() {
            let goal_m = roadmap.position_m(waypoint.distances.goal());
            let dwells = |(place_m, from, until): &(Point3<f64>, Tick, Tick)| {
                let is_there = (place_m - goal_m).norm() <= SAME_PLACE_M;
                is_there && (*from).max(at).after(waypoint.dwell_ticks) <= *until
            };
            before += stops[before..].iter().position(dwells)?;
            let there = stops[before].1.max(at);
            if there > waypoint.due {
                return Some((index, there.after(self.lead_ticks())));
            }
            at = there.after(waypoint.dwell_ticks).max(waypoint.until);
        }
        None
    }

    /// Holds it to no arrival that it cannot keep any more, with no other drone there.
    pub(crate) fn drop_missed_deadlines(&mut self, roadmap: &Roadmap) {
        // It begins to move, and comes to rest, at every task.
        let rests = 2 * self.lead_ticks();
        let least = |_, _, ticks: u32| ticks.saturating_add(rests);
        while self.is_timed()
            && let Some((task, _)) = self.is_late(roadmap, least)
        {
            self.waypoints[task].due = Tick::FOREVER;
        }
    }

    /// The same drone if it may be anywhere as late as it takes.
    pub(crate) fn at_any_time(&self) -> Agent {
        let mut agent = self.clone();
        for waypoint in &mut agent.waypoints {
            waypoint.due = Tick::FOREVER;
        }
        agent
    }

    /// From one place to another it takes so many ticks at least, of so many along the lattice.
    fn is_late(
        &self,
        roadmap: &Roadmap,
        least: impl Fn(Vertex, Vertex, u32) -> u32,
    ) -> Option<(usize, Tick)> {
        let (mut from, mut departs) = (self.start, self.departs);
        let moves = |first: &Waypoint| first.distances.goal() != self.start;
        if self.begun.is_empty() && self.waypoints.first().is_some_and(moves) {
            departs = departs.after(self.lead_ticks());
        }
        // At the earliest, and along the lattice.
        let mut at = [departs; 2];
        for (index, waypoint) in self.waypoints.iter().enumerate() {
            let ticks = waypoint.distances.ticks(roadmap, from);
            if ticks == UNREACHABLE {
                return None;
            }
            let goal = waypoint.distances.goal();
            let there = [at[0].after(least(from, goal, ticks)), at[1].after(ticks)];
            if there[0] > waypoint.due {
                return Some((index, there[1].after(self.lead_ticks())));
            }
            at = there.map(|at| at.after(waypoint.dwell_ticks).max(waypoint.until));
            from = goal;
        }
        None
    }

    /// Works out how long its path is with no other drone there, in time and in metres.
    pub(crate) fn find_lower_bound(&mut self, roadmap: &Roadmap) {
        self.lower_bound_ticks = self.remaining(roadmap, 0, self.start);
        let moves = |first: &Waypoint| first.distances.goal() != self.start;
        if self.waypoints.first().is_some_and(moves) && self.begun.is_empty() {
            self.lower_bound_ticks = add(self.lower_bound_ticks, self.lead_ticks());
        }
        let held = self.ends_from(0).0.saturating_sub(self.departs.0);
        self.lower_bound_ticks = self.lower_bound_ticks.max(held);
        let starts = std::iter::once(self.start).chain(self.goals());
        let legs = starts.zip(&self.waypoints);
        self.lower_bound_m = legs
            .map(|(from, waypoint)| waypoint.distances.length_m(roadmap, from))
            .sum();
        self.forget();
    }

    /// Lets it use the roadmap's paths beyond the lattice as well, where there are any that it fits
    /// along; how long its path is has to be worked out anew then.
    pub(crate) fn use_channels(&mut self, roadmap: &Roadmap) {
        let stops = roadmap.channel_stops(self.mover.radius_m());
        self.use_stops(roadmap, stops);
    }

    /// Lets it use more of the roadmap's stops, as [`Agent::use_channels`].
    pub(crate) fn use_stops(&mut self, roadmap: &Roadmap, more: impl Iterator<Item = Vertex>) {
        let known = self.mover.stops().len();
        self.mover = self.mover.clone().with_stops(more);
        if self.mover.stops().len() == known {
            return;
        }
        let mut from = self.start;
        for waypoint in &mut self.waypoints {
            let goal = waypoint.distances.goal();
            let distances = Distances::new(roadmap, goal, from, self.mover.clone());
            waypoint.distances = Arc::new(distances);
            from = goal;
        }
        self.chain(roadmap);
    }

    /// Whether distances from its start are known without a search.
    pub(crate) fn is_straight(&self, roadmap: &Roadmap) -> bool {
        let first = self.waypoints.first();
        first.is_none_or(|waypoint| waypoint.distances.is_straight(roadmap, self.start))
    }

    /// Forgets the distances, which take more room than all else; they are worked out anew when
    /// they are asked for.
    pub(crate) fn forget(&self) {
        for waypoint in &self.waypoints {
            waypoint.distances.forget();
        }
    }
}

/// Sum of two durations in ticks; [`UNREACHABLE`] if either is.
fn add(a: u32, b: u32) -> u32 {
    if a == UNREACHABLE || b == UNREACHABLE {
        UNREACHABLE
    } else {
        a.saturating_add(b)
    }
}
