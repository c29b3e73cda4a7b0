//! Worlds: small ones by hand, and random ones of every kind of thing that a scenario may hold.

use airflow::{Air, Airframe, Jet, Superposition};
use nalgebra::Point3;
use planner::plan::outcome::{Blocker, EndpointKind};
use planner::scenario::world::{
    AtEnd, AtStart, Bounds, Drone, Obstacle, PathMotion, Planning, Solid, Task, Vehicle, World,
    Zone,
};
use planner::scenario::{Misplaced, Spot, WorldError};
use proptest::prelude::*;

/// An empty room from the origin, cells of 1 m, straight motion and quasi-static wakes.
pub(super) fn room(size_m: [f64; 3], drones: Vec<Drone>) -> World {
    World {
        name: "by hand".to_owned(),
        bounds_m: Bounds {
            min: Point3::origin(),
            max: size_m.into(),
        },
        air: Air::default(),
        jet: Jet::default(),
        superposition: Superposition::Momentum,
        effects: airflow::effects::Effects::default(),
        convection: None,
        obstacles: Vec::new(),
        zones: Vec::new(),
        drones,
        formations: Vec::new(),
        planning: Planning {
            cell_m: 1.0,
            clearance_m: 0.1,
            motion: PathMotion::Straight,
            seed: 0,
            energy_weight: 1.0,
            ..Planning::default()
        },
        origin: None,
        notes: Vec::new(),
    }
}

/// Flies from one place to another at 2 m/s, hovers before and after, limit 0.3.
pub(super) fn drone(name: &str, preset: &str, start_m: [f64; 3], goal_m: [f64; 3]) -> Drone {
    let airframe = Airframe::preset(preset).expect("a preset");
    Drone {
        name: name.to_owned(),
        vehicle: Vehicle::new(airframe, 2.0, Air::default().density_kg_per_m3()),
        start_m: start_m.into(),
        at_start: AtStart::Hover,
        tasks: vec![task(goal_m, 0.0)],
        at_end: AtEnd::Hover,
        air_limit: 0.3,
    }
}

pub(super) fn task(to_m: [f64; 3], dwell_s: f64) -> Task {
    Task {
        to_m: to_m.into(),
        dwell_s,
        load_kg: None,
        during_s: None,
    }
}

pub(super) fn block(name: &str, min_m: [f64; 3], max_m: [f64; 3]) -> Obstacle {
    Obstacle {
        name: name.to_owned(),
        shape: Solid::Box {
            min_m: min_m.into(),
            max_m: max_m.into(),
        },
    }
}

/// Four numbers from 0 to 1.
type Unit = [f64; 3];

fn unit() -> impl Strategy<Value = Unit> {
    prop::array::uniform3(0.0..1.0)
}

#[derive(Clone, Debug)]
struct DroneRecipe {
    airframe: usize,
    start: Unit,
    tasks: Vec<(Unit, f64, Option<f64>)>,
    landed: bool,
    ending: AtEnd,
    air_limit: f64,
    speed_mps: f64,
    on_cells: bool,
}

fn drone_recipe() -> impl Strategy<Value = DroneRecipe> {
    let task = (
        unit(),
        prop_oneof![3 => Just(0.0), 2 => 0.0..6.0],
        prop_oneof![3 => Just(None), 1 => (0.0..1.0).prop_map(Some)],
    );
    let ending =
        prop_oneof![4 => Just(AtEnd::Hover), 1 => Just(AtEnd::Land), 1 => Just(AtEnd::Leave)];
    (
        0..3_usize,
        unit(),
        prop::collection::vec(task, 0..4),
        prop::bool::weighted(0.3),
        ending,
        0.1..1.0,
        0.5..4.0,
        any::<bool>(),
    )
        .prop_map(
            |(airframe, start, tasks, landed, ending, air_limit, speed_mps, on_cells)| {
                DroneRecipe {
                    airframe,
                    start,
                    tasks,
                    landed,
                    ending,
                    air_limit,
                    speed_mps,
                    on_cells,
                }
            },
        )
}

#[derive(Clone, Debug)]
struct SolidRecipe {
    round: bool,
    at: Unit,
    size: Unit,
}

fn solid_recipe() -> impl Strategy<Value = SolidRecipe> {
    (any::<bool>(), unit(), unit()).prop_map(|(round, at, size)| SolidRecipe { round, at, size })
}

