//! What a fleet has reserved, by place and time.
//!
//! - [`ground`]: the floor in bins
//! - [`over_time`]: what changes over time, in buckets of a second
//! - [`timeline`]: the legs over each bin, in order of time
//! - `background`: what far wakes add up to
//! - [`zones`]: what wakes bring into zones

pub(crate) mod background;
pub mod ground;
pub mod over_time;
pub mod timeline;
pub mod zones;
