//! Reading of what takes up space: bounds, obstacles, zones.

use super::fields::{Field, Reader, Record, listed, within};
use super::limits::{SIZE_M, ZONE_AIR_LIMIT_MPS};
use super::problem::Problem;
use super::source::Value;
use super::written::{Bounds, Obstacle, Place, Zone};

/// The bounds of the world; `None` unless they enclose a volume.
pub(super) fn bounds<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>) -> Option<Bounds> {
    let mut record = reader.record(field.value, "Bounds", "`bounds_m`".to_owned())?;
    let min = record.required(reader, "min", Reader::place);
    let max = record.required(reader, "max", Reader::place);
    let sound = record.close(reader);
    let (min, max) = (min?, max?);
    (box_has_volume(reader, "`bounds_m`", &min, &max) && sound).then_some(Bounds { min, max })
}

/// Whether `min` lies below `max` on every axis, by a size in range.
fn box_has_volume(reader: &mut Reader<'_>, subject: &str, min: &Place, max: &Place) -> bool {
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
    let problem = Problem::at(&max.at, format!("{subject} encloses nothing"))
        .label(listed(&flat, "and"))
        .help(if swapped {
            "swap its two corners"
        } else {
            "its highest corner must exceed its lowest on every axis"
        });
    reader.report(problem);
    false
}

/// One solid; `None` unless its keys make exactly one shape.
pub(super) fn obstacle<'t>(
    reader: &mut Reader<'t>,
    value: Value<'t>,
    index: usize,
) -> Option<Obstacle> {
    let mut record = reader.named(value, "Obstacle", index)?;
    let before = reader.problems.len();
    let mut name = format!("obstacle-{}", index + 1);
    record.set(reader, ("name", &mut name), Reader::name);
    let min_m = record.optional(reader, "min_m", Reader::place);
    let max_m = record.optional(reader, "max_m", Reader::place);
    let base_m = record.optional(reader, "base_m", Reader::place);
    let radius_m = record.optional(reader, "radius_m", within(&SIZE_M));
    let height_m = record.optional(reader, "height_m", within(&SIZE_M));
    let mesh = record.optional(reader, "mesh", |reader, field| {
        Some(field.found(reader.name(field)?))
    });
    let at_m = record.optional(reader, "at_m", Reader::place);
    let one_shape = is_one_shape(reader, &record);
    let subject = record.subject.clone();
    record.close(reader);
    if let (true, Some(min), Some(max)) = (one_shape, &min_m, &max_m) {
        box_has_volume(reader, &subject, min, max);
    }
    let obstacle = Obstacle {
        name,
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
    /// Each shape with the keys that it needs, and its optional keys.
    const SHAPES: [(&str, &[&str], &[&str]); 3] = [
        ("box", &["min_m", "max_m"], &[]),
        ("cylinder", &["base_m", "radius_m", "height_m"], &[]),
        ("mesh", &["mesh"], &["at_m"]),
    ];
    let begun: Vec<_> = SHAPES
        .iter()
        .filter(|(_, needed, more)| needed.iter().chain(*more).any(|key| record.has(key)))
        .collect();
    let subject = &record.subject;
    let problem = match begun.as_slice() {
        [] => Problem::at(record.head(), format!("{subject} has no shape"))
            .label("neither box, cylinder nor mesh")
            .help("give min_m and max_m, or base_m, radius_m and height_m, or mesh"),
        [(shape, needed, _)] => {
            let missing = needed.iter().filter(|key| !record.has(key));
            let missing: Vec<String> = missing.map(|key| format!("`{key}`")).collect();
            if missing.is_empty() {
                return true;
            }
            let message = format!("{subject} has no {}", listed(&missing, "and"));
            Problem::at(record.head(), message).label(format!("a {shape} needs it"))
        }
        several => {
            let shapes = several.iter().map(|(shape, ..)| format!("a {shape}"));
            let shapes: Vec<String> = shapes.collect();
            let message = format!("{subject} is {} at once", listed(&shapes, "and"));
            let problem = Problem::at(record.head(), message).label("one shape each");
            problem.help("make two obstacles of it")
        }
    };
    reader.report(problem);
    false
}

/// One zone; `None` unless it encloses a volume.
pub(super) fn zone<'t>(reader: &mut Reader<'t>, value: Value<'t>, index: usize) -> Option<Zone> {
    let mut record = reader.named(value, "Zone", index)?;
    let before = reader.problems.len();
    let mut name = format!("zone-{}", index + 1);
    record.set(reader, ("name", &mut name), Reader::name);
    let min_m = record.required(reader, "min_m", Reader::place);
    let max_m = record.required(reader, "max_m", Reader::place);
    let air_limit_mps = record.optional(reader, "air_limit_mps", within(&ZONE_AIR_LIMIT_MPS));
    let keep_out = record.optional(reader, "keep_out", |reader, field| {
        reader.word(field, &[("true", true), ("false", false)])
    });
    let subject = record.subject.clone();
    record.close(reader);
    let (min_m, max_m) = (min_m?, max_m?);
    box_has_volume(reader, &subject, &min_m, &max_m);
    let zone = Zone {
        name,
        min_m,
        max_m,
        air_limit_mps,
        keep_out: keep_out.unwrap_or_default(),
    };
    (reader.problems.len() == before).then_some(zone)
}
