//! The spacing of the lattice where the scenario names none: from how close drones stand, from the
//! gaps that they have to pass, and from their bodies.

use std::collections::BTreeSet;
use std::iter::successors;

use nalgebra::{Point3, Vector3};
use parry3d::bounding_volume::Aabb;

use crate::plan::cause::as_typed;
use crate::scenario::limits::lattice_places;
use crate::scenario::solid::Solids;
use crate::scenario::world::World;

/// Cells are not made smaller unasked (m): chosen here, what a drone can hold its place to.
const LEAST_M: f64 = 0.1;
/// A formation counts as packed where drones stand on more than this share of its places, spaced as
/// they are: chosen here, from there on they pass one another between the places only.
const PACKED_SHARE: f64 = 0.5;
/// Places of a lattice that is not asked for by name: chosen here, two seconds of preparation.
const MOST_PLACES: f64 = 400_000.0;
/// Room to spare from which a gap counts as meant for a body (m): chosen here.
const LEAST_LANE_M: f64 = 0.2;
/// No gap asks for smaller cells (m). Chosen here: of two drones in opposite directions in
/// a tunnel, a search on cells of 0.12 m takes more states than there are, and where such a gap is
/// the only connection a passage beyond the lattice leads through it.
const LEAST_FOR_GAPS_M: f64 = 0.25;
/// The share of drones that may stand closer than what counts as their spacing: chosen here, so
/// that one pair does not decide for a fleet.
const CLOSER_SHARE: usize = 10;

/// Formations of fewer drones keep the cells that are named: chosen here, three by three.
const LEAST_FORMATION: usize = 9;

/// Cells where nothing asks for smaller ones (m): chosen here, half a second's flight at 2 m/s.
pub(super) const LARGEST_M: f64 = 1.0;

/// The spacing (m), and why, as a sentence where it is less than [`LARGEST_M`].
pub(super) fn chosen(world: &World) -> (f64, Option<String>) {
    let starts = world.drones.iter().map(|drone| drone.start_m);
    let goals = world.drones.iter().filter_map(|drone| drone.tasks.last());
    let asked = [
        formation(&starts.collect::<Vec<_>>(), "starts"),
        formation(&goals.map(|task| task.to_m).collect::<Vec<_>>(), "goals"),
        gaps(world),
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
        let asked_m = as_typed(asked_m);
        why += &format!(", but the place is too large for cells of {asked_m} m");
    }
    let sentence = format!("cells of {cell_m} m: {why}; planning: (cell_m: ..) sets others");
    (cell_m, Some(sentence))
}

/// The same world with the spacing that it would have been read with, where that is left open.
pub(crate) fn chosen_anew(mut world: World) -> World {
    if world.planning.relaxable.spacing {
        world.planning.cell_m = chosen(&world).0;
    }
    world
}

/// Starts or goals that fill their place.
struct Packed {
    /// From each to the nearest other (m).
    spacing_m: f64,
    what: &'static str,
}

impl Packed {
    /// Those of a world.
    fn all(world: &World) -> impl Iterator<Item = Packed> {
        let starts = world.drones.iter().map(|drone| drone.start_m);
        let goals = world.drones.iter().filter_map(|drone| drone.tasks.last());
        let all = [
            (starts.collect::<Vec<_>>(), "starts"),
            (goals.map(|task| task.to_m).collect(), "goals"),
        ];
        all.into_iter().filter_map(|(places_m, what)| {
            let (spacing_m, is_packed) = spacing(&places_m)?;
            let is_packed = is_packed && places_m.len() >= LEAST_FORMATION;
            is_packed.then_some(Packed { spacing_m, what })
        })
    }

    /// From the middle between two neighbours to each of them (m): how near a drone passes them.
    fn passed_at_m(&self) -> f64 {
        0.5 * self.spacing_m
    }

    fn is_on_cells_of(&self, cell_m: f64) -> bool {
        // A part in a million: halves of typed lengths are not exact.
        (self.spacing_m / cell_m - 1.0).abs() < 1e-6
    }
}

/// Diameter of the largest body (m).
fn largest_body_m(world: &World) -> f64 {
    let radii_m = world.drones.iter().map(|it| it.vehicle.body_radius_m);
    2.0 * radii_m.fold(0.0, f64::max)
}

