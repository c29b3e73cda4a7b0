//! Setpoint tables, NED or ENU by their header: straight from place to place.

use nalgebra::{Point3, Vector3};

use super::{ReadError, Table, columns_of, table};
use crate::flown::Flown;
use crate::frame::{Axes, Frame};

/// The axes that a header names: `t_s` and three columns of places, whatever follows.
///
/// # Errors
///
/// It names neither.
pub fn axes(text: &str) -> Result<Axes, ReadError> {
    let header = text.lines().next().unwrap_or_default();
    let columns: Vec<&str> = header.split(',').map(str::trim).collect();
    match columns[..] {
        ["t_s", "n_m", "e_m", "d_m", ..] => Ok(Axes::Ned),
        ["t_s", "x_m", "y_m", "z_m", ..] => Ok(Axes::Enu),
        _ => {
            let what = "a setpoint table begins t_s,n_m,e_m,d_m (NED) or t_s,x_m,y_m,z_m (ENU)";
            Err(ReadError::line(1, what))
        }
    }
}

/// A further column that is another time or place.
fn again(text: &str) -> Option<&str> {
    let header = text.lines().next().unwrap_or_default();
    let places = ["t_s", "n_m", "e_m", "d_m", "x_m", "y_m", "z_m"];
    let mut further = header.split(',').map(str::trim).skip(4);
    further.find(|name| places.contains(name))
}

/// One drone in the world, whose +x has this heading (deg), places counted from one of its own (m).
///
/// # Errors
///
/// All that is wrong, each at its line.
pub fn read(text: &str, heading_deg: f64, from_m: Point3<f64>) -> Result<Flown, ReadError> {
    let frame = Frame {
        axes: axes(text)?,
        heading_deg,
    };
    if let Some(again) = again(text) {
        let what = format!("a further column `{again}`: there is one time and one place a row");
        return Err(ReadError::line(1, what));
    }
    let Table { rows, mut faults } = table(text, columns_of(text), 4)?;
    let rows = rows.into_iter().map(|(line, row)| {
        let seen_m = Vector3::new(row[1], row[2], row[3]);
        (line, row[0], from_m + frame.to_world(seen_m))
    });
    let flown = Flown::through_rows(rows, &mut faults);
    Ok(faults.or(flown)?)
}
