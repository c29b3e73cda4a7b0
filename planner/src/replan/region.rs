//! A fleet planned around drones that are not its own: their trajectories are fixed, their bodies
//! and wakes moving obstacles. So several planners can own several areas, each told what the others
//! fly.
//!
//! ```
//! use planner::plan::outcome::{Control, Outcome};
//!
//! let theirs = planner::read_world(r#"Scenario(name: "theirs", bounds_m: (min: (0, 0, 0), max: (12, 8, 6)),
//!     drones: [(name: "lifter", airframe: "matrice-300", start_m: (6, 1, 5), tasks: [(to_m: (6, 7, 5))])])"#);
//! let ours = planner::read_world(r#"Scenario(name: "ours", bounds_m: (min: (0, 0, 0), max: (12, 8, 6)),
//!     drones: [(name: "scout", airframe: "kolibri", start_m: (2, 4, 1), tasks: [(to_m: (10, 4, 1))])])"#);
//! let (theirs, ours) = (theirs.expect("in order"), ours.expect("in order"));
//!
//! let theirs = planner::plan_world(&theirs, &Control::QUIET).expect("in order");
//! let plan = theirs.into_planned().expect("a plan").plan;
//! let told = planner::replan::region::plan_region(&ours, &plan.drones, &Control::QUIET)?;
//! let Outcome::Safe(both) = told else { panic!("no safe plan") };
//! let both = both.plan;
//! assert_eq!(both.drones[1].trajectory, plan.drones[0].trajectory);
//! # Ok::<(), Vec<planner::replan::GivenError>>(())
//! ```

use costmap::leg::DroneId;

use crate::plan::DronePlan;
use crate::plan::outcome::{Control, Failure, Outcome, Progress};
use crate::replan::track::{legs_of, path_deviation_m};
use crate::replan::{GivenError, given};
use crate::scenario::world::World;
use crate::solver::assemble::assemble;
use crate::solver::explain::known_cause;
use crate::solver::fleet::{FleetRun, Solved, by_open_rules, unplanned_of};
use crate::solver::relaxed::weaker;
use crate::verify::{judged, verify};

/// Plans a fleet around `others`, whose trajectories stay as they are, and verifies all of them
/// together.
///
/// The others are obstacles that move: their bodies and wakes are in the costmap before the first
/// drone of the fleet is planned, and no search may displace them. They are checked by the same
/// ranges as a scenario's drones. Times of both count from the same moment. In the plan the fleet
/// comes first, in the world's order, then the others as they were given, but for the air that they
/// meet now. Sums over the fleet are over its own.
///
/// # Errors
///
/// All that is wrong with the world, or else with the others: names that are taken, trajectories
/// that cannot be read, numbers out of range.
pub fn plan_region(
    world: &World,
    others: &[DronePlan],
    control: &Control<'_>,
) -> Result<Outcome, Vec<GivenError>> {
    if let Err(faults) = world.check() {
        let faults = faults.0.into_iter();
        return Err(faults.map(|it| GivenError::World(Box::new(it))).collect());
    }
    let all = joined(world, others)?;
    let own = world.drones.len();
    let fixed_path_deviation_m = (others.iter().zip(&all.drones[own..]))
        .map(|(entry, drone)| path_deviation_m(drone, entry))
        .fold(0.0, f64::max);
    let solve = |run: &mut FleetRun<'_>| {
        let fixed = others.iter().zip(&all.drones[own..]).enumerate();
        let fixed = fixed.map(|(index, (entry, drone))| {
            let id = DroneId((own + index) as u32);
            legs_of(id, entry, false, |mass_kg| {
                run.job.kinds.kind(&drone.vehicle, mass_kg)
            })
        });
        let fixed: Vec<_> = fixed.collect();
        run.job.fixed_path_deviation_m = fixed_path_deviation_m;
        let mut all = all.clone();
        (all.planning.motion, all.convection) = (run.world.planning.motion, run.world.convection);
        let costmap = run.job.costmap(&all, all.drones.len());
        Some((run.paths(costmap, fixed)?, Vec::new()))
    };
    let weaker = weaker(world);
    let solved = by_open_rules(world, &weaker, control, solve);
    let Solved {
        run, paths, notes, ..
    } = match solved {
        Ok(solved) => solved,
        Err(conflicts) => return Ok(Outcome::Infeasible { conflicts }),
    };
    let failures = paths.unplanned.iter().map(|&(drone, why)| Failure {
        drone: all.drones[drone.0 as usize].name.clone(),
        cause: known_cause(&all, why),
    });
    let failures: Vec<Failure> = failures.collect();

    (control.progress)(Progress::Verifying);
    let mut plan = assemble(run.world, &run.job, &paths);
    plan.drones.extend_from_slice(others);
    let report = verify(&plan);
    let mut plan = judged(plan, report, unplanned_of(&failures));
    let energy_j = plan.drones[..own].iter().map(|drone| drone.extra_energy_j);
    plan.fleet.extra_energy_j = energy_j.sum();
    Ok(run.answer(plan, failures, notes))
}

