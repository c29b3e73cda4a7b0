//! The file of a calibrated jet: its constants, and what it says of their making.

use airflow::Jet;

use super::fields::{Field, Reader, cited, within};
use super::limits::{ANY, CENTRELINE, ORIGIN, SPREADING};
use super::problem::Problem;
use super::source::Value;
use super::written::At;

/// Reads the cited file: its constants, in range, and what a reader of the plan should know of it.
///
/// # Errors
/// Everything that is wrong with it, each at its place in it; at the citation, where it cannot be
/// had at all.
pub(super) fn read(
    citation: &At<String>,
    files: &super::Files<'_>,
) -> Result<(Jet, Vec<String>), Vec<Problem>> {
    let file = &citation.value;
    let text = files.text(file).map_err(|why| {
        let problem = Problem::at(&citation.at, "the jet of `air` cannot be used").label(why);
        vec![
            problem.help("`plan calibrate` writes such a file; without `jet` the paper's is flown"),
        ]
    })?;
    cited(file, &text, |reader, value| jet(reader, value, file))
}

/// The jet in a text that is RON; all other keys are checked, and change nothing.
fn jet<'t>(reader: &mut Reader<'t>, value: Value<'t>, file: &str) -> Option<(Jet, Vec<String>)> {
    let mut record = reader.record(value, "Jet", "the jet".to_owned())?;
    let centreline = record.required(reader, "centreline", within(&CENTRELINE));
    let spreading = record.required(reader, "spreading", within(&SPREADING));
    let origin = record.required(reader, "origin", within(&ORIGIN));
    // What follows says where the constants come from; it is checked, and does not change the flow.
    for (key, count) in [
        ("centreline_95", (2, "2 numbers")),
        ("spreading_95", (2, "2 numbers")),
        ("origin_95", (2, "2 numbers")),
        ("centreline_95_if_one_gain", (2, "2 numbers")),
        ("correlation", (3, "3 numbers")),
    ] {
        record.optional(reader, key, |reader, field| {
            reader.numbers(field, count, &ANY);
            Some(())
        });
    }
    for key in ["readings", "cells", "flights"] {
        record.optional(reader, key, within(&ANY));
    }
    record.optional(reader, "recordings", |reader, field| {
        for value in reader.items(field)? {
            reader.text(Field { value, ..field });
        }
        Some(())
    });
    let doubt = record.optional(reader, "fit", |reader, field| {
        let choices = [
            ("Fits", None),
            ("Poor", Some("fits what it was calibrated on poorly")),
            (
                "Undecided",
                Some("was calibrated on too few flights to say whether it fits"),
            ),
        ];
        reader.word(field, &choices)
    });
    record.close(reader);
    let jet = Jet {
        centreline: centreline?,
        spreading: spreading?,
        origin: origin?,
    };
    let note = |doubt| format!("the jet of {file} {doubt}");
    Some((jet, doubt.flatten().map(note).into_iter().collect()))
}
