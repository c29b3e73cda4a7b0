//! Smooth motion along a path: when its velocity may change, and what is flown then.
//!
//! What is flown is the path averaged over two windows of time, T₁ and T₂ (`plan::smoothing`). Its
//! acceleration is the change of the path's velocity within T₁, over T₁, averaged over T₂: at most
//! a wherever the velocities of any T₁ of the path differ by at most a T₁, which is the highest
//! speed or more; jerk is at most 2a/T₂ = j then.

use costmap::leg::{KindId, Leg, Tick};
use nalgebra::{Point3, Vector3};

use crate::graph::lattice::{Lattice, NEIGHBOURS};
use crate::plan::smoothing::Kernel;
use crate::scenario::solid::Solids;
use crate::scenario::world::Vehicle;

/// How far a chord may be from what is flown (m): chosen here, a fifth of the tracking margin.
const CHORD_M: f64 = 0.02;
/// Chords in which a corner is looked at beside solids: chosen here, a tenth of a millimetre at 4
/// m/s².
const CORNER_CHORDS: u32 = 64;
/// Velocities that differ by no more are one (m/s): rounding.
const SAME_MPS: f64 = 1e-6;
/// A velocity may change by a part in 10⁹ more than it may: rounding.
const ROUNDING: f64 = 1.0 + 1e-9;

/// Which step of the lattice led to a place: one of [`NEIGHBOURS`], or one of these two.
pub(crate) type Heading = u8;
/// It stands, and has for T₁.
pub(crate) const AT_REST: Heading = 26;
/// From or to a place beyond the lattice.
pub(crate) const BEYOND: Heading = 27;

/// How one drone's path is smoothed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Smoothing {
    /// What its path is averaged over.
    pub(crate) kernel: Kernel,
    /// Highest acceleration (m/s²).
    most_mps2: f64,
    /// How far from a corner of the path it passes at most (m).
    pub(crate) corner_deviation_m: f64,
    /// By heading on the lattice, the headings that may follow at once, as bits.
    follows: [u32; 26],
}

/// How much farther a vehicle goes straight up or down than it has to beside its pad, so that what
/// is flown does (m), at a speed (m/s).
pub(crate) fn lift_beyond_m(vehicle: &Vehicle, lift_mps: f64) -> f64 {
    // A tick more, as times are whole ones.
    (kernel(vehicle).half_s() + 1.0 / Tick::PER_SECOND) * lift_mps
}

/// How far from a corner of its path a vehicle passes at most (m).
pub(crate) fn corner_deviation_m(vehicle: &Vehicle) -> f64 {
    let kernel = kernel(vehicle);
    kernel.deviation_m(vehicle.max_acceleration_mps2 * kernel.first_s())
}

fn kernel(vehicle: &Vehicle) -> Kernel {
    Kernel::new(
        vehicle.max_speed_mps,
        vehicle.max_acceleration_mps2,
        vehicle.max_jerk_mps3,
    )
}

impl Smoothing {
    /// Of a vehicle whose steps to each of [`NEIGHBOURS`] take so many ticks.
    pub(crate) fn new(vehicle: &Vehicle, lattice: &Lattice, ticks: &[u32; 26]) -> Smoothing {
        let mut smoothing = Smoothing {
            kernel: kernel(vehicle),
            most_mps2: vehicle.max_acceleration_mps2,
            corner_deviation_m: corner_deviation_m(vehicle),
            follows: [0; 26],
        };
        let velocity = |n: usize| {
            let by = NEIGHBOURS[n].map(|cells| f64::from(cells) * lattice.cell_m());
            Vector3::from(by) / Tick(ticks[n]).seconds()
        };
        smoothing.follows = std::array::from_fn(|before| {
            let allowed =
                (0..26).filter(|&after| smoothing.follows(velocity(before), velocity(after)));
            allowed.fold(0, |bits, after| bits | 1 << after)
        });
        smoothing
    }

    /// Whether a velocity (m/s) may follow another within T₁.
    pub(crate) fn follows(&self, before_mps: Vector3<f64>, after_mps: Vector3<f64>) -> bool {
        (after_mps - before_mps).norm() <= self.most_mps2 * self.kernel.first_s() * ROUNDING
    }

    /// The same of headings on the lattice.
    pub(crate) fn may_follow(&self, before: Heading, after: Heading) -> bool {
        self.follows[usize::from(before)] >> after & 1 != 0
    }

    /// T₁ (ticks): standing so long forgets where a drone came from.
    pub(crate) fn turn_ticks(&self) -> u32 {
        Tick::lasting(self.kernel.first_s())
    }

