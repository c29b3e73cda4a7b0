//! What the project promises, through its public face and its commands; modules by promise.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

mod boundaries;
mod calibration;
mod commands;
mod diagnosis;
mod docs;
mod endpoints;
mod findings;
mod hover;
mod instances;
mod near_field;
mod neural_swarm;
mod paper;
mod planner;
mod readme;
mod real_flights;
mod recordings;
mod recordings_commands;
mod scaling;
mod scenario;
mod scenarios;
mod verifier;
mod volumes;
mod wakes;
