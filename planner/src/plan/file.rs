//! plan.json from anywhere: read as far as it can be judged, what it leaves out filled in, and what
//! it claims kept apart from what it is.
//!
//! A plan says which drone flies which airframe, where, when, at which mass and within which
//! limits; what follows from that (exposure, energy, arrivals, sums, violations) are results. A
//! foreign plan may leave results out, name a preset in place of an airframe's numbers, and leave
//! out all that has a [default](self).

use std::fmt;

use schemars::JsonSchema;
use serde::de::{Deserializer, Error as _, IgnoredAny, MapAccess, Visitor, value};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::form::{self, FieldFault, FieldFaultKind};

use super::limits::DefaultLimits;
use super::trajectory::{SAME_PLACE_M, Tail, Trajectory};
use super::{
    AIR_LIMIT_DEFAULT, AirDelay, AirframeEntry, AtEnd, AtStart, DronePlan, FORMAT, FORMAT_BEFORE,
    MAX_SPEED_DEFAULT_MPS, Plan, Status, ZoneAir,
};

/// A plan, complete, and what its file claims of it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanFile {
    /// With everything filled in; results that the file leaves out are 0 or absent.
    pub plan: Plan,
    /// The results that the file states.
    pub claims: Claims,
    /// What was filled in, and for how many drones; in the order of the fields.
    pub filled: Vec<(&'static str, usize)>,
    /// What was assumed while it was read, as sentences.
    pub remarks: Vec<String>,
}

impl PlanFile {
    /// The figures that the file states and that only planning could find.
    pub fn planning_figures(&self) -> Vec<&'static str> {
        let drones = &self.claims.drones;
        let figures = [
            ("alone_s", drones.iter().any(|it| it.alone_s.is_some())),
            ("waits_s", drones.iter().any(|it| it.waits_s.is_some())),
            ("detour_m", drones.iter().any(|it| it.detour_m.is_some())),
            ("ignoring_downwash", self.plan.ignoring_downwash.is_some()),
        ];
        let stated = figures.into_iter().filter(|(_, is_stated)| *is_stated);
        stated.map(|(figure, _)| figure).collect()
    }
}

/// Why a text is no plan that can be judged.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum NotAPlan {
    /// Not JSON, or fields that are missing, unknown or of another kind.
    #[error("{}", fault_lines(.faults, (*line, *column)))]
    Fields {
        /// The one at which it cannot be read, then others that are not as the schema says; at `.`:
        /// the whole.
        faults: Vec<FieldFault>,
        /// Where in the text the first is, from 1.
        line: usize,
        /// Where in the line, from 1.
        column: usize,
    },
    /// Another format.
    #[error("`format` is \"{0}\", this program reads \"{FORMAT}\" and \"{FORMAT_BEFORE}\"")]
    Format(String),
    /// No drone.
    #[error("`drones`: there are none")]
    NoDrones,
    /// Two statements that cannot both be.
    #[error("`{0}`: {1}")]
    Contradiction(&'static str, &'static str),
}

/// The results that a file states; `None`: it does not.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(default)]
pub struct Claims {
    /// As [`Plan::status`].
    pub status: Option<Status>,
    /// As [`Plan::quasi_static`].
    pub quasi_static: Option<bool>,
    /// In the order of [`Plan::drones`].
    pub drones: Vec<DroneClaims>,
    /// As [`Plan::fleet`].
    pub fleet: FleetClaims,
    /// As [`Plan::zone_air`].
    pub zone_air: Option<Vec<ZoneAir>>,
    /// As [`Plan::violations`].
    pub violations: Option<Vec<super::Violation>>,
    margins: Option<IgnoredAny>,
    /// Not `null`.
    air_delay: Option<IgnoredAny>,
}

impl Claims {
    /// Whether the file says how the plan was judged: whether it is safe, and of each drone when it
    /// arrives and what air it meets.
    pub fn are_whole(&self) -> bool {
        let is_judged = |it: &DroneClaims| it.arrives_s.is_some() && it.worst_air_mps.is_some();
        self.status.is_some() && self.violations.is_some() && self.drones.iter().all(is_judged)
    }

