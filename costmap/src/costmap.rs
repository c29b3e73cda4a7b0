//! A leg against the fleet: free, priced or forbidden, and by whom.

use crate::cover::Covers;
use crate::fleet::{BUDGET, Fleet, Meeting, WHOLE, ZoneBox};
use crate::leg::{DroneId, Leg, Tick};
use crate::timeline::{Footprint, Item, Slot, Timeline};
use crate::verdict::{Blocker, Verdict, Why, block_largest, price};
use crate::zone::ZoneLoad;

/// Everybody's legs, and what another leg would mean to them.
#[derive(Clone, Debug)]
pub struct Costmap {
    fleet: Fleet,
    pub(crate) covers: Covers,
    pub(crate) zones: Vec<ZoneBox>,
    pub(crate) timeline: Timeline,
    /// Who blows into which zone: `[bucket][zone]`, the last bucket being the time after.
    pub(crate) zone_loads: Vec<Vec<Vec<ZoneLoad>>>,
    /// Per drone, what was inserted.
    legs: Vec<Vec<Leg>>,
    /// What the loads on one drone or zone may add up to, in millionths of its limit.
    budget: u32,
}

/// A leg of another drone that comes near, as [`Costmap::near`] found it.
#[derive(Clone, Copy, Debug)]
pub struct Neighbour {
    slot: Slot,
    item: Item,
}

impl Neighbour {
    /// The part of its leg that is near.
    pub fn leg(&self) -> &Leg {
        &self.item.leg
    }

    pub(crate) fn item(&self) -> &Item {
        &self.item
    }

    /// Height at which its wake ends (m).
    pub fn wake_end_z_m(&self) -> f64 {
        self.item.wake_end_z_m
    }

    /// When its leg began.
    pub fn began(&self) -> Tick {
        self.item.began
    }

    /// When its leg ends.
    pub fn clear(&self) -> Tick {
        self.item.clear
    }
}

