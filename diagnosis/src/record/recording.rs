//! What was recorded, as plain data: vehicles and their tracks, probes, receivers, the
//! surroundings, and what "simulation" is declared to mean. Nothing here is computed; `read` makes
//! it, the other rooms read it.
//!
//! World frame, metres, z up; seconds on one clock per recording (see [`Clock`]); attitude turns
//! body into world.

use airflow::{Air, Airframe, Jet};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use serde::Deserialize;

use crate::record::baseline::Baseline;
use crate::record::checked;
use crate::record::remark::Remark;
use crate::record::thrust_map::ThrustMap;

/// One flight, or one session of probes: what the tool compares a simulation with.
#[derive(Clone, Debug)]
pub struct Recording {
    /// What reports call it: the name of its folder or file.
    pub name: String,
    /// The surroundings.
    pub environment: Environment,
    /// Sorted by id.
    pub vehicles: Vec<Vehicle>,
    /// Anemometers, if there were any.
    pub probes: Option<Probes>,
    /// Throttle of vehicles sampled beside the tracks, in the order of the file.
    pub receivers: Vec<ReceiverSample>,
    /// What "simulation" means here.
    pub baseline: Baseline,
    /// The jet that it is simulated with; the paper's unless the metadata say otherwise.
    pub jet: Jet,
    /// What was noticed while reading: gaps, impossible values, assumptions. Kept, reported, never
    /// mended in silence.
    pub remarks: Vec<Remark>,
}

impl Recording {
    /// Induced velocity `U_H` (m/s) of one of its vehicles in hover, at its stated mass and in the
    /// recording's air.
    #[must_use]
    pub fn hover_mps(&self, vehicle: &Vehicle) -> f64 {
        let airframe = &vehicle.airframe;
        let density_kg_per_m3 = self.environment.air.density_kg_per_m3();
        airframe.hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3)
    }

    /// Whether it holds tracks alone: it can only be judged by the forces on its drones.
    #[must_use]
    pub fn is_flight_log(&self) -> bool {
        self.probes.is_none() && self.receivers.is_empty()
    }

    /// Whether it holds the same readings as another, whatever the two are called.
    #[must_use]
    pub fn is_copy_of(&self, other: &Recording) -> bool {
        let track = |it: &Vehicle| {
            let places = it.track.position_m.iter().flat_map(|at| at.iter().copied());
            let all = it.track.t_s.iter().copied().chain(places);
            (it.id.clone(), all.map(f64::to_bits).collect::<Vec<u64>>())
        };
        let speed = |it: &ProbeSample| [it.t_s, it.speed_mps].map(f64::to_bits);
        let speeds = |it: &Recording| {
            let samples = it.probes.iter().flat_map(|probes| &probes.samples);
            samples.map(speed).collect::<Vec<_>>()
        };
        let throttle = |it: &ReceiverSample| [it.t_s, it.throttle_ratio].map(f64::to_bits);
        let throttles = |it: &Recording| it.receivers.iter().map(throttle).collect::<Vec<_>>();
        self.vehicles.len() == other.vehicles.len()
            && speeds(self) == speeds(other)
            && throttles(self) == throttles(other)
            && (self.vehicles.iter().map(track)).eq(other.vehicles.iter().map(track))
    }

    /// Whether it is a flight log that tells what one of its drones' forces is judged by, whatever
    /// else that may lack.
    #[must_use]
    pub fn is_of_a_force(&self) -> bool {
        let mut vehicles = self.vehicles.iter();
        self.is_flight_log() && vehicles.any(|it| it.track.is_of_a_force())
    }
}

/// The surroundings of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Environment {
    /// Gravity (m/s²).
    pub gravity_mps2: f64,
    /// Temperature and pressure.
    pub air: Air,
    /// Height of the floor (m), where there is one.
    pub floor_z_m: Option<f64>,
    /// Height of the ceiling (m), where there is one.
    pub ceiling_z_m: Option<f64>,
    /// Speed (m/s) that the probes read before take-off.
    pub ambient_mps: f64,
    /// Whether that has been taken off the recorded speeds. A scalar never should be; readers
    /// remark on it.
    pub ambient_is_subtracted: bool,
}

/// One drone of a recording.
#[derive(Clone, Debug)]
pub struct Vehicle {
    /// Its id in the files.
    pub id: String,
    /// Mass, propellers, motor distance.
    pub airframe: Airframe,
    /// Whether its wake matters, its response, or both.
    pub role: Role,
    /// Where it was and what it did.
    pub track: Track,
    /// Duty cycle to thrust, where the track has duty cycles.
    pub thrust_map: Option<ThrustMap>,
    /// Its clock against that of the recording.
    pub clock: Clock,
}

/// What a vehicle is in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Its wake is measured.
    Emitter,
    /// It measures.
    Receiver,
    /// Both: every drone of a swarm.
    Both,
}

