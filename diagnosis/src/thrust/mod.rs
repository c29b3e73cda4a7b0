//! From duty cycles to thrust: the map identified in free flight, and the clocks of the logs.

pub mod clock;
pub mod free_flight;
pub mod held_out;
pub mod identify;
mod least_squares;
pub mod thrust_map;
