//! From scenario to verified plan: what was typed (`scenario`), what it means ([`world`]), the
//! search, and the plan as plain data ([`plan`](mod@plan)) that `verify` judges.

pub mod endpoints;
pub mod outcome;
pub mod plan;
pub mod trajectory;
pub mod verify;
pub mod world;

pub use outcome::{Control, Outcome};
