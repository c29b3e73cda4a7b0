//! Figures, one file each: SVG that needs no network, no script and no colour to be read.

mod agreement;
mod axes;
mod before_after;
pub(crate) mod calibration;
mod colours;
mod compact;
mod expansion;
mod field;
pub(crate) mod finding;
mod near_field;
pub(crate) mod plan;
mod profiles;
mod readings;
mod receiver;
mod residual_map;
mod sheet;
mod signature;
pub(crate) mod simulation;
#[cfg(test)]
mod tests;

use crate::report::Figure;
