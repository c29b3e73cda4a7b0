//! From text to what was written, with everything that is wrong on the way.

use std::collections::BTreeMap;
use std::ops::Range;

use airflow::Superposition;
use nalgebra::Point3;

use super::airframes::airframes;
use super::cell::LARGEST_M as LARGEST_CELL_M;
use super::fields::{Field, Reader, whole, within};
use super::formations::formation;
use super::limits::{
    AIR_LIMIT, ALTITUDE_M, CELL_M, CLEARANCE_M, CONVECTION, DURING_S, DWELL_S, ENERGY_WEIGHT,
    HEADING_DEG, LATITUDE_DEG, LOAD_KG, LONGITUDE_DEG, Limits, MOST_LATTICE_PLACES, PLACE_M,
    PRESSURE_PA, TEMPERATURE_C, TIME_MARGIN_S, TRACKING_M, lattice_places,
};
use super::places::{bounds, obstacle, zone};
use super::problem::Problem;
use super::source::{Value, line};
use super::written::{Air, At, Bounds, Drone, Origin, Planning, Task, Written};
use crate::plan::cause::as_typed;
use crate::scenario::world::{AtEnd, AtStart, PathMotion};

/// What could be read, and what was wrong.
///
/// Wrong items of a list are left out; in place of wrong bounds there are the widest ones, and in
/// place of other wrong values their defaults, so that the rest can still be checked against one
/// another.
#[derive(Debug)]
pub(super) struct Reading {
    /// `None` where the text is no RON or no record.
    pub(super) written: Option<Written>,
    /// Names in `airframes` whose entry was wrong: known, but not to be used.
    pub(super) spoilt_airframes: Vec<String>,
    /// What is wrong, in the order in which it was met.
    pub(super) problems: Vec<Problem>,
}

/// Reads a scenario as far as it can be read; never stops at an error.
pub(super) fn read(text: &str) -> Reading {
    let mut spoilt_airframes = Vec::new();
    let read = |reader: &mut _, value| scenario(reader, value, &mut spoilt_airframes);
    let (written, problems) = whole(text, read);
    Reading {
        written,
        spoilt_airframes,
        problems,
    }
}

/// The whole record; names of wrong airframes go to `spoilt`.
fn scenario<'t>(
    reader: &mut Reader<'t>,
    value: Value<'t>,
    spoilt: &mut Vec<String>,
) -> Option<Written> {
    let mut record = reader.record(value, "Scenario", "the scenario".to_owned())?;
    let name = record.required(reader, "name", Reader::name);
    let bounds_m = record.required(reader, "bounds_m", bounds);
    let origin = record.optional(reader, "origin", origin);
    let air = record.optional(reader, "air", air);
    let obstacles = record.optional(reader, "obstacles", |reader, field| {
        Some(reader.list(field, obstacle))
    });
    let zones = record.optional(reader, "zones", |reader, field| {
        Some(reader.list(field, zone))
    });
    let airframes = record.optional(reader, "airframes", |reader, field| {
        Some(airframes(reader, field, spoilt))
    });
    let drones = record.required(reader, "drones", drones);
    let formations = record.optional(reader, "formations", |reader, field| {
        Some(reader.list(field, formation))
    });
    let planning = record.optional(reader, "planning", planning);
    let (planning, cell_at) = planning.unwrap_or_default();
    record.close(reader);
    if let Some(bounds) = &bounds_m {
        let cell_m = planning.cell_m.unwrap_or(LARGEST_CELL_M);
        lattice_fits(reader, cell_m, cell_at, bounds);
    }
    let anywhere = |coordinate: f64| At {
        value: Point3::new(coordinate, coordinate, coordinate),
        at: value.head(),
    };
    Some(Written {
        name: name.unwrap_or_default(),
        bounds_m: bounds_m.unwrap_or(Bounds {
            min: anywhere(PLACE_M.low),
            max: anywhere(PLACE_M.high),
        }),
        origin,
        air: air.unwrap_or_default(),
        obstacles: obstacles.unwrap_or_default(),
        zones: zones.unwrap_or_default(),
        airframes: airframes.unwrap_or_default(),
        drones: drones.unwrap_or_default(),
        formations: formations.unwrap_or_default(),
        planning,
    })
}

/// Where the world lies on the Earth.
fn origin<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>) -> Option<Origin> {
    let mut record = reader.record(field.value, "Origin", "`origin`".to_owned())?;
    let mut number = |name: &'static str, limits: &'static Limits| {
        record.required(reader, name, |reader, field| reader.number(field, limits))
    };
    let latitude_deg = number("latitude_deg", &LATITUDE_DEG);
    let longitude_deg = number("longitude_deg", &LONGITUDE_DEG);
    let altitude_m = number("altitude_m", &ALTITUDE_M);
    let heading_deg = number("heading_deg", &HEADING_DEG);
    record.close(reader);
    Some(Origin {
        latitude_deg: latitude_deg?,
        longitude_deg: longitude_deg?,
        altitude_m: altitude_m?,
        heading_deg: heading_deg?,
    })
}

