//! What one drone flies, and where in that and in its tasks it is at a moment.

use costmap::leg::{Leg, Tick};
use nalgebra::Point3;

use crate::graph::agent::Errand;
use crate::graph::roadmap::{Roadmap, Vertex};
use crate::sipp::search::joined;

/// One drone of a running plan.
#[derive(Clone, Debug)]
pub(super) struct Track {
    /// Its legs, back to back, from where it comes to where it ends.
    pub(super) legs: Vec<Leg>,
    /// What it had to do from [`Track::since`] on.
    pub(super) errand: Errand,
    /// When it was last told what to do.
    pub(super) since: Tick,
    /// It has a way to the end of its errand. Others stay where they are.
    pub(super) planned: bool,
}

/// Where a drone is in what it flies.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum State {
    /// It has not come yet, or has left.
    Absent,
    /// All its tasks are done, and how it ends goes on whatever is planned; or it has no way.
    Ends,
    /// It can go on otherwise from a place and a moment.
    Flies {
        /// How many of its tasks are done by then.
        done: usize,
        /// What it flies until then, from the moment asked about or a little earlier.
        begun: Vec<Leg>,
        /// When it can go on otherwise.
        departs: Tick,
        /// Where that is.
        at_m: Point3<f64>,
        /// It stands on the ground.
        grounded: bool,
    },
}

impl Track {
    /// Index of the leg under way at a moment.
    fn leg_at(&self, at: Tick) -> Option<usize> {
        let index = self.legs.partition_point(|leg| leg.end <= at);
        let leg = self.legs.get(index)?;
        (leg.start <= at).then_some(index)
    }

    /// Where it is at a moment, and from when on it can do something else. A leg is flown to its end; a
    /// dwell that has begun is, too, unless it `drops` what it has to do.
    pub(super) fn state(&self, roadmap: &Roadmap, at: Tick, drops: bool) -> State {
        let Some(index) = self.leg_at(at) else {
            return State::Absent;
        };
        let dwells = self.dwells(roadmap);
        let finished = dwells.len() == self.errand.stages.len()
            && dwells.last().is_none_or(|dwell| dwell.1 <= at);
        if !drops && (finished || !self.planned) {
            return State::Ends;
        }
        let leg = &self.legs[index];
        let dwell = dwells.iter().find(|dwell| dwell.0 <= at && at < dwell.1);
        let departs = match dwell {
            Some(dwell) if !drops => dwell.1,
            _ if leg.stays() => at,
            _ if leg.start == at && self.vertex_at(roadmap, &leg.from_m).is_some() => at,
            _ => leg.end,
        };
        let begun: Vec<Leg> = self.legs[index..]
            .iter()
            .filter(|leg| leg.start < departs)
            .map(|leg| {
                if leg.stays() {
                    leg.between(leg.start, departs)
                } else {
                    *leg
                }
            })
            .collect();
        let at_m = begun.last().map_or(leg.from_m, |leg| leg.to_m);
        // A leg down or up counts as flown: on the ground is who stays there before or after it.
        let past = self.legs.partition_point(|leg| leg.end <= departs);
        let around = [past.checked_sub(1), Some(past)];
        let around = around
            .into_iter()
            .flatten()
            .filter_map(|at| self.legs.get(at));
        let mut stands = around.filter(|leg| leg.stays()).map(|leg| !leg.flying);
        let grounded = if past == 0 {
            !leg.flying || self.errand.grounded
        } else {
            stands.any(|it| it)
        };
        State::Flies {
            done: dwells.iter().filter(|dwell| dwell.1 <= departs).count(),
            // A descent ends on the ground.
            grounded,
            begun,
            departs,
            at_m,
        }
    }

    /// When each task is begun to dwell at and done, as far as legs get.
    ///
    /// A task is done once the drone has been at its place for the whole dwell in one piece, after the task
    /// before it, at the mass that it flies with from there.
    pub(super) fn dwells(&self, roadmap: &Roadmap) -> Vec<(Tick, Tick)> {
        let mut dwells = Vec::with_capacity(self.errand.stages.len());
        let mut from = self.since;
        let mut index = self.legs.partition_point(|leg| leg.end <= from);
        for (stage, kind) in self.errand.stages.iter().zip(&self.errand.kinds[1..]) {
            let goal_m = roadmap.position_m(stage.distances.goal());
            let dwell = loop {
                let Some(leg) = self.legs.get(index) else {
                    return dwells;
                };
                let begins = leg.start.max(from);
                let there = leg.position_m(begins) == goal_m && leg.kind == *kind;
                if there && self.stays_until(index, goal_m) >= begins.after(stage.dwell_ticks) {
                    break (begins, begins.after(stage.dwell_ticks));
                }
                index += 1;
            };
            from = dwell.1;
            index = self.legs.partition_point(|leg| leg.end <= from);
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
        let own = self.errand.mover.stops().iter().copied();
        let own = own.filter(|&stop| roadmap.position_m(stop) == *at_m);
        own.chain(roadmap.lattice().place_at(at_m)).next()
    }

    /// What it has to do once this many tasks are done.
    pub(super) fn errand_after(&self, done: usize) -> Errand {
        Errand {
            stages: self.errand.stages[done..].to_vec(),
            kinds: self.errand.kinds[done..].to_vec(),
            ..self.errand.clone()
        }
    }

    /// Behind by some ticks from a moment on: it stands for that long where it was that long ago, and goes
    /// on from there.
    pub(super) fn fall_behind(&mut self, roadmap: &Roadmap, at: Tick, by: u32) {
        let was = Tick(at.0 - by);
        let dwells = self.dwells(roadmap);
        let done = dwells.iter().filter(|dwell| dwell.1 <= was).count();
        self.errand = self.errand_after(done);
        if let (Some(dwell), Some(stage)) = (dwells.get(done), self.errand.stages.first_mut())
            && dwell.0 <= was
        {
            let gone = stage.dwell_ticks - (dwell.1.0 - was.0);
            stage.dwell_ticks -= gone;
            stage.rest_ticks = stage.rest_ticks.saturating_sub(gone);
        }
        self.since = at;
        let mut legs: Vec<Leg> = Vec::with_capacity(self.legs.len() + 2);
        for leg in &self.legs {
            let later = |leg: Leg| Leg {
                start: leg.start.after(by),
                end: leg.end.after(by),
                ..leg
            };
            if leg.start > was {
                legs.push(later(*leg));
                continue;
            }
            if leg.end <= was {
                legs.push(*leg);
                continue;
            }
            if leg.stays() {
                legs.push(Leg {
                    end: leg.end.after(by),
                    ..*leg
                });
                continue;
            }
            let here_m = leg.position_m(was);
            if leg.start < was {
                legs.push(leg.between(leg.start, was));
            }
            legs.push(Leg {
                start: was,
                end: at,
                from_m: here_m,
                to_m: here_m,
                ..*leg
            });
            legs.push(later(leg.between(was, leg.end)));
        }
        self.legs = joined(legs);
    }

    /// The legs that end after a moment.
    pub(super) fn rest(&self, at: Tick) -> Vec<Leg> {
        self.legs
            .iter()
            .filter(|leg| leg.end > at)
            .copied()
            .collect()
    }

    /// Goes on with these legs from where they begin.
    pub(super) fn go_on(&mut self, legs: &[Leg]) {
        let Some(first) = legs.first() else { return };
        self.cut(first.start);
        self.legs.extend_from_slice(legs);
        self.legs = joined(std::mem::take(&mut self.legs));
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
