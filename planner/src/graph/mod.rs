//! Where drones can go and how long it takes: the lattice, the roadmap beyond it, times to every
//! goal.

pub(crate) mod agent;
pub(crate) mod distances;
pub(crate) mod lattice;
pub(crate) mod passage;
pub(crate) mod roadmap;

pub(crate) mod scratch;
pub(crate) mod turns;
