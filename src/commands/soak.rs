//! `plan soak`: the simulated life of a fleet, planned by what `plan serve` answers with.

mod life;
mod tally;

use std::num::NonZeroUsize;

use clap::{Args, ValueEnum};
use flight::feed_forward::FeedForward;
use flight::{Options, Setup};
use planner::Plan;
use planner::scenario::limits::DELAY_S;
use tools::instances::Floor;

use crate::commands::plan::use_threads;
use crate::commands::{ABOVE_0, number};
use crate::io::answer::{Answer, Format, print};
use crate::io::failure::Failure;
use crate::io::files;
use crate::io::progress::Progress;
use crate::io::watch::cpu_s;
use life::Life;
use tally::Tally;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Where they fly
    #[arg(long, value_enum, default_value_t = SoakSite::Hall)]
    place: SoakSite,
    /// How many drones there are at most
    #[arg(long, default_value_t = 500, value_name = "N",
        value_parser = clap::value_parser!(u32).range(2..=5_000))]
    drones: u32,
    /// How long they live (minutes of the site's clock)
    #[arg(long, default_value_t = 60.0, value_name = "MINUTES", value_parser = number(ABOVE_0..=1e6, "min"), allow_negative_numbers = true)]
    minutes: f64,
    /// Changes in a second of the site's clock
    #[arg(long, default_value_t = 10.0, value_name = "N", value_parser = number(ABOVE_0..=1e6, ""), allow_negative_numbers = true)]
    rate: f64,
    /// Time between two requests (s of the site's clock): what has changed until then is one
    #[arg(long, default_value_t = 1.0, value_name = "SECONDS", value_parser = number(ABOVE_0..=DELAY_S.high, "s"), allow_negative_numbers = true)]
    interval: f64,
    /// Longest time that a patch may take (s); a change is to hold so long after it is asked for
    #[arg(long, default_value_t = 1.0, value_name = "SECONDS", value_parser = number(ABOVE_0..=1e6, "s"), allow_negative_numbers = true)]
    deadline: f64,
    /// Draws all of it
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Do not fly the last minutes in closed loop at the end
    #[arg(long)]
    without_flight: bool,
    /// Replay the journal at the end and compare, which takes as long as all patches took
    #[arg(long)]
    replay: bool,
    /// How to print the answer
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Threads [default: one per core]
    #[arg(long)]
    jobs: Option<NonZeroUsize>,
}

#[derive(Clone, Copy, ValueEnum)]
enum SoakSite {
    /// Empty, 64 x 64 x 8 m
    Hall,
    /// 80 x 60 x 8 m with 76 shelves
    Warehouse,
}

/// Answers no where a patch was late, a plan not sound, memory not flat, or the flight met too much
/// air or touched something.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    use_threads(arguments.jobs)?;
    let floor = match arguments.place {
        SoakSite::Hall => Floor::Hall,
        SoakSite::Warehouse => Floor::Warehouse,
    };
    let drones = arguments.drones as usize;
    let scenario = floor.scenario(drones, arguments.seed)?;
    let mut tally = Tally::new(arguments.deadline);
    let mut life = Life::new(&scenario, drones, arguments.seed, &mut tally)
        .map_err(|answer| Failure::NotSoaked(answer.to_string()))?;
    let before_s = cpu_s();
    let rounds = (60.0 * arguments.minutes / arguments.interval)
        .ceil()
        .max(1.0) as usize;
    let progress = Progress::start("requests", rounds);
    for round in 1..=rounds {
        let at_s = arguments.interval * round as f64;
        // So many by now, less those before.
        let by_now = |round: usize| (arguments.rate * arguments.interval * round as f64) as usize;
        life.round(at_s, by_now(round) - by_now(round - 1), &mut tally);
        if round % (rounds / 20).max(1) == 0 {
            life.examine(&mut tally);
        }
        progress.done_one();
    }
    progress.finish();
    life.examine(&mut tally);
    tally.cpu_s = cpu_s()
        .zip(before_s)
        .map(|(now_s, before_s)| now_s - before_s);
    if arguments.replay {
        tally.replayed = Some(life.is_replayed());
    }
    if !arguments.without_flight {
        tally.flight = Some(flown(&life.plan())?);
    }
    print(&match arguments.format {
        Format::Text => tally.text(arguments.minutes),
        Format::Json => files::json_pretty(&tally.json(arguments.minutes)),
    })?;
    Ok(Answer::from(tally.is_in_order()))
}

/// The plan in closed loop, from where its history begins.
fn flown(plan: &Plan) -> Result<flight::report::Flight, Failure> {
    let options = Options {
        feed_forward: vec![FeedForward::Matched],
        convection: vec![1.0],
        ..Options::default()
    };
    let told = flight::fly(&from_zero(plan), &Setup::default(), &options, &|_, _| {});
    let told = told.map_err(|error| Failure::NotSoaked(error.to_string()))?;
    let with = told
        .flights
        .into_iter()
        .rfind(|it| it.case.feed_forward == FeedForward::Matched);
    with.ok_or_else(|| Failure::NotSoaked("no flight was flown".to_owned()))
}

/// The same plan with its clock set to 0 where the history that it still has begins.
fn from_zero(plan: &Plan) -> Plan {
    let mut plan = plan.clone();
    let begins = plan.drones.iter().map(|it| it.enters_s.unwrap_or(0.0));
    let begins_s = begins.fold(f64::INFINITY, f64::min);
    for drone in &mut plan.drones {
        for t_s in &mut drone.trajectory.t_s {
            *t_s -= begins_s;
        }
        let (from_s, until_s) = drone.airborne_s;
        drone.airborne_s = (from_s - begins_s, until_s.map(|it| it - begins_s));
        for rest_s in &mut drone.landed_s {
            *rest_s = (rest_s.0 - begins_s, rest_s.1 - begins_s);
        }
        drone.enters_s = drone.enters_s.map(|it| it - begins_s);
        drone.arrives_s -= begins_s;
    }
    plan
}
