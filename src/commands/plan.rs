//! `plan SCENARIO`: from a scenario file to a verified plan, its files and its report.

use std::io::Read as _;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use planner::plan::outcome::{Control, Effort, Outcome, WellFormed};
use planner::plan::{IgnoringDownwash, Plan, Status};
use planner::scenario::world::World;
use serde::Serialize;

use crate::io::failure::{Failure, answer, tell, tell_error};
use crate::io::files;
use crate::io::files::OutFolder;
use crate::io::problems;
use crate::io::watch::{Durations, Watch, peak_memory_bytes};
use crate::plots;
use crate::report::conflicts::{self, ConflictEntry};
use crate::report::plan as report;
use crate::report::well_formed::{self, WellFormedEntry};
use crate::report::words;
use crate::{Answer, Format};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Scenario to plan (RON); `-` reads standard input
    scenario: PathBuf,
    /// How to print the answer
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Folder for plan.json, timing.json and plan.svg [default: out/<scenario's file name>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Finding to fly through, as `plan diagnose` writes it, in place of the scenario's
    #[arg(long, value_name = "FINDING.ron")]
    finding: Option<PathBuf>,
    /// Breaks ties and orders restarts, in place of the scenario's seed
    #[arg(long)]
    seed: Option<u64>,
    /// Threads [default: one per core]; the plan does not depend on it
    #[arg(long)]
    jobs: Option<NonZeroUsize>,
    /// Stop after this long with the best plan so far; time left over makes it better
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    time_limit: Option<Duration>,
}

/// Contents of timing.json: all that differs between two runs of the same scenario.
#[derive(Debug, Serialize)]
struct Timing {
    planning_time_s: f64,
    verification_time_s: f64,
    ignoring_downwash_time_s: f64,
    /// `null` where the system does not tell.
    peak_memory_bytes: Option<u64>,
    threads: usize,
    /// Searches for one drone.
    searches: u64,
    /// States expanded over all searches.
    expansions: u64,
    /// Drones whose path was taken back for another's.
    evictions: u64,
    /// Steps that everybody took at once, where the floor is crowded.
    steps_together: u64,
}

/// What `--format json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    /// `safe`, `partial`, `unsafe`, `blocked` or `stopped`.
    status: &'static str,
    plan: Option<&'a Plan>,
    conflicts: &'a [ConflictEntry],
    /// Whether any order of the fleet leads to a plan; `null` where that is not examined.
    well_formed: Option<WellFormedEntry<'a>>,
    timing: Option<&'a Timing>,
    files: Vec<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let mut world = read_world(&arguments.scenario, arguments.finding.as_deref())?;
    if !world.notes.is_empty() {
        tell(problems::draw_notes(&world.notes, problems::colour_on_stderr()).trim_end());
    }
    if let Some(seed) = arguments.seed {
        world.planning.seed = seed;
    }
    use_threads(arguments.jobs)?;
    let out = OutFolder::prepare(
        arguments
            .out
            .clone()
            .unwrap_or_else(|| default_out(&arguments.scenario)),
    )?;
    let watch = Watch::start(arguments.time_limit);
    let control = Control {
        stop: &|| watch.stop(),
        improve: &|| watch.improve(),
        progress: &|progress| watch.progress(progress),
    };
    match planner::plan_world(&world, &control) {
        Outcome::Planned {
            plan,
            conflicts,
            well_formed,
            effort,
        } => {
            let durations = watch.finish();
            let conflicts = conflicts::describe_all(&conflicts, &world);
            deliver(
                arguments.format,
                &out,
                &plan,
                &conflicts,
                &durations,
                (effort, well_formed.as_ref()),
            )
        }
        Outcome::Blocked { conflicts } => {
            out.abandon();
            let conflicts = conflicts::describe_all(&conflicts, &world);
            let contrast = planner::contrast(&world, &control);
            watch.finish();
            blocked(arguments.format, &world, &conflicts, contrast.as_ref())
        }
        Outcome::Stopped => {
            out.abandon();
            watch.finish();
            stopped(arguments.format)
        }
    }
}

/// So many threads from here on; `None`: one a core.
pub(crate) fn use_threads(jobs: Option<NonZeroUsize>) -> Result<(), Failure> {
    let Some(jobs) = jobs.map(NonZeroUsize::get) else {
        return Ok(());
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs);
    pool.build_global()
        .map_err(|source| Failure::Threads { jobs, source })
}

/// A length of time from the command line.
pub(crate) fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text
        .parse()
        .map_err(|_| "not a number of seconds".to_owned())?;
    if seconds.is_nan() || seconds <= 0.0 {
        return Err("must be more than 0 s".into());
    }
    // Beyond what a clock can count is as good as no limit.
    Ok(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX))
}

fn default_out(scenario: &Path) -> PathBuf {
    let name = match scenario.file_stem() {
        Some(stem) if !is_standard_input(scenario) => stem.to_owned(),
        _ => "scenario".into(),
    };
    Path::new("out").join(name)
}

fn is_standard_input(scenario: &Path) -> bool {
    scenario.as_os_str() == "-"
}

