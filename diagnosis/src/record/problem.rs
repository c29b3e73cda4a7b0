//! What keeps a recording from being read: all of it at once, each at its place.

use std::fmt;

/// One problem of one file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The file, as the recording calls it (`meta.json`, `probes.csv`).
    pub file: String,
    /// Line, from 1, where it has one.
    pub line: Option<u64>,
    /// Column or field by name, where it has one.
    pub field: Option<String>,
    /// What is wrong, with the value.
    pub message: String,
    /// The way out, where there is one.
    pub help: Option<String>,
}

/// Places of problems not yet reported.
impl Problem {
    pub(super) fn file(file: &str) -> Problem {
        Problem {
            file: file.to_owned(),
            line: None,
            field: None,
            message: String::new(),
            help: None,
        }
    }

    pub(super) fn field(file: &str, field: &str) -> Problem {
        Problem {
            field: Some(field.to_owned()),
            ..Problem::file(file)
        }
    }

    pub(super) fn line(self, line: u64) -> Problem {
        Problem {
            line: Some(line),
            ..self
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        if let Some(field) = &self.field {
            write!(f, ": `{field}`")?;
        }
        write!(f, ": {}", self.message)
    }
}

/// Everything that is wrong with a recording, in the order of its files and lines; never empty.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{} problems, the first: {}", .0.len(), .0.first().map(ToString::to_string).unwrap_or_default())]
pub struct Problems(pub Vec<Problem>);