    /// Of a file of so many drones that states no results.
    pub(crate) fn of_none(drones: usize) -> Claims {
        Claims {
            drones: vec![DroneClaims::default(); drones],
            ..Claims::default()
        }
    }
}

/// The results that a file states of one drone.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(default)]
pub struct DroneClaims {
    /// Of its airframe.
    #[serde(deserialize_with = "airframe_claims")]
    pub airframe: AirframeClaims,
    /// As [`DronePlan::air_limit`].
    air_limit: Option<f64>,
    /// As [`DronePlan::arrives_s`].
    pub arrives_s: Option<f64>,
    /// As [`DronePlan::alone_s`].
    pub alone_s: Option<f64>,
    /// As [`DronePlan::waits_s`].
    pub waits_s: Option<f64>,
    /// As [`DronePlan::detour_m`].
    pub detour_m: Option<f64>,
    /// As [`DronePlan::worst_air_mps`].
    pub worst_air_mps: Option<f64>,
    /// As [`DronePlan::worst_air_from`].
    pub worst_air_from: Option<String>,
    /// As [`DronePlan::worst_air_at_s`].
    pub worst_air_at_s: Option<f64>,
    /// As [`DronePlan::dose_m`].
    pub dose_m: Option<f64>,
    /// As [`DronePlan::extra_energy_j`].
    pub extra_energy_j: Option<f64>,
    /// As [`DronePlan::extra_energy_percent`].
    pub extra_energy_percent: Option<f64>,
    /// As [`DronePlan::may_be_late_s`].
    pub may_be_late_s: Option<f64>,
}

/// What a file states of an airframe, and what it leaves out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AirframeClaims {
    /// As [`AirframeEntry::hover_induced_velocity_mps`].
    pub hover_induced_velocity_mps: Option<f64>,
    /// Keys that no preset fills in.
    omitted: Vec<&'static str>,
}

/// The results that a file states of the fleet.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(default)]
pub struct FleetClaims {
    /// As [`super::Fleet::makespan_s`].
    pub makespan_s: Option<f64>,
    /// As [`super::Fleet::sum_of_arrivals_s`].
    pub sum_of_arrivals_s: Option<f64>,
    /// As [`super::Fleet::sum_alone_s`].
    pub sum_alone_s: Option<f64>,
    /// As [`super::Fleet::extra_energy_j`].
    pub extra_energy_j: Option<f64>,
}

/// Reads a plan, fills in what it leaves out, and keeps what it claims.
///
/// # Errors
///
/// What keeps it from being judged: all fields that are not as the schema says, or the first that
/// contradicts another.
pub fn read(text: &str) -> Result<PlanFile, NotAPlan> {
    let mut plan: Plan = parsed(text)?;
    if ![FORMAT, FORMAT_BEFORE].contains(&plan.format.as_str()) {
        return Err(NotAPlan::Format(plan.format));
    }
    if plan.drones.is_empty() {
        return Err(NotAPlan::NoDrones);
    }
    let claims: Claims = parsed(text)?;
    plan.settle_delay(&claims)?;
    let filled = plan.complete(&claims);
    let mut remarks = Vec::new();
    if plan.format == FORMAT_BEFORE {
        let what = "neither margins nor limits of climb and descent: none are judged";
        remarks.push(format!("{FORMAT_BEFORE} states {what}"));
        if plan.quasi_static {
            let what = "wakes are judged as quasi-static: they follow their drones without delay";
            remarks.push(format!("{FORMAT_BEFORE} is quasi-static: {what}"));
        }
    } else if claims.margins.is_none() {
        remarks.push("no margins stated: judged as flown on time and on its paths".to_owned());
    }
    let turns = plan.drones.iter().filter(|it| it.trajectory.turns_at_once);
    if let some @ 1.. = turns.count() {
        let what = "corners, acceleration and jerk of curves, and limits left out, are not judged";
        remarks.push(format!("turns_at_once (of {some} in the fleet): {what}"));
    }
    Ok(PlanFile {
        plan,
        claims,
        filled,
        remarks,
    })
}

