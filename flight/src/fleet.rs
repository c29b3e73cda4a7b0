//! A plan made ready to be flown.

use std::borrow::Cow;
use std::str::FromStr;

use airflow::{Airframe, DiscPoints, Flown, Superposition, Wake};
use costmap::wake::fleet::wake_of;
use costmap::wake::surfaces::BlockingSurfaces;
use nalgebra::{Point3, Vector3};
use planner::Plan;
use planner::plan::cause::as_typed;
use planner::plan::{Bounds, DronePlan};
use planner::verify::NamedSolid;
use thiserror::Error;

use crate::reference::ReferencePath;
use crate::setup::Setup;
use crate::vehicle::{Dynamics, Vehicle};

/// Why a plan cannot be flown.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum FlyError {
    /// No drone.
    #[error("the plan has no drones")]
    NoDrones,
    /// Its air.
    #[error("the plan's air: {0}")]
    Air(String),
    /// Its place.
    #[error("the plan's place: {0}")]
    Place(String),
    /// One of its drones.
    #[error("`{drone}`: {what}")]
    Drone {
        /// Its name.
        drone: String,
        /// What is wrong with it.
        what: String,
    },
    /// Options with which nothing can be flown.
    #[error("{0}")]
    Options(String),
    /// More drones in one place than can be flown.
    #[error("{drones} drones are in one place at {at_s:.0} s; at most {most} can be flown")]
    TooDense {
        /// How many.
        drones: usize,
        /// When (s).
        at_s: f64,
        /// How many at most.
        most: usize,
    },
    /// Longer than is flown.
    #[error(
        "{drones} drones for {lasts_s:.0} s are more than is flown at a time ({most:.0} drone-seconds); end it sooner"
    )]
    TooLong {
        /// How many.
        drones: usize,
        /// How long (s).
        lasts_s: f64,
        /// Their product, at most.
        most: f64,
    },
}

/// One drone and what flies it.
#[derive(Clone, Debug)]
pub(crate) struct SimulatedDrone {
    pub(crate) name: String,
    pub(crate) course: ReferencePath,
    pub(crate) dynamics: Dynamics,
    /// Without payload.
    pub(crate) mass_kg: f64,
    /// At its mass without payload, with what a finding adds.
    pub(crate) wake: Wake,
    pub(crate) discs: DiscPoints,
    pub(crate) body_radius_m: f64,
    pub(crate) max_speed_mps: f64,
    pub(crate) air_limit: f64,
    /// As the plan claims: its highest air (m/s), and its mass at that moment (kg).
    pub(crate) claimed: (f64, f64),
}

impl SimulatedDrone {
    /// Induced velocity at hover by which its exposure is measured, at a mass (m/s).
    pub(crate) fn hover_mps(&self, mass_kg: f64) -> f64 {
        self.wake.hover_velocity_mps() * (mass_kg / self.mass_kg).sqrt()
    }
}

/// A solid and its bounding box (m).
#[derive(Debug)]
pub(crate) struct Boxed {
    pub(crate) solid: NamedSolid,
    /// Drones stand on its top.
    pub(crate) bears: bool,
    low_m: Vector3<f64>,
    high_m: Vector3<f64>,
}

impl Boxed {
    fn new(solid: NamedSolid, bears: bool) -> Boxed {
        let [low_m, high_m] = solid.corners_m().map(|it| it.coords);
        Boxed {
            solid,
            bears,
            low_m,
            high_m,
        }
    }

    /// Whether a place is farther than this from its bounding box (m).
    pub(crate) fn is_beyond(&self, place_m: &Vector3<f64>, far_m: f64) -> bool {
        (0..3).any(|k| place_m[k] < self.low_m[k] - far_m || place_m[k] > self.high_m[k] + far_m)
    }
}

/// A whole plan.
#[derive(Debug)]
pub(crate) struct SimulatedFleet {
    pub(crate) drones: Vec<SimulatedDrone>,
    pub(crate) superposition: Superposition,
    pub(crate) flown: Flown,
    pub(crate) surfaces: BlockingSurfaces,
    /// Obstacles, and zones that keep bodies out.
    pub(crate) solids: Vec<Boxed>,
    pub(crate) bounds_m: Bounds,
    /// Last time of any trajectory (s).
    pub(crate) last_s: f64,
    /// By airframe, in the order in which they come.
    pub(crate) vehicles: Vec<(String, Vehicle)>,
}

