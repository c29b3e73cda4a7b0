//! A recording made ready to be explained: its samples beside the baseline's, with everything that
//! a residual may depend on.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use airflow::effects::Effects;

use crate::forward::flow::{Flow, Wakes};
use crate::forward::hypothesis::{Hypothesis, Sensor};
use crate::forward::simulate::{Channel, Sample, Series, series, simulate};
use crate::record::recording::Recording;

/// Names of the covariates with their units, and their letters in an expression, in the order of
/// [`Observed::covariates`]. Which probe reads comes first: of coordinates that part the samples
/// alike, the first is named.
pub const COVARIATES: [(&str, &str); 21] = [
    (PROBE, "probe"),
    ("s/l", "s"),
    ("r/l", "r"),
    ("xi", "xi"),
    ("cos az", "cos"),
    ("sin az", "sin"),
    ("height m", "h"),
    ("time s", "t"),
    ("air m/s", "U"),
    ("emitter z m", "z_e"),
    ("emitter speed m/s", "v_e"),
    ("climb m/s", "v_z"),
    ("second jet/first", "U2/U1"),
    ("battery V", "V"),
    ("height/half-width", "h/r_half"),
    ("cos az body", "cos_b"),
    ("sin az body", "sin_b"),
    ("x m", "x"),
    ("y m", "y"),
    ("emitter x m", "x_e"),
    ("emitter y m", "y_e"),
];

/// Which probe reads; 0 of other channels.
pub const PROBE: &str = "probe";

/// Most samples that are fitted; of more, every second, third and so on is. Chosen here, for time
/// and memory: what neighbours of ten thousand say is known to a hundredth of their scatter.
pub const MOST_SAMPLES: usize = 10_000;
/// Samples kept at one phase before it moves on. Chosen here: nearly all steps stay even.
const STRETCH: usize = 64;
/// Golden section: multiples of it fill the phases most evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// Simulated values that are kept for when they are asked for again. Chosen here: 64 MB.
const MOST_KEPT: usize = 1 << 22;

/// Values recorded, what a hypothesis makes of them, and what surrounds each: all that a diagnosis
/// needs to know.
pub trait Explained: std::fmt::Debug + Sync {
    /// Recorded values.
    fn recorded(&self) -> Vec<f64>;

    /// What they would be under a hypothesis, in their order.
    fn predict(&self, hypothesis: &Hypothesis) -> Vec<f64>;

    /// Times (s).
    fn times_s(&self) -> Vec<f64>;

    /// What surrounds each value.
    fn covariates(&self) -> Covariates<'_>;

    /// Which instrument read each value, counted from 0.
    fn instruments(&self) -> Vec<usize>;

    /// For each series that a pulsation of the rotors would show in: its samples, and when the air
    /// there was released (s).
    fn releases(&self) -> Vec<(Vec<usize>, Vec<f64>)>;
}

/// Quantities known at every value beside it.
#[derive(Clone, Copy, Debug)]
pub struct Covariates<'a> {
    /// What they are called, with the unit, and their letters in an expression.
    pub names: &'static [(&'static str, &'static str)],
    /// One column for each, one entry a value; not a number where it has none.
    pub columns: &'a [Vec<f64>],
}

impl Covariates<'_> {
    /// Azimuth (rad) about the drone whose wake a value lies in: in the world from east, or in the
    /// drone's body from its nose. `None` where it is not known; not a number below no drone.
    #[must_use]
    pub fn azimuth_rad(&self, in_body: bool) -> Option<Vec<f64>> {
        let [cos, sin] = match in_body {
            true => ["cos az body", "sin az body"],
            false => ["cos az", "sin az"],
        }
        .map(|name| self.names.iter().position(|(known, _)| *known == name));
        let (cos, sin) = (&self.columns[cos?], &self.columns[sin?]);
        let angle = |(&cos, &sin): (&f64, &f64)| match cos.hypot(sin) > 0.5 {
            true => sin.atan2(cos),
            false => f64::NAN,
        };
        Some(cos.iter().zip(sin).map(angle).collect())
    }
}

/// Samples of one recording, one channel, and what surrounds each of them.
#[derive(Clone, Debug)]
pub struct Observed<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// What was recorded: one channel only.
    pub channel: Channel,
    /// Samples in the order of series, then time; the baseline's value in each.
    pub samples: Vec<Sample>,
    /// Which series (probe or receiver) a sample belongs to.
    pub series_of: Vec<usize>,
    /// One column for each of [`COVARIATES`], one entry a sample.
    pub covariates: Vec<Vec<f64>>,
    wakes: Wakes,
    series: Vec<Series>,
    /// What was simulated of these samples last.
    kept: Arc<Mutex<SimulatedCache>>,
}

