//! What flies: airframes at their masses, and how each one's wake falls on each other.

use airflow::Flown;
use airflow::{Airframe, DiscPoints, Jet, Superposition, Wake};
use nalgebra::Vector3;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use crate::leg::{KindId, Leg, Tick};
use crate::verdict::price;
use crate::volumes::conflict_volume::{ConflictVolume, WakeSection};
use crate::volumes::downwash::{Section, column};
use crate::volumes::relative::{Relative, nearest_radius_m, nearest_square};
use crate::wake::advected::{ConvectiveDelayBound, advected};
use crate::wake::envelope::{Envelope, tables};
use far_loads::{FAR_STEP_M, FarLoads, at_gap};

/// An airframe at one mass.
#[derive(Clone, Debug)]
pub struct Kind {
    /// Index of the airframe in the fleet's list.
    pub airframe: usize,
    /// With payload (kg).
    pub mass_kg: f64,
    /// Radius of the ball that stays clear of others (m).
    pub body_radius_m: f64,
}

/// The air that all wakes meet in.
#[derive(Clone, Copy, Debug)]
pub struct Conditions {
    /// kg/m³.
    pub density_kg_per_m3: f64,
    /// Constants of the merged jet.
    pub jet: Jet,
    /// How wakes add up.
    pub superposition: Superposition,
    /// What is added to the hover jet.
    pub flown: Flown,
    /// Highest speed of the fleet: the fastest that any drone sinks (m/s).
    pub fastest_mps: f64,
    /// Gap between two bodies beyond their radii (m), of which none, one or both fly.
    pub gaps_m: [f64; 3],
    /// How much earlier or later than planned one drone may be, seen from another (ticks): both
    /// time margins together.
    pub shift: u32,
    /// How far off its legs any drone may be in any direction (m): legs are chords of what is
    /// flown. Bodies keep their distance in `gaps_m`.
    pub path_deviation_m: f64,
    /// Longest fall of a wake (m).
    pub deepest_m: f64,
    /// Lowest air limit of the fleet, over the induced velocity.
    pub lowest_air_limit: f64,
    /// Lowest air limit of any zone (m/s); infinite where there is none.
    pub lowest_zone_limit_mps: f64,
    /// Whether wakes count at all; `false` plans as if there were none.
    pub wakes: bool,
}

/// Share of the budget, in millionths, that planned wakes may fill. The rest, chosen here, is for
/// the wakes too weak to be counted one by one.
pub const BUDGET: u32 = 980_000;
/// A load of the whole limit, in millionths.
pub(crate) const WHOLE: f64 = 1_000_000.0;
/// Wakes below this share of a budget count as still air. Chosen here: a hundred of them fit into
/// the reserve.
const NEGLIGIBLE_SHARE: f64 = 2e-4;

/// The same for mean squares: where speeds add up, a tenth of a percent of the limit each, chosen
/// here.
fn negligible_share(superposition: Superposition) -> f64 {
    match superposition {
        Superposition::Linear => 1e-6,
        Superposition::Momentum | Superposition::Strongest => NEGLIGIBLE_SHARE,
    }
}

/// What recirculation leaves of a limit. Never nothing: a limit below it is refused before
/// planning.
pub(crate) fn limit_after_recirculation(limit: f64, recirculated: f64) -> f64 {
    if recirculated == 0.0 {
        return limit;
    }
    (limit - recirculated).max(1e-6)
}

/// A lower bound of the horizontal distance between two paths (m): exact where they are apart
/// along one axis alone.
fn level_gap_m(first: &Leg, second: &Leg) -> f64 {
    gap_along_m(first, second, 0).hypot(gap_along_m(first, second, 1))
}

/// How far two paths are apart along an axis (m).
fn gap_along_m(first: &Leg, second: &Leg, axis: usize) -> f64 {
    let ends = |leg: &Leg| (leg.from_m[axis], leg.to_m[axis]);
    let ((a, b), (c, d)) = (ends(first), ends(second));
    (a.min(b) - c.max(d)).max(c.min(d) - a.max(b)).max(0.0)
}

/// All kinds of a fleet, with tables of what each one's wake brings to each other.
#[derive(Clone, Debug)]
pub struct Fleet {
    pub(crate) kinds: Vec<Kind>,
    pub(crate) wakes: Vec<Wake>,
    /// Near-field columns, by kind.
    columns: Vec<Section>,
    /// What a receiver measures air by, by kind (m/s).
    reference_velocities_mps: Vec<f64>,
    /// Receiver by receiver, emitter by emitter: `[receiver airframe][emitter]`.
    envelopes: Vec<Arc<Envelope>>,
    /// Speed at a point, by emitter; empty where no zone limits the air.
    points: Vec<Envelope>,
    /// How many emitters there are, and which each kind is.
    emitters: usize,
    emitter_of: Vec<usize>,
    reach_m: Vec<f64>,
    far_loads: FarLoads,
    /// Per kind, how late its air may be.
    delay_bounds: Vec<ConvectiveDelayBound>,
    conditions: Conditions,
}

