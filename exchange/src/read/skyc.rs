//! Skybrush's show file, version 1: its drones by name, each a chain of Bézier segments.

use std::collections::BTreeMap;
use std::io::{Cursor, Read as _};

use nalgebra::Point3;
use planner::plan::cause::as_typed;
use serde::Deserialize;
use serde_json::Value;
use zip::ZipArchive;

use super::ReadError;
use crate::flown::{Flown, Span, powers};
use crate::lights::Lights;

/// Most bytes of one file in the zip, unpacked: chosen here, a show of 5000 drones in one.
const MOST_BYTES: u64 = 200 << 20;
/// The same of all that is read, a file for each drone that refers to it: chosen here, five shows
/// of 5000 drones.
const MOST_BYTES_IN_ALL: u64 = 5 * MOST_BYTES;

/// One drone of a show.
#[derive(Clone, Debug, PartialEq)]
pub struct Performer {
    /// Its name, or `drone-3` by its place in the list.
    pub name: String,
    /// What it flies; before its take-off it stands at its first point.
    pub flown: Flown,
    /// Its light program.
    pub lights: Option<Lights>,
    /// Where it stands before the show (m), where that is said.
    pub home_m: Option<Point3<f64>>,
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
    #[serde(default)]
    home: Option<[f64; 3]>,
}

#[derive(Deserialize)]
struct Trajectory {
    version: u64,
    #[serde(default, rename = "takeoffTime")]
    takeoff_s: f64,
    points: Vec<(f64, [f64; 3], Vec<[f64; 3]>)>,
}

/// A show, as its file has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Skyc {
    /// In its order.
    pub performers: Vec<Performer>,
    /// Its `show.json`.
    pub index: Value,
}

/// The drones of a show.
///
/// # Errors
///
/// No zip, no show in it, or another version; else all that is wrong with its drones: files that
/// are missing, points.
pub fn read(bytes: &[u8]) -> Result<Skyc, Vec<ReadError>> {
    read_up_to(MOST_BYTES_IN_ALL, bytes)
}

fn read_up_to(most_bytes: u64, bytes: &[u8]) -> Result<Skyc, Vec<ReadError>> {
    let (mut zip, index) = opened(bytes, most_bytes).map_err(|error| vec![error])?;
    let drones = index["swarm"]["drones"].as_array();
    let drones = drones.map_or(&[][..], Vec::as_slice);
    let mut performers = Vec::with_capacity(drones.len());
    let mut errors = Vec::new();
    let mut shared = Shared::new();
    for (k, drone) in drones.iter().enumerate() {
        match performer(&mut zip, &mut shared, k, drone.clone()) {
            Ok(performer) => performers.push(performer),
            Err(wrong) => errors.extend(wrong),
        }
    }
    match errors.is_empty() {
        true => Ok(Skyc { performers, index }),
        false => Err(errors),
    }
}

/// A zip, and how many bytes may still be unpacked of it.
struct Zip<'b> {
    archive: ZipArchive<Cursor<&'b [u8]>>,
    left: u64,
}

/// The zip and its `show.json`.
fn opened(bytes: &[u8], left: u64) -> Result<(Zip<'_>, Value), ReadError> {
    let archive = ZipArchive::new(Cursor::new(bytes))
        .map_err(|error| ReadError::within("the file", format!("no zip: {error}")))?;
    let mut zip = Zip { archive, left };
    let show = json(&mut zip, "show.json")?;
    if show["version"] != 1 {
        let what = format!("version {}, this program reads 1", show["version"]);
        return Err(ReadError::within("show.json", what));
    }
    match show["swarm"]["drones"].is_array() {
        true => Ok((zip, show)),
        false => Err(ReadError::within("show.json", "no swarm.drones")),
    }
}

/// Files of which drones refer to parts, by name.
type Shared = BTreeMap<String, Value>;

/// What a JSON pointer leads to in a file of the zip.
fn part(
    zip: &mut Zip<'_>,
    shared: &mut Shared,
    (name, within): (&str, &str),
) -> Result<Value, ReadError> {
    if !shared.contains_key(name) {
        shared.insert(name.to_owned(), json(zip, name)?);
    }
    let found = shared.get(name).and_then(|file| file.pointer(within));
    let nowhere = || ReadError::within(name, format!("nothing at `{within}`, which a drone names"));
    found.cloned().ok_or_else(nowhere)
}

