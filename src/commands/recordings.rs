//! What the commands on recordings share: their arguments, and how they answer.

use std::path::PathBuf;

use clap::Args;
use diagnosis::record::recording::Recording;
use serde::Serialize;

use crate::io::answer::{Format, print};
use crate::io::failure::Failure;
use crate::io::files::{self, OutFolder};
use crate::io::recordings;
use crate::report::page;
use crate::report::sections::Report;
use crate::report::words::wrote;

#[derive(Args, Clone)]
pub(crate) struct Asked {
    /// Recordings: folders with a meta.json, flight logs (.csv, .csv.gz, .ulg), or folders of
    /// either
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

/// An answer as programs read it: its format, its fields, and with them what was written.
#[derive(Serialize)]
pub(crate) struct Printed<'a, T> {
    pub(crate) format: &'static str,
    #[serde(flatten)]
    pub(crate) answer: &'a T,
    #[serde(skip_serializing_if = "<[PathBuf]>::is_empty")]
    pub(crate) files: &'a [PathBuf],
}

impl Asked {
    /// Every recording, sorted by name, and what the run is called.
    pub(crate) fn read(&self) -> Result<(Vec<Recording>, String), Failure> {
        let recordings = recordings::read_all(&self.recordings, self.meta.as_deref())?;
        let first = recordings.first().map_or("recordings", |first| &first.name);
        let name = recordings::name_of(&self.recordings, first);
        Ok((recordings, name))
    }

    /// More recordings, read with the same campaign file.
    pub(crate) fn read_others(&self, paths: &[PathBuf]) -> Result<Vec<Recording>, Failure> {
        recordings::read_all(paths, self.meta.as_deref())
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
        (file, levels, format): (&str, usize, &'static str),
        answer: &T,
        mut texts: Vec<(String, String)>,
    ) -> Result<(), Failure> {
        let json = |files: &[PathBuf]| {
            let printed = Printed {
                format,
                answer,
                files,
            };
            files::json_down_to(&printed, levels)
        };
        texts.push((file.to_owned(), json(&[])));
        texts.extend(page::files(report));
        let files = files::write_below(&self.folder(name, file)?.path, texts)?;
        if self.is_silent {
            return Ok(());
        }
        print(&match self.format {
            Format::Text => report.text() + &wrote(&files),
            Format::Json => json(&files),
        })
    }
}
