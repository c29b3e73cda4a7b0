//! Zones: boxes in which the summed speed of all wakes is limited, and what reserved legs bring
//! into each.
//!
//! Wakes reach a zone from above, and along the floor as the wall jets that they become.

use nalgebra::{Point3, Vector3};

use crate::leg::{DroneId, Leg, Tick};
use crate::reservations::over_time::{OverTime, begins, buckets, spans};
use crate::verdict::{Blocker, Verdict, Why, block_largest, record_max_load};
use crate::wake::fleet::{BUDGET, Fleet, WHOLE, limit_after_recirculation};
use crate::wake::surfaces::BlockingSurfaces;

/// Rings in which the wall jet between the nearest and the farthest place of a zone is looked at;
/// chosen here.
const RINGS: u32 = 16;

/// A box in which the summed wake speed is limited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZoneBox {
    /// Lowest corner (m).
    pub min_m: Point3<f64>,
    /// Highest corner (m).
    pub max_m: Point3<f64>,
    /// m/s; infinite where the air is not limited.
    pub air_limit_mps: f64,
}

/// What one drone's wake brings into a zone, when the zone is clear of it, and when the leg begins
/// and ends that it is of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ZoneLoad {
    pub(crate) drone: DroneId,
    pub(crate) load: u32,
    pub(crate) clear: Tick,
    pub(crate) flown: [Tick; 2],
}

/// What flies, and the faces that stop its wake: what a load on a zone depends on beside the leg.
#[derive(Clone, Copy)]
pub(crate) struct Wakes<'a> {
    pub(crate) fleet: &'a Fleet,
    pub(crate) surfaces: &'a BlockingSurfaces,
}

/// All zones of a world, each with the loads of reserved legs on it, in millionths of its limit.
#[derive(Clone, Debug)]
pub(crate) struct Zones {
    boxes: Vec<ZoneBox>,
    /// By time and zone.
    pub(crate) loads: OverTime<Vec<Vec<ZoneLoad>>>,
    /// What the loads on one zone may add up to, in millionths of its limit.
    pub(crate) budget: u32,
}

impl Zones {
    pub(crate) fn new(boxes: Vec<ZoneBox>) -> Zones {
        Zones {
            loads: OverTime::new(vec![Vec::new(); boxes.len()]),
            budget: BUDGET,
            boxes,
        }
    }

    /// Whether the air of any of them is limited.
    pub(crate) fn limit_air(&self) -> bool {
        self.boxes.iter().any(|zone| zone.air_limit_mps.is_finite())
    }

    /// Counts a leg in every zone that its wake reaches, for as long as its air lasts.
    pub(crate) fn add(&mut self, leg: &Leg, wakes: Wakes) {
        if !self.limit_air() {
            return;
        }
        let shift = wakes.fleet.conditions().shift;
        let delay = wakes.delay(leg) + shift;
        let clear = leg.end.after(delay);
        for during in spans(leg, buckets(leg.start.before(shift), clear)) {
            let (start, end) = (begins(during.start), begins(during.end));
            let part = leg.between(start.before(delay), end.after(shift));
            if part.start >= part.end {
                continue;
            }
            for (index, zone) in self.boxes.iter().enumerate() {
                let load = wakes.load_on(&part, zone);
                if load == 0 {
                    continue;
                }
                for zones in self.loads.during_mut(during.clone()) {
                    zones[index].push(ZoneLoad {
                        drone: part.drone,
                        load,
                        clear,
                        flown: [leg.start, leg.end],
                    });
                }
            }
        }
    }

    /// Takes back what a drone's legs brought between two ticks.
    pub(crate) fn remove(&mut self, drone: DroneId, start: Tick, end: Tick) {
        for zones in self.loads.during_mut(buckets(start, end)) {
            for loads in zones {
                loads.retain(|load| load.drone != drone);
            }
        }
    }

