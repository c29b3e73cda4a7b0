//! A `downwash-recording/1` folder: `meta.json` (surroundings, vehicles, probe, and what
//! "simulation" means) and the tables that it names.

use std::collections::BTreeMap;

use airflow::{Air, Airframe, GRAVITY_MPS2, Jet};
use nalgebra::Vector3;
use serde_json::Value;

use super::columns::{self, Columns};
use super::conventions::{CRASH_TILT_DEG, Conventions, Frame, Turns};
use super::declared::{Declared, baseline};
use super::found::{Found, RowRemarks, did_you_mean, listed};
use super::json::Fields;
use super::plausible;
use super::probes::{PROBES, probes};
use super::samples::Samples;
use super::table::Table;
use super::track::track;
use crate::record::baseline::Baseline;
use crate::record::problem::{Problem, Problems};
use crate::record::recording::{
    Clock, Environment, Instrument, Measures, ReceiverSample, Recording, Role, Track, Vehicle,
};
use crate::record::remark::RemarkKind;

/// The file that says what the tables are of.
const META: &str = "meta.json";
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
const VEHICLES: &str = "vehicles.csv";
const RECEIVER: &str = "receiver.csv";
/// Every table that a folder may have.
const TABLES: [&str; 3] = [VEHICLES, PROBES, RECEIVER];
/// Every file of a folder that is read.
pub const FOLDER_FILES: [&str; 4] = [META, VEHICLES, PROBES, RECEIVER];

/// A recording from the files of its folder, by name: `meta.json` and the tables beside it.
///
/// # Errors
/// Everything that keeps it from being read, in the order meta.json, vehicles.csv, probes.csv,
/// receiver.csv.
pub fn read_folder(name: &str, files: &BTreeMap<String, Vec<u8>>) -> Result<Recording, Problems> {
    Found::recording(|found| folder(name, files, found))
}

fn folder(name: &str, files: &BTreeMap<String, Vec<u8>>, found: &mut Found) -> Option<Recording> {
    let Some(bytes) = files.get(META) else {
        found.problem(Problem::file(META), "is missing");
        return None;
    };
    let mut meta = meta(name, bytes, found)?;
    for channel in &meta.channels {
        let place = Problem::field(META, "channels");
        if !TABLES.contains(&channel.as_str()) {
            let message = format!("names \"{channel}\"; tables are {}", listed(TABLES));
            found.helped(place, message, did_you_mean(channel, TABLES));
        } else if !files.contains_key(channel) {
            found.problem(place, format!("names {channel}, which is not there"));
        }
    }
    let channels = std::mem::take(&mut meta.channels);
    let is_named = |table: &str| channels.iter().any(|channel| channel == table);
    let named = |table: &str| files.get(table).filter(|_| is_named(table));
    for table in TABLES.into_iter().filter(|table| !is_named(table)) {
        if files.contains_key(table) {
            let message =
                format!("{table} is there but not among the `channels` of {META}: not used");
            found.remark(RemarkKind::Unused, None, message);
        }
    }
    let has_tracks = match named(VEHICLES) {
        Some(bytes) => vehicles(bytes, &mut meta, found).is_some(),
        None => {
            let message =
                format!("must name {VEHICLES}: without tracks there is nothing to simulate");
            found.problem(Problem::field(META, "channels"), message);
            false
        }
    };
    meta.recording.probes = match (named(PROBES), &meta.instrument) {
        (None, _) => None,
        (Some(bytes), Some(instrument)) => {
            let floor_z_m = meta.recording.environment.floor_z_m;
            probes(bytes, (instrument, floor_z_m), found)
        }
        (Some(_), None) if meta.has_probe => None, // told above
        (Some(_), None) => {
            let message = format!("is missing, and {PROBES} needs it");
            found.problem(Problem::field(META, "probe"), message);
            None
        }
    };
    if let (true, Some(bytes)) = (has_tracks, named(RECEIVER)) {
        receivers(bytes, &mut meta, found);
    }
    if found.problems.is_empty() {
        overlaps(&meta.recording, found);
    }
    has_tracks.then_some(meta.recording)
}

/// Seconds since 1970 are more than this from 1973 on; a log's own are fewer for three years.
const EPOCH_S: f64 = 1e8;

