//! One file for each subcommand: its arguments, what it asks the libraries, and its answer.

pub(crate) mod air;
mod answers;
mod applied;
mod battery;
pub(crate) mod bench;
pub(crate) mod calibrate;
pub(crate) mod check;
pub(crate) mod compare;
pub(crate) mod diagnose;
pub(crate) mod explain;
pub(crate) mod export;
pub(crate) mod fly;
pub(crate) mod generate;
pub(crate) mod plan;
pub(crate) mod prove;
mod recordings;
pub(crate) mod schema;
pub(crate) mod separation;
pub(crate) mod serve;
pub(crate) mod simulate;
pub(crate) mod soak;
pub(crate) mod sweep;

use std::ops::RangeInclusive;

use clap::builder::{PossibleValuesParser, TypedValueParser};

/// Takes one of these values by its name.
fn by_name<T: Copy + Send + Sync + 'static>(
    all: &'static [T],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let names = PossibleValuesParser::new(all.iter().map(move |one| name(*one)));
    names.map(move |given| {
        let found = all.iter().find(|one| name(**one) == given);
        *found.expect("clap lets no other name pass")
    })
}

/// The lowest of a [`number`] that has to be above 0.
const ABOVE_0: f64 = f64::MIN_POSITIVE;

/// Takes a number within a range, which messages tell with its unit.
fn number(range: RangeInclusive<f64>, unit: &'static str) -> impl TypedValueParser<Value = f64> {
    move |text: &str| {
        let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
        let (low, high) = (*range.start(), *range.end());
        let told = match (range.contains(&value), low == ABOVE_0) {
            (true, _) => return Ok(value),
            (_, true) => format!("must be above 0 and at most {high} {unit}"),
            (_, false) => format!("must be from {low} to {high} {unit}"),
        };
        Err(told.trim_end().to_owned())
    }
}
