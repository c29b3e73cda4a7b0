//! Faults of instruments and clocks: one row each.

use airflow::effects::EntrainmentRadial;

use super::candidate::{Candidate, Change, Kind, Parameter, Scope};
use super::effects::{MOTORS_OFF, ONE_AXIS, THERE_AND_BACK};
use super::shows::Shows;
use crate::forward::hypothesis::{CLOCK_RANGE_S, Hypothesis};

/// One fault as a fit tries it. Numbers without a source are chosen here.
pub(crate) struct Fault {
    /// Canonical name.
    pub(crate) name: &'static str,
    /// Other names of the same fault.
    pub(crate) aliases: &'static [&'static str],
    /// See [`Candidate::equation`].
    pub(crate) equation: &'static str,
    /// See [`Candidate::description`].
    pub(crate) description: &'static str,
    /// See [`Candidate::parameters`]; all are essential.
    pub(crate) parameters: &'static [Parameter],
    /// See [`Candidate::starts`]: a value for every parameter, one start after another.
    pub(crate) starts: &'static [f64],
    /// Whether the values of parameters and starts are over the highest reading.
    pub(crate) is_over_fastest: bool,
    /// Whether they are over the length of the recording, where that is shorter than an hour.
    pub(crate) is_over_hours: bool,
    /// See [`Candidate::closure_error`].
    pub(crate) closure_error: f64,
    /// See [`Candidate::settled_by`].
    pub(crate) settled_by: &'static str,
    /// What values of its parameters change.
    pub(crate) change: fn(&[f64], &mut Hypothesis),
    /// Whether a recording can show it.
    pub(crate) shown: fn(&Shows) -> bool,
}

impl Fault {
    /// As a candidate for a recording that shows so much.
    pub(crate) fn candidate(&self, shows: &Shows) -> Candidate {
        let [from_s, to_s] = shows.span_s;
        let hours = ((to_s - from_s) / 3600.0).clamp(1e-3, 1.0);
        let over = match (self.is_over_fastest, self.is_over_hours) {
            (true, _) => shows.fastest,
            (false, true) => hours.recip(),
            (false, false) => 1.0,
        };
        let scaled = |parameter: &Parameter| Parameter {
            low: over * parameter.low,
            high: over * parameter.high,
            neutral: over * parameter.neutral,
            practical: over * parameter.practical,
            ..*parameter
        };
        let starts = self.starts.chunks(self.parameters.len());
        let start = |values: &[f64]| values.iter().map(|value| over * value).collect();
        Candidate {
            name: self.name,
            kind: Kind::Sensor,
            equation: self.equation,
            description: self.description,
            parameters: self.parameters.iter().map(scaled).collect(),
            essential: self.parameters.len(),
            starts: starts.map(start).collect(),
            closure_error: self.closure_error,
            settled_by: match shows.probes || self.settled_by == THERE_AND_BACK {
                true => self.settled_by,
                false => OF_A_RECEIVER,
            },
            change: Change::Hypothesis(self.change),
            scope: Scope::Whole,
        }
    }
}

/// What settles a fault of a receiver, which stands at no probe.
const OF_A_RECEIVER: &str = "the same passes with another drone in the receiver's place: what comes back is not its instrument's";

pub(crate) const GAIN: Fault = Fault {
    name: "sensor_gain",
    aliases: &[],
    equation: "y -> (1 + g) y",
    description: "the sensor reads too much or too little by one factor",
    parameters: &[Parameter::new("g", "1", [-0.9, 0.9], 0.07)],
    starts: &[0.08],
    is_over_fastest: false,
    is_over_hours: false,
    closure_error: 0.0,
    settled_by: "the same hover with a second probe beside the first, or the probe in a calibrated stream at two speeds",
    change: |p, h| h.sensor.gain = p[0],
    shown: |_| true,
};

/// Of a probe. What is practical lies beyond what the maker allows: that much is fitted everywhere.
pub(crate) const OFFSET: Fault = Fault {
    name: "sensor_offset",
    aliases: &["ambient_background"],
    equation: "y -> y + b",
    description: "the sensor reads too much or too little by one amount",
    parameters: &[Parameter::new("b", "m/s", [-1.5, 1.5], 0.08)],
    starts: &[0.08],
    settled_by: MOTORS_OFF,
    change: |p, h| h.sensor.offset = p[0],
    shown: |shows| shows.probes,
    ..GAIN
};

