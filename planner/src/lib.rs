//! From scenario to verified plan: what was typed ([`scenario`]), what it means ([`world`]), the
//! search, and the plan as plain data ([`plan`]) that [`verify`](mod@verify) judges.

pub mod plan;
pub mod world;