/// Weather and flow model; numbers that look like kelvin or hectopascal are reported as such.
pub(super) fn air<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>) -> Option<Air> {
    let mut record = reader.record(field.value, "Air", "`air`".to_owned())?;
    let mut air = Air::default();
    let temperature_c = ("temperature_c", &mut air.temperature_c);
    record.set(reader, temperature_c, |reader, field| {
        let typed = field.value.plain::<f64>();
        let kelvin = typed.filter(|kelvin| (200.0..330.0).contains(kelvin));
        let help =
            kelvin.map(|kelvin| format!("is this in kelvin? Then write {:.2}", kelvin - 273.15));
        reader.helped(help, |reader| reader.number(field, &TEMPERATURE_C))
    });
    let pressure_pa = ("pressure_pa", &mut air.pressure_pa);
    record.set(reader, pressure_pa, |reader, field| {
        let typed = field.value.plain::<f64>();
        let hectopascal = typed.filter(|hpa| (300.0..1100.0).contains(hpa));
        let help = hectopascal.map(|hpa| format!("is this in hPa? Then write {:.0}", hpa * 100.0));
        reader.helped(help, |reader| reader.number(field, &PRESSURE_PA))
    });
    let superposition = ("superposition", &mut air.superposition);
    record.set(reader, superposition, |reader, field| {
        let choices = [
            ("Momentum", Superposition::Momentum),
            ("Linear", Superposition::Linear),
            ("Strongest", Superposition::Strongest),
        ];
        reader.word(field, &choices)
    });
    air.jet = record.optional(reader, "jet", Reader::text);
    air.finding = record.optional(reader, "finding", Reader::text);
    air.convection = record.or_none(reader, "convection", |reader, field| {
        reader.range(field, &CONVECTION)
    });
    record.close(reader);
    Some(air)
}

/// The fleet without what is no record of a drone; names given twice are noted.
fn drones<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>) -> Option<Vec<Drone>> {
    let items = reader.items(field)?;
    if items.is_empty() {
        let problem =
            Problem::at(&field.value.at(), "there are no drones").label("nothing to plan");
        reader.report(
            problem.help("add one: (name: \"k1\", airframe: \"kolibri\", start_m: (1, 1, 1))"),
        );
    }
    let mut drones = Vec::new();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    // Of the last name seen: names come in order, and every line is counted once.
    let (mut at, mut line_number) = (0, 1);
    for (index, item) in items.into_iter().enumerate() {
        let Some((name, drone)) = drone(reader, item, index) else {
            continue;
        };
        drones.push(drone);
        let Some(name) = name else { continue };
        line_number += line(&reader.text[at..], name.at.start.saturating_sub(at)) - 1;
        at = name.at.start;
        if let Some(first_line) = seen.get(&name.value) {
            let problem = Problem::at(&name.at, format!("two drones are called `{}`", name.value));
            reader.report(problem.label(format!("first on line {first_line}")));
        } else {
            seen.insert(name.value, line_number);
        }
    }
    Some(drones)
}

/// The name of a drone as far as it is one, and the drone as far as it could be read.
fn drone<'t>(
    reader: &mut Reader<'t>,
    value: Value<'t>,
    index: usize,
) -> Option<(Option<At<String>>, Drone)> {
    let before = reader.problems.len();
    let mut record = reader.named(value, "Drone", index)?;
    let name = record.required(reader, "name", |reader, field| {
        Some(field.found(reader.name(field)?))
    });
    let airframe = record.required(reader, "airframe", Reader::text);
    let start_m = record.required(reader, "start_m", Reader::place);
    let at_start = record.optional(reader, "at_start", |reader, field| {
        let choices = [("Hover", AtStart::Hover), ("Landed", AtStart::Landed)];
        reader.word(field, &choices)
    });
    let tasks = record.optional(reader, "tasks", |reader, field| {
        Some(reader.list(field, |reader, value, index| {
            task(reader, value, index, field.subject)
        }))
    });
    let at_end = record.optional(reader, "at_end", |reader, field| {
        let choices = [
            ("Hover", AtEnd::Hover),
            ("Land", AtEnd::Land),
            ("Leave", AtEnd::Leave),
        ];
        reader.word(field, &choices)
    });
    let air_limit = record.optional(reader, "air_limit", within(&AIR_LIMIT));
    record.close(reader);
    let tasks = tasks.unwrap_or_default();
    let has_start = start_m.is_some();
    // What could be read of it is checked all the same.
    let start_m = start_m.or_else(|| tasks.first().map(|task| task.to_m.clone()));
    let drone = Drone {
        name: (name.as_ref()).map_or(format!("drone-{}", index + 1), |name| name.value.clone()),
        airframe: airframe.unwrap_or(At {
            value: String::new(),
            at: value.head(),
        }),
        // Without any place none is reported: it has no start.
        start_m: start_m.unwrap_or(At {
            value: Point3::origin(),
            at: value.head(),
        }),
        at_start: at_start.unwrap_or_default(),
        tasks,
        at_end: at_end.unwrap_or_default(),
        air_limit,
        is_whole: reader.problems.len() == before,
        has_start,
    };
    Some((name, drone))
}

