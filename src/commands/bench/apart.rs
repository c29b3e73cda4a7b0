//! One instance in a process of its own: memory is counted for whole processes, and what one run leaves
//! behind (threads, tables, freed pages) is not there for the next.

use std::process::{Command, Stdio};

use super::one::{Figures, One};

/// The figures, or what became of the process instead.
pub(super) fn plan(one: &One) -> Result<Figures, String> {
    let program = std::env::current_exe().map_err(|error| format!("not run: {error}"))?;
    let output = Command::new(program)
        .args(arguments(one))
        .stdin(Stdio::null())
        .output()
        .map_err(|error| format!("not run: {error}"))?;
    serde_json::from_slice(&output.stdout).map_err(|_| {
        let said = String::from_utf8_lossy(&output.stderr);
        let last = said.lines().last().unwrap_or("without a word").trim();
        format!("ended with {}: {last}", output.status)
    })
}

fn arguments(one: &One) -> Vec<String> {
    let mut words = vec!["bench".to_owned(), one.place.word().to_owned()];
    words.extend(["--one".to_owned(), format!("--drones={}", one.drones)]);
    words.push(format!("--seeds={}", one.seed));
    if let Some(limit) = one.time_limit {
        words.push(format!("--time-limit={}", limit.as_secs_f64()));
    }
    if let Some(jobs) = one.jobs {
        words.push(format!("--jobs={jobs}"));
    }
    if !one.contrast {
        words.push("--without-contrast".to_owned());
    }
    words
}
