//! `meta.json` of a `downwash-recording/1` folder: surroundings, vehicles, probe, and what "simulation" means.

use airflow::{Air, Airframe};
use serde_json::Value;

use super::declared::{Declared, baseline};
use super::found::{Found, Place};
use super::json::Fields;
use crate::record::baseline::Baseline;
use crate::record::recording::{Environment, Instrument, Known, Measures, Origin, Role};
use crate::record::remark::RemarkKind;

/// The file's name.
pub(super) const META: &str = "meta.json";
/// The only format that is read.
const FORMAT: &str = "downwash-recording/1";
/// 0 °C (K).
const ZERO_CELSIUS_K: f64 = 273.15;

/// What `meta.json` says.
pub(super) struct Meta {
    pub(super) environment: Environment,
    /// Sorted by id.
    pub(super) vehicles: Vec<MetaVehicle>,
    /// Every id that it speaks of, also where something is wrong with the vehicle.
    pub(super) ids: Vec<String>,
    /// Whether it speaks of a probe.
    pub(super) has_probe: bool,
    pub(super) instrument: Option<Instrument>,
    pub(super) baseline: Baseline,
    /// Names of the tables that belong to it.
    pub(super) channels: Vec<String>,
}

/// A vehicle without its track.
pub(super) struct MetaVehicle {
    pub(super) id: String,
    pub(super) airframe: Airframe,
    pub(super) known: Known,
    pub(super) role: Role,
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
    let format = fields.text("format", found)?;
    if format != FORMAT {
        fields.fault(
            "format",
            format!("is \"{format}\"; this reads \"{FORMAT}\""),
            found,
        );
        return None;
    }
    let environment = environment(&mut fields, found);
    let objects = fields.objects("vehicles", found);
    let ids = objects.iter().map(|(id, _)| (*id).to_owned()).collect();
    let vehicles: Vec<MetaVehicle> = objects
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
    let channels = fields.texts("channels", found);
    unread(&fields, found);
    Some(Meta {
        environment: environment?,
        vehicles,
        ids,
        has_probe,
        instrument,
        baseline: baseline?,
        channels: channels?.into_iter().map(str::to_owned).collect(),
    })
}

fn environment(fields: &mut Fields<'_>, found: &mut Found) -> Option<Environment> {
    let gravity_mps2 = fields.number("g_mps2", found);
    if let Some(gravity_mps2) = gravity_mps2
        && gravity_mps2 <= 0.0
    {
        fields.fault(
            "g_mps2",
            format!("is {gravity_mps2}; it must be above 0"),
            found,
        );
    }
    let mut of = fields.object("environment", found)?;
    let temperature_k = of.number("temperature_k", found);
    let pressure_pa = of.number("pressure_pa", found);
    let floor_z_m = of.optional_number("floor_z_m", found);
    let ceiling_z_m = of.optional_number("ceiling_z_m", found);
    let ambient_mps = of.not_negative("ambient_speed_before_takeoff_mps", found);
    let ambient_is_subtracted = of.flag("ambient_is_subtracted", found);
    if let Some(kelvin) = temperature_k
        && kelvin <= 0.0
    {
        of.fault(
            "temperature_k",
            format!("is {kelvin}; it must be above 0"),
            found,
        );
    }
    if let Some(pascal) = pressure_pa
        && pascal <= 0.0
    {
        of.fault(
            "pressure_pa",
            format!("is {pascal}; it must be above 0"),
            found,
        );
    }
    if let (Some(floor), Some(ceiling)) = (floor_z_m, ceiling_z_m)
        && ceiling <= floor
    {
        of.fault(
            "ceiling_z_m",
            format!("is {ceiling}, not above the floor at {floor}"),
            found,
        );
    }
    unread(&of, found);
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

fn vehicle(id: &str, of: &mut Fields<'_>, found: &mut Found) -> Option<MetaVehicle> {
    let kind = of.text("type", found);
    let mass_kg = of.number("mass_kg", found);
    let propeller_diameter_m = of.number("prop_diameter_m", found);
    let propellers = of.number("n_props", found);
    let motor_distance_m = of.number("motor_distance_m", found);
    let width_factor = of.optional_number("width_factor", found).unwrap_or(1.0);
    let role = match of.text("role", found) {
        Some("emitter") => Some(Role::Emitter),
        Some("receiver") => Some(Role::Receiver),
        Some("both") => Some(Role::Both),
        Some(other) => {
            let message = format!("is \"{other}\"; it must be emitter, receiver or both");
            of.fault("role", message, found);
            None
        }
        None => None,
    };
    unread(of, found);
    let propellers = propellers?;
    // Exact for every count that there is; the cast saturates for the others, which the airframe refuses or the fraction gives away.
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
    Some(MetaVehicle {
        id: id.to_owned(),
        airframe: airframe.ok()?,
        known: Known {
            mass: Origin::Stated,
            propeller_diameter: Origin::Stated,
            motor_distance: Origin::Stated,
        },
        role: role?,
    })
}

fn instrument(of: &mut Fields<'_>, found: &mut Found) -> Option<Instrument> {
    let kind = of.text("kind", found);
    let measures = match of.text("measures", found) {
        Some("speed_magnitude") => Some(Measures::SpeedMagnitude),
        Some("axial") => Some(Measures::Axial),
        Some(other) => {
            let message = format!("is \"{other}\"; it must be speed_magnitude or axial");
            of.fault("measures", message, found);
            None
        }
        None => None,
    };
    let rate_hz = of.number("rate_hz", found);
    if let Some(rate_hz) = rate_hz
        && rate_hz <= 0.0
    {
        of.fault(
            "rate_hz",
            format!("is {rate_hz}; it must be above 0"),
            found,
        );
    }
    let lowpass_tau_s = of.not_negative("lowpass_tau_s", found);
    let accuracy_abs_mps = of.not_negative("accuracy_abs_mps", found);
    let accuracy_rel = of.not_negative("accuracy_rel", found);
    let resolution_mps = of.not_negative("resolution_mps", found);
    unread(of, found);
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

/// All of its words are required here: a recording that leaves one open does not say what it is compared with.
fn declared_baseline(of: &mut Fields<'_>, found: &mut Found) -> Baseline {
    let mut text = |key, found: &mut Found| of.text(key, found).map(str::to_owned);
    let declared = Declared {
        superposition: text("superposition", found),
        emitter_delay: text("emitter_delay", found),
        near_field: text("near_field", found),
        receiver_air: text("receiver_air", found),
        receiver_law: text("receiver_law", found),
        observation: text("observation", found),
        convection: of.optional_number("convection", found),
    };
    unread(of, found);
    baseline(META, &declared, Baseline::default(), found)
}

fn unread(fields: &Fields<'_>, found: &mut Found) {
    for path in fields.unread() {
        let message = format!("`{path}` of {META} is not used");
        found.remark(RemarkKind::Unused, None, message);
    }
}
