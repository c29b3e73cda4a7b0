//! Recordings at paths: which there are, what speaks for them, which are left out.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read as _};
use std::path::{Path, PathBuf};

use diagnosis::record::problem::{Problem, Problems};
use diagnosis::record::read::{self, Campaign, JoinedLog};
use diagnosis::record::recording::Recording;
use diagnosis::record::remark::{Remark, RemarkKind};
use rayon::prelude::*;
use thiserror::Error;

use crate::files::{self, MOST_BYTES, MOST_SCENARIO_BYTES};

/// What makes a folder a `downwash-recording/1`.
const META: &str = "meta.json";
/// What speaks for the flights beside it and below it.
const CAMPAIGN: &str = "campaign.ron";
/// Bytes of a log that are read at a time.
const PIECE: usize = 1 << 16;
/// How many folders above a flight its campaign file is looked for.
const PARENTS: usize = 2;
/// A folder of this name holds the flights of the folder that it is in.
const FLIGHTS: &str = "flights";

/// Recordings sorted by name, and what was left out: each with the name of its recording.
#[derive(Debug)]
pub struct ReadAll {
    /// Those that are in order.
    pub recordings: Vec<Recording>,
    /// Those that are not, and copies.
    pub left_out: Vec<(String, Remark)>,
}

/// Why recordings are not read.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The disk refused.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// What.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// What is wrong with them, each at its place: a line each, and one for its help.
    #[error("{}", with_helps(.0))]
    Problems(Problems),
    /// Several of these, a line or more each.
    #[error("{}", lines(.0))]
    Several(Vec<LoadError>),
}

fn with_helps(Problems(problems): &Problems) -> String {
    let line = |it: &Problem| match &it.help {
        Some(help) => format!("{it}\nhelp: {help}"),
        None => it.to_string(),
    };
    lines(&problems.iter().map(line).collect::<Vec<String>>())
}

fn lines<T: ToString>(all: &[T]) -> String {
    all.iter().map(T::to_string).collect::<Vec<_>>().join("\n")
}

impl LoadError {
    fn read(path: &Path) -> impl FnOnce(std::io::Error) -> LoadError {
        let path = path.to_owned();
        move |source| LoadError::Read { path, source }
    }
}

/// What flight logs leave unsaid.
#[derive(Clone, Copy, Debug)]
pub struct Meta<'m> {
    /// The campaign file; `None`: that beside or above each log.
    pub file: Option<&'m Path>,
    /// How a user names one, for who has none: `--meta`.
    pub option: &'m str,
}

