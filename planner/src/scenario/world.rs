//! What a scenario means: bounds, obstacles, zones, air and the fleet, in SI units, z up.
//!
//! What was read has been checked: every number is finite and in range, every airframe is known.
//! [`World::check`] checks a world made by hand against the same rules.

use airflow::effects::Effects;
use airflow::{Air, Airframe, Convection, Flown, Jet, Superposition};
use nalgebra::Point3;
use schemars::JsonSchema;
use serde::Serialize;

use crate::plan::limits::DefaultLimits;
use crate::plan::smoothing::Kernel;
use crate::plan::{
    AirDelay, AirModel, AirframeEntry, DronePlan, FORMAT, Fleet, Plan, Status, TrajectoryEntry,
};

pub use crate::plan::{AtEnd, AtStart, Bounds, Margins, Obstacle, Origin, Solid, Zone};

/// Highest vertical speed next to where a drone stands (m/s): chosen here, the landing speed that
/// autopilots ship with lies between 0.5 and 0.7 (PX4 MPC_LAND_SPEED, ArduPilot LAND_SPEED).
pub(crate) const LIFT_MPS: f64 = 0.5;
/// Length of that part of a take-off or landing beyond the body radius (m): chosen here, rotors
/// feel the ground up to about a diameter above it.
pub(crate) const LIFT_M: f64 = 0.5;

/// A place, a fleet and its tasks: the question that a plan answers.
#[derive(Clone, Debug)]
pub struct World {
    /// The scenario's name.
    pub name: String,
    /// Lowest and highest corner of the box that limits every rotor-plane centre (m).
    pub bounds_m: Bounds,
    /// Where it lies on the Earth, where that is said.
    pub origin: Option<Origin>,
    /// Temperature and pressure: one density for the whole world.
    pub air: Air,
    /// The constants of the merged jet.
    pub jet: Jet,
    /// How several wakes add up at a point; where a finding says, as it says.
    pub superposition: Superposition,
    /// What a finding adds to the hover jet; nothing by default.
    pub effects: Effects,
    /// How fast air is carried down: every delay from none on is planned for; `None`: wakes follow
    /// their drones at once, unless a finding says otherwise.
    pub convection: Option<Convection>,
    /// What no body may touch.
    pub obstacles: Vec<Obstacle>,
    /// Places where the air itself is limited.
    pub zones: Vec<Zone>,
    /// The fleet, in the scenario's order.
    pub drones: Vec<Drone>,
    /// Of each formation whose places any of its drones may take, the tasks that came of it: the
    /// drone's name, and the index among its tasks.
    pub formations: Vec<Vec<(String, usize)>>,
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
    /// Highest vertical speed upwards (m/s).
    pub max_climb_mps: f64,
    /// Highest vertical speed downwards (m/s), in flight, at take-off and landing.
    pub max_descent_mps: f64,
    /// m/s²: of what tracks the plan; straight legs change their velocity in no time.
    pub max_acceleration_mps2: f64,
    /// m/s³: as above.
    pub max_jerk_mps3: f64,
}

/// How fast air is carried down where a scenario does not say (lowest and highest speed over the
/// centreline's): chosen here, from what large eddies are carried at to what air on the axis is.
pub(crate) const CONVECTION_DEFAULT: [f64; 2] = [0.6, 1.0];

/// How early or late each drone may be by default (s): chosen here, a command that comes a few
/// cycles of a radio link late, and clocks kept by the network.
const TIME_MARGIN_S: f64 = 0.1;
/// How far off its path each drone may be by default (m): chosen here, what position control holds
/// indoors under motion capture or ultra-wideband.
const TRACKING_M: f64 = 0.1;
impl Vehicle {
    /// How long it takes at least to come down so far onto what it lands on (s).
    pub(crate) fn landing_s(&self, height_m: f64) -> f64 {
        let low_m = height_m.min(self.body_radius_m + LIFT_M);
        let descent_mps = self.max_descent_mps.min(self.max_speed_mps);
        low_m / LIFT_MPS.min(descent_mps) + (height_m - low_m) / descent_mps
    }

    /// An airframe at a highest speed (m/s) in air of a density (kg/m³), with the limits of one
    /// that states none: a body to the rotor tips, climb at full speed, descent at no more than
    /// two fifths of its induced velocity, acceleration and jerk by its size.
    #[must_use]
    pub fn new(airframe: Airframe, max_speed_mps: f64, density_kg_per_m3: f64) -> Vehicle {
        let DefaultLimits {
            max_climb_mps,
            max_descent_mps,
            max_acceleration_mps2,
            max_jerk_mps3,
        } = DefaultLimits::of(&airframe, max_speed_mps, density_kg_per_m3);
        Vehicle {
            body_radius_m: airframe.tip_radius_m(),
            airframe,
            max_speed_mps,
            max_climb_mps,
            max_descent_mps,
            max_acceleration_mps2,
            max_jerk_mps3,
        }
    }
}

