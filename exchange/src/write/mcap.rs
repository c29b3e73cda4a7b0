//! MCAP, for Foxglove: the place, the drones and their wakes as `foxglove.SceneUpdate` messages in
//! JSON.
//!
//! The messages are those of foxglove/foxglove-sdk's `SceneUpdate`; the schema in the file is made
//! from the types here.

use std::collections::BTreeMap;
use std::io::{Cursor, Error};

use mcap::records::{MessageHeader, Metadata};
use mcap::{McapResult, WriteOptions};
use nalgebra::Point3;
use planner::plan::{DronePlan, Solid};
use planner::{Outline, Plan, WakeOutlines};
use schemars::JsonSchema;
use serde::Serialize;

use crate::course::Course;

/// Updates a second (1/s), of fleets up to [`MANY`] and of larger ones: chosen here, a gigabyte
/// holds an hour of twelve drones and some minutes of a thousand.
const RATES_HZ: [f64; 2] = [10.0, 2.0];
/// Drones.
const MANY: usize = 150;

/// Updates a second of a fleet of so many (1/s).
pub(crate) fn rate_hz(drones: usize) -> f64 {
    RATES_HZ[usize::from(drones > MANY)]
}

/// Smallest radius that a drone is drawn with (m): chosen here, it would be invisible in a hall.
const DRAWN_M: f64 = 0.25;

#[derive(Serialize, JsonSchema)]
struct SceneUpdate {
    deletions: Vec<Nothing>,
    entities: Vec<Entity>,
}

/// Elements that are never written.
#[derive(Serialize, JsonSchema)]
struct Nothing {}

#[derive(Serialize, JsonSchema)]
struct Time {
    sec: u32,
    nsec: u32,
}

#[derive(Serialize, JsonSchema)]
struct KeyValue {
    key: String,
    value: String,
}

#[derive(Default, Serialize, JsonSchema)]
struct Vector {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Serialize, JsonSchema)]
struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

#[derive(Serialize, JsonSchema)]
struct Pose {
    position: Vector,
    orientation: Quaternion,
}

#[derive(Clone, Copy, Serialize, JsonSchema)]
struct Color {
    r: f64,
    g: f64,
    b: f64,
    a: f64,
}

/// A cube or a sphere.
#[derive(Serialize, JsonSchema)]
struct Solid3 {
    pose: Pose,
    size: Vector,
    color: Color,
}

/// A cylinder or a truncated cone.
#[derive(Serialize, JsonSchema)]
struct Cylinder {
    pose: Pose,
    size: Vector,
    bottom_scale: f64,
    top_scale: f64,
    color: Color,
}

#[derive(Serialize, JsonSchema)]
struct Entity {
    timestamp: Time,
    frame_id: String,
    id: String,
    lifetime: Time,
    frame_locked: bool,
    metadata: Vec<KeyValue>,
    arrows: Vec<Nothing>,
    cubes: Vec<Solid3>,
    spheres: Vec<Solid3>,
    cylinders: Vec<Cylinder>,
    lines: Vec<Nothing>,
    triangles: Vec<Nothing>,
    texts: Vec<Nothing>,
    models: Vec<Nothing>,
}

const GREY: Color = Color {
    r: 0.6,
    g: 0.6,
    b: 0.6,
    a: 0.5,
};
const DRONE: Color = Color {
    r: 0.0,
    g: 0.45,
    b: 0.7,
    a: 1.0,
};
const WAKE: Color = Color {
    r: 0.9,
    g: 0.6,
    b: 0.0,
    a: 0.25,
};

fn time(ns: u64) -> Time {
    Time {
        sec: (ns / 1_000_000_000) as u32,
        nsec: (ns % 1_000_000_000) as u32,
    }
}

fn pose(at_m: [f64; 3]) -> Pose {
    let [x, y, z] = at_m.map(|m| (m * 1e6).round() / 1e6);
    Pose {
        position: Vector { x, y, z },
        orientation: Quaternion {
            x: 0.0,
            y: 0.0,
            z: 0.0,
            w: 1.0,
        },
    }
}

fn size(of_m: [f64; 3]) -> Vector {
    let [x, y, z] = of_m.map(|m| (m * 1e6).round() / 1e6);
    Vector { x, y, z }
}

fn entity(id: String, ns: u64, lifetime_ns: u64) -> Entity {
    Entity {
        timestamp: time(ns),
        frame_id: "world".to_owned(),
        id,
        lifetime: time(lifetime_ns),
        frame_locked: false,
        metadata: Vec::new(),
        arrows: Vec::new(),
        cubes: Vec::new(),
        spheres: Vec::new(),
        cylinders: Vec::new(),
        lines: Vec::new(),
        triangles: Vec::new(),
        texts: Vec::new(),
        models: Vec::new(),
    }
}

/// Obstacles that have a shape of their own here; meshes do not.
fn place(plan: &Plan) -> Entity {
    let mut all = entity("place".to_owned(), 0, 0);
    for obstacle in &plan.obstacles {
        match &obstacle.shape {
            Solid::Box { min_m, max_m } => all.cubes.push(Solid3 {
                pose: pose([0, 1, 2].map(|k| (min_m[k] + max_m[k]) / 2.0)),
                size: size([0, 1, 2].map(|k| max_m[k] - min_m[k])),
                color: GREY,
            }),
            Solid::Cylinder {
                base_m,
                radius_m,
                height_m,
            } => all.cylinders.push(Cylinder {
                pose: pose([base_m.x, base_m.y, base_m.z + height_m / 2.0]),
                size: size([2.0 * radius_m, 2.0 * radius_m, *height_m]),
                bottom_scale: 1.0,
                top_scale: 1.0,
                color: GREY,
            }),
            Solid::Mesh { .. } => {}
        }
    }
    all
}

