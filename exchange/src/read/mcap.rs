//! MCAP with scene updates in JSON: where each drone's sphere is, straight between messages.

use std::collections::BTreeMap;

use mcap::MessageStream;
use nalgebra::Point3;
use planner::plan::cause::as_typed;
use serde_json::Value;

use super::ReadError;
use crate::flown::Flown;

/// The drones of a file by name.
///
/// # Errors
///
/// No such file, or a message of a scene that is none.
pub fn read(bytes: &[u8]) -> Result<BTreeMap<String, Flown>, ReadError> {
    let broken = |what: String| ReadError::within("the file", what);
    let messages = MessageStream::new(bytes).map_err(|error| broken(error.to_string()))?;
    let mut points: BTreeMap<String, Vec<(f64, Point3<f64>)>> = BTreeMap::new();
    for message in messages {
        let message = message.map_err(|error| broken(error.to_string()))?;
        if message.channel.message_encoding != "json" {
            continue;
        }
        let t_s = message.log_time as f64 / 1e9;
        let update: Value = serde_json::from_slice(&message.data).map_err(|error| {
            ReadError::within(&format!("at {} s", as_typed(t_s)), error.to_string())
        })?;
        for entity in update["entities"].as_array().into_iter().flatten() {
            let name = entity["metadata"].as_array().into_iter().flatten();
            let name = name
                .filter(|it| it["key"] == "name")
                .find_map(|it| it["value"].as_str());
            let position = &entity["spheres"][0]["pose"]["position"];
            let place = ["x", "y", "z"].map(|axis| position[axis].as_f64());
            if let (Some(name), [Some(x), Some(y), Some(z)]) = (name, place) {
                let here = points.entry(name.to_owned()).or_default();
                here.push((t_s, Point3::new(x, y, z)));
            }
        }
    }
    let through = |(name, points): (String, Vec<_>)| (name, Flown::through(&points));
    Ok(points.into_iter().map(through).collect())
}
