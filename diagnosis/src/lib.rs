//! Recordings of real flights against the model of the air: what it would have measured, how far
//! off it is, and what its parameters would have to be.
//!
//! A caller hands in the bytes of files; nothing here opens one.
//!
//! # In reading order
//!
//! [`record`]: what was recorded, what "simulation" means for it, and from bytes to it.
//! [`forward`]: the air that the baseline makes, what a probe and a drone make of it, what would
//! have been recorded, and how far off that is. [`thrust`]: from duty cycle to thrust, and how far
//! apart the logs' clocks are. [`calibrate`]: the constants of the jet that fit best.
//! [`statistics`] and [`infer`]: which effect is missing. [`campaign`]: many flights together.
//! [`made_up`] and [`prove`]: recordings of a world made up here, to try all of it on.

pub mod calibrate;
pub mod campaign;
pub mod forward;
pub mod infer;
pub mod record;
pub mod statistics;
pub mod thrust;
