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
use crate::thrust::free_flight::{Around, Trace};
use crate::thrust::identify::{Identification, IdentifyError, Options, deal, fold_maps};

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
            under_m: 0.35,
            above_floor_m: 0.3,
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
    /// Flights that they come from.
    pub flights: usize,
    /// In the order of the folds.
    pub folds: Vec<ForceFold>,
    /// In the order of the recordings' names; those without a row have none here either.
    pub by_recording: Vec<RecordingForce>,
}

/// One fold.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ForceFold {
    /// Over the flights held out.
    pub sums: ForceSums,
    /// The thrust maps of the other flights, by airframe.
    pub maps: Vec<(String, Identification)>,
}

/// One recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordingForce {
    /// Its name.
    pub name: String,
    /// Which fold held it out.
    pub fold: usize,
    /// Over its rows.
    pub sums: ForceSums,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ForceTestError {
    /// Nothing is held out with fewer than two.
    #[error("{0} folds; at least 2 are needed to hold flights out")]
    Folds(usize),
    /// No vehicle logs all that a force needs.
    #[error("no vehicle logs specific force, duty cycle and battery voltage")]
    NoForce,
    /// A thrust map could not be identified.
    #[error("thrust map of {airframe}, fold {fold}: {error}")]
    Identify {
        /// Name of the airframe.
        airframe: String,
        /// The fold held out.
        fold: usize,
        /// Why.
        error: IdentifyError,
    },
    /// There is nothing to judge.
    #[error(
        "no row has another drone within {under_m} m horizontally above and is {above_floor_m} m above the floor"
    )]
    NoRows {
        /// As tested.
        under_m: f64,
        /// As tested.
        above_floor_m: f64,
    },
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
    let around = (&options.free, test.under_m);
    let traces = Trace::of_all(recordings, &by_name, around, options.low_pass);
    if traces.is_empty() {
        return Err(ForceTestError::NoForce);
    }
    let held: Vec<Option<usize>> = fold_of.iter().copied().map(Some).collect();
    let maps = fold_maps(&traces, &held, options).map_err(|failed| ForceTestError::Identify {
        airframe: failed.airframe,
        fold: failed.fold,
        error: failed.found,
    })?;
    let mut folds: Vec<ForceFold> = Vec::new();
    folds.resize_with(test.folds, || ForceFold {
        sums: ForceSums::default(),
        maps: Vec::new(),
    });
    for map in maps {
        folds[map.fold].maps.push((map.airframe, map.found));
    }
    let sums: Vec<ForceSums> = traces
        .par_iter()
        .map(|trace| {
            let known = folds[fold_of[trace.recording]].map_of(trace.airframe());
            let clocks_s = clocks_s.get(trace.recording).map_or(&[][..], Vec::as_slice);
            known.map_or_else(ForceSums::default, |map| {
                sums(&recordings[trace.recording], trace, clocks_s, map, test)
            })
        })
        .collect();
    let mut by_recording: Vec<RecordingForce> = Vec::new();
    let mut total = ForceSums::default();
    for (trace, sums) in traces.iter().zip(sums) {
        if sums.rows == 0 {
            continue;
        }
        let (name, fold) = (&recordings[trace.recording].name, fold_of[trace.recording]);
        folds[fold].sums += sums;
        total += sums;
        match by_recording.last_mut() {
            Some(last) if last.name == *name => last.sums += sums,
            _ => by_recording.push(RecordingForce {
                name: name.clone(),
                fold,
                sums,
            }),
        }
    }
    if total.rows == 0 {
        return Err(ForceTestError::NoRows {
            under_m: test.under_m,
            above_floor_m: test.above_floor_m,
        });
    }
    Ok(ForceSkill {
        r2_disc_mean: total.r2(&total.disc_mean),
        r2_centre: total.r2(&total.centre),
        rows: total.rows,
        flights: by_recording.len(),
        folds,
        by_recording,
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
    let (_, fold_of) = deal(recordings, skill.folds.len().max(1));
    let one = |(recording, &fold): (&Recording, &usize)| {
        let map = |of: &Vehicle| skill.folds.get(fold)?.map_of(of.airframe.name());
        let maps: Vec<Option<&ThrustMap>> = recording.vehicles.iter().map(map).collect();
        clock::offsets(recording, &maps, test.identify.low_pass)
    };
    recordings.par_iter().zip(&fold_of).map(one).collect()
}

impl ForceFold {
    /// The thrust map of an airframe for the flights held out.
    fn map_of(&self, airframe: &str) -> Option<&ThrustMap> {
        let mut maps = self.maps.iter();
        let (_, known) = maps.find(|(known, _)| known == airframe)?;
        Some(&known.map)
    }
}

/// Sums over the rows of one vehicle in one flight.
fn sums(
    recording: &Recording,
    trace: &Trace,
    clocks_s: &[f64],
    map: &ThrustMap,
    test: &ForceTest,
) -> ForceSums {
    let mut sums = ForceSums::default();
    let Some(force) = Force::of(recording, trace, map, test.identify.low_pass) else {
        return sums;
    };
    let mut flow = Flow::new(recording);
    for (vehicle, &clock_s) in clocks_s.iter().enumerate() {
        flow.set_clock_offset(vehicle, clock_s);
    }
    let own_clock_s = clocks_s.get(trace.vehicle).copied().unwrap_or(0.0);
    let [disc_mean_n, centre_n] = [ReceiverAir::DiscMean, ReceiverAir::Centre]
        .map(|air| force.simulated_n(&force.air_mps(&flow, air, own_clock_s)));
    let track = &trace.of.track;
    let floor_z_m = recording.environment.floor_z_m.unwrap_or(0.0);
    for (row, &recorded_n) in force.recorded_n.iter().enumerate() {
        let high = track.position_m[row].z - floor_z_m > test.above_floor_m;
        let all = recorded_n + disc_mean_n[row] + centre_n[row];
        if trace.around[row] != Around::Below || !high || !all.is_finite() {
            continue;
        }
        sums.rows += 1;
        let duty = track.duty.as_ref().map(|duty| duty[row]);
        sums.rows_outside += usize::from(duty.is_some_and(|duty| !map.covers(duty)));
        sums.recorded_n += recorded_n;
        sums.recorded_n2 += recorded_n * recorded_n;
        sums.disc_mean.add(recorded_n, disc_mean_n[row]);
        sums.centre.add(recorded_n, centre_n[row]);
    }
    sums
}

/// Sums over rows from which the figures follow; those of several flights add up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ForceSums {
    /// Rows.
    pub rows: usize,
    /// Of these, rows with a motor outside the range of the thrust map.
    pub rows_outside: usize,
    /// `Σ F` (N).
    pub recorded_n: f64,
    /// `Σ F²` (N²).
    pub recorded_n2: f64,
    /// With the air met as mean over the rotor discs.
    pub disc_mean: AgainstSimulated,
    /// With that at the rotor plane's centre.
    pub centre: AgainstSimulated,
}