/// Reads every recording at `paths`: folders with a meta.json; flight logs, alone or in a folder.
/// One that is named must be in order; of those that only its folder names, one that is not is left
/// out.
///
/// # Errors
///
/// Paths that cannot be read, all that is wrong with what is named, and that nothing is in order.
pub fn read_all(paths: &[PathBuf], meta: Meta<'_>) -> Result<ReadAll, LoadError> {
    let mut sources = Vec::new();
    let mut passed = Vec::new();
    let found = paths
        .iter()
        .map(|path| find(path, &mut sources, &mut passed));
    let missing: Vec<LoadError> = found.filter_map(Result::err).collect();
    if !missing.is_empty() {
        return Err(LoadError::Several(missing));
    }
    sources.sort();
    sources.dedup();
    let copies = take_copies(&mut sources)?;
    let campaigns: Vec<Option<PathBuf>> = sources
        .iter()
        .map(|source| source.campaign(meta))
        .collect::<Result<_, LoadError>>()?;
    let mut parsed = BTreeMap::new();
    for file in campaigns.iter().flatten() {
        if !parsed.contains_key(file) {
            let text = files::text(file, MOST_SCENARIO_BYTES).map_err(LoadError::read(file))?;
            let campaign =
                Campaign::parse(&file.display().to_string(), &text).map_err(LoadError::Problems)?;
            parsed.insert(file, campaign);
        }
    }
    let (sources, campaigns) = joined(sources, &campaigns, &parsed)?;
    let read: Vec<Result<Result<Recording, Problems>, LoadError>> = sources
        .par_iter()
        .zip(campaigns)
        .map(|(source, file)| source.read(file.map(|file| &parsed[file])))
        .collect();
    let mut recordings = Vec::with_capacity(read.len());
    let (mut problems, mut bad) = (Vec::new(), Vec::new());
    for (source, one) in sources.iter().zip(read) {
        match one? {
            Ok(recording) => recordings.push(recording),
            Err(Problems(more)) if paths.contains(&source.path) => problems.extend(more),
            Err(more) => bad.push((source, more.0)),
        }
    }
    if recordings.is_empty() || !problems.is_empty() {
        problems.extend(bad.into_iter().flat_map(|(_, more)| more));
        return Err(LoadError::Problems(Problems(problems)));
    }
    let mut left_out = Vec::new();
    let mut tell = |name: &str, message| {
        let remark = Remark::new(RemarkKind::Unused, None, message);
        left_out.push((name.to_owned(), remark));
    };
    for (source, problems) in bad {
        let told = problems.first().map_or(String::new(), |problem| {
            let help = problem.help.iter().map(|help| format!(" ({help})"));
            format!(": {problem}{}", help.collect::<String>())
        });
        let message = format!("{} is left out{told}", source.path.display());
        tell(&source.name, message);
    }
    // One that is named beside the folder that it is in is not passed over.
    for folder in passed.into_iter().filter(|it| !paths.contains(it)) {
        let name = file_name(&folder).to_owned();
        let folder = folder.display();
        let message = format!("{folder} is left out: it holds recordings of its own; name it, too");
        tell(&name, message);
    }
    for (copy, of) in copies {
        let message = format!(
            "{} is a copy of {}: one flight",
            copy.path.display(),
            of.display()
        );
        tell(&copy.name, message);
    }
    Ok(ReadAll {
        recordings,
        left_out,
    })
}

/// Logs that are of one flight by their campaign become one source, which takes the place of the
/// first.
fn joined<'f>(
    sources: Vec<Source>,
    campaigns: &'f [Option<PathBuf>],
    parsed: &BTreeMap<&'f PathBuf, Campaign>,
) -> Result<(Vec<Source>, Vec<Option<&'f PathBuf>>), LoadError> {
    let mut all: Vec<(Source, Option<&PathBuf>)> = sources
        .into_iter()
        .zip(campaigns.iter().map(Option::as_ref))
        .collect();
    let mut problems = Vec::new();
    for (&file, campaign) in parsed {
        for (flight, logs) in &campaign.joined.0 {
            let place = |all: &[(Source, Option<&PathBuf>)], log: &str| {
                let is_it = |(source, of): &(Source, Option<&PathBuf>)| {
                    source.kind == Kind::Log && source.name == log && *of == Some(file)
                };
                all.iter().position(is_it)
            };
            let there: Vec<&String> = (logs.0.iter().map(|(_, log)| log))
                .filter(|log| place(&all, log).is_some())
                .collect();
            // Another flight of the campaign may be what is asked for.
            if there.is_empty() {
                continue;
            }
            if !files::is_plain(flight) {
                problems.push(Problem {
                    file: file.display().to_string(),
                    line: None,
                    field: Some("joined".to_owned()),
                    message: format!("flight `{flight}` has the name of a path"),
                    help: Some("a folder is named after it: leave out what / separates".to_owned()),
                });
            }
            let mut parts = Vec::new();
            for (vehicle, log) in &logs.0 {
                match place(&all, log) {
                    Some(at) => {
                        let (source, _) = all.remove(at);
                        parts.push((vehicle.clone(), log.clone(), source.path));
                    }
                    None => problems.push(Problem {
                        file: file.display().to_string(),
                        line: None,
                        field: Some("joined".to_owned()),
                        message: format!("`{log}` of flight `{flight}` is not among the logs"),
                        help: Some("name the folder that holds all of its logs".to_owned()),
                    }),
                }
            }
            let path = parts
                .first()
                .map_or_else(PathBuf::new, |(.., path)| path.clone());
            let source = Source {
                name: flight.clone(),
                path,
                kind: Kind::Joined(parts),
            };
            all.push((source, Some(file)));
        }
    }
    if !problems.is_empty() {
        return Err(LoadError::Problems(Problems(problems)));
    }
    all.sort();
    Ok(all.into_iter().unzip())
}

