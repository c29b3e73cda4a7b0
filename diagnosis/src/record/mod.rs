//! What was recorded, and from the bytes of files to it.
//!
//! # In reading order
//!
//! [`recording`]: environment, vehicles, tracks, readings; plain data in SI units, world z up.
//! [`baseline`]: what "simulation" means for it. [`thrust_map`]: from duty cycle to thrust.
//! [`checked`]: numbers that a file cannot get wrong. [`track`]: where a vehicle was between two
//! entries. [`settled`]: where it was at each, without a tracker's noise. [`remark`] and
//! [`problem`]: what was noticed, and what keeps a file from being read.
//! [`read`]: one module a format.

pub mod baseline;
pub mod checked;
pub mod problem;
pub mod read;
pub mod recording;
pub mod remark;
pub mod settled;
pub mod thrust_map;
pub mod track;

/// What a recording describes its air and its drones by.
pub use airflow::{Air, Airframe, NoSuchAirframe, Superposition};
