//! What was flown, as a plan that can be judged: samples of every drone's place, and a few lines of
//! RON that say which airframes they are.
//!
//! A log is noisy and ends when recording ends. A drone that rests on the floor or on an obstacle,
//! as near as a scenario has it for starts, at its first sample starts landed, at its last one it
//! has landed; until it first leaves that place its noise is no motion. One that is in the air when
//! its samples end hovers there until the log ends, and is gone then; for good where its one sample
//! is the log's last moment.
//! Between two samples it flies straight. Speed is a mean over half a second: noise of a centimetre
//! at 20 Hz is 0.3 m/s from sample to sample.
//!
//! Formats of logs end in [`Samples`]; [`read_samples`] reads the plainest of them, a table.

use std::collections::BTreeMap;

use nalgebra::Point3;
use thiserror::Error;

use super::Files;
use super::fleet::{Members, around, as_plan, read_fleet, without_limits};
use super::limits::{MASS_KG, PLACE_M};
use super::placement::{SUPPORT_TOLERANCE_M, landing_place_m};
use super::problem::Problems;
use super::row_faults::RowFaults;
use super::solid::Solids;
use crate::plan::cause::as_typed;
use crate::plan::file::PlanFile;
use crate::plan::{AtEnd, AtStart, DronePlan, TrajectoryEntry};
use crate::scenario::world::{Drone, World};

/// Noise of a drone at rest stays within this (m), chosen here: twice that of motion capture in
/// poor light.
const STILL_M: f64 = 0.05;
/// Speed is taken over this (s), chosen here: ten samples at 20 Hz.
const SPEED_OVER_S: f64 = 0.5;
/// A drone whose first sample is this late was not there before (s), chosen here: loggers do not
/// begin at one moment.
const ENTERS_S: f64 = 1.0;
/// A gap between samples longer than this is reported (s): chosen here, twenty samples at 20 Hz.
const GAP_S: f64 = 1.0;
/// Times up to this are seconds of a log or of an epoch (s): chosen here, those since 1970 are
/// below 2e9, in milliseconds above 1e12.
const LATEST_S: f64 = 1e11;

/// What is flown faster is a mistake in a row (m/s): chosen here, just below what plans from
/// anywhere may state.
const FASTEST_MPS: f64 = 999.0;

/// The columns of a table of samples.
const COLUMNS: [&str; 5] = ["t_s", "drone", "x_m", "y_m", "z_m"];

/// Why samples make no plan.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum FlownError {
    /// Rows of the table.
    #[error(transparent)]
    Rows(#[from] RowFaults),
    /// Columns that are not there.
    #[error("the table needs the columns t_s, drone, x_m, y_m, z_m; it lacks {0}")]
    Columns(String),
    /// All of it is under the floor: its axes are not the assumed ones.
    #[error(
        "every place is below z = 0, the floor where the fleet's file gives no bounds_m; is z down (NED)? North, east, down is x = east, y = north, z = -down here"
    )]
    BelowFloor,
    /// No row.
    #[error("the table has no rows")]
    Empty,
    /// Samples of a drone that are none, not finite or not in order of time.
    #[error("the samples of `{0}` are none, or not finite, or not in order of time")]
    Samples(String),
    /// What is wrong with the airframes' file.
    #[error(transparent)]
    Fleet(#[from] Problems),
}

/// Where every drone was when: its samples in order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// By drone.
    pub of: BTreeMap<String, Vec<Sample>>,
}

/// Where one drone was at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// On the log's clock (s).
    pub t_s: f64,
    /// Centre of its rotor plane, z up (m).
    pub position_m: Point3<f64>,
    /// With payload (kg); `None`: not recorded.
    pub mass_kg: Option<f64>,
}

