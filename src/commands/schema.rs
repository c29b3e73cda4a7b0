//! `plan schema`: the formats as JSON schemas, a scenario's with every default and every preset.

use clap::{Args, ValueEnum};

use crate::io::answer::{Answer, print};
use crate::io::failure::Failure;
use crate::io::files;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Which format
    #[arg(value_enum, default_value_t = Which::Scenario)]
    of: Which,
}

/// A format that has a schema.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Which {
    /// What `plan` reads (RON)
    #[default]
    Scenario,
    /// What `plan` writes and `plan check` reads (plan.json)
    Plan,
    /// What `plan fly` writes (flight.json)
    Flight,
    /// What `plan serve` takes, answers and keeps: messages, answers, records of a journal
    Serve,
}

/// Prints one JSON object. Of a scenario `defaults` and `presets` come first, for readers; the rest
/// is the schema itself, for editors.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    print(&files::json_pretty(&match arguments.of {
        Which::Scenario => planner::scenario::schema(),
        Which::Plan => planner::plan::file::schema(),
        Which::Flight => flight::report::schema(),
        Which::Serve => service::message::schema(),
    }))?;
    Ok(Answer::Yes)
}
