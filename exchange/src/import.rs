//! Shows from other programs: files recognised and read, and what they say as trajectories that a
//! plan can hold.
//!
//! A plan's pieces are straight or cubic. Polynomials of a higher degree are halved until a cubic
//! with their places and velocities at both ends stays within [`WITHIN_M`] of them; straight pieces
//! that go on as they were within that are one. Rows of a table that follow a curve at a rate are
//! cubics through some of them, within [`ROWS_WITHIN_M`] of the straight pieces from row to row.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;
use planner::plan::{Origin, TrajectoryEntry};
use planner::scenario::Intended;
use serde::Deserialize;
use thiserror::Error;

use crate::export::{DroneNamed, File};
use crate::flown::{Flown, Span};
use crate::frame::HEADING_DEFAULT_DEG;
use crate::kept::{Kept, Original};
use crate::read::{self, ReadError};

/// How far what is judged may be from what a file says (m), chosen here: a fiftieth of the
/// verifier's own tolerance at obstacles.
pub const WITHIN_M: f64 = 1e-4;
/// The same for rows of a table that follow a curve (m), chosen here: what is flown from one row to
/// the next is not said to that; at 20 rows a second and 4 m/s² a chord is 1.2 mm off its arc.
pub const ROWS_WITHIN_M: f64 = 2e-3;
/// Rows farther apart than this are no curve at a rate (s), chosen here.
const ROWS_APART_S: f64 = 0.15;
/// Most rows in one cubic: chosen here, several seconds.
const MOST_ROWS: usize = 128;
/// Ends of pieces this near to where the next begins are one place, rounded (m): chosen here, half
/// a millimetre by a file's rounding at each.
const JOINED_M: f64 = 1e-3;
/// Parts of a length that are below any rounding (m).
const NOTHING_M: f64 = 1e-9;
/// A home this far beside a first point is reported (m): chosen here, the error of placing by hand.
const HOME_M: f64 = 0.1;
/// Halvings of a piece: chosen here, far more than any trajectory that can be flown takes.
const MOST_HALVINGS: usize = 20;

/// What files say of a show.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Show {
    /// In the order of the files.
    pub drones: Vec<Intended>,
    /// What an export to Skybrush keeps as it is.
    pub kept: Kept,
    /// Where its (0, 0, 0) lies on the Earth, if it says so.
    pub origin: Option<Origin>,
    /// What was read, and how near to it what is judged is, as sentences.
    pub remarks: Vec<String>,
}

/// Why a file is no show.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{file}: {error}")]
pub struct ShowError {
    /// Which file.
    pub file: String,
    /// What is wrong with it, at its place.
    pub error: ReadError,
}

/// What a file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FileKind {
    /// Skybrush's show file.
    Skyc,
    /// Skybrush's binary file of a drone.
    Skyb,
    /// The Crazyflie's compressed pieces.
    Compressed,
    /// A table of setpoints.
    Setpoints,
    /// A table of polynomials.
    UavTrajectory,
    /// A table of Skybrush Studio.
    SkybrushCsv,
}

impl FileKind {
    fn as_str(self) -> &'static str {
        match self {
            FileKind::Skyc => "a Skybrush show",
            FileKind::Skyb => "Skybrush's binary files",
            FileKind::Compressed => "compressed Crazyflie trajectories",
            FileKind::Setpoints => "setpoints",
            FileKind::UavTrajectory => "polynomials of uav_trajectories",
            FileKind::SkybrushCsv => "tables of Skybrush Studio",
        }
    }

    /// By the ending of its name; of tables by their first line.
    fn of(file: &File) -> Result<FileKind, ReadError> {
        let ending = file.name.rsplit('.').next().unwrap_or_default();
        match ending.to_lowercase().as_str() {
            "skyc" => return Ok(FileKind::Skyc),
            "skyb" => return Ok(FileKind::Skyb),
            "cfpoly" => return Ok(FileKind::Compressed),
            _ => {}
        }
        let text = text(file)?;
        if is_log(text) {
            let what = "a log, which has all drones in it: name it alone, without other tables";
            return Err(ReadError::line(1, what));
        }
        let header = text.lines().next().unwrap_or_default();
        let first = header.split(',').next().unwrap_or_default().trim();
        if first.eq_ignore_ascii_case("duration") {
            return Ok(FileKind::UavTrajectory);
        }
        if read::skybrush_csv::is_header(header) {
            return Ok(FileKind::SkybrushCsv);
        }
        if read::setpoints::axes(text).is_ok() {
            return Ok(FileKind::Setpoints);
        }
        let shown: String = header.chars().take(60).collect();
        let separators = [(';', "semicolons"), ('\t', "tabs")].into_iter();
        let separator = separators
            .filter(|_| !header.contains(','))
            .find(|(mark, _)| header.contains(*mark));
        if let Some((_, separator)) = separator {
            let what = format!("one column, `{shown}`: write commas instead of {separator}");
            return Err(ReadError::line(1, what));
        }
        let what = format!(
            "no table that is known begins `{shown}`. Known are: t_s,drone,x_m,y_m,z_m (a log); \
             t_s,n_m,e_m,d_m (setpoints, NED); t_s,x_m,y_m,z_m (setpoints, z up); \
             Duration,x^0,...,yaw^7 (uav_trajectories); Time_msec,X_m,Y_m,Z_m (Skybrush Studio)"
        );
        Err(ReadError::line(1, what))
    }
}

