//! A plan as plain data: the contents of `plan.json`, format `plan/2`.
//!
//! A plan holds all that a judge needs (air, airframes, obstacles, zones), so that it can be
//! checked without its scenario. Positions are rotor-plane centres in metres, z up; times in
//! seconds. Wall-clock figures are not part of a plan: the same scenario and seed give the same
//! bytes.

pub mod cause;
pub mod file;
pub(crate) mod limits;
pub mod outcome;
pub mod smoothing;
pub mod trajectory;

use std::collections::BTreeMap;

use airflow::effects::{Effects, Treatment};
use airflow::{Airframe, Convection, Flown, Jet, Superposition};
use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use trajectory::{Motion, SAME_TIME_S};

/// The value of [`Plan::format`].
pub const FORMAT: &str = "plan/2";
/// The format before it, which has neither margins nor limits of climb and descent; readers take
/// both.
pub const FORMAT_BEFORE: &str = "plan/1";

/// Highest speed of an airframe that states none (m/s). Chosen here: indoor flights among racks are
/// flown at walking pace.
pub(crate) const MAX_SPEED_DEFAULT_MPS: f64 = 2.0;

/// Air limit of a drone that states none, over its induced velocity: costs 16 % power.
pub(crate) const AIR_LIMIT_DEFAULT: f64 = 0.3;

/// What a planner answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Plan {
    /// `plan/2`; `plan/1` is read as well.
    #[schemars(extend("enum" = [FORMAT, FORMAT_BEFORE]))]
    pub format: String,
    /// The scenario's name.
    #[serde(default)]
    pub scenario: String,
    /// The answer in one word. A result.
    #[serde(default)]
    pub status: Status,
    /// Wakes follow their drones without delay: exactly where `air_delay` is `null`.
    #[serde(default = "is_quasi_static")]
    pub quasi_static: bool,
    /// The convective delay of air; `null`: wakes are quasi-static, as in `plan/1`.
    #[serde(default)]
    pub air_delay: Option<AirDelay>,
    /// The air that the plan assumes.
    #[serde(default)]
    pub air: AirModel,
    /// Limits of every rotor-plane centre.
    pub bounds_m: Bounds,
    /// Where (0, 0, 0) lies on the Earth, where the scenario says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Origin>,
    /// What no body may touch.
    #[serde(default)]
    pub obstacles: Vec<Obstacle>,
    /// Places where the air is limited.
    #[serde(default)]
    pub zones: Vec<Zone>,
    /// Gap kept between bodies and to obstacles, beyond the body radii (m). Absent where none is
    /// stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clearance_m: Option<f64>,
    /// Edge of the cells that the search began on (m): paths that it does not find are looked for
    /// on finer ones. Absent where no search is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cell_m: Option<f64>,
    /// What the plan bears beyond what it says: absent in `plan/1`, which bears nothing.
    #[serde(default)]
    pub margins: Margins,
    /// Every drone of the scenario, in its order, the unplanned ones included.
    #[schemars(length(min = 1))]
    pub drones: Vec<DronePlan>,
    /// Drones that stay at their start, and why.
    #[serde(default)]
    pub unplanned: Vec<Unplanned>,
    /// Sums over the fleet. Results.
    #[serde(default)]
    pub fleet: Fleet,
    /// The same fleet planned without wakes, judged with them; absent where it is not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ignoring_downwash: Option<IgnoringDownwash>,
    /// The highest air in each zone that limits it, and the bodies that pass through. Results.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub zone_air: Vec<ZoneAir>,
    /// What the verifier found. A result.
    #[serde(default)]
    pub violations: Vec<Violation>,
}

/// Where the world lies on the Earth (WGS 84).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Origin {
    /// Of (0, 0, 0) (deg, north positive).
    pub latitude_deg: f64,
    /// Of (0, 0, 0) (deg, east positive).
    pub longitude_deg: f64,
    /// Height of (0, 0, 0) above mean sea level (m).
    pub altitude_m: f64,
    /// Heading of +x (deg, clockwise from north).
    pub heading_deg: f64,
}

