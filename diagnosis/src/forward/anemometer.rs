//! What a speed probe makes of the air: magnitude, ambient, low-pass, gain and offset.
//!
//! ```text
//! y = (1 + gain) · L[ √((U + W)² + V² + a²) ] + offset,      L: ẏ = (x - y)/τ
//! ```
//!
//! A probe of magnitude never reads the jet alone, and no scalar is taken off it: subtracting the
//! ambient speed from a magnitude makes a jet look up to 0.1 U_C weaker where the two are alike.

use nalgebra::Point3;

use crate::forward::flow::Flow;
use crate::forward::hypothesis::Sensor;
use crate::record::recording::{Measures, ProbeSample, Probes};

/// Steps of the low-pass in a time constant. Chosen here: the air is taken as linear within a step,
/// which leaves less than a hundredth of its change in a time constant.
const STEPS_PER_TAU: f64 = 5.0;

/// The steady reading (m/s) of a true probe at a time and point; `None` where some drone's place is
/// not known.
#[must_use]
pub fn steady_reading_mps(
    flow: &Flow,
    measures: Measures,
    t_s: f64,
    point_m: Point3<f64>,
) -> Option<f64> {
    let velocity_mps = flow.velocity_mps(t_s, point_m, None)?;
    if measures == Measures::Axial {
        return Some(-velocity_mps.z);
    }
    let environment = &flow.recording().environment;
    let square = velocity_mps.norm_squared() + flow.ambient_mps(t_s).powi(2);
    let subtracted_mps = match environment.ambient_is_subtracted {
        true => environment.ambient_mps,
        false => 0.0,
    };
    Some(square.sqrt() - subtracted_mps)
}

/// Readings (m/s) of one probe in some rows of a recording's, which come in the order of time;
/// `None` where some drone's place is not known. What drifts does so from the recording's first
/// reading on.
#[must_use]
pub fn readings_mps(
    flow: &Flow,
    probes: &Probes,
    sensor: &Sensor,
    rows: &[usize],
) -> Vec<Option<f64>> {
    let instrument = &probes.instrument;
    let times_s = probes.samples.iter().map(|sample| sample.t_s);
    let first_s = times_s.fold(f64::INFINITY, f64::min);
    let steady = |t_s, point_m| steady_reading_mps(flow, instrument.measures, t_s, point_m);
    // Two low-passes in a row are nearly one of the summed time constant.
    let tau_s = instrument.lowpass_tau_s + sensor.lag_s;
    let mut held: Option<(ProbeSample, f64)> = None;
    let mut readings = Vec::with_capacity(rows.len());
    for sample in rows.iter().map(|&row| probes.samples[row]) {
        let lagged_mps = match held {
            Some((before, before_mps)) if tau_s > 0.0 => {
                lag(before, before_mps, sample, tau_s, steady)
            }
            // Nothing to lag behind: the probe has come to rest in the air it is in.
            _ => steady(sample.t_s, sample.position_m),
        };
        held = lagged_mps.map(|reading_mps| (sample, reading_mps));
        let since_s = sample.t_s - first_s;
        readings.push(lagged_mps.map(|reading_mps| sensor.reads(reading_mps, since_s)));
    }
    readings
}

/// Time constants after which a low-pass has forgotten: e^-8 is 0.0003.
const MEMORY: f64 = 8.0;

/// Carries a lagged reading from one sample to the next through the air between them.
fn lag(
    before: ProbeSample,
    before_mps: f64,
    sample: ProbeSample,
    tau_s: f64,
    steady: impl Fn(f64, Point3<f64>) -> Option<f64>,
) -> Option<f64> {
    let whole_s = sample.t_s - before.t_s;
    let span_s = whole_s.min(MEMORY * tau_s);
    let from_share = 1.0 - span_s / whole_s;
    let at = |share: f64| {
        let share = from_share + share * (1.0 - from_share);
        let point_m = before.position_m + (sample.position_m - before.position_m) * share;
        steady(before.t_s + whole_s * share, point_m)
    };
    let steps = (span_s / tau_s * STEPS_PER_TAU).ceil().max(1.0);
    let step_s = span_s / steps;
    let kept = (-step_s / tau_s).exp();
    let mut x_before_mps = at(0.0)?;
    let mut reading_mps = match from_share > 0.0 {
        true => x_before_mps, // the rest is forgotten
        false => before_mps,
    };
    for step in 1..=steps as u32 {
        let x_mps = at(f64::from(step) / steps)?;
        // Exact for air that changes linearly within the step.
        let slope = (x_mps - x_before_mps) / step_s;
        let settled_mps = x_mps - slope * tau_s;
        reading_mps = settled_mps + (reading_mps - (x_before_mps - slope * tau_s)) * kept;
        x_before_mps = x_mps;
    }
    Some(reading_mps)
}
