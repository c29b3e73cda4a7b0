//! Recordings of a world made up here: its jet is written anew and shares no code with `airflow`, so that a calibration that
//! recovers it has not merely inverted itself.
//!
//! ```
//! use diagnosis::made_up::{HoverGrid, TrueProfile};
//!
//! let flight = HoverGrid::over_one_probe("kolibri").expect("one of the paper's drones").fly(1);
//! assert!(flight.probes.is_some_and(|probes| probes.samples.len() > 300));
//! let mut other_shape = HoverGrid::over_one_probe("offboard-2").expect("one of the paper's drones");
//! other_shape.jet.profile = TrueProfile::Gaussian; // not what the paper's jet can be fitted to
//! ```

mod flight;
mod folder;
mod hover_grid;
mod true_jet;

pub use folder::texts;
pub use hover_grid::HoverGrid;
pub use true_jet::{TrueJet, TrueProfile};
