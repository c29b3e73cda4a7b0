//! One plan in one format: written, read back, measured.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;

use nalgebra::Point3;
use planner::Plan;
use planner::plan::{DronePlan, Obstacle, Solid, TrajectoryEntry, failed};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::course::{self, Course};
use crate::deviation::{self, Deviation};
use crate::flown::Flown;
use crate::frame::{Axes, Frame, Georeference, HEADING_DEFAULT_DEG};
use crate::kept::{self, Kept};
use crate::read::{self, ReadError};
use crate::standing;
use crate::untimed::{self, Untimed};
use crate::write::mission::{self, Mission};
use crate::write::{compressed, crazyswarm, czml, mcap, setpoints, skyb, skyc};

/// A file may be off the plan by its `tracking_m`, or by this where it keeps less (m): chosen here,
/// what a path at 2 m/s cuts a corner by at 20 setpoints a second, and as much again.
const LEAST_TOLERANCE_M: f64 = 0.05;

/// Rows of setpoints of all drones together: chosen here, about 1 GiB while they are written.
const MOST_ROWS: u64 = 4_000_000;
/// Drones in the scenes of all moments together: chosen here, as much.
const MOST_SCENE_DRONES: u64 = 1_000_000;
/// Moments at which files are compared with their plan, of all drones together: chosen here, some
/// seconds of work.
const MOST_COMPARED: u64 = 50_000_000;
/// Those moments, each with every line of its drone's mission: chosen here, as long, and a thousand
/// drones that fly for four minutes along a hundred lines.
const MOST_ALONG: usize = 500_000_000;

/// Setpoints a second: chosen here, from what holds a straight path to what a log takes.
pub const RATES_HZ: RangeInclusive<f64> = 2.0..=1000.0;

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// Setpoints at a rate, a CSV a drone.
    Setpoints,
    /// Crazyswarm2's CSV and the Crazyflie's compressed bytes, one each a drone.
    Crazyswarm,
    /// Skybrush's show file, and a binary one a drone.
    Skybrush,
    /// MCAP with scene updates, for Foxglove.
    Mcap,
    /// CZML, for Cesium; takes a georeference.
    Czml,
    /// Missions of QGroundControl, two files a drone, without times; takes a georeference.
    Qgc,
}

impl Target {
    /// All of them.
    pub const ALL: [Target; 6] = [
        Target::Setpoints,
        Target::Crazyswarm,
        Target::Skybrush,
        Target::Mcap,
        Target::Czml,
        Target::Qgc,
    ];

    /// As the command line has it.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Target::Setpoints => "setpoints",
            Target::Crazyswarm => "crazyswarm",
            Target::Skybrush => "skybrush",
            Target::Mcap => "mcap",
            Target::Czml => "czml",
            Target::Qgc => "qgc",
        }
    }

    /// What of [`Options`] says something of some formats alone, and of which: a georeference,
    /// axes, a rate, an origin, compressed bytes alone, formats without times.
    pub const OF_OPTIONS: [&[Target]; 6] = [
        &[
            Target::Setpoints,
            Target::Skybrush,
            Target::Czml,
            Target::Qgc,
        ],
        &[Target::Setpoints],
        &[Target::Setpoints],
        &[Target::Setpoints],
        &[Target::Crazyswarm],
        &[Target::Qgc],
    ];

    /// Options that are given and say nothing of the format, each with the formats it is for; in
    /// the order of [`Target::OF_OPTIONS`].
    pub fn idle(self, options: [(&str, bool); 6]) -> impl Iterator<Item = (&str, String)> {
        let all = options.into_iter().zip(Target::OF_OPTIONS);
        let is_idle =
            move |((_, is_given), of): &((&str, bool), &[Target])| *is_given && !of.contains(&self);
        all.filter(is_idle).map(|((option, _), of)| {
            let of: Vec<&str> = of.iter().map(|it| it.as_str()).collect();
            (option, of.join(", "))
        })
    }

    /// It is flown; else it is looked at.
    fn is_flown(self) -> bool {
        !matches!(self, Target::Mcap | Target::Czml)
    }
}

/// Setpoints a second where none are asked for: chosen here, ten times what PX4's offboard mode
/// asks for at least (2 Hz).
pub const RATE_DEFAULT_HZ: f64 = 20.0;

