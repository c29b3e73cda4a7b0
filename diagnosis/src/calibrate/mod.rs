//! From recordings to the three constants of the jet, with intervals that cover:
//! the paper's own path, through an explicit observation operator.
//!
//! # In reading order
//!
//! `samples`: readings beside the state of the drone above, and their medians per grid cell.
//! `jet_fit`: what a probe reads of a jet, and the three constants that fit best. `spread`: how far
//! to trust them. `goodness`: whether one jet describes it all, and where not. `profiles` and
//! `residual_tests`: the paper's figures and its table. `calibration`: what comes of it.
//!
//! # How good the intervals are
//!
//! Measured (`cargo bench -p leeward-validation --bench coverage`) on synthetic flights of the
//! paper's four drones without cant, 1000 repeats: with four flights a drone the intervals of `B`,
//! `S` and `s₀` hold the truth in 94.6, 95.4 and 94.8 % of cases, and 1 % of the fits are called
//! poor. A plain percentile bootstrap by flight, tried beside, held it in 90.4, 91.2 and 91.3 %,
//! which is why it is not used. With one flight a drone (blocks of time, 300 repeats): 96.0, 96.3
//! and 96.0 %. Of 600 campaigns in a jet of another shape (Gaussian, Gaussian tail, top hat) all
//! 600 are called poor.

mod calibration;
mod goodness;
mod jet_fit;
mod profiles;
mod residual_tests;
mod samples;
mod spread;

use airflow::Jet;
use nalgebra::Matrix3;

pub use calibration::*;
use goodness::goodness;
use jet_fit::{Constants, Data, Joint, fit_jet, flights_of};
use profiles::{Measured, lobes, profiles};
use residual_tests::{departures, residual_tests};
use samples::{Cell, Gathered, cells, gather};
use spread::{Spread, Units, spread, units};

use crate::record::recording::Recording;

/// How to calibrate. The default follows the paper wherever the paper says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Readings count while the drone is slower than this (m/s); the paper's 0.1.
    pub slower_than_mps: f64,
    /// Depth of a grid cell over the motor distance. Chosen here: the centreline changes by 3 %
    /// over it at 2.5 l.
    pub cell_s_over_l: f64,
    /// Width of a grid cell over the motor distance. Chosen here: a sixth of the half-width at 2.5
    /// l.
    pub cell_r_over_l: f64,
    /// Thickness of a slice of depth over the motor distance, for profiles. Chosen here: the jet
    /// widens by 12 % over it at 2.5 l.
    pub slice_s_over_l: f64,
    /// Standard deviation of each lateral speed over the local mean, which a magnitude probe reads
    /// in quadrature. 0, the default: the fitted jet is what such a probe reads. Assumed here,
    /// because round jets have about 0.2 on the axis (Panchapakesan & Lumley 1993, J. Fluid Mech.
    /// 246:197), which would lower `B` by 4 %.
    pub lateral_turbulence: f64,
    /// Bootstrap draws.
    pub draws: usize,
    /// Fewest flights in the fit that are resampled as wholes; with fewer, blocks of time are.
    /// Chosen here: below eight the interval of a mean of flights is already a fifth wider by
    /// Student's t alone.
    pub fewest_flights: usize,
    /// Seed of the draws.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            slower_than_mps: 0.1,
            cell_s_over_l: 0.25,
            cell_r_over_l: 0.1,
            slice_s_over_l: 1.0,
            lateral_turbulence: 0.0,
            draws: 1999,
            fewest_flights: 8,
            seed: 0,
        }
    }
}

/// Fewest cells that three constants, a gain and a zero are fitted to.
const FEWEST_CELLS: usize = 12;
/// Why recordings cannot be calibrated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrateError {
    /// No recording has a probe.
    #[error("none of the {0} recordings has readings of a speed probe")]
    NoProbe(usize),
    /// Nothing, or next to nothing, is left to fit.
    #[error(
        "only {} grid cells below uncanted drones from 2.5 motor distances down, at least {FEWEST_CELLS} are needed{}",
        .0.cells, most_dropped(.0)
    )]
    TooFew(Box<Counts>),
    /// The readings do not determine all three constants.
    #[error(
        "the readings do not determine B, S and s0 together: they need several depths, the axis and the edge"
    )]
    Undetermined,
    /// The search for the best constants did not end.
    #[error(
        "the fit did not converge; at B = {centreline:.3}, S = {spreading:.4}, s0 = {origin:.2} it gave up"
    )]
    NotConverged {
        /// `B` where it stopped.
        centreline: f64,
        /// `S` where it stopped.
        spreading: f64,
        /// `s₀` where it stopped.
        origin: f64,
    },
}

