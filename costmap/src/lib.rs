//! Downwash as parry volumes and as exposure prices: a leg is free, priced or forbidden, and by whom.
//!
//! The jets of `airflow` say how fast the air moves at a point. A planner asks other questions: may
//! this leg be flown at all, and what does the air along it cost? This crate answers them with bodies
//! that parry can query, with bounds that add up, and with integrals along flights. Every
//! approximation is outward: a volume may be larger than the air it stands for, never smaller.
//!
//! Volumes, in reading order:
//!
//! - [`frame`]: where nalgebra and z up meet parry, glam and y up; nowhere else
//! - [`frustum`]: the exact truncated cone as a parry shape
//! - [`swept`]: a convex body on the move, and whether two of them meet
//! - [`downwash`]: near-field column and half-width cone of one airborne drone
//! - [`spindle`]: all points where its wake is faster than a limit
//! - [`flight`] and [`exposure`]: the air met along one: dose, worst speed, extra energy
//!
//! The fleet over time:
//!
//! - [`leg`]: one drone, straight, for a whole number of ticks
//! - [`envelope`]: what one wake brings to another airframe's discs, bounded from above; `moved_jet`: where wind or tilt moved it
//! - [`cover`]: where a wake ends
//! - [`fleet`]: all kinds of drones, and what two legs do to each other
//! - `zone`: what blows into zones, wall jets included
//! - `late`: what legs do to one another where air takes its time
//! - [`ground`]: the floor in bins
//! - [`timeline`]: the legs over each bin, in order of time
//! - [`costmap`](mod@costmap): a leg against all of them, in bounds: what a search asks
//! - [`verdict`]: what it says
//! - [`assess`]: the same in full, with the air integrated: what a person asks

pub mod assess;
pub mod costmap;
pub mod cover;
pub mod downwash;
mod draught;
pub mod envelope;
pub mod exposure;
pub mod fleet;
pub mod flight;
pub mod frame;
pub mod frustum;
pub mod ground;
mod late;
pub mod leg;
mod moved_jet;
mod quadrature;
pub mod spindle;
pub mod swept;
pub mod timeline;
pub mod verdict;
mod zone;
