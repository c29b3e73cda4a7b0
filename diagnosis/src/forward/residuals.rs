//! How far recordings are from their simulation, by region: below the rotors, across the jet, over
//! the floor, in time.

use rayon::prelude::*;
use serde::Serialize;

use crate::forward::simulate::{Channel, Sample};
use crate::record::recording::{Instrument, Recording};

/// A coordinate that samples are sorted by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Depth below the rotor plane over the motor distance.
    SOverL,
    /// Distance from the axis over the half-width.
    Xi,
    /// Height above the floor, or above z = 0 without one (m).
    HeightM,
    /// Time (s).
    TimeS,
}

impl Axis {
    /// All of them, in the order of reports.
    pub const ALL: [Axis; 4] = [Axis::SOverL, Axis::Xi, Axis::HeightM, Axis::TimeS];

    /// As a reader meets it: letter and unit.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Axis::SOverL => "depth s/l",
            Axis::Xi => "radius xi",
            Axis::HeightM => "height m",
            Axis::TimeS => "time s",
        }
    }
}

/// Residuals of one channel in one interval of one coordinate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Region {
    /// What was recorded.
    pub channel: Channel,
    /// The coordinate; `None`: everywhere.
    pub axis: Option<Axis>,
    /// The interval, lower end included.
    pub interval: Option<(f64, f64)>,
    /// How many samples.
    pub samples: usize,
    /// Mean of recorded minus simulated, in the channel's unit.
    pub bias: f64,
    /// Root of its mean square.
    pub rms: f64,
    /// Root mean square of recorded values, for scale.
    pub recorded_rms: f64,
    /// Root mean square over what the instrument's stated accuracy allows; `None` where none is
    /// stated.
    pub rms_over_accuracy: Option<f64>,
}

/// Lower ends of intervals, of which the last has no upper end. Depth from 0 in the steps of the
/// near field (2.5 l), then wider; `ξ` as in the paper's table.
const S_FROM: [f64; 9] = [0.0, 1.0, 2.5, 4.0, 6.0, 9.0, 13.0, 18.0, 25.0];
const XI_FROM: [f64; 7] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
/// Intervals of height and time: as many equal ones over what was covered. Chosen here: a table
/// that fits a screen.
const EVEN_INTERVALS: usize = 6;

/// Residuals of every channel, first everywhere, then along each coordinate; empty intervals are
/// left away.
#[must_use]
pub fn by_region(recording: &Recording, samples: &[Sample]) -> Vec<Region> {
    let instrument = recording.probes.as_ref().map(|probes| &probes.instrument);
    let floor_m = recording.environment.floor_z_m.unwrap_or(0.0);
    let mut channels: Vec<Channel> = samples.iter().map(|sample| sample.channel).collect();
    channels.sort_unstable();
    channels.dedup();
    let mut regions = Vec::new();
    for channel in channels {
        let of_channel: Vec<&Sample> = samples.iter().filter(|s| s.channel == channel).collect();
        regions.extend(region(channel, None, &of_channel, instrument));
        // Measured side by side, put down in order.
        let along: Vec<Vec<Region>> = Axis::ALL
            .par_iter()
            .map(|&axis| along(axis, channel, &of_channel, floor_m, instrument))
            .collect();
        regions.extend(along.into_iter().flatten());
    }
    regions
}

/// Residuals of one channel along one coordinate: every sample goes to its interval once.
fn along(
    axis: Axis,
    channel: Channel,
    of_channel: &[&Sample],
    floor_m: f64,
    instrument: Option<&Instrument>,
) -> Vec<Region> {
    let placed: Vec<(f64, &Sample)> = of_channel
        .iter()
        .filter_map(|&sample| Some((coordinate(axis, sample, floor_m)?, sample)))
        .collect();
    let intervals = intervals(axis, &placed);
    let mut within: Vec<Vec<&Sample>> = vec![Vec::new(); intervals.len()];
    for (x, sample) in placed {
        let at = intervals.partition_point(|(_, to)| *to <= x);
        if intervals.get(at).is_some_and(|(from, _)| *from <= x) {
            within[at].push(sample);
        }
    }
    let region = |(interval, within): (_, &Vec<&Sample>)| {
        region(channel, Some((axis, interval)), within, instrument)
    };
    let regions = intervals.into_iter().zip(&within);
    regions.filter_map(region).collect()
}

fn coordinate(axis: Axis, sample: &Sample, floor_m: f64) -> Option<f64> {
    match axis {
        Axis::SOverL => Some(sample.place?.s_over_l),
        Axis::Xi => Some(sample.place?.xi),
        Axis::HeightM => Some(sample.position_m.z - floor_m),
        Axis::TimeS => Some(sample.t_s),
    }
}

fn intervals(axis: Axis, placed: &[(f64, &Sample)]) -> Vec<(f64, f64)> {
    let pairs = |from: &[f64], end: f64| {
        let ends = from.iter().skip(1).chain([&end]);
        from.iter().copied().zip(ends.copied()).collect()
    };
    let values = || placed.iter().map(|(x, _)| *x);
    match (axis, values().reduce(f64::min), values().reduce(f64::max)) {
        (Axis::SOverL, ..) => pairs(&S_FROM, f64::INFINITY),
        (Axis::Xi, ..) => pairs(&XI_FROM, f64::INFINITY),
        (_, Some(from), Some(to)) => {
            // All at one height: the interval that holds it.
            let count = if from == to { 1 } else { EVEN_INTERVALS };
            let step = (to - from) / EVEN_INTERVALS as f64;
            let even: Vec<f64> = (0..count).map(|i| from + step * i as f64).collect();
            pairs(&even, to.next_up())
        }
        _ => Vec::new(),
    }
}

fn region(
    channel: Channel,
    along: Option<(Axis, (f64, f64))>,
    samples: &[&Sample],
    instrument: Option<&Instrument>,
) -> Option<Region> {
    if samples.is_empty() {
        return None;
    }
    let count = samples.len() as f64;
    let mean = |of: &dyn Fn(&Sample) -> f64| samples.iter().map(|s| of(s)).sum::<f64>() / count;
    let instrument = instrument.filter(|_| channel == Channel::Speed);
    let rms_over_accuracy = instrument.map(|instrument| {
        let (absolute, relative) = (instrument.accuracy_abs_mps, instrument.accuracy_rel);
        let accuracy = |sample: &Sample| absolute + relative * sample.simulated;
        mean(&|sample| (sample.residual() / accuracy(sample)).powi(2)).sqrt()
    });
    Some(Region {
        channel,
        axis: along.map(|(axis, _)| axis),
        interval: along.map(|(_, interval)| interval),
        samples: samples.len(),
        bias: mean(&Sample::residual),
        rms: mean(&|sample| sample.residual().powi(2)).sqrt(),
        recorded_rms: mean(&|sample| sample.recorded.powi(2)).sqrt(),
        rms_over_accuracy,
    })
}
