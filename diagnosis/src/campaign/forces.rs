//! Vertical forces of several flights, thinned to what a diagnosis needs, and what any hypothesis makes of them.
//!
//! ```text
//! F = [ τ(α) g(z) s(V) f(V_h) - 1 ] T + F_drag          α = η (U + κ V_z)/U_H
//! ```
//!
//! `T` is the vertical thrust in still air by a thrust map that was identified in *other* flights, with nobody above and away from the floor; `τ` the receiver
//! law of the baseline; `g`, `s`, `f` what floor, battery and forward flight do. Recorded and simulated force pass the same low-pass.

use airflow::effects::{Effects, Reception, Surroundings};
use airflow::{DiscPoints, Superposition, Wake};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::covariates::{COORDINATES, covariates};
use super::options::CampaignOptions;
use crate::baseline::{Delay, ReceiverAir, Upper};
use crate::force;
use crate::free_flight::{self, Around, Trace};
use crate::held_out::deal;
use crate::hypothesis::Hypothesis;
use crate::identify::{Bench, IdentifyError};
use crate::low_pass::{self, LowPass};
use crate::observed::{Circumstances, Explained};
use crate::receiver::thrust_ratio;
use crate::recording::{Recording, Role};
use crate::select::FOLDS;
use crate::simulate::{Channel, Place, Sample};

/// Half-widths from its axis beyond which a drone above is taken to be without any effect, beside the receiver's own size. Chosen here: the
/// hover jet has less than half a percent of its speed there.
const REACH: f64 = 6.0;
/// Of steps where nothing is near, one in so many is judged, and of the others. Chosen here: half a second and a fifth of one, in which the
/// scatter forgets most.
const THINNED: usize = 5;
const NEAR: usize = 2;
/// Steps of a window, and before and after one that are simulated for what low-pass and lags remember.
const WINDOW: usize = 40;
const BEFORE: usize = 10;

/// Forces of a campaign.
#[derive(Clone, Debug)]
pub struct Forces<'a> {
    /// All recordings.
    pub recordings: &'a [Recording],
    /// One vehicle in one flight each, in the order of the flights' names.
    pub parts: Vec<Part>,
    /// Judged rows.
    pub rows: usize,
    /// What a hypothesis-free simulation gives.
    alone: bool,
    low_pass: LowPass,
    wakes: Vec<Wake>,
    /// Of every recording and vehicle: which of the wakes, `None` where it does not blow.
    wake_of: Vec<Vec<Option<usize>>>,
    /// Air of the hover jets at every step of every part (m/s).
    hover_air_mps: Vec<Vec<f64>>,
    /// One column for each of [`COORDINATES`].
    columns: Vec<Vec<f64>>,
    places: Vec<Option<Place>>,
}

/// One vehicle in one flight.
#[derive(Clone, Debug)]
pub struct Part {
    /// Which recording, and which of its vehicles.
    pub recording: usize,
    /// Which vehicle of it.
    pub vehicle: usize,
    /// Number of its flight among those judged, in the order of their names.
    pub flight: usize,
    /// Equal steps in time.
    pub steps: Vec<Step>,
    /// Parts of the steps without a gap.
    pub runs: Vec<std::ops::Range<usize>>,
    /// Steps that are judged.
    pub judged: Vec<usize>,
    /// Whether a step is simulated at all.
    is_needed: Vec<bool>,
    hover_mps: f64,
    discs: DiscPoints,
    radius_m: f64,
    length_m: f64,
    density_kg_per_m3: f64,
}

/// One moment of a part.
#[derive(Clone, Debug)]
pub struct Step {
    /// Row of the vehicle's track.
    pub row: usize,
    /// Time (s).
    pub t_s: f64,
    /// Place (m).
    pub position_m: Point3<f64>,
    /// Velocity (m/s).
    pub velocity_mps: Vector3<f64>,
    /// Vertical part of the thrust in still air (N).
    pub thrust_n: f64,
    /// Force recorded (N).
    pub recorded_n: f64,
    /// Height over the floor (m).
    pub height_m: f64,
    /// Battery voltage (V).
    pub battery_v: f64,
    /// That over its first in the flight.
    pub voltage_ratio: f64,
    /// Whether nobody is above and the floor far away.
    pub is_free: bool,
    /// Drones that may blow on it.
    pub above: Vec<Above>,
}