/// The text of a table, without a byte order mark.
fn text(file: &File) -> Result<&str, ReadError> {
    let text = std::str::from_utf8(&file.bytes).map_err(|error| {
        let at = error.valid_up_to();
        ReadError::byte(at, "it is no text: not all of it is UTF-8")
    })?;
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// Whether a table is a log of a flight: it names a drone in each row.
#[must_use]
pub fn is_log(text: &str) -> bool {
    let rows = text.lines().filter(|it| !it.starts_with('#'));
    let header = rows.map(str::trim).find(|it| !it.is_empty());
    let mut columns = header.unwrap_or_default().split(',').map(str::trim);
    columns.any(|it| it.eq_ignore_ascii_case("drone"))
}

/// What an export says of its files: `export.json`, as far as it is needed to read them.
#[derive(Clone, Debug, Default, Deserialize)]
struct Exported {
    #[serde(default)]
    axes: Option<AxesRead>,
    drones: Vec<DroneNamed>,
    /// The drone of each file: the first in `drones` that names it.
    #[serde(skip)]
    of_file: BTreeMap<String, usize>,
}

/// The axes of its setpoints.
#[derive(Clone, Debug, Deserialize)]
struct AxesRead {
    heading_deg: f64,
    origin: String,
}

/// The file beside a show's own that says what they count from.
pub const MANIFEST: &str = "export.json";

impl Exported {
    fn of(text: &str) -> Result<Exported, ReadError> {
        let mut exported: Exported = serde_json::from_str(text).map_err(|error| {
            let what = format!("it does not say what the files beside it count from: {error}");
            ReadError::line(error.line() as u64, what)
        })?;
        for (k, file) in (exported.drones.iter().enumerate())
            .flat_map(|(k, drone)| drone.files.iter().map(move |file| (k, file)))
        {
            exported.of_file.entry(file.clone()).or_insert(k);
        }
        Ok(exported)
    }

    fn drone(&self, file: &str) -> Option<&DroneNamed> {
        Some(&self.drones[*self.of_file.get(file)?])
    }

    /// Whether setpoints count from each drone's own start.
    fn has_own_origins(&self) -> bool {
        self.axes.as_ref().is_some_and(|it| it.origin == "own")
    }

    /// What does not go together with the files of its folder: those of their kind that it names
    /// and that are not there, each an error.
    fn missing(&self, files: &[File]) -> Vec<ReadError> {
        let ending = |name: &str| name.rsplit_once('.').map(|it| it.1.to_lowercase());
        let Some(kind) = files.first().map(|it| ending(&it.name)) else {
            return Vec::new();
        };
        let named = self.drones.iter().flat_map(|drone| {
            let of_kind = drone.files.iter().filter(|it| ending(it) == kind);
            of_kind.map(|file| (&drone.name, file))
        });
        let there: BTreeSet<&str> = files.iter().map(|it| &it.name[..]).collect();
        let missing = named.filter(|(_, file)| !there.contains(&file[..]));
        let told = missing.map(|(drone, file)| {
            let what = format!("its file {file} is not there");
            ReadError::within(&format!("drone `{drone}`"), what)
        });
        told.collect()
    }
}

/// Which files a show is read from.
#[derive(Clone, Copy, Debug, Default)]
pub struct Beside<'a> {
    /// The text of an `export.json` beside them: it says what they count from.
    pub manifest: Option<&'a str>,
    /// They are all of their folder, so that those which it names have to be among them.
    pub is_folder: bool,
}

