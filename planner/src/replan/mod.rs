//! A plan changed while it is flown ([`rolling`]), and a fleet planned around fixed trajectories
//! ([`region`]).

pub mod change;
pub mod region;
pub mod rolling;

mod track;

use nalgebra::Point3;
use thiserror::Error;

use crate::plan::cause::as_typed;
use crate::plan::trajectory::{Tail, Trajectory};
use crate::plan::{AtEnd, DronePlan, TrajectoryEntry};
use crate::scenario::WorldError;
use crate::scenario::limits::{BUSY_S, DWELL_S, PLACE_M};
use crate::scenario::world::{Drone, Task, World};

/// What is wrong with a world, a plan, or the drones of one, that is handed in.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum GivenError {
    /// The world is not in order, or a drone has a number that no scenario may have.
    #[error(transparent)]
    World(Box<WorldError>),
    /// Not the plan of this world.
    #[error("the plan has {plan} drones, the world {world}")]
    Count {
        /// In the plan.
        plan: usize,
        /// In the world.
        world: usize,
    },
    /// Not the plan of this world.
    #[error("drone {index} of the plan is `{plan}`, of the world `{world}`")]
    Name {
        /// In both.
        index: usize,
        /// In the plan.
        plan: String,
        /// In the world.
        world: String,
    },
    /// Two are called the same.
    #[error("`{0}` is one of several drones of this name")]
    Twice(String),
    /// It contradicts itself.
    #[error("`{drone}`: {why}")]
    Unusable {
        /// The drone's name.
        drone: String,
        /// What is wrong.
        why: String,
    },
}

/// How long a trajectory is in motion (s): what is not at rest is cut into legs of a few ticks.
fn moving_s(entry: &TrajectoryEntry) -> f64 {
    let times = entry.t_s.windows(2).zip(entry.position_m.windows(2));
    let pieces = times.enumerate().filter(|(k, (_, places_m))| {
        let bends = entry.control_m.get(*k).is_some_and(|it| !it.is_empty());
        bends || places_m[0] != places_m[1]
    });
    pieces.map(|(_, (times, _))| times[1] - times[0]).sum()
}

/// What flies in a plan, with nothing to do, where its trajectory begins; held against the rules of
/// a scenario's drones, all along its trajectory.
fn given(entry: &DronePlan, world: &World) -> Result<Drone, GivenError> {
    let density_kg_per_m3 = world.air.density_kg_per_m3();
    let unusable = |why: String| GivenError::Unusable {
        drone: entry.name.clone(),
        why,
    };
    Trajectory::new(&entry.trajectory, Tail::Gone).map_err(|it| unusable(it.to_string()))?;
    let drone = Drone {
        name: entry.name.clone(),
        vehicle: entry
            .airframe
            .vehicle(density_kg_per_m3)
            .map_err(unusable)?,
        start_m: entry.trajectory.position_m[0],
        at_start: entry.at_start,
        tasks: Vec::new(),
        at_end: AtEnd::Hover,
        air_limit: entry.air_limit,
    };
    let TrajectoryEntry {
        t_s,
        position_m,
        mass_kg,
        control_m,
        turns_at_once: _,
    } = &entry.trajectory;
    if let Some(mass_kg) = mass_kg.iter().find(|kg| **kg <= 0.0) {
        return Err(unusable(format!("its mass (kg) is {}", as_typed(*mass_kg))));
    }
    let outside = |place_m: &&Point3<f64>| !place_m.iter().all(|x_m| PLACE_M.contain(*x_m));
    if let Some(place_m) = position_m
        .iter()
        .chain(control_m.iter().flatten())
        .find(outside)
    {
        let [x, y, z] = <[f64; 3]>::from(place_m.coords).map(as_typed);
        return Err(unusable(format!(
            "({x}, {y}, {z}) m is more than 10 km away"
        )));
    }
    let (from_s, until_s) = entry.airborne_s;
    let times_s = t_s.iter().copied().chain([from_s]).chain(until_s);
    let rests_s = entry.landed_s.iter().flat_map(|it| [it.0, it.1]);
    let times_s = times_s.chain(entry.enters_s).chain(rests_s);
    if let Some(time_s) = times_s.into_iter().find(|t_s| !BUSY_S.contain(*t_s)) {
        let (low, high) = (BUSY_S.low, BUSY_S.high);
        let time_s = as_typed(time_s);
        let why = format!("{time_s} s is no time of a plan, which are from {low} to {high:.1e} s");
        return Err(unusable(why));
    }
    let moving_s = moving_s(&entry.trajectory);
    if moving_s > DWELL_S.high {
        let (moving_s, most_s) = (as_typed(moving_s), DWELL_S.high);
        let why = format!("it is in motion for {moving_s} s in all, of at most {most_s} s");
        return Err(unusable(why));
    }
    // Its heaviest load counts as a task's.
    let heaviest_kg = mass_kg.iter().copied().fold(0.0, f64::max);
    let loaded = Drone {
        tasks: vec![Task {
            to_m: drone.start_m,
            dwell_s: 0.0,
            load_kg: Some((heaviest_kg - drone.vehicle.airframe.mass_kg()).max(0.0)),
            during_s: None,
        }],
        ..drone.clone()
    };
    if let Some(fault) = world.faults_of(&loaded, 0.0).into_iter().next() {
        return Err(GivenError::World(Box::new(fault)));
    }
    Ok(drone)
}
