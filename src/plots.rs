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

pub(crate) use sheet::escape;

/// One picture of a report.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    /// Its file's name, without ending.
    pub(crate) name: String,
    pub(crate) svg: String,
    /// How to read it.
    pub(crate) caption: String,
}
