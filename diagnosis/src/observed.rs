//! A recording made ready to be explained: its samples beside the baseline's, with everything that a residual may depend on.

use crate::flow::{Flow, Wakes};
use crate::hypothesis::Hypothesis;
use crate::recording::Recording;
use crate::simulate::{Channel, Sample, Series, series, simulate};

/// Names of the covariates, in the order of [`Observed::covariates`].
pub const COVARIATES: [&str; 18] = [
    "s/l",
    "r/l",
    "xi",
    "cos az",
    "sin az",
    "height m",
    "time s",
    "air m/s",
    "emitter z m",
    "emitter speed m/s",
    "climb m/s",
    "second jet/first",
    "battery V",
    "height/half-width",
    "cos az body",
    "sin az body",
    "x m",
    "y m",
];

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
}

impl<'a> Observed<'a> {
    /// The samples of a recording: of its probes where it has any, of its receivers otherwise. `None` without either.
    #[must_use]
    pub fn new(recording: &'a Recording) -> Option<Observed<'a>> {
        let simulated = simulate(recording).samples;
        let channel = simulated.first()?.channel;
        let all = series(recording);
        let mut samples = Vec::with_capacity(simulated.len());
        let mut series_of = Vec::with_capacity(simulated.len());
        let mut kept = Vec::new();
        for mut one in all.into_iter().filter(|series| series.channel == channel) {
            let find = |row: &usize| {
                let at = simulated.binary_search_by_key(&(channel, *row), |s| (s.channel, s.row));
                at.ok().map(|at| simulated[at])
            };
            let of_series: Vec<Sample> = one.rows.iter().filter_map(find).collect();
            one.rows = of_series.iter().map(|sample| sample.row).collect();
            series_of.extend(of_series.iter().map(|_| kept.len()));
            samples.extend(of_series);
            kept.push(one);
        }
        let mut observed = Observed {
            recording,
            channel,
            samples,
            series_of,
            covariates: Vec::new(),
            wakes: Wakes::new(recording),
            series: kept,
        };
        observed.covariates = covariates(&observed);
        Some(observed)
    }

    /// What the samples would be under a hypothesis, in their order. Where a hypothesis asks for a drone's place in a gap, the
    /// baseline's value stands.
    #[must_use]
    pub fn predict(&self, hypothesis: &Hypothesis) -> Vec<f64> {
        let flow = Flow::supposing(self.recording, &self.wakes, hypothesis);
        let mut predicted = Vec::with_capacity(self.samples.len());
        for series in &self.series {
            let values = series.simulate(self.recording, &flow, &hypothesis.sensor);
            for value in values {
                predicted.push(value.unwrap_or_else(|| self.samples[predicted.len()].simulated));
            }
        }
        predicted
    }

    /// How long ago (s) the air at a sample left its drone, at the centreline's speed; 0 below none.
    #[must_use]
    pub fn age_s(&self, sample: usize) -> f64 {
        let sample = &self.samples[sample];
        let age = sample.place.and_then(|place| {
            let airframe = &self.recording.vehicles[place.emitter].airframe;
            let wake = self.wakes.of(place.emitter)?;
            let depth_m = place.s_over_l * airframe.motor_distance_m();
            Some(wake.far_field().transport_time_s(depth_m, 1.0))
        });
        age.unwrap_or(0.0)
    }

    /// Azimuth (rad) of a sample about the drone that blows on it: in the world from east, or in the drone's body from its nose. `None`
    /// below no drone.
    #[must_use]
    pub fn azimuth_rad(&self, sample: usize, in_body: bool) -> Option<f64> {
        self.samples[sample].place?;
        let column = |name: &str| Some(self.covariate(name)?[sample]);
        let (cos, sin) = if in_body {
            (column("cos az body")?, column("sin az body")?)
        } else {
            (column("cos az")?, column("sin az")?)
        };
        Some(sin.atan2(cos))
    }

    /// Smallest step of a reading, in the channel's unit; 0 where none is declared.
    #[must_use]
    pub fn resolution(&self) -> f64 {
        let probes = self.recording.probes.as_ref();
        probes
            .filter(|_| self.channel == Channel::Speed)
            .map_or(0.0, |probes| probes.instrument.resolution_mps)
    }

    /// Recorded values.
    #[must_use]
    pub fn recorded(&self) -> Vec<f64> {
        self.samples.iter().map(|sample| sample.recorded).collect()
    }

    /// The baseline's values.
    #[must_use]
    pub fn simulated(&self) -> Vec<f64> {
        self.samples.iter().map(|sample| sample.simulated).collect()
    }

    /// Times (s).
    #[must_use]
    pub fn times_s(&self) -> Vec<f64> {
        self.samples.iter().map(|sample| sample.t_s).collect()
    }

    /// One covariate by name.
    #[must_use]
    pub fn covariate(&self, name: &str) -> Option<&[f64]> {
        let at = COVARIATES.iter().position(|known| *known == name)?;
        self.covariates.get(at).map(Vec::as_slice)
    }
}

fn covariates(observed: &Observed) -> Vec<Vec<f64>> {
    let recording = observed.recording;
    let flow = Flow::new(recording);
    let floor_m = recording.environment.floor_z_m.unwrap_or(0.0);
    let mut columns = vec![Vec::with_capacity(observed.samples.len()); COVARIATES.len()];
    for sample in &observed.samples {
        let but = (sample.channel != Channel::Speed).then_some(sample.subject as usize);
        let place = sample.place;
        let emitter = place.map(|place| &recording.vehicles[place.emitter]);
        let state = emitter.and_then(|emitter| {
            let moment = emitter.track.moment(sample.t_s)?;
            let (_, _, yaw_rad) = emitter.track.attitude_at(moment).euler_angles();
            Some((
                emitter.track.position_at(moment),
                emitter.track.velocity_at(moment),
                yaw_rad,
            ))
        });
        let [first_mps, second_mps] = flow.strongest_mps(sample.t_s, sample.position_m, but);
        let height_m = sample.position_m.z - floor_m;
        let half_width_m = place
            .zip(emitter)
            .map_or(f64::INFINITY, |(place, emitter)| {
                let over_l = if place.xi > 0.0 {
                    place.r_over_l / place.xi
                } else {
                    0.0
                };
                let fallback = recording.jet.spreading * (place.s_over_l - recording.jet.origin);
                emitter.airframe.motor_distance_m() * if over_l > 0.0 { over_l } else { fallback }
            });
        let body_rad = place
            .zip(state)
            .map(|(place, (_, _, yaw_rad))| place.azimuth_rad - yaw_rad);
        let battery_v = match sample.channel {
            Channel::Throttle => recording.receivers[sample.row].battery_v,
            _ => None,
        };
        let row = [
            place.map_or(-1.0, |place| place.s_over_l),
            place.map_or(-1.0, |place| place.r_over_l),
            place.map_or(-1.0, |place| place.xi),
            place.map_or(0.0, |place| place.azimuth_rad.cos()),
            place.map_or(0.0, |place| place.azimuth_rad.sin()),
            height_m,
            sample.t_s,
            sample.air_mps,
            state.map_or(0.0, |(position_m, ..)| position_m.z),
            state.map_or(0.0, |(_, velocity_mps, _)| velocity_mps.norm()),
            state.map_or(0.0, |(_, velocity_mps, _)| velocity_mps.z),
            if first_mps > 0.0 {
                second_mps / first_mps
            } else {
                0.0
            },
            battery_v.unwrap_or(0.0),
            (height_m / half_width_m).min(20.0),
            body_rad.map_or(0.0, f64::cos),
            body_rad.map_or(0.0, f64::sin),
            sample.position_m.x,
            sample.position_m.y,
        ];
        columns
            .iter_mut()
            .zip(row)
            .for_each(|(column, value)| column.push(value));
    }
    columns
}
