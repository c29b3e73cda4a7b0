//! From text to what was written, with everything that is wrong on the way.

use std::collections::BTreeMap;

use airflow::Superposition;
use nalgebra::Point3;

use super::fields::{Field, Reader, Record, listed};
use super::limits::{
    AIR_LIMIT, BODY_RADIUS_M, CELL_M, CLEARANCE_M, DWELL_S, ENERGY_WEIGHT, LOAD_KG, Limits, MASS_KG,
    MAX_SPEED_MPS, MOST_LATTICE_PLACES, MOTOR_DISTANCE_M, PLACE_M, PRESSURE_PA, PROPELLER_DIAMETER_M,
    PROPELLERS, SIZE_M, TEMPERATURE_C, WIDTH_FACTOR, ZONE_AIR_LIMIT_MPS,
};
use super::problem::Problem;
use super::source::{Value, line, root};
use super::written::{
    self, Air, Airframe, At, Bounds, Drone, Obstacle, Place, Planning, Task, Written, Zone,
};
use crate::world::{AtEnd, AtStart};

/// What could be read, and what was wrong.
///
/// Wrong items of a list are left out; in place of wrong bounds there are the widest ones, and in place of
/// other wrong values their defaults, so that the rest can still be checked against one another.
#[derive(Debug)]
pub(super) struct Reading {
    /// `None` where the text is no RON or no record.
    pub(super) written: Option<Written>,
    /// Names in `airframes` whose entry was wrong: known, but not to be used.
    pub(super) spoilt_airframes: Vec<String>,
    pub(super) problems: Vec<Problem>,
}

pub(super) fn read(text: &str) -> Reading {
    let mut reader = Reader { text, problems: Vec::new() };
    let mut spoilt_airframes = Vec::new();
    let written = match root(text) {
        Ok(value) => scenario(&mut reader, value, &mut spoilt_airframes),
        Err(problem) => {
            reader.report(*problem);
            None
        }
    };
    Reading { written, spoilt_airframes, problems: reader.problems }
}

fn scenario<'t>(reader: &mut Reader<'t>, value: Value<'t>, spoilt: &mut Vec<String>) -> Option<Written> {
    let mut record = reader.record(value, "Scenario", "the scenario".to_owned())?;
    let name = record.required("name").and_then(|field| reader.name(field));
    let bounds_m = record.required("bounds_m").and_then(|field| bounds(reader, field));
    let air = record.optional("air").and_then(|field| air(reader, field)).unwrap_or_default();
    let obstacles = record.optional("obstacles").map(|field| list(reader, field, obstacle));
    let zones = record.optional("zones").map(|field| list(reader, field, zone));
    let airframes = record.optional("airframes").map(|field| airframes(reader, field, spoilt));
    let drones = record.required("drones").map(|field| drones(reader, field));
    let planning = record.optional("planning").map(|field| planning(reader, field, bounds_m.as_ref()));
    record.close(reader);
    let anywhere = |coordinate: f64| At {
        value: Point3::new(coordinate, coordinate, coordinate),
        at: value.head(),
    };
    Some(Written {
        name: name.map(|name| name.value).unwrap_or_default(),
        bounds_m: bounds_m.unwrap_or(Bounds { min: anywhere(PLACE_M.low), max: anywhere(PLACE_M.high) }),
        air,
        obstacles: obstacles.unwrap_or_default(),
        zones: zones.unwrap_or_default(),
        airframes: airframes.unwrap_or_default(),
        drones: drones.unwrap_or_default(),
        planning: planning.unwrap_or_default(),
    })
}

fn list<'t, T>(
    reader: &mut Reader<'t>,
    field: Field<'_, 't>,
    read: impl Fn(&mut Reader<'t>, Value<'t>, usize) -> Option<T>,
) -> Vec<T> {
    let items = reader.items(field).unwrap_or_default();
    items.into_iter().enumerate().filter_map(|(index, item)| read(reader, item, index)).collect()
}

fn bounds<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>) -> Option<Bounds> {
    let mut record = reader.record(field.value, "Bounds", "`bounds_m`".to_owned())?;
    let min = record.required("min").and_then(|field| reader.place(field));
    let max = record.required("max").and_then(|field| reader.place(field));
    let sound = record.close(reader);
    let bounds = Bounds { min: min?, max: max? };
    (box_has_volume(reader, "`bounds_m`", &bounds.min, &bounds.max) && sound).then_some(bounds)
}

