//! Faults of instruments and clocks.

use airflow::effects::EntrainmentRadial;

use super::effects::ONE_AXIS;
use super::{Candidate, Change, Kind, Shows, parameter};
use crate::forward::observed::Observed;
use crate::forward::simulate::Channel;

/// One fault, whatever its channel.
pub(crate) struct Fault {
    /// Canonical name.
    pub(super) name: &'static str,
    /// Other names of the same fault.
    pub(super) aliases: &'static [&'static str],
    /// See [`Candidate::settled_by`].
    settled_by: &'static str,
    /// See [`Candidate::closure_error`].
    closure_error: f64,
}

pub(super) const MOTORS_OFF: &str =
    "a minute with the motors off before take-off and one after landing, the probe running";
pub(super) const BOTH_WAYS: &str = "a pass over the probe and back at two speeds: a clock shifts both ways alike, a slow sensor and slow air do not";

pub(crate) const GAIN: Fault = Fault {
    name: "sensor_gain",
    aliases: &[],
    settled_by: "the same hover with a second probe beside the first, or the probe in a calibrated stream at two speeds",
    closure_error: 0.0,
};
pub(crate) const OFFSET: Fault = Fault {
    name: "sensor_offset",
    aliases: &["ambient_background"],
    settled_by: MOTORS_OFF,
    closure_error: 0.0,
};
pub(crate) const DRIFT: Fault = Fault {
    name: "sensor_drift",
    aliases: &[],
    settled_by: "the first hover once more at the end of the flight",
    closure_error: 0.0,
};
pub(crate) const LAG: Fault = Fault {
    name: "sensor_lag",
    aliases: &[],
    settled_by: BOTH_WAYS,
    // One low-pass or two in a row.
    closure_error: 0.02,
};
const SATURATION: Fault = Fault {
    name: "sensor_saturation",
    aliases: &[],
    settled_by: "a hover closer above the probe, where it should read more",
    closure_error: 0.0,
};
pub(crate) const CLOCK: Fault = Fault {
    name: "clock_misalignment",
    aliases: &["time_offset"],
    settled_by: BOTH_WAYS,
    closure_error: 0.0,
};
const MAGNITUDE: Fault = Fault {
    name: "magnitude_sensor",
    aliases: &[],
    settled_by: ONE_AXIS,
    closure_error: 0.0,
};

/// Every fault that has a name.
pub(super) const FAULTS: [&Fault; 7] = [
    &GAIN,
    &OFFSET,
    &DRIFT,
    &LAG,
    &SATURATION,
    &CLOCK,
    &MAGNITUDE,
];

impl Fault {
    /// A candidate that has its name, one parameter that counts, and changes nothing yet.
    pub(crate) fn candidate(&self) -> Candidate {
        Candidate {
            name: self.name,
            kind: Kind::Sensor,
            equation: "",
            description: "",
            parameters: Vec::new(),
            essential: 1,
            starts: Vec::new(),
            closure_error: self.closure_error,
            settled_by: self.settled_by,
            change: Change::Hypothesis(|_, _| ()),
        }
    }
}

pub(super) fn of_the_sensor(shows: &Shows, observed: &Observed) -> Vec<Candidate> {
    let unit = if shows.probes { "m/s" } else { "1" };
    let offset = if shows.probes { 1.5 } else { 0.3 };
    // Beyond what the maker allows: that much is fitted everywhere.
    let offset_practical = if shows.probes { 0.08 } else { 0.02 };
    let mut candidates = vec![
        Candidate {
            equation: "y -> (1 + g) y",
            description: "the sensor reads too much or too little by one factor",
            parameters: vec![parameter("g", "1", [-0.6, 0.9], 0.0, 0.07)],
            starts: vec![vec![0.08]],
            change: Change::Hypothesis(|p, h| h.sensor.gain = p[0]),
            ..GAIN.candidate()
        },
        Candidate {
            equation: "y -> y + b",
            description: "the sensor reads too much or too little by one amount",
            parameters: vec![parameter(
                "b",
                unit,
                [-offset, offset],
                0.0,
                offset_practical,
            )],
            starts: vec![vec![offset_practical]],
            change: Change::Hypothesis(|p, h| h.sensor.offset = p[0]),
            ..OFFSET.candidate()
        },
    ];
    if shows.moves || observed.channel == Channel::Speed {
        candidates.push(Candidate {
            equation: "tau y' = x - y",
            description: "the sensor is slow",
            parameters: vec![parameter("tau", "s", [0.0, 8.0], 0.0, 0.25)],
            starts: vec![vec![0.8]],
            change: Change::Hypothesis(|p, h| h.sensor.lag_s = p[0]),
            ..LAG.candidate()
        });
        candidates.push(Candidate {
            equation: "y(t) -> y(t + dt)",
            description: "the drones' clock and the sensors' disagree",
            parameters: vec![parameter("dt", "s", [-4.0, 4.0], 0.0, 0.15)],
            // A pass through a jet lasts a second: the fit must begin within half of one.
            starts: (-10..=10)
                .filter(|step| *step != 0)
                .map(|step| vec![0.4 * f64::from(step)])
                .collect(),
            change: Change::Hypothesis(|p, h| h.sensor.clock_s = p[0]),
            ..CLOCK.candidate()
        });
    }
    if shows.probes {
        candidates.push(Candidate {
            equation: "y -> (1 + g' t) y + b' t",
            description: "the sensor's calibration drifts with time",
            parameters: vec![
                parameter("g'", "1/h", [-6.0, 6.0], 0.0, 0.2),
                parameter("b'", "m/s/h", [-6.0, 6.0], 0.0, 0.3),
            ],
            essential: 2,
            starts: vec![vec![0.1, 0.1], vec![-0.1, -0.1]],
            change: Change::Hypothesis(|p, h| {
                h.sensor.gain_drift_per_h = p[0];
                h.sensor.offset_drift_per_h = p[1];
            }),
            ..DRIFT.candidate()
        });
        candidates.push(Candidate {
            equation: "y -> min(y, y_max)",
            description: "the sensor does not read above a ceiling",
            parameters: vec![parameter(
                "y_max",
                "m/s",
                [0.2 * shows.fastest, 1.3 * shows.fastest],
                1.3 * shows.fastest,
                0.2 * shows.fastest,
            )],
            starts: vec![vec![0.95 * shows.fastest]],
            change: Change::Hypothesis(|p, h| h.sensor.saturation = p[0]),
            ..SATURATION.candidate()
        });
    }
    if shows.probes && shows.axial_only {
        candidates.push(Candidate {
            equation: "y = sqrt(U^2 + kappa^2 V^2 + a^2)",
            description: "the probe sees the air that is drawn in, which the simulation leaves out",
            parameters: vec![parameter("kappa", "1", [0.0, 2.5], 0.0, 0.5)],
            starts: vec![vec![0.8]],
            change: Change::Hypothesis(|p, h| {
                h.effects.entrainment_radial = Some(EntrainmentRadial { factor: p[0] })
            }),
            ..MAGNITUDE.candidate()
        });
    }
    candidates
}