/// What was simulated, the newest last: fits come back to where they began, and what only the
/// instrument makes of the air needs no other air.
type SimulatedCache = VecDeque<(HypothesisAir, Arc<Vec<Option<f64>>>)>;

/// What of a hypothesis tells values before gain, offset, drift and saturation.
#[derive(Clone, Copy, Debug, PartialEq)]
struct HypothesisAir {
    lag_s: f64,
    clock_s: f64,
    downwash: Option<f64>,
    effects: Effects,
}

impl HypothesisAir {
    fn of(hypothesis: &Hypothesis) -> HypothesisAir {
        HypothesisAir {
            lag_s: hypothesis.sensor.lag_s,
            clock_s: hypothesis.sensor.clock_s,
            downwash: hypothesis.downwash,
            effects: hypothesis.effects,
        }
    }
}

impl<'a> Observed<'a> {
    /// The samples of one channel of a recording; where none is named, of its probes where it has
    /// any, of its receivers otherwise. `None` where it has none.
    #[must_use]
    pub fn of(recording: &'a Recording, channel: Option<Channel>) -> Option<Observed<'a>> {
        let simulated = simulate(recording).samples;
        let channel = channel.or(simulated.first().map(|sample| sample.channel))?;
        simulated.iter().find(|sample| sample.channel == channel)?;
        let mut observed = Observed {
            recording,
            channel,
            samples: Vec::with_capacity(simulated.len()),
            series_of: Vec::with_capacity(simulated.len()),
            covariates: Vec::new(),
            wakes: Wakes::new(recording),
            series: series(recording),
            kept: Arc::default(),
        };
        observed.series.retain(|series| series.channel == channel);
        for (index, series) in observed.series.iter_mut().enumerate() {
            let find = |row: &usize| {
                let at = simulated.binary_search_by_key(&(channel, *row), |s| (s.channel, s.row));
                at.ok().map(|at| simulated[at])
            };
            let samples: Vec<Sample> = series.rows.iter().filter_map(find).collect();
            series.rows = samples.iter().map(|sample| sample.row).collect();
            series.recorded = samples.iter().map(|sample| sample.recorded).collect();
            observed.series_of.extend(samples.iter().map(|_| index));
            observed.samples.extend(samples);
        }
        observed.covariates = covariates(&observed);
        Some(observed)
    }

    /// Every so many-th of its samples, about `most` in all, and every how many-th: neighbours tell
    /// much the same. `None` where it has no more than these.
    ///
    /// Which of so many moves on at each stretch, so that passes at an even pace are met at every
    /// phase.
    #[must_use]
    pub fn thinned(&self, most: usize) -> Option<(Observed<'a>, usize)> {
        let every = self.samples.len().div_ceil(most);
        if every < 2 {
            return None;
        }
        let mut kept: Vec<usize> = Vec::with_capacity(most);
        let mut from = 0;
        for (index, series) in self.series.iter().enumerate() {
            let is_kept = |place: &usize| {
                let stretch = index + place / every / STRETCH;
                let phase = (stretch as f64 * GOLDEN).fract() * every as f64;
                place % every == phase as usize
            };
            let places = (0..series.rows.len()).filter(is_kept);
            kept.extend(places.map(|place| from + place));
            from += series.rows.len();
        }
        let of = |column: &Vec<f64>| kept.iter().map(|&i| column[i]).collect();
        let mut thinned = Observed {
            recording: self.recording,
            channel: self.channel,
            samples: kept.iter().map(|&i| self.samples[i]).collect(),
            series_of: kept.iter().map(|&i| self.series_of[i]).collect(),
            covariates: self.covariates.iter().map(of).collect(),
            wakes: self.wakes.clone(),
            series: self.series.clone(),
            kept: Arc::default(),
        };
        for (index, series) in thinned.series.iter_mut().enumerate() {
            let own = thinned.samples.iter().zip(&thinned.series_of);
            let own = own.filter(|(_, of)| **of == index);
            (series.rows, series.recorded) =
                own.map(|(sample, _)| (sample.row, sample.recorded)).unzip();
        }
        Some((thinned, every))
    }

    /// Looks for the drones from every sample once, for all that is supposed later.
    pub fn look(&mut self) {
        let flow = Flow::supposing(self.recording, &self.wakes, &Hypothesis::default());
        self.series.iter_mut().for_each(|series| series.look(&flow));
        self.kept = Arc::default();
    }

    /// What is known at some of these samples (`among`, in the same order), at all of them: that of
    /// the nearest of its series in time, and 0 in a series without any.
    #[must_use]
    pub fn carried(&self, among: &Observed, values: &[f64]) -> Vec<f64> {
        let mut carried = Vec::with_capacity(self.samples.len());
        for (index, series) in self.series.iter().enumerate() {
            let from = among.series_of.partition_point(|&of| of < index);
            let to = among.series_of.partition_point(|&of| of <= index);
            let mut nearest = from;
            for _ in &series.rows {
                let t_s = self.samples[carried.len()].t_s;
                let away_s = |i: usize| (among.samples[i].t_s - t_s).abs();
                while nearest + 1 < to && away_s(nearest + 1) <= away_s(nearest) {
                    nearest += 1;
                }
                carried.push(if from < to { values[nearest] } else { 0.0 });
            }
        }
        carried
    }

    /// How long ago (s) the air at a sample left its drone, at the centreline's speed; 0 below
    /// none.
    #[must_use]
    pub fn age_s(&self, sample: usize) -> f64 {
        let sample = &self.samples[sample];
        let age = sample.place.and_then(|place| {
            let wake = self.wakes.of(0, place.emitter)?;
            let depth_m = place.s_over_l * wake.motor_distance_m();
            Some(wake.far_field().transport_time_s(depth_m, 1.0))
        });
        age.unwrap_or(0.0)
    }

    /// Smallest step of a reading, in the channel's unit; 0 where none is declared.
    #[must_use]
    pub fn resolution(&self) -> f64 {
        let probes = self.recording.probes.as_ref();
        probes
            .filter(|_| self.channel == Channel::Speed)
            .map_or(0.0, |probes| probes.instrument.resolution_mps)
    }

    /// The baseline's values.
    #[must_use]
    pub fn simulated(&self) -> Vec<f64> {
        self.samples.iter().map(|sample| sample.simulated).collect()
    }

    /// Values under a hypothesis as its lag and clock have them, gain, offset, drift and saturation
    /// apart; `None` where it asks for a drone's place in a gap.
    fn simulated_through(&self, hypothesis: &Hypothesis) -> Arc<Vec<Option<f64>>> {
        let air = HypothesisAir::of(hypothesis);
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, values)) = kept().iter().rev().find(|(known, _)| *known == air) {
            return values.clone();
        }
        let flow = Flow::supposing(self.recording, &self.wakes, hypothesis);
        let of_series = |series: &Series| series.simulate(&flow, &hypothesis.sensor);
        let values: Vec<Option<f64>> = self.series.iter().flat_map(of_series).collect();
        let values = Arc::new(values);
        let mut kept = kept();
        kept.push_back((air, values.clone()));
        if kept.len() * values.len() > MOST_KEPT {
            kept.pop_front();
        }
        values
    }

    /// One covariate by name.
    #[must_use]
    pub fn covariate(&self, name: &str) -> Option<&[f64]> {
        let at = COVARIATES.iter().position(|(known, _)| *known == name)?;
        self.covariates.get(at).map(Vec::as_slice)
    }
}