    /// (T₁ + T₂)/2 (ticks): how long before and after a change of velocity another path is flown.
    pub(crate) fn lead_ticks(&self) -> u32 {
        Tick::lasting(self.kernel.half_s())
    }

    /// By how much what is flown is ahead of a change from rest, and behind one to rest, at that
    /// moment (ticks).
    pub(crate) fn ahead_ticks(&self) -> u32 {
        Tick::lasting(self.kernel.deviation_s(0.0))
    }

    /// How long steps of at most this length (m) last at least if any may follow any other (ticks).
    pub(crate) fn ticks_between_any(&self, longest_m: f64) -> u32 {
        let change_mps = self.most_mps2 * self.kernel.first_s();
        Tick::lasting(2.0 * longest_m / change_mps).max(self.turn_ticks())
    }

    /// Whether a ball (m) that comes to a corner at one velocity and leaves it at another (m/s) is
    /// clear of solids on what it flies.
    pub(crate) fn has_room(
        &self,
        solids: &Solids,
        (corner_m, radius_m): (Point3<f64>, f64),
        [before_mps, after_mps]: [Vector3<f64>; 2],
    ) -> bool {
        let half_s = self.kernel.half_s();
        // Inscribed chords: what is flown lies between them and the legs, which are clear.
        let at_m = |k: u32| {
            let t_s = half_s * (2.0 * f64::from(k) / f64::from(CORNER_CHORDS) - 1.0);
            let on_path_m = before_mps * t_s.min(0.0) + after_mps * t_s.max(0.0);
            corner_m + on_path_m + (after_mps - before_mps) * self.kernel.deviation_s(t_s)
        };
        let chord_s = 2.0 * half_s / f64::from(CORNER_CHORDS);
        let chord_m = chord_s * before_mps.norm().max(after_mps.norm());
        // Chords that are not looked at yet, from and to: where the place in their middle is so far
        // from solids that none of them reaches one, they are not looked at one by one.
        let mut open = vec![(0_u32, CORNER_CHORDS)];
        while let Some((from, to)) = open.pop() {
            let middle = from.midpoint(to);
            let at = at_m(middle);
            if to - from == 1 {
                if solids.segment_clearance_m(at, at_m(to), radius_m) < radius_m {
                    return false;
                }
                continue;
            }
            let clear_m = radius_m + f64::from(to - middle) * chord_m;
            let found_m = solids.segment_clearance_m(at, at, clear_m);
            if found_m < radius_m {
                return false;
            }
            if found_m < clear_m {
                open.extend([(from, middle), (middle, to)]);
            }
        }
        true
    }

    /// Chords in each change of velocity, between its first and its last moment.
    fn chords(&self) -> u32 {
        let longest_s = (8.0 * CHORD_M / self.most_mps2).sqrt();
        (self.kernel.rest_s() / longest_s).ceil().max(1.0) as u32
    }

    /// How far what is flown may be from the legs of [`Smoothing::flown`] (m).
    pub(crate) fn chord_m(&self) -> f64 {
        // Both ends of a chord are whole ticks.
        let ticks = f64::from(2 * self.lead_ticks()) / f64::from(self.chords()) + 1.0;
        0.125 * self.most_mps2 * (ticks / Tick::PER_SECOND).powi(2)
    }

    /// What is flown of a path, as chords: legs back to back, over the same time.
    pub(crate) fn flown(&self, legs: &[Leg]) -> Vec<Leg> {
        self.flown_in(self.chords(), legs)
    }