/// The air of one zone over the whole plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ZoneAir {
    /// The zone's name.
    pub zone: String,
    /// Highest summed air that was found at one of its points (m/s); 0: none above 0.1.
    pub worst_air_mps: f64,
    /// Summed air that no point of it exceeds at any time (m/s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_most_mps: Option<f64>,
    /// The drone with the strongest wake.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worst_air_from: Option<String>,
    /// When (s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub worst_air_at_s: Option<f64>,
    /// Drones whose bodies pass through it or are in it, where it does not keep them out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub entered_by: Vec<String>,
}

/// Wakes are attached unless a plan says otherwise.
fn is_quasi_static() -> bool {
    true
}

/// The convective delays for which the plan holds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AirDelay {
    /// Speed of the air that carries wakes down over the centreline's, lowest and highest: air at a
    /// depth left its drone up to the delay of the lowest ago, all air at the same speed at a time.
    /// Exposure and energy are those of the highest.
    #[schemars(with = "[f64; 2]")]
    pub convection: Convection,
}

impl DronePlan {
    /// Induced velocity at hover with the load of a time (s), in the stated air (m/s); see
    /// [`airflow::Flown::hover_velocity_mps`].
    pub fn hover_mps(&self, t_s: f64) -> f64 {
        let point = self.trajectory.point_at(t_s).unwrap_or(0);
        let own_kg = self.airframe.mass_kg;
        let mass_kg = self
            .trajectory
            .mass_kg
            .get(point)
            .copied()
            .unwrap_or(own_kg);
        let loaded = mass_kg / own_kg.max(f64::MIN_POSITIVE);
        self.airframe.hover_induced_velocity_mps * loaded.sqrt()
    }

    /// Whether it stands landed at its last place: one that leaves may have landed there before.
    pub fn has_landed(&self) -> bool {
        let last_s = self.trajectory.t_s.last().copied();
        match self.at_end {
            AtEnd::Hover => false,
            AtEnd::Land => true,
            AtEnd::Leave => (self.airborne_s.1.zip(last_s))
                .is_some_and(|(until_s, last_s)| until_s < last_s - SAME_TIME_S),
        }
    }
}

/// What follows a drone's name in that of its wreck.
pub(crate) const WRECK: &str = " (wreck";

/// Of the name of a wreck that of the drone that failed; `None`: it is no wreck's.
pub fn failed(name: &str) -> Option<&str> {
    let (failed, rest) = name.rsplit_once(WRECK)?;
    let nth = rest.strip_suffix(')')?;
    let is_one = nth.is_empty() || nth.trim_start().parse::<usize>().is_ok();
    is_one.then_some(failed)
}

/// Where every drone is at one moment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sample {
    /// Time since the plan began (s).
    pub t_s: f64,
    /// Rotor-plane centres in the world's frame, z up (m), in the order of [`Plan::drones`];
    /// `None`: the drone is not there yet, or has left.
    pub position_m: Vec<Option<Point3<f64>>>,
}

impl Plan {
    /// What its air is flown with beside the hover jets; nothing where that cannot be flown.
    pub fn flown(&self) -> Flown {
        Flown::of(&self.air.effects.unwrap_or_default()).unwrap_or_default()
    }

