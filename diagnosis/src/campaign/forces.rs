//! Vertical forces of several flights, thinned to what a diagnosis needs, and what any hypothesis
//! makes of them.
//!
//! ```text
//! F = [ τ(α) g(z) s(V) f(V_h) - 1 ] T + F_drag          α = η (U + κ V_z)/U_H
//! ```
//!
//! `T` is the vertical thrust in still air by a thrust map identified in *other* flights, away from
//! other drones and from the floor; `U` the air from the drones above; `V_z`, `V_h` the drone's own
//! climb and horizontal speed; `τ` the receiver law of the baseline; `g`, `s`, `f` what floor,
//! battery and forward flight do. Recorded and simulated force pass the same low-pass.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use airflow::effects::{Effects, Reception};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use crate::forward::flow::{Flow, Place, Wakes};
use crate::forward::force;
use crate::forward::hypothesis::Hypothesis;
use crate::forward::observed::{Covariates, Explained};
use crate::forward::receiver::thrust_ratio;
use crate::forward::simulate::{Channel, Sample};
use crate::record::recording::{Recording, Role};
use crate::statistics::held_out::FOLDS;
use crate::thrust::free_flight::{Around, Trace};
use crate::thrust::identify::{self, FoldMap, IdentifyError, deal, fold_maps};
use crate::thrust::low_pass::{self, LowPass};

/// Steps within a second of which some are judged. Chosen here: the forces hold nothing above some
/// 3 Hz.
pub(super) const RATE_HZ: f64 = 10.0;
/// Most moments within a second that are simulated, of logs that hold more. Chosen here, for time:
/// between them the force is taken as linear, which takes 1.2 % off what changes at 3 Hz
/// (`sinc²(3/50)`), and would take 26 % at ten a second.
const MOST_SIMULATED_HZ: f64 = 50.0;
/// Low-pass of everything compared. Chosen here, as [`RATE_HZ`].
pub(super) const LOW_PASS: LowPass = LowPass { cutoff_hz: 3.0 };
/// Most rows judged. Chosen here: a diagnosis of an hour of flights within a minute.
const MOST_ROWS: usize = 6000;
/// Of steps where no drone is near, one in so many is judged, and of the others. Chosen here: half
/// a second and a fifth of one, in which the scatter forgets most.
const THINNED: usize = 5;
const NEAR: usize = 2;
/// Steps of a window, and before and after one that are simulated for what low-pass and lags
/// remember.
const WINDOW: usize = 40;
const BEFORE: usize = 10;
/// Most windows of which one is judged. Chosen here, so that the search for a stride ends.
const MOST_STRIDE: usize = 51;
/// Half-widths from its axis beyond which a drone above is taken to be without any effect, beside
/// the receiver's own size. Chosen here: the hover jet has less than half a percent of its speed
/// there.
const REACH: f64 = 6.0;
/// Airs kept. Chosen here: some megabytes each for an hour of flights, and as many as fits on all
/// threads ask for at a time.
const MOST_KEPT: usize = 24;

/// How many of them, from the first, say where a row is: regions are described in these.
pub(super) const PLACES: usize = 6;

/// And how many of these, from the first, have to do with wakes and the floor, as all laws of the
/// library have; the others say where in the room.
pub(super) const PLACES_OF_LAWS: usize = 4;

/// Names of the coordinates and their letters, in the order of `covariates`.
pub const COORDINATES: [(&str, &str); 15] = [
    ("depth m", "s"),
    ("beside m", "r"),
    ("beside/half-width", "xi"),
    ("height m", "h"),
    ("x m", "x"),
    ("y m", "y"),
    ("drones above", "n"),
    ("air m/s", "U"),
    ("own climb m/s", "V_z"),
    ("own speed m/s", "V_h"),
    ("emitter climb m/s", "v_z"),
    ("emitter speed m/s", "v_e"),
    ("thrust N", "T"),
    ("battery V", "V"),
    ("time s", "t"),
];

/// What of a campaign is diagnosed, and from which beginning.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CampaignOptions {
    /// Recordings whose rows are judged, by index; empty: all. The others serve the thrust maps
    /// only.
    pub judge: Vec<usize>,
    /// Whether to begin with drones that fly alone, whatever the baseline says: no wakes at all.
    pub alone: bool,
}

