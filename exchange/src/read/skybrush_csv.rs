//! Tables of Skybrush Studio, one a drone: milliseconds, places, colours; straight from place to
//! place.

use nalgebra::Point3;

use super::{ReadError, Table, columns, table};
use crate::flown::Flown;

/// Whether a first line is that of such a table: its first cell alone says so, as Studio's own
/// reader has it.
#[must_use]
pub fn is_header(line: &str) -> bool {
    let first = line.split(',').next().unwrap_or_default().trim();
    let first = first.to_lowercase();
    first.starts_with("time_msec") || first.starts_with("time [msec]")
}

/// One drone: time (ms), x, y and z (m), and colours, which are left alone.
///
/// # Errors
///
/// All that is wrong, each at its line.
pub fn read(text: &str) -> Result<Flown, ReadError> {
    let columns = columns(text.lines().next().unwrap_or_default());
    if columns < 4 {
        let what = format!("{columns} columns; Time_msec,X_m,Y_m,Z_m are needed");
        return Err(ReadError::line(1, what));
    }
    let Table { rows, mut faults } = table(text, columns, 4)?;
    let rows = rows.into_iter().map(|(line, row)| {
        let at_m = Point3::new(row[1], row[2], row[3]);
        (line, row[0] / 1000.0, at_m)
    });
    let flown = Flown::through_rows(rows, &mut faults);
    Ok(faults.or(flown)?)
}
