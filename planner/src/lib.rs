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
//!         let positions = planned.plan.sample(10.0); // ten times a second
//!         assert_eq!(positions[0].position_m[1], Some(world.drones[1].start_m));
//!     }
//!     Outcome::Partial(planned) => {
//!         for failure in &planned.failures {
//!             println!("{} stays: {}", failure.drone, failure.cause);
//!         }
//!     }
//!     Outcome::Unsafe(planned) => println!("do not fly: {} violations", planned.plan.violations.len()),
//!     Outcome::Infeasible { conflicts } => println!("{} pairs of places exclude one another", conflicts.count()),
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Names beyond these stand in [`scenario`], [`plan`](mod@plan), [`replan`] and
//! [`verify`](mod@verify). To read the code, take the rooms in this order, each of which imports
//! only from those before it:
//!
//! 0. `form`: JSON held against its schema, each field at fault in words.
//! 1. `plan`: a plan as plain data (`plan.json`), its trajectories, and what a run answers
//!    ([`Outcome`]).
//! 2. `scenario`: RON text with every error at its place, the [`World`] that it means, obstacles as
//!    distances, and the rules that a world built by hand is held against.
//! 3. `graph`: the 26-connected lattice, the roadmap with a petgraph of the paths beyond it, exact
//!    times to every goal, and one drone's job on it (an agent and its waypoints).
//! 4. `sipp`: safe-interval path planning for one drone (M. Phillips and M. Likhachev, ICRA 2011):
//!    conflict tables of two steps, the reservation table of all planned drones, goal-occupancy
//!    cost, and the search itself, a weighted A* with partial expansion whose path the costmap
//!    judges afterwards (lazy validation).
//! 5. `verify`: the plan against the flow model in continuous time; it shares no code with the
//!    search.
//! 6. `solver`: the fleet: endpoints that exclude one another, prioritized planning with evictions,
//!    PIBT where the floor is crowded, large-neighbourhood search for small fleets and in the time
//!    left, and why a drone has no path.
//! 7. `replan`: a plan changed while it is flown, and a fleet around fixed trajectories.
//!
//! World frame throughout: metres, z up; a position is the centre of a drone's rotor plane. Times
//! are seconds from the plan's beginning; inside the search they are whole ticks of a hundredth of
//! a second.

pub mod form;
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
pub use solver::outlines::{WakeOutlines, blocking_surfaces};
pub use verify::verify;