/// A problem for a table with no row while any drone's place is known.
fn overlaps(recording: &Recording, found: &mut Found) {
    let span = |times_s: &mut dyn Iterator<Item = f64>| {
        times_s.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t_s| {
            (low.min(t_s), high.max(t_s))
        })
    };
    let tracks = recording.vehicles.iter().map(|it| &it.track.t_s);
    let (begin_s, end_s) = span(&mut tracks.flatten().copied());
    let samples = recording.probes.iter().flat_map(|probes| &probes.samples);
    let readings = span(&mut samples.map(|sample| sample.t_s));
    let receivers = span(&mut recording.receivers.iter().map(|it| it.t_s));
    for (table, (from_s, to_s)) in [(PROBES, readings), (RECEIVER, receivers)] {
        if from_s > to_s || begin_s > end_s || (from_s <= end_s && begin_s <= to_s) {
            continue;
        }
        let message = format!(
            "its rows are from {from_s:.1} to {to_s:.1} s, and those of {VEHICLES} from {begin_s:.1} to {end_s:.1} s: no drone's place is known at any of them"
        );
        let hours = ((from_s - begin_s) / 3600.0).round();
        let help = if (from_s > EPOCH_S) != (begin_s > EPOCH_S) {
            "one of them counts from 1970? Both have to count from the same moment".to_owned()
        } else if hours != 0.0 {
            format!("clocks {} h apart, or tables of two flights?", hours.abs())
        } else {
            "clocks that differ, or tables of two flights?".to_owned()
        };
        found.helped(Problem::field(table, "t_s"), message, Some(help));
    }
}

/// Reads the tracks of the vehicles.
fn vehicles(bytes: &[u8], meta: &mut Meta, found: &mut Found) -> Option<()> {
    let is_named = |columns: &Columns, found: &mut Found| {
        if columns.vehicle.is_none() {
            found.problem(Problem::field(VEHICLES, "vehicle_id").line(1), "is missing");
        }
    };
    let table = Table::open(VEHICLES, bytes, found)?;
    let (rows, columns) = columns::read(VEHICLES, table, &[], found, is_named)?;
    let how = Conventions {
        frame: Frame::ZUp,
        acceleration: None,
        rotation: Turns::BodyToWorld,
        pitch: None,
        gravity_mps2: meta.recording.environment.gravity_mps2,
        rotor_offset_m: Vector3::zeros(),
        floor_z_m: meta.recording.environment.floor_z_m,
        touch_z_m: None,
        crash_tilt_rad: CRASH_TILT_DEG.to_radians(),
    };
    let by_vehicle = rows.by_vehicle(VEHICLES, meta.ids.iter().map(String::as_str), found);
    for vehicle in std::mem::take(&mut meta.recording.vehicles) {
        let id = &vehicle.id;
        let name = rows.names.iter().position(|name| name == id);
        let Some(mine) = name.map(|name| &by_vehicle[name]) else {
            let field = format!("vehicles.{id}");
            let message = format!("has no row in {VEHICLES}");
            found.problem(Problem::field(META, &field), message);
            continue;
        };
        let samples = Samples::gather(id, (&rows, &columns), mine, how.gravity_mps2, found);
        if let Some(track) = track(id, VEHICLES, samples, &how, found) {
            let of = &vehicle.airframe;
            let density_kg_per_m3 = meta.recording.environment.air.density_kg_per_m3();
            let ideal_w = of.hover_power_w(of.mass_kg(), density_kg_per_m3);
            plausible::power((id, VEHICLES), &track, ideal_w, found);
            meta.recording.vehicles.push(Vehicle { track, ..vehicle });
        }
    }
    Some(())
}