    /// The same in so many chords a change of velocity.
    pub(crate) fn flown_in(&self, chords: u32, legs: &[Leg]) -> Vec<Leg> {
        let changes: Vec<(Tick, Vector3<f64>)> = changes(legs).collect();
        if changes.is_empty() {
            return legs.to_vec();
        }
        let (Some(first), Some(last)) = (legs.first(), legs.last()) else {
            return Vec::new();
        };
        let end = match last.end {
            Tick::FOREVER => Tick(u32::MAX - 1),
            end => end,
        };
        let lead = self.lead_ticks();
        let inside = |tick: Tick| {
            let after = changes.partition_point(|(at, _)| at.after(lead) <= tick);
            changes
                .get(after)
                .is_some_and(|(at, _)| at.before(lead) < tick)
        };
        // It moves before it leaves the ground, and after it is there.
        let switches: Vec<(Tick, bool)> = (legs.windows(2))
            .filter(|pair| pair[0].flying != pair[1].flying)
            .map(|pair| match pair[1].flying {
                true => (pair[1].start.before(lead), true),
                false => (pair[1].start.after(lead), false),
            })
            .collect();
        // It is loaded and unloaded once it stands.
        let loads: Vec<(Tick, KindId)> = (legs.windows(2))
            .filter(|pair| pair[0].kind != pair[1].kind)
            .map(|pair| (pair[1].start.after(lead), pair[1].kind))
            .collect();
        let mut ticks: Vec<Tick> = vec![first.start];
        let starts = legs.iter().skip(1).map(|leg| leg.start);
        ticks.extend(starts.filter(|start| !inside(*start)));
        ticks.extend(switches.iter().map(|(at, _)| *at));
        ticks.extend(loads.iter().map(|(at, _)| *at));
        for (at, _) in &changes {
            let from = at.before(lead);
            let whole = at.after(lead).0 - from.0;
            ticks.extend((0..=chords).map(|k| from.after(whole * k / chords)));
        }
        ticks.retain(|tick| first.start <= *tick && *tick < end);
        ticks.sort_unstable();
        ticks.dedup();
        let mut places = Places {
            smoothing: self,
            legs,
            changes: &changes,
            leg: 0,
            change: 0,
        };
        let mut flown: Vec<Leg> = Vec::with_capacity(ticks.len());
        let mut from_m = places.at_m(ticks[0]);
        for (index, &start) in ticks.iter().enumerate() {
            let whole = *places.leg_at(start);
            let next = ticks.get(index + 1).copied();
            let leg_end = next.unwrap_or(last.end);
            let to_m = match next {
                Some(next) => places.at_m(next),
                None if last.end == Tick::FOREVER => from_m,
                None => places.at_m(last.end),
            };
            let switched = switches.iter().rfind(|(at, _)| *at <= start);
            let loaded = loads.iter().rfind(|(at, _)| *at <= start);
            flown.push(Leg {
                start,
                end: leg_end,
                from_m,
                to_m,
                flying: switched.map_or(first.flying, |(_, flying)| *flying),
                kind: loaded.map_or(first.kind, |(_, kind)| *kind),
                ..whole
            });
            from_m = to_m;
        }
        flown
    }
}

/// Where a drone is on a smoothed path, asked in order of time.
struct Places<'a> {
    smoothing: &'a Smoothing,
    legs: &'a [Leg],
    changes: &'a [(Tick, Vector3<f64>)],
    /// The leg under way.
    leg: usize,
    /// The first change that is not over.
    change: usize,
}

impl Places<'_> {
    /// The leg that lasts at a moment.
    fn leg_at(&mut self, at: Tick) -> &Leg {
        while self.leg + 1 < self.legs.len() && self.legs[self.leg].end <= at {
            self.leg += 1;
        }
        &self.legs[self.leg]
    }

    fn at_m(&mut self, at: Tick) -> Point3<f64> {
        let lead = self.smoothing.lead_ticks();
        let mut at_m = self.leg_at(at).position_m(at);
        while let Some((done, _)) = self.changes.get(self.change)
            && done.after(lead) <= at
        {
            self.change += 1;
        }
        for (moment, by_mps) in &self.changes[self.change..] {
            if moment.before(lead) > at {
                break;
            }
            at_m += by_mps * (self.smoothing.kernel).deviation_s(at.seconds() - moment.seconds());
        }
        at_m
    }
}

/// The moments at which a path's velocity changes, and by how much (m/s). It begins as it goes on.
fn changes(legs: &[Leg]) -> impl Iterator<Item = (Tick, Vector3<f64>)> + '_ {
    let pairs = legs.windows(2).map(|pair| {
        let by_mps = pair[1].velocity_mps() - pair[0].velocity_mps();
        (pair[1].start, by_mps)
    });
    pairs.filter(|(_, by_mps)| by_mps.norm() > SAME_MPS)
}

#[cfg(test)]
mod tests {
    use airflow::Airframe;
    use costmap::leg::{DroneId, KindId};

    use super::*;
    use crate::graph::lattice::Spacing;
    use crate::plan::TrajectoryEntry;

    fn smoothing(name: &str) -> Smoothing {
        let airframe = Airframe::preset(name).expect("a preset");
        let vehicle = Vehicle::new(airframe, 2.0, 1.2);
        let bounds = crate::plan::Bounds {
            min: Point3::origin(),
            max: Point3::new(9.0, 9.0, 9.0),
        };
        let lattice = Lattice::new(&bounds, &Spacing::of(1.0), &[]);
        let ticks = NEIGHBOURS.map(|by| match by.map(i32::abs).iter().sum::<i32>() {
            1 => 50,
            2 => 71,
            _ => 87,
        });
        Smoothing::new(&vehicle, &lattice, &ticks)
    }

