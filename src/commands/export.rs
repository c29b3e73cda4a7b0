//! `plan export`: a plan in the formats that other programs fly.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use exchange::frame::{Axes, Georeference};
use exchange::{
    ExportError, Manifest, Options, RATE_DEFAULT_HZ, RATES_HZ, Refusal, Target, export,
};
use planner::verify::examination::examine;
use serde::Serialize;
use serde_json::json;

use crate::commands::{by_name, number};
use crate::io::answer::{Answer, Format, print};
use crate::io::failure::{Failure, tell_error};
use crate::io::files::{self, OutFolder};
use crate::io::plans::{Source, Sourced};
use crate::report::words::{count, wrote};

#[derive(Args)]
pub(crate) struct Arguments {
    /// What is exported; it is verified first
    #[command(flatten)]
    source: Source,
    /// Format
    #[arg(long, value_name = "FORMAT", value_parser = by_name(&Target::ALL, Target::as_str))]
    to: Target,
    /// Setpoints, Skybrush, CZML, QGC: where (0, 0, 0) lies (deg, deg, m above mean sea level), and
    /// where +x points (deg, clockwise from north)
    #[arg(long, value_name = "LAT,LON,AMSL,HEADING", value_parser = georeference)]
    #[arg(allow_hyphen_values = true)]
    georeference: Option<Georeference>,
    /// Setpoints: axes [default: ned]
    #[arg(long, value_enum)]
    frame: Option<FrameNames>,
    /// Setpoints: how many a second, 2 to 1000 [default: 20]
    #[arg(long, value_name = "HZ", value_parser = number(RATES_HZ, "Hz"))]
    rate: Option<f64>,
    /// Setpoints: count from the world's (0, 0, 0), or from each drone's start, as each PX4 does
    /// [default: common]
    #[arg(long, value_enum)]
    origin: Option<Origins>,
    /// Crazyswarm: the compressed form alone, for paths of more than 31 pieces
    #[arg(long)]
    compressed: bool,
    /// QGC: missions hold no times; write them all the same
    #[arg(long)]
    untimed_ok: bool,
    /// How to print the answer
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Folder for the files and export.json [default: out/export/<plan's scenario>/<format>]; what
    /// an earlier export left there is replaced
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Axes as the command line has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FrameNames {
    /// North, east, down
    Ned,
    /// East, north, up
    Enu,
}

/// Origins of setpoints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Origins {
    /// The world's
    Common,
    /// Each drone's first place
    Own,
}

/// What `--format json` prints.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    manifest: &'a Manifest,
    files: &'a [PathBuf],
}

/// More files than these are counted, not named.
const FILES_NAMED: usize = 6;
/// The file by which one knows a folder of this command.
const MAIN: &str = exchange::import::MANIFEST;

impl Arguments {
    /// Options that were given and say nothing of the format, each with the formats it is for.
    fn inapplicable(&self) -> Vec<String> {
        let given = [
            ("--georeference", self.georeference.is_some()),
            ("--frame", self.frame.is_some()),
            ("--rate", self.rate.is_some()),
            ("--origin", self.origin.is_some()),
            ("--compressed", self.compressed),
            ("--untimed-ok", self.untimed_ok),
        ];
        let told = self.to.idle(given).map(|(option, of)| {
            let to = self.to.as_str();
            format!("`{option}` is for --to {of}: it says nothing of {to}")
        });
        told.collect()
    }
}