/// Whether `min` lies below `max` on every axis, by a size worth the name.
fn box_has_volume(reader: &mut Reader<'_>, who: &str, min: &Place, max: &Place) -> bool {
    let flat: Vec<String> = ["x", "y", "z"]
        .into_iter()
        .enumerate()
        .filter(|(axis, _)| max.value[*axis] - min.value[*axis] < SIZE_M.low)
        .map(|(axis, name)| format!("{name} from {} to {} m", min.value[axis], max.value[axis]))
        .collect();
    if flat.is_empty() {
        return true;
    }
    let swapped = (0..3).all(|axis| max.value[axis] <= min.value[axis]);
    let problem = Problem::at(&max.at, format!("{who} encloses nothing"))
        .label(listed(&flat, "and"))
        .help(if swapped { "swap its two corners" } else { "its highest corner must exceed its lowest on every axis" });
    reader.report(problem);
    false
}

fn air<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>) -> Option<Air> {
    let mut record = reader.record(field.value, "Air", "`air`".to_owned())?;
    let default = Air::default();
    let temperature_c = record.optional("temperature_c").map(|field| {
        let kelvin = field.value.plain::<f64>().filter(|kelvin| (200.0..330.0).contains(kelvin));
        let help = kelvin.map(|kelvin| format!("is this in kelvin? Then write {:.2}", kelvin - 273.15));
        helped(reader, help, |reader| reader.number(field, &TEMPERATURE_C))
    });
    let pressure_pa = record.optional("pressure_pa").map(|field| {
        let hectopascal = field.value.plain::<f64>().filter(|hpa| (300.0..1100.0).contains(hpa));
        let help = hectopascal.map(|hpa| format!("is this in hPa? Then write {:.0}", hpa * 100.0));
        helped(reader, help, |reader| reader.number(field, &PRESSURE_PA))
    });
    let superposition = record.optional("superposition").map(|field| {
        let choices = [
            ("Momentum", Superposition::Momentum),
            ("Linear", Superposition::Linear),
            ("Strongest", Superposition::Strongest),
        ];
        reader.word(field, &choices)
    });
    for key in ["jet", "finding"] {
        if let Some(field) = record.optional(key) {
            let problem = Problem::at(&field.value.head(), format!("`{key}` of `air` is not available yet"));
            reader.report(problem.label("no file of this kind can be used so far").help(
                "leave it out: the scenario is then planned with the paper's jet",
            ));
        }
    }
    record.close(reader);
    let or = |read: Option<Option<At<f64>>>, default: f64| read.flatten().map_or(default, |read| read.value);
    Some(Air {
        temperature_c: or(temperature_c, default.temperature_c),
        pressure_pa: or(pressure_pa, default.pressure_pa),
        superposition: superposition.flatten().map_or(default.superposition, |read| read.value),
    })
}

/// Adds `help` to what `read` reports.
fn helped<'t, T>(
    reader: &mut Reader<'t>,
    help: Option<String>,
    read: impl FnOnce(&mut Reader<'t>) -> T,
) -> T {
    let before = reader.problems.len();
    let value = read(reader);
    if let Some(problem) = reader.problems.get_mut(before) {
        problem.help = help.or(problem.help.take());
    }
    value
}

fn obstacle<'t>(reader: &mut Reader<'t>, value: Value<'t>, index: usize) -> Option<Obstacle> {
    let mut record = named(reader, value, "Obstacle", index)?;
    let before = reader.problems.len();
    let name = match record.optional("name") {
        Some(field) => reader.name(field).map(|name| name.value),
        None => Some(format!("obstacle-{}", index + 1)),
    };
    let min_m = record.optional("min_m").and_then(|field| reader.place(field));
    let max_m = record.optional("max_m").and_then(|field| reader.place(field));
    let base_m = record.optional("base_m").and_then(|field| reader.place(field));
    let radius_m = number(reader, &mut record, "radius_m", &SIZE_M);
    let height_m = number(reader, &mut record, "height_m", &SIZE_M);
    let mesh = record.optional("mesh").and_then(|field| reader.name(field));
    let at_m = record.optional("at_m").and_then(|field| reader.place(field));
    let one_shape = is_one_shape(reader, &record);
    let who = record.who.clone();
    record.close(reader);
    if let (true, Some(min), Some(max)) = (one_shape, &min_m, &max_m) {
        box_has_volume(reader, &who, min, max);
    }
    let obstacle = Obstacle { name: name?, min_m, max_m, base_m, radius_m, height_m, mesh, at_m };
    (reader.problems.len() == before).then_some(obstacle)
}

