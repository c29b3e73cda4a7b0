//! Continuous time: who is near whom, what a receiver is exposed to between two break points, air
//! that arrives with a delay, and the subdivision that finds what is highest.
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