/// The wake of an airframe at a mass, in air of a density: the hover jet, with what a finding adds
/// to it.
pub fn wake_of(
    airframe: &Airframe,
    mass_kg: f64,
    density_kg_per_m3: f64,
    air: (&Jet, &Flown),
) -> Wake {
    let (jet, flown) = air;
    flown.wake(&Wake::new(airframe, mass_kg, density_kg_per_m3, jet))
}

/// What two legs do to each other while both last.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LegInteraction {
    /// The bodies come closer than they may.
    pub bodies: bool,
    /// One centre is in the other's near-field column.
    pub column: bool,
    /// Bound on the first's budget that the second's wake fills, in millionths.
    pub load_on_first: u32,
    /// The same of the second, from the first.
    pub load_on_second: u32,
    /// Mean air over the first's discs, over its induced velocity, averaged over the common time.
    pub alpha_first: f64,
    /// The same of the second, from the first.
    pub alpha_second: f64,
}

impl Fleet {
    /// Tabulates every airframe's wake over every other's discs.
    pub fn new(airframes: &[Airframe], kinds: Vec<Kind>, conditions: Conditions) -> Fleet {
        let density = conditions.density_kg_per_m3;
        let flown = &conditions.flown;
        let bare: Vec<Wake> = airframes
            .iter()
            .map(|a| Wake::new(a, a.mass_kg(), density, &conditions.jet))
            .collect();
        let hovering = kinds.iter();
        let hovering = hovering.map(|it| flown.wake(&bare[it.airframe].with_mass(it.mass_kg)));
        let hovering: Vec<Wake> = hovering.collect();
        let delay_bounds = ConvectiveDelayBound::of_each(&kinds, &hovering, &conditions);
        let wakes: Vec<Wake> = hovering
            .iter()
            // Outward: every wake as of a drone that sinks at full speed.
            .map(|wake| flown.climbing(wake, -conditions.fastest_mps))
            .collect();
        let reference_velocities_mps: Vec<f64> = wakes
            .iter()
            .map(|wake| wake.hover_velocity_mps() / flown.receiver_gain)
            .collect();
        // Payload scales the hover jet; how far wind moves a jet depends on how heavy its drone is.
        let shaped = wakes.iter().any(Wake::is_shaped);
        let (emitters, emitter_of): (Vec<Wake>, Vec<usize>) = if shaped {
            (wakes.clone(), (0..kinds.len()).collect())
        } else {
            (bare, kinds.iter().map(|kind| kind.airframe).collect())
        };
        let slowest = |airframe: usize| {
            let own = kinds.iter().zip(&reference_velocities_mps);
            own.filter(move |(kind, _)| kind.airframe == airframe)
                .map(|(_, reference_velocity_mps)| *reference_velocity_mps)
                .fold(f64::INFINITY, f64::min)
        };
        let fastest = |emitter: usize| {
            let own = emitter_of.iter().zip(&wakes);
            own.filter(move |(own, _)| **own == emitter)
                .map(|(_, wake)| wake.induced_velocity_mps())
                .fold(0.0, f64::max)
        };
        let discs: Vec<DiscPoints> = airframes.iter().map(Airframe::disc_points).collect();
        let pairs = if conditions.wakes {
            airframes.len() * emitters.len()
        } else {
            0
        };
        // What is alike but for its mass brings the same, in units of its induced velocity.
        let alike = |emitter: usize| match shaped {
            true => emitter,
            false => first_alike(airframes, emitter),
        };
        let tabulated = |pair: usize| {
            let (receiver, emitter) = (pair / emitters.len(), pair % emitters.len());
            let receiver = first_alike(airframes, receiver);
            receiver * emitters.len() + alike(emitter)
        };
        let negligible = |pair: usize| {
            let (receiver, emitter) = (pair / emitters.len(), pair % emitters.len());
            let limit = limit_after_recirculation(
                conditions.lowest_air_limit,
                flown.return_flow_mps / slowest(receiver),
            );
            let budget = limit * slowest(receiver) / fastest(emitter);
            negligible_share(conditions.superposition) * budget * budget
        };
        // Both may be off their legs.
        let apart_m = 2.0 * conditions.path_deviation_m;
        let made = emitters.par_iter().enumerate().flat_map(|(emitter, wake)| {
            let own = (0..pairs).skip(emitter).step_by(emitters.len());
            let own: Vec<usize> = own.filter(|pair| tabulated(*pair) == *pair).collect();
            let receivers = own.iter().map(|pair| {
                let all = (0..pairs).filter(|other| tabulated(*other) == *pair);
                let negligible = all.map(negligible).fold(f64::INFINITY, f64::min);
                (&discs[pair / emitters.len()], negligible)
            });
            let receivers: Vec<_> = receivers.collect();
            let made = tables::of_each(wake, &receivers, [conditions.deepest_m, apart_m]);
            own.into_par_iter().zip(made)
        });
        let made: BTreeMap<usize, Arc<Envelope>> = made.collect();
        let envelopes = (0..pairs).map(|pair| made[&tabulated(pair)].clone());
        let envelopes = envelopes.collect();
        let point = DiscPoints {
            offsets_m: vec![[0.0, 0.0]],
            weights: vec![1.0],
        };
        let limits_zones = conditions.lowest_zone_limit_mps.is_finite();
        let points = (emitters.par_iter().enumerate())
            .filter(|_| limits_zones)
            .map(|(emitter, wake)| {
                let limit_mps = limit_after_recirculation(
                    conditions.lowest_zone_limit_mps,
                    flown.return_flow_mps,
                );
                let limit = (limit_mps / fastest(emitter)).min(1.0);
                // With wall jets among them wakes count by their speed.
                let superposition = match flown.wall {
                    Some(_) => Superposition::Linear,
                    None => conditions.superposition,
                };
                let negligible = negligible_share(superposition) * limit * limit;
                Envelope::new(wake, &point, conditions.deepest_m, negligible).grown(apart_m)
            })
            .collect();
        let fleet = Fleet {
            columns: wakes
                .iter()
                .map(|wake| column(wake).grown(apart_m))
                .collect(),
            kinds,
            wakes,
            reference_velocities_mps,
            envelopes,
            points,
            emitters: emitters.len(),
            emitter_of,
            reach_m: Vec::new(),
            far_loads: FarLoads::default(),
            delay_bounds,
            conditions,
        };
        let kinds = 0..fleet.kinds.len() as u32;
        let farthest = kinds.map(|kind| fleet.farthest_m(KindId(kind)));
        let reach_m: Vec<f64> = farthest.collect();
        let fleet = Fleet { reach_m, ..fleet };
        let far_loads = FarLoads::new(&fleet);
        Fleet { far_loads, ..fleet }
    }

