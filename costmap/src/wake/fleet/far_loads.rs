//! Bounds of what wakes bring to others by horizontal distance alone.

use super::Fleet;
use crate::leg::KindId;

/// Distances at which loads of far wakes are tabulated: chosen here (m).
pub(super) const FAR_STEP_M: f64 = 0.125;
/// Largest load, in millionths, for which its bound by distance will do. Chosen here: an Offboard 2
/// brings another less than that at a metre beside its axis.
const FAR_LOAD: u32 = 120_000;

/// Loads by horizontal distance alone, for drones that are not close.
#[derive(Clone, Debug, Default)]
pub(super) struct FarLoads {
    /// Emitter by emitter, receiver by receiver: loads at multiples of the step, up to the reach.
    pub(super) loads: Vec<Vec<u32>>,
    /// Emitter by emitter, the largest of these.
    pub(super) on_any: Vec<Vec<u32>>,
    /// Kind by kind, kind by kind.
    pub(super) exact_within_m: Vec<f64>,
    pub(super) pairwise_within_m: f64,
}

impl FarLoads {
    pub(super) fn new(fleet: &Fleet) -> FarLoads {
        let all = || (0..fleet.kinds.len() as u32).map(KindId);
        let pairs = || all().flat_map(|one| all().map(move |other| (one, other)));
        let loads: Vec<Vec<u32>> = pairs()
            .map(|(emitter, receiver)| loads_by_distance(fleet, emitter, receiver))
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
        let exact_within_m: Vec<f64> = pairs()
            .map(|(one, other)| {
                let strong = |loads: &[u32]| loads.partition_point(|&load| load > FAR_LOAD);
                let steps = strong(of(one, other)).max(strong(of(other, one)));
                let bodies_m = fleet.kind(one).body_radius_m + fleet.kind(other).body_radius_m;
                let column_m = |kind: KindId| fleet.wake(kind).column_radius_m();
                (steps as f64 * FAR_STEP_M)
                    .max(bodies_m + fleet.conditions.gaps_m[2])
                    .max(column_m(one))
                    .max(column_m(other))
            })
            .collect();
        FarLoads {
            // A millionth less, so that bins that only touch are not asked.
            pairwise_within_m: exact_within_m.iter().copied().fold(0.0, f64::max) - 1e-6,
            loads,
            on_any,
            exact_within_m,
        }
    }
}

/// Loads of the lowest limit at multiples of [`FAR_STEP_M`], as far as they count.
fn loads_by_distance(fleet: &Fleet, emitter: KindId, receiver: KindId) -> Vec<u32> {
    if !fleet.conditions.wakes {
        return Vec::new();
    }
    let envelope = fleet.envelope(emitter.index(), receiver.index());
    let ratio = fleet.velocity_ratio(emitter, receiver);
    let limit = fleet.air_limit_left(receiver, fleet.conditions.lowest_air_limit);
    let load = |step: usize| {
        let square = envelope.highest_square(step as f64 * FAR_STEP_M);
        fleet.load(square.sqrt() * ratio / limit)
    };
    (0..).map(load).take_while(|&load| load > 0).collect()
}

/// Loads fall with distance: the one at the step before bounds it.
pub(super) fn at_gap(loads: &[u32], gap_m: f64) -> u32 {
    loads
        .get((gap_m / FAR_STEP_M) as usize)
        .copied()
        .unwrap_or(0)
}
