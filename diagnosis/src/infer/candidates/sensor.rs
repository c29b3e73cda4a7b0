//! Faults of instruments and clocks.

use airflow::effects::EntrainmentRadial;

use super::{Candidate, Kind, Shows, parameter};
use crate::forward::observed::Observed;
use crate::forward::simulate::Channel;

pub(super) fn of_the_sensor(shows: &Shows, observed: &Observed) -> Vec<Candidate> {
    let unit = if shows.probes { "m/s" } else { "1" };
    let offset = if shows.probes { 1.5 } else { 0.3 };
    // Beyond what the maker allows: that much is fitted everywhere.
    let offset_practical = if shows.probes { 0.08 } else { 0.02 };
    let mut candidates = vec![
        Candidate {
            name: "sensor_gain",
            kind: Kind::Sensor,
            equation: "y -> (1 + g) y",
            story: "the sensor reads too much or too little by one factor",
            parameters: vec![parameter("g", "1", [-0.6, 0.9], 0.0, 0.07)],
            essential: 1,
            starts: vec![vec![0.08]],
            set: |p, h| h.sensor.gain = p[0],
        },
        Candidate {
            name: "sensor_offset",
            kind: Kind::Sensor,
            equation: "y -> y + b",
            story: "the sensor reads too much or too little by one amount",
            parameters: vec![parameter(
                "b",
                unit,
                [-offset, offset],
                0.0,
                offset_practical,
            )],
            essential: 1,
            starts: vec![vec![offset_practical]],
            set: |p, h| h.sensor.offset = p[0],
        },
    ];
    if shows.moves || observed.channel == Channel::Speed {
        candidates.push(Candidate {
            name: "sensor_lag",
            kind: Kind::Sensor,
            equation: "tau y' = x - y",
            story: "the sensor is slow",
            parameters: vec![parameter("tau", "s", [0.0, 8.0], 0.0, 0.25)],
            essential: 1,
            starts: vec![vec![0.8]],
            set: |p, h| h.sensor.lag_s = p[0],
        });
        candidates.push(Candidate {
            name: "clock_misalignment",
            kind: Kind::Sensor,
            equation: "y(t) -> y(t + dt)",
            story: "the drones' clock and the sensors' disagree",
            parameters: vec![parameter("dt", "s", [-4.0, 4.0], 0.0, 0.15)],
            essential: 1,
            // A pass through a jet lasts a second: the fit must begin within half of one.
            starts: (-10..=10)
                .filter(|step| *step != 0)
                .map(|step| vec![0.4 * f64::from(step)])
                .collect(),
            set: |p, h| h.sensor.clock_s = p[0],
        });
    }
    if shows.probes {
        candidates.push(Candidate {
            name: "sensor_drift",
            kind: Kind::Sensor,
            equation: "y -> (1 + g' t) y + b' t",
            story: "the sensor's calibration drifts with time",
            parameters: vec![
                parameter("g'", "1/h", [-6.0, 6.0], 0.0, 0.2),
                parameter(
                    "b'",
                    if shows.probes { "m/s/h" } else { "1/h" },
                    [-6.0, 6.0],
                    0.0,
                    0.3,
                ),
            ],
            essential: 2,
            starts: vec![vec![0.1, 0.1], vec![-0.1, -0.1]],
            set: |p, h| {
                h.sensor.gain_drift_per_h = p[0];
                h.sensor.offset_drift_per_h = p[1];
            },
        });
        candidates.push(Candidate {
            name: "sensor_saturation",
            kind: Kind::Sensor,
            equation: "y -> min(y, y_max)",
            story: "the sensor does not read above a ceiling",
            parameters: vec![parameter(
                "y_max",
                "m/s",
                [0.2 * shows.fastest, 1.3 * shows.fastest],
                1.3 * shows.fastest,
                0.2 * shows.fastest,
            )],
            essential: 1,
            starts: vec![vec![0.95 * shows.fastest]],
            set: |p, h| h.sensor.saturation = p[0],
        });
    }
    if shows.probes && shows.axial_only {
        candidates.push(Candidate {
            name: "magnitude_sensor",
            kind: Kind::Sensor,
            equation: "y = sqrt(U^2 + kappa^2 V^2 + a^2)",
            story: "the probe sees the air that is drawn in, which the simulation leaves out",
            parameters: vec![parameter("kappa", "1", [0.0, 2.5], 0.0, 0.5)],
            essential: 1,
            starts: vec![vec![0.8]],
            set: |p, h| h.effects.entrainment_radial = Some(EntrainmentRadial { factor: p[0] }),
        });
    }
    candidates
}