    /// Largest distance, over all others, at which bodies touch or a wake counts.
    fn farthest_m(&self, kind: KindId) -> f64 {
        let wake_m = |emitter, receiver| self.envelope(emitter, receiver).reach_m();
        let me = kind.index();
        let mut farthest_m = 0.0_f64;
        for other in 0..self.kinds.len() {
            let bodies_m = self.kinds[me].body_radius_m + self.kinds[other].body_radius_m;
            farthest_m = farthest_m.max(bodies_m + self.conditions.gaps_m[2]);
            if self.conditions.wakes {
                farthest_m = farthest_m.max(wake_m(me, other)).max(wake_m(other, me));
            }
        }
        farthest_m
    }

    /// Of one kind's wake over another's discs.
    pub(crate) fn envelope(&self, emitter: usize, receiver: usize) -> &Envelope {
        &self.envelopes[self.kinds[receiver].airframe * self.emitters + self.emitter_of[emitter]]
    }

    /// Whether every wake brings as much at every bearing.
    pub fn is_round(&self) -> bool {
        self.envelopes.iter().all(|envelope| envelope.is_round())
    }

    /// Speed at a point below this kind, for zones.
    pub(crate) fn points(&self, kind: KindId) -> &Envelope {
        &self.points[self.emitter_of[kind.index()]]
    }

    /// The kind of this index.
    pub fn kind(&self, kind: KindId) -> &Kind {
        &self.kinds[kind.index()]
    }

    /// The wake of this kind.
    pub fn wake(&self, kind: KindId) -> &Wake {
        &self.wakes[kind.index()]
    }

    /// How late the air of this kind may be.
    pub fn delay_bound(&self, kind: KindId) -> &ConvectiveDelayBound {
        &self.delay_bounds[kind.index()]
    }

    /// What a drone of this kind measures the air it meets by (m/s): the induced velocity of its
    /// rotors, unless it feels another part of it.
    pub(crate) fn reference_velocity_mps(&self, kind: KindId) -> f64 {
        self.reference_velocities_mps[kind.index()]
    }

    /// The air they meet in.
    pub fn conditions(&self) -> &Conditions {
        &self.conditions
    }

