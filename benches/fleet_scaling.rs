//! Question: how does the whole of a planning run grow with the fleet?
//!
//! The instances of `plan bench`, seed 1. Criterion measures all of [`planner::plan_world`]:
//! endpoints, roadmap, search, verification, and the second plan that ignores downwash. How that
//! splits, what it costs the fleet, how much memory it takes, and larger fleets: `plan bench`
//! prints the table.
//!
//! `cargo bench --bench fleet_scaling` takes about two minutes.

#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented functions"
)]

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use planner::{Control, plan_world, read_world};
use tools::instances::Floor;

const FLEETS: [usize; 5] = [10, 50, 100, 200, 500];
const SEED: u64 = 1;

fn scaling(c: &mut Criterion) {
    for (name, floor) in [("hall", Floor::Hall), ("warehouse", Floor::Warehouse)] {
        let mut group = c.benchmark_group(name);
        group.sample_size(10);
        group.warm_up_time(Duration::from_millis(500));
        group.measurement_time(Duration::from_secs(5));
        for drones in FLEETS {
            let text = floor.scenario(drones, SEED).expect("there is room");
            let world = read_world(&text).expect("in order");
            group.bench_with_input(BenchmarkId::from_parameter(drones), &world, |b, world| {
                b.iter(|| plan_world(black_box(world), &Control::QUIET));
            });
        }
        group.finish();
    }
}

criterion_group!(benches, scaling);
criterion_main!(benches);