/// Reads the files of a show: one `.skyc`, or one table or binary file a drone, named as it.
///
/// # Errors
///
/// All that is wrong, each with its file and place.
pub fn read_show(files: &[File], beside: Beside<'_>) -> Result<Show, Vec<ShowError>> {
    let mut errors: Vec<ShowError> = Vec::new();
    // A show file counts from its own origin.
    let is_counted = |it: &File| !it.name.to_lowercase().ends_with(".skyc");
    let manifest = beside.manifest.filter(|_| files.iter().any(is_counted));
    let manifest = manifest.map(Exported::of).transpose();
    let manifest = manifest.unwrap_or_else(|error| {
        errors.push(ShowError::of(MANIFEST, error));
        None
    });
    if let Some(manifest) = manifest.as_ref().filter(|_| beside.is_folder) {
        let missing = manifest.missing(files).into_iter();
        errors.extend(missing.map(|it| ShowError::of(MANIFEST, it)));
    }
    let mut show = Show::default();
    let mut kinds: Vec<FileKind> = Vec::new();
    let mut nearness = Nearness::default();
    let mut homes = Homes::default();
    let mut originals: Vec<Original> = Vec::new();
    let mut names: BTreeSet<String> = BTreeSet::new();
    for file in files {
        let read = FileKind::of(file).map_err(|error| vec![error]);
        let read = read.and_then(|kind| Ok((kind, read_file(kind, file, manifest.as_ref())?)));
        let (kind, (performers, original)) = match read {
            Ok(read) => read,
            Err(wrong) => {
                let wrong = wrong.into_iter();
                errors.extend(wrong.map(|error| ShowError::of(&file.name, error)));
                continue;
            }
        };
        if !kinds.contains(&kind) {
            kinds.push(kind);
        }
        originals.extend(original);
        for performer in performers {
            let read::skyc::Performer {
                name,
                flown,
                lights,
                home_m,
            } = performer;
            if !names.insert(name.clone()) {
                let what = format!("a second drone `{name}`");
                errors.push(ShowError::of(
                    &file.name,
                    ReadError::within("the show", what),
                ));
                continue;
            }
            if let Some(lights) = lights {
                show.kept.lights.insert(name.clone(), lights);
            }
            let trajectory = trajectory(&flown, &mut nearness);
            homes.add(&name, home_m, trajectory.position_m.first());
            show.drones.push(Intended { name, trajectory });
        }
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    let kinds: Vec<&str> = kinds.into_iter().map(FileKind::as_str).collect();
    show.remarks
        .push(format!("read as {}", kinds.join(" and ")));
    show.keep(originals);
    show.remarks.extend(nearness.told());
    show.remarks.extend(homes.told());
    Ok(show)
}

/// Drones whose home is not where their trajectory begins.
#[derive(Default)]
struct Homes {
    beside: usize,
    /// By how much (m), and the drone.
    farthest: (f64, String),
}

impl Homes {
    fn add(&mut self, name: &str, home_m: Option<Point3<f64>>, first_m: Option<&Point3<f64>>) {
        let Some((home_m, first_m)) = home_m.zip(first_m) else {
            return;
        };
        let off_m = (home_m - first_m).xy().norm();
        self.beside += usize::from(off_m > HOME_M);
        if off_m > self.farthest.0 {
            self.farthest = (off_m, name.to_owned());
        }
    }

    fn told(&self) -> Option<String> {
        let (off_m, name) = &self.farthest;
        (self.beside > 0).then(|| {
            let drones = if self.beside == 1 { "drone" } else { "drones" };
            format!(
                "`home` of {} {drones} is beside the first point of the trajectory, by up to {off_m:.2} m (`{name}`): judged is the trajectory from its first point on",
                self.beside
            )
        })
    }
}

impl ShowError {
    fn of(file: &str, error: ReadError) -> ShowError {
        let file = file.to_owned();
        ShowError { file, error }
    }
}

impl Show {
    /// Keeps what a show file says beside its trajectories, and says what that is.
    fn keep(&mut self, originals: Vec<Original>) {
        let several = originals.len();
        if let Ok([original]) = <[Original; 1]>::try_from(originals) {
            match original.origin() {
                Ok(origin) => self.origin = origin,
                Err(what) => {
                    let what = format!("where the show lies is kept and not understood: {what}");
                    self.remarks.push(what);
                }
            }
            self.kept.original = Some(original);
        } else if several > 1 {
            let what =
                format!("of {several} shows light programs alone are kept beside trajectories");
            self.remarks.push(what);
        }
        let (lit, all) = (self.kept.lights.len(), self.drones.len());
        let of_drones = format!("light programs of {lit} of {all} drones");
        let told = self.kept.told().into_iter();
        let told = told.map(|it| {
            if it == "light programs" {
                of_drones.clone()
            } else {
                it
            }
        });
        let told: Vec<String> = told.collect();
        if !told.is_empty() {
            let told = told.join(", ");
            self.remarks.push(format!(
                "{told} are kept, not judged: an export of the show itself to Skybrush has them, a plan has not"
            ));
        }
    }
}

/// The drones of one file, and the file itself if it is kept.
fn read_file(
    kind: FileKind,
    file: &File,
    manifest: Option<&Exported>,
) -> Result<(Vec<read::skyc::Performer>, Option<Original>), Vec<ReadError>> {
    if kind == FileKind::Skyc {
        let read::skyc::Skyc { performers, index } = read::skyc::read(&file.bytes)?;
        let original = Original {
            bytes: (&file.bytes[..]).into(),
            index,
            drones: performers.iter().map(|it| it.name.clone()).collect(),
            begins_s: (performers.iter())
                .filter_map(|it| Some(it.flown.spans.first()?.from_s))
                .reduce(f64::min)
                .unwrap_or(0.0),
        };
        return Ok((performers, Some(original)));
    }
    let known = manifest.and_then(|it| it.drone(&file.name));
    let flown = flown(kind, file, manifest, known).map_err(|error| vec![error])?;
    let stem = file.name.rsplit_once('.').map_or(&file.name[..], |it| it.0);
    let performer = read::skyc::Performer {
        name: known.map_or(stem, |it| &it.name).to_owned(),
        flown,
        home_m: None,
        lights: None,
    };
    Ok((vec![performer], None))
}

/// What the drone of one file flies.
fn flown(
    kind: FileKind,
    file: &File,
    manifest: Option<&Exported>,
    known: Option<&DroneNamed>,
) -> Result<Flown, ReadError> {
    let flown = match kind {
        // Read with its drones.
        FileKind::Skyc => Flown::default(),
        FileKind::Skyb => read::skyb::read(&file.bytes)?.0,
        FileKind::Compressed => read::compressed::read(&file.bytes, 0.001)?,
        FileKind::UavTrajectory => read::uav_trajectory::read(text(file)?)?,
        FileKind::SkybrushCsv => read::skybrush_csv::read(text(file)?)?,
        FileKind::Setpoints => {
            let axes = manifest.and_then(|it| it.axes.as_ref());
            let heading_deg = axes.map_or(HEADING_DEFAULT_DEG, |it| it.heading_deg);
            let is_own = manifest.is_some_and(Exported::has_own_origins);
            let from_m = match (is_own, known) {
                (false, _) => Point3::origin(),
                (true, Some(drone)) => drone.start_m,
                (true, None) => {
                    let what = "export.json beside it counts each drone from a place of its own, and does not name this file";
                    return Err(ReadError::within("the file", what));
                }
            };
            read::setpoints::read(text(file)?, heading_deg, from_m)?
        }
    };
    match flown.spans.is_empty() {
        true => Err(ReadError::within("the file", "no trajectory in it")),
        false => Ok(flown),
    }
}

/// How near what is judged is to what the files say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Nearness {
    /// Pieces of a degree above 3, and the cubics in their place.
    higher: usize,
    cubics: usize,
    /// Straight pieces that go on in another.
    joined: usize,
    /// Straight pieces along a curve, and the cubics in their place.
    rows: usize,
    row_cubics: usize,
    /// The farthest that the end of a piece was moved to where the next begins (m).
    moved_m: f64,
}

