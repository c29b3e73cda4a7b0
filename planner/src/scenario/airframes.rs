//! Reading of the airframes that a scenario brings along.

use std::collections::BTreeMap;

use super::fields::{Field, Reader, Record};
use super::limits::{
    BODY_RADIUS_M, Limits, MASS_KG, MAX_SPEED_MPS, MOTOR_DISTANCE_M, PROPELLER_DIAMETER_M,
    PROPELLERS, WIDTH_FACTOR,
};
use super::problem::Problem;
use super::read::{helped, number};
use super::source::{Value, line};
use super::written::{self, Airframe};

pub(super) fn airframes<'t>(
    reader: &mut Reader<'t>,
    Field { value, .. }: Field<'_, 't>,
    spoilt: &mut Vec<String>,
) -> BTreeMap<String, Airframe> {
    let Some(entries) = value.entries() else {
        let problem = Problem::at(
            &value.head(),
            "`airframes` must be a map `{ \"name\": (...), ... }`",
        );
        reader.report(problem.label(format!("this is {}", value.kind())));
        return BTreeMap::new();
    };
    let mut airframes = BTreeMap::new();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for (key, value) in entries {
        let field = Field {
            value: key,
            key: "name",
            who: "an airframe",
        };
        let Some(name) = reader.name(field) else {
            continue;
        };
        if let Some(first) = seen.get(&name.value) {
            let first_line = line(reader.text, *first);
            let problem = Problem::at(
                &name.at,
                format!("airframe `{}` is given twice", name.value),
            );
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
            let help = one.then(|| {
                "a single propeller leaves no motor distance to scale its jet with".to_owned()
            });
            helped(reader, help, |reader| reader.whole(field, &PROPELLERS)).map(|read| read.value)
        }
        None => Some(written::propellers()),
    };
    let propeller_diameter_m = required_number(
        reader,
        &mut record,
        "propeller_diameter_m",
        &PROPELLER_DIAMETER_M,
    );
    let motor_distance_m =
        required_number(reader, &mut record, "motor_distance_m", &MOTOR_DISTANCE_M);
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

fn required_number<'t>(
    reader: &mut Reader<'t>,
    record: &mut Record<'t>,
    key: &'static str,
    limits: &Limits,
) -> Option<f64> {
    record
        .required(key)
        .and_then(|field| reader.number(field, limits))
        .map(|read| read.value)
}