/// Air (m/s) at every moment of every part.
type Airs = Arc<Vec<Vec<f64>>>;

/// Forces of a campaign.
#[derive(Debug)]
pub(super) struct Forces<'a> {
    pub(super) recordings: &'a [Recording],
    /// One vehicle in one flight each, in the order of the flights' names.
    pub(super) parts: Vec<VehicleFlight>,
    /// Judged rows.
    pub(super) rows: usize,
    /// Whether no drone has a wake unless a hypothesis says so.
    pub(super) alone: bool,
    wakes: Wakes,
    /// Air of the hover jets.
    hover_air_mps: Airs,
    /// One column for each of [`COORDINATES`].
    columns: Vec<Vec<f64>>,
    places: Vec<Option<Place>>,
    /// The last few airs with effects on, by effects and clock (s): many hypotheses differ in what
    /// a drone makes of the same air.
    kept: Mutex<VecDeque<((Effects, f64), Airs)>>,
}

#[derive(Clone, Debug)]
pub(super) struct VehicleFlight {
    /// Which recording, and which of its vehicles.
    pub(super) recording: usize,
    pub(super) vehicle: usize,
    /// Number of its flight among those judged, in the order of their names.
    pub(super) flight: usize,
    /// The moments that are simulated, as they are logged: what passes a low-pass must not be
    /// thinned before it.
    pub(super) moments: Vec<ForceSample>,
    /// Parts of the moments without a gap.
    runs: Vec<Range<usize>>,
    /// Moments that are equal steps in time.
    pub(super) steps: Vec<usize>,
    /// Moments that are judged, steps all of them.
    pub(super) judged: Vec<usize>,
    /// Whether a moment is simulated at all.
    is_needed: Vec<bool>,
    hover_mps: f64,
}

/// One moment of a part.
#[derive(Clone, Debug)]
pub(super) struct ForceSample {
    pub(super) t_s: f64,
    pub(super) position_m: Point3<f64>,
    pub(super) velocity_mps: Vector3<f64>,
    /// Vertical part of the thrust in still air (N), as flown, and low-passed.
    thrust_n: f64,
    pub(super) smooth_n: f64,
    /// Force recorded (N).
    pub(super) recorded_n: f64,
    /// Height over the floor (m).
    pub(super) height_m: f64,
    /// Not a number where it is not logged.
    pub(super) battery_v: f64,
    /// That over its first in the flight, where it is logged.
    pub(super) voltage_ratio: Option<f64>,
    /// Whether no drone is above and the floor far away.
    pub(super) is_free: bool,
    /// Drones above whose wake may reach it.
    pub(super) above: Vec<Above>,
}

/// A drone above, at one moment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Above {
    /// Which vehicle of the recording.
    pub(super) vehicle: usize,
    pub(super) position_m: Point3<f64>,
    pub(super) velocity_mps: Vector3<f64>,
}

