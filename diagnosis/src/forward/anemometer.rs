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

/// Some rows of one probe, in the order of time: what was worked out once for all that is supposed.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// Through the instrument as its maker declares it; `None` before it was looked for.
    course: Option<Course>,
    /// From every moment of it every vehicle with a wake; empty where air takes its time: that is
    /// left to each simulation.
    sightings: Vec<Sighting>,
    /// Vehicles with a wake.
    emitters: usize,
}

impl Seen {
    /// Looks around from all moments that some rows ask for.
    #[must_use]
    pub fn of(flow: &Flow, probes: &Probes, rows: &[usize]) -> Seen {
        let course = Course::new(probes, rows, probes.instrument.lowpass_tau_s);
        let moments = course.moments.iter().filter(|_| flow.is_prompt());
        let around = moments.map(|moment| flow.sightings(moment.t_s, moment.point_m));
        let around: Vec<Vec<Sighting>> = around.collect();
        Seen {
            course: Some(course),
            emitters: around.first().map_or(0, Vec::len),
            sightings: around.concat(),
        }
    }

    /// From one of the moments.
    fn from(&self, moment: usize) -> Option<&[Sighting]> {
        self.sightings
            .get(moment * self.emitters..(moment + 1) * self.emitters)
            .filter(|seen| !seen.is_empty())
    }
}

/// Readings (m/s) of one probe in some rows of a recording's, which come in the order of time, with
/// what is `seen` from them, of a probe that is so much slower (s) than its maker says, before what
/// else is wrong with it; `None` where some drone's place is not known.
#[must_use]
pub fn readings_mps(
    flow: &Flow,
    (probes, rows, seen): (&Probes, &[usize], &Seen),
    lag_s: f64,
) -> Vec<Option<f64>> {
    let measures = probes.instrument.measures;
    // Two low-passes in a row are nearly one of the summed time constant.
    let tau_s = probes.instrument.lowpass_tau_s + lag_s;
    let known = seen.course.as_ref().filter(|known| known.tau_s == tau_s);
    let is_seen = known.is_some() && flow.is_prompt();
    let own = known.is_none().then(|| Course::new(probes, rows, tau_s));
    let Some(course) = known.or(own.as_ref()) else {
        return Vec::new();
    };
    let steady = |index: usize| {
        let Moment { t_s, point_m, .. } = course.moments[index];
        match seen.from(index).filter(|_| is_seen) {
            Some(seen) => {
                let velocity_mps = flow.velocity_seen_mps(t_s, point_m, seen)?;
                Some(magnitude_mps(flow, measures, t_s, velocity_mps))
            }
            None => steady_reading_mps(flow, measures, t_s, point_m),
        }
    };
    let mut held: Option<Held> = None;
    let mut readings = Vec::with_capacity(rows.len());
    let mut from = 0;
    for &to in &course.ends {
        // Nothing to lag behind: the probe has come to rest in the air it is in.
        let asked = if held.is_none() { to - 1..to } else { from..to };
        for moment in asked {
            let lags = |steady_mps| course.moments[moment].lags(held, steady_mps);
            held = steady(moment).map(lags);
            if held.is_none() {
                break;
            }
        }
        from = to;
        readings.push(held.map(|held| held.read_mps));
    }
    readings
}

/// The air at the last moment, and what the probe read of it.
#[derive(Clone, Copy)]
struct Held {
    steady_mps: f64,
    read_mps: f64,
}

/// Time constants after which a low-pass has forgotten: e^-8 is 0.0003.
const MEMORY: f64 = 8.0;

/// The moments at which readings through one low-pass ask for the air.
#[derive(Clone, Debug)]
struct Course {
    tau_s: f64,
    /// In the order of time.
    moments: Vec<Moment>,
    /// Of each row, how many moments there are up to its own, the last of them.
    ends: Vec<usize>,
}

/// A moment on the way of a probe.
#[derive(Clone, Copy, Debug)]
struct Moment {
    t_s: f64,
    point_m: Point3<f64>,
    /// What is left of what was held the moment before; `None` where that is forgotten.
    low_pass: Option<LowPass>,
}

/// A low-pass over one step, exact for air that changes linearly within it.
#[derive(Clone, Copy, Debug)]
struct LowPass {
    /// Time constant over the step.
    tau_over_step: f64,
    /// Share of the last deviation that is left after the step.
    kept: f64,
}

impl Moment {
    /// What is held when the air is this, after what was.
    fn lags(&self, before: Option<Held>, steady_mps: f64) -> Held {
        let read_mps = self
            .low_pass
            .zip(before)
            .map_or(steady_mps, |(it, before)| {
                let behind_mps = (steady_mps - before.steady_mps) * it.tau_over_step;
                let deviation_mps = before.read_mps - (before.steady_mps - behind_mps);
                steady_mps - behind_mps + deviation_mps * it.kept
            });
        Held {
            steady_mps,
            read_mps,
        }
    }
}

impl Course {
    /// Of some rows, which come in the order of time.
    ///
    /// What air of an age `a` weighs in a reading falls as e^(-a/τ), and what a step of length `h`
    /// leaves out grows as h²: steps that lengthen as e^(a/2τ) leave out as much each.
    fn new(probes: &Probes, rows: &[usize], tau_s: f64) -> Course {
        let mut course = Course {
            tau_s,
            moments: Vec::with_capacity(rows.len()),
            ends: Vec::with_capacity(rows.len()),
        };
        let mut before: Option<ProbeSample> = None;
        for sample in rows.iter().map(|&row| probes.samples[row]) {
            match before.filter(|_| tau_s > 0.0) {
                Some(from) => course.add(&from, &sample),
                None => course.moments.push(Moment {
                    t_s: sample.t_s,
                    point_m: sample.position_m,
                    low_pass: None,
                }),
            }
            course.ends.push(course.moments.len());
            before = Some(sample);
        }
        course
    }

    /// From one sample to the next, through the air between them.
    fn add(&mut self, from: &ProbeSample, sample: &ProbeSample) {
        let tau_s = self.tau_s;
        let whole_s = sample.t_s - from.t_s;
        let span_s = whole_s.min(MEMORY * tau_s);
        let mut add = |age_s: f64, low_pass: Option<LowPass>| {
            let along = match age_s {
                0.0 => 0.0,
                _ => age_s / whole_s,
            };
            self.moments.push(Moment {
                t_s: sample.t_s - age_s,
                point_m: sample.position_m + (from.position_m - sample.position_m) * along,
                low_pass,
            });
        };
        if span_s < whole_s {
            // The rest is forgotten.
            add(span_s, None);
        }
        let forgotten = -(-0.5 * span_s / tau_s).exp_m1();
        let steps = (2.0 * STEPS_PER_TAU * forgotten).ceil().max(1.0);
        let age_s = |step: u32| -2.0 * tau_s * (-forgotten * f64::from(step) / steps).ln_1p();
        let mut age_before_s = span_s;
        for step in (0..steps as u32).rev() {
            // Its own moment to the last bit.
            let age_s = if step == 0 { 0.0 } else { age_s(step) };
            let step_s = age_before_s - age_s;
            let low_pass = LowPass {
                tau_over_step: tau_s / step_s,
                kept: (-step_s / tau_s).exp(),
            };
            add(age_s, Some(low_pass));
            age_before_s = age_s;
        }
    }
}
