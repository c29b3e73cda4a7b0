//! What was typed, field by field, with the places that later messages point at.
//!
//! These types are also the source of the JSON schema: a doc comment below is what its reader sees.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

use airflow::Superposition;
use nalgebra::Point3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};

use super::limits::{
    AIR_LIMIT, ALTITUDE_M, BODY_RADIUS_M, CELL_M, CLEARANCE_M, DWELL_S, ENERGY_WEIGHT, HEADING_DEG,
    LATITUDE_DEG, LOAD_KG, LONGITUDE_DEG, MASS_KG, MAX_ACCELERATION_MPS2, MAX_JERK_MPS3,
    MAX_SPEED_MPS, MOTOR_DISTANCE_M, PRESSURE_PA, PROPELLER_DIAMETER_M, SIZE_M, TEMPERATURE_C,
    TIME_MARGIN_S, TRACKING_M, VERTICAL_SPEED_MPS, WIDTH_FACTOR, ZONE_AIR_LIMIT_MPS,
};
use crate::plan::AIR_LIMIT_DEFAULT;
pub(super) use crate::plan::MAX_SPEED_DEFAULT_MPS;
use crate::scenario::world::{self, AtEnd, AtStart, CONVECTION_DEFAULT, PathMotion, Vehicle};

/// Air limit of a zone that states none (m/s): the upper end of Beaufort 1, "light air", which
/// moves no paper.
pub(super) const ZONE_AIR_LIMIT_DEFAULT_MPS: f64 = 1.5;

/// Propellers of an airframe that states no number: a quadrotor, as the near-field model knows it.
pub(super) const PROPELLERS_DEFAULT: u32 = 4;
/// Width factor of an airframe that states none: rotors without cant.
pub(super) const WIDTH_FACTOR_DEFAULT: f64 = 1.0;

/// A value and the bytes of the text that it was read from.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct At<T> {
    /// What was read.
    pub(super) value: T,
    /// Bytes of the whole text.
    pub(super) at: Range<usize>,
}

/// A point of the world: (x, y, z) in metres, z up. Where a drone is, it is the centre of its rotor
/// plane.
pub(super) type Place = At<Point3<f64>>;

/// How a place looks in the schema.
struct Coordinates;

impl JsonSchema for Coordinates {
    fn schema_name() -> Cow<'static, str> {
        "Place".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "(x, y, z) in metres, z up, within 10 km of the origin",
            "type": "array", "items": { "type": "number" }, "minItems": 3, "maxItems": 3
        })
    }
}

/// A place, a fleet and its tasks, as a person writes them in RON (a record is `(key: value, ...)`,
/// its name before the bracket is optional).
#[derive(Clone, Debug, JsonSchema)]
#[schemars(rename = "Scenario", deny_unknown_fields)]
pub(super) struct Written {
    /// What the plan and the output folder are called.
    pub(super) name: String,
    /// The box that no rotor-plane centre leaves; its lower face is the floor, where wakes end.
    pub(super) bounds_m: Bounds,
    /// Where (0, 0, 0) lies on the Earth, and where +x points: for exports that leave the local
    /// frame.
    #[schemars(default)]
    pub(super) origin: Option<Origin>,
    /// Weather and flow model.
    #[schemars(default)]
    pub(super) air: Air,
    /// What no body may touch.
    #[schemars(default, extend("default" = []))]
    pub(super) obstacles: Vec<Obstacle>,
    /// Boxes for people or goods in which the air itself is limited.
    #[schemars(default, extend("default" = []))]
    pub(super) zones: Vec<Zone>,
    /// Airframes of your own, by name; one that is called like a preset replaces it.
    #[schemars(default, extend("default" = {}))]
    pub(super) airframes: BTreeMap<String, Airframe>,
    /// The fleet, at least one drone.
    #[schemars(length(min = 1))]
    pub(super) drones: Vec<Drone>,
    /// Goals that any drone of a group may take, in order, after the tasks of each.
    #[schemars(default, extend("default" = []))]
    pub(super) formations: Vec<Formation>,
    /// How to plan.
    #[schemars(default)]
    pub(super) planning: Planning,
}

impl Written {
    /// Temperature and pressure.
    pub(super) fn air(&self) -> airflow::Air {
        airflow::Air {
            temperature_c: self.air.temperature_c,
            pressure_pa: self.air.pressure_pa,
        }
    }

