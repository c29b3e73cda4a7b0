//! A flight log: one table, a row for each vehicle and time, or all of one vehicle; its campaign
//! says the rest.

use airflow::{Air, Airframe, Jet};
use nalgebra::Vector3;

use super::campaign::{Campaign, Sourced, VehicleType};
use super::columns::{self, Role as Column, Unit};
use super::conventions::{CRASH_TILT_DEG, Conventions};
use super::crazyflie;
use super::found::{Found, Start, listed};
use super::log::Log;
use super::plausible;
use super::samples::Samples;
use super::table::{Rows, Table};
use super::track::track;
use crate::record::problem::Problem;
use crate::record::recording::{Clock, Environment, Recording, Role, Track, Vehicle};
use crate::record::remark::RemarkKind;
use crate::record::track::ThrustSource;

/// A table in CSV. One with the Crazyflie's names needs no `columns`.
pub(super) fn flight(log: Log<'_>, campaign: &Campaign, found: &mut Found) -> Option<Recording> {
    let Log { name, file, bytes } = log;
    let table = Table::open(file, bytes, found)?;
    let campaign = crazyflie::completed(campaign, table.header());
    let vehicles = vehicles((name, file), table, &campaign, found)?;
    recording(name, file, vehicles, &campaign, found)
}

/// The recording of a log of one vehicle: the campaign's only one, or the one that the log is named
/// after. `samples` reads it, by its id.
pub(super) fn of_one(
    name: &str,
    file: &str,
    campaign: &Campaign,
    found: &mut Found,
    samples: impl FnOnce(&str, &mut Found) -> Option<Samples>,
) -> Option<Recording> {
    let one = match campaign.vehicles.0.as_slice() {
        [one] => Some(one),
        several => several.iter().find(|(id, _)| id == name),
    };
    let Some((id, kind)) = one else {
        let ids = listed(campaign.vehicles.keys());
        let message = format!("is of one vehicle, and the campaign has several: {ids}");
        let help = format!(
            "name the log after its vehicle, or list only one; this one is called `{name}`"
        );
        found.helped(Problem::file(file), message, Some(help));
        return None;
    };
    let samples = samples(id, found)?;
    let kind = campaign.types.get(kind)?;
    let vehicles = vehicle(id, file, samples, kind, campaign, found);
    recording(name, file, vehicles.into_iter().collect(), campaign, found)
}

/// The recording of some vehicles; a problem where there are none.
pub(super) fn recording(
    name: &str,
    file: &str,
    mut vehicles: Vec<Vehicle>,
    campaign: &Campaign,
    found: &mut Found,
) -> Option<Recording> {
    if vehicles.is_empty() {
        if found.problems.is_empty() {
            let help = found.remarks.last().map(|remark| remark.message.clone());
            found.helped(Problem::file(file), "no vehicle ever flew", help);
        }
        return None;
    }
    vehicles.sort_by(|a, b| a.id.cmp(&b.id));
    if campaign.clock.is_none() && vehicles.len() > 1 {
        let message = "the vehicles are taken to share one clock";
        found.remark(RemarkKind::Assumed, None, message);
    }
    Some(Recording {
        name: name.to_owned(),
        environment: environment(campaign, found),
        vehicles,
        probes: None,
        receivers: Vec::new(),
        baseline: campaign.baseline(),
        jet: Jet::default(),
        remarks: Vec::new(),
    })
}

fn environment(campaign: &Campaign, found: &mut Found) -> Environment {
    let air = match campaign.stated_air() {
        Some(air) => air,
        None => {
            let message = "the air is not stated: taken as 20 °C and 101325 Pa";
            found.remark(RemarkKind::Assumed, None, message);
            Air::default()
        }
    };
    Environment {
        gravity_mps2: campaign.gravity_mps2(),
        air,
        floor_z_m: campaign.floor_z_m.map(|floor| floor.0),
        ceiling_z_m: campaign.ceiling_z_m.map(|ceiling| ceiling.0),
        ambient_mps: 0.0,
        ambient_is_subtracted: false,
    }
}

