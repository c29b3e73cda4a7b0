//! What may change while a plan is flown, and what is wrong with a change.

use std::collections::BTreeSet;

use thiserror::Error;

use crate::scenario::placement::{Misfit, Spot, misplaced};
use crate::scenario::solid::Solids;
use crate::scenario::world::{AtStart, Drone, Task, World};
use crate::solver::prepare::ending_from;

/// Something that is not as the plan says, or shall not be any more.
#[derive(Clone, Debug)]
pub enum Change {
    /// A drone is behind its plan: where the plan had it `by_s` ago.
    Late {
        /// Its name.
        drone: String,
        /// How far behind (s).
        by_s: f64,
    },
    /// A drone comes, to where it starts.
    Added(Drone),
    /// A drone is taken out, body and wake.
    Removed {
        /// Its name.
        drone: String,
    },
    /// A drone drops what it still had to do, and does this.
    Retasked {
        /// Its name.
        drone: String,
        /// From now on. What it does after the last stays as the scenario says.
        tasks: Vec<Task>,
    },
}

impl Change {
    /// Whom it is about.
    pub fn drone(&self) -> &str {
        match self {
            Change::Late { drone, .. }
            | Change::Removed { drone }
            | Change::Retasked { drone, .. } => drone,
            Change::Added(drone) => &drone.name,
        }
    }
}

/// What is wrong with a change, or with the moment.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ChangeError {
    /// Not a time from 0 on.
    #[error("{0} s is no time to plan from")]
    Time(f64),
    /// Planned from later already.
    #[error("at {at_s:.2} s is before {known_s:.2} s, from when on this plan was made")]
    Past {
        /// Asked for (s).
        at_s: f64,
        /// Of the plan (s).
        known_s: f64,
    },
    /// Nobody is called that.
    #[error("no drone is called `{0}`")]
    Unknown(String),
    /// Somebody is called that already, or was.
    #[error("`{0}` is in the plan already; give the drone that comes another name")]
    Known(String),
    /// More than one change.
    #[error("`{0}` changes twice; say all of it in one change")]
    Twice(String),
    /// It has left or was taken out.
    #[error("`{0}` is not there any more")]
    Gone(String),
    /// A number that makes no sense.
    #[error("`{drone}`: its {what} is {value}")]
    Number {
        /// Who.
        drone: String,
        /// Which number.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A place where it cannot be.
    #[error("`{drone}` cannot be at {place}: {why}")]
    Misplaced {
        /// Who.
        drone: String,
        /// Its start, a task or its landing, and where.
        place: String,
        /// What is in the way.
        why: String,
    },
    /// Larger than all whom the roadmap was made for.
    #[error(
        "the body of `{drone}` has a radius of {radius_m:.3} m, and the roadmap is made for {known_m:.3} m at most; \
         plan the whole scenario with it"
    )]
    TooLarge {
        /// Who.
        drone: String,
        /// m.
        radius_m: f64,
        /// m.
        known_m: f64,
    },
}

