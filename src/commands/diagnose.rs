//! `plan diagnose RECORDING...`: where simulation and recording differ, what is missing, how well
//! the correction predicts.

pub(crate) mod flights;
pub(crate) mod hardware;
mod words;

use std::path::PathBuf;

use clap::Args;
use diagnosis::campaign::flights::Flights;
use diagnosis::campaign::{diagnose_campaign, diagnose_sideways, take_forceless};
use diagnosis::forward::simulate::Channel;
use diagnosis::infer::diagnose::{DiagnoseError, diagnose_channel};
use diagnosis::infer::finding::{FORMAT, Finding, Verdict};
use diagnosis::infer::finding_file::{FindingFile, finding_ron, read_finding};
use diagnosis::infer::noticed::{RemarkOf, Remarked, noticed};
use diagnosis::record::recording::Recording;
use serde::Serialize;

use super::answers::Printed;
use super::recordings::{Asked, Read, sentences};
use super::{applied, by_name};
use crate::io::answer::{Answer, Format, print};
use crate::io::failure::Failure;
use crate::io::files::{self, OutFolder};
use crate::io::progress::Progress;
use crate::plots;
use crate::report::page;
use crate::report::sections::{Part, Report};
use crate::report::words::channel_words;
pub(crate) use words::amount;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Asked,
    /// Of flight logs: begin with drones that fly alone, without any wakes
    #[arg(long, conflicts_with = "normal")]
    alone: bool,
    /// Of flight logs: judge flights near the floor only; the others serve the thrust maps
    #[arg(long, conflicts_with = "normal")]
    near_floor: bool,
    /// Of flight logs: those whose names begin with it flew the hardware as stated; each flight is
    /// compared with them: has a weight or a propeller changed?
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
    /// With --normal: parts of names that tell several sessions apart (a day, a rebuilt drone):
    /// motors are compared within one, and what changed between them is told
    #[arg(
        long,
        value_name = "NAME,NAME",
        value_delimiter = ',',
        requires = "normal"
    )]
    sessions: Vec<String>,
    /// What to compare, where a recording has several: the probes' speed, a receiver's throttle
    /// over hover, its power over that without a wake [default: speed, else throttle]
    #[arg(long, value_parser = by_name(&COMPARED, |channel| channel_words(channel).file_stem))]
    channel: Option<Channel>,
    /// Instead of a diagnosis: hold a finding (finding.ron) from other recordings against these
    #[arg(long, value_name = "FILE", conflicts_with_all = ["alone", "near_floor", "normal", "judge"])]
    finding: Option<PathBuf>,
    /// Then hold what was found against these recordings as well; with --format json the answer to
    /// that is in judged/judged.json alone
    #[arg(long, value_name = "RECORDING", num_args = 1.., conflicts_with = "normal")]
    judge: Vec<PathBuf>,
}

/// Of a judgement of a finding, in `judged.json`.
const JUDGED: (&str, usize, &str) = ("judged.json", 3, "judged/1");

/// The file by which one knows a folder of this command.
const MAIN: &str = "diagnosis.json";
/// What can be compared with the simulation of one recording.
const COMPARED: [Channel; 3] = [Channel::Speed, Channel::Throttle, Channel::Power];

