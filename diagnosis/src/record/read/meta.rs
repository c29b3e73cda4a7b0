//! `meta.json` of a `downwash-recording/1` folder: surroundings, vehicles, probe, and what
//! "simulation" means.

use airflow::{Air, Airframe};
use serde_json::Value;

use super::declared::{Declared, baseline};
use super::found::{Found, Place};
use super::json::Fields;
use crate::record::baseline::Baseline;
use crate::record::recording::{
    Clock, Environment, Instrument, Known, Measures, Origin, Role, Track, Vehicle,
};
use crate::record::remark::RemarkKind;

/// The file's name.
pub(super) const META: &str = "meta.json";
/// The only format that is read.
const FORMAT: &str = "downwash-recording/1";
/// 0 °C (K).
const ZERO_CELSIUS_K: f64 = 273.15;

const ROLES: [(&str, Role); 3] = [
    ("emitter", Role::Emitter),
    ("receiver", Role::Receiver),
    ("both", Role::Both),
];
const MEASURES: [(&str, Measures); 2] = [
    ("speed_magnitude", Measures::SpeedMagnitude),
    ("axial", Measures::Axial),
];

/// What `meta.json` says.
pub(super) struct Meta {
    pub(super) environment: Environment,
    /// Sorted by id, without their tracks.
    pub(super) vehicles: Vec<Vehicle>,
    /// Every id that it speaks of, also where something is wrong with the vehicle.
    pub(super) ids: Vec<String>,
    /// Whether it speaks of a probe.
    pub(super) has_probe: bool,
    pub(super) instrument: Option<Instrument>,
    pub(super) baseline: Baseline,
    /// Names of the tables that belong to it.
    pub(super) channels: Vec<String>,
}

/// Reads the file; `None` where something is missing that the rest depends on.
pub(super) fn meta(bytes: &[u8], found: &mut Found) -> Option<Meta> {
    let value: Value = match serde_json::from_slice(bytes) {
        Ok(value) => value,
        Err(error) => {
            let line = u64::try_from(error.line()).unwrap_or(0);
            found.problem(Place::file(META).line(line), format!("is no JSON: {error}"));
            return None;
        }
    };
    let mut fields = Fields::root(META, &value, found)?;
    let format: &str = fields.get("format", found)?;
    if format != FORMAT {
        let message = format!("is \"{format}\"; this reads \"{FORMAT}\"");
        fields.fault("format", message, found);
        return None;
    }
    let environment = environment(&mut fields, found);
    let objects = fields.objects("vehicles", found);
    let ids = objects.iter().map(|(id, _)| (*id).to_owned()).collect();
    let vehicles: Vec<Vehicle> = objects
        .into_iter()
        .filter_map(|(id, mut of)| vehicle(id, &mut of, found))
        .collect();
    let has_probe = fields.has("probe");
    let instrument = has_probe
        .then(|| fields.object("probe", found))
        .flatten()
        .and_then(|mut of| instrument(&mut of, found));
    let declared = fields.object("baseline", found);
    let baseline = declared.map(|mut of| declared_baseline(&mut of, found));
    let channels = fields.get("channels", found);
    fields.finish(found);
    Some(Meta {
        environment: environment?,
        vehicles,
        ids,
        has_probe,
        instrument,
        baseline: baseline?,
        channels: channels?,
    })
}

fn environment(fields: &mut Fields<'_>, found: &mut Found) -> Option<Environment> {
    let gravity_mps2 = fields.positive("g_mps2", found);
    let mut of = fields.object("environment", found)?;
    let temperature_k = of.positive("temperature_k", found);
    let pressure_pa = of.positive("pressure_pa", found);
    let floor_z_m = of.optional("floor_z_m", found);
    let ceiling_z_m = of.optional("ceiling_z_m", found);
    let ambient_mps = of.not_negative("ambient_speed_before_takeoff_mps", found);
    let ambient_is_subtracted = of.get("ambient_is_subtracted", found);
    if let (Some(floor), Some(ceiling)) = (floor_z_m, ceiling_z_m)
        && ceiling <= floor
    {
        let message = format!("is {ceiling}, not above the floor at {floor}");
        of.fault("ceiling_z_m", message, found);
    }
    of.finish(found);
    if ambient_is_subtracted == Some(true) {
        let message = "the ambient speed has been taken off the readings; of a magnitude that takes too much wherever the jet blows across it";
        found.remark(RemarkKind::Assumed, None, message);
    }
    Some(Environment {
        gravity_mps2: gravity_mps2?,
        air: Air {
            temperature_c: temperature_k? - ZERO_CELSIUS_K,
            pressure_pa: pressure_pa?,
        },
        floor_z_m,
        ceiling_z_m,
        ambient_mps: ambient_mps?,
        ambient_is_subtracted: ambient_is_subtracted?,
    })
}

