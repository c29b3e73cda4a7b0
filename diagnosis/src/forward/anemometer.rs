//! What a speed probe makes of the air: magnitude, ambient, low-pass, gain and offset.
//!
//! ```text
//! y = (1 + gain) · L[ √((U + W)² + V² + a²) ] + offset,      L: ẏ = (x - y)/τ
//! ```
//!
//! A probe of magnitude never reads the jet alone, and no scalar is taken off it: subtracting the
//! ambient speed from a magnitude makes a jet look up to 0.1 U_C weaker where the two are alike.

use nalgebra::{Point3, Vector3};

use crate::forward::flow::{Flow, Sighting};
use crate::forward::hypothesis::Sensor;
use crate::record::recording::{Measures, ProbeSample, Probes};

/// Steps of the low-pass in the latest time constant. Chosen here: the air is taken as linear
/// within a step, which leaves less than a hundredth of its change in a time constant.
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
    Some(magnitude_mps(
        flow,
        measures,
        t_s,
        flow.velocity_mps(t_s, point_m, None)?,
    ))
}

fn magnitude_mps(flow: &Flow, measures: Measures, t_s: f64, velocity_mps: Vector3<f64>) -> f64 {
    if measures == Measures::Axial {
        return -velocity_mps.z;
    }
    let environment = &flow.recording().environment;
    let square = velocity_mps.norm_squared() + flow.ambient_mps(t_s).powi(2);
    let subtracted_mps = match environment.ambient_is_subtracted {
        true => environment.ambient_mps,
        false => 0.0,
    };
    square.sqrt() - subtracted_mps
}

/// Some rows of one probe, in the order of time, with where the drones are seen from each.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// Of every row every vehicle with a wake; empty before they are looked for.
    sightings: Vec<Sighting>,
    /// Vehicles with a wake.
    emitters: usize,
}

impl Seen {
    /// Looks around from some rows; where air takes its time, that is left to each simulation.
    #[must_use]
    pub fn of(flow: &Flow, probes: &Probes, rows: &[usize]) -> Seen {
        if !flow.is_prompt() {
            return Seen::default();
        }
        let samples = rows.iter().map(|&row| probes.samples[row]);
        let around = samples.map(|sample| flow.sightings(sample.t_s, sample.position_m));
        let around: Vec<Vec<Sighting>> = around.collect();
        Seen {
            emitters: around.first().map_or(0, Vec::len),
            sightings: around.concat(),
        }
    }

    /// From one of the rows, by its place among them.
    fn from(&self, place: usize) -> Option<&[Sighting]> {
        self.sightings
            .get(place * self.emitters..(place + 1) * self.emitters)
            .filter(|seen| !seen.is_empty())
    }
}

/// Readings (m/s) of one probe in some rows of a recording's, which come in the order of time, with
/// what is `seen` from them; `None` where some drone's place is not known. What drifts does so from
/// `first_s` on, the time of the recording's first reading.
#[must_use]
pub fn readings_mps(
    flow: &Flow,
    (probes, rows, seen): (&Probes, &[usize], &Seen),
    sensor: &Sensor,
    first_s: f64,
) -> Vec<Option<f64>> {
    let instrument = &probes.instrument;
    let is_prompt = flow.is_prompt();
    let steady = |t_s, point_m| steady_reading_mps(flow, instrument.measures, t_s, point_m);
    let steady_at = |place: usize, sample: &ProbeSample| {
        let (t_s, point_m) = (sample.t_s, sample.position_m);
        match seen.from(place).filter(|_| is_prompt) {
            Some(seen) => {
                let velocity_mps = flow.velocity_seen_mps(t_s, point_m, seen)?;
                Some(magnitude_mps(flow, instrument.measures, t_s, velocity_mps))
            }
            None => steady(t_s, point_m),
        }
    };
    // Two low-passes in a row are nearly one of the summed time constant.
    let tau_s = instrument.lowpass_tau_s + sensor.lag_s;
    let mut held: Option<Held> = None;
    let mut readings = Vec::with_capacity(rows.len());
    for (place, sample) in rows.iter().map(|&row| probes.samples[row]).enumerate() {
        let steady_mps = steady_at(place, &sample);
        let lagged_mps = match (&held, steady_mps) {
            (Some(before), Some(steady_mps)) if tau_s > 0.0 => {
                lag(before, (&sample, steady_mps), tau_s, steady)
            }
            // Nothing to lag behind: the probe has come to rest in the air it is in.
            _ => steady_mps,
        };
        held = lagged_mps
            .zip(steady_mps)
            .map(|(read_mps, steady_mps)| Held {
                sample,
                steady_mps,
                read_mps,
            });
        let since_s = sample.t_s - first_s;
        readings.push(lagged_mps.map(|reading_mps| sensor.reads(reading_mps, since_s)));
    }
    readings
}

/// The last sample, the air there, and what the probe read of it.
struct Held {
    sample: ProbeSample,
    steady_mps: f64,
    read_mps: f64,
}

/// Time constants after which a low-pass has forgotten: e^-8 is 0.0003.
const MEMORY: f64 = 8.0;

/// Carries a lagged reading from one sample to the next through the air between them.
///
/// What air of an age `a` weighs in the reading falls as e^(-a/τ), and what a step of length `h`
/// leaves out grows as h²: steps that lengthen as e^(a/2τ) leave out as much each.
fn lag(
    before: &Held,
    (sample, steady_mps): (&ProbeSample, f64),
    tau_s: f64,
    steady: impl Fn(f64, Point3<f64>) -> Option<f64>,
) -> Option<f64> {
    let from = &before.sample;
    let whole_s = sample.t_s - from.t_s;
    let span_s = whole_s.min(MEMORY * tau_s);
    let at = |age_s: f64| {
        let point_m = sample.position_m + (from.position_m - sample.position_m) * (age_s / whole_s);
        steady(sample.t_s - age_s, point_m)
    };
    let forgotten = -(-0.5 * span_s / tau_s).exp_m1();
    let steps = (2.0 * STEPS_PER_TAU * forgotten).ceil().max(1.0);
    let age_s = |step: u32| -2.0 * tau_s * (-forgotten * f64::from(step) / steps).ln_1p();
    let (mut x_before_mps, mut reading_mps) = match span_s < whole_s {
        // The rest is forgotten.
        true => {
            let x_mps = at(span_s)?;
            (x_mps, x_mps)
        }
        false => (before.steady_mps, before.read_mps),
    };
    let mut age_before_s = span_s;
    for step in (0..steps as u32).rev() {
        let age_s = age_s(step);
        let x_mps = match step {
            0 => steady_mps,
            _ => at(age_s)?,
        };
        // Exact for air that changes linearly within the step.
        let step_s = age_before_s - age_s;
        let slope = (x_mps - x_before_mps) / step_s;
        let settled_mps = x_mps - slope * tau_s;
        let kept = (-step_s / tau_s).exp();
        reading_mps = settled_mps + (reading_mps - (x_before_mps - slope * tau_s)) * kept;
        (x_before_mps, age_before_s) = (x_mps, age_s);
    }
    Some(reading_mps)
}
