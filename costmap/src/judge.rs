//! The verdict on a leg: those who are close one by one, the others by what they add up to.

use std::ops::Range;

use crate::costmap::{Costmap, incoming, parts};
use crate::leg::{DroneId, Leg, Tick};
use crate::reservations::ground::Footprint;
use crate::reservations::timeline::Item;
use crate::verdict::{Blocker, Incoming, Verdict, Why, block_largest, peak, price};
use crate::wake::fleet::Meeting;

impl Costmap {
    /// Judges a leg against all legs near and the zones.
    pub fn judge(&self, leg: &Leg, verdict: &mut Verdict) {
        if self.fleet.longest_delay() > 0 {
            verdict.clear();
            self.judge_advected(leg, &self.near(leg), verdict);
            if leg.flying && self.fleet.conditions().wakes {
                self.zones.judge(leg, self.wakes(), &self.timeline, verdict);
            }
            return;
        }
        self.judge_parts(leg, verdict, |part, verdict| {
            self.judge_fully(part, verdict)
        });
    }

    /// The same in a tenth of the time: by bounds for those who are not close, and without a look at what the
    /// leg's own weak wake adds far off. Ask [`Costmap::is_borne`] once a whole path is known.
    pub fn judge_nearby(&self, leg: &Leg, verdict: &mut Verdict) {
        if self.fleet.longest_delay() > 0 {
            return self.judge(leg, verdict);
        }
        self.judge_parts(leg, verdict, |part, verdict| {
            let before = (verdict.blockers.len(), verdict.price_s);
            let enough = [false, true].into_iter().any(|exactly| {
                verdict.blockers.truncate(before.0);
                verdict.price_s = before.1;
                self.judge_close(part, exactly, verdict)
            });
            if !enough {
                verdict.blockers.truncate(before.0);
                verdict.price_s = before.1;
                self.judge_fully(part, verdict);
            }
        });
    }

    fn judge_parts(&self, leg: &Leg, verdict: &mut Verdict, judge: impl Fn(&Leg, &mut Verdict)) {
        verdict.clear();
        for part in parts(leg) {
            judge(&part, verdict);
        }
        if leg.flying && self.fleet.conditions().wakes {
            self.zones.judge(leg, self.wakes(), &self.timeline, verdict);
        }
    }

    /// Whether all drones farther off bear what these legs bring them.
    pub fn is_borne(&self, legs: &[Leg]) -> bool {
        if self.fleet.longest_delay() > 0 {
            return true;
        }
        let mut parts = legs.iter().filter(|leg| leg.flying).flat_map(parts);
        parts.all(|part| self.is_borne_far_off(&part))
    }

    /// Whether all drones that [`Costmap::close_to`] leaves out bear a part's wake.
    fn is_borne_far_off(&self, part: &Leg) -> bool {
        let ground = self.timeline.ground();
        let own = Footprint::around(part, 0.0);
        let bins = ground.bins(&own.grown(self.fleet.wake_reach_m(part.kind)));
        let mut own_end_z_m = None;
        for (bin, gap_m) in ground.rows(bins).flatten().zip(ground.gaps_m(&own, bins)) {
            let load = u64::from(self.fleet.far_load_on_any(part.kind, gap_m));
            let filled = self.timeline.fullest(bin) + self.far_wakes.worst_in(bin);
            let is_close = gap_m < self.fleet.near_m();
            if is_close || load == 0 || filled + load <= u64::from(self.budget) {
                continue;
            }
            for (_, item) in self.timeline.over(bin, part.start, part.end) {
                if item.leg.drone == part.drone || self.bears_easily(part, &own, item) {
                    continue;
                }
                let end_z_m = *own_end_z_m.get_or_insert_with(|| self.wake_end_z_m(part));
                let ends = [end_z_m, item.wake_end_z_m];
                let meeting = self.fleet.meet(part, &item.leg, ends);
                let load = meeting.map_or(0, |meeting| meeting.load_on_second);
                if load > 0 && !self.bears(item, &part.overlap(&item.leg), load) {
                    return false;
                }
            }
        }
        true
    }

    /// Whether a planned leg bears a part's wake, to judge by their distance alone.
    fn bears_easily(&self, part: &Leg, own: &Footprint, item: &Item) -> bool {
        let gap_m = own.gap_m(&item.footprint);
        let load = u64::from(self.fleet.far_load(part.kind, item.leg.kind, gap_m));
        let worst = self
            .far_wakes
            .worst(self.timeline.ground(), &item.footprint);
        !item.leg.flying || load == 0 || item.peak + worst + load <= u64::from(self.budget)
    }

    /// Whether a planned leg bears this much more during a time.
    fn bears(&self, item: &Item, time: &Range<Tick>, load: u32) -> bool {
        let (budget, load) = (u64::from(self.budget), u64::from(load));
        let far_wakes = &self.far_wakes;
        item.peak + far_wakes.worst(self.timeline.ground(), &item.footprint) + load <= budget
            || {
                let weak = far_wakes.on(&self.timeline, &item.footprint, time.start, time.end);
                item.filled(time.start, time.end) + weak + load <= budget
            }
            || load <= budget && self.summed(item, time) + load <= budget
    }

