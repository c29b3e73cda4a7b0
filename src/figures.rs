//! Figures of recordings, one file each: SVG that needs no network, no script and no colour to be read.

pub(crate) mod agreement;
mod axes;
pub(crate) mod before_after;
mod colours;
mod compact;
pub(crate) mod expansion;
pub(crate) mod field;
pub(crate) mod near_field;
pub(crate) mod profiles;
pub(crate) mod readings;
pub(crate) mod receiver;
pub(crate) mod residual_map;
mod sheet;
pub(crate) mod signature;

pub(crate) use sheet::escape;

#[cfg(test)]
mod tests;
