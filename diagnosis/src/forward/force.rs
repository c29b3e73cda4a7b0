//! The vertical force on a drone beyond thrust and weight: recorded, and simulated from its
//! exposure.
//!
//! ```text
//! recorded   F = m a_z - T z_z          a: specific force, z_z: vertical part of the body's axis, T: thrust map
//! simulated  F = (τ(α) - 1) T z_z       τ: thrust left in the air met, by the declared receiver law
//! ```
//!
//! Both pass the same low-pass. Negative: pushed down. The thrust map must have been identified in
//! free flight before.

use airflow::DiscPoints;
use nalgebra::Point3;

use crate::forward::flow::Flow;
use crate::forward::receiver;
use crate::forward::simulate::{self as readings, Channel, Sample, Simulation};
use crate::record::baseline::ReceiverAir;
use crate::record::recording::Recording;
use crate::record::remark::{Remark, RemarkKind};
use crate::record::thrust_map::ThrustMap;
use crate::record::track::ThrustSource;
use crate::thrust::free_flight::Trace;
use crate::thrust::identify::LOW_PASS;
use crate::thrust::low_pass::{self, LowPass};

/// The vertical force on one vehicle at each entry of its track: recorded, and what any air makes
/// of its thrust.
pub(crate) struct Force<'a> {
    recording: &'a Recording,
    pub(crate) trace: &'a Trace<'a>,
    low_pass: LowPass,
    discs: DiscPoints,
    /// The vehicle's own `U_H`.
    hover_mps: f64,
    /// Vertical part of its thrust in still air (N).
    thrust_n: Vec<f64>,
    /// Lift minus vertical thrust (N), low-passed; not a number where either is not known.
    pub(crate) recorded_n: Vec<f64>,
}

impl<'a> Force<'a> {
    /// `None` without a map where one is needed.
    pub(crate) fn of(
        recording: &'a Recording,
        trace: &'a Trace<'a>,
        map: Option<&ThrustMap>,
        low_pass: LowPass,
    ) -> Option<Force<'a>> {
        let thrust_n = trace.thrust_n(map)?;
        Some(Force {
            recording,
            trace,
            low_pass,
            discs: trace.of.airframe.disc_points(),
            hover_mps: recording.hover_mps(trace.of),
            recorded_n: recorded_n(trace, &thrust_n, low_pass),
            thrust_n,
        })
    }

    /// Air (m/s, downwards) at each of its entries; not a number where some other drone's place is
    /// not known. `clock_s` is what its clock is ahead of the recording's (s); those of the others
    /// are set in the flow.
    pub(crate) fn air_mps(&self, flow: &Flow, air: ReceiverAir, clock_s: f64) -> Vec<f64> {
        let track = &self.trace.of.track;
        let others = |other| other != self.trace.vehicle;
        let met = |(t_s, &centre_m): (&f64, &Point3<f64>)| {
            flow.met_mps(air, &self.discs, (t_s - clock_s, centre_m), others)
                .unwrap_or(f64::NAN)
        };
        let places_m = flow.places_m(self.trace.vehicle);
        track.t_s.iter().zip(places_m).map(met).collect()
    }

    /// Vertical force (N) that the declared law leaves of the thrust in this air, low-passed within
    /// stretches where all is known.
    pub(crate) fn simulated_n(&self, air_mps: &[f64]) -> Vec<f64> {
        let law = self.recording.baseline.receiver_law;
        let one = |(thrust_n, air_mps): (&f64, &f64)| match *air_mps == 0.0 {
            true => 0.0 * thrust_n,
            false => (receiver::thrust_ratio(law, air_mps / self.hover_mps) - 1.0) * thrust_n,
        };
        let mut force_n: Vec<f64> = self.thrust_n.iter().zip(air_mps).map(one).collect();
        let track = &self.trace.of.track;
        let usable = |row: usize| force_n[row].is_finite();
        for run in low_pass::runs(&track.t_s, track.longest_step_s, usable) {
            self.low_pass
                .smooth(&track.t_s[run.clone()], &mut force_n[run]);
        }
        force_n
    }
}

