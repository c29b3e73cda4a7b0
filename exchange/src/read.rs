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
    /// Their lines, and the values of the columns that are read.
    rows: Vec<(u64, Vec<f64>)>,
    /// Of rows that are left out.
    faults: RowFaults,
}

/// How many columns a header has; one without a name at its end is what a last comma leaves.
fn columns(header: &str) -> usize {
    let header = header.trim_end();
    header
        .strip_suffix(',')
        .unwrap_or(header)
        .split(',')
        .count()
}

/// The rows of a table with so many columns, of which the first so many are read: numbers.
fn table(text: &str, columns: usize, read: usize) -> Result<Table, ReadError> {
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
        let ends_in_comma = record.len() == columns + 1 && record.get(columns) == Some("");
        if record.len() != columns && !ends_in_comma {
            let what = format!("{} columns, {columns} expected", record.len());
            faults.add(line, what);
            continue;
        }
        let mut row = Vec::with_capacity(read);
        for (column, cell) in record.iter().enumerate().take(read) {
            match cell.parse::<f64>().ok().filter(|value| value.is_finite()) {
                Some(value) => row.push(value),
                None => {
                    let what = format!("column {}: `{cell}` is no finite number", column + 1);
                    faults.add(line, what);
                }
            }
        }
        if row.len() == read {
            rows.push((line, row));
        }
    }
    if rows.is_empty() && faults.is_empty() {
        return Err(ReadError::line(2, "no rows below the header"));
    }
    Ok(Table { rows, faults })
}
