//! The simulation of a recording: the air, what instruments and receivers make of it, and how far off it is.

pub mod anemometer;
pub mod flow;
pub mod force;
pub mod force_sums;
pub mod hypothesis;
pub mod low_pass;
pub mod observed;
pub mod receiver;
pub mod residuals;
pub mod simulate;