/// A drone above, at one moment.
#[derive(Clone, Copy, Debug)]
pub struct Above {
    /// Which vehicle of the recording.
    pub vehicle: usize,
    /// Where it is (m).
    pub position_m: Point3<f64>,
    /// How it moves (m/s).
    pub velocity_mps: Vector3<f64>,
}

impl<'a> Forces<'a> {
    /// The forces of the flights to be judged.
    ///
    /// # Errors
    /// A thrust map that cannot be identified.
    pub fn new(
        recordings: &'a [Recording],
        options: &CampaignOptions,
    ) -> Result<Forces<'a>, IdentifyError> {
        let is_judged = |index: usize| options.judge.is_empty() || options.judge.contains(&index);
        let (by_name, _) = deal(recordings, FOLDS);
        // Folds count the judged flights alone, so that each holds as many.
        let mut flight_of = vec![usize::MAX; recordings.len()];
        for (flight, &index) in by_name.iter().filter(|&&i| is_judged(i)).enumerate() {
            flight_of[index] = flight;
        }
        let wanted: Vec<(usize, usize)> = by_name
            .iter()
            .flat_map(|&index| (0..recordings[index].vehicles.len()).map(move |v| (index, v)))
            .filter(|&(index, v)| !options.except.contains(&recordings[index].vehicles[v].id))
            .collect();
        let low_pass = options.identify.low_pass;
        let traces: Vec<Trace> = wanted
            .par_iter()
            .filter_map(|&(index, vehicle)| {
                let free = &options.identify.free;
                let around = free_flight::around(&recordings[index], vehicle, free, 0.0);
                Trace::new(recordings, (index, vehicle), around, low_pass)
            })
            .collect();
        let mut groups: Vec<&str> = traces.iter().map(|t| options.share.group(t.of)).collect();
        groups.sort_unstable();
        groups.dedup();
        let mut parts: Vec<Part> = Vec::new();
        for group in groups {
            let of_group = || traces.iter().filter(|t| options.share.group(t.of) == group);
            let bench = Bench::new(of_group().collect(), &options.identify);
            for fold in 0..FOLDS {
                let held = |index: usize| {
                    flight_of[index] != usize::MAX && flight_of[index] % FOLDS == fold
                };
                if !of_group().any(|trace| held(trace.recording)) {
                    continue;
                }
                let map = bench.fit(|index| !held(index))?.map;
                let of_fold: Vec<&Trace> = of_group().filter(|t| held(t.recording)).collect();
                let made: Vec<Option<Part>> = of_fold
                    .par_iter()
                    .map(|trace| {
                        let thrust_n = trace.thrust_n(&map)?;
                        let flight = flight_of[trace.recording];
                        part(recordings, trace, &thrust_n, flight, options)
                    })
                    .collect();
                parts.extend(made.into_iter().flatten());
            }
        }
        parts.sort_by_key(|part| (part.flight, part.vehicle));
        let (wakes, wake_of) = wakes(recordings);
        let mut forces = Forces {
            recordings,
            parts,
            rows: 0,
            alone: options.alone || recordings.iter().all(|one| !one.baseline.wakes),
            low_pass,
            wakes,
            wake_of,
            hover_air_mps: Vec::new(),
            columns: Vec::new(),
            places: Vec::new(),
        };
        forces.choose_rows(options.most_rows);
        let plain = Hypothesis::default();
        forces.hover_air_mps = forces
            .parts
            .par_iter()
            .map(|part| forces.air_mps(part, &plain, &forces.wakes))
            .collect();
        (forces.columns, forces.places) = covariates(&forces);
        Ok(forces)
    }

    /// Windows of a few seconds, as many as are allowed, spread over all flights: simulating costs what is judged and little more.
    fn choose_rows(&mut self, most: usize) {
        let mut stride = 1;
        loop {
            let mut rows = 0;
            for (index, part) in self.parts.iter_mut().enumerate() {
                let is_kept = |at: usize| (at / WINDOW + index).is_multiple_of(stride);
                let steps = part.steps.iter().enumerate();
                let kept = steps.filter(|(at, step)| {
                    let every = if step.is_free { THINNED } else { NEAR };
                    is_kept(*at) && at % every == 0
                });
                part.judged = kept.map(|(at, _)| at).collect();
                part.is_needed = (0..part.steps.len())
                    .map(|at| {
                        is_kept(at) || is_kept(at + BEFORE) || is_kept(at.saturating_sub(BEFORE))
                    })
                    .collect();
                rows += part.judged.len();
            }
            self.rows = rows;
            if rows <= most.max(1) || stride > 50 {
                return;
            }
            stride += 1;
        }
    }

    /// Whether no wakes blow unless a hypothesis says so.
    #[must_use]
    pub fn is_alone(&self) -> bool {
        self.alone
    }

    /// Judged steps with their part, in order.
    pub fn judged(&self) -> impl Iterator<Item = (&Part, &Step)> + '_ {
        let of = |part: &'_ Part| part.judged.len();
        debug_assert_eq!(self.parts.iter().map(of).sum::<usize>(), self.rows);
        self.parts
            .iter()
            .flat_map(|part| part.judged.iter().map(move |&at| (part, &part.steps[at])))
    }

    /// Air of the hover jets at every judged row (m/s).
    #[must_use]
    pub fn hover_air_mps(&self) -> Vec<f64> {
        let parts = self.parts.iter().zip(&self.hover_air_mps);
        parts
            .flat_map(|(part, air_mps)| part.judged.iter().map(|&at| air_mps[at]))
            .collect()
    }

    /// The judged rows, beside a simulation of them; rows count along them.
    #[must_use]
    pub fn samples(&self, simulated_n: &[f64]) -> Vec<Sample> {
        let air_mps = self.hover_air_mps();
        self.judged()
            .enumerate()
            .map(|(row, (part, step))| Sample {
                channel: Channel::VerticalForce,
                row,
                t_s: step.t_s,
                subject: part.vehicle as u32,
                position_m: step.position_m,
                recorded: step.recorded_n,
                simulated: simulated_n[row],
                air_mps: air_mps[row],
                place: self.places[row],
            })
            .collect()
    }

    /// Half-width (m) of a vehicle's hover jet at a depth.
    #[must_use]
    pub fn half_width_m(&self, recording: usize, vehicle: usize, depth_m: f64) -> Option<f64> {
        let wake = self.wake_of[recording][vehicle]?;
        Some(self.wakes[wake].half_width_m(depth_m))
    }

    /// Forces (N) at every step of every part under a hypothesis.
    #[must_use]
    pub fn at_every_step(&self, hypothesis: &Hypothesis) -> Vec<Vec<f64>> {
        let of_air = of_the_air(&hypothesis.effects);
        let blows = !self.alone || hypothesis.downwash.is_some();
        let factor = hypothesis.downwash.unwrap_or(1.0);
        let is_plain = of_air == Effects::default() && hypothesis.sensor.clock_s == 0.0;
        let wakes: Vec<Wake> = match is_plain || !blows {
            true => Vec::new(),
            false => self.wakes.iter().map(|w| w.with_effects(&of_air)).collect(),
        };
        let of_part = |(index, part): (usize, &Part)| {
            let air_mps = match (blows, is_plain) {
                (false, _) => vec![0.0; part.steps.len()],
                (true, true) => self.hover_air_mps[index]
                    .iter()
                    .map(|u| factor * u)
                    .collect(),
                (true, false) => {
                    let air_mps = self.air_mps(part, hypothesis, &wakes);
                    air_mps.into_iter().map(|u| factor * u).collect()
                }
            };
            self.forces_n(part, hypothesis, &air_mps)
        };
        let parts: Vec<(usize, &Part)> = self.parts.iter().enumerate().collect();
        parts.into_par_iter().map(of_part).collect()
    }

    fn forces_n(&self, part: &Part, hypothesis: &Hypothesis, air_mps: &[f64]) -> Vec<f64> {
        let effects = &hypothesis.effects;
        let law = self.recordings[part.recording].baseline.receiver_law;
        let mut forces_n: Vec<f64> = part
            .steps
            .iter()
            .zip(air_mps)
            .zip(&part.is_needed)
            .map(|((step, air_mps), is_needed)| {
                if !is_needed {
                    return 0.0;
                }
                let velocity_mps = step.velocity_mps;
                let mut alpha = air_mps / part.hover_mps;
                let reception = Reception {
                    height_m: Some(step.height_m),
                    gap_m: None,
                    propeller_radius_m: part.radius_m,
                    voltage_ratio: Some(step.voltage_ratio),
                };
                let mut factor = effects.thrust_ratio(&reception);
                if let Some(motion) = &effects.own_motion {
                    alpha = motion.met(alpha, velocity_mps.z / part.hover_mps);
                    let forward = velocity_mps.x.hypot(velocity_mps.y) / part.hover_mps;
                    factor *= motion.thrust_ratio(forward);
                }
                if let Some(battery) = &effects.battery_sag {
                    let throttle = battery.throttle_factor(step.voltage_ratio);
                    factor /= throttle * throttle;
                }
                let left = match effects.felt(alpha) {
                    0.0 => 1.0,
                    alpha => thrust_ratio(law, alpha),
                };
                let drag_n = effects.body_drag.map_or(0.0, |drag| {
                    let past_mps = air_mps + velocity_mps.z;
                    drag.force_n(part.density_kg_per_m3, part.length_m, past_mps)
                });
                (left * factor - 1.0) * step.thrust_n + drag_n
            })
            .collect();
        let times_s: Vec<f64> = part.steps.iter().map(|step| step.t_s).collect();
        let sensor = &hypothesis.sensor;
        for run in &part.runs {
            let t_s = &times_s[run.clone()];
            low_pass::lag(sensor.lag_s, t_s, &mut forces_n[run.clone()]);
            self.low_pass.smooth(t_s, &mut forces_n[run.clone()]);
        }
        let began_s = times_s.first().copied().unwrap_or(0.0);
        for (force_n, t_s) in forces_n.iter_mut().zip(&times_s) {
            *force_n = sensor.reads(*force_n, t_s - began_s);
        }
        forces_n
    }

    /// Air (m/s) at every step of a part: over the rotor discs or at the centre, as its baseline declares.
    fn air_mps(&self, part: &Part, hypothesis: &Hypothesis, wakes: &[Wake]) -> Vec<f64> {
        let recording = &self.recordings[part.recording];
        let effects = &hypothesis.effects;
        let clock_s = hypothesis.sensor.clock_s;
        let convection = match (effects.wake_transport, recording.baseline.delay) {
            (Some(transport), _) => transport.convection(),
            (None, Delay::Transport { convection }) => Some(convection),
            (None, Delay::None) => None,
        };
        let centre = DiscPoints {
            offsets_m: vec![[0.0; 2]],
            weights: vec![1.0],
        };
        let discs = match recording.baseline.receiver_air {
            ReceiverAir::Centre => &centre,
            ReceiverAir::DiscMean => &part.discs,
        };
        let wake_of = &self.wake_of[part.recording];
        let mut gathered = vec![0.0; discs.weights.len()];
        let mut at_step = |step: &Step| -> f64 {
            gathered.fill(0.0);
            for above in &step.above {
                let Some(wake) = wake_of[above.vehicle].map(|wake| &wakes[wake]) else {
                    continue;
                };
                let moved = match convection.is_some() || clock_s != 0.0 {
                    true => earlier(recording, step, above, wake, convection, clock_s),
                    false => *above,
                };
                let from_emitter_m = step.position_m - moved.position_m;
                if from_emitter_m.z >= 0.0 {
                    continue;
                }
                let at = Surroundings {
                    t_s: step.t_s,
                    climb_mps: moved.velocity_mps.z,
                    floor_z_m: recording.environment.floor_z_m,
                    emitter_z_m: moved.position_m.z,
                };
                for (so_far, &[x, y]) in gathered.iter_mut().zip(&discs.offsets_m) {
                    let offset_m = from_emitter_m + Vector3::new(x, y, 0.0);
                    let down_mps = -effects.meet(wake, offset_m, &at).z;
                    *so_far = match &effects.jet_merging {
                        Some(merging) => merging.gather(*so_far, down_mps),
                        None => match recording.baseline.superposition {
                            Superposition::Momentum => *so_far + down_mps * down_mps,
                            Superposition::Linear => *so_far + down_mps,
                            Superposition::Strongest => so_far.max(down_mps),
                        },
                    };
                }
            }
            let finish =
                |so_far: f64| match (&effects.jet_merging, recording.baseline.superposition) {
                    (Some(merging), _) => merging.finish(so_far),
                    (None, Superposition::Momentum) => so_far.sqrt(),
                    (None, _) => so_far,
                };
            let weighed = discs.weights.iter().zip(&gathered);
            weighed
                .map(|(weight, so_far)| weight * finish(*so_far))
                .sum()
        };
        let steps = part.steps.iter().zip(&part.is_needed);
        steps
            .map(|(step, is_needed)| if *is_needed { at_step(step) } else { 0.0 })
            .collect()
    }
}

