//! What a show or a table of setpoints wants to be flown, as a plan that can be judged: each
//! drone's trajectory, and a few lines of RON that say which airframes they are.
//!
//! Such files say where drones are to be, and not which limits hold: speeds and corners are
//! reported, not judged, and no margins are assumed. A drone that rests on the floor or on an
//! obstacle at its first place starts landed, one that does at its last place lands there; one that
//! is in the air at its last place hovers on.

use nalgebra::{Point3, Vector3};
use thiserror::Error;

use super::Files;
use super::fleet::{Members, around, as_plan, read_fleet, without_limits};
use super::placement::{SUPPORT_TOLERANCE_M, landing_place_m};
use super::problem::Problems;
use super::solid::Solids;
use super::world::{Drone, World};
use crate::plan::cause::as_typed;
use crate::plan::file::{PlanFile, airborne_s};
use crate::plan::trajectory::{Motion, SAME_PLACE_M};
use crate::plan::{AtEnd, AtStart, DronePlan, TrajectoryEntry};

/// A place this far below the floor is a mistake in the file's axes (m), chosen here: pads are
/// measured to a few centimetres.
const BELOW_M: f64 = 0.05;
/// A drone whose last place is this near to where it would rest has landed (m), as the verifier has
/// it.
const LANDED_M: f64 = 0.01;
/// Changes of velocity in no time up to this are rounding in the file (m/s), chosen here: a
/// millisecond in a tenth of a second at 2 m/s.
const REPORTED_TURN_MPS: f64 = 0.05;

/// What one drone is to fly.
#[derive(Clone, Debug, PartialEq)]
pub struct Intended {
    /// None twice.
    pub name: String,
    /// Rotor-plane centre, z up (m, s); without masses.
    pub trajectory: TrajectoryEntry,
}

/// Why a show makes no plan.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum IntendedError {
    /// No drone.
    #[error("there are no drones in it")]
    Empty,
    /// All drones that cannot be flown as they say.
    #[error("{}", .0.iter().map(DroneFault::to_string).collect::<Vec<_>>().join("; "))]
    Drones(Vec<DroneFault>),
    /// What is wrong with the airframes' file.
    #[error(transparent)]
    Fleet(#[from] Problems),
}

/// Why a drone of a show cannot be flown as it says.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum DroneFault {
    /// A trajectory that is none.
    #[error("`{drone}`: {why}")]
    Trajectory {
        /// Its name.
        drone: String,
        /// What is wrong.
        why: String,
    },
    /// Two of one name.
    #[error("two drones are called `{0}`")]
    Twice(String),
    /// Under the floor: its axes are not the assumed ones.
    #[error("`{drone}` is at z = {z_m:.2} m at {at_s:.2} s, below the floor (z = {} m)", as_typed(*floor_z_m))]
    BelowFloor {
        /// Its name.
        drone: String,
        /// First found (s).
        at_s: f64,
        /// m.
        z_m: f64,
        /// m.
        floor_z_m: f64,
    },
}

/// The plan that a show is, judged like any other; what was assumed stands in
/// [`PlanFile::remarks`]. `fleet` is the text of a file that says which airframes fly, and where;
/// `origin_m` of a drone there is where the (0, 0, 0) of its own places lies.
///
/// # Errors
///
/// Everything that is wrong with `fleet`, each at its place in it; or all drones that cannot be
/// flown as they say.
pub fn intended_as_plan(
    name: &str,
    drones: Vec<Intended>,
    fleet: &str,
    files: &Files<'_>,
) -> Result<PlanFile, IntendedError> {
    let fleet = read_fleet(fleet);
    let mut drones = drones;
    check(&drones)?;
    for drone in &mut drones {
        if let Some(origin_m) = fleet.origin_m(&drone.name) {
            drone.move_by(origin_m.coords);
        }
    }
    let mut remarks = drones_from_zero(&mut drones);
    let floor_z_m = fleet.floor_z_m().unwrap_or(0.0);
    let members = Members {
        of: "show",
        firsts: drones.iter().map(Intended::first).collect(),
        room_m: around(drones.iter().flat_map(Intended::places_m), floor_z_m),
    };
    let (world, more) = fleet.world(name, &members, files)?;
    remarks.extend(more);
    let below = drones.iter().filter_map(|it| it.below(floor_z_m));
    none_of(below.collect())?;
    remarks.extend(remarks_of(&world, &drones));
    let solids = Solids::new(&world.obstacles);
    let flown = world.drones.iter().zip(drones);
    let flown = flown.map(|(drone, intended)| plan_of(&world, &solids, drone, intended));
    Ok(as_plan(&world, flown.collect(), remarks))
}

