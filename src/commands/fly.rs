//! `plan fly`: a plan flown in closed loop.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use airflow::CONVECTION_FACTORS;
use clap::{Args, ValueEnum};
use flight::controller::Controller;
use flight::feed_forward::FeedForward;
use flight::gusts::INTENSITY;
use flight::{FlightReport, Options, Setup};
use planner::plan::Plan;
use planner::plan::file::PlanFile;
use planner::verify::examination::examine;
use serde::Serialize;
use viewer::View;

use crate::commands::number;
use crate::commands::plan::{seconds, tell_notes, use_threads};
use crate::io::answer::{Answer, Format, print};
use crate::io::failure::{Failure, tell};
use crate::io::files::{self, OutFolder};
use crate::io::plans::Source;
use crate::io::progress::Progress;
use crate::plots;
use crate::report::words::{ALPHA, wrote};
use crate::report::{flight as report, page};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Plan to fly; with --airframe or --airframes a show, a folder of setpoints, or a log, as
    /// `plan check` takes them
    #[arg(
        value_name = "PLAN.json | SHOW.skyc | TABLE.csv",
        required_unless_present = "paper"
    )]
    plan: Option<PathBuf>,
    /// Airframe of all drones of a show or a log, by its preset's name
    #[arg(
        long,
        value_name = "NAME",
        requires = "plan",
        conflicts_with = "airframes"
    )]
    airframe: Option<String>,
    /// Which airframes a show or a log is of, and where they fly (RON; see docs/shows.md)
    #[arg(long, value_name = "FLEET.ron", requires = "plan")]
    airframes: Option<PathBuf>,
    /// Fly the paper's own case instead: a Kolibri passes below an Offboard 2; gusts, their seed
    /// and vehicles may be given
    #[arg(long, conflicts_with_all = ["plan", "controller", "feed_forward", "convection", "lean", "until", "out"])]
    paper: bool,
    /// Controller
    #[arg(long, value_enum, default_value_t = Controllers::Px4)]
    controller: Controllers,
    /// What drones know of the air, one or several; without feed-forward is flown in any case
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        default_value = "paper,late,matched"
    )]
    feed_forward: Vec<FeedForwardChoice>,
    /// Speed of the air in wakes over that of the centreline, one or several, 0.05 to 1000
    /// [default: the plan's range, else 1 and 0.6]
    #[arg(long, value_name = "K", value_delimiter = ',', value_parser = number(CONVECTION_FACTORS[0]..=CONVECTION_FACTORS[1], ""))]
    convection: Vec<f64>,
    /// Gusts of the jets over their centreline speed, 0 to 1; 0: none
    #[arg(long, value_name = "INTENSITY", default_value_t = INTENSITY, value_parser = number(0.0..=1.0, ""), allow_negative_numbers = true)]
    gusts: f64,
    /// Seed of the gusts
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Let air leave along the thrust, turned about: acceleration leans the wake, whatever a
    /// finding says of it
    #[arg(long)]
    lean: bool,
    /// Fly only up to this time of the plan
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    until: Option<std::time::Duration>,
    /// Vehicles and gains (RON; see docs/flight.md)
    #[arg(long, value_name = "SETUP.ron")]
    vehicles: Option<PathBuf>,
    /// How to print the answer
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Folder for flight.json, report.html, plan.html and figures [default: out/fly/<plan's
    /// scenario>]; one that holds another command's output is refused
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads [default: one per core]; the answer does not depend on it
    #[arg(long)]
    jobs: Option<NonZeroUsize>,
}

/// Controllers as the command line has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Controllers {
    /// PX4's cascade with its default gains
    Px4,
    /// A stiff cascade without integral
    Research,
    /// Both, one after the other
    Both,
}

/// Feed-forward as the command line has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FeedForwardChoice {
    /// Nothing
    None,
    /// The paper's: the value at its centre, of quasi-static wakes
    Paper,
    /// The mean over its discs, of advected wakes
    Late,
    /// The same, by the rotors' own law in place of momentum theory's
    Matched,
}

/// What `--format json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    report: &'a FlightReport,
    /// What is wrong with the plan itself.
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    notes: &'a [String],
    #[serde(skip_serializing_if = "<[PathBuf]>::is_empty")]
    files: &'a [PathBuf],
}

/// The file by which one knows a folder of this command.
const MAIN: &str = "flight.json";

