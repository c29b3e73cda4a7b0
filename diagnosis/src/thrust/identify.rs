//! The thrust map of a kind of drone, by least squares over its free flight: coefficients, lag,
//! scatter, and how well they are known.
//!
//! Thrust is linear in the coefficients, and stays so through lag and low-pass; the lag itself is
//! searched for. Every drone has a factor of its own in each flight, which are 1 on the average:
//! drones of one airframe differ by some percent, and so do sessions; taken for one they would be
//! errors in the duty cycles, and flatten the map. Rows of one flight are anything but independent,
//! so standard errors are clustered by flight: with `X` the terms' values and `e` what is left,
//!
//! ```text
//! cov = F/(F-1) · (XᵀX)⁻¹ ( Σ_flights Xᵀe eᵀX ) (XᵀX)⁻¹           F flights
//! ```

use std::collections::BTreeSet;

use nalgebra::DMatrix;
use rayon::prelude::*;
use serde::Serialize;

use crate::record::recording::{Recording, Vehicle};
use crate::record::thrust_map::{
    CUBIC_FROM_ZERO, FACTOR, FULL_CELL_V, OFFSET, SQUARE, Term, ThrustMap, ThrustMapError,
};
use crate::record::track::ThrustSource;
use crate::statistics::quantile::nearest_rank;
use crate::thrust::free_flight::Trace;
use crate::thrust::least_squares::{Solved, lag_standard_error_s};
use crate::thrust::low_pass::LowPass;

/// Step of the search for the lag (s). Chosen here: the square error is smooth in the lag on this
/// scale, and the vertex of the parabola through the best three is taken.
const LAG_STEP_S: f64 = 0.01;

/// Half the step of the differences that the lag's standard error is worked out from (s). Chosen
/// here: half that of the search.
const HALF_STEP_S: f64 = 0.5 * LAG_STEP_S;

/// Share of the duty cycles that is left outside the fitted range, half at each end. Chosen here:
/// the few that lie beyond say nothing.
const OUTSIDE_SHARE: f64 = 0.01;

/// Rows below which nothing is identified, for each term. Chosen here.
const ROWS_PER_TERM: usize = 20;

/// Forces are compared below this frequency. Chosen here: motors and frames shake above it, wakes
/// are met more slowly.
pub const LOW_PASS: LowPass = LowPass { cutoff_hz: 5.0 };

/// How a thrust map is identified.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// What is fitted.
    pub terms: Vec<Term>,
    /// What the fitted terms are added to: a published map, when only an offset is to be found.
    pub base: Option<ThrustMap>,
    /// The rotors' lag.
    pub lag: Lag,
    /// Applied to specific force and thrust alike, so that what is left is what the low-pass leaves
    /// of the difference.
    pub low_pass: LowPass,
}

/// How the lag of a thrust map is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lag {
    /// It is known (s).
    Fixed(f64),
    /// The one that leaves least, between 0 and this (s).
    UpTo(f64),
}

impl Default for Options {
    fn default() -> Options {
        Options {
            terms: CUBIC_FROM_ZERO.to_vec(),
            base: None,
            lag: Lag::UpTo(0.15),
            low_pass: LOW_PASS,
        }
    }
}

impl Options {
    /// Of a map that is stated nothing but an offset is found.
    #[must_use]
    pub fn on(self, stated: &ThrustMap) -> Options {
        Options {
            terms: OFFSET.to_vec(),
            lag: Lag::Fixed(stated.lag_s()),
            base: Some(stated.clone()),
            ..self
        }
    }

    /// With the terms that suit the thrust source; those of the options, and their base, are of
    /// duty cycles.
    fn of(&self, source: ThrustSource) -> Options {
        let terms = match source {
            ThrustSource::DutyCycle => return self.clone(),
            ThrustSource::RotorSpeed => SQUARE.to_vec(),
            ThrustSource::Thrust | ThrustSource::ReadyForce => FACTOR.to_vec(),
        };
        Options {
            terms,
            base: None,
            ..self.clone()
        }
    }
}

/// A thrust map, and what is known about it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Identification {
    /// The map.
    pub map: ThrustMap,
    /// Standard errors of the fitted terms (N), clustered by flight, in the order of
    /// [`Options::terms`]; none with one flight.
    pub standard_errors_n: Option<Vec<f64>>,
    /// Standard error of the lag (s), clustered by flight; none where the lag was given or lies at
    /// an end of its search.
    pub lag_standard_error_s: Option<f64>,
    /// Root mean square of what is left (N).
    pub scatter_n: f64,
    /// Thrust (N) that the map gives at zero duty.
    pub offset_n: f64,
    /// Relative change of thrust per volt (1/V) at the median duty cycle and voltage.
    pub battery_per_v: f64,
    /// Least and largest battery voltage (V) met.
    pub battery_range_v: [f64; 2],
    /// Rows fitted.
    pub rows: usize,
    /// Of these, rows with a motor outside the range of the map.
    pub rows_outside: usize,
    /// Flights that they come from.
    pub flights: usize,
}

