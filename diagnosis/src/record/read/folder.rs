//! A `downwash-recording/1` folder: `meta.json` and the tables that it names.

use std::collections::BTreeMap;

use airflow::Jet;
use nalgebra::Vector3;

use super::checks::FlightLimits;
use super::columns::{self, Columns};
use super::found::{Found, Place, did_you_mean, listed};
use super::meta::{META, Meta, MetaVehicle, meta};
use super::probes::{PROBES, probes};
use super::samples::{GROUPS, Samples};
use super::table::{Rows, Table};
use super::track::{Conventions, Frame, Turns, track};
use crate::record::problem::Problems;
use crate::record::recording::{Clock, ReceiverSample, Recording, Vehicle};
use crate::record::remark::{Remark, RemarkKind};

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
/// Everything that keeps it from being read, in the order meta.json, vehicles.csv, probes.csv, receiver.csv.
pub fn read_folder(name: &str, files: &BTreeMap<String, Vec<u8>>) -> Result<Recording, Problems> {
    let mut found = Found::default();
    let read = folder(name, files, &mut found);
    let (mut recording, remarks) = found.into_result(read)?;
    recording.remarks = remarks;
    Ok(recording)
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
    let (rows, columns) = table(VEHICLES, bytes, found)?;
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
    let by_vehicle = split(&rows);
    unknown(
        VEHICLES,
        &rows,
        &by_vehicle,
        meta.ids.iter().map(String::as_str),
        found,
    );
    let mut vehicles = Vec::with_capacity(meta.vehicles.len());
    for MetaVehicle {
        id,
        airframe,
        known,
        role,
    } in &meta.vehicles
    {
        let name = rows.names.iter().position(|name| name == id);
        let Some(mine) = name.map(|name| &by_vehicle[name]) else {
            let field = format!("vehicles.{id}");
            found.problem(
                Place::field(META, &field),
                format!("has no row in {VEHICLES}"),
            );
            continue;
        };
        let samples = Samples::gather(id, &rows, &columns, mine, how.gravity_mps2, found);
        let Some(track) = track(id, VEHICLES, samples, &how, found) else {
            continue;
        };
        vehicles.push(Vehicle {
            id: id.clone(),
            airframe: airframe.clone(),
            known: *known,
            role: *role,
            track,
            thrust_map: None,
            clock: Clock::Shared,
        });
    }
    Some(vehicles)
}

/// A long table of vehicles with all the columns that are known.
pub(super) fn table(file: &str, bytes: &[u8], found: &mut Found) -> Option<(Rows, Columns)> {
    let table = Table::open(file, bytes, found)?;
    let before = found.problems.len();
    let mut columns = columns::find(file, table.header(), &BTreeMap::new(), found);
    if columns.vehicle.is_none() {
        found.problem(Place::field(file, "vehicle_id").line(1), "is missing");
    }
    for group in GROUPS {
        columns.drop_partial(group, found, file);
    }
    if found.problems.len() > before {
        return None;
    }
    unused(file, &columns, found);
    let wanted: Vec<usize> = columns.by_role.values().map(|column| column.at).collect();
    Some((table.read(&wanted, columns.vehicle, found), columns))
}

/// One remark with all the columns that nothing reads.
pub(super) fn unused(file: &str, columns: &Columns, found: &mut Found) {
    if !columns.unused.is_empty() {
        let names = listed(columns.unused.iter().map(String::as_str));
        found.remark(
            RemarkKind::Unused,
            None,
            format!("columns of {file} that are not used: {names}"),
        );
    }
}

/// Rows of each name, in the order of [`Rows::names`].
pub(super) fn split(rows: &Rows) -> Vec<Vec<usize>> {
    let mut by_name = vec![Vec::new(); rows.names.len()];
    for (row, &name) in rows.named.iter().enumerate() {
        by_name[name].push(row);
    }
    by_name
}

/// Ids in a table that the metadata do not know: without a mass they cannot be simulated, and left out they would blow unseen.
pub(super) fn unknown<'a>(
    file: &str,
    rows: &Rows,
    by_name: &[Vec<usize>],
    known: impl Iterator<Item = &'a str> + Clone,
    found: &mut Found,
) {
    for (name, mine) in rows.names.iter().zip(by_name) {
        if !known.clone().any(|id| id == name) {
            let line = mine.first().map_or(0, |&row| rows.lines[row]);
            found.helped(
                Place::file(file).line(line),
                format!(
                    "vehicle `{name}` is not in the metadata ({} rows)",
                    mine.len()
                ),
                did_you_mean(name, known.clone())
                    .or_else(|| Some(format!("known are {}", listed(known.clone())))),
            );
        }
    }
}

fn receivers(
    bytes: &[u8],
    meta: &Meta,
    vehicles: &[Vehicle],
    found: &mut Found,
) -> Option<Vec<ReceiverSample>> {
    let table = Table::open(RECEIVER, bytes, found)?;
    let mut column = |name: &str| {
        let column = table.column(name);
        if column.is_none() {
            found.problem(Place::field(RECEIVER, name).line(1), "is missing");
        }
        column
    };
    let (time, throttle, id) = (
        column("t_s"),
        column("throttle_ratio"),
        column("vehicle_id"),
    );
    let battery = table.column("battery_v");
    let used = ["t_s", "vehicle_id", "throttle_ratio", "battery_v"];
    for name in table
        .header()
        .iter()
        .filter(|name| !used.contains(&name.as_str()))
    {
        let message = format!("column `{name}` of {RECEIVER} is not used");
        found.remark(RemarkKind::Unused, None, message);
    }
    let wanted: Vec<usize> = [time?, throttle?].into_iter().chain(battery).collect();
    let rows = table.read(&wanted, Some(id?), found);
    let by_name = split(&rows);
    unknown(
        RECEIVER,
        &rows,
        &by_name,
        meta.ids.iter().map(String::as_str),
        found,
    );
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
    if let (Some(&first), Some(&last)) = (left_out.first(), left_out.last()) {
        found.remarks.push(Remark {
            kind: RemarkKind::Impossible,
            subject: None,
            samples: left_out.len(),
            span_s: Some((first, last)),
            message: format!(
                "{} rows of {RECEIVER} left out: their time repeats or goes back, or the throttle is missing or outside 0 to 5 times hover",
                left_out.len()
            ),
        });
    }
    Some(samples)
}

#[cfg(test)]
mod tests;