/// One value from a text, or the field that is wrong.
fn parsed<'t, T: Deserialize<'t>>(text: &'t str) -> Result<T, NotAPlan> {
    let json = &mut serde_json::Deserializer::from_str(text);
    let value = serde_path_to_error::deserialize(&mut *json).map_err(|error| {
        let path = error.path().to_string();
        let error = error.inner();
        let mut faults = faults(text);
        // What was found is what stands there, or something in it, or the whole is no object.
        let below = path.strip_suffix('.').unwrap_or(&path);
        let is_it = |it: &FieldFault| it.place.is_empty() || it.place.starts_with(below);
        match faults.iter().position(is_it) {
            Some(first) => faults[..=first].rotate_right(1),
            None => faults.insert(0, unread(path, error)),
        }
        NotAPlan::at(error, faults)
    })?;
    let end = json.end();
    end.map_err(|error| NotAPlan::at(&error, vec![unread(String::new(), &error)]))?;
    Ok(value)
}

/// A field at fault where the schema finds none.
fn unread(place: String, error: &serde_json::Error) -> FieldFault {
    let what = error.to_string();
    let at = format!(" at line {} column {}", error.line(), error.column());
    FieldFault {
        name: place.rsplit('.').next().unwrap_or_default().to_owned(),
        place,
        kind: FieldFaultKind::Kind,
        what: what.strip_suffix(&at).unwrap_or(&what).to_owned(),
    }
}

/// Fields at fault, a line each, the first with its line and column.
fn fault_lines(faults: &[FieldFault], (line, column): (usize, usize)) -> String {
    let told = faults.iter().enumerate().map(|(k, it)| match k {
        0 => format!("`{}`: {} at line {line} column {column}", it.place, it.what),
        _ => format!("\n  `{}`: {}", it.place, it.what),
    });
    told.collect()
}

impl NotAPlan {
    fn at(error: &serde_json::Error, mut faults: Vec<FieldFault>) -> NotAPlan {
        // Where the text breaks off there may be no field: `?`.
        let is_whole = |it: &&mut FieldFault| ["", "?"].contains(&it.place.as_str());
        if let Some(whole) = faults.first_mut().filter(is_whole) {
            ".".clone_into(&mut whole.place);
        }
        NotAPlan::Fields {
            faults,
            line: error.line(),
            column: error.column(),
        }
    }
}

/// The fields that are not as the schema says; none where the text is no JSON.
fn faults(text: &str) -> Vec<FieldFault> {
    let Ok(value) = serde_json::from_str(text) else {
        return Vec::new();
    };
    let schema = schema();
    form::faults(schema.as_value(), schema.as_value(), &value, "")
}

impl Plan {
    /// Holds what is said of the delay of air against one another, and fills in what follows.
    ///
    /// # Errors
    ///
    /// A contradiction, at its place.
    fn settle_delay(&mut self, claims: &Claims) -> Result<(), NotAPlan> {
        if self.format == FORMAT_BEFORE && claims.air_delay.is_some() {
            let why = "plan/1 is quasi-static; advected wakes are stated by plan/2";
            return Err(NotAPlan::Contradiction("air_delay", why));
        }
        let convection = self.convection();
        let is_quasi_static = convection.is_none();
        match claims.quasi_static {
            Some(true) if !is_quasi_static => {
                let why = "it is true, but the plan states a convective delay";
                return Err(NotAPlan::Contradiction("quasi_static", why));
            }
            Some(false) if is_quasi_static => {
                let why = "it is false, but the plan states no delay: air_delay is null";
                return Err(NotAPlan::Contradiction("quasi_static", why));
            }
            _ => {}
        }
        self.quasi_static = is_quasi_static;
        self.air_delay = convection.map(|convection| AirDelay { convection });
        Ok(())
    }