/// Whether the keys of an obstacle make exactly one of the three shapes, and all of it.
fn is_one_shape(reader: &mut Reader<'_>, record: &Record<'_>) -> bool {
    const SHAPES: [(&str, &[&str], &[&str]); 3] = [
        ("box", &["min_m", "max_m"], &[]),
        ("cylinder", &["base_m", "radius_m", "height_m"], &[]),
        ("mesh", &["mesh"], &["at_m"]),
    ];
    let begun: Vec<_> = SHAPES
        .iter()
        .filter(|(_, needed, more)| needed.iter().chain(*more).any(|key| record.has(key)))
        .collect();
    let who = &record.who;
    let problem = match begun.as_slice() {
        [] => Problem::at(record.head(), format!("{who} has no shape"))
            .label("neither box, cylinder nor mesh")
            .help("give min_m and max_m, or base_m, radius_m and height_m, or mesh"),
        [(shape, needed, _)] => {
            let missing: Vec<String> = needed
                .iter()
                .filter(|key| !record.has(key))
                .map(|key| format!("`{key}`"))
                .collect();
            if missing.is_empty() {
                return true;
            }
            Problem::at(record.head(), format!("{who} has no {}", listed(&missing, "and")))
                .label(format!("a {shape} needs it"))
        }
        several => {
            let shapes: Vec<String> = several.iter().map(|(shape, ..)| format!("a {shape}")).collect();
            Problem::at(record.head(), format!("{who} is {} at once", listed(&shapes, "and")))
                .label("one shape each")
                .help("make two obstacles of it")
        }
    };
    reader.report(problem);
    false
}

fn zone<'t>(reader: &mut Reader<'t>, value: Value<'t>, index: usize) -> Option<Zone> {
    let mut record = named(reader, value, "Zone", index)?;
    let name = match record.optional("name") {
        Some(field) => reader.name(field).map(|name| name.value),
        None => Some(format!("zone-{}", index + 1)),
    };
    let min_m = record.required("min_m").and_then(|field| reader.place(field));
    let max_m = record.required("max_m").and_then(|field| reader.place(field));
    let air_limit_mps = match record.optional("air_limit_mps") {
        Some(field) => reader.number(field, &ZONE_AIR_LIMIT_MPS).map(|limit| limit.value),
        None => Some(written::zone_air_limit_mps()),
    };
    let who = record.who.clone();
    let sound = record.close(reader);
    let (min_m, max_m) = (min_m?, max_m?);
    let sound = box_has_volume(reader, &who, &min_m, &max_m) && sound;
    let zone = Zone { name: name?, min_m, max_m, air_limit_mps: air_limit_mps? };
    sound.then_some(zone)
}

fn airframes<'t>(
    reader: &mut Reader<'t>,
    Field { value, .. }: Field<'_, 't>,
    spoilt: &mut Vec<String>,
) -> BTreeMap<String, Airframe> {
    let Some(entries) = value.entries() else {
        let problem = Problem::at(&value.head(), "`airframes` must be a map `{ \"name\": (...), ... }`");
        reader.report(problem.label(format!("this is {}", value.kind())));
        return BTreeMap::new();
    };
    let mut airframes = BTreeMap::new();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for (key, value) in entries {
        let field = Field { value: key, key: "name", who: "an airframe" };
        let Some(name) = reader.name(field) else { continue };
        if let Some(first) = seen.get(&name.value) {
            let first_line = line(reader.text, *first);
            let problem = Problem::at(&name.at, format!("airframe `{}` is given twice", name.value));
            reader.report(problem.label(format!("first given on line {first_line}")));
            continue;
        }
        seen.insert(name.value.clone(), name.at.start);
        match airframe(reader, value, &name.value) {
            Some(airframe) => {
                airframes.insert(name.value, airframe);
            }
            None => spoilt.push(name.value),
        }
    }
    airframes
}