impl<'a> Forces<'a> {
    /// The forces of the flights to be judged.
    ///
    /// # Errors
    /// A thrust map that cannot be identified.
    pub(super) fn new(
        recordings: &'a [Recording],
        options: &CampaignOptions,
    ) -> Result<Forces<'a>, IdentifyError> {
        let is_judged = |index: usize| options.judge.is_empty() || options.judge.contains(&index);
        let (by_name, _) = deal(recordings, FOLDS);
        // Folds count the judged flights alone, so that each holds as many.
        let mut flight_of: Vec<Option<usize>> = vec![None; recordings.len()];
        for (flight, &index) in by_name.iter().filter(|&&i| is_judged(i)).enumerate() {
            flight_of[index] = Some(flight);
        }
        let fold_of: Vec<Option<usize>> = flight_of.iter().map(|of| Some((*of)? % FOLDS)).collect();
        let identify = identify::Options {
            low_pass: LOW_PASS,
            ..identify::Options::default()
        };
        let wakes = Wakes::of_all(recordings);
        let traces = Trace::of_all(recordings, &by_name, 0.0, LOW_PASS);
        let maps = fold_maps(&traces, &fold_of, &identify).map_err(|failed| failed.error)?;
        let of_trace = |trace: &Trace| {
            let map = FoldMap::of(&maps, fold_of[trace.recording]?, trace.of);
            let thrust_n = trace.thrust_n(map)?;
            let flight = flight_of[trace.recording]?;
            let places_m = wakes.places_m(trace.recording, trace.vehicle);
            let recording = &recordings[trace.recording];
            Some(VehicleFlight::new(
                recording, trace, places_m, &thrust_n, flight,
            ))
        };
        let mut parts: Vec<VehicleFlight> = traces.par_iter().filter_map(of_trace).collect();
        parts.sort_by_key(|part| (part.flight, part.vehicle));
        let mut forces = Forces {
            recordings,
            parts,
            rows: 0,
            alone: options.alone || recordings.iter().all(|one| !one.baseline.wakes),
            wakes,
            hover_air_mps: Arc::default(),
            columns: Vec::new(),
            places: Vec::new(),
            kept: Mutex::default(),
        };
        forces.choose_rows();
        forces.hover_air_mps = forces.air_mps(&Hypothesis::default(), &forces.wakes);
        (forces.columns, forces.places) = covariates(&forces);
        Ok(forces)
    }

    /// Windows of a few seconds, as many as are allowed, spread over all flights: simulating costs
    /// what is judged and little more.
    fn choose_rows(&mut self) {
        for stride in 1..=MOST_STRIDE {
            for (index, part) in self.parts.iter_mut().enumerate() {
                let is_kept = |step: usize| (step / WINDOW + index).is_multiple_of(stride);
                let is_judged = |&(step, &at): &(usize, &usize)| {
                    let is_free = part.moments[at].is_free;
                    is_kept(step) && step.is_multiple_of(if is_free { THINNED } else { NEAR })
                };
                let judged = part.steps.iter().enumerate().filter(is_judged);
                part.judged = judged.map(|(_, &at)| at).collect();
                let near = |step: usize| [step, step + BEFORE, step.saturating_sub(BEFORE)];
                // The first moment of a part is a step.
                let mut step = 0;
                let is_needed = |at: usize| {
                    step += usize::from(part.steps.get(step + 1) == Some(&at));
                    near(step).into_iter().any(is_kept)
                };
                part.is_needed = (0..part.moments.len()).map(is_needed).collect();
            }
            self.rows = self.parts.iter().map(|part| part.judged.len()).sum();
            if self.rows <= MOST_ROWS {
                return;
            }
        }
    }

    /// Judged moments with their part, in order.
    pub(super) fn judged(&self) -> impl Iterator<Item = (&VehicleFlight, &ForceSample)> + '_ {
        self.parts
            .iter()
            .flat_map(|part| part.judged.iter().map(move |&at| (part, &part.moments[at])))
    }

    /// Of values at every moment of every part those at the judged rows.
    pub(super) fn at_judged(&self, every: &[Vec<f64>]) -> Vec<f64> {
        let parts = self.parts.iter().zip(every);
        parts
            .flat_map(|(part, values)| part.judged.iter().map(|&at| values[at]))
            .collect()
    }

    /// Air of the hover jets at every judged row (m/s).
    fn hover_air_mps(&self) -> Vec<f64> {
        self.at_judged(&self.hover_air_mps)
    }

    /// The judged rows, beside a simulation of them; rows count along them.
    pub(super) fn samples(&self, simulated_n: &[f64]) -> Vec<Sample> {
        let air_mps = self.hover_air_mps();
        let sample = |(row, (part, step)): (usize, (&VehicleFlight, &ForceSample))| Sample {
            channel: Channel::VerticalForce,
            row,
            t_s: step.t_s,
            subject: part.vehicle as u32,
            position_m: step.position_m,
            recorded: step.recorded_n,
            simulated: simulated_n[row],
            air_mps: air_mps[row],
            place: self.places[row],
        };
        self.judged().enumerate().map(sample).collect()
    }

    /// Forces (N) at every moment of every part under a hypothesis; 0 at those that are not needed.
    pub(super) fn at_every_moment(&self, hypothesis: &Hypothesis) -> Vec<Vec<f64>> {
        // The effects of the air alone, those of the receiver left out.
        let effects = Effects {
            ground_effect_thrust: None,
            ceiling_effect: None,
            receiver_inflow: None,
            battery_sag: None,
            body_drag: None,
            own_motion: None,
            ..hypothesis.effects
        };
        let of_air = Hypothesis {
            effects,
            ..*hypothesis
        };
        let has_wake = !self.alone || hypothesis.downwash.is_some();
        let air_mps = has_wake.then(|| self.known_air_mps(&of_air));
        let factor = hypothesis.downwash.unwrap_or(1.0);
        let of_part = |(index, part): (usize, &VehicleFlight)| {
            let air_mps = air_mps.as_ref().map(|air_mps| &air_mps[index]);
            part.forces_n(&self.recordings[part.recording], hypothesis, |at| {
                air_mps.map_or(0.0, |air_mps| factor * air_mps[at])
            })
        };
        self.parts.par_iter().enumerate().map(of_part).collect()
    }

    /// Air under a hypothesis, from those kept where it is there.
    fn known_air_mps(&self, of_air: &Hypothesis) -> Airs {
        let key = (of_air.effects, of_air.sensor.clock_s);
        if key == (Effects::default(), 0.0) {
            return Arc::clone(&self.hover_air_mps);
        }
        // A thread that has panicked leaves nothing half done here.
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, air_mps)) = kept().iter().find(|(known, _)| *known == key) {
            return Arc::clone(air_mps);
        }
        let air_mps = self.air_mps(of_air, &self.wakes.with_effects(&of_air.effects));
        let mut kept = kept();
        if kept.len() >= MOST_KEPT {
            kept.pop_front();
        }
        kept.push_back((key, Arc::clone(&air_mps)));
        air_mps
    }

    /// Air (m/s) over the rotor discs or at the centre, as each baseline declares. Where a delay
    /// leads back into a gap of a track, the air of the hover jets stands.
    fn air_mps(&self, of_air: &Hypothesis, wakes: &Wakes) -> Airs {
        let of_part = |(index, part): (usize, &VehicleFlight)| -> Vec<f64> {
            let recording = &self.recordings[part.recording];
            let flow = Flow::through((recording, part.recording), wakes, of_air);
            let air = recording.baseline.receiver_air;
            let discs = recording.vehicles[part.vehicle].airframe.disc_points();
            let at_moment = |at: usize| {
                let moment = &part.moments[at];
                let counts = |vehicle| moment.above.iter().any(|above| above.vehicle == vehicle);
                if !part.is_needed[at] || moment.above.is_empty() {
                    return 0.0;
                }
                let met = flow.met_mps(air, &discs, (moment.t_s, moment.position_m), counts);
                let known = self.hover_air_mps.get(index);
                met.unwrap_or(known.map_or(0.0, |air_mps| air_mps[at]))
            };
            (0..part.moments.len()).map(at_moment).collect()
        };
        Arc::new(self.parts.par_iter().enumerate().map(of_part).collect())
    }
}

