//! `plan SCENARIO`: from a scenario file to a verified plan, its files and its report.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use flight::Setup;
use flight::battery::Charge;
use planner::plan::IgnoringDownwash;
use planner::plan::outcome::Effort;
use planner::scenario::Problems;
use planner::verify::lateness;
use planner::{Control, Outcome, Plan, Planned, World};
use serde::Serialize;
use viewer::{Bottlenecks, View};

use crate::commands::battery::Batteries;
use crate::commands::{ABOVE_0, fly, number};
use crate::io::answer::{Answer, Format, print};
use crate::io::failure::{Failure, tell, tell_error};
use crate::io::files;
use crate::io::files::{MOST_SCENARIO_BYTES, OutFolder};
use crate::io::problems;
use crate::io::watch::{Durations, Watch, peak_memory_bytes};
use crate::plots;
use crate::report::conflicts::{self, ConflictEntry};
use crate::report::plan as report;
use crate::report::sections::{Part, Report};
use crate::report::words::{self, LIST_ALL_UP_TO};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Scenario to plan (RON); `-` reads standard input
    scenario: PathBuf,
    /// How to print the answer
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Folder for plan.json, timing.json, plan.svg and plan.html [default: out/<scenario's file
    /// name>]; one that holds another command's output is refused
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
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    time_limit: Option<Duration>,
    /// Do not plan the fleet once more as if there were no downwash, to say what ignoring it would
    /// cost
    #[arg(long)]
    no_contrast: bool,
    /// Write no plan.html
    #[arg(long)]
    no_page: bool,
    /// Refuse a plan in which a drone takes more of its full battery (%)
    #[arg(long, value_name = "PERCENT", value_parser = number(ABOVE_0..=100.0, "%"))]
    battery: Option<f64>,
    /// Capacities of batteries and efficiencies of drives (RON; see docs/flight.md)
    #[arg(long, value_name = "SETUP.ron")]
    vehicles: Option<PathBuf>,
}

/// The file by which one knows a folder of this command.
const MAIN: &str = "plan.json";

/// Contents of timing.json: all that differs between two runs of the same scenario.
#[derive(Debug, Serialize)]
struct Timing {
    planning_time_s: f64,
    verification_time_s: f64,
    ignoring_downwash_time_s: f64,
    lateness_time_s: f64,
    /// `null` where the system does not tell.
    peak_memory_bytes: Option<u64>,
    threads: usize,
    /// Searches for one drone.
    searches: u64,
    /// States expanded over all searches.
    expansions: u64,
    /// Evictions: planned paths withdrawn for other drones.
    evictions: u64,
    /// PIBT rounds, where the floor is crowded.
    steps_together: u64,
}

/// What `--format json` prints.
#[derive(Default, Serialize)]
struct Printed<'a> {
    /// `safe`, `partial`, `unsafe` or `blocked`.
    status: &'static str,
    plan: Option<&'a Plan>,
    /// What a reader of the plan should know: how cells were chosen, which rules were given up.
    notes: Vec<&'a str>,
    conflicts: Vec<ConflictEntry>,
    /// How many more endpoints exclude one another.
    more_conflicts: usize,
    timing: Option<Timing>,
    /// Where no plan can be safe, what ignoring downwash would bring about; `null`: no plan
    /// either. Of a plan it stands in the plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    ignoring_downwash: Option<Option<IgnoringDownwash>>,
    /// Where drones wait most, and for which drones.
    #[serde(skip_serializing_if = "Option::is_none")]
    bottlenecks: Option<Bottlenecks>,
    /// What each drone takes of its battery.
    batteries: &'a [Charge],
    files: Vec<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let mut world = read_world(&arguments.scenario, arguments.finding.as_deref())?;
    let vehicles = fly::setup(arguments.vehicles.as_deref())?;
    tell_notes(&world.notes);
    if let Some(seed) = arguments.seed {
        world.planning.seed = seed;
    }
    use_threads(arguments.jobs)?;
    let name = match arguments.scenario.file_stem() {
        Some(stem) if !is_standard_input(&arguments.scenario) => stem.to_string_lossy(),
        _ => "scenario".into(),
    };
    let out = OutFolder::of(arguments.out.as_deref(), &name, MAIN)?;
    let watch = Watch::start(arguments.time_limit);
    let control = Control {
        stop: &|| watch.stop(),
        improve: &|| watch.improve(),
        progress: &|progress| watch.progress(progress),
        contrast: !arguments.no_contrast,
    };
    // A world that was read is in order.
    let outcome = planner::plan_world(&world, &control)
        .map_err(|faults| Failure::Drawn(faults.to_string()))?;
    let conflicts = match outcome {
        Outcome::Safe(mut planned)
        | Outcome::Partial(mut planned)
        | Outcome::Unsafe(mut planned) => {
            watch.tell_lateness();
            tell_lateness(&mut planned.plan, &watch);
            let durations = watch.finish();
            tell_notes(&planned.notes);
            let planned = (&*planned, vehicles.as_ref());
            return deliver(arguments, &out, &world, planned, &durations);
        }
        Outcome::Infeasible { conflicts } => conflicts,
    };
    // No plan can be safe: nothing is written.
    let earlier = out.path.join(MAIN);
    let earlier = earlier.exists().then(|| {
        let earlier = earlier.display();
        format!("{earlier} is of an earlier run: this one writes nothing")
    });
    out.abandon();
    tell_notes(earlier.as_slice());
    let notes = world.notes.iter().chain(&earlier);
    let mut printed = Printed {
        status: "blocked",
        notes: notes.map(String::as_str).collect(),
        conflicts: conflicts::describe_all(&conflicts, &world),
        more_conflicts: conflicts.more,
        ..Printed::default()
    };
    let pairs = match conflicts.count() {
        1 => "1 pair of places excludes one another".to_owned(),
        pairs => format!("{pairs} pairs of places exclude one another"),
    };
    let mut report = Report {
        title: format!("{}: no plan can be safe, {pairs}", world.name),
        ..Report::default()
    };
    if control.contrast {
        let ignoring = planner::contrast(&world, &control);
        let contrast = match &ignoring {
            Some(contrast) => report::contrast(Some(contrast)),
            None => "Ignoring downwash: no plan either.".into(),
        };
        printed.ignoring_downwash = Some(ignoring);
        report.section("", vec![Part::Line(contrast)]);
    }
    watch.finish();
    say(arguments.format, &printed, &report, Vec::new())?;
    Ok(Answer::No)
}

