//! The file of a calibrated jet: its constants, and what it says of their making.

use airflow::Jet;

use super::fields::{Field, Reader, cited};
use super::limits::{ANY, CENTRELINE, Limits, ORIGIN, SPREADING};
use super::problem::Problem;
use super::source::root;
use super::written::At;

/// A jet that a scenario cites.
pub(super) struct CitedJet {
    pub(super) jet: Jet,
    /// What a reader of the plan should know of it.
    pub(super) note: Option<String>,
}

#[derive(Clone, Copy, PartialEq)]
enum Fit {
    Fits,
    Poor,
    Undecided,
}

/// Reads the cited file.
///
/// # Errors
/// Everything that is wrong with it, each at its place in it; at the citation, where it cannot be
/// had at all.
pub(super) fn read(
    citation: &At<String>,
    files: &super::Files<'_>,
) -> Result<CitedJet, Vec<Problem>> {
    let file = &citation.value;
    let text = files.text(file).map_err(|why| {
        let problem = Problem::at(&citation.at, "the jet of `air` cannot be used").label(why);
        vec![
            problem.help("`plan calibrate` writes such a file; without `jet` the paper's is flown"),
        ]
    })?;
    cited(file, &text, |reader| jet(reader, file))
}

fn jet(reader: &mut Reader<'_>, file: &str) -> Option<CitedJet> {
    let value = root(reader.text).ok()?;
    let mut record = reader.record(value, "Jet", "the jet".to_owned())?;
    let mut constants = [None; 3];
    for (constant, (key, limits)) in constants.iter_mut().zip([
        ("centreline", &CENTRELINE),
        ("spreading", &SPREADING),
        ("origin", &ORIGIN),
    ]) {
        *constant = record
            .required(key)
            .and_then(|field| reader.number(field, limits))
            .map(|read| read.value);
    }
    // What follows says where the constants come from; it is checked, and does not change the flow.
    for key in [
        "centreline_95",
        "spreading_95",
        "origin_95",
        "centreline_95_if_one_gain",
    ] {
        if let Some(field) = record.optional(key) {
            numbers(reader, field, 2, &ANY);
        }
    }
    if let Some(field) = record.optional("correlation") {
        numbers(reader, field, 3, &ANY);
    }
    for key in ["readings", "cells", "flights"] {
        if let Some(field) = record.optional(key) {
            reader.number(field, &ANY);
        }
    }
    if let Some(field) = record.optional("recordings") {
        let who = field.who;
        for value in reader.items(field).unwrap_or_default() {
            let key = "recordings";
            reader.text(Field { value, key, who });
        }
    }
    let choices = [
        ("Fits", Fit::Fits),
        ("Poor", Fit::Poor),
        ("Undecided", Fit::Undecided),
    ];
    let fit = record
        .optional("fit")
        .and_then(|field| reader.word(field, &choices));
    record.close(reader);
    let [centreline, spreading, origin] = constants;
    let jet = Jet {
        centreline: centreline?,
        spreading: spreading?,
        origin: origin?,
    };
    let doubt = match fit.map(|fit| fit.value) {
        Some(Fit::Poor) => "fits what it was calibrated on poorly",
        Some(Fit::Undecided) => "was calibrated on too few flights to say whether it fits",
        Some(Fit::Fits) | None => "",
    };
    Some(CitedJet {
        jet,
        note: (!doubt.is_empty()).then(|| format!("the jet of {file} {doubt}")),
    })
}

/// As many numbers in round brackets.
fn numbers<'t>(reader: &mut Reader<'t>, field: Field<'_, 't>, count: usize, limits: &Limits) {
    let Field { value, key, who } = field;
    let items = value.tuple().filter(|_| value.text.starts_with('('));
    match items {
        Some(items) if items.len() == count => {
            for value in items {
                reader.number(Field { value, key, who }, limits);
            }
        }
        _ => reader.report(
            Problem::at(
                &value.head(),
                format!("`{key}` of {who} must be {count} numbers"),
            )
            .label("in round brackets, commas between them"),
        ),
    }
}
