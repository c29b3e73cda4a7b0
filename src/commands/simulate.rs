//! `plan simulate RECORDING...`: what the declared simulation would have recorded, beside what was.

mod csv;
mod forces;
mod skill;
mod words;

use std::collections::BTreeSet;
use std::path::PathBuf;

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
use crate::plots;
use crate::report::words::{file_stem, wrote};
use crate::{Answer, Format};
use forces::Map;
use skill::Skill;

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

/// Contents of residuals.json, and with the files what `--format json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    format: &'static str,
    recordings: Vec<&'a str>,
    samples: usize,
    regions: &'a [Region],
    thrust_maps: &'a [Map],
    #[serde(skip_serializing_if = "Option::is_none")]
    held_out: Option<&'a Skill>,
    remarks: Vec<RemarkOf<'a>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    files: Vec<PathBuf>,
}

#[derive(Serialize)]
struct RemarkOf<'a> {
    recording: &'a str,
    #[serde(flatten)]
    remark: &'a Remark,
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
    let name = recordings::name_of(&arguments.recordings, &first.recording.name);
    let simulated: Vec<(&Recording, &[Sample])> = all
        .iter()
        .map(|one| (&one.recording, one.samples.as_slice()))
        .collect();
    let scatter_n = |airframe: &str| {
        let map = maps.iter().find(|map| map.airframe == airframe)?;
        Some(map.identification.scatter_n)
    };
    let figures = plots::simulation::draw(&name, &simulated, scatter_n);
    let mut printed = Printed {
        format: "residuals/1",
        recordings: all.iter().map(|one| one.recording.name.as_str()).collect(),
        samples: samples.len(),
        regions: &regions,
        thrust_maps: &maps,
        held_out: skill.as_ref(),
        remarks: all.iter().flat_map(Simulated::remarks).collect(),
        files: Vec::new(),
    };
    let report = words::report(&name, &all, &printed, figures);
    let mut texts: Vec<(String, String)> = channels(&samples)
        .into_iter()
        .map(|channel| {
            let file = format!("{}.csv", file_stem(channel));
            (file, csv::table(channel, &all))
        })
        .collect();
    texts.push(("residuals.json".to_owned(), files::json_pretty(&printed)));
    texts.extend(report.files());
    let out = OutFolder::of(arguments.out.as_deref(), &name)?;
    printed.files = files::write_below(&out.path, texts)?;
    answer(&match arguments.format {
        Format::Text => report.text() + &wrote(&printed.files),
        Format::Json => files::json_pretty(&printed),
    })?;
    Ok(Answer::Yes)
}

impl Simulated {
    fn remarks(&self) -> impl Iterator<Item = RemarkOf<'_>> {
        let recording = self.recording.name.as_str();
        let of = move |remark| RemarkOf { recording, remark };
        self.remarks.iter().map(of)
    }
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
fn channels(samples: &[Sample]) -> BTreeSet<Channel> {
    samples.iter().map(|sample| sample.channel).collect()
}
