//! `plan simulate RECORDING...`: what the declared simulation would have recorded, beside what was.

mod csv;
mod simulated;
mod skill;
mod words;

use std::collections::BTreeSet;
use std::path::PathBuf;

use clap::Args;
use diagnosis::campaign::Applied;
use diagnosis::forward::residuals::by_region;
use diagnosis::forward::simulate::{Channel, Sample};
use diagnosis::infer::finding_file::FindingFile;
use diagnosis::record::recording::{Recording, Vehicle};
use diagnosis::thrust::maps::identify_all;

use super::applied;
use super::recordings::{Asked, Read};
use crate::io::answer::Answer;
use crate::io::failure::Failure;
use crate::io::progress::Progress;
use crate::plots;
use crate::report::sections::{Figure, Part};
use crate::report::words::channel_words;
use simulated::{Printed, Simulated, simulate_all};

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    asked: Asked,
    /// Also judge forces in whole flights that no thrust map was identified from, and the drones'
    /// clocks
    #[arg(long)]
    held_out: bool,
    /// Also simulate with a finding (finding.ron) from other recordings: errors before and after,
    /// by flight
    #[arg(long, value_name = "FILE")]
    finding: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let Read {
        mut recordings,
        name,
        mut left_out,
    } = arguments.asked.read()?;
    let finding = arguments
        .finding
        .as_deref()
        .map(applied::read)
        .transpose()?;
    let judged = |finding: &FindingFile| {
        let judged = applied::judge(&recordings, Vec::new(), None, finding)?;
        let figures = applied::figures(&name, &recordings, &judged);
        left_out.extend(applied::not_judged(&recordings, 0, &judged));
        Ok::<_, Failure>((judged, figures))
    };
    let judged = finding.as_ref().map(judged).transpose()?;
    let (judged, more_figures): (Option<Applied>, Vec<Figure>) = match judged {
        Some((judged, figures)) => (Some(judged), figures),
        None => (None, Vec::new()),
    };
    // Before the recordings hold maps that were identified in all of them.
    let held_out = arguments
        .held_out
        .then(|| skill::held_out(&recordings))
        .transpose()
        .map_err(Failure::HeldOut)?;
    let progress = Progress::start("identifying thrust maps", 1);
    let thrust_maps = identify_all(&mut recordings);
    progress.finish();
    let all = simulate_all(recordings);
    let samples: Vec<Sample> = all.iter().flat_map(|one| &one.samples).copied().collect();
    if samples.is_empty() {
        let recordings = all.iter().map(|one| &one.recording);
        return Err(Failure::nothing_to_compare(recordings));
    }
    let scatter_n = |vehicle: &Vehicle| {
        let map = thrust_maps.iter().find(|map| map.is_of(vehicle))?;
        Some(map.identification.scatter_n)
    };
    let simulated = all.iter().map(|one| (&one.recording, &one.samples[..]));
    let simulated: Vec<(&Recording, &[Sample])> = simulated.collect();
    let figures = plots::simulation::draw(&name, &simulated, scatter_n);
    left_out.extend(all.iter().flat_map(Simulated::remarks));
    let printed = Printed {
        recordings: all.iter().map(|one| one.recording.name.as_str()).collect(),
        samples: samples.len(),
        regions: by_region(&simulated),
        thrust_maps,
        held_out,
        applied: judged,
        remarks: left_out,
    };
    let mut report = words::report(&name, &all, &printed, figures);
    if let (Some(judged), Some(finding)) = (&printed.applied, &finding) {
        applied::section(&mut report, &printed.recordings, judged, finding);
        let more = more_figures.into_iter().map(Part::Figure);
        report.section("Residuals before and after", more.collect());
    }
    let channels: BTreeSet<Channel> = samples.iter().map(|sample| sample.channel).collect();
    let table = |channel| {
        let file = format!("{}.csv", channel_words(channel).file_stem);
        (file, csv::table(channel, &all))
    };
    let tables = channels.into_iter().map(table).collect();
    let json = ("residuals.json", usize::MAX, "residuals/1");
    arguments
        .asked
        .deliver((&name, &report), json, &printed, tables)?;
    Ok(Answer::from(
        printed.applied.as_ref().is_none_or(applied::helps),
    ))
}
