//! Question: how does planning time grow with the fleet, and what does staying out of each other's air
//! cost?
//!
//! Random flights in the hall of `plan generate hall`, 64 x 64 x 8 m, seed 1. Criterion measures the
//! whole of [`planner::plan_world`]: endpoints, roadmap, search, verification, and the second plan that
//! ignores downwash. After it, one run of each size prints a table in Markdown:
//! `cargo bench --bench fleet_scaling`.
//!
//! Takes about a minute. Machine: two shared virtual cores of an AMD EPYC, rustc 1.95, bench
//! profile (thin LTO), other work running beside it. Medians there: 0.17, 0.19, 0.30, 0.67 and 1.55 s.

#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented functions"
)]

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, criterion_group};
use planner::world::World;
use planner::{Control, Outcome, instances, plan_world, scenario};

const FLEETS: [usize; 5] = [10, 20, 50, 100, 200];
const SEED: u64 = 1;

fn hall(drones: usize) -> World {
    let text = instances::hall(drones, SEED).expect("the hall has room");
    scenario::read_world(&text, &|file| Err(format!("there is no {file}"))).expect("in order")
}

fn scaling(c: &mut Criterion) {
    let mut group = c.benchmark_group("hall");
    group.sample_size(10);
    group.warm_up_time(Duration::from_millis(500));
    group.measurement_time(Duration::from_secs(5));
    for drones in FLEETS {
        let world = hall(drones);
        group.bench_with_input(BenchmarkId::from_parameter(drones), &world, |b, world| {
            b.iter(|| plan_world(black_box(world), &Control::QUIET));
        });
    }
    group.finish();
}

fn print_table() {
    println!(
        "| drones | planned | whole run (s) | states expanded | evictions | sum of arrivals / sum alone | drones over their limit if downwash is ignored |"
    );
    println!("| ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    for drones in FLEETS {
        let world = hall(drones);
        let began = Instant::now();
        let outcome = plan_world(&world, &Control::QUIET);
        let took_s = began.elapsed().as_secs_f64();
        let Outcome::Planned { plan, effort, .. } = outcome else {
            println!("| {drones} | none: blocked | | | | | |");
            continue;
        };
        let over = plan
            .ignoring_downwash
            .map_or_else(String::new, |it| it.drones_over_limit.to_string());
        println!(
            "| {drones} | {} | {took_s:.2} | {} | {} | {:.4} | {over} |",
            drones - plan.unplanned.len(),
            effort.expansions,
            effort.evictions,
            plan.fleet.sum_of_arrivals_s / plan.fleet.sum_alone_s,
        );
    }
}

criterion_group!(benches, scaling);

fn main() {
    benches();
    Criterion::default().configure_from_args().final_summary();
    // `cargo test --benches` and `--list` want no table.
    if std::env::args().any(|argument| argument == "--bench") {
        print_table();
    }
}