    /// Beyond this horizontal distance, a drone of this kind and any other have nothing to do with
    /// each other (m).
    pub fn reach_m(&self, kind: KindId) -> f64 {
        self.reach_m[kind.index()]
    }

    /// Takes out of the gaps between bodies that legs are chords of what is flown.
    pub(crate) fn keep_bodies_by_legs(&mut self) {
        let path_deviation_m = self.conditions.path_deviation_m;
        for gap_m in &mut self.conditions.gaps_m {
            *gap_m -= 2.0 * path_deviation_m;
        }
    }

    /// How far apart the centres of two drones stay on these legs (m).
    fn gap_m(&self, first: &Leg, second: &Leg) -> f64 {
        let radii_m = [first, second].map(|leg| self.kind(leg.kind).body_radius_m);
        let flying = usize::from(first.flying) + usize::from(second.flying);
        radii_m[0] + radii_m[1] + self.conditions.gaps_m[flying]
    }

    /// What two legs do to each other during the time they share, and while either of them, or the
    /// air of one, is earlier or later; `None` where that is nothing.
    ///
    /// `ends` are the heights at which their wakes end (m). Advected wakes have no mean here,
    /// see `Fleet::price_s`; quasi-static ones are priced as planned, and past a drone that stays
    /// where it is over the widened time.
    pub fn meet(&self, first: &Leg, second: &Leg, ends: [f64; 2]) -> Option<LegInteraction> {
        let shift = self.conditions.shift;
        if self.is_advected() {
            return self.meet_advected(first, second, ends);
        }
        if shift == 0 {
            return self.meet_as_planned(first, second, ends);
        }
        // Past what stays where it is, early and late are places on one line.
        if second.stays() {
            return self.meet_during(first, second, first.shared(second, shift), ends);
        }
        if first.stays() {
            return self.meet_during(first, second, second.shared(first, shift), ends);
        }
        self.meet_shifted(first, second, ends, shift)
    }

    /// [`Fleet::meet`] where wakes are advected.
    fn meet_advected(&self, first: &Leg, second: &Leg, ends: [f64; 2]) -> Option<LegInteraction> {
        let shift = self.conditions.shift;
        let reach_m = self.reach_m(first.kind).max(self.reach_m(second.kind));
        let apart_m = level_gap_m(first, second);
        if apart_m >= reach_m {
            return None;
        }
        let mut meeting = LegInteraction::default();
        let (one, other) = match first.drone < second.drone {
            true => (first, second),
            false => (second, first),
        };
        let gap_m = self.gap_m(first, second);
        // Seen from either the same to the last bit.
        meeting.bodies = match shift {
            _ if apart_m.hypot(gap_along_m(first, second, 2)) >= gap_m => false,
            0 => (at_same_time_m(one, other))
                .is_some_and(|[from_m, to_m]| nearest_square(&from_m, &to_m).sqrt() < gap_m),
            _ => self.shared(one, other, shift).is_some_and(|region| {
                region.nearest([0.0; 2]) < gap_m && region.delays_near(gap_m).is_some()
            }),
        };
        if first.flying && second.flying {
            (meeting.column, meeting.load_on_first) =
                self.advected_wake([second, first], ends[1], apart_m);
            let (column, load) = self.advected_wake([first, second], ends[0], apart_m);
            meeting.column |= column;
            meeting.load_on_second = load;
        }
        (meeting != LegInteraction::default()).then_some(meeting)
    }