/// Reads the throttle of receivers beside the tracks.
fn receivers(bytes: &[u8], meta: &mut Meta, found: &mut Found) -> Option<()> {
    let table = Table::open(RECEIVER, bytes, found)?;
    let names = ["t_s", "throttle_ratio", "vehicle_id"];
    let mut wanted = table.columns(&names, &["battery_v"], found)?;
    let id = wanted.pop();
    wanted.extend(table.column("battery_v"));
    let rows = table.read(&wanted, id, found);
    rows.by_vehicle(RECEIVER, meta.ids.iter().map(String::as_str), found);
    let mut last_s = vec![f64::NEG_INFINITY; rows.names.len()];
    let mut left_out = Vec::new();
    for (row, &line) in rows.lines.iter().enumerate() {
        let id = &rows.names[rows.named[row]];
        let mut vehicles = meta.recording.vehicles.iter();
        let Some(vehicle) = vehicles.position(|of| of.id == *id) else {
            continue; // told above
        };
        let (t_s, mut throttle_ratio) = (rows.numbers[0][row], rows.numbers[1][row]);
        if !t_s.is_finite() {
            found.problem(Problem::field(RECEIVER, "t_s").line(line), "has no time");
        }
        let last_s = &mut last_s[rows.named[row]];
        if t_s <= *last_s || !(0.0..=5.0).contains(&throttle_ratio) {
            left_out.push(row);
            throttle_ratio = f64::NAN;
        }
        *last_s = last_s.max(t_s);
        let battery_v = rows.numbers.get(2).map(|column| column[row]);
        meta.recording.receivers.push(ReceiverSample {
            t_s,
            vehicle,
            throttle_ratio,
            battery_v: battery_v.filter(|volts| volts.is_finite() && *volts > 0.0),
        });
    }
    let what = format!(
        "of {RECEIVER} left out: their time repeats or goes back, or the throttle is missing or outside 0 to 5 times hover"
    );
    let mut remarks = RowRemarks {
        found,
        subject: None,
        noun: "row",
        t_s: &rows.numbers[0],
    };
    remarks.tell(RemarkKind::Impossible, &left_out, &what);
    if left_out.len() == rows.lines.len() && !left_out.is_empty() {
        let first = rows.numbers[1][0];
        let message = format!("cannot be used in any row (first {first})");
        let help = "it is 1 in hover: is this percent, a duty cycle, or a dead column?";
        let place = Problem::field(RECEIVER, "throttle_ratio");
        found.helped(place, message, Some(help.to_owned()));
    }
    Some(())
}

/// What `meta.json` says.
struct Meta {
    /// Without tables: vehicles sorted by id, without their tracks.
    recording: Recording,
    /// Every id that it speaks of, also where something is wrong with the vehicle.
    ids: Vec<String>,
    /// Whether it speaks of a probe.
    has_probe: bool,
    instrument: Option<Instrument>,
    /// Names of the tables that belong to it.
    channels: Vec<String>,
}

/// Reads the file; `None` where something is missing that the rest depends on.
fn meta(name: &str, bytes: &[u8], found: &mut Found) -> Option<Meta> {
    let value: Value = match serde_json::from_slice(bytes) {
        Ok(value) => value,
        Err(error) => {
            let place = Problem::file(META).line(error.line() as u64);
            found.problem(place, format!("is no JSON: {error}"));
            return None;
        }
    };
    let mut fields = Fields::root(META, &value, found)?;
    let format = fields.text("format", found)?;
    if format != FORMAT {
        let message = format!("is \"{format}\"; this reads \"{FORMAT}\"");
        fields.fault("format", message, found);
        return None;
    }
    let environment = environment(&mut fields, found);
    let gravity_mps2 = environment.map_or(GRAVITY_MPS2, |of| of.gravity_mps2);
    let objects = fields.objects("vehicles", found);
    let ids = objects.iter().map(|(id, _)| (*id).to_owned()).collect();
    let vehicles = objects.into_iter();
    let vehicles = vehicles
        .filter_map(|(id, of)| vehicle(id, of, gravity_mps2, found))
        .collect();
    let has_probe = fields.has("probe");
    let probe = has_probe.then(|| fields.object("probe", found)).flatten();
    let instrument = probe.and_then(|of| instrument(of, found));
    let declared = fields.object("baseline", found);
    let baseline = declared.map(|of| declared_baseline(of, found));
    let channels = fields.texts("channels", found);
    fields.finish(found);
    Some(Meta {
        recording: Recording {
            name: name.to_owned(),
            environment: environment?,
            vehicles,
            probes: None,
            receivers: Vec::new(),
            baseline: baseline?,
            jet: Jet::default(),
            remarks: Vec::new(),
        },
        ids,
        has_probe,
        instrument,
        channels: channels?,
    })
}

