//! From duty cycles to thrust: the map identified in free flight, and the clocks of the logs.

pub mod free_flight;
pub mod identify;
pub(crate) mod least_squares;
pub mod low_pass;
