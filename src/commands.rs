//! One file for each subcommand: its arguments, what it asks the libraries, and its answer.

pub(crate) mod bench;
pub(crate) mod calibrate;
pub(crate) mod check;
pub(crate) mod diagnose;
pub(crate) mod generate;
pub(crate) mod plan;
pub(crate) mod prove;
pub(crate) mod schema;
pub(crate) mod simulate;
