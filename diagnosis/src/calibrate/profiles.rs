//! Radial profiles slice by slice, each fitted alone: centreline and half-width against depth.

use airflow::{FAR_FIELD_FROM_S_OVER_L, Jet};
use nalgebra::Vector2;

use super::calibration::{Estimate, Interval, Profile, RadialBin, SliceFit};
use super::cells::{Cell, quantile};
use super::curve::{self, AtReading};
use super::intervals::student_quantile;
use super::joint::assumed_variance;
use super::operator::{Constants, xi};
use super::options::Options;
use super::samples::{Flight, Sample};

/// Thickness of a slice of the near field over the motor distance. Chosen here: the lobes move a tenth of l within it.
const NEAR_SLICE: f64 = 0.5;
/// Width of a radial bin over the half-width of the paper's jet. Chosen here: the profile falls by at most 17 % within it.
const BIN_OVER_HALF_WIDTH: f64 = 0.25;
/// Fewest readings of a bin that is drawn.
const FEWEST_READINGS: usize = 3;
/// Fewest cells of a slice that is fitted.
const FEWEST_CELLS: usize = 8;

/// Readings and cells of one drone, all flights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured<'a> {
    pub(super) drone: usize,
    pub(super) flights: &'a [Flight],
    /// In the order that the cells refer to.
    pub(super) samples: &'a [Sample],
    pub(super) cells: &'a [Cell],
}

/// Profiles of one drone, shallowest first; near-field ones are not fitted.
pub(super) fn profiles(
    near: Measured<'_>,
    far: Measured<'_>,
    joint: &Constants,
    options: &Options,
) -> Vec<Profile> {
    let mut profiles = slices(near, 0.0, NEAR_SLICE, None);
    profiles.extend(slices(
        far,
        FAR_FIELD_FROM_S_OVER_L,
        options.slice_s_over_l,
        Some(joint),
    ));
    profiles
}

fn slices(
    measured: Measured<'_>,
    from: f64,
    thickness: f64,
    joint: Option<&Constants>,
) -> Vec<Profile> {
    let of_drone = |cell: &&Cell| measured.flights[cell.flight].drone == measured.drone;
    let mut cells: Vec<(usize, &Cell)> = measured
        .cells
        .iter()
        .filter(of_drone)
        .map(|cell| (((cell.s - from) / thickness).max(0.0) as usize, cell))
        .collect();
    cells.sort_by_key(|(slice, _)| *slice);
    cells
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|slice| {
            let s_from = from + thickness * slice[0].0 as f64;
            let cells: Vec<&Cell> = slice.iter().map(|(_, cell)| *cell).collect();
            let readings: usize = cells.iter().map(|cell| cell.count()).sum();
            let depths: f64 = cells.iter().map(|cell| cell.s * cell.count() as f64).sum();
            let s_over_l = depths / readings as f64;
            let bins = bins(measured, &cells, s_over_l);
            (!bins.is_empty()).then(|| Profile {
                s_from,
                s_to: s_from + thickness,
                s_over_l,
                bins,
                fit: joint.and_then(|joint| fit(measured, &cells, s_over_l, joint)),
            })
        })
        .collect()
}

fn bins(measured: Measured<'_>, cells: &[&Cell], s_over_l: f64) -> Vec<RadialBin> {
    let jet = Jet::default();
    // Above the far field the jet is about as wide as where that begins.
    let deep = s_over_l.max(FAR_FIELD_FROM_S_OVER_L);
    let width = BIN_OVER_HALF_WIDTH * jet.spreading * (deep - jet.origin);
    let mut numbered: Vec<(usize, &Cell)> = cells
        .iter()
        .map(|cell| ((cell.r / width) as usize, *cell))
        .collect();
    numbered.sort_by_key(|(bin, _)| *bin);
    numbered
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|bin| {
            let over = |flight: usize, mps: f64| {
                mps / measured.flights[flight].operator.induced_velocity_mps
            };
            let mut medians: Vec<f64> = bin
                .iter()
                .map(|(_, cell)| over(cell.flight, cell.median_mps))
                .collect();
            let readings = || {
                bin.iter()
                    .flat_map(|(_, cell)| &measured.samples[cell.from..cell.to])
            };
            let mut speeds: Vec<f64> = readings()
                .map(|sample| over(sample.flight, sample.speed_mps))
                .collect();
            let mut flights: Vec<usize> = bin.iter().map(|(_, cell)| cell.flight).collect();
            flights.sort_unstable();
            flights.dedup();
            (speeds.len() >= FEWEST_READINGS).then(|| RadialBin {
                r_over_l: readings().map(|sample| sample.r).sum::<f64>() / speeds.len() as f64,
                median: quantile(&mut medians, 0.5),
                low: quantile(&mut speeds, 0.16),
                high: quantile(&mut speeds, 0.84),
                samples: speeds.len(),
                flights: flights.len(),
            })
        })
        .collect()
}

/// The slice alone, through the observation operator. Within it the jet widens about the joint fit's virtual origin.
fn fit(
    measured: Measured<'_>,
    cells: &[&Cell],
    s_over_l: f64,
    joint: &Constants,
) -> Option<SliceFit> {
    let xis = || cells.iter().map(|cell| xi(joint, cell.s, cell.r));
    let reaches = xis().any(|xi| xi < 0.5) && xis().any(|xi| xi > 1.0);
    if cells.len() < FEWEST_CELLS || !reaches {
        return None;
    }
    let mut flights: Vec<usize> = cells.iter().map(|cell| cell.flight).collect();
    flights.sort_unstable();
    flights.dedup();
    // By flight where there are some: the gain of the probe is then in the interval. Else by cell.
    let by_flight = flights.len() >= 4;
    let group = |row: usize| match by_flight {
        true => flights.binary_search(&cells[row].flight).unwrap_or(0),
        false => row,
    };
    let at = |row: usize, x: &Vector2<f64>| {
        let cell = cells[row];
        let operator = &measured.flights[cell.flight].operator;
        let constants = Constants::new(x[0], x[1], joint[2]);
        let predicted = operator.predict(&constants, cell.s, cell.r);
        let weighed = operator.predict(joint, cell.s, cell.r).reading_mps;
        AtReading {
            root_weight: assumed_variance(weighed, cell.count()).sqrt().recip(),
            residual: cell.median_mps - predicted.reading_mps,
            gradient: predicted.gradient.fixed_rows::<2>(0).into_owned(),
        }
    };
    let fitted = curve::fit(cells.len(), Vector2::new(joint[0], joint[1]), at, group)?;
    let covariance = fitted.covariance?;
    let past_origin = s_over_l - joint[2];
    let quantile = student_quantile(fitted.groups as f64 - 1.0);
    let estimate = |k: usize, scale: f64| {
        let value = fitted.constants[k] * scale;
        let half = quantile * covariance[(k, k)].max(0.0).sqrt() * scale;
        let interval = Interval {
            low: value - half,
            high: value + half,
        };
        (value.is_finite() && value > 0.0 && half.is_finite())
            .then_some(Estimate { value, interval })
    };
    Some(SliceFit {
        centreline: estimate(0, past_origin.recip())?,
        half_width: estimate(1, past_origin)?,
    })
}