    /// Names of the effects that its air is flown with.
    pub fn flown_effects(&self) -> Vec<&'static str> {
        let effects = self.air.effects.unwrap_or_default().treatments();
        let flown = effects.into_iter();
        let flown = flown.filter(|(_, it)| !matches!(it, Treatment::Ignored(_)));
        flown.map(|(name, _)| name).collect()
    }

    /// The convective delay of air, as the plan states it and as its effects have it; `None`: wakes
    /// are quasi-static.
    pub fn convection(&self) -> Option<Convection> {
        let stated = self.air_delay.map(|it| it.convection);
        self.flown().with_convection(stated).convection
    }

    /// Every drone is planned, and the verifier found nothing: it may be flown as it is.
    pub fn is_safe(&self) -> bool {
        self.status == Status::Safe && self.violations.is_empty() && self.unplanned.is_empty()
    }

    /// One of its drones, by name.
    pub fn drone(&self, name: &str) -> Option<&DronePlan> {
        self.drones.iter().find(|it| it.name == name)
    }

    /// Whether a drone of this name has no path, and stays where it starts.
    pub fn is_unplanned(&self, name: &str) -> bool {
        self.unplanned.iter().any(|it| it.name == name)
    }

    /// When one of its drones leaves (s); `None`: never, as one that is not planned.
    pub fn leaves_s(&self, drone: &DronePlan) -> Option<f64> {
        let stays = drone.at_end != AtEnd::Leave || self.is_unplanned(&drone.name);
        drone.trajectory.t_s.last().copied().filter(|_| !stays)
    }

    /// The end of the last motion (s).
    pub fn ends_s(&self) -> f64 {
        let last_s = self.drones.iter().filter_map(|it| it.trajectory.t_s.last());
        last_s.copied().fold(0.0, f64::max)
    }

    /// Where all drones are, `rate_hz` times a second (1/s) from time 0 to the end of the last
    /// motion, and once at or after it; nothing unless the rate is positive and finite.
    pub fn sample(&self, rate_hz: f64) -> Vec<Sample> {
        if !(rate_hz > 0.0 && rate_hz.is_finite()) {
            return Vec::new();
        }
        let leave_s: Vec<Option<f64>> = self.drones.iter().map(|it| self.leaves_s(it)).collect();
        let at = |k: u64| {
            let t_s = k as f64 / rate_hz;
            let of = |(drone, leaves_s): (&DronePlan, &Option<f64>)| {
                let comes = drone.enters_s.is_none_or(|enters_s| enters_s <= t_s);
                let is_there = comes && leaves_s.is_none_or(|leaves_s| t_s <= leaves_s);
                drone.trajectory.position_m(t_s).filter(|_| is_there)
            };
            Sample {
                t_s,
                position_m: self.drones.iter().zip(&leave_s).map(of).collect(),
            }
        };
        let steps = (self.ends_s() * rate_hz).ceil() as u64;
        (0..=steps).map(at).collect()
    }
}

/// The answer in one word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Every drone planned, nothing violated.
    #[default]
    Safe,
    /// Nothing violated, but a drone stays at the start.
    Partial,
    /// The verifier found violations.
    Unsafe,
}

impl Status {
    /// As plan.json has it.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Status::Safe => "safe",
            Status::Partial => "partial",
            Status::Unsafe => "unsafe",
        }
    }
}

/// How far flights may be from the plan while it still holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Margins {
    /// Each drone may be early or late by so much, at any time, whatever the others are (s):
    /// bodies, near-field columns and limits of air hold.
    pub time_s: f64,
    /// Each drone that flies may be off its path by so much in any direction (m): bodies hold
    /// against one another, obstacles and zones that keep bodies out. Tops of obstacles below a
    /// drone's own pad are exempt.
    pub tracking_m: f64,
}

/// The air that a plan assumes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct AirModel {
    /// kg/m³.
    pub density_kg_per_m3: f64,
    /// Constants of the merged jet.
    #[schemars(with = "JetKeys")]
    pub jet: Jet,
    /// `momentum`, `linear` or `strongest`.
    pub superposition: String,
    /// What a finding adds to the hover jet, by name; absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<BTreeMap<String, BTreeMap<String, serde_json::Value>>>")]
    pub effects: Option<Effects>,
}

impl Default for AirModel {
    fn default() -> AirModel {
        AirModel {
            density_kg_per_m3: airflow::Air::default().density_kg_per_m3(),
            jet: Jet::default(),
            superposition: Superposition::default().as_str().to_owned(),
            effects: None,
        }
    }
}

/// The keys of a [`Jet`], for the schema.
#[derive(JsonSchema)]
#[expect(dead_code, reason = "its keys are all that is asked of it")]
struct JetKeys {
    /// Decay of the centreline: `U_C/U_H = centreline / (s/l - origin)`.
    centreline: f64,
    /// Growth of the half-width: `r_half/l = spreading (s/l - origin)`.
    spreading: f64,
    /// Virtual origin, in motor distances below the rotor plane.
    origin: f64,
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Bounds {
    /// Lowest corner (m).
    #[schemars(with = "[f64; 3]")]
    pub min: Point3<f64>,
    /// Highest corner (m).
    #[schemars(with = "[f64; 3]")]
    pub max: Point3<f64>,
}

/// A named solid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Obstacle {
    /// What messages and the plan call it.
    pub name: String,
    /// Its shape, in the world.
    #[serde(flatten)]
    pub shape: Solid,
}

