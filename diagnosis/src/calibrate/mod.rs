//! From recordings to the three constants of the jet, with honest intervals: the paper's own path, through an explicit
//! observation operator.

mod calibration;

pub use calibration::*;
