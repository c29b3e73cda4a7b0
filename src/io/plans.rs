//! Plans from files: plan.json, and logs of flights with their airframes.

use std::path::Path;

use planner::plan::file::{self, PlanFile};
use planner::scenario::{FlownError, read_samples, samples_as_plan};

use super::failure::Failure;
use super::files::{self, MOST_SCENARIO_BYTES};
use super::problems;

/// A plan, or a log with its airframes.
pub(crate) fn read(path: &Path, airframes: Option<&Path>) -> Result<PlanFile, Failure> {
    let text = |path: &Path| files::text(path, files::MOST_BYTES).map_err(Failure::read(path));
    let log = text(path)?;
    let is_table = path
        .extension()
        .is_some_and(|it| it.eq_ignore_ascii_case("csv"));
    let not_a_plan = |reason: String| Failure::NotAPlan {
        path: path.to_owned(),
        reason,
    };
    let Some(fleet_path) = airframes else {
        if is_table {
            let why = "a log says nothing of airframes: name them with --airframes FLEET.ron";
            return Err(not_a_plan(why.to_owned()));
        }
        return file::read(&log).map_err(|reason| not_a_plan(reason.to_string()));
    };
    let fleet = text(fleet_path)?;
    let folder = fleet_path.parent().unwrap_or(Path::new(""));
    let load = |file: &str| {
        files::text(&folder.join(file), MOST_SCENARIO_BYTES).map_err(|it| it.to_string())
    };
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let samples = read_samples(&log);
    let plan = samples
        .and_then(|samples| samples_as_plan(&name, &samples, &fleet, &planner::Files::new(&load)));
    plan.map_err(|error| match error {
        FlownError::Fleet(found) => {
            let name = fleet_path.display().to_string();
            let colour = problems::colour_on_stderr();
            Failure::Drawn(problems::draw(&found, &name, &fleet, colour))
        }
        other => not_a_plan(other.to_string()),
    })
}