/// Quantities with their ranges, wider than any drone known here; beyond them sums are not finite.
const MASS_KG: (f64, f64) = (1e-4, 1e5);
const LENGTH_M: (f64, f64) = (1e-3, 1e3);
const DENSITY_KG_PER_M3: (f64, f64) = (1e-3, 100.0);
const PLACE_M: (f64, f64) = (-1e7, 1e7);

fn is_within(value: f64, (low, high): (f64, f64)) -> bool {
    (low..=high).contains(&value)
}

impl SimulatedFleet {
    pub(crate) fn new(plan: &Plan, setup: &Setup) -> Result<SimulatedFleet, FlyError> {
        if plan.drones.is_empty() {
            return Err(FlyError::NoDrones);
        }
        let (_, stated) = air(plan).map_err(FlyError::Air)?;
        let plan = &*as_found_to_weigh(plan, &stated);
        let (superposition, flown) = air(plan).map_err(FlyError::Air)?;
        let bounds_m = plan.bounds_m;
        let corners = || bounds_m.min.iter().chain(bounds_m.max.iter());
        let is_box = (0..3).all(|k| bounds_m.min[k] <= bounds_m.max[k]);
        if !is_box || !corners().all(|it| is_within(*it, PLACE_M)) {
            return Err(FlyError::Place("its bounds are no box".to_owned()));
        }
        let solids = plan.obstacles.iter().map(NamedSolid::new);
        let solids: Result<Vec<NamedSolid>, String> = solids.collect();
        let keep_out = plan.zones.iter().filter(|zone| zone.keep_out);
        let solids = solids.map_err(FlyError::Place)?.into_iter();
        let solids = solids.map(|it| Boxed::new(it, true));
        let solids = solids.chain(keep_out.map(|it| Boxed::new(NamedSolid::of_zone(it), false)));
        let mut fleet = SimulatedFleet {
            drones: Vec::with_capacity(plan.drones.len()),
            superposition,
            flown,
            surfaces: planner::blocking_surfaces(plan),
            solids: solids.collect(),
            bounds_m,
            last_s: 0.0,
            vehicles: Vec::new(),
        };
        for drone in &plan.drones {
            let simulated = fleet.simulated_drone(plan, drone, setup);
            let simulated = simulated.map_err(|what| FlyError::Drone {
                drone: drone.name.clone(),
                what,
            })?;
            fleet.last_s = fleet.last_s.max(simulated.course.last_s);
            fleet.drones.push(simulated);
        }
        Ok(fleet)
    }