impl Identification {
    /// A map that is stated, where too little is flown to find anything of it.
    fn stated(map: &ThrustMap) -> Identification {
        Identification {
            standard_errors_n: None,
            lag_standard_error_s: None,
            scatter_n: f64::NAN,
            offset_n: map.offset_n(),
            battery_per_v: f64::NAN,
            battery_range_v: [f64::NAN; 2],
            rows: 0,
            rows_outside: 0,
            flights: 0,
            map: map.clone(),
        }
    }
}

/// Why no thrust map could be identified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// Too little free flight.
    #[error(
        "{rows} rows with no drone above and away from the floor; {needed} are needed to identify {terms} terms"
    )]
    TooFewRows {
        /// What there is.
        rows: usize,
        /// What there should be.
        needed: usize,
        /// Terms to be fitted.
        terms: usize,
    },
    /// No flight but those that it is to be judged on.
    #[error(
        "one flight alone; a thrust map is identified in other flights than those it is judged on"
    )]
    NoOtherFlight,
    /// Terms that these rows cannot tell apart.
    #[error(
        "the rows do not tell the {0} terms of the thrust map apart; fit fewer, or fly more varied"
    )]
    Degenerate(usize),
    /// The fitted numbers make no map.
    #[error(transparent)]
    Map(#[from] ThrustMapError),
}

/// Identifies one thrust map for the given vehicles, each `(recording, vehicle)` by index. Those
/// that lack specific force or a thrust source, or whose source is another than the first one's,
/// are passed over; they have no rows in the result.
///
/// # Errors
/// Too few rows, terms that cannot be told apart, or numbers that make no map.
pub fn identify(
    recordings: &[Recording],
    vehicles: &[(usize, usize)],
    options: &Options,
) -> Result<Identification, IdentifyError> {
    let mut traces = Trace::of_each(recordings, vehicles.to_vec(), 0.0, options.low_pass);
    let source = traces.first().map(|trace| trace.source);
    traces.retain(|trace| Some(trace.source) == source);
    Bench::new(traces.iter().collect(), options).fit(|_| true)
}

/// Recordings in the order of their names, and the fold that each is dealt to in turn.
pub(crate) fn deal(recordings: &[Recording], folds: usize) -> (Vec<usize>, Vec<usize>) {
    let mut by_name: Vec<usize> = (0..recordings.len()).collect();
    by_name.sort_by(|&a, &b| recordings[a].name.cmp(&recordings[b].name));
    let mut fold_of = vec![0; recordings.len()];
    for (place, &recording) in by_name.iter().enumerate() {
        fold_of[recording] = place % folds;
    }
    (by_name, fold_of)
}

/// The thrust map of one airframe for the flights of one fold, identified in the flights of the
/// others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoldMap {
    /// Name of the airframe.
    pub airframe: String,
    /// What it takes.
    pub source: ThrustSource,
    /// The fold held out.
    pub fold: usize,
    /// What was identified.
    #[serde(flatten)]
    pub found: Identification,
}

impl FoldMap {
    /// That of a vehicle for a fold; `None` where it has none, or needs none.
    pub(crate) fn of<'m>(
        maps: &'m [FoldMap],
        fold: usize,
        vehicle: &Vehicle,
    ) -> Option<&'m ThrustMap> {
        let (airframe, source) = (vehicle.airframe.name(), vehicle.track.thrust_source()?);
        let is_its = |map: &&FoldMap| map.airframe == airframe && map.source == source;
        let one = maps.iter().find(|map| map.fold == fold && is_its(map))?;
        Some(&one.found.map)
    }
}

/// Why there is no thrust map of one airframe for one fold.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("thrust map of {airframe}, fold {fold}: {error}")]
pub struct FoldError {
    /// Name of the airframe.
    pub airframe: String,
    /// The fold held out.
    pub fold: usize,
    /// Why.
    pub error: IdentifyError,
}

