//! Question: what does the feed-forward of one drone cost a flight stack, ten neighbours above it,
//! and what the record of all eleven places that goes before it?
//!
//! Machine: two shared cores of an AMD EPYC, rustc 1.95, release profile without link-time
//! optimisation, other work running beside it: 11 µs for the factors, 0.2 µs for the record.

use std::hint::black_box;

use airflow::{Airframe, Jet, Wake};
use criterion::{Criterion, criterion_group, criterion_main};
use flight::feed_forward::{FleetAir, FleetDrone};
use nalgebra::Point3;

/// A Kolibri below ten Offboards that fly past, 1.5 to 6 m above it, after a minute of flight.
fn fleet() -> (FleetAir, Vec<(Point3<f64>, f64)>) {
    let part = |name: &str| {
        let airframe = Airframe::preset(name).expect("a preset");
        FleetDrone {
            wake: Wake::new(&airframe, airframe.mass_kg(), 1.204, &Jet::default()),
            discs: airframe.disc_points(),
        }
    };
    let names = std::iter::once("kolibri").chain(std::iter::repeat_n("offboard-2", 10));
    let air = FleetAir::new(names.map(part).collect(), (0.6, 0.02), (0.0, 10.0));
    let mut air = air.expect("in range");
    let mut places = Vec::new();
    for step in 0..3000 {
        let x_m = 0.04 * f64::from(step) - 118.0;
        places = vec![(Point3::new(0.0, 0.0, 2.0), 1.0)];
        places.extend((0..10).map(|k| {
            let (y_m, z_m) = (0.2 * f64::from(k) - 1.0, 3.5 + 0.45 * f64::from(k));
            (Point3::new(x_m, y_m, z_m), 1.0)
        }));
        air.record(&places);
    }
    (air, places)
}

fn feed_forward(c: &mut Criterion) {
    let (mut air, places) = fleet();
    let factors = air.factors(0, places[0].0);
    assert!(factors.power > 1.1, "it is in the air of them: {factors:?}");
    c.bench_function("feed_forward/factors", |b| {
        b.iter(|| air.factors(0, black_box(places[0].0)));
    });
    c.bench_function("feed_forward/record", |b| {
        b.iter(|| air.record(black_box(&places)));
    });
}

criterion_group!(benches, feed_forward);
criterion_main!(benches);
