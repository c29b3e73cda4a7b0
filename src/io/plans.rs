//! Plans from files: plan.json; logs, shows and setpoints, with their airframes.

use std::fmt::Display;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use clap::Args;
use exchange::import::{self, Beside, MANIFEST, Show, ShowError};
use exchange::kept::Kept;
use planner::Files;
use planner::plan::file::{self, PlanFile};
use planner::scenario::{
    DroneFault, FlownError, IntendedError, Problems, intended_as_plan, read_samples,
    samples_as_plan,
};
use sha2::{Digest as _, Sha256};

use super::failure::Failure;
use super::files::{self, MOST_SCENARIO_BYTES};
use super::problems;

/// Faults of a show that are listed; the rest is counted. Chosen here, what one reads.
const MOST_LISTED: usize = 20;

/// What a command is asked about: a plan, or what can be judged as one.
#[derive(Args)]
pub(crate) struct Source {
    /// Plan; or with --airframe or --airframes a show (.skyc), tables of setpoints or
    /// uav_trajectories (one a drone, or their folder), a log (t_s,drone,x_m,y_m,z_m); see
    /// docs/shows.md
    #[arg(value_name = "PLAN.json | SHOW.skyc | TABLE.csv", required = true)]
    paths: Vec<PathBuf>,
    /// Airframe of all drones of a show or a log, by its preset's name
    #[arg(long, value_name = "NAME", conflicts_with = "airframes")]
    airframe: Option<String>,
    /// Which airframes a show or a log is of, and where they fly (RON; see docs/shows.md)
    #[arg(long, value_name = "FLEET.ron")]
    airframes: Option<PathBuf>,
}

/// A plan as it was read.
pub(crate) struct Sourced {
    pub(crate) file: PlanFile,
    /// What a show says beside its trajectories.
    pub(crate) kept: Kept,
}

impl Source {
    /// A plan by its path, with its airframes.
    pub(crate) fn one(path: &Path, airframe: Option<&str>, airframes: Option<&Path>) -> Source {
        Source {
            paths: vec![path.to_owned()],
            airframe: airframe.map(str::to_owned),
            airframes: airframes.map(Path::to_owned),
        }
    }

    /// The first sixteen digits of the SHA-256 of its files one after another, of one file as
    /// `sha256sum` prints it.
    pub(crate) fn id(&self) -> Result<String, Failure> {
        let mut hasher = Sha256::new();
        for path in self.files()? {
            let from = std::fs::File::open(&path).map_err(Failure::read(&path))?;
            let bytes = files::bytes_of(from, files::MOST_BYTES).map_err(Failure::read(&path))?;
            hasher.update(&bytes);
        }
        let digest = hasher.finalize();
        Ok(digest
            .iter()
            .take(8)
            .map(|it| format!("{it:02x}"))
            .collect())
    }

    /// The first file, by which it is known.
    pub(crate) fn path(&self) -> &Path {
        self.paths.first().map_or(Path::new(""), PathBuf::as_path)
    }

    /// What a folder for it is called: as its scenario, where that is no way to elsewhere.
    pub(crate) fn name(&self, file: &PlanFile) -> String {
        let names = [file.plan.scenario.clone(), stem(self.path())];
        let plain = names.into_iter().find(|it| files::is_plain(it));
        plain.unwrap_or_else(|| "plan".to_owned())
    }