/// A thrust map for every airframe, thrust source, and fold that holds a flight of it out,
/// airframes by name. Ready forces need none. Of duty cycles one that the metadata state is kept
/// but for an offset, and as it is where that cannot be found.
/// `fold_of` gives the fold of each recording; one without is never held out.
///
/// # Errors
/// The first map that cannot be identified.
pub(crate) fn fold_maps(
    traces: &[Trace],
    fold_of: &[Option<usize>],
    options: &Options,
) -> Result<Vec<FoldMap>, FoldError> {
    let needs_one = |trace: &&Trace| trace.source != ThrustSource::ReadyForce;
    let kind = |trace: &Trace<'_>| (trace.airframe().to_owned(), trace.source);
    let kinds: BTreeSet<_> = traces.iter().filter(needs_one).map(kind).collect();
    let mut maps = Vec::new();
    for (airframe, source) in &kinds {
        let is_own = |trace: &&Trace| trace.airframe() == airframe && trace.source == *source;
        let own = || traces.iter().filter(is_own);
        let folds: BTreeSet<usize> = own().filter_map(|of| fold_of[of.recording]).collect();
        let is_of_duty = *source == ThrustSource::DutyCycle;
        let stated = own().find_map(|of| of.of.thrust_map.as_ref().filter(|_| is_of_duty));
        let options = match stated {
            Some(map) => options.clone().on(map),
            None => options.clone(),
        };
        let bench = Bench::new(own().collect(), &options);
        for fold in folds {
            let is_other = |recording: usize| fold_of[recording] != Some(fold);
            let found = match own().any(|trace| is_other(trace.recording)) {
                true => bench.fit(is_other),
                false => Err(IdentifyError::NoOtherFlight),
            };
            let found = found.or_else(|error| stated.map(Identification::stated).ok_or(error));
            let failed = |error| FoldError {
                airframe: airframe.clone(),
                fold,
                error,
            };
            maps.push(FoldMap {
                airframe: airframe.clone(),
                source: *source,
                fold,
                found: found.map_err(failed)?,
            });
        }
    }
    Ok(maps)
}

/// Free flights with the sums that fits need, at every lag of the search: many fits over different
/// flights cost little more than one.
struct Bench<'a> {
    traces: Vec<&'a Trace<'a>>,
    options: Options,
    lags_s: Vec<f64>,
    /// By lag, then by trace.
    grams: Vec<Vec<DMatrix<f64>>>,
}

