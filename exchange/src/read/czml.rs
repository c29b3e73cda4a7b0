//! CZML: each named packet's places, from geocentric coordinates of the ellipsoid itself.

use nalgebra::{Matrix3, Point3, Vector3};
use serde_json::Value;

use super::ReadError;
use crate::flown::Flown;
use crate::frame::{Axes, Frame, Georeference};

/// Where a longitude, latitude (deg) and height (m) are from the Earth's centre (m; WGS 84).
fn geocentric_m([longitude_deg, latitude_deg, height_m]: [f64; 3]) -> Vector3<f64> {
    const A_M: f64 = 6_378_137.0;
    const B_M: f64 = 6_356_752.314_245;
    let (sin, cos) = latitude_deg.to_radians().sin_cos();
    let (east, north) = longitude_deg.to_radians().sin_cos();
    let across_m = A_M * A_M / (A_M * A_M * cos * cos + B_M * B_M * sin * sin).sqrt();
    let level_m = (across_m + height_m) * cos;
    let up_m = (across_m * (B_M / A_M).powi(2) + height_m) * sin;
    Vector3::new(level_m * north, level_m * east, up_m)
}

/// East, north and up at a place, in rows.
fn axes(at: &Georeference) -> Matrix3<f64> {
    let (sin, cos) = at.latitude_deg.to_radians().sin_cos();
    let (east, north) = at.longitude_deg.to_radians().sin_cos();
    Matrix3::new(
        -east,
        north,
        0.0, //
        -sin * north,
        -sin * east,
        cos, //
        cos * north,
        cos * east,
        sin,
    )
}

/// What turns a longitude, latitude (deg) and height (m) into a place of the world that lies at a
/// place on the Earth.
pub(super) fn on_earth_to_world(at: &Georeference) -> impl Fn([f64; 3]) -> Point3<f64> {
    let enu = Frame {
        axes: Axes::Enu,
        heading_deg: at.heading_deg,
    };
    let centre_m = geocentric_m([at.longitude_deg, at.latitude_deg, at.altitude_m]);
    let axes = axes(at);
    move |there| Point3::from(enu.to_world(axes * (geocentric_m(there) - centre_m)))
}

/// The drones of a file by name, in the world that lies at a place on the Earth.
///
/// # Errors
///
/// No JSON list, or a packet whose places are no groups of four numbers.
pub fn read(bytes: &[u8], at: &Georeference) -> Result<Vec<(String, Flown)>, ReadError> {
    let packets: Vec<Value> = serde_json::from_slice(bytes)
        .map_err(|error| ReadError::within("the file", error.to_string()))?;
    let to_world = on_earth_to_world(at);
    let mut drones = Vec::new();
    for packet in packets.iter().filter(|it| it.get("position").is_some()) {
        let name = packet["name"].as_str().unwrap_or_default();
        let numbers = packet["position"]["cartographicDegrees"].as_array();
        let numbers: Option<Vec<f64>> =
            numbers.and_then(|all| all.iter().map(Value::as_f64).collect());
        let numbers = numbers.filter(|it| it.len() >= 4 && it.len().is_multiple_of(4));
        let Some(numbers) = numbers else {
            let what = "cartographicDegrees are no groups of four numbers";
            return Err(ReadError::within(name, what));
        };
        let point = |four: &[f64]| (four[0], to_world([four[1], four[2], four[3]]));
        let points: Vec<(f64, Point3<f64>)> = numbers.chunks(4).map(point).collect();
        drones.push((name.to_owned(), Flown::through(&points)));
    }
    Ok(drones)
}