/// That there are no faults.
fn none_of(faults: Vec<DroneFault>) -> Result<(), IntendedError> {
    match faults.is_empty() {
        true => Ok(()),
        false => Err(IntendedError::Drones(faults)),
    }
}

/// What keeps a plan from being made at all.
fn check(drones: &[Intended]) -> Result<(), IntendedError> {
    if drones.is_empty() {
        return Err(IntendedError::Empty);
    }
    let mut names: Vec<&str> = drones.iter().map(|it| &it.name[..]).collect();
    names.sort_unstable();
    let twice = names.windows(2).filter(|two| two[0] == two[1]);
    let mut faults: Vec<DroneFault> = twice
        .map(|two| DroneFault::Twice(two[0].to_owned()))
        .collect();
    faults.dedup();
    for drone in drones {
        let entry = &drone.trajectory;
        let mut places_m = (entry.position_m.iter()).chain(entry.control_m.iter().flatten());
        let is_finite = places_m.all(|at_m| at_m.iter().all(|it| it.is_finite()))
            && entry.t_s.iter().all(|it| it.is_finite());
        let has_places = !entry.t_s.is_empty() && entry.t_s.len() == entry.position_m.len();
        let why = match (has_places, is_finite, entry.t_s.is_sorted()) {
            (false, _, _) => "it has no places, or not one for each time",
            (_, false, _) => "not all of it is finite",
            (_, _, false) => "its time runs backwards",
            _ => continue,
        };
        faults.push(DroneFault::Trajectory {
            drone: drone.name.clone(),
            why: why.to_owned(),
        });
    }
    none_of(faults)
}

/// Lets the first of all begin at time 0.
fn drones_from_zero(drones: &mut [Intended]) -> Vec<String> {
    let begins_s = drones.iter().map(|it| it.trajectory.t_s[0]);
    let begins_s = begins_s.fold(f64::INFINITY, f64::min);
    if begins_s == 0.0 {
        return Vec::new();
    }
    let times = drones.iter_mut().flat_map(|it| &mut it.trajectory.t_s);
    times.for_each(|t_s| *t_s -= begins_s);
    vec![format!("time 0 is {} s of the file", as_typed(begins_s))]
}

impl Intended {
    fn first(&self) -> (&str, Point3<f64>) {
        (&self.name, self.trajectory.position_m[0])
    }

    /// Break points and control points: all that is flown lies in their hull.
    fn places_m(&self) -> impl Iterator<Item = &Point3<f64>> {
        let entry = &self.trajectory;
        (entry.position_m.iter()).chain(entry.control_m.iter().flatten())
    }

    fn move_by(&mut self, by_m: Vector3<f64>) {
        let entry = &mut self.trajectory;
        let places_m = entry.position_m.iter_mut();
        let places_m = places_m.chain(entry.control_m.iter_mut().flatten());
        places_m.for_each(|it| *it += by_m);
    }

    fn motions(&self) -> impl DoubleEndedIterator<Item = Motion> {
        (0..self.trajectory.t_s.len()).filter_map(|piece| self.trajectory.motion(piece))
    }

    /// That it goes below a floor (m).
    fn below(&self, floor_z_m: f64) -> Option<DroneFault> {
        let lowest_m = floor_z_m - BELOW_M;
        let entry = &self.trajectory;
        let points = entry.t_s.iter().zip(&entry.position_m);
        let points = points.map(|(t_s, at_m)| (*t_s, at_m.z));
        let bent = self.motions().filter(|it| !it.is_straight());
        let between = bent.flat_map(|it| {
            (1..16).map(move |k| {
                let t_s = it.from_s + (it.until_s - it.from_s) * f64::from(k) / 16.0;
                (t_s, it.at_m(t_s).z)
            })
        });
        let below = points.chain(between).filter(|(_, z_m)| *z_m < lowest_m);
        let (at_s, z_m) = below.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(DroneFault::BelowFloor {
            drone: self.name.clone(),
            at_s,
            z_m,
            floor_z_m,
        })
    }

