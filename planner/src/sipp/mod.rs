//! The search for one drone: safe-interval path planning (SIPP) past the drones that are planned already.

pub mod conflicts;
pub mod search;

pub(crate) mod goal_occupancy;