    /// The scenario's own airframe of this name, or the preset, as it is flown; `None` where there
    /// is none.
    ///
    /// # Errors
    /// Why it cannot fly.
    pub(super) fn vehicle(&self, name: &str) -> Option<Result<Vehicle, String>> {
        let density_kg_per_m3 = self.air().density_kg_per_m3();
        let Some(own) = self.airframes.get(name) else {
            let airframe = airflow::Airframe::preset(name)?;
            let speed_mps = MAX_SPEED_DEFAULT_MPS;
            return Some(Ok(Vehicle::new(airframe, speed_mps, density_kg_per_m3)));
        };
        let airframe = airflow::Airframe::new(
            name,
            own.mass_kg,
            own.propellers,
            own.propeller_diameter_m,
            own.motor_distance_m,
            own.width_factor,
        );
        let or = |own: Option<f64>, default: f64| own.unwrap_or(default);
        let airframe = airframe.map_err(|error| error.to_string());
        Some(airframe.map(|airframe| {
            let by_default = Vehicle::new(airframe, own.max_speed_mps, density_kg_per_m3);
            let (acceleration, jerk) = (own.max_acceleration_mps2, own.max_jerk_mps3);
            Vehicle {
                body_radius_m: or(own.body_radius_m, by_default.body_radius_m),
                max_climb_mps: or(own.max_climb_mps, by_default.max_climb_mps),
                max_descent_mps: or(own.max_descent_mps, by_default.max_descent_mps),
                max_acceleration_mps2: or(acceleration, by_default.max_acceleration_mps2),
                max_jerk_mps3: or(jerk, by_default.max_jerk_mps3),
                ..by_default
            }
        }))
    }
}

/// A box with its lowest and its highest corner.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct Bounds {
    /// Lowest corner (m).
    #[schemars(with = "Coordinates")]
    pub(super) min: Place,
    /// Highest corner (m).
    #[schemars(with = "Coordinates")]
    pub(super) max: Place,
}

/// Where the world lies on the Earth (WGS 84).
#[derive(Clone, Copy, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct Origin {
    /// Degrees, north positive.
    #[schemars(range(min = LATITUDE_DEG.low, max = LATITUDE_DEG.high))]
    pub(super) latitude_deg: f64,
    /// Degrees, east positive.
    #[schemars(range(min = LONGITUDE_DEG.low, max = LONGITUDE_DEG.high))]
    pub(super) longitude_deg: f64,
    /// Height above mean sea level (m).
    #[schemars(range(min = ALTITUDE_M.low, max = ALTITUDE_M.high))]
    pub(super) altitude_m: f64,
    /// Heading of +x (degrees, clockwise from north).
    #[schemars(range(min = HEADING_DEG.low, max = HEADING_DEG.high))]
    pub(super) heading_deg: f64,
}

/// Weather and flow model.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub(super) struct Air {
    /// Degrees Celsius.
    #[schemars(range(min = TEMPERATURE_C.low, max = TEMPERATURE_C.high))]
    pub(super) temperature_c: f64,
    /// Pa.
    #[schemars(range(min = PRESSURE_PA.low, max = PRESSURE_PA.high))]
    pub(super) pressure_pa: f64,
    /// How several wakes add up at a point: by momentum (root of the sum of squares), linearly, or
    /// the strongest alone.
    #[schemars(with = "String", extend("enum" = ["Momentum", "Linear", "Strongest"], "default" = "Momentum"))]
    pub(super) superposition: Superposition,
    /// A calibrated jet: a file beside the scenario as `plan calibrate` writes it,
    /// `Jet(centreline: 10.11, spreading: 0.07668, origin: -5.817)` with its intervals and origins.
    #[schemars(with = "Option<String>", extend("default" = "the paper's jet"))]
    pub(super) jet: Option<At<String>>,
    /// A finding: a file beside the scenario as `plan diagnose` writes it,
    /// `Finding(effects: (crossflow: Some((wind_mps: (0.38, 0.27)))))` with its evidence. The plan
    /// is flown through, and checked in, the air that it corrects.
    #[schemars(with = "Option<String>", extend("default" = "nothing is added to the hover jet"))]
    pub(super) finding: Option<At<String>>,
    /// How fast air is carried down, lowest and highest speed over the centreline's, as
    /// `(0.6, 1.0)`: air at a depth left its drone up to the delay of the lowest ago, and the plan
    /// holds for every delay from none on, the same factor for all wakes at a time. `None`:
    /// quasi-static, wakes follow their drones at once. Where it is not given it is given up for a
    /// fleet that finds no paths with it, and the plan says so.
    #[schemars(with = "Option<[f64; 2]>", extend("default" = written_range(CONVECTION_DEFAULT)))]
    pub(super) convection: Option<Option<[f64; 2]>>,
}

