//! `plan diagnose RECORDING...`: where simulation and recording differ, what is missing, how well the correction predicts.

pub(crate) mod flights;
pub(crate) mod hardware;
mod words;

use std::path::{Path, PathBuf};

use clap::Args;
use diagnosis::forward::simulate::Channel;
use diagnosis::infer::diagnose::{DiagnoseError, diagnose_channel};
use diagnosis::infer::finding::Finding;
use diagnosis::infer::finding::Verdict;
use diagnosis::infer::finding_file::finding_ron;
use diagnosis::record::recording::{Recording, Vehicle};
use serde::Serialize;

use super::by_name;
use crate::io::failure::{Failure, answer};
use crate::io::files;
use crate::io::files::OutFolder;
use crate::io::progress::Progress;
use crate::io::recordings;
use crate::plots;
use crate::report::Report;
use crate::report::words::{file_stem, wrote};
use crate::{Answer, Format};
use flights::Flights;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Recordings: folders with a meta.json, flight logs (.csv, .csv.gz, .ulg), or folders of either
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// What flight logs leave unsaid (RON) [default: the campaign.ron beside or above them]
    #[arg(long, value_name = "FILE")]
    meta: Option<PathBuf>,
    /// Of flight logs: begin with drones that fly alone, without any wakes
    #[arg(long, conflicts_with = "normal")]
    alone: bool,
    /// Of flight logs: judge flights near the floor only; the others serve the thrust maps
    #[arg(long, conflicts_with = "normal")]
    near_floor: bool,
    /// Of flight logs: those whose names begin with it flew the hardware as stated; each flight is compared with them: has a weight or a propeller changed?
    #[arg(long, value_name = "NAME")]
    normal: Option<String>,
    /// With --normal: parts of names that tell several drones apart
    #[arg(
        long,
        value_name = "NAME,NAME",
        value_delimiter = ',',
        requires = "normal"
    )]
    drones: Vec<String>,
    /// What to compare, where a recording has several: the probes' speed, a receiver's throttle over hover, its power over that without a wake [default: speed, else throttle]
    #[arg(long, value_parser = by_name(&COMPARED, file_stem))]
    channel: Option<Channel>,
    /// How to print the answer: one object, or a list of them where several recordings are diagnosed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Folder for finding.ron, diagnosis.json, figures and report.html; of several recordings each gets a folder in it [default: out/NAME, that of the first recording]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

/// What can be compared with the simulation of one recording.
const COMPARED: [Channel; 3] = [Channel::Speed, Channel::Throttle, Channel::Power];

/// Answers no where a mismatch stays unexplained.
///
/// Recordings of probes and of receivers are diagnosed one by one; flight logs together, with whole flights held out.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let recordings = recordings::read_all(&arguments.recordings, arguments.meta.as_deref())?;
    let logs = recordings.iter().filter(|one| is_log(one)).count();
    if arguments.normal.is_some() && logs == recordings.len() {
        return hardware::run(arguments, &recordings);
    }
    if logs > 0 && logs == recordings.len() {
        return flights::run(arguments, &recordings);
    }
    let for_logs = arguments.alone || arguments.near_floor || arguments.normal.is_some();
    if logs > 0 || for_logs {
        return Err(Failure::NotOnlyFlightLogs {
            others: recordings.len() - logs,
        });
    }
    let (found, errors) = diagnose_all(&recordings, arguments.channel);
    let Some((first, _)) = found.first() else {
        return Err(Failure::Diagnose(errors));
    };
    let name = recordings::name_of(&arguments.recordings, &first.name);
    let out = OutFolder::of(arguments.out.as_deref(), &name)?;
    let several = recordings.len() > 1;
    let mut texts = Vec::new();
    let mut reports = Vec::new();
    for (recording, finding) in &found {
        let report = report(recording, finding);
        let below = match several {
            true => Path::new(&recording.name),
            false => Path::new(""),
        };
        let folder = OutFolder::prepare(out.path.join(below))?.path;
        let named = |(file, text): (String, String)| (folder.join(file), text);
        texts.extend(files_of(finding, None, &report).into_iter().map(named));
        reports.push(report.text());
    }
    files::write(&texts)?;
    let files: Vec<PathBuf> = texts.into_iter().map(|(path, _)| path).collect();
    answer(&match (arguments.format, found.as_slice()) {
        (Format::Json, [(_, finding)]) if !several => {
            files::json(&Printed::of(finding, None, files))
        }
        (Format::Json, _) => {
            let findings = found.iter().map(|(_, finding)| finding);
            let of = |finding| Printed::of(finding, None, Vec::new());
            files::json(&findings.map(of).collect::<Vec<_>>())
        }
        (Format::Text, _) if !several => reports.concat() + &wrote(&files),
        (Format::Text, _) => {
            let folder = out.path.display();
            words::summary(&found).text()
                + &format!(
                    "\nwrote {folder}/<recording>/report.html  finding.ron  diagnosis.json  and the figures\n"
                )
        }
    })?;
    if !errors.is_empty() {
        return Err(Failure::Diagnose(errors));
    }
    let explained = |finding: &Finding| finding.verdict != Verdict::OutsideLibrary;
    Ok(Answer::from(
        found.iter().all(|(_, finding)| explained(finding)),
    ))
}

/// A finding as programs read it: `diagnosis/1`, in diagnosis.json and with the files what `--format json` prints. Rows count
/// from 0 and are those of probes.csv, or of receiver.csv where there are no probes.
#[derive(Serialize)]
struct Printed<'a> {
    format: &'static str,
    #[serde(flatten)]
    finding: &'a Finding,
    #[serde(flatten)]
    flights: Option<&'a Flights<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    files: Vec<PathBuf>,
}

impl<'a> Printed<'a> {
    fn of(
        finding: &'a Finding,
        flights: Option<&'a Flights<'a>>,
        files: Vec<PathBuf>,
    ) -> Printed<'a> {
        Printed {
            format: "diagnosis/1",
            finding,
            flights,
            files,
        }
    }
}

/// Names and contents of the files of one finding.
fn files_of(
    finding: &Finding,
    flights: Option<&Flights>,
    report: &Report,
) -> Vec<(String, String)> {
    let json = files::json(&Printed::of(finding, flights, Vec::new()));
    let mut files = vec![
        ("finding.ron".to_owned(), finding_ron(finding)),
        ("diagnosis.json".to_owned(), json),
    ];
    files.extend(report.files());
    files
}

fn report(recording: &Recording, finding: &Finding) -> Report {
    let what = words::what(recording, finding);
    let subtitle = format!("{what}; {}", words::verdict(finding));
    let figures = plots::finding::draw(recording, finding, &subtitle);
    words::report(&recording.name, what, finding, figures)
}

/// Whether it can only be judged by the forces on its drones.
fn is_log(recording: &Recording) -> bool {
    let logs_motors = |vehicle: &Vehicle| vehicle.track.duty.is_some();
    recording.probes.is_none()
        && recording.receivers.is_empty()
        && recording.vehicles.iter().any(logs_motors)
}

/// One after the other: each takes all threads.
fn diagnose_all(
    recordings: &[Recording],
    channel: Option<Channel>,
) -> (Vec<(&Recording, Finding)>, Vec<DiagnoseError>) {
    let progress = Progress::start("diagnosing", recordings.len());
    let (mut found, mut errors) = (Vec::new(), Vec::new());
    for recording in recordings {
        match diagnose_channel(recording, channel) {
            Ok(finding) => found.push((recording, finding)),
            Err(error) => errors.push(error),
        }
        progress.done_one();
    }
    progress.finish();
    (found, errors)
}