fn most_dropped(counts: &Counts) -> String {
    counts.dropped.first().map_or(String::new(), |dropped| {
        format!(
            "; {} of {} readings were left out as {:?}",
            dropped.samples, counts.read, dropped.reason
        )
    })
}

/// Calibrates the jet from recordings of drones that hover over speed probes.
///
/// A flight is one emitter of one recording. Recordings without a probe are passed over.
/// Deterministic: the same recordings and options give the same numbers.
///
/// ```
/// use diagnosis::calibrate::{Options, calibrate};
/// use diagnosis::record::recording::Recording;
///
/// fn spreading_interval(flights: &[Recording]) -> Option<(f64, f64)> {
///     let calibration = calibrate(flights, &Options::default()).ok()?;
///     let interval = calibration.jet.spreading.interval;
///     Some((interval.low, interval.high))
/// }
/// // No reading, no jet.
/// assert_eq!(spreading_interval(&[]), None);
/// ```
///
/// # Errors
/// Where there is nothing to fit, or not enough to tell the three constants apart.
pub fn calibrate(
    recordings: &[Recording],
    options: &Options,
) -> Result<Calibration, CalibrateError> {
    if recordings
        .iter()
        .all(|recording| recording.probes.is_none())
    {
        return Err(CalibrateError::NoProbe(recordings.len()));
    }
    let mut gathered = gather(recordings, options);
    let far_cells = cells(&mut gathered.far, options);
    let near_cells = cells(&mut gathered.near, options);
    let in_fit = |cell: &&Cell| {
        let drone = gathered.drones[gathered.flights[cell.flight].drone];
        !drone.airframe.fit_excludes()
    };
    let fitted_cells: Vec<Cell> = far_cells.iter().filter(in_fit).cloned().collect();
    gathered.counts.cells = fitted_cells.len();
    if fitted_cells.len() < FEWEST_CELLS {
        return Err(CalibrateError::TooFew(Box::new(gathered.counts)));
    }
    let data = Data {
        flights: &gathered.flights,
        samples: &gathered.far,
        cells: &fitted_cells,
    };
    let paper = Jet::default();
    let joint = fit_jet(
        data,
        Constants::new(paper.centreline, paper.spreading, paper.origin),
    );
    if !joint.converged {
        let [centreline, spreading, origin] = joint.constants.into();
        return Err(CalibrateError::NotConverged {
            centreline,
            spreading,
            origin,
        });
    }
    let units = units(data, &joint, options.fewest_flights).ok_or(CalibrateError::Undetermined)?;
    let spread = spread(&units).ok_or(CalibrateError::Undetermined)?;
    let jet = fitted_jet(&gathered, &fitted_cells, &joint, &units, &spread, options);
    let drones = (0..gathered.drones.len())
        .map(|drone| {
            let measured = |samples, cells| Measured {
                drone,
                flights: &gathered.flights,
                samples,
                cells,
            };
            let near = measured(&gathered.near, &near_cells);
            let far = measured(&gathered.far, &far_cells);
            drone_fit(&gathered, near, far, &joint.constants, options)
        })
        .collect();
    let mut names: Vec<String> = Vec::new();
    for flight in &gathered.flights {
        if !names.contains(&flight.recording) {
            names.push(flight.recording.clone());
        }
    }
    Ok(Calibration {
        goodness: goodness(data, &joint, options),
        residual_tests: residual_tests(data, &joint),
        caveats: caveats(&gathered, &jet),
        drones,
        jet,
        counts: gathered.counts,
        recordings: names,
    })
}

