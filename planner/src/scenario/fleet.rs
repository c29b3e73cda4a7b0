//! The few lines of RON that go with a log or a show: which airframes fly, and where.
//!
//! ```ron
//! Fleet(
//!     airframe: "crazyflie-2.1",                     // of every drone that `drones` does not list
//!     air_limit: 0.3,                                // of every drone with none of its own
//!     airframes: { "courier": (mass_kg: 1.6, propeller_diameter_m: 0.2, motor_distance_m: 0.45) },
//!     drones: [ (name: "c1", airframe: "courier", air_limit: 0.4) ],
//!     bounds_m: (min: (0, 0, 0), max: (30, 20, 8)),  // its lower face is the floor
//!     obstacles: [], zones: [], air: (),             // as in a scenario
//! )
//! ```

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::airframes::airframes;
use super::fields::{Field, Reader, whole, within};
use super::limits::AIR_LIMIT;
use super::places::{bounds, obstacle, zone};
use super::problem::{Problem, Problems};
use super::source::Value;
use super::world::{Vehicle, World};
use super::written::{self, At, Bounds, Written};
use super::{Files, meaning, read};
use crate::plan::file::{Claims, PlanFile, arrival_s};
use crate::plan::trajectory::SAME_PLACE_M;
use crate::plan::{AirframeEntry, AtEnd, AtStart, DronePlan, Margins, Plan};

/// Room around all places where no bounds are given (m): chosen here.
const ROOM_M: f64 = 1.0;

/// The drones of a log or a show.
pub(super) struct Members<'a> {
    /// `log` or `show`.
    pub(super) of: &'static str,
    /// Names and first places (m), in its order.
    pub(super) firsts: Vec<(&'a str, Point3<f64>)>,
    /// A box around all that is flown, with room; its lower face is the floor (m). It is the place
    /// where no bounds are given.
    pub(super) room_m: (Point3<f64>, Point3<f64>),
}

/// A fleet's file, as far as it could be read.
pub(super) struct FleetFile {
    fleet: Option<StatedFleet>,
    problems: Vec<Problem>,
    /// Airframes that could not be read.
    spoilt: Vec<String>,
}

/// A box around some places, with room (m); its lower face is the floor, or, in whole millimetres,
/// just below the lowest of them where that is lower: pads and noise.
pub(super) fn around<'p>(
    places_m: impl Iterator<Item = &'p Point3<f64>>,
    floor_z_m: f64,
) -> (Point3<f64>, Point3<f64>) {
    let both = |(low_m, high_m): (Point3<f64>, Point3<f64>), (low_too_m, high_too_m)| {
        (low_m.inf(&low_too_m), high_m.sup(&high_too_m))
    };
    let boxes = places_m.map(|it| (*it, *it));
    let (low_m, high_m) = boxes.reduce(both).unwrap_or_default();
    let room_m = Vector3::repeat(ROOM_M);
    let (mut min_m, max_m) = (low_m - room_m, high_m + room_m);
    min_m.z = match low_m.z < floor_z_m - SAME_PLACE_M {
        true => (low_m.z * 1e3).floor() / 1e3,
        false => floor_z_m,
    };
    (min_m, max_m)
}

pub(super) fn read_fleet(text: &str) -> FleetFile {
    let mut spoilt = Vec::new();
    let (fleet, problems) = whole(text, |reader, value| fleet_of(reader, value, &mut spoilt));
    FleetFile {
        fleet,
        problems,
        spoilt,
    }
}

impl FleetFile {
    /// Where a drone's (0, 0, 0) lies in the world (m), if the file says.
    pub(super) fn origin_m(&self, name: &str) -> Option<Point3<f64>> {
        let listed = self.fleet.as_ref()?.drones.iter();
        let mut of_name = listed.filter(|it| it.name == name);
        Some(of_name.next()?.origin_m.as_ref()?.value)
    }

