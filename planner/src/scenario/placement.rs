//! Whether every drone can be at its stated places: starts, tasks and landing places against the
//! bounds and the obstacles. Conflicts between drones are not judged here.
//!
//! World frame, metres, z up.

use nalgebra::{Point3, Vector3};

use crate::scenario::solid::{Solids, TOUCHING_M};
use crate::scenario::world::{AtEnd, AtStart, Bounds, Drone, World};

/// How far a body that rests on something may sink into it (m). Chosen here: coordinates are typed
/// in centimetres, and half of one is how they get rounded. Plan checks allow the same.
pub(crate) const REST_TOLERANCE_M: f64 = 0.005;

/// Largest gap below the resting place of a drone that starts landed (m), chosen here: pads and
/// racks are measured to a few centimetres.
pub(crate) const SUPPORT_TOLERANCE_M: f64 = 0.05;

/// A drone at a place where it cannot be.
#[derive(Clone, Debug, PartialEq)]
pub struct Misplaced {
    /// Index in [`World::drones`].
    pub drone: usize,
    /// Which of its places.
    pub spot: Spot,
    /// Where that is: centre of the rotor plane (m).
    pub place_m: Point3<f64>,
    /// What is wrong there.
    pub why: Misfit,
    /// A place near it that is in order, to the centimetre, if there is one. For a landing: where
    /// its last task should be.
    pub nearest_m: Option<Point3<f64>>,
    /// A gap to obstacles (m) that is smaller than the world's, with which it is in order there.
    pub bears_m: Option<f64>,
}

/// Which of a drone's places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spot {
    /// At time 0.
    Start,
    /// Index in [`crate::scenario::world::Drone::tasks`].
    Task(usize),
    /// Straight below the last of the others.
    Landing,
}

/// What is wrong with a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Misfit {
    /// The centre is outside the bounds.
    OutOfBounds {
        /// How far (m).
        by_m: f64,
    },
    /// The body is too near to an obstacle, or in it.
    Obstacle {
        /// Index in [`World::obstacles`]; from their number on, of the zones that keep bodies out.
        obstacle: usize,
        /// From the centre to the nearest face (m); negative: inside.
        distance_m: f64,
        /// What that has to be (m).
        needs_m: f64,
    },
    /// It is landed, and nothing is below it that it could stand on.
    Unsupported {
        /// Between its resting place and what is below (m).
        gap_m: f64,
    },
}

/// Every place at which a drone of this world cannot be, in the order of the drones.
pub(crate) fn misplaced(world: &World, solids: &Solids) -> Vec<Misplaced> {
    let drones = 0..world.drones.len();
    let mut found: Vec<Misplaced> = drones
        .flat_map(|drone| misplaced_of(world, solids, drone))
        .collect();
    let mut closer: Option<World> = None;
    for it in &mut found {
        let Some(gap_m) = bearable_gap_m(world, it) else {
            continue;
        };
        let closer = closer.get_or_insert_with(|| world.clone());
        closer.planning.clearance_m = world.planning.clearance_m.min(gap_m);
        closer.planning.margins.tracking_m = world.planning.margins.tracking_m.min(gap_m);
        let mut still = misplaced_of(closer, solids, it.drone).into_iter();
        it.bears_m = (!still.any(|other| other.spot == it.spot)).then_some(gap_m);
    }
    found
}

/// The gap to obstacles (m) at a place that is too near to one, to the millimetre.
fn bearable_gap_m(world: &World, found: &Misplaced) -> Option<f64> {
    let Misfit::Obstacle { distance_m, .. } = found.why else {
        return None;
    };
    let body_m = world.drones[found.drone].vehicle.body_radius_m;
    // Downwards.
    let gap_m = ((distance_m - body_m) * 1e3 + 1e-6).floor() / 1e3;
    (found.spot != Spot::Landing && gap_m >= 0.0).then_some(gap_m)
}

