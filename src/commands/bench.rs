//! `plan bench`: how planning grows with the fleet, as a table with its machine and its command.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use planner::Control;
use serde_json::json;
use tools::bench::growth::growth;
use tools::bench::instance::{Figures, Instance, Measured};
use tools::bench::machine::Machine;
use tools::bench::row::Row;
use tools::bench::suite::Suite;
use tools::bench::{apart, peers, table};
use tools::instances::Floor;

use super::by_name;
use super::plan::{at_least_1, drawn, seconds, use_threads};
use crate::io::answer::{Answer, Format, print};
use crate::io::failure::Failure;
use crate::io::files;
use crate::io::progress::Progress;
use crate::io::watch::{Watch, peak_memory_bytes};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Where they fly, as `plan generate` makes it; mixed-hall: every tenth drone a Matrice 300
    #[arg(value_parser = by_name(&Floor::ALL, Floor::name), default_values = ["hall", "warehouse"])]
    places: Vec<Floor>,
    /// Sizes of the fleets
    #[arg(long, value_delimiter = ',', default_values_t = [100, 200, 500, 1000], value_name = "N,N...", value_parser = at_least_1)]
    drones: Vec<usize>,
    /// Instances of every size; each figure is the median over them
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2, 3], value_name = "SEED,SEED...")]
    seeds: Vec<u64>,
    /// Stop planning an instance after this long with the best plan so far; the plan that ignores
    /// downwash may take as long again
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    time_limit: Option<Duration>,
    /// Threads [default: one per core]
    #[arg(long)]
    jobs: Option<NonZeroUsize>,
    /// Leave out the plans that ignore downwash; they are not timed, but take their time
    #[arg(long)]
    without_contrast: bool,
    /// Plan in straight motion with quasi-static wakes from the start, as crowded floors are
    #[arg(long)]
    relaxed: bool,
    /// Solve the same instances by other planners, too: `lacam3` (the `main` of LaCAM3) and `lns`
    /// (MAPF-LNS2), where they lie in this folder; on the floor alone, as they do
    #[arg(long, value_name = "DIR", conflicts_with = "one")]
    peers: Option<PathBuf>,
    /// How to print: Markdown, or JSON with every single run
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Plan one instance (one place, one size, one seed) in this process and print its figures as
    /// JSON: each figure of the table comes from such a process of its own, so that its peak of
    /// memory is its own
    #[arg(long, conflicts_with = "format")]
    one: bool,
}

/// Answers no where a fleet could not be planned whole or a plan is not verified.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let suite = arguments.suite();
    if let Some(path) = &suite.peers {
        std::fs::read_dir(path).map_err(|source| Failure::Read {
            path: path.clone(),
            source,
        })?;
    }
    let asked = suite.instances();
    // Nothing is planned where something does not fit.
    for one in &asked {
        one.place.scenario(one.drones, one.seed)?;
    }
    if arguments.one {
        let [one] = asked.as_slice() else {
            return Err(Failure::NotOneInstance(asked.len()));
        };
        let figures = plan(one)?;
        print(&files::json(&figures))?;
        return Ok(Answer::from(figures.is_safe()));
    }
    let machine = Machine::here(arguments.jobs);
    let command = suite.command();
    let rows = rows(&suite, asked.len());
    let folder = suite.peers.as_deref();
    let peers = folder.map(|folder| peers::rows(&suite, folder, tempfile::tempdir));
    print(&match arguments.format {
        Format::Text => {
            let table = table::text(&command, &machine, &rows, suite.seeds.len());
            let peers = peers.map(|peers| peers::text(&rows, &peers));
            table + &peers.map_or(String::new(), |peers| format!("\n{peers}"))
        }
        Format::Json => files::json_pretty(&json!({
            "format": "bench/1",
            "command": command,
            "machine": machine,
            "rows": rows,
            "growth": growth(&rows),
            "peers": peers,
        })),
    })?;
    Ok(Answer::from(rows.iter().all(Row::is_safe)))
}

/// Plans one instance in this process. The limit holds for planning, and once more for the plan
/// that ignores downwash.
fn plan(one: &Instance) -> Result<Figures, Failure> {
    let text = one.place.scenario(one.drones, one.seed)?;
    let no_files = |file: &str| Err(format!("there is no {file}"));
    let world = planner::read_world_with(&text, &planner::Files::new(&no_files));
    let mut world = world.map_err(|found| drawn(one.place.name(), &text, &found))?;
    if one.relaxed {
        world = world.relaxed().unwrap_or(world);
    }
    use_threads(one.jobs)?;
    let watch = Watch::start(one.time_limit);
    let cut_short = AtomicBool::new(false);
    let outcome = planner::plan_world(
        &world,
        &Control {
            stop: &|| {
                let stop = watch.stop();
                cut_short.fetch_or(stop, Ordering::Relaxed);
                stop
            },
            progress: &|phase| watch.progress(phase),
            ..Control::QUIET
        },
    );
    let spent = watch.finish();
    let measured = Measured {
        planning: spent.planning,
        verification: spent.verification,
        cut_short: cut_short.into_inner(),
        peak_memory_bytes: peak_memory_bytes(),
    };
    let mut planned = outcome.ok().and_then(planner::Outcome::into_planned);
    if let (Some(planned), true) = (&mut planned, one.contrast) {
        let watch = Watch::start(one.time_limit);
        planned.plan.ignoring_downwash = planner::contrast(
            &world.ruled_as(&planned.plan),
            &Control {
                stop: &|| watch.stop(),
                ..Control::QUIET
            },
        );
    }
    Ok(Figures::of(planned.as_ref(), one.drones, measured))
}

impl Arguments {
    fn suite(&self) -> Suite {
        Suite {
            places: self.places.clone(),
            drones: self.drones.clone(),
            seeds: self.seeds.clone(),
            time_limit: self.time_limit,
            jobs: self.jobs,
            contrast: !self.without_contrast,
            relaxed: self.relaxed,
            peers: self.peers.clone(),
        }
    }
}

/// Each instance in a process of its own; after an interrupt the rest is not run, and says so.
fn rows(suite: &Suite, instances: usize) -> Vec<Row> {
    let watch = Watch::start(None);
    let progress = Progress::start("planning instances", instances);
    let rows = suite.rows(|one| {
        let figures = match watch.stop() {
            true => Err("not run: interrupted".to_owned()),
            false => apart::plan(one),
        };
        progress.done_one();
        figures
    });
    progress.finish();
    rows
}