impl VehicleFlight {
    /// One vehicle's flight. `places_m`, `thrust_n`: where it was, and its vertical thrust, at each
    /// entry.
    fn new(
        recording: &Recording,
        trace: &Trace,
        places_m: &[Point3<f64>],
        thrust_n: &[f64],
        flight: usize,
    ) -> VehicleFlight {
        let track = &trace.of.track;
        let recorded_n = force::recorded_n(trace, thrust_n, LOW_PASS);
        let mut smooth_n = thrust_n.to_vec();
        trace.smooth(LOW_PASS, &mut smooth_n);
        let battery_v = track.battery_v.as_deref();
        let is_known = |v: &&f64| v.is_finite() && **v > 0.0;
        let first_v = battery_v.and_then(|all| all.iter().find(is_known));
        let ratio = |row: usize| Some(battery_v?.get(row).filter(is_known)? / first_v?);
        let floor_z_m = recording.environment.floor_z_m.unwrap_or(f64::NEG_INFINITY);
        let mut moments: Vec<ForceSample> = Vec::new();
        let mut steps: Vec<usize> = Vec::new();
        let mut runs: Vec<Range<usize>> = Vec::new();
        let usable = |row: usize| {
            (recorded_n[row] + thrust_n[row] + track.velocity_mps[row].norm()).is_finite()
                && trace.around[row] != Around::Unknown
        };
        for run in low_pass::runs(&track.t_s, track.longest_step_s, usable) {
            let from = moments.len();
            let (mut next_s, mut next_step_s) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
            // A millisecond: times are decimal fractions.
            let is_due = |t_s: f64, next_s: f64| t_s >= next_s - 1e-3;
            for row in run {
                let (t_s, position_m) = (track.t_s[row], places_m[row]);
                if !is_due(t_s, next_s) {
                    continue;
                }
                let Some(above) = above(recording, trace.vehicle, (t_s, position_m)) else {
                    continue;
                };
                next_s = t_s.max(next_s) + 1.0 / MOST_SIMULATED_HZ;
                if is_due(t_s, next_step_s) {
                    next_step_s = t_s.max(next_step_s) + 1.0 / RATE_HZ;
                    steps.push(moments.len());
                }
                moments.push(ForceSample {
                    t_s,
                    position_m,
                    velocity_mps: track.velocity_mps[row],
                    thrust_n: thrust_n[row],
                    smooth_n: smooth_n[row],
                    recorded_n: recorded_n[row],
                    height_m: position_m.z - floor_z_m,
                    battery_v: battery_v.map_or(f64::NAN, |all| all[row]),
                    voltage_ratio: ratio(row),
                    is_free: trace.around[row] == Around::Free,
                    above,
                });
            }
            if moments.len() > from {
                runs.push(from..moments.len());
            }
        }
        VehicleFlight {
            recording: trace.recording,
            vehicle: trace.vehicle,
            flight,
            moments,
            runs,
            steps,
            judged: Vec::new(),
            is_needed: Vec::new(),
            hover_mps: recording.hover_mps(trace.of),
        }
    }