/// Prints what a reader of a plan should know, on standard error.
pub(super) fn tell_notes(notes: &[String]) {
    if !notes.is_empty() {
        tell(problems::draw_notes(notes, problems::colour_on_stderr()).trim_end());
    }
}

/// Writes into the plan of a small fleet that is in order how late each drone may be: of a larger
/// one that takes too long beside planning.
fn tell_lateness(plan: &mut Plan, watch: &Watch) {
    if plan.drones.len() > LIST_ALL_UP_TO || !plan.violations.is_empty() {
        return;
    }
    let late = lateness::of_all(plan, &|| watch.is_over());
    for (drone, late) in plan.drones.iter_mut().zip(late) {
        drone.may_be_late_s = late.map(|it| it.late_s);
    }
}

/// Writes the files, and prints the report with every reason for a no.
fn deliver(
    arguments: &Arguments,
    out: &OutFolder,
    world: &World,
    (planned, vehicles): (&Planned, Option<&Setup>),
    durations: &Durations,
) -> Result<Answer, Failure> {
    let Planned { plan, effort, .. } = planned;
    if let Some(setup) = vehicles {
        fly::tell_unknown(setup, plan);
    }
    let batteries = Batteries::of(plan, arguments.battery, vehicles);
    let mut printed = Printed {
        status: plan.status.as_str(),
        plan: Some(plan),
        notes: (world.notes.iter().chain(&planned.notes))
            .map(String::as_str)
            .collect(),
        conflicts: conflicts::describe_all(&planned.conflicts, world),
        more_conflicts: planned.conflicts.more,
        timing: Some(Timing::of(durations, effort)),
        ignoring_downwash: None,
        bottlenecks: None,
        batteries: &batteries.charges,
        files: Vec::new(),
    };
    let texts = vec![
        (MAIN.to_owned(), files::json(plan)),
        ("timing.json".to_owned(), files::json(&printed.timing)),
    ];
    printed.files = files::write_below(&out.path, texts)?;
    // The plan first: pictures of it are drawn when it is safe on the disk.
    let mut pictures = vec![("plan.svg".to_owned(), plots::plan::draw(plan, Some(world)))];
    let view = View::of(plan, Some(world));
    if !arguments.no_page {
        let page = view.page(None);
        pictures.push(("plan.html".to_owned(), page));
    }
    printed
        .files
        .extend(files::write_below(&out.path, pictures)?);
    let bottlenecks = view.bottlenecks();
    let mut report = report::report(plan, durations, effort.improved_s(), &bottlenecks);
    report.section("", batteries.line().map(Part::Line).into_iter().collect());
    printed.bottlenecks = Some(bottlenecks);
    say(arguments.format, &printed, &report, reasons(plan))?;
    tell_batteries(&batteries);
    Ok(Answer::from(plan.is_safe() && batteries.are_within()))
}

/// Prints on standard error which batteries are beyond their limit, or nearly empty.
pub(super) fn tell_batteries(batteries: &Batteries) {
    match batteries.warning() {
        Some(warning) if batteries.are_within() => tell(&format!("warning: {warning}")),
        Some(beyond) => tell_error(&beyond, &[]),
        None => {}
    }
}

