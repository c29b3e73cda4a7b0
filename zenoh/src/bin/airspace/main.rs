//! `leeward-airspace area`: the planner of one area of a site, with random traffic.
//! `leeward-airspace soak`: one process for each area, over loopback; one is killed and started
//! again, one is cut off; all plans together are judged by the verifier.

mod area;
mod forward;
mod soak;

use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use service::airspace::traffic::Grid;

#[derive(Parser)]
#[command(name = "leeward-airspace", version)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Plan one area until the time is over
    Area(area::Arguments),
    /// Run all areas of a site, each in a process; exit code 1 where the plans together are not
    /// sound, or a drone is of two planners, or of none, for longer than it takes to change hands
    Soak(soak::Arguments),
}

/// A site of square areas.
#[derive(Args, Clone, Debug)]
struct Place {
    /// Areas along x
    #[arg(long, default_value_t = 2)]
    columns: usize,
    /// Areas along y
    #[arg(long, default_value_t = 2)]
    rows: usize,
    /// Side of an area (m)
    #[arg(long, default_value_t = 12)]
    side: usize,
    /// How far its world reaches into its neighbours' (m)
    #[arg(long, default_value_t = 3)]
    strip: usize,
    /// Drones of an area at the beginning
    #[arg(long, default_value_t = 4)]
    drones: usize,
    /// Draws where they are and what they do
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How long after it is asked a change is flown (s): planning, and a message there and back
    #[arg(long, default_value_t = 1.0)]
    lead: f64,
    /// Of a hundred tasks so many lead to a neighbour
    #[arg(long, default_value_t = 50)]
    crossing: usize,
    /// Tasks given in an area in a second
    #[arg(long, default_value_t = 4.0)]
    rate: f64,
}

impl Place {
    fn grid(&self) -> Grid {
        Grid {
            areas: [self.columns, self.rows],
            side_m: self.side,
            strip_m: self.strip,
            drones: self.drones,
            seed: self.seed,
        }
    }

    /// As the command line has it.
    fn words(&self) -> Vec<String> {
        let named = [
            ("--columns", self.columns.to_string()),
            ("--rows", self.rows.to_string()),
            ("--side", self.side.to_string()),
            ("--strip", self.strip.to_string()),
            ("--drones", self.drones.to_string()),
            ("--seed", self.seed.to_string()),
            ("--lead", self.lead.to_string()),
            ("--crossing", self.crossing.to_string()),
            ("--rate", self.rate.to_string()),
        ];
        named
            .into_iter()
            .flat_map(|(name, value)| [name.to_owned(), value])
            .collect()
    }
}

/// Why a question is broken.
type Broken = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    let done = match CommandLine::parse().command {
        Command::Area(arguments) => area::run(&arguments).map(|()| true),
        Command::Soak(arguments) => soak::run(&arguments),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}