/// Takes out logs that hold the same bytes as one before; with each the other's path.
fn take_copies(sources: &mut Vec<Source>) -> Result<Vec<(Source, PathBuf)>, LoadError> {
    let mut by_size: BTreeMap<u64, Vec<PathBuf>> = BTreeMap::new();
    let (mut copies, mut kept) = (Vec::new(), Vec::new());
    for source in std::mem::take(sources) {
        if source.kind != Kind::Log {
            kept.push(source);
            continue;
        }
        let path = &source.path;
        let of = fs::metadata(path).map_err(LoadError::read(path))?;
        let alike = by_size.entry(of.len()).or_default();
        let is_same = |other: &&PathBuf| matches!(is_same(path, other), Ok(true));
        match alike.iter().find(is_same).cloned() {
            Some(other) => copies.push((source, other)),
            None => {
                alike.push(path.clone());
                kept.push(source);
            }
        }
    }
    *sources = kept;
    Ok(copies)
}

/// Whether two files of one size hold the same bytes; read piece by piece.
fn is_same(one: &Path, other: &Path) -> std::io::Result<bool> {
    let open = |path| Ok::<_, std::io::Error>(BufReader::new(fs::File::open(path)?));
    let (mut one, mut other) = (open(one)?, open(other)?);
    loop {
        let (a, b) = (one.fill_buf()?, other.fill_buf()?);
        let read = a.len().min(b.len());
        if read == 0 || a[..read] != b[..read] {
            return Ok(a.is_empty() && b.is_empty());
        }
        one.consume(read);
        other.consume(read);
    }
}

/// What a run is about: the folder that was named first, or the first recording.
#[must_use]
pub fn name_of(paths: &[PathBuf], recording: &str) -> String {
    let folder = paths.first().filter(|path| path.is_dir()).and_then(|path| {
        let path = fs::canonicalize(path).ok()?;
        Some(path.file_name()?.to_string_lossy().into_owned())
    });
    folder.unwrap_or_else(|| recording.to_owned())
}

/// What one recording is read from; in the order of names.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Source {
    /// Of the recording.
    name: String,
    /// The log, or the folder that its tables are in.
    path: PathBuf,
    kind: Kind,
}

#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    /// A folder with a meta.json.
    Folder,
    /// A flight log.
    Log,
    /// Tables that `ulog2csv` made of one log, whose name theirs begin with.
    Tables,
    /// Logs of one flight: of each its vehicle, its name and where it is.
    Joined(Vec<(String, String, PathBuf)>),
}

/// Adds what is at `path`: a recording, a flight, or a folder of either.
/// Folders in it that hold recordings of their own are passed over.
fn find(
    path: &Path,
    sources: &mut Vec<Source>,
    passed: &mut Vec<PathBuf>,
) -> Result<(), LoadError> {
    let of = fs::metadata(path).map_err(LoadError::read(path))?;
    if !of.is_dir() {
        let log = Source::log(path.to_owned());
        let help = format!("logs are {}", read::LOG_FILES);
        sources.push(log.ok_or_else(|| unusable(path, "is no flight log", &help))?);
        return Ok(());
    }
    if path.join(META).is_file() {
        sources.push(Source::folder(path.to_owned()));
        return Ok(());
    }
    let flights = path.join(FLIGHTS);
    let folder = if flights.is_dir() { &flights } else { path };
    let before = sources.len();
    let entries = entries(folder)?;
    let logs = logs_of_tables(&entries);
    let passed_before = passed.len();
    for entry in entries {
        // One without its meta.json is told when it is read.
        if holds_tables(&entry) {
            sources.push(Source::folder(entry));
        } else if entry.is_file() && !is_of(&entry, &logs) {
            sources.extend(Source::log(entry));
        } else if entry.is_dir() && holds_recordings(&entry) {
            passed.push(entry);
        }
    }
    sources.extend(logs.into_iter().map(|name| Source {
        name,
        path: folder.to_owned(),
        kind: Kind::Tables,
    }));
    if sources.len() == before {
        let within: Vec<String> = (passed.drain(passed_before..))
            .map(|folder| folder.display().to_string())
            .collect();
        let help = match within.is_empty() {
            true => format!(
                "a recording is a folder with a meta.json, a flight log ({}), or a folder of either",
                read::LOG_FILES
            ),
            false => format!("folders in it do; name them: {}", within.join(" ")),
        };
        return Err(unusable(path, "holds no recording", &help));
    }
    Ok(())
}

