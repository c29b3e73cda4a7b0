//! From recordings to the three constants of the jet, with intervals that cover:
//! the paper's own path, through an explicit observation operator.
//!
//! # In reading order
//!
//! `samples`: readings beside the state of the drone above, and their medians per grid cell.
//! `jet_fit`: what a probe reads of a jet, and the three constants that fit best. `spread`: how far
//! to trust them. `goodness`: whether one jet describes it all, and where not. `profiles` and
//! `residual_tests`: the paper's figures and its table. `assemble`: all of it, from recordings to a
//! `calibration`.
//!
//! # How good the intervals are
//!
//! Measured (`cargo bench -p leeward-validation --bench coverage`) on synthetic flights of the
//! paper's four drones without cant, 1000 repeats: with four flights a drone the intervals of `B`,
//! `S` and `s₀` hold the truth in 94.6, 95.4 and 94.8 % of cases, and 1 % of the fits are called
//! poor. A plain percentile bootstrap by flight, tried beside, held it in 90.4, 91.2 and 91.3 %,
//! which is why it is not used. With one flight a drone (blocks of time, 300 repeats): 96.0, 96.3
//! and 96.0 %. Of 600 campaigns in a jet of another shape (Gaussian, Gaussian tail, top hat) all
//! 600 are called poor.

mod assemble;
mod calibration;
mod goodness;
mod jet_fit;
mod profiles;
mod residual_tests;
mod samples;
mod spread;

pub use assemble::{CalibrateError, calibrate};
pub use calibration::*;

/// Of calibration.json.
pub const FORMAT: &str = "calibration/1";