    /// Whether a receiver may be in an emitter's column, and a bound on its budget that the wake
    /// fills (millionths), which ends at a height (m); the legs stay so far apart (m, level).
    fn advected_wake(
        &self,
        [emitter, receiver]: [&Leg; 2],
        end_z_m: f64,
        apart_m: f64,
    ) -> (bool, u32) {
        let highest_m = |leg: &Leg| leg.from_m.z.max(leg.to_m.z);
        let lowest_m = |leg: &Leg| leg.from_m.z.min(leg.to_m.z);
        let depths_m = [
            lowest_m(emitter) - highest_m(receiver),
            highest_m(emitter) - lowest_m(receiver),
        ];
        if highest_m(receiver) < end_z_m - 1e-6
            || depths_m[1] + 2.0 * self.conditions.path_deviation_m <= 0.0
        {
            return (false, 0);
        }
        let shift = self.conditions.shift;
        let delay = self.delay_between(emitter, receiver);
        if receiver.end.after(shift) <= emitter.start
            || emitter.end.after(delay + shift) <= receiver.start
        {
            return (false, 0);
        }
        // Most are beside one another wherever they are.
        let kinds = [emitter, receiver].map(|leg| leg.kind.index());
        let (envelope, column) = (self.envelope(kinds[0], kinds[1]), &self.columns[kinds[0]]);
        let may_enter = apart_m < column.from_radius_m.max(column.to_radius_m)
            && depths_m[0] <= column.to_depth_m + 1e-6
            && column.from_depth_m <= depths_m[1] + 1e-6;
        let beside_m = |[x, y]: [f64; 2]| (apart_m - x.hypot(y)).max(0.0);
        if !may_enter && envelope.highest_among(depths_m, beside_m) == 0.0 {
            return (false, 0);
        }
        if emitter.from_m.z != emitter.to_m.z
            || receiver.from_m.z != receiver.to_m.z
            || !(emitter.stays() || receiver.stays())
        {
            return self.advected_wake_in_region([emitter, receiver], delay, may_enter);
        }
        // Past what stays where it is, early and late are places on one line, at one depth.
        let path_m = |late: u32| {
            let (mover, time) = match emitter.stays() {
                true => (receiver, receiver.within(emitter, [shift, shift + late])),
                false => (emitter, emitter.within(receiver, [shift + late, shift])),
            };
            let offset_m = |at: Tick| match std::ptr::eq(mover, receiver) {
                true => receiver.position_m(at) - emitter.from_m,
                false => receiver.from_m - emitter.position_m(at),
            };
            (time.start < time.end).then(|| [offset_m(time.start), offset_m(time.end)])
        };
        // Columns go by places at the same time.
        let is_entered = |[from_m, to_m]: [Vector3<f64>; 2]| column.is_entered(&from_m, &to_m);
        let entered = may_enter && path_m(0).is_some_and(is_entered);
        let Some([from_m, to_m]) = path_m(delay) else {
            return (entered, 0);
        };
        let square = envelope.along(&from_m, &to_m).peak_square;
        (entered, self.load_above_0(emitter, receiver, square))
    }

    /// The same of legs of which both move, or one changes its height; the air is late by so much
    /// (ticks), at most.
    fn advected_wake_in_region(
        &self,
        [emitter, receiver]: [&Leg; 2],
        delay: u32,
        may_enter: bool,
    ) -> (bool, u32) {
        let shift = self.conditions.shift;
        let kinds = [emitter, receiver].map(|leg| leg.kind.index());
        let (envelope, column) = (self.envelope(kinds[0], kinds[1]), &self.columns[kinds[0]]);
        let Some(whole) = advected(emitter, receiver, delay, shift) else {
            return (false, 0);
        };
        // Columns go by places at the same time.
        let entered = may_enter
            && match shift {
                0 => at_same_time_m(receiver, emitter)
                    .is_some_and(|[from_m, to_m]| column.is_entered(&from_m, &to_m)),
                _ => (self.shared(receiver, emitter, shift))
                    .is_some_and(|it| it.delays_in(column).is_some()),
            };
        let [shallow_m, deep_m] = whole.depths();
        let below_m = whole.nearest([0.0; 2]);
        let nearest_m = |axis_m: [f64; 2]| match axis_m {
            [0.0, 0.0] => below_m,
            _ => whole.nearest(axis_m),
        };
        let mut square = envelope.highest_among([shallow_m, deep_m], nearest_m);
        let climbs = emitter.from_m.z != emitter.to_m.z || receiver.from_m.z != receiver.to_m.z;
        if square > 0.0 && climbs {
            // Depth and distance are bounded apart, and air is older the deeper: in slabs.
            let relative_deviation_m = 2.0 * self.conditions.path_deviation_m;
            let shallow_m = shallow_m.max(-relative_deviation_m);
            let slabs = ((deep_m - shallow_m) / CLIMB_STEP_M).ceil().max(1.0) as u32;
            let edge_m =
                |k: u32| shallow_m + (deep_m - shallow_m) * f64::from(k) / f64::from(slabs);
            square = 0.0;
            for k in 0..slabs {
                let edges_m = [edge_m(k), edge_m(k + 1)];
                if envelope.highest_among(edges_m, nearest_m) <= square {
                    continue;
                }
                let late =
                    self.delay_ticks(emitter.kind, edges_m[1] + relative_deviation_m) + shift;
                let slab = whole
                    .between_depths(edges_m)
                    .and_then(|slab| slab.delayed([-f64::from(shift), f64::from(late)]));
                if let Some(slab) = slab {
                    let highest =
                        envelope.highest_among(slab.depths(), |axis_m| slab.nearest(axis_m));
                    square = highest.max(square);
                }
            }
        }
        (entered, self.load_above_0(emitter, receiver, square))
    }

    /// [`Fleet::load_of`] of a wake that may bring nothing at all.
    fn load_above_0(&self, emitter: &Leg, receiver: &Leg, square: f64) -> u32 {
        match square > 0.0 {
            true => self.load_of(emitter, receiver, square),
            false => 0,
        }
    }

