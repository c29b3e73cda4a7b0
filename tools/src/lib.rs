//! Synthetic scenarios and benchmark tables; the command alone uses them.

pub mod instances;