impl Nearness {
    fn told(&self) -> Vec<String> {
        let mut told = Vec::new();
        let within_mm = 1e3 * WITHIN_M;
        if self.higher > 0 {
            let (higher, cubics) = (self.higher, self.cubics);
            told.push(format!(
                "{higher} pieces of a degree above 3 are judged as {cubics} cubics within {within_mm} mm of them"
            ));
        }
        if self.joined > 0 {
            let joined = self.joined;
            told.push(format!(
                "{joined} straight pieces go on as the one before them, within {within_mm} mm"
            ));
        }
        if self.rows > 0 {
            let (rows, cubics, within_mm) = (self.rows, self.row_cubics, 1e3 * ROWS_WITHIN_M);
            told.push(format!(
                "{rows} straight pieces along curves are judged as {cubics} cubics within {within_mm} mm of them"
            ));
        }
        if self.moved_m > 1e-6 {
            let moved_mm = 1e3 * self.moved_m;
            told.push(format!(
                "ends of pieces are up to {moved_mm:.3} mm from where the next begins: taken as one place"
            ));
        }
        told
    }
}

/// A piece of what is judged.
#[derive(Clone, Debug)]
struct BezierPiece {
    from_s: f64,
    until_s: f64,
    /// Bézier points (m): 2 of a straight piece, 4 of a cubic.
    points_m: Vec<Point3<f64>>,
}

