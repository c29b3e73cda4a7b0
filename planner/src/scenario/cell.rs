//! The spacing of the lattice where the scenario names none: from how close drones stand, from the
//! gaps that they have to pass, and from their bodies.

use std::collections::BTreeSet;

use nalgebra::{Point3, Vector3};
use parry3d::bounding_volume::Aabb;

use crate::scenario::limits::lattice_places;
use crate::scenario::solid::Solids;
use crate::scenario::world::World;

/// Cells are not made smaller unasked (m): chosen here, what a drone can hold its place to.
const LEAST_M: f64 = 0.1;
/// Gaps wider than this ask for nothing (m): chosen here, cells of [`LARGEST_M`] have two lanes
/// through them.
const WIDE_M: f64 = 3.0;
/// A formation counts as packed where drones stand on more than this share of its places, spaced as
/// they are: chosen here, from there on they pass one another between the places only.
const PACKED_SHARE: f64 = 0.5;
/// Places of a lattice that is not asked for by name: chosen here, two seconds of preparation.
const MOST_PLACES: f64 = 400_000.0;
/// Room to spare from which a gap counts as meant for a body (m): chosen here.
const LEAST_LANE_M: f64 = 0.2;
/// The share of drones that may stand closer than what counts as their spacing: chosen here, so that
/// one pair does not decide for a fleet.
const CLOSER_SHARE: usize = 10;

/// Cells where nothing asks for smaller ones (m): chosen here, half a second's flight at 2 m/s.
pub(super) const LARGEST_M: f64 = 1.0;

/// The spacing (m), and why, as a sentence where it is less than [`LARGEST_M`].
pub(super) fn chosen(world: &World) -> (f64, Option<String>) {
    let starts = world.drones.iter().map(|drone| drone.start_m);
    let goals = world.drones.iter().filter_map(|drone| drone.tasks.last());
    let asked = [
        formation(&starts.collect::<Vec<_>>(), "starts"),
        formation(&goals.map(|task| task.to_m).collect::<Vec<_>>(), "goals"),
        narrowest_gap(world),
    ];
    let diameters_m = world.drones.iter().map(|it| 2.0 * it.vehicle.body_radius_m);
    let smallest_m = diameters_m.fold(f64::INFINITY, f64::min).min(LARGEST_M);
    let asked = asked.into_iter().flatten();
    let least = asked.min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((mut cell_m, mut why)) = least.filter(|(cell_m, _)| *cell_m < LARGEST_M) else {
        return (LARGEST_M, None);
    };
    let floor_m = LEAST_M.max(0.5 * smallest_m);
    if cell_m < floor_m {
        cell_m = floor_m;
        why += ", and half a body is enough";
    }
    // Whole centimetres, so that it can be typed.
    cell_m = ((cell_m * 100.0 + 1e-6).floor() / 100.0).max(0.01);
    let size_m = world.bounds_m.max - world.bounds_m.min;
    let asked_m = cell_m;
    while lattice_places(size_m, cell_m) > MOST_PLACES && cell_m < LARGEST_M {
        cell_m = ((cell_m * 102.0).ceil() / 100.0).min(LARGEST_M);
    }
    if cell_m > asked_m {
        why += &format!(", but the place is too large for cells of {asked_m} m");
    }
    let sentence = format!("cells of {cell_m} m: {why}; planning: (cell_m: ..) sets others");
    (cell_m, Some(sentence))
}

/// The cells that places (m) ask for by how close they are, and why; `None` for fewer than two.
fn formation(places_m: &[Point3<f64>], what: &str) -> Option<(f64, String)> {
    let mut nearest_m: Vec<f64> = nearest_m(places_m);
    nearest_m.retain(|apart_m| apart_m.is_finite() && *apart_m > 1e-6);
    nearest_m.sort_unstable_by(f64::total_cmp);
    let spacing_m = *nearest_m.get(nearest_m.len() / CLOSER_SHARE)?;
    let cells = |extent_m: f64| (extent_m / spacing_m).round() + 1.0;
    let low = places_m.iter().fold(places_m[0], |low, it| low.inf(it));
    let high = places_m.iter().fold(places_m[0], |high, it| high.sup(it));
    let room: f64 = (high - low)
        .iter()
        .map(|extent_m| cells(*extent_m))
        .product();
    let held: BTreeSet<[i64; 3]> = places_m
        .iter()
        .map(|place_m| {
            [0, 1, 2].map(|axis| ((place_m[axis] - low[axis]) / spacing_m).round() as i64)
        })
        .collect();
    let is_packed = held.len() as f64 > PACKED_SHARE * room && held.len() > 2;
    let apart = format!("{what} are {:.2} m apart", spacing_m);
    Some(match is_packed {
        true => (
            0.5 * spacing_m,
            apart + " side by side, and drones pass between them",
        ),
        false => (spacing_m, apart),
    })
}