fn vehicles(
    (name, file): (&str, &str),
    table: Table<'_>,
    campaign: &Campaign,
    found: &mut Found,
) -> Option<Vec<Vehicle>> {
    let renamed = &campaign.columns.0;
    let only = match campaign.vehicles.0.as_slice() {
        [(only, _)] => Some(only.as_str()),
        _ => campaign.vehicles.keys().find(|id| *id == name),
    };
    let (mut rows, columns) = columns::read(file, table, renamed, found, |columns, found| {
        if columns.vehicle.is_none() && only.is_none() {
            let ids = listed(campaign.vehicles.keys());
            let message = format!("is missing, and the campaign has several vehicles: {ids}");
            found.problem(Problem::field(file, "vehicle").line(1), message);
        }
        // Without its kind an acceleration is one gravity off, or not.
        let acceleration = columns.by_role.get(&Column::Acceleration(0));
        if let (Some(column), None) = (acceleration, campaign.acceleration) {
            let place = Problem::field(file, &column.name).line(1);
            let message = "is an acceleration, and the metadata do not say of which kind";
            let help = "write `acceleration: SpecificForceInWorld` (at hover az is +g), `SpecificForceInBody`, `GravityRemovedInWorld` (at hover az is 0) or `GravityRemovedInBody`";
            found.helped(place, message, Some(help.to_owned()));
        }
    })?;
    // A table without a column of vehicles is of the only one that the campaign has, or of the one
    // that the log is named after.
    if let (None, Some(only)) = (columns.vehicle, only) {
        rows.names = vec![only.to_owned()];
        rows.named = vec![0; rows.lines.len()];
    }
    since_its_start(&mut rows, &columns, found);
    let by_vehicle = rows.by_vehicle(file, campaign.vehicles.keys(), found);
    let mut vehicles = Vec::with_capacity(by_vehicle.len());
    for (id, mine) in rows.names.iter().zip(&by_vehicle) {
        let kind = campaign.vehicles.get(id);
        let Some(kind) = kind.and_then(|kind| campaign.types.get(kind)) else {
            continue; // told above
        };
        let samples = Samples::gather(id, (&rows, &columns), mine, campaign.gravity_mps2(), found);
        vehicles.extend(vehicle(id, file, samples, kind, campaign, found));
    }
    Some(vehicles)
}

/// Times (s) beyond which they count from an epoch, not from a start. Chosen here: eleven days.
const EPOCH_S: f64 = 1e6;

/// Times that count from an epoch are counted from the first on.
fn since_its_start(rows: &mut Rows, columns: &columns::Columns, found: &mut Found) {
    let mut times = columns.by_role.iter().zip(&mut rows.numbers);
    let Some(((_, column), times)) = times.find(|((role, _), _)| **role == Column::Time) else {
        return;
    };
    let factor = match column.unit {
        Unit::Times(factor) => factor,
        Unit::Gravities => return,
    };
    let finite = times.iter().copied().filter(|time| time.is_finite());
    let Some(first) = finite
        .reduce(f64::min)
        .filter(|first| first * factor > EPOCH_S)
    else {
        return;
    };
    times.iter_mut().for_each(|time| *time -= first);
    let first_s = first * factor;
    found.starts = Some(Start {
        at_s: first_s,
        within_s: 0.0,
    });
    let message = format!(
        "times count from {first_s:.3} s of column `{}`",
        column.name
    );
    found.remark(RemarkKind::Assumed, None, message);
}