impl<'a> Bench<'a> {
    fn new(traces: Vec<&'a Trace<'a>>, options: &Options) -> Bench<'a> {
        let source = traces.first().map(|trace| trace.source);
        let options = options.of(source.unwrap_or(ThrustSource::DutyCycle));
        let lags_s: Vec<f64> = match options.lag {
            Lag::Fixed(lag_s) => vec![lag_s],
            Lag::UpTo(most_s) => {
                let steps = (most_s / LAG_STEP_S).round().max(2.0) as u32;
                (0..=steps).map(|i| f64::from(i) * LAG_STEP_S).collect()
            }
        };
        let all: Vec<usize> = (0..traces.len()).collect();
        let mut bench = Bench {
            traces,
            options,
            lags_s,
            grams: Vec::new(),
        };
        let lags_s = bench.lags_s.iter();
        bench.grams = lags_s.map(|&lag_s| bench.grams_at(lag_s, &all)).collect();
        bench
    }

    fn reference_v(&self) -> f64 {
        let base = self.options.base.as_ref();
        base.map_or(FULL_CELL_V, ThrustMap::battery_reference_v)
    }

    fn grams_at(&self, lag_s: f64, members: &[usize]) -> Vec<DMatrix<f64>> {
        let options = &self.options;
        let base = (options.base.as_ref(), self.reference_v());
        let gram = |&member: &usize| {
            self.traces[member].gram(&options.terms, base, lag_s, options.low_pass)
        };
        members.par_iter().map(gram).collect()
    }

    /// The map of the flights whose recording is to be used.
    fn fit(&self, used: impl Fn(usize) -> bool) -> Result<Identification, IdentifyError> {
        let is_used = |&member: &usize| used(self.traces[member].recording);
        let members: Vec<usize> = (0..self.traces.len()).filter(is_used).collect();
        let terms = self.options.terms.len();
        let rows_of = |&member: &usize| self.traces[member].free_rows().count();
        let rows: usize = members.iter().map(rows_of).sum();
        let needed = ROWS_PER_TERM * terms.max(1);
        if rows < needed {
            return Err(IdentifyError::TooFewRows {
                rows,
                needed,
                terms,
            });
        }
        let degenerate = || IdentifyError::Degenerate(terms);
        let free_s = members.iter().map(|&member| self.traces[member].free_s());
        let free_s: Vec<f64> = free_s.collect();
        let is_whole = self.options.base.is_none();
        let solve = |grams: &[&DMatrix<f64>]| match is_whole {
            true => Solved::scaled(grams, &free_s, terms),
            false => Solved::new(grams, terms),
        };
        let square_n2 = |grams: &Vec<DMatrix<f64>>| {
            let of_members: Vec<_> = members.iter().map(|&member| &grams[member]).collect();
            Some(solve(&of_members)?.square_n2)
        };
        let squares: Option<Vec<f64>> = self.grams.iter().map(square_n2).collect();
        let squares = squares.ok_or_else(degenerate)?;
        let order = |&a: &usize, &b: &usize| squares[a].total_cmp(&squares[b]);
        let best = (0..squares.len()).min_by(order).unwrap_or(0);
        let inside = best > 0 && best + 1 < squares.len();
        let lag_s = match inside {
            true => self.lags_s[best] + LAG_STEP_S * vertex(&squares[best - 1..=best + 1]),
            false => self.lags_s[best],
        };
        let grams = self.grams_at(lag_s, &members);
        let solved = solve(&grams.iter().collect::<Vec<_>>()).ok_or_else(degenerate)?;
        let flights = self.clusters(&members);
        let of_lag = || {
            let [before, after] =
                [-HALF_STEP_S, HALF_STEP_S].map(|shift_s| self.grams_at(lag_s + shift_s, &members));
            let square_n2 =
                |grams: &[DMatrix<f64>]| Some(solve(&grams.iter().collect::<Vec<_>>())?.square_n2);
            let squares_n2 = [square_n2(&before)?, square_n2(&after)?];
            let both = [&before[..], &after[..]];
            lag_standard_error_s(&solved, both, squares_n2, &flights, HALF_STEP_S)
        };
        let lag_standard_error_s = inside.then(of_lag).flatten();
        let used = || members.iter().map(|&member| self.traces[member]);
        let free = || used().flat_map(Trace::free_duty);
        let mut duties: Vec<f64> = free().flat_map(|(duty, _)| duty).collect();
        let mut batteries_v: Vec<f64> = free().map(|(_, battery_v)| battery_v).collect();
        duties.sort_unstable_by(f64::total_cmp);
        batteries_v.sort_unstable_by(f64::total_cmp);
        let quantile = |sorted: &[f64], p: f64| nearest_rank(sorted, p).unwrap_or(f64::NAN);
        let fitted = [0.5 * OUTSIDE_SHARE, 1.0 - 0.5 * OUTSIDE_SHARE].map(|p| quantile(&duties, p));
        let base = self.options.base.as_ref();
        let mut sum: Vec<(Term, f64)> = base.iter().flat_map(|base| base.terms()).collect();
        for (&term, &newtons) in self.options.terms.iter().zip(solved.newtons.iter()) {
            match sum.iter_mut().find(|(known, _)| *known == term) {
                Some((_, sum_n)) => *sum_n += newtons,
                None => sum.push((term, newtons)),
            }
        }
        let range = base.map_or(fitted, ThrustMap::duty_range);
        let map = ThrustMap::new(sum, self.reference_v(), lag_s, range)?;
        let (middle_duty, middle_v) = (quantile(&duties, 0.5), quantile(&batteries_v, 0.5));
        Ok(Identification {
            standard_errors_n: solved.standard_errors(&grams, &flights),
            lag_standard_error_s,
            scatter_n: (solved.square_n2.max(0.0) / batteries_v.len() as f64).sqrt(),
            offset_n: map.offset_n(),
            battery_per_v: map.battery_sensitivity_per_v(middle_duty, middle_v),
            battery_range_v: [quantile(&batteries_v, 0.0), quantile(&batteries_v, 1.0)],
            rows: batteries_v.len(),
            rows_outside: free().filter(|&(duty, _)| !map.covers(duty)).count(),
            flights: flights.iter().max().map_or(0, |last| last + 1),
            map,
        })
    }

    /// Which flight each member belongs to: recordings in order, counted from 0.
    fn clusters(&self, members: &[usize]) -> Vec<usize> {
        let of = |&member: &usize| self.traces[member].recording;
        let all: BTreeSet<usize> = members.iter().map(of).collect();
        let place = |member: &usize| all.range(..of(member)).count();
        members.iter().map(place).collect()
    }
}

/// Where a parabola through three equally spaced values is least, in steps from the middle one.
fn vertex(values: &[f64]) -> f64 {
    let (fall, rise) = (values[0] - values[1], values[2] - values[1]);
    0.5 * (fall - rise) / (fall + rise)
}
