//! The whole fleet: endpoints, priorities with evictions, PIBT, LNS, and the reason of each drone left unplanned.

pub mod assemble;
pub mod density;
pub mod endpoints;
pub mod explain;
pub mod prepare;
pub mod priority;
pub mod well_formed;

pub(crate) mod fleet;
pub(crate) mod outlines;
pub(crate) mod pibt;
