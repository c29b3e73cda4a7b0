//! What the user wrote: a scenario in RON, read from text, with every error at its place; and the
//! [`world`] that it means.
//!
//! ```
//! let world = planner::read_world(r#"Scenario(
//!     name: "two",
//!     bounds_m: (min: (0, 0, 0), max: (30, 20, 8)),
//!     drones: [
//!         (name: "k1", airframe: "kolibri", start_m: (1, 1, 1), tasks: [(to_m: (20, 10, 3), dwell_s: 10)]),
//!         (name: "k2", airframe: "kolibri", start_m: (1, 9, 1), at_end: Land),
//!     ],
//! )"#)?;
//! assert_eq!(world.drones[0].tasks[0].dwell_s, 10.0);
//! assert_eq!(world.drones[1].air_limit, 0.3); // a default; `schema()` lists them all
//! # Ok::<(), planner::Problems>(())
//! ```

pub mod limits;
pub mod world;

pub(crate) mod placement;
pub(crate) mod solid;

mod airframes;
mod asked;
pub(crate) mod cell;
mod check;
mod fields;
mod finding_file;
mod fleet;
mod flown;
mod formations;
mod intended;
mod jet_file;
mod meaning;
mod mesh;
mod places;
mod problem;
mod read;
mod row_faults;
mod schema;
mod source;
mod tokens;
mod written;

pub use asked::{dwells, missing, missing_in_flight};
pub use check::WorldError;
pub use flown::{FlownError, Samples, read_samples, samples_as_plan};
pub use intended::{DroneFault, Intended, IntendedError, intended_as_plan};
pub use placement::{Misfit, Misplaced, Spot};
pub use problem::{Cited, Problem, Problems};
pub use row_faults::RowFaults;
pub use schema::schema;
pub use source::with_setting;

use crate::scenario::world::World;

/// The files that a scenario may cite: meshes, a calibrated jet, a finding. Libraries read none
/// themselves.
#[derive(Clone, Copy)]
pub struct Files<'a> {
    /// The text of a file by its path, or why it cannot be had.
    read: &'a dyn Fn(&str) -> Result<String, String>,
    /// Takes the place of the finding that the scenario cites.
    finding: Option<&'a str>,
}

impl<'a> Files<'a> {
    /// `read` gives the text of a file by the path that the scenario writes, or says why it cannot.
    pub fn new(read: &'a dyn Fn(&str) -> Result<String, String>) -> Files<'a> {
        Files {
            read,
            finding: None,
        }
    }

    /// The fleet flies through this finding instead of the one that the scenario cites; its text is
    /// asked for by this name.
    #[must_use]
    pub fn with_finding(self, file: &'a str) -> Files<'a> {
        Files {
            finding: Some(file),
            ..self
        }
    }

    /// The text of a cited file.
    fn text(&self, file: &str) -> Result<String, String> {
        (self.read)(file)
    }
}

/// Reads a scenario that cites no files, and what it means.
///
/// # Errors
/// Everything that is wrong, in the order of the text: a drone in an obstacle beside a misspelt
/// key.
pub fn read_world(text: &str) -> Result<World, Problems> {
    let none = |file: &str| Err(format!("`{file}` was not given"));
    read_world_with(text, &Files::new(&none))
}

/// The same for a scenario that cites files.
///
/// # Errors
/// Everything that is wrong, in the order of the text; then what is wrong in the cited files.
pub fn read_world_with(text: &str, files: &Files<'_>) -> Result<World, Problems> {
    let read::Reading {
        written,
        spoilt_airframes,
        mut problems,
    } = read::read(text);
    if let Some(written) = written {
        let (world, more) = meaning::world(&written, &spoilt_airframes, files);
        problems.extend(more);
        if problems.is_empty() {
            return Ok(world);
        }
    }
    problems.sort_by_key(|problem| {
        let span = problem.span.as_ref();
        let (start, end) = span.map_or((usize::MAX, 0), |span| (span.start, span.end));
        (problem.cited.is_some(), start, end)
    });
    Err(Problems(problems))
}
