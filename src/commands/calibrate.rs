//! `plan calibrate RECORDING...`: the constants of the jet from recordings of hovering drones, as the paper found them.

mod words;

use std::path::{Path, PathBuf};

use clap::Args;
use diagnosis::calibrate::{Calibration, Options, Verdict, calibrate, jet_ron};
use serde::Serialize;

use crate::commands::simulate::{name_of, wrote};
use crate::io::failure::{Failure, answer};
use crate::io::files;
use crate::io::files::OutFolder;
use crate::io::progress::Progress;
use crate::io::recordings;
use crate::plots::{self, Figure};
use crate::report::page::Page;
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
    #[serde(skip_serializing_if = "Option::is_none")]
    files: Option<&'a [PathBuf]>,
}

const FORMAT: &str = "calibration/1";

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
    let name = name_of(
        arguments.recordings.first(),
        recordings.first().map_or("recordings", |first| &first.name),
    );
    let figures = plots::calibration::draw(&name, &calibration, &recordings);
    let out = OutFolder::prepare(
        arguments
            .out
            .clone()
            .unwrap_or_else(|| Path::new("out").join(&name)),
    )?;
    let mut written = vec![
        ("jet.ron".to_owned(), jet_ron(&calibration)),
        (
            "calibration.json".to_owned(),
            files::json_pretty(&Printed {
                format: FORMAT,
                calibration: &calibration,
                files: None,
            }),
        ),
    ];
    for figure in &figures {
        written.push((format!("{}.svg", figure.name), figure.svg.clone()));
    }
    written.push((
        "report.html".to_owned(),
        page(&name, &calibration, &figures),
    ));
    let written: Vec<(PathBuf, String)> = written
        .into_iter()
        .map(|(file, text)| (out.path.join(file), text))
        .collect();
    files::write(&written)?;
    let files: Vec<PathBuf> = written.into_iter().map(|(path, _)| path).collect();
    answer(&match arguments.format {
        Format::Json => files::json_pretty(&Printed {
            format: FORMAT,
            calibration: &calibration,
            files: Some(&files),
        }),
        Format::Text => words::text(&name, &calibration) + &wrote(&files),
    })?;
    Ok(Answer::from(calibration.goodness.verdict != Verdict::Poor))
}

fn page(name: &str, found: &Calibration, figures: &[Figure]) -> String {
    let mut page = Page::new(&format!("{name}: the jet, calibrated"), &words::what(found));
    page.paragraph(&found.goodness.sentence);
    page.table(&words::constants(found));
    page.list(&words::about_the_constants(found));
    let (expansion, others) = figures.split_at(figures.len().min(1));
    for figure in expansion {
        page.figure(figure);
    }
    page.section("Drone by drone");
    page.table(&words::drones(found));
    for figure in others {
        page.figure(figure);
    }
    if found.drones.iter().any(|drone| !drone.in_fit) {
        page.section("Canted drones beside the fit");
        page.paragraph("Measured minus the jet of the others, over the centreline speed, by distance over half-width.");
        page.table(&words::departures(found));
    }
    page.section("Where the jet is off");
    page.table(&words::regions(found));
    page.section("The paper's residual test");
    page.paragraph("Is the mean of eps = (predicted - measured)/U_C above 0 in an interval of xi? One-sided t test at 5 %, first as the paper has it, then with the samples that count as independent and Holm's correction for the number of rows.");
    page.table(&words::tests(found));
    page.list(&found.residual_tests.caveats);
    page.section("What was used, and what to know");
    page.table(&words::counts(found));
    page.list(&found.caveats);
    page.finish()
}