impl Explained for Forces<'_> {
    fn recorded(&self) -> Vec<f64> {
        self.judged().map(|(_, step)| step.recorded_n).collect()
    }

    fn predict(&self, hypothesis: &Hypothesis) -> Vec<f64> {
        let every = self.at_every_step(hypothesis);
        let parts = self.parts.iter().zip(&every);
        parts
            .flat_map(|(part, forces_n)| part.judged.iter().map(|&at| forces_n[at]))
            .collect()
    }

    fn times_s(&self) -> Vec<f64> {
        self.judged().map(|(_, step)| step.t_s).collect()
    }

    fn circumstances(&self) -> Circumstances<'_> {
        Circumstances {
            names: &COORDINATES,
            columns: &self.columns,
        }
    }

    /// Rows are windows of a few seconds: too short for a rhythm.
    fn releases(&self) -> Vec<(Vec<usize>, Vec<f64>)> {
        Vec::new()
    }
}

/// The effects of the air alone, those of the receiver left out.
fn of_the_air(effects: &Effects) -> Effects {
    Effects {
        ground_effect_thrust: None,
        ceiling_effect: None,
        receiver_inflow: None,
        battery_sag: None,
        body_drag: None,
        own_motion: None,
        ..*effects
    }
}

/// A drone above when the air that arrives left it, on a clock that is ahead.
fn earlier(
    recording: &Recording,
    step: &Step,
    above: &Above,
    wake: &Wake,
    convection: Option<f64>,
    clock_s: f64,
) -> Above {
    let track = &recording.vehicles[above.vehicle].track;
    let mut moved = *above;
    // Four turns, as for single recordings: it contracts by climb speed over jet speed.
    for _ in 0..4 {
        let depth_m = moved.position_m.z - step.position_m.z;
        let ago_s = convection.map_or(0.0, |k| wake.far_field().transport_time_s(depth_m, k));
        let first_s = track.t_s.first().copied().unwrap_or(0.0);
        let Some(moment) = track.moment((step.t_s + clock_s - ago_s).max(first_s)) else {
            return *above;
        };
        moved.position_m = track.position_at(moment);
        moved.velocity_mps = track.velocity_at(moment);
    }
    moved
}

