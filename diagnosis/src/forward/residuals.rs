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
pub fn by_region<'r>(recordings: &[(&'r Recording, &'r [Sample])]) -> Vec<Region> {
    let with_own = |&(recording, samples): &(&'r Recording, &'r [Sample])| {
        samples.iter().map(move |sample| Of { sample, recording })
    };
    let samples: Vec<Of> = recordings.iter().flat_map(with_own).collect();
    let mut channels: Vec<Channel> = samples.iter().map(|of| of.sample.channel).collect();
    channels.sort_unstable();
    channels.dedup();
    let mut regions = Vec::new();
    for channel in channels {
        let is_of_it = |of: &&Of| of.sample.channel == channel;
        let of_channel: Vec<Of> = samples.iter().filter(is_of_it).copied().collect();
        regions.extend(region(channel, None, &of_channel));
        // Measured side by side, put down in order.
        let along: Vec<Vec<Region>> = Axis::ALL
            .par_iter()
            .map(|&axis| along(axis, channel, &of_channel))
            .collect();
        regions.extend(along.into_iter().flatten());
    }
    regions
}

/// Residuals of one channel along one coordinate: every sample goes to its interval once.
fn along<'r>(axis: Axis, channel: Channel, of_channel: &[Of<'r>]) -> Vec<Region> {
    let placed: Vec<(f64, Of<'r>)> = of_channel
        .iter()
        .filter_map(|&of| Some((of.coordinate(axis)?, of)))
        .collect();
    let intervals = intervals(axis, &placed);
    let mut within: Vec<Vec<Of<'r>>> = vec![Vec::new(); intervals.len()];
    for (x, sample) in placed {
        let at = intervals.partition_point(|(_, to)| *to <= x);
        if intervals.get(at).is_some_and(|(from, _)| *from <= x) {
            within[at].push(sample);
        }
    }
    let region =
        |(interval, within): (_, &Vec<Of>)| region(channel, Some((axis, interval)), within);
    let regions = intervals.into_iter().zip(&within);
    regions.filter_map(region).collect()
}

/// A sample, and the recording whose floor and instrument are its own.
#[derive(Clone, Copy)]
struct Of<'r> {
    sample: &'r Sample,
    recording: &'r Recording,
}

impl Of<'_> {
    fn coordinate(self, axis: Axis) -> Option<f64> {
        let Of { sample, recording } = self;
        let floor_m = recording.environment.floor_z_m.unwrap_or(0.0);
        match axis {
            Axis::SOverL => Some(sample.place?.s_over_l),
            Axis::Xi => Some(sample.place?.xi),
            Axis::HeightM => Some(sample.position_m.z - floor_m),
            Axis::TimeS => Some(sample.t_s),
        }
    }

    /// Of a speed its residual over what the instrument's stated accuracy allows.
    fn over_accuracy(self) -> Option<f64> {
        let Of { sample, recording } = self;
        let probes = recording.probes.as_ref();
        let Instrument {
            accuracy_abs_mps,
            accuracy_rel,
            ..
        } = probes
            .filter(|_| sample.channel == Channel::Speed)?
            .instrument;
        Some(sample.residual() / (accuracy_abs_mps + accuracy_rel * sample.simulated))
    }
}

fn intervals(axis: Axis, placed: &[(f64, Of)]) -> Vec<(f64, f64)> {
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

fn region(channel: Channel, along: Option<(Axis, (f64, f64))>, samples: &[Of]) -> Option<Region> {
    if samples.is_empty() {
        return None;
    }
    let count = samples.len() as f64;
    let mean =
        |of: &dyn Fn(&Sample) -> f64| samples.iter().map(|one| of(one.sample)).sum::<f64>() / count;
    let over_accuracy = samples.iter().map(|of| Some(of.over_accuracy()?.powi(2)));
    let rms_over_accuracy = over_accuracy.sum::<Option<f64>>();
    let rms_over_accuracy = rms_over_accuracy.map(|sum| (sum / count).sqrt());
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forward::simulate::simulate;
    use crate::infer::diagnose::tests::hall;

    #[test]
    fn every_sample_is_judged_by_the_floor_and_the_instrument_of_its_own_recording() {
        let low = hall();
        let mut high = hall();
        high.environment.floor_z_m = low.environment.floor_z_m.map(|z_m| z_m - 2.0);
        let probes = high.probes.as_mut().expect("it has probes");
        probes.instrument.accuracy_abs_mps *= 2.0;
        probes.instrument.accuracy_rel *= 2.0;
        let samples = simulate(&low).samples;
        let regions = |of: &[&Recording]| {
            let of: Vec<_> = of.iter().map(|one| (*one, &samples[..])).collect();
            by_region(&of)
        };
        let over = |regions: &[Region]| regions[0].rms_over_accuracy.expect("a probe's");
        let [one, two] = [&low, &high].map(|of| over(&regions(&[of])));
        let both = regions(&[&low, &high]);
        let together = (0.5 * (one * one + two * two)).sqrt();
        // Rounding of a thousand terms.
        assert!((over(&both) / together - 1.0).abs() < 1e-9 && one > 1.9 * two);
        let heights = both.iter().filter(|of| of.axis == Some(Axis::HeightM));
        let ends = heights.filter_map(|of| of.interval);
        let [from_m, to_m] = ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[from, to], of| {
            [from.min(of.0), to.max(of.1)]
        });
        assert!(to_m - from_m >= 2.0 - 1e-9, "{from_m} {to_m}");
    }
}