/// Exit codes: 0 written and read back; 1: the plan is not safe, or a drone does not fit; 2: there
/// is no plan, or an option that is not for the format.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let inapplicable = arguments.inapplicable();
    if !inapplicable.is_empty() {
        return Err(Failure::Inapplicable(inapplicable));
    }
    let Sourced { file, kept } = arguments.source.read()?;
    let examined = examine(&file, false);
    let violations = examined.plan.violations.len() + examined.omitted;
    if violations > 0 {
        let what = format!(
            "{}: not exported: {}",
            arguments.source.path().display(),
            count(violations, "violation", "violations")
        );
        return refused(arguments, &what, &[], "see plan check");
    }
    let options = Options {
        plan_id: arguments.source.id()?,
        kept,
        georeference: arguments.georeference,
        axes: match arguments.frame {
            None | Some(FrameNames::Ned) => Axes::Ned,
            Some(FrameNames::Enu) => Axes::Enu,
        },
        rate_hz: arguments.rate.unwrap_or(RATE_DEFAULT_HZ),
        own_origin: arguments.origin == Some(Origins::Own),
        compressed_alone: arguments.compressed,
        untimed_ok: arguments.untimed_ok,
    };
    let made = match export(&file.plan, arguments.to, &options) {
        Ok(made) => made,
        Err(error @ (ExportError::NoGeoreference | ExportError::Origin(_))) => {
            return Err(Failure::NoGeoreference(error.into()));
        }
        Err(error) => {
            let refusals = match &error {
                ExportError::Refused(refusals) => &refusals[..],
                _ => &[],
            };
            let what = format!("{}: {error}", arguments.source.path().display());
            let then = match &error {
                ExportError::Untimed(_) => {
                    "nothing is written; --untimed-ok writes them all the same"
                }
                _ => "nothing is written",
            };
            return refused(arguments, &what, refusals, then);
        }
    };
    let name = format!("{}/{}", arguments.source.name(&file), arguments.to.as_str());
    let out = OutFolder::of(arguments.out.as_deref(), &name, MAIN)?;
    let before = files_of(&out.path.join(MAIN));
    let mut contents = vec![(MAIN.to_owned(), files::json(&made.manifest).into_bytes())];
    contents.extend(made.files.into_iter().map(|it| (it.name, it.bytes)));
    let paths = files::write_below(&out.path, contents)?;
    for old in before.iter().map(|name| out.path.join(name)) {
        if !paths.contains(&old) {
            // A file of another fleet, or none any more.
            let _ = std::fs::remove_file(old);
        }
    }
    print(&match arguments.format {
        Format::Text => {
            // A file of each drone is named in the manifest alone.
            let named = match paths.len() > FILES_NAMED {
                true => &paths[..1],
                false => &paths,
            };
            text(&made.manifest, paths.len() - 1) + &wrote(named)
        }
        Format::Json => files::json(&Printed {
            manifest: &made.manifest,
            files: &paths,
        }),
    })?;
    Ok(Answer::Yes)
}

/// The answer is no.
fn refused(
    arguments: &Arguments,
    what: &str,
    refusals: &[Refusal],
    then: &str,
) -> Result<Answer, Failure> {
    if arguments.format == Format::Json {
        print(&files::json(&json!({ "refused": refusals, "error": what })))?;
    }
    let mut more: Vec<String> = refusals.iter().map(ToString::to_string).collect();
    more.push(then.to_owned());
    tell_error(what, &more);
    Ok(Answer::No)
}

/// The files that an earlier export names: plain names alone.
fn files_of(manifest: &Path) -> Vec<String> {
    let text = files::text(manifest, files::MOST_BYTES).unwrap_or_default();
    let manifest: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    let drones = manifest["drones"].as_array().into_iter().flatten();
    let names = drones.flat_map(|it| it["files"].as_array().into_iter().flatten());
    let names = names.chain(manifest["files_of_all"].as_array().into_iter().flatten());
    let names = names.filter_map(|it| it.as_str());
    let plain = names.filter(|it| files::is_plain(it));
    plain.map(str::to_owned).collect()
}

fn text(manifest: &Manifest, files: usize) -> String {
    let deviation = &manifest.deviation;
    let mut text = format!(
        "{} to {}: {}, {}, largest deviation {:.1} mm",
        manifest.plan.scenario,
        manifest.to.as_str(),
        count(manifest.drones.len(), "drone", "drones"),
        count(files, "file", "files"),
        deviation.largest_m * 1000.0,
    );
    if deviation.largest_m > 0.0 {
        text += &format!(" (`{}` at {:.2} s)", deviation.drone, deviation.at_s);
    }
    text += &format!(" over {} samples\n", deviation.samples);
    for it in &manifest.fullest {
        text += &format!(
            "  fullest: `{}`, {} of {} {}\n",
            it.drone, it.takes, it.of, it.what
        );
    }
    if let Some(untimed) = &manifest.untimed {
        text += &format!("  warning: {untimed}\n");
    }
    for lost in &manifest.lost {
        text += &format!("  note: {lost}\n");
    }
    text + &format!(
        "  plan {}; each drone is `{}/NAME`\n",
        manifest.plan.id, manifest.plan.id
    )
}

fn georeference(text: &str) -> Result<Georeference, String> {
    let values: Result<Vec<f64>, _> = text.split(',').map(|it| it.trim().parse()).collect();
    let Ok(&[latitude_deg, longitude_deg, altitude_m, heading_deg]) = values.as_deref() else {
        return Err("four numbers are asked for: LAT,LON,AMSL,HEADING".to_owned());
    };
    Georeference::new([latitude_deg, longitude_deg, altitude_m, heading_deg])
}