/// Reads a table `t_s,drone,x_m,y_m,z_m`, with `mass_kg` where it is recorded; further columns are
/// left alone, lines that begin with `#` are comments.
///
/// # Errors
///
/// All rows that are wrong, with their lines.
pub fn read_samples(text: &str) -> Result<Samples, FlownError> {
    let mut reader = csv::ReaderBuilder::new();
    let reader = reader
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .flexible(false);
    let mut reader = reader.from_reader(text.as_bytes());
    let line_of = |error: &csv::Error| error.position().map_or(1, csv::Position::line);
    let mut faults = RowFaults::default();
    let headings = match reader.headers() {
        Ok(headings) => headings.clone(),
        Err(error) => {
            faults.add(line_of(&error), of_csv(&error));
            return Err(faults.into());
        }
    };
    let named = |name: &str| {
        let all = headings.iter().enumerate();
        let named = all.filter(|(_, it)| it.eq_ignore_ascii_case(name));
        named.map(|(column, _)| column).collect::<Vec<usize>>()
    };
    let column = |name: &str| named(name).first().copied();
    let twice = |name: &&str| named(name).len() > 1;
    for name in COLUMNS.iter().chain(&["mass_kg"]).filter(|it| twice(it)) {
        faults.add(1, format!("the column `{name}` is there more than once"));
    }
    if !faults.is_empty() {
        return Err(faults.into());
    }
    let lacks = COLUMNS.iter().filter(|name| column(name).is_none());
    let lacks: Vec<&str> = lacks.copied().collect();
    let [Some(t), Some(drone), Some(x), Some(y), Some(z)] = COLUMNS.map(column) else {
        return Err(FlownError::Columns(lacks.join(", ")));
    };
    let mass = column("mass_kg");
    let mut samples = Samples::default();
    for row in reader.records() {
        let row = match row {
            Ok(row) => row,
            Err(error) => {
                faults.add(line_of(&error), of_csv(&error));
                continue;
            }
        };
        let line = row.position().map_or(0, csv::Position::line);
        let mut number = |column: usize, name: &str, (low, high): (f64, f64)| {
            let text = row.get(column).unwrap_or_default();
            let number = text.parse::<f64>().ok();
            let number = number.filter(|it| (low..=high).contains(it));
            if number.is_none() {
                let what = format!("`{name}` is `{text}`: not a number from {low} to {high}");
                faults.add(line, what);
            }
            number
        };
        let place = (PLACE_M.low, PLACE_M.high);
        let t_s = number(t, "t_s", (-LATEST_S, LATEST_S));
        let [x, y, z] =
            [(x, "x_m"), (y, "y_m"), (z, "z_m")].map(|(column, name)| number(column, name, place));
        let mass_kg = match mass.map(|column| (column, row.get(column).unwrap_or_default())) {
            Some((column, text)) if !text.is_empty() => {
                let known = number(column, "mass_kg", (MASS_KG.low, MASS_KG.high));
                known.map(Some)
            }
            _ => Some(None),
        };
        let name = row.get(drone).unwrap_or_default();
        if name.is_empty() {
            faults.add(line, "`drone` is empty");
            continue;
        }
        let (Some(t_s), Some(x), Some(y), Some(z), Some(mass_kg)) = (t_s, x, y, z, mass_kg) else {
            continue;
        };
        let known = samples.of.entry(name.to_owned()).or_default();
        let position_m = Point3::new(x, y, z);
        if let Some(Sample { t_s: last_s, .. }) = known.last().filter(|last| last.t_s >= t_s) {
            let [t_s, last_s] = [t_s, *last_s].map(as_typed);
            let what = format!("`{name}` is at {t_s} s after it was at {last_s} s");
            faults.add(line, what);
            continue;
        }
        let flown_mps = known.last().map_or(0.0, |last| {
            (position_m - last.position_m).norm() / (t_s - last.t_s)
        });
        if flown_mps > FASTEST_MPS {
            let what = format!("`{name}` is flown at {flown_mps:.0} m/s, at most {FASTEST_MPS}");
            faults.add(line, what);
            continue;
        }
        known.push(Sample {
            t_s,
            position_m,
            mass_kg,
        });
    }
    let samples = faults.or(samples)?;
    match samples.of.is_empty() {
        true => Err(FlownError::Empty),
        false => Ok(samples),
    }
}

/// What the reader of tables finds wrong with a row.
fn of_csv(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!("{len} columns, {expected_len} expected"),
        _ => error.to_string(),
    }
}