/// Sums of recorded against simulated force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct AgainstSimulated {
    /// `Σ (F - F_simulated)²` (N²).
    pub left_n2: f64,
    /// `Σ (F - F_simulated)` (N).
    pub left_n: f64,
    /// `Σ F F_simulated` (N²).
    pub product_n2: f64,
    /// `Σ F_simulated²` (N²).
    pub simulated_n2: f64,
}

impl AgainstSimulated {
    fn add(&mut self, recorded_n: f64, simulated_n: f64) {
        let left_n = recorded_n - simulated_n;
        self.left_n2 += left_n * left_n;
        self.left_n += left_n;
        self.product_n2 += recorded_n * simulated_n;
        self.simulated_n2 += simulated_n * simulated_n;
    }
}

impl AddAssign for AgainstSimulated {
    fn add_assign(&mut self, more: AgainstSimulated) {
        self.left_n2 += more.left_n2;
        self.left_n += more.left_n;
        self.product_n2 += more.product_n2;
        self.simulated_n2 += more.simulated_n2;
    }
}

impl AddAssign for ForceSums {
    fn add_assign(&mut self, more: ForceSums) {
        self.rows += more.rows;
        self.rows_outside += more.rows_outside;
        self.recorded_n += more.recorded_n;
        self.recorded_n2 += more.recorded_n2;
        self.disc_mean += more.disc_mean;
        self.centre += more.centre;
    }
}

impl ForceSums {
    /// `R²` against the mean of these rows; not a number without rows.
    #[must_use]
    pub fn r2(&self, against: &AgainstSimulated) -> f64 {
        let spread_n2 = self.recorded_n2 - self.recorded_n * self.recorded_n / self.rows as f64;
        1.0 - against.left_n2 / spread_n2
    }
}
