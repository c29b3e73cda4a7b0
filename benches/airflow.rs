//! Question: what does one evaluation of the air cost, at a point and averaged over a receiver's
//! rotor discs, below one drone and below a hundred?
//!
//! Machine: two shared cores of an AMD EPYC, rustc 1.95, release profile. Throughput is per point
//! (or per receiver), so a report of "x Melem/s" is 1000/x ns. The fastest of 100 samples there,
//! other work running beside it (medians were twice that):
//!
//! | | one drone | a hundred |
//! |---|---|---|
//! | axial speed at a far-field point | 1.8 ns vectorised, 5.3 ns through `Source` | 320 ns |
//! | velocity at a far-field point | 6.8 ns | |
//! | axial speed, velocity at a near-field point | 100 ns, 310 ns | |
//! | mean over the 28 points of a quadrotor's discs | 140 ns | 5.5 µs |
//!
//! A new wake with its table takes 97 µs, the same at another mass 16 ns.

use std::hint::black_box;

use airflow::{Airframe, Jet, Source, Superposition, Wake, axial_speed_mps, mean_over_discs_mps};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Point3, Vector3};

fn wake() -> Wake {
    let airframe = Airframe::preset("offboard-2").expect("a preset");
    Wake::new(&airframe, airframe.mass_kg(), 1.204, &Jet::default())
}

/// A thousand places spread over a box by the golden ratio and its like: no two in line, the same
/// in every run.
fn places(low: Point3<f64>, high: Point3<f64>) -> Vec<Point3<f64>> {
    let steps = Vector3::new(0.819_172_513_396, 0.671_043_606_704, 0.549_700_477_902);
    (1..=1000)
        .map(|i| low + (high - low).component_mul(&(steps * f64::from(i)).map(f64::fract)))
        .collect()
}

fn one_drone(c: &mut Criterion) {
    let wake = wake();
    let mut group = c.benchmark_group("one_drone");
    group.throughput(Throughput::Elements(1000));
    for (name, top_m, bottom_m) in [
        ("far_field", -0.7, -8.0),
        ("merging", -0.48, -0.66),
        ("near_field", -0.01, -0.47),
    ] {
        let offsets: Vec<Vector3<f64>> = places(
            Point3::new(-1.0, -1.0, bottom_m),
            Point3::new(1.0, 1.0, top_m),
        )
        .into_iter()
        .map(|p| p.coords)
        .collect();
        group.bench_function(format!("axial_speed/{name}"), |b| {
            b.iter(|| {
                offsets
                    .iter()
                    .map(|&o| wake.axial_speed_mps(black_box(o)))
                    .sum::<f64>()
            });
        });
        group.bench_function(format!("velocity/{name}"), |b| {
            b.iter(|| {
                offsets
                    .iter()
                    .map(|&o| wake.velocity_mps(black_box(o)))
                    .sum::<Vector3<f64>>()
            });
        });
    }
    group.finish();
}

fn many_drones(c: &mut Criterion) {
    let wake = wake();
    let discs = Airframe::preset("kolibri").expect("a preset").disc_points();
    let emitters = places(Point3::new(0.0, 0.0, 5.0), Point3::new(20.0, 20.0, 8.0));
    let receivers = places(Point3::new(0.0, 0.0, 0.0), Point3::new(20.0, 20.0, 4.0));
    for (name, count) in [("one", 1), ("hundred", 100)] {
        let sources: Vec<Source> = emitters[..count]
            .iter()
            .map(|&position_m| Source {
                wake: &wake,
                position_m,
                ends_at_z_m: 0.0,
            })
            .collect();
        let mut group = c.benchmark_group(format!("below_{name}"));
        group.throughput(Throughput::Elements(receivers.len() as u64));
        group.bench_function("point", |b| {
            b.iter(|| {
                receivers
                    .iter()
                    .map(|&p| axial_speed_mps(black_box(&sources), p, Superposition::Momentum))
                    .sum::<f64>()
            });
        });
        group.bench_function("disc_mean", |b| {
            b.iter(|| {
                let mean = |&p| {
                    mean_over_discs_mps(black_box(&sources), &discs, p, Superposition::Momentum)
                };
                receivers.iter().map(mean).sum::<f64>()
            });
        });
        group.finish();
    }
}

fn making(c: &mut Criterion) {
    let airframe = Airframe::preset("offboard-2").expect("a preset");
    let wake = wake();
    c.bench_function("new_wake", |b| {
        b.iter(|| Wake::new(black_box(&airframe), 1.2, 1.204, &Jet::default()))
    });
    c.bench_function("with_mass", |b| {
        b.iter_batched(
            || wake.clone(),
            |wake| wake.with_mass(black_box(1.5)),
            BatchSize::SmallInput,
        );
    });
}

criterion_group!(airflow_benches, one_drone, many_drones, making);
criterion_main!(airflow_benches);
