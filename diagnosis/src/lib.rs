//! Recordings of real flights against the model of the air: what it would have measured, how far off it is, and what its
//! parameters would have to be.
//!
//! A caller hands in the bytes of files; nothing here opens one.
//!
//! # In reading order
//!
//! [`recording`]: what was recorded. [`baseline`]: what "simulation" means for it. [`remark`] and [`problem`]: what was noticed,
//! what keeps it from being read. [`thrust_map`]: from duty cycle to thrust. [`simulate`]: what would have been recorded.

pub mod baseline;
pub mod calibrate;
pub mod made_up;
pub mod problem;
mod random;
pub mod recording;
pub mod remark;
pub mod simulate;
pub mod thrust_map;
