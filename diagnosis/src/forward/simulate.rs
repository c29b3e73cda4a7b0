//! What the declared simulation would have recorded, at every sample that was.

use std::sync::Arc;

use nalgebra::Point3;

use crate::forward::anemometer::{self, Looked};
use crate::forward::flow::Flow;
pub use crate::forward::flow::Place;
use crate::forward::hypothesis::Sensor;
use crate::forward::receiver;
use crate::record::baseline::ReceiverLaw;
use crate::record::read::{FAST_MPS, STUCK_READINGS};
use crate::record::recording::Recording;
use crate::record::remark::{Remark, RemarkKind};

/// A quantity that was recorded and can be simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// Reading of a speed probe (m/s).
    Speed,
    /// A receiver's throttle over that of its hover.
    Throttle,
    /// A receiver's power over that of its hover.
    Power,
    /// Vertical force on a receiver beyond thrust and weight (N), up positive.
    VerticalForce,
}

/// One recorded value beside the simulated one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// What it is of.
    pub channel: Channel,
    /// Data row, from 0, in the file that holds the channel.
    pub row: usize,
    /// Time (s).
    pub t_s: f64,
    /// Probe id, or index of the vehicle.
    pub subject: u32,
    /// Where it was measured (m).
    pub position_m: Point3<f64>,
    /// What was recorded.
    pub recorded: f64,
    /// What the simulation gives.
    pub simulated: f64,
    /// Axial speed of the air that is simulated there (m/s).
    pub air_mps: f64,
    /// Place in the strongest wake there; `None`: no drone above.
    pub place: Option<Place>,
}

/// A recording, simulated.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// In the order of the channels, then of the rows.
    pub samples: Vec<Sample>,
    /// What could not be simulated, and why.
    pub left_out: Vec<Remark>,
}

/// Simulates every probe and every receiver of a recording as its baseline declares.
#[must_use]
pub fn simulate(recording: &Recording) -> Simulation {
    let flow = Flow::new(recording);
    let mut simulation = Simulation {
        samples: Vec::new(),
        left_out: Vec::new(),
    };
    for series in series(recording) {
        let values = series.simulate(&flow, &Sensor::default());
        let (mut unknown_s, mut dead_s) = (Vec::new(), Vec::new());
        let is_dead = series.is_dead(&values);
        let recorded = series.rows.iter().zip(&series.recorded);
        for (((&row, &recorded), value), is_dead) in recorded.zip(values).zip(is_dead) {
            let t_s = series.channel.time_s(recording, row);
            match sample(&flow, &series, (row, recorded), value) {
                _ if is_dead => dead_s.push(t_s),
                Some(sample) => simulation.samples.push(sample),
                None => unknown_s.push(t_s),
            }
        }
        let subject = match series.channel {
            Channel::Speed => format!("probe {}", series.subject),
            _ => recording.vehicles[series.subject as usize].id.clone(),
        };
        let is_unknown = "not simulated: some drone's place is not known then";
        let is_dead = "left out: 0 without a break, also where the simulation has fast air: the instrument is dead then";
        for (kind, times_s, why) in [
            (RemarkKind::Gap, &unknown_s, is_unknown),
            (RemarkKind::Stuck, &dead_s, is_dead),
        ] {
            let told = left_out(kind, times_s, &subject, why);
            simulation.left_out.extend(told);
        }
    }
    let place = |sample: &Sample| (sample.channel, sample.row);
    simulation.samples.sort_by_key(place);
    simulation
}

/// What one probe or one receiver recorded, in the order of time.
#[derive(Clone, Debug)]
pub struct Series {
    /// What it recorded.
    pub channel: Channel,
    /// Probe id, or index of the vehicle.
    pub subject: u32,
    /// Its rows in the file of the channel, by time.
    pub rows: Vec<usize>,
    /// What was recorded in each of them.
    pub recorded: Vec<f64>,
    /// When the recording has its first reading of this channel (s), of whatever subject.
    pub first_s: f64,
    /// Where drones are seen from all that these rows of a probe ask for, once [`Series::look`] was
    /// called.
    looked: Option<Arc<Looked>>,
}

/// The series of a recording: probes by id, then receivers by vehicle.
#[must_use]
pub fn series(recording: &Recording) -> Vec<Series> {
    let probes = recording.probes.iter().flat_map(|probes| &probes.samples);
    let speeds = probes.map(|s| (s.probe_id, s.t_s, s.speed_mps));
    let speeds = by_subject(Channel::Speed, speeds);
    // A drone that holds its power holds its throttle: nothing to compare.
    if recording.baseline.receiver_law == ReceiverLaw::HoldsPower {
        return speeds;
    }
    let receivers = recording.receivers.iter();
    let throttles = receivers.map(|s| (s.vehicle as u32, s.t_s, s.throttle_ratio));
    let ratios = receiver::recorded_power_ratios(recording);
    let powers = recording.receivers.iter().zip(ratios);
    let powers = powers.map(|(s, ratio)| (s.vehicle as u32, s.t_s, ratio));
    let throttles = by_subject(Channel::Throttle, throttles);
    [speeds, throttles, by_subject(Channel::Power, powers)].concat()
}

