//! The search for one drone: safe-interval path planning (SIPP) past the drones that are planned
//! already.

pub(crate) mod conflicts;
pub(crate) mod search;

pub(crate) mod goal_occupancy;
