//! Skybrush's show file (`.skyc`, version 1): a zip of `show.json` and a trajectory a drone.
//!
//! The layout is that of `packages/show-format` in skybrush-io/skybrush.js. Metres; x north, y
//! west, z up, turned by `orientation`: the world's own axes. What an imported show says beside
//! its trajectories is copied from it.

use std::collections::BTreeSet;
use std::io::{Cursor, Error};

use nalgebra::Point3;
use planner::Plan;
use serde_json::{Value, json};
use zip::result::ZipResult;
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

use crate::course::Course;
use crate::frame::Georeference;
use crate::kept::Kept;

/// Drones that Skybrush's loader takes.
pub const MOST_DRONES: usize = 5000;

/// What a show says beside its trajectories.
#[derive(Clone, Copy, Debug)]
pub struct Show<'a> {
    /// The plan that is written.
    pub plan: &'a Plan,
    /// What it is called in the file's title.
    pub plan_id: &'a str,
    /// Outdoors; `None`: indoors, or as the show that was imported.
    pub georeference: Option<Georeference>,
    /// Of a show that was imported: all that is not written anew stays as it is.
    pub kept: &'a Kept,
}

/// The file of what is called so of the `k`-th drone.
fn name(k: usize, what: &str) -> String {
    format!("drones/drone_{:04}/{what}.json", k + 1)
}

/// The file.
///
/// # Errors
///
/// The zip of the show that was imported cannot be copied from.
pub fn file(show: &Show<'_>, courses: &[Course]) -> ZipResult<Vec<u8>> {
    let index = show.index(courses);
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default();
    let mut written = BTreeSet::new();
    let mut put = |name: String, value: &Value| -> ZipResult<()> {
        zip.start_file(&name[..], options)?;
        serde_json::to_writer(&mut zip, value).map_err(Error::from)?;
        written.insert(name);
        Ok(())
    };
    put("show.json".to_owned(), &index)?;
    let begins_s = show.kept.begins_s();
    for (k, course) in courses.iter().enumerate() {
        put(name(k, "trajectory"), &trajectory(course, begins_s))?;
        if let Some(lights) = show.kept.lights.get(&course.name) {
            put(name(k, "lights"), lights.json())?;
        }
    }
    if let Some(original) = &show.kept.original {
        let mut from = ZipArchive::new(Cursor::new(&original.bytes[..]))?;
        // Trajectories and light programs as they were, unless something else refers to them.
        let mut idle = BTreeSet::new();
        for drone in original.drones.iter().filter_map(|it| original.drone(it)) {
            let settings = ["trajectory", "lights"].map(|key| &drone["settings"][key]);
            settings.iter().for_each(|it| refers_to(it, &mut idle));
        }
        let mut used = BTreeSet::new();
        refers_to(&index, &mut used);
        for k in 0..from.len() {
            let file = from.by_index_raw(k)?;
            let name = file.name()?.into_owned();
            let is_idle = idle.contains(&name) && !used.contains(&name);
            if !file.is_dir() && !is_idle && !written.contains(&name) {
                zip.raw_copy_file(file)?;
            }
        }
    }
    Ok(zip.finish()?.into_inner())
}

fn refers_to(value: &Value, files: &mut BTreeSet<String>) {
    match value {
        Value::Object(fields) => {
            if let Some(referred) = fields.get("$ref").and_then(Value::as_str) {
                let file = referred.split('#').next().unwrap_or_default();
                files.insert(file.trim_start_matches("./").to_owned());
            }
            fields.values().for_each(|it| refers_to(it, files));
        }
        Value::Array(values) => values.iter().for_each(|it| refers_to(it, files)),
        _ => {}
    }
}

/// A title without the id of the plan that it was exported from.
fn without_id(title: &str) -> &str {
    let is_id = |it: &str| it.len() == 16 && it.chars().all(|c| c.is_ascii_hexdigit());
    let split = title.rsplit_once(" (plan ");
    let own = split.filter(|(_, id)| id.strip_suffix(')').is_some_and(is_id));
    own.map_or(title, |it| it.0)
}

fn place(at_m: Point3<f64>) -> Value {
    let rounded = |m: f64| (m * 1e6).round() / 1e6 + 0.0;
    json!([rounded(at_m.x), rounded(at_m.y), rounded(at_m.z)])
}

