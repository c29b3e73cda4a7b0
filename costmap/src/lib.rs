//! Downwash as parry volumes and as exposure prices: a leg is free, priced or forbidden, and by
//! which drones.
//!
//! The jets of `airflow` say how fast the air moves at a point. A planner asks other questions: may
//! this leg be flown at all, and what does the air along it cost? This crate answers them with
//! volumes in closed form, which tests hold against parry, and with bounds that add up. Every
//! approximation is outward: a volume may be larger than the air it stands for, never smaller.
//!
//! In reading order:
//!
//! - [`leg`]: one drone, straight, for a whole number of ticks
//! - [`volumes`]: the shapes of one drone's body and wake
//! - [`wake`]: what one wake brings to another drone's discs, where it ends, and the kinds of
//!   drones of a fleet
//! - [`reservations`]: what a fleet has reserved, by place and time
//! - [`costmap`](mod@costmap): a leg against all of them, in bounds: what a search asks
//! - [`verdict`]: the answer

/// For a search that asks this crate alone, and names no jet.
pub use airflow::GoldenSection;

pub mod costmap;
pub mod leg;
pub mod reservations;
pub mod verdict;
pub mod volumes;
pub mod wake;
