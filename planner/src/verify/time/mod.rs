//! Continuous time: who is near whom, what a receiver is exposed to between two break points, air that
//! arrives with a delay, and the subdivision that finds what is highest.

pub(super) mod advected;
pub(super) mod encounters;
pub(super) mod subdivision;
pub(super) mod window;
