//! Flight logs of one campaign, diagnosed together by the vertical forces on their drones.

use std::path::{Path, PathBuf};

use diagnosis::campaign::skill::{Curve, Skill};
use diagnosis::campaign::{
    CampaignError, CampaignFinding, CampaignOptions, diagnose_campaign, near_floor,
};
use diagnosis::forward::simulate::{Channel, Sample};
use diagnosis::infer::finding::Verdict;
use diagnosis::infer::finding_file::finding_ron;
use diagnosis::record::recording::Recording;
use serde::Serialize;

use super::printed::Printed;
use super::sections::{Part, Section, sections};
use super::{Arguments, page, words};
use crate::commands::simulate::{name_of, wrote};
use crate::io::failure::{Failure, answer};
use crate::io::files;
use crate::io::files::OutFolder;
use crate::io::progress::Progress;
use crate::plots;
use crate::report::page::Table;
use crate::{Answer, Format};

/// What `--format json` prints of flights: a diagnosis, with what only several flights can say.
#[derive(Serialize)]
struct PrintedFlights<'a> {
    #[serde(flatten)]
    diagnosis: Printed<'a>,
    /// Which flight, drone and moment each row is.
    rows: Vec<Row<'a>>,
    #[serde(flatten)]
    found: &'a CampaignFinding,
}

#[derive(Serialize)]
struct Row<'a> {
    flight: &'a str,
    vehicle: &'a str,
    t_s: f64,
}

pub(super) fn run(arguments: &Arguments, recordings: &[Recording]) -> Result<Answer, Failure> {
    let options = options(recordings, arguments.alone, arguments.near_floor)?;
    let progress = Progress::start("diagnosing flights together", 1);
    let found = diagnose_campaign(recordings, &options)?;
    progress.finish();
    let finding = &found.finding;
    let first = recordings.first().map_or("flights", |one| &one.name);
    let name = name_of(arguments.recordings.first(), first);
    let out = arguments
        .out
        .clone()
        .unwrap_or_else(|| Path::new("out").join(&name));
    let out = OutFolder::prepare(out)?.path;
    let what = what(&found, &options);
    let figures = plots::finding::draw_campaign(
        &name,
        &found,
        &format!("{what}; {}", words::verdict(finding)),
    );
    let mut written = vec![
        (out.join("finding.ron"), finding_ron(finding)),
        (
            out.join("diagnosis.json"),
            files::json(&printed(recordings, &found, None)),
        ),
    ];
    for figure in &figures {
        written.push((out.join(format!("{}.svg", figure.name)), figure.svg.clone()));
    }
    let report = page(&name, &what, finding, &all_sections(&found, true), &figures);
    written.push((out.join("report.html"), report));
    files::write(&written)?;
    let files: Vec<PathBuf> = written.into_iter().map(|(path, _)| path).collect();
    answer(&match arguments.format {
        Format::Json => files::json(&printed(recordings, &found, Some(&files))),
        Format::Text => {
            words::text(&name, &what, finding, &all_sections(&found, false)) + &wrote(&files)
        }
    })?;
    Ok(Answer::from(finding.verdict != Verdict::OutsideLibrary))
}

/// What of the flights is judged, and from which beginning.
pub(crate) fn options(
    recordings: &[Recording],
    alone: bool,
    near_the_floor: bool,
) -> Result<CampaignOptions, Failure> {
    let judge = match near_the_floor {
        true => near_floor(recordings),
        false => Vec::new(),
    };
    if near_the_floor && judge.is_empty() {
        return Err(CampaignError::NoForce.into());
    }
    Ok(CampaignOptions {
        alone,
        judge,
        ..CampaignOptions::default()
    })
}

fn printed<'a>(
    recordings: &'a [Recording],
    found: &'a CampaignFinding,
    files: Option<&'a [PathBuf]>,
) -> PrintedFlights<'a> {
    let of = |(sample, &of): (&Sample, &usize)| Row {
        flight: &recordings[of].name,
        vehicle: &recordings[of].vehicles[sample.subject as usize].id,
        t_s: sample.t_s,
    };
    PrintedFlights {
        diagnosis: Printed::of(&found.finding, files),
        rows: found
            .samples
            .iter()
            .zip(&found.recording_of)
            .map(of)
            .collect(),
        found,
    }
}

/// `4777 values of the vertical force in 88 flights, from drones that fly alone`.
fn what(found: &CampaignFinding, options: &CampaignOptions) -> String {
    let from = match options.alone {
        true => "simulated as if each drone flew alone",
        false => "simulated with the hover jets of the drones above",
    };
    let rows = found.finding.samples;
    format!(
        "{rows} values of the vertical force in {} flights, {from}",
        found.flights
    )
}

