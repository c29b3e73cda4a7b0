//! `plan schema`: the scenario format as a JSON schema, with every default and every preset.

use crate::io::answer::{Answer, print};
use crate::io::failure::Failure;
use crate::io::files;

/// Prints one JSON object. `defaults` and `presets` come first, for readers; the rest is the schema
/// itself, for editors.
pub(crate) fn run() -> Result<Answer, Failure> {
    print(&files::json_pretty(&planner::scenario::schema()))?;
    Ok(Answer::Yes)
}