    /// The plan.
    ///
    /// # Errors
    /// What keeps the files from being one, at its place.
    pub(crate) fn read(&self) -> Result<Sourced, Failure> {
        let fleet = match (&self.airframe, &self.airframes) {
            (Some(name), _) => Some(AirframesFile::of_one(name)?),
            (None, Some(path)) => Some(AirframesFile::read(path)?),
            (None, None) => None,
        };
        let paths = self.files()?;
        if let [path] = &paths[..] {
            let is = |ending: &str| {
                let own = path.extension();
                own.is_some_and(|it| it.eq_ignore_ascii_case(ending))
            };
            let text = || files::text(path, files::MOST_BYTES).map_err(Failure::read(path));
            if is("csv") && text().is_ok_and(|it| import::is_log(&it)) {
                let fleet = fleet.ok_or_else(|| no_airframe(path, "a log"))?;
                return log(path, &text()?, &fleet);
            }
            if !["csv", "skyc", "skyb", "cfpoly"].iter().any(|it| is(it)) {
                let text = text()?;
                if let Some(fleet) = fleet {
                    if text.trim_start().starts_with('{') {
                        let what = "JSON says which airframes a plan has: leave --airframe and --airframes out";
                        return Err(not_a_plan(path, what.to_owned()));
                    }
                    return log(path, &text, &fleet);
                }
                let file = file::read(&text).map_err(|it| not_a_plan(path, it.to_string()))?;
                let kept = Kept::default();
                return Ok(Sourced { file, kept });
            }
        }
        self.show(&paths, fleet)
    }

    fn show(&self, paths: &[PathBuf], fleet: Option<AirframesFile>) -> Result<Sourced, Failure> {
        let path = self.path();
        let mut unread = Vec::new();
        let mut files = Vec::with_capacity(paths.len());
        for path in paths {
            let bytes = std::fs::File::open(path);
            match bytes.and_then(|it| files::bytes_of(it, files::MOST_BYTES)) {
                Ok(bytes) => {
                    let name = path.file_name().unwrap_or_default().to_string_lossy();
                    let name = name.into_owned();
                    files.push(exchange::File { name, bytes });
                }
                Err(error) => unread.push(Failure::read(path)(error)),
            }
        }
        let manifest = self.folder().join(MANIFEST);
        let manifest = match files::text(&manifest, files::MOST_BYTES) {
            Ok(text) => Some(text),
            Err(error) if error.kind() == ErrorKind::NotFound => None,
            Err(error) => {
                unread.push(Failure::read(&manifest)(error));
                None
            }
        };
        if !unread.is_empty() {
            return Err(Failure::Several(unread));
        }
        let beside = Beside {
            manifest: manifest.as_deref(),
            is_folder: path.is_dir(),
        };
        let show = import::read_show(&files, beside).map_err(|errors| {
            if let [ShowError { file, error }] = &errors[..] {
                let named = |it: &&PathBuf| it.file_name().is_some_and(|it| *it == **file);
                let path = match &file[..] {
                    MANIFEST => self.folder().join(MANIFEST),
                    _ => paths
                        .iter()
                        .find(named)
                        .map_or(path, PathBuf::as_path)
                        .to_owned(),
                };
                return not_a_plan(&path, error.to_string());
            }
            not_a_plan(path, listed(&errors))
        })?;
        let Show {
            drones,
            kept,
            origin,
            remarks,
        } = show;
        let fleet = fleet.ok_or_else(|| no_airframe(path, "a show"))?;
        let plan = fleet.with_files(|files| {
            let name = match (path.is_dir(), self.paths.len()) {
                (false, 2..) => path.parent().map(stem).unwrap_or_default(),
                _ => stem(path),
            };
            intended_as_plan(&name, drones, &fleet.text, files)
        });
        let mut file = plan.map_err(|error| match error {
            IntendedError::Fleet(found) => fleet.drawn(&found),
            IntendedError::Drones(faults) => {
                let is_below = |it: &DroneFault| matches!(it, DroneFault::BelowFloor { .. });
                let help = match faults.iter().any(is_below) {
                    true => {
                        "; z_m counts up and d_m down: columns of the other kind have to be named \
                         so (x_m,y_m,z_m or n_m,e_m,d_m); a deeper floor is said by bounds_m \
                         (--airframes)"
                    }
                    false => "",
                };
                not_a_plan(path, listed(&faults) + help)
            }
            other => not_a_plan(path, other.to_string()),
        })?;
        file.remarks.splice(0..0, remarks);
        file.plan.origin = file.plan.origin.or(origin);
        Ok(Sourced { file, kept })
    }

    /// Where its files are.
    fn folder(&self) -> &Path {
        let path = self.path();
        match path.is_dir() {
            true => path,
            false => path.parent().unwrap_or(Path::new("")),
        }
    }