/// The drone of an entry, the `k`-th.
fn performer(
    zip: &mut Zip<'_>,
    shared: &mut Shared,
    k: usize,
    mut drone: Value,
) -> Result<Performer, Vec<ReadError>> {
    let mut errors = Vec::new();
    let mut place = |key: &str| -> String {
        let settings = format!("show.json, swarm.drones[{k}].settings");
        let Some(value) = drone.get_mut("settings").and_then(|it| it.get_mut(key)) else {
            return settings;
        };
        let Some(referred) = value["$ref"].as_str() else {
            return format!("{settings}.{key}");
        };
        // A JSON reference: a file, and where in it (RFC 6901).
        let (file, within) = referred.split_once('#').unwrap_or((referred, ""));
        let name = match file.trim_start_matches("./") {
            "" => "show.json".to_owned(),
            name => name.to_owned(),
        };
        let found = match within {
            "" => json(zip, &name),
            within => part(zip, shared, (&name, within)),
        };
        match found {
            Ok(found) => *value = found,
            Err(error) => errors.push(error),
        }
        name
    };
    let (within, lit_within) = (place("trajectory"), place("lights"));
    if !errors.is_empty() {
        return Err(errors);
    }
    let entry: Entry = serde_path_to_error::deserialize(drone).map_err(|error| {
        let at = error.path().to_string();
        let at = at
            .trim_start_matches("settings.trajectory")
            .trim_start_matches('.');
        let what = match at {
            "" | "." => error.inner().to_string(),
            at => format!("{at}: {}", error.inner()),
        };
        vec![ReadError::within(&within, what)]
    })?;
    let Settings {
        name,
        trajectory,
        lights,
        home,
    } = entry.settings;
    let (flown, faults) = flown(&trajectory);
    errors.extend(faults.iter().map(|what| ReadError::within(&within, what)));
    let lights = lights.filter(|it| !it.is_null()).map(Lights::of);
    let lights = lights.transpose().unwrap_or_else(|what| {
        errors.push(ReadError::within(&lit_within, what));
        None
    });
    match errors.is_empty() {
        true => Ok(Performer {
            name: (name.filter(|it| !it.trim().is_empty()))
                .unwrap_or_else(|| format!("drone-{}", k + 1)),
            flown,
            lights,
            home_m: home.map(Point3::from),
        }),
        false => Err(errors),
    }
}

/// A JSON file of the zip.
fn json(zip: &mut Zip<'_>, name: &str) -> Result<Value, ReadError> {
    let file = zip.archive.by_name(name);
    let file = file.map_err(|error| ReadError::within(name, error.to_string()))?;
    let most = MOST_BYTES.min(zip.left);
    let mut text = Vec::new();
    let taken = file.take(most + 1).read_to_end(&mut text);
    taken.map_err(|error| ReadError::within(name, error.to_string()))?;
    zip.left = zip.left.saturating_sub(text.len() as u64);
    if text.len() as u64 > most {
        let what = match most {
            MOST_BYTES => format!("unpacks to more than {} MiB", MOST_BYTES >> 20),
            _ => format!(
                "with all that was read before it unpacks to more than {} MiB",
                MOST_BYTES_IN_ALL >> 20
            ),
        };
        return Err(ReadError::within(name, what));
    }
    serde_json::from_slice(&text).map_err(|error| ReadError::within(name, error.to_string()))
}

/// What it flies, and what is wrong with its points.
fn flown(trajectory: &Trajectory) -> (Flown, Vec<String>) {
    let mut flown = Flown::default();
    if trajectory.version != 1 {
        let version = trajectory.version;
        return (
            flown,
            vec![format!("version {version}, this program reads 1")],
        );
    }
    let Some((first_s, first_m, _)) = trajectory.points.first() else {
        return (flown, vec!["no points".to_owned()]);
    };
    let mut faults = Vec::new();
    let mut now = (trajectory.takeoff_s + first_s, *first_m);
    // Until its take-off it stands.
    if now.0 > 0.0 {
        flown = Flown::through(&[(0.0, Point3::from(now.1)), now_at(now)]);
    }
    for (k, (t_s, end_m, inner)) in trajectory.points.iter().enumerate().skip(1) {
        let until_s = trajectory.takeoff_s + t_s;
        if inner.len() > 2 {
            let count = inner.len();
            faults.push(format!("points[{k}]: {count} control points, at most 2"));
        }
        if until_s <= now.0 {
            faults.push(format!(
                "points[{k}]: time does not go on: {} s",
                as_typed(*t_s)
            ));
            continue;
        }
        let axis = |axis: usize| {
            let mut bernstein = vec![now.1[axis]];
            bernstein.extend(inner.iter().map(|it| it[axis]));
            bernstein.push(end_m[axis]);
            powers(&bernstein, until_s - now.0)
        };
        let span = Span {
            from_s: now.0,
            until_s,
            axes: [0, 1, 2].map(axis),
        };
        if let Some(what) = span.fault() {
            faults.push(format!("points[{k}]: {what}"));
            continue;
        }
        flown.spans.push(span);
        now = (until_s, *end_m);
    }
    if flown.spans.is_empty() {
        let (t_s, at_m) = now_at(now);
        flown = Flown::through(&[(t_s, at_m), (t_s + 1.0, at_m)]);
    }
    (flown, faults)
}

fn now_at(now: (f64, [f64; 3])) -> (f64, Point3<f64>) {
    (now.0, Point3::from(now.1))
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use serde_json::json;
    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    use super::*;

    #[test]
    fn a_file_that_many_drones_refer_to_counts_for_each_of_them() {
        let drone = json!({"settings": {"trajectory": {"$ref": "./all.json"}}});
        let show = json!({"version": 1, "swarm": {"drones": [drone, drone, drone]}}).to_string();
        let path = json!({"version": 1, "points": [[0, [1, 2, 3], []], [9, [1, 2, 4], []]]});
        let path = path.to_string();
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, text) in [("show.json", &show), ("all.json", &path)] {
            zip.start_file(name, SimpleFileOptions::default())
                .expect("a zip in memory");
            zip.write_all(text.as_bytes()).expect("a zip in memory");
        }
        let bytes = zip.finish().expect("a zip in memory").into_inner();
        let takes = (show.len() + 3 * path.len()) as u64;
        let read = read_up_to(takes, &bytes).expect("all fit");
        assert_eq!(read.performers.len(), 3);
        let errors = read_up_to(takes - 1, &bytes).expect_err("the last does not fit");
        assert_eq!(errors.len(), 1);
        assert!(
            errors[0]
                .to_string()
                .contains("with all that was read before")
        );
    }
}
