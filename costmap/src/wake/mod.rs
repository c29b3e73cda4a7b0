//! What one wake brings to another drone, bounded for the search.
//!
//! - [`envelope`]: the air over another airframe's discs, bounded from above, made once;
//!   `moved_jet`: where wind or tilt moved it
//! - [`surfaces`]: where a wake ends
//! - [`fleet`]: all kinds of drones, and what two legs do to each other; `advected`: with the delay
//!   of convection

pub mod advected;
pub mod envelope;
pub mod fleet;
mod moved_jet;
pub mod surfaces;