    /// The most that all wakes fill of a planned leg's budget at any moment of a time, each looked at, in
    /// millionths.
    fn summed(&self, item: &Item, time: &Range<Tick>) -> u64 {
        let part = item.leg.between(time.start, time.end);
        let met: Vec<Incoming> = (self.near(&part).into_iter())
            .filter_map(|other| {
                let ends = [item.wake_end_z_m, other.wake_end_z_m];
                let meeting = self.fleet.meet(&part, &other.leg, ends)?;
                let load = meeting.load_on_first;
                (load > 0).then(|| incoming(&part, &other.leg, load))
            })
            .collect();
        peak(&met, part.start, part.end)
    }

    /// Looks at those who are close, and takes bounds for the rest. `false` if bounds will not do: `exactly`
    /// they serve for none that is close.
    fn judge_close(&self, part: &Leg, exactly: bool, verdict: &mut Verdict) -> bool {
        let own = Footprint::around(part, 0.0);
        let mut own_end_z_m = None;
        let mut met = std::mem::take(&mut verdict.met);
        met.clear();
        self.close_to(part, |_, item| {
            let (mine, theirs) = (part.kind, item.leg.kind);
            let gap_m = own.gap_m(&item.footprint);
            let tight = exactly || gap_m < self.fleet.tight_m(mine, theirs);
            let load = if tight || !self.bears_easily(part, &own, item) {
                let end_z_m = *own_end_z_m.get_or_insert_with(|| self.wake_end_z_m(part));
                self.judge_one(part, end_z_m, item, verdict)
            } else if part.flying && item.leg.flying {
                self.fleet.far_load(theirs, mine, gap_m)
            } else {
                0
            };
            if load > 0 {
                met.push((incoming(part, &item.leg, load), [item.began, item.clear]));
            }
        });
        let emits = part.flying && self.fleet.conditions().wakes;
        let enough = !emits || {
            let weak = self
                .far_wakes
                .on(&self.timeline, &own, part.start, part.end);
            let weak = u32::try_from(weak).unwrap_or(u32::MAX);
            let all = met.iter().map(|(incoming, _)| u64::from(incoming.load));
            all.sum::<u64>() + u64::from(weak) <= u64::from(self.budget)
                || self.block_sums(part, weak, false, &met, verdict)
        };
        verdict.met = met;
        enough
    }

    /// Whether the loads fit into the budget at every moment of a part; if they `must`, those that do not are
    /// blocked.
    fn block_sums(
        &self,
        part: &Leg,
        weak: u32,
        must: bool,
        met: &[(Incoming, [Tick; 2])],
        verdict: &mut Verdict,
    ) -> bool {
        let begins = met.iter().map(|(incoming, _)| incoming.start);
        for moment in std::iter::once(part.start).chain(begins) {
            let lasts = |it: &Incoming| it.start <= moment && moment < it.end;
            let together = || met.iter().filter(|(it, _)| lasts(it));
            let sum: u64 = together().map(|(it, _)| u64::from(it.load)).sum();
            if sum + u64::from(weak) <= u64::from(self.budget) {
                continue;
            }
            if !must {
                return false;
            }
            let mut loads: Vec<(u32, Blocker)> = together()
                .map(|(it, [began, clear])| {
                    let blocker = Blocker {
                        drone: it.from,
                        why: Why::OwnLimit,
                        began: *began,
                        clear: *clear,
                    };
                    (it.load, blocker)
                })
                .collect();
            loads.sort_by_key(|(_, blocker)| (blocker.drone, blocker.began));
            block_largest(&mut loads, weak.min(self.budget), self.budget, verdict);
        }
        true
    }

    /// Judges against one other; what it brings unless it forbids the leg.
    fn judge_one(&self, part: &Leg, own_end_z_m: f64, item: &Item, verdict: &mut Verdict) -> u32 {
        let ends = [own_end_z_m, item.wake_end_z_m];
        let Some(meeting) = self.fleet.meet(part, &item.leg, ends) else {
            return 0;
        };
        let time = part.overlap(&item.leg);
        let why = if meeting.bodies {
            Some(Why::Bodies)
        } else if meeting.column {
            Some(Why::Column)
        } else if meeting.load_on_first > self.budget {
            Some(Why::OwnLimit)
        } else if meeting.load_on_second > 0 && !self.bears(item, &time, meeting.load_on_second) {
            Some(Why::TheirLimit)
        } else {
            None
        };
        if let Some(why) = why {
            verdict.block(item.leg.drone, why, item.began, item.clear);
            return 0;
        }
        if time.end != Tick::FOREVER {
            let seconds = time.end.seconds() - time.start.seconds();
            verdict.price_s += seconds * (price(meeting.alpha_first) + price(meeting.alpha_second));
        }
        meeting.load_on_first
    }

