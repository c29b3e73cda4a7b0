use costmap::verdict::Verdict;

use super::*;
use crate::scenario::read_world;
use crate::solver::prepare::{Job, prepare};

const HALL: &str = r#"Scenario(
    name: "crowd",
    bounds_m: (min: (0, 0, 0), max: (7, 7, 8)),
    obstacles: [(name: "rack", min_m: (3, 0, 0), max_m: (5, 7, 3))],
    drones: [
        (name: "a", airframe: "offboard-2", start_m: (0.5, 0.5, 4.5), tasks: [(to_m: (6.5, 6.5, 6.5))]),
        (name: "b", airframe: "kolibri", start_m: (6.5, 0.5, 4.5), tasks: [(to_m: (0.5, 6.5, 2.5))]),
    ],
)"#;

fn job() -> (Job, Costmap) {
    let world = read_world(HALL).expect("in order");
    let job = prepare(&world);
    let costmap = job.costmap(&world, true, world.drones.len());
    (job, costmap)
}

/// A step of the second drone, half a second long.
fn step(job: &Job, drone: usize, from: [i32; 3], way: usize, start: u32) -> Option<Leg> {
    let lattice = job.roadmap.lattice();
    let to = [0, 1, 2].map(|axis| from[axis] + cells(way)[axis]);
    let agent = &job.agents[drone];
    let axes = cells(way).iter().filter(|cells| **cells != 0).count();
    let ticks = agent.mover.step_ticks()[axes.max(1) - 1];
    Some(Leg {
        drone: agent.drone,
        kind: agent.kinds[0],
        start: Tick(start),
        end: Tick(start + ticks),
        from_m: lattice.position_m(lattice.at(from)?),
        to_m: lattice.position_m(lattice.at(to)?),
        flying: true,
        air_limit: agent.air_limit,
    })
}

fn vertices(job: &Job, leg: &Leg) -> [Vertex; 2] {
    let lattice = job.roadmap.lattice();
    [leg.from_m, leg.to_m].map(|at_m| lattice.place_at(&at_m).expect("on the lattice"))
}

/// Every way past every way: what the tables let pass, the costmap lets pass.
#[test]
fn no_step_that_the_costmap_forbids_is_free_in_the_crowd() {
    let (job, empty) = job();
    let steps = Steps::new(job.roadmap.lattice(), &job.agents, &empty).expect("a small fleet");
    let (mut forbidden, mut taken, mut tried) = (0, 0, 0);
    for case in 0..27 * 27 {
        let (way, others) = (case % 27, case / 27);
        let Some(other) = step(&job, 1, [3, 3, 4], others, 200) else {
            continue;
        };
        let mut costmap = empty.clone();
        costmap.insert(vec![other]);
        let reservations = ReservationTable::new(&steps, &costmap);
        for offset in 0..60 {
            let from = [
                2 + offset % 3,
                2 + offset / 3 % 3,
                (1 + 2 * (offset / 9)).min(7),
            ];
            let start = (130 + (case as u32 * 37 + offset as u32 * 11) % 140).max(1);
            let Some(leg) = step(&job, 0, from, way, start) else {
                continue;
            };
            let mut exact = Verdict::default();
            costmap.judge(&leg, &mut exact);
            let query = StepQuery {
                class: reservations.class(leg.drone, leg.kind).expect("known"),
                way: vertices(&job, &leg),
                time: [leg.start, leg.end],
            };
            let mut brief = Verdict::default();
            let mut is_free = reservations.step(&costmap, &query, &mut brief);
            if way == STILL {
                reservations.stay(query.class, query.way[0], query.time, &mut brief);
                is_free = true;
            }
            let allows = is_free && brief.blockers.is_empty();
            assert!(
                exact.is_allowed() || !allows,
                "{way} past {others} from {from:?} at {start}: {exact:?}"
            );
            forbidden += usize::from(!exact.is_allowed());
            taken += usize::from(!brief.blockers.is_empty());
            tried += 1;
        }
    }
    // Too careful by less than a tenth of all: the rest of a budget is kept for wakes farther off.
    assert!(forbidden > 3000, "{forbidden}");
    assert!(
        taken - forbidden < tried / 10,
        "{taken} {forbidden} {tried}"
    );
}

/// A drone in the way of a step is no more when its departures are said to be clear.
#[test]
fn a_step_is_free_when_it_departs_after_all_are_clear() {
    let (job, empty) = job();
    let steps = Steps::new(job.roadmap.lattice(), &job.agents, &empty).expect("a small fleet");
    let mut met = 0;
    for case in 0..26 * 26 {
        let direction = |index: usize| index + usize::from(index >= STILL);
        let (way, others) = (direction(case % 26), direction(case / 26));
        let other = step(&job, 1, [3, 3, 4], others, 200).expect("inside");
        let mut costmap = empty.clone();
        costmap.insert(vec![other]);
        let reservations = ReservationTable::new(&steps, &costmap);
        for z in [3, 4, 6] {
            let leg = step(&job, 0, [3, 3, z], way, 210).expect("inside");
            let ask = |departs: u32| {
                let mut verdict = Verdict::default();
                let query = StepQuery {
                    class: reservations.class(leg.drone, leg.kind).expect("known"),
                    way: vertices(&job, &leg),
                    time: [Tick(departs), Tick(departs + leg.end.0 - leg.start.0)],
                };
                reservations.step(&costmap, &query, &mut verdict);
                verdict.blockers
            };
            if let Some(blocker) = ask(210).first() {
                met += 1;
                assert!(blocker.began < Tick(210) && Tick(210) < blocker.clear);
                assert_eq!(ask(blocker.clear.0), []);
                assert_eq!(ask(blocker.began.0), []);
            }
        }
    }
    assert!(met > 500, "{met}");
}

#[test]
fn who_is_taken_back_leaves_nothing_behind() {
    let (job, mut costmap) = job();
    let steps = Steps::new(job.roadmap.lattice(), &job.agents, &costmap).expect("a small fleet");
    let first = step(&job, 0, [3, 3, 4], 14, 0).expect("inside");
    let second = step(&job, 1, [3, 4, 6], 22, 30).expect("inside");
    let hover = Leg {
        start: second.end,
        end: Tick::FOREVER,
        from_m: second.to_m,
        ..second
    };
    costmap.insert(vec![first]);
    let before = ReservationTable::new(&steps, &costmap);
    costmap.insert(vec![second, hover]);
    let mut reservations = before.clone();
    reservations.insert(costmap.legs(second.drone));
    let place = job
        .roadmap
        .lattice()
        .place_at(&hover.to_m)
        .expect("a place");
    let below = job.roadmap.lattice().at([3, 4, 6]).expect("a place");
    let class = reservations.class(first.drone, first.kind).expect("known");
    assert_eq!(reservations.closed_from(class)[place as usize], hover.start);
    assert_ne!(reservations.taken, before.taken);
    assert!(reservations.closed_from(class)[below as usize] <= hover.start);
    reservations.remove(costmap.legs(second.drone));
    assert_eq!(reservations.columns, before.columns);
    assert_eq!(reservations.glances, before.glances);
    assert_eq!(reservations.taken, before.taken);
    assert_eq!(reservations.closed, before.closed);
}
