//! What the commands on recordings share: their arguments, and how they answer.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use diagnosis::infer::noticed::RemarkOf;
use diagnosis::record::recording::Recording;
use loader::recordings::{self, Meta, ReadAll};
use serde::Serialize;

use super::answers;
use crate::io::answer::Format;
use crate::io::failure::Failure;
use crate::io::files::OutFolder;
use crate::report::sections::Report;

/// A campaign file that is named, or none.
pub(crate) fn meta(file: Option<&Path>) -> Meta<'_> {
    let option = "--meta";
    Meta { file, option }
}

#[derive(Args, Clone)]
pub(crate) struct Asked {
    /// Recordings: folders with a meta.json, flight logs (.csv, .csv.gz, .ulg, .bin, .mcap, of
    /// a Crazyflie's card), or folders of either
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// What flight logs leave unsaid (RON) [default: the campaign.ron beside or above them]
    #[arg(long, value_name = "FILE")]
    meta: Option<PathBuf>,
    /// How to print the answer: one object, or a list of them where several recordings are
    /// diagnosed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub(crate) format: Format,
    /// Folder for report.html, figures, tables, RON and JSON; of several recordings diagnosed each
    /// gets a folder in it; one that holds another command's output is refused [default:
    /// out/COMMAND/NAME, that of the first recording]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Whether the answer is written and not printed.
    #[arg(skip)]
    is_silent: bool,
}

/// What a run is about: recordings, what it is called, and what was noticed about those that it
/// leaves out.
pub(crate) struct Read {
    pub(crate) recordings: Vec<Recording>,
    pub(crate) name: String,
    pub(crate) left_out: Vec<RemarkOf>,
}

/// More remarks of a kind than these are counted, not printed; the JSON has all.
const REMARKS_OF_A_KIND: usize = 6;

/// Every remark with its recording; of many of a kind the first few and a count.
pub(crate) fn sentences<'r>(
    remarks: impl IntoIterator<Item = &'r RemarkOf>,
    file: &str,
) -> Vec<String> {
    let mut found: Vec<&RemarkOf> = remarks.into_iter().collect();
    found.sort_by_key(|of| of.remark.kind);
    let mut sentences = Vec::new();
    for of_kind in found.chunk_by(|a, b| a.remark.kind == b.remark.kind) {
        for RemarkOf { recording, remark } in of_kind.iter().take(REMARKS_OF_A_KIND) {
            let subject = remark.subject.iter().map(|subject| format!(", {subject}"));
            let subject: String = subject.collect();
            sentences.push(format!("{recording}{subject}: {}", remark.message));
        }
        if of_kind.len() > REMARKS_OF_A_KIND {
            let more = of_kind.len() - REMARKS_OF_A_KIND;
            sentences.push(format!("and {more} more of the kind, see {file}"));
        }
    }
    sentences
}

impl Asked {
    /// Every recording, sorted by name.
    pub(crate) fn read(&self) -> Result<Read, Failure> {
        self.read_at(&self.recordings)
    }

    /// Those of other paths that are, or hold, or lie in what is asked about.
    pub(crate) fn shared_with<'p>(&self, others: &'p [PathBuf]) -> Vec<&'p PathBuf> {
        let whole = |path: &PathBuf| fs::canonicalize(path).ok();
        let own: Vec<PathBuf> = self.recordings.iter().filter_map(whole).collect();
        let is_shared = |path: &PathBuf| {
            own.iter()
                .any(|own| own.starts_with(path) || path.starts_with(own))
        };
        let others = others.iter();
        others
            .filter(|path| whole(path).is_some_and(|path| is_shared(&path)))
            .collect()
    }

    /// More recordings, read with the same campaign file.
    pub(crate) fn read_at(&self, paths: &[PathBuf]) -> Result<Read, Failure> {
        let ReadAll {
            recordings,
            left_out,
        } = recordings::read_all(paths, meta(self.meta.as_deref()))?;
        let first = recordings.first().map_or("recordings", |first| &first.name);
        let name = recordings::name_of(paths, first);
        let left_out = left_out.into_iter();
        let left_out = left_out.map(|(recording, remark)| RemarkOf { recording, remark });
        Ok(Read {
            name,
            left_out: left_out.collect(),
            recordings,
        })
    }

    /// The same for what follows an answer, in a folder below its own; of several JSON objects the
    /// first alone is printed.
    pub(crate) fn after(&self, folder: PathBuf) -> Asked {
        Asked {
            out: Some(folder),
            is_silent: matches!(self.format, Format::Json),
            ..self.clone()
        }
    }

    /// The folder for what a run of this name writes, by its main file.
    pub(crate) fn folder(&self, name: &str, main: &str) -> Result<OutFolder, Failure> {
        OutFolder::of(self.out.as_deref(), name, main)
    }

    /// Writes a report beside some texts and the answer as JSON, in lines down to so many `levels`;
    /// prints it as asked.
    pub(crate) fn deliver<T: Serialize>(
        &self,
        (name, report): (&str, &Report),
        json: (&str, usize, &'static str),
        answer: &T,
        texts: Vec<(String, String)>,
    ) -> Result<(), Failure> {
        let folder = self.folder(name, json.0)?;
        let shown = (!self.is_silent).then_some(self.format);
        answers::deliver(&folder, (report, shown), json, answer, texts)
    }
}
