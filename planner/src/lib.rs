//! From scenario to verified plan. A fleet manager needs what stands at this root:
//!
//! ```
//! use planner::{Control, Outcome};
//!
//! let world = planner::read_world(r#"Scenario(
//!     name: "hand-over",
//!     bounds_m: (min: (0, 0, 0), max: (12, 8, 6)),
//!     drones: [
//!         (name: "lifter", airframe: "matrice-300", start_m: (2, 4, 5), tasks: [(to_m: (10, 4, 5))]),
//!         (name: "scout", airframe: "kolibri", start_m: (10, 4, 1), tasks: [(to_m: (2, 4, 1), dwell_s: 5)]),
//!     ],
//! )"#)?;
//! match planner::plan_world(&world, &Control::QUIET)? {
//!     Outcome::Safe(planned) => {
//!         for drone in &planned.plan.drones {
//!             println!("{}: {:.1} s, at worst {:.1} m/s", drone.name, drone.arrives_s, drone.worst_air_mps);
//!         }
//!         let positions = planned.plan.sample(10.0); // of all drones, ten times a second
//!         assert_eq!(positions[0].position_m[1], Some(world.drones[1].start_m));
//!     }
//!     Outcome::Partial(planned) => {
//!         for failure in &planned.failures {
//!             println!("{} stays: {}", failure.drone, failure.cause);
//!         }
//!     }
//!     Outcome::Unsafe(planned) => println!("do not fly: {} violations", planned.plan.violations.len()),
//!     Outcome::Infeasible { conflicts } => println!("{} pairs of starts exclude one another", conflicts.len()),
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod plan;
pub mod replan;
pub mod scenario;
pub mod verify;

mod graph;
mod sipp;
mod solver;

pub use costmap::volumes::downwash::Outline;
pub use plan::Plan;
pub use plan::cause::FailureCause;
pub use plan::outcome::{Control, Outcome, Planned};
pub use replan::region::plan_region;
pub use replan::rolling::Running;
pub use scenario::world::{Drone, Task, World};
pub use scenario::{Files, Problems, read_world, read_world_with};
pub use solver::endpoints::check as endpoint_conflicts;
pub use solver::fleet::{contrast, plan_world};
pub use solver::outlines::WakeOutlines;
pub use verify::verify;
