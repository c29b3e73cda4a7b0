//! Readers, one file a format: bytes in, [`Flown`](crate::flown::Flown) out. None imports a writer.

pub mod compressed;
pub mod czml;
pub mod mcap;
pub mod mission;
pub mod setpoints;
pub mod skyb;
pub mod skybrush_csv;
pub mod skyc;
pub mod uav_trajectory;

use planner::scenario::RowFaults;
use thiserror::Error;

/// Why bytes are not what they should be.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ReadError {
    /// At a line of a table, counted from 1.
    #[error("line {line}: {what}")]
    Line {
        /// From 1.
        line: u64,
        /// What is wrong.
        what: String,
    },
    /// In rows of a table.
    #[error(transparent)]
    Rows(#[from] RowFaults),
    /// At a byte, counted from 0.
    #[error("byte {at}: {what}")]
    Byte {
        /// From 0.
        at: usize,
        /// What is wrong.
        what: String,
    },
    /// In one file of several, or one value of a file.
    #[error("{place}: {what}")]
    Within {
        /// Which.
        place: String,
        /// What is wrong.
        what: String,
    },
}

impl ReadError {
    pub(crate) fn line(line: u64, what: impl Into<String>) -> ReadError {
        let what = what.into();
        ReadError::Line { line, what }
    }

    pub(crate) fn within(place: &str, what: impl Into<String>) -> ReadError {
        let (place, what) = (place.to_owned(), what.into());
        ReadError::Within { place, what }
    }

    /// The first of several.
    pub(crate) fn first(of: Vec<ReadError>) -> ReadError {
        let first = of.into_iter().next();
        first.unwrap_or_else(|| ReadError::within("the file", "not read"))
    }

    pub(crate) fn byte(at: usize, what: impl Into<String>) -> ReadError {
        let what = what.into();
        ReadError::Byte { at, what }
    }
}

/// A table of numbers below its first line.
struct Table {
    /// Their lines, and the values that were asked for.
    rows: Vec<(u64, Vec<f64>)>,
    /// Of rows that are left out.
    faults: RowFaults,
}

/// How many columns a table's first line names; a comma at its end begins none.
fn columns_of(text: &str) -> usize {
    let header = text.lines().next().unwrap_or_default().trim_end();
    header
        .strip_suffix(',')
        .unwrap_or(header)
        .split(',')
        .count()
}

/// The first numbers of the rows of a table with so many columns; further columns may hold
/// anything. A row may end with a comma.
fn table(text: &str, columns: usize, numbers: usize) -> Result<Table, ReadError> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(true)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut rows = Vec::new();
    let mut faults = RowFaults::default();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(0, csv::Position::line);
            ReadError::line(line, error.to_string())
        })?;
        let line = record.position().map_or(0, csv::Position::line);
        let ends_empty = record.len() == columns + 1 && record.get(columns) == Some("");
        if record.len() != columns && !ends_empty {
            let what = format!("{} columns, {columns} expected", record.len());
            faults.add(line, what);
            continue;
        }
        let mut row = Vec::with_capacity(numbers);
        for (column, cell) in record.iter().take(numbers).enumerate() {
            match cell.parse::<f64>().ok().filter(|value| value.is_finite()) {
                Some(value) => row.push(value),
                None => {
                    let what = format!("column {}: `{cell}` is no finite number", column + 1);
                    faults.add(line, what);
                }
            }
        }
        if row.len() == numbers {
            rows.push((line, row));
        }
    }
    if rows.is_empty() && faults.is_empty() {
        return Err(ReadError::line(2, "no rows below the header"));
    }
    Ok(Table { rows, faults })
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::{setpoints, skybrush_csv, uav_trajectory};

    #[test]
    fn further_columns_may_hold_text() {
        let ned = "t_s,n_m,e_m,d_m,note\n0,0,0,-1,up\n1,1,0,-1,\n";
        let flown = setpoints::read(ned, 0.0, Point3::origin()).expect("a table");
        assert_eq!(flown.spans.len(), 1);
        for twice in [
            "t_s,x_m,y_m,z_m,x_m\n0,0,0,1,5\n",
            "t_s,x_m,y_m,z_m,n_m\n0,0,0,1,5\n",
        ] {
            assert!(setpoints::read(twice, 0.0, Point3::origin()).is_err());
        }
        let studio = "Time_msec,X_m,Y_m,Z_m,Color\n0,0,0,1,#ff0000\n1000,1,0,1,#00ff00\n";
        assert_eq!(skybrush_csv::read(studio).expect("a table").spans.len(), 1);
        let lacks = studio.replace("1000,1", "1000,?");
        assert!(skybrush_csv::read(&lacks).is_err());
    }

    #[test]
    fn rows_of_polynomials_may_end_with_a_comma() {
        let name = |axis: &str| (0..8).map(|k| format!(",{axis}^{k}")).collect::<String>();
        let header = format!(
            "duration{}{}{}{}",
            name("x"),
            name("y"),
            name("z"),
            name("yaw")
        );
        let row = format!("1.5{}", ",0.1".repeat(32));
        for (header, row) in [
            (header.clone(), row.clone()),
            (header.clone() + ",", row.clone()),
            (header.clone() + ",", row.clone() + ","),
        ] {
            let flown = uav_trajectory::read(&format!("{header}\n{row}\n"));
            assert_eq!(flown.expect("one piece").spans.len(), 1);
        }
        assert!(uav_trajectory::read(&format!("{header}\n{row},0\n")).is_err());
    }
}
