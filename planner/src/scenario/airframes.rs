//! Reading of the airframes that a scenario brings along.

use std::collections::BTreeMap;

use super::fields::{Field, Reader, within};
use super::limits::{
    BODY_RADIUS_M, MASS_KG, MAX_ACCELERATION_MPS2, MAX_JERK_MPS3, MAX_SPEED_MPS, MOTOR_DISTANCE_M,
    PROPELLER_DIAMETER_M, PROPELLERS, VERTICAL_SPEED_MPS, WIDTH_FACTOR,
};
use super::problem::Problem;
use super::source::{Value, line};
use super::written::{Airframe, MAX_SPEED_DEFAULT_MPS, PROPELLERS_DEFAULT, WIDTH_FACTOR_DEFAULT};

/// The airframes of a scenario by name; names whose entry is wrong go to `spoilt`.
pub(super) fn airframes<'t>(
    reader: &mut Reader<'t>,
    Field { value, .. }: Field<'_, 't>,
    spoilt: &mut Vec<String>,
) -> BTreeMap<String, Airframe> {
    let Some(entries) = value.entries() else {
        let message = "`airframes` must be a map `{ \"name\": (...), ... }`";
        let problem = Problem::at(&value.head(), message);
        reader.report(problem.label(format!("this is {}", value.kind())));
        return BTreeMap::new();
    };
    let mut airframes = BTreeMap::new();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for (key, value) in entries {
        let field = Field {
            value: key,
            key: "name",
            subject: "an airframe",
        };
        let Some(name) = reader.name(field) else {
            continue;
        };
        if let Some(first) = seen.get(&name) {
            let first_line = line(reader.text, *first);
            let message = format!("airframe `{}` is given twice", name);
            let problem = Problem::at(&key.at(), message);
            reader.report(problem.label(format!("first given on line {first_line}")));
            continue;
        }
        seen.insert(name.clone(), key.start);
        match airframe(reader, value, &name) {
            Some(airframe) => {
                airframes.insert(name, airframe);
            }
            None => spoilt.push(name),
        }
    }
    airframes
}

/// One airframe; `None` where a required number is missing or any is wrong.
fn airframe<'t>(reader: &mut Reader<'t>, value: Value<'t>, name: &str) -> Option<Airframe> {
    let before = reader.problems.len();
    let mut record = reader.record(value, "Airframe", format!("airframe `{name}`"))?;
    let mass_kg = record.required(reader, "mass_kg", within(&MASS_KG));
    let mut propellers = PROPELLERS_DEFAULT;
    record.set(reader, ("propellers", &mut propellers), |reader, field| {
        let one = field.value.plain::<u32>() == Some(1);
        let help =
            one.then(|| "a single propeller leaves no motor distance to scale its jet with".into());
        reader.helped(help, |reader| reader.whole(field, &PROPELLERS))
    });
    let propeller_diameter_m = record.required(
        reader,
        "propeller_diameter_m",
        within(&PROPELLER_DIAMETER_M),
    );
    let motor_distance_m = record.required(reader, "motor_distance_m", within(&MOTOR_DISTANCE_M));
    let width_factor = record.optional(reader, "width_factor", within(&WIDTH_FACTOR));
    let body_radius_m = record.optional(reader, "body_radius_m", within(&BODY_RADIUS_M));
    let max_speed_mps = record.optional(reader, "max_speed_mps", within(&MAX_SPEED_MPS));
    let max_climb_mps = record.optional(reader, "max_climb_mps", within(&VERTICAL_SPEED_MPS));
    let max_descent_mps = record.optional(reader, "max_descent_mps", within(&VERTICAL_SPEED_MPS));
    let max_acceleration_mps2 = record.optional(
        reader,
        "max_acceleration_mps2",
        within(&MAX_ACCELERATION_MPS2),
    );
    let max_jerk_mps3 = record.optional(reader, "max_jerk_mps3", within(&MAX_JERK_MPS3));
    record.close(reader);
    let airframe = Airframe {
        mass_kg: mass_kg?,
        propellers,
        propeller_diameter_m: propeller_diameter_m?,
        motor_distance_m: motor_distance_m?,
        width_factor: width_factor.unwrap_or(WIDTH_FACTOR_DEFAULT),
        body_radius_m,
        max_speed_mps: max_speed_mps.unwrap_or(MAX_SPEED_DEFAULT_MPS),
        max_climb_mps,
        max_descent_mps,
        max_acceleration_mps2,
        max_jerk_mps3,
    };
    (reader.problems.len() == before).then_some(airframe)
}
