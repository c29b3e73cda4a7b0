//! A `downwash-recording/1` folder: `meta.json` and the tables that it names.

use std::collections::BTreeMap;

use airflow::Jet;
use nalgebra::Vector3;

use super::checks::FlightLimits;
use super::columns;
use super::found::{Found, Place, did_you_mean, listed};
use super::meta::{META, Meta, meta};
use super::probes::{PROBES, probes};
use super::samples::Samples;
use super::table::Table;
use super::track::{Conventions, Frame, Turns, track};
use crate::record::problem::Problems;
use crate::record::recording::{ReceiverSample, Recording, Vehicle};
use crate::record::remark::RemarkKind;

const VEHICLES: &str = "vehicles.csv";
const RECEIVER: &str = "receiver.csv";
/// Every table that a folder may have.
const TABLES: [&str; 3] = [VEHICLES, PROBES, RECEIVER];
/// Every file of a folder that is read.
pub const FOLDER_FILES: [&str; 4] = [META, VEHICLES, PROBES, RECEIVER];
/// Tilt (deg) taken for a crash. Chosen here: the model is of hover and slow flight.
pub(super) const CRASH_TILT_DEG: f64 = 45.0;

/// A recording from the files of its folder, by name: `meta.json` and the tables beside it.
///
/// # Errors
/// Everything that keeps it from being read, in the order meta.json, vehicles.csv, probes.csv,
/// receiver.csv.
pub fn read_folder(name: &str, files: &BTreeMap<String, Vec<u8>>) -> Result<Recording, Problems> {
    let mut found = Found::default();
    let read = folder(name, files, &mut found);
    found.recording(read)
}

fn folder(name: &str, files: &BTreeMap<String, Vec<u8>>, found: &mut Found) -> Option<Recording> {
    let Some(bytes) = files.get(META) else {
        found.problem(Place::file(META), "is missing");
        return None;
    };
    let meta = meta(bytes, found)?;
    for channel in &meta.channels {
        let place = Place::field(META, "channels");
        if !TABLES.contains(&channel.as_str()) {
            let message = format!("names \"{channel}\"; tables are {}", listed(TABLES));
            found.helped(place, message, did_you_mean(channel, TABLES));
        } else if !files.contains_key(channel) {
            found.problem(place, format!("names {channel}, which is not there"));
        }
    }
    for table in TABLES {
        let is_named = meta.channels.iter().any(|channel| channel == table);
        if files.contains_key(table) && !is_named {
            let message =
                format!("{table} is there but not among the `channels` of {META}: not used");
            found.remark(RemarkKind::Unused, None, message);
        }
    }
    let named = |table: &str| {
        let is_named = meta.channels.iter().any(|channel| channel == table);
        files.get(table).filter(|_| is_named)
    };
    let vehicles = match named(VEHICLES) {
        Some(bytes) => vehicles(bytes, &meta, found),
        None => {
            let message =
                format!("must name {VEHICLES}: without tracks there is nothing to simulate");
            found.problem(Place::field(META, "channels"), message);
            None
        }
    };
    let probes = match (named(PROBES), &meta.instrument) {
        (None, _) => None,
        (Some(bytes), Some(instrument)) => probes(bytes, instrument, found),
        (Some(_), None) if meta.has_probe => None, // told above
        (Some(_), None) => {
            found.problem(
                Place::field(META, "probe"),
                format!("is missing, and {PROBES} needs it"),
            );
            None
        }
    };
    let vehicles = vehicles?;
    let receivers = named(RECEIVER)
        .and_then(|bytes| receivers(bytes, &meta, &vehicles, found))
        .unwrap_or_default();
    Some(Recording {
        name: name.to_owned(),
        environment: meta.environment,
        vehicles,
        probes,
        receivers,
        baseline: meta.baseline,
        jet: Jet::default(),
        remarks: Vec::new(),
    })
}

fn vehicles(bytes: &[u8], meta: &Meta, found: &mut Found) -> Option<Vec<Vehicle>> {
    let (rows, columns) = columns::read(
        VEHICLES,
        bytes,
        &BTreeMap::new(),
        found,
        |columns, found| {
            if columns.vehicle.is_none() {
                found.problem(Place::field(VEHICLES, "vehicle_id").line(1), "is missing");
            }
        },
    )?;
    let how = Conventions {
        frame: Frame::ZUp,
        acceleration: None,
        rotation: Turns::BodyToWorld,
        pitch: None,
        gravity_mps2: meta.environment.gravity_mps2,
        rotor_offset_m: Vector3::zeros(),
        limits: FlightLimits {
            floor_z_m: meta.environment.floor_z_m,
            touch_z_m: None,
            tilt_rad: CRASH_TILT_DEG.to_radians(),
        },
    };
    let by_vehicle = rows.by_vehicle(VEHICLES, meta.ids.iter().map(String::as_str), found);
    let mut vehicles = Vec::with_capacity(meta.vehicles.len());
    for vehicle in &meta.vehicles {
        let id = &vehicle.id;
        let name = rows.names.iter().position(|name| name == id);
        let Some(mine) = name.map(|name| &by_vehicle[name]) else {
            let field = format!("vehicles.{id}");
            let message = format!("has no row in {VEHICLES}");
            found.problem(Place::field(META, &field), message);
            continue;
        };
        let samples = Samples::gather(id, &rows, &columns, mine, how.gravity_mps2, found);
        if let Some(track) = track(id, VEHICLES, samples, &how, found) {
            vehicles.push(Vehicle {
                track,
                ..vehicle.clone()
            });
        }
    }
    Some(vehicles)
}

fn receivers(
    bytes: &[u8],
    meta: &Meta,
    vehicles: &[Vehicle],
    found: &mut Found,
) -> Option<Vec<ReceiverSample>> {
    let table = Table::open(RECEIVER, bytes, found)?;
    let names = ["t_s", "throttle_ratio", "vehicle_id"];
    let mut wanted = table.columns(&names, &["battery_v"], found)?;
    let id = wanted.pop();
    wanted.extend(table.column("battery_v"));
    let rows = table.read(&wanted, id, found);
    rows.by_vehicle(RECEIVER, meta.ids.iter().map(String::as_str), found);
    let mut samples = Vec::with_capacity(rows.lines.len());
    let mut last_s = vec![f64::NEG_INFINITY; rows.names.len()];
    let mut left_out = Vec::new();
    for (row, &line) in rows.lines.iter().enumerate() {
        let id = &rows.names[rows.named[row]];
        let Some(vehicle) = vehicles.iter().position(|of| of.id == *id) else {
            continue; // told above
        };
        let (t_s, mut throttle_ratio) = (rows.numbers[0][row], rows.numbers[1][row]);
        if !t_s.is_finite() {
            found.problem(Place::field(RECEIVER, "t_s").line(line), "has no time");
        }
        let last_s = &mut last_s[rows.named[row]];
        if t_s <= *last_s || !(0.0..=5.0).contains(&throttle_ratio) {
            left_out.push(t_s);
            throttle_ratio = f64::NAN;
        }
        *last_s = last_s.max(t_s);
        let battery_v = rows.numbers.get(2).map(|column| column[row]);
        samples.push(ReceiverSample {
            t_s,
            vehicle,
            throttle_ratio,
            battery_v: battery_v.filter(|volts| volts.is_finite() && *volts > 0.0),
        });
    }
    let what = format!(
        "of {RECEIVER} left out: their time repeats or goes back, or the throttle is missing or outside 0 to 5 times hover"
    );
    found.rows(RemarkKind::Impossible, None, ("row", left_out), &what);
    Some(samples)
}

#[cfg(test)]
mod tests;