/// A range as a scenario has it.
fn written_range([low, high]: [f64; 2]) -> String {
    format!("({low:?}, {high:?})")
}

/// A solid: a box (`min_m`, `max_m`), an upright cylinder (`base_m`, `radius_m`, `height_m`) or a
/// triangle mesh (`mesh`, `at_m`).
#[derive(Clone, Debug, JsonSchema)]
#[schemars(deny_unknown_fields, extend("oneOf" = [
    { "required": ["min_m", "max_m"] },
    { "required": ["base_m", "radius_m", "height_m"] },
    { "required": ["mesh"] },
]))]
pub(super) struct Obstacle {
    /// What messages call it.
    #[schemars(default, with = "String", extend("default" = "obstacle-1, obstacle-2, ..."))]
    pub(super) name: String,
    /// Box: lowest corner (m).
    #[schemars(with = "Option<Coordinates>")]
    pub(super) min_m: Option<Place>,
    /// Box: highest corner (m).
    #[schemars(with = "Option<Coordinates>")]
    pub(super) max_m: Option<Place>,
    /// Cylinder: centre of the lower face (m).
    #[schemars(with = "Option<Coordinates>")]
    pub(super) base_m: Option<Place>,
    /// Cylinder: radius (m).
    #[schemars(range(min = SIZE_M.low, max = SIZE_M.high))]
    pub(super) radius_m: Option<f64>,
    /// Cylinder: height (m).
    #[schemars(range(min = SIZE_M.low, max = SIZE_M.high))]
    pub(super) height_m: Option<f64>,
    /// Mesh: an OBJ file beside the scenario, in metres, z up.
    #[schemars(with = "Option<String>")]
    pub(super) mesh: Option<At<String>>,
    /// Mesh: where its origin is put (m).
    #[schemars(with = "Option<Coordinates>", extend("default" = [0, 0, 0]))]
    pub(super) at_m: Option<Place>,
}

/// A box in which the speed of all wakes together stays at or below a limit, that bodies keep out
/// of, or both.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct Zone {
    /// What messages call it.
    #[schemars(default, with = "String", extend("default" = "zone-1, zone-2, ..."))]
    pub(super) name: String,
    /// Lowest corner (m).
    #[schemars(with = "Coordinates")]
    pub(super) min_m: Place,
    /// Highest corner (m).
    #[schemars(with = "Coordinates")]
    pub(super) max_m: Place,
    /// Downward speed of all wakes together (m/s); the default is the upper end of Beaufort 1, and
    /// no limit in a zone that keeps bodies out and states none.
    #[schemars(extend("default" = ZONE_AIR_LIMIT_DEFAULT_MPS), range(min = ZONE_AIR_LIMIT_MPS.low, max = ZONE_AIR_LIMIT_MPS.high))]
    pub(super) air_limit_mps: Option<f64>,
    /// No body may be inside. A zone with people needs both.
    #[schemars(default, extend("default" = false))]
    pub(super) keep_out: bool,
}