/// The plan that samples are, judged like any other; what was assumed stands in
/// [`PlanFile::remarks`]. `fleet` is the text of a file that says which airframes were flown, and
/// where.
///
/// # Errors
///
/// Everything that is wrong with `fleet`, each at its place in it.
pub fn samples_as_plan(
    name: &str,
    samples: &Samples,
    fleet: &str,
    files: &Files<'_>,
) -> Result<PlanFile, FlownError> {
    let out_of_order = |of_one: &[Sample]| {
        let is_finite = |it: &Sample| {
            let mass_kg = it.mass_kg.unwrap_or(0.0);
            it.t_s.is_finite() && mass_kg.is_finite() && it.position_m.iter().all(|m| m.is_finite())
        };
        of_one.is_empty() || !of_one.iter().all(is_finite) || !of_one.is_sorted_by_key(|it| it.t_s)
    };
    let mut all = samples.of.iter();
    if let Some((drone, _)) = all.find(|(_, of_one)| out_of_order(of_one)) {
        return Err(FlownError::Samples(drone.clone()));
    }
    let fleet = read_fleet(fleet);
    let places_m = || samples.of.values().flatten().map(|it| &it.position_m);
    if fleet.floor_z_m().is_none() && places_m().all(|it| it.z < 0.0) {
        return Err(FlownError::BelowFloor);
    }
    let firsts = samples.of.iter().map(|(name, of_one)| {
        let first_m = of_one.first().map_or(Point3::origin(), |it| it.position_m);
        (&name[..], first_m)
    });
    let members = Members {
        of: "log",
        firsts: firsts.collect(),
        room_m: around(places_m(), fleet.floor_z_m().unwrap_or(0.0)),
    };
    let (world, mut remarks) = fleet.world(name, &members, files)?;
    let times_s = || samples.of.values().flatten().map(|it| it.t_s);
    let begins_s = times_s().fold(f64::INFINITY, f64::min);
    let ends_s = times_s().fold(begins_s, f64::max);
    if begins_s != 0.0 {
        remarks.push(format!("time 0 is {} s of the log", as_typed(begins_s)));
    }
    let solids = Solids::new(&world.obstacles);
    let drones = world.drones.iter().map(|drone| {
        let of_one = samples.of.get(&drone.name).map_or(&[][..], Vec::as_slice);
        let lasts_s = [begins_s, ends_s];
        flown((&world, &solids), drone, of_one, lasts_s, &mut remarks)
    });
    let drones = drones.collect();
    Ok(as_plan(&world, drones, remarks))
}

