//! What one drone flies, and where in that and in its tasks it is at a moment.

use std::borrow::Cow;

use costmap::leg::{DroneId, KindId, Leg, Tick};
use nalgebra::Point3;

use crate::graph::agent::{Agent, Ending};
use crate::graph::lattice::Lattice;
use crate::graph::roadmap::{Roadmap, Vertex};
use crate::plan::trajectory::SAME_PLACE_M;
use crate::plan::{AtEnd, DronePlan, TrajectoryEntry};
use crate::scenario::world::Drone;
use crate::sipp::search::joined;
use crate::solver::prepare::with_lifts;

/// A time this close to a whole tick is one (ticks): what writing it in seconds rounds.
const SAME_TICK: f64 = 1e-6;

/// One drone of a running plan.
#[derive(Clone, Debug)]
pub(super) struct Track {
    /// Its legs, back to back, from where it comes to where it ends.
    pub(super) legs: Vec<Leg>,
    /// What it had to do from [`Track::since`] on.
    pub(super) agent: Agent,
    /// When it was last told what to do.
    pub(super) since: Tick,
    /// It has a path to the end of its agent. Others stay where they are.
    pub(super) planned: bool,
    /// It is not planned here: nothing makes it do anything else.
    pub(super) is_fixed: bool,
    /// It was taken out, or has failed: what is left of its legs is how it stops.
    pub(super) is_gone: bool,
    /// How long the air of a leg may matter after its end (ticks).
    pub(super) wake_persistence_ticks: u32,
}

/// Where a drone is in what it flies.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum TrackState {
    /// It has not come yet, or has left.
    Absent,
    /// All its tasks are done, and how it ends goes on whatever is planned; or it has no path.
    Ends,
    /// It can go on otherwise from a place and a moment.
    Flies {
        /// How many of its tasks are done by then.
        done: usize,
        /// What it flies until then, from the moment asked about or a little earlier, and what it
        /// flew before that whose air may still be under way.
        begun: Vec<Leg>,
        /// When it can go on otherwise.
        departs: Tick,
        at_m: Point3<f64>,
        /// It stands on the ground.
        grounded: bool,
    },
}

impl Track {
    /// Whether it has come by a moment, and has neither left nor been taken out.
    pub(super) fn is_there(&self, roadmap: &Roadmap, at: Tick) -> bool {
        !self.is_gone && self.state(roadmap, at) != TrackState::Absent
    }

    /// Where it is at a moment, and from when on its flight can change. A leg, and a dwell that has
    /// begun, is flown to its end.
    pub(super) fn state(&self, roadmap: &Roadmap, at: Tick) -> TrackState {
        self.state_of(roadmap, at, false)
    }

    /// The same if it drops what it has to do: a dwell ends at once.
    pub(super) fn state_without_tasks(&self, roadmap: &Roadmap, at: Tick) -> TrackState {
        self.state_of(roadmap, at, true)
    }

    fn state_of(&self, roadmap: &Roadmap, at: Tick, drops: bool) -> TrackState {
        if self.legs.iter().all(|leg| leg.end <= at || at < leg.start) {
            return TrackState::Absent;
        }
        // Until then what is flown now depends on the path.
        let settled = at.after(self.agent.lead_ticks());
        let mut state = self.state_from(roadmap, settled, drops);
        if let TrackState::Flies { begun, departs, .. } = &mut state
            && settled > at
        {
            let before = self.rest(at).into_iter().filter(|leg| leg.start < *departs);
            *begun = before.map(|leg| leg.between(leg.start, *departs)).collect();
        }
        match state {
            TrackState::Absent => TrackState::Ends,
            state => state,
        }
    }

