//! From scenario to verified plan: what was typed (`scenario`), what it means ([`world`]), the
//! search, and the plan as plain data ([`plan`](mod@plan)) that `verify` judges.

pub mod instances;
pub mod outcome;
pub mod plan;
pub mod world;

pub use outcome::{Control, Outcome};
