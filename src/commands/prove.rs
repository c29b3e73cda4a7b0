//! `plan prove`: synthetic recordings with an injected effect, diagnosed blind, and the metrics of
//! the answers.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use diagnosis::campaign::{CampaignFinding, diagnose_campaign};
use loader::recordings;
use serde::Serialize;
use tools::real_flights::{self, DRONES, HARDWARE, NORMAL, QUESTIONS, Question, SWARM, Set};
use validation::folder;
use validation::metrics::{LONG_SAMPLES, Metric, Metrics};
use validation::{Answer as Given, Case, Half};

use crate::commands::diagnose;
use crate::commands::plan::at_least_1;
use crate::commands::recordings::meta;
use crate::io::answer::{Answer, Format, print};
use crate::io::failure::Failure;
use crate::io::files::{self, OutFolder};
use crate::io::progress::Progress;
use crate::io::watch::cpu_s;
use crate::report::words::wrote;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Draws flights, weather, instruments and the injected effects
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Recordings to make; two in five have nothing injected
    #[arg(long, default_value_t = 600, value_parser = at_least_1)]
    count: usize,
    /// Families that no other run shows, drawn by the seed: totals alone
    #[arg(long, conflicts_with_all = ["out", "format"])]
    unseen: bool,
    /// Instead: the table of real flights, from a folder with `neural_swarm2` and `crazypad` in it;
    /// run it where `recordings/` lies
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["out", "format", "count", "seed", "unseen"])]
    flights: Option<PathBuf>,
    /// How to print the metrics
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Write marks.json and marks.txt to this folder
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Write the recordings there as well, and what was injected to truth/: about 500 kB each
    #[arg(long, requires = "out")]
    recordings: bool,
}

/// CPU time that one long recording may take (s): five seconds on two cores.
const MOST_CPU_S: f64 = 10.0;

/// What `--format json` prints, and marks.json: the same for the same seed and count.
#[derive(Serialize)]
struct Printed<'a> {
    format: &'static str,
    seed: u64,
    count: usize,
    reached: bool,
    marks: Vec<Metric>,
    #[serde(flatten)]
    all: &'a Metrics,
}

/// Answers no where a metric misses its goal.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    if let Some(folder) = &arguments.flights {
        return flights(folder);
    }
    let Arguments { seed, count, .. } = *arguments;
    let out = arguments.out.clone();
    let out = out
        .map(|it| OutFolder::prepare(it, "marks.json"))
        .transpose()?;
    let progress = Progress::start("validating", count);
    let half = match arguments.unseen {
        true => Half::Unseen,
        false => Half::Shown,
    };
    let mut marks = validation::prove(half, seed, count, |recording| {
        let start = Instant::now();
        let given = validation::ask(recording);
        progress.done_one();
        Given {
            seconds: start.elapsed().as_secs_f64(),
            ..given
        }
    });
    progress.finish();
    if half == Half::Unseen {
        print(&marks.totals(seed))?;
        return Ok(Answer::from(marks.are_reached()));
    }
    let time = time(seed, &marks);
    // What is written does not differ from run to run.
    marks.cases.iter_mut().for_each(|case| case.seconds = 0.0);
    let text = marks.report(seed);
    let json = files::json(&Printed {
        format: "marks/1",
        seed,
        count,
        reached: marks.are_reached(),
        marks: marks.metrics(),
        all: &marks,
    });
    let mut written = Vec::new();
    if let Some(out) = &out {
        written.push((out.path.join("marks.json"), json.clone()));
        written.push((out.path.join("marks.txt"), text.clone()));
        if arguments.recordings {
            for index in 0..count {
                written.extend(folder(&out.path, seed, index)?);
            }
        }
    }
    files::write(&written)?;
    let named = written.iter().take(2).map(|(path, _)| path.clone());
    let named: Vec<PathBuf> = named.collect();
    print(&match arguments.format {
        Format::Json => json,
        Format::Text => text + &time + &wrote(&named),
    })?;
    Ok(Answer::from(marks.are_reached()))
}

/// The table of real flights; campaign files are those that ship, below the current folder.
fn flights(folder: &Path) -> Result<Answer, Failure> {
    let read = |set: &Set| {
        let paths = [folder.join(set.folder)];
        let read = recordings::read_all(&paths, meta(Some(Path::new(set.campaign))))?;
        Ok::<_, Failure>(read.recordings)
    };
    let swarm = read(&SWARM)?;
    let ask = |question: &Question| {
        let options = diagnose::flights::options(&swarm, question.alone, question.near_floor)?;
        Ok(diagnose_campaign(&swarm, &options)?)
    };
    let found: Vec<CampaignFinding> = QUESTIONS.iter().map(ask).collect::<Result<_, Failure>>()?;
    let drones = DRONES.map(str::to_owned);
    let names = diagnose::hardware::Names {
        normal: NORMAL,
        drones: &drones,
        sessions: &[],
    };
    let hardware = diagnose::hardware::judge(&read(&HARDWARE)?, names)?.flights;
    print(&real_flights::table(&found, &hardware).markdown())?;
    Ok(Answer::from(real_flights::is_named(&found, &hardware)))
}

/// Side by side, recordings take one another's time: the slowest of the long ones once more, alone,
/// by the time that processors spend on it, which other programs do not change.
fn time(seed: u64, marks: &Metrics) -> String {
    let Some((index, slowest)) = marks.slowest() else {
        return String::new();
    };
    let Case { recording, .. } = validation::case(Half::Shown, seed, index);
    let before_s = cpu_s();
    let _again = validation::ask(&recording);
    let used = match cpu_s()
        .zip(before_s)
        .map(|(now_s, before_s)| now_s - before_s)
    {
        None => "not measured on this system".to_owned(),
        Some(used_s) if used_s > MOST_CPU_S => format!("{used_s:.1} s, missed"),
        Some(used_s) => format!("{used_s:.1} s"),
    };
    format!(
        "\nCPU time of the slowest recording of {LONG_SAMPLES} samples and more ({}, {} samples), alone: {used}; at most {MOST_CPU_S} s, \
         which is 5 s on two cores\n",
        slowest.family, slowest.samples
    )
}

/// The files of one case: the recording in a folder of its own, what was injected beside it.
fn folder(out: &Path, seed: u64, index: usize) -> Result<Vec<(PathBuf, String)>, Failure> {
    let Case { recording, truth } = validation::case(Half::Shown, seed, index);
    let here = OutFolder::prepare(out.join(&recording.name), "")?.path;
    let truths = OutFolder::prepare(out.join("truth"), "")?.path;
    let mut files = files::below(&here, folder::texts(&recording));
    // No answer is still to come.
    let truth = truth.unblind(&Given::nothing());
    let file = truths.join(format!("{}.json", recording.name));
    files.push((file, files::json_down_to(&truth, 0)));
    Ok(files)
}