/// What one drone flew.
fn flown(
    (world, solids): (&World, &Solids),
    drone: &Drone,
    samples: &[Sample],
    [begins_s, ends_s]: [f64; 2],
    remarks: &mut Vec<String>,
) -> DronePlan {
    let vehicle = &drone.vehicle;
    let mass_kg = vehicle.airframe.mass_kg();
    let mut flown: Vec<Sample> = samples.to_vec();
    flown.iter_mut().for_each(|it| it.t_s -= begins_s);
    // Where it stands if it stands below a place.
    let lands_m =
        |it_m: Point3<f64>| landing_place_m(&world.bounds_m, solids, it_m, vehicle.body_radius_m);
    let rests = |it: &Sample| it.position_m.z - lands_m(it.position_m).z <= SUPPORT_TOLERANCE_M;
    let near = |a: &Sample, b: &Sample| (a.position_m - b.position_m).norm() <= STILL_M;
    let (first, last) = (flown[0], flown[flown.len() - 1]);
    let at_start = if rests(&first) {
        AtStart::Landed
    } else {
        AtStart::Hover
    };
    let ends_s = ends_s - begins_s;
    let at_end = match rests(&last) {
        true => AtEnd::Land,
        false if first.t_s < ends_s => AtEnd::Leave,
        // The log does not say what follows.
        false => AtEnd::Hover,
    };
    // Samples at rest before it takes off and after it has landed are one place each.
    let takes_off = flown.iter().take_while(|it| near(it, &first)).count();
    let lands = flown.len() - flown.iter().rev().take_while(|it| near(it, &last)).count();
    let (mut from_s, mut until_s) = (flown[0].t_s, Some(last.t_s));
    if at_start == AtStart::Landed {
        let still = takes_off.max(1);
        flown[..still]
            .iter_mut()
            .for_each(|it| it.position_m = first.position_m);
        from_s = flown[still - 1].t_s;
    }
    let never = at_start == AtStart::Landed && takes_off == flown.len();
    if at_end == AtEnd::Land && lands < flown.len() && !never {
        // At rest from here on.
        flown.truncate(lands + 1);
        flown[lands].position_m = lands_m(last.position_m);
        until_s = Some(flown[lands].t_s);
    }
    let gaps = flown
        .windows(2)
        .map(|two| two[1].t_s - two[0].t_s)
        .filter(|it| *it > GAP_S);
    let gaps: Vec<f64> = gaps.collect();
    if let Some(longest_s) = gaps.iter().copied().reduce(f64::max) {
        let (name, some) = (&drone.name, gaps.len());
        remarks.push(format!(
            "`{name}`: {some} gaps between samples, up to {longest_s:.1} s; it is taken to fly straight in them"
        ));
    }
    if at_end != AtEnd::Land && ends_s - last.t_s > GAP_S {
        let (name, here_s, before_s) = (&drone.name, last.t_s, ends_s - last.t_s);
        remarks.push(format!(
            "`{name}`: its samples end at {here_s:.1} s in the air, {before_s:.1} s before the log's; it is taken to hover there until then"
        ));
    }
    match at_end {
        AtEnd::Leave if last.t_s < ends_s => {
            flown.push(Sample {
                t_s: ends_s,
                ..last
            });
            until_s = Some(ends_s);
        }
        AtEnd::Hover => until_s = None,
        AtEnd::Leave | AtEnd::Land => {}
    }
    let speed_mps = speed_mps(&flown);
    if speed_mps > vehicle.max_speed_mps {
        let (name, most_mps) = (&drone.name, vehicle.max_speed_mps);
        remarks.push(format!(
            "`{name}` flew {speed_mps:.2} m/s over {SPEED_OVER_S} s; its highest speed is {most_mps:.2} m/s"
        ));
    }
    let pieces = flown
        .windows(2)
        .map(|two| (two[1].position_m - two[0].position_m).norm() / (two[1].t_s - two[0].t_s));
    // From sample to sample noise is faster than the drone, in every direction.
    let speed_mps = pieces.fold(vehicle.max_speed_mps, f64::max) * 1.001;
    DronePlan {
        name: drone.name.clone(),
        airframe: without_limits(vehicle, world, speed_mps),
        air_limit: drone.air_limit,
        enters_s: (first.t_s > ENTERS_S).then_some(first.t_s),
        at_start,
        at_end,
        airborne_s: match never {
            true => (first.t_s, Some(first.t_s)),
            false => (
                if first.t_s > ENTERS_S || from_s > first.t_s {
                    from_s
                } else {
                    0.0
                },
                until_s,
            ),
        },
        trajectory: TrajectoryEntry {
            t_s: flown.iter().map(|it| it.t_s).collect(),
            position_m: flown.iter().map(|it| it.position_m).collect(),
            mass_kg: flown
                .iter()
                .map(|it| it.mass_kg.unwrap_or(mass_kg))
                .collect(),
            turns_at_once: true,
            ..TrajectoryEntry::default()
        },
        ..DronePlan::default()
    }
}

/// Highest mean speed over [`SPEED_OVER_S`] (m/s).
fn speed_mps(flown: &[Sample]) -> f64 {
    let mut until = 0;
    let mut highest_mps = 0.0_f64;
    for from in flown {
        while until < flown.len() && flown[until].t_s < from.t_s + SPEED_OVER_S {
            until += 1;
        }
        let Some(to) = flown.get(until) else { break };
        highest_mps =
            highest_mps.max((to.position_m - from.position_m).norm() / (to.t_s - from.t_s));
    }
    highest_mps
}