/// Answers no where a mismatch stays unexplained.
///
/// Recordings of probes and of receivers are diagnosed one by one; flight logs together, with whole
/// flights held out.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let shared = arguments.asked.shared_with(&arguments.judge);
    if !shared.is_empty() {
        let refused = shared.into_iter().map(|path| {
            let path = path.display();
            format!("--judge {path}: what is found is fitted to it; name recordings that are not diagnosed")
        });
        return Err(Failure::Inapplicable(refused.collect()));
    }
    let Read {
        mut recordings,
        name,
        mut left_out,
    } = arguments.asked.read()?;
    left_out.extend(take_forceless(&mut recordings));
    let logs = recordings.iter().filter(|one| one.is_of_a_force()).count();
    let are_logs = logs > 0 && logs == recordings.len();
    if are_logs && let Some(channel) = arguments.channel {
        return Err(Failure::Inapplicable(vec![format!(
            "--channel {} chooses among readings of probes and receivers; flight logs are judged by the forces on their drones",
            channel_words(channel).file_stem
        )]));
    }
    if let Some(finding) = &arguments.finding {
        let finding = applied::read(finding)?;
        let asked = (&arguments.asked, arguments.channel);
        let read = (&recordings[..], left_out);
        return judge(asked, read, 0, (&name, &finding));
    }
    let others = others(arguments, &recordings)?;
    match (are_logs, &arguments.normal) {
        (true, Some(normal)) => {
            let names = hardware::Names {
                normal,
                drones: &arguments.drones,
                sessions: &arguments.sessions,
            };
            return hardware::run(&arguments.asked, &name, (&recordings, left_out), names);
        }
        (true, None) => {
            let told = sentences(&left_out, MAIN);
            let found = run_flights(arguments, (&recordings, left_out), &name);
            let (answer, found) = found.map_err(|failure| match failure {
                Failure::Campaign(error) => Failure::LeftOfCampaign {
                    error,
                    left_out: told,
                },
                other => other,
            })?;
            return judge_others(arguments, (&recordings, others), (&name, &found), answer);
        }
        _ if logs > 0 || arguments.alone || arguments.near_floor || arguments.normal.is_some() => {
            return Err(Failure::not_only_forces(&recordings));
        }
        _ => {}
    }
    let namesakes = recordings
        .windows(2)
        .filter(|two| two[0].name == two[1].name);
    let mut namesakes: Vec<String> = namesakes.map(|two| two[0].name.clone()).collect();
    namesakes.dedup();
    if !namesakes.is_empty() {
        return Err(Failure::Namesakes(namesakes));
    }
    let (found, errors) = diagnose_all(&recordings, arguments.channel);
    match found.as_slice() {
        [] => return Err(undiagnosed(&recordings, arguments.channel, errors)),
        [(recording, finding)] if recordings.len() == 1 => {
            let report = report(recording, finding);
            let read = (&recordings[..], left_out);
            deliver(&arguments.asked, (&name, report), finding, (read, finding))?;
        }
        several => deliver_all(&arguments.asked, &name, several, left_out)?,
    }
    if !errors.is_empty() {
        return Err(Failure::Diagnose(errors));
    }
    let are_explained = found.iter().all(|(_, finding)| is_explained(finding));
    let answer = Answer::from(are_explained);
    match found.as_slice() {
        [(_, finding)] => judge_others(arguments, (&[], others), (&name, finding), answer),
        _ if arguments.judge.is_empty() => Ok(answer),
        several => Err(Failure::SeveralToJudge(several.len())),
    }
}

/// Why none of these recordings was diagnosed.
fn undiagnosed(
    recordings: &[Recording],
    channel: Option<Channel>,
    errors: Vec<DiagnoseError>,
) -> Failure {
    let is_empty = |error: &DiagnoseError| matches!(error, DiagnoseError::NothingToCompare(..));
    let are_logs = recordings.iter().all(Recording::is_flight_log);
    match channel.is_none() && errors.iter().all(is_empty) && are_logs {
        // A force may be what was meant.
        true => Failure::nothing_to_compare(recordings.iter()),
        false => Failure::Diagnose(errors),
    }
}

/// The recordings named with `--judge`, none of which holds the readings of one that the finding is
/// fitted to.
fn others(arguments: &Arguments, fitted: &[Recording]) -> Result<Option<Read>, Failure> {
    if arguments.judge.is_empty() {
        return Ok(None);
    }
    let others = arguments.asked.read_at(&arguments.judge)?;
    let copies = others.recordings.iter().filter_map(|other| {
        let of = fitted.iter().find(|own| other.is_copy_of(own))?;
        Some(format!(
            "--judge {}: holds the same readings as {}, which the finding is fitted to",
            other.name, of.name
        ))
    });
    let copies: Vec<String> = copies.collect();
    match copies.is_empty() {
        true => Ok(Some(others)),
        false => Err(Failure::Inapplicable(copies)),
    }
}

/// What was found, held against the recordings named with `--judge`; `own` serve the thrust maps.
fn judge_others(
    arguments: &Arguments,
    (own, others): (&[Recording], Option<Read>),
    (name, finding): (&str, &Finding),
    answer: Answer,
) -> Result<Answer, Failure> {
    let Some(others) = others else {
        return Ok(answer);
    };
    let file = read_finding(&finding_ron(finding)).map_err(|error| Failure::Finding {
        path: "finding.ron".into(),
        error: error.into(),
    })?;
    let from = own.len();
    let recordings = [own, &others.recordings].concat();
    let folder = arguments.asked.folder(name, MAIN)?.path.join("judged");
    let asked = arguments.asked.after(folder);
    let helps = judge(
        (&asked, arguments.channel),
        (&recordings, others.left_out),
        from,
        (&others.name, &file),
    )?;
    Ok(answer.and(helps))
}

/// A finding held against recordings, from one of them on: answers no where it predicts them no
/// better.
fn judge(
    (asked, channel): (&Asked, Option<Channel>),
    (recordings, mut remarks): (&[Recording], Vec<RemarkOf>),
    from: usize,
    (name, finding): (&str, &FindingFile),
) -> Result<Answer, Failure> {
    let progress = Progress::start("judging a finding", 1);
    let judged = (from..recordings.len()).collect();
    let applied = applied::judge(recordings, judged, channel, finding)?;
    progress.finish();
    remarks.extend(noticed(&recordings[from..]));
    remarks.extend(applied::not_judged(recordings, from, &applied));
    let helps = applied::helps(&applied);
    let title = match helps {
        true => format!("{name}: the finding predicts these recordings better"),
        false => format!("{name}: the finding does not predict these recordings better"),
    };
    let mut report = Report::new(title, applied::lead(recordings, &applied, finding));
    let names: Vec<&str> = recordings.iter().map(|one| &*one.name).collect();
    applied::section(&mut report, &names, &applied, finding);
    let figures = applied::figures(name, recordings, &applied).into_iter();
    report.section(
        "Residuals before and after",
        figures.map(Part::Figure).collect(),
    );
    report.section("Remarks", Part::list(sentences(&remarks, JUDGED.0)));
    let answer = Remarked {
        answer: &applied,
        remarks: &remarks,
    };
    asked.deliver((name, &report), JUDGED, &answer, Vec::new())?;
    Ok(Answer::from(helps))
}