impl Vehicle {
    /// How long it takes from full speed to rest where corners are not flown in no time (s).
    pub(crate) fn stop_s(&self) -> f64 {
        let Vehicle {
            max_speed_mps,
            max_acceleration_mps2,
            max_jerk_mps3,
            ..
        } = *self;
        Kernel::new(max_speed_mps, max_acceleration_mps2, max_jerk_mps3).rest_s()
    }
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
    /// It is there throughout this time of the plan, from and until (s): it comes no later than the
    /// first and goes on no earlier than the second. `None`: whenever it comes.
    pub during_s: Option<[f64; 2]>,
}

/// What is flown between the places of a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub enum PathMotion {
    /// Straight pieces at constant speed, with corners in no time.
    Straight,
    /// Straight pieces averaged over time, so that no limit of acceleration and jerk is exceeded.
    #[default]
    Smooth,
}

/// Rules that the scenario does not name: the planner gives them up where not every drone finds a
/// path by them, and says so.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Relaxable {
    /// [`PathMotion::Smooth`], for straight motion.
    pub motion: bool,
    /// Advected wakes, for quasi-static ones.
    pub convection: bool,
    /// The spacing of the lattice, which is chosen: anew, where places are moved.
    pub spacing: bool,
}

/// How to plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Planning {
    /// Spacing of the roadmap's lattice (m).
    pub cell_m: f64,
    /// Added between bodies and to obstacles (m).
    pub clearance_m: f64,
    /// How far flights may be from the plan while it still holds.
    pub margins: Margins,
    /// What is flown between the places of a path.
    pub motion: PathMotion,
    /// What of motion and air may be given up.
    pub relaxable: Relaxable,
    /// Breaks ties and orders restarts.
    pub seed: u64,
    /// Price of extra energy: seconds of delay that one second's worth of hover energy is worth
    /// (dimensionless). 0 ignores energy; limits hold whatever the price.
    pub energy_weight: f64,
}

impl World {
    /// The air as it is flown; of effects that cannot be flown, without any.
    pub(crate) fn flown(&self) -> Flown {
        let flown = Flown::of(&self.effects).unwrap_or_default();
        flown
            .with_convection(self.convection)
            .accelerating(self.most_acceleration_mps2())
    }

    /// The highest acceleration of any of its drones (m/s²).
    pub(super) fn most_acceleration_mps2(&self) -> f64 {
        let drones = self.drones.iter();
        let accelerations = drones.map(|drone| drone.vehicle.max_acceleration_mps2);
        accelerations.fold(0.0, f64::max)
    }

    /// The same without the rules that it does not name; `None` where it names all that hold.
    #[must_use]
    pub fn relaxed(&self) -> Option<World> {
        let relaxed = self.with_quasi_static_wakes();
        let straight = relaxed.as_ref().unwrap_or(self).in_straight_motion();
        straight.or(relaxed)
    }

    /// The same with quasi-static wakes; `None` where it names what its air does, or they are.
    pub(crate) fn with_quasi_static_wakes(&self) -> Option<World> {
        let is_open = self.planning.relaxable.convection && self.convection.is_some();
        is_open.then(|| {
            let mut relaxed = self.clone();
            relaxed.convection = None;
            relaxed.planning.relaxable.convection = false;
            relaxed
        })
    }

    /// The same in straight motion; `None` where it names its motion, or that is straight.
    pub(crate) fn in_straight_motion(&self) -> Option<World> {
        let is_open = self.planning.relaxable.motion && self.planning.motion == PathMotion::Smooth;
        is_open.then(|| {
            let mut relaxed = self.clone();
            relaxed.planning.motion = PathMotion::Straight;
            relaxed.planning.relaxable.motion = false;
            relaxed
        })
    }

    /// The same by the rules of a plan of it, where it leaves any open.
    #[must_use]
    pub fn ruled_as(mut self, plan: &Plan) -> World {
        let Some(relaxed) = self.relaxed() else {
            return self;
        };
        let mut drones = plan.drones.iter().map(|it| &it.trajectory);
        // Of drones that stay, it cannot be told: they are planned on by the weaker rule.
        if !drones.any(TrajectoryEntry::is_smooth) {
            self.planning.motion = relaxed.planning.motion;
        }
        if plan.convection() == relaxed.flown().convection {
            self.convection = relaxed.convection;
        }
        self.planning.relaxable = Relaxable::default();
        self
    }