/// Prints an answer; then on standard error its conflicts and every other error, each with its
/// lines.
fn say(
    format: Format,
    printed: &Printed,
    report: &Report,
    errors: Vec<Vec<String>>,
) -> Result<(), Failure> {
    print(&match format {
        Format::Json => files::json_with_plan_inside(printed),
        Format::Text => report.text() + &words::wrote(&printed.files),
    })?;
    let conflicts = printed.conflicts.iter().map(ConflictEntry::lines);
    let errors: Vec<Vec<String>> = conflicts.chain(errors).collect();
    let texts: Vec<String> = errors.iter().map(|lines| lines.concat()).collect();
    let name = |index: usize| match errors[index][0].split('`').nth(1) {
        Some(name) => format!("`{name}`"),
        None => errors[index][0].clone(),
    };
    for told in problems::told_once(
        &texts,
        "with figures of their own (--format json) for",
        name,
    ) {
        let mut lines = errors[told.first].clone();
        lines.extend(told.others);
        tell_error(&lines[0], &lines[1..]);
    }
    if printed.more_conflicts > 0 {
        let more = words::count(printed.more_conflicts, "pair excludes", "pairs exclude");
        tell(&format!("... and {more} one another"));
    }
    if errors.iter().flatten().any(|line| line.contains("alpha ")) {
        tell(words::ALPHA);
    }
    Ok(())
}

/// Why drones stay, and what the verifier found.
fn reasons(plan: &Plan) -> Vec<Vec<String>> {
    let unplanned = plan.unplanned.iter().map(|entry| {
        let is_stopped = entry.cause.as_ref().is_some_and(|it| it.kind == "stopped");
        let what = if is_stopped {
            "no path yet"
        } else {
            "no safe path"
        };
        let reason = format!("{what} for `{}`: {}", entry.name, entry.reason);
        reason.lines().map(str::to_owned).collect()
    });
    let found = plan.violations.iter();
    let found = found.map(|found| vec![format!("the plan fails its check: {found}")]);
    unplanned.chain(found).collect()
}

impl Timing {
    fn of(durations: &Durations, effort: &Effort) -> Timing {
        Timing {
            planning_time_s: durations.planning.as_secs_f64(),
            verification_time_s: durations.verification.as_secs_f64(),
            ignoring_downwash_time_s: durations.ignoring_downwash.as_secs_f64(),
            lateness_time_s: durations.lateness.as_secs_f64(),
            peak_memory_bytes: peak_memory_bytes(),
            threads: rayon::current_num_threads(),
            searches: effort.searches,
            expansions: effort.expansions,
            evictions: effort.evictions,
            steps_together: effort.rounds,
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

/// How many of what there has to be some of.
pub(crate) fn at_least_1(text: &str) -> Result<usize, String> {
    let count: usize = text.parse().map_err(|_| "not a whole number".to_owned())?;
    match count {
        0 => Err("must be at least 1".to_owned()),
        count => Ok(count),
    }
}

fn is_standard_input(scenario: &Path) -> bool {
    scenario.as_os_str() == "-"
}

pub(crate) fn read_world(path: &Path, finding: Option<&Path>) -> Result<World, Failure> {
    world_of(path, &read_source(path)?, finding)
}

/// The text of a scenario.
pub(crate) fn read_source(path: &Path) -> Result<String, Failure> {
    let text = match is_standard_input(path) {
        true => files::text_of(std::io::stdin(), MOST_SCENARIO_BYTES),
        false => files::text(path, MOST_SCENARIO_BYTES),
    };
    text.map_err(Failure::read(path))
}

/// The world of a scenario's text that stands at a path, or all its problems drawn beside it.
pub(crate) fn world_of(path: &Path, text: &str, finding: Option<&Path>) -> Result<World, Failure> {
    let world = found_in(path, text, finding)?;
    world.map_err(|found| drawn(&path.display().to_string(), text, &found))
}

/// The world of a scenario's text that stands, or might stand, at a path, or its problems.
pub(crate) fn found_in(
    path: &Path,
    text: &str,
    finding: Option<&Path>,
) -> Result<Result<World, Problems>, Failure> {
    let named = |file: &Path| {
        let text = files::text(file, MOST_SCENARIO_BYTES).map_err(Failure::read(file));
        text.map(|text| (file.display().to_string(), text))
    };
    let finding = finding.map(named).transpose()?;
    // Meshes, the jet and the finding of a scenario are named relative to it; the command line's is
    // not.
    let folder = path.parent().unwrap_or(Path::new(""));
    let load = |source: &str| match &finding {
        Some((file, text)) if file == source => Ok(text.clone()),
        _ => files::text(&folder.join(source), MOST_SCENARIO_BYTES).map_err(|it| it.to_string()),
    };
    let mut files = planner::Files::new(&load);
    if let Some((finding, _)) = &finding {
        files = files.with_finding(finding);
    }
    Ok(planner::read_world_with(text, &files))
}

/// The problems of a scenario called `name`, drawn beside its text.
pub(crate) fn drawn(name: &str, text: &str, found: &Problems) -> Failure {
    let colour = problems::colour_on_stderr();
    Failure::Drawn(problems::draw(found, name, text, colour))
}