fn is_explained(finding: &Finding) -> bool {
    finding.verdict != Verdict::OutsideLibrary
}

/// Flight logs of one campaign, by the forces on their drones: vertical ones make the finding.
fn run_flights(
    asked: &Arguments,
    (logs, left_out): (&[Recording], Vec<RemarkOf>),
    name: &str,
) -> Result<(Answer, Finding), Failure> {
    let options = flights::options(logs, asked.alone, asked.near_floor)?;
    let progress = Progress::start("diagnosing flights together", 1);
    let found = diagnose_campaign(logs, &options)?;
    let sideways = diagnose_sideways(logs, &options);
    progress.finish();
    let report = flights::report(name, (&found, &sideways), &options);
    let answer = Flights::of(&found, sideways.as_ref().ok(), logs);
    deliver(
        &asked.asked,
        (name, report),
        &found.finding,
        ((logs, left_out), &answer),
    )?;
    Ok((Answer::from(is_explained(&found.finding)), found.finding))
}

/// Writes and prints one finding; `answer` is what programs read of it. Rows count from 0 and are
/// those of probes.csv, or of receiver.csv where there are no probes.
fn deliver(
    asked: &Asked,
    (name, mut report): (&str, Report),
    finding: &Finding,
    ((recordings, mut remarks), answer): ((&[Recording], Vec<RemarkOf>), &impl Serialize),
) -> Result<(), Failure> {
    let finding = ("finding.ron".to_owned(), finding_ron(finding));
    remarks.extend(noticed(recordings));
    let remarks = &remarks;
    remark(&mut report, remarks);
    let answer = Remarked { answer, remarks };
    asked.deliver((name, &report), (MAIN, 2, FORMAT), &answer, vec![finding])
}

fn remark<'r>(report: &mut Report, remarks: impl IntoIterator<Item = &'r RemarkOf>) {
    report.section("Remarks", Part::list(sentences(remarks, MAIN)));
}

/// Writes each finding to a folder of its own, and prints a line of each. What is left out stands
/// with the first.
fn deliver_all(
    asked: &Asked,
    name: &str,
    found: &[(&Recording, Finding)],
    mut left_out: Vec<RemarkOf>,
) -> Result<(), Failure> {
    let out = asked.folder(name, MAIN)?.path;
    let remarks_of = |(recording, _): &(&Recording, Finding)| {
        let mut remarks = std::mem::take(&mut left_out);
        remarks.extend(noticed(std::slice::from_ref(*recording)));
        remarks
    };
    let noticed: Vec<Vec<RemarkOf>> = found.iter().map(remarks_of).collect();
    let remarked = found.iter().zip(&noticed);
    let remarked = remarked.map(|((_, answer), remarks)| Remarked { answer, remarks });
    let remarked: Vec<Remarked<Finding>> = remarked.collect();
    let printed = |answer| Printed {
        format: FORMAT,
        answer,
        files: &[],
    };
    let mut texts = Vec::new();
    for ((recording, finding), remarked) in found.iter().zip(&remarked) {
        let folder = OutFolder::prepare(out.join(&recording.name), MAIN)?.path;
        let json = files::json(&printed(remarked));
        let mut report = report(recording, finding);
        remark(&mut report, remarked.remarks);
        let mut here = page::files(&report);
        here.push(("finding.ron".to_owned(), finding_ron(finding)));
        here.push((MAIN.to_owned(), json));
        texts.extend(files::below(&folder, here));
    }
    files::write(&texts)?;
    print(&match asked.format {
        Format::Json => {
            let all = remarked.iter().map(printed);
            files::json(&all.collect::<Vec<_>>())
        }
        Format::Text => {
            let mut summary = words::summary(found);
            remark(&mut summary, noticed.iter().flatten());
            format!(
                "{}\nwrote {}/<recording>/report.html  finding.ron  diagnosis.json  and the figures\n",
                summary.text(),
                out.display()
            )
        }
    })
}

fn report(recording: &Recording, finding: &Finding) -> Report {
    let what = words::what(recording, finding);
    let subtitle = format!("{what}; {}", words::verdict(finding));
    let figures = plots::finding::draw(recording, finding, &subtitle);
    words::report(&recording.name, what, finding, figures)
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