    /// A plan in this place and its air, by its rules, for these drones: not judged, nothing summed
    /// up.
    pub(crate) fn plan_of(&self, drones: Vec<DronePlan>) -> Plan {
        let convection = self.flown().convection;
        Plan {
            format: FORMAT.to_owned(),
            scenario: self.name.clone(),
            status: Status::Safe,
            quasi_static: convection.is_none(),
            air_delay: convection.map(|convection| AirDelay { convection }),
            air: AirModel {
                density_kg_per_m3: self.air.density_kg_per_m3(),
                jet: self.jet,
                superposition: self.superposition.as_str().to_owned(),
                effects: (self.effects != Effects::default()).then_some(self.effects),
            },
            bounds_m: self.bounds_m,
            origin: self.origin,
            obstacles: self.obstacles.clone(),
            zones: self.zones.clone(),
            clearance_m: Some(self.planning.clearance_m),
            cell_m: Some(self.planning.cell_m),
            margins: self.planning.margins,
            drones,
            unplanned: Vec::new(),
            fleet: Fleet::default(),
            ignoring_downwash: None,
            zone_air: Vec::new(),
            violations: Vec::new(),
        }
    }
}

impl Planning {
    /// Kept between a flying body and obstacles (m): the clearance as planned, and off its path the
    /// body does not touch.
    #[must_use]
    pub(crate) fn gap_to_solids_m(&self) -> f64 {
        self.clearance_m.max(self.margins.tracking_m)
    }

    /// Kept between two bodies (m), of which so many fly: the clearance as planned, and both off
    /// their paths they do not touch.
    #[must_use]
    pub(crate) fn gap_to_bodies_m(&self, flying: usize) -> f64 {
        self.clearance_m
            .max(flying as f64 * self.margins.tracking_m)
    }
}

impl Vehicle {
    /// As a plan has it, with all that is needed to judge its wake in air of a density (kg/m³).
    pub(crate) fn entry(&self, density_kg_per_m3: f64) -> AirframeEntry {
        let airframe = &self.airframe;
        AirframeEntry {
            name: airframe.name().to_owned(),
            mass_kg: airframe.mass_kg(),
            propellers: airframe.propellers(),
            propeller_diameter_m: airframe.propeller_diameter_m(),
            motor_distance_m: airframe.motor_distance_m(),
            width_factor: airframe.width_factor(),
            body_radius_m: self.body_radius_m,
            max_speed_mps: self.max_speed_mps,
            max_climb_mps: Some(self.max_climb_mps),
            max_descent_mps: Some(self.max_descent_mps),
            max_acceleration_mps2: Some(self.max_acceleration_mps2),
            max_jerk_mps3: Some(self.max_jerk_mps3),
            hover_induced_velocity_mps: airframe
                .hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3),
        }
    }
}

impl AirframeEntry {
    /// The vehicle of a plan's entry, in air of a density (kg/m³); limits that it lacks are the
    /// default ones.
    ///
    /// # Errors
    ///
    /// What is wrong with it, in words.
    pub fn vehicle(&self, density_kg_per_m3: f64) -> Result<Vehicle, String> {
        let by_default = Vehicle::new(self.airframe()?, self.max_speed_mps, density_kg_per_m3);
        let or = |own: Option<f64>, default: f64| own.unwrap_or(default);
        Ok(Vehicle {
            body_radius_m: self.body_radius_m,
            max_climb_mps: or(self.max_climb_mps, by_default.max_climb_mps),
            max_descent_mps: or(self.max_descent_mps, by_default.max_descent_mps),
            max_acceleration_mps2: or(self.max_acceleration_mps2, by_default.max_acceleration_mps2),
            max_jerk_mps3: or(self.max_jerk_mps3, by_default.max_jerk_mps3),
            ..by_default
        })
    }
}

impl Default for Planning {
    fn default() -> Planning {
        Planning {
            cell_m: 1.0,
            clearance_m: 0.1,
            margins: Margins {
                time_s: TIME_MARGIN_S,
                tracking_m: TRACKING_M,
            },
            motion: PathMotion::default(),
            relaxable: Relaxable {
                motion: true,
                convection: false,
                spacing: false,
            },
            seed: 0,
            energy_weight: 1.0,
        }
    }
}