    /// Fills in what follows from the rest: masses, hover velocities, when drones are airborne and
    /// when they arrive, and limits, of which `plan/1` knows none. Says what, and for how many
    /// drones.
    fn complete(&mut self, claims: &Claims) -> Vec<(&'static str, usize)> {
        let mut filled: Vec<(&'static str, usize)> = Vec::new();
        let mut note_filled =
            |key: &'static str| match filled.iter_mut().find(|(known, _)| *known == key) {
                Some((_, drones)) => *drones += 1,
                None => filled.push((key, 1)),
            };
        let density_kg_per_m3 = self.air.density_kg_per_m3;
        let is_limited = self.format == FORMAT;
        for (drone, stated) in self.drones.iter_mut().zip(&claims.drones) {
            let points = drone.trajectory.t_s.len();
            if drone.trajectory.mass_kg.is_empty() && points > 0 {
                drone.trajectory.mass_kg = vec![drone.airframe.mass_kg; points];
                note_filled("mass_kg");
            }
            if drone.airborne_s == airborne_not_said() {
                let is_unplanned = self.unplanned.iter().any(|it| it.name == drone.name);
                drone.airborne_s = airborne_s(drone, is_unplanned);
                note_filled("airborne_s");
            }
            if stated.arrives_s.is_none() {
                // A result, which no remark is made of; what reads a plan goes by it all the same.
                drone.arrives_s = arrival_s(drone, None);
            }
            if stated.air_limit.is_none() {
                note_filled("air_limit");
            }
            let is_limited = is_limited && !drone.trajectory.turns_at_once;
            let omitted = stated.airframe.omitted.iter();
            let omitted = omitted.filter(|key| is_limited || !LIMITS.contains(key));
            omitted.for_each(|key| note_filled(key));
            let airframe = drone.airframe.airframe().ok();
            let Some(airframe) = airframe.filter(|_| density_kg_per_m3 > 0.0) else {
                continue;
            };
            let entry = &mut drone.airframe;
            if entry.hover_induced_velocity_mps == 0.0 {
                entry.hover_induced_velocity_mps =
                    airframe.hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3);
            }
            if is_limited {
                let limits = DefaultLimits::of(&airframe, entry.max_speed_mps, density_kg_per_m3);
                entry.max_climb_mps.get_or_insert(limits.max_climb_mps);
                entry.max_descent_mps.get_or_insert(limits.max_descent_mps);
                let acceleration_mps2 = limits.max_acceleration_mps2;
                entry.max_acceleration_mps2.get_or_insert(acceleration_mps2);
                entry.max_jerk_mps3.get_or_insert(limits.max_jerk_mps3);
            }
        }
        filled
    }
}

/// When a drone is in the air that does not say so: from when it comes, or first moves where it
/// starts landed, until it has landed or left.
pub(crate) fn airborne_s(drone: &DronePlan, is_unplanned: bool) -> (f64, Option<f64>) {
    let comes_s = drone.enters_s.unwrap_or(0.0);
    let last_s = drone.trajectory.t_s.last().copied();
    let moves_s = Trajectory::new(&drone.trajectory, Tail::Gone)
        .ok()
        .and_then(|it| it.moves_s());
    let from_s = match (drone.at_start, moves_s) {
        (AtStart::Hover, _) => comes_s,
        (AtStart::Landed, Some((first_s, _))) => first_s,
        (AtStart::Landed, None) => return (comes_s, Some(comes_s)),
    };
    match drone.at_end {
        AtEnd::Land | AtEnd::Leave if !is_unplanned => (from_s, last_s),
        _ => (from_s, None),
    }
}

/// Stands for an `airborne_s` that is left out; no file can say it.
pub(super) fn airborne_not_said() -> (f64, Option<f64>) {
    (f64::NEG_INFINITY, None)
}

/// Of a drone that states none.
pub(super) fn air_limit() -> f64 {
    AIR_LIMIT_DEFAULT
}

/// Limits of an airframe, which `plan/1` does not know.
const LIMITS: [&str; 4] = [
    "max_climb_mps",
    "max_descent_mps",
    "max_acceleration_mps2",
    "max_jerk_mps3",
];

