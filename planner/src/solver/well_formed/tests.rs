use costmap::leg::{Leg, Tick};

use super::examine;
use crate::plan::outcome::{Control, OffenceKind, WellFormed};
use crate::scenario::world::World;
use crate::sipp::conflicts::Steps;
use crate::sipp::search::{Found, IMMOVABLE, Scene, search};
use crate::solver::prepare::{Job, empty_costmap, prepare};

/// Drones of one kind in a hall, from where to where.
fn world(size_m: [u32; 3], flights: &[([f64; 3], [f64; 3])]) -> World {
    let drone = |(index, (start, goal)): (usize, &([f64; 3], [f64; 3]))| {
        let place = |[x, y, z]: &[f64; 3]| format!("({x}, {y}, {z})");
        format!(
            r#"(name: "d{index}", airframe: "offboard-2", start_m: {}, tasks: [(to_m: {})])"#,
            place(start),
            place(goal)
        )
    };
    let drones: Vec<String> = flights.iter().enumerate().map(drone).collect();
    let text = format!(
        r#"Scenario(name: "ends", bounds_m: (min: (0, 0, 0), max: {:?}), drones: [{}])"#,
        (size_m[0], size_m[1], size_m[2]),
        drones.join(", ")
    );
    crate::scenario::read_world(&text).expect("in order")
}

fn examined(world: &World) -> (Job, WellFormed) {
    let job = prepare(world);
    let costmap = empty_costmap(world, job.roadmap.lattice(), true);
    let steps = Steps::new(job.roadmap.lattice(), &job.errands, &costmap).expect("no zones");
    let known = examine(&job, &steps).expect("all on the lattice");
    (job, known)
}

#[test]
fn drones_with_room_around_everybody_need_no_order() {
    let world = world(
        [10, 8, 4],
        &[
            ([1.5, 1.5, 1.5], [8.5, 6.5, 1.5]),
            ([8.5, 1.5, 2.5], [1.5, 6.5, 2.5]),
        ],
    );
    assert!(examined(&world).1.is_proven());
}

#[test]
fn tasks_beside_the_lattice_are_not_examined() {
    let mut world = world([10, 8, 4], &[([1.5, 1.5, 1.5], [8.5, 6.5, 1.5])]);
    let mut on_the_way = world.drones[0].tasks[0].clone();
    on_the_way.to_m.x = 4.25;
    world.drones[0].tasks.insert(0, on_the_way);
    let job = prepare(&world);
    let costmap = empty_costmap(&world, job.roadmap.lattice(), true);
    let steps = Steps::new(job.roadmap.lattice(), &job.errands, &costmap).expect("no zones");
    assert_eq!(examine(&job, &steps), None);
}

#[test]
fn who_ends_above_anothers_start_waits_for_it() {
    let world = world(
        [10, 8, 4],
        &[
            ([1.5, 1.5, 3.5], [6.5, 4.5, 3.5]),
            ([6.5, 4.5, 0.5], [8.5, 1.5, 0.5]),
        ],
    );
    let (_, known) = examined(&world);
    assert!(known.waiting.contains(&0), "{known:?}");
    let above = |kind| {
        known
            .offences
            .iter()
            .any(|it| (it.drone, it.other, it.kind) == (0, 1, kind))
    };
    assert!(above(OffenceKind::GoalAtStart), "{known:?}");
}

#[test]
fn who_stands_in_a_corridor_encloses_those_behind() {
    // One column wide: whoever is in it is in everybody's way.
    let world = world(
        [9, 1, 3],
        &[
            ([1.5, 0.5, 1.5], [7.5, 0.5, 1.5]),
            ([3.5, 0.5, 1.5], [4.5, 0.5, 1.5]),
        ],
    );
    let (_, known) = examined(&world);
    assert_eq!(known.waiting, [0], "{known:?}");
    let others: Vec<usize> = known.offences.iter().map(|it| it.other).collect();
    assert_eq!(others, [1], "{known:?}");
}

/// The costmap, with everybody else at both ends at once, has to let every drone through that is said not to wait.
#[test]
fn who_is_said_not_to_wait_has_a_way_past_everybody_at_start_and_goal_at_once() {
    let mut ways = 0;
    for seed in 0..6_u64 {
        let mut state = seed * 2 + 1;
        let mut below = |end: u64| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % end
        };
        let mut columns: Vec<u64> = (0..100).collect();
        let mut place = || {
            let column = columns.swap_remove(below(columns.len() as u64) as usize);
            [
                (column % 10) as f64 + 0.5,
                (column / 10) as f64 + 0.5,
                below(6) as f64 + 0.5,
            ]
        };
        let flights: Vec<_> = (0..14).map(|_| (place(), place())).collect();
        let world = world([10, 10, 6], &flights);
        let (job, known) = examined(&world);
        let weights = vec![IMMOVABLE; job.errands.len()];
        for (drone, errand) in job.errands.iter().enumerate() {
            if known.waiting.contains(&drone) {
                continue;
            }
            let mut costmap = empty_costmap(&world, job.roadmap.lattice(), true);
            for other in job
                .errands
                .iter()
                .filter(|other| other.drone != errand.drone)
            {
                let hovers = |place: u32| {
                    let at_m = job.roadmap.position_m(place);
                    Leg {
                        drone: other.drone,
                        kind: other.kinds[0],
                        start: Tick(0),
                        end: Tick::FOREVER,
                        from_m: at_m,
                        to_m: at_m,
                        flying: true,
                        air_limit: other.air_limit,
                    }
                };
                costmap.insert(vec![hovers(other.start), hovers(other.last_vertex())]);
            }
            let scene = Scene {
                roadmap: &job.roadmap,
                costmap: &costmap,
                reservations: None,
                weights: &weights,
                under_way: &[],
                energy_weight: 0.0,
                detours: true,
                careful: true,
                most_expansions: u64::MAX,
                stop: Control::QUIET.stop,
            };
            let searched = search(scene, errand);
            assert!(
                matches!(searched.found, Found::Path(_)),
                "seed {seed}, drone {drone}: {:?}",
                searched.found
            );
            ways += 1;
        }
    }
    assert!(ways > 20, "{ways} drones do not wait");
}
