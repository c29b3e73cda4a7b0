//! From recordings to the three constants of the jet, with honest intervals: the paper's own path, through an explicit
//! observation operator.
//!
//! # In reading order
//!
//! `samples`: readings beside the state of the drone that blew. `cells`: their medians per grid cell. `operator`: what a probe
//! reads of a jet. `joint`: the three constants that fit best. `units` and `intervals`: how far to trust them. `goodness`: whether
//! one jet describes it all, and where not. `profiles`, `lobes` and `residual_tests`: the paper's figures and its table.
//!
//! # How good the intervals are
//!
//! Measured (`cargo bench -p leeward-validation --bench coverage`) on synthetic flights of the paper's four drones without cant, 1000 repeats: with four flights a
//! drone the intervals of `B`, `S` and `s₀` hold the truth in 94.6, 95.4 and 94.8 % of cases, and 1 % of the fits are called poor. A
//! plain percentile bootstrap by flight, tried beside, held it in 90.4, 91.2 and 91.3 %, which is why it is not used. With one
//! flight a drone (blocks of time, 300 repeats): 96.0, 96.3 and 96.0 %. Of 600 campaigns in a jet of another shape (Gaussian,
//! Gaussian tail, top hat) all 600 are called poor.

mod calibration;
mod cells;
mod curve;
mod goodness;
mod intervals;
mod jet_file;
mod joint;
mod lobes;
mod operator;
mod options;
mod profiles;
mod residual_tests;
mod run;
mod samples;
mod units;

pub use calibration::*;
pub use jet_file::jet_ron;
pub use options::Options;
pub use run::{CalibrateError, calibrate};
