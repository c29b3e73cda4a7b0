//! `plan simulate RECORDING...`: what the declared simulation would have recorded, beside what was.

mod csv;
mod forces;
mod skill;
mod words;

use std::path::{Path, PathBuf};

use clap::Args;
use diagnosis::forward::residuals::{Region, by_region};
use diagnosis::forward::simulate::{Channel, Sample, simulate};
use diagnosis::record::recording::Recording;
use diagnosis::record::remark::Remark;
use rayon::prelude::*;
use serde::Serialize;

use crate::io::failure::{Failure, answer};
use crate::io::files;
use crate::io::files::OutFolder;
use crate::io::progress::Progress;
use crate::io::recordings;
use crate::plots::{self, Figure};
use crate::report::page::Page;
use crate::{Answer, Format};
use forces::Map;
use skill::Skill;
pub(crate) use words::wrote;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Recordings: folders with a meta.json, flight logs (.csv, .csv.gz, .ulg), or folders of either
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// What flight logs leave unsaid (RON) [default: the campaign.ron beside or above them]
    #[arg(long, value_name = "FILE")]
    meta: Option<PathBuf>,
    /// Also judge forces in whole flights that no thrust map was identified from, and the drones' clocks
    #[arg(long)]
    held_out: bool,
    /// How to print the answer
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Folder for the tables, figures and report.html [default: out/NAME, that of the first recording]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

/// One recording, simulated.
struct Simulated {
    recording: Recording,
    samples: Vec<Sample>,
    /// Of reading and of simulating.
    remarks: Vec<Remark>,
}

/// Contents of residuals.json.
#[derive(Serialize)]
struct Residuals<'a> {
    format: &'static str,
    recordings: Vec<&'a str>,
    samples: usize,
    regions: &'a [Region],
    thrust_maps: &'a [Map],
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out: Option<&'a Skill>,
    remarks: Vec<RemarkOf<'a>>,
}

#[derive(Serialize)]
struct RemarkOf<'a> {
    recording: &'a str,
    #[serde(flatten)]
    remark: &'a Remark,
}

/// What `--format json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    residuals: Residuals<'a>,
    files: Vec<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let mut recordings = recordings::read_all(&arguments.recordings, arguments.meta.as_deref())?;
    let maps = forces::identify_all(&mut recordings);
    let skill = arguments
        .held_out
        .then(|| skill::held_out(&recordings))
        .transpose()
        .map_err(Failure::HeldOut)?;
    let all = simulate_all(recordings);
    let samples: Vec<Sample> = all.iter().flat_map(|one| &one.samples).copied().collect();
    let Some(first) = all.first().filter(|_| !samples.is_empty()) else {
        return Err(Failure::NothingToCompare(all.len()));
    };
    // One campaign has one instrument and one floor: those of its first recording.
    let regions = by_region(&first.recording, &samples);
    let name = name_of(arguments.recordings.first(), &first.recording.name);
    let simulated: Vec<(&Recording, &[Sample])> = all
        .iter()
        .map(|one| (&one.recording, one.samples.as_slice()))
        .collect();
    let scatter_n = |airframe: &str| {
        let map = maps.iter().find(|map| map.airframe == airframe)?;
        Some(map.identification.scatter_n)
    };
    let figures = plots::simulation::draw(&name, &simulated, scatter_n);
    let out = OutFolder::prepare(
        arguments
            .out
            .clone()
            .unwrap_or_else(|| Path::new("out").join(&name)),
    )?;
    let mut written: Vec<(PathBuf, String)> = Vec::new();
    for channel in channels(&samples) {
        let file = format!("{}.csv", words::file_stem(channel));
        written.push((out.path.join(file), csv::table(channel, &all)));
    }
    written.push((
        out.path.join("residuals.json"),
        files::json_pretty(&residuals(
            &all,
            &regions,
            &maps,
            skill.as_ref(),
            samples.len(),
        )),
    ));
    for figure in &figures {
        written.push((
            out.path.join(format!("{}.svg", figure.name)),
            figure.svg.clone(),
        ));
    }
    let report = page(&name, &all, &regions, &maps, &figures);
    written.push((out.path.join("report.html"), report));
    files::write(&written)?;
    let files: Vec<PathBuf> = written.into_iter().map(|(path, _)| path).collect();
    answer(&match arguments.format {
        Format::Json => files::json_pretty(&Printed {
            residuals: residuals(&all, &regions, &maps, skill.as_ref(), samples.len()),
            files,
        }),
        Format::Text => {
            let skill = skill.as_ref().map(Skill::text).unwrap_or_default();
            words::text(&name, &all, &regions, &maps, &skill) + &words::wrote(&files)
        }
    })?;
    Ok(Answer::Yes)
}

/// The name of what a run is about: that of the folder or file that was named first.
pub(crate) fn name_of(path: Option<&PathBuf>, recording: &str) -> String {
    let folder = path.filter(|path| path.is_dir()).and_then(|path| {
        let path = std::fs::canonicalize(path).ok()?;
        Some(path.file_name()?.to_string_lossy().into_owned())
    });
    folder.unwrap_or_else(|| recording.to_owned())
}

fn simulate_all(recordings: Vec<Recording>) -> Vec<Simulated> {
    let progress = Progress::start("simulating", recordings.len());
    let all = recordings
        .into_par_iter()
        .map(|recording| {
            let simulation = simulate(&recording);
            let (forces, more) = forces::simulate(&recording);
            let mut remarks = recording.remarks.clone();
            remarks.extend(simulation.left_out);
            remarks.extend(more);
            let mut samples = simulation.samples;
            samples.extend(forces);
            progress.done_one();
            Simulated {
                recording,
                samples,
                remarks,
            }
        })
        .collect();
    progress.finish();
    all
}

/// Which there are, in their order.
fn channels(samples: &[Sample]) -> Vec<Channel> {
    let mut channels: Vec<Channel> = Vec::new();
    for sample in samples {
        if !channels.contains(&sample.channel) {
            channels.push(sample.channel);
        }
    }
    channels.sort_unstable();
    channels
}

fn residuals<'a>(
    all: &'a [Simulated],
    regions: &'a [Region],
    maps: &'a [Map],
    held_out: Option<&'a Skill>,
    samples: usize,
) -> Residuals<'a> {
    Residuals {
        format: "residuals/1",
        recordings: all.iter().map(|one| one.recording.name.as_str()).collect(),
        samples,
        regions,
        thrust_maps: maps,
        held_out,
        remarks: all
            .iter()
            .flat_map(|one| {
                let recording = one.recording.name.as_str();
                one.remarks
                    .iter()
                    .map(move |remark| RemarkOf { recording, remark })
            })
            .collect(),
    }
}

fn page(
    name: &str,
    all: &[Simulated],
    regions: &[Region],
    maps: &[Map],
    figures: &[Figure],
) -> String {
    let mut page = Page::new(
        &format!("{name}: recorded and simulated"),
        &words::what(all),
    );
    page.paragraph(&words::baseline(all));
    for figure in figures {
        page.figure(figure);
    }
    page.section("Residuals by region");
    page.paragraph("Recorded minus simulated: mean (bias), root mean square (rms), that of the recorded values for scale, and the rms over what the instrument's stated accuracy allows.");
    page.table(&words::region_table(regions));
    if !maps.is_empty() {
        page.section("Thrust maps, identified in free flight");
        page.list(&maps.iter().map(Map::sentence).collect::<Vec<_>>());
    }
    let remarks = words::remarks(all);
    if !remarks.is_empty() {
        page.section("Noticed");
        page.list(&remarks);
    }
    page.finish()
}
