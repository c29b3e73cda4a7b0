//! Skybrush's show file (`.skyc`, version 1): a zip of `show.json` and a trajectory a drone.
//!
//! The layout is that of `packages/show-format` in skybrush-io/skybrush.js. Metres; x north, y
//! west,
//! z up, turned by `orientation`: the world's own axes.

use std::collections::BTreeMap;
use std::io::{Cursor, Error};

use nalgebra::Point3;
use planner::Plan;
use serde_json::{Value, json};
use zip::ZipWriter;
use zip::result::ZipResult;
use zip::write::SimpleFileOptions;

use crate::course::Course;
use crate::frame::Georeference;
use crate::lights::Lights;

/// Drones that Skybrush's loader takes.
pub const MOST_DRONES: usize = 5000;

/// What a show says beside its trajectories.
#[derive(Clone, Copy, Debug)]
pub struct Show<'a> {
    /// The plan that is written.
    pub plan: &'a Plan,
    /// What it is called in the file's title.
    pub plan_id: &'a str,
    /// Outdoors; `None`: indoors.
    pub georeference: Option<Georeference>,
    /// Light programs, by drone.
    pub lights: &'a BTreeMap<String, Lights>,
}

/// The file.
///
/// # Errors
///
/// None is known: it is written to memory.
pub fn file(show: &Show<'_>, courses: &[Course]) -> ZipResult<Vec<u8>> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default();
    let mut put = |name: &str, value: &Value| -> ZipResult<()> {
        zip.start_file(name, options)?;
        serde_json::to_writer(&mut zip, value).map_err(Error::from)?;
        Ok(())
    };
    put("show.json", &index(show, courses))?;
    for (k, course) in courses.iter().enumerate() {
        put(
            &format!("drones/drone_{:04}/trajectory.json", k + 1),
            &trajectory(course),
        )?;
        if let Some(lights) = show.lights.get(&course.name) {
            let name = format!("drones/drone_{:04}/lights.json", k + 1);
            put(&name, lights.json())?;
        }
    }
    Ok(zip.finish()?.into_inner())
}

fn place(at_m: Point3<f64>) -> Value {
    let rounded = |m: f64| (m * 1e6).round() / 1e6 + 0.0;
    json!([rounded(at_m.x), rounded(at_m.y), rounded(at_m.z)])
}

fn index(show: &Show<'_>, courses: &[Course]) -> Value {
    let drones = courses.iter().enumerate().map(|(k, course)| {
        let end_m = course
            .pieces
            .last()
            .map_or(course.start_m(), |it| it.points_m[3]);
        let file = format!("./drones/drone_{:04}/trajectory.json#", k + 1);
        let mut settings = json!({
            "name": course.name,
            "home": place(course.start_m()),
            "landAt": place(end_m),
            "trajectory": {"$ref": file},
        });
        if show.lights.contains_key(&course.name) {
            let file = format!("./drones/drone_{:04}/lights.json#", k + 1);
            settings["lights"] = json!({"$ref": file});
        }
        json!({"type": "generic", "settings": settings})
    });
    let environment = match show.georeference {
        None => json!({"type": "indoor"}),
        // Studio's scaled integers: degrees by 1e7, millimetres.
        Some(at) => json!({
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
    };
    let airframes = || show.plan.drones.iter().map(|it| &it.airframe);
    let most = |speed: fn(&planner::plan::AirframeEntry) -> f64| {
        airframes().map(speed).fold(0.0, f64::max)
    };
    let smallest_m = airframes()
        .map(|it| it.body_radius_m)
        .fold(f64::INFINITY, f64::min);
    json!({
        "version": 1,
        "environment": environment,
        "settings": {
            "cues": {"version": 1, "items": []},
            "validation": {
                "maxAltitude": show.plan.bounds_m.max.z,
                "maxVelocityXY": most(|it| it.max_speed_mps),
                "maxVelocityZ": most(|it| it.max_descent_mps.unwrap_or(it.max_speed_mps)),
                "maxVelocityZUp": most(|it| it.max_climb_mps.unwrap_or(it.max_speed_mps)),
                "minDistance": 2.0 * smallest_m + show.plan.clearance_m,
            },
        },
        "meta": {"title": format!("{} (plan {})", show.plan.scenario, show.plan_id)},
        "swarm": {"drones": drones.collect::<Vec<Value>>()},
    })
}

/// Points with whole milliseconds, which rise.
fn trajectory(course: &Course) -> Value {
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
    json!({"version": 1, "takeoffTime": 0.0, "points": points})
}
