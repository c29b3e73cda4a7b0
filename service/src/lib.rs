//! A plan that is being flown, changed by messages. One [`Service`] holds one plan; a line in is
//! one request, and gives one answer and, where the plan has changed, what a journal must keep.
//!
//! ```
//! use service::Service;
//!
//! let mut service = Service::default();
//! let told = service.handle(r#"{"id": 1, "method": "plan"}"#, &|| 0.0);
//! let error = told.answer.error.expect("nothing is open");
//! assert_eq!(error.code, service::message::Code::NotOpen);
//! ```
//!
//! Nothing here reads a file or a clock: the caller hands in how long a request has taken so far.
//! In this order:
//!
//! 1. `message`: requests, answers and records as data, with their JSON schema.
//! 2. `off_plan`: where a drone says it is, against where its plan has it.
//! 3. `landing`: where the drones that fly could land.
//! 4. `repeated`: which keys a request has twice.
//! 5. `handler`: what a request does.
//! 6. [`airspace`]: several planners of one site, each with an area of its own.

pub mod airspace;
pub mod message;

mod handler;
mod landing;
mod off_plan;
mod repeated;

pub use handler::{Handled, ReplayError, Service};
