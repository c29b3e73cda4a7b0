//! The package's exceptions, from what the crates refuse.

use diagnosis::record::problem::Problem;
use planner::plan::file::NotAPlan;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use serde_json::{Value, json};

/// An exception of the package by its name, with a message and its entries as data.
pub(crate) fn refused(py: Python<'_>, class: &str, message: &str, entries: &[Value]) -> PyErr {
    let entries = Value::from(entries.to_vec()).to_string();
    let made = py
        .import("leeward._errors")
        .and_then(|module| module.getattr("made"))
        .and_then(|made| made.call1((class, message, entries)));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// What is wrong with a scenario, each at its line and column, from 1.
pub(crate) fn scenario(
    py: Python<'_>,
    (name, text): (&str, &str),
    problems: &planner::Problems,
) -> PyErr {
    let entry = |problem: &planner::scenario::Problem| {
        let cited = problem.cited.as_deref();
        let file = cited.map_or(name, |it| it.file.as_str());
        let place = problem.line_column(text);
        json!({
            "message": problem.message,
            "file": file,
            "line": place.map(|(line, _)| line),
            "column": place.map(|(_, column)| column),
            "label": problem.label,
            "notes": problem.notes,
            "help": problem.help,
        })
    };
    let entries: Vec<Value> = problems.iter().map(entry).collect();
    refused(py, "ScenarioError", &problems.to_string(), &entries)
}

/// Why the text of a file, where it is of one, is no plan: its fields, the first at its line and
/// column, from 1.
pub(crate) fn no_plan(py: Python<'_>, file: Option<&str>, why: &NotAPlan) -> PyErr {
    let entry = |message: String, place: Option<(usize, usize)>| {
        json!({
            "message": message,
            "file": file,
            "line": place.map(|(line, _)| line),
            "column": place.map(|(_, column)| column),
        })
    };
    let entries: Vec<Value> = match why {
        NotAPlan::Fields {
            faults,
            line,
            column,
        } => {
            let told = faults.iter().enumerate().map(|(k, it)| {
                let at = (k == 0).then_some((*line, *column));
                entry(format!("`{}`: {}", it.place, it.what), at)
            });
            told.collect()
        }
        other => vec![entry(other.to_string(), None)],
    };
    let named = file.map_or(String::new(), |file| format!("{file}: "));
    refused(py, "PlanError", &format!("{named}{why}"), &entries)
}

/// What is wrong with recordings, each at its file and line.
pub(crate) fn recording(py: Python<'_>, message: &str, problems: &[Problem]) -> PyErr {
    let entry = |problem: &Problem| {
        json!({
            "message": problem.message,
            "file": problem.file,
            "line": problem.line,
            "column": problem.field,
            "label": null,
            "notes": [],
            "help": problem.help,
        })
    };
    let entries: Vec<Value> = problems.iter().map(entry).collect();
    refused(py, "RecordingError", message, &entries)
}

/// An exception of the package that is one sentence.
pub(crate) fn sentence(py: Python<'_>, class: &str, message: impl ToString) -> PyErr {
    refused(py, class, &message.to_string(), &[])
}

/// What can only go wrong by a fault of this package.
pub(crate) fn fault(message: impl ToString) -> PyErr {
    PyRuntimeError::new_err(format!("a fault of leeward: {}", message.to_string()))
}

/// Plain data as JSON text.
pub(crate) fn json_text(value: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(fault)
}