    fn simulated_drone(
        &mut self,
        plan: &Plan,
        drone: &DronePlan,
        setup: &Setup,
    ) -> Result<SimulatedDrone, String> {
        let entry = &drone.airframe;
        let airframe = entry.airframe()?;
        let lengths_m = [
            ("propeller diameter", entry.propeller_diameter_m),
            ("motor distance", entry.motor_distance_m),
            ("body radius", entry.body_radius_m),
        ];
        for (what, length_m) in lengths_m {
            if !is_within(length_m, LENGTH_M) {
                return Err(format!("its {what} is {} m", as_typed(length_m)));
            }
        }
        let masses_kg = drone.trajectory.mass_kg.iter().chain([&entry.mass_kg]);
        if let Some(mass_kg) = masses_kg.copied().find(|it| !is_within(*it, MASS_KG)) {
            return Err(format!("its mass is {} kg", as_typed(mass_kg)));
        }
        let is_place = |it: &Point3<f64>| it.iter().all(|c| is_within(*c, PLACE_M));
        if !drone.trajectory.position_m.iter().all(is_place) {
            return Err("a place of its trajectory is beyond reason".to_owned());
        }
        if !(drone.air_limit >= 0.0 && entry.max_speed_mps >= 0.0) {
            return Err("a limit of it is negative or no number".to_owned());
        }
        let density_kg_per_m3 = plan.air.density_kg_per_m3;
        if let Some(why) = self.flown.beyond(&airframe, density_kg_per_m3) {
            return Err(why);
        }
        let course = ReferencePath::new(plan, drone)?;
        let alike = self
            .drones
            .iter()
            .find(|it| *it.wake.airframe() == airframe);
        let (wake, dynamics) = match alike {
            Some(known) => (known.wake.clone(), known.dynamics.clone()),
            None => {
                let vehicle = Vehicle::of(&airframe, &setup.entry(airframe.name()));
                self.vehicles
                    .push((airframe.name().to_owned(), vehicle.clone()));
                let found_kg_per_m3 = self.flown.density_kg_per_m3(density_kg_per_m3);
                let dynamics = Dynamics::new(vehicle, &airframe, found_kg_per_m3);
                (self.wake(plan, &airframe), dynamics)
            }
        };
        let masses_kg = drone.trajectory.mass_kg.iter().copied();
        let heaviest_kg = masses_kg.fold(airframe.mass_kg(), f64::max);
        let thrust_to_weight = dynamics.vehicle.thrust_to_weight;
        let most_kg = thrust_to_weight * airframe.mass_kg();
        if heaviest_kg > most_kg {
            return Err(format!(
                "it weighs {heaviest_kg:.3} kg with all it carries, and its rotors lift {most_kg:.3} kg: \
                 {thrust_to_weight} times its own mass"
            ));
        }
        let path = &drone.trajectory;
        let at = drone
            .worst_air_at_s
            .map(|t_s| path.point_at(t_s).unwrap_or(0));
        let claimed_kg = at.and_then(|point| path.mass_kg.get(point).copied());
        let claimed_kg = claimed_kg.unwrap_or(airframe.mass_kg());
        Ok(SimulatedDrone {
            name: drone.name.clone(),
            course,
            dynamics,
            mass_kg: airframe.mass_kg(),
            wake,
            discs: airframe.disc_points(),
            body_radius_m: entry.body_radius_m,
            max_speed_mps: entry.max_speed_mps,
            air_limit: drone.air_limit,
            claimed: (drone.worst_air_mps, claimed_kg),
        })
    }

    fn wake(&self, plan: &Plan, airframe: &Airframe) -> Wake {
        let air = (&plan.air.jet, &self.flown);
        wake_of(
            airframe,
            airframe.mass_kg(),
            plan.air.density_kg_per_m3,
            air,
        )
    }
}

/// A plan whose drones weigh what a finding says, and whose wakes are stronger by that alone.
pub(crate) fn as_found_to_weigh<'a>(plan: &'a Plan, flown: &Flown) -> Cow<'a, Plan> {
    let factor = flown.mass_factor();
    if factor == 1.0 {
        return Cow::Borrowed(plan);
    }
    let mut plan = plan.clone();
    if let Some(effects) = &mut plan.air.effects {
        effects.payload_mass = None;
    }
    for drone in &mut plan.drones {
        let masses_kg = drone.trajectory.mass_kg.iter_mut();
        masses_kg.for_each(|mass_kg| *mass_kg *= factor);
    }
    Cow::Owned(plan)
}

/// How wakes add up, and what a finding adds to them.
fn air(plan: &Plan) -> Result<(Superposition, Flown), String> {
    let density_kg_per_m3 = plan.air.density_kg_per_m3;
    if !is_within(density_kg_per_m3, DENSITY_KG_PER_M3) {
        return Err(format!(
            "its density is {} kg/m3",
            as_typed(density_kg_per_m3)
        ));
    }
    if let Some(problem) = plan.air.jet.problems().first() {
        return Err(format!("the jet: {problem}"));
    }
    let superposition = Superposition::from_str(&plan.air.superposition);
    let superposition = superposition.map_err(|error| error.to_string())?;
    let effects = plan.air.effects.unwrap_or_default();
    if let Some(problem) = effects.problems().first() {
        return Err(format!("an effect: {problem}"));
    }
    let flown = Flown::of(&effects).map_err(|refused| {
        let (name, why) = refused[0];
        format!("`{name}` cannot be flown: {why}")
    })?;
    Ok((flown.superposition.unwrap_or(superposition), flown))
}
