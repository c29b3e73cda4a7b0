//! PIBT until nearly every drone is home; the others are planned among those
//! who are.

use costmap::leg::{DroneId, Leg};

use super::whole::{MOST_EXPANSIONS_A_DRONE, Setting, known_hopeless};
use super::{Attempt, Paths, stays_at_start};
use crate::graph::agent::Agent;
use crate::graph::roadmap::Roadmap;
use crate::plan::outcome::Effort;
use crate::sipp::conflicts::ReservationTable;
use crate::sipp::search::{IMMOVABLE, Path};
use crate::solver::pibt::run_pibt;

/// Ways for every drone but those who are excluded, or `None`.
pub(super) fn plan_by_pibt(setting: &Setting<'_>, effort: &mut Effort) -> Option<Paths> {
    let Setting {
        job,
        costmap,
        excluded,
        control,
        ..
    } = *setting;
    let steps = setting.steps?;
    if known_hopeless(job, excluded) > excluded.len() {
        return None;
    }
    let fixed: Vec<DroneId> = excluded.iter().map(|(drone, _)| *drone).collect();
    let seed = setting.planning.seed;
    let run = run_pibt(job, costmap, steps, &fixed, seed, control, effort)?;
    let most = effort.expansions + MOST_EXPANSIONS_A_DRONE * job.agents.len() as u64;
    let mut attempt = Attempt::new(
        &job.roadmap,
        &run.agents,
        costmap.clone(),
        setting.planning.energy_weight,
        control,
        effort,
    );
    attempt.gives_up_at = Some(most);
    attempt.detours = false;
    attempt.reservations = Some(ReservationTable::new(steps, costmap));
    let mut waiting = Vec::new();
    for (index, agent) in run.agents.iter().enumerate() {
        if run.fixed[index] {
            attempt.reserve(vec![stays_at_start(agent, &job.roadmap)]);
            attempt.weights[index] = IMMOVABLE;
        } else if run.home[index] {
            let legs = vec![stays(agent, &job.roadmap)];
            attempt.reserve(legs.clone());
            attempt.paths[index] = Some(Path {
                legs,
                arrives: agent.departs,
                met: Vec::new(),
            });
        } else {
            waiting.push((agent.alone_ticks, agent.drone));
        }
    }
    waiting.sort_unstable();
    let is_through = attempt.run(waiting.into_iter().map(|(_, drone)| drone).collect());
    if !is_through || !attempt.unplanned.is_empty() {
        return None;
    }
    let moved = |(path, agent): (Option<Path>, &Agent)| {
        path.filter(|path| path.legs != [stays(agent, &job.roadmap)])
    };
    let planned = attempt.paths.into_iter().zip(&run.agents).map(moved);
    let planned = planned.collect();
    let (paths, costmap) = run.whole(job, costmap, planned)?;
    let mut paths: Vec<Option<Path>> = paths.into_iter().map(Some).collect();
    for (drone, _) in excluded {
        paths[drone.0 as usize] = None;
    }
    Some(Paths {
        paths,
        unplanned: excluded.to_vec(),
        costmap,
    })
}

/// What a drone does that is home.
fn stays(agent: &Agent, roadmap: &Roadmap) -> Leg {
    let kind = agent.kinds[agent.kinds.len() - 1];
    Leg {
        start: agent.departs,
        ..agent.hover(roadmap.position_m(agent.start), kind)
    }
}

#[cfg(test)]
mod tests {
    use costmap::leg::Tick;

    use super::*;
    use crate::graph::agent::Ending;
    use crate::plan::outcome::Control;
    use crate::scenario::world::AtEnd;
    use crate::sipp::conflicts::Steps;
    use crate::solver::assemble::assemble;
    use crate::solver::prepare::{empty_costmap, prepare};
    use crate::verify::verify;

    /// Sixty drones on twelve metres by twelve, two tasks each, the first with a dwell.
    #[test]
    fn steps_together_and_those_left_make_a_plan_that_the_verifier_finds_nothing_in() {
        let text = tools::instances::hall(60, 2).expect("there is room");
        let mut world = crate::scenario::read_world(&text).expect("in order");
        let column = |index: usize| {
            (
                (index * 53 % 144 % 12) as f64 + 0.5,
                (index * 53 % 144 / 12) as f64 + 0.5,
            )
        };
        for (index, drone) in world.drones.iter_mut().enumerate() {
            (drone.start_m.x, drone.start_m.y) = column(index);
            let mut first = drone.tasks[0].clone();
            (first.to_m.x, first.to_m.y) = column(index + 31);
            first.dwell_s = 0.7 * (index % 3) as f64;
            (drone.tasks[0].to_m.x, drone.tasks[0].to_m.y) = column(index + 83);
            drone.tasks.insert(0, first);
            drone.at_end = match index % 6 {
                0 => AtEnd::Land,
                3 => AtEnd::Leave,
                _ => AtEnd::Hover,
            };
        }
        world.drones[7].tasks.clear();
        (world.bounds_m.max.x, world.bounds_m.max.y) = (12.0, 12.0);
        let job = prepare(&world);
        let costmap = empty_costmap(&world, job.roadmap.lattice(), true);
        let steps = Steps::new(job.roadmap.lattice(), &job.agents, &costmap);
        let setting = Setting {
            job: &job,
            costmap: &costmap,
            steps: steps.as_ref(),
            excluded: &[],
            planning: &world.planning,
            control: &Control::QUIET,
        };
        let mut effort = Effort::default();
        let paths = plan_by_pibt(&setting, &mut effort).expect("every drone comes home");
        assert!(effort.rounds > 0);
        let report = verify(&assemble(&world, &job, &paths));
        assert!(report.violations.is_empty(), "{:#?}", report.violations);
        for (path, agent) in paths.paths.iter().flatten().zip(&job.agents) {
            let last = path.legs.last().expect("it flies");
            let goal_m = job.roadmap.position_m(agent.last_vertex());
            match agent.ending {
                Ending::Hover => assert_eq!((last.to_m, last.end), (goal_m, Tick::FOREVER)),
                Ending::Leave => assert_eq!(last.to_m, goal_m),
                Ending::Land { rest_m, .. } => {
                    assert_eq!((last.to_m, last.flying), (rest_m, false))
                }
            }
            if agent.waypoints.is_empty() {
                assert_eq!(path.legs.len(), 1, "no drone without a task is displaced");
                continue;
            }
            let passes = |leg: &Leg| {
                leg.stays()
                    && leg.from_m == job.roadmap.position_m(agent.waypoints[0].distances.goal())
            };
            let dwells = path.legs.iter().filter(|leg| passes(leg));
            let longest = dwells.map(|leg| leg.end.0 - leg.start.0).max();
            assert!(longest.unwrap_or(0) >= agent.waypoints[0].dwell_ticks);
        }
    }
}
