//! `plan check`: the verifier alone, on a plan file from anywhere.

use std::path::{Path, PathBuf};

use clap::Args;
use planner::plan::{FORMAT, Plan, Violation, ViolationKind};
use planner::verify::verify;
use serde_json::json;

use crate::io::answer::{Answer, Format, print};
use crate::io::failure::{Failure, tell};
use crate::io::files;
use crate::report::words::{ALPHA, count, joined, violation};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Plan to check
    #[arg(value_name = "PLAN.json")]
    plan: PathBuf,
    /// How to print what is found
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

/// Answers as the run did that wrote the plan: an unplanned drone is a no, a violation is a no.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let plan = read(&arguments.plan)?;
    let violations = verify(&plan).violations;
    print(&match arguments.format {
        Format::Json => files::json(&json!({
            "scenario": plan.scenario,
            "drones": plan.drones.len(),
            "unplanned": plan.unplanned.len(),
            "violations": violations,
        })),
        Format::Text => text(&plan, &violations),
    })?;
    let are_exposed = violations.iter().any(|it| it.kind == ViolationKind::Air);
    if are_exposed && arguments.format == Format::Text {
        tell(ALPHA);
    }
    let is_safe = violations.is_empty() && plan.unplanned.is_empty();
    Ok(Answer::from(is_safe))
}

fn text(plan: &Plan, violations: &[Violation]) -> String {
    let lines = violations.iter().map(|found| violation(found) + "\n");
    let stay = match plan.unplanned.len() {
        0 => String::new(),
        some => {
            let stay = count(some, "drone stays", "drones stay");
            format!(", {stay} at the start")
        }
    };
    format!(
        "{}{}: {}, {}{stay}\n",
        joined(lines, ""),
        plan.scenario,
        count(plan.drones.len(), "drone", "drones"),
        count(violations.len(), "violation", "violations")
    )
}

fn read(path: &Path) -> Result<Plan, Failure> {
    let text = files::text(path, files::MOST_BYTES).map_err(Failure::read(path))?;
    let not_a_plan = |reason: String| Failure::NotAPlan {
        path: path.to_owned(),
        reason,
    };
    let json = &mut serde_json::Deserializer::from_str(&text);
    let plan: Plan = serde_path_to_error::deserialize(json)
        .map_err(|error| not_a_plan(format!("`{}`: {}", error.path(), error.inner())))?;
    if plan.format != FORMAT {
        return Err(not_a_plan(format!(
            "`format` is \"{}\", this program reads \"{FORMAT}\"",
            plan.format
        )));
    }
    Ok(plan)
}