/// The shape of an obstacle, in world coordinates; in a file told apart by its keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Solid {
    /// Axis-aligned box.
    Box {
        /// Lowest corner (m).
        #[schemars(with = "[f64; 3]")]
        min_m: Point3<f64>,
        /// Highest corner (m).
        #[schemars(with = "[f64; 3]")]
        max_m: Point3<f64>,
    },
    /// Upright cylinder standing on `base_m`.
    Cylinder {
        /// Centre of the lower face (m).
        #[schemars(with = "[f64; 3]")]
        base_m: Point3<f64>,
        /// Radius (m).
        radius_m: f64,
        /// Height (m).
        height_m: f64,
    },
    /// Triangle mesh, already moved to its place; does not stop a wake.
    Mesh {
        /// The file it came from, as the scenario names it.
        mesh: String,
        /// Vertices (m).
        #[schemars(with = "Vec<[f64; 3]>")]
        vertices_m: Vec<Point3<f64>>,
        /// Corner indices into the vertices.
        triangles: Vec<[u32; 3]>,
    },
}

/// A box for people or goods: the summed axial wake speed in it is limited, bodies keep out of it,
/// or both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Zone {
    /// What messages and the plan call it.
    pub name: String,
    /// Lowest corner (m).
    #[schemars(with = "[f64; 3]")]
    pub min_m: Point3<f64>,
    /// Highest corner (m).
    #[schemars(with = "[f64; 3]")]
    pub max_m: Point3<f64>,
    /// Limit of the summed axial wake speed at every point (m/s); `None`: the air is not limited.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub air_limit_mps: Option<f64>,
    /// No body may be inside.
    #[serde(default)]
    pub keep_out: bool,
}

/// What one drone does.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DronePlan {
    /// The scenario's name for it.
    pub name: String,
    /// What flies.
    #[serde(deserialize_with = "file::airframe")]
    #[schemars(with = "file::AirframeWritten")]
    pub airframe: AirframeEntry,
    /// Highest mean air over its rotor discs, over its induced velocity at its current mass.
    #[serde(default = "file::air_limit")]
    pub air_limit: f64,
    /// When it comes (s): before, neither body nor wake is there. Absent: it is there from time 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub enters_s: Option<f64>,
    /// `hover` or `landed`, when it comes.
    #[serde(default)]
    #[schemars(with = "StartWord")]
    pub at_start: AtStart,
    /// `hover`, `land` or `leave`.
    #[serde(default)]
    #[schemars(with = "EndWord")]
    pub at_end: AtEnd,
    /// When its wake is on: from, until (`null`: until the end). From 0 until 0: never.
    /// Left out: from when it first moves, or comes hovering, until it has landed or left.
    #[serde(default = "file::airborne_not_said")]
    #[schemars(transform = file::without_default)]
    pub airborne_s: (f64, Option<f64>),
    /// When it stands landed between two flights: from, until (s), in order, each of them within
    /// `airborne_s`. Its air limit does not hold then; its wake still counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub landed_s: Vec<(f64, f64)>,
    /// Where it is when.
    pub trajectory: TrajectoryEntry,
    /// End of the last dwell (s). A result, as all that follows.
    #[serde(default)]
    pub arrives_s: f64,
    /// The same with no other drone there (s).
    #[serde(default)]
    pub alone_s: f64,
    /// How much later it is for standing still beyond its dwells, on the path that is smoothed (s);
    /// waiting for an appointment makes a drone no later. A smooth trajectory is slow for longer
    /// than that, and may not stand at all.
    #[serde(default)]
    pub waits_s: f64,
    /// Length flown beyond its path when alone (m).
    #[serde(default)]
    pub detour_m: f64,
    /// Highest mean air over its rotor discs (m/s).
    #[serde(default)]
    pub worst_air_mps: f64,
    /// The drone with the strongest wake.
    #[serde(default)]
    pub worst_air_from: Option<String>,
    /// When.
    #[serde(default)]
    pub worst_air_at_s: Option<f64>,
    /// Integral of the air met over time (m).
    #[serde(default)]
    pub dose_m: f64,
    /// Energy that the air met costs (J).
    #[serde(default)]
    pub extra_energy_j: f64,
    /// The same over its own still-air hover energy during its flight (%).
    #[serde(default)]
    pub extra_energy_percent: f64,
    /// How late it may be, all others on time, before a rule breaks (s), to 0.01 s and up to 3 s;
    /// absent where that was not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub may_be_late_s: Option<f64>,
}

