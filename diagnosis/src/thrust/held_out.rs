//! How well the force on a drone below another is predicted in flights that nothing was fitted to.
//!
//! The thrust map, with nobody above, from some flights; the force, under somebody, in others. Flights in the order of their names are
//! dealt to the folds in turn, so every flight is held out once, whole. Nothing of the air is fitted. The figure is
//!
//! ```text
//! R² = 1 - Σ (F - F_simulated)² / Σ (F - mean F)²          over all held-out rows together
//! ```

use rayon::prelude::*;
use serde::Serialize;

use crate::forward::flow::Flow;
use crate::forward::force::{self, AirMet};
use crate::forward::force_sums::ForceSums;
use crate::record::recording::{Recording, Vehicle};
use crate::thrust::clock::{self, ClockOffset};
use crate::thrust::free_flight::{self, Around, Trace};
use crate::thrust::identify::{Bench, Identification, IdentifyError, Options};
use crate::thrust::thrust_map::ThrustMap;

/// What is held out, and which rows are judged.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceTest {
    /// Parts that the flights are dealt to; at least 2.
    pub folds: usize,
    /// A row counts where another drone is higher and horizontally closer than this (m) ...
    pub under_m: f64,
    /// ... and its own height above the floor is more than this (m).
    pub above_floor_m: f64,
    /// Which vehicles share a thrust map.
    pub share: Share,
    /// Ids of vehicles whose own force is not judged and serves no thrust map; their wakes still count.
    pub except: Vec<String>,
    /// How the thrust map is identified.
    pub identify: Options,
}

/// Which vehicles share a thrust map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// Those of one airframe: its name.
    Airframe,
    /// None: one for each id.
    Nobody,
}

impl Share {
    /// The name that a vehicle's thrust map goes by.
    pub(crate) fn group(self, of: &Vehicle) -> &str {
        match self {
            Share::Airframe => of.airframe.name(),
            Share::Nobody => &of.id,
        }
    }
}