fn fitted_jet(
    gathered: &Gathered<'_>,
    cells: &[Cell],
    joint: &Joint,
    units: &Units,
    spread: &Spread,
    options: &Options,
) -> FittedJet {
    let estimate = |k: usize| Estimate {
        value: joint.constants[k],
        interval: spread.interval(k, joint.constants[k], 0.0),
    };
    let correlation = |i: usize, j: usize| {
        let c: &Matrix3<f64> = &spread.covariance;
        c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt()
    };
    let extra = units.common_gain[(0, 0)];
    FittedJet {
        centreline: estimate(0),
        spreading: estimate(1),
        origin: estimate(2),
        correlation: Correlation {
            centreline_spreading: correlation(0, 1),
            centreline_origin: correlation(0, 2),
            spreading_origin: correlation(1, 2),
        },
        resampling: Resampling {
            unit: units.unit,
            units: units.units.len(),
            draws: options.draws,
            block_s: units.block_s,
        },
        centreline_if_one_gain: spread.interval(0, joint.constants[0], extra),
        gains: flights_of(cells)
            .into_iter()
            .map(|flight| FlightGain {
                recording: gathered.flights[flight].recording.clone(),
                gain: joint.nuisances[flight][0],
                offset_mps: joint.nuisances[flight][1],
            })
            .collect(),
    }
}

fn drone_fit(
    gathered: &Gathered<'_>,
    near: Measured<'_>,
    far: Measured<'_>,
    constants: &Constants,
    options: &Options,
) -> DroneFit {
    let airframe = &gathered.drones[far.drone].airframe;
    let flights: Vec<usize> = (0..far.flights.len())
        .filter(|f| far.flights[*f].drone == far.drone)
        .collect();
    let speeds_mps: f64 = flights
        .iter()
        .map(|f| far.flights[*f].operator.induced_velocity_mps)
        .sum();
    let samples = |of: Measured<'_>| {
        of.samples
            .iter()
            .filter(|sample| of.flights[sample.flight].drone == of.drone)
            .count()
    };
    let (lobes, lobes_merge_s_over_l) = lobes(far.drone, far.flights, near.samples);
    DroneFit {
        airframe: airframe.name().to_owned(),
        in_fit: !airframe.fit_excludes(),
        induced_velocity_mps: speeds_mps / flights.len().max(1) as f64,
        motor_distance_m: airframe.motor_distance_m(),
        flights: flights.len(),
        samples: samples(near) + samples(far),
        profiles: profiles(near, far, constants, options),
        lobes,
        lobes_merge_s_over_l,
        departures: departures(far, constants),
    }
}

fn caveats(gathered: &Gathered<'_>, jet: &FittedJet) -> Vec<String> {
    let mut caveats = Vec::new();
    let Interval { low, high } = jet.centreline_if_one_gain;
    caveats.push(format!(
        "a gain of the probe that all flights share cannot be seen by drawing flights: if there was one within the stated \
         accuracy, B lies between {low:.2} and {high:.2}"
    ));
    if jet.resampling.unit == Unit::Block {
        caveats.push(format!(
            "there are too few flights to draw: intervals come from {} blocks of time, and the probe's stated accuracy is added",
            jet.resampling.units
        ));
    }
    let lengths: Vec<f64> = gathered
        .drones
        .iter()
        .filter(|drone| !drone.airframe.fit_excludes())
        .map(|drone| drone.airframe.propeller_diameter_m() / drone.airframe.motor_distance_m())
        .collect();
    let narrowest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
    let widest = lengths.iter().copied().fold(0.0, f64::max);
    if widest < 1.1 * narrowest {
        caveats.push(
            "all drones of the fit have nearly the same propeller diameter over motor distance: whether the jet goes with \
             U_H l or with U_H d cannot be told"
                .to_owned(),
        );
    }
    if gathered.ambient_added_again {
        caveats.push(
            "where the ambient speed had been subtracted from the readings it was added again: a magnitude probe reads the root \
             of the sum of squares"
                .to_owned(),
        );
    }
    if !jet.jet().problems().is_empty() {
        caveats.push(
            "these constants are no usable jet: the virtual origin lies below the rotors"
                .to_owned(),
        );
    }
    caveats
}
