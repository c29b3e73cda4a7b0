//! The geometry of one drone's body and wake, written once: as sections in closed form, from which
//! the conflict tables are made, and ([`swept`]) the same sections as parry shapes, which tests
//! hold the tables against.
//!
//! All lengths in metres, z up; depths are measured down from the rotor plane. Every approximation
//! is outward.
//!
//! - [`frame`]: where nalgebra and z up meet parry, glam and y up; nowhere else
//! - [`frustum`]: the exact truncated cone as a parry shape
//! - [`swept`]: a convex body on the move, and whether two of them meet
//! - [`downwash`]: near-field column and half-width cone of one airborne drone
//! - [`relative`]: where one drone is relative to another, each at a moment of its own
//! - [`conflict_volume`]: where one drone's centre must not be, seen from another
//! - [`iso_speed`]: all points where its wake is faster than a limit

pub mod conflict_volume;
pub mod downwash;
pub mod frame;
pub mod frustum;
pub mod iso_speed;
pub mod relative;
pub mod swept;
