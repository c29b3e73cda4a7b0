//! What a recording can show.

use airflow::Superposition;
use airflow::effects::WakeLean;
use nalgebra::{Vector2, Vector3};

use crate::forward::observed::{Explained, Observed};
use crate::forward::simulate::{Channel, Sample};
use crate::record::baseline::{Baseline, Delay, Observation, Upper};
use crate::record::recording::{Role, Vehicle};

/// What a recording has that effects need.
pub(crate) struct Shows {
    /// Whether there is a wake at all.
    pub(crate) air: bool,
    /// Whether it is of a speed probe.
    pub(crate) probes: bool,
    /// Highest induced velocity at hover (m/s).
    pub(crate) hover_mps: f64,
    /// Most jets.
    pub(crate) jets: usize,
    /// Whether propeller diameter over motor distance differs among the drones.
    pub(crate) sizes_differ: bool,
    /// Whether samples lie above 2.5 motor distances, where the baseline only extrapolates.
    pub(crate) near: bool,
    /// Whether samples lie near a floor.
    pub(crate) floor: bool,
    /// Whether there is a ceiling.
    pub(crate) ceiling: bool,
    /// Whether emitters move.
    pub(crate) moves: bool,
    /// Whether they tilt their thrust.
    pub(crate) leans: bool,
    /// Whether they climb or descend.
    pub(crate) climbs: bool,
    /// Whether the receiver's battery voltage varies.
    pub(crate) battery: bool,
    /// Whether a receiver moves by as much as changes its exposure.
    pub(crate) receiver_moves: bool,
    /// Whether a receiver moves at all.
    pub(crate) receiver_travels: bool,
    /// Whether the baseline simulates axial speed alone.
    pub(crate) axial_only: bool,
    /// Exponent by which jets add up in the baseline.
    pub(crate) merging: f64,
    /// Age of the air in the baseline over that at the centreline's speed; 0: quasi-static.
    pub(crate) lag_factor: f64,
    /// Times of the first and the last sample (s).
    pub(crate) span_s: [f64; 2],
    /// Highest reading, in the channel's unit.
    pub(crate) fastest: f64,
}

/// Whether propeller diameter over motor distance differs by 3 %: below that, what the exponent of
/// `dl_ratio` does is below any noise.
pub(crate) fn sizes_differ<'v>(vehicles: impl Iterator<Item = &'v Vehicle>) -> bool {
    let airframes = vehicles.map(|vehicle| &vehicle.airframe);
    let [low, high] = ends(airframes.map(|a| a.propeller_diameter_m() / a.motor_distance_m()));
    high > 1.03 * low
}

/// Whether vehicles lean otherwise than on average, by 0.02, for more than 2 % of their time: a
/// jet's half-width grows by 0.1 for each metre down. What always leans alike shows a jet that is
/// tilted, not what it follows.
pub(crate) fn lean<'v>(vehicles: impl Iterator<Item = &'v Vehicle>) -> bool {
    let (mut leaning, mut all) = (0, 0);
    for vehicle in vehicles.filter(|vehicle| vehicle.track.attitude_is_logged) {
        let attitudes = vehicle.track.attitude.iter();
        let leans = attitudes.map(|it| Vector2::from(WakeLean::against(it * Vector3::z())));
        let leans: Vec<Vector2<f64>> = leans.collect();
        let mean = leans.iter().sum::<Vector2<f64>>() / leans.len().max(1) as f64;
        leaning += leans.iter().filter(|it| (*it - mean).norm() > 0.02).count();
        all += leans.len();
    }
    50 * leaning > all
}

/// The exponent of the sum that a baseline declares. That of the strongest jet alone is infinite:
/// as much as the effect's range has.
pub(crate) fn merging(baseline: &Baseline) -> f64 {
    match baseline.superposition {
        Superposition::Linear => 1.0,
        Superposition::Momentum => 2.0,
        Superposition::Strongest => 4.0,
    }
}

/// What a baseline declares as the age of the air, over that at the centreline's speed.
pub(crate) fn lag_factor(baseline: &Baseline) -> f64 {
    match baseline.delay {
        Delay::None => 0.0,
        Delay::Transport { convection } => convection.recip(),
    }
}

/// The least and the greatest value.
fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    })
}

/// Whether a receiver flies faster than this, of its own induced velocity (m/s), in more than 2 %
/// of the samples.
fn receiver_moves(observed: &Observed, least_mps: impl Fn(f64) -> f64) -> bool {
    let recording = observed.recording;
    let moves = |sample: &Sample| {
        let vehicle = recording.vehicles.get(sample.subject as usize)?;
        let velocity_mps = vehicle.track.velocity_at(vehicle.track.moment(sample.t_s)?);
        Some(velocity_mps.norm() > least_mps(recording.hover_mps(vehicle)))
    };
    let moving = observed.samples.iter().filter(|s| moves(s) == Some(true));
    moving.count() as f64 > 0.02 * observed.samples.len() as f64
}

impl Shows {
    /// The value of an effect's first parameter that the baseline has instead of none.
    pub(super) fn declared(&self, effect: &str) -> Option<f64> {
        match effect {
            "jet_merging" => Some(self.merging),
            "wake_transport" => Some(self.lag_factor),
            _ => None,
        }
    }

    pub(super) fn of(observed: &Observed) -> Shows {
        let recording = observed.recording;
        let emits = |v: &&Vehicle| v.role != Role::Receiver && recording.baseline.wakes;
        let emitters: Vec<&Vehicle> = recording.vehicles.iter().filter(emits).collect();
        let hover = emitters.iter().map(|vehicle| recording.hover_mps(vehicle));
        let column = |name: &str| observed.covariate(name).unwrap_or_default();
        let range = |name: &str| ends(column(name).iter().copied());
        let share = |name: &str, test: &dyn Fn(f64) -> bool| {
            let inside = column(name).iter().filter(|x| test(**x)).count();
            inside as f64 / observed.samples.len().max(1) as f64
        };
        let [low_v, high_v] = range("battery V");
        let receives = observed.channel != Channel::Speed;
        Shows {
            air: !emitters.is_empty(),
            probes: observed.channel == Channel::Speed,
            hover_mps: hover.fold(0.1, f64::max),
            jets: emitters.len(),
            sizes_differ: sizes_differ(emitters.iter().copied()),
            near: share("s/l", &|s| (0.0..2.5).contains(&s)) > 0.005
                && recording.baseline.upper == Upper::FarFieldExtrapolated,
            floor: recording.environment.floor_z_m.is_some()
                && share("height/half-width", &|h| h < 2.5) > 0.005,
            ceiling: recording.environment.ceiling_z_m.is_some(),
            // The paper's limit for hover is 0.1 m/s.
            moves: share("emitter speed m/s", &|v| v > 0.1) > 0.02,
            leans: lean(emitters.iter().copied()),
            climbs: share("climb m/s", &|v| v.abs() > 0.1) > 0.02,
            battery: low_v > 0.0 && high_v > 1.01 * low_v && observed.channel != Channel::Power,
            receiver_moves: receives && receiver_moves(observed, |hover_mps| 0.1 * hover_mps),
            // As of the emitters.
            receiver_travels: receives && receiver_moves(observed, |_| 0.1),
            axial_only: recording.baseline.observation == Observation::AxialAndAmbient,
            merging: merging(&recording.baseline),
            lag_factor: lag_factor(&recording.baseline),
            span_s: range("time s"),
            fastest: observed.recorded().into_iter().fold(0.0, f64::max),
        }
    }
}