    /// The same of a path that is flown as it is.
    fn state_from(&self, roadmap: &Roadmap, at: Tick, drops: bool) -> TrackState {
        let index = self.first_after(at);
        let Some(leg) = self.legs.get(index).filter(|leg| leg.start <= at) else {
            return TrackState::Absent;
        };
        let dwells = self.dwells(roadmap);
        let finished = dwells.len() == self.agent.waypoints.len()
            && dwells.last().is_none_or(|dwell| dwell.1 <= at);
        if !drops && (finished || !self.planned) {
            return TrackState::Ends;
        }
        let dwell = dwells.iter().find(|dwell| dwell.0 <= at && at < dwell.1);
        let departs = match dwell {
            Some(dwell) if !drops => dwell.1,
            _ if leg.stays() => at,
            _ if leg.start == at && self.vertex_at(roadmap, &leg.from_m).is_some() => at,
            _ => leg.end,
        };
        let since = at.before(self.wake_persistence_ticks);
        let first = self.first_after(since);
        let begun = self.legs[first..].iter().filter(|leg| leg.start < departs);
        // Flown to its end is what moves.
        let cut = |leg: &Leg| match leg.stays() {
            true => leg.between(leg.start, departs),
            false => *leg,
        };
        let begun: Vec<Leg> = begun.map(cut).collect();
        let at_m = begun.last().map_or(leg.from_m, |leg| leg.to_m);
        // A leg down or up counts as flown: a drone that stays there before or after it is on the
        // ground.
        let past = self.first_after(departs);
        let mut around = self.legs[past.saturating_sub(1)..].iter().take(2);
        let grounded = if past == 0 {
            !leg.flying || self.agent.grounded
        } else {
            around.any(|leg| leg.stays() && !leg.flying)
        };
        TrackState::Flies {
            done: dwells.iter().filter(|dwell| dwell.1 <= departs).count(),
            // A descent ends on the ground.
            grounded,
            begun,
            departs,
            at_m,
        }
    }

    /// Where it can be planned anew from, if that is no vertex that it may use (m), and whether it
    /// stands on the ground there: as on a path found on finer cells.
    pub(super) fn turns_beyond(
        &self,
        roadmap: &Roadmap,
        state: &TrackState,
    ) -> Option<(Point3<f64>, bool)> {
        let &TrackState::Flies {
            done,
            at_m,
            grounded,
            ..
        } = state
        else {
            return None;
        };
        let is_beyond = done < self.agent.waypoints.len();
        let is_beyond = is_beyond && self.vertex_at(roadmap, &at_m).is_none();
        is_beyond.then_some((at_m, grounded))
    }

    /// What it has to do from where its flight can change, which is at the `beyond` vertex where
    /// that is none of its own; `None` where it cannot be planned anew: it has nothing left to do
    /// but to end, which it cannot do otherwise.
    pub(super) fn ready(
        &self,
        roadmap: &Roadmap,
        state: TrackState,
        beyond: Option<Vertex>,
    ) -> Option<Agent> {
        let TrackState::Flies {
            done,
            begun,
            departs,
            at_m,
            grounded,
        } = state
        else {
            return None;
        };
        let start = beyond.or_else(|| self.vertex_at(roadmap, &at_m))?;
        let mut agent = (done < self.agent.waypoints.len()).then(|| Agent {
            start,
            departs,
            begun,
            grounded,
            is_sent: false,
            is_stopped_in_conflict: false,
            ..self.agent_after(done)
        })?;
        if beyond.is_some() {
            agent.use_stops(roadmap, with_lifts(roadmap, &[start]).into_iter());
        }
        Some(agent)
    }

    /// When each task is begun to dwell at and done, as far as legs get.
    ///
    /// A task is done once the drone has been at its place for the whole dwell in one piece, after
    /// the task before it, at the mass that it flies with from there.
    pub(super) fn dwells(&self, roadmap: &Roadmap) -> Vec<(Tick, Tick)> {
        let mut dwells = Vec::with_capacity(self.agent.waypoints.len());
        let mut from = self.since;
        let mut index = self.first_after(from);
        for (waypoint, kind) in self.agent.waypoints.iter().zip(&self.agent.kinds[1..]) {
            let goal_m = roadmap.position_m(waypoint.distances.goal());
            let dwell = loop {
                let Some(leg) = self.legs.get(index) else {
                    return dwells;
                };
                let begins = leg.start.max(from);
                let there = leg.position_m(begins) == goal_m && leg.kind == *kind;
                // However late it is by now.
                let until = begins.after(waypoint.dwell_ticks).max(waypoint.until);
                if there && self.stays_until(index, goal_m) >= until {
                    break (begins, until);
                }
                index += 1;
            };
            from = dwell.1;
            index = self.first_after(from);
            dwells.push(dwell);
        }
        dwells
    }