fn airframe<'t>(reader: &mut Reader<'t>, value: Value<'t>, name: &str) -> Option<Airframe> {
    let before = reader.problems.len();
    let mut record = reader.record(value, "Airframe", format!("airframe `{name}`"))?;
    let mass_kg = required_number(reader, &mut record, "mass_kg", &MASS_KG);
    let propellers = match record.optional("propellers") {
        Some(field) => {
            let one = field.value.plain::<u32>() == Some(1);
            let help = one.then(|| "a single propeller leaves no motor distance to scale its jet with".to_owned());
            helped(reader, help, |reader| reader.whole(field, &PROPELLERS)).map(|read| read.value)
        }
        None => Some(written::propellers()),
    };
    let propeller_diameter_m =
        required_number(reader, &mut record, "propeller_diameter_m", &PROPELLER_DIAMETER_M);
    let motor_distance_m = required_number(reader, &mut record, "motor_distance_m", &MOTOR_DISTANCE_M);
    let width_factor = number(reader, &mut record, "width_factor", &WIDTH_FACTOR);
    let body_radius_m = number(reader, &mut record, "body_radius_m", &BODY_RADIUS_M);
    let max_speed_mps = number(reader, &mut record, "max_speed_mps", &MAX_SPEED_MPS);
    record.close(reader);
    let airframe = Airframe {
        mass_kg: mass_kg?,
        propellers: propellers?,
        propeller_diameter_m: propeller_diameter_m?,
        motor_distance_m: motor_distance_m?,
        width_factor: width_factor.unwrap_or_else(written::width_factor),
        body_radius_m,
        max_speed_mps: max_speed_mps.unwrap_or_else(written::max_speed_mps),
    };
    (reader.problems.len() == before).then_some(airframe)
}

/// A number with a default: `None` where it is left out, and where it is wrong (then noted).
fn number<'t>(
    reader: &mut Reader<'t>,
    record: &mut Record<'t>,
    key: &'static str,
    limits: &Limits,
) -> Option<f64> {
    record.optional(key).and_then(|field| reader.number(field, limits)).map(|read| read.value)
}

fn required_number<'t>(
    reader: &mut Reader<'t>,
    record: &mut Record<'t>,
    key: &'static str,
    limits: &Limits,
) -> Option<f64> {
    record.required(key).and_then(|field| reader.number(field, limits)).map(|read| read.value)
}

fn drones<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>) -> Vec<Drone> {
    let Some(items) = reader.items(field) else { return Vec::new() };
    if items.is_empty() {
        let problem = Problem::at(&field.value.at(), "there are no drones").label("nothing to plan");
        reader.report(problem.help("add one: (name: \"k1\", airframe: \"kolibri\", start_m: (1, 1, 1))"));
    }
    let mut drones = Vec::new();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for (index, item) in items.into_iter().enumerate() {
        let (name, drone) = drone(reader, item, index);
        drones.extend(drone);
        let Some(name) = name else { continue };
        if let Some(first) = seen.get(&name.value) {
            let first_line = line(reader.text, *first);
            let problem = Problem::at(&name.at, format!("two drones are called `{}`", name.value));
            reader.report(problem.label(format!("first on line {first_line}")));
        } else {
            seen.insert(name.value, name.at.start);
        }
    }
    drones
}