/// The trajectory of a drone, without masses.
fn trajectory(flown: &Flown, nearness: &mut Nearness) -> TrajectoryEntry {
    let mut parts: Vec<BezierPiece> = Vec::with_capacity(flown.spans.len());
    for span in flown.spans.iter().filter(|it| it.until_s > it.from_s) {
        parts_of(span, nearness, &mut parts);
    }
    let starts: Vec<Point3<f64>> = parts.iter().map(|it| it.points_m[0]).collect();
    for (part, next_m) in parts.iter_mut().zip(starts.iter().skip(1)) {
        if let Some(end_m) = part.points_m.last_mut() {
            let apart_m = (*end_m - next_m).norm();
            if apart_m <= JOINED_M {
                nearness.moved_m = nearness.moved_m.max(apart_m);
                *end_m = *next_m;
            }
        }
    }
    let parts = curved(thinned(parts, nearness), nearness);
    let mut entry = TrajectoryEntry::default();
    let is_curved = parts.iter().any(|it| it.points_m.len() > 2);
    let mut push = |t_s: f64, at_m: Point3<f64>, bends_m: &[Point3<f64>]| {
        if !entry.t_s.is_empty() && is_curved {
            entry.control_m.push(bends_m.to_vec());
        }
        entry.t_s.push(t_s);
        entry.position_m.push(at_m);
    };
    let mut now: Option<Point3<f64>> = None;
    for BezierPiece {
        from_s,
        until_s,
        points_m,
    } in &parts
    {
        let [first_m, bends_m @ .., last_m] = &points_m[..] else {
            continue;
        };
        if now != Some(*first_m) {
            // Where it begins; else a jump, which is the verifier's to judge.
            push(*from_s, *first_m, &[]);
        }
        push(*until_s, *last_m, bends_m);
        now = Some(*last_m);
    }
    entry
}

/// Straight pieces that go on as the one before them within [`WITHIN_M`], made one: each axis by
/// itself, so that the bound holds for all three together.
fn thinned(parts: Vec<BezierPiece>, nearness: &mut Nearness) -> Vec<BezierPiece> {
    let within_m = WITHIN_M / 3.0_f64.sqrt();
    let mut kept: Vec<BezierPiece> = Vec::with_capacity(parts.len());
    // Velocities with which the last kept piece stays near all that it stands for.
    let mut range_mps = [(f64::NEG_INFINITY, f64::INFINITY); 3];
    for part in parts {
        let is_straight = part.points_m.len() == 2;
        let last = kept.last_mut().filter(|last| {
            let goes_on = last.points_m.len() == 2 && last.points_m[1] == part.points_m[0];
            goes_on && is_straight && last.until_s == part.from_s
        });
        if let Some(last) = last {
            let (from_m, to_m) = (last.points_m[0], part.points_m[1]);
            let over_s = part.until_s - last.from_s;
            let before_s = last.until_s - last.from_s;
            // With the place that would be passed over.
            let passed_m = last.points_m[1] - from_m;
            let ranges = [0, 1, 2].map(|axis| {
                let (low, high) = range_mps[axis];
                let at_mps = passed_m[axis] / before_s;
                let by_mps = within_m / before_s;
                (low.max(at_mps - by_mps), high.min(at_mps + by_mps))
            });
            let velocity_mps = (to_m - from_m) / over_s;
            let stays = |axis: usize| {
                let (low, high) = ranges[axis];
                (low..=high).contains(&velocity_mps[axis])
            };
            if (0..3).all(stays) {
                range_mps = ranges;
                last.until_s = part.until_s;
                last.points_m[1] = to_m;
                nearness.joined += 1;
                continue;
            }
        }
        range_mps = [(f64::NEG_INFINITY, f64::INFINITY); 3];
        kept.push(part);
    }
    kept
}