    /// Until when it stays at a place from where a leg begins.
    fn stays_until(&self, index: usize, place_m: Point3<f64>) -> Tick {
        let kind = self.legs[index].kind;
        let stays = |leg: &&Leg| leg.stays() && leg.from_m == place_m && leg.kind == kind;
        let held = self.legs[index..].iter().take_while(stays).last();
        held.map_or(self.legs[index].start, |leg| leg.end)
    }

    /// The vertex of a place among those that it may use: its own stops before the lattice.
    pub(super) fn vertex_at(&self, roadmap: &Roadmap, at_m: &Point3<f64>) -> Option<Vertex> {
        let own = self.agent.mover.stops().iter().copied();
        let own = own.filter(|&stop| roadmap.position_m(stop) == *at_m);
        own.chain(roadmap.lattice().place_at(at_m)).next()
    }

    /// What it has to do once this many tasks are done.
    pub(super) fn agent_after(&self, done: usize) -> Agent {
        Agent {
            waypoints: self.agent.waypoints[done..].to_vec(),
            kinds: self.agent.kinds[done..].to_vec(),
            ..self.agent.clone()
        }
    }

    /// Behind by some ticks from a moment on: it stands for that long, and goes on so that from
    /// then on it flies what it flew that long ago.
    pub(super) fn fall_behind(&mut self, roadmap: &Roadmap, at: Tick, by: u32) {
        let was = Tick(at.0 - by);
        let dwells = self.dwells(roadmap);
        let done = dwells.iter().filter(|dwell| dwell.1 <= was).count();
        self.agent = self.agent_after(done);
        if let (Some(dwell), Some(waypoint)) = (dwells.get(done), self.agent.waypoints.first_mut())
            && dwell.0 <= was
        {
            waypoint.dwell_for_less(waypoint.dwell_ticks.saturating_sub(dwell.1.0 - was.0));
        }
        self.since = at;
        // What is flown at a moment depends on the path this much earlier, too.
        let first = self.legs.first().map_or(was, |leg| leg.start);
        let was = was.before(self.agent.lead_ticks()).max(first);
        let later = |leg: Leg| Leg {
            start: leg.start.after(by),
            end: leg.end.after(by),
            ..leg
        };
        let mut legs: Vec<Leg> = Vec::with_capacity(self.legs.len() + 2);
        for &leg in &self.legs {
            if leg.start > was {
                legs.push(later(leg));
            } else if leg.end <= was {
                legs.push(leg);
            } else {
                let here_m = leg.position_m(was);
                if leg.start < was {
                    legs.push(leg.between(leg.start, was));
                }
                // Where it has not taken off yet it stands on the ground.
                let rose = legs.last().map_or(!self.agent.grounded, |last| last.flying);
                legs.push(Leg {
                    start: was,
                    end: was.after(by),
                    from_m: here_m,
                    to_m: here_m,
                    flying: leg.flying && rose,
                    ..leg
                });
                legs.push(later(leg.between(was, leg.end)));
            }
        }
        self.legs = joined(legs);
    }

    /// Flies nothing any more from a moment on but what it takes to stop.
    pub(super) fn stop(&mut self, at: Tick) {
        let lead = self.agent.lead_ticks();
        self.cut(at.after(lead));
        if let Some(&last) = self.legs.last().filter(|_| lead > 0) {
            self.legs.push(Leg {
                start: last.end,
                end: last.end.after(lead),
                from_m: last.to_m,
                ..last
            });
            self.legs = joined(std::mem::take(&mut self.legs));
        }
    }

