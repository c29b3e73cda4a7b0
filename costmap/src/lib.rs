//! Downwash as parry volumes and as exposure prices: a leg is free, priced or forbidden, and by whom.
//!
//! In reading order:
//!
//! - [`leg`]: one drone, straight, for a whole number of ticks
//! - [`envelope`]: what one wake brings to another airframe's discs, bounded from above
//! - [`cover`]: where a wake ends
//! - [`fleet`]: all kinds of drones, and what two legs do to each other
//! - [`timeline`]: the legs that exist in each second, in parry trees
//! - [`costmap`](mod@costmap): a leg against all of them

pub mod costmap;
pub mod cover;
pub mod envelope;
pub mod fleet;
pub mod leg;
pub mod timeline;