    /// Forces (N) at every moment that is needed, from the exposure (m/s) there.
    fn forces_n(
        &self,
        recording: &Recording,
        hypothesis: &Hypothesis,
        air_mps: impl Fn(usize) -> f64,
    ) -> Vec<f64> {
        let effects = &hypothesis.effects;
        let law = recording.baseline.receiver_law;
        let airframe = &recording.vehicles[self.vehicle].airframe;
        let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
        let at_moment = |at: usize| {
            if !self.is_needed[at] {
                return 0.0;
            }
            let (moment, air_mps) = (&self.moments[at], air_mps(at));
            let velocity_mps = moment.velocity_mps;
            let mut alpha = air_mps / self.hover_mps;
            let mut factor = effects.thrust_ratio(&Reception {
                height_m: Some(moment.height_m),
                gap_m: None,
                propeller_radius_m: 0.5 * airframe.propeller_diameter_m(),
                voltage_ratio: moment.voltage_ratio,
            });
            if let Some(motion) = &effects.own_motion {
                alpha = motion.alpha(alpha, velocity_mps.z / self.hover_mps);
                let forward = velocity_mps.x.hypot(velocity_mps.y) / self.hover_mps;
                factor *= motion.thrust_ratio(forward);
            }
            if let (Some(battery), Some(ratio)) = (&effects.battery_sag, moment.voltage_ratio) {
                let throttle = battery.throttle_factor(ratio);
                factor /= throttle * throttle;
            }
            let left = match effects.receiver_alpha(alpha) {
                0.0 => 1.0,
                alpha => thrust_ratio(law, alpha),
            };
            let drag_n = effects.body_drag.map_or(0.0, |drag| {
                let past_mps = air_mps + velocity_mps.z;
                drag.force_n(density_kg_per_m3, airframe.motor_distance_m(), past_mps)
            });
            (left * factor - 1.0) * moment.thrust_n + drag_n
        };
        let mut forces_n: Vec<f64> = (0..self.moments.len()).map(at_moment).collect();
        let times_s: Vec<f64> = self.moments.iter().map(|moment| moment.t_s).collect();
        let sensor = &hypothesis.sensor;
        for run in &self.runs {
            let t_s = &times_s[run.clone()];
            low_pass::lag(sensor.lag_s, t_s, &mut forces_n[run.clone()]);
            LOW_PASS.smooth(t_s, &mut forces_n[run.clone()]);
        }
        let began_s = times_s.first().copied().unwrap_or(0.0);
        for (force_n, t_s) in forces_n.iter_mut().zip(&times_s) {
            *force_n = sensor.reads(*force_n, t_s - began_s);
        }
        forces_n
    }
}

