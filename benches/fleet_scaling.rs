//! Question: how does the whole of a planning run grow with the fleet?
//!
//! The instances of `plan bench`, seed 1. Criterion measures all of [`planner::plan_world`]:
//! endpoints, roadmap, search, verification, and the second plan that ignores downwash. How that
//! splits, what it costs the fleet, how much memory it takes, and larger fleets: `plan bench`
//! prints the table. The hall is planned once more with two zones whose air is limited, which
//! searches ask for at every step and the verifier judges at every moment; without the drones that
//! start or end above them.
//!
//! `cargo bench --bench fleet_scaling` takes about five minutes.

#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented functions"
)]

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use planner::plan::Zone;
use planner::scenario::world::World;
use planner::{Control, plan_world, read_world};
use tools::instances::Floor;

const FLEETS: [usize; 5] = [10, 50, 100, 200, 500];
const FLEETS_AMONG_ZONES: [usize; 2] = [50, 200];
const SEED: u64 = 1;

/// Lowest and highest corner of each zone on the floor (m).
const ZONES_M: [[[f64; 2]; 2]; 2] = [[[30.0, 30.0], [33.0, 33.0]], [[2.0, 40.0], [6.0, 44.0]]];
/// Drones that start or end nearer to a zone than this stay away (m).
const BESIDE_M: f64 = 3.0;

fn among_zones(mut world: World) -> World {
    let is_beside = |[low, high]: [[f64; 2]; 2], at: nalgebra::Point3<f64>| {
        (0..2).all(|k| (low[k] - BESIDE_M..high[k] + BESIDE_M).contains(&at[k]))
    };
    (world.drones).retain(|drone| {
        let goals_m = drone.tasks.iter().map(|task| task.to_m);
        let mut places_m = goals_m.chain([drone.start_m]);
        !places_m.any(|at| ZONES_M.iter().any(|zone| is_beside(*zone, at)))
    });
    world.zones = ZONES_M
        .iter()
        .enumerate()
        .map(|(k, [low, high])| Zone {
            name: format!("zone {k}"),
            min_m: [low[0], low[1], 0.0].into(),
            max_m: [high[0], high[1], 2.0].into(),
            air_limit_mps: Some(1.5),
            keep_out: false,
        })
        .collect();
    world
}

fn scaling(c: &mut Criterion) {
    let places = [
        ("hall", Floor::Hall, &FLEETS[..], false),
        (
            "hall with two zones",
            Floor::Hall,
            &FLEETS_AMONG_ZONES,
            true,
        ),
        ("warehouse", Floor::Warehouse, &FLEETS, false),
    ];
    for (name, floor, fleets, has_zones) in places {
        let mut group = c.benchmark_group(name);
        group.sample_size(10);
        group.warm_up_time(Duration::from_millis(500));
        group.measurement_time(Duration::from_secs(5));
        for &drones in fleets {
            let text = floor.scenario(drones, SEED).expect("there is room");
            let mut world = read_world(&text).expect("in order");
            if has_zones {
                world = among_zones(world);
            }
            group.bench_with_input(BenchmarkId::from_parameter(drones), &world, |b, world| {
                b.iter(|| plan_world(black_box(world), &Control::QUIET));
            });
        }
        group.finish();
    }
}

criterion_group!(benches, scaling);
criterion_main!(benches);
