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

    pub(crate) fn byte(at: usize, what: impl Into<String>) -> ReadError {
        let what = what.into();
        ReadError::Byte { at, what }
    }
}

/// The rows of a table of numbers below its first line: their lines, and as many values as columns.
fn rows(text: &str, columns: usize) -> Result<Vec<(u64, Vec<f64>)>, ReadError> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(true)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| {
            let line = error.position().map_or(0, csv::Position::line);
            ReadError::line(line, error.to_string())
        })?;
        let line = record.position().map_or(0, csv::Position::line);
        if record.len() != columns {
            let what = format!("{} columns, {columns} expected", record.len());
            return Err(ReadError::line(line, what));
        }
        let number = |(column, cell): (usize, &str)| match cell.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => {
                let what = format!("column {}: `{cell}` is no finite number", column + 1);
                Err(ReadError::line(line, what))
            }
        };
        let values: Result<Vec<f64>, ReadError> = record.iter().enumerate().map(number).collect();
        rows.push((line, values?));
    }
    if rows.is_empty() {
        return Err(ReadError::line(2, "no rows below the header"));
    }
    Ok(rows)
}
