//! What the declared simulation would have recorded, at every sample that was.

use nalgebra::Point3;

use crate::anemometer::{self, Calibration};
use crate::baseline::ReceiverLaw;
use crate::flow::Flow;
use crate::receiver;
use crate::recording::{ProbeSample, Recording};
use crate::remark::{Remark, RemarkKind};

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
    /// Place in the wake that blows hardest there; `None`: no drone above.
    pub place: Option<Place>,
}

/// A place in one drone's wake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Index of the vehicle that blows.
    pub emitter: usize,
    /// Depth below its rotor plane over its motor distance.
    pub s_over_l: f64,
    /// Distance from its axis over its motor distance.
    pub r_over_l: f64,
    /// The same distance over the half-width at that depth.
    pub xi: f64,
    /// Azimuth around its axis in the world (rad), from x towards y.
    pub azimuth_rad: f64,
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
    simulate_probes(recording, &flow, &mut simulation);
    simulate_throttles(recording, &flow, &mut simulation);
    simulation
}

fn simulate_probes(recording: &Recording, flow: &Flow, into: &mut Simulation) {
    let Some(probes) = &recording.probes else {
        return;
    };
    let mut ids: Vec<u32> = probes.samples.iter().map(|s| s.probe_id).collect();
    ids.sort_unstable();
    ids.dedup();
    let first = into.samples.len();
    for id in ids {
        let mut rows: Vec<usize> = (0..probes.samples.len())
            .filter(|&row| probes.samples[row].probe_id == id)
            .filter(|&row| probes.samples[row].speed_mps.is_finite()) // told where it was read
            .collect();
        rows.sort_by(|&a, &b| probes.samples[a].t_s.total_cmp(&probes.samples[b].t_s));
        let of_probe: Vec<ProbeSample> = rows.iter().map(|&row| probes.samples[row]).collect();
        let readings_mps = anemometer::readings_mps(
            flow,
            &recording.environment,
            recording.baseline.observation,
            &probes.instrument,
            Calibration::default(),
            &of_probe,
        );
        let mut unknown = Unknown::default();
        for ((&row, sample), reading_mps) in rows.iter().zip(&of_probe).zip(readings_mps) {
            let velocity_mps = flow.velocity_mps(sample.t_s, sample.position_m);
            let (Some(simulated), Some(velocity_mps)) = (reading_mps, velocity_mps) else {
                unknown.note(sample.t_s);
                continue;
            };
            into.samples.push(Sample {
                channel: Channel::Speed,
                row,
                t_s: sample.t_s,
                subject: id,
                position_m: sample.position_m,
                recorded: sample.speed_mps,
                simulated,
                air_mps: -velocity_mps.z,
                place: flow.place(sample.t_s, sample.position_m, None),
            });
        }
        into.left_out
            .extend(unknown.remark(&format!("probe {id}"), "readings"));
    }
    into.samples[first..].sort_by_key(|sample| sample.row);
}

fn simulate_throttles(recording: &Recording, flow: &Flow, into: &mut Simulation) {
    // A drone that holds its power holds its throttle: nothing to compare.
    let law = recording.baseline.receiver_law;
    if law == ReceiverLaw::HoldsPower {
        return;
    }
    let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
    let mut unknown = vec![Unknown::default(); recording.vehicles.len()];
    for (row, sample) in recording.receivers.iter().enumerate() {
        if !sample.throttle_ratio.is_finite() {
            continue; // told where it was read
        }
        let vehicle = &recording.vehicles[sample.vehicle];
        let met = vehicle.track.moment(sample.t_s).and_then(|moment| {
            let centre_m = vehicle.track.position_at(moment);
            let air_mps = receiver::air_met_mps(
                flow,
                recording.baseline.receiver_air,
                &recording.vehicles,
                sample.vehicle,
                sample.t_s,
                centre_m,
            )?;
            Some((centre_m, air_mps))
        });
        let Some((position_m, air_mps)) = met else {
            unknown[sample.vehicle].note(sample.t_s);
            continue;
        };
        let airframe = &vehicle.airframe;
        let hover_mps = airframe.hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3);
        into.samples.push(Sample {
            channel: Channel::Throttle,
            row,
            t_s: sample.t_s,
            subject: sample.vehicle as u32,
            position_m,
            recorded: sample.throttle_ratio,
            simulated: receiver::throttle_ratio(law, air_mps / hover_mps),
            air_mps,
            place: flow.place(sample.t_s, position_m, Some(sample.vehicle)),
        });
    }
    for (vehicle, unknown) in recording.vehicles.iter().zip(unknown) {
        into.left_out
            .extend(unknown.remark(&vehicle.id, "throttle readings"));
    }
}

/// Samples at times when some drone's place is not known.
#[derive(Clone, Debug, Default)]
struct Unknown {
    samples: usize,
    span_s: Option<(f64, f64)>,
}

impl Unknown {
    fn note(&mut self, t_s: f64) {
        self.samples += 1;
        let (from_s, to_s) = self.span_s.unwrap_or((t_s, t_s));
        self.span_s = Some((from_s.min(t_s), to_s.max(t_s)));
    }

    fn remark(self, subject: &str, what: &str) -> Option<Remark> {
        let (from_s, to_s) = self.span_s?;
        Some(Remark {
            kind: RemarkKind::Gap,
            subject: Some(subject.to_owned()),
            samples: self.samples,
            span_s: self.span_s,
            message: format!(
                "{} {what} between {from_s:.2} and {to_s:.2} s are not simulated: some drone's place is not known then",
                self.samples
            ),
        })
    }
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