const OFFSET_OF_RATIO: Fault = Fault {
    parameters: &[Parameter::new("b", "1", [-0.3, 0.3], 0.02)],
    starts: &[0.02],
    shown: |shows| !shows.probes,
    ..OFFSET
};

/// One low-pass after the declared one; a single slower one in their place is its closure's error.
pub(crate) const LAG: Fault = Fault {
    name: "sensor_lag",
    equation: "tau y' = x - y",
    description: "the sensor is slow",
    parameters: &[Parameter::new("tau", "s", [0.0, 8.0], 0.25)],
    starts: &[0.8],
    closure_error: 0.02,
    settled_by: THERE_AND_BACK,
    change: |p, h| h.sensor.lag_s = p[0],
    shown: |shows| shows.moves || shows.probes || shows.receiver_travels,
    ..GAIN
};

/// A pass through a jet lasts a second: the fit must begin within half of one.
pub(crate) const CLOCK: Fault = Fault {
    name: "clock_misalignment",
    aliases: &["time_offset"],
    equation: "y(t) -> y(t + dt)",
    description: "the drones' clock and the sensors' disagree",
    parameters: &[Parameter::new(
        "dt",
        "s",
        [-CLOCK_RANGE_S, CLOCK_RANGE_S],
        0.15,
    )],
    starts: &[
        -4.0, -3.6, -3.2, -2.8, -2.4, -2.0, -1.6, -1.2, -0.8, -0.4, 0.4, 0.8, 1.2, 1.6, 2.0, 2.4,
        2.8, 3.2, 3.6, 4.0,
    ],
    settled_by: THERE_AND_BACK,
    change: |p, h| h.sensor.clock_s = p[0],
    shown: LAG.shown,
    ..GAIN
};

pub(crate) const DRIFT: Fault = Fault {
    name: "sensor_drift",
    equation: "y -> (1 + g' t) y + b' t",
    description: "the sensor's calibration drifts with time",
    parameters: &[
        Parameter::new("g'", "1/h", [-1.0, 1.0], 0.07),
        Parameter::new("b'", "m/s/h", [-2.0, 2.0], 0.08),
    ],
    starts: &[0.03, 0.03, -0.03, -0.03],
    is_over_hours: true,
    settled_by: "the first hover once more at the end of the flight",
    change: |p, h| {
        h.sensor.gain_drift_per_h = p[0];
        h.sensor.offset_drift_per_h = p[1];
    },
    shown: |shows| shows.probes,
    ..GAIN
};

/// Every fault, in the order in which they are tried.
pub(super) static FAULTS: [Fault; 8] = [
    GAIN,
    OFFSET,
    OFFSET_OF_RATIO,
    LAG,
    CLOCK,
    DRIFT,
    Fault {
        name: "sensor_saturation",
        equation: "y -> min(y, y_max)",
        description: "the sensor does not read above a ceiling",
        parameters: &[Parameter {
            neutral: 1.3,
            ..Parameter::new("y_max", "m/s", [0.2, 1.3], 0.2)
        }],
        starts: &[0.95],
        is_over_fastest: true,
        settled_by: "a hover closer above the probe, where it should read more",
        change: |p, h| h.sensor.saturation = p[0],
        shown: |shows| shows.probes,
        ..GAIN
    },
    Fault {
        name: "magnitude_sensor",
        equation: "y = sqrt(U^2 + kappa^2 V^2 + a^2)",
        description: "the probe sees the air that is drawn in, which the simulation leaves out",
        parameters: &[Parameter::new("kappa", "1", [0.0, 2.5], 0.5)],
        starts: &[0.8],
        settled_by: ONE_AXIS,
        change: |p, h| h.effects.entrainment_radial = Some(EntrainmentRadial { factor: p[0] }),
        shown: |shows| shows.probes && shows.axial_only,
        ..GAIN
    },
];
