//! What the planners of neighbouring areas say to one another: `airspace/1`.
//!
//! World frame of the site: metres, z up. Times are seconds by the site's clock, which all planners
//! share. A drone's trajectory is as in plan.json, whole, so that one that was lost is made good by
//! the next.

use planner::plan::{AtEnd, DronePlan};
use serde::{Deserialize, Serialize};

use crate::message::Task;

/// The version of all messages.
pub const PROTOCOL: &str = "airspace/1";

/// One message.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Message {
    /// `airspace/1`.
    pub protocol: String,
    /// The area whose planner says it.
    pub from: String,
    /// The area whose planner it is for.
    pub to: String,
    /// What.
    pub says: Says,
}

/// What can be said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Says {
    /// All that may matter to the receiver; it comes again and again, as the sign of life.
    Border(Border),
    /// What is to be flown, if all agree.
    Propose(Proposal),
    /// Whether the receiver's proposal may be flown.
    Vote(Vote),
    /// What became of a proposal of the sender.
    Settle(Settled),
    /// What has happened to the sender's drones, and is flown already.
    Fact(Fact),
}

/// A planner's drones that may matter to a neighbour.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Border {
    /// Of the sender's plan; it never falls.
    pub revision: u64,
    /// When it was said (s).
    pub at_s: f64,
    /// Up to when the sender speaks for its drones (s): if it is not heard until then, they come
    /// down in its area.
    pub until_s: f64,
    /// The number of its last proposal that is settled.
    pub settled: u64,
    /// The number of the receiver's last proposal up to which the sender knows them to be settled.
    pub heard: u64,
    /// What comes near the receiver's world, or was taken from it: what would and is not among them
    /// is not there any more.
    pub drones: Vec<DronePlan>,
    /// Drones that hover, or will, in the strip that both worlds share, for the receiver to take:
    /// all of them, until they are taken.
    pub offers: Vec<Offer>,
}

/// What is to be flown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Proposal {
    /// Rises with every proposal of the sender.
    pub number: u64,
    /// The sender's revision with it.
    pub revision: u64,
    /// The receiver's revision that it was planned against.
    pub seen: u64,
    /// From when on it is to be flown (s): what is not agreed to by then is dropped.
    pub from_s: f64,
    /// The sender's drones that fly something else, whole.
    pub drones: Vec<DronePlan>,
    /// One of them that is the receiver's, or a third's, until then: it was offered.
    pub takes: Option<String>,
}

/// Whether a proposal may be flown.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vote {
    /// Of the proposal.
    pub number: u64,
    /// `null`: yes; else why not.
    pub against: Option<String>,
}

/// What became of a proposal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settled {
    /// Which.
    pub number: u64,
    /// It is flown; else it is dropped.
    pub is_flown: bool,
}

/// What has happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fact {
    /// The sender's revision with it.
    pub revision: u64,
    /// The drones concerned, whole.
    pub drones: Vec<DronePlan>,
}

/// A drone to be taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Offer {
    /// Its name; where it is, its planner's border says.
    pub drone: String,
    /// What is left for it to do.
    pub tasks: Vec<Task>,
    /// What it does after that.
    pub at_end: AtEnd,
}