impl Costmap {
    /// An empty sky for a fleet of this many drones.
    pub fn new(fleet: Fleet, covers: Covers, zones: Vec<ZoneBox>, drones: usize) -> Costmap {
        Costmap {
            fleet,
            covers,
            zone_loads: vec![vec![Vec::new(); zones.len()]],
            zones,
            timeline: Timeline::default(),
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

    /// From here on nothing changes any more: the end of all legs that end, and of the air that they leave behind.
    pub fn horizon(&self) -> Tick {
        self.timeline.horizon()
    }

    pub(crate) fn budget(&self) -> u32 {
        self.budget
    }

    pub(crate) fn buckets(&self, start: Tick, end: Tick) -> std::ops::Range<u32> {
        self.timeline.buckets(start, end)
    }

    pub(crate) fn span(&self, bucket: u32) -> (Tick, Tick) {
        self.timeline.span(bucket)
    }

    /// Everybody's legs near a footprint that a span of time touches.
    pub(crate) fn items_near(&self, footprint: &Footprint, start: Tick, end: Tick) -> Vec<&Item> {
        let mut slots = Vec::new();
        for bucket in self.timeline.buckets(start, end) {
            self.timeline.near(bucket, footprint, &mut slots);
        }
        // Tree order must not reach a result.
        slots.sort_unstable();
        slots
            .into_iter()
            .map(|slot| self.timeline.item(slot))
            .collect()
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
        let lag = self.fleet.longest_lag();
        self.timeline.extend_to(last.unwrap_or_default().after(lag));
        self.extend_zones(self.timeline.bucket_count());
        for leg in &legs {
            let end_z_m = self.wake_end_z_m(leg);
            for bucket in self.timeline.buckets(leg.start, leg.end) {
                let (start, end) = self.timeline.span(bucket);
                let part = leg.between(start, end);
                if part.start >= part.end {
                    continue;
                }
                self.insert_part(bucket, leg, part, end_z_m);
            }
            self.blow_into_zones(leg);
        }
        self.legs[drone.0 as usize] = legs;
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

    fn insert_part(&mut self, bucket: u32, whole: &Leg, part: Leg, wake_end_z_m: f64) {
        let mut item = Item {
            leg: part,
            began: whole.start,
            clear: whole.end,
            wake_end_z_m,
            load: 0,
        };
        // Air that comes late is added up when it is asked for.
        let meetings = if self.fleet.longest_lag() == 0 {
            self.meetings(bucket, &part, wake_end_z_m)
        } else {
            Vec::new()
        };
        for (slot, meeting) in meetings {
            item.load += u64::from(meeting.load_on_first);
            let other = self.timeline.item_mut(slot);
            other.load += u64::from(meeting.load_on_second);
        }
        self.timeline.add(bucket, item);
    }

    /// Everyone in a bucket that a part of a leg has to do with.
    fn meetings(&self, bucket: u32, part: &Leg, wake_end_z_m: f64) -> Vec<(Slot, Meeting)> {
        let footprint = Footprint::around(part, self.fleet.reach_m(part.kind));
        let mut slots = Vec::new();
        self.timeline.near(bucket, &footprint, &mut slots);
        slots
            .into_iter()
            .filter(|&slot| self.timeline.item(slot).leg.drone != part.drone)
            .filter_map(|slot| {
                let other = self.timeline.item(slot);
                let meeting =
                    self.fleet
                        .meet(part, &other.leg, [wake_end_z_m, other.wake_end_z_m])?;
                Some((slot, meeting))
            })
            .collect()
    }

    /// Takes back all that a drone has reserved.
    pub fn remove(&mut self, drone: DroneId) {
        let legs = std::mem::take(&mut self.legs[drone.0 as usize]);
        let (Some(first), Some(last)) = (legs.first(), legs.last()) else {
            return;
        };
        let lag = self.fleet.longest_lag();
        for bucket in self.timeline.buckets(first.start, last.end.after(lag)) {
            let slots = self.timeline.of(bucket, drone);
            for &slot in slots.iter().filter(|_| lag == 0) {
                let item = *self.timeline.item(slot);
                for (other, meeting) in self.meetings(bucket, &item.leg, item.wake_end_z_m) {
                    let other = self.timeline.item_mut(other);
                    other.load -= u64::from(meeting.load_on_second);
                }
            }
            self.timeline.remove(bucket, &slots);
            if !self.zones.is_empty() {
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

    /// Collects everybody that a leg could have to do with.
    ///
    /// The answer serves all legs of the same drone at the same places and within its time.
    pub fn near(&self, leg: &Leg, found: &mut Vec<Neighbour>) {
        found.clear();
        let footprint = Footprint::around(leg, self.fleet.reach_m(leg.kind));
        let mut slots = Vec::new();
        let lag = self.fleet.longest_lag();
        let (since, until) = (Tick(leg.start.0.saturating_sub(lag)), leg.end.after(lag));
        for bucket in self.timeline.buckets(since, until) {
            self.timeline.near(bucket, &footprint, &mut slots);
        }
        found.extend(slots.into_iter().filter_map(|slot| {
            let item = *self.timeline.item(slot);
            let concerns =
                item.leg.drone != leg.drone && item.leg.start < until && since < item.leg.end;
            concerns.then_some(Neighbour { slot, item })
        }));
        // Tree order must not reach a sum.
        found.sort_unstable_by_key(|n| (n.slot.bucket, n.item.leg.drone, n.item.leg.start));
    }

    /// Those of `neighbours` so near that they could forbid `leg`, or one that begins within
    /// `around_m` of it, all by themselves.
    pub fn gripping<'a>(
        &'a self,
        leg: &Leg,
        around_m: f64,
        neighbours: &'a [Neighbour],
    ) -> impl Iterator<Item = &'a Neighbour> {
        let footprint = Footprint::around(leg, self.fleet.grip_m(leg.kind) + around_m);
        neighbours
            .iter()
            .filter(move |n| footprint.meets(&Footprint::around(&n.item.leg, 0.0)))
    }

    /// Judges a leg against its neighbours (of [`Costmap::near`]) and the zones.
    pub fn judge(&self, leg: &Leg, neighbours: &[Neighbour], verdict: &mut Verdict) {
        verdict.clear();
        if self.fleet.longest_lag() > 0 {
            self.judge_late(leg, neighbours, verdict);
        } else {
            let mut own_end_z_m = None;
            for same_bucket in neighbours.chunk_by(|a, b| a.slot.bucket == b.slot.bucket) {
                self.judge_bucket(leg, same_bucket, &mut own_end_z_m, verdict);
            }
        }
        if leg.flying && self.fleet.conditions().wakes {
            self.judge_zones(leg, verdict);
        }
    }

    fn judge_bucket(
        &self,
        leg: &Leg,
        neighbours: &[Neighbour],
        own_end_z_m: &mut Option<f64>,
        verdict: &mut Verdict,
    ) {
        // One drone's legs follow one another: its greatest load counts, not their sum.
        let mut loads: Vec<(u32, Blocker)> = Vec::new();
        for Neighbour { item, .. } in neighbours {
            let end_z_m = *own_end_z_m.get_or_insert_with(|| self.wake_end_z_m(leg));
            let Some(meeting) = self
                .fleet
                .meet(leg, &item.leg, [end_z_m, item.wake_end_z_m])
            else {
                continue;
            };
            let drone = item.leg.drone;
            let why = if meeting.bodies {
                Some(Why::Bodies)
            } else if meeting.column {
                Some(Why::Column)
            } else if meeting.load_on_first > self.budget {
                Some(Why::OwnLimit)
            } else if meeting.load_on_second > 0
                && item.load + u64::from(meeting.load_on_second) > u64::from(self.budget)
            {
                Some(Why::TheirLimit)
            } else {
                None
            };
            if let Some(why) = why {
                verdict.block(drone, why, item.began, item.clear);
                continue;
            }
            let seconds = self.shared_s(leg, item);
            verdict.price_s += seconds * (price(meeting.alpha_first) + price(meeting.alpha_second));
            if meeting.load_on_first > 0 {
                let blocker = Blocker {
                    drone,
                    why: Why::OwnLimit,
                    began: item.began,
                    clear: item.clear,
                };
                match loads.last_mut() {
                    Some((load, last)) if last.drone == drone => {
                        *load = meeting.load_on_first.max(*load);
                        last.clear = last.clear.max(item.clear);
                    }
                    _ => loads.push((meeting.load_on_first, blocker)),
                }
            }
        }
        block_largest(&mut loads, 0, self.budget, verdict);
    }

    pub(crate) fn shared_s(&self, leg: &Leg, item: &Item) -> f64 {
        let time = leg.overlap(&item.leg);
        if time.end == Tick::FOREVER {
            return 0.0;
        }
        time.end.seconds() - time.start.seconds()
    }
}

#[cfg(test)]
mod tests;
