//! Questions: how long does a diagnosis take of one long recording; how long does a calibration
//! take of all that the paper's kind of campaign can bring?
//!
//! The diagnosis: the first synthetic recording of seed 1 with 4000 samples or more; at most 5 s
//! are allowed.
//!
//! Measured: 1.12 s, two shared virtual cores of an AMD EPYC with nothing beside it; 4164 samples,
//! verdict `library`.
//!
//! The calibration: sixteen hours of readings at 1 Hz below six drones: 120 grid flights of eight
//! minutes; and a quarter of that.
//!
//! On two shared virtual cores of an AMD EPYC, rustc 1.95, one run each at opt-level 2, others
//! compiling beside it:
//!
//! | | readings | flights | time |
//! | --- | ---: | ---: | ---: |
//! | 4 hours | 14 735 | 30 | 0.02 s |
//! | 16 hours | 58 940 | 120 | 0.19 s |

#![allow(
    missing_docs,
    reason = "criterion's macros generate undocumented functions"
)]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use diagnosis::calibrate::{Options, calibrate};
use diagnosis::infer::diagnose::diagnose;
use diagnosis::record::recording::Recording;
use validation::hover_grid::HoverGrid;

const DRONES: usize = 6;

fn campaign(hours: f64) -> Vec<Recording> {
    let mut recordings: Vec<Recording> = Vec::new();
    let mut readings = 0;
    for seed in 0.. {
        for name in &airflow::Airframe::PRESETS[..DRONES] {
            let flight = HoverGrid::over_one_probe(name).expect("a preset").fly(seed);
            readings += flight
                .probes
                .as_ref()
                .map_or(0, |probes| probes.samples.len());
            recordings.push(flight);
        }
        if readings as f64 >= hours * 3600.0 {
            break;
        }
    }
    recordings
}

fn calibration(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("calibrate");
    group.sample_size(10);
    for hours in [4.0, 16.0] {
        let recordings = campaign(hours);
        let calibrated = calibrate(&recordings, &Options::default()).expect("enough to fit");
        eprintln!(
            "{hours} h: {} readings, {} flights",
            calibrated.counts.read,
            recordings.len()
        );
        group.bench_function(format!("{hours} hours"), |bencher| {
            bencher.iter(|| calibrate(black_box(&recordings), &Options::default()));
        });
    }
    group.finish();
}

/// Samples of the recording that is diagnosed.
const LONG: usize = 4000;

fn long_recording() -> Recording {
    let readings = |recording: &Recording| {
        let probes = recording.probes.as_ref();
        probes.map_or(0, |probes| probes.samples.len())
    };
    (0..)
        .map(|index| validation::case(validation::Half::Shown, 1, index).recording)
        .find(|recording| readings(recording) >= LONG)
        .expect("without end")
}

fn diagnosis(criterion: &mut Criterion) {
    let recording = long_recording();
    let found = diagnose(&recording).expect("long enough");
    eprintln!("{} samples: {:?}", found.samples, found.verdict);
    let mut group = criterion.benchmark_group("diagnose");
    group.sample_size(10);
    group.bench_function("4000 samples", |bencher| {
        bencher.iter(|| diagnose(black_box(&recording)));
    });
    group.finish();
}

criterion_group!(benches, diagnosis, calibration);
criterion_main!(benches);