/// How it is written.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// What the plan is called in every export, so that a log can be matched to it.
    pub plan_id: String,
    /// Where the world lies; headings are taken from it.
    pub georeference: Option<Georeference>,
    /// Of setpoints.
    pub axes: Axes,
    /// Of setpoints (1/s), within [`RATES_HZ`].
    pub rate_hz: f64,
    /// Setpoints count from each drone's own start.
    pub own_origin: bool,
    /// The Crazyflie's compressed bytes without CSV.
    pub compressed_alone: bool,
    /// A format that holds no times will do: drones fly such files without the plan's separation.
    pub untimed_ok: bool,
    /// Of an imported show: Skybrush's formats keep it.
    pub kept: Kept,
}

/// A file of an export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct File {
    /// Without folders.
    pub name: String,
    /// Its contents.
    pub bytes: Vec<u8>,
}

/// What `export.json` says beside the files.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Manifest {
    /// `export/1`.
    pub format: &'static str,
    /// The format of the files.
    pub to: Target,
    /// Of the plan.
    pub plan: PlanNamed,
    /// Axes of setpoints, and what they count from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axes: Option<AxesNamed>,
    /// Files of all drones together.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub files_of_all: Vec<String>,
    /// In the plan's order.
    pub drones: Vec<DroneNamed>,
    /// How far the files are from the plan.
    pub deviation: Deviation,
    /// What becomes of the plan without its times, of a format that has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub untimed: Option<Untimed>,
    /// What is fullest, of each limit that the format has.
    pub fullest: Vec<Fullest>,
    /// What the plan says and the files do not.
    pub lost: Vec<String>,
}

/// The plan of an export.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlanNamed {
    /// As [`Options::plan_id`].
    pub id: String,
    /// Its scenario.
    pub scenario: String,
}

/// Axes of setpoints.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxesNamed {
    /// `ned` or `enu`.
    pub frame: &'static str,
    /// Heading of the world's +x (deg, clockwise from north).
    pub heading_deg: f64,
    /// `common`: places count from the world's (0, 0, 0); `own`: from each drone's start.
    pub origin: &'static str,
    /// 1/s.
    pub rate_hz: f64,
}

/// A drone of an export.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DroneNamed {
    /// As in the plan.
    pub name: String,
    /// The plan's id, a slash, its name.
    #[serde(default)]
    pub id: String,
    /// Its first place in the world (m).
    pub start_m: Point3<f64>,
    /// Its own.
    pub files: Vec<String>,
}

/// How much of a limit the fullest drone takes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fullest {
    /// Its name.
    pub drone: String,
    /// So many.
    pub takes: usize,
    /// Of so many.
    pub of: usize,
    /// Of what.
    pub what: &'static str,
}

/// An export that was read back.
#[derive(Clone, Debug, PartialEq)]
pub struct Export {
    /// What was written, and how well.
    pub manifest: Manifest,
    /// The files.
    pub files: Vec<File>,
}

/// What keeps one drone from being exported.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Error)]
#[error("`{drone}`: {what}")]
pub struct Refusal {
    /// Its name.
    pub drone: String,
    /// Which limit, and by how much.
    pub what: String,
}

/// Why there is no export.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ExportError {
    /// Drones do not fit into the format.
    #[error("{} of the drones cannot be exported", .0.len())]
    Refused(Vec<Refusal>),
    /// The format counts on the Earth.
    #[error(
        "this format lies on the Earth: say where with --georeference LAT,LON,AMSL,HEADING, or with `origin` in the scenario"
    )]
    NoGeoreference,
    /// The show that was imported cannot be kept beside the plan's trajectories.
    #[error("the show as it was cannot be kept: {0}")]
    Original(String),
    /// Where the plan says that it lies is nowhere.
    #[error("`origin` of the plan: {0}")]
    Origin(String),
    /// The format holds no times, and that was not said to do.
    #[error("missions hold no times: who flies them flies without the plan's separation; {0}")]
    Untimed(Box<Untimed>),
    /// A file that was just written cannot be read: an error of this program.
    #[error("{file}, read back: {error}")]
    ReadBack {
        /// Its name.
        file: String,
        /// What is wrong with it.
        error: ReadError,
    },
    /// The files are farther from the plan than it allows.
    #[error(
        "read back, `{}` is {:.3} m off its plan at {:.2} s; {tolerance_m} m are borne",
        deviation.drone, deviation.largest_m, deviation.at_s
    )]
    Off {
        /// Where, and by how much.
        deviation: Deviation,
        /// The plan's (m).
        tolerance_m: f64,
    },
}

