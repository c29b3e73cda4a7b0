//! Question: what does the search for one drone cost among a hundred that are planned already?
//!
//! The hall of `plan generate hall`, 64 x 64 x 8 m, 101 drones, seed 1. All are planned; the one
//! that flies farthest is taken out and searched for as if nobody could be made to give way, and as if everybody could. For
//! comparison: alone in the hall, and reserving a path.
//!
//! On two shared virtual cores of an AMD EPYC, rustc 1.95, bench profile (thin LTO):
//!
//! | | states | time |
//! | --- | ---: | ---: |
//! | alone in the hall | 57 | 0.05 ms |
//! | among a hundred, nobody gives way / everybody may | 63 | 0.07 / 0.07 ms |
//! | reserving its path and taking it back | | 0.20 ms |

#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented functions"
)]

use std::hint::black_box;

use costmap::costmap::Costmap;
use costmap::leg::DroneId;
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use planner::plan::outcome::Effort;
use planner::sipp::conflicts::{Crowd, Steps};
use planner::sipp::search::{Found, IMMOVABLE, Scene, search};
use planner::solver::prepare::{Job, empty_costmap, prepare};
use planner::solver::priority::plan_fleet;
use planner::{Control, scenario};

const PLANNED: usize = 100;

struct Bench {
    job: Job,
    one: DroneId,
    empty: Costmap,
    full: Costmap,
}

fn bench() -> Bench {
    let text = tools::instances::hall(PLANNED + 1, 1).expect("the hall has room");
    let world =
        scenario::read_world(&text, &|file| Err(format!("there is no {file}"))).expect("in order");
    let job = prepare(&world);
    let empty = empty_costmap(&world, job.roadmap.lattice(), true);
    let mut effort = Effort::default();
    let steps = Steps::new(job.roadmap.lattice(), &job.errands, &empty);
    let paths = plan_fleet(
        &job,
        &empty,
        steps.as_ref(),
        &[],
        &world.planning,
        &Control::QUIET,
        &mut effort,
    );
    let farthest = job
        .errands
        .iter()
        .max_by_key(|errand| errand.alone(&job.roadmap));
    let one = farthest.map_or(DroneId(0), |errand| errand.drone);
    let mut full = paths.costmap;
    full.remove(one);
    Bench {
        job,
        one,
        empty,
        full,
    }
}

fn one_drone(c: &mut Criterion) {
    let Bench {
        job,
        one,
        empty,
        full,
    } = bench();
    let errand = &job.errands[one.0 as usize];
    let steps = Steps::new(job.roadmap.lattice(), &job.errands, &full);
    let crowd = |costmap| {
        let steps = steps.as_ref().expect("one kind of drone, no zones");
        Crowd::new(steps, costmap)
    };
    let (nobody, everybody) = (crowd(&empty), crowd(&full));
    let firm = vec![IMMOVABLE; PLANNED + 1];
    let yielding = vec![500; PLANNED + 1];
    let mut group = c.benchmark_group("one_drone");
    for (name, costmap, crowd, weights) in [
        ("alone", &empty, &nobody, &firm),
        ("among_a_hundred_firm", &full, &everybody, &firm),
        ("among_a_hundred_yielding", &full, &everybody, &yielding),
    ] {
        let scene = Scene {
            roadmap: &job.roadmap,
            costmap,
            crowd: Some(crowd),
            weights,
            under_way: &[],
            energy_weight: 1.0,
            detours: true,
            careful: false,
            most_expansions: 400_000,
            stop: &|| false,
        };
        let once = search(scene, errand);
        println!("{name}: {} states expanded", once.expansions);
        group.bench_function(name, |b| b.iter(|| search(black_box(scene), errand)));
    }
    let scene = Scene {
        roadmap: &job.roadmap,
        costmap: &full,
        crowd: Some(&everybody),
        weights: &firm,
        under_way: &[],
        energy_weight: 1.0,
        detours: true,
        careful: false,
        most_expansions: 400_000,
        stop: &|| false,
    };
    if let Found::Path(path) = search(scene, errand).found {
        group.bench_function("reserve_and_take_back", |b| {
            b.iter_batched_ref(
                || full.clone(),
                |costmap| {
                    costmap.insert(path.legs.clone());
                    costmap.remove(one);
                },
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, one_drone);
criterion_main!(benches);
