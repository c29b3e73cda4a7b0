use super::habits::direction;
use super::*;
use crate::prepare::{empty_costmap, prepare};
use crate::scenario::read_world;

const HALL: &str = r#"Scenario(
    name: "crowd",
    bounds_m: (min: (0, 0, 0), max: (7, 7, 8)),
    obstacles: [(name: "rack", min_m: (3, 0, 0), max_m: (5, 7, 3))],
    drones: [
        (name: "a", airframe: "offboard-2", start_m: (0.5, 0.5, 4.5), tasks: [(to_m: (6.5, 6.5, 6.5))]),
        (name: "b", airframe: "kolibri", start_m: (6.5, 0.5, 4.5), tasks: [(to_m: (0.5, 6.5, 2.5))]),
    ],
)"#;

/// What the lists forbid is what the costmap forbids, but for the part of a step in which that changes.
#[test]
fn places_are_taken_when_the_costmap_says_so() {
    let world = read_world(HALL, &|file| Err(file.to_owned())).expect("in order");
    let job = prepare(&world);
    let empty = empty_costmap(&world, job.roadmap.lattice(), true);
    let habits = Habits::new(&job.roadmap, &job.errands, &empty).expect("a small fleet");
    let lattice = job.roadmap.lattice();
    let (me, other) = (&job.errands[0], &job.errands[1]);
    let mut forbidden = 0;
    for way in 0..27 {
        let from = [3, 3, 4];
        let d = direction(way);
        let to = [0, 1, 2].map(|axis| from[axis] + d[axis]);
        let at_m = |steps| lattice.position_m(lattice.at(steps).expect("inside"));
        let leg = Leg {
            drone: other.drone,
            kind: other.kinds[0],
            start: Tick(100),
            end: Tick(100 + 2 * PARTS),
            from_m: at_m(from),
            to_m: at_m(to),
            flying: true,
            air_limit: other.air_limit,
        };
        let mut costmap = empty.clone();
        costmap.insert(vec![leg]);
        let mut crowd = Crowd::new(&habits);
        crowd.insert(&costmap, &[leg]);
        for place in 0..lattice.place_count() as u32 {
            let ticks = leg.start.0..leg.end.0;
            let is_forbidden = |tick: u32| {
                let hover = Leg {
                    drone: me.drone,
                    kind: me.kinds[0],
                    start: Tick(tick),
                    end: Tick(tick + 1),
                    from_m: lattice.position_m(place),
                    to_m: lattice.position_m(place),
                    flying: true,
                    air_limit: me.air_limit,
                };
                let mut verdict = Verdict::default();
                costmap.judge(&hover, &mut verdict);
                !verdict.is_allowed()
            };
            let is_taken = |tick: u32| {
                let mut verdict = Verdict::default();
                let time = [Tick(tick), Tick(tick + 1)];
                crowd.stay(me.kinds[0], me.air_limit, place, time, &mut verdict);
                !verdict.is_allowed()
            };
            let asked: Vec<bool> = ticks.clone().map(is_forbidden).collect();
            let listed: Vec<bool> = ticks.map(is_taken).collect();
            for tick in 0..asked.len() {
                // A part of its time, two ticks here, is the finest that is told apart.
                let near = tick.saturating_sub(3)..(tick + 4).min(asked.len());
                let agrees = near.into_iter().any(|other| listed[tick] == asked[other]);
                assert!(agrees, "direction {way}, place {place}, tick {tick}");
            }
            forbidden += asked.iter().filter(|it| **it).count();
        }
        crowd.remove(&costmap, &[leg]);
        assert_eq!(crowd.entries, Crowd::new(&habits).entries);
    }
    assert!(forbidden > 1000);
}
