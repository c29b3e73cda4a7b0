//! How well the force on a drone below another is predicted in flights that nothing was fitted to.
//!
//! The thrust map comes from free flight in some flights; the force is judged below other drones in
//! the others. Flights in the order of their names are dealt to the folds in turn, so every flight
//! is held out once, whole. Nothing of the air is fitted. The figure is
//!
//! ```text
//! R² = 1 - Σ (F - F_simulated)² / Σ (F - mean F)²          over all held-out rows together
//! ```

use std::ops::AddAssign;

use rayon::prelude::*;
use serde::Serialize;

use crate::forward::clock::{self, ClockOffset};
use crate::forward::flow::Flow;
use crate::forward::force::Force;
use crate::record::baseline::ReceiverAir;
use crate::record::recording::{Recording, Vehicle};
use crate::record::thrust_map::ThrustMap;
use crate::statistics::bootstrap::intervals_95;
use crate::thrust::free_flight::{Around, Trace};
use crate::thrust::identify::{FoldError, FoldMap, Options, deal, fold_maps};

/// Where forces are judged besides everywhere: how near (m) to the axis of a drone above ...
pub(crate) const UNDER_M: f64 = 0.35;
/// ... and how high above the floor (m). Chosen here.
pub(crate) const ABOVE_FLOOR_M: f64 = 0.3;
/// Draws with replacement. Chosen here: enough for two digits of a 95 % interval.
const DRAWS: usize = 400;
/// Rows below which nothing is said of a place. Chosen here: fewer make no mean.
pub(crate) const LEAST_ROWS: usize = 20;

/// What is held out, and which rows are judged.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceTest {
    /// Parts that the flights are dealt to; at least 2.
    pub folds: usize,
    /// A row counts where another drone is higher and horizontally closer than this (m) ...
    pub under_m: f64,
    /// ... and its own height above the floor is more than this (m).
    pub above_floor_m: f64,
    /// How the thrust map is identified.
    pub identify: Options,
}

impl Default for ForceTest {
    fn default() -> ForceTest {
        ForceTest {
            folds: 5,
            under_m: UNDER_M,
            above_floor_m: ABOVE_FLOOR_M,
            identify: Options::default(),
        }
    }
}

/// The answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ForceSkill {
    /// Held-out `R²`, air averaged over the rotor discs.
    pub r2_disc_mean: f64,
    /// Held-out `R²`, air at the centre of the rotor plane.
    pub r2_centre: f64,
    /// Rows judged.
    pub rows: usize,
    /// Of these, rows with a motor outside the range of the thrust map.
    pub rows_outside: usize,
    /// Flights that they come from.
    pub flights: usize,
    /// Parts that the flights were dealt to.
    pub folds: usize,
    /// The thrust maps of the flights outside each fold.
    pub maps: Vec<FoldMap>,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ForceTestError {
    /// Nothing is held out with fewer than two.
    #[error("{0} folds; at least 2 are needed to hold flights out")]
    Folds(usize),
    /// No vehicle logs all that a force needs.
    #[error("no vehicle logs specific force and what tells its thrust, or a ready force")]
    NoForce,
    /// A thrust map could not be identified.
    #[error(transparent)]
    Identify(#[from] FoldError),
    /// There is nothing to judge. It holds how close (m) the other drone had to be and how high (m)
    /// the row.
    #[error(
        "no row has another drone within {0} m horizontally above and is {1} m above the floor"
    )]
    NoRows(f64, f64),
}

/// The test over a set of flights. `clocks_s` gives, by recording and vehicle, what each clock is
/// ahead of the recording's (s); empty: nothing.
///
/// # Errors
/// Fewer than two folds, no vehicle that logs a force, too little free flight, or no row to judge.
pub fn held_out_force(
    recordings: &[Recording],
    clocks_s: &[Vec<f64>],
    test: &ForceTest,
) -> Result<ForceSkill, ForceTestError> {
    if test.folds < 2 {
        return Err(ForceTestError::Folds(test.folds));
    }
    let (by_name, fold_of) = deal(recordings, test.folds);
    let options = &test.identify;
    let traces = Trace::of_all(recordings, &by_name, test.under_m, options.low_pass);
    if traces.is_empty() {
        return Err(ForceTestError::NoForce);
    }
    let held: Vec<Option<usize>> = fold_of.iter().copied().map(Some).collect();
    let maps = fold_maps(&traces, &held, options)?;
    let sums: Vec<Option<(R2Sums, usize)>> = traces
        .par_iter()
        .map(|trace| {
            let map = FoldMap::of(&maps, fold_of[trace.recording], trace.of);
            let clocks_s = clocks_s.get(trace.recording).map_or(&[][..], Vec::as_slice);
            sums(&recordings[trace.recording], trace, clocks_s, map, test)
        })
        .collect();
    let mut total = R2Sums::default();
    let mut rows_outside = 0;
    let mut flights: Vec<usize> = Vec::new();
    for (trace, sums) in traces.iter().zip(sums) {
        let Some((sums, outside)) = sums.filter(|(sums, _)| sums.rows > 0.0) else {
            continue;
        };
        total += sums;
        rows_outside += outside;
        flights.push(trace.recording);
    }
    flights.dedup();
    if flights.is_empty() {
        return Err(ForceTestError::NoRows(test.under_m, test.above_floor_m));
    }
    let [r2_disc_mean, r2_centre] = total.r2();
    Ok(ForceSkill {
        r2_disc_mean,
        r2_centre,
        rows: total.rows as usize,
        rows_outside,
        flights: flights.len(),
        folds: test.folds,
        maps,
    })
}

