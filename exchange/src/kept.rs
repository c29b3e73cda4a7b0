//! What a show says beside its trajectories: kept as it is, neither made nor judged.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use planner::plan::Origin;
use serde_json::Value;

use crate::frame::Georeference;
use crate::lights::Lights;

/// What an import keeps for an export.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kept {
    /// Light programs, by drone.
    pub lights: BTreeMap<String, Lights>,
    /// The show file, where there was one.
    pub original: Option<Original>,
}

impl Kept {
    /// Time 0 of the plan by the show's clock (s).
    #[must_use]
    pub fn begins_s(&self) -> f64 {
        self.original.as_ref().map_or(0.0, |it| it.begins_s)
    }

    /// What it is, in words; empty: nothing was kept.
    #[must_use]
    pub fn told(&self) -> Vec<String> {
        let lights = (!self.lights.is_empty()).then(|| "light programs".to_owned());
        let more = self.original.iter().flat_map(Original::told);
        lights.into_iter().chain(more).collect()
    }
}

/// A Skybrush show file as it was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Original {
    /// The zip.
    pub bytes: Arc<[u8]>,
    /// Its `show.json`, as it stands there.
    pub index: Value,
    /// Names of its drones, in its order.
    pub drones: Vec<String>,
    /// When the first of them begins, by its clock (s): time 0 of the plan.
    pub begins_s: f64,
}

/// Of a drone's settings what is written anew, and light programs.
const OWN_SETTINGS: [&str; 5] = ["name", "home", "landAt", "trajectory", "lights"];

impl Original {
    /// A drone's entry.
    #[must_use]
    pub fn drone(&self, name: &str) -> Option<&Value> {
        let k = self.drones.iter().position(|it| it == name)?;
        self.index["swarm"]["drones"].get(k)
    }

    /// What it says beside trajectories, light programs, title and place.
    fn told(&self) -> Vec<String> {
        let mut told: Vec<String> = self.of_drones().into_iter().map(word).collect();
        let settings =
            keys(&self.index["settings"]).filter(|it| !["cues", "validation"].contains(it));
        let cues = &self.index["settings"]["cues"]["items"];
        if cues.as_array().is_some_and(|it| !it.is_empty()) {
            told.push("cues".to_owned());
        }
        let known = ["version", "environment", "settings", "meta", "swarm"];
        let more = keys(&self.index).filter(|it| !known.contains(it));
        told.extend(settings.chain(more).map(word));
        told
    }

    /// Settings of its drones beside those that are written anew.
    pub(crate) fn of_drones(&self) -> BTreeSet<&str> {
        let drones = self.index["swarm"]["drones"].as_array();
        let settings = drones.into_iter().flatten().map(|it| &it["settings"]);
        let all = settings.flat_map(keys);
        all.filter(|it| !OWN_SETTINGS.contains(it)).collect()
    }

    /// Where the show lies, if it is an outdoor one: Studio's whole numbers, degrees by 1e7 and
    /// millimetres above mean sea level.
    ///
    /// # Errors
    ///
    /// In words, why its `location` is not understood.
    pub fn origin(&self) -> Result<Option<Origin>, String> {
        let location = &self.index["environment"]["location"];
        if location.is_null() {
            return Ok(None);
        }
        let number = |it: &Value| it.as_f64().or_else(|| it.as_str()?.parse().ok());
        let numbers = [0, 1, 2].map(|k| number(&location["origin"][k]));
        let heading_deg = number(&location["orientation"]);
        let ([Some(latitude), Some(longitude), Some(altitude_mm)], Some(heading_deg)) =
            (numbers, heading_deg)
        else {
            return Err("`origin` is not three numbers, or `orientation` none".to_owned());
        };
        let origin = Origin {
            latitude_deg: latitude / 1e7,
            longitude_deg: longitude / 1e7,
            altitude_m: altitude_mm / 1e3,
            heading_deg,
        };
        Georeference::of(&origin).map(|_| Some(origin))
    }
}

fn keys(value: &Value) -> impl Iterator<Item = &str> {
    let fields = value.as_object().into_iter().flatten();
    fields.map(|(key, _)| &key[..])
}

/// A key of the show file as people say it.
pub(crate) fn word(key: &str) -> String {
    match key {
        "yawControl" => "yaw".to_owned(),
        "pyro" | "media" => key.to_owned(),
        other => format!("`{other}`"),
    }
}