fn drone<'t>(
    reader: &mut Reader<'t>,
    value: Value<'t>,
    index: usize,
) -> (Option<At<String>>, Option<Drone>) {
    let before = reader.problems.len();
    let Some(mut record) = named(reader, value, "Drone", index) else { return (None, None) };
    let name = record.required("name").and_then(|field| reader.name(field));
    let airframe = record.required("airframe").and_then(|field| reader.text(field));
    let start_m = record.required("start_m").and_then(|field| reader.place(field));
    let at_start = record.optional("at_start").and_then(|field| {
        reader.word(field, &[("Hover", AtStart::Hover), ("Landed", AtStart::Landed)])
    });
    let who = record.who.clone();
    let tasks = record.optional("tasks").map(|field| {
        list(reader, field, |reader, value, index| task(reader, value, index, &who))
    });
    let at_end = record.optional("at_end").and_then(|field| {
        let choices = [("Hover", AtEnd::Hover), ("Land", AtEnd::Land), ("Leave", AtEnd::Leave)];
        reader.word(field, &choices)
    });
    let air_limit = number(reader, &mut record, "air_limit", &AIR_LIMIT);
    record.close(reader);
    let sound = reader.problems.len() == before;
    let drone = || {
        Some(Drone {
            name: name.as_ref()?.value.clone(),
            airframe: airframe?,
            start_m: start_m?,
            at_start: at_start.map_or_else(written::at_start, |read| read.value),
            tasks: tasks.unwrap_or_default(),
            at_end: at_end.map_or_else(written::at_end, |read| read.value),
            air_limit,
        })
    };
    let drone = if sound { drone() } else { None };
    (name, drone)
}

fn task<'t>(reader: &mut Reader<'t>, value: Value<'t>, index: usize, drone: &str) -> Option<Task> {
    let mut record = reader.record(value, "Task", format!("task {} of {drone}", index + 1))?;
    let to_m = record.required("to_m").and_then(|field| reader.place(field));
    let dwell_s = number(reader, &mut record, "dwell_s", &DWELL_S);
    let load_kg = record.optional("load_kg").and_then(|field| reader.number(field, &LOAD_KG));
    record.close(reader);
    Some(Task { to_m: to_m?, dwell_s: dwell_s.unwrap_or_else(written::dwell_s), load_kg })
}

fn planning<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>, bounds: Option<&Bounds>) -> Planning {
    let Some(mut record) = reader.record(field.value, "Planning", "`planning`".to_owned()) else {
        return Planning::default();
    };
    let default = Planning::default();
    let cell_m = record.optional("cell_m").and_then(|field| {
        let cell_m = reader.number(field, &CELL_M)?;
        lattice_fits(reader, &cell_m, bounds).then_some(cell_m.value)
    });
    let air_limit = number(reader, &mut record, "air_limit", &AIR_LIMIT);
    let clearance_m = number(reader, &mut record, "clearance_m", &CLEARANCE_M);
    let seed = record.optional("seed").and_then(|field| reader.seed(field));
    let energy_weight = number(reader, &mut record, "energy_weight", &ENERGY_WEIGHT);
    record.close(reader);
    Planning {
        cell_m: cell_m.unwrap_or(default.cell_m),
        air_limit: air_limit.unwrap_or(default.air_limit),
        clearance_m: clearance_m.unwrap_or(default.clearance_m),
        seed: seed.map_or(default.seed, |seed| seed.value),
        energy_weight: energy_weight.unwrap_or(default.energy_weight),
    }
}

fn lattice_fits(reader: &mut Reader<'_>, cell_m: &At<f64>, bounds: Option<&Bounds>) -> bool {
    let Some(Bounds { min, max }) = bounds else { return true };
    let size_m = max.value - min.value;
    let places = |cell_m: f64| size_m.iter().map(|size_m| (size_m / cell_m).floor() + 1.0).product::<f64>();
    if places(cell_m.value) <= MOST_LATTICE_PLACES {
        return true;
    }
    let mut smallest_m = cell_m.value;
    while places(smallest_m) > MOST_LATTICE_PLACES {
        smallest_m *= 1.02;
    }
    let problem = Problem::at(&cell_m.at, "`cell_m` of `planning` is too small for these bounds").label(
        format!("{:.1e} places, at most {MOST_LATTICE_PLACES:.0e}", places(cell_m.value)),
    );
    reader.report(problem.help(format!("{:.2} m fits", (smallest_m * 100.0).ceil() / 100.0)));
    false
}

/// A record that messages call by its name, or by its number where it has none.
fn named<'t>(
    reader: &mut Reader<'t>,
    value: Value<'t>,
    kind: &'static str,
    index: usize,
) -> Option<Record<'t>> {
    let thing = kind.to_lowercase();
    let mut record = reader.record(value, kind, format!("{thing} {}", index + 1))?;
    if let Some(name) = record.plain_name() {
        record.who = format!("{thing} `{name}`");
    }
    Some(record)
}
