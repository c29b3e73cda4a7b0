//! A leg against the fleet: free, priced or forbidden, and by whom.

use airflow::power;

use crate::cover::Covers;
use crate::fleet::{BUDGET, Fleet, Meeting, WHOLE, ZoneBox};
use crate::leg::{DroneId, Leg, Tick};
use crate::timeline::{Footprint, Item, Slot, Timeline};

/// Mean air below this share of the induced velocity costs nothing: chosen here, half a percent of power.
const PRICELESS_ALPHA: f64 = 0.01;

/// Everybody's legs, and what another leg would mean to them.
#[derive(Clone, Debug)]
pub struct Costmap {
    fleet: Fleet,
    covers: Covers,
    zones: Vec<ZoneBox>,
    timeline: Timeline,
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

/// Why a leg may not be flown past a drone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// The bodies would touch.
    Bodies,
    /// One would be in the other's near-field column.
    Column,
    /// The leg's own air limit would be exceeded.
    OwnLimit,
    /// The other's air limit would be exceeded.
    TheirLimit,
    /// Both together blow too much into a zone.
    Zone,
}

/// A drone in the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Blocker {
    /// Who.
    pub drone: DroneId,
    /// How.
    pub why: Why,
    /// When its leg began.
    pub began: Tick,
    /// When its leg ends: before, trying again is in vain or nearly so.
    pub clear: Tick,
}

/// The answer to "may I fly this leg, and what does it cost".
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// Who forbids it; empty: nobody.
    pub blockers: Vec<Blocker>,
    /// The zone (its index) into which it blows more than may be, all by itself.
    pub breaks_zone: Option<usize>,
    /// Extra energy of everyone affected, in seconds of its own hovering in still air.
    pub price_s: f64,
}

impl Verdict {
    /// Nobody forbids it.
    pub fn is_allowed(&self) -> bool {
        self.blockers.is_empty() && self.breaks_zone.is_none()
    }

    fn clear(&mut self) {
        self.blockers.clear();
        self.breaks_zone = None;
        self.price_s = 0.0;
    }

