//! Recordings of real flights against the model of the air: what it would have measured, how far
//! off it is, and what its parameters would have to be.
//!
//! A caller hands in the bytes of files; nothing here opens one.
//!
//! # In reading order
//!
//! - [`statistics`]: tests, folds, trees and intervals on plain numbers.
//! - [`record`]: what was recorded, what "simulation" means for it, and from bytes to it.
//! - [`thrust`]: from duty cycles to thrust, identified in free flight.
//! - [`forward`]: the air that the baseline makes, what a probe and a drone make of it, what would
//!   have been recorded, how far off that is; vertical forces and the clocks of the logs.
//! - [`calibrate`]: the constants of the jet that fit best.
//! - [`infer`]: which effect is missing in one recording: candidates, fits, selection, the finding.
//! - [`campaign`]: the forces of many flights together, and one drone's motors against its own
//!   normal flights.
//!
//! Each imports from those above it only. The crate `validation` makes synthetic recordings to try
//! all of it on.

pub mod calibrate;
pub mod campaign;
pub mod forward;
pub mod infer;
pub mod record;
pub mod statistics;
pub mod thrust;
