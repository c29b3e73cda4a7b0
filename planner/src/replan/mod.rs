//! A plan changed while it is flown ([`rolling`]), and a fleet planned around fixed trajectories ([`region`]).

pub mod region;
pub mod rolling;