/// Clock offsets of every recording, by recording and vehicle, with the thrust maps of the folds
/// that held it out: what [`held_out_force`] takes once more. The force that tells them is the one
/// that is then judged, so state both figures.
#[must_use]
pub fn clock_offsets(
    recordings: &[Recording],
    skill: &ForceSkill,
    test: &ForceTest,
) -> Vec<Vec<ClockOffset>> {
    let (_, fold_of) = deal(recordings, skill.folds.max(1));
    let one = |(recording, &fold): (&Recording, &usize)| {
        let map = |of: &Vehicle| FoldMap::of(&skill.maps, fold, of);
        let maps: Vec<Option<&ThrustMap>> = recording.vehicles.iter().map(map).collect();
        clock::offsets(recording, &maps, test.identify.low_pass)
    };
    recordings.par_iter().zip(&fold_of).map(one).collect()
}

/// Sums over the rows of one vehicle in one flight, and how many have a motor outside the range of
/// the thrust map.
fn sums(
    recording: &Recording,
    trace: &Trace,
    clocks_s: &[f64],
    map: Option<&ThrustMap>,
    test: &ForceTest,
) -> Option<(R2Sums, usize)> {
    let force = Force::of(recording, trace, map, test.identify.low_pass)?;
    let mut flow = Flow::new(recording);
    for (vehicle, &clock_s) in clocks_s.iter().enumerate() {
        flow.set_clock_offset(vehicle, clock_s);
    }
    let own_clock_s = clocks_s.get(trace.vehicle).copied().unwrap_or(0.0);
    let [disc_mean_n, centre_n] = [ReceiverAir::DiscMean, ReceiverAir::Centre]
        .map(|air| force.simulated_n(&force.air_mps(&flow, air, own_clock_s)));
    let track = &trace.of.track;
    let floor_z_m = recording.environment.floor_z_m.unwrap_or(0.0);
    let (mut sums, mut outside) = (R2Sums::default(), 0);
    for (row, &recorded_n) in force.recorded_n.iter().enumerate() {
        let high = track.position_m[row].z - floor_z_m > test.above_floor_m;
        let simulated_n = [disc_mean_n[row], centre_n[row]];
        let all = recorded_n + simulated_n[0] + simulated_n[1];
        if trace.around[row] != Around::Below || !high || !all.is_finite() {
            continue;
        }
        sums.add(recorded_n, simulated_n);
        outside += usize::from(map.is_some_and(|map| !trace.is_covered(map, row)));
    }
    Some((sums, outside))
}

/// Sums over rows from which the `R²` of two predictions follow; those of several flights add up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct R2Sums {
    pub(crate) rows: f64,
    /// `Σ F`, `F` as recorded.
    recorded: f64,
    /// `Σ F²`.
    square: f64,
    /// `Σ (F - F_predicted)²` of each prediction.
    left: [f64; 2],
}

impl R2Sums {
    /// Counts one row, as recorded and as predicted twice.
    pub(crate) fn add(&mut self, recorded: f64, predicted: [f64; 2]) {
        *self += R2Sums {
            rows: 1.0,
            recorded,
            square: recorded * recorded,
            left: predicted.map(|predicted| (recorded - predicted).powi(2)),
        };
    }

    /// `R²` of each prediction against the mean of these rows; not a number without rows.
    pub(crate) fn r2(&self) -> [f64; 2] {
        let spread = self.square - self.recorded * self.recorded / self.rows;
        self.left.map(|left| 1.0 - left / spread)
    }

    /// Root mean square of what each prediction leaves.
    pub(crate) fn rms(&self) -> [f64; 2] {
        self.left.map(|left| (left / self.rows).sqrt())
    }
}

/// What sums of some units (flights, blocks) say together; intervals are 95 % over units: lower
/// end, value, upper end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct R2Figures {
    /// Rows of all units.
    pub(crate) rows: usize,
    /// Root mean square of what the first prediction leaves, and the second.
    pub(crate) rms: (f64, [f64; 3]),
    /// `R²` of the first prediction, and of the second.
    pub(crate) r2: (f64, [f64; 3]),
    /// Second less first.
    pub(crate) r2_gained: [f64; 3],
}

impl R2Figures {
    /// `None` below [`LEAST_ROWS`].
    pub(crate) fn over(units: &[R2Sums]) -> Option<R2Figures> {
        let together = |picked: &mut dyn Iterator<Item = &R2Sums>| {
            let mut sums = R2Sums::default();
            picked.for_each(|unit| sums += *unit);
            sums
        };
        let total = together(&mut units.iter());
        let rows = total.rows as usize;
        if rows < LEAST_ROWS {
            return None;
        }
        let figures = |sums: R2Sums| {
            let ([before, after], [_, rms_after]) = (sums.r2(), sums.rms());
            [after, after - before, rms_after]
        };
        let ends = intervals_95(units.len(), DRAWS, rows as u64, |picked| {
            figures(together(&mut picked.iter().map(|&unit| &units[unit])))
        });
        let values = figures(total);
        let interval = |which: usize| [ends[which][0], values[which], ends[which][1]];
        Some(R2Figures {
            rows,
            rms: (total.rms()[0], interval(2)),
            r2: (total.r2()[0], interval(0)),
            r2_gained: interval(1),
        })
    }
}

impl AddAssign for R2Sums {
    fn add_assign(&mut self, more: R2Sums) {
        self.rows += more.rows;
        self.recorded += more.recorded;
        self.square += more.square;
        self.left = [0, 1].map(|at| self.left[at] + more.left[at]);
    }
}
