//! What the project promises, through its public face and its commands; modules by promise.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod boundaries;
mod bounded;
mod calibration;
mod commands;
mod diagnosis;
mod docs;
mod endpoints;
mod exports;
mod findings;
mod flying;
mod fuzz;
mod hover;
mod imports;
mod instances;
mod mutations;
mod near_field;
#[cfg(feature = "long")]
mod neural_swarm;
mod page;
mod paper;
mod planner;
#[cfg(feature = "long")]
mod practice_set;
mod questions;
mod random_worlds;
mod readme;
#[cfg(feature = "long")]
mod real_flights;
mod receivers;
mod recordings;
mod recordings_commands;
mod scaling;
mod scenario;
mod scenarios;
mod serve;
mod swarm;
mod verifier;
mod volumes;
mod wakes;

use std::path::{Path, PathBuf};
use std::process::Command;

use ::planner::World;
use ::planner::scenario::world::{PathMotion, Relaxable};

/// How many samples: the second with the feature `long`, for which a machine has half an hour.
const fn samples<T: Copy>(short: T, long: T) -> T {
    if cfg!(feature = "long") { long } else { short }
}

/// A world whose plans are straight, with quasi-static wakes.
fn straight_and_quasi_static(mut world: World) -> World {
    world.convection = None;
    world.planning.motion = PathMotion::Straight;
    world.planning.relaxable = Relaxable::default();
    world
}

/// The command in a folder: exit code, what it printed, what it said of errors and notes.
fn run(folder: &Path, arguments: &str) -> (Option<i32>, String, String) {
    let words: Vec<&str> = arguments.split(' ').collect();
    run_words(folder, &words)
}

/// The same with arguments that may have spaces in them.
fn run_words(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_plan"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (
        output.status.code(),
        text(output.stdout),
        text(output.stderr),
    )
}

/// A set of recordings that do not ship; what needs it is ignored where `build.rs` did not find it.
fn shared(set: &str) -> PathBuf {
    let folder: Option<&str> = option_env!("SHARED_RECORDINGS");
    let folder = folder.expect("asked only where recordings were found");
    PathBuf::from(folder).join(set)
}

/// Runs a command, which must exit with 0.
fn succeeds(command: &mut Command) {
    let output = command.output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
}