/// Whether a folder is a recording, or would be one with its meta.json.
fn holds_tables(folder: &Path) -> bool {
    let mut files = read::FOLDER_FILES.iter();
    files.any(|file| folder.join(file).is_file())
}

/// Whether a folder in one that is named holds recordings itself, as far as it can be read.
fn holds_recordings(folder: &Path) -> bool {
    let is_one = |it: PathBuf| holds_tables(&it) || (it.is_file() && Source::log(it).is_some());
    entries(folder).is_ok_and(|all| all.into_iter().any(is_one))
}

/// What is in a folder, sorted.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, LoadError> {
    let mut entries = Vec::new();
    for entry in fs::read_dir(folder).map_err(LoadError::read(folder))? {
        entries.push(entry.map_err(LoadError::read(folder))?.path());
    }
    entries.sort();
    Ok(entries)
}

/// Logs of which `ulog2csv` has written the position, by which one knows them.
fn logs_of_tables(entries: &[PathBuf]) -> Vec<String> {
    let names = entries.iter().map(|path| file_name(path));
    names
        .filter_map(read::table_name)
        .filter(|(_, topic, instance)| *topic == "vehicle_local_position" && *instance == 0)
        .map(|(log, _, _)| log.to_owned())
        .collect()
}

/// Whether a table is one of those that `ulog2csv` made of one of these logs; it makes one of every
/// topic.
fn is_of(path: &Path, logs: &[String]) -> bool {
    let rest = |log: &String| {
        file_name(path)
            .strip_prefix(log.as_str())?
            .strip_prefix('_')
    };
    logs.iter()
        .filter_map(rest)
        .any(|rest| rest.ends_with(".csv"))
}

/// Empty where it is not Unicode.
fn file_name(path: &Path) -> &str {
    let name = path.file_name().and_then(|name| name.to_str());
    name.unwrap_or_default()
}

fn unusable(path: &Path, message: &str, help: &str) -> LoadError {
    LoadError::Problems(Problems(vec![Problem {
        file: path.display().to_string(),
        line: None,
        field: None,
        message: message.to_owned(),
        help: Some(help.to_owned()),
    }]))
}

impl Source {
    fn folder(path: PathBuf) -> Source {
        let whole = fs::canonicalize(&path).unwrap_or_else(|_| path.clone());
        let name = whole.file_name().unwrap_or_default();
        Source {
            name: name.to_string_lossy().into_owned(),
            path,
            kind: Kind::Folder,
        }
    }

    /// `None` where neither the file's name nor its first bytes are a log's.
    fn log(path: PathBuf) -> Option<Source> {
        let name = read::log_name(file_name(&path), &head(&path))?.to_owned();
        Some(Source {
            name,
            kind: Kind::Log,
            path,
        })
    }

    /// Its campaign file: `meta`, else the one beside it or in a folder above; `None` where it
    /// needs none.
    fn campaign(&self, meta: Meta<'_>) -> Result<Option<PathBuf>, LoadError> {
        let folder = match (&self.kind, meta.file) {
            (Kind::Folder, _) => return Ok(None),
            (_, Some(file)) => return Ok(Some(file.to_owned())),
            (Kind::Log | Kind::Joined(_), None) => self.path.parent().unwrap_or(Path::new("")),
            (Kind::Tables, None) => &self.path,
        };
        // Parents of a relative path end where the path does; the disk knows further.
        let folder = fs::canonicalize(Path::new(".").join(folder)).unwrap_or_default();
        let mut candidates = folder.ancestors().take(1 + PARENTS);
        let found = candidates.find_map(|up| Some(up.join(CAMPAIGN)).filter(|file| file.is_file()));
        let help = || {
            format!(
                "name one with {}, or put a {CAMPAIGN} beside it or up to {PARENTS} folders above. The fewest lines that would do, with each ? filled in:\n\n{}\nrecordings/README.md says what else it may hold",
                meta.option,
                self.needed()
            )
        };
        let missing = || unusable(&self.path, "has no campaign file", &help());
        found.ok_or_else(missing).map(Some)
    }

