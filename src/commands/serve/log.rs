//! Lines on standard error: words for people, or one JSON object each.

use std::fmt::Display;
use std::time::{SystemTime, UNIX_EPOCH};

use clap::ValueEnum;
use serde_json::{Map, Value};

use crate::io::failure::{Failure, tell};

/// How lines are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Style {
    /// For people
    Text,
    /// One JSON object a line: `event`, `unix_s` (when, s), and what belongs to it
    Json,
}

/// Where lines go.
#[derive(Clone, Copy, Debug)]
pub(super) struct Log {
    style: Style,
}

impl Log {
    pub(super) fn new(style: Style) -> Log {
        Log { style }
    }

    /// One line: words, or an event with its fields.
    pub(super) fn tell(self, words: impl Display, event: &str, fields: &[(&str, Value)]) {
        match self.style {
            Style::Text => tell(&words.to_string()),
            Style::Json => tell(&object(event, fields)),
        }
    }

    /// What ends the process, as it is to be printed.
    pub(super) fn failure(self, failure: Failure) -> Failure {
        match self.style {
            Style::Text => failure,
            Style::Json => {
                let text = anstream::adapter::strip_str(&failure.to_string()).to_string();
                Failure::Drawn(object("failed", &[("error", text.into())]))
            }
        }
    }
}

fn object(event: &str, fields: &[(&str, Value)]) -> String {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let unix_s = now.map_or(0.0, |it| it.as_millis() as f64 / 1000.0);
    let first = [("event", Value::from(event)), ("unix_s", unix_s.into())];
    let all = first.iter().chain(fields);
    let all: Map<String, Value> = all
        .map(|(name, value)| ((*name).to_owned(), value.clone()))
        .collect();
    Value::Object(all).to_string()
}