/// Recorded force (N) at each entry: lift minus vertical thrust, low-passed; not a number where
/// either is not known.
pub(crate) fn recorded_n(trace: &Trace, thrust_n: &[f64], low_pass: LowPass) -> Vec<f64> {
    let mut smooth_n = thrust_n.to_vec();
    trace.smooth(low_pass, &mut smooth_n);
    let both = trace.lift_n.iter().zip(smooth_n);
    both.map(|(lift_n, thrust_n)| lift_n - thrust_n).collect()
}

/// Every reading of a recording, then every vertical force that its thrust maps allow, as its
/// baseline declares the simulation.
#[must_use]
pub fn simulate_all(recording: &Recording) -> Simulation {
    let Simulation {
        mut samples,
        mut left_out,
    } = readings::simulate(recording);
    let (forces, without_force) = simulate(recording, &Flow::new(recording), LOW_PASS);
    samples.extend(forces);
    left_out.extend(without_force);
    Simulation { samples, left_out }
}

/// Every vertical force of a recording that a thrust map allows, as its baseline declares the
/// simulation, and what was left out.
///
/// Rows are counted along each vehicle's track.
#[must_use]
pub fn simulate(
    recording: &Recording,
    flow: &Flow,
    low_pass: LowPass,
) -> (Vec<Sample>, Vec<Remark>) {
    let (mut samples, mut remarks) = (Vec::new(), Vec::new());
    for (index, vehicle) in recording.vehicles.iter().enumerate() {
        let map = vehicle.thrust_map.as_ref();
        let all = std::slice::from_ref(recording);
        let trace = Trace::of_each(all, vec![(0, index)], 0.0, low_pass).pop();
        let force = trace.as_ref();
        let Some(force) = force.and_then(|trace| Force::of(recording, trace, map, low_pass)) else {
            continue;
        };
        let air_mps = force.air_mps(flow, recording.baseline.receiver_air, 0.0);
        let (recorded_n, simulated_n) = (&force.recorded_n, force.simulated_n(&air_mps));
        let track = &vehicle.track;
        let before = samples.len();
        for row in 0..track.t_s.len() {
            if !(recorded_n[row] + simulated_n[row]).is_finite() {
                continue;
            }
            let (t_s, position_m) = (track.t_s[row], flow.places_m(index)[row]);
            samples.push(Sample {
                channel: Channel::VerticalForce,
                row,
                t_s,
                subject: index as u32,
                position_m,
                recorded: recorded_n[row],
                simulated: simulated_n[row],
                air_mps: air_mps[row],
                place: flow.place(t_s, position_m, Some(index)),
            });
        }
        let entries = track.t_s.len();
        let unknown = entries - (samples.len() - before);
        let no_force = format!(
            "{unknown} of {entries} entries have no force: specific force, attitude, duty cycle, battery or another drone's place is missing"
        );
        let duty = track.duty.as_deref().unwrap_or_default();
        let is_of_duty = trace
            .as_ref()
            .is_some_and(|trace| trace.source == ThrustSource::DutyCycle);
        let map = map.filter(|_| is_of_duty);
        let outside = map.map_or(0, |map| map.rows_outside(duty));
        let [low, high] = map.map_or([0.0, 1.0], ThrustMap::duty_range);
        let out_of_range = format!(
            "{outside} of {entries} entries have a motor outside the duty cycles {low:.3} to {high:.3} that the thrust map was fitted in"
        );
        let found = [
            (RemarkKind::Gap, unknown, no_force),
            (RemarkKind::OutOfRange, outside, out_of_range),
        ];
        let found = found.into_iter().filter(|(_, samples, _)| *samples > 0);
        remarks.extend(found.map(|(kind, samples, message)| Remark {
            samples,
            ..Remark::new(kind, Some(&vehicle.id), message)
        }));
    }
    (samples, remarks)
}
