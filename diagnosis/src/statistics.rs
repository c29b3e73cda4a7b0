//! What is signal and what is noise: tests, trees, expressions and intervals on plain numbers.
//!
//! Nothing here knows air or recordings: values come as slices and nalgebra matrices, samples by rows. Samples of one series (one
//! probe, one receiver) depend on one another, so every test, fold and interval works on [`sequence::Blocks`] of them. Every draw
//! comes from a seed.
//!
//! # In reading order
//!
//! [`sequence`]: which sample follows which, and blocks of them. [`noise`]: how far values scatter, and whitening. [`column`]: shapes
//! that a residual is held against. [`gate`]: is anything there? [`spectrum`]: does it pulsate? [`change_point`]: does it step?
//! [`scan`]: where is it? [`held_out`]: does a prediction hold where it was not fitted? [`trees`]: the most that any function of
//! the covariates explains. [`expression`]: the shortest formula for it. [`covariance`] and [`bootstrap`]: how sure. [`draws`] and [`tail`]: the
//! generator of random numbers, and chances.

pub mod bootstrap;
pub mod change_point;
pub mod column;
pub mod covariance;
pub mod draws;
pub mod expression;
pub mod gate;
pub mod held_out;
pub mod noise;
pub mod scan;
pub mod sequence;
pub mod spectrum;
pub mod tail;
pub mod trees;