/// Presets, the canted and the smallest among them, and a frame with six propellers.
const FLEET: [&str; 7] = [
    "kolibri",
    "offboard-1",
    "offboard-2",
    "mavic-3e",
    "elios-3",
    "crazyflie-2.1",
    "hexa",
];

fn vehicle(name: &str, speed_mps: f64) -> Vehicle {
    let airframe = if name == "hexa" {
        Airframe::new(name, 1.8, 6, 0.2, 0.5, 1.0).expect("in range")
    } else {
        Airframe::preset(name).expect("a preset")
    };
    Vehicle::new(airframe, speed_mps, Air::default().density_kg_per_m3())
}

fn within(bounds: &Bounds, at: Unit, on_cells: bool) -> Point3<f64> {
    let mut place_m = Point3::origin();
    for axis in 0..3 {
        // Off the floor: a body has to fit below the rotor plane.
        let low_m = bounds.min[axis] + if axis == 2 { 0.5 } else { 0.0 };
        let wish_m = low_m + at[axis] * (bounds.max[axis] - low_m);
        place_m[axis] = if on_cells {
            (wish_m - 0.5)
                .round()
                .max(low_m.ceil())
                .min(bounds.max[axis] - 0.5)
                + 0.5
        } else {
            (wish_m * 100.0).round() / 100.0
        };
        place_m[axis] = place_m[axis].clamp(bounds.min[axis], bounds.max[axis]);
    }
    place_m
}

fn solid(bounds: &Bounds, recipe: &SolidRecipe) -> Solid {
    let size = bounds.max - bounds.min;
    let at_m = bounds.min + size.component_mul(&nalgebra::Vector3::from(recipe.at));
    if recipe.round {
        return Solid::Cylinder {
            base_m: Point3::new(at_m.x, at_m.y, bounds.min.z),
            radius_m: 0.2 + 1.3 * recipe.size[0],
            height_m: 0.3 + size.z * recipe.size[2],
        };
    }
    let half = [0.2 + 1.5 * recipe.size[0], 0.2 + 1.5 * recipe.size[1]];
    let low_m = if recipe.at[2] > 0.8 {
        at_m.z
    } else {
        bounds.min.z
    };
    Solid::Box {
        min_m: Point3::new(at_m.x - half[0], at_m.y - half[1], low_m),
        max_m: Point3::new(
            at_m.x + half[0],
            at_m.y + half[1],
            low_m + 0.3 + size.z * recipe.size[2],
        ),
    }
}

/// Rooms of 5 to 12 m, up to six drones, boxes, cylinders and zones. Every place is in order, and
/// no two starts exclude one another.
pub(super) fn any_world() -> impl Strategy<Value = World> {
    let size = (5.0..12.0, 5.0..12.0, 3.0..9.0);
    let planning = (
        prop_oneof![Just(0.5), Just(0.7), Just(1.0)],
        0.0..0.2,
        0_u64..3,
        prop_oneof![Just(0.0), Just(1.0), Just(20.0)],
    );
    let superposition = prop_oneof![
        2 => Just(Superposition::Momentum),
        1 => Just(Superposition::Linear),
        1 => Just(Superposition::Strongest)
    ];
    let zone = (unit(), unit(), prop_oneof![0.05..0.5, 0.5..3.0]);
    (
        size,
        planning,
        superposition,
        (0..FLEET.len(), prop::collection::vec(drone_recipe(), 1..7)),
        prop::collection::vec(solid_recipe(), 0..4),
        prop::collection::vec(zone, 0..2),
    )
        .prop_map(
            |(size, planning, superposition, (first, drones), solids, zones)| {
                let bounds_m = Bounds {
                    min: Point3::new(-1.0, 2.0, 0.5),
                    max: Point3::new(-1.0 + size.0, 2.0 + size.1, 0.5 + size.2),
                };
                let mut world = room([1.0; 3], Vec::new());
                world.name = "random".to_owned();
                world.bounds_m = bounds_m;
                world.superposition = superposition;
                world.planning = Planning {
                    cell_m: planning.0,
                    clearance_m: planning.1,
                    seed: planning.2,
                    energy_weight: planning.3,
                    ..world.planning
                };
                world.obstacles = solids
                    .iter()
                    .enumerate()
                    .map(|(k, recipe)| Obstacle {
                        name: format!("solid-{k}"),
                        shape: solid(&bounds_m, recipe),
                    })
                    .collect();
                world.zones = zones
                    .iter()
                    .enumerate()
                    .map(|(k, (at, size, air_limit_mps))| {
                        let min = within(&bounds_m, *at, false);
                        let size_m = nalgebra::Vector3::from(*size) * 2.0;
                        Zone {
                            name: format!("zone-{k}"),
                            min_m: min,
                            max_m: (min + size_m).coords.inf(&bounds_m.max.coords).into(),
                            air_limit_mps: Some(*air_limit_mps),
                            keep_out: false,
                        }
                    })
                    .collect();
                world.drones = drones
                    .iter()
                    .enumerate()
                    .map(|(k, recipe)| {
                        // Three of the frames a world: every pair of them costs a table.
                        let frame = FLEET[(first + recipe.airframe) % FLEET.len()];
                        made(&world, &format!("d{k}"), frame, recipe)
                    })
                    .collect();
                mended(world)
            },
        )
        .prop_filter("no drone is left", |world| !world.drones.is_empty())
}

