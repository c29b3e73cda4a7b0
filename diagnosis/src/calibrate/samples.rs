//! Readings beside the state of the drone above at that moment; what is left out, by reason; and
//! the paper's median per grid cell, of one flight each, so that a flight can be drawn with all
//! that is its own.

use std::collections::{BTreeMap, BTreeSet};

use airflow::{FAR_FIELD_FROM_S_OVER_L, Jet};
use nalgebra::{Point3, Vector3};

use super::calibration::{Counts, Dropped, DroppedCount};
use super::jet_fit::Operator;
use crate::record::baseline::Observation;
use crate::record::recording::{
    Instrument, Measures, ProbeSample, Recording, Role, Track, Vehicle,
};
use crate::record::track::Moment;
use crate::statistics::quantile;

/// Readings count while the drone is slower than this (m/s), as in the paper.
const SLOWER_THAN_MPS: f64 = 0.1;
/// Depth and width of a grid cell over the motor distance. Chosen here: the centreline changes by
/// 3 % over the one at 2.5 l, and the other is a sixth of the half-width there.
const CELL_S_OVER_L: f64 = 0.25;
const CELL_R_OVER_L: f64 = 0.1;
/// Readings beyond so many half-widths of the paper's jet are not compared: the paper's own table
/// ends there.
const FARTHEST_XI: f64 = 6.0;
/// A jet turns this many of its half-widths (at the floor) above the floor. Assumed here, because
/// the stagnation region of an impinging jet is about as high as the jet is wide.
const FLOOR_HALF_WIDTHS: f64 = 2.0;
/// A drone that comes back to a grid cell after so long (s) makes a new median: the two are
/// independent, and the two sides of the axis are two places of the paper's grid. Chosen here: two
/// of the paper's dwells.
const PAUSE_S: f64 = 10.0;

/// One drone over the probes of one recording.
#[derive(Clone, Debug)]
pub(super) struct ProbedFlight {
    pub(super) recording: String,
    /// Index into the drones.
    pub(super) drone: usize,
    pub(super) operator: Operator,
    /// Accuracies of its probe: part of the reading, and m/s.
    pub(super) accuracy_rel: f64,
    pub(super) accuracy_abs_mps: f64,
    /// Time between readings (s).
    pub(super) step_s: f64,
}

/// One reading of known place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) flight: usize,
    pub(super) t_s: f64,
    pub(super) probe: u32,
    /// Depth and radius over the motor distance.
    pub(super) s: f64,
    pub(super) r: f64,
    /// Along the body's x and y axes levelled, over the motor distance.
    pub(super) forward: f64,
    pub(super) left: f64,
    /// The reading (m/s), with anything that had been subtracted added again.
    pub(super) speed_mps: f64,
}

/// What the recordings hold.
#[derive(Clone, Debug, Default)]
pub(super) struct Gathered<'r> {
    /// One vehicle for every airframe, in order of appearance.
    pub(super) drones: Vec<&'r Vehicle>,
    pub(super) flights: Vec<ProbedFlight>,
    /// From 2.5 l down.
    pub(super) far: Vec<Sample>,
    /// Above.
    pub(super) near: Vec<Sample>,
    pub(super) counts: Counts,
    /// Whether the ambient speed had been taken off some readings.
    pub(super) ambient_added_again: bool,
}

