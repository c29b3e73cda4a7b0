//! `plan calibrate RECORDING...`: the constants of the jet from recordings of hovering drones, as
//! the paper found them.

mod words;

use clap::Args;
use diagnosis::calibrate::{FORMAT, Options, Verdict, calibrate, jet_ron};
use diagnosis::infer::noticed::{Remarked, doubts, noticed};

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
    /// Seed of the draws of signs behind the p-value of the misfit
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// Answers no where one jet does not describe the readings, or throttle and power do not fit the
/// stated masses and density.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let Read {
        recordings,
        name,
        mut left_out,
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
    left_out.extend(noticed(&recordings));
    let doubts = doubts(&recordings);
    let is_as_stated = doubts.is_empty();
    left_out.extend(doubts);
    let remarks = &left_out;
    report.section(
        "Remarks",
        Part::list(sentences(remarks, "calibration.json")),
    );
    let answer = Remarked {
        answer: &found,
        remarks,
    };
    let json = ("calibration.json", usize::MAX, FORMAT);
    let jet = ("jet.ron".to_owned(), jet_ron(&found));
    arguments
        .asked
        .deliver((&name, &report), json, &answer, vec![jet])?;
    let is_one_jet = found.goodness.verdict != Verdict::Poor;
    Ok(Answer::from(is_one_jet && is_as_stated))
}