/// A wake as its column and its cone, which end where it ends.
fn wake(outline: &Outline) -> Vec<Cylinder> {
    let [joins_z_m, ends_z_m] = outline.z_m;
    let [upper_m, lower_m] = outline.half_width_m;
    let part = |top_z_m: f64, bottom_z_m: f64, top_m: f64, bottom_m: f64, aside_m: [f64; 2]| {
        let widest_m = top_m.max(bottom_m);
        (top_z_m - bottom_z_m > 1e-3 && widest_m > 0.0).then(|| Cylinder {
            pose: pose([
                outline.at_m.x + aside_m[0],
                outline.at_m.y + aside_m[1],
                (top_z_m + bottom_z_m) / 2.0,
            ]),
            size: size([2.0 * widest_m, 2.0 * widest_m, top_z_m - bottom_z_m]),
            bottom_scale: bottom_m / widest_m,
            top_scale: top_m / widest_m,
            color: WAKE,
        })
    };
    let [first, last] = outline.aside_m;
    let middle = [0, 1].map(|k| (first[k] + last[k]) / 2.0);
    let column_m = outline.column_radius_m;
    let column = part(outline.at_m.z, joins_z_m, column_m, column_m, [0.0; 2]);
    let cone = part(joins_z_m, ends_z_m, upper_m, lower_m, middle);
    column.into_iter().chain(cone).collect()
}

/// The file: the place once, and each drone with its wake at a rate.
///
/// # Errors
///
/// None is known: it is written to memory.
pub fn file(plan: &Plan, plan_id: &str, courses: &[Course]) -> McapResult<Vec<u8>> {
    let mut writer = WriteOptions::new()
        .compression(None)
        .library("leeward")
        .create(Cursor::new(Vec::new()))?;
    let schema = serde_json::to_vec(&schemars::schema_for!(SceneUpdate)).map_err(Error::from)?;
    let schema = writer.add_schema("foxglove.SceneUpdate", "jsonschema", &schema)?;
    let channel = writer.add_channel(schema, "/leeward/scene", "json", &BTreeMap::new())?;
    writer.write_metadata(&Metadata {
        name: "leeward".to_owned(),
        metadata: BTreeMap::from([
            ("plan".to_owned(), plan_id.to_owned()),
            ("scenario".to_owned(), plan.scenario.clone()),
        ]),
    })?;
    let outlines = WakeOutlines::new(plan);
    let rate_hz = rate_hz(courses.len());
    let end_s = courses.iter().map(Course::until_s).fold(0.0, f64::max);
    let steps = (end_s * rate_hz - 1e-6).ceil().max(0.0) as u32;
    for k in 0..=steps {
        let t_s = f64::from(k) / rate_hz;
        let ns = (t_s * 1e9).round() as u64;
        // Until the update after the next, so that what has left goes.
        let lifetime_ns = (2e9 / rate_hz) as u64;
        let mut entities: Vec<Entity> = (k == 0).then(|| place(plan)).into_iter().collect();
        for (drone, course) in plan.drones.iter().zip(courses) {
            let is_there = course.enters_s.is_none_or(|it| it <= t_s)
                && !(course.leaves && t_s > course.until_s());
            if is_there {
                let id = format!("{plan_id}/{}", drone.name);
                let mut one = entity(id, ns, lifetime_ns);
                dressed(
                    &mut one,
                    drone,
                    course.state(t_s).position_m,
                    t_s,
                    &outlines,
                );
                entities.push(one);
            }
        }
        let update = SceneUpdate {
            deletions: Vec::new(),
            entities,
        };
        let header = MessageHeader {
            channel_id: channel,
            sequence: k,
            log_time: ns,
            publish_time: ns,
        };
        let update = serde_json::to_vec(&update).map_err(Error::from)?;
        writer.write_to_known_channel(&header, &update)?;
    }
    writer.finish()?;
    Ok(writer.into_inner().into_inner())
}

/// A drone's body and, where it flies, its wake.
fn dressed(
    one: &mut Entity,
    drone: &DronePlan,
    at_m: Point3<f64>,
    t_s: f64,
    outlines: &WakeOutlines,
) {
    let across_m = 2.0 * drone.airframe.body_radius_m.max(DRAWN_M);
    one.metadata.push(KeyValue {
        key: "name".to_owned(),
        value: drone.name.clone(),
    });
    one.spheres.push(Solid3 {
        pose: pose([at_m.x, at_m.y, at_m.z]),
        size: size([across_m; 3]),
        color: DRONE,
    });
    let (from_s, until_s) = drone.airborne_s;
    if t_s >= from_s && until_s.is_none_or(|it| t_s < it) {
        let entry = &drone.trajectory;
        let after = entry.t_s.partition_point(|it| *it <= t_s);
        let mass_kg = entry.mass_kg[after.saturating_sub(1)];
        one.cylinders = wake(&outlines.of(drone, at_m, mass_kg));
    }
}
