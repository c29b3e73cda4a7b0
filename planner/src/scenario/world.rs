//! What a scenario means: bounds, obstacles, zones, air and the fleet, in SI units, z up.
//!
//! Everything here has been checked: every number is finite and in range, every airframe is known.

use airflow::effects::Effects;
use airflow::{Air, Airframe, Jet, Superposition};
use nalgebra::Point3;

pub use crate::plan::{AtEnd, AtStart, Bounds, Obstacle, Solid, Zone};

/// A place, a fleet and its tasks: the question that a plan answers.
#[derive(Clone, Debug)]
pub struct World {
    /// The scenario's name.
    pub name: String,
    /// Lowest and highest corner of the box that limits every rotor-plane centre (m).
    pub bounds_m: Bounds,
    /// Temperature and pressure: one density for the whole world.
    pub air: Air,
    /// The constants of the merged jet.
    pub jet: Jet,
    /// How several wakes add up at a point; where a finding says, as it says.
    pub superposition: Superposition,
    /// What a finding adds to the hover jet; nothing by default.
    pub effects: Effects,
    /// What no body may touch.
    pub obstacles: Vec<Obstacle>,
    /// Places where the air itself is limited.
    pub zones: Vec<Zone>,
    /// The fleet, in the scenario's order.
    pub drones: Vec<Drone>,
    /// How to plan.
    pub planning: Planning,
    /// What a reader of the plan should know about this question: frames outside the jet's fit,
    /// frames without a near-field model.
    pub notes: Vec<String>,
}

/// An airframe as a planner flies it.
#[derive(Clone, Debug, PartialEq)]
pub struct Vehicle {
    /// Mass, propellers, motor distance: what makes its air.
    pub airframe: Airframe,
    /// Radius of the ball that must stay clear of bodies and obstacles (m); default: to the rotor
    /// tips.
    pub body_radius_m: f64,
    /// Highest speed along a leg (m/s).
    pub max_speed_mps: f64,
}

/// One drone and what it has to do.
#[derive(Clone, Debug)]
pub struct Drone {
    /// Unique name.
    pub name: String,
    /// What flies.
    pub vehicle: Vehicle,
    /// Centre of the rotor plane at time 0 (m).
    pub start_m: Point3<f64>,
    /// How it starts.
    pub at_start: AtStart,
    /// Where it goes, in order.
    pub tasks: Vec<Task>,
    /// What it does after its last dwell.
    pub at_end: AtEnd,
    /// Highest mean air over its own rotor discs, over its induced velocity at its current mass.
    pub air_limit: f64,
}

/// A place to reach and to stay at for a while.
#[derive(Clone, Debug)]
pub struct Task {
    /// Centre of the rotor plane (m).
    pub to_m: Point3<f64>,
    /// How long it hovers there (s).
    pub dwell_s: f64,
    /// Payload carried from arrival here (kg); `None`: unchanged.
    pub load_kg: Option<f64>,
}

/// How to plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Planning {
    /// Spacing of the roadmap's lattice (m).
    pub cell_m: f64,
    /// Added between bodies and to obstacles (m).
    pub clearance_m: f64,
    /// Breaks ties and orders restarts.
    pub seed: u64,
    /// Price of extra energy: seconds of delay that one second's worth of hover energy is worth
    /// (dimensionless). 0 ignores energy; limits hold whatever the price.
    pub energy_weight: f64,
}