/// Every reading of known place below one hovering drone, with the lateral turbulence that its
/// probe is taken to read.
pub(super) fn gather(recordings: &[Recording], lateral_turbulence: f64) -> Gathered<'_> {
    let mut gathered = Gathered::default();
    let mut dropped: BTreeMap<Dropped, usize> = BTreeMap::new();
    for recording in recordings {
        let Some(probes) = &recording.probes else {
            continue;
        };
        let vehicles = recording.vehicles.iter();
        let emitters: Vec<&Vehicle> = vehicles.filter(|v| v.role != Role::Receiver).collect();
        let mut flights: Vec<Option<usize>> = vec![None; emitters.len()];
        gathered.counts.read += probes.samples.len();
        for sample in &probes.samples {
            let flying = the_one_flying(recording, &emitters, &probes.instrument, sample);
            let placed = flying.and_then(|(emitter, state)| {
                let placed = place(recording, emitters[emitter], &state, sample)?;
                Ok((emitter, placed))
            });
            let (emitter, mut placed) = match placed {
                Ok(found) => found,
                Err(reason) => {
                    *dropped.entry(reason).or_default() += 1;
                    continue;
                }
            };
            placed.flight = *flights[emitter].get_or_insert_with(|| {
                let (drones, vehicle) = (&mut gathered.drones, emitters[emitter]);
                let known = |drone: &&Vehicle| drone.airframe == vehicle.airframe;
                let drone = drones.iter().position(known).unwrap_or_else(|| {
                    drones.push(vehicle);
                    drones.len() - 1
                });
                let mut flight = flight(recording, &probes.instrument, vehicle);
                flight.drone = drone;
                flight.operator.lateral *= lateral_turbulence;
                gathered.flights.push(flight);
                gathered.flights.len() - 1
            });
            if recording.environment.ambient_is_subtracted {
                gathered.ambient_added_again = true;
                placed.speed_mps += recording.environment.ambient_mps;
            }
            match placed.s >= FAR_FIELD_FROM_S_OVER_L {
                true => gathered.far.push(placed),
                false => gathered.near.push(placed),
            }
        }
    }
    gathered.counts.far = gathered.far.len();
    let is_fitted = |sample: &&Sample| {
        let drone = gathered.flights[sample.flight].drone;
        !gathered.drones[drone].airframe.fit_excludes()
    };
    gathered.counts.fitted = gathered.far.iter().filter(is_fitted).count();
    gathered.counts.near = gathered.near.len();
    let dropped = dropped.into_iter();
    let dropped = dropped.map(|(reason, samples)| DroppedCount { reason, samples });
    gathered.counts.dropped = dropped.collect();
    let most_first = |count: &DroppedCount| std::cmp::Reverse(count.samples);
    gathered.counts.dropped.sort_by_key(most_first);
    gathered
}

/// A drone over a probe, of drone 0 and with a lateral turbulence of 1 where the probe reads any.
fn flight(recording: &Recording, instrument: &Instrument, vehicle: &Vehicle) -> ProbedFlight {
    let environment = &recording.environment;
    let magnitude = f64::from(u8::from(instrument.measures == Measures::SpeedMagnitude));
    let radial = recording.baseline.observation == Observation::VelocityAndAmbient;
    ProbedFlight {
        recording: recording.name.clone(),
        drone: 0,
        operator: Operator {
            // U_H goes with the root of gravity; `airflow` assumes the standard one.
            induced_velocity_mps: recording.hover_mps(vehicle)
                * (environment.gravity_mps2 / airflow::GRAVITY_MPS2).sqrt(),
            ambient_mps: magnitude * environment.ambient_mps,
            radial: magnitude * f64::from(u8::from(radial)),
            lateral: magnitude,
        },
        accuracy_rel: instrument.accuracy_rel,
        accuracy_abs_mps: instrument.accuracy_abs_mps,
        step_s: 1.0 / instrument.rate_hz,
    }
}

/// A drone at the moment of a reading.
struct State {
    position_m: Point3<f64>,
    yaw_rad: f64,
    /// Whether it was slower than 0.1 m/s all the while the probe averaged.
    is_hovering: bool,
}

/// The one drone in the air, and its state.
fn the_one_flying(
    recording: &Recording,
    emitters: &[&Vehicle],
    instrument: &Instrument,
    sample: &ProbeSample,
) -> Result<(usize, State), Dropped> {
    if !(sample.speed_mps.is_finite() && sample.speed_mps >= 0.0 && sample.t_s.is_finite()) {
        return Err(Dropped::NotAReading);
    }
    // What the probe still remembers: its averaging, and three time constants of its low-pass (5 %
    // left).
    let memory_s = (1.0 / instrument.rate_hz).max(3.0 * instrument.lowpass_tau_s);
    let floor_z_m = recording.environment.floor_z_m.unwrap_or(f64::NEG_INFINITY);
    let at = |(emitter, vehicle): (usize, &&Vehicle)| {
        let track = &vehicle.track;
        let moment = track.moment(sample.t_s)?;
        let state = state(track, moment, sample.t_s - memory_s);
        let above_floor_m = state.position_m.z - floor_z_m;
        let on_floor = above_floor_m < 0.5 * vehicle.airframe.motor_distance_m();
        let is_flying = !on_floor && !track.is_idle(moment.entry);
        Some(is_flying.then_some((emitter, state)))
    };
    let tracked: Vec<Option<_>> = emitters.iter().enumerate().filter_map(at).collect();
    let is_tracked = !tracked.is_empty();
    let mut flying = tracked.into_iter().flatten();
    match (flying.next(), flying.next()) {
        (Some(one), None) => Ok(one),
        (Some(_), Some(_)) => Err(Dropped::SeveralFlying),
        (None, _) if is_tracked => Err(Dropped::NoneFlying),
        (None, _) => Err(Dropped::NoTrack),
    }
}