/// An airframe of your own.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct Airframe {
    /// Without payload (kg).
    #[schemars(range(min = MASS_KG.low, max = MASS_KG.high))]
    pub(super) mass_kg: f64,
    /// Number of propellers. The near-field model knows four; with another number the far field and
    /// the column are used, and a note says so.
    #[schemars(default, extend("default" = PROPELLERS_DEFAULT), range(min = 2, max = 16))]
    pub(super) propellers: u32,
    /// m.
    #[schemars(range(min = PROPELLER_DIAMETER_M.low, max = PROPELLER_DIAMETER_M.high))]
    pub(super) propeller_diameter_m: f64,
    /// Diagonal, motor to motor (m).
    #[schemars(range(min = MOTOR_DISTANCE_M.low, max = MOTOR_DISTANCE_M.high))]
    pub(super) motor_distance_m: f64,
    /// Multiplies the jet's half-width and divides its centreline speed; 1 for uncanted rotors.
    #[schemars(default, extend("default" = WIDTH_FACTOR_DEFAULT), range(min = WIDTH_FACTOR.low, max = WIDTH_FACTOR.high))]
    pub(super) width_factor: f64,
    /// Radius of the ball that no other body and no obstacle may enter (m).
    #[schemars(range(min = BODY_RADIUS_M.low, max = BODY_RADIUS_M.high),
        extend("default" = "to the rotor tips: motor_distance_m / 2 + propeller_diameter_m / 2"))]
    pub(super) body_radius_m: Option<f64>,
    /// Highest speed (m/s); also that of the presets.
    #[schemars(default, extend("default" = MAX_SPEED_DEFAULT_MPS), range(min = MAX_SPEED_MPS.low, max = MAX_SPEED_MPS.high))]
    pub(super) max_speed_mps: f64,
    /// Highest vertical speed upwards (m/s).
    #[schemars(range(min = VERTICAL_SPEED_MPS.low, max = VERTICAL_SPEED_MPS.high), extend("default" = "max_speed_mps"))]
    pub(super) max_climb_mps: Option<f64>,
    /// Highest vertical speed downwards (m/s), in flight and at landing.
    #[schemars(range(min = VERTICAL_SPEED_MPS.low, max = VERTICAL_SPEED_MPS.high),
        extend("default" = "the smaller of max_speed_mps and 0.4 times its induced velocity"))]
    pub(super) max_descent_mps: Option<f64>,
    /// m/s2; straight legs change their velocity in no time.
    #[schemars(range(min = MAX_ACCELERATION_MPS2.low, max = MAX_ACCELERATION_MPS2.high),
        extend("default" = "4 below a motor distance of 0.6 m, 2.5 from there on"))]
    pub(super) max_acceleration_mps2: Option<f64>,
    /// m/s3.
    #[schemars(range(min = MAX_JERK_MPS3.low, max = MAX_JERK_MPS3.high),
        extend("default" = "20 below a motor distance of 0.6 m, 8 from there on"))]
    pub(super) max_jerk_mps3: Option<f64>,
}

/// One drone and what it has to do.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct Drone {
    /// Unique.
    pub(super) name: String,
    /// A preset or one of `airframes`.
    #[schemars(with = "String")]
    pub(super) airframe: At<String>,
    /// Centre of its rotor plane at time 0 (m).
    #[schemars(with = "Coordinates")]
    pub(super) start_m: Place,
    /// In the air, or standing there without a wake until it first moves.
    #[schemars(default, extend("default" = "Hover"))]
    pub(super) at_start: AtStart,
    /// Where it goes, in order.
    #[schemars(default, extend("default" = []))]
    pub(super) tasks: Vec<Task>,
    /// After its last dwell: hover there, land straight below, or leave with body and wake.
    #[schemars(default, extend("default" = "Hover"))]
    pub(super) at_end: AtEnd,
    /// Mean air over its rotor discs that it bears, over its own induced velocity at its current
    /// mass.
    #[schemars(range(min = AIR_LIMIT.low, max = AIR_LIMIT.high), extend("default" = "that of planning"))]
    pub(super) air_limit: Option<f64>,
    /// Whether all of it could be read.
    #[schemars(skip)]
    pub(super) is_whole: bool,
    /// Whether `start_m` could.
    #[schemars(skip)]
    pub(super) has_start: bool,
}

/// A place to reach and to stay at for a while.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct Task {
    /// Where the centre of the rotor plane goes (m).
    #[schemars(with = "Coordinates")]
    pub(super) to_m: Place,
    /// How long it hovers there (s).
    #[schemars(default, range(min = DWELL_S.low, max = DWELL_S.high))]
    pub(super) dwell_s: f64,
    /// Payload carried from arrival here on (kg); 0: dropped.
    #[schemars(with = "Option<f64>", range(min = LOAD_KG.low, max = LOAD_KG.high), extend("default" = "unchanged"))]
    pub(super) load_kg: Option<At<f64>>,
    /// From and until when it is there, times of the plan, as `(20, 30)` (s): it comes no later,
    /// waits there if it comes earlier, and goes on no earlier.
    #[schemars(with = "Option<[f64; 2]>", extend("default" = "whenever it comes"))]
    pub(super) during_s: Option<At<[f64; 2]>>,
}