fn vehicle(id: &str, of: &mut Fields<'_>, found: &mut Found) -> Option<Vehicle> {
    let kind: Option<&str> = of.get("type", found);
    let mass_kg: Option<f64> = of.get("mass_kg", found);
    let propeller_diameter_m: Option<f64> = of.get("prop_diameter_m", found);
    let propellers: Option<f64> = of.get("n_props", found);
    let motor_distance_m: Option<f64> = of.get("motor_distance_m", found);
    let width_factor = of.optional("width_factor", found).unwrap_or(1.0);
    let role = of.word("role", &ROLES, found);
    of.finish(found);
    let propellers = propellers?;
    // Exact for every count that there is; the cast saturates for the others, which the airframe
    // refuses or the fraction gives away.
    let count = propellers as u32;
    if f64::from(count) != propellers {
        let message = format!("is {propellers}; it must be a whole number");
        of.fault("n_props", message, found);
        return None;
    }
    let (mass_kg, propeller_diameter_m) = (mass_kg?, propeller_diameter_m?);
    let motor_distance_m = motor_distance_m?;
    for problem in Airframe::problems(
        mass_kg,
        count,
        propeller_diameter_m,
        motor_distance_m,
        width_factor,
    ) {
        let key = match problem.field() {
            "propellers" => "n_props",
            "propeller_diameter_m" => "prop_diameter_m",
            other => other,
        };
        of.fault(key, problem.to_string(), found);
    }
    let airframe = Airframe::new(
        kind?,
        mass_kg,
        count,
        propeller_diameter_m,
        motor_distance_m,
        width_factor,
    );
    Some(Vehicle {
        id: id.to_owned(),
        airframe: airframe.ok()?,
        known: Known {
            mass: Origin::Stated,
            propeller_diameter: Origin::Stated,
            motor_distance: Origin::Stated,
        },
        role: role?,
        track: Track::default(),
        thrust_map: None,
        clock: Clock::Shared,
    })
}

fn instrument(of: &mut Fields<'_>, found: &mut Found) -> Option<Instrument> {
    let kind: Option<&str> = of.get("kind", found);
    let measures = of.word("measures", &MEASURES, found);
    let rate_hz = of.positive("rate_hz", found);
    let lowpass_tau_s = of.not_negative("lowpass_tau_s", found);
    let accuracy_abs_mps = of.not_negative("accuracy_abs_mps", found);
    let accuracy_rel = of.not_negative("accuracy_rel", found);
    let resolution_mps = of.not_negative("resolution_mps", found);
    of.finish(found);
    Some(Instrument {
        kind: kind?.to_owned(),
        measures: measures?,
        rate_hz: rate_hz?,
        lowpass_tau_s: lowpass_tau_s?,
        accuracy_abs_mps: accuracy_abs_mps?,
        accuracy_rel: accuracy_rel?,
        resolution_mps: resolution_mps?,
    })
}

/// All of its words are required here: a recording that leaves one open does not say what it is
/// compared with.
fn declared_baseline(of: &mut Fields<'_>, found: &mut Found) -> Baseline {
    let mut text = |key, found: &mut Found| of.get(key, found).map(|text: &str| text.to_owned());
    let declared = Declared {
        superposition: text("superposition", found),
        emitter_delay: text("emitter_delay", found),
        near_field: text("near_field", found),
        receiver_air: text("receiver_air", found),
        receiver_law: text("receiver_law", found),
        observation: text("observation", found),
        convection: of.optional("convection", found),
    };
    of.finish(found);
    baseline(META, &declared, found)
}