/// One vehicle with its track; `None` where nothing of it is left.
pub(super) fn vehicle(
    id: &str,
    file: &str,
    samples: Samples,
    kind: &VehicleType,
    campaign: &Campaign,
    found: &mut Found,
) -> Option<Vehicle> {
    let mut times_s = samples.column(Column::Time).iter().copied();
    let first_s = times_s.find(|t_s| t_s.is_finite());
    let earlier = found.first_s.into_iter().chain(first_s);
    found.first_s = earlier.reduce(f64::min);
    let mut unusable = campaign.acceleration_unusable.iter();
    let is_unusable = unusable.any(|other| other == id);
    if is_unusable && !samples.column(Column::Acceleration(0)).is_empty() {
        let message = "its acceleration is not used: the campaign says so";
        found.remark(RemarkKind::Unused, Some(id), message);
    }
    let tilt_deg = campaign
        .crash_tilt_deg
        .map_or(CRASH_TILT_DEG, |tilt| tilt.0);
    let offset = kind.rotor_offset_m.map(|offset| offset.value());
    let how = Conventions {
        frame: campaign.frame,
        acceleration: campaign.acceleration.filter(|_| !is_unusable),
        rotation: campaign.quaternion,
        pitch: campaign.pitch,
        gravity_mps2: campaign.gravity_mps2(),
        rotor_offset_m: offset.map_or_else(Vector3::zeros, |o| Vector3::from(o.map(|axis| axis.0))),
        floor_z_m: campaign.floor_z_m.map(|floor| floor.0),
        touch_z_m: kind.touch_z_m.map(|touch| touch.0),
        crash_tilt_rad: tilt_deg.to_radians(),
    };
    assumptions(id, kind, found);
    let track = track(id, file, samples, &how, found)?;
    let airframe = Airframe::new(
        campaign.vehicles.get(id)?,
        kind.mass_kg.value().0,
        kind.propellers,
        kind.propeller_diameter_m.value().0,
        kind.motor_distance_m.value().0,
        kind.width_factor.0,
    );
    // Every number of it was checked with the campaign.
    let airframe = airframe.ok()?;
    let air = campaign.stated_air().unwrap_or_default();
    let ideal_w = airframe.hover_power_w(airframe.mass_kg(), air.density_kg_per_m3());
    plausible::power((id, file), &track, ideal_w, found);
    superseded(id, &track, found);
    let weight_n = airframe.mass_kg() * campaign.gravity_mps2();
    plausible::force((id, file), &track, weight_n, found);
    // Its numbers were checked, too.
    let thrust_map = kind.thrust_map.as_ref().and_then(|map| map.meaning().ok());
    let is_of_duty = track.thrust_source() == Some(ThrustSource::DutyCycle);
    if thrust_map.is_some() {
        let (kind, message) = match is_of_duty {
            true => (
                RemarkKind::Assumed,
                "its thrust map is taken as stated, but for an offset where enough is flown to find one",
            ),
            false => (
                RemarkKind::Unused,
                "its thrust map is not used: it is of duty cycles, which do not tell its thrust",
            ),
        };
        found.remark(kind, Some(id), message);
    }
    Some(Vehicle {
        id: id.to_owned(),
        airframe,
        role: Role::Both,
        track,
        thrust_map: thrust_map.filter(|_| is_of_duty),
        clock: campaign.clock.unwrap_or(Clock::Shared),
    })
}

/// Of several columns that give a force, the unused ones. Duty cycles with a battery give the
/// motors' input, too.
fn superseded(id: &str, track: &Track, found: &mut Found) {
    let has_force = track.specific_force_mps2.is_some() || track.force_n.is_some();
    let Some(source) = track.thrust_source().filter(|_| has_force) else {
        return;
    };
    let is_duty_alone = track.battery_v.is_none() || source == ThrustSource::DutyCycle;
    // Beside a ready force the thrust is what it counts from.
    let has_thrust = track.thrust_n.is_some() && source != ThrustSource::ReadyForce;
    let there = [
        (
            track.rotor_speed_radps.is_some(),
            ThrustSource::RotorSpeed,
            "speeds of rotors",
        ),
        (
            track.duty.is_some() && is_duty_alone,
            ThrustSource::DutyCycle,
            "duty cycles",
        ),
        (has_thrust, ThrustSource::Thrust, "thrust"),
        (
            track.force_n.is_some(),
            ThrustSource::ReadyForce,
            "ready force",
        ),
    ];
    let words = |is_used: bool| {
        let there = there
            .iter()
            .filter(|(is_there, of, _)| *is_there && (*of == source) == is_used);
        let words: Vec<&str> = there.map(|(.., words)| *words).collect();
        words.join(", ")
    };
    let others = words(false);
    if !others.is_empty() {
        let message = format!("its force is told by {}, not by {others}", words(true));
        found.remark(RemarkKind::Unused, Some(id), message);
    }
}

/// Assumed values.
fn assumptions(id: &str, kind: &VehicleType, found: &mut Found) {
    let mut tell = |what: String| found.remark(RemarkKind::Assumed, Some(id), what);
    for (name, value) in [
        ("mass", (kind.mass_kg, "kg")),
        ("propeller diameter", (kind.propeller_diameter_m, "m")),
        ("motor distance", (kind.motor_distance_m, "m")),
    ] {
        if let (Sourced::Assumed(number), unit) = value {
            tell(format!("its {name} is assumed: {} {unit}", number.0));
        }
    }
    match kind.rotor_offset_m {
        None => tell("the logged point is taken as the centre of the rotor plane".to_owned()),
        Some(Sourced::Assumed(offset)) => {
            let [x, y, z] = offset.map(|axis| axis.0);
            tell(format!(
                "the rotor plane is assumed ({x}, {y}, {z}) m from the logged point"
            ));
        }
        Some(_) => {}
    }
}

#[cfg(test)]
mod tests;