/// What a format's writer and reader make of a fleet.
#[derive(Default)]
struct Written {
    /// Of each drone.
    files: Vec<Vec<File>>,
    /// Of all drones together.
    of_all: Vec<File>,
    refused: Vec<Refusal>,
    fullest: Vec<Fullest>,
    lost: Vec<String>,
    untimed: Option<Untimed>,
}

impl Written {
    fn refuse(&mut self, drone: &str, what: String) {
        let drone = drone.to_owned();
        self.refused.push(Refusal { drone, what });
    }

    /// Notes how much of a limit a drone takes.
    fn takes(&mut self, drone: &str, takes: usize, (of, what): (usize, &'static str)) {
        let drone = drone.to_owned();
        let this = Fullest {
            drone,
            takes,
            of,
            what,
        };
        match self.fullest.iter_mut().find(|it| it.what == what) {
            Some(known) if known.takes >= takes => {}
            Some(known) => *known = this,
            None => self.fullest.push(this),
        }
    }
}

/// Writes a plan in a format, reads what was written and measures it against the plan.
///
/// # Errors
///
/// Every drone that does not fit, by its limit; or files that are farther off than the plan allows.
pub fn export(plan: &Plan, to: Target, options: &Options) -> Result<Export, ExportError> {
    // Where it lies the scenario may have said.
    let origin = plan.origin.as_ref().map(Georeference::of);
    let origin = origin.transpose().map_err(ExportError::Origin)?;
    let options = &Options {
        georeference: options.georeference.or(origin),
        ..options.clone()
    };
    let (plan, wrecks) = without_wrecks(plan, to);
    let plan = &*plan;
    let courses = course::of_all(plan).map_err(|wrong| {
        let refusal = |(drone, error): (String, course::CourseError)| Refusal {
            drone,
            what: error.to_string(),
        };
        ExportError::Refused(wrong.into_iter().map(refusal).collect())
    })?;
    let too_long = too_long(to, &courses, options);
    if matches!(to, Target::Setpoints | Target::Mcap) && too_long.is_some() {
        return Err(ExportError::Refused(Vec::from_iter(too_long)));
    }
    let stems = stems(&courses);
    let mut written = match to {
        Target::Setpoints => write_setpoints(&courses, &stems, options),
        Target::Crazyswarm => write_crazyswarm(&courses, &stems, options),
        Target::Skybrush => write_skybrush(plan, &courses, &stems, options)?,
        Target::Mcap => write_mcap(plan, &courses, options),
        Target::Czml => {
            let georeference = options.georeference.ok_or(ExportError::NoGeoreference)?;
            write_czml(plan, &courses, &georeference, options)
        }
        Target::Qgc => {
            let georeference = options.georeference.ok_or(ExportError::NoGeoreference)?;
            let untimed = untimed::of(plan);
            if !options.untimed_ok {
                return Err(ExportError::Untimed(untimed.into()));
            }
            write_qgc(plan, (&courses, &stems), &georeference, (options, untimed))
        }
    };
    if to.is_flown() {
        written.refused.extend(standing::refusals(plan));
    }
    if !written.refused.is_empty() || too_long.is_some() {
        written.refused.extend(too_long);
        return Err(ExportError::Refused(written.refused));
    }
    written.lost.extend(lost(plan, to, &courses));
    let wrecks: Vec<&str> = wrecks.iter().map(String::as_str).collect();
    written
        .lost
        .extend(of_some("is not flown, is left out", &wrecks));
    let kept = options.kept.told();
    if to != Target::Skybrush && !kept.is_empty() {
        let what = format!("{}: Skybrush's formats alone hold them", kept.join(", "));
        written.lost.push(what);
    }
    let deviation = match (to, &options.georeference) {
        (Target::Qgc, Some(at)) => missions(plan, &written.files, at)?,
        _ => timed(plan, to, (&courses, &written), options)?,
    };
    let tolerance_m = plan.margins.tracking_m.max(LEAST_TOLERANCE_M);
    let bears_m = if to.is_flown() { tolerance_m } else { f64::MAX };
    if deviation.largest_m > bears_m {
        return Err(ExportError::Off {
            deviation,
            tolerance_m,
        });
    }
    let named = |(course, files): (&Course, &Vec<File>)| DroneNamed {
        name: course.name.clone(),
        id: format!("{}/{}", options.plan_id, course.name),
        start_m: course.start_m(),
        files: files.iter().map(|it| it.name.clone()).collect(),
    };
    let frame = frame(options);
    let manifest = Manifest {
        format: "export/1",
        to,
        plan: PlanNamed {
            id: options.plan_id.clone(),
            scenario: plan.scenario.clone(),
        },
        axes: (to == Target::Setpoints).then(|| AxesNamed {
            frame: frame.axes.as_str(),
            heading_deg: frame.heading_deg,
            origin: if options.own_origin { "own" } else { "common" },
            rate_hz: options.rate_hz,
        }),
        files_of_all: written.of_all.iter().map(|it| it.name.clone()).collect(),
        drones: courses.iter().zip(&written.files).map(named).collect(),
        deviation,
        untimed: written.untimed,
        fullest: written.fullest,
        lost: written.lost,
    };
    Ok(Export {
        manifest,
        files: written
            .of_all
            .into_iter()
            .chain(written.files.into_iter().flatten())
            .collect(),
    })
}

/// The drone that takes longest, where all together take longer than can be written, or compared
/// with the plan.
fn too_long(to: Target, courses: &[Course], options: &Options) -> Option<Refusal> {
    let (rate_hz, most, what, help) = match to {
        Target::Setpoints => (
            options.rate_hz,
            MOST_ROWS,
            "rows",
            "; a lower --rate has fewer",
        ),
        Target::Mcap => {
            let rate_hz = mcap::rate_hz(courses.len());
            (rate_hz, MOST_SCENE_DRONES, "drones in scenes", "")
        }
        _ => (deviation::RATE_HZ, MOST_COMPARED, "places to compare", ""),
    };
    let last = (courses.iter()).max_by(|a, b| a.until_s().total_cmp(&b.until_s()))?;
    let end_s = last.until_s();
    // Rows begin at time 0; what does not leave is in the scenes to the end.
    let lasts_s = |it: &Course| match to {
        Target::Setpoints => it.until_s(),
        Target::Mcap if !it.leaves => end_s - it.enters_s.unwrap_or(0.0),
        _ => it.until_s() - it.enters_s.unwrap_or(0.0),
    };
    let all_s: f64 = courses.iter().map(lasts_s).sum();
    let (count, scenes) = (all_s * rate_hz, end_s * rate_hz);
    let longest = (courses.iter()).max_by(|a, b| {
        let as_long = lasts_s(a).total_cmp(&lasts_s(b));
        as_long.then(a.until_s().total_cmp(&b.until_s()))
    })?;
    let (drone, what) = if count > most as f64 {
        let what = format!(
            "it takes {:.0} s, all drones together {all_s:.0} s: {count:.0} {what} at {rate_hz} a second, at most {most} are borne{help}",
            lasts_s(longest)
        );
        (longest, what)
    } else if to == Target::Mcap && scenes > most as f64 {
        let what = format!(
            "it ends at {end_s:.0} s: {scenes:.0} scenes at {rate_hz} a second, at most {most} are borne"
        );
        (last, what)
    } else {
        return None;
    };
    let drone = drone.name.clone();
    Some(Refusal { drone, what })
}

/// The files of formats with times, read and measured.
fn timed(
    plan: &Plan,
    to: Target,
    (courses, written): (&[Course], &Written),
    options: &Options,
) -> Result<Deviation, ExportError> {
    let mut read = Vec::new();
    for (drone, (course, files)) in plan.drones.iter().zip(courses.iter().zip(&written.files)) {
        for file in files {
            let flown = read_one(to, file, course, options).map_err(|error| {
                let file = file.name.clone();
                ExportError::ReadBack { file, error }
            })?;
            read.push((drone, Some(flown)));
        }
    }
    for file in &written.of_all {
        let flown = read_all(to, file, courses, options).map_err(|error| {
            let file = file.name.clone();
            ExportError::ReadBack { file, error }
        })?;
        read.extend(plan.drones.iter().zip(flown));
    }
    let pairs = read.iter().map(|(drone, flown)| (*drone, flown.as_ref()));
    Ok(deviation::of(pairs))
}

/// Missions, read and measured along their lines, unless that would take too long.
fn missions(plan: &Plan, files: &[Vec<File>], at: &Georeference) -> Result<Deviation, ExportError> {
    let mut read = Vec::new();
    for (drone, files) in plan.drones.iter().zip(files) {
        for file in files {
            let line = read::mission::read(&file.bytes, at).map_err(|error| {
                let file = file.name.clone();
                ExportError::ReadBack { file, error }
            })?;
            // Whatever stands takes off first: it climbs from where it is.
            let start_m = drone.trajectory.position_m.first().copied();
            read.push((drone, start_m.into_iter().chain(line).collect::<Vec<_>>()));
        }
    }
    let count = |it: &(&DronePlan, Vec<_>)| [deviation::moments(it.0), it.1.len()];
    let work = |it: &_| count(it).into_iter().product::<usize>();
    if read.iter().map(work).sum::<usize>() > MOST_ALONG {
        let most = read.iter().max_by_key(|it| work(it));
        let refusal = |it: &(&DronePlan, Vec<_>)| Refusal {
            drone: it.0.name.clone(),
            what: format!(
                "{} moments to compare with {} places of its mission each, of all drones at most {MOST_ALONG} such pairs are borne",
                count(it)[0],
                count(it)[1]
            ),
        };
        return Err(ExportError::Refused(
            most.map(refusal).into_iter().collect(),
        ));
    }
    let pairs = read.iter().map(|(drone, line)| (*drone, &line[..]));
    Ok(deviation::along(pairs))
}

/// The axes of setpoints.
fn frame(options: &Options) -> Frame {
    Frame {
        axes: options.axes,
        heading_deg: options
            .georeference
            .map_or(HEADING_DEFAULT_DEG, |it| it.heading_deg),
    }
}

/// Where a drone's setpoints count from (m).
fn origin_m(course: &Course, options: &Options) -> Point3<f64> {
    match options.own_origin {
        true => course.start_m(),
        false => Point3::origin(),
    }
}

/// Names of drones as they may stand in a file's name, none twice whatever their case.
fn stems(courses: &[Course]) -> Vec<String> {
    let is_plain = |name: &str| {
        let fits = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        !name.is_empty() && !name.starts_with('.') && name.len() < 100 && name.chars().all(fits)
    };
    let mut taken = BTreeSet::new();
    let stem = |(k, course): (usize, &Course)| {
        let numbered = format!("drone-{:04}", k + 1);
        let is_free = is_plain(&course.name) && !course.name.to_lowercase().starts_with("drone-");
        let is_free = is_free && course.name.to_lowercase() != "export";
        match is_free && taken.insert(course.name.to_lowercase()) {
            true => course.name.clone(),
            false => numbered,
        }
    };
    courses.iter().enumerate().map(stem).collect()
}

fn write_setpoints(courses: &[Course], stems: &[String], options: &Options) -> Written {
    let frame = frame(options);
    let mut written = Written::default();
    for (course, stem) in courses.iter().zip(stems) {
        let from_m = origin_m(course, options);
        let table = setpoints::table(course, &frame, options.rate_hz, from_m);
        written.files.push(vec![File {
            name: format!("{stem}.csv"),
            bytes: table.into_bytes(),
        }]);
    }
    if options.georeference.is_none() {
        let what = "no --georeference, and no `origin` in the scenario: +x is taken to point east, +y north";
        written.lost.push(what.to_owned());
    }
    written
}

fn write_crazyswarm(courses: &[Course], stems: &[String], options: &Options) -> Written {
    let mut written = Written::default();
    let pieces = (crazyswarm::MOST_PIECES, "pieces of the CSV");
    let bytes = (compressed::MOST_BYTES, "bytes, compressed");
    let mut lacks_range = false;
    for (course, stem) in courses.iter().zip(stems) {
        let mut files = Vec::new();
        let small = compressed::crazyflie(course);
        if !options.compressed_alone {
            let table = crazyswarm::pieces(course);
            let count = table.len();
            written.takes(&course.name, count, pieces);
            if count > crazyswarm::MOST_PIECES {
                let most = crazyswarm::MOST_PIECES;
                let help = match &small {
                    Ok(small) if small.bytes.len() <= compressed::MOST_BYTES => format!(
                        "; compressed it takes {} of {} bytes: --compressed",
                        small.bytes.len(),
                        compressed::MOST_BYTES
                    ),
                    _ => String::new(),
                };
                let what = format!("{count} pieces, a Crazyflie's memory takes {most}{help}");
                written.refuse(&course.name, what);
            }
            files.push(File {
                name: format!("{stem}.csv"),
                bytes: crazyswarm::table(&table).into_bytes(),
            });
        }
        match small {
            Ok(small) if small.bytes.len() > compressed::MOST_BYTES => {
                let (count, most) = (small.bytes.len(), compressed::MOST_BYTES);
                let what = format!("{count} bytes, a Crazyflie's memory takes {most}");
                written.refuse(&course.name, what);
            }
            Ok(small) if small.pieces > compressed::MOST_PIECES => {
                let (count, most) = (small.pieces, compressed::MOST_PIECES);
                let what = format!("{count} compressed pieces, a Crazyflie is told of {most}");
                written.refuse(&course.name, what);
            }
            Ok(small) => {
                written.takes(&course.name, small.bytes.len(), bytes);
                files.push(File {
                    name: format!("{stem}.cfpoly"),
                    bytes: small.bytes,
                });
            }
            Err(_) if !options.compressed_alone => lacks_range = true,
            Err(far) => {
                let what = format!(
                    "reaches {:.2} m from 0, compressed pieces take {:.3} m",
                    far.reached_m, far.most_m
                );
                written.refuse(&course.name, what);
            }
        }
        written.files.push(files);
    }
    if lacks_range {
        let what = "drones beyond 32.767 m of 0 have no compressed file: it counts millimetres";
        written.lost.push(what.to_owned());
    }
    let what = "take-off and landing are pieces like others: arm and spin up before time 0, and \
                cut the motors after the end";
    if courses.iter().any(|it| it.starts_landed || it.lands) {
        written.lost.push(what.to_owned());
    }
    written
}

fn write_skybrush(
    plan: &Plan,
    courses: &[Course],
    stems: &[String],
    options: &Options,
) -> Result<Written, ExportError> {
    let kept = &options.kept;
    let mut written = Written::default();
    let limit = (skyb::MOST_BYTES, "bytes of a .skyb's trajectory");
    let mut unit_mm = 1;
    for (k, (course, stem)) in courses.iter().zip(stems).enumerate() {
        if k >= skyc::MOST_DRONES {
            let most = skyc::MOST_DRONES;
            let what = format!("is drone {} of the show, Skybrush loads {most}", k + 1);
            written.refuse(&course.name, what);
        }
        let comment = format!("{}/{}", options.plan_id, course.name);
        let lights = kept.lights.get(&course.name);
        let other = lights
            .map_or(0, |it| it.bytecode().len())
            .max(comment.len());
        match skyb::file(course, lights, &comment) {
            Ok(it) if it.body.max(other) > skyb::MOST_BYTES => {
                let (count, most) = (it.body.max(other), skyb::MOST_BYTES);
                written.refuse(
                    &course.name,
                    format!("{count} bytes, a .skyb's block takes {most}"),
                );
            }
            Ok(it) => {
                written.takes(&course.name, it.body, limit);
                unit_mm = it.unit_mm.max(unit_mm);
                written.files.push(vec![File {
                    name: format!("{stem}.skyb"),
                    bytes: it.bytes,
                }]);
            }
            Err(far) => {
                let what = format!(
                    "reaches {:.2} m from 0, a .skyb takes {:.0} m",
                    far.reached_m, far.most_m
                );
                written.refuse(&course.name, what);
            }
        }
    }
    let show = skyc::Show {
        plan,
        plan_id: &options.plan_id,
        georeference: options.georeference,
        kept,
    };
    let bytes = skyc::file(&show, courses);
    written.of_all.push(File {
        name: "show.skyc".to_owned(),
        bytes: bytes.map_err(|error| ExportError::Original(error.to_string()))?,
    });
    let mut lost = |what: &str| written.lost.push(what.to_owned());
    if unit_mm > 1 {
        lost(&format!(
            "places of a .skyb are whole multiples of up to {unit_mm} mm"
        ));
    }
    let dark = courses
        .iter()
        .filter(|it| !kept.lights.contains_key(&it.name));
    match dark.count() {
        0 => {}
        all if all == courses.len() => lost("no light program"),
        some => lost(&format!(
            "no light programs of {some} of the drones: the show has none"
        )),
    }
    if !show.is_outdoor() {
        lost("no --georeference, and no `origin` in the scenario: the show is an indoor one");
    }
    let of_drones = kept.original.iter().flat_map(|it| it.of_drones());
    let of_drones: Vec<String> = of_drones.map(kept::word).collect();
    if !of_drones.is_empty() {
        let of_drones = of_drones.join(", ");
        lost(&format!(
            "{of_drones}: the .skyc has them, the .skyb files have not"
        ));
    }
    let begins_s = kept.begins_s();
    if begins_s != 0.0 && !kept.lights.is_empty() {
        lost(&format!(
            "the show begins at {begins_s} s: the .skyc keeps that, the flight of a .skyb begins at 0 and its light program does not"
        ));
    }
    if courses.iter().any(|it| !it.lands) {
        lost(
            "drones that end hovering: Skybrush takes their last height for the ground they land on",
        );
    }
    Ok(written)
}

fn write_mcap(plan: &Plan, courses: &[Course], options: &Options) -> Written {
    let bytes = mcap::file(plan, &options.plan_id, courses);
    let mut lost = vec!["sampled for looking at, not for flying".to_owned()];
    let is_mesh = |it: &Obstacle| matches!(it.shape, Solid::Mesh { .. });
    if plan.obstacles.iter().any(is_mesh) {
        lost.push("obstacles that are meshes are not drawn".to_owned());
    }
    Written {
        files: vec![Vec::new(); courses.len()],
        of_all: vec![File {
            name: "scene.mcap".to_owned(),
            bytes: bytes.expect("a log in memory can be written"),
        }],
        lost,
        ..Written::default()
    }
}

fn write_czml(
    plan: &Plan,
    courses: &[Course],
    georeference: &Georeference,
    options: &Options,
) -> Written {
    let heights = "heights count from the ellipsoid: AMSL was taken as it is, which the geoid is up \
                   to 110 m off";
    Written {
        files: vec![Vec::new(); courses.len()],
        of_all: vec![File {
            name: "plan.czml".to_owned(),
            bytes: czml::file(&plan.scenario, &options.plan_id, georeference, courses),
        }],
        lost: vec![heights.to_owned(), "air and wakes are not in it".to_owned()],
        ..Written::default()
    }
}

fn write_qgc(
    plan: &Plan,
    (courses, stems): (&[Course], &[String]),
    at: &Georeference,
    (options, untimed): (&Options, Untimed),
) -> Written {
    let mut written = Written::default();
    let limit = (mission::MOST_ITEMS, "items of a mission");
    let mut wait_landed: Vec<&str> = Vec::new();
    let mut parked: Vec<&str> = Vec::new();
    for (course, stem) in courses.iter().zip(stems) {
        let mission = Mission::of(course, plan.bounds_m.min.z);
        if mission.is_empty() {
            parked.push(&course.name);
            written.files.push(Vec::new());
            continue;
        }
        written.takes(&course.name, mission.len(), limit);
        if mission.len() > mission::MOST_ITEMS {
            let (count, most) = (mission.len(), mission::MOST_ITEMS);
            let what = format!("{count} items, MAVLink counts up to {most}");
            written.refuse(&course.name, what);
        }
        if mission.waits_landed() {
            wait_landed.push(&course.name);
        }
        let id = format!("{}/{}", options.plan_id, course.name);
        written.files.push(vec![
            File {
                name: format!("{stem}.plan"),
                bytes: mission.plan(&id, at),
            },
            File {
                name: format!("{stem}.waypoints"),
                bytes: mission.waypoints(at),
            },
        ]);
    }
    let times = "times: a vehicle flies at its own speed, and holds where the plan does; nothing \
                 keeps drones apart";
    written.lost.push(times.to_owned());
    let home = "heights count from home, which is below each drone's first place: on the floor, or \
                where it stands";
    written.lost.push(home.to_owned());
    let waits = "waits on the ground in the plan, takes off at once here";
    written.lost.extend(of_some(waits, &wait_landed));
    let parked = of_some("never leaves the ground, has no mission", &parked);
    written.lost.extend(parked);
    written.untimed = Some(untimed);
    written
}

/// The plan without the wrecks of drones that failed where files are flown, and their names.
fn without_wrecks(plan: &Plan, to: Target) -> (Cow<'_, Plan>, Vec<String>) {
    let (wrecks, drones): (Vec<_>, Vec<_>) =
        (plan.drones.iter()).partition(|it| to.is_flown() && failed(&it.name).is_some());
    if wrecks.is_empty() {
        return (Cow::Borrowed(plan), Vec::new());
    }
    let flown = Plan {
        drones: drones.into_iter().cloned().collect(),
        ..plan.clone()
    };
    let names = wrecks.into_iter().map(|it| it.name.clone());
    (Cow::Owned(flown), names.collect())
}

/// What is true of some drones; nothing where there are none.
fn of_some(what: &str, names: &[&str]) -> Option<String> {
    let [first, rest @ ..] = names else {
        return None;
    };
    let more = match rest.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    Some(format!("{what}: `{first}`{more}"))
}

/// What no format holds; in those that are flown drones are there from the beginning to the end.
fn lost(plan: &Plan, to: Target, courses: &[Course]) -> Vec<String> {
    let mut lost = Vec::new();
    let mut some = |what: &str, holds: &dyn Fn(&Course) -> bool| {
        let of = courses.iter().filter(|it| holds(it));
        let of: Vec<&str> = of.map(|it| &it.name[..]).collect();
        lost.extend(of_some(what, &of));
    };
    some("changes of payload are not in it", &|it| it.changes_mass);
    some("waits at its first place until it comes", &|it| {
        to.is_flown() && it.enters_s.is_some()
    });
    some("leaves in the plan, stands at its last place here", &|it| {
        to.is_flown() && it.leaves
    });
    some("no path was found, stands at its first place here", &|it| {
        plan.is_unplanned(&it.name)
    });
    let jumps = |it: &TrajectoryEntry| {
        !it.is_smooth() && it.position_m.iter().any(|at_m| *at_m != it.position_m[0])
    };
    if courses
        .iter()
        .any(|it| it.pieces.iter().any(|piece| piece.is_straight))
        && plan.drones.iter().any(|it| jumps(&it.trajectory))
    {
        let what = "straight pieces change velocity at once, which no drone does: plan with \
                    `motion: Smooth` to fly them as they are";
        lost.push(what.to_owned());
    }
    let effects = plan.flown_effects();
    if !effects.is_empty() {
        let effects = effects.join(", ");
        lost.push(format!(
            "planned in air with {effects}, which it does not say: judged without, it is another plan"
        ));
    }
    lost
}

/// One drone's file, read.
fn read_one(
    to: Target,
    file: &File,
    course: &Course,
    options: &Options,
) -> Result<Flown, ReadError> {
    let text = || String::from_utf8_lossy(&file.bytes);
    match to {
        Target::Setpoints => {
            let heading_deg = frame(options).heading_deg;
            read::setpoints::read(&text(), heading_deg, origin_m(course, options))
        }
        Target::Crazyswarm if file.name.ends_with(".csv") => read::uav_trajectory::read(&text()),
        Target::Crazyswarm => read::compressed::read(&file.bytes, 0.001),
        Target::Skybrush => read::skyb::read(&file.bytes).map(|(flown, _)| flown),
        // All drones are in one file, or there are no times.
        Target::Mcap | Target::Czml | Target::Qgc => Ok(Flown::default()),
    }
}

/// The drones of a file of all, in the plan's order; `None`: it lacks one.
fn read_all(
    to: Target,
    file: &File,
    courses: &[Course],
    options: &Options,
) -> Result<Vec<Option<Flown>>, ReadError> {
    let mut by_name: BTreeMap<String, Flown> = match (to, &options.georeference) {
        (Target::Mcap, _) => read::mcap::read(&file.bytes)?,
        (Target::Czml, Some(at)) => read::czml::read(&file.bytes, at)?.into_iter().collect(),
        _ => {
            let show = read::skyc::read(&file.bytes);
            let show = show.map_err(ReadError::first)?;
            let performers = show.performers.into_iter();
            let begins_s = options.kept.begins_s();
            let by_plan = performers.map(|it| (it.name, it.flown.earlier_by(begins_s)));
            by_plan.collect()
        }
    };
    Ok(courses.iter().map(|it| by_name.remove(&it.name)).collect())
}
