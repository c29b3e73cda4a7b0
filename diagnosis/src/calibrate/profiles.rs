//! The paper's figures of one drone: radial profiles slice by slice, each fitted alone (centreline
//! and half-width against depth), and the two lobes of the near field along the body's y axis,
//! which come together (the paper's `δ(s)`).

use std::collections::BTreeSet;

use airflow::{FAR_FIELD_FROM_S_OVER_L, Jet};
use nalgebra::{Vector2, Vector3};

use super::calibration::{Estimate, Interval, Lobes, Profile, RadialBin, SliceFit};
use super::jet_fit::{AtReading, Constants, FittedCurve, assumed_variance, fit_curve, xi};
use super::samples::{Cell, ProbedFlight, Sample, flights_of, quantile};
use super::spread::student_quantile;

/// Thickness of a slice of the far field over the motor distance. Chosen here: the jet widens by
/// 12 % over it at 2.5 l.
const FAR_SLICE: f64 = 1.0;
/// Thickness of a slice of the near field over the motor distance. Chosen here: the lobes move a
/// tenth of l within it.
const NEAR_SLICE: f64 = 0.5;
/// Width of a radial bin over the half-width of the paper's jet. Chosen here: the profile falls by
/// at most 17 % within it.
const BIN_OVER_HALF_WIDTH: f64 = 0.25;
/// Fewest readings of a bin that is drawn.
const FEWEST_READINGS: usize = 3;
/// Fewest cells of a slice that is fitted.
const FEWEST_CELLS: usize = 8;
/// Readings within this of the body's y axis make its profile, over the motor distance. Chosen
/// here: a third of the distance between axis and rotors.
const BESIDE: f64 = 0.1;
/// Thickness of a slice over the motor distance. Chosen here: the lobes move by a twentieth of l
/// within it.
const LOBE_SLICE: f64 = 0.25;
/// Readings of one flight in so wide a strip share their errors: about one grid point. Chosen here.
const STRIP: f64 = 0.05;
/// Fewest readings of a slice whose lobes are fitted. Chosen here: seven a constant.
const FEWEST_OF_LOBES: usize = 20;
/// Distance of the rotors along y over the motor distance: they stand on diagonals, `1/(2 √2)`.
const ROTORS: f64 = 0.353_553_390_593_273_8;

/// Readings and cells of one drone, all flights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measured<'a> {
    pub(super) drone: usize,
    pub(super) flights: &'a [ProbedFlight],
    /// In the order that the cells refer to.
    pub(super) samples: &'a [Sample],
    pub(super) cells: &'a [Cell],
}

impl<'a> Measured<'a> {
    /// The readings that are of this drone.
    pub(super) fn of_drone(self) -> impl Iterator<Item = &'a Sample> {
        let samples = self.samples.iter();
        samples.filter(move |sample| self.flights[sample.flight].drone == self.drone)
    }
}

/// Profiles of one drone, shallowest first; near-field ones are not fitted.
pub(super) fn profiles(near: Measured<'_>, far: Measured<'_>, joint: &Constants) -> Vec<Profile> {
    let mut profiles = slices(near, 0.0, NEAR_SLICE, None);
    let from = FAR_FIELD_FROM_S_OVER_L;
    profiles.extend(slices(far, from, FAR_SLICE, Some(joint)));
    profiles
}

fn slices(
    measured: Measured<'_>,
    from: f64,
    thickness: f64,
    joint: Option<&Constants>,
) -> Vec<Profile> {
    let of_drone = |cell: &&Cell| measured.flights[cell.flight].drone == measured.drone;
    let cells = measured.cells.iter().filter(of_drone);
    let slice_of = |cell: &Cell| ((cell.s - from) / thickness).max(0.0) as usize;
    let mut cells: Vec<(usize, &Cell)> = cells.map(|cell| (slice_of(cell), cell)).collect();
    cells.sort_by_key(|(slice, _)| *slice);
    let profile = |slice: &[(usize, &Cell)]| {
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
    };
    let slices = cells.chunk_by(|a, b| a.0 == b.0);
    slices.filter_map(profile).collect()
}

fn bins(measured: Measured<'_>, cells: &[&Cell], s_over_l: f64) -> Vec<RadialBin> {
    let jet = Jet::default();
    // Above the far field the jet is about as wide as where that begins.
    let deep = s_over_l.max(FAR_FIELD_FROM_S_OVER_L);
    let width = BIN_OVER_HALF_WIDTH * jet.spreading * (deep - jet.origin);
    let numbered = cells.iter().map(|cell| ((cell.r / width) as usize, *cell));
    let mut numbered: Vec<(usize, &Cell)> = numbered.collect();
    numbered.sort_by_key(|(bin, _)| *bin);
    numbered
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|bin| {
            let over = |flight: usize, mps: f64| {
                mps / measured.flights[flight].operator.induced_velocity_mps
            };
            let cells = || bin.iter().map(|(_, cell)| *cell);
            let readings = || cells().flat_map(|cell| &measured.samples[cell.from..cell.to]);
            let medians = cells().map(|cell| over(cell.flight, cell.median_mps));
            let mut medians: Vec<f64> = medians.collect();
            let speeds = readings().map(|sample| over(sample.flight, sample.speed_mps));
            let mut speeds: Vec<f64> = speeds.collect();
            (speeds.len() >= FEWEST_READINGS).then(|| RadialBin {
                r_over_l: readings().map(|sample| sample.r).sum::<f64>() / speeds.len() as f64,
                median: quantile(&mut medians, 0.5),
                low: quantile(&mut speeds, 0.16),
                high: quantile(&mut speeds, 0.84),
                samples: speeds.len(),
                flights: flights_of(cells()).len(),
            })
        })
        .collect()
}