/// Goals that any drone of a group may take: as many as it has drones. They are given so that the
/// sum of straight flight times is least, and the price of each other's downwash during the stay.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(deny_unknown_fields, extend("oneOf" = [
    { "required": ["to_m"] },
    { "required": ["circle"] },
    { "required": ["sphere"] },
    { "required": ["home_m"] },
]))]
pub(super) struct Formation {
    /// Its place in the list, those that are not in order counted.
    #[schemars(skip)]
    pub(super) index: usize,
    /// Names of the group.
    #[schemars(with = "Option<Vec<String>>", length(min = 1), extend("default" = "all drones"))]
    pub(super) drones: Option<Vec<At<String>>>,
    /// Places, one for each drone (m).
    #[schemars(with = "Option<Vec<Coordinates>>")]
    pub(super) to_m: Option<At<Vec<Place>>>,
    /// Places on a level circle, equally spaced from +x on.
    #[schemars(with = "Option<Round>")]
    pub(super) circle: Option<At<Round>>,
    /// Places on a sphere, on a Fibonacci lattice: each has the same area around it.
    #[schemars(with = "Option<Round>")]
    pub(super) sphere: Option<At<Round>>,
    /// Each drone goes to so far above its own start (m).
    #[schemars(with = "Option<f64>", range(min = SIZE_M.low, max = SIZE_M.high))]
    pub(super) home_m: Option<At<f64>>,
    /// Of `home_m`: drones whose starts are too near to fly beside one another hover in layers so
    /// far above one another, as few as keep them apart (m).
    #[schemars(
        with = "Option<f64>",
        range(min = SIZE_M.low, max = SIZE_M.high),
        extend("default" = "one layer")
    )]
    pub(super) layer_m: Option<At<f64>>,
    /// How long each drone hovers there (s).
    #[schemars(default, range(min = DWELL_S.low, max = DWELL_S.high))]
    pub(super) dwell_s: f64,
    /// From and until when all are in place, times of the plan, as `(20, 30)` (s).
    #[schemars(with = "Option<[f64; 2]>", extend("default" = "each when it comes"))]
    pub(super) during_s: Option<At<[f64; 2]>>,
    /// The whole record.
    #[schemars(skip)]
    pub(super) at: Range<usize>,
}

/// A circle or a sphere.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(deny_unknown_fields)]
pub(super) struct Round {
    /// m.
    #[schemars(with = "Coordinates")]
    pub(super) centre_m: Place,
    /// m.
    #[schemars(range(min = SIZE_M.low, max = SIZE_M.high))]
    pub(super) radius_m: f64,
}

/// How to plan.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(default, deny_unknown_fields)]
pub(super) struct Planning {
    /// Spacing of the roadmap's lattice (m); unless it is given it is chosen, and the plan says
    /// why.
    #[schemars(range(min = CELL_M.low, max = CELL_M.high),
        extend("default" = "at most 1, less where drones stand closer or have to pass narrow gaps"))]
    pub(super) cell_m: Option<f64>,
    /// Air limit of every drone that states none of its own, over its induced velocity. 0.3 costs
    /// 16 % power.
    #[schemars(range(min = AIR_LIMIT.low, max = AIR_LIMIT.high))]
    pub(super) air_limit: f64,
    /// Gap between bodies, and from bodies to obstacles (m).
    #[schemars(range(min = CLEARANCE_M.low, max = CLEARANCE_M.high))]
    pub(super) clearance_m: f64,
    /// Each drone may be early or late by so much, whatever the others are (s).
    #[schemars(range(min = TIME_MARGIN_S.low, max = TIME_MARGIN_S.high))]
    pub(super) time_margin_s: f64,
    /// Each drone that flies may be off its path by so much in any direction (m).
    #[schemars(range(min = TRACKING_M.low, max = TRACKING_M.high))]
    pub(super) tracking_m: f64,
    /// What is flown between the places of a path: corners in no time, or within the airframes'
    /// limits of acceleration and jerk. Where it is not given, smooth motion is given up for a
    /// fleet that finds no paths with it, and the plan says so.
    #[schemars(with = "PathMotion", extend("default" = PathMotion::default()))]
    pub(super) motion: Option<PathMotion>,
    /// Breaks ties and orders restarts: same scenario, same seed, same plan.
    pub(super) seed: u64,
    /// Seconds of delay that one second's worth of hover energy is worth; 0 ignores energy, limits
    /// hold anyway.
    #[schemars(range(min = ENERGY_WEIGHT.low, max = ENERGY_WEIGHT.high))]
    pub(super) energy_weight: f64,
}

impl Default for Air {
    fn default() -> Air {
        let airflow::Air {
            temperature_c,
            pressure_pa,
        } = airflow::Air::default();
        Air {
            temperature_c,
            pressure_pa,
            superposition: Superposition::default(),
            jet: None,
            finding: None,
            convection: None,
        }
    }
}

impl Default for Planning {
    fn default() -> Planning {
        let world::Planning {
            clearance_m,
            margins,
            seed,
            energy_weight,
            ..
        } = world::Planning::default();
        Planning {
            cell_m: None,
            air_limit: AIR_LIMIT_DEFAULT,
            clearance_m,
            time_margin_s: margins.time_s,
            tracking_m: margins.tracking_m,
            motion: None,
            seed,
            energy_weight,
        }
    }
}