/// Cells in place of those that the scenario names (m), and why: half of them, where a packed
/// formation is spaced as they are and drones fit between two that stand. On cells as wide as the
/// formation there is no room to move but where a drone has left, and flights take twice as long.
pub(super) fn between_neighbours(world: &World) -> Option<(f64, String)> {
    let planning = &world.planning;
    let apart_m = largest_body_m(world) + planning.gap_to_bodies_m(2);
    let asked = Packed::all(world).filter(|it| it.passed_at_m() >= apart_m);
    let asked = asked.min_by(|a, b| a.spacing_m.total_cmp(&b.spacing_m))?;
    let size_m = world.bounds_m.max - world.bounds_m.min;
    let (cell_m, named_m) = (asked.passed_at_m(), planning.cell_m);
    let is_asked = asked.is_on_cells_of(named_m) && lattice_places(size_m, cell_m) <= MOST_PLACES;
    is_asked.then(|| {
        let why = format!(
            "{} are {:.2} m apart {BETWEEN}",
            asked.what, asked.spacing_m
        );
        (
            cell_m,
            format!("cells of {cell_m:.3} m in place of {named_m} m: {why}"),
        )
    })
}

/// The same world with a tracking margin that lets drones pass between two that stand in its packed
/// formations, and what is said of it where that is planned; `None` where its own margin does, or
/// none would.
pub(crate) fn with_room_to_pass(world: &World) -> Option<(World, String)> {
    let own_m = world.planning.margins.tracking_m;
    let packed = Packed::all(world);
    let formation = packed.min_by(|a, b| a.spacing_m.total_cmp(&b.spacing_m))?;
    let room_m = formation.passed_at_m() - largest_body_m(world);
    // Whole centimetres, so that it can be typed.
    let tracking_m = (50.0 * room_m + 1e-6).floor() / 100.0;
    if tracking_m < 0.0 || tracking_m >= own_m || room_m < world.planning.clearance_m {
        return None;
    }
    let mut changed = world.clone();
    changed.planning.margins.tracking_m = tracking_m;
    if let Some((cell_m, _)) = between_neighbours(&changed) {
        changed.planning.cell_m = cell_m;
    }
    let said = format!(
        "tracking_m of {own_m:.2} m keeps drones from passing between {} that are {:.2} m apart; \
         with planning: (tracking_m: {tracking_m}) all are planned",
        formation.what, formation.spacing_m
    );
    Some((changed, said))
}

/// Why cells are half as wide as a packed formation.
const BETWEEN: &str = "side by side, and drones pass between them";

/// The cells that places (m) ask for by how close they are, and why; `None` for fewer than two.
fn formation(places_m: &[Point3<f64>], what: &str) -> Option<(f64, String)> {
    let (spacing_m, is_packed) = spacing(places_m)?;
    let apart = format!("{what} are {spacing_m:.2} m apart");
    Some(match is_packed {
        true => (0.5 * spacing_m, format!("{apart} {BETWEEN}")),
        false => (spacing_m, apart),
    })
}

/// How far apart places are (m), and whether they are packed; `None` for fewer than two.
fn spacing(places_m: &[Point3<f64>]) -> Option<(f64, bool)> {
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
    Some((spacing_m, is_packed))
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
            (other_m.x - here_m.x).abs() < best_m
        };
        let ahead = by_x[index + 1..].iter();
        let _ = ahead.take_while(|other_m| look(other_m)).count();
        let behind = by_x[..index].iter().rev();
        let _ = behind.take_while(|other_m| look(other_m)).count();
        best_m
    };
    (0..by_x.len()).map(of).collect()
}

/// The cells that gaps ask for, each for the largest body that it is meant for, and why: with them
/// a lane of the lattice leads through.
fn gaps(world: &World) -> Option<(f64, String)> {
    let clearance_m = world.planning.clearance_m;
    let mut needs_m: Vec<f64> = (world.drones.iter())
        .map(|drone| 2.0 * (drone.vehicle.body_radius_m + clearance_m))
        .collect();
    needs_m.sort_unstable_by(f64::total_cmp);
    let smallest_m = *needs_m.first()?;
    let starts = world.drones.iter().map(|drone| drone.start_m);
    let tasks = world.drones.iter().flat_map(|drone| &drone.tasks);
    let places_m: Vec<Point3<f64>> = starts.chain(tasks.map(|task| task.to_m)).collect();
    let within = |a: &Aabb| {
        let (low, high) = (world.bounds_m.min, world.bounds_m.max);
        (0..3).all(|axis| a.maxs[axis] > low[axis] && a.mins[axis] < high[axis])
    };
    let mut boxes = Solids::of(world).boxes();
    boxes.retain(within);
    let mut found: Option<(f64, f64)> = None;
    for (index, a) in boxes.iter().enumerate() {
        for b in &boxes[index + 1..] {
            let Some((axis, low_m, high_m)) = gap_between(a, b, smallest_m) else {
                continue;
            };
            let gap_m = high_m - low_m;
            let fits = needs_m.partition_point(|needs_m| *needs_m + LEAST_LANE_M <= gap_m);
            let Some(body_m) = fits.checked_sub(1).map(|index| 0.5 * needs_m[index]) else {
                continue;
            };
            let lane = (low_m + body_m, high_m - body_m);
            // Halves, so that places on whole cells stay on them.
            let halves_m = successors(Some(LARGEST_M), |cell_m| Some(0.5 * cell_m));
            let mut asked_m = halves_m.take_while(|cell_m| *cell_m >= LEAST_FOR_GAPS_M);
            let Some(cell_m) = asked_m.find(|cell_m| is_met(lane, *cell_m, axis, &places_m)) else {
                continue;
            };
            if found.is_none_or(|(known_m, _)| cell_m < known_m) {
                found = Some((cell_m, gap_m));
            }
        }
    }
    let (cell_m, gap_m) = found?;
    Some((cell_m, format!("a gap to pass is {gap_m:.2} m wide")))
}