    /// The files. Of a folder those of one kind, in the order of their names.
    fn files(&self) -> Result<Vec<PathBuf>, Failure> {
        let path = self.path();
        if let Some(folder) = self.paths.iter().find(|it| it.is_dir())
            && self.paths.len() > 1
        {
            let why = "a folder is read by itself: name it alone, or the files";
            return Err(not_a_plan(folder, why.to_owned()));
        }
        if !path.is_dir() {
            return Ok(self.paths.clone());
        }
        let entries = std::fs::read_dir(path).map_err(Failure::read(path))?;
        let mut all: Vec<PathBuf> = entries.flatten().map(|it| it.path()).collect();
        all.sort();
        for ending in ["skyc", "csv", "skyb", "cfpoly"] {
            let is = |it: &&PathBuf| {
                it.extension()
                    .is_some_and(|it| it.eq_ignore_ascii_case(ending))
            };
            let of_kind: Vec<PathBuf> = all.iter().filter(is).cloned().collect();
            if !of_kind.is_empty() {
                return Ok(of_kind);
            }
        }
        let why = "a folder without .skyc, .csv, .skyb or .cfpoly files";
        Err(not_a_plan(path, why.to_owned()))
    }
}

/// A file's name without its ending; a folder's as it is.
fn stem(path: &Path) -> String {
    let name = match path.is_dir() {
        true => path.file_name(),
        false => path.file_stem(),
    };
    name.unwrap_or_default().to_string_lossy().into_owned()
}

/// What is wrong, a line each, as much of it as one reads.
fn listed(faults: &[impl Display]) -> String {
    let told = faults.iter().take(MOST_LISTED);
    let mut told: Vec<String> = told.map(ToString::to_string).collect();
    if faults.len() > MOST_LISTED {
        told.push(format!("and {} more", faults.len() - MOST_LISTED));
    }
    told.join("\n  ")
}

fn not_a_plan(path: &Path, reason: String) -> Failure {
    Failure::NotAPlan {
        path: path.to_owned(),
        reason,
    }
}

fn no_airframe(path: &Path, what: &str) -> Failure {
    let why = "says nothing of airframes: name one with --airframe NAME, or several with --airframes FLEET.ron";
    not_a_plan(path, format!("{what} {why}"))
}

/// The log of a flight as a plan.
fn log(path: &Path, text: &str, fleet: &AirframesFile) -> Result<Sourced, Failure> {
    let samples = read_samples(text);
    let plan = fleet.with_files(|files| {
        samples.and_then(|samples| samples_as_plan(&stem(path), &samples, &fleet.text, files))
    });
    let file = plan.map_err(|error| match error {
        FlownError::Fleet(found) => fleet.drawn(&found),
        other => not_a_plan(path, other.to_string()),
    })?;
    let kept = Kept::default();
    Ok(Sourced { file, kept })
}

/// Which airframes fly, as a text, and where it is from.
struct AirframesFile {
    text: String,
    path: PathBuf,
}

impl AirframesFile {
    fn read(path: &Path) -> Result<AirframesFile, Failure> {
        let text = files::text(path, MOST_SCENARIO_BYTES).map_err(Failure::read(path))?;
        Ok(AirframesFile {
            text,
            path: path.to_owned(),
        })
    }

    /// One preset for all.
    fn of_one(name: &str) -> Result<AirframesFile, Failure> {
        airflow::Airframe::named(name)?;
        Ok(AirframesFile {
            text: format!("Fleet(airframe: \"{name}\")"),
            path: PathBuf::from("--airframe"),
        })
    }

    /// What it cites lies beside it.
    fn with_files<T>(&self, then: impl FnOnce(&Files<'_>) -> T) -> T {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let load = |file: &str| {
            files::text(&folder.join(file), MOST_SCENARIO_BYTES).map_err(|it| it.to_string())
        };
        then(&Files::new(&load))
    }

    fn drawn(&self, found: &Problems) -> Failure {
        let name = self.path.display().to_string();
        let colour = problems::colour_on_stderr();
        Failure::Drawn(problems::draw(found, &name, &self.text, colour))
    }
}
