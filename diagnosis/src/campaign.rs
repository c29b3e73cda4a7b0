//! Several flights of one campaign, diagnosed together by the forces on their drones: folds, errors and intervals over whole flights.
//!
//! # In reading order
//!
//! [`options`]: what is diagnosed, and from which beginning. [`forces`]: rows, and what a hypothesis makes of them. [`scatter`]: the
//! noise, and what one flight shares. [`library`]: what may be missing in a force. [`forward`]: one effect after another. [`diagnose`]: the whole way, and the finding.
//! [`skill`]: how well flights that were not fitted are predicted. [`hardware`]: one drone's motors against its own earlier flights.

pub mod covariates;
pub mod diagnose;
pub mod forces;
pub mod forward;
pub mod hardware;
pub mod library;
pub mod options;
pub mod scatter;
pub mod skill;

pub use diagnose::{CampaignError, CampaignFinding, diagnose_campaign, near_floor};
pub use options::CampaignOptions;