    /// When it has landed, if it sinks at a moment and is no farther above its pad than this (m).
    pub(super) fn lands_next(&self, at: Tick, above_m: f64) -> Option<Tick> {
        let Ending::Land { rest_m, .. } = self.agent.ending else {
            return None;
        };
        let last = self.legs.iter().rfind(|leg| leg.flying)?;
        let sinks =
            last.start <= at && at <= last.end && (last.to_m - rest_m).norm() < SAME_PLACE_M;
        let is_low = |last: &Leg| (last.position_m(at) - rest_m).norm() <= above_m;
        (sinks && is_low(last)).then_some(last.end)
    }

    /// What is flown of those that end after a moment, or whose air may then be under way.
    pub(super) fn flown_from(&self, at: Tick) -> Vec<Leg> {
        let flown = self.agent.flown(&self.legs);
        let since = at.before(self.wake_persistence_ticks);
        let ahead = flown.iter().filter(|leg| leg.end > since);
        ahead.copied().collect()
    }

    /// The legs that end after a moment, and those before on which what is flown then depends, or
    /// whose air may then be under way.
    pub(super) fn rest(&self, at: Tick) -> Vec<Leg> {
        let since = at.before(2 * self.agent.lead_ticks() + self.wake_persistence_ticks);
        let ahead = self.legs.iter().filter(|leg| leg.end > since);
        ahead.copied().collect()
    }

    /// Goes on with these legs from where they begin.
    pub(super) fn go_on(&mut self, legs: &[Leg]) {
        let Some(first) = legs.first() else { return };
        self.cut(first.start);
        self.legs.extend_from_slice(legs);
        self.legs = joined(std::mem::take(&mut self.legs));
    }

    /// Index of the first leg that lasts beyond a moment.
    fn first_after(&self, at: Tick) -> usize {
        self.legs.partition_point(|leg| leg.end <= at)
    }

    /// Whether it, and its air, is gone at a moment and nothing of what it flew matters any more.
    pub(super) fn has_left(&self, at: Tick) -> bool {
        let matters = 2 * self.agent.lead_ticks() + self.wake_persistence_ticks;
        let last = self.legs.last();
        last.is_none_or(|leg| leg.end != Tick::FOREVER && leg.end.after(matters) <= at)
    }

    /// Drops what it flew before it last stood still before a moment, and the tasks that were done
    /// by then; from when on it is known now. `None`: nothing is dropped.
    pub(super) fn forget(&mut self, roadmap: &Roadmap, before: Tick) -> Option<Tick> {
        let lead = self.agent.lead_ticks();
        let before = before.before(2 * lead + self.wake_persistence_ticks);
        let first = self.legs.first()?.start;
        // In the middle of a stay what is flown stands still, too.
        let rests = |leg: &Leg| {
            let from = leg.start.after(lead);
            let until = match leg.end {
                Tick::FOREVER => before,
                end => end.before(lead).min(before),
            };
            (leg.stays() && from <= until && until > first).then_some((until, !leg.flying))
        };
        let (since, grounded) = self.legs.iter().rev().find_map(rests)?;
        let dwells = self.dwells(roadmap);
        let done = dwells.iter().filter(|dwell| dwell.1 <= since).count();
        self.agent = Agent {
            grounded,
            ..self.agent_after(done)
        };
        if let (Some(dwell), Some(waypoint)) = (dwells.get(done), self.agent.waypoints.first_mut())
            && dwell.0 < since
        {
            waypoint.dwell_for_less(since.0 - dwell.0.0);
        }
        self.since = self.since.max(since);
        self.legs.retain(|leg| leg.end > since);
        let first = self.legs.first_mut()?;
        *first = first.between(since, first.end);
        Some(since)
    }

    /// Flies nothing any more from a moment on.
    pub(super) fn cut(&mut self, at: Tick) {
        self.legs.retain(|leg| leg.start < at);
        if let Some(last) = self.legs.last_mut()
            && last.end > at
        {
            *last = last.between(last.start, at);
        }
    }
}

