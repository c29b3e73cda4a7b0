//! Several flights of one campaign, diagnosed together by the forces on their drones: folds, errors
//! and intervals over whole flights.
//!
//! # In reading order
//!
//! `forces`: drones in equal steps of time, rows, what surrounds them, and what a hypothesis makes
//! of them. `scatter`: the noise, and what one flight shares. `library`: what may be missing in a
//! force. `forward`: one effect after another. [`skill`]: how well flights that were not fitted are
//! predicted. [`diagnose`]: all of it, and the finding. [`mod@flights`]: that with its rows, for
//! programs. [`hardware`]: one drone's motors against its own normal flights. [`sideways`]: forces
//! to the sides. [`applied`]: a finding tested on recordings that it was not fitted to.

pub mod applied;
pub mod diagnose;
pub mod flights;
mod forces;
mod forward;
pub mod hardware;
mod library;
mod scatter;
pub mod sideways;
pub mod skill;

pub use applied::{Applied, Compared, apply, apply_campaign};
pub use diagnose::{
    CampaignError, CampaignFinding, diagnose_campaign, lacking, near_floor, take_forceless,
};
pub use forces::{COORDINATES, CampaignOptions};
pub use scatter::LEAST_OFFSET_N;
pub use sideways::{SidewaysFinding, diagnose_sideways};