    fn block(&mut self, drone: DroneId, why: Why, began: Tick, clear: Tick) {
        self.blockers.push(Blocker {
            drone,
            why,
            began,
            clear,
        });
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
            for bucket in self.timeline.buckets(leg.start, leg.end) {
                let (start, end) = self.timeline.span(bucket);
                let part = leg.between(start, end);
                if part.start >= part.end {
                    continue;
                }
                self.insert_part(bucket, leg, part, end_z_m);
            }
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
        for (slot, meeting) in self.meetings(bucket, &part, wake_end_z_m) {
            item.load += u64::from(meeting.load_on_first);
            let other = self.timeline.item_mut(slot);
            other.load += u64::from(meeting.load_on_second);
        }
        self.timeline.add(bucket, item);
        for (index, zone) in self.zones.iter().enumerate() {
            let load = self.fleet.load_on_zone(&part, &self.covers, zone);
            if load > 0 {
                self.zone_loads[bucket as usize][index].push(ZoneLoad {
                    drone: part.drone,
                    load,
                    clear: whole.end,
                });
            }
        }
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
        for bucket in self.timeline.buckets(first.start, last.end) {
            let slots = self.timeline.of(bucket, drone);
            for &slot in &slots {
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
        for bucket in self.timeline.buckets(leg.start, leg.end) {
            self.timeline.near(bucket, &footprint, &mut slots);
        }
        found.extend(slots.into_iter().filter_map(|slot| {
            let item = *self.timeline.item(slot);
            let concerns =
                item.leg.drone != leg.drone && item.leg.start < leg.end && leg.start < item.leg.end;
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
        let mut own_end_z_m = None;
        for same_bucket in neighbours.chunk_by(|a, b| a.slot.bucket == b.slot.bucket) {
            self.judge_bucket(leg, same_bucket, &mut own_end_z_m, verdict);
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

    fn shared_s(&self, leg: &Leg, item: &Item) -> f64 {
        let time = leg.overlap(&item.leg);
        if time.end == Tick::FOREVER {
            return 0.0;
        }
        time.end.seconds() - time.start.seconds()
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

/// Blocks the heaviest loads until the rest fits into the budget beside `own`.
fn block_largest(loads: &mut [(u32, Blocker)], own: u32, budget: u32, verdict: &mut Verdict) {
    let mut total = loads
        .iter()
        .fold(own, |sum, (load, _)| sum.saturating_add(*load));
    if total <= budget {
        return;
    }
    loads.sort_by_key(|(load, blocker)| (std::cmp::Reverse(*load), blocker.drone));
    for (load, blocker) in loads.iter() {
        if total <= budget {
            return;
        }
        verdict.blockers.push(*blocker);
        total = total.saturating_sub(*load);
    }
}

/// Extra power over the power of hovering in still air.
fn price(alpha: f64) -> f64 {
    if alpha < PRICELESS_ALPHA {
        0.0
    } else {
        power::beta(alpha) - 1.0
    }
}

#[cfg(test)]
mod tests {
    use airflow::{Airframe, Jet, Superposition};
    use nalgebra::Point3;

    use super::*;
    use crate::cover::Top;
    use crate::fleet::{Conditions, Kind};
    use crate::leg::KindId;

    const DRONES: u32 = 24;

    fn empty() -> Costmap {
        let airframes =
            ["offboard-2", "kolibri"].map(|name| Airframe::preset(name).expect("a preset"));
        let kinds = [(0, 1.207), (1, 0.23)].map(|(airframe, mass_kg): (usize, f64)| Kind {
            airframe,
            mass_kg,
            body_radius_m: airframes[airframe].tip_radius_m(),
        });
        let conditions = Conditions {
            density_kg_per_m3: 1.204,
            jet: Jet::default(),
            superposition: Superposition::Momentum,
            clearance_m: 0.1,
            deepest_m: 6.0,
            lowest_air_limit: 0.3,
            lowest_zone_limit_mps: 1.5,
            wakes: true,
        };
        let top = Top::Rectangle {
            min_m: [0.0, 0.0],
            max_m: [3.0, 3.0],
            z_m: 1.0,
        };
        let zone = ZoneBox {
            min_m: Point3::new(4.0, 4.0, 0.0),
            max_m: Point3::new(6.0, 6.0, 1.0),
            air_limit_mps: 2.0,
        };
        Costmap::new(
            Fleet::new(&airframes, kinds.to_vec(), conditions),
            Covers::new(0.0, vec![top]),
            vec![zone],
            DRONES as usize,
        )
    }

    fn at(index: u32) -> f64 {
        (f64::from(index) * 0.754_877_666_246_69).fract()
    }

    /// Five random legs, back to back; two drones in three stay at the end for ever.
    fn legs(drone: u32, round: u32) -> Vec<Leg> {
        let place = |k: u32| {
            let i = 1000 * round + 31 * drone + 3 * k;
            Point3::new(7.0 * at(i), 7.0 * at(i + 1), 6.0 * at(i + 2))
        };
        let leg = |k: u32| Leg {
            drone: DroneId(drone),
            kind: KindId((drone % 2) as u16),
            start: Tick(170 * k),
            end: Tick(170 * (k + 1)),
            from_m: place(k),
            to_m: place(k + 1),
            flying: k > 0 || drone % 4 != 0,
            air_limit: 0.3,
        };
        let mut legs: Vec<Leg> = (0..5).map(leg).collect();
        if drone % 3 != 0 {
            legs.push(Leg {
                start: legs[4].end,
                end: Tick::FOREVER,
                from_m: legs[4].to_m,
                ..legs[4]
            });
        }
        legs
    }

    /// Who, from when: the load.
    type Loads = Vec<(u32, DroneId, Tick, u64)>;

    fn loads(costmap: &Costmap) -> (Loads, Vec<Vec<(DroneId, u32)>>) {
        let mut loads = Loads::new();
        let mut in_zone = Vec::new();
        for bucket in 0..=costmap.timeline.bucket_count() as u32 {
            for drone in (0..DRONES).map(DroneId) {
                for slot in costmap.timeline.of(bucket, drone) {
                    let item = costmap.timeline.item(slot);
                    loads.push((bucket, drone, item.leg.start, item.load));
                }
            }
            let mut zone: Vec<_> = costmap.zone_loads[bucket as usize][0]
                .iter()
                .map(|load| (load.drone, load.load))
                .collect();
            zone.sort_unstable();
            in_zone.push(zone);
        }
        loads.sort_unstable();
        (loads, in_zone)
    }

    #[test]
    fn what_was_taken_back_leaves_no_trace() {
        let mut used = empty();
        for round in 0..4 {
            for drone in 0..DRONES {
                used.remove(DroneId(drone));
                used.insert(legs(drone, round));
            }
        }
        // Some are gone in the end, and everybody else was inserted in another order.
        let gone = |drone: u32| drone % 5 == 2;
        (0..DRONES)
            .filter(|d| gone(*d))
            .for_each(|d| used.remove(DroneId(d)));
        let mut fresh = empty();
        for drone in (0..DRONES).rev().filter(|drone| !gone(*drone)) {
            fresh.insert(legs(drone, 3));
        }
        assert_eq!(loads(&used), loads(&fresh));
        let (loads, zones) = loads(&used);
        assert!(loads.iter().filter(|load| load.3 > 0).count() > 50);
        assert!(zones.iter().flatten().count() > 5);
    }

    #[test]
    fn an_empty_sky_forbids_nothing_but_a_zone() {
        let costmap = empty();
        let mut verdict = Verdict::default();
        for leg in (0..DRONES).flat_map(|drone| legs(drone, 0)) {
            let mut near = Vec::new();
            costmap.near(&leg, &mut near);
            assert!(near.is_empty());
            costmap.judge(&leg, &near, &mut verdict);
            assert!(verdict.blockers.is_empty() && verdict.price_s == 0.0);
        }
    }
}