/// All that is wrong with these changes; `is_there` says who can still be changed.
pub(super) fn problems(
    world: &World,
    solids: &Solids,
    widest_m: f64,
    changes: &[Change],
    is_there: impl Fn(usize) -> bool,
) -> Vec<ChangeError> {
    let mut found = Vec::new();
    let mut seen = BTreeSet::new();
    let mut placed = World {
        drones: Vec::new(),
        ..world.clone()
    };
    for change in changes {
        let name = change.drone();
        if !seen.insert(name) {
            found.push(ChangeError::Twice(name.to_owned()));
        }
        let index = world.drones.iter().position(|drone| drone.name == name);
        match (change, index) {
            (Change::Added(_), Some(_)) => found.push(ChangeError::Known(name.to_owned())),
            (Change::Added(drone), None) => {
                found.extend(numbers(drone));
                let radius_m = drone.vehicle.body_radius_m;
                if radius_m + world.planning.clearance_m > widest_m {
                    found.push(ChangeError::TooLarge {
                        drone: name.to_owned(),
                        radius_m,
                        known_m: widest_m - world.planning.clearance_m,
                    });
                }
                placed.drones.push(drone.clone());
            }
            (_, None) => found.push(ChangeError::Unknown(name.to_owned())),
            (_, Some(index)) if !is_there(index) => found.push(ChangeError::Gone(name.to_owned())),
            (Change::Late { by_s, .. }, _) if !(by_s.is_finite() && *by_s >= 0.0) => {
                found.push(ChangeError::Number {
                    drone: name.to_owned(),
                    what: "delay (s)",
                    value: *by_s,
                });
            }
            (Change::Retasked { tasks, .. }, Some(index)) => {
                let drone = Drone {
                    tasks: tasks.clone(),
                    start_m: tasks
                        .first()
                        .map_or(world.drones[index].start_m, |task| task.to_m),
                    at_start: AtStart::Hover,
                    ..world.drones[index].clone()
                };
                found.extend(numbers(&drone));
                placed.drones.push(drone);
            }
            _ => {}
        }
    }
    let finite = |drone: &Drone| {
        let tasks = drone.tasks.iter().map(|task| task.to_m);
        tasks
            .chain([drone.start_m])
            .all(|at_m| at_m.iter().all(|c| c.is_finite()))
    };
    placed.drones.retain(finite);
    // Where the others are is not asked: they are there.
    let comes = |name: &str| {
        let added = |change: &Change| matches!(change, Change::Added(_)) && change.drone() == name;
        changes.iter().any(added)
    };
    found.extend(misplacements(&placed, solids, comes));
    found
}

fn numbers(drone: &Drone) -> Vec<ChangeError> {
    let mut found = Vec::new();
    let mut asked = |what: &'static str, value: f64, ok: bool| {
        if !(value.is_finite() && ok) {
            found.push(ChangeError::Number {
                drone: drone.name.clone(),
                what,
                value,
            });
        }
    };
    for task in &drone.tasks {
        asked("dwell (s)", task.dwell_s, task.dwell_s >= 0.0);
        let load_kg = task.load_kg.unwrap_or(0.0);
        asked("load (kg)", load_kg, load_kg >= 0.0);
        for axis in 0..3 {
            asked("place (m)", task.to_m[axis], true);
        }
    }
    for axis in 0..3 {
        asked("place (m)", drone.start_m[axis], true);
    }
    asked("air limit", drone.air_limit, drone.air_limit >= 0.0);
    let vehicle = &drone.vehicle;
    asked(
        "highest speed (m/s)",
        vehicle.max_speed_mps,
        vehicle.max_speed_mps > 0.0,
    );
    asked(
        "body radius (m)",
        vehicle.body_radius_m,
        vehicle.body_radius_m > 0.0,
    );
    found
}

fn misplacements(
    placed: &World,
    solids: &Solids,
    comes: impl Fn(&str) -> bool,
) -> Vec<ChangeError> {
    let mut found: Vec<ChangeError> = Vec::new();
    for it in misplaced(placed, solids) {
        if it.spot == Spot::Start && !comes(&placed.drones[it.drone].name) {
            continue;
        }
        let at = format!(
            "({:.2}, {:.2}, {:.2})",
            it.place_m.x, it.place_m.y, it.place_m.z
        );
        found.push(ChangeError::Misplaced {
            drone: placed.drones[it.drone].name.clone(),
            place: match it.spot {
                Spot::Start => format!("its start {at}"),
                Spot::Task(task) => format!("task {} {at}", task + 1),
                Spot::Landing => format!("its landing {at}"),
            },
            why: match it.why {
                Misfit::OutOfBounds { by_m } => format!("{by_m:.2} m out of bounds"),
                Misfit::Obstacle {
                    obstacle,
                    distance_m,
                    needs_m,
                } => format!(
                    "{distance_m:.2} m to `{}`, it needs {needs_m:.2} m",
                    placed.obstacles[obstacle].name
                ),
            },
        });
    }
    for drone in &placed.drones {
        let last_m = drone.tasks.last().map_or(drone.start_m, |task| task.to_m);
        let known = |error: &ChangeError| matches!(error, ChangeError::Misplaced { drone: name, .. } if *name == drone.name);
        if let Err(short_m) = ending_from(placed, solids, drone, last_m)
            && !found.iter().any(known)
        {
            found.push(ChangeError::Misplaced {
                drone: drone.name.clone(),
                place: "the end of its descent".to_owned(),
                why: format!("{short_m:.2} m too little room beside an obstacle"),
            });
        }
    }
    found
}
