//! From recordings to the three constants of the jet, with honest intervals: the paper's own path, through an explicit
//! observation operator.

mod calibration;

pub use calibration::*;

mod cells;
mod intervals;
mod joint;
mod operator;
mod options;
mod samples;
mod units;

pub use options::Options;
mod probe_test;
