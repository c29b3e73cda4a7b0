//! How commands that answer with a report deliver it: files in a folder, text or JSON on the
//! screen.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use crate::io::answer::{Format, print};
use crate::io::failure::Failure;
use crate::io::files::{self, OutFolder};
use crate::report::page;
use crate::report::sections::Report;
use crate::report::words::wrote;

/// How the answer to a question is wanted.
#[derive(Args)]
pub(crate) struct Wanted {
    /// How to print the answer
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Folder for report.html, the figure and JSON [default: out/COMMAND/NAME]; one that holds
    /// another command's output is refused
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// An answer as programs read it: its format, its fields, and with them what was written.
#[derive(Serialize)]
pub(super) struct Printed<'a, T> {
    pub(super) format: &'static str,
    #[serde(flatten)]
    pub(super) answer: &'a T,
    #[serde(skip_serializing_if = "<[PathBuf]>::is_empty")]
    pub(super) files: &'a [PathBuf],
}

impl Wanted {
    /// The folder of a run of this name, whose main file this is.
    pub(crate) fn folder(&self, name: &str, main: &str) -> Result<OutFolder, Failure> {
        OutFolder::of(self.out.as_deref(), name, main)
    }

    /// Writes a report and the answer as JSON, in lines down to so many `levels`, to the folder of
    /// a run of this name; prints it as asked.
    pub(crate) fn deliver<T: Serialize>(
        &self,
        (name, report): (&str, &Report),
        json: (&str, usize, &'static str),
        answer: &T,
    ) -> Result<(), Failure> {
        self.deliver_to(&self.folder(name, json.0)?, report, json, answer)
    }

    /// The same to a folder that was made before.
    pub(crate) fn deliver_to<T: Serialize>(
        &self,
        folder: &OutFolder,
        report: &Report,
        json: (&str, usize, &'static str),
        answer: &T,
    ) -> Result<(), Failure> {
        let shown = Some(self.format);
        deliver(folder, (report, shown), json, answer, Vec::new())
    }
}

/// Writes some texts, an answer as JSON and its report to a folder; prints it as it is to be shown,
/// if it is.
pub(super) fn deliver<T: Serialize>(
    folder: &OutFolder,
    (report, shown): (&Report, Option<Format>),
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
    let files = files::write_below(&folder.path, texts)?;
    match shown {
        Some(Format::Text) => print(&(report.text() + &wrote(&files))),
        Some(Format::Json) => print(&json(&files)),
        None => Ok(()),
    }
}