fn environment(fields: &mut Fields<'_>, found: &mut Found) -> Option<Environment> {
    let gravity_mps2 = fields.positive("g_mps2", found);
    let mut of = fields.object("environment", found)?;
    let temperature_k = of.positive("temperature_k", found);
    let pressure_pa = of.positive("pressure_pa", found);
    let floor_z_m = of.optional_number("floor_z_m", found);
    let ceiling_z_m = of.optional_number("ceiling_z_m", found);
    let ambient_mps = of.not_negative("ambient_speed_before_takeoff_mps", found);
    let ambient_is_subtracted = of.flag("ambient_is_subtracted", found);
    let field = |key: &str| Problem::field(META, &format!("environment.{key}"));
    for (range, value, place) in [
        (
            &plausible::GRAVITY,
            gravity_mps2,
            Problem::field(META, "g_mps2"),
        ),
        (
            &plausible::TEMPERATURE_K,
            temperature_k,
            field("temperature_k"),
        ),
        (&plausible::PRESSURE, pressure_pa, field("pressure_pa")),
    ] {
        // What is not positive was reported.
        if let Some(value) = value.filter(|value| *value > 0.0) {
            range.holds(value, place, found);
        }
    }
    if let Some(mps) = ambient_mps {
        let place = field("ambient_speed_before_takeoff_mps");
        plausible::ambient(mps, place, found);
    }
    if let (Some(floor), Some(ceiling)) = (floor_z_m, ceiling_z_m)
        && ceiling <= floor
    {
        let message = format!("is {ceiling}, not above the floor at {floor}");
        of.fault("ceiling_z_m", message, found);
    }
    of.finish(found);
    if ambient_is_subtracted == Some(true) {
        let message = "the ambient speed has been taken off the readings; of a magnitude that takes too much wherever the jet crosses it";
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

fn vehicle(id: &str, mut of: Fields<'_>, gravity_mps2: f64, found: &mut Found) -> Option<Vehicle> {
    let kind = of.text("type", found);
    let mass_kg = of.number("mass_kg", found);
    let diameter_m = of.number("prop_diameter_m", found);
    let propellers = of.number("n_props", found);
    let distance_m = of.number("motor_distance_m", found);
    let width_factor = of.optional_number("width_factor", found).unwrap_or(1.0);
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
    let (mass_kg, diameter_m, distance_m) = (mass_kg?, diameter_m?, distance_m?);
    for problem in Airframe::problems(mass_kg, count, diameter_m, distance_m, width_factor) {
        let key = match problem.field() {
            "propellers" => "n_props",
            "propeller_diameter_m" => "prop_diameter_m",
            other => other,
        };
        of.fault(key, problem.to_string(), found);
    }
    let airframe =
        Airframe::new(kind?, mass_kg, count, diameter_m, distance_m, width_factor).ok()?;
    let place = |field: &str| {
        let key = match field {
            "propeller_diameter_m" => "prop_diameter_m",
            other => other,
        };
        Problem::field(META, &format!("vehicles.{id}.{key}"))
    };
    plausible::airframe(&airframe, gravity_mps2, place, found);
    Some(Vehicle {
        id: id.to_owned(),
        airframe,
        role: role?,
        track: Track::default(),
        thrust_map: None,
        clock: Clock::Shared,
    })
}

fn instrument(mut of: Fields<'_>, found: &mut Found) -> Option<Instrument> {
    let kind = of.text("kind", found);
    let measures = of.word("measures", &MEASURES, found);
    let rate_hz = of.positive("rate_hz", found);
    let lowpass_tau_s = of.not_negative("lowpass_tau_s", found);
    let accuracy_abs_mps = of.not_negative("accuracy_abs_mps", found);
    let accuracy_rel = of.not_negative("accuracy_rel", found);
    let resolution_mps = of.not_negative("resolution_mps", found);
    of.finish(found);
    let instrument = Instrument {
        kind: kind?.to_owned(),
        measures: measures?,
        rate_hz: rate_hz?,
        lowpass_tau_s: lowpass_tau_s?,
        accuracy_abs_mps: accuracy_abs_mps?,
        accuracy_rel: accuracy_rel?,
        resolution_mps: resolution_mps?,
    };
    let place = |key: &str| Problem::field(META, &format!("probe.{key}"));
    plausible::instrument(&instrument, place, found);
    Some(instrument)
}

/// All of its words are required here: a recording that leaves one open does not say what it is
/// compared with.
fn declared_baseline(mut of: Fields<'_>, found: &mut Found) -> Baseline {
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
    of.finish(found);
    baseline(META, &declared, found)
}

#[cfg(test)]
mod tests;