/// Every place at which one drone cannot be, in the order in which it comes to them.
fn misplaced_of(world: &World, solids: &Solids, drone: usize) -> Vec<Misplaced> {
    let it = &world.drones[drone];
    let body_m = it.vehicle.body_radius_m;
    let hovering_m = body_m + world.planning.gap_to_solids_m();
    let start_needs_m = match it.at_start {
        AtStart::Hover => hovering_m,
        AtStart::Landed => body_m - REST_TOLERANCE_M,
    };
    let start = std::iter::once((Spot::Start, it.start_m, start_needs_m));
    let tasks = it.tasks.iter().enumerate();
    let tasks = tasks.map(|(i, task)| (Spot::Task(i), task.to_m, hovering_m));
    let mut found = Vec::new();
    let mut report = |spot, place_m, why, nearest_m| {
        found.push(Misplaced {
            drone,
            spot,
            place_m,
            why,
            nearest_m,
            bears_m: None,
        });
    };
    let is_landed = it.at_start == AtStart::Landed;
    // Of the start, then of the last place.
    let [mut starts_well, mut ends_well] = [true; 2];
    for (spot, place_m, needs_m) in start.chain(tasks) {
        let why = misfit(world, solids, place_m, needs_m);
        ends_well = why.is_none();
        starts_well &= ends_well || spot != Spot::Start;
        if let Some(why) = why {
            let nearest_m = match (spot, it.at_start) {
                (Spot::Start, AtStart::Landed) => nearest_pad_m(world, solids, it),
                _ => nearest_free_m(world.bounds_m, solids, place_m, needs_m),
            };
            report(spot, place_m, why, nearest_m);
        }
    }
    if is_landed && starts_well {
        let rest_m = landing_place_m(&world.bounds_m, solids, it.start_m, body_m);
        let gap_m = it.start_m.z - rest_m.z;
        let unsupported = (gap_m > SUPPORT_TOLERANCE_M).then_some(Misfit::Unsupported { gap_m });
        let flies = !it.tasks.is_empty();
        let beside = flies.then(|| beside_misfit(world, solids, [it.start_m; 2], body_m));
        for why in unsupported.into_iter().chain(beside.flatten()) {
            let nearest_m = nearest_pad_m(world, solids, it);
            report(Spot::Start, it.start_m, why, nearest_m);
        }
    }
    let last_m = it.tasks.last().map_or(it.start_m, |task| task.to_m);
    let stays_landed = it.tasks.is_empty() && is_landed;
    if ends_well
        && it.at_end == AtEnd::Land
        && !stays_landed
        && let Some(why) = landing_misfit(world, solids, last_m, body_m)
    {
        let place_m = landing_place_m(&world.bounds_m, solids, last_m, body_m);
        let nearest_m = nearest_landing_m(world, solids, last_m, body_m);
        report(Spot::Landing, place_m, why, nearest_m);
    }
    found
}

/// Where a drone that comes down from `last_m` rests: with its centre one body radius above the
/// highest surface below, or where it already is, if that is lower.
pub(crate) fn landing_place_m(
    bounds_m: &Bounds,
    solids: &Solids,
    last_m: Point3<f64>,
    body_radius_m: f64,
) -> Point3<f64> {
    let (support_z_m, _) = solids.support_below_z_m(last_m, bounds_m.min.z);
    Point3::new(
        last_m.x,
        last_m.y,
        last_m.z.min(support_z_m + body_radius_m),
    )
}

/// Where a body could lie that is said to be at a place (m): on what is below that, or on top of
/// the obstacle that it is in. In a zone it may lie. `None`: there is no room for it.
pub(crate) fn lying_place_m(
    world: &World,
    place_m: Point3<f64>,
    body_radius_m: f64,
) -> Option<Point3<f64>> {
    let (solids, bounds_m) = (Solids::new(&world.obstacles), &world.bounds_m);
    let is_inside = solids.distance_to_point_m(place_m).0 < 0.0;
    let (up, most_m) = (Vector3::z(), f64::INFINITY);
    let up_m = match is_inside {
        true => path_out_m(bounds_m, &solids, place_m, up, body_radius_m, most_m)?,
        false => 0.0,
    };
    let rest_m = landing_place_m(bounds_m, &solids, place_m + up * up_m, body_radius_m);
    let fault = misfit(world, &solids, rest_m, body_radius_m - REST_TOLERANCE_M);
    fault.is_none().then_some(rest_m)
}

/// What is too near to a drone that leaves or reaches its pad on a path straight up or down (m): it
/// may be off that by the tracking margin, though not from what it stands on.
pub(crate) fn beside_misfit(
    world: &World,
    solids: &Solids,
    [from_m, to_m]: [Point3<f64>; 2],
    body_radius_m: f64,
) -> Option<Misfit> {
    let (_, stands_on) = solids.support_below_z_m(to_m, world.bounds_m.min.z);
    let tracking_m = world.planning.margins.tracking_m;
    let needs_m = body_radius_m
        + if tracking_m > 0.0 {
            tracking_m
        } else {
            -REST_TOLERANCE_M
        };
    let (distance_m, obstacle) = solids.nearest_beside(from_m, to_m, stands_on);
    let obstacle = obstacle.filter(|_| distance_m < needs_m - TOUCHING_M)?;
    Some(Misfit::Obstacle {
        obstacle,
        distance_m,
        needs_m,
    })
}