    /// Extra energy of two drones on legs that meet, in seconds of hovering: of air at the delay of
    /// the mean flow. `ends` are the heights at which their wakes end (m).
    pub(crate) fn price_s(&self, first: &Leg, second: &Leg, ends: [f64; 2]) -> f64 {
        let of = |emitter: &Leg, receiver: &Leg, end_z_m: f64| {
            let late = self.arriving(emitter, receiver);
            let time = receiver.overlap(&late);
            if time.is_empty() || time.end == Tick::FOREVER {
                return 0.0;
            }
            let moments = [time.start, time.end];
            let offsets_m = moments.map(|at| receiver.position_m(at) - late.position_m(at));
            if receiver
                .position_m(time.start)
                .z
                .max(receiver.position_m(time.end).z)
                < end_z_m - 1e-6
            {
                return 0.0;
            }
            let kinds = [emitter, receiver].map(|leg| leg.kind.index());
            let exposure = self
                .envelope(kinds[0], kinds[1])
                .along(&offsets_m[0], &offsets_m[1]);
            let ratio = self.velocity_ratio(emitter.kind, receiver.kind);
            (time.end.seconds() - time.start.seconds()) * price(exposure.mean * ratio)
        };
        of(second, first, ends[1]) + of(first, second, ends[0])
    }

    /// [`Fleet::meet`] of two drones that both are in time.
    pub fn meet_as_planned(
        &self,
        first: &Leg,
        second: &Leg,
        ends: [f64; 2],
    ) -> Option<LegInteraction> {
        self.meet_during(first, second, first.overlap(second), ends)
    }

    /// The same during a time in which both are under way, or stay where they are.
    fn meet_during(
        &self,
        first: &Leg,
        second: &Leg,
        time: Range<Tick>,
        ends: [f64; 2],
    ) -> Option<LegInteraction> {
        if time.is_empty() {
            return None;
        }
        let [own_from_m, own_to_m] = [time.start, time.end].map(|at| first.position_m(at));
        let [other_from_m, other_to_m] = [time.start, time.end].map(|at| second.position_m(at));
        let (from_m, to_m) = (own_from_m - other_from_m, own_to_m - other_to_m);
        let nearest_m = nearest_radius_m(&from_m, &to_m);
        let mut meeting = LegInteraction::default();
        let gap_m = self.gap_m(first, second);
        if nearest_m < gap_m {
            meeting.bodies = nearest_square(&from_m, &to_m).sqrt() < gap_m;
        }
        if self.conditions.wakes && first.flying && second.flying {
            // A wake that ends above a drone's rotor plane does not reach it.
            if own_from_m.z.max(own_to_m.z) >= ends[1] - 1e-6 {
                self.add_wake(second, first, &from_m, &to_m, &mut meeting, true);
            }
            if other_from_m.z.max(other_to_m.z) >= ends[0] - 1e-6 {
                self.add_wake(first, second, &-from_m, &-to_m, &mut meeting, false);
            }
        }
        (meeting != LegInteraction::default()).then_some(meeting)
    }

    /// [`Fleet::meet`] of two drones, one of them up to `shift` ticks earlier or later than
    /// planned, seen from the other: what they are to one another fills a parallelogram.
    fn meet_shifted(
        &self,
        first: &Leg,
        second: &Leg,
        ends: [f64; 2],
        shift: u32,
    ) -> Option<LegInteraction> {
        let gap_m = self.gap_m(first, second);
        let reach_m = self.reach_m(first.kind).max(self.reach_m(second.kind));
        let far_m = reach_m.max(gap_m);
        if level_gap_m(first, second) >= far_m {
            return None;
        }
        // Seen from either the same to the last bit.
        let region = match first.drone < second.drone {
            true => self.shared(first, second, shift)?,
            false => self.shared(second, first, shift)?,
        };
        let nearest_m = region.nearest([0.0; 2]);
        if nearest_m >= far_m {
            return None;
        }
        let planned = self.meet_as_planned(first, second, ends);
        let mut meeting = LegInteraction {
            bodies: planned.is_some_and(|it| it.bodies)
                || nearest_m < gap_m && region.delays_near(gap_m).is_some(),
            load_on_first: 0,
            load_on_second: 0,
            ..planned.unwrap_or_default()
        };
        if self.conditions.wakes && first.flying && second.flying {
            let [highest_m, lowest_m] = [f64::max, f64::min].map(|most: fn(f64, f64) -> f64| {
                [first, second].map(|leg| most(leg.from_m.z, leg.to_m.z))
            });
            let relative_deviation_m = 2.0 * self.conditions.path_deviation_m;
            if highest_m[0] >= ends[1] - 1e-6 && highest_m[1] + relative_deviation_m > lowest_m[0] {
                let (column, load) = self.shifted_wake(second, first, shift);
                meeting.column |= column;
                meeting.load_on_first = load;
            }
            if highest_m[1] >= ends[0] - 1e-6 && highest_m[0] + relative_deviation_m > lowest_m[1] {
                let (column, load) = self.shifted_wake(first, second, shift);
                meeting.column |= column;
                meeting.load_on_second = load;
            }
        }
        (meeting != LegInteraction::default()).then_some(meeting)
    }