    /// Whether a leg's own wake, and others' with it, are too strong for a zone.
    pub(crate) fn judge(&self, leg: &Leg, wakes: Wakes, verdict: &mut Verdict) {
        for (index, zone) in self.boxes.iter().enumerate() {
            let own = wakes.load_on(leg, zone);
            if own == 0 {
                continue;
            }
            if own > self.budget {
                verdict.breaks_zone = Some(index);
                return;
            }
            let shift = wakes.fleet.conditions().shift;
            let outlasts = wakes.delay(leg) + shift;
            let (since, until) = (leg.start.before(shift), leg.end.after(outlasts));
            for zones in self.loads.during(buckets(since, until)) {
                let mut loads: Vec<(u32, Blocker)> = Vec::new();
                for load in zones[index].iter().filter(|it| it.drone != leg.drone) {
                    let blocker = Blocker {
                        drone: load.drone,
                        why: Why::Zone,
                        began: load.flown[0].before(shift + outlasts),
                        clear: load.clear.after(shift),
                        flown: load.flown,
                    };
                    if blocker.began < leg.end && leg.start < blocker.clear {
                        record_max_load(&mut loads, load.load, blocker);
                    }
                }
                block_largest(&mut loads, own, self.budget, verdict);
            }
        }
    }
}

impl Wakes<'_> {
    /// How long the air of a leg outlasts it, down to the floor (ticks).
    fn delay(self, leg: &Leg) -> u32 {
        self.fleet.delay_down_to(leg, self.surfaces.floor_z_m())
    }

    /// Millionths of a zone's limit that a leg's wake fills, at most.
    ///
    /// Wall jets run in many directions, and add up to the sum of their speeds at most; with wakes
    /// from above that add by momentum the whole is at most the sum of `√(above² + along²)`.
    fn load_on(self, leg: &Leg, zone: &ZoneBox) -> u32 {
        if !self.fleet.conditions().wakes || !leg.flying || zone.air_limit_mps.is_infinite() {
            return 0;
        }
        let limit_mps = limit_after_recirculation(
            zone.air_limit_mps,
            self.fleet.conditions().flown.return_flow_mps,
        );
        let above_mps = self.wake_in_zone_mps(leg, zone);
        let along_mps = self.wall_jet_in_zone_mps(leg, zone);
        match along_mps {
            None => self.fleet.load(above_mps / limit_mps),
            Some(along_mps) => {
                let share = above_mps.hypot(along_mps) / limit_mps;
                (share * WHOLE).ceil().min(f64::from(u32::MAX / 4)) as u32
            }
        }
    }

    /// Bound on a leg's wake anywhere in a zone (m/s).
    fn wake_in_zone_mps(self, leg: &Leg, zone: &ZoneBox) -> f64 {
        let envelope = self.fleet.points(leg.kind);
        let offset_m = horizontal_gap_m(leg, zone);
        let highest_m = leg.from_m.z.max(leg.to_m.z);
        let lowest_m = leg.from_m.z.min(leg.to_m.z);
        if offset_m >= envelope.reach_m() || highest_m <= zone.min_m.z {
            return 0.0;
        }
        let wake = self.fleet.wake(leg.kind);
        if self.surfaces.wake_end_z_m(wake, &leg.from_m, &leg.to_m) >= zone.max_m.z {
            return 0.0;
        }
        let shallow = Vector3::new(offset_m, 0.0, (zone.max_m.z - lowest_m).min(0.0));
        let deep = Vector3::new(offset_m, 0.0, zone.min_m.z - highest_m);
        envelope.highest_beyond(&shallow, &deep).sqrt() * wake.induced_velocity_mps()
    }

    /// Bound on a leg's wall jet anywhere in a zone (m/s); `None` where wakes leave no wall jet. It
    /// spreads along the floor whatever stands there: outward.
    fn wall_jet_in_zone_mps(self, leg: &Leg, zone: &ZoneBox) -> Option<f64> {
        let wall = self.fleet.conditions().flown.wall?;
        let wake = self.fleet.wake(leg.kind);
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
                let floor_z_m = self.surfaces.floor_z_m();
                let here_mps = wall.highest_between_mps(wake, floor_z_m, &emitter_m, &places_m);
                *highest_mps = highest_mps.max(here_mps);
            }
        }
        // Either set of slices makes up the whole zone.
        Some(highest_mps[0].min(highest_mps[1]))
    }
}

/// A lower bound of the horizontal distance between a path and a box (m): exact where they are
/// apart along one axis alone.
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
