//! Missions of QGroundControl: where their items are, in their order; they have no times.

use nalgebra::Point3;
use serde_json::Value;

use super::ReadError;
use super::czml::on_earth_to_world;
use crate::frame::Georeference;

/// Cells of a line of a `.waypoints`.
const CELLS: usize = 12;

/// The places of a `.plan` or a `.waypoints` (m), in the world that lies at a place on the Earth.
///
/// # Errors
///
/// The first thing that is wrong, at its place.
pub fn read(bytes: &[u8], at: &Georeference) -> Result<Vec<Point3<f64>>, ReadError> {
    let (home_amsl_m, items) = match bytes.first() {
        Some(b'{') => of_plan(bytes)?,
        _ => of_waypoints(&String::from_utf8_lossy(bytes))?,
    };
    let to_world = on_earth_to_world(at);
    let place = |[latitude_deg, longitude_deg, above_m]: [f64; 3]| {
        to_world([longitude_deg, latitude_deg, home_amsl_m + above_m])
    };
    Ok(items.into_iter().map(place).collect())
}

/// Height of home, and latitude, longitude and height above home of each item.
type Items = (f64, Vec<[f64; 3]>);

fn of_plan(bytes: &[u8]) -> Result<Items, ReadError> {
    let file: Value = serde_json::from_slice(bytes)
        .map_err(|error| ReadError::within("the file", error.to_string()))?;
    let mission = &file["mission"];
    let home = &mission["plannedHomePosition"][2];
    let Some(home_amsl_m) = home.as_f64() else {
        return Err(ReadError::within(
            "plannedHomePosition",
            "three numbers are expected",
        ));
    };
    let items = mission["items"].as_array().into_iter().flatten();
    let numbers = |(k, item): (usize, &Value)| {
        let number = |index: usize| item["params"][index].as_f64();
        match (number(4), number(5), number(6)) {
            (Some(a), Some(b), Some(c)) if item["frame"] == 3 => Ok([a, b, c]),
            _ => {
                let place = format!("item {}", k + 1);
                Err(ReadError::within(&place, "no place above home"))
            }
        }
    };
    let items: Result<Vec<[f64; 3]>, ReadError> = items.enumerate().map(numbers).collect();
    Ok((home_amsl_m, items?))
}

fn of_waypoints(text: &str) -> Result<Items, ReadError> {
    let mut lines = (1..).zip(text.lines());
    if lines.next().is_none_or(|it| it.1 != "QGC WPL 110") {
        return Err(ReadError::line(1, "`QGC WPL 110` is expected"));
    }
    let (mut home_amsl_m, mut items) = (None, Vec::new());
    for (line, text) in lines {
        let cells: Result<Vec<f64>, _> = text.split('\t').map(str::parse::<f64>).collect();
        let cells = cells.ok().filter(|it| it.len() == CELLS);
        let Some(cells) = cells else {
            let what = format!("{CELLS} numbers are expected");
            return Err(ReadError::line(line, what));
        };
        match (home_amsl_m, cells[2]) {
            (None, 0.0) => home_amsl_m = Some(cells[10]),
            (Some(_), 3.0) => items.push([cells[8], cells[9], cells[10]]),
            _ => return Err(ReadError::line(line, "home first, then heights above it")),
        }
    }
    let home_amsl_m = home_amsl_m.ok_or_else(|| ReadError::line(2, "no home"))?;
    Ok((home_amsl_m, items))
}
