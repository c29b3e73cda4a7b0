//! One vehicle in one flight, in equal steps of time, with the drones that may blow on it.

use airflow::DiscPoints;
use nalgebra::{Point3, Vector3};

use super::options::CampaignOptions;
use crate::forward::force;
use crate::forward::low_pass;
use crate::record::recording::{Recording, Role};
use crate::thrust::free_flight::{Around, Trace};

/// Half-widths from its axis beyond which a drone above is taken to be without any effect, beside the receiver's own size. Chosen here: the
/// hover jet has less than half a percent of its speed there.
const REACH: f64 = 6.0;

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
    pub(super) is_needed: Vec<bool>,
    pub(super) hover_mps: f64,
    pub(super) discs: DiscPoints,
    pub(super) radius_m: f64,
    pub(super) length_m: f64,
    pub(super) density_kg_per_m3: f64,
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

/// One vehicle's flight in equal steps; `None` where it has no force.
pub(super) fn part(
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
