//! A plan flown with inertia, motors, a controller and advected wakes.
//!
//! The verifier judges drones that are exactly where their plan says. Here they are where their
//! controllers bring them, and their wakes leave from there. It is a simulation, not a measurement:
//! `docs/flight.md` lists its assumptions.
//!
//! In reading order: [`rotor`] and [`vehicle`]: how a drone moves; [`controller`]: how it is
//! commanded; `reference`: what the plan asks; [`wakes`] and [`gusts`]: the air that comes to it;
//! [`feed_forward`]: what it does about that; `fleet`, `bins`, `tally` and `fly`: all drones
//! together, and what is counted; [`report`]: the results; [`setup`]: parameters from a file;
//! [`paper`]: the paper's own flight; [`battery`]: what a plan takes of batteries.

pub mod battery;
pub mod controller;
pub mod feed_forward;
pub mod gusts;
pub mod paper;
pub mod report;
pub mod rotor;
pub mod setup;
pub mod vehicle;
pub mod wakes;

mod bins;
mod fleet;
mod fly;
mod reference;
mod tally;

pub use fleet::FlyError;
pub use fly::{Options, fly};
pub use report::FlightReport;
pub use setup::{Setup, SetupError};
