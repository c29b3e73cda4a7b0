//! `plan calibrate RECORDING...`: the constants of the jet from recordings of hovering drones, as the paper found them.

mod words;

use std::path::PathBuf;

use clap::Args;
use diagnosis::calibrate::{Calibration, Options, Verdict, calibrate, jet_ron};
use serde::Serialize;

use crate::io::failure::{Failure, answer};
use crate::io::files;
use crate::io::files::OutFolder;
use crate::io::progress::Progress;
use crate::io::recordings;
use crate::plots;
use crate::report::words::wrote;
use crate::{Answer, Format};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Recordings of drones that hover over speed probes: folders with a meta.json, or folders of these
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// What flight logs leave unsaid (RON) [default: the campaign.ron beside or above them]
    #[arg(long, value_name = "FILE")]
    meta: Option<PathBuf>,
    /// How to print the answer
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Folder for jet.ron, calibration.json, figures and report.html [default: out/NAME, that of the first recording]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Seed of the bootstrap draws
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// What `--format json` prints; calibration.json is the same without the files.
#[derive(Serialize)]
struct Printed<'a> {
    format: &'static str,
    #[serde(flatten)]
    calibration: &'a Calibration,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    files: Vec<PathBuf>,
}

/// Answers no where one jet does not describe the readings.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let recordings = recordings::read_all(&arguments.recordings, arguments.meta.as_deref())?;
    let options = Options {
        seed: arguments.seed,
        ..Options::default()
    };
    let progress = Progress::start("calibrating", 1);
    let calibration = calibrate(&recordings, &options)?;
    progress.finish();
    let first = recordings.first().map_or("recordings", |first| &first.name);
    let name = recordings::name_of(&arguments.recordings, first);
    let figures = plots::calibration::draw(&name, &calibration, &recordings);
    let report = words::report(&name, &calibration, figures);
    let mut printed = Printed {
        format: "calibration/1",
        calibration: &calibration,
        files: Vec::new(),
    };
    let mut texts = vec![
        ("jet.ron".to_owned(), jet_ron(&calibration)),
        ("calibration.json".to_owned(), files::json_pretty(&printed)),
    ];
    texts.extend(report.files());
    let out = OutFolder::of(arguments.out.as_deref(), &name)?;
    printed.files = files::write_below(&out.path, texts)?;
    answer(&match arguments.format {
        Format::Text => report.text() + &wrote(&printed.files),
        Format::Json => files::json_pretty(&printed),
    })?;
    Ok(Answer::from(calibration.goodness.verdict != Verdict::Poor))
}
