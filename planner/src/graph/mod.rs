//! Where drones can go and how long it takes: the lattice, the roadmap beyond it, times to every goal.

pub mod agent;
pub mod distances;
pub mod lattice;
pub mod roadmap;

pub(crate) mod scratch;