    /// Its highest speed (m/s), and when (s).
    fn fastest(&self) -> (f64, f64) {
        let mut fastest = (0.0, 0.0);
        for motion in self.motions() {
            if let Some(faster) = motion.highest_over(&|v| v.norm(), fastest.0) {
                fastest = faster;
            }
        }
        fastest
    }

    /// Its largest change of velocity in no time (m/s), and when (s).
    fn sharpest(&self) -> (f64, f64) {
        let motions: Vec<Motion> = self.motions().collect();
        let turns = motions.windows(2).map(|two| {
            let t_s = two[1].from_s;
            let by_mps = two[1].velocity_mps(t_s) - two[0].velocity_mps(t_s);
            (by_mps.norm(), t_s)
        });
        turns.fold((0.0, 0.0), |most, it| if it.0 > most.0 { it } else { most })
    }
}

/// What is reported and not judged: the drone that is fastest over its airframe's speed, and the
/// sharpest corner.
fn remarks_of(world: &World, drones: &[Intended]) -> Vec<String> {
    let mut remarks = Vec::new();
    let fastest = world.drones.iter().zip(drones).map(|(drone, intended)| {
        let (speed_mps, at_s) = intended.fastest();
        (
            speed_mps / drone.vehicle.max_speed_mps,
            speed_mps,
            at_s,
            drone,
        )
    });
    let fastest = fastest.max_by(|a, b| a.0.total_cmp(&b.0));
    // By more than the rounding of times to milliseconds.
    if let Some((_, speed_mps, at_s, drone)) = fastest.filter(|it| it.0 > 1.01) {
        let (name, most_mps) = (&drone.name, drone.vehicle.max_speed_mps);
        let airframe = drone.vehicle.airframe.name();
        remarks.push(format!(
            "speeds are told, not judged: `{name}` flies {speed_mps:.2} m/s at {at_s:.2} s; `{airframe}` has max_speed_mps {most_mps}"
        ));
    }
    let sharpest = drones.iter().map(|it| (it.sharpest(), &it.name));
    let sharpest = sharpest.max_by(|a, b| a.0.0.total_cmp(&b.0.0));
    if let Some(((by_mps, at_s), name)) = sharpest.filter(|it| it.0.0 > REPORTED_TURN_MPS) {
        remarks.push(format!(
            "corners are told, not judged: `{name}` changes its velocity by {by_mps:.2} m/s in no time at {at_s:.2} s"
        ));
    }
    remarks
}

/// One drone's part of the plan.
fn plan_of(world: &World, solids: &Solids, drone: &Drone, intended: Intended) -> DronePlan {
    let vehicle = &drone.vehicle;
    let above_rest_m = |at_m: Point3<f64>| {
        at_m.z - landing_place_m(&world.bounds_m, solids, at_m, vehicle.body_radius_m).z
    };
    let (speed_mps, _) = intended.fastest();
    let mut entry = intended.trajectory;
    entry.mass_kg = vec![vehicle.airframe.mass_kg(); entry.t_s.len()];
    entry.turns_at_once = true;
    let (first_m, last_m) = (entry.position_m[0], entry.position_m[entry.t_s.len() - 1]);
    let at_start = match above_rest_m(first_m) <= SUPPORT_TOLERANCE_M {
        true => AtStart::Landed,
        false => AtStart::Hover,
    };
    let at_end = match above_rest_m(last_m) <= LANDED_M {
        true => AtEnd::Land,
        false => AtEnd::Hover,
    };
    if at_end == AtEnd::Land {
        // It rests from here on.
        let stands = |k: usize| {
            let bends_m = entry.control_m.get(k).into_iter().flatten();
            let mut places_m = bends_m.chain([&entry.position_m[k]]);
            places_m.all(|it| (it - last_m).norm() <= SAME_PLACE_M)
        };
        let rests = (0..entry.t_s.len() - 1).rev().take_while(|k| stands(*k));
        let points = entry.t_s.len() - rests.count();
        entry.t_s.truncate(points);
        entry.position_m.truncate(points);
        entry.mass_kg.truncate(points);
        entry.control_m.truncate(points.saturating_sub(1));
    }
    let mut flown = DronePlan {
        name: drone.name.clone(),
        airframe: without_limits(vehicle, world, vehicle.max_speed_mps.max(1.001 * speed_mps)),
        air_limit: drone.air_limit,
        at_start,
        at_end,
        trajectory: entry,
        ..DronePlan::default()
    };
    flown.airborne_s = airborne_s(&flown, false);
    flown
}
