//! What `plan generate`, `plan bench` and `plan prove --flights` are made of; the command alone
//! uses it.
//!
//! In reading order: [`instances`], synthetic scenarios from a seed; [`mod@bench`], fleets of them
//! planned one a process, and how the cost grows; [`real_flights`], what the diagnosis names in
//! published flights; [`table`], the tables all of these print.

pub mod bench;
pub mod instances;
pub mod real_flights;
pub mod table;
