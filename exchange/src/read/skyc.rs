//! Skybrush's show file, version 1: its drones by name, each a chain of Bézier segments.

use std::io::{Cursor, Read as _};

use nalgebra::Point3;
use serde::Deserialize;
use serde_json::Value;
use zip::ZipArchive;

use super::ReadError;
use crate::flown::{Flown, Span, powers};
use crate::lights::Lights;

/// Most bytes of one file in the zip, unpacked: chosen here, a show of 5000 drones in one.
const MOST_BYTES: u64 = 200 << 20;

/// One drone of a show.
#[derive(Clone, Debug, PartialEq)]
pub struct Performer {
    /// Its name, or `drone-3` by its place in the list.
    pub name: String,
    /// What it flies; before its take-off it stands at its first point.
    pub flown: Flown,
    /// Its light program.
    pub lights: Option<Lights>,
}

/// A drone's entry.
#[derive(Deserialize)]
struct Entry {
    settings: Settings,
}

#[derive(Deserialize)]
struct Settings {
    #[serde(default)]
    name: Option<String>,
    trajectory: Trajectory,
    #[serde(default)]
    lights: Option<Value>,
}

#[derive(Deserialize)]
struct Trajectory {
    version: u64,
    #[serde(default, rename = "takeoffTime")]
    takeoff_s: f64,
    points: Vec<(f64, [f64; 3], Vec<[f64; 3]>)>,
}

/// The drones of a show, in its order.
///
/// # Errors
///
/// The first thing that is wrong: no zip, a file that is missing, another version, a drone's
/// points.
pub fn read(bytes: &[u8]) -> Result<Vec<Performer>, ReadError> {
    let mut zip = ZipArchive::new(Cursor::new(bytes))
        .map_err(|error| ReadError::within("the file", format!("no zip: {error}")))?;
    let show = json(&mut zip, "show.json")?;
    if show["version"] != 1 {
        let what = format!("version {}, this program reads 1", show["version"]);
        return Err(ReadError::within("show.json", what));
    }
    let Some(drones) = show["swarm"]["drones"].as_array() else {
        return Err(ReadError::within("show.json", "no swarm.drones"));
    };
    let mut performers = Vec::with_capacity(drones.len());
    for (k, drone) in drones.iter().enumerate() {
        let mut drone = drone.clone();
        let mut place = |key: &str| -> Result<String, ReadError> {
            let Some(value) = drone.get_mut("settings").and_then(|it| it.get_mut(key)) else {
                return Ok(format!("show.json, swarm.drones[{k}].settings"));
            };
            let Some(referred) = value["$ref"].as_str() else {
                return Ok(format!("show.json, swarm.drones[{k}].settings.{key}"));
            };
            let name = referred.split('#').next().unwrap_or_default();
            let name = name.trim_start_matches("./").to_owned();
            *value = json(&mut zip, &name)?;
            Ok(name)
        };
        let (within, lit_within) = (place("trajectory")?, place("lights")?);
        let entry: Entry = serde_json::from_value(drone)
            .map_err(|error| ReadError::within(&within, error.to_string()))?;
        let Settings {
            name,
            trajectory,
            lights,
        } = entry.settings;
        let lights = lights
            .filter(|it| !it.is_null())
            .map(Lights::of)
            .transpose();
        performers.push(Performer {
            name: name.unwrap_or_else(|| format!("drone-{}", k + 1)),
            flown: flown(&trajectory).map_err(|what| ReadError::within(&within, what))?,
            lights: lights.map_err(|what| ReadError::within(&lit_within, what))?,
        });
    }
    Ok(performers)
}

/// A JSON file of the zip.
fn json(zip: &mut ZipArchive<Cursor<&[u8]>>, name: &str) -> Result<Value, ReadError> {
    let file = zip.by_name(name);
    let file = file.map_err(|error| ReadError::within(name, error.to_string()))?;
    let mut text = Vec::new();
    let taken = file.take(MOST_BYTES + 1).read_to_end(&mut text);
    taken.map_err(|error| ReadError::within(name, error.to_string()))?;
    if text.len() as u64 > MOST_BYTES {
        let what = format!("unpacks to more than {} MiB", MOST_BYTES >> 20);
        return Err(ReadError::within(name, what));
    }
    serde_json::from_slice(&text).map_err(|error| ReadError::within(name, error.to_string()))
}

fn flown(trajectory: &Trajectory) -> Result<Flown, String> {
    if trajectory.version != 1 {
        let version = trajectory.version;
        return Err(format!("version {version}, this program reads 1"));
    }
    let Some((first_s, first_m, _)) = trajectory.points.first() else {
        return Err("no points".to_owned());
    };
    let mut now = (trajectory.takeoff_s + first_s, *first_m);
    // Until its take-off it stands.
    let stands = Flown::through(&[(0.0, Point3::from(now.1)), now_at(now)]);
    let mut flown = Flown::default();
    if now.0 > 0.0 {
        flown = stands;
    }
    for (k, (t_s, end_m, inner)) in trajectory.points.iter().enumerate().skip(1) {
        let until_s = trajectory.takeoff_s + t_s;
        if until_s <= now.0 {
            return Err(format!("points[{k}]: time does not go on: {t_s} s"));
        }
        if inner.len() > 2 {
            let count = inner.len();
            return Err(format!("points[{k}]: {count} control points, at most 2"));
        }
        let axis = |axis: usize| {
            let mut bernstein = vec![now.1[axis]];
            bernstein.extend(inner.iter().map(|it| it[axis]));
            bernstein.push(end_m[axis]);
            powers(&bernstein, until_s - now.0)
        };
        flown.spans.push(Span {
            from_s: now.0,
            until_s,
            axes: [0, 1, 2].map(axis),
        });
        now = (until_s, *end_m);
    }
    if flown.spans.is_empty() {
        let (t_s, at_m) = now_at(now);
        flown = Flown::through(&[(t_s, at_m), (t_s + 1.0, at_m)]);
    }
    Ok(flown)
}

fn now_at(now: (f64, [f64; 3])) -> (f64, Point3<f64>) {
    (now.0, Point3::from(now.1))
}
