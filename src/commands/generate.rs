//! `plan generate`: a scenario made by rule and seed, as RON.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};
use tools::instances::{self, Floor};
use validation::hover_grid::set::{GridSet, UNCANTED};

use crate::commands::plan::at_least_1;
use crate::io::answer::{Answer, print};
use crate::io::failure::Failure;
use crate::io::files::{self, OutFolder};

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    instance: Instance,
    /// Write to this file instead of standard output; recordings and other formats: to this folder
    #[arg(long, global = true, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Subcommand)]
enum Instance {
    /// Empty hall, 64 x 64 x 8 m, random starts and goals
    Hall {
        #[command(flatten)]
        scattered: Scattered,
        /// Make every tenth drone one of these (6.3 kg, 0.89 m from motor to motor); it keeps the
        /// eight columns around its start and its goal free
        #[arg(long, value_parser = ["matrice-300"], value_name = "AIRFRAME")]
        every_tenth: Option<String>,
    },
    /// Empty field, 160 x 160 x 8 m, random starts and goals
    Field(Scattered),
    /// 80 x 60 x 8 m with 76 shelves, random starts and goals in the aisles
    Warehouse(Scattered),
    /// Two rooms that swap their drones through one window 2 m wide
    Window {
        /// How many drones
        #[arg(long, default_value_t = 20, value_parser = at_least_1)]
        drones: usize,
    },
    /// Every drone on a circle flies to the opposite point
    Circle {
        /// How many drones
        #[arg(long, default_value_t = 16, value_parser = at_least_1)]
        drones: usize,
        /// Radius of the circle (m)
        #[arg(long, default_value_t = 20.0, value_name = "METRES")]
        radius: f64,
    },
    /// Random world of everything that a scenario may hold, for tests: world.ron and its meshes;
    /// needs --out
    Random {
        /// Draws all of it
        #[arg(long, default_value_t = 0)]
        seed: u64,
    },
    /// Synthetic flights over a speed probe, as folders in the format downwash-recording/1; needs
    /// --out
    Recordings(HoverGrids),
}

#[derive(Args)]
struct HoverGrids {
    /// Flights of every drone
    #[arg(long, default_value_t = 2)]
    flights: u64,
    /// Airframes that fly [default: the four uncanted drones of the paper]
    #[arg(long, value_delimiter = ',', value_name = "AIRFRAME")]
    drones: Vec<String>,
    /// Fly above 2.5 motor distances as well, along the body's y axis
    #[arg(long)]
    near_field: bool,
    /// Fewer points: 5 depths, 9 offsets, 2 rows of the track a second
    #[arg(long)]
    short: bool,
    /// Draws weather, gusts and the probe's faults
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

#[derive(Args)]
struct Scattered {
    /// How many drones
    #[arg(long, default_value_t = 100, value_parser = at_least_1)]
    drones: usize,
    /// Draws the starts and goals
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// What to write
    #[arg(long, value_enum, default_value_t = Form::Scenario)]
    format: Form,
}

/// What an instance is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Form {
    /// A scenario for this command, as RON
    Scenario,
    /// .3dmap and .3dscen in voxels of 1 m, .map and .scen of the floor seen from above; needs
    /// --out
    Movingai,
    /// YAML with x, y and z of every cell; needs --out
    #[value(name = "libmultirobotplanning")]
    LibMultiRobotPlanning,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let out = arguments.out.as_deref();
    let text = match &arguments.instance {
        Instance::Hall {
            scattered,
            every_tenth: None,
        } => return over(Floor::Hall, scattered, out),
        Instance::Hall { scattered, .. } => return over(Floor::MixedHall, scattered, out),
        Instance::Field(scattered) => return over(Floor::Field, scattered, out),
        Instance::Warehouse(scattered) => return over(Floor::Warehouse, scattered, out),
        Instance::Window { drones } => instances::window(*drones),
        Instance::Circle { drones, radius } => instances::circle(*drones, *radius),
        Instance::Random { seed } => {
            let folder = out.ok_or(Failure::NoFolder("a random world may have meshes"))?;
            let folder = OutFolder::prepare(folder.to_owned(), "")?.path;
            let mut made = instances::random::world(*seed);
            made.meshes.push(("world.ron".to_owned(), made.scenario));
            files::write_below(&folder, made.meshes)?;
            return Ok(Answer::Yes);
        }
        Instance::Recordings(grids) => return recordings(grids, out),
    }?;
    scenario(text, out)
}

fn scenario(text: String, out: Option<&Path>) -> Result<Answer, Failure> {
    match out {
        Some(path) => files::write(&[(path.to_owned(), text)])?,
        None => print(&text)?,
    }
    Ok(Answer::Yes)
}

/// Random flights over a floor, in the form asked for.
fn over(floor: Floor, scattered: &Scattered, out: Option<&Path>) -> Result<Answer, Failure> {
    let Scattered { drones, seed, .. } = *scattered;
    let texts = match scattered.format {
        Form::Scenario => return scenario(floor.scenario(drones, seed)?, out),
        Form::Movingai => instances::movingai(&floor.grid(drones, seed)?).to_vec(),
        Form::LibMultiRobotPlanning => {
            vec![instances::lib_multi_robot_planning(
                &floor.grid(drones, seed)?,
            )]
        }
    };
    let folder = out.ok_or(Failure::NoFolder("this format is files by name"))?;
    let folder = OutFolder::prepare(folder.to_owned(), "")?.path;
    files::write_below(&folder, texts)?;
    Ok(Answer::Yes)
}

/// One folder a flight; nothing is written unless all of it can be.
fn recordings(grids: &HoverGrids, out: Option<&Path>) -> Result<Answer, Failure> {
    let out = out.ok_or(Failure::NoFolder("recordings are folders"))?;
    let airframes: Vec<&str> = grids.drones.iter().map(String::as_str).collect();
    let set = GridSet {
        airframes: match airframes.as_slice() {
            [] => &UNCANTED,
            named => named,
        },
        flights: grids.flights,
        near_field: grids.near_field,
        short: grids.short,
        seed: grids.seed,
    };
    let mut written = Vec::new();
    for (name, texts) in set.folders()? {
        let folder = OutFolder::prepare(out.join(name), "")?.path;
        written.extend(files::below(&folder, texts));
    }
    files::write(&written)?;
    Ok(Answer::Yes)
}
