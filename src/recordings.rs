//! Recordings from disk: which files there are, their bytes, and their problems as a person reads them.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use annotate_snippets::{Group, Level, Renderer};
use diagnosis::problem::{Problem, Problems};
use diagnosis::read::{self, Campaign};
use diagnosis::recording::Recording;
use rayon::prelude::*;

use crate::failure::Failure;
use crate::problems::colour_on_stderr;

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

/// What one recording is read from.
#[derive(Debug)]
enum Source {
    /// A folder with a meta.json.
    Folder(PathBuf),
    /// A flight log.
    Flight(PathBuf),
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
    let mut entries = Vec::new();
    for entry in fs::read_dir(folder).map_err(Failure::read(folder))? {
        entries.push(entry.map_err(Failure::read(folder))?.path());
    }
    entries.sort();
    for entry in entries {
        if entry.join(META).is_file() {
            sources.push(Source::Folder(entry));
        } else if entry.is_file() && stem(&entry).is_some() {
            sources.push(Source::Flight(entry));
        }
    }
    if sources.len() == before {
        let help = "a recording is a folder with a meta.json, a flight log (.csv, .csv.gz, .ulg), or a folder of either";
        return Err(unusable(path, "holds no recording", help));
    }
    Ok(())
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
    let flights = sources.iter().filter_map(|source| match source {
        Source::Flight(path) => Some(path),
        Source::Folder(_) => None,
    });
    let mut problems = Vec::new();
    for flight in flights {
        let folder = match meta {
            Some(_) => PathBuf::new(),
            None => folder_of(flight),
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

fn folder_of(flight: &Path) -> PathBuf {
    flight.parent().map(Path::to_owned).unwrap_or_default()
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
            Source::Folder(path) | Source::Flight(path) => path,
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
        }
    }

    fn read(&self, campaigns: &Campaigns) -> Result<Recording, Failed> {
        match self {
            Source::Folder(folder) => read_folder(&self.name(), folder),
            Source::Flight(path) => {
                let bytes = bytes(path).map_err(Failed::Disk)?;
                let all = campaigns.get(Path::new(""));
                let campaign = all.or_else(|| campaigns.get(&folder_of(path)));
                let campaign = campaign.expect("every flight's campaign was read before");
                let file = path.display().to_string();
                read::read_flight(&self.name(), &file, &bytes, campaign).map_err(Failed::Recording)
            }
        }
    }
}

fn read_folder(name: &str, folder: &Path) -> Result<Recording, Failed> {
    let mut files = BTreeMap::new();
    for file in read::FOLDER_FILES {
        let path = folder.join(file);
        if path.is_file() {
            files.insert(file.to_owned(), bytes(&path).map_err(Failed::Disk)?);
        }
    }
    read::read_folder(name, &files).map_err(|Problems(mut problems)| {
        for problem in &mut problems {
            problem.file = folder.join(&problem.file).display().to_string();
        }
        Failed::Recording(Problems(problems))
    })
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