/// Rows along a curve as cubics: as many at a time as stay within [`ROWS_WITHIN_M`] of the straight
/// pieces, half of it at the rows and half of it between them.
fn curved(parts: Vec<BezierPiece>, nearness: &mut Nearness) -> Vec<BezierPiece> {
    let is_row =
        |part: &BezierPiece| part.points_m.len() == 2 && part.until_s - part.from_s < ROWS_APART_S;
    let mut kept: Vec<BezierPiece> = Vec::with_capacity(parts.len());
    let mut now = 0;
    while now < parts.len() {
        let mut taken = None;
        let mut count = 2;
        while count <= MOST_ROWS
            && let Some(rows) = parts.get(now..now + count)
            && rows.iter().all(is_row)
            && let Some(cubic) = through(&parts, (now, now + count))
        {
            taken = Some((count, cubic));
            count *= 2;
        }
        let Some((count, cubic)) = taken else {
            kept.push(parts[now].clone());
            now += 1;
            continue;
        };
        nearness.rows += count;
        nearness.row_cubics += 1;
        kept.push(cubic);
        now += count;
    }
    kept
}

/// The cubic in place of some straight pieces, with the velocity at both ends of a parabola through
/// the neighbours; `None`: it is too far from them.
fn through(parts: &[BezierPiece], (first, end): (usize, usize)) -> Option<BezierPiece> {
    let velocity_mps = |at: usize| {
        let of = |part: &BezierPiece| {
            let duration_s = part.until_s - part.from_s;
            (
                (part.points_m[part.points_m.len() - 1] - part.points_m[0]) / duration_s,
                duration_s,
            )
        };
        let is_near = |it: &&BezierPiece| it.points_m.len() == 2;
        let before = at
            .checked_sub(1)
            .and_then(|it| parts.get(it))
            .filter(is_near)
            .map(of);
        let after = parts.get(at).filter(is_near).map(of);
        match (before, after) {
            (Some((a, a_s)), Some((b, b_s))) => Some((a * b_s + b * a_s) / (a_s + b_s)),
            (one, other) => one.or(other).map(|it| it.0),
        }
    };
    let rows = &parts[first..end];
    let (from_s, until_s) = (rows[0].from_s, rows[rows.len() - 1].until_s);
    let third_s = (until_s - from_s) / 3.0;
    let (a, d) = (rows[0].points_m[0], rows[rows.len() - 1].points_m[1]);
    let points_m = [
        a,
        a + velocity_mps(first)? * third_s,
        d - velocity_mps(end)? * third_s,
        d,
    ];
    let at_m = |t_s: f64| {
        let u = (t_s - from_s) / (until_s - from_s);
        let between = |two: &[Point3<f64>]| two[0] + (two[1] - two[0]) * u;
        let mut row = points_m.to_vec();
        while row.len() > 1 {
            row = row.windows(2).map(between).collect();
        }
        row[0]
    };
    let [b, c] = [points_m[1], points_m[2]];
    let bends_m = [(c - b) - (b - a), (d - c) - (c - b)];
    let bend_m = bends_m[0].norm().max(bends_m[1].norm());
    // The second derivative is linear: its ends decide.
    let most_mps2 = 6.0 * bend_m / (until_s - from_s).powi(2);
    let fits = rows.iter().all(|row| {
        let chord_m = most_mps2 * (row.until_s - row.from_s).powi(2) / 8.0;
        let off_m = (at_m(row.until_s) - row.points_m[1]).norm();
        chord_m <= 0.5 * ROWS_WITHIN_M && off_m <= 0.5 * ROWS_WITHIN_M
    });
    let points_m = points_m.to_vec();
    fits.then_some(BezierPiece {
        from_s,
        until_s,
        points_m,
    })
}

