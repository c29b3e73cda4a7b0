//! `plan generate`: a scenario made by rule and seed, as RON.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};
use tools::instances::{self, Floor};
use validation::folder::texts;
use validation::hover_grid::HoverGrid;

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
        /// Make every tenth drone one of these; it keeps the eight columns around its start and its goal free
        #[arg(long, value_enum, value_name = "AIRFRAME")]
        every_tenth: Option<Heavy>,
    },
    /// Empty field, 160 x 160 x 8 m, random starts and goals
    Field(Scattered),
    /// 80 x 60 x 8 m with 76 shelves, random starts and goals in the aisles
    Warehouse(Scattered),
    /// Two rooms that swap their drones through one window 2 m wide
    Window {
        /// How many drones
        #[arg(long, default_value_t = 20)]
        drones: usize,
    },
    /// Every drone on a circle flies to the opposite point
    Circle {
        /// How many drones
        #[arg(long, default_value_t = 16)]
        drones: usize,
        /// Radius of the circle (m)
        #[arg(long, default_value_t = 20.0, value_name = "METRES")]
        radius: f64,
    },
    /// Synthetic flights over a speed probe, as folders in the format downwash-recording/1; needs --out
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

/// The drones that the paper's fit is made from.
const UNCANTED: [&str; 4] = ["kolibri", "offboard-1", "offboard-2", "matrice-300"];

#[derive(Args)]
struct Scattered {
    /// How many drones
    #[arg(long, default_value_t = 100)]
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
    /// .3dmap and .3dscen in voxels of 1 m, .map and .scen of the floor seen from above; needs --out
    Movingai,
    /// YAML with x, y and z of every cell; needs --out
    #[value(name = "libmultirobotplanning")]
    LibMultiRobotPlanning,
}

/// An airframe that can fly among Offboards 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Heavy {
    /// 6.3 kg, 0.89 m from motor to motor
    #[value(name = "matrice-300")]
    Matrice300,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let text = match &arguments.instance {
        Instance::Hall {
            scattered,
            every_tenth,
        } => {
            let floor = match every_tenth {
                Some(Heavy::Matrice300) => Floor::MixedHall,
                None => Floor::Hall,
            };
            return over(floor, scattered, arguments.out.as_deref());
        }
        Instance::Field(scattered) => {
            return over(Floor::Field, scattered, arguments.out.as_deref());
        }
        Instance::Warehouse(scattered) => {
            return over(Floor::Warehouse, scattered, arguments.out.as_deref());
        }
        Instance::Window { drones } => instances::window(*drones),
        Instance::Circle { drones, radius } => instances::circle(*drones, *radius),
        Instance::Recordings(grids) => {
            let out = arguments.out.as_deref();
            let folder = out.ok_or(Failure::NoFolder("recordings are folders"))?;
            return recordings(grids, folder);
        }
    }?;
    scenario(text, arguments.out.as_deref())
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
    let Scattered {
        drones,
        seed,
        format,
    } = *scattered;
    if format == Form::Scenario {
        return scenario(floor.scenario(drones, seed)?, out);
    }
    let grid = floor.grid(drones, seed)?;
    let folder = out.ok_or(Failure::NoFolder("this format is files by name"))?;
    let texts = if format == Form::Movingai {
        instances::movingai(&grid).to_vec()
    } else {
        vec![instances::lib_multi_robot_planning(&grid)]
    };
    let folder = OutFolder::prepare(folder.to_owned())?.path;
    let named = |(name, text)| (folder.join(name), text);
    files::write(&texts.into_iter().map(named).collect::<Vec<_>>())?;
    Ok(Answer::Yes)
}

/// One folder a flight, named by drone and number; nothing is written unless all of it can be.
fn recordings(grids: &HoverGrids, folder: &Path) -> Result<Answer, Failure> {
    let names: Vec<&str> = match grids.drones.as_slice() {
        [] => UNCANTED.to_vec(),
        named => named.iter().map(String::as_str).collect(),
    };
    let mut written = Vec::new();
    for (index, &name) in (0_u64..).zip(&names) {
        let unknown = || Failure::NoSuchAirframe(name.to_owned());
        let mut kinds = vec![("", HoverGrid::over_one_probe(name).ok_or_else(unknown)?)];
        if grids.near_field {
            kinds.push(("-near", HoverGrid::near_field(name).ok_or_else(unknown)?));
        }
        for (kind, (suffix, mut grid)) in (0_u64..).zip(kinds) {
            if grids.short {
                shorten(&mut grid);
            }
            for flight in 0..grids.flights {
                // No two flights of a run share a seed.
                let seed = ((grids.seed * 64 + index) * 2 + kind) * 4096 + flight;
                let path = folder.join(format!("{name}{suffix}-{}", flight + 1));
                for (file, text) in texts(&grid.fly(seed)) {
                    written.push((path.join(file), text));
                }
            }
        }
    }
    for (path, _) in &written {
        let parent = path.parent().unwrap_or(folder);
        std::fs::create_dir_all(parent).map_err(Failure::write(parent))?;
    }
    files::write(&written)?;
    Ok(Answer::Yes)
}

/// Every `n`th of a list, ends included, so that so many are left.
fn thinned(values: &[f64], left: usize) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    (0..left)
        .filter_map(|i| values.get((i * last + (left - 1) / 2) / (left - 1)))
        .copied()
        .collect()
}

fn shorten(grid: &mut HoverGrid) {
    grid.depths_over_l = thinned(&grid.depths_over_l, 5);
    grid.offsets_over_l = thinned(&grid.offsets_over_l, 9);
    grid.track_hz = 2.0;
}
