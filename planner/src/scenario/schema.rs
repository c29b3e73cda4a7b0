//! The format as a JSON schema, with every default and every preset in one list each.

use schemars::Schema;
use serde_json::{Map, Value, json};

use super::written::{MAX_SPEED_DEFAULT_MPS, Written};

/// The JSON schema of a scenario: keys, units, ranges. `defaults` lists every key that may be left
/// out, by its path; where a default depends on something else, words say on what. `presets` lists
/// the airframes that are known by name.
pub fn schema() -> Schema {
    let mut schema = schemars::schema_for!(Written);
    let mut defaults = Map::new();
    gather(schema.as_value(), schema.as_value(), "", &mut defaults);
    let presets: Map<String, Value> = airflow::Airframe::PRESETS
        .into_iter()
        .filter_map(airflow::Airframe::preset)
        .map(|airframe| (airframe.name().to_owned(), preset(&airframe)))
        .collect();
    schema.insert("defaults".to_owned(), Value::Object(defaults));
    schema.insert("presets".to_owned(), Value::Object(presets));
    schema
}

/// Collects `default` of every property below `at`: `planning.cell_m`, `drones[].tasks[].dwell_s`.
fn gather(whole: &Value, at: &Value, path: &str, defaults: &mut Map<String, Value>) {
    if let Some(name) = at["$ref"]
        .as_str()
        .and_then(|path| path.strip_prefix("#/$defs/"))
    {
        gather(whole, &whole["$defs"][name], path, defaults);
    }
    for branch in at["anyOf"].as_array().into_iter().flatten() {
        gather(whole, branch, path, defaults);
    }
    for (key, property) in at["properties"].as_object().into_iter().flatten() {
        let path = if path.is_empty() {
            key.clone()
        } else {
            format!("{path}.{key}")
        };
        if let Some(default) = property.get("default") {
            defaults.insert(path.clone(), typed(default));
        }
        gather(whole, property, &path, defaults);
        gather(whole, &property["items"], &format!("{path}[]"), defaults);
        gather(
            whole,
            &property["additionalProperties"],
            &format!("{path}{{}}"),
            defaults,
        );
    }
}

/// A default as a scenario has it: a place in round brackets.
fn typed(default: &Value) -> Value {
    let numbers = default.as_array().filter(|it| !it.is_empty());
    let Some(numbers) = numbers.filter(|it| it.iter().all(Value::is_number)) else {
        return default.clone();
    };
    let numbers: Vec<String> = numbers.iter().map(Value::to_string).collect();
    Value::String(format!("({})", numbers.join(", ")))
}

/// An airframe known by name, with the keys that a scenario would write for it.
fn preset(airframe: &airflow::Airframe) -> Value {
    json!({
        "mass_kg": airframe.mass_kg(),
        "propellers": airframe.propellers(),
        "propeller_diameter_m": airframe.propeller_diameter_m(),
        "motor_distance_m": airframe.motor_distance_m(),
        "width_factor": airframe.width_factor(),
        // To the micrometre: the sum of two halves shows its rounding otherwise.
        "body_radius_m": (airframe.tip_radius_m() * 1e6).round() / 1e6,
        "max_speed_mps": MAX_SPEED_DEFAULT_MPS,
    })
}