/// The legs of a drone, back to back; between two break points there is one.
///
/// A break point between two ticks is passed by on the straight line between its places at both: by
/// less than it flies in a tick. `kind` is what flies at a mass (kg).
pub(crate) fn legs_of(
    drone: DroneId,
    plan: &DronePlan,
    stays: bool,
    mut kind: impl FnMut(f64) -> KindId,
) -> Vec<Leg> {
    let entry = &finely(&plan.trajectory);
    let (Some(first_s), Some(last_m)) = (entry.t_s.first(), entry.position_m.last()) else {
        return Vec::new();
    };
    let begins = plan.enters_s.map_or(0, |_| whole(*first_s)[0]);
    let until_s = plan.airborne_s.1.unwrap_or(f64::INFINITY);
    let rests_s = plan.landed_s.iter().flat_map(|it| [it.0, it.1]);
    let switches_s = [plan.airborne_s.0, until_s].into_iter().chain(rests_s);
    let times_s = entry.t_s.iter().copied();
    let times_s = times_s.chain(switches_s.filter(|t_s| t_s.is_finite()));
    let mut ticks: Vec<u32> = times_s.flat_map(whole).chain([begins]).collect();
    ticks.retain(|tick| *tick >= begins);
    ticks.sort_unstable();
    ticks.dedup();
    let place_m = |tick: u32| {
        // Times ascend, and with them the ticks they lie between.
        let known = (entry.t_s.partition_point(|t_s| whole(*t_s)[1] <= tick)).checked_sub(1);
        let known = known.filter(|index| whole(entry.t_s[*index]) == [tick; 2]);
        let known_m = known.map(|index| entry.position_m[index]);
        let place_m = known_m.or_else(|| entry.position_m(Tick(tick).seconds()));
        place_m.unwrap_or(*last_m)
    };
    let mut leg = |start: Tick, end: Tick, [from_m, to_m]: [Point3<f64>; 2]| {
        let (from_s, to_s) = (start.seconds() + 1e-9, end.seconds() - 1e-9);
        let last = entry.t_s.partition_point(|t_s| *t_s < to_s).max(1);
        let first = entry.point_at(from_s).unwrap_or(0);
        // The heaviest counts where a mass changes within a tick: its wake is stronger.
        let masses_kg = entry.mass_kg[first..last].iter().copied();
        Leg {
            drone,
            kind: kind(masses_kg.fold(0.0, f64::max)),
            start,
            end,
            from_m,
            to_m,
            flying: plan.airborne_s.0 < to_s
                && from_s < until_s
                && !(plan.landed_s.iter()).any(|it| it.0 <= from_s && to_s <= it.1),
            air_limit: plan.air_limit,
        }
    };
    let pairs = ticks.windows(2).map(|pair| {
        let ends_m = [place_m(pair[0]), place_m(pair[1])];
        leg(Tick(pair[0]), Tick(pair[1]), ends_m)
    });
    let mut legs: Vec<Leg> = pairs.collect();
    if stays || plan.at_end != AtEnd::Leave {
        let rests = Tick(ticks.last().copied().unwrap_or(0));
        legs.push(leg(rests, Tick::FOREVER, [*last_m; 2]));
    }
    legs
}

/// Ticks between the places at which a curve is taken for straight legs: chosen here, of 4 m/s²
/// they are then within 1.3 mm of it.
const CURVE_TICKS: u32 = 5;

/// How far a curve flown at this acceleration (m/s²) is from its legs at most (m).
fn curve_m(acceleration_mps2: f64) -> f64 {
    0.125 * acceleration_mps2 * Tick(CURVE_TICKS).seconds().powi(2)
}

/// How far what is flown is from its legs (m), of a drone that is not planned here.
pub(super) fn path_deviation_m(drone: &Drone, entry: &DronePlan) -> f64 {
    if !entry.trajectory.is_smooth() {
        return 0.0;
    }
    let flown_mps2 = entry.trajectory.highest_acceleration_mps2();
    curve_m(drone.vehicle.max_acceleration_mps2.max(flown_mps2))
}