/// [`AtStart`] as a plan writes it, for schemas alone.
#[derive(JsonSchema)]
#[schemars(rename_all = "snake_case")]
#[expect(missing_docs, reason = "those of the other")]
pub enum StartWord {
    Hover,
    Landed,
}

/// [`AtEnd`] as a plan writes it, for schemas alone.
#[derive(JsonSchema)]
#[schemars(rename_all = "snake_case")]
#[expect(missing_docs, reason = "those of the other")]
pub enum EndWord {
    Hover,
    Land,
    Leave,
}

/// How a drone begins. A scenario writes `Hover` or `Landed`, a plan `hover` or `landed`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename_all = "PascalCase", description = "How a drone begins.")]
pub enum AtStart {
    /// In the air, with its wake, from time 0.
    #[default]
    Hover,
    /// On the ground, without a wake, until it first moves.
    Landed,
}

/// What a drone does after its last dwell. A scenario writes `Hover`, a plan `hover`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(
    rename_all = "PascalCase",
    description = "What a drone does after its last dwell."
)]
pub enum AtEnd {
    /// Stays in the air without end.
    #[default]
    Hover,
    /// Descends straight to the floor or obstacle top below and rests there without a wake.
    Land,
    /// Body and wake vanish.
    Leave,
}

/// An airframe, complete enough to judge its wake.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AirframeEntry {
    /// Preset or the scenario's own name.
    pub name: String,
    /// Without payload (kg).
    pub mass_kg: f64,
    /// Number of propellers.
    pub propellers: u32,
    /// m.
    pub propeller_diameter_m: f64,
    /// Diagonal, motor to motor (m).
    pub motor_distance_m: f64,
    /// Multiplies the half-width, divides the centreline.
    pub width_factor: f64,
    /// Radius of the ball that stays clear (m).
    pub body_radius_m: f64,
    /// m/s.
    pub max_speed_mps: f64,
    /// Highest vertical speed upwards (m/s); `None`, as in `plan/1`: not limited beyond
    /// `max_speed_mps`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_climb_mps: Option<f64>,
    /// Highest vertical speed downwards (m/s); `None`, as in `plan/1`: not limited beyond
    /// `max_speed_mps`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_descent_mps: Option<f64>,
    /// m/s²; `None`, as in `plan/1`: not limited. Straight pieces change their velocity in no time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_acceleration_mps2: Option<f64>,
    /// m/s³; `None`, as in `plan/1`: not limited.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_jerk_mps3: Option<f64>,
    /// At its mass without payload (m/s).
    pub hover_induced_velocity_mps: f64,
}

impl AirframeEntry {
    /// What it says flies.
    ///
    /// # Errors
    ///
    /// What is wrong with it, in words.
    pub fn airframe(&self) -> Result<Airframe, String> {
        Airframe::new(
            self.name.as_str(),
            self.mass_kg,
            self.propellers,
            self.propeller_diameter_m,
            self.motor_distance_m,
            self.width_factor,
        )
        .map_err(|error| format!("its airframe: {error}"))
    }
}

/// Break points of a motion that is straight between them, or cubic where control points say so.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrajectoryEntry {
    /// Ascending (s).
    pub t_s: Vec<f64>,
    /// Rotor-plane centre at each time (m).
    #[schemars(with = "Vec<[f64; 3]>")]
    pub position_m: Vec<Point3<f64>>,
    /// Mass from each time to the next (kg); left out: the airframe's.
    #[serde(default)]
    pub mass_kg: Vec<f64>,
    /// One entry for each piece between two points, or none at all where all are straight: the two
    /// inner Bézier points of a cubic whose parameter is linear in time (m), or nothing for a
    /// straight piece. With it the motion is continuous up to acceleration, from rest to rest.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(with = "Vec<Vec<[f64; 3]>>")]
    pub control_m: Vec<Vec<Point3<f64>>>,
    /// It says where the drone is to be and nothing of what it keeps, as files of other programs
    /// do: it may turn in no time although it is curved, and limits that its airframe leaves out
    /// are not filled in. Neither jumps of velocity nor acceleration and jerk are judged.
    #[serde(default, skip_serializing_if = "is_false")]
    pub turns_at_once: bool,
}

