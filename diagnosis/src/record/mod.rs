//! What was recorded, and from the bytes of files to it.

pub mod baseline;
pub mod problem;
pub mod read;
pub mod recording;
pub mod remark;
pub mod thrust_map;
pub mod track;

/// What a recording describes its air and its drones by.
pub use airflow::{Air, Airframe, Superposition};
