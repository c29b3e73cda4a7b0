//! `plan generate`: a scenario made by rule and seed, as RON.

use std::path::PathBuf;

use clap::{Args, Subcommand};
use planner::instances;

use crate::failure::{Failure, answer};
use crate::{Answer, files};

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    instance: Instance,
    /// Write to this file instead of standard output
    #[arg(long, global = true, value_name = "FILE")]
    out: Option<PathBuf>,
}

#[derive(Subcommand)]
enum Instance {
    /// Empty hall, 64 x 64 x 8 m, random starts and goals
    Hall(Scattered),
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
    /// Everybody on a circle flies to the opposite point
    Circle {
        /// How many drones
        #[arg(long, default_value_t = 16)]
        drones: usize,
        /// Radius of the circle (m)
        #[arg(long, default_value_t = 20.0, value_name = "METRES")]
        radius: f64,
    },
}

#[derive(Args)]
struct Scattered {
    /// How many drones
    #[arg(long, default_value_t = 100)]
    drones: usize,
    /// Draws the starts and goals
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let text = match &arguments.instance {
        Instance::Hall(Scattered { drones, seed }) => instances::hall(*drones, *seed),
        Instance::Field(Scattered { drones, seed }) => instances::field(*drones, *seed),
        Instance::Warehouse(Scattered { drones, seed }) => instances::warehouse(*drones, *seed),
        Instance::Window { drones } => instances::window(*drones),
        Instance::Circle { drones, radius } => instances::circle(*drones, *radius),
    }?;
    match &arguments.out {
        Some(path) => files::write(&[(path.clone(), text)])?,
        None => answer(&text)?,
    }
    Ok(Answer::Yes)
}
