//! The vertical force on a drone beyond thrust and weight: recorded, and simulated from the air it meets.
//!
//! ```text
//! recorded   F = m a_z - T z_z          a: specific force, z_z: vertical part of the body's axis, T: thrust map
//! simulated  F = (τ(α) - 1) T z_z       τ: thrust left in the air met, by the declared receiver law
//! ```
//!
//! Both pass the same low-pass. Negative: pushed down. The thrust map must have been identified in free flight before.

use airflow::{DiscPoints, Source};

use crate::forward::flow::Flow;
use crate::forward::low_pass::{self, LowPass};
use crate::forward::receiver;
use crate::forward::simulate::{Channel, Sample};
use crate::record::baseline::{ReceiverAir, ReceiverLaw};
use crate::record::recording::Recording;
use crate::record::remark::{Remark, RemarkKind};
use crate::thrust::free_flight::Trace;

/// Air (m/s, downwards) that a vehicle meets at each entry of its track, both ways of meeting it; not a number where some other
/// drone's place is not known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AirMet {
    /// At the centre of its rotor plane.
    pub centre_mps: Vec<f64>,
    /// Mean over its rotor discs.
    pub disc_mean_mps: Vec<f64>,
}

impl AirMet {
    /// The air over the whole track of a vehicle of the recording. `clock_s` is what its clock is ahead of the recording's (s);
    /// those of the others are set in the flow.
    #[must_use]
    pub fn along(recording: &Recording, flow: &Flow, vehicle: usize, clock_s: f64) -> AirMet {
        let met = &recording.vehicles[vehicle];
        let discs = met.airframe.disc_points();
        let mut air = AirMet {
            centre_mps: Vec::with_capacity(met.track.t_s.len()),
            disc_mean_mps: Vec::with_capacity(met.track.t_s.len()),
        };
        let mut sources = Vec::with_capacity(recording.vehicles.len());
        for row in 0..met.track.t_s.len() {
            let [centre, mean] =
                at_row(recording, flow, vehicle, clock_s, row, &discs, &mut sources);
            air.centre_mps.push(centre);
            air.disc_mean_mps.push(mean);
        }
        air
    }

    /// The one that a baseline declares.
    #[must_use]
    pub fn declared(&self, air: ReceiverAir) -> &[f64] {
        match air {
            ReceiverAir::Centre => &self.centre_mps,
            ReceiverAir::DiscMean => &self.disc_mean_mps,
        }
    }
}

/// Air at the centre and over the discs, at one entry of a vehicle's track.
pub(crate) fn at_row<'s>(
    recording: &Recording,
    flow: &'s Flow,
    vehicle: usize,
    clock_s: f64,
    row: usize,
    discs: &DiscPoints,
    sources: &mut Vec<Source<'s>>,
) -> [f64; 2] {
    let track = &recording.vehicles[vehicle].track;
    let centre_m = track.position_m[row];
    if !flow.sources_at(track.t_s[row] - clock_s, centre_m, Some(vehicle), sources) {
        return [f64::NAN; 2];
    }
    if sources
        .iter()
        .all(|source| source.position_m.z <= centre_m.z)
    {
        return [0.0; 2];
    }
    let superposition = flow.superposition();
    [
        airflow::axial_speed_mps(sources, centre_m, superposition),
        airflow::mean_over_discs_mps(sources, discs, centre_m, superposition),
    ]
}

/// Vertical force (N) that a law and the air met leave of a vertical thrust, low-passed within stretches where all is known.
///
/// `thrust_n` is the vertical part of the thrust in still air at each entry, `hover_mps` the receiver's own `U_H`.
pub(crate) fn simulated_n(
    law: ReceiverLaw,
    trace: &Trace,
    thrust_n: &[f64],
    air_mps: &[f64],
    hover_mps: f64,
    low_pass: LowPass,
) -> Vec<f64> {
    let one = |(thrust_n, air_mps): (&f64, &f64)| match *air_mps == 0.0 {
        true => 0.0 * thrust_n,
        false => (receiver::thrust_ratio(law, air_mps / hover_mps) - 1.0) * thrust_n,
    };
    let mut force_n: Vec<f64> = thrust_n.iter().zip(air_mps).map(one).collect();
    let track = &trace.of.track;
    let usable = |row: usize| force_n[row].is_finite();
    for run in low_pass::runs(&track.t_s, track.longest_step_s, usable) {
        low_pass.smooth(&track.t_s[run.clone()], &mut force_n[run]);
    }
    force_n
}

/// Recorded force (N) at each entry: lift minus vertical thrust, low-passed; not a number where either is not known.
pub(crate) fn recorded_n(trace: &Trace, thrust_n: &[f64], low_pass: LowPass) -> Vec<f64> {
    let mut smooth_n = thrust_n.to_vec();
    trace.smooth(low_pass, &mut smooth_n);
    trace
        .lift_n
        .iter()
        .zip(smooth_n)
        .map(|(lift_n, thrust_n)| lift_n - thrust_n)
        .collect()
}

/// Every vertical force of a recording that a thrust map allows, as its baseline declares the simulation, and what was left out.
///
/// Rows are counted along each vehicle's track.
#[must_use]
pub fn simulate(
    recording: &Recording,
    flow: &Flow,
    low_pass: LowPass,
) -> (Vec<Sample>, Vec<Remark>) {
    let baseline = &recording.baseline;
    let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
    let (mut samples, mut remarks) = (Vec::new(), Vec::new());
    for (index, vehicle) in recording.vehicles.iter().enumerate() {
        let Some(map) = &vehicle.thrust_map else {
            continue;
        };
        let all = std::slice::from_ref(recording);
        // What is around it matters to identification and judgement only.
        let Some(trace) = Trace::new(all, (0, index), Vec::new(), low_pass) else {
            continue;
        };
        let Some(thrust_n) = trace.thrust_n(map) else {
            continue;
        };
        let hover_mps = vehicle
            .airframe
            .hover_induced_velocity_mps(vehicle.airframe.mass_kg(), density_kg_per_m3);
        let met = AirMet::along(recording, flow, index, 0.0);
        let air_mps = met.declared(baseline.receiver_air);
        let recorded_n = recorded_n(&trace, &thrust_n, low_pass);
        let simulated_n = simulated_n(
            baseline.receiver_law,
            &trace,
            &thrust_n,
            air_mps,
            hover_mps,
            low_pass,
        );
        let track = &vehicle.track;
        let before = samples.len();
        for row in 0..track.t_s.len() {
            if !(recorded_n[row] + simulated_n[row]).is_finite() {
                continue;
            }
            let (t_s, position_m) = (track.t_s[row], track.position_m[row]);
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
        let remark = |kind, samples, message| Remark {
            kind,
            subject: Some(vehicle.id.clone()),
            samples,
            span_s: None,
            message,
        };
        let unknown = track.t_s.len() - (samples.len() - before);
        if unknown > 0 {
            let message = format!(
                "{unknown} of {} entries have no force: specific force, attitude, duty cycle, battery or another drone's place is missing",
                track.t_s.len()
            );
            remarks.push(remark(RemarkKind::Gap, unknown, message));
        }
        let outside = map.rows_outside(track);
        if outside > 0 {
            let [low, high] = map.duty_range();
            let message = format!(
                "{outside} of {} entries have a motor outside the duty cycles {low:.3} to {high:.3} that the thrust map was fitted in",
                track.t_s.len()
            );
            remarks.push(remark(RemarkKind::OutOfRange, outside, message));
        }
    }
    (samples, remarks)
}
