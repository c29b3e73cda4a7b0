//! A fleet manager in one file: plan a shift, fly four seconds of it, take a new order, plan again.
//!
//! ```text
//! cargo run --release -p leeward-planner --example fleet_manager
//! ```
//!
//! Nothing is read and nothing is written: a scenario goes in as text, plans come out as plain
//! data.

use std::error::Error;
use std::process::ExitCode;

use nalgebra::Point3;
use planner::plan::Plan;
use planner::plan::outcome::{Control, Outcome};
use planner::read_world;
use planner::scenario::world::{AtStart, Task, World};

/// Two scouts count stock on their sides of a rack while a heavy drone crosses the hall above them.
const SHIFT: &str = r#"Scenario(
  name: "shift",
  bounds_m: (min: (0, 0, 0), max: (20, 12, 8)),
  obstacles: [(name: "rack", min_m: (6, 5, 0), max_m: (14, 6, 4))],
  drones: [
    (name: "lifter", airframe: "matrice-300", start_m: (2, 8, 6.5), tasks: [(to_m: (18, 8, 6.5))]),
    (name: "scout-1", airframe: "kolibri", start_m: (18, 8, 1.5), tasks: [(to_m: (2, 8, 1.5), dwell_s: 5)]),
    (name: "scout-2", airframe: "kolibri", start_m: (2, 2, 1.5), tasks: [(to_m: (18, 2, 1.5), dwell_s: 5)]),
  ],
)"#;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let world = read_world(SHIFT)?;
    let Some(plan) = planned(&world)? else {
        return Ok(ExitCode::FAILURE);
    };
    tell("the shift", &plan);

    let now_s = 4.0;
    let mut rest = at_time(&world, &plan, now_s);
    let order = Task {
        to_m: Point3::new(10.0, 9.0, 1.5),
        dwell_s: 3.0,
        load_kg: None,
        during_s: None,
    };
    if let Some(scout) = rest.drones.iter_mut().find(|drone| drone.name == "scout-2") {
        scout.tasks.push(order);
    }
    let Some(plan) = planned(&rest)? else {
        return Ok(ExitCode::FAILURE);
    };
    tell("after 4 s, with one more order for scout-2", &plan);
    Ok(ExitCode::SUCCESS)
}

/// A plan that is safe; what keeps it from being so is told otherwise.
fn planned(world: &World) -> Result<Option<Plan>, Box<dyn Error>> {
    match planner::plan_world(world, &Control::QUIET)? {
        Outcome::Safe(planned) => return Ok(Some(planned.plan)),
        Outcome::Partial(planned) => {
            for failure in &planned.failures {
                eprintln!("{} stays: {}", failure.drone, failure.cause);
            }
        }
        Outcome::Unsafe(planned) => {
            eprintln!(
                "not to be flown: {} violations",
                planned.plan.violations.len()
            );
        }
        Outcome::Infeasible { conflicts } => {
            eprintln!("{} pairs of starts exclude one another", conflicts.count());
        }
    }
    Ok(None)
}

/// What is left of a world once its plan has been flown up to a time (s): every drone starts where
/// it is, and keeps its one task until that is done. Who has several tasks or a load keeps books of
/// its own.
fn at_time(world: &World, plan: &Plan, now_s: f64) -> World {
    let mut rest = world.clone();
    for (drone, flown) in rest.drones.iter_mut().zip(&plan.drones) {
        if let Some(position_m) = flown.trajectory.position_m(now_s) {
            drone.start_m = position_m;
        }
        let (from_s, until_s) = flown.airborne_s;
        let airborne = from_s <= now_s && until_s.is_none_or(|until_s| now_s < until_s);
        drone.at_start = if airborne {
            AtStart::Hover
        } else {
            AtStart::Landed
        };
        if flown.arrives_s <= now_s {
            drone.tasks.clear();
        }
    }
    rest
}

fn tell(when: &str, plan: &Plan) {
    println!("{when}: all done in {:.1} s", plan.fleet.makespan_s);
    for drone in &plan.drones {
        println!(
            "  {:8} arrives {:5.1} s ({:.1} s if alone), worst air {:.2} m/s of {:.2} allowed",
            drone.name,
            drone.arrives_s,
            drone.alone_s,
            drone.worst_air_mps,
            drone.air_limit * drone.airframe.hover_induced_velocity_mps,
        );
    }
}
