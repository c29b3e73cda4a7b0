//! `plan calibrate RECORDING...`: the constants of the jet from recordings of hovering drones, as
//! the paper found them.

mod words;

use clap::Args;
use diagnosis::calibrate::{Options, Verdict, calibrate, jet_ron};
use diagnosis::infer::actuation::actuation;
use diagnosis::record::recording::Recording;
use diagnosis::record::remark::{Remark, RemarkKind};

use super::recordings::{Asked, Read, RemarkOf, Remarked, noticed, sentences};
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
    let doubts = recordings.iter().filter_map(doubt);
    let doubts: Vec<RemarkOf> = doubts.collect();
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
    let json = ("calibration.json", usize::MAX, "calibration/1");
    let jet = ("jet.ron".to_owned(), jet_ron(&found));
    arguments
        .asked
        .deliver((&name, &report), json, &answer, vec![jet])?;
    let is_one_jet = found.goodness.verdict != Verdict::Poor;
    Ok(Answer::from(is_one_jet && is_as_stated))
}

/// Why the induced velocity that a jet is calibrated by may not be that of the drones which flew.
fn doubt(recording: &Recording) -> Option<RemarkOf> {
    let said = actuation(recording);
    let message = match said.cause {
        Some(cause) => format!(
            "throttle and power say {cause}; the jet is calibrated by what is stated, so its speeds are off"
        ),
        None if said.is_contradicted => "throttle and power are not those of the stated masses and density, and the jet is calibrated by these".to_owned(),
        None => return None,
    };
    let remark = Remark::new(RemarkKind::Contradicted, None, message);
    Some(RemarkOf::new(recording, &remark))
}