fn read_world(path: &Path, finding: Option<&Path>) -> Result<World, Failure> {
    let text = if is_standard_input(path) {
        let mut text = String::new();
        std::io::stdin().read_to_string(&mut text).map(|_| text)
    } else {
        std::fs::read_to_string(path)
    }
    .map_err(Failure::read(path))?;
    let finding = match finding {
        Some(file) => {
            let text = std::fs::read_to_string(file).map_err(Failure::read(file))?;
            Some((file.display().to_string(), text))
        }
        None => None,
    };
    // Meshes, the jet and the finding of a scenario are named relative to it; the command line's is not.
    let folder = path.parent().unwrap_or(Path::new(""));
    let load = |source: &str| match &finding {
        Some((file, text)) if file == source => Ok(text.clone()),
        _ => std::fs::read_to_string(folder.join(source)).map_err(|error| error.to_string()),
    };
    let flown = finding.as_ref().map(|(file, _)| file.as_str());
    read_text(&path.display().to_string(), &text, flown, &load)
}

/// The world of a scenario called `name`, or all its problems drawn beside its text.
pub(crate) fn read_text(
    name: &str,
    text: &str,
    finding: Option<&str>,
    load: &dyn Fn(&str) -> Result<String, String>,
) -> Result<World, Failure> {
    planner::scenario::read_world_flying(text, finding, &load).map_err(|found| {
        let colour = problems::colour_on_stderr();
        Failure::Scenario(problems::draw(&found, name, text, colour))
    })
}

/// Writes the files, prints the report and every reason for a no.
fn deliver(
    format: Format,
    out: &OutFolder,
    plan: &Plan,
    conflicts: &[ConflictEntry],
    durations: &Durations,
    (effort, well_formed): (Effort, Option<&WellFormed>),
) -> Result<Answer, Failure> {
    let timing = Timing {
        planning_time_s: durations.planning.as_secs_f64(),
        verification_time_s: durations.verification.as_secs_f64(),
        ignoring_downwash_time_s: durations.ignoring_downwash.as_secs_f64(),
        peak_memory_bytes: peak_memory_bytes(),
        threads: rayon::current_num_threads(),
        searches: effort.searches,
        expansions: effort.expansions,
        evictions: effort.evictions,
        steps_together: effort.rounds,
    };
    let written = [
        ("plan.json", files::json(plan)),
        ("timing.json", files::json(&timing)),
        ("plan.svg", plots::plan::draw(plan)),
    ]
    .map(|(name, text)| (out.path.join(name), text));
    files::write(&written)?;
    match format {
        Format::Json => answer(&files::json_with_plan_inside(&Printed {
            status: plan.status.as_str(),
            plan: Some(plan),
            conflicts,
            well_formed: well_formed.map(|known| well_formed::describe(known, plan)),
            timing: Some(&timing),
            files: written.iter().map(|(path, _)| path.clone()).collect(),
        }))?,
        Format::Text => {
            let wrote = format!(
                "\nwrote {}  timing.json  plan.svg\n",
                written[0].0.display()
            );
            answer(
                &(report::report(plan, durations, well_formed, effort.improved_s()).text()
                    + &wrote),
            )?;
        }
    }
    conflicts::print(conflicts);
    for left_out in &plan.unplanned {
        let mut reason = left_out.reason.lines();
        let what = format!(
            "no safe path for `{}`: {}",
            left_out.name,
            reason.next().unwrap_or("no reason known")
        );
        tell_error(&what, &reason.map(str::to_owned).collect::<Vec<_>>());
    }
    for found in &plan.violations {
        tell_error(
            &format!("the plan fails its check: {}", words::violation(found)),
            &[],
        );
    }
    Ok(Answer::from(
        plan.status == Status::Safe && plan.unplanned.is_empty() && plan.violations.is_empty(),
    ))
}

/// No plan can be safe; what can be said is said, and nothing is written.
fn blocked(
    format: Format,
    world: &World,
    conflicts: &[ConflictEntry],
    ignoring: Option<&IgnoringDownwash>,
) -> Result<Answer, Failure> {
    match format {
        Format::Json => answer(&files::json_with_plan_inside(&Printed {
            status: "blocked",
            plan: None,
            conflicts,
            well_formed: None,
            timing: None,
            files: Vec::new(),
        }))?,
        Format::Text => {
            let contrast = match ignoring {
                Some(contrast) => report::contrast(Some(contrast)),
                None => "Ignoring downwash: no plan either.".into(),
            };
            answer(&format!(
                "{}: no plan can be safe, {} at the start exclude one another\n  {contrast}\n",
                world.name,
                words::count(conflicts.len(), "pair", "pairs")
            ))?;
        }
    }
    conflicts::print(conflicts);
    Ok(Answer::No)
}

fn stopped(format: Format) -> Result<Answer, Failure> {
    if format == Format::Json {
        answer(&files::json(&Printed {
            status: "stopped",
            plan: None,
            conflicts: &[],
            well_formed: None,
            timing: None,
            files: Vec::new(),
        }))?;
    }
    tell_error(
        "stopped before there was any plan; nothing is written",
        &["help: allow more time".into()],
    );
    Ok(Answer::No)
}