/// What is wrong with coming down from `last_m`: the ball has to pass and to rest without sinking
/// in.
pub(super) fn landing_misfit(
    world: &World,
    solids: &Solids,
    last_m: Point3<f64>,
    body_radius_m: f64,
) -> Option<Misfit> {
    let rest_m = landing_place_m(&world.bounds_m, solids, last_m, body_radius_m);
    let needs_m = body_radius_m - REST_TOLERANCE_M;
    let (distance_m, obstacle) = solids.nearest(last_m, rest_m);
    match obstacle.filter(|_| distance_m < needs_m - TOUCHING_M) {
        Some(obstacle) => Some(Misfit::Obstacle {
            obstacle,
            distance_m,
            needs_m: body_radius_m,
        }),
        None => beside_misfit(world, solids, [last_m, rest_m], body_radius_m),
    }
}

/// What is wrong with being at a place (m) with so much room around (m); `None`: nothing.
pub(super) fn misfit(
    world: &World,
    solids: &Solids,
    place_m: Point3<f64>,
    needs_m: f64,
) -> Option<Misfit> {
    let by_m = outside_by_m(&world.bounds_m, place_m);
    if by_m > TOUCHING_M {
        return Some(Misfit::OutOfBounds { by_m });
    }
    let (distance_m, obstacle) = solids.distance_to_point_m(place_m);
    let obstacle = obstacle.filter(|_| distance_m < needs_m - TOUCHING_M)?;
    Some(Misfit::Obstacle {
        obstacle,
        distance_m,
        needs_m,
    })
}

/// How far a place lies outside, along the axis where that is most (m); 0 inside.
fn outside_by_m(bounds_m: &Bounds, place_m: Point3<f64>) -> f64 {
    (0..3)
        .map(|axis| (bounds_m.min[axis] - place_m[axis]).max(place_m[axis] - bounds_m.max[axis]))
        .fold(0.0, f64::max)
}

/// A place near `place_m`, within bounds and `needs_m` clear of all obstacles, whole centimetres if
/// such a one is near: what a person types back. The nearest one along 154 directions, faces first.
pub(crate) fn nearest_free_m(
    bounds_m: Bounds,
    solids: &Solids,
    place_m: Point3<f64>,
    needs_m: f64,
) -> Option<Point3<f64>> {
    let inside = place_m.coords.sup(&bounds_m.min.coords);
    let inside = Point3::from(inside.inf(&bounds_m.max.coords));
    let free = |at_m: Point3<f64>| {
        outside_by_m(&bounds_m, at_m) <= TOUCHING_M
            && solids.distance_to_point_m(at_m).0 >= needs_m - TOUCHING_M
    };
    let mut best: Option<(f64, Point3<f64>)> = None;
    for direction in directions() {
        let most_m = best.map_or(f64::INFINITY, |(path_m, _)| path_m);
        if let Some(path_m) = path_out_m(&bounds_m, solids, inside, direction, needs_m, most_m) {
            best = Some((path_m, inside + direction * path_m));
        }
        if best.is_some_and(|(path_m, _)| path_m == 0.0) {
            break;
        }
    }
    let exact_m = best?.1;
    // The centimetres around it, nearest to the wish first.
    let around =
        (0..27).map(|i| Vector3::from([i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1].map(f64::from)));
    let rounded = around
        .map(|step| Point3::from((exact_m.coords * 100.0 + step).map(f64::round) / 100.0))
        .filter(|at_m| free(*at_m))
        .min_by(|a, b| (a - place_m).norm().total_cmp(&(b - place_m).norm()));
    Some(rounded.unwrap_or(exact_m))
}

