//! What the user wrote: a scenario in RON, read from text, with every error at its place.
//!
//! ```
//! let text = r#"Scenario(
//!     name: "two",
//!     bounds_m: (min: (0, 0, 0), max: (30, 20, 8)),
//!     drones: [
//!         (name: "k1", airframe: "kolibri", start_m: (1, 1, 1), tasks: [(to_m: (20, 10, 3), dwell_s: 10)]),
//!         (name: "k2", airframe: "kolibri", start_m: (1, 9, 1), at_end: Land),
//!     ],
//! )"#;
//! let world = planner::scenario::read_world(text, &|file| Err(format!("there is no {file}"))).unwrap();
//! assert_eq!(world.drones[0].tasks[0].dwell_s, 10.0);
//! assert_eq!(world.drones[1].air_limit, 0.3); // a default; `schema()` lists them all
//! ```

pub mod placement;
pub mod solid;
pub mod world;

mod airframes;
mod fields;
mod finding_file;
mod jet_file;
mod limits;
mod meaning;
mod mesh;
mod misplacement;
mod places;
mod problem;
mod read;
mod schema;
mod source;
mod tokens;
mod written;

pub use meaning::Files;
pub use problem::{Cited, Problem};
pub use schema::schema;

use crate::scenario::world::World;

/// A scenario whose text is in order: every key known, every number in range, every name unique.
/// Its airframes, files and places have still to be looked up: [`Scenario::into_world`].
#[derive(Clone, Debug)]
pub struct Scenario(written::Written);

/// Reads a scenario.
///
/// # Errors
/// Everything that is wrong with the text, in its order.
pub fn parse(text: &str) -> Result<Scenario, Vec<Problem>> {
    let read::Reading {
        written, problems, ..
    } = read::read(text);
    match written {
        Some(written) if problems.is_empty() => Ok(Scenario(written)),
        _ => Err(in_order(problems)),
    }
}

/// Reads a scenario and what it means, in one go: a drone in an obstacle is reported beside a misspelt key.
///
/// # Errors
/// Everything that is wrong, in the order of the text.
pub fn read_world(text: &str, files: &Files<'_>) -> Result<World, Vec<Problem>> {
    read_world_flying(text, None, files)
}

/// The same, flown through another finding than the scenario cites: the text of `finding` is asked of `files` by that name.
///
/// # Errors
/// Everything that is wrong, in the order of the text.
pub fn read_world_flying(
    text: &str,
    finding: Option<&str>,
    files: &Files<'_>,
) -> Result<World, Vec<Problem>> {
    let read::Reading {
        written,
        spoilt_airframes,
        mut problems,
    } = read::read(text);
    let Some(written) = written else {
        return Err(in_order(problems));
    };
    let (world, more) = meaning::world(&written, &spoilt_airframes, finding, files);
    problems.extend(more);
    if problems.is_empty() {
        Ok(world)
    } else {
        Err(in_order(problems))
    }
}

impl Scenario {
    /// The mesh files that it wants, as it names them, each once.
    pub fn meshes(&self) -> Vec<&str> {
        let mut files: Vec<&str> = Vec::new();
        for file in self
            .0
            .obstacles
            .iter()
            .filter_map(|obstacle| obstacle.mesh.as_ref())
        {
            if !files.contains(&file.value.as_str()) {
                files.push(&file.value);
            }
        }
        files
    }

    /// The file of the jet that it cites, if it cites one.
    pub fn jet(&self) -> Option<&str> {
        self.0.air.jet.as_ref().map(|file| file.value.as_str())
    }

    /// The file of the finding that it cites, if it cites one.
    pub fn finding(&self) -> Option<&str> {
        self.0.air.finding.as_ref().map(|file| file.value.as_str())
    }

    /// Looks up airframes, meshes, the jet and the finding, and checks every place against bounds and obstacles.
    ///
    /// # Errors
    /// Everything that is wrong, in the order of the text.
    pub fn into_world(self, files: &Files<'_>) -> Result<World, Vec<Problem>> {
        let (world, problems) = meaning::world(&self.0, &[], None, files);
        if problems.is_empty() {
            Ok(world)
        } else {
            Err(in_order(problems))
        }
    }
}

fn in_order(mut problems: Vec<Problem>) -> Vec<Problem> {
    // The scenario's own first, then those of a file that it cites.
    problems.sort_by_key(|problem| {
        let (start, end) = problem
            .span
            .as_ref()
            .map_or((usize::MAX, 0), |span| (span.start, span.end));
        (problem.cited.is_some(), start, end)
    });
    problems
}
