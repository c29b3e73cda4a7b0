//! Question: how long does it take to plan on when ten of five hundred drones are late, come, are
//! taken out or are sent elsewhere, and what of it is planning and what the check of the whole
//! plan?
//!
//! The hall of `plan generate hall`, 64 x 64 x 8 m, seed 1, five seconds after its beginning: three
//! drones late by 1.3 to 1.9 s, three sent elsewhere, two taken out, two that come. `take over` is
//! [`planner::replan::rolling::Running::new`], once for each plan; `ten changes` is one
//! [`planner::replan::rolling::Running::replan`], the verification included; `without the check`
//! the same up to the verification.
//!
//! `cargo bench --bench rolling`; takes about two minutes. On two shared virtual cores of an Intel
//! Xeon, rustc 1.95: 1.3 s, 1.7 s and 1.2 s.

#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented functions"
)]

use std::hint::black_box;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use planner::plan::Plan;
use planner::plan::outcome::Progress;
use planner::replan::change::Change;
use planner::replan::rolling::Running;
use planner::scenario::world::{Drone, Task, World};
use planner::{Control, plan_world, read_world};

const DRONES: usize = 500;
const AT_S: f64 = 5.0;

fn planned() -> (World, Plan) {
    let text = tools::instances::hall(DRONES, 1).expect("the hall has room");
    let read = read_world(&text);
    let world = read.expect("in order");
    let outcome = plan_world(&world, &Control::QUIET).expect("in order");
    let planned = outcome.into_planned().expect("the hall has a plan");
    (world, planned.plan)
}

/// Places in columns in which no drone starts or ends.
fn free_places(world: &World) -> impl Iterator<Item = [f64; 2]> + '_ {
    let columns = (0..4096).map(|cell: u32| [cell * 37 % 64, cell * 37 / 64 % 64]);
    let middle = |column: [u32; 2]| column.map(|cell| f64::from(cell) + 0.5);
    columns.map(middle).filter(|[x, y]| {
        let in_it = |at: &nalgebra::Point3<f64>| (at.x - x).abs() < 0.5 && (at.y - y).abs() < 0.5;
        !(world.drones.iter()).any(|drone| in_it(&drone.start_m) || in_it(&drone.tasks[0].to_m))
    })
}

fn ten_changes(world: &World) -> Vec<Change> {
    let mut free = free_places(world);
    let mut task = |z: f64| {
        let [x, y] = free.next().expect("free columns");
        Task {
            to_m: [x, y, z].into(),
            dwell_s: 1.0,
            load_kg: None,
            during_s: None,
        }
    };
    let mut changes = Vec::new();
    for late in 1..=3 {
        changes.push(Change::Late {
            drone: format!("d{late}"),
            by_s: 1.0 + 0.3 * f64::from(late),
        });
    }
    for sent in 4..=6 {
        changes.push(Change::Retasked {
            drone: format!("d{sent}"),
            tasks: vec![task(3.5)],
        });
    }
    for out in 7..=8 {
        changes.push(Change::Removed {
            drone: format!("d{out}"),
        });
    }
    for comes in 1..=2 {
        changes.push(Change::Added(Drone {
            name: format!("new-{comes}"),
            start_m: task(7.5).to_m,
            tasks: vec![task(2.5)],
            ..world.drones[0].clone()
        }));
    }
    changes
}

fn rolling(c: &mut Criterion) {
    let (world, plan) = planned();
    let changes = ten_changes(&world);
    let mut group = c.benchmark_group("rolling");
    group.sample_size(10);
    group.measurement_time(Duration::from_secs(10));
    let take_over = || Running::new(world.clone(), plan.clone()).expect("its plan");
    group.bench_function("take over", |b| b.iter(|| black_box(take_over())));
    group.bench_function("ten changes", |b| {
        b.iter_batched(
            take_over,
            |mut running| running.replan(AT_S, black_box(&changes), &Control::QUIET),
            BatchSize::PerIteration,
        );
    });
    group.bench_function("ten changes without the check", |b| {
        b.iter_custom(|times| {
            let mut took = Duration::ZERO;
            for _ in 0..times {
                let mut running = take_over();
                let checks = Mutex::new(Duration::ZERO);
                let began = Instant::now();
                let told = |progress| {
                    if let (Progress::Verifying, Ok(mut checks)) = (progress, checks.lock()) {
                        *checks = began.elapsed();
                    }
                };
                let control = Control {
                    progress: &told,
                    ..Control::QUIET
                };
                black_box(running.replan(AT_S, &changes, &control)).expect("in order");
                took += *checks.lock().expect("no thread panicked");
            }
            took
        });
    });
    group.finish();
}

criterion_group!(benches, rolling);
criterion_main!(benches);