impl Explained for Observed<'_> {
    fn recorded(&self) -> Vec<f64> {
        self.samples.iter().map(|sample| sample.recorded).collect()
    }

    /// Where a hypothesis asks for a drone's place in a gap, the baseline's value stands.
    fn predict(&self, hypothesis: &Hypothesis) -> Vec<f64> {
        let mut predicted = Vec::with_capacity(self.samples.len());
        let sensor = &hypothesis.sensor;
        let is_as_declared = Hypothesis {
            sensor: Sensor::default(),
            ..*hypothesis
        } == Hypothesis::default();
        if is_as_declared && sensor.lag_s == 0.0 && sensor.clock_s == 0.0 {
            // The air of the baseline, which is known already.
            let first_s = |i: usize| self.series[self.series_of[i]].first_s;
            let reading = |(i, sample): (usize, &Sample)| {
                sensor.reads(sample.simulated, sample.t_s - first_s(i))
            };
            predicted.extend(self.samples.iter().enumerate().map(reading));
            return predicted;
        }
        let values = self.simulated_through(hypothesis);
        for (i, (value, sample)) in values.iter().zip(&self.samples).enumerate() {
            let since_s = sample.t_s - self.series[self.series_of[i]].first_s;
            let read = value.map(|value| sensor.reads(value, since_s));
            predicted.push(read.unwrap_or(sample.simulated));
        }
        predicted
    }

    fn times_s(&self) -> Vec<f64> {
        self.samples.iter().map(|sample| sample.t_s).collect()
    }

    fn covariates(&self) -> Covariates<'_> {
        Covariates {
            names: &COVARIATES,
            columns: &self.covariates,
        }
    }

    /// Every probe is one; throttles and powers are read as one.
    fn instruments(&self) -> Vec<usize> {
        match self.channel {
            Channel::Speed => self.series_of.clone(),
            _ => vec![0; self.samples.len()],
        }
    }

    fn releases(&self) -> Vec<(Vec<usize>, Vec<f64>)> {
        let of_series = |series: usize| {
            let all = 0..self.samples.len();
            let samples: Vec<usize> = all.filter(|&i| self.series_of[i] == series).collect();
            let released = samples.iter().map(|&i| self.samples[i].t_s - self.age_s(i));
            let released_s = released.collect();
            (samples, released_s)
        };
        (0..self.series.len()).map(of_series).collect()
    }
}

