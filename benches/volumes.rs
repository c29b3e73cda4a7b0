//! Question: what do the costmap's volumes cost per query, so that a search can afford millions of
//! them?
//!
//! - a ball against a frustum: GJK on the support map
//! - a frustum against a capsule, both moving
//! - the iso-speed volume of one airframe, once per airframe and limit
//!
//! On two shared virtual cores of an AMD EPYC, rustc 1.95, bench profile (thin LTO), others
//! compiling beside it:
//!
//! | query | time |
//! | --- | --- |
//! | frustum and ball, GJK | 217 ns |
//! | frustum and capsule, both moving, proven | 0.84 µs |
//! | iso-speed volume of one airframe at one limit | 0.55 ms |

#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented functions"
)]

use airflow::{Air, Airframe, Jet, Wake};
use costmap::volumes::frame::{centred, upright};
use costmap::volumes::frustum::Frustum;
use costmap::volumes::iso_speed::IsoSpeedVolume;
use costmap::volumes::swept::{Mover, may_meet};
use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Point3, Vector3};
use parry3d::math::Pose;
use parry3d::query::details::intersection_test_support_map_support_map;
use parry3d::shape::{Ball, Capsule};
use std::hint::black_box;

fn wake(preset: &str) -> Wake {
    let airframe = Airframe::preset(preset).expect("a preset");
    let density = Air::default().density_kg_per_m3();
    Wake::new(&airframe, airframe.mass_kg(), density, &Jet::default())
}

/// Places around the frustum, hits and misses in turn.
fn places() -> Vec<Pose> {
    (0..64)
        .map(|i| {
            let angle = f64::from(i) * 2.4;
            let radius = 0.2 + 0.02 * f64::from(i);
            let z = f64::from(i % 9) * 0.5 - 2.0;
            centred(Point3::new(radius * angle.cos(), radius * angle.sin(), z)).expect("finite")
        })
        .collect()
}

fn shapes(c: &mut Criterion) {
    let frustum = Frustum::new(3.0, 0.4, 0.7).expect("positive lengths");
    let stand = upright(Point3::origin()).expect("finite");
    let (ball, capsule) = (Ball::new(0.3), Capsule::new_y(0.5, 0.3));
    let places = places();
    let mut next = places.iter().cycle();
    let mut place = move || *black_box(next.next().expect("a cycle does not end"));

    c.bench_function("frustum-ball, GJK", |b| {
        b.iter(|| {
            intersection_test_support_map_support_map(&stand.inv_mul(&place()), &frustum, &ball)
        });
    });
    c.bench_function("frustum-capsule, both moving", |b| {
        b.iter(|| {
            let first = Mover::new(&frustum, stand, Vector3::new(0.5, 0.0, 0.0));
            let second = Mover::new(&capsule, place(), Vector3::new(0.0, -0.7, 0.2));
            first.and_then(|first| second.map(|second| may_meet(&first, &second)))
        });
    });
}

fn air(c: &mut Criterion) {
    let kolibri = wake("kolibri");
    c.bench_function("iso-speed volume of one airframe", |b| {
        b.iter(|| IsoSpeedVolume::new(black_box(&kolibri), 0.3 * kolibri.induced_velocity_mps()));
    });
}

criterion_group!(volumes, shapes, air);
criterion_main!(volumes);