/// For what a file leaves out where it says nothing.
fn is_false(it: &bool) -> bool {
    !it
}

/// Where a drone is, and how it moves, at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionState {
    /// Rotor-plane centre (m, world).
    pub position_m: Point3<f64>,
    /// m/s.
    pub velocity_mps: Vector3<f64>,
    /// m/s².
    pub acceleration_mps2: Vector3<f64>,
}

impl TrajectoryEntry {
    /// Adds that the drone is at its first place from time 0 on; nothing where it has no points.
    pub fn hold_from_0(&mut self) {
        let Some(first_m) = self.position_m.first().copied() else {
            return;
        };
        self.t_s.insert(0, 0.0);
        self.position_m.insert(0, first_m);
        self.mass_kg.insert(0, self.mass_kg[0]);
        if !self.control_m.is_empty() {
            self.control_m.insert(0, Vec::new());
        }
    }

    /// Leaves out all points after a time (s) but the first of all: the drone is at rest by then.
    pub fn end_at(&mut self, t_s: f64) {
        let points = self.t_s.partition_point(|it| *it <= t_s).max(1);
        self.t_s.truncate(points);
        self.position_m.truncate(points);
        self.mass_kg.truncate(points);
        self.control_m.truncate(points - 1);
    }

    /// Where the drone is at a time (s): held before the first point and after the last (m).
    ///
    /// `None` where the entry has no points.
    pub fn position_m(&self, at_s: f64) -> Option<Point3<f64>> {
        self.state(at_s).map(|state| state.position_m)
    }

    /// Where the drone is and how it moves at a time (s): at rest before the first point and after
    /// the last; at a point, as it goes on from there.
    ///
    /// `None` where the entry has no points.
    pub fn state(&self, at_s: f64) -> Option<MotionState> {
        let at_rest = |place_m: &Point3<f64>| MotionState {
            position_m: *place_m,
            velocity_mps: Vector3::zeros(),
            acceleration_mps2: Vector3::zeros(),
        };
        let Some(piece) = self.point_at(at_s) else {
            return self.position_m.first().map(at_rest);
        };
        // A piece that takes no time leads to the next.
        let Some(motion) = (piece..self.t_s.len()).find_map(|piece| self.motion(piece)) else {
            return self.position_m.last().map(at_rest);
        };
        Some(MotionState {
            position_m: motion.at_m(at_s).into(),
            velocity_mps: motion.velocity_mps(at_s),
            acceleration_mps2: motion.acceleration_mps2(at_s),
        })
    }

    /// Index of the last point at or before a time (s); `None`: there is none.
    pub fn point_at(&self, at_s: f64) -> Option<usize> {
        let after = self.t_s.partition_point(|&t_s| t_s <= at_s);
        after.checked_sub(1)
    }

    /// The piece between a point and the next; `None`: there is none, or it takes no time.
    pub fn motion(&self, piece: usize) -> Option<Motion> {
        let span_s = (*self.t_s.get(piece)?, *self.t_s.get(piece + 1)?);
        let (from_m, to_m) = (
            *self.position_m.get(piece)?,
            *self.position_m.get(piece + 1)?,
        );
        if span_s.1 - span_s.0 <= SAME_TIME_S {
            return None;
        }
        Some(match self.control_m.get(piece).map(Vec::as_slice) {
            Some(&[first_m, second_m]) => Motion::cubic(span_s, [from_m, first_m, second_m, to_m]),
            _ => Motion::straight(span_s, from_m, to_m),
        })
    }

    /// Places along it, in order, whose straight connections stay within a length of it (m), at
    /// least a tenth of a millimetre: for pictures.
    pub fn outline_m(&self, within_m: f64) -> Vec<Point3<f64>> {
        let mut places_m: Vec<Point3<f64>> = self.position_m.first().copied().into_iter().collect();
        for (piece, end_m) in self.position_m.iter().skip(1).enumerate() {
            let mut open: Vec<Motion> = self.motion(piece).into_iter().collect();
            while let Some(part) = open.pop() {
                if part.off_chord_m(part.from_s, part.until_s) > within_m.max(1e-4) {
                    let [first, second] = part.halves();
                    open.extend([second, first]);
                } else if !open.is_empty() {
                    places_m.push(part.at_m(part.until_s).into());
                }
            }
            places_m.push(*end_m);
        }
        places_m
    }

