//! From duty cycles to thrust: the map of an airframe, identified in free flight.
//!
//! # In reading order
//!
//! [`low_pass`]: the filters that logged and simulated series share. [`free_flight`]: where nothing
//! but thrust carries a drone. [`identify`]: the map by least squares, its lag and its standard
//! errors; one map for each fold of flights held out. [`maps`]: those of all drones.

pub mod free_flight;
pub mod identify;
pub(crate) mod least_squares;
pub mod low_pass;
pub mod maps;
