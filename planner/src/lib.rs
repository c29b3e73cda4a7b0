//! From scenario to verified plan: what was typed ([`scenario`]), what it means ([`world`]), the
//! search, and the plan as plain data ([`plan`](mod@plan)) that [`verify`](mod@verify) judges.

pub mod scenario;
pub mod world;

pub mod endpoints;
pub mod placement;
pub mod solid;

pub mod instances;
pub mod outcome;
pub mod plan;
pub mod trajectory;
pub mod verify;

pub use outcome::{Control, Outcome};
