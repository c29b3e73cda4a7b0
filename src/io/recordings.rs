//! Recordings from disk: which files there are, their bytes, and their problems as a person reads them.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use annotate_snippets::{Group, Level, Renderer};
use diagnosis::record::problem::{Problem, Problems};
use diagnosis::record::read::{self, Campaign};
use diagnosis::record::recording::Recording;
use rayon::prelude::*;

use crate::io::failure::Failure;
use crate::io::problems::colour_on_stderr;

/// What makes a folder a `downwash-recording/1`.
const META: &str = "meta.json";
/// What speaks for the flights beside it and below it.
const CAMPAIGN: &str = "campaign.ron";
/// How many folders above a flight its campaign file is looked for.
const PARENTS: usize = 2;
/// A folder of this name holds the flights of the folder that it is in.
const FLIGHTS: &str = "flights";
/// Endings of flight logs, with what may pack them.
const ENDINGS: [&str; 4] = [".csv.gz", ".csv", ".ulg.gz", ".ulg"];
/// Most problems printed. Chosen here: two screens' worth; nobody mends more at once.
const MOST_PRINTED: usize = 40;

/// Reads every recording at `paths`, sorted by name: folders with a meta.json; flight logs, alone or in a folder, with the campaign
/// file `meta`, or the campaign.ron beside or above them.
pub(crate) fn read_all(paths: &[PathBuf], meta: Option<&Path>) -> Result<Vec<Recording>, Failure> {
    let mut sources = Vec::new();
    for path in paths {
        find(path, &mut sources)?;
    }
    sources.sort_by(|a, b| (a.name(), a.path()).cmp(&(b.name(), b.path())));
    sources.dedup_by(|a, b| a.path() == b.path() && a.name() == b.name());
    let campaigns = campaigns(&sources, meta)?;
    let read: Vec<Result<Recording, Failed>> = sources
        .par_iter()
        .map(|source| source.read(&campaigns))
        .collect();
    let mut recordings = Vec::with_capacity(read.len());
    let mut problems = Vec::new();
    for one in read {
        match one {
            Ok(recording) => recordings.push(recording),
            Err(Failed::Disk(failure)) => return Err(failure),
            Err(Failed::Recording(Problems(more))) => problems.extend(more),
        }
    }
    match problems.as_slice() {
        [] => Ok(recordings),
        _ => Err(Failure::Recordings(drawn(&problems, colour_on_stderr()))),
    }
}

/// What a run is about: the folder that was named first, or the first recording.
pub(crate) fn name_of(paths: &[PathBuf], recording: &str) -> String {
    let folder = paths.first().filter(|path| path.is_dir()).and_then(|path| {
        let path = fs::canonicalize(path).ok()?;
        Some(path.file_name()?.to_string_lossy().into_owned())
    });
    folder.unwrap_or_else(|| recording.to_owned())
}

/// What one recording is read from.
#[derive(Debug)]
enum Source {
    /// A folder with a meta.json.
    Folder(PathBuf),
    /// A flight log.
    Flight(PathBuf),
    /// Tables that `ulog2csv` made of one log.
    Tables {
        /// The folder that they are in.
        folder: PathBuf,
        /// What their names begin with: the log's name.
        log: String,
    },
}

/// Why one recording was not read.
enum Failed {
    Disk(Failure),
    Recording(Problems),
}

/// Campaign files by the folder that they were found for; one for all under the empty path.
type Campaigns = BTreeMap<PathBuf, Campaign>;

/// Adds what is at `path`: a recording, a flight, or a folder of either.
fn find(path: &Path, sources: &mut Vec<Source>) -> Result<(), Failure> {
    let kind = fs::metadata(path).map_err(Failure::read(path))?;
    if !kind.is_dir() {
        if stem(path).is_none() {
            return Err(unusable(
                path,
                "is no flight log",
                "logs end in .csv, .csv.gz or .ulg",
            ));
        }
        sources.push(Source::Flight(path.to_owned()));
        return Ok(());
    }
    if path.join(META).is_file() {
        sources.push(Source::Folder(path.to_owned()));
        return Ok(());
    }
    let flights = path.join(FLIGHTS);
    let folder = if flights.is_dir() { &flights } else { path };
    let before = sources.len();
    let entries = entries(folder)?;
    let logs = logs_of_tables(&entries);
    for entry in entries {
        if entry.join(META).is_file() {
            sources.push(Source::Folder(entry));
        } else if entry.is_file() && stem(&entry).is_some() && !is_of(&entry, &logs) {
            sources.push(Source::Flight(entry));
        }
    }
    sources.extend(logs.into_iter().map(|log| Source::Tables {
        folder: folder.to_owned(),
        log,
    }));
    if sources.len() == before {
        let help = "a recording is a folder with a meta.json, a flight log (.csv, .csv.gz, .ulg), or a folder of either";
        return Err(unusable(path, "holds no recording", help));
    }
    Ok(())
}