fn state(track: &Track, moment: Moment, since_s: f64) -> State {
    let forward = track.attitude_at(moment) * Vector3::x();
    // From the last entry that is no later than that.
    let first = track.t_s[..=moment.entry]
        .iter()
        .rposition(|t_s| *t_s <= since_s);
    let logged = &track.velocity_mps[first.unwrap_or(0)..=moment.entry];
    let now = track.velocity_at(moment);
    // An unknown speed counts as moving.
    let is_slow = |velocity_mps: &Vector3<f64>| velocity_mps.norm() < SLOWER_THAN_MPS;
    State {
        position_m: track.position_at(moment),
        yaw_rad: forward.y.atan2(forward.x),
        is_hovering: logged.iter().chain([&now]).all(is_slow),
    }
}

fn place(
    recording: &Recording,
    vehicle: &Vehicle,
    state: &State,
    sample: &ProbeSample,
) -> Result<Sample, Dropped> {
    if !state.is_hovering {
        return Err(Dropped::Moving);
    }
    let l_m = vehicle.airframe.motor_distance_m();
    let away = (sample.position_m - state.position_m) / l_m;
    let (s, r) = (-away.z, away.x.hypot(away.y));
    if !(s.is_finite() && r.is_finite()) {
        return Err(Dropped::NoTrack);
    }
    if s <= 0.0 {
        return Err(Dropped::Above);
    }
    // The paper's jet draws these two lines, so that which readings count does not depend on the
    // fit.
    let half_width = |s: f64| Jet::default().spreading * (s - Jet::default().origin);
    if let Some(floor_z_m) = recording.environment.floor_z_m {
        let rotor_above_floor = (state.position_m.z - floor_z_m) / l_m;
        let probe_above_floor = (sample.position_m.z - floor_z_m) / l_m;
        if probe_above_floor < FLOOR_HALF_WIDTHS * half_width(rotor_above_floor) {
            return Err(Dropped::NearFloor);
        }
    }
    if r > FARTHEST_XI * half_width(s) {
        return Err(Dropped::FarOut);
    }
    let (sin, cos) = state.yaw_rad.sin_cos();
    Ok(Sample {
        flight: 0,
        t_s: sample.t_s,
        probe: sample.probe_id,
        s,
        r,
        forward: cos * away.x + sin * away.y,
        left: cos * away.y - sin * away.x,
        speed_mps: sample.speed_mps,
    })
}

/// Readings of one flight that fall into one grid cell.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    pub(super) flight: usize,
    /// Mean time (s), depth and radius over the motor distance.
    pub(super) t_s: f64,
    pub(super) s: f64,
    pub(super) r: f64,
    /// Median reading (m/s).
    pub(super) median_mps: f64,
    /// Its readings in the sorted list.
    pub(super) from: usize,
    pub(super) to: usize,
}

impl Cell {
    pub(super) fn count(&self) -> usize {
        self.to - self.from
    }
}

/// Sorts readings into cells; each cell's readings then stand together, in order of time. Cells are
/// in order of flight and time.
pub(super) fn cells(samples: &mut [Sample]) -> Vec<Cell> {
    let key = |sample: &Sample| {
        (
            sample.flight,
            (sample.s / CELL_S_OVER_L) as u32,
            (sample.r / CELL_R_OVER_L) as u32,
            sample.probe,
        )
    };
    samples.sort_by(|a, b| key(a).cmp(&key(b)).then(a.t_s.total_cmp(&b.t_s)));
    let mut cells = Vec::new();
    let mut from = 0;
    for group in samples.chunk_by(|a, b| key(a) == key(b) && b.t_s - a.t_s < PAUSE_S) {
        let n = group.len() as f64;
        let mean = |of: fn(&Sample) -> f64| group.iter().map(of).sum::<f64>() / n;
        let mut speeds: Vec<f64> = group.iter().map(|sample| sample.speed_mps).collect();
        cells.push(Cell {
            flight: group[0].flight,
            t_s: mean(|sample| sample.t_s),
            s: mean(|sample| sample.s),
            r: mean(|sample| sample.r),
            median_mps: quantile(&mut speeds, 0.5),
            from,
            to: from + group.len(),
        });
        from += group.len();
    }
    // A stable sort: equals stay in the order of their readings.
    cells.sort_by(|a, b| a.flight.cmp(&b.flight).then(a.t_s.total_cmp(&b.t_s)));
    cells
}

/// Flights that have a cell, each once, in order.
pub(super) fn flights_of<'c>(cells: impl IntoIterator<Item = &'c Cell>) -> Vec<usize> {
    let flights: BTreeSet<usize> = cells.into_iter().map(|cell| cell.flight).collect();
    flights.into_iter().collect()
}

/// Quantile of values in any order; 0 of nothing.
pub(super) fn quantile(values: &mut [f64], share: f64) -> f64 {
    quantile::selected(values, share).unwrap_or(0.0)
}
