//! Recordings of real flights against the model of the air: what it would have measured, how far off it is, and what its
//! parameters would have to be.
//!
//! A caller hands in the bytes of files; nothing here opens one.
//!
//! # In reading order
//!
//! [`recording`]: what was recorded. [`baseline`]: what "simulation" means for it. [`remark`] and [`problem`]: what was noticed,
//! what keeps it from being read. [`thrust_map`]: from duty cycle to thrust. [`track`]: between two entries. [`flow`]: the air that
//! the baseline makes. [`anemometer`] and [`receiver`]: what a probe and a drone make of it. [`simulate`]: what would have been
//! recorded. [`residuals`]: how far off that is, and where. [`statistics`]: what of it is signal, on plain numbers.

pub mod anemometer;
pub mod baseline;
pub mod flow;
pub mod problem;
pub mod receiver;
pub mod recording;
pub mod remark;
pub mod residuals;
pub mod simulate;
pub mod statistics;
pub mod thrust_map;
pub mod track;