/// Whether a lattice of these cells (m) has places in a lane of an axis (m): wherever it begins, or
/// as it begins where more than half of the places that it has to meet say so.
fn is_met(lane: (f64, f64), cell_m: f64, axis: usize, places_m: &[Point3<f64>]) -> bool {
    if cell_m <= lane.1 - lane.0 {
        return true;
    }
    let phase_m = |place_m: &Point3<f64>| place_m[axis].rem_euclid(cell_m);
    let mut phases_m: Vec<f64> = places_m.iter().map(phase_m).collect();
    phases_m.sort_unstable_by(f64::total_cmp);
    // What more than half of them share is the one in the middle.
    let shared_m = phases_m[phases_m.len() / 2];
    let sharing = phases_m.iter().filter(|it| (*it - shared_m).abs() < 1e-6);
    let first = ((lane.0 - shared_m) / cell_m - 1e-6).ceil();
    2 * sharing.count() > phases_m.len() && first * cell_m + shared_m <= lane.1 + 1e-6
}

/// The axis of the gap between two boxes that face each other over more than `body_m` (m), and from
/// where to where it is (m): what is lower or shorter than a body is passed by.
pub(crate) fn gap_between(a: &Aabb, b: &Aabb, body_m: f64) -> Option<(usize, f64, f64)> {
    let gaps = Vector3::from(
        [0, 1, 2].map(|axis: usize| (b.mins[axis] - a.maxs[axis]).max(a.mins[axis] - b.maxs[axis])),
    );
    let axis = gaps.imax();
    let facing = (0..3).filter(|other| *other != axis && gaps[*other] < -body_m);
    let (low_m, high_m) = (
        a.maxs[axis].min(b.maxs[axis]),
        a.mins[axis].max(b.mins[axis]),
    );
    (gaps[axis] > 0.0 && facing.count() == 2).then_some((axis, low_m, high_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::read_world;

    fn world(place: &str, drones: &str) -> World {
        let text = format!(r#"Scenario(name: "w", {place}, drones: [{drones}])"#);
        read_world(&text).expect("in order")
    }

    fn crazyflies(spacing_m: f64, side: usize) -> String {
        let at = |index: usize| 1.0 + spacing_m * index as f64;
        let drones = (0..side * side).map(|k| {
            let (x, y) = (at(k % side), at(k / side));
            let (to_x, to_y) = (at(side - 1 - k % side), at(side - 1 - k / side));
            format!(
                r#"(name: "c{k}", airframe: "crazyflie-2.1", start_m: ({x:.3}, {y:.3}, 1), tasks: [(to_m: ({to_x:.3}, {to_y:.3}, 1))]),"#
            )
        });
        drones.collect()
    }

    #[test]
    fn a_packed_formation_gets_two_cells_between_neighbours() {
        let place = "bounds_m: (min: (0, 0, 0), max: (9, 9, 3)), planning: (clearance_m: 0)";
        for (spacing_m, cell_m) in [(0.5, 0.25), (0.6, 0.3), (1.0, 0.5), (2.0, 1.0)] {
            let side = (7.0_f64 / spacing_m).min(7.0) as usize;
            let world = world(place, &crazyflies(spacing_m, side));
            assert_eq!(world.planning.cell_m, cell_m, "{spacing_m} m apart");
            assert_eq!(world.notes.is_empty(), cell_m == 1.0, "{:?}", world.notes);
        }
    }

    #[test]
    fn cells_that_are_named_stay_as_they_are() {
        let place =
            "bounds_m: (min: (0, 0, 0), max: (9, 9, 3)), planning: (cell_m: 0.7, clearance_m: 0)";
        let world = world(place, &crazyflies(0.5, 7));
        assert_eq!((world.planning.cell_m, world.notes.len()), (0.7, 0));
    }

    #[test]
    fn a_gap_beside_the_places_that_drones_go_to_gets_a_lane() {
        let room = |from_m: f64, to_m: f64| {
            let place = format!(
                r#"bounds_m: (min: (0, 0, 0), max: (10, 6, 3)), obstacles: [
                    (name: "left", min_m: (5, 0, 0), max_m: (5.4, {from_m}, 3)),
                    (name: "right", min_m: (5, {to_m}, 0), max_m: (5.4, 6, 3))]"#
            );
            let drone = r#"(name: "k", airframe: "kolibri", start_m: (1, 1, 1), tasks: [(to_m: (9, 1, 1))])"#;
            world(&place, drone).planning.cell_m
        };
        // Kolibris need 0.39 m; their places lie on whole metres.
        assert_eq!(room(2.5, 3.5), 1.0);
        assert_eq!(room(2.1, 2.9), 0.5);
        assert_eq!(room(2.05, 2.65), 0.25);
        // Between the places of a quarter metre: that is for a passage beyond the lattice.
        assert_eq!(room(2.065, 2.685), 1.0);
        // Too narrow for any: nothing helps.
        assert_eq!(room(2.1, 2.3), 1.0);
    }

    /// So many Crazyflies by so many, half a metre apart, on cells of half a metre.
    fn formation(side: usize, margins: &str) -> String {
        let place = |k: usize| {
            let at = |k: usize| 2.0 + 0.5 * k as f64;
            format!("({}, {}, 1.25)", at(k % side), at(k / side))
        };
        let drone = |k: usize| {
            let to = (k * 7 + 3) % (side * side);
            let (from_m, to_m) = (place(k), place(to));
            format!(
                r#"(name: "d{k}", airframe: "crazyflie-2.1", start_m: {from_m}, tasks: [(to_m: {to_m})])"#
            )
        };
        let drones: Vec<String> = (0..side * side).map(drone).collect();
        format!(
            r#"(name: "formation", bounds_m: (min: (0, 0, 0), max: (8, 8, 3)), drones: [{}], planning: (cell_m: 0.5{margins}))"#,
            drones.join(", ")
        )
    }

    const NO_MARGINS: &str = ", time_margin_s: 0, tracking_m: 0";

    #[test]
    fn cells_as_wide_as_a_packed_formation_are_halved_where_drones_fit_between_its_places() {
        let world = read_world(&formation(5, NO_MARGINS)).expect("in order");
        assert_eq!(world.planning.cell_m, 0.25);
        assert!(
            world
                .notes
                .iter()
                .any(|note| note.contains("in place of 0.5 m"))
        );
        // With the margins there is no room between two that stand.
        let margins = ", time_margin_s: 0, tracking_m: 0.1";
        let wide = read_world(&formation(5, margins)).expect("in order");
        assert_eq!(wide.planning.cell_m, 0.5);
        let few = read_world(&formation(2, NO_MARGINS)).expect("in order");
        assert_eq!(few.planning.cell_m, 0.5);
    }

    #[test]
    fn the_widest_margin_with_which_drones_pass_between_two_that_stand_is_named() {
        let margins = ", time_margin_s: 0, tracking_m: 0.1";
        let world = read_world(&formation(5, margins)).expect("in order");
        let (changed, said) = with_room_to_pass(&world).expect("too wide a margin");
        assert_eq!(changed.planning.margins.tracking_m, 0.05);
        assert_eq!(changed.planning.cell_m, 0.25);
        assert!(said.contains("planning: (tracking_m: 0.05)"), "{said}");
        // It does, and a centimetre more does not.
        assert!(with_room_to_pass(&changed).is_none());
        let mut wider = changed;
        wider.planning.margins.tracking_m = 0.06;
        assert!(with_room_to_pass(&wider).is_some());
    }

    #[test]
    fn a_packed_formation_changes_places_within_a_seventh_of_its_lower_bound() {
        let world = read_world(&formation(5, NO_MARGINS)).expect("in order");
        let world = world.relaxed().expect("it leaves rules open");
        let outcome = crate::plan_world(&world, &crate::Control::QUIET).expect("in order");
        let plan = &outcome.planned().expect("starts are apart").plan;
        assert!(plan.is_safe() && plan.unplanned.is_empty());
        let fleet = &plan.fleet;
        assert!(
            fleet.sum_of_arrivals_s <= 1.14 * fleet.sum_alone_s,
            "{fleet:?}"
        );
    }
}
