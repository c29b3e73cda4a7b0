//! Reading of whatever takes up space: bounds, obstacles, zones.

use super::fields::{Field, Reader, Record, listed};
use super::limits::{SIZE_M, ZONE_AIR_LIMIT_MPS};
use super::problem::Problem;
use super::read::{named, number};
use super::source::Value;
use super::written::{self, Bounds, Obstacle, Place, Zone};

pub(super) fn bounds<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>) -> Option<Bounds> {
    let mut record = reader.record(field.value, "Bounds", "`bounds_m`".to_owned())?;
    let min = record.required("min").and_then(|field| reader.place(field));
    let max = record.required("max").and_then(|field| reader.place(field));
    let sound = record.close(reader);
    let bounds = Bounds {
        min: min?,
        max: max?,
    };
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
        .help(if swapped {
            "swap its two corners"
        } else {
            "its highest corner must exceed its lowest on every axis"
        });
    reader.report(problem);
    false
}

pub(super) fn obstacle<'t>(
    reader: &mut Reader<'t>,
    value: Value<'t>,
    index: usize,
) -> Option<Obstacle> {
    let mut record = named(reader, value, "Obstacle", index)?;
    let before = reader.problems.len();
    let name = match record.optional("name") {
        Some(field) => reader.name(field).map(|name| name.value),
        None => Some(format!("obstacle-{}", index + 1)),
    };
    let min_m = record
        .optional("min_m")
        .and_then(|field| reader.place(field));
    let max_m = record
        .optional("max_m")
        .and_then(|field| reader.place(field));
    let base_m = record
        .optional("base_m")
        .and_then(|field| reader.place(field));
    let radius_m = number(reader, &mut record, "radius_m", &SIZE_M);
    let height_m = number(reader, &mut record, "height_m", &SIZE_M);
    let mesh = record.optional("mesh").and_then(|field| reader.name(field));
    let at_m = record
        .optional("at_m")
        .and_then(|field| reader.place(field));
    let one_shape = is_one_shape(reader, &record);
    let who = record.who.clone();
    record.close(reader);
    if let (true, Some(min), Some(max)) = (one_shape, &min_m, &max_m) {
        box_has_volume(reader, &who, min, max);
    }
    let obstacle = Obstacle {
        name: name?,
        min_m,
        max_m,
        base_m,
        radius_m,
        height_m,
        mesh,
        at_m,
    };
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
            Problem::at(
                record.head(),
                format!("{who} has no {}", listed(&missing, "and")),
            )
            .label(format!("a {shape} needs it"))
        }
        several => {
            let shapes: Vec<String> = several
                .iter()
                .map(|(shape, ..)| format!("a {shape}"))
                .collect();
            Problem::at(
                record.head(),
                format!("{who} is {} at once", listed(&shapes, "and")),
            )
            .label("one shape each")
            .help("make two obstacles of it")
        }
    };
    reader.report(problem);
    false
}

pub(super) fn zone<'t>(reader: &mut Reader<'t>, value: Value<'t>, index: usize) -> Option<Zone> {
    let mut record = named(reader, value, "Zone", index)?;
    let name = match record.optional("name") {
        Some(field) => reader.name(field).map(|name| name.value),
        None => Some(format!("zone-{}", index + 1)),
    };
    let min_m = record
        .required("min_m")
        .and_then(|field| reader.place(field));
    let max_m = record
        .required("max_m")
        .and_then(|field| reader.place(field));
    let air_limit_mps = match record.optional("air_limit_mps") {
        Some(field) => reader
            .number(field, &ZONE_AIR_LIMIT_MPS)
            .map(|limit| limit.value),
        None => Some(written::zone_air_limit_mps()),
    };
    let who = record.who.clone();
    let sound = record.close(reader);
    let (min_m, max_m) = (min_m?, max_m?);
    let sound = box_has_volume(reader, &who, &min_m, &max_m) && sound;
    let zone = Zone {
        name: name?,
        min_m,
        max_m,
        air_limit_mps: air_limit_mps?,
    };
    sound.then_some(zone)
}
