//! What blows into zones: wakes from above, and along the floor the wall jets that they become.

use nalgebra::Vector3;

use crate::costmap::Costmap;
use crate::cover::Covers;
use crate::fleet::{BUDGET, Fleet, WHOLE, ZoneBox, left};
use crate::leg::{DroneId, Leg, Tick};
use crate::verdict::{Blocker, Verdict, Why, block_largest};

/// Rings in which the wall jet between the nearest and the farthest place of a zone is looked at; chosen here.
const RINGS: u32 = 16;

/// What one drone blows into a zone, and when it is clear of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ZoneLoad {
    pub(crate) drone: DroneId,
    pub(crate) load: u32,
    pub(crate) clear: Tick,
}

impl Fleet {
    /// Millionths of a zone's limit that a leg's wake fills, at most.
    ///
    /// Wall jets run in many directions, and add up to the sum of their speeds at most; with wakes from above that add by momentum the whole
    /// is at most the sum of `√(above² + along²)`.
    pub fn load_on_zone(&self, leg: &Leg, covers: &Covers, zone: &ZoneBox) -> u32 {
        if !self.conditions().wakes || !leg.flying {
            return 0;
        }
        let limit_mps = left(zone.air_limit_mps, self.conditions().flown.draught_mps);
        let above_mps = self.wake_in_zone_mps(leg, covers, zone);
        let along_mps = self.wall_jet_in_zone_mps(leg, covers, zone);
        match along_mps {
            None => self.load(above_mps / limit_mps),
            Some(along_mps) => {
                let share = above_mps.hypot(along_mps) / limit_mps;
                (share * WHOLE).ceil().min(f64::from(u32::MAX / 4)) as u32
            }
        }
    }

    /// Bound on a leg's wake anywhere in a zone (m/s).
    fn wake_in_zone_mps(&self, leg: &Leg, covers: &Covers, zone: &ZoneBox) -> f64 {
        let envelope = self.points(leg.kind);
        let offset_m = horizontal_gap_m(leg, zone);
        let highest_m = leg.from_m.z.max(leg.to_m.z);
        let lowest_m = leg.from_m.z.min(leg.to_m.z);
        if offset_m >= envelope.reach_m() || highest_m <= zone.min_m.z {
            return 0.0;
        }
        let wake = self.wake(leg.kind);
        if covers.wake_end_z_m(wake, &leg.from_m, &leg.to_m) >= zone.max_m.z {
            return 0.0;
        }
        let shallow = Vector3::new(offset_m, 0.0, (zone.max_m.z - lowest_m).min(0.0));
        let deep = Vector3::new(offset_m, 0.0, zone.min_m.z - highest_m);
        envelope.highest_beyond(&shallow, &deep).sqrt() * wake.induced_velocity_mps()
    }

    /// Bound on a leg's wall jet anywhere in a zone (m/s); `None` where wakes leave no wall jet. It spreads along the floor whatever stands
    /// there: outward.
    fn wall_jet_in_zone_mps(&self, leg: &Leg, covers: &Covers, zone: &ZoneBox) -> Option<f64> {
        let wall = self.conditions().flown.wall?;
        let wake = self.wake(leg.kind);
        let emitter_m = (
            leg.from_m.coords.inf(&leg.to_m.coords),
            leg.from_m.coords.sup(&leg.to_m.coords),
        );
        let (low_m, high_m) = (zone.min_m.coords, zone.max_m.coords);
        let slice = |k: u32| f64::from(k) / f64::from(RINGS) * (high_m - low_m);
        // Slices along both sides: near ones are thinner and faster than far ones.
        let mut highest_mps = [0.0_f64; 2];
        for (axis, highest_mps) in highest_mps.iter_mut().enumerate() {
            for k in 0..RINGS {
                let (mut from_m, mut to_m) = (low_m, high_m);
                from_m[axis] = low_m[axis] + slice(k)[axis];
                to_m[axis] = low_m[axis] + slice(k + 1)[axis];
                let places_m = (from_m, to_m);
                let floor_z_m = covers.floor_z_m();
                let here_mps = wall.highest_between_mps(wake, floor_z_m, &emitter_m, &places_m);
                *highest_mps = highest_mps.max(here_mps);
            }
        }
        // Either way of slicing covers the whole zone.
        Some(highest_mps[0].min(highest_mps[1]))
    }
}

impl Costmap {
    /// Counts a leg in every zone that it blows into, for as long as its air lasts.
    pub(crate) fn blow_into_zones(&mut self, leg: &Leg) {
        if self.zones.is_empty() {
            return;
        }
        let lag = self.fleet().longest_lag();
        let clear = leg.end.after(lag);
        for bucket in self.timeline.buckets(leg.start, clear) {
            let (start, end) = self.timeline.span(bucket);
            let part = leg.between(Tick(start.0.saturating_sub(lag)), end);
            if part.start >= part.end {
                continue;
            }
            for (index, zone) in self.zones.iter().enumerate() {
                let load = self.fleet().load_on_zone(&part, &self.covers, zone);
                if load > 0 {
                    self.zone_loads[bucket as usize][index].push(ZoneLoad {
                        drone: part.drone,
                        load,
                        clear,
                    });
                }
            }
        }
    }

    /// Whether a leg's own wake, and others' with it, are too strong for a zone.
    pub(crate) fn judge_zones(&self, leg: &Leg, verdict: &mut Verdict) {
        for (index, zone) in self.zones.iter().enumerate() {
            let own = self.fleet().load_on_zone(leg, &self.covers, zone);
            if own == 0 {
                continue;
            }
            if own > BUDGET {
                verdict.breaks_zone = Some(index);
                return;
            }
            let until = leg.end.after(self.fleet().longest_lag());
            for bucket in self.timeline.buckets(leg.start, until) {
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

/// A lower bound of the horizontal distance between a way and a box: exact where either stands for one axis.
fn horizontal_gap_m(leg: &Leg, zone: &ZoneBox) -> f64 {
    let along = |axis: usize| {
        let (from_m, to_m) = (leg.from_m[axis], leg.to_m[axis]);
        let (low, high) = (from_m.min(to_m), from_m.max(to_m));
        (zone.min_m[axis] - high)
            .max(low - zone.max_m[axis])
            .max(0.0)
    };
    along(0).hypot(along(1))
}