/// What is in a folder, sorted.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let mut entries = Vec::new();
    for entry in fs::read_dir(folder).map_err(Failure::read(folder))? {
        entries.push(entry.map_err(Failure::read(folder))?.path());
    }
    entries.sort();
    Ok(entries)
}

/// Logs of which `ulog2csv` has written the position, by which one knows them.
fn logs_of_tables(entries: &[PathBuf]) -> Vec<String> {
    let names = entries.iter().filter_map(|path| path.file_name()?.to_str());
    names
        .filter_map(read::table_name)
        .filter(|(_, topic, instance)| *topic == "vehicle_local_position" && *instance == 0)
        .map(|(log, _, _)| log.to_owned())
        .collect()
}

/// Whether a table is one of those that `ulog2csv` made of one of these logs; it makes one of every topic.
fn is_of(path: &Path, logs: &[String]) -> bool {
    let name = path
        .file_name()
        .and_then(|name| name.to_str())
        .unwrap_or_default();
    let of = |log: &String| {
        let rest = name
            .strip_prefix(log.as_str())
            .and_then(|rest| rest.strip_prefix('_'));
        rest.is_some_and(|rest| rest.ends_with(".csv"))
    };
    logs.iter().any(of)
}

/// The name of a flight log without its ending; `None` where it ends otherwise.
fn stem(path: &Path) -> Option<&str> {
    let name = path.file_name()?.to_str()?;
    let stem = ENDINGS.iter().find_map(|ending| name.strip_suffix(ending));
    stem.filter(|stem| !stem.is_empty() && !stem.starts_with('.'))
}

fn unusable(path: &Path, message: &str, help: &str) -> Failure {
    let problem = Problem {
        file: path.display().to_string(),
        line: None,
        field: None,
        message: message.to_owned(),
        help: Some(help.to_owned()),
    };
    Failure::Recordings(drawn(&[problem], colour_on_stderr()))
}

/// Reads every campaign file that the flights need, each once.
fn campaigns(sources: &[Source], meta: Option<&Path>) -> Result<Campaigns, Failure> {
    let mut campaigns = Campaigns::new();
    let flights = sources
        .iter()
        .filter_map(|source| Some((source.path(), source.folder()?)));
    let mut problems = Vec::new();
    for (flight, folder) in flights {
        let folder = match meta {
            Some(_) => PathBuf::new(),
            None => folder,
        };
        if campaigns.contains_key(&folder) {
            continue;
        }
        let file = match meta {
            Some(file) => file.to_owned(),
            None => beside(&folder).ok_or_else(|| {
                let help = format!(
                    "name one with --meta, or put a {CAMPAIGN} beside it or up to {PARENTS} folders above; recordings/README.md says what it holds"
                );
                unusable(flight, "has no campaign file", &help)
            })?,
        };
        let text = fs::read_to_string(&file).map_err(Failure::read(&file))?;
        match Campaign::parse(&file.display().to_string(), &text) {
            Ok(campaign) => {
                campaigns.insert(folder, campaign);
            }
            Err(Problems(more)) => {
                problems.extend(more);
                break;
            }
        }
    }
    match problems.as_slice() {
        [] => Ok(campaigns),
        _ => Err(Failure::Recordings(drawn(&problems, colour_on_stderr()))),
    }
}

/// The campaign file of a folder: in it or in one of its parents.
fn beside(folder: &Path) -> Option<PathBuf> {
    // Parents of a relative path end where the path does; the disk knows further.
    let folder = fs::canonicalize(if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    });
    let folder = folder.ok()?;
    let candidates = folder
        .ancestors()
        .take(1 + PARENTS)
        .map(|up| up.join(CAMPAIGN));
    candidates.into_iter().find(|file| file.is_file())
}

impl Source {
    fn path(&self) -> &Path {
        match self {
            Source::Folder(path) | Source::Flight(path) | Source::Tables { folder: path, .. } => {
                path
            }
        }
    }

    /// The folder for which a campaign file is looked for; `None` where none is needed.
    fn folder(&self) -> Option<PathBuf> {
        match self {
            Source::Folder(_) => None,
            Source::Flight(path) => Some(path.parent().map(Path::to_owned).unwrap_or_default()),
            Source::Tables { folder, .. } => Some(folder.clone()),
        }
    }

