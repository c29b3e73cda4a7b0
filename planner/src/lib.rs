//! From scenario to verified plan: what was typed ([`scenario`]), what it means ([`world`]), the
//! search, and the plan as plain data ([`plan`](mod@plan)) that [`verify`](mod@verify) judges.
//!
//! ```
//! use planner::plan::outcome::{Control, Outcome};
//!
//! let text = r#"Scenario(
//!     name: "hand-over",
//!     bounds_m: (min: (0, 0, 0), max: (12, 8, 6)),
//!     drones: [
//!         (name: "lifter", airframe: "matrice-300", start_m: (2, 4, 5), tasks: [(to_m: (10, 4, 5))]),
//!         (name: "scout", airframe: "kolibri", start_m: (10, 4, 1), tasks: [(to_m: (2, 4, 1), dwell_s: 5)]),
//!     ],
//! )"#;
//! let no_files = |file: &str| Err(format!("there is no {file}")); // meshes come from the caller
//! let world = planner::scenario::read_world(text, &no_files).expect("a scenario in order");
//!
//! match planner::plan_world(&world, &Control::QUIET) {
//!     Outcome::Planned { plan, .. } => {
//!         assert!(plan.violations.is_empty() && plan.unplanned.is_empty());
//!         for drone in &plan.drones {
//!             println!("{}: {:.1} s, at worst {:.1} m/s", drone.name, drone.arrives_s, drone.worst_air_mps);
//!         }
//!     }
//!     Outcome::Blocked { conflicts } => println!("{} pairs of starts exclude one another", conflicts.len()),
//!     Outcome::Stopped => println!("stopped before there was a plan"),
//! }
//! ```

pub mod graph;
pub mod plan;
pub mod replan;
pub mod scenario;
pub mod sipp;
pub mod solver;
pub mod verify;

pub use costmap::volumes::downwash::Outline;
pub use plan::outcome::{Control, Outcome};
pub use solver::fleet::{contrast, plan_world};
pub use solver::outlines::WakeOutlines;