/// Where a body rests straight below a place: on the highest top under it, or on the floor.
fn resting_place_m(world: &World, from_m: Point3<f64>, body_radius_m: f64) -> Point3<f64> {
    let tops_m = world.obstacles.iter().filter_map(|it| match &it.shape {
        Solid::Box { min_m, max_m } => (0..2)
            .all(|k| (min_m[k]..=max_m[k]).contains(&from_m[k]))
            .then_some(max_m.z),
        Solid::Cylinder {
            base_m,
            radius_m,
            height_m,
        } => ((from_m - base_m).xy().norm() <= *radius_m).then_some(base_m.z + height_m),
        Solid::Mesh { .. } => None,
    });
    let below_m = tops_m.filter(|top_m| *top_m <= from_m.z);
    let support_z_m = below_m.fold(world.bounds_m.min.z, f64::max);
    let rest_z_m = from_m.z.min(support_z_m + body_radius_m);
    Point3::new(from_m.x, from_m.y, rest_z_m)
}

fn made(world: &World, name: &str, frame: &str, recipe: &DroneRecipe) -> Drone {
    let vehicle = vehicle(frame, recipe.speed_mps);
    let mass_kg = vehicle.airframe.mass_kg();
    let place = |at: Unit| within(&world.bounds_m, at, recipe.on_cells);
    let tasks = recipe
        .tasks
        .iter()
        .map(|(at, dwell_s, load)| Task {
            to_m: place(*at),
            dwell_s: *dwell_s,
            load_kg: load.map(|share| share * mass_kg),
            during_s: None,
        })
        .collect();
    let mut start_m = place(recipe.start);
    if recipe.landed {
        start_m = resting_place_m(world, start_m, vehicle.body_radius_m);
    }
    Drone {
        name: name.to_owned(),
        vehicle,
        start_m,
        at_start: if recipe.landed {
            AtStart::Landed
        } else {
            AtStart::Hover
        },
        tasks,
        at_end: recipe.ending,
        air_limit: recipe.air_limit,
    }
}

fn misplaced(world: &World) -> Vec<Misplaced> {
    let faults = world.check().err().map_or(Vec::new(), |faults| faults.0);
    let misplaced = faults.into_iter().map(|fault| match fault {
        WorldError::Misplaced { found, .. } => found,
        other => panic!("{other}"),
    });
    misplaced.collect()
}

/// Moves what is out of place, and drops whom that does not help: what reading a scenario refuses
/// is no question here.
fn mended(mut world: World) -> World {
    for _ in 0..4 {
        for it in misplaced(&world) {
            let drone = &mut world.drones[it.drone];
            match (it.spot, it.nearest_m) {
                (Spot::Start, Some(place_m)) => drone.start_m = place_m,
                (Spot::Task(k), Some(place_m)) => drone.tasks[k].to_m = place_m,
                _ => drone.at_end = AtEnd::Hover,
            }
        }
    }
    let mut wrong: Vec<usize> = misplaced(&world).iter().map(|it| it.drone).collect();
    wrong.dedup();
    for drone in wrong.into_iter().rev() {
        world.drones.remove(drone);
    }
    loop {
        let conflict = planner::endpoint_conflicts(&world)
            .worst
            .into_iter()
            .find(|conflict| conflict.when == EndpointKind::Starts);
        let Some(conflict) = conflict else {
            return world;
        };
        // The wake of the one named reaches the zone; of two drones, the later goes.
        let later = match conflict.blocker {
            Blocker::Drone(other) => other.max(conflict.drone),
            Blocker::Zone(_) => conflict.drone,
        };
        world.drones.remove(later);
    }
}