/// A trajectory as straight pieces: its curves in short ones.
fn finely(entry: &TrajectoryEntry) -> Cow<'_, TrajectoryEntry> {
    if !entry.is_smooth() {
        return Cow::Borrowed(entry);
    }
    let mut fine = TrajectoryEntry::default();
    let mut push = |t_s: f64, place_m: Point3<f64>, mass_kg: f64| {
        fine.t_s.push(t_s);
        fine.position_m.push(place_m);
        fine.mass_kg.push(mass_kg);
    };
    for (k, (&t_s, &mass_kg)) in entry.t_s.iter().zip(&entry.mass_kg).enumerate() {
        push(t_s, entry.position_m[k], mass_kg);
        let (Some(bends), Some(&next_s)) = (entry.control_m.get(k), entry.t_s.get(k + 1)) else {
            continue;
        };
        let first = (t_s * Tick::PER_SECOND) as u32 / CURVE_TICKS + 1;
        let ticks = (first..).map(|it| Tick(it * CURVE_TICKS).seconds());
        for at_s in ticks.take_while(|at_s| !bends.is_empty() && *at_s < next_s) {
            if let Some(place_m) = entry.position_m(at_s) {
                push(at_s, place_m, mass_kg);
            }
        }
    }
    Cow::Owned(fine)
}

/// The whole ticks at or around a time (s).
fn whole(t_s: f64) -> [u32; 2] {
    let ticks = t_s * Tick::PER_SECOND;
    if (ticks - ticks.round()).abs() < SAME_TICK {
        return [ticks.round() as u32; 2];
    }
    [ticks.floor() as u32, ticks.ceil() as u32]
}

/// Cuts a leg wherever it passes a place of the lattice, or one of these (m), at a whole tick; what
/// passes by them, as on a path found on finer cells, in short pieces.
pub(super) fn cut(leg: &Leg, lattice: &Lattice, stops_m: &[Point3<f64>]) -> Vec<Leg> {
    let mut parts = Vec::new();
    let mut rest = *leg;
    let inner = leg.start.0 + 1..if leg.stays() { 0 } else { leg.end.0 };
    for tick in inner.map(Tick) {
        let here_m = leg.position_m(tick);
        let on_lattice = lattice.at(lattice.cell_of(&here_m));
        let on_lattice = on_lattice.map(|place| lattice.position_m(place));
        let mut known = on_lattice.iter().chain(stops_m);
        if let Some(&place_m) = known.find(|at_m| (*at_m - here_m).norm() < SAME_PLACE_M) {
            let (end, to_m) = (tick, place_m);
            parts.push(Leg { end, to_m, ..rest });
            rest.start = tick;
            rest.from_m = place_m;
        }
    }
    parts.push(rest);
    let is_known = |at_m: &Point3<f64>| lattice.place_at(at_m).is_some() || stops_m.contains(at_m);
    let is_on = |part: &Leg| is_known(&part.from_m) && is_known(&part.to_m);
    let part = |part: &Leg| match is_on(part) {
        true => vec![*part],
        false => pieces(part, 0.5 * lattice.cell_m()),
    };
    parts.iter().flat_map(part).collect()
}

/// A leg in pieces of this length at most (m), but for ticks; one straight up or down, as from
/// where a drone stands, in one.
fn pieces(leg: &Leg, longest_m: f64) -> Vec<Leg> {
    let way_m = leg.to_m - leg.from_m;
    if leg.stays() || way_m.xy().norm() < SAME_PLACE_M {
        return vec![*leg];
    }
    let ticks = leg.end.0 - leg.start.0;
    let count = ((way_m.norm() - SAME_PLACE_M) / longest_m).ceil().max(1.0);
    let count = (count as u32).min(ticks);
    let at = |k: u32| {
        let past = u64::from(ticks) * u64::from(k) / u64::from(count);
        leg.start.after(past as u32)
    };
    let pieces = (0..count).map(|k| leg.between(at(k), at(k + 1)));
    pieces.collect()
}
