//! The whole fleet: endpoints, priorities with evictions, PIBT, LNS, and the reason of each drone
//! left unplanned.

pub(crate) mod assemble;
pub(crate) mod density;
pub(crate) mod endpoints;
pub(crate) mod explain;
pub(crate) mod prepare;
pub(crate) mod priority;
pub(crate) mod refusals;
pub(crate) mod relaxed;
pub(crate) mod subfleet;

pub(crate) mod fleet;
pub(crate) mod lanes;
pub(crate) mod outlines;
pub(crate) mod pibt;