    fn name(&self) -> String {
        match self {
            Source::Folder(path) => {
                let path = fs::canonicalize(path).unwrap_or_else(|_| path.clone());
                path.file_name()
                    .map(|name| name.to_string_lossy().into_owned())
                    .unwrap_or_default()
            }
            Source::Flight(path) => stem(path).unwrap_or_default().to_owned(),
            Source::Tables { log, .. } => log.clone(),
        }
    }

    fn read(&self, campaigns: &Campaigns) -> Result<Recording, Failed> {
        match self {
            Source::Folder(folder) => read_folder(&self.name(), folder),
            Source::Flight(path) => {
                let bytes = bytes(path).map_err(Failed::Disk)?;
                let file = path.display().to_string();
                let read = if is_ulog(path) {
                    read::read_ulog
                } else {
                    read::read_flight
                };
                read(&self.name(), &file, &bytes, self.campaign(campaigns))
                    .map_err(Failed::Recording)
            }
            Source::Tables { folder, log } => {
                let files = tables(folder, log)?;
                read::read_ulog_tables(log, &files, self.campaign(campaigns))
                    .map_err(|problems| below(folder, problems))
            }
        }
    }

    fn campaign<'c>(&self, campaigns: &'c Campaigns) -> &'c Campaign {
        let all = campaigns.get(Path::new(""));
        all.or_else(|| campaigns.get(&self.folder()?))
            .expect("`campaigns` has read one for every flight")
    }
}

fn is_ulog(path: &Path) -> bool {
    let name = path
        .file_name()
        .map(|name| name.to_string_lossy().into_owned());
    name.is_some_and(|name| name.trim_end_matches(".gz").ends_with(".ulg"))
}

/// The tables of one log that are read, by name.
fn tables(folder: &Path, log: &str) -> Result<BTreeMap<String, Vec<u8>>, Failed> {
    let mut files = BTreeMap::new();
    for path in entries(folder).map_err(Failed::Disk)? {
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else {
            continue;
        };
        if read::table_name(name).is_some_and(|(of, _, _)| of == log) {
            files.insert(name.to_owned(), bytes(&path).map_err(Failed::Disk)?);
        }
    }
    Ok(files)
}

/// Problems whose files are named as they lie on the disk.
fn below(folder: &Path, Problems(mut problems): Problems) -> Failed {
    for problem in &mut problems {
        problem.file = folder.join(&problem.file).display().to_string();
    }
    Failed::Recording(Problems(problems))
}

fn read_folder(name: &str, folder: &Path) -> Result<Recording, Failed> {
    let mut files = BTreeMap::new();
    for file in read::FOLDER_FILES {
        let path = folder.join(file);
        if path.is_file() {
            files.insert(file.to_owned(), bytes(&path).map_err(Failed::Disk)?);
        }
    }
    read::read_folder(name, &files).map_err(|problems| below(folder, problems))
}

/// The bytes of a file, unpacked where its name ends in `.gz`.
fn bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    let packed = fs::read(path).map_err(Failure::read(path))?;
    if path.extension().is_none_or(|ending| ending != "gz") {
        return Ok(packed);
    }
    let mut bytes = Vec::with_capacity(6 * packed.len()); // tables of numbers pack to a sixth to a quarter
    flate2::read::MultiGzDecoder::new(packed.as_slice())
        .read_to_end(&mut bytes)
        .map_err(Failure::read(path))?;
    Ok(bytes)
}

/// Problems one below the other, with their ways out, and a last line that counts them.
fn drawn(problems: &[Problem], colour: bool) -> String {
    let renderer = if colour {
        Renderer::styled()
    } else {
        Renderer::plain()
    };
    let mut drawn = String::new();
    for problem in problems.iter().take(MOST_PRINTED) {
        let title = problem.to_string();
        let mut group = Group::with_title(Level::ERROR.primary_title(title.as_str()));
        if let Some(help) = &problem.help {
            group = group.element(Level::HELP.message(help.as_str()));
        }
        drawn.push_str(&renderer.render(&[group]));
        drawn.push_str("\n\n");
    }
    let count = problems.len();
    if count > MOST_PRINTED {
        drawn.push_str(&format!("... and {} more\n\n", count - MOST_PRINTED));
    }
    let word = if count == 1 { "error" } else { "errors" };
    drawn.push_str(&format!("{count} {word}\n"));
    drawn
}

#[cfg(test)]
mod tests;
