//! What a speed probe makes of the air: magnitude, ambient, low-pass, gain and offset.
//!
//! ```text
//! y = (1 + gain) · L[ √((U + W)² + V² + a²) ] + offset
//! L: ẋ₁ = (x - x₁)/τ₁ as its maker states it, then ẋ₂ = (x₁ - x₂)/τ₂ of whatever makes it slower
//! ```
//!
//! Where a stretch of readings begins the probe has lagged behind air that is not known: its state
//! is what it reads there.
//!
//! A probe of magnitude never reads the jet alone, and no scalar is taken off it: subtracting the
//! ambient speed from a magnitude makes a jet look up to 0.1 U_C weaker where the two are alike.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{Point3, Vector3};

use crate::forward::flow::{Flow, Sighting, View};
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

/// Where drones are seen from all that some rows of one probe ask for: worked out once for all that
/// is supposed of other things, since fits mostly change these.
#[derive(Debug)]
pub struct Looked {
    /// By the baseline, and how its drones lean.
    declared: Arc<Seen>,
    /// By what was supposed last, the newest last.
    supposed: Mutex<VecDeque<Arc<Seen>>>,
}

/// Suppositions that are kept: a difference quotient goes back to where it came from. And sightings
/// that one of them has at most, some 6 MB. Chosen here.
const SUPPOSED: usize = 2;
const MOST_SIGHTINGS: usize = 1 << 16;

impl Looked {
    /// Looks around from all moments that some rows ask for.
    #[must_use]
    pub fn of(flow: &Flow, probes: &Probes, rows: &[usize]) -> Looked {
        let declared = Seen::of(flow, ProbeCourse::new(probes, rows, Late::default()), true);
        Looked {
            declared: Arc::new(declared),
            supposed: Mutex::default(),
        }
    }

    /// The same by another flow through a probe that is late; without sightings where these depend
    /// on more than a view, or are too many to be kept.
    fn by(&self, flow: &Flow, (probes, rows): (&Probes, &[usize]), late: Late) -> Arc<Seen> {
        let view = flow.view();
        let is_it = |seen: &&Arc<Seen>| seen.course.late == late && seen.view == view;
        if is_it(&&self.declared) {
            return self.declared.clone();
        }
        let supposed = || self.supposed.lock().unwrap_or_else(PoisonError::into_inner);
        let leans = flow.effects().wake_lean.is_some();
        if !leans && let Some(seen) = supposed().iter().find(is_it) {
            return seen.clone();
        }
        let course = ProbeCourse::new(probes, rows, late);
        if leans || course.moments.len() * view.emitters() > MOST_SIGHTINGS {
            return Arc::new(Seen::unseen(course));
        }
        let seen = Arc::new(Seen::of(flow, course, false));
        let mut supposed = supposed();
        supposed.push_back(seen.clone());
        if supposed.len() > SUPPOSED {
            supposed.pop_front();
        }
        seen
    }
}

/// Some rows of one probe, in the order of time, and from every moment that they ask for every
/// vehicle with a wake.
#[derive(Debug)]
struct Seen {
    course: ProbeCourse,
    view: View,
    /// Empty where each simulation looks for itself.
    sightings: Vec<Sighting>,
}

impl Seen {
    fn of(flow: &Flow, course: ProbeCourse, leans: bool) -> Seen {
        let view = flow.view();
        let mut sightings = Vec::with_capacity(course.moments.len() * view.emitters());
        for moment in &course.moments {
            sightings.extend(flow.sightings(leans, moment.t_s, moment.point_m));
        }
        Seen {
            course,
            view,
            sightings,
        }
    }

    fn unseen(course: ProbeCourse) -> Seen {
        Seen {
            course,
            view: View::default(),
            sightings: Vec::new(),
        }
    }

    fn from(&self, moment: usize) -> Option<&[Sighting]> {
        let emitters = self.view.emitters();
        self.sightings
            .get(moment * emitters..(moment + 1) * emitters)
            .filter(|seen| !seen.is_empty())
    }
}

