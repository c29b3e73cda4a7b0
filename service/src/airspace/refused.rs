//! Why a change is not made.

use std::fmt;

/// Why a change is not made, or not proposed.
#[derive(Clone, Debug, PartialEq)]
pub enum Refused {
    /// A proposal is under way: ask again.
    Busy,
    /// The changes are not in order, or find no path.
    Changes(Vec<String>),
    /// The verifier finds this, against all that is known of the neighbours.
    NotVerified(String),
    /// It comes near the world of a neighbour that is not heard.
    Silent(String),
    /// It comes within reach of where the drones of a neighbour come down that is not heard any
    /// more, and nearer than what is flown now, or takes one of them.
    Closed(String),
    /// The drone is offered to a neighbour.
    Offered(String),
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refused::Busy => f.write_str("a proposal is under way"),
            Refused::Changes(all) => f.write_str(&all.join("; ")),
            Refused::NotVerified(what) => f.write_str(what),
            Refused::Silent(area) => write!(f, "near the world of `{area}`, which is not heard"),
            Refused::Closed(area) => {
                write!(f, "`{area}` is lost, and its drones come down in its area")
            }
            Refused::Offered(drone) => write!(f, "`{drone}` is offered to a neighbour"),
        }
    }
}

impl std::error::Error for Refused {}