    /// The fewest lines of a campaign file that would do.
    fn needed(&self) -> String {
        let file = self.path.display().to_string();
        let bytes = match self.kind {
            Kind::Log => bytes(&self.path).unwrap_or_default(),
            // PX4's, of which the name says all that is asked, or such as have one.
            Kind::Tables | Kind::Folder | Kind::Joined(_) => Vec::new(),
        };
        read::needed(&self.name, &file, &bytes)
    }

    /// Its problems, or what the disk refused.
    fn read(&self, campaign: Option<&Campaign>) -> Result<Result<Recording, Problems>, LoadError> {
        let campaign = || campaign.expect("every flight has one, or was refused");
        let name = &self.name;
        if self.kind == Kind::Log {
            let file = self.path.display().to_string();
            return Ok(read::read_log(name, &file, opened(&self.path)?, campaign()));
        }
        if let Kind::Joined(parts) = &self.kind {
            let log = |(vehicle, log, path): &(String, String, PathBuf)| {
                Ok(JoinedLog {
                    vehicle: vehicle.clone(),
                    log: log.clone(),
                    file: path.display().to_string(),
                    bytes: opened(path)?,
                })
            };
            let logs = parts
                .iter()
                .map(log)
                .collect::<Result<Vec<_>, LoadError>>()?;
            return Ok(read::read_joined(name, logs, campaign()));
        }
        let is_wanted = |file: &str| match self.kind {
            Kind::Tables => read::table_name(file).is_some_and(|(of, _, _)| of == name),
            _ => read::FOLDER_FILES.contains(&file),
        };
        let mut files = BTreeMap::new();
        for path in entries(&self.path)? {
            let file = file_name(&path);
            if is_wanted(file) && path.is_file() {
                files.insert(file.to_owned(), bytes(&path)?);
            }
        }
        let read = match self.kind {
            Kind::Tables => read::read_ulog_tables(name, &files, campaign()),
            _ => read::read_folder(name, &files),
        };
        // Files are named as they lie on the disk.
        Ok(read.map_err(|Problems(mut problems)| {
            for problem in &mut problems {
                problem.file = self.path.join(&problem.file).display().to_string();
            }
            Problems(problems)
        }))
    }
}

/// The first bytes of a file, which say what it is; empty where it cannot be read, which is told
/// when all of it is.
fn head(path: &Path) -> Vec<u8> {
    let mut head = Vec::new();
    let read = fs::File::open(path).and_then(|file| {
        file.take(read::LOG_HEAD_BYTES as u64)
            .read_to_end(&mut head)
    });
    read.map_or(Vec::new(), |_| head)
}

/// A log from its beginning, unpacked where its name ends in `.gz`, as it is read.
fn opened(path: &Path) -> Result<Box<dyn BufRead>, LoadError> {
    let file = fs::File::open(path).map_err(LoadError::read(path))?;
    let file = BufReader::with_capacity(PIECE, file);
    let is_packed = path.extension().is_some_and(|ending| ending == "gz");
    Ok(match is_packed {
        true => {
            let unpacked = flate2::bufread::MultiGzDecoder::new(file);
            Box::new(BufReader::with_capacity(PIECE, unpacked))
        }
        false => Box::new(file),
    })
}

/// The bytes of a file, unpacked where its name ends in `.gz`.
fn bytes(path: &Path) -> Result<Vec<u8>, LoadError> {
    files::bytes_of(opened(path)?, MOST_BYTES).map_err(LoadError::read(path))
}

#[cfg(test)]
mod tests;
