//! Downwash as parry volumes and as exposure prices.
//!
//! The jets of `airflow` say how fast the air moves at a point. A planner asks other questions: may
//! this leg be flown at all, and what does the air along it cost? This crate answers them with convex
//! bodies that parry can query, and with integrals along legs. Every approximation is outward: a
//! volume may be larger than the air it stands for, never smaller.
//!
//! In reading order:
//!
//! - [`frame`]: where nalgebra and z up meet parry, glam and y up; nowhere else
//! - [`leg`]: a straight piece of flight
//! - [`frustum`]: the exact truncated cone as a parry shape
//! - [`swept`]: a convex body on the move, and whether two of them meet
//! - [`downwash`]: near-field column and half-width cone of one airborne drone
//! - [`spindle`]: all points where its wake is faster than a limit
//! - [`exposure`]: the air met along a leg: dose, worst speed, extra energy

pub mod downwash;
pub mod exposure;
pub mod frame;
pub mod frustum;
pub mod leg;
mod quadrature;
pub mod spindle;
pub mod swept;
