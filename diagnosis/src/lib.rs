//! Recordings of real flights against the model of the air: what it would have measured, how far off it is, and what its
//! parameters would have to be.
//!
//! A caller hands in the bytes of files; nothing here opens one.
//!
//! # In reading order
//!
//! [`recording`]: what was recorded. [`baseline`]: what "simulation" means for it. [`remark`] and [`problem`]: what was noticed,
//! what keeps it from being read. [`read`]: from bytes to a recording. [`thrust_map`]: from duty cycle to thrust. [`track`]: between two entries. [`flow`]: the air that
//! the baseline makes. [`anemometer`] and [`receiver`]: what a probe and a drone make of it. [`simulate`]: what would have been
//! recorded. [`residuals`]: how far off that is, and where. [`calibrate`]: the constants of the jet that fit best. [`made_up`]:
//! recordings of a world made up here, to try all of it on.
//!
//! Forces: [`low_pass`], [`free_flight`] and [`identify`]: the thrust map, from rows with nobody above. [`force`]: on a drone below
//! another, recorded and simulated. [`clock`]: how far apart the logs' clocks are. [`held_out`] and [`force_sums`]: how well forces
//! are predicted in flights that nothing was fitted to.

pub mod actuation;
pub mod advice;
pub mod anemometer;
pub mod baseline;
pub mod calibrate;
pub mod campaign;
pub mod candidates;
pub mod clock;
pub mod diagnose;
pub mod finding;
pub mod finding_file;
pub mod fit;
pub mod flow;
pub mod force;
pub mod force_sums;
pub mod free_flight;
pub mod held_out;
pub mod hypothesis;
pub mod identify;
pub mod intervals;
mod least_squares;
pub mod low_pass;
pub mod made_up;
pub mod noise;
pub mod observed;
pub mod outside;
pub mod problem;
pub mod prove;
mod random;
pub mod read;
pub mod receiver;
pub mod recording;
pub mod remark;
pub mod residuals;
pub mod select;
pub mod simulate;
pub mod statistics;
pub mod thrust_map;
pub mod track;
