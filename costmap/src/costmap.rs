//! A leg against the fleet: free, priced or forbidden, and by whom.

use std::ops::Range;

use crate::cover::Covers;
use crate::draught::Draught;
use crate::fleet::{BUDGET, Fleet, WHOLE, ZoneBox};
use crate::ground::{Footprint, Ground};
use crate::leg::{DroneId, Leg, Tick};
use crate::timeline::{BUCKET_TICKS, Incoming, Item, Timeline};
use crate::verdict::{Blocker, Verdict, Why, block_largest, price};

/// Legs on the move that last longer are judged and kept in parts: chosen here, a second holds a typical one.
const PART_TICKS: u32 = 200;

/// Everybody's legs, and what another leg would mean to them.
#[derive(Clone, Debug)]
pub struct Costmap {
    fleet: Fleet,
    covers: Covers,
    zones: Vec<ZoneBox>,
    timeline: Timeline,
    draught: Draught,
    /// Who blows into which zone: `[bucket][zone]`, the last bucket being the time after.
    zone_loads: Vec<Vec<Vec<ZoneLoad>>>,
    /// Per drone, what was inserted.
    legs: Vec<Vec<Leg>>,
    /// What the loads on one drone or zone may add up to, in millionths of its limit.
    budget: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct ZoneLoad {
    drone: DroneId,
    load: u32,
    clear: Tick,
}

impl Costmap {
    /// An empty sky for a fleet of this many drones.
    pub fn new(
        fleet: Fleet,
        covers: Covers,
        zones: Vec<ZoneBox>,
        ground: Ground,
        drones: usize,
    ) -> Costmap {
        Costmap {
            fleet,
            covers,
            zone_loads: vec![vec![Vec::new(); zones.len()]],
            zones,
            timeline: Timeline::new(ground, drones),
            draught: Draught::new(&ground),
            legs: vec![Vec::new(); drones],
            budget: BUDGET,
        }
    }

    /// The same sky, were every drone's air limit this many times higher. Bodies, columns and zones stay
    /// as they are.
    #[must_use]
    pub fn with_limits_raised(&self, times: f64) -> Costmap {
        let raised = f64::from(self.fleet.load(times)) * f64::from(BUDGET) / WHOLE;
        Costmap {
            budget: raised.min(f64::from(u32::MAX / 2)) as u32,
            ..self.clone()
        }
    }

    /// What flies.
    pub fn fleet(&self) -> &Fleet {
        &self.fleet
    }

    /// What a drone has reserved; empty if it is not planned.
    pub fn legs(&self, drone: DroneId) -> &[Leg] {
        &self.legs[drone.0 as usize]
    }

    /// The end of all legs that end.
    pub fn horizon(&self) -> Tick {
        self.timeline.horizon()
    }

    /// Reserves a drone's legs, bodies and wakes, in place of what it had reserved.
    pub fn insert(&mut self, legs: Vec<Leg>) {
        let Some(first) = legs.first() else { return };
        let drone = first.drone;
        self.remove(drone);
        let last = legs
            .iter()
            .map(|leg| {
                if leg.end == Tick::FOREVER {
                    leg.start
                } else {
                    leg.end
                }
            })
            .max();
        self.timeline.extend_to(last.unwrap_or_default());
        self.extend_zones(self.timeline.bucket_count());
        for leg in &legs {
            let end_z_m = self.wake_end_z_m(leg);
            for part in parts(leg) {
                self.insert_part(part, [leg.start, leg.end], end_z_m);
            }
            self.load_zones(leg);
        }
        if self.fleet.conditions().wakes {
            self.draught.extend_to(self.timeline.bucket_count());
            self.draught.add(&self.fleet, &self.timeline, &legs);
        }
        self.legs[drone.0 as usize] = legs;
    }

    fn insert_part(&mut self, part: Leg, whole: [Tick; 2], wake_end_z_m: f64) {
        let mut met = Vec::new();
        self.close_to(&part, |other, item| {
            let ends = [wake_end_z_m, item.wake_end_z_m];
            if let Some(meeting) = self.fleet.meet(&part, &item.leg, ends) {
                let on_me = incoming(&part, &item.leg, meeting.load_on_first);
                met.push((other, on_me, incoming(&item.leg, &part, meeting.load_on_second)));
            }
        });
        let index = self.timeline.add(part, whole, wake_end_z_m);
        for (other, on_me, on_them) in met {
            if on_me.load > 0 {
                self.timeline.meets(index, on_me);
            }
            if on_them.load > 0 {
                self.timeline.meets(other, on_them);
            }
        }
    }

    /// Calls `f` with everybody who is not so far off that [`Draught`] accounts for them.
    fn close_to<'a>(&'a self, part: &Leg, mut f: impl FnMut(u32, &'a Item)) {
        let ground = self.timeline.ground();
        let own = Footprint::around(part, 0.0);
        let around = ground.hull(ground.bins(&own), self.fleet.near_m());
        self.timeline.around(&around, part.start, part.end, |index, item| {
            if item.leg.drone != part.drone {
                f(index, item);
            }
        });
    }

