//! Loads by horizontal distance alone, for drones that are not close.

use super::{Fleet, left};
use crate::leg::KindId;

/// Distances at which faint loads are tabulated: chosen here (m).
const FAINT_STEP_M: f64 = 0.125;
/// Largest load, in millionths, for which its bound by distance will do. Chosen here: an Offboard 2 brings
/// another less than that at a metre beside its axis.
const FAINT_LOAD: u32 = 120_000;

/// Loads by horizontal distance alone, for drones that are not close.
#[derive(Clone, Debug, Default)]
pub(super) struct Faint {
    /// Emitter by emitter, receiver by receiver: loads at multiples of the step, up to the reach.
    loads: Vec<Vec<u32>>,
    /// Emitter by emitter, the largest of these.
    on_any: Vec<Vec<u32>>,
    /// Kind by kind, kind by kind.
    tight_m: Vec<f64>,
    near_m: f64,
}

impl Faint {
    pub(super) fn new(fleet: &Fleet) -> Faint {
        let all = || (0..fleet.kinds.len() as u16).map(KindId);
        let pairs = || all().flat_map(|one| all().map(move |other| (one, other)));
        let loads: Vec<Vec<u32>> = pairs()
            .map(|(emitter, receiver)| fleet.loads_by_distance(emitter, receiver))
            .collect();
        let of = |one: KindId, other: KindId| &loads[fleet.pair(one, other)];
        let on_any = all()
            .map(|emitter| {
                let steps = all().map(|receiver| of(emitter, receiver).len());
                let steps = 0..steps.max().unwrap_or(0);
                let worst = |step: usize| {
                    let loads = all().map(|receiver| of(emitter, receiver).get(step));
                    loads.flatten().copied().max().unwrap_or(0)
                };
                steps.map(worst).collect()
            })
            .collect();
        let tight_m: Vec<f64> = pairs()
            .map(|(one, other)| {
                let strong = |loads: &[u32]| loads.partition_point(|&load| load > FAINT_LOAD);
                let steps = strong(of(one, other)).max(strong(of(other, one)));
                let bodies_m = fleet.kind(one).body_radius_m + fleet.kind(other).body_radius_m;
                let column_m = |kind: KindId| fleet.wake(kind).column_radius_m();
                (steps as f64 * FAINT_STEP_M)
                    .max(bodies_m + fleet.conditions.clearance_m)
                    .max(column_m(one))
                    .max(column_m(other))
            })
            .collect();
        Faint {
            // A millionth less, so that bins that only touch are not asked.
            near_m: tight_m.iter().copied().fold(0.0, f64::max) - 1e-6,
            loads,
            on_any,
            tight_m,
        }
    }
}

impl Fleet {
    /// From this horizontal distance on, two drones of these kinds load one another so little that a bound
    /// by distance will do (m).
    pub(crate) fn tight_m(&self, one: KindId, other: KindId) -> f64 {
        self.faint.tight_m[self.pair(one, other)]
    }

    /// The largest of these distances in the fleet (m): beyond it nobody forbids anybody anything alone.
    pub fn near_m(&self) -> f64 {
        self.faint.near_m
    }

    /// Beyond this horizontal distance the wake of this kind counts as still air to everybody (m).
    pub(crate) fn wake_reach_m(&self, kind: KindId) -> f64 {
        self.faint.on_any[usize::from(kind.0)].len() as f64 * FAINT_STEP_M
    }

    /// Bound on the load that a wake brings a drone at this horizontal distance or more, in millionths of the
    /// fleet's lowest limit.
    pub(crate) fn faint_load(&self, emitter: KindId, receiver: KindId, gap_m: f64) -> u32 {
        at_gap(&self.faint.loads[self.pair(emitter, receiver)], gap_m)
    }

    /// The same, whoever the receiver is.
    pub(crate) fn faint_load_on_any(&self, emitter: KindId, gap_m: f64) -> u32 {
        at_gap(&self.faint.on_any[usize::from(emitter.0)], gap_m)
    }

    fn pair(&self, one: KindId, other: KindId) -> usize {
        usize::from(one.0) * self.kinds.len() + usize::from(other.0)
    }

    /// Loads of the lowest limit at multiples of [`FAINT_STEP_M`], as far as they count.
    fn loads_by_distance(&self, emitter: KindId, receiver: KindId) -> Vec<u32> {
        if !self.conditions.wakes {
            return Vec::new();
        }
        let envelope = self.envelope(usize::from(emitter.0), usize::from(receiver.0));
        let measure_mps = self.measure_mps(receiver);
        let ratio = self.wake(emitter).induced_velocity_mps() / measure_mps;
        let draught = self.conditions.flown.draught_mps / measure_mps;
        let limit = left(self.conditions.lowest_air_limit, draught);
        let load = |step: usize| {
            let square = envelope.highest_square(step as f64 * FAINT_STEP_M);
            self.load(square.sqrt() * ratio / limit)
        };
        (0..).map(load).take_while(|&load| load > 0).collect()
    }
}

/// Loads fall with distance: the one at the step before bounds it.
fn at_gap(loads: &[u32], gap_m: f64) -> u32 {
    loads
        .get((gap_m / FAINT_STEP_M) as usize)
        .copied()
        .unwrap_or(0)
}