/// The wakes of a campaign, each once, and whose they are.
fn wakes(recordings: &[Recording]) -> (Vec<Wake>, Vec<Vec<Option<usize>>>) {
    let mut wakes: Vec<Wake> = Vec::new();
    let mut made: Vec<(usize, usize)> = Vec::new();
    let mut wake_of = Vec::with_capacity(recordings.len());
    for (index, recording) in recordings.iter().enumerate() {
        let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
        let mut of_recording = Vec::with_capacity(recording.vehicles.len());
        for (vehicle, of) in recording.vehicles.iter().enumerate() {
            let same = |&(other, at): &(usize, usize)| {
                let known: &Recording = &recordings[other];
                known.vehicles[at].airframe == of.airframe
                    && known.environment.air == recording.environment.air
                    && known.jet == recording.jet
                    && known.baseline.upper == recording.baseline.upper
            };
            let found = made.iter().position(same).unwrap_or_else(|| {
                let mass_kg = of.airframe.mass_kg();
                let wake = Wake::new(&of.airframe, mass_kg, density_kg_per_m3, &recording.jet);
                wakes.push(match recording.baseline.upper {
                    Upper::FourRotors => wake,
                    Upper::FarFieldExtrapolated => wake.extrapolated(),
                });
                made.push((index, vehicle));
                made.len() - 1
            });
            of_recording.push((of.role != Role::Receiver).then_some(found));
        }
        wake_of.push(of_recording);
    }
    (wakes, wake_of)
}

