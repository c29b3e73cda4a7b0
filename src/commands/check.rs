//! `plan check`: the verifier alone, on a plan file from anywhere.

use std::path::{Path, PathBuf};

use clap::Args;
use planner::plan::{FORMAT, Plan, Violation};
use planner::verify::verify;
use serde::Serialize;

use crate::io::failure::{Failure, answer};
use crate::io::files;
use crate::report::words::{count, violation};
use crate::{Answer, Format};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Plan to check
    #[arg(value_name = "PLAN.json")]
    plan: PathBuf,
    /// How to print what is found
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

/// What `--format json` prints.
#[derive(Serialize)]
struct CheckEntry<'a> {
    scenario: &'a str,
    drones: usize,
    unplanned: usize,
    violations: &'a [Violation],
}

/// Answers as the run did that wrote the plan: an unplanned drone is a no, a violation is a no.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let plan = read(&arguments.plan)?;
    let violations = verify(&plan).violations;
    let entry = CheckEntry {
        scenario: &plan.scenario,
        drones: plan.drones.len(),
        unplanned: plan.unplanned.len(),
        violations: &violations,
    };
    answer(&match arguments.format {
        Format::Json => files::json(&entry),
        Format::Text => text(&entry),
    })?;
    Ok(Answer::from(
        violations.is_empty() && plan.unplanned.is_empty(),
    ))
}

fn text(entry: &CheckEntry) -> String {
    let mut text = String::new();
    for found in entry.violations {
        text += &format!("{}\n", violation(found));
    }
    text += &format!(
        "{}: {}, {}",
        entry.scenario,
        count(entry.drones, "drone", "drones"),
        count(entry.violations.len(), "violation", "violations")
    );
    if entry.unplanned > 0 {
        text += &format!(
            ", {} at the start",
            count(entry.unplanned, "drone stays", "drones stay")
        );
    }
    text + "\n"
}

fn read(path: &Path) -> Result<Plan, Failure> {
    let text = std::fs::read_to_string(path).map_err(Failure::read(path))?;
    let not_a_plan = |reason: String| Failure::NotAPlan {
        path: path.to_owned(),
        reason,
    };
    let parsed: Result<Plan, _> =
        serde_path_to_error::deserialize(&mut serde_json::Deserializer::from_str(&text));
    let plan =
        parsed.map_err(|error| not_a_plan(format!("`{}`: {}", error.path(), error.inner())))?;
    if plan.format != FORMAT {
        return Err(not_a_plan(format!(
            "`format` is \"{}\", this program reads \"{FORMAT}\"",
            plan.format
        )));
    }
    Ok(plan)
}
