//! The simulation of a recording: the air, what instruments and receivers make of it, and how far
//! off it is.
//!
//! # In reading order
//!
//! [`hypothesis`]: what is added to the baseline. [`flow`]: the air at any point and moment.
//! [`anemometer`] and [`receiver`]: what a probe reads of it, and how a drone answers to it.
//! [`simulate`]: what would have been recorded. [`residuals`]: how far off that is, by region.
//! [`mistakes`]: slips of units and axes. [`observed`]: a recording made ready to be explained.
//! [`force`]: the vertical force on a drone, recorded and simulated. [`held_out`]: how well it is
//! predicted in flights that nothing was fitted to. [`clock`]: how far the logs' clocks are apart.

pub mod anemometer;
pub mod clock;
pub mod flow;
pub mod force;
pub mod held_out;
pub mod hypothesis;
pub mod mistakes;
pub mod observed;
pub mod receiver;
pub mod residuals;
pub mod simulate;
