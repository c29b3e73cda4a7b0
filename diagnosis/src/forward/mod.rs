//! The simulation of a recording: the air, what instruments and receivers make of it, and how far
//! off it is.

pub mod anemometer;
pub mod clock;
pub mod flow;
pub mod force;
pub mod held_out;
pub mod hypothesis;
pub mod observed;
pub mod receiver;
pub mod residuals;
pub mod simulate;