impl Show<'_> {
    /// Whether the file lies on the Earth.
    pub(crate) fn is_outdoor(&self) -> bool {
        self.environment()["type"] == "outdoor"
    }

    fn environment(&self) -> Value {
        let original = self.kept.original.as_ref();
        let there = original.and_then(|it| it.origin().ok()?);
        let there = there.and_then(|it| Georeference::of(&it).ok());
        match (self.georeference, original) {
            // Where it was.
            (at, Some(original))
                if (at.is_none() || at == there) && original.index["environment"].is_object() =>
            {
                original.index["environment"].clone()
            }
            (None, _) => json!({"type": "indoor"}),
            // Studio's scaled integers: degrees by 1e7, millimetres.
            (Some(at), _) => json!({
                "type": "outdoor",
                "location": {
                    "origin": [
                        (at.latitude_deg * 1e7).round() as i64,
                        (at.longitude_deg * 1e7).round() as i64,
                        (at.altitude_m * 1e3).round() as i64,
                    ],
                    "orientation": at.heading_deg,
                },
            }),
        }
    }

    /// `show.json`.
    fn index(&self, courses: &[Course]) -> Value {
        let original = self.kept.original.as_ref();
        let mut index = match original {
            Some(original) => original.index.clone(),
            None => json!({
                "version": 1,
                "environment": {},
                "settings": {
                    "cues": {"version": 1, "items": []},
                    "validation": self.validation(),
                },
            }),
        };
        index["environment"] = self.environment();
        let named = index["meta"]["title"]
            .as_str()
            .unwrap_or(&self.plan.scenario);
        let title = format!("{} (plan {})", without_id(named), self.plan_id);
        match &mut index["meta"] {
            Value::Object(meta) => {
                meta.insert("title".to_owned(), title.into());
            }
            other => *other = json!({"title": title}),
        }
        let drones = courses.iter().enumerate();
        let drones = drones.map(|(k, course)| self.drone(k, course));
        index["swarm"]["drones"] = drones.collect();
        index
    }

    /// A drone's entry, the `k`-th.
    fn drone(&self, k: usize, course: &Course) -> Value {
        let original = self.kept.original.as_ref();
        let known = original.and_then(|it| it.drone(&course.name)).cloned();
        let mut drone = known.unwrap_or_else(|| json!({"type": "generic", "settings": {}}));
        let last = course.pieces.last();
        let end_m = last.map_or(course.start_m(), |it| it.points_m[3]);
        let referred = |what: &str| json!({"$ref": format!("./{}#", name(k, what))});
        let settings = &mut drone["settings"];
        settings["name"] = json!(course.name);
        settings["home"] = place(course.start_m());
        settings["landAt"] = place(end_m);
        settings["trajectory"] = referred("trajectory");
        if self.kept.lights.contains_key(&course.name) {
            settings["lights"] = referred("lights");
        }
        drone
    }

    /// What the airframes may do.
    fn validation(&self) -> Value {
        let airframes = || self.plan.drones.iter().map(|it| &it.airframe);
        let most = |speed: fn(&planner::plan::AirframeEntry) -> f64| {
            airframes().map(speed).fold(0.0, f64::max)
        };
        let radii_m = airframes().map(|it| it.body_radius_m);
        let smallest_m = radii_m.fold(f64::INFINITY, f64::min);
        json!({
            "maxAltitude": self.plan.bounds_m.max.z,
            "maxVelocityXY": most(|it| it.max_speed_mps),
            "maxVelocityZ": most(|it| it.max_descent_mps.unwrap_or(it.max_speed_mps)),
            "maxVelocityZUp": most(|it| it.max_climb_mps.unwrap_or(it.max_speed_mps)),
            "minDistance": 2.0 * smallest_m + self.plan.clearance_m.unwrap_or(0.0),
        })
    }
}

/// Points with whole milliseconds, which rise, from a moment of the show's clock on (s).
fn trajectory(course: &Course, begins_s: f64) -> Value {
    let ms = |t_s: f64| (t_s * 1000.0).round();
    let mut points = vec![json!([0.0, place(course.start_m()), []])];
    let mut now_ms = 0.0;
    for piece in &course.pieces {
        let [_, b, c, end] = piece.points_m;
        if ms(piece.until_s) > now_ms {
            now_ms = ms(piece.until_s);
            let inner = match piece.is_straight {
                true => json!([]),
                false => json!([place(b), place(c)]),
            };
            points.push(json!([now_ms / 1000.0, place(end), inner]));
        }
    }
    json!({"version": 1, "takeoffTime": begins_s, "points": points})
}
