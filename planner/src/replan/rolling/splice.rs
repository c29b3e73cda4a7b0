//! What has been flown and what will be, as one drone's part of a plan.

use costmap::leg::{Leg, Tick};

use super::track::Track;
use crate::graph::agent::Errand;
use crate::graph::distances::UNREACHABLE;
use crate::plan::{AtEnd, DronePlan};
use crate::scenario::world::{self, Drone};
use crate::solver::assemble::{break_points, rounded};
use crate::solver::prepare::Kinds;

/// Writes down where a drone is when, and whether it blows there.
pub(super) fn write_legs(entry: &mut DronePlan, legs: &[Leg], kinds: &Kinds) {
    entry.trajectory = break_points(legs, |leg| kinds.kinds[usize::from(leg.kind.0)].1);
    let flying = || legs.iter().filter(|leg| leg.flying);
    let finite = |tick: Tick| (tick != Tick::FOREVER).then(|| tick.seconds());
    // One span in the air: who lands and rises again counts as airborne in between.
    entry.airborne_s = match (flying().next(), flying().next_back()) {
        (Some(first), Some(last)) => (first.start.seconds(), finite(last.end)),
        _ => {
            let begins_s = entry.enters_s.unwrap_or(0.0);
            (begins_s, Some(begins_s))
        }
    };
}

/// Writes down how the errand goes that a drone has from `errand.departs` on.
pub(super) fn write_errand(entry: &mut DronePlan, track: &Track, errand: &Errand, arrives: Tick) {
    let alone = errand.alone_ticks;
    entry.arrives_s = arrives.seconds();
    entry.alone_s = if alone == UNREACHABLE {
        0.0
    } else {
        errand.departs.after(alone).seconds()
    };
    let ahead = |leg: &&Leg| leg.start >= errand.departs && leg.start < arrives;
    let still = track.legs.iter().filter(ahead).filter(|leg| leg.stays());
    let still: u32 = still.map(|leg| leg.end.min(arrives).0 - leg.start.0).sum();
    let dwells: u32 = errand.stages.iter().map(|stage| stage.dwell_ticks).sum();
    let flown = track.legs.iter().filter(ahead);
    let flown_m: f64 = flown.map(|leg| (leg.to_m - leg.from_m).norm()).sum();
    entry.waits_s = Tick(still.saturating_sub(dwells)).seconds();
    entry.detour_m = rounded((flown_m - errand.alone_m).max(0.0));
}

/// How a drone that has a way ends.
pub(super) fn at_end(drone: &Drone) -> AtEnd {
    match drone.at_end {
        world::AtEnd::Hover => AtEnd::Hover,
        world::AtEnd::Land => AtEnd::Land,
        world::AtEnd::Leave => AtEnd::Leave,
    }
}