    /// Takes back all that a drone has reserved.
    pub fn remove(&mut self, drone: DroneId) {
        let legs = std::mem::take(&mut self.legs[drone.0 as usize]);
        let (Some(first), Some(last)) = (legs.first(), legs.last()) else {
            return;
        };
        let mut loaded = Vec::new();
        for &index in self.timeline.of(drone) {
            self.close_to(&self.timeline.item(index).leg, |other, item| {
                if item.met.iter().any(|incoming| incoming.from == drone) {
                    loaded.push(other);
                }
            });
        }
        loaded.sort_unstable();
        loaded.dedup();
        for other in loaded {
            self.timeline.forget(other, drone);
        }
        self.timeline.remove(drone);
        if self.fleet.conditions().wakes {
            self.draught.take_back(&self.fleet, &self.timeline, &legs);
        }
        if !self.zones.is_empty() {
            for bucket in self.timeline.buckets(first.start, last.end) {
                for zone in &mut self.zone_loads[bucket as usize] {
                    zone.retain(|load| load.drone != drone);
                }
            }
        }
    }

    /// Height at which the wake of a leg ends (m).
    pub fn wake_end_z_m(&self, leg: &Leg) -> f64 {
        if !leg.flying {
            return f64::INFINITY;
        }
        self.covers
            .wake_end_z_m(self.fleet.wake(leg.kind), &leg.from_m, &leg.to_m)
    }

    /// Everybody that a leg could have to do with while it lasts.
    pub fn near(&self, leg: &Leg) -> Vec<&Item> {
        let mut found = Vec::new();
        let around = Footprint::around(leg, self.fleet.reach_m(leg.kind));
        self.timeline.around(&around, leg.start, leg.end, |_, item| {
            if item.leg.drone != leg.drone {
                found.push(item);
            }
        });
        found.sort_unstable_by_key(|item| (item.leg.drone, item.leg.start));
        found
    }

    /// Calls `f` with everybody so near while a leg lasts that they could forbid it, or one that begins
    /// within `around_m` of it, all by themselves: when their leg began, and when it ends.
    pub fn gripping(&self, leg: &Leg, around_m: f64, mut f: impl FnMut(Tick, Tick)) {
        let around = Footprint::around(leg, self.fleet.grip_m(leg.kind) + around_m);
        self.timeline.around(&around, leg.start, leg.end, |_, item| {
            if item.leg.drone != leg.drone && item.footprint.gap_m(&around) == 0.0 {
                f(item.began, item.clear);
            }
        });
    }

    /// Judges a leg against everybody near and the zones.
    pub fn judge(&self, leg: &Leg, verdict: &mut Verdict) {
        self.judge_parts(leg, verdict, |part, verdict| self.judge_fully(part, verdict));
    }

    /// The same in a tenth of the time: by bounds for those who are not close, and without a look at what the
    /// leg's own weak wake adds far off. Ask [`Costmap::is_borne`] once a whole way is known.
    pub fn judge_nearby(&self, leg: &Leg, verdict: &mut Verdict) {
        self.judge_parts(leg, verdict, |part, verdict| {
            let before = (verdict.blockers.len(), verdict.price_s);
            if !self.judge_close(part, false, verdict) {
                verdict.blockers.truncate(before.0);
                verdict.price_s = before.1;
                self.judge_close(part, true, verdict);
            }
        });
    }

    fn judge_parts(
        &self,
        leg: &Leg,
        verdict: &mut Verdict,
        judge: impl Fn(&Leg, &mut Verdict),
    ) {
        verdict.clear();
        for part in parts(leg) {
            judge(&part, verdict);
        }
        if leg.flying && self.fleet.conditions().wakes {
            self.judge_zones(leg, verdict);
        }
    }

    /// Whether everybody farther off bears what these legs bring them.
    pub fn is_borne(&self, legs: &[Leg]) -> bool {
        let parts = legs.iter().filter(|leg| leg.flying).flat_map(parts);
        parts.into_iter().all(|part| {
            let own = Footprint::around(&part, 0.0);
            let reach = own.grown(self.fleet.wake_reach_m(part.kind));
            let mut own_end_z_m = None;
            let mut borne = true;
            self.timeline.around(&reach, part.start, part.end, |_, item| {
                if !borne || item.leg.drone == part.drone || self.bears_easily(&part, &own, item) {
                    return;
                }
                let end_z_m = *own_end_z_m.get_or_insert_with(|| self.wake_end_z_m(&part));
                let ends = [end_z_m, item.wake_end_z_m];
                let meeting = self.fleet.meet(&part, &item.leg, ends);
                let load = meeting.map_or(0, |meeting| meeting.load_on_second);
                borne &= load == 0 || self.bears(item, &part.overlap(&item.leg), load);
            });
            borne
        })
    }