/// The sections of a single recording, with what whole flights add.
fn all_sections(found: &CampaignFinding, all: bool) -> Vec<Section> {
    let mut sections = sections(&found.finding, all);
    for section in &mut sections {
        match section.heading {
            "WHERE" => section.parts.extend(located(found)),
            "WHAT" => section.parts.extend(taken(found)),
            "FIT" => {
                section.parts.push(Part::Table(skills(&found.skills)));
                if all {
                    section.parts.extend(found.curves.iter().map(curve));
                }
            }
            "NOT SURE ABOUT" => section.parts.extend(left(found)),
            _ => {}
        }
    }
    sections
}

fn located(found: &CampaignFinding) -> Option<Part> {
    let located = found.located.as_ref()?;
    Some(Part::Line(format!(
        "Found without any candidate: {}, {:.0} % of the values, where recorded minus simulated is {} in the mean (chance {:.3}).",
        located.description,
        100.0 * located.share,
        newton(located.mean_error_n),
        located.p
    )))
}

/// In which order, and what else was tried in each place.
fn taken(found: &CampaignFinding) -> Option<Part> {
    let row = |taken: &diagnosis::campaign::diagnose::Taken| {
        let rivals = taken.rivals.iter().take(2);
        let rivals: Vec<String> = rivals
            .map(|(name, gain, error)| format!("{name} {gain:.0} +- {error:.0}"))
            .collect();
        vec![
            taken.name.clone(),
            format!("{:.0}", taken.gain),
            format!("{:.0}", taken.gain_error),
            rivals.join(", "),
        ]
    };
    let headings = ["taken in this order", "gain", "+-", "in its place"];
    (!found.taken.is_empty()).then(|| {
        Part::Table(Table {
            headings: headings.map(str::to_owned).to_vec(),
            rows: found.taken.iter().map(row).collect(),
        })
    })
}

fn skills(skills: &[Skill]) -> Table {
    let row = |skill: &Skill| {
        let [low, after, high] = skill.rms_after_n.map(newton);
        let [r2_low, r2, r2_high] = skill.r2_after;
        vec![
            skill.rows_where.clone(),
            skill.rows.to_string(),
            skill.flights.to_string(),
            newton(skill.rms_before_n),
            format!("{after} ({low} to {high})"),
            format!("{:.2}", skill.r2_before),
            format!("{r2:.2} ({r2_low:.2} to {r2_high:.2})"),
        ]
    };
    let headings = [
        "flights held out whole",
        "rows",
        "flights",
        "rms before",
        "after (95 %)",
        "R2 before",
        "after (95 %)",
    ];
    Table {
        headings: headings.map(str::to_owned).to_vec(),
        rows: skills.iter().map(row).collect(),
    }
}

fn curve(curve: &Curve) -> Part {
    let rows = (0..curve.bins.len()).map(|i| {
        let [from, to] = curve.bins[i];
        vec![
            format!("{from:.2} to {to:.2}"),
            curve.rows[i].to_string(),
            newton(curve.recorded_n[i]),
            newton(curve.before_n[i]),
            newton(curve.after_n[i]),
            newton(curve.error_n[i]),
        ]
    });
    let headings = [
        curve.along.as_str(),
        "rows",
        "recorded",
        "before",
        "after",
        "+-",
    ];
    Part::Table(Table {
        headings: headings.map(str::to_owned).to_vec(),
        rows: rows.collect(),
    })
}

fn newton(force_n: f64) -> String {
    words::amount(force_n, Channel::VerticalForce)
}

/// What was not taken, and what is left.
fn left(found: &CampaignFinding) -> Vec<Part> {
    let mut lines = Vec::new();
    if let Some((name, gain, error)) = &found.next {
        lines.push(format!(
            "Next would come {name}: {gain:.0} +- {error:.0} more, which is too little or rests on too few flights."
        ));
    }
    let [before, left] = found.flexible_gain;
    lines.push(match left > 2.5 * found.flexible_gain_error {
        true => format!(
            "Any function of the circumstances (trees) gains {left:.0} +- {:.0} more in flights that it has not seen: there is more, without a name here.",
            found.flexible_gain_error
        ),
        false => format!(
            "Any function of the circumstances (trees) gains {before:.0} on the simulation as it is, and nothing on what is left ({left:.0} +- {:.0}).",
            found.flexible_gain_error
        ),
    });
    lines.into_iter().map(Part::Line).collect()
}
