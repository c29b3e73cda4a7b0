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
use planner::replan::change::Change;
use planner::{Control, Outcome, Running, Task, read_world};

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
    let Outcome::Safe(planned) = planner::plan_world(&world, &Control::QUIET)? else {
        eprintln!("the shift cannot be flown as it is");
        return Ok(ExitCode::FAILURE);
    };
    tell("the shift", &planned.plan);

    // Drones under way, and their air, go on from where they are; those that need not change keep
    // their trajectories.
    let mut running = Running::new(world, planned.plan)?;
    let mut tasks = running.world().drones[2].tasks.clone();
    tasks.push(Task {
        to_m: Point3::new(10.0, 9.0, 1.5),
        dwell_s: 3.0,
        load_kg: None,
        during_s: None,
    });
    let order = Change::Retasked {
        drone: "scout-2".to_owned(),
        tasks,
    };
    let told = match running.replan(4.0, &[order], &Control::QUIET) {
        Ok(told) => told,
        Err(problems) => {
            problems.iter().for_each(|problem| eprintln!("{problem}"));
            return Ok(ExitCode::FAILURE);
        }
    };
    for changed in &told.changed {
        println!("{} changes its path: {:?}", changed.drone, changed.cause);
    }
    tell(
        "from 4 s on, with one more order for scout-2",
        running.plan(),
    );
    let is_safe = told.refused.is_empty() && running.plan().violations.is_empty();
    Ok(ExitCode::from(u8::from(!is_safe)))
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
