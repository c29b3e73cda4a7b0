//! Continuous time: which drones are near one another, what a receiver is exposed to between two
//! break points, advected air, and the subdivision that finds maxima.
//!
//! Time is in seconds since the plan begins. A span is cut wherever a drone changes its piece,
//! takes off, lands or leaves, so that within a [window](window::Window) every motion is one
//! formula.

pub(super) mod advected;
pub(super) mod closest;
pub(super) mod encounters;
pub(super) mod spans;
pub(super) mod subdivision;
pub(super) mod window;