/// Of each place, how far the nearest other is (m); infinite where there is none.
fn nearest_m(places_m: &[Point3<f64>]) -> Vec<f64> {
    let mut by_x: Vec<Point3<f64>> = places_m.to_vec();
    by_x.sort_unstable_by(|a, b| a.x.total_cmp(&b.x));
    let of = |index: usize| {
        let here_m = by_x[index];
        let mut best_m = f64::INFINITY;
        let mut look = |other_m: &Point3<f64>| {
            best_m = best_m.min((other_m - here_m).norm());
            // What is farther along x alone is farther.
            (other_m.x - here_m.x).abs() <= best_m
        };
        let ahead = by_x[index + 1..].iter();
        let _ = ahead.take_while(|other_m| look(other_m)).count();
        let behind = by_x[..index].iter().rev();
        let _ = behind.take_while(|other_m| look(other_m)).count();
        best_m
    };
    (0..by_x.len()).map(of).collect()
}

/// The cells that the narrowest gap asks for that some body fits through, and why: one lane at least
/// leads through wherever it lies.
fn narrowest_gap(world: &World) -> Option<(f64, String)> {
    let clearance_m = world.planning.clearance_m;
    let mut needs_m: Vec<f64> = (world.drones.iter())
        .map(|drone| 2.0 * (drone.vehicle.body_radius_m + clearance_m))
        .collect();
    needs_m.sort_unstable_by(f64::total_cmp);
    needs_m.first()?;
    let boxes = Solids::of(world).boxes();
    let (low, high) = (world.bounds_m.min, world.bounds_m.max);
    let mut found: Option<(f64, f64)> = None;
    let mut gap = |gap_m: f64| {
        // The largest body that fits with a lane to spare has to find it.
        let fits = needs_m.partition_point(|needs_m| *needs_m + LEAST_LANE_M <= gap_m);
        let Some(largest_m) = fits.checked_sub(1).map(|index| needs_m[index]) else {
            return;
        };
        let lane_m = gap_m - largest_m;
        if gap_m < WIDE_M && found.is_none_or(|(known_m, _)| lane_m < known_m) {
            found = Some((lane_m, gap_m));
        }
    };
    let within = |a: &Aabb| {
        let inside = |axis: usize| a.maxs[axis] > low[axis] && a.mins[axis] < high[axis];
        (0..3).all(inside)
    };
    let boxes: Vec<Aabb> = boxes.into_iter().filter(within).collect();
    for (index, a) in boxes.iter().enumerate() {
        for b in &boxes[index + 1..] {
            if let Some(gap_m) = gap_between_m(a, b, needs_m[0]) {
                gap(gap_m);
            }
        }
    }
    let (lane_m, gap_m) = found?;
    // Halves, so that places on whole cells stay on them.
    let mut cell_m = LARGEST_M;
    while cell_m > lane_m && cell_m > LEAST_LANE_M {
        cell_m *= 0.5;
    }
    Some((
        cell_m,
        format!("the narrowest gap that a body fits through is {gap_m:.2} m wide"),
    ))
}

/// The gap between two boxes that face each other over more than `body_m` (m): what is lower or
/// shorter than a body is passed by.
fn gap_between_m(a: &Aabb, b: &Aabb, body_m: f64) -> Option<f64> {
    let gaps = Vector3::from(
        [0, 1, 2].map(|axis: usize| (b.mins[axis] - a.maxs[axis]).max(a.mins[axis] - b.maxs[axis])),
    );
    let apart = (0..3).filter(|axis| gaps[*axis] > 0.0).count();
    let facing = (0..3).filter(|axis| gaps[*axis] < -body_m).count();
    (apart == 1 && facing == 2).then(|| gaps.max())
}
