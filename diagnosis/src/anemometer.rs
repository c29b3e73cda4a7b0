//! What a speed probe makes of the air: magnitude, ambient, low-pass, gain and offset.
//!
//! ```text
//! y = (1 + gain) · L[ √((U + W)² + V² + a²) ] + offset,      L: ẏ = (x - y)/τ
//! ```
//!
//! A probe of magnitude never reads the jet alone, and no scalar is taken off it: subtracting the ambient speed from a magnitude
//! makes a jet look up to 0.1 U_C weaker where the two are alike.

use nalgebra::{Point3, Vector3};

use crate::baseline::Observation;
use crate::flow::Flow;
use crate::recording::{Environment, Instrument, Measures, ProbeSample};

/// Steps of the low-pass in a time constant. Chosen here: the air is taken as linear within a step, which leaves less than a
/// hundredth of its change in a time constant.
const STEPS_PER_TAU: f64 = 5.0;

/// What the makers allow a probe to be off by, as it enters a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calibration {
    /// Relative; 0: as true.
    pub gain: f64,
    /// Absolute (m/s); 0: as true.
    pub offset_mps: f64,
}

/// The steady reading (m/s) of a true probe in air of a velocity (world frame, z up), ambient and observation as declared.
#[must_use]
pub fn steady_reading_mps(
    velocity_mps: Vector3<f64>,
    environment: &Environment,
    measures: Measures,
    observation: Observation,
) -> f64 {
    if measures == Measures::Axial {
        return -velocity_mps.z;
    }
    let radial2 = match observation {
        Observation::AxialAndAmbient => 0.0,
        Observation::VelocityAndAmbient => {
            velocity_mps.x * velocity_mps.x + velocity_mps.y * velocity_mps.y
        }
    };
    let ambient_mps = environment.ambient_mps;
    let magnitude_mps =
        (velocity_mps.z * velocity_mps.z + radial2 + ambient_mps * ambient_mps).sqrt();
    if environment.ambient_is_subtracted {
        magnitude_mps - ambient_mps
    } else {
        magnitude_mps
    }
}

/// Readings (m/s) of one probe, whose samples come in the order of time; `None` where some drone's place is not known.
#[must_use]
pub fn readings_mps(
    flow: &Flow,
    environment: &Environment,
    observation: Observation,
    instrument: &Instrument,
    calibration: Calibration,
    samples: &[ProbeSample],
) -> Vec<Option<f64>> {
    let steady = |t_s: f64, point_m: Point3<f64>| {
        let velocity_mps = flow.velocity_mps(t_s, point_m)?;
        Some(steady_reading_mps(
            velocity_mps,
            environment,
            instrument.measures,
            observation,
        ))
    };
    let mut held: Option<(ProbeSample, f64)> = None;
    let mut readings = Vec::with_capacity(samples.len());
    for &sample in samples {
        let now_mps = steady(sample.t_s, sample.position_m);
        let lagged_mps = match (now_mps, held) {
            (None, _) => None,
            // Nothing to lag behind: the probe has come to rest in the air it is in.
            (Some(now_mps), None) => Some(now_mps),
            (Some(now_mps), Some(_)) if instrument.lowpass_tau_s <= 0.0 => Some(now_mps),
            (Some(_), Some((before, before_mps))) => {
                lag(before, before_mps, sample, instrument.lowpass_tau_s, steady)
            }
        };
        held = lagged_mps.map(|reading_mps| (sample, reading_mps));
        let calibrated =
            |reading_mps| (1.0 + calibration.gain) * reading_mps + calibration.offset_mps;
        readings.push(lagged_mps.map(calibrated));
    }
    readings
}

/// Carries a lagged reading from one sample to the next through the air between them.
fn lag(
    before: ProbeSample,
    before_mps: f64,
    sample: ProbeSample,
    tau_s: f64,
    steady: impl Fn(f64, Point3<f64>) -> Option<f64>,
) -> Option<f64> {
    let span_s = sample.t_s - before.t_s;
    let steps = (span_s / tau_s * STEPS_PER_TAU).ceil().clamp(1.0, 1e4);
    let step_s = span_s / steps;
    let kept = (-step_s / tau_s).exp();
    let mut reading_mps = before_mps;
    let mut x_before_mps = steady(before.t_s, before.position_m)?;
    for step in 1..=steps as u32 {
        let share = f64::from(step) / steps;
        let point_m = before.position_m + (sample.position_m - before.position_m) * share;
        let x_mps = steady(before.t_s + span_s * share, point_m)?;
        // Exact for air that changes linearly within the step.
        let slope = (x_mps - x_before_mps) / step_s;
        let settled_mps = x_mps - slope * tau_s;
        reading_mps = settled_mps + (reading_mps - (x_before_mps - slope * tau_s)) * kept;
        x_before_mps = x_mps;
    }
    Some(reading_mps)
}