/// An airframe as a plan may write it: the name of a preset, or its numbers; those of a preset may
/// be left out.
#[derive(Deserialize, JsonSchema, Serialize)]
#[schemars(rename = "Airframe")]
pub(super) struct AirframeForm {
    /// A preset's, or any other.
    #[serde(default)]
    name: String,
    /// Without payload (kg).
    mass_kg: Option<f64>,
    /// Number of propellers.
    propellers: Option<u32>,
    /// m.
    propeller_diameter_m: Option<f64>,
    /// Diagonal, motor to motor (m).
    motor_distance_m: Option<f64>,
    /// Multiplies the half-width, divides the centreline; left out: 1.
    width_factor: Option<f64>,
    /// Radius of the ball that stays clear (m); left out: to the rotor tips.
    body_radius_m: Option<f64>,
    /// m/s; left out: 2.
    max_speed_mps: Option<f64>,
    /// Highest vertical speed upwards (m/s); left out: `max_speed_mps`.
    max_climb_mps: Option<f64>,
    /// Highest vertical speed downwards (m/s); left out: two fifths of its induced velocity at
    /// hover, at most `max_speed_mps`.
    max_descent_mps: Option<f64>,
    /// m/s²; left out: by its size.
    max_acceleration_mps2: Option<f64>,
    /// m/s³; left out: by its size.
    max_jerk_mps3: Option<f64>,
    /// At its mass without payload (m/s). A result.
    hover_induced_velocity_mps: Option<f64>,
}

impl AirframeForm {
    /// With what a preset or a default says.
    ///
    /// # Errors
    ///
    /// A number that is left out and no preset has.
    fn complete(self) -> Result<AirframeEntry, String> {
        let preset = airflow::Airframe::preset(&self.name);
        let preset = preset.as_ref();
        let lacks = |field: &str| {
            let name = &self.name;
            format!("airframe `{name}` is no preset, and lacks `{field}`")
        };
        let mass_kg = self.mass_kg.or(preset.map(|it| it.mass_kg()));
        let diameter_m = (self.propeller_diameter_m).or(preset.map(|it| it.propeller_diameter_m()));
        let distance_m = self
            .motor_distance_m
            .or(preset.map(|it| it.motor_distance_m()));
        let diameter_m = diameter_m.ok_or_else(|| lacks("propeller_diameter_m"))?;
        let distance_m = distance_m.ok_or_else(|| lacks("motor_distance_m"))?;
        Ok(AirframeEntry {
            mass_kg: mass_kg.ok_or_else(|| lacks("mass_kg"))?,
            propellers: (self.propellers)
                .or(preset.map(|it| it.propellers()))
                .unwrap_or(4),
            propeller_diameter_m: diameter_m,
            motor_distance_m: distance_m,
            width_factor: (self.width_factor)
                .or(preset.map(|it| it.width_factor()))
                .unwrap_or(1.0),
            body_radius_m: self
                .body_radius_m
                .unwrap_or(0.5 * (distance_m + diameter_m)),
            max_speed_mps: self.max_speed_mps.unwrap_or(MAX_SPEED_DEFAULT_MPS),
            max_climb_mps: self.max_climb_mps,
            max_descent_mps: self.max_descent_mps,
            max_acceleration_mps2: self.max_acceleration_mps2,
            max_jerk_mps3: self.max_jerk_mps3,
            hover_induced_velocity_mps: self.hover_induced_velocity_mps.unwrap_or(0.0),
            name: self.name,
        })
    }
}

/// An airframe: the name of a preset, or its numbers.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "for the schema alone")]
pub(super) enum AirframeWritten {
    /// The name of a preset; `plan schema` lists them.
    Name(String),
    /// Numbers.
    Numbers(AirframeForm),
}

/// For the schema: what is filled in follows from the rest, and is no value.
pub(super) fn without_default(schema: &mut schemars::Schema) {
    schema.remove("default");
}

/// Reads an airframe by the name of a preset, or by its numbers.
pub(super) fn airframe<'de, D: Deserializer<'de>>(from: D) -> Result<AirframeEntry, D::Error> {
    from.deserialize_any(OneOf)?
        .complete()
        .map_err(D::Error::custom)
}