/// One vehicle's flight in equal steps; `None` where it has no force.
fn part(
    recordings: &[Recording],
    trace: &Trace,
    thrust_n: &[f64],
    flight: usize,
    options: &CampaignOptions,
) -> Option<Part> {
    let recording = &recordings[trace.recording];
    let track = &trace.of.track;
    let recorded_n = force::recorded_n(trace, thrust_n, options.identify.low_pass);
    let mut smooth_n = thrust_n.to_vec();
    trace.smooth(options.identify.low_pass, &mut smooth_n);
    let battery_v = track.battery_v.as_deref()?;
    let first_v = *battery_v.iter().find(|v| v.is_finite() && **v > 0.0)?;
    let floor_z_m = recording.environment.floor_z_m.unwrap_or(f64::NEG_INFINITY);
    let gap_s = 1.0 / options.rate_hz;
    let mut steps: Vec<Step> = Vec::new();
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    let usable = |row: usize| {
        (recorded_n[row] + smooth_n[row] + track.velocity_mps[row].norm()).is_finite()
            && trace.around[row] != Around::Unknown
    };
    let mut sources = Vec::new();
    for run in low_pass::runs(&track.t_s, track.longest_step_s, usable) {
        let from = steps.len();
        let mut next_s = f64::NEG_INFINITY;
        for row in run {
            let t_s = track.t_s[row];
            // A millisecond: times are decimal fractions.
            if t_s < next_s - 1e-3 || !above(recording, trace.vehicle, row, &mut sources) {
                continue;
            }
            next_s = t_s.max(next_s) + gap_s;
            let position_m = track.position_m[row];
            steps.push(Step {
                row,
                t_s,
                position_m,
                velocity_mps: track.velocity_mps[row],
                thrust_n: smooth_n[row],
                recorded_n: recorded_n[row],
                height_m: position_m.z - floor_z_m,
                battery_v: battery_v[row],
                voltage_ratio: battery_v[row] / first_v,
                is_free: trace.around[row] == Around::Free,
                above: sources.clone(),
            });
        }
        if steps.len() > from {
            runs.push(from..steps.len());
        }
    }
    let airframe = &trace.of.airframe;
    let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
    Some(Part {
        recording: trace.recording,
        vehicle: trace.vehicle,
        flight,
        steps,
        runs,
        judged: Vec::new(),
        is_needed: Vec::new(),
        hover_mps: airframe.hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3),
        discs: airframe.disc_points(),
        radius_m: 0.5 * airframe.propeller_diameter_m(),
        length_m: airframe.motor_distance_m(),
        density_kg_per_m3,
    })
}

/// The drones above an entry of a vehicle's track that may blow on it. `false`: some drone's place is not known then.
fn above(recording: &Recording, vehicle: usize, row: usize, found: &mut Vec<Above>) -> bool {
    found.clear();
    let track = &recording.vehicles[vehicle].track;
    let (t_s, position_m) = (track.t_s[row], track.position_m[row]);
    for (other, of) in recording.vehicles.iter().enumerate() {
        if other == vehicle || of.role == Role::Receiver {
            continue;
        }
        let Some(moment) = of.track.moment(t_s) else {
            return false;
        };
        let other_m = of.track.position_at(moment);
        let apart_m = other_m - position_m;
        let emitter_m = of.airframe.motor_distance_m();
        let half_m = recording.jet.spreading * (apart_m.z - recording.jet.origin * emitter_m);
        let own_m = recording.vehicles[vehicle].airframe.motor_distance_m();
        let reach_m = REACH * half_m + own_m;
        if apart_m.z > 0.0
            && apart_m.x.hypot(apart_m.y) < reach_m
            && !of.track.is_idle(moment.entry)
        {
            found.push(Above {
                vehicle: other,
                position_m: other_m,
                velocity_mps: of.track.velocity_at(moment),
            });
        }
    }
    true
}
