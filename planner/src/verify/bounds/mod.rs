//! What bounds the air and the bodies: wakes, their tables, and the obstacles on which they end.
//!
//! Every bound is from above on speeds and slopes, and from below on distances: a check that is
//! passed on bounds holds at every moment and place between. Distances to obstacles, wake ends and
//! moved wakes are worked out here for a second time on purpose: the search has its own.

pub(crate) mod obstacles;
mod tables;
pub(crate) mod wake;

#[cfg(test)]
mod tests;