/// Exit codes: 0 no drone over its limit, none touches another or anything; 1: one does; 2: there
/// is no plan that can be flown.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    use_threads(arguments.jobs)?;
    let setup = setup(arguments.vehicles.as_deref())?.unwrap_or_default();
    let Some(path) = &arguments.plan else {
        return paper(arguments, &setup);
    };
    let airframes = (
        arguments.airframe.as_deref(),
        arguments.airframes.as_deref(),
    );
    let source = Source::one(path, airframes.0, airframes.1);
    let file = source.read()?.file;
    tell_unknown(&setup, &file.plan);
    let options = options(arguments, &file);
    let name = source.name(&file);
    let out = OutFolder::of(arguments.out.as_deref(), &name, MAIN)?;
    let mut bar: OnceLock<Progress> = OnceLock::new();
    let progress = |done: usize, all: usize| {
        let bar = bar.get_or_init(|| Progress::start("seconds flown", all));
        (0..done).for_each(|_| bar.done_one());
    };
    let flown = flight::fly(&file.plan, &setup, &options, &progress);
    if let Some(bar) = bar.take() {
        bar.finish();
    }
    let mut flown = match flown {
        Ok(flown) => flown,
        Err(error) => {
            out.abandon();
            let path = path.clone();
            return Err(Failure::NotFlown { path, error });
        }
    };
    unsaid(&mut flown, &file);
    let contradictions = planner::verify::contradictions(&file.plan);
    let mut notes: Vec<String> = contradictions.iter().map(ToString::to_string).collect();
    let effects = file.plan.flown_effects();
    if !effects.is_empty() {
        notes.push(format!("flown in air with {}", effects.join(", ")));
    }
    let figure = plots::flight::draw(&flown);
    let report = report::report(&name, &flown, figure);
    let json = |files: &[PathBuf]| {
        let printed = Printed {
            report: &flown,
            notes: &notes,
            files,
        };
        files::json_down_to(&printed, LEVELS)
    };
    let mut texts = vec![(MAIN.to_owned(), json(&[]))];
    texts.extend(page::files(&report));
    // What a plan does not say of itself the page has from the verifier.
    let examined = (!file.claims.are_whole()).then(|| examine(&file, true));
    let view = match &examined {
        Some(found) => View::of(&found.plan, None).with_omitted(found.omitted),
        None => View::of(&file.plan, None),
    };
    let page = view.page(Some(&flown));
    texts.push(("plan.html".to_owned(), page));
    let files = files::write_below(&out.path, texts)?;
    print(&match arguments.format {
        Format::Text => report.text() + &wrote(&files),
        Format::Json => json(&files),
    })?;
    if arguments.format == Format::Text {
        for note in &notes {
            tell(&format!("note: {note}"));
        }
        tell(ALPHA);
    }
    Ok(Answer::from(flown.is_within_limits()))
}

/// flight.json has a line for each drone of each flight.
const LEVELS: usize = 4;

/// The paper's own flight beside the paper's figures.
fn paper(arguments: &Arguments, setup: &Setup) -> Result<Answer, Failure> {
    let found = flight::paper::fly(setup, arguments.seed, arguments.gusts);
    print(&match arguments.format {
        Format::Text => report::paper(&found).text(),
        Format::Json => files::json_pretty(&found),
    })?;
    Ok(Answer::Yes)
}

/// Vehicles and gains from a file, if there is one.
pub(super) fn setup(path: Option<&Path>) -> Result<Option<Setup>, Failure> {
    let read = |path: &Path| {
        let text = files::text(path, files::MOST_SCENARIO_BYTES).map_err(Failure::read(path))?;
        Setup::read(&text).map_err(|error| Failure::NotASetup {
            path: path.to_owned(),
            error,
        })
    };
    path.map(read).transpose()
}

/// Notes which airframes of a file of parameters no drone of the plan has.
pub(super) fn tell_unknown(setup: &Setup, plan: &Plan) {
    let flown = plan.drones.iter().map(|drone| &drone.airframe.name[..]);
    let unknown = setup.unknown(&flown.collect());
    let note = |name| format!("--vehicles: no drone of the plan has an airframe `{name}`");
    tell_notes(&unknown.into_iter().map(note).collect::<Vec<String>>());
}

fn options(arguments: &Arguments, file: &PlanFile) -> Options {
    let mut convection = arguments.convection.clone();
    if convection.is_empty() {
        convection = match file.plan.convection() {
            Some(stated) => {
                let [lowest, highest] = stated.factors();
                vec![highest, lowest]
            }
            None => Options::default().convection,
        };
        convection.dedup();
    }
    Options {
        controllers: match arguments.controller {
            Controllers::Px4 => vec![Controller::Px4],
            Controllers::Research => vec![Controller::Research],
            Controllers::Both => vec![Controller::Px4, Controller::Research],
        },
        feed_forward: each_once(arguments.feed_forward.iter().map(|known| match known {
            FeedForwardChoice::None => FeedForward::None,
            FeedForwardChoice::Paper => FeedForward::Paper,
            FeedForwardChoice::Late => FeedForward::Late,
            FeedForwardChoice::Matched => FeedForward::Matched,
        })),
        convection,
        gusts: arguments.gusts,
        lean: arguments.lean,
        seed: arguments.seed,
        until_s: arguments.until.map(|it| it.as_secs_f64()),
    }
}

fn each_once<T: PartialEq>(all: impl Iterator<Item = T>) -> Vec<T> {
    let mut once = Vec::new();
    for one in all {
        if !once.contains(&one) {
            once.push(one);
        }
    }
    once
}

/// Takes out claims that the file does not make.
fn unsaid(flown: &mut FlightReport, file: &PlanFile) {
    let drones = flown.flights.iter_mut().map(|flight| &mut flight.drones);
    for drones in drones {
        for (k, drone) in drones.iter_mut().enumerate() {
            let claims = file.claims.drones.get(k);
            if claims.is_none_or(|it| it.worst_air_mps.is_none()) {
                drone.claimed_alpha = None;
            }
        }
    }
}