    /// Whether the receiver may be in the emitter's column, and a bound on its budget that the wake
    /// fills (millionths), either of them up to `shift` ticks early or late, where wakes follow at
    /// once.
    fn shifted_wake(&self, emitter: &Leg, receiver: &Leg, shift: u32) -> (bool, u32) {
        let envelope = self.envelope(emitter.kind.index(), receiver.kind.index());
        let highest = |region: &Relative| {
            envelope.highest_among(region.depths(), |axis_m| region.nearest(axis_m))
        };
        let Some(whole) = self.exposed(receiver, emitter, shift) else {
            return (false, 0);
        };
        let column = &self.columns[emitter.kind.index()];
        let entered = whole.delays_in(column).is_some();
        let mut square = highest(&whole);
        // Where both change, in pieces.
        let climbs_m = [emitter, receiver].map(|leg| (leg.to_m.z - leg.from_m.z).abs());
        let pieces = ((climbs_m[0] + climbs_m[1]) / CLIMB_STEP_M).ceil() as u32;
        if square > 0.0 && pieces > 1 {
            let time = self.exposed_during(receiver, emitter);
            let moment = |piece: u32| {
                let ticks = u64::from(time.end.0.saturating_sub(time.start.0));
                let part = ticks * u64::from(piece) / u64::from(pieces);
                time.start.after(part as u32)
            };
            square = (0..pieces)
                .filter_map(|piece| {
                    let part = receiver.between(moment(piece), moment(piece + 1));
                    Some(highest(&self.exposed(&part, emitter, shift)?))
                })
                .fold(0.0, f64::max);
        }
        (entered, self.load_above_0(emitter, receiver, square))
    }

    /// Where a drone of the first kind must not be, seen from one of the second (m): where bodies
    /// touch, in a column, or where one wake alone fills more than a share of the other's budget at
    /// its air limit: one share quasi-static, another at any convective delay. Kinds with air
    /// limits.
    pub fn conflict_volume(
        &self,
        [first, second]: [(KindId, f64); 2],
        [share, advected_share]: [f64; 2],
    ) -> ConflictVolume {
        let body_m = self.kind(first.0).body_radius_m + self.kind(second.0).body_radius_m;
        let below = |emitter: KindId, receiver: (KindId, f64)| {
            if !self.conditions.wakes {
                return Vec::new();
            }
            let envelope = self.envelope(emitter.index(), receiver.0.index());
            let above = |share: f64, is_quasi_static: bool| {
                let sections = envelope.iso_exposure(self.square_of(emitter, receiver, share));
                sections.into_iter().map(move |section| WakeSection {
                    section,
                    is_quasi_static,
                    is_above: false,
                })
            };
            let late = self.is_advected().then(|| above(advected_share, false));
            let column = WakeSection {
                section: self.columns[emitter.index()],
                is_quasi_static: true,
                is_above: false,
            };
            above(share, true)
                .chain(late.into_iter().flatten())
                .chain([column])
                .collect()
        };
        ConflictVolume::new(
            body_m + self.conditions.gaps_m[2],
            &below(second.0, first),
            &below(first.0, second),
        )
    }

    /// The mean square of an emitter's air that fills a share of a receiver's budget:
    /// [`Fleet::load_of`] backwards.
    fn square_of(&self, emitter: KindId, (receiver, air_limit): (KindId, f64), share: f64) -> f64 {
        let ratio = self.velocity_ratio(emitter, receiver);
        let limit = self.air_limit_left(receiver, air_limit);
        let additive = (share * f64::from(BUDGET)).floor() / WHOLE;
        let of_limit = match self.conditions.superposition {
            Superposition::Linear => additive,
            Superposition::Momentum | Superposition::Strongest => additive.sqrt(),
        };
        (of_limit * limit / ratio).powi(2)
    }