    /// The highest acceleration within its pieces (m/s²): at their ends, it is linear in each.
    pub(crate) fn highest_acceleration_mps2(&self) -> f64 {
        let motions = (0..self.t_s.len()).filter_map(|piece| self.motion(piece));
        let ends = |it: Motion| [it.from_s, it.until_s].map(|t_s| it.acceleration_mps2(t_s).norm());
        motions.flat_map(ends).fold(0.0, f64::max)
    }

    /// An upper bound of its speed (m/s).
    pub fn highest_speed_mps(&self) -> f64 {
        let motions = (0..self.t_s.len()).filter_map(|piece| self.motion(piece));
        motions.map(|it| it.max_speed_mps()).fold(0.0, f64::max)
    }

    /// Whether it has curved pieces.
    pub fn is_smooth(&self) -> bool {
        !self.control_m.is_empty()
    }

    /// Whether it claims to be continuous up to acceleration.
    pub(crate) fn claims_continuity(&self) -> bool {
        self.is_smooth() && !self.turns_at_once
    }
}

/// A drone that could not be planned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Unplanned {
    /// Its name.
    pub name: String,
    /// What blocks it, where and when, and the way out.
    #[serde(default)]
    pub reason: String,
    /// The same as data, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cause: Option<UnplannedCause>,
}

/// Why a drone could not be planned, for programs and pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UnplannedCause {
    /// `no_path`, `too_late`, `goal_conflict`, `no_room_to_land`, `stopped`, or what obstructs it:
    /// `zone`, `body`, `column`, `downwash`, `own_downwash`, `zone_together`, `eviction_limit`.
    pub kind: String,
    /// The name of the blocking drone or zone.
    pub blocker: Option<String>,
    /// How far it could get, or where it would meet the other as it lands, or the place that no
    /// path leads to, or that it cannot have (m).
    #[schemars(with = "Option<[f64; 3]>")]
    pub at_m: Option<Point3<f64>>,
    /// When it would have gone on, or both were to be there (s).
    pub at_s: Option<f64>,
}

/// Sums over the planned drones.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Fleet {
    /// Last arrival (s).
    pub makespan_s: f64,
    /// s.
    pub sum_of_arrivals_s: f64,
    /// Sum of each drone's arrival with no other drone there (s).
    pub sum_alone_s: f64,
    /// Energy that downwash costs the fleet (J).
    pub extra_energy_j: f64,
}

/// The same fleet planned without wakes, judged with them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct IgnoringDownwash {
    /// Last arrival (s).
    pub makespan_s: f64,
    /// How many drones exceed their own limit or cross a column.
    pub drones_over_limit: usize,
    /// Highest mean air over the discs of any drone (m/s).
    pub worst_air_mps: f64,
    /// How many zones get more air than they bear.
    #[serde(default)]
    pub zones_over_limit: usize,
    /// Highest air in those zones (m/s).
    #[serde(default)]
    pub worst_zone_air_mps: f64,
    /// How many could not be planned even so.
    #[serde(default)]
    pub unplanned: usize,
}

/// Something that a plan must not do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Violation {
    /// Which check.
    pub kind: ViolationKind,
    /// The drone.
    pub drone: String,
    /// The other drone, obstacle or zone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub with: Option<String>,
    /// First moment found (s).
    pub from_s: f64,
    /// Last moment found (s); `null`: until the end.
    pub until_s: Option<f64>,
    /// By how much the clock of `with` is ahead of the drone's at the worst moment (s), where time
    /// margins are judged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shift_s: Option<f64>,
    /// Where the drone is at the worst moment (m).
    #[schemars(with = "[f64; 3]")]
    pub position_m: Point3<f64>,
    /// The worst value, in `unit`.
    pub value: f64,
    /// `value` is an upper bound: whether the limit holds could not be decided, and it counts as
    /// broken.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_bound: bool,
    /// What it may be at most (or at least, for gaps), in `unit`.
    pub limit: f64,
    /// `m`, `m/s`, `m/s2`, `m/s3`, `U_D/U_H` or `s`.
    pub unit: String,
}

