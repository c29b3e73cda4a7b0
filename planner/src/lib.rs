//! From scenario to verified plan: what was typed ([`scenario`]), what it means ([`world`]), the
//! search, and the plan as plain data ([`plan`](mod@plan)) that [`verify`](mod@verify) judges.

pub mod assemble;
pub mod distances;
pub mod endpoints;
pub mod errand;
pub mod instances;
pub mod lattice;
pub mod outcome;
pub mod placement;
pub mod plan;
pub mod prepare;
pub mod priority;
pub mod reason;
pub mod roadmap;
pub mod scenario;
pub mod search;
pub mod solid;
pub mod trajectory;
pub mod verify;
pub mod world;

mod fleet;

pub use fleet::{contrast, plan_world};
pub use outcome::{Control, Outcome};
