//! Samples in the coordinates of the wake that they were taken in, and what is typical of several.

use diagnosis::forward::simulate::Sample;
use diagnosis::statistics::quantile::quantile;

/// One recorded value beside the simulated one, in the strongest wake there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    /// Depth below the rotor plane over the motor distance.
    pub(crate) s_over_l: f64,
    /// Distance from the axis over the motor distance, negative on the side of negative x.
    pub(crate) across_over_l: f64,
    pub(crate) recorded: f64,
    pub(crate) simulated: f64,
    /// What the instrument is accurate to, in the unit of the values.
    pub(crate) accuracy: f64,
}

impl Reading {
    /// A sample with its values in units of `unit`; `None` outside every wake.
    pub(super) fn of(sample: &Sample, accuracy: f64, unit: f64) -> Option<Reading> {
        let place = sample.place?;
        Some(Reading {
            s_over_l: place.s_over_l,
            across_over_l: place.r_over_l.copysign(place.azimuth_rad.cos()),
            recorded: sample.recorded / unit,
            simulated: sample.simulated / unit,
            accuracy: accuracy / unit,
        })
    }
}

/// Distance from the axis, with a sign, and depth of each reading.
pub(super) fn places(readings: &[Reading]) -> Vec<(f64, f64)> {
    let place = |reading: &Reading| (reading.across_over_l, reading.s_over_l);
    readings.iter().map(place).collect()
}

/// Median and the middle 68 % of some values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spread {
    pub(crate) median: f64,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl Spread {
    pub(super) fn new(low: f64, median: f64, high: f64) -> Spread {
        Spread { median, low, high }
    }

    /// `None`: no values.
    pub(crate) fn of(values: impl Iterator<Item = f64>) -> Option<Spread> {
        let values = sorted(values);
        // One standard deviation to either side, where the values are normal.
        let at = |share: f64| quantile(&values, share);
        Some(Spread::new(at(0.1587)?, at(0.5)?, at(0.8413)?))
    }
}

pub(super) fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_of_a_normal_sample_is_one_standard_deviation_to_either_side() {
        // Quantiles of the uniform distribution stand in: 0, 0.001, ... 1.
        let found = Spread::of((0..=1000).map(|i| f64::from(i) / 1000.0));
        assert_eq!(found, Some(Spread::new(0.1587, 0.5, 0.8413)));
        assert_eq!(Spread::of(std::iter::empty()), None);
    }
}
