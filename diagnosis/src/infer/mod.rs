//! Which effect a simulation leaves out: candidates, fits, selection, and the finding.

pub mod actuation;
pub mod advice;
pub mod candidates;
pub mod diagnose;
pub mod finding;
pub mod finding_file;
pub mod fit;
pub mod intervals;
pub mod noise;
pub mod outside;
pub mod select;