/// Readings (m/s) of one probe in some rows of a recording's, which come in the order of time, with
/// what was `looked` for from them, with the lag and the clock of an instrument, before what else
/// is wrong with it; `None` where some drone's place is not known.
#[must_use]
pub fn readings_mps(
    flow: &Flow,
    (probes, rows, looked): (&Probes, &[usize], Option<&Looked>),
    sensor: &Sensor,
) -> Vec<Option<f64>> {
    let measures = probes.instrument.measures;
    let late = Late {
        lag_s: sensor.lag_s,
        place_ahead_s: flow.place_ahead_s(sensor.clock_s),
    };
    let seen = match looked {
        Some(looked) => looked.by(flow, (probes, rows), late),
        None => Arc::new(Seen::unseen(ProbeCourse::new(probes, rows, late))),
    };
    let course = &seen.course;
    let steady = |index: usize| {
        let ProbeMoment { t_s, point_m, .. } = course.moments[index];
        match seen.from(index) {
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
    for (&to, &row) in course.ends.iter().zip(rows) {
        if held.is_none() {
            let begins = |steady_mps| Held {
                steady_mps,
                read_mps: match course.is_prompt() {
                    true => [steady_mps; 2],
                    false => [probes.samples[row].speed_mps; 2],
                },
            };
            held = steady(to - 1).map(begins);
        } else {
            for moment in from..to {
                let lags = |steady_mps| course.moments[moment].lags(held, steady_mps);
                held = steady(moment).map(lags);
                if held.is_none() {
                    break;
                }
            }
        }
        from = to;
        readings.push(held.map(|held| held.read_mps[1]));
    }
    readings
}

/// The air at the last moment, and what the probe made of it after one low-pass and after both.
#[derive(Clone, Copy)]
struct Held {
    steady_mps: f64,
    read_mps: [f64; 2],
}

/// Time constants after which a low-pass has forgotten: e^-8 is 0.0003.
const MEMORY: f64 = 8.0;

/// How late a probe reads, beside what its maker says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Late {
    /// How much slower it is (s).
    lag_s: f64,
    /// How much later it is where it reads what it does (s).
    place_ahead_s: f64,
}

/// The moments at which readings through the low-passes ask for the air.
#[derive(Clone, Debug)]
struct ProbeCourse {
    /// Time constant as declared (s).
    tau_s: f64,
    late: Late,
    /// In the order of time.
    moments: Vec<ProbeMoment>,
    /// Of each row, how many moments there are up to its own, the last of them.
    ends: Vec<usize>,
}

/// A moment on the way of a probe.
#[derive(Clone, Copy, Debug)]
struct ProbeMoment {
    t_s: f64,
    point_m: Point3<f64>,
    /// What is left of what was held the moment before; `None` where that is forgotten.
    low_passes: Option<[LowPass; 2]>,
}

/// A low-pass over one step, exact for air that changes linearly within it.
#[derive(Clone, Copy, Debug)]
pub(super) struct LowPass {
    /// Time constant over the step.
    tau_over_step: f64,
    /// Share of the last deviation that is left after the step.
    kept: f64,
}

impl LowPass {
    /// Of a time constant (s) over a step (s).
    pub(super) fn new(tau_s: f64, step_s: f64) -> LowPass {
        LowPass {
            tau_over_step: tau_s / step_s,
            kept: (-step_s / tau_s).exp(),
        }
    }

    /// What comes out (m/s) after a step from what went in and came out before it to what goes in.
    pub(super) fn after(self, [before_mps, held_mps]: [f64; 2], now_mps: f64) -> f64 {
        let behind_mps = (now_mps - before_mps) * self.tau_over_step;
        let deviation_mps = held_mps - (before_mps - behind_mps);
        now_mps - behind_mps + deviation_mps * self.kept
    }
}

impl ProbeMoment {
    /// What is held when the air is this, after what was.
    fn lags(&self, before: Option<Held>, steady_mps: f64) -> Held {
        let Some(([declared, own], before)) = self.low_passes.zip(before) else {
            return Held {
                steady_mps,
                read_mps: [steady_mps; 2],
            };
        };
        let [first, second] = before.read_mps;
        let through = declared.after([before.steady_mps, first], steady_mps);
        Held {
            steady_mps,
            read_mps: [through, own.after([first, second], through)],
        }
    }
}

impl ProbeCourse {
    /// Of some rows, which come in the order of time.
    ///
    /// What air of an age `a` weighs in a reading falls as e^(-a/τ), and what a step of length `h`
    /// leaves out grows as h²: steps that lengthen as e^(a/2τ) leave out as much each.
    fn new(probes: &Probes, rows: &[usize], late: Late) -> ProbeCourse {
        let mut course = ProbeCourse {
            tau_s: probes.instrument.lowpass_tau_s,
            late,
            moments: Vec::with_capacity(rows.len()),
            ends: Vec::with_capacity(rows.len()),
        };
        let mut before: Option<ProbeSample> = None;
        let places_m = probes.places_m(rows, late.place_ahead_s);
        for (&row, position_m) in rows.iter().zip(places_m) {
            let sample = ProbeSample {
                position_m,
                ..probes.samples[row]
            };
            match before.filter(|_| !course.is_prompt()) {
                Some(from) => course.add(&from, &sample),
                None => course.moments.push(ProbeMoment {
                    t_s: sample.t_s,
                    point_m: sample.position_m,
                    low_passes: None,
                }),
            }
            course.ends.push(course.moments.len());
            before = Some(sample);
        }
        course
    }

    /// Whether readings follow the air at once.
    fn is_prompt(&self) -> bool {
        self.taus_s() == [0.0; 2]
    }

    /// Time constants as declared, and what comes on top (s).
    fn taus_s(&self) -> [f64; 2] {
        [self.tau_s, self.late.lag_s]
    }

    /// From one sample to the next, through the air between them.
    fn add(&mut self, from: &ProbeSample, sample: &ProbeSample) {
        let taus_s = self.taus_s();
        let tau_s = taus_s[0] + taus_s[1];
        let whole_s = sample.t_s - from.t_s;
        let span_s = whole_s.min(MEMORY * tau_s);
        let mut add = |age_s: f64, low_passes: Option<[LowPass; 2]>| {
            let along = match age_s {
                0.0 => 0.0,
                _ => age_s / whole_s,
            };
            self.moments.push(ProbeMoment {
                t_s: sample.t_s - age_s,
                point_m: sample.position_m + (from.position_m - sample.position_m) * along,
                low_passes,
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
            let low_passes = taus_s.map(|tau_s| LowPass::new(tau_s, step_s));
            add(age_s, Some(low_passes));
            age_before_s = age_s;
        }
    }
}
