//! `plan calibrate RECORDING...`: the constants of the jet from recordings of hovering drones, as
//! the paper found them.

mod words;

use clap::Args;
use diagnosis::calibrate::{Options, Verdict, calibrate, jet_ron};

use super::recordings::{Asked, Read, sentences};
use crate::io::answer::Answer;
use crate::io::failure::Failure;
use crate::io::progress::Progress;
use crate::plots;
use crate::report::sections::Part;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Asked,
    /// Seed of the bootstrap draws
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// Answers no where one jet does not describe the readings.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let Read {
        recordings,
        name,
        left_out,
    } = arguments.asked.read()?;
    let options = Options {
        seed: arguments.seed,
        ..Options::default()
    };
    let progress = Progress::start("calibrating", 1);
    let found = calibrate(&recordings, &options)?;
    progress.finish();
    let figures = plots::calibration::draw(&name, &found, &recordings);
    let mut report = words::report(&name, &found, figures);
    report.section(
        "Remarks",
        Part::list(sentences(&left_out, "calibration.json")),
    );
    let json = ("calibration.json", usize::MAX, "calibration/1");
    let jet = ("jet.ron".to_owned(), jet_ron(&found));
    arguments
        .asked
        .deliver((&name, &report), json, &found, vec![jet])?;
    Ok(Answer::from(found.goodness.verdict != Verdict::Poor))
}