/// How far along `direction` the first free place lies, if within bounds and nearer than `most_m`.
///
/// A signed distance changes at most by the length gone, so what is missing may be gone at once.
fn path_out_m(
    bounds_m: &Bounds,
    solids: &Solids,
    from_m: Point3<f64>,
    direction: Vector3<f64>,
    needs_m: f64,
    most_m: f64,
) -> Option<f64> {
    // Steps shrink where the path grazes a curved face; chosen here, 200 settle all but the
    // flattest grazing.
    const STEPS: usize = 200;
    let mut path_m = 0.0;
    for _ in 0..STEPS {
        let at_m = from_m + direction * path_m;
        if path_m >= most_m || outside_by_m(bounds_m, at_m) > TOUCHING_M {
            return None;
        }
        let missing_m = needs_m - solids.distance_to_point_m(at_m).0;
        if missing_m <= TOUCHING_M {
            return Some(path_m);
        }
        path_m += missing_m;
    }
    None
}

/// The 26 directions to the neighbours in a lattice, faces first, then 128 spread evenly over the
/// sphere.
fn directions() -> impl Iterator<Item = Vector3<f64>> {
    let mut lattice: Vec<Vector3<f64>> = (0..27)
        .filter(|i| *i != 13)
        .map(|i| Vector3::from([i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1].map(f64::from)))
        .collect();
    lattice.sort_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
    // Fibonacci's spiral: equal steps in height, golden angle (rad) in azimuth. How many: chosen
    // here.
    const SPREAD: u32 = 128;
    const GOLDEN_ANGLE_RAD: f64 = 2.399_963_229_728_653;
    let sphere = (0..SPREAD).map(|i| {
        let height = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(SPREAD);
        let (sin, cos) = (GOLDEN_ANGLE_RAD * f64::from(i)).sin_cos();
        Vector3::new(cos, sin, 0.0) * (1.0 - height * height).sqrt() + Vector3::z() * height
    });
    let lattice = lattice.into_iter().map(|direction| direction.normalize());
    lattice.chain(sphere)
}

/// A place beside `last_m`, at its height, from which a drone can come down.
fn nearest_landing_m(
    world: &World,
    solids: &Solids,
    last_m: Point3<f64>,
    body_radius_m: f64,
) -> Option<Point3<f64>> {
    let needs_m = body_radius_m + world.planning.gap_to_solids_m();
    beside_m(last_m).find(|place_m| {
        misfit(world, solids, *place_m, needs_m).is_none()
            && landing_misfit(world, solids, *place_m, body_radius_m).is_none()
    })
}

/// A place near a landed drone's start (m) where it can stand, and leave if it is to.
fn nearest_pad_m(world: &World, solids: &Solids, drone: &Drone) -> Option<Point3<f64>> {
    let body_m = drone.vehicle.body_radius_m;
    let (min_m, max_m) = (world.bounds_m.min.coords, world.bounds_m.max.coords);
    let start_m = drone.start_m.coords.sup(&min_m).inf(&max_m);
    let stands = |above_m: Point3<f64>| {
        let mut rest_m = landing_place_m(&world.bounds_m, solids, above_m, body_m);
        // Whole centimetres, and not into what is below.
        rest_m.z = (rest_m.z * 100.0 - TOUCHING_M).ceil() / 100.0;
        let is_free = misfit(world, solids, rest_m, body_m - REST_TOLERANCE_M).is_none();
        let may_leave =
            drone.tasks.is_empty() || beside_misfit(world, solids, [rest_m; 2], body_m).is_none();
        (is_free && may_leave).then_some(rest_m)
    };
    let above_m = Point3::new(start_m.x, start_m.y, start_m.z + body_m);
    stands(above_m).or_else(|| beside_m(above_m).find_map(stands))
}

/// Places beside one at its height (m), whole centimetres, on rings about it. Chosen here: in 16
/// directions, every centimetre up to a tenth of a metre, then every tenth up to 5 m.
fn beside_m(place_m: Point3<f64>) -> impl Iterator<Item = Point3<f64>> {
    const PLACES: u32 = 16;
    let near_m = (1..10).map(|ring| 0.01 * f64::from(ring));
    let rings_m = near_m.chain((1..=50).map(|ring| 0.1 * f64::from(ring)));
    let ring = move |radius_m: f64| {
        (0..PLACES).map(move |place| {
            let angle_rad = std::f64::consts::TAU * f64::from(place) / f64::from(PLACES);
            let step = Vector3::new(angle_rad.cos(), angle_rad.sin(), 0.0) * radius_m;
            Point3::from(((place_m + step).coords * 100.0).map(f64::round) / 100.0)
        })
    };
    rings_m.flat_map(ring)
}
