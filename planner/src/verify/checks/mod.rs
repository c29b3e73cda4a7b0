//! One file a check: each names what breaks its rule as violations.

pub(crate) mod air;
pub(super) mod collision;
mod column;
pub(super) mod contents;
pub(super) mod limits;
pub(crate) mod obstacle;
pub(crate) mod zone;
