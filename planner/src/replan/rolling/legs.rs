//! From the trajectory of a plan back to legs.

use costmap::leg::{DroneId, KindId, Leg, Tick};
use nalgebra::Point3;

use crate::graph::lattice::Lattice;
use crate::plan::trajectory::SAME_PLACE_M;
use crate::plan::{AtEnd, DronePlan};

/// A time this close to a whole tick is one (ticks): what writing it in seconds rounds.
const SAME_TICK: f64 = 1e-6;

/// The legs of a drone, back to back; those of the way between two break points in one.
///
/// A break point between two ticks is passed by on the straight line between its places at both: by less than
/// it flies in a tick. `kind` is what flies at a mass (kg).
pub(crate) fn legs_of(
    drone: DroneId,
    plan: &DronePlan,
    stays: bool,
    mut kind: impl FnMut(f64) -> KindId,
) -> Vec<Leg> {
    let entry = &plan.trajectory;
    let (Some(first_s), Some(last_m)) = (entry.t_s.first(), entry.position_m.last()) else {
        return Vec::new();
    };
    let begins = plan.enters_s.map_or(0, |_| whole(*first_s).0);
    let until_s = plan.airborne_s.1.unwrap_or(f64::INFINITY);
    let times_s = entry.t_s.iter().copied();
    let switches_s = [plan.airborne_s.0, until_s]
        .into_iter()
        .filter(|t_s| t_s.is_finite());
    let mut ticks: Vec<u32> = times_s
        .chain(switches_s)
        .flat_map(|t_s| {
            let (below, above) = whole(t_s);
            [below, above]
        })
        .chain([begins])
        .filter(|tick| *tick >= begins)
        .collect();
    ticks.sort_unstable();
    ticks.dedup();
    let place_m = |tick: u32| {
        let known = entry
            .t_s
            .iter()
            .rposition(|t_s| whole(*t_s) == (tick, tick));
        known
            .map(|index| entry.position_m[index])
            .or_else(|| entry.position_m(Tick(tick).seconds()))
            .unwrap_or(*last_m)
    };
    // Heavier counts where a mass changes within a tick: it blows harder.
    let mut heaviest = |from_s: f64, to_s: f64| {
        let last = entry.t_s.partition_point(|t_s| *t_s < to_s).max(1);
        let first = entry.t_s.partition_point(|t_s| *t_s <= from_s).max(1);
        let masses_kg = &entry.mass_kg[first - 1..last];
        kind(masses_kg.iter().copied().fold(0.0, f64::max))
    };
    let mut leg = |start: Tick, end: Tick, from_m: Point3<f64>, to_m: Point3<f64>| {
        let (from_s, to_s) = (start.seconds() + 1e-9, end.seconds() - 1e-9);
        Leg {
            drone,
            kind: heaviest(from_s, to_s),
            start,
            end,
            from_m,
            to_m,
            flying: plan.airborne_s.0 < to_s && from_s < until_s,
            air_limit: plan.air_limit,
        }
    };
    let mut legs: Vec<Leg> = ticks
        .windows(2)
        .map(|pair| {
            leg(
                Tick(pair[0]),
                Tick(pair[1]),
                place_m(pair[0]),
                place_m(pair[1]),
            )
        })
        .collect();
    if stays || plan.at_end != AtEnd::Leave {
        let rests = Tick(ticks.last().copied().unwrap_or(0));
        legs.push(leg(rests, Tick::FOREVER, *last_m, *last_m));
    }
    legs
}

/// The whole ticks at or around a time.
fn whole(t_s: f64) -> (u32, u32) {
    let ticks = t_s * Tick::PER_SECOND;
    if (ticks - ticks.round()).abs() < SAME_TICK {
        (ticks.round() as u32, ticks.round() as u32)
    } else {
        (ticks.floor() as u32, ticks.ceil() as u32)
    }
}

/// Cuts a leg wherever it passes a place of the lattice, or one of these, at a whole tick.
pub(super) fn cut(leg: &Leg, lattice: &Lattice, stops_m: &[Point3<f64>]) -> Vec<Leg> {
    let mut parts = Vec::new();
    let mut rest = *leg;
    if !leg.stays() {
        for tick in leg.start.0 + 1..leg.end.0 {
            let here_m = leg.position_m(Tick(tick));
            let on_lattice = lattice
                .at(lattice.cell_of(&here_m))
                .map(|at| lattice.position_m(at));
            let known = on_lattice.iter().chain(stops_m);
            let Some(place_m) = known
                .copied()
                .find(|at_m| (at_m - here_m).norm() < SAME_PLACE_M)
            else {
                continue;
            };
            parts.push(Leg {
                end: Tick(tick),
                to_m: place_m,
                ..rest
            });
            rest = Leg {
                start: Tick(tick),
                from_m: place_m,
                ..rest
            };
        }
    }
    parts.push(rest);
    parts
}
