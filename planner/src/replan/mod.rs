//! A plan changed while it is flown ([`rolling`]), and a fleet planned around fixed trajectories
//! ([`region`]).

pub mod change;
pub mod region;
pub mod rolling;

mod track;

use thiserror::Error;

use crate::plan::trajectory::{Tail, Trajectory};
use crate::plan::{AtEnd, DronePlan};
use crate::scenario::WorldError;
use crate::scenario::world::Drone;

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

/// What flies in a plan, with nothing to do, where its trajectory begins; in air of a density
/// (kg/m³).
fn given(entry: &DronePlan, density_kg_per_m3: f64) -> Result<Drone, GivenError> {
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
    if let Some(fault) = drone.faults(density_kg_per_m3).into_iter().next() {
        return Err(GivenError::World(Box::new(fault)));
    }
    if let Some(mass_kg) = entry.trajectory.mass_kg.iter().find(|kg| **kg <= 0.0) {
        return Err(unusable(format!("its mass (kg) is {mass_kg}")));
    }
    Ok(drone)
}