/// The drones above a vehicle at a time and place whose wake may reach it. `None`: some drone's
/// place is not known then.
pub(super) fn above(
    recording: &Recording,
    vehicle: usize,
    (t_s, position_m): (f64, Point3<f64>),
) -> Option<Vec<Above>> {
    let own_m = recording.vehicles[vehicle].airframe.motor_distance_m();
    let mut found = Vec::new();
    for (other, of) in recording.vehicles.iter().enumerate() {
        if other == vehicle || of.role == Role::Receiver {
            continue;
        }
        let moment = of.track.moment(t_s)?;
        let other_m = of.track.position_at(moment);
        let apart_m = other_m - position_m;
        let emitter_m = of.airframe.motor_distance_m();
        let half_m = recording.jet.spreading * (apart_m.z - recording.jet.origin * emitter_m);
        let is_near = apart_m.xy().norm() < REACH * half_m + own_m;
        if apart_m.z > 0.0 && is_near && !of.track.is_idle(moment.entry) {
            found.push(Above {
                vehicle: other,
                position_m: other_m,
                velocity_mps: of.track.velocity_at(moment),
            });
        }
    }
    Some(found)
}

/// One column for each of [`COORDINATES`], one entry a judged row, and the place in the wake of the
/// drone above. Those of the drone above are of the one whose axis is nearest in half-widths of its
/// hover jet; not a number where none is above.
fn covariates(forces: &Forces) -> (Vec<Vec<f64>>, Vec<Option<Place>>) {
    let mut columns = vec![Vec::with_capacity(forces.rows); COORDINATES.len()];
    let mut places = Vec::with_capacity(forces.rows);
    for ((part, step), air_mps) in forces.judged().zip(forces.hover_air_mps()) {
        let of_jet = |above: &Above| {
            let apart_m = above.position_m - step.position_m;
            let wake = forces.wakes.of(part.recording, above.vehicle)?;
            let (beside_m, length_m) = (apart_m.x.hypot(apart_m.y), wake.motor_distance_m());
            let place = Place {
                emitter: above.vehicle,
                s_over_l: apart_m.z / length_m,
                r_over_l: beside_m / length_m,
                xi: beside_m / wake.half_width_m(apart_m.z),
                azimuth_rad: (-apart_m.y).atan2(-apart_m.x),
            };
            let (climb_mps, speed_mps) = (above.velocity_mps.z, above.velocity_mps.norm());
            let values = [apart_m.z, beside_m, place.xi, climb_mps, speed_mps];
            Some((place, values))
        };
        let jets = step.above.iter().filter_map(of_jet);
        let nearest = jets.reduce(|best, next| if next.0.xi < best.0.xi { next } else { best });
        let (place, values) = nearest.unzip();
        let [depth_m, beside_m, xi, emitter_climb_mps, emitter_mps] =
            values.unwrap_or([f64::NAN; 5]);
        let row = [
            depth_m,
            beside_m,
            xi,
            step.height_m,
            step.position_m.x,
            step.position_m.y,
            step.above.len() as f64,
            air_mps,
            step.velocity_mps.z,
            step.velocity_mps.xy().norm(),
            emitter_climb_mps,
            emitter_mps,
            step.smooth_n,
            step.battery_v,
            step.t_s,
        ];
        for (column, value) in columns.iter_mut().zip(row) {
            column.push(value);
        }
        places.push(place);
    }
    (columns, places)
}

impl Explained for Forces<'_> {
    fn recorded(&self) -> Vec<f64> {
        self.judged().map(|(_, step)| step.recorded_n).collect()
    }

    fn predict(&self, hypothesis: &Hypothesis) -> Vec<f64> {
        self.at_judged(&self.at_every_moment(hypothesis))
    }

    fn times_s(&self) -> Vec<f64> {
        self.judged().map(|(_, step)| step.t_s).collect()
    }

    fn covariates(&self) -> Covariates<'_> {
        Covariates {
            names: &COORDINATES,
            columns: &self.columns,
        }
    }

    /// All forces count as one's.
    fn instruments(&self) -> Vec<usize> {
        self.judged().map(|_| 0).collect()
    }

    /// Rows are windows of a few seconds: too short for a rhythm.
    fn releases(&self) -> Vec<(Vec<usize>, Vec<f64>)> {
        Vec::new()
    }
}