/// A polynomial as straight and cubic pieces.
fn parts_of(span: &Span, nearness: &mut Nearness, parts: &mut Vec<BezierPiece>) {
    let duration_s = span.until_s - span.from_s;
    // What a power adds at the end is the most it adds.
    let adds = |axis: &Vec<f64>, power: usize| {
        axis.get(power)
            .map_or(0.0, |it| it.abs() * duration_s.powi(power as i32))
    };
    let most = span.axes.iter().map(Vec::len).max().unwrap_or(0);
    let is_used = |power: &usize| span.axes.iter().any(|it| adds(it, *power) > NOTHING_M);
    let degree = (2..most).rev().find(is_used).unwrap_or(1);
    let points_m = bezier(span, degree.max(1), duration_s);
    match degree {
        1 => parts.push(BezierPiece {
            from_s: span.from_s,
            until_s: span.until_s,
            points_m,
        }),
        2 | 3 => parts.push(BezierPiece {
            from_s: span.from_s,
            until_s: span.until_s,
            points_m: elevated(&points_m, 3),
        }),
        _ => {
            nearness.higher += 1;
            let before = parts.len();
            cubics((span.from_s, span.until_s), points_m, 0, parts);
            nearness.cubics += parts.len() - before;
        }
    }
}

/// Bézier points of a polynomial over its duration (s).
fn bezier(span: &Span, degree: usize, duration_s: f64) -> Vec<Point3<f64>> {
    let choose = |n: usize, k: usize| (0..k).fold(1.0, |c, i| c * (n - i) as f64 / (i + 1) as f64);
    let point = |j: usize| {
        let along = |axis: &Vec<f64>| {
            let used = axis.iter().enumerate().take(j + 1);
            let parts = used.map(|(i, a)| {
                let share = choose(j, i) / choose(degree, i);
                share * a * duration_s.powi(i as i32)
            });
            parts.sum()
        };
        let [x, y, z] = &span.axes;
        Point3::new(along(x), along(y), along(z))
    };
    (0..=degree).map(point).collect()
}

/// The same curve by more Bézier points.
fn elevated(points_m: &[Point3<f64>], degree: usize) -> Vec<Point3<f64>> {
    let mut points_m = points_m.to_vec();
    while points_m.len() <= degree {
        let n = points_m.len();
        let inner = (1..n).map(|k| {
            let share = k as f64 / n as f64;
            points_m[k] + (points_m[k - 1] - points_m[k]) * share
        });
        let inner: Vec<Point3<f64>> = inner.collect();
        let ends_m = [points_m[0], points_m[n - 1]];
        points_m = [&ends_m[..1], &inner, &ends_m[1..]].concat();
    }
    points_m
}