/// A vehicle's clock against the recording's.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub enum Clock {
    /// The same clock.
    Shared,
    /// One of its own: unknown within plus or minus so many seconds.
    Own {
        /// Bound on the offset (s), 0 or more.
        #[serde(deserialize_with = "checked::not_negative")]
        within_s: f64,
    },
}

/// A vehicle over time: as many entries in every column that is there, times rising strictly.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Time (s).
    pub t_s: Vec<f64>,
    /// Centre of the rotor plane (m), the rotor offset of the metadata already added.
    pub position_m: Vec<Point3<f64>>,
    /// Velocity (m/s).
    pub velocity_mps: Vec<Vector3<f64>>,
    /// Body to world.
    pub attitude: Vec<UnitQuaternion<f64>>,
    /// Whether that is logged; otherwise it is taken as level.
    pub attitude_is_logged: bool,
    /// Throttle over that of hover at the stated mass and density.
    pub throttle_ratio: Option<Vec<f64>>,
    /// Electrical power (W).
    pub power_w: Option<Vec<f64>>,
    /// Specific force in the world frame (m/s²): acceleration minus gravity, +9.81 in z at hover.
    pub specific_force_mps2: Option<Vec<Vector3<f64>>>,
    /// Duty cycle of each motor, 0 to 1.
    pub duty: Option<Vec<[f64; 4]>>,
    /// Speed of each rotor (rad/s), 0 or more.
    pub rotor_speed_radps: Option<Vec<[f64; 4]>>,
    /// Thrust of all rotors together (N), where the log states it.
    pub thrust_n: Option<Vec<f64>>,
    /// Force beyond thrust and weight (N), in the world, where the log states it ready made.
    pub force_n: Option<Vec<Vector3<f64>>>,
    /// Battery voltage (V).
    pub battery_v: Option<Vec<f64>>,
    /// Steps longer than this are gaps (s), across which nothing is interpolated.
    pub longest_step_s: f64,
}

/// Anemometers and what they read.
#[derive(Clone, Debug)]
pub struct Probes {
    /// The instrument, the same for all.
    pub instrument: Instrument,
    /// In the order of the file: sample `i` is data row `i`.
    pub samples: Vec<ProbeSample>,
}

impl Probes {
    /// Where one probe, whose readings `rows` are in the order of time, is so much later (s) than
    /// each of them: linear from one reading to the next, and where it was at the first and the
    /// last before and after them.
    #[must_use]
    pub fn places_m(&self, rows: &[usize], later_s: f64) -> Vec<Point3<f64>> {
        let sample = |at: usize| &self.samples[rows[at]];
        let place_m = |of: &usize| {
            let t_s = self.samples[*of].t_s + later_s;
            let after = rows.partition_point(|&row| self.samples[row].t_s <= t_s);
            let Some(before) = after.checked_sub(1) else {
                return sample(after).position_m;
            };
            let from = sample(before);
            if after == rows.len() {
                return from.position_m;
            }
            let (to, since_s) = (sample(after), t_s - from.t_s);
            let share = since_s / (to.t_s - from.t_s);
            from.position_m + (to.position_m - from.position_m) * share
        };
        match later_s {
            0.0 => rows
                .iter()
                .map(|&row| self.samples[row].position_m)
                .collect(),
            _ => rows.iter().map(place_m).collect(),
        }
    }
}

/// What an anemometer does to the air's speed, and how well its maker promises to know it.
#[derive(Clone, Debug, PartialEq)]
pub struct Instrument {
    /// `hot_ball` and the like.
    pub kind: String,
    /// What it measures of the velocity.
    pub measures: Measures,
    /// Readings a second.
    pub rate_hz: f64,
    /// Time constant of its low-pass (s); 0: none.
    pub lowpass_tau_s: f64,
    /// Accuracy (m/s), plus or minus.
    pub accuracy_abs_mps: f64,
    /// Accuracy as part of the reading, plus or minus.
    pub accuracy_rel: f64,
    /// Smallest step of a reading (m/s).
    pub resolution_mps: f64,
}

/// What an anemometer measures of the velocity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measures {
    /// Its magnitude, whatever the direction.
    SpeedMagnitude,
    /// Its part downwards.
    Axial,
}

/// One reading of one probe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeSample {
    /// Time (s).
    pub t_s: f64,
    /// Which probe.
    pub probe_id: u32,
    /// Where it stood (m).
    pub position_m: Point3<f64>,
    /// What it read (m/s), nothing subtracted; NaN where unusable, as a remark says.
    pub speed_mps: f64,
}

/// One reading of a receiver's throttle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceiverSample {
    /// Time (s).
    pub t_s: f64,
    /// Which of [`Recording::vehicles`].
    pub vehicle: usize,
    /// Throttle over that of hover at the stated mass and density; NaN where it cannot be used.
    pub throttle_ratio: f64,
    /// Battery voltage (V), where it was logged.
    pub battery_v: Option<f64>,
}