    fn add_wake(
        &self,
        emitter: &Leg,
        receiver: &Leg,
        from_m: &Vector3<f64>,
        to_m: &Vector3<f64>,
        meeting: &mut LegInteraction,
        onto_first: bool,
    ) {
        let envelope = self.envelope(emitter.kind.index(), receiver.kind.index());
        meeting.column |= self.columns[emitter.kind.index()].is_entered(from_m, to_m);
        let exposure = envelope.along(from_m, to_m);
        if exposure.peak_square == 0.0 {
            return;
        }
        let load = self.load_of(emitter, receiver, exposure.peak_square);
        let alpha = exposure.mean * self.velocity_ratio(emitter.kind, receiver.kind);
        if onto_first {
            (meeting.load_on_first, meeting.alpha_first) = (load, alpha);
        } else {
            (meeting.load_on_second, meeting.alpha_second) = (load, alpha);
        }
    }

    /// Millionths of a receiver's budget that a mean square of an emitter's air fills.
    pub(crate) fn load_of(&self, emitter: &Leg, receiver: &Leg, peak_square: f64) -> u32 {
        let ratio = self.velocity_ratio(emitter.kind, receiver.kind);
        let limit = self.air_limit_left(receiver.kind, receiver.air_limit);
        self.load(peak_square.sqrt() * ratio / limit)
    }

    /// An emitter's induced velocity at hover over that in which a receiver's limit is stated.
    pub(super) fn velocity_ratio(&self, emitter: KindId, receiver: KindId) -> f64 {
        self.wake(emitter).induced_velocity_mps() / self.reference_velocity_mps(receiver)
    }

    /// What recirculation leaves of a receiver's limit of air.
    pub(super) fn air_limit_left(&self, receiver: KindId, air_limit: f64) -> f64 {
        let recirculated =
            self.conditions.flown.return_flow_mps / self.reference_velocity_mps(receiver);
        limit_after_recirculation(air_limit, recirculated)
    }

    /// From this horizontal distance on, two drones of these kinds load one another so little that
    /// a bound by distance will do (m).
    pub(crate) fn exact_within_m(&self, one: KindId, other: KindId) -> f64 {
        self.far_loads.exact_within_m[self.pair(one, other)]
    }

    /// The largest of these distances in the fleet (m): beyond it no drone alone forbids another
    /// anything.
    pub fn pairwise_within_m(&self) -> f64 {
        self.far_loads.pairwise_within_m
    }

    /// Beyond this horizontal distance the wake of this kind counts as still air to every kind (m).
    pub(crate) fn wake_reach_m(&self, kind: KindId) -> f64 {
        self.far_loads.on_any[kind.index()].len() as f64 * FAR_STEP_M
    }

    /// Bound on the load that a wake brings a drone at this horizontal distance or more, in
    /// millionths of the fleet's lowest limit.
    pub(crate) fn far_load(&self, emitter: KindId, receiver: KindId, gap_m: f64) -> u32 {
        at_gap(&self.far_loads.loads[self.pair(emitter, receiver)], gap_m)
    }

    /// The same, for any receiver.
    pub(crate) fn far_load_on_any(&self, emitter: KindId, gap_m: f64) -> u32 {
        at_gap(&self.far_loads.on_any[emitter.index()], gap_m)
    }

    fn pair(&self, one: KindId, other: KindId) -> usize {
        one.index() * self.kinds.len() + other.index()
    }

    /// Millionths of a budget that a speed of this share of a limit fills, so that loads add up.
    pub(crate) fn load(&self, share: f64) -> u32 {
        let additive = match self.conditions.superposition {
            Superposition::Linear => share,
            // The strongest of several is at most the root of their sum of squares.
            Superposition::Momentum | Superposition::Strongest => share * share,
        };
        (additive * WHOLE).ceil().min(f64::from(u32::MAX / 4)) as u32
    }
}

/// Where one drone is as seen from another at the beginning and at the end of the time that their
/// legs share (m); `None`: they share none.
fn at_same_time_m(one: &Leg, other: &Leg) -> Option<[Vector3<f64>; 2]> {
    let time = one.overlap(other);
    let offset_m = |at: Tick| one.position_m(at) - other.position_m(at);
    (!time.is_empty()).then(|| [offset_m(time.start), offset_m(time.end)])
}

/// Height of the pieces in which a climb past a wake is bounded (m): chosen here, three rows of a
/// small drone's table.
const CLIMB_STEP_M: f64 = 0.25;

/// The first airframe with the same rotors in the same places as one of them.
fn first_alike(airframes: &[Airframe], index: usize) -> usize {
    let shape = |airframe: &Airframe| {
        (
            airframe.propellers(),
            airframe.propeller_diameter_m(),
            airframe.motor_distance_m(),
            airframe.width_factor(),
        )
    };
    let same = |other: &Airframe| shape(other) == shape(&airframes[index]);
    airframes.iter().position(same).unwrap_or(index)
}

mod far_loads;
#[cfg(test)]
mod tests;