impl Violation {
    /// Whether it concerns the flight from a time on (s): a malformed plan is so from the
    /// beginning.
    pub fn matters_from(&self, from_s: f64) -> bool {
        let is_over = self.until_s.is_some_and(|until_s| until_s < from_s);
        self.kind == ViolationKind::Malformed || !is_over
    }
}

/// Which check a violation fails.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum ViolationKind {
    /// The file contradicts itself: times run backwards, lengths differ, unknown values.
    Malformed,
    /// A drone is in two places at once.
    Jump,
    /// Faster than its highest speed.
    Speed,
    /// Rotor-plane centre outside the bounds.
    Bounds,
    /// Body in an obstacle.
    Obstacle,
    /// Two bodies touch.
    Collision,
    /// Centre inside another drone's near-field column.
    Column,
    /// Mean air over the rotor discs above the drone's limit.
    Air,
    /// Air in a zone above its limit.
    Zone,
    /// Climbs faster than it may.
    Climb,
    /// Sinks faster than it may.
    Descent,
    /// Moves sideways while it takes off or lands.
    Sideways,
    /// Sets down faster than it may.
    Touchdown,
    /// Velocity changes in no time where the trajectory claims to be smooth.
    VelocityJump,
    /// Acceleration changes in no time where the trajectory claims to be smooth.
    AccelerationJump,
    /// Beyond its highest acceleration.
    Acceleration,
    /// Beyond its highest jerk.
    Jerk,
    /// Body in a zone that keeps bodies out, or nearer to it than the tracking margin.
    KeepOut,
    /// Body nearer to an obstacle than the tracking margin.
    ObstacleMargin,
    /// Two bodies touch when both are early or late, and off their paths, by their margins.
    CollisionMargin,
    /// Centre inside another drone's near-field column when both are early or late.
    ColumnMargin,
    /// Mean air over the rotor discs above the limit when drones are early or late.
    AirMargin,
    /// Air in a zone above its limit when drones are early or late.
    ZoneMargin,
}

impl ViolationKind {
    /// For a rule with margins, the same rule without.
    #[must_use]
    pub fn without_margin(self) -> ViolationKind {
        match self {
            ViolationKind::ObstacleMargin => ViolationKind::Obstacle,
            ViolationKind::CollisionMargin => ViolationKind::Collision,
            ViolationKind::ColumnMargin => ViolationKind::Column,
            ViolationKind::AirMargin => ViolationKind::Air,
            ViolationKind::ZoneMargin => ViolationKind::Zone,
            plain => plain,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Control, Outcome, plan_world, read_world};

    #[test]
    fn samples_hold_all_drones_at_the_rate_until_the_last_has_come_to_rest() {
        let world = read_world(
            r#"(name: "two", bounds_m: (min: (0, 0, 0), max: (20, 10, 8)), drones: [
                (name: "a", airframe: "kolibri", start_m: (1, 1, 1), tasks: [(to_m: (9, 9, 3))]),
                (name: "b", airframe: "kolibri", start_m: (1, 9, 1), tasks: [(to_m: (3, 9, 1))], at_end: Leave),
            ])"#,
        );
        let outcome = plan_world(&world.expect("in order"), &Control::QUIET);
        let Ok(Outcome::Safe(planned)) = outcome else {
            panic!("{outcome:?}");
        };
        let plan = &planned.plan;
        assert!(plan.is_safe() && plan.ignoring_downwash.is_none());
        let samples = plan.sample(5.0);
        let end_s = plan.drones[0]
            .trajectory
            .t_s
            .last()
            .copied()
            .expect("points");
        assert_eq!(samples.len(), (5.0 * end_s).ceil() as usize + 1);
        assert_eq!(samples[0].position_m[1], Some([1.0, 9.0, 1.0].into()));
        for sample in &samples {
            assert_eq!(
                sample.position_m[0],
                plan.drones[0].trajectory.position_m(sample.t_s)
            );
        }
        let last = &samples[samples.len() - 1].position_m;
        assert_eq!(*last, [Some([9.0, 9.0, 3.0].into()), None]);
        assert!(plan.sample(0.0).is_empty() && plan.sample(f64::NAN).is_empty());
        // What a fleet manager keeps or sends on.
        let kept = serde_json::to_value(&*planned).expect("plain data");
        assert_eq!(kept["plan"]["status"], "safe");
    }
}
