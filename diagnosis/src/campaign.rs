//! Several flights of one campaign, diagnosed together by the forces on their drones: folds, errors and intervals over whole flights.
//!
//! # In reading order
//!
//! [`options`]: what is diagnosed, and from which beginning. [`steps`]: drones in equal steps of time. [`forces`]: rows, and what a hypothesis
//! makes of them (`air_met`). [`covariates`]: what surrounds them. [`scatter`]: the noise, and what one flight shares. [`library`]: what may be
//! missing in a force. [`forward`]: one effect after another. [`skill`]: how well flights that were not fitted are predicted. [`diagnose`]:
//! the whole way, and the finding. [`hardware`]: one drone's motors against its own normal flights.

mod air_met;
pub mod covariates;
pub mod diagnose;
pub mod forces;
pub mod forward;
pub mod hardware;
pub mod library;
pub mod options;
pub mod scatter;
pub mod skill;
pub mod steps;

pub use diagnose::{CampaignError, CampaignFinding, diagnose_campaign, near_floor};
pub use options::CampaignOptions;
