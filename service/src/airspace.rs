//! One site, several planners: each plans the drones of its own area, around what the neighbours
//! have said that their drones fly.
//!
//! Areas overlap by a strip in which drones are handed over. Before an [`Area`] flies a change
//! there, it proposes it to its neighbours with the moment from which it is to hold. Every
//! neighbour whose world the change comes near checks it against its own plan by the verifier, and
//! keeps room for it until it hears the outcome. The change is flown once all have agreed, and
//! dropped if one refuses or has said nothing by then. So two areas never fly plans made at the
//! same time without knowing of one another, however long messages take.
//!
//! What has happened (a drone is late, has failed, is gone) is not proposed but told: the
//! neighbours replan around it.
//!
//! A drone is handed over where it hovers in the strip: its planner offers it, the neighbour
//! proposes a plan that takes it, and with that plan owns it. A planner that has agreed to the
//! proposal and hears no more keeps room for both.
//!
//! A silent neighbour's last wakes stay in the plan, and nothing is changed near its world. After
//! the last moment for which it has spoken its drones come down in its area, and nothing is planned
//! within reach of it until it is heard again, except to land there or to leave.
//!
//! In this order: `message`, what neighbours say to one another; [`Neighbours`], how it gets there,
//! with one implementation within a process; `site`, the areas and what is near them;
//! `neighbourhood`, what a planner knows of its neighbours, and whether what they say can be;
//! `area`, one planner; `traffic`, for tests and measurements. Nothing here reads a clock: the
//! caller says how late it is, by the site's clock.

pub mod message;
pub mod traffic;

mod area;
mod neighbourhood;
mod refused;
mod site;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

pub use area::{Area, Counts};
use message::Message;
pub use refused::Refused;
pub use site::Site;

/// How messages get to the planners of other areas: none twice, none before one that was sent
/// earlier by the same planner to the same; any may get lost.
pub trait Neighbours {
    /// Sends a message to the planner that it names.
    fn send(&mut self, message: &Message);
    /// What has come since it was asked last.
    fn received(&mut self) -> Vec<Message>;
}

/// Planners of one process. A copy is the same place to meet.
#[derive(Clone, Debug, Default)]
pub struct InProcess {
    shared: Arc<Mutex<Shared>>,
}

#[derive(Debug, Default)]
struct Shared {
    /// By the name of the area that is to get them.
    waiting: BTreeMap<String, VecDeque<Message>>,
    /// Areas that no message gets to or comes from.
    cut_off: BTreeSet<String>,
    sent: u64,
}

/// One planner's place in a process.
#[derive(Clone, Debug)]
pub struct Seat {
    area: String,
    all: InProcess,
}

impl InProcess {
    /// The place of an area's planner.
    pub fn seat(&self, area: &str) -> Seat {
        Seat {
            area: area.to_owned(),
            all: self.clone(),
        }
    }

    /// Lets no message to an area through, nor one from it, or lets them through again. What was
    /// under way is lost.
    pub fn cut_off(&self, area: &str, is_cut_off: bool) {
        self.with(|shared| {
            shared.waiting.remove(area);
            match is_cut_off {
                true => shared.cut_off.insert(area.to_owned()),
                false => shared.cut_off.remove(area),
            };
        });
    }

    /// How many messages were sent.
    pub fn sent(&self) -> u64 {
        self.with(|shared| shared.sent)
    }

    fn with<T>(&self, what: impl FnOnce(&mut Shared) -> T) -> T {
        // A panic of another thread leaves whole messages.
        what(&mut self.shared.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Neighbours for Seat {
    fn send(&mut self, message: &Message) {
        self.all.with(|shared| {
            shared.sent += 1;
            let ends = [&message.from, &message.to];
            if ends.iter().all(|it| !shared.cut_off.contains(*it)) {
                let waiting = shared.waiting.entry(message.to.clone()).or_default();
                waiting.push_back(message.clone());
            }
        });
    }

    fn received(&mut self) -> Vec<Message> {
        self.all.with(|shared| {
            let waiting = shared.waiting.remove(&self.area);
            waiting.unwrap_or_default().into()
        })
    }
}

/// What a journal keeps of one area's planner: replayed in their order they give the same plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Record {
    /// Its drones have changed.
    Changed {
        /// The revision that it has then.
        revision: u64,
        /// When (s).
        at_s: f64,
        /// What was asked.
        changes: Vec<crate::message::OneChange>,
        /// What a neighbour had offered, and was taken.
        took: Option<message::Offer>,
        /// The number of the proposal; 0: there was none.
        number: u64,
    },
    /// A neighbour's drones have changed.
    Noted {
        /// When (s).
        at_s: f64,
        /// Which neighbour.
        from: String,
        /// The number of the proposal, or the last one that it has settled.
        number: u64,
        /// What they fly.
        drones: Vec<planner::plan::DronePlan>,
        /// Own drones were replanned around it.
        gave_way: bool,
    },
    /// A proposal was agreed to, and room is kept for it.
    Agreed {
        /// Which neighbour.
        from: String,
        /// The proposal.
        proposal: message::Proposal,
    },
    /// It was dropped.
    Dropped {
        /// Which neighbour.
        from: String,
        /// Which proposal.
        number: u64,
    },
    /// A neighbour has said up to which proposal it knows what was taken from it.
    Knows {
        /// Which neighbour.
        from: String,
        /// Of the last one.
        number: u64,
    },
    /// A proposal was made; if no change bears its number, it is dropped.
    Proposed {
        /// Which.
        number: u64,
    },
    /// A drone was offered to a neighbour.
    Offered {
        /// Which neighbour.
        to: String,
        /// The drone, and its remaining tasks.
        offer: message::Offer,
    },
    /// An offer was taken back.
    Withdrawn {
        /// Of which drone.
        drone: String,
    },
    /// What was flown before a time is dropped.
    Forgot {
        /// When (s).
        before_s: f64,
    },
}

#[cfg(test)]
mod tests;