/// The slice alone, through the observation operator. Within it the jet widens about the joint
/// fit's virtual origin.
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
    let flights = flights_of(cells.iter().copied());
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
    let fitted = fit_curve(cells.len(), Vector2::new(joint[0], joint[1]), at, group)?;
    let covariance = fitted.covariance?;
    let past_origin = s_over_l - joint[2];
    let quantile = student_quantile(fitted.groups as f64 - 1.0);
    let estimate = |k: usize, scale: f64| {
        let value = fitted.constants[k] * scale;
        let half = quantile * covariance[(k, k)].max(0.0).sqrt() * scale;
        let interval = Interval::around(value, half);
        (value.is_finite() && value > 0.0 && half.is_finite())
            .then_some(Estimate { value, interval })
    };
    Some(SliceFit {
        centreline: estimate(0, past_origin.recip())?,
        half_width: estimate(1, past_origin)?,
    })
}

/// Lobes of one drone by depth, and between which depths two maxima become one.
pub(super) fn lobes(near: Measured<'_>) -> (Vec<Lobes>, Option<Interval>) {
    let slice = |sample: &Sample| (sample.s / LOBE_SLICE) as usize;
    let mut samples: Vec<&Sample> = near
        .of_drone()
        .filter(|sample| sample.forward.abs() < BESIDE && sample.s < FAR_FIELD_FROM_S_OVER_L)
        .collect();
    samples.sort_by_key(|sample| slice(sample));
    let slices = samples.chunk_by(|a, b| slice(a) == slice(b));
    let lobes: Vec<Lobes> = slices
        .filter_map(|slice| fit_lobes(near.flights, slice))
        .collect();
    let two = |lobes: &Lobes| lobes.delta.value > lobes.width;
    let last = lobes.iter().rposition(two);
    let merged = last.and_then(|last| lobes.get(last..last + 2));
    let merged = merged.map(|ends| Interval {
        low: ends[0].s_over_l,
        high: ends[1].s_over_l,
    });
    (lobes, merged)
}

/// One lobe of height 1, at a distance from its centre.
fn gauss(distance: f64, width: f64) -> f64 {
    (-0.5 * (distance / width).powi(2)).exp()
}

fn fit_lobes(flights: &[ProbedFlight], samples: &[&Sample]) -> Option<Lobes> {
    let strip = |sample: &Sample| (sample.flight, (sample.left / STRIP).floor() as i64);
    let strips: BTreeSet<(usize, i64)> = samples.iter().map(|sample| strip(sample)).collect();
    let strips: Vec<(usize, i64)> = strips.into_iter().collect();
    if samples.len() < FEWEST_OF_LOBES || strips.len() < 6 {
        return None;
    }
    let group = |row: usize| strips.binary_search(&strip(samples[row])).unwrap_or(0);
    let at = |row: usize, x: &Vector3<f64>| {
        let sample = samples[row];
        let operator = &flights[sample.flight].operator;
        let u_h_mps = operator.induced_velocity_mps;
        let (ambient, read) = (operator.ambient_mps / u_h_mps, sample.speed_mps / u_h_mps);
        let [height, delta, width] = (*x).into();
        let [right, left] = [delta, -delta].map(|centre| gauss(sample.left - centre, width));
        let flow = height * (right + left);
        let reading = flow.hypot(ambient);
        let by_flow = if reading > 0.0 { flow / reading } else { 0.0 };
        let (to_right, to_left) = (sample.left - delta, sample.left + delta);
        let by_delta = height * (right * to_right - left * to_left) / (width * width);
        let by_width =
            height * (right * to_right * to_right + left * to_left * to_left) / width.powi(3);
        AtReading {
            // A twentieth of U_H besides a seventh of the reading: gusts (chosen here, weights
            // only).
            root_weight: (0.05_f64.powi(2) + (0.15 * read).powi(2)).sqrt().recip(),
            residual: read - reading,
            gradient: by_flow * Vector3::new(right + left, by_delta, by_width),
        }
    };
    let starts = [ROTORS, 0.2, 0.08].map(|delta| Vector3::new(1.0, delta, 0.15));
    let fits = starts.map(|start| fit_curve(samples.len(), start, at, group));
    let usable = |fitted: &FittedCurve<3>| {
        let [height, delta, width] = fitted.constants.into();
        height > 0.0 && delta.abs() < 2.0 && width.abs() > 1e-3
    };
    let usable = fits.into_iter().flatten().filter(usable);
    let best = usable.min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    let [height, delta, width] = best.constants.into();
    let (delta, width) = (delta.abs(), width.abs());
    let half = best.covariance.map_or(width, |covariance| {
        student_quantile(best.groups as f64 - 3.0) * covariance[(1, 1)].max(0.0).sqrt()
    });
    // With one maximum nothing holds the lobes apart: they may lie on the axis, and no farther out
    // than they are wide.
    let interval = match delta > width {
        true => Interval::around(delta, half),
        false => Interval {
            low: 0.0,
            high: (delta + half).min(width),
        },
    };
    let at_y = |y: f64| height * (gauss(y - delta, width) + gauss(y + delta, width));
    Some(Lobes {
        s_over_l: samples.iter().map(|sample| sample.s).sum::<f64>() / samples.len() as f64,
        delta: Estimate {
            value: delta,
            interval,
        },
        width,
        peak: at_y(delta).max(at_y(0.0)),
        samples: samples.len(),
    })
}
