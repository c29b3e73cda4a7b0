//! `plan bench`: how planning grows with the fleet, as a table with its machine and its command.

mod apart;
mod fit;
mod machine;
mod one;
mod row;
mod table;

use std::num::NonZeroUsize;
use std::time::Duration;

use clap::{Args, ValueEnum};
use serde::Serialize;
use tools::instances::Floor;

use crate::commands::plan::seconds;
use crate::io::failure::{Failure, answer};
use crate::io::files;
use crate::io::progress::Progress;
use crate::io::watch::Watch;
use crate::{Answer, Format};
use machine::Machine;
use one::One;
use row::{Row, Run};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Where they fly, as `plan generate` makes it
    #[arg(value_enum, default_values_t = [Place::Hall, Place::Warehouse])]
    places: Vec<Place>,
    /// Sizes of the fleets
    #[arg(long, value_delimiter = ',', default_values_t = [100, 200, 500, 1000], value_name = "N,N...")]
    drones: Vec<usize>,
    /// Instances of every size; each figure is the median over them
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2, 3], value_name = "SEED,SEED...")]
    seeds: Vec<u64>,
    /// Stop planning an instance after this long with the best plan so far; the plan that ignores downwash may take as long again
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    time_limit: Option<Duration>,
    /// Threads [default: one per core]
    #[arg(long)]
    jobs: Option<NonZeroUsize>,
    /// Leave out the plans that ignore downwash; they are not timed, but take their time
    #[arg(long)]
    without_contrast: bool,
    /// How to print: Markdown, or JSON with every single run
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Plan one instance (one place, one size, one seed) in this process and print its figures as JSON: each figure of the table comes from such a process of its own, so that its peak of memory is its own
    #[arg(long, conflicts_with = "format")]
    one: bool,
}

/// Where a fleet flies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
enum Place {
    /// Empty, 64 x 64 x 8 m
    Hall,
    /// The hall, every tenth drone a Matrice 300
    MixedHall,
    /// 80 x 60 x 8 m with 76 shelves
    Warehouse,
    /// Empty, 160 x 160 x 8 m
    Field,
}

impl Place {
    fn floor(self) -> Floor {
        match self {
            Place::Hall => Floor::Hall,
            Place::MixedHall => Floor::MixedHall,
            Place::Warehouse => Floor::Warehouse,
            Place::Field => Floor::Field,
        }
    }

    /// As the command line has it.
    fn word(self) -> &'static str {
        self.floor().name()
    }
}

/// What `--format json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    format: &'static str,
    command: &'a str,
    machine: &'a Machine,
    rows: &'a [Row],
    growth: Vec<fit::Growth>,
}

/// Answers no where a fleet could not be planned whole or a plan is not verified.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let asked = arguments.all_of_them();
    // Nothing is planned where something does not fit.
    for one in &asked {
        one.place.floor().scenario(one.drones, one.seed)?;
    }
    if arguments.one {
        let [one] = asked.as_slice() else {
            return Err(Failure::NotOneInstance(asked.len()));
        };
        let figures = one::plan(one)?;
        answer(&files::json(&figures))?;
        return Ok(Answer::from(figures.is_safe()));
    }
    let machine = Machine::here(arguments.jobs);
    let rows = rows(arguments, asked);
    let command = arguments.command();
    answer(&match arguments.format {
        Format::Text => table::text(&command, &machine, &rows, arguments.seeds.len()),
        Format::Json => files::json_pretty(&Printed {
            format: "bench/1",
            command: &command,
            machine: &machine,
            growth: fit::growth(&rows),
            rows: &rows,
        }),
    })?;
    Ok(Answer::from(rows.iter().all(Row::is_safe)))
}

/// One after another, so that nobody takes another's time; after an interrupt the rest is not run, and says so.
fn rows(arguments: &Arguments, asked: Vec<One>) -> Vec<Row> {
    let watch = Watch::start(None);
    let progress = Progress::start("planning instances", asked.len());
    let mut runs = asked.into_iter().map(|one| {
        let result = if watch.stop() {
            Err("not run: interrupted".to_owned())
        } else {
            apart::plan(&one)
        };
        progress.done_one();
        Run::of(one.seed, result)
    });
    let mut rows = Vec::new();
    for &place in &arguments.places {
        for &drones in &arguments.drones {
            let runs = runs.by_ref().take(arguments.seeds.len()).collect();
            rows.push(Row::of(place, drones, runs));
        }
    }
    drop(runs);
    progress.finish();
    rows
}

impl Arguments {
    /// Every instance, row by row, seed by seed.
    fn all_of_them(&self) -> Vec<One> {
        let mut asked = Vec::new();
        for &place in &self.places {
            for &drones in &self.drones {
                asked.extend(self.seeds.iter().map(|&seed| One {
                    place,
                    drones,
                    seed,
                    time_limit: self.time_limit,
                    jobs: self.jobs,
                    contrast: !self.without_contrast,
                }));
            }
        }
        asked
    }

    /// The command that does this again.
    fn command(&self) -> String {
        let places: Vec<&str> = self.places.iter().map(|place| place.word()).collect();
        let mut command = format!(
            "plan bench {} --drones {} --seeds {}",
            places.join(" "),
            listed(&self.drones),
            listed(&self.seeds)
        );
        if let Some(limit) = self.time_limit {
            command += &format!(" --time-limit {}", limit.as_secs_f64());
        }
        if let Some(jobs) = self.jobs {
            command += &format!(" --jobs {jobs}");
        }
        if self.without_contrast {
            command += " --without-contrast";
        }
        command
    }
}

fn listed<T: ToString>(values: &[T]) -> String {
    let words: Vec<String> = values.iter().map(T::to_string).collect();
    words.join(",")
}