    /// The height of the floor, if the file says (m).
    pub(super) fn floor_z_m(&self) -> Option<f64> {
        Some(self.fleet.as_ref()?.bounds_m.as_ref()?.min.value.z)
    }

    /// The scenario that the drones of a log or a show would have had, without tasks, and the
    /// assumptions.
    ///
    /// # Errors
    ///
    /// Everything that is wrong with the file, each at its place in it.
    pub(super) fn world(
        mut self,
        name: &str,
        members: &Members<'_>,
        files: &Files<'_>,
    ) -> Result<(World, Vec<String>), Problems> {
        let mut remarks = Vec::new();
        let problems = &mut self.problems;
        let fleet = self.fleet;
        let written = fleet.map(|it| it.written(name, members, problems, &mut remarks));
        let world = written.map(|written| {
            let (world, more) = meaning::world(&written, &self.spoilt, files);
            problems.extend(more);
            world
        });
        match world.filter(|_| problems.is_empty()) {
            Some(world) => Ok((world, remarks)),
            None => Err(Problems(self.problems)),
        }
    }
}

/// What these drones fly, as a plan to judge: a log or a show gives places, not limits.
pub(super) fn as_plan(world: &World, mut drones: Vec<DronePlan>, remarks: Vec<String>) -> PlanFile {
    for drone in &mut drones {
        drone.arrives_s = arrival_s(drone, None);
    }
    PlanFile {
        claims: Claims::of_none(drones.len()),
        plan: Plan {
            cell_m: None,
            margins: Margins::default(),
            ..world.plan_of(drones)
        },
        filled: Vec::new(),
        remarks,
    }
}

/// The airframe of a drone that flies up to a speed (m/s) and states no other limit.
pub(super) fn without_limits(vehicle: &Vehicle, world: &World, speed_mps: f64) -> AirframeEntry {
    AirframeEntry {
        max_speed_mps: speed_mps,
        max_climb_mps: None,
        max_descent_mps: None,
        max_acceleration_mps2: None,
        max_jerk_mps3: None,
        ..vehicle.entry(world.air.density_kg_per_m3())
    }
}

/// What the airframes' file says.
struct StatedFleet {
    bounds_m: Option<Bounds>,
    air: written::Air,
    obstacles: Vec<written::Obstacle>,
    zones: Vec<written::Zone>,
    airframes: BTreeMap<String, written::Airframe>,
    drones: Vec<Listed>,
    /// Of the drones that are not listed.
    airframe: Option<At<String>>,
    /// Of the drones with none of their own; `None`: a scenario's default.
    air_limit: Option<f64>,
    /// The whole record.
    at: std::ops::Range<usize>,
}

/// A drone of the airframes' file.
struct Listed {
    name: String,
    airframe: At<String>,
    air_limit: Option<f64>,
    /// Where its (0, 0, 0) lies in the world (m).
    origin_m: Option<At<Point3<f64>>>,
}

/// Reads the airframes' file.
fn fleet_of<'t>(
    reader: &mut Reader<'t>,
    value: Value<'t>,
    spoilt: &mut Vec<String>,
) -> Option<StatedFleet> {
    let mut record = reader.record(value, "Fleet", "the fleet".to_owned())?;
    let bounds_m = record.optional(reader, "bounds_m", bounds);
    let air = record.optional(reader, "air", read::air);
    let list = |reader: &mut Reader<'t>, field: Field<'_, 't>| Some(reader.list(field, obstacle));
    let obstacles = record.optional(reader, "obstacles", list);
    let list = |reader: &mut Reader<'t>, field: Field<'_, 't>| Some(reader.list(field, zone));
    let zones = record.optional(reader, "zones", list);
    let airframes = record.optional(reader, "airframes", |reader, field| {
        Some(airframes(reader, field, spoilt))
    });
    let airframe = record.optional(reader, "airframe", Reader::text);
    let air_limit = record.optional(reader, "air_limit", within(&AIR_LIMIT));
    let list = |reader: &mut Reader<'t>, field: Field<'_, 't>| Some(reader.list(field, drone));
    let drones = record.optional(reader, "drones", list);
    record.close(reader);
    Some(StatedFleet {
        bounds_m,
        air: air.unwrap_or_default(),
        obstacles: obstacles.unwrap_or_default(),
        zones: zones.unwrap_or_default(),
        airframes: airframes.unwrap_or_default(),
        drones: drones.unwrap_or_default(),
        airframe,
        air_limit,
        at: value.head(),
    })
}

