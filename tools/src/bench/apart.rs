//! One instance in a process of its own: memory is counted for whole processes, and what one run
//! leaves behind (threads, tables, freed pages) is not there for the next.

use std::process::{Command, Stdio};

use super::instance::{Figures, Instance};

/// Plans an instance by this same program, as `bench --one`.
///
/// # Errors
/// What became of the process instead, in words.
pub fn plan(instance: &Instance) -> Result<Figures, String> {
    let program = std::env::current_exe().map_err(|error| format!("not run: {error}"))?;
    let output = Command::new(program)
        .args(["bench", instance.place.name(), "--one"])
        .args(["--drones", &instance.drones.to_string()])
        .args(["--seeds", &instance.seed.to_string()])
        .args(instance.options())
        .stdin(Stdio::null())
        .output()
        .map_err(|error| format!("not run: {error}"))?;
    serde_json::from_slice(&output.stdout).map_err(|_| {
        let said = String::from_utf8_lossy(&output.stderr);
        let last = said.lines().last().unwrap_or("without a word").trim();
        format!("ended with {}: {last}", output.status)
    })
}