/// One task of a drone that messages call `drone`; `None` without a place.
fn task<'t>(reader: &mut Reader<'t>, value: Value<'t>, index: usize, drone: &str) -> Option<Task> {
    let mut record = reader.record(value, "Task", format!("task {} of {drone}", index + 1))?;
    let to_m = record.required(reader, "to_m", Reader::place);
    let dwell_s = record.optional(reader, "dwell_s", within(&DWELL_S));
    let load_kg = record.optional(reader, "load_kg", |reader, field| {
        Some(field.found(reader.number(field, &LOAD_KG)?))
    });
    let during_s = record.optional(reader, "during_s", during);
    record.close(reader);
    Some(Task {
        to_m: to_m?,
        dwell_s: dwell_s.unwrap_or_default(),
        load_kg,
        during_s,
    })
}

/// From and until when drones are somewhere.
pub(super) fn during<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>) -> Option<At<[f64; 2]>> {
    Some(field.found(reader.range(field, &DURING_S)?))
}

/// Also where `cell_m` stands, if it does.
fn planning<'t>(
    reader: &mut Reader<'t>,
    field: Field<'_, 't>,
) -> Option<(Planning, Option<Range<usize>>)> {
    let mut it = Planning::default();
    let mut record = reader.record(field.value, "Planning", "`planning`".to_owned())?;
    let mut cell_at = None;
    record.set(reader, ("cell_m", &mut it.cell_m), |reader, field| {
        let cell_m = reader.number(field, &CELL_M)?;
        cell_at = Some(field.value.at());
        Some(Some(cell_m))
    });
    record.set(reader, ("air_limit", &mut it.air_limit), within(&AIR_LIMIT));
    let clearance_m = ("clearance_m", &mut it.clearance_m);
    record.set(reader, clearance_m, within(&CLEARANCE_M));
    let time_margin_s = ("time_margin_s", &mut it.time_margin_s);
    record.set(reader, time_margin_s, within(&TIME_MARGIN_S));
    let tracking_m = ("tracking_m", &mut it.tracking_m);
    record.set(reader, tracking_m, within(&TRACKING_M));
    record.set(reader, ("motion", &mut it.motion), |reader, field| {
        let choices = [
            ("Straight", PathMotion::Straight),
            ("Smooth", PathMotion::Smooth),
        ];
        reader.word(field, &choices).map(Some)
    });
    record.set(reader, ("seed", &mut it.seed), Reader::seed);
    let energy_weight = ("energy_weight", &mut it.energy_weight);
    record.set(reader, energy_weight, within(&ENERGY_WEIGHT));
    record.close(reader);
    Some((it, cell_at))
}

/// Notes a lattice with more places than a roadmap can hold, at the cell or else at the bounds.
fn lattice_fits(
    reader: &mut Reader<'_>,
    cell_m: f64,
    cell_at: Option<Range<usize>>,
    bounds: &Bounds,
) {
    let size_m = bounds.max.value - bounds.min.value;
    let places = |cell_m: f64| lattice_places(size_m, cell_m);
    if places(cell_m) <= MOST_LATTICE_PLACES {
        return;
    }
    // Whole centimetres, so that it can be typed; the loop ends because larger cells make fewer
    // places.
    let mut fits_cm = (cell_m * 100.0).ceil();
    while places(fits_cm / 100.0) > MOST_LATTICE_PLACES {
        fits_cm = (fits_cm * 1.02).ceil();
    }
    let at = cell_at.unwrap_or_else(|| bounds.max.at.clone());
    let message = format!(
        "cells of {} m are too small for these bounds",
        as_typed(cell_m)
    );
    let made = places(cell_m);
    let label = format!("{made:.1e} places, at most {MOST_LATTICE_PLACES:.0e}");
    let problem = Problem::at(&at, message).label(label);
    reader.report(problem.help(format!("planning: (cell_m: {:.2}) fits", fits_cm / 100.0)));
}
