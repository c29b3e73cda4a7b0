//! Figures: SVG that needs no network, no script and no colour to be read, all on one canvas.
//!
//! In reading order: [`canvas`], a sheet with a title, paths and texts; [`colours`], the palette
//! and the colour scales; [`axes`], charts with linear axes; [`legend`]. Then one file for each
//! kind of figure: [`field`], [`residual_map`] (both on a [`grid`]), [`profiles`], [`expansion`],
//! [`signature`], [`agreement`], and [`plan`] for plan.svg. Last the figures of each command with
//! their captions: [`simulation`], [`calibration`], [`finding`], [`flight`].
//!
//! SVG is written here rather than by a library: of those that draw charts, plotters has whole
//! pixels only, no gradients, groups or names, and the picture of a plan needs all of these.

mod agreement;
mod axes;
pub(crate) mod calibration;
mod canvas;
mod colours;
pub(crate) mod curves;
mod expansion;
mod field;
pub(crate) mod finding;
pub(crate) mod flight;
mod grid;
mod legend;
pub(crate) mod map;
pub(crate) mod plan;
mod profiles;
mod readings;
mod residual_map;
mod signature;
pub(crate) mod simulation;
#[cfg(test)]
mod tests;
