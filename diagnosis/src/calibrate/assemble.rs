//! From recordings to a calibration: gathered, fitted, judged, and put together.

use airflow::Jet;

use super::calibration::{
    Calibration, Correlation, Counts, DroneFit, Estimate, FittedJet, FlightGain, Interval, Options,
    Resampling, Unit,
};
use super::goodness::goodness;
use super::jet_fit::{Constants, Data, Joint, fit_jet};
use super::profiles::{Measured, lobes, profiles};
use super::residual_tests::{departures, residual_tests};
use super::samples::{Cell, Gathered, ProbedFlight, cells, flights_of, gather};
use super::spread::{Spread, Units, spread, units};

use crate::record::recording::Recording;
use crate::statistics::quantile::mean;

/// Fewest cells that three constants, a gain and a zero are fitted to.
const FEWEST_CELLS: usize = 12;
/// Fewest flights in the fit that are resampled as wholes; with fewer, blocks of time are. Chosen
/// here: below eight the interval of a mean of flights is already a fifth wider by Student's t
/// alone.
const FEWEST_FLIGHTS: usize = 8;

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
    /// It holds `B`, `S` and `s₀` where it stopped.
    #[error(
        "the readings determine no jet: the fit runs away to {}; `plan diagnose` says how they differ from the paper's jet: is the probe's scale cut off, do all readings come from one place?",
        run_away(.0)
    )]
    NotConverged([f64; 3]),
}

/// The constants where a search stopped, in words.
fn run_away(constants: &[f64; 3]) -> String {
    let named = ["B", "S", "s0"].iter().zip(constants);
    let words = named.map(|(name, value)| match value.is_finite() {
        true => format!("{name} = {value:.3}"),
        false => format!("{name} beyond all bounds"),
    });
    words.collect::<Vec<_>>().join(", ")
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
    let mut gathered = gather(recordings, options.lateral_turbulence);
    let far_cells = cells(&mut gathered.far);
    let near_cells = cells(&mut gathered.near);
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
    let start = Constants::new(paper.centreline, paper.spreading, paper.origin);
    let joint = fit_jet(data, start);
    if !joint.converged {
        return Err(CalibrateError::NotConverged(joint.constants.into()));
    }
    let units = units(&joint, FEWEST_FLIGHTS).ok_or(CalibrateError::Undetermined)?;
    let spread = spread(&units).ok_or(CalibrateError::Undetermined)?;
    let jet = fitted_jet(&joint, &units, &spread);
    let of_drone = |drone: usize| {
        let measured = |samples, cells| Measured {
            drone,
            flights: &gathered.flights,
            samples,
            cells,
        };
        let near = measured(&gathered.near, &near_cells);
        let far = measured(&gathered.far, &far_cells);
        drone_fit(&gathered, near, far, &joint.constants)
    };
    let drones = (0..gathered.drones.len()).map(of_drone).collect();
    let flights = gathered.flights.iter();
    let mut names: Vec<String> = flights.map(|flight| flight.recording.clone()).collect();
    names.dedup();
    Ok(Calibration {
        goodness: goodness(&joint, options),
        residual_tests: residual_tests(&joint),
        caveats: caveats(&gathered, &jet),
        drones,
        jet,
        counts: gathered.counts,
        recordings: names,
    })
}

fn fitted_jet(joint: &Joint<'_>, units: &Units, spread: &Spread) -> FittedJet {
    let estimate = |k: usize| Estimate {
        value: joint.constants[k],
        interval: spread.interval(k, joint.constants[k], 0.0),
    };
    let c = &spread.covariance;
    let correlation = |i: usize, j: usize| c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt();
    let extra = units.common_gain[(0, 0)];
    let flights = flights_of(joint.data.cells);
    let gain = |flight: usize| FlightGain {
        recording: joint.data.flights[flight].recording.clone(),
        gain: joint.nuisances[flight][0],
        offset_mps: joint.nuisances[flight][1],
    };
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
            block_s: units.block_s,
        },
        centreline_if_one_gain: spread.interval(0, joint.constants[0], extra),
        gains: flights.into_iter().map(gain).collect(),
    }
}

fn drone_fit(
    gathered: &Gathered<'_>,
    near: Measured<'_>,
    far: Measured<'_>,
    constants: &Constants,
) -> DroneFit {
    let airframe = &gathered.drones[far.drone].airframe;
    let own = |flight: &ProbedFlight| (flight.drone == far.drone).then_some(flight.operator);
    let operators = far.flights.iter().filter_map(own);
    let speeds_mps: Vec<f64> = operators.map(|own| own.induced_velocity_mps).collect();
    let (lobes, lobes_merge_s_over_l) = lobes(near);
    DroneFit {
        airframe: airframe.name().to_owned(),
        in_fit: !airframe.fit_excludes(),
        induced_velocity_mps: mean(&speeds_mps),
        motor_distance_m: airframe.motor_distance_m(),
        flights: speeds_mps.len(),
        samples: near.of_drone().count() + far.of_drone().count(),
        profiles: profiles(near, far, constants),
        lobes,
        lobes_merge_s_over_l,
        departures: departures(far, constants),
    }
}

fn caveats(gathered: &Gathered<'_>, jet: &FittedJet) -> Vec<String> {
    let Interval { low, high } = jet.centreline_if_one_gain;
    let mut caveats = vec![format!(
        "a gain of the probe that all flights share cannot be seen by drawing flights: if there was one within the stated \
         accuracy, B lies between {low:.2} and {high:.2}"
    )];
    if jet.resampling.unit == Unit::Block {
        caveats.push(format!(
            "there are too few flights to draw: intervals come from {} blocks of time, and the probe's stated accuracy is added",
            jet.resampling.units
        ));
    }
    let airframes = gathered.drones.iter().map(|drone| &drone.airframe);
    let fitted = airframes.filter(|airframe| !airframe.fit_excludes());
    let lengths: Vec<f64> = fitted
        .map(|airframe| airframe.propeller_diameter_m() / airframe.motor_distance_m())
        .collect();
    let narrowest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
    let others = [
        (
            lengths.iter().all(|length| *length < 1.1 * narrowest),
            "all drones of the fit have nearly the same propeller diameter over motor distance: whether the jet goes with \
             U_H l or with U_H d cannot be told",
        ),
        (
            gathered.ambient_added_again,
            "where the ambient speed had been subtracted from the readings it was added again: a magnitude probe reads the root \
             of the sum of squares",
        ),
        (
            !jet.jet().problems().is_empty(),
            "these constants are no usable jet: the virtual origin lies below the rotors",
        ),
    ];
    let others = others.into_iter().filter(|(holds, _)| *holds);
    caveats.extend(others.map(|(_, caveat)| caveat.to_owned()));
    caveats
}