    /// Looks at all legs near, and sums what lasts together.
    fn judge_fully(&self, part: &Leg, verdict: &mut Verdict) {
        let end_z_m = self.wake_end_z_m(part);
        let mut met = Vec::new();
        for item in self.near(part) {
            let load = self.judge_one(part, end_z_m, item, verdict);
            if load > 0 {
                met.push((incoming(part, &item.leg, load), [item.began, item.clear]));
            }
        }
        self.block_sums(part, 0, true, &met, verdict);
    }

    /// [`Costmap::judge`] with advected wakes.
    pub(crate) fn judge_advected(&self, leg: &Leg, neighbours: &[&Item], verdict: &mut Verdict) {
        let end_z_m = self.wake_end_z_m(leg);
        let mut emitting: Vec<(&Item, Blocker)> = Vec::new();
        for &item in neighbours {
            let meeting = self
                .fleet()
                .meet_advected(leg, &item.leg, [end_z_m, item.wake_end_z_m]);
            if meeting == Meeting::default() {
                continue;
            }
            let blocker = |why: Why, before: u32, after: u32| Blocker {
                drone: item.leg.drone,
                why,
                began: Tick(item.began.0.saturating_sub(before)),
                clear: item.clear.after(after),
            };
            let own = blocker(Why::OwnLimit, 0, self.fleet().delay_between(&item.leg, leg));
            if meeting.bodies {
                verdict.blockers.push(blocker(Why::Bodies, 0, 0));
            } else if meeting.column {
                verdict.blockers.push(blocker(Why::Column, 0, 0));
            } else if meeting.load_on_first > self.budget() {
                verdict.blockers.push(own);
            } else if meeting.load_on_second > 0
                && self.load_by_others(item, leg.drone) + u64::from(meeting.load_on_second)
                    > u64::from(self.budget())
            {
                let delay = self.fleet().delay_between(leg, &item.leg);
                verdict.blockers.push(blocker(Why::TheirLimit, delay, 0));
            } else {
                // An advected wake costs what it forbids, and no energy.
                let prices = price(meeting.alpha_first) + price(meeting.alpha_second);
                verdict.price_s += shared_s(leg, item) * prices;
                if meeting.load_on_first > 0 {
                    emitting.push((item, own));
                }
            }
        }
        if emitting.is_empty() {
            return;
        }
        for bucket in self.timeline.buckets(leg.start, leg.end) {
            let (start, end) = self.timeline.span(bucket);
            let part = leg.between(start, end);
            if part.start >= part.end {
                continue;
            }
            let mut loads: Vec<(u32, Blocker)> = Vec::new();
            for (item, blocker) in &emitting {
                let load = self
                    .fleet()
                    .advected_load(&item.leg, &part, item.wake_end_z_m);
                if load > 0 {
                    greatest_of_each(&mut loads, load, *blocker);
                }
            }
            block_largest(&mut loads, 0, self.budget(), verdict);
        }
    }

    /// Bound on the budget of a drone on its leg that all wakes but one drone's fill, in millionths.
    fn load_by_others(&self, item: &Item, but: DroneId) -> u64 {
        let footprint = Footprint::around(&item.leg, self.fleet().reach_m(item.leg.kind));
        let since = Tick(
            item.leg
                .start
                .0
                .saturating_sub(self.fleet().longest_delay()),
        );
        let mut loads: Vec<(u32, Blocker)> = Vec::new();
        for other in self.items_near(&footprint, since, item.leg.end) {
            if other.leg.drone == but || other.leg.drone == item.leg.drone {
                continue;
            }
            let load = (self.fleet()).advected_load(&other.leg, &item.leg, other.wake_end_z_m);
            if load > 0 {
                let blocker = Blocker {
                    drone: other.leg.drone,
                    why: Why::TheirLimit,
                    began: other.began,
                    clear: other.clear,
                };
                greatest_of_each(&mut loads, load, blocker);
            }
        }
        loads.iter().map(|(load, _)| u64::from(*load)).sum()
    }
}

/// The greatest load of each drone: its legs follow one another.
fn greatest_of_each(loads: &mut Vec<(u32, Blocker)>, load: u32, blocker: Blocker) {
    match loads
        .iter_mut()
        .find(|(_, known)| known.drone == blocker.drone)
    {
        Some((known, last)) => {
            *known = load.max(*known);
            last.clear = last.clear.max(blocker.clear);
        }
        None => loads.push((load, blocker)),
    }
}

/// How long a leg that ends shares with another (s).
fn shared_s(leg: &Leg, item: &Item) -> f64 {
    let time = leg.overlap(&item.leg);
    if time.end == Tick::FOREVER {
        return 0.0;
    }
    time.end.seconds() - time.start.seconds()
}