/// The world with the others in it, which have nothing to do in it.
fn joined(world: &World, others: &[DronePlan]) -> Result<World, Vec<GivenError>> {
    let mut joined = world.clone();
    let mut problems = Vec::new();
    for entry in others {
        if joined.drones.iter().any(|known| known.name == entry.name) {
            problems.push(GivenError::Twice(entry.name.clone()));
        }
        match given(entry, world) {
            Ok(drone) => joined.drones.push(drone),
            Err(error) => problems.push(error),
        }
    }
    match problems.is_empty() {
        true => Ok(joined),
        false => Err(problems),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::read_world;

    fn read(drones: &str) -> World {
        let text = format!(
            r#"Scenario(name: "area", bounds_m: (min: (0, 0, 0), max: (16, 9, 6)), drones: [{drones}])"#
        );
        read_world(&text).expect("in order")
    }

    fn planned(outcome: Outcome) -> crate::plan::Plan {
        outcome.into_planned().expect("a plan").plan
    }

    const THEIRS: &str = r#"(name: "lifter", airframe: "matrice-300", start_m: (8.5, 4.5, 5),
        tasks: [(to_m: (8.5, 4.5, 4.5), dwell_s: 8), (to_m: (1.5, 7.5, 5))])"#;
    const OURS: &str = r#"(name: "scout", airframe: "kolibri", start_m: (5.5, 4.5, 0.5),
        tasks: [(to_m: (12.5, 4.5, 0.5))])"#;

    #[test]
    fn a_fleet_that_knows_of_others_keeps_out_of_their_wakes() {
        let theirs = planned(crate::plan_world(&read(THEIRS), &Control::QUIET).expect("in order"));
        let ours = read(OURS);
        let told = plan_region(&ours, &theirs.drones, &Control::QUIET).expect("readable");
        let told = planned(told);
        assert_eq!(told.violations, []);
        assert!(told.unplanned.is_empty());
        assert_eq!(told.drones[1].trajectory, theirs.drones[0].trajectory);
        let mut untold = planned(crate::plan_world(&ours, &Control::QUIET).expect("in order"));
        untold.drones.extend_from_slice(&theirs.drones);
        assert!(!verify(&untold).violations.is_empty());
        assert!(told.drones[0].arrives_s > untold.drones[0].arrives_s);
    }

    #[test]
    fn a_drone_that_meets_others_in_a_corridor_steps_aside_and_returns() {
        let corridor = |drones: &str| {
            let text = format!(
                r#"Scenario(name: "corridor", bounds_m: (min: (0, 0, 0), max: (20, 6, 3)), obstacles: [
                (name: "south", min_m: (4, 0, 0), max_m: (16, 2.6, 3)),
                (name: "north", min_m: (4, 3.4, 0), max_m: (16, 6, 3))], drones: [{drones}])"#
            );
            read_world(&text).expect("in order")
        };
        let theirs = corridor(
            r#"(name: "theirs", airframe: "kolibri", start_m: (1, 3, 1), tasks: [(to_m: (19, 5, 1))])"#,
        );
        let theirs = planned(crate::plan_world(&theirs, &Control::QUIET).expect("in order"));
        let ours = corridor(
            r#"(name: "ours", airframe: "offboard-1", start_m: (16, 3, 1), tasks: [(to_m: (1, 3, 1))])"#,
        );
        let told = plan_region(&ours, &theirs.drones, &Control::QUIET).expect("readable");
        let told = planned(told);
        assert_eq!((told.violations, told.unplanned), (Vec::new(), Vec::new()));
    }

    #[test]
    fn times_between_ticks_are_passed_by_closely() {
        let mut theirs =
            planned(crate::plan_world(&read(THEIRS), &Control::QUIET).expect("in order"));
        for t_s in &mut theirs.drones[0].trajectory.t_s[1..] {
            *t_s += 0.0037;
        }
        let told = plan_region(&read(OURS), &theirs.drones, &Control::QUIET).expect("readable");
        assert_eq!(planned(told).violations, []);
    }

    #[test]
    fn all_that_cannot_be_read_is_reported() {
        let mut theirs =
            planned(crate::plan_world(&read(THEIRS), &Control::QUIET).expect("in order"));
        let mut twice = theirs.drones[0].clone();
        twice.name = "scout".to_owned();
        theirs.drones[0].trajectory.t_s.clear();
        theirs.drones.push(twice);
        let errors = plan_region(&read(OURS), &theirs.drones, &Control::QUIET).expect_err("two");
        assert_eq!(errors.len(), 2);
    }

    #[test]
    fn curves_of_others_are_kept_clear_of_by_straight_and_smooth_flights() {
        let mut theirs = read(THEIRS);
        theirs.planning.motion = crate::scenario::world::PathMotion::Smooth;
        let theirs = planned(crate::plan_world(&theirs, &Control::QUIET).expect("in order"));
        assert!(theirs.drones[0].trajectory.is_smooth());
        for motion in [
            crate::scenario::world::PathMotion::Straight,
            crate::scenario::world::PathMotion::Smooth,
        ] {
            let mut ours = read(OURS);
            ours.planning.motion = motion;
            let told = plan_region(&ours, &theirs.drones, &Control::QUIET).expect("readable");
            let told = planned(told);
            assert_eq!(told.violations, []);
            assert!(told.unplanned.is_empty());
            assert_eq!(told.drones[1].trajectory, theirs.drones[0].trajectory);
        }
    }
}