fn covariates(observed: &Observed) -> Vec<Vec<f64>> {
    let recording = observed.recording;
    let flow = Flow::supposing(recording, &observed.wakes, &Hypothesis::default());
    let floor_m = recording.environment.floor_z_m.unwrap_or(0.0);
    let mut columns = vec![Vec::with_capacity(observed.samples.len()); COVARIATES.len()];
    for sample in &observed.samples {
        let but = (sample.channel != Channel::Speed).then_some(sample.subject as usize);
        let place = sample.place;
        let emitter = place.map(|place| &recording.vehicles[place.emitter]);
        let state = emitter.and_then(|emitter| {
            let moment = emitter.track.moment(sample.t_s)?;
            let (_, _, yaw_rad) = emitter.track.attitude_at(moment).euler_angles();
            let velocity_mps = emitter.track.velocity_at(moment);
            let position_m = emitter.track.position_at(moment);
            Some((position_m, velocity_mps, yaw_rad))
        });
        let [first_mps, second_mps] = flow.strongest_mps(sample.t_s, sample.position_m, but);
        let height_m = sample.position_m.z - floor_m;
        let half_width_m = place.zip(emitter).map(|(place, emitter)| {
            let over_l = match place.xi > 0.0 && place.r_over_l > 0.0 {
                true => place.r_over_l / place.xi,
                false => recording.jet.spreading * (place.s_over_l - recording.jet.origin),
            };
            emitter.airframe.motor_distance_m() * over_l
        });
        let placed = place.zip(state);
        let body_rad = placed.map(|(place, (.., yaw_rad))| place.azimuth_rad - yaw_rad);
        let battery_v = match sample.channel {
            Channel::Throttle | Channel::Power => recording.receivers[sample.row].battery_v,
            _ => None,
        };
        let [s_over_l, r_over_l, xi, cos, sin] =
            place.map_or([-1.0, -1.0, -1.0, 0.0, 0.0], |place| {
                let (sin, cos) = place.azimuth_rad.sin_cos();
                [place.s_over_l, place.r_over_l, place.xi, cos, sin]
            });
        let (emitter_m, emitter_mps, _) = state.unwrap_or_default();
        let probe = match sample.channel {
            Channel::Speed => f64::from(sample.subject),
            _ => 0.0,
        };
        let row = [
            probe,
            s_over_l,
            r_over_l,
            xi,
            cos,
            sin,
            height_m,
            sample.t_s,
            sample.air_mps,
            emitter_m.z,
            emitter_mps.norm(),
            emitter_mps.z,
            second_mps / first_mps.max(f64::MIN_POSITIVE),
            battery_v.unwrap_or(0.0),
            (height_m / half_width_m.unwrap_or(f64::INFINITY)).min(20.0),
            body_rad.map_or(0.0, f64::cos),
            body_rad.map_or(0.0, f64::sin),
            sample.position_m.x,
            sample.position_m.y,
            emitter_m.x,
            emitter_m.y,
        ];
        for (column, value) in columns.iter_mut().zip(row) {
            column.push(value);
        }
    }
    columns
}