    /// Whether somebody planned bears a part's wake, to judge by their distance alone.
    fn bears_easily(&self, part: &Leg, own: &Footprint, item: &Item) -> bool {
        let gap_m = own.gap_m(&item.footprint);
        let load = u64::from(self.fleet.faint_load(part.kind, item.leg.kind, gap_m));
        let worst = self.draught.worst(&item.footprint);
        !item.leg.flying || load == 0 || item.peak + worst + load <= u64::from(self.budget)
    }

    /// Whether somebody planned bears this much more during a time.
    fn bears(&self, item: &Item, time: &Range<Tick>, load: u32) -> bool {
        let (budget, load) = (u64::from(self.budget), u64::from(load));
        let draught = &self.draught;
        item.peak + draught.worst(&item.footprint) + load <= budget || {
            let weak = draught.on(&self.timeline, &item.footprint, time.start, time.end);
            item.filled(time.start, time.end) + weak + load <= budget
        }
    }

    /// Looks at those who are close, and takes bounds for the rest. `false` if bounds will not do: `exactly`
    /// they serve for nobody close, and the heaviest loads give way to the others.
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
                self.fleet.faint_load(theirs, mine, gap_m)
            } else {
                0
            };
            if load > 0 {
                met.push((incoming(part, &item.leg, load), [item.began, item.clear]));
            }
        });
        let blows = part.flying && self.fleet.conditions().wakes;
        let enough = !blows || {
            let weak = self.draught.on(&self.timeline, &own, part.start, part.end);
            let weak = u32::try_from(weak).unwrap_or(u32::MAX);
            let all = met.iter().map(|(incoming, _)| u64::from(incoming.load));
            all.sum::<u64>() + u64::from(weak) <= u64::from(self.budget)
                || self.block_sums(part, weak, exactly, &met, verdict)
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

    /// Looks at everybody, and sums what lasts together.
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

    fn extend_zones(&mut self, buckets: usize) {
        if self.zones.is_empty() {
            return;
        }
        while self.zone_loads.len() < buckets + 1 {
            let after = self.zone_loads.last().cloned().unwrap_or_default();
            self.zone_loads.push(after);
        }
    }

    fn load_zones(&mut self, leg: &Leg) {
        if self.zones.is_empty() {
            return;
        }
        for bucket in self.timeline.buckets(leg.start, leg.end) {
            let (start, end) = self.timeline.span(bucket);
            let part = leg.between(start, end);
            if part.start >= part.end {
                continue;
            }
            for (index, zone) in self.zones.iter().enumerate() {
                let load = self.fleet.load_on_zone(&part, &self.covers, zone);
                if load > 0 {
                    self.zone_loads[bucket as usize][index].push(ZoneLoad {
                        drone: part.drone,
                        load,
                        clear: leg.end,
                    });
                }
            }
        }
    }

    fn judge_zones(&self, leg: &Leg, verdict: &mut Verdict) {
        for (index, zone) in self.zones.iter().enumerate() {
            let own = self.fleet.load_on_zone(leg, &self.covers, zone);
            if own == 0 {
                continue;
            }
            if own > BUDGET {
                verdict.breaks_zone = Some(index);
                return;
            }
            for bucket in self.timeline.buckets(leg.start, leg.end) {
                let Some(zones) = self.zone_loads.get(bucket as usize) else {
                    continue;
                };
                let mut loads: Vec<(u32, Blocker)> = zones[index]
                    .iter()
                    .map(|load| {
                        let blocker = Blocker {
                            drone: load.drone,
                            why: Why::Zone,
                            began: leg.start,
                            clear: load.clear,
                        };
                        (load.load, blocker)
                    })
                    .collect();
                block_largest(&mut loads, own, BUDGET, verdict);
            }
        }
    }
}

/// What one leg meets of another's wake.
fn incoming(on: &Leg, from: &Leg, load: u32) -> Incoming {
    let time = on.overlap(from);
    Incoming {
        from: from.drone,
        start: time.start,
        end: time.end,
        load,
    }
}

/// A leg that stays, whole; others in parts of a second, if they last for more than two.
fn parts(leg: &Leg) -> impl Iterator<Item = Leg> + '_ {
    let whole = leg.stays() || leg.end.0 - leg.start.0 <= PART_TICKS;
    let step = if whole { u32::MAX } else { BUCKET_TICKS };
    let mut next = Some(leg.start);
    std::iter::from_fn(move || {
        let start = next?;
        let end = start.after(step).min(leg.end);
        next = (end < leg.end).then_some(end);
        Some(if whole { *leg } else { leg.between(start, end) })
    })
}

#[cfg(test)]
mod tests;