/// From subject, time and value of each row. Values that are no numbers were reported where they
/// were read.
fn by_subject(channel: Channel, samples: impl Iterator<Item = (u32, f64, f64)>) -> Vec<Series> {
    let samples: Vec<(u32, f64, f64)> = samples.collect();
    let first_s = samples.iter().map(|sample| sample.1);
    let first_s = first_s.fold(f64::INFINITY, f64::min);
    let is_told = |row: &usize| samples[*row].2.is_finite();
    let mut order: Vec<usize> = (0..samples.len()).filter(is_told).collect();
    order.sort_by(|&a, &b| {
        let ((id_a, t_a, _), (id_b, t_b, _)) = (samples[a], samples[b]);
        id_a.cmp(&id_b).then(t_a.total_cmp(&t_b))
    });
    order
        .chunk_by(|&a, &b| samples[a].0 == samples[b].0)
        .map(|rows| Series {
            channel,
            subject: samples[rows[0]].0,
            recorded: rows.iter().map(|&row| samples[row].2).collect(),
            rows: rows.to_vec(),
            first_s,
            looked: None,
        })
        .collect()
}

impl Series {
    /// Its values as they would be in this air through a sensor with this lag and this clock,
    /// before its gain, offset, drift and saturation; `None` where some drone's place is not known.
    #[must_use]
    pub fn simulate(&self, flow: &Flow, sensor: &Sensor) -> Vec<Option<f64>> {
        match (self.channel, &flow.recording().probes) {
            (Channel::Speed, Some(probes)) => {
                let rows = (probes, self.rows.as_slice(), self.looked.as_deref());
                anemometer::readings_mps(flow, rows, sensor)
            }
            (Channel::Throttle | Channel::Power, _) => {
                let is_power = self.channel == Channel::Power;
                receiver::ratios(flow, sensor, &self.rows, is_power)
            }
            _ => vec![None; self.rows.len()],
        }
    }

    /// Of each row, whether the probe reads 0 as a dead one does: without a break, eight times or
    /// more where these simulated readings are faster than half of the fastest that it reads. No
    /// effect of the library takes all of the air out of a jet's middle.
    fn is_dead(&self, simulated: &[Option<f64>]) -> Vec<bool> {
        let mut is_dead = vec![false; self.rows.len()];
        let fastest_mps = self.recorded.iter().copied().fold(0.0, f64::max);
        // One that never reads anything else was reported where it was read.
        if self.channel != Channel::Speed || fastest_mps == 0.0 {
            return is_dead;
        }
        let least_mps = FAST_MPS.max(0.5 * fastest_mps);
        let mut from = 0;
        for run in self.recorded.chunk_by(|a, b| a == b) {
            let rows = from..from + run.len();
            let values = simulated[rows.clone()].iter().flatten();
            let fast = values.filter(|mps| **mps > least_mps).count();
            is_dead[rows.clone()].fill(run[0] == 0.0 && fast >= STUCK_READINGS);
            from = rows.end;
        }
        is_dead
    }

    /// Looks for the drones from every row once, for all simulations of these rows.
    pub fn look(&mut self, flow: &Flow) {
        if let (Channel::Speed, Some(probes)) = (self.channel, &flow.recording().probes) {
            self.looked = Some(Arc::new(Looked::of(flow, probes, &self.rows)));
        }
    }
}

impl Channel {
    fn time_s(self, recording: &Recording, row: usize) -> f64 {
        match (self, &recording.probes) {
            (Channel::Speed, Some(probes)) => probes.samples[row].t_s,
            _ => recording.receivers[row].t_s,
        }
    }
}

fn sample(
    flow: &Flow,
    series: &Series,
    (row, recorded): (usize, f64),
    simulated: Option<f64>,
) -> Option<Sample> {
    let recording = flow.recording();
    let t_s = series.channel.time_s(recording, row);
    let vehicle = series.subject as usize;
    let (position_m, but) = match (series.channel, &recording.probes) {
        (Channel::Speed, Some(probes)) => (probes.samples[row].position_m, None),
        _ => {
            let track = &recording.vehicles[vehicle].track;
            let position_m = flow.position_m(vehicle, track.moment(t_s)?);
            (position_m, Some(vehicle))
        }
    };
    Some(Sample {
        channel: series.channel,
        row,
        t_s,
        subject: series.subject,
        position_m,
        recorded,
        simulated: simulated?,
        air_mps: -flow.velocity_mps(t_s, position_m, but)?.z,
        place: flow.place(t_s, position_m, but),
    })
}

/// Of readings at these times (s), and why; `None` of none.
fn left_out(kind: RemarkKind, times_s: &[f64], subject: &str, why: &str) -> Option<Remark> {
    let times = || times_s.iter().copied();
    let (from_s, to_s) = (times().reduce(f64::min)?, times().reduce(f64::max)?);
    let samples = times_s.len();
    let message = format!("{samples} readings between {from_s:.2} and {to_s:.2} s are {why}");
    Some(Remark {
        samples,
        span_s: Some((from_s, to_s)),
        ..Remark::new(kind, Some(subject), message)
    })
}

impl Sample {
    /// Recorded minus simulated.
    #[must_use]
    pub fn residual(&self) -> f64 {
        self.recorded - self.simulated
    }
}

#[cfg(test)]
mod tests;