impl Default for ForceTest {
    fn default() -> ForceTest {
        ForceTest {
            folds: 5,
            under_m: 0.35,
            above_floor_m: 0.3,
            share: Share::Airframe,
            except: Vec::new(),
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
    /// The thrust maps of the other flights, by airframe or vehicle.
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
    #[error("thrust map of {group}, fold {fold}: {error}")]
    Identify {
        /// Airframe or vehicle.
        group: String,
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

/// A trace with the air that it meets.
struct Judged<'a> {
    trace: Trace<'a>,
    group: String,
    air: AirMet,
    hover_mps: f64,
}

/// The test over a set of flights. `clocks_s` gives, by recording and vehicle, what each clock is ahead of the recording's (s);
/// empty: nothing.
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
    let judged = prepare(recordings, clocks_s, &by_name, test);
    let mut groups: Vec<&str> = judged.iter().map(|judged| judged.group.as_str()).collect();
    groups.sort_unstable();
    groups.dedup();
    if groups.is_empty() {
        return Err(ForceTestError::NoForce);
    }
    let mut folds: Vec<ForceFold> = Vec::new();
    folds.resize_with(test.folds, || ForceFold {
        sums: ForceSums::default(),
        maps: Vec::new(),
    });
    for group in groups {
        let of_group = judged.iter().filter(|judged| judged.group == group);
        let bench = Bench::new(
            of_group.map(|judged| &judged.trace).collect(),
            &test.identify,
        );
        for (fold, into) in folds.iter_mut().enumerate() {
            let map = bench
                .fit(|recording| fold_of[recording] != fold)
                .map_err(|error| ForceTestError::Identify {
                    group: group.to_owned(),
                    fold,
                    error,
                })?;
            into.maps.push((group.to_owned(), map));
        }
    }
    let sums: Vec<ForceSums> = judged
        .par_iter()
        .map(|judged| {
            let recording = judged.trace.recording;
            let maps = &folds[fold_of[recording]].maps;
            let map = maps.iter().find(|(group, _)| *group == judged.group);
            map.map_or_else(ForceSums::default, |(_, map)| {
                sums(&recordings[recording], judged, map, test)
            })
        })
        .collect();
    let mut by_recording: Vec<RecordingForce> = Vec::new();
    let mut total = ForceSums::default();
    for (judged, sums) in judged.iter().zip(sums) {
        if sums.rows == 0 {
            continue;
        }
        let (name, fold) = (
            &recordings[judged.trace.recording].name,
            fold_of[judged.trace.recording],
        );
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
        r2_disc_mean: total.r2_disc_mean(),
        r2_centre: total.r2_centre(),
        rows: total.rows,
        flights: by_recording.len(),
        folds,
        by_recording,
    })
}

/// Clock offsets of every recording, by recording and vehicle, with the thrust maps of the folds that held it out: what
/// [`held_out_force`] takes once more. The force that tells them is the one that is then judged, so state both figures.
#[must_use]
pub fn clock_offsets(
    recordings: &[Recording],
    skill: &ForceSkill,
    test: &ForceTest,
) -> Vec<Vec<ClockOffset>> {
    let (_, fold_of) = deal(recordings, skill.folds.len().max(1));
    let one = |(recording, &fold): (&Recording, &usize)| {
        let known = skill.folds.get(fold).map_or(&[][..], |fold| &fold.maps);
        let map = |of: &Vehicle| {
            let group = test.share.group(of);
            let judged = !test.except.contains(&of.id);
            let mut maps = known.iter().filter(|(known, _)| judged && *known == group);
            maps.next().map(|(_, known)| &known.map)
        };
        let maps: Vec<Option<&ThrustMap>> = recording.vehicles.iter().map(map).collect();
        clock::offsets(recording, &maps, test.identify.low_pass)
    };
    let with_fold: Vec<(&Recording, &usize)> = recordings.iter().zip(&fold_of).collect();
    with_fold.into_par_iter().map(one).collect()
}

/// Recordings in the order of their names, and the fold that each is dealt to.
pub(crate) fn deal(recordings: &[Recording], folds: usize) -> (Vec<usize>, Vec<usize>) {
    let mut by_name: Vec<usize> = (0..recordings.len()).collect();
    by_name.sort_by(|&a, &b| recordings[a].name.cmp(&recordings[b].name));
    let mut fold_of = vec![0; recordings.len()];
    for (place, &recording) in by_name.iter().enumerate() {
        fold_of[recording] = place % folds;
    }
    (by_name, fold_of)
}

/// Traces with the air that they meet, in the order of the recordings' names.
fn prepare<'a>(
    recordings: &'a [Recording],
    clocks_s: &[Vec<f64>],
    by_name: &[usize],
    test: &ForceTest,
) -> Vec<Judged<'a>> {
    let of_recording = |&index: &usize| -> Vec<Judged<'a>> {
        let recording = &recordings[index];
        let clock_s = |vehicle: usize| {
            let clocks_s = clocks_s.get(index);
            clocks_s
                .and_then(|clocks_s| clocks_s.get(vehicle))
                .copied()
                .unwrap_or(0.0)
        };
        let mut flow = Flow::new(recording);
        for vehicle in 0..recording.vehicles.len() {
            flow.set_clock_offset(vehicle, clock_s(vehicle));
        }
        let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
        let judge = |(vehicle, of): (usize, &Vehicle)| {
            if test.except.contains(&of.id) {
                return None;
            }
            let around = free_flight::around(recording, vehicle, &test.identify.free, test.under_m);
            let trace = Trace::new(recordings, (index, vehicle), around, test.identify.low_pass)?;
            let airframe = &of.airframe;
            Some(Judged {
                trace,
                group: test.share.group(of).to_owned(),
                air: AirMet::along(recording, &flow, vehicle, clock_s(vehicle)),
                hover_mps: airframe
                    .hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3),
            })
        };
        recording
            .vehicles
            .iter()
            .enumerate()
            .filter_map(judge)
            .collect()
    };
    let prepared: Vec<Vec<Judged>> = by_name.par_iter().map(of_recording).collect();
    prepared.into_iter().flatten().collect()
}

/// Sums over the rows of one vehicle in one flight.
fn sums(
    recording: &Recording,
    judged: &Judged,
    known: &Identification,
    test: &ForceTest,
) -> ForceSums {
    let mut sums = ForceSums::default();
    let (trace, low_pass) = (&judged.trace, test.identify.low_pass);
    let Some(thrust_n) = trace.thrust_n(&known.map) else {
        return sums;
    };
    let law = recording.baseline.receiver_law;
    let recorded_n = force::recorded_n(trace, &thrust_n, low_pass);
    let [disc_mean_n, centre_n] =
        [&judged.air.disc_mean_mps, &judged.air.centre_mps].map(|air_mps| {
            force::simulated_n(law, trace, &thrust_n, air_mps, judged.hover_mps, low_pass)
        });
    let track = &trace.of.track;
    let floor_z_m = recording.environment.floor_z_m.unwrap_or(0.0);
    for row in 0..track.t_s.len() {
        let high = track.position_m[row].z - floor_z_m > test.above_floor_m;
        let (recorded_n, all) = (
            recorded_n[row],
            recorded_n[row] + disc_mean_n[row] + centre_n[row],
        );
        if trace.around[row] != Around::Below || !high || !all.is_finite() {
            continue;
        }
        sums.rows += 1;
        let duty = track.duty.as_ref().map(|duty| duty[row]);
        sums.rows_outside += usize::from(duty.is_some_and(|duty| !known.map.covers(duty)));
        sums.recorded_n += recorded_n;
        sums.recorded_n2 += recorded_n * recorded_n;
        sums.disc_mean.add(recorded_n, disc_mean_n[row]);
        sums.centre.add(recorded_n, centre_n[row]);
    }
    sums
}