/// What is stated of an airframe, and what is left out.
fn airframe_claims<'de, D: Deserializer<'de>>(from: D) -> Result<AirframeClaims, D::Error> {
    let form = from.deserialize_any(OneOf)?;
    let is_preset = airflow::Airframe::preset(&form.name).is_some();
    let [climb, descent, acceleration, jerk] = LIMITS;
    let omitted = [
        ("propellers", form.propellers.is_none() && !is_preset),
        ("width_factor", form.width_factor.is_none() && !is_preset),
        ("body_radius_m", form.body_radius_m.is_none()),
        ("max_speed_mps", form.max_speed_mps.is_none()),
        (climb, form.max_climb_mps.is_none()),
        (descent, form.max_descent_mps.is_none()),
        (acceleration, form.max_acceleration_mps2.is_none()),
        (jerk, form.max_jerk_mps3.is_none()),
    ];
    let omitted = omitted.into_iter().filter(|(_, is_omitted)| *is_omitted);
    Ok(AirframeClaims {
        hover_induced_velocity_mps: form.hover_induced_velocity_mps,
        omitted: omitted.map(|(key, _)| key).collect(),
    })
}

/// Takes a name, or a map of numbers.
struct OneOf;

impl<'de> Visitor<'de> for OneOf {
    type Value = AirframeForm;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the name of a preset, or an airframe's numbers")
    }

    fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<AirframeForm, E> {
        let of_name = value::MapDeserializer::new([("name", name)].into_iter());
        AirframeForm::deserialize(of_name)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<AirframeForm, A::Error> {
        AirframeForm::deserialize(value::MapAccessDeserializer::new(map))
    }
}

/// The JSON schema of a plan, from the types that read and write it.
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(Plan)
}

/// The moments at which a drone's final dwell may end, by its trajectory alone, the likeliest first
/// (s): the break points from when it stands at its last place on; of a drone that lands, those
/// above its pad, and last those on it, where its last task may have been.
pub fn arrivals_s(drone: &DronePlan) -> Vec<f64> {
    let times_s = &drone.trajectory.t_s;
    let points = times_s.len().min(drone.trajectory.position_m.len());
    if drone.has_landed() {
        let descends = last_descent(drone);
        let below = (descends..points).map(|k| times_s[k]);
        let stands = standing_s(drone, descends);
        return stands.into_iter().chain(below).collect();
    }
    standing_s(drone, points)
}

/// Times are told in full precision; sums of many may lose this (s), chosen here: a hundredth of a
/// millisecond, far below any margin.
pub(crate) const TIME_S: f64 = 1e-5;

/// When a drone's final dwell ends (s): as stated where that may be, else as is likeliest.
pub(crate) fn arrival_s(drone: &DronePlan, stated_s: Option<f64>) -> f64 {
    let may_be_s = arrivals_s(drone);
    let is_stated = |it: &&f64| stated_s.is_some_and(|stated_s| (stated_s - **it).abs() <= TIME_S);
    let stated = may_be_s.iter().find(is_stated).or(may_be_s.first());
    stated.copied().unwrap_or(0.0)
}

/// How many break points there are up to the top of the last descent.
fn last_descent(drone: &DronePlan) -> usize {
    let (times_s, places_m) = (&drone.trajectory.t_s, &drone.trajectory.position_m);
    let apart_m = |k: usize| places_m[k] - places_m[k - 1];
    let mut descends = times_s.len().min(places_m.len());
    while descends > 1 && apart_m(descends - 1).norm() <= SAME_PLACE_M {
        descends -= 1;
    }
    while descends > 1
        && apart_m(descends - 1).xy().norm() <= SAME_PLACE_M
        && apart_m(descends - 1).z < -SAME_PLACE_M
    {
        descends -= 1;
    }
    descends
}

/// The moments of the last of so many break points and of those before it at the same place (s).
fn standing_s(drone: &DronePlan, points: usize) -> Vec<f64> {
    let (times_s, places_m) = (&drone.trajectory.t_s, &drone.trajectory.position_m);
    let Some(last) = points.checked_sub(1) else {
        return Vec::new();
    };
    let is_there = |k: &usize| (places_m[*k] - places_m[last]).norm() <= SAME_PLACE_M;
    let stands = (0..=last).rev().take_while(is_there);
    stands.map(|k| times_s[k]).collect()
}