/// One drone of the airframes' file.
fn drone<'t>(reader: &mut Reader<'t>, value: Value<'t>, index: usize) -> Option<Listed> {
    let mut record = reader.named(value, "Drone", index)?;
    let name = record.required(reader, "name", Reader::name);
    let airframe = record.required(reader, "airframe", Reader::text);
    let air_limit = record.optional(reader, "air_limit", within(&AIR_LIMIT));
    let origin_m = record.optional(reader, "origin_m", Reader::place);
    record.close(reader);
    Some(Listed {
        name: name?,
        airframe: airframe?,
        air_limit,
        origin_m,
    })
}

impl StatedFleet {
    /// The scenario that these drones would have had, without tasks.
    fn written(
        self,
        name: &str,
        members: &Members<'_>,
        problems: &mut Vec<Problem>,
        remarks: &mut Vec<String>,
    ) -> Written {
        let of = members.of;
        let mut planning = written::Planning::default();
        planning.air_limit = self.air_limit.unwrap_or(planning.air_limit);
        let listed: BTreeMap<&str, &Listed> =
            self.drones.iter().map(|it| (&it.name[..], it)).collect();
        let mut drones = Vec::new();
        for &(name, first_m) in &members.firsts {
            let listed = listed.get(name);
            let airframe = listed.map(|it| &it.airframe).or(self.airframe.as_ref());
            let Some(airframe) = airframe.cloned() else {
                let message = format!("drone `{name}` of the {of} has no airframe");
                let help = format!(
                    "drones: [(name: \"{name}\", airframe: ...)], or airframe: ... for all"
                );
                problems.push(Problem::at(&self.at, message).help(help));
                continue;
            };
            drones.push(written::Drone {
                name: name.to_owned(),
                start_m: At {
                    value: first_m,
                    at: airframe.at.clone(),
                },
                airframe,
                at_start: AtStart::Hover,
                tasks: Vec::new(),
                at_end: AtEnd::Hover,
                air_limit: listed.and_then(|it| it.air_limit),
                is_whole: true,
                // Its start is judged, not refused.
                has_start: false,
            });
        }
        for listed in &self.drones {
            let name = &listed.name;
            if !members.firsts.iter().any(|(known, _)| known == name) {
                let message = format!("drone `{name}` is not in the {of}");
                problems.push(Problem::at(&listed.airframe.at, message));
            }
            let origin_m = listed.origin_m.as_ref().filter(|_| of == "log");
            if let Some(origin_m) = origin_m {
                let message = format!("`origin_m` of drone `{name}`: a log has one origin for all");
                problems.push(Problem::at(&origin_m.at, message));
            }
        }
        let at = self.at.clone();
        let bounds_m = self.bounds_m.unwrap_or_else(|| {
            let (low, high) = members.room_m;
            remarks.push(format!(
                "no bounds_m given: the floor is at z = {} m, all else is open",
                low.z
            ));
            let place = |value| At {
                value,
                at: at.clone(),
            };
            Bounds {
                min: place(low),
                max: place(high),
            }
        });
        Written {
            name: name.to_owned(),
            bounds_m,
            origin: None,
            air: self.air,
            obstacles: self.obstacles,
            zones: self.zones,
            airframes: self.airframes,
            drones,
            formations: Vec::new(),
            planning,
        }
    }
}