/// Cubics in place of a curve of a higher degree: it lies within the hull of its Bézier points, and
/// so does its difference from a cubic.
fn cubics(
    span_s: (f64, f64),
    points_m: Vec<Point3<f64>>,
    halvings: usize,
    parts: &mut Vec<BezierPiece>,
) {
    let degree = points_m.len() - 1;
    let (a, d) = (points_m[0], points_m[degree]);
    let share = degree as f64 / 3.0;
    let cubic = [
        a,
        a + (points_m[1] - a) * share,
        d + (points_m[degree - 1] - d) * share,
        d,
    ];
    let same = elevated(&cubic, degree);
    let off_m = same.iter().zip(&points_m).map(|(a, b)| (a - b).norm());
    if off_m.fold(0.0, f64::max) <= WITHIN_M || halvings == MOST_HALVINGS {
        parts.push(BezierPiece {
            from_s: span_s.0,
            until_s: span_s.1,
            points_m: cubic.to_vec(),
        });
        return;
    }
    // De Casteljau, at the middle.
    let mut row = points_m;
    let (mut first, mut second) = (vec![row[0]], vec![row[degree]]);
    while row.len() > 1 {
        row = row
            .windows(2)
            .map(|two| nalgebra::center(&two[0], &two[1]))
            .collect();
        first.push(row[0]);
        second.push(row[row.len() - 1]);
    }
    second.reverse();
    let middle_s = 0.5 * (span_s.0 + span_s.1);
    cubics((span_s.0, middle_s), first, halvings + 1, parts);
    cubics((middle_s, span_s.1), second, halvings + 1, parts);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(from_s: f64, until_s: f64, axes: [Vec<f64>; 3]) -> Span {
        Span {
            from_s,
            until_s,
            axes,
        }
    }

    #[test]
    fn polynomials_of_degree_seven_become_cubics_within_what_is_said() {
        // From rest to rest over 2 s, 4 m along x (minimum snap), a cubic along y, nothing along z.
        let s = 2.0_f64;
        let snap = [35.0, -84.0, 70.0, -20.0];
        let mut x = vec![0.0; 4];
        x.extend((0..4).map(|k| 4.0 * snap[k] / s.powi(4 + k as i32)));
        let flown = Flown {
            spans: vec![
                span(0.0, s, [x, vec![1.0, 0.0, 0.3, -0.1], vec![1.5]]),
                span(s, 3.0, [vec![4.0], vec![1.4], vec![1.5]]),
            ],
        };
        let mut nearness = Nearness::default();
        let entry = trajectory(&flown, &mut nearness);
        assert_eq!(nearness.higher, 1);
        assert!((4..=32).contains(&nearness.cubics), "{nearness:?}");
        assert_eq!(entry.control_m.len() + 1, entry.t_s.len());
        assert!(entry.control_m.last().is_some_and(Vec::is_empty));
        let mut farthest_m = 0.0_f64;
        for k in 0..=3000 {
            let t_s = f64::from(k) / 1000.0;
            let (is, says) = (entry.position_m(t_s), flown.at_m(t_s));
            let off_m = is.zip(says).map(|(is, says)| (is - says).norm());
            farthest_m = farthest_m.max(off_m.expect("both have places"));
        }
        assert!((1e-7..=WITHIN_M).contains(&farthest_m), "{farthest_m}");
    }

    #[test]
    fn straight_pieces_are_one_where_they_go_on_and_never_farther_off_than_is_said() {
        // A circle of 1 m at 1 m/s with a straight run before it, ten places a second.
        let at = |t_s: f64| match t_s < 5.0 {
            true => Point3::new(1.0, t_s - 5.0, 2.0),
            false => Point3::new((t_s - 5.0).cos(), (t_s - 5.0).sin(), 2.0),
        };
        let points: Vec<_> = (0..=110).map(|k| f64::from(k) / 10.0).collect();
        let points: Vec<_> = points.into_iter().map(|t_s| (t_s, at(t_s))).collect();
        let flown = Flown::through(&points);
        let mut nearness = Nearness::default();
        let entry = trajectory(&flown, &mut nearness);
        assert!(entry.control_m.is_empty());
        assert_eq!(entry.t_s.len(), 111 - nearness.joined);
        assert!((49..60).contains(&nearness.joined), "{nearness:?}");
        assert_eq!(nearness.rows, 0, "a chord of 0.1 s is 1.2 mm off the arc");
        for k in 0..=11_000 {
            let t_s = f64::from(k) / 1000.0;
            let (is, says) = (entry.position_m(t_s), flown.at_m(t_s));
            let off_m = is.zip(says).map(|(is, says)| (is - says).norm());
            assert!(off_m.is_some_and(|it| it <= WITHIN_M + 1e-12), "{t_s}");
        }
    }

    #[test]
    fn rows_along_a_curve_are_cubics_within_what_is_said_and_corners_stay() {
        // A circle of 1 m at 1 m/s, twenty places a second; at 6 s it turns back at once.
        let at = |t_s: f64| {
            let angle: f64 = if t_s < 6.0 { t_s } else { 12.0 - t_s };
            Point3::new(angle.cos(), angle.sin(), 2.0 + 0.1 * angle)
        };
        let points = (0..=200).map(|k| f64::from(k) / 20.0);
        let points: Vec<_> = points.map(|t_s| (t_s, at(t_s))).collect();
        let flown = Flown::through(&points);
        let mut nearness = Nearness::default();
        let entry = trajectory(&flown, &mut nearness);
        assert!(entry.t_s.len() < 40, "{nearness:?}");
        for k in 0..=10_000 {
            let t_s = f64::from(k) / 1000.0;
            let (is, says) = (entry.position_m(t_s), flown.at_m(t_s));
            let off_m = is.zip(says).map(|(is, says)| (is - says).norm());
            assert!(
                off_m.is_some_and(|it| it <= ROWS_WITHIN_M + WITHIN_M),
                "{t_s}"
            );
        }
    }

    #[test]
    fn a_jump_stays_a_jump_and_rounding_does_not_become_one() {
        let stands =
            |from_s: f64, x_m: f64| span(from_s, from_s + 1.0, [vec![x_m], vec![], vec![]]);
        for (apart_m, points) in [(0.0009, 3), (0.0011, 4)] {
            let flown = Flown {
                spans: vec![stands(0.0, 1.0), stands(1.0, 1.0 + apart_m)],
            };
            let entry = trajectory(&flown, &mut Nearness::default());
            assert_eq!(entry.t_s.len(), points, "{entry:?}");
        }
    }
}