    /// Places (m) and when a path is there (ticks).
    fn legs(points: &[(u32, [f64; 3])]) -> Vec<Leg> {
        let leg = |pair: &[(u32, [f64; 3])]| Leg {
            drone: DroneId(0),
            kind: KindId(0),
            start: Tick(pair[0].0),
            end: Tick(pair[1].0),
            from_m: pair[0].1.into(),
            to_m: pair[1].1.into(),
            flying: pair[0].0 >= 100,
            air_limit: 0.3,
        };
        points.windows(2).map(leg).collect()
    }

    /// From rest on the ground up, along a cell, a turn of 45 degrees, a stop and a long rest.
    const POINTS: [(u32, [f64; 3]); 7] = [
        (0, [1.0, 1.0, 0.2]),
        (100, [1.0, 1.0, 0.2]),
        (300, [1.0, 1.0, 1.2]),
        (400, [1.0, 1.0, 1.2]),
        (450, [2.0, 1.0, 1.2]),
        (521, [3.0, 2.0, 1.2]),
        (700, [3.0, 2.0, 1.2]),
    ];

    #[test]
    fn chords_are_as_near_to_what_is_flown_as_they_say() {
        for name in ["kolibri", "matrice-300"] {
            let smoothing = smoothing(name);
            let chords = smoothing.flown(&legs(&POINTS));
            let path = TrajectoryEntry {
                t_s: POINTS.iter().map(|it| Tick(it.0).seconds()).collect(),
                position_m: POINTS.iter().map(|it| it.1.into()).collect(),
                mass_kg: vec![1.0; POINTS.len()],
                ..TrajectoryEntry::default()
            };
            let flown = smoothing.kernel.smooth(&path).expect("it begins at rest");
            let mut farthest_m = 0.0_f64;
            for leg in &chords {
                for tick in leg.start.0..=leg.end.0 {
                    let there_m = flown.position_m(Tick(tick).seconds()).expect("points");
                    farthest_m = farthest_m.max((there_m - leg.position_m(Tick(tick))).norm());
                }
            }
            assert!(farthest_m <= smoothing.chord_m() + 1e-9, "{farthest_m}");
            assert!(smoothing.chord_m() < 1.3 * CHORD_M);
            let ends = [chords[0].start, chords[chords.len() - 1].end];
            assert_eq!(ends, [Tick(0), Tick(700)]);
            for pair in chords.windows(2) {
                assert_eq!((pair[0].end, pair[0].to_m), (pair[1].start, pair[1].from_m));
            }
            // Its wake is there as soon as it moves.
            let first = chords.iter().find(|leg| leg.flying).map(|leg| leg.start);
            assert_eq!(first, Some(Tick(100).before(smoothing.lead_ticks())));
        }
    }

    #[test]
    fn turns_by_more_than_sixty_degrees_need_a_stop() {
        let smoothing = smoothing("kolibri");
        let heading = |by| crate::graph::lattice::neighbour(by).expect("a neighbour");
        let along = heading([1, 0, 0]);
        for (by, follows) in [
            ([1, 0, 0], true),
            ([1, 1, 0], true),
            ([1, 1, 1], true),
            ([0, 1, 0], false),
            ([-1, 1, 0], false),
            ([-1, 0, 0], false),
        ] {
            assert_eq!(smoothing.may_follow(along, heading(by)), follows, "{by:?}");
        }
        assert!(smoothing.may_follow(heading([1, 1, 0]), heading([0, 1, 1])));
    }

    #[test]
    fn a_corner_that_is_cut_needs_room_on_its_inner_side() {
        let smoothing = smoothing("kolibri");
        let velocities_mps = [
            Vector3::new(2.0, 0.0, 0.0),
            Vector3::new(2.0, 2.0, 0.0) / 2.0_f64.sqrt(),
        ];
        let block = |low_m: [f64; 3], high_m: [f64; 3]| {
            Solids::new(&[crate::plan::Obstacle {
                name: "block".to_owned(),
                shape: crate::plan::Solid::Box {
                    min_m: low_m.into(),
                    max_m: high_m.into(),
                },
            }])
        };
        let corner_m = Point3::new(5.0, 5.0, 5.0);
        // As near to the corner from either side.
        let inner = block([4.0, 5.25, 4.0], [4.9, 7.0, 6.0]);
        let outer = block([4.0, 3.0, 4.0], [6.0, 4.75, 6.0]);
        let room = |solids: &Solids| smoothing.has_room(solids, (corner_m, 0.24), velocities_mps);
        assert!(!room(&inner));
        assert!(room(&outer));
    }
}
