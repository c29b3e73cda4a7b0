//! The `plan` command: files, terminal, exit codes. What a plan is and how it is found lives in the
//! `planner` crate; here is what a person types and reads.

mod commands;
mod io;
mod plots;
mod report;

use std::ffi::OsString;
use std::io::Write as _;
use std::path::Path;
use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use commands::{
    air, bench, calibrate, check, compare, diagnose, explain, export, fly, generate, plan, prove,
    schema, separation, serve, simulate, soak, sweep,
};
use io::answer::Answer;
use io::failure::Failure;

/// Plan a fleet of drones out of each other's downwash.
///
/// Reads a scenario (RON), plans every drone, checks the plan against the flow model and writes
/// plan.json, timing.json, plan.svg and plan.html. Exit codes: 0 every drone planned and
/// verified; 1 the answer is no (a drone has no safe path, or a check found violations); 2 the
/// input or the usage is wrong.
#[derive(Parser)]
#[command(name = "plan", version, arg_required_else_help = true)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
struct CommandLine {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    plan: Option<plan::Arguments>,
}

#[derive(Subcommand)]
enum Command {
    /// Check a plan.json for downwash, collisions and limits, by the verifier alone
    Check(check::Arguments),
    /// Fly a plan in closed loop: controllers, inertia, advected wakes; exit code 1
    /// where a drone meets too much air or touches something
    Fly(fly::Arguments),
    /// Export a plan in a format that other programs fly, read back and measured; exit code 1 where
    /// a drone does not fit
    Export(export::Arguments),
    /// Say how far one drone must stay from the wake of another: below, beside, hovering and
    /// passing, and the ellipsoid that holds it
    Separation(separation::Arguments),
    /// Say what air a hovering drone makes: the field, where it is weaker than so much, how long it
    /// stays
    Air(air::Arguments),
    /// Explain what a drone of a plan does at a time: why it waits, for which drone, what would
    /// break if it did not
    Explain(explain::Arguments),
    /// Compare two plans: what each keeps, and what that costs
    Compare(compare::Arguments),
    /// Plan a scenario for each value of one setting: sum of costs, exposure, drones planned
    Sweep(sweep::Arguments),
    /// Keep a plan that is being flown, and change it by messages: JSON Lines on standard input and
    /// output, or HTTP
    Serve(serve::Arguments),
    /// Let a fleet live for an hour of its clock, planned as `plan serve` plans: tasks, delays,
    /// drones that come, land and fail; exit code 1 where a patch is late or a plan not sound
    Soak(soak::Arguments),
    /// Print the fields of a scenario, a plan, a flight or a message, with units and defaults as
    /// JSON Schema
    Schema(schema::Arguments),
    /// Print a scenario made by rule and seed, or write synthetic recordings
    Generate(generate::Arguments),
    /// Print how planning time, memory and cost grow with the fleet, in Markdown; exit code 1 where
    /// a drone is unplanned or a plan is not verified
    Bench(bench::Arguments),
    /// Simulate recordings and compare: what the model says every sample should have read
    Simulate(simulate::Arguments),
    /// Calibrate the jet from recordings of hovering drones; exit code 1 where one jet does not
    /// describe them
    Calibrate(calibrate::Arguments),
    /// Diagnose recordings: where simulation and recording differ, what is missing, how well it is
    /// known; exit code 1 where it stays unexplained
    Diagnose(diagnose::Arguments),
    /// Validate the diagnosis on synthetic recordings with an injected effect; exit code 1 where a
    /// metric misses its goal
    Prove(prove::Arguments),
}

/// Reads the command line, runs the subcommand, and answers with its exit code: 0 yes, 1 no, 2 a
/// broken question.
pub fn main() -> ExitCode {
    let answer = match mistyped_subcommand() {
        Some(failure) => Err(failure),
        None => CommandLine::try_parse().map_or_else(
            |usage| {
                // Help and version are no errors.
                if usage.use_stderr() {
                    tell_json(&usage);
                }
                usage.exit()
            },
            answer,
        ),
    };
    answer.map_or_else(
        |failure| {
            tell_json(&failure);
            failure.print();
            ExitCode::from(2)
        },
        ExitCode::from,
    )
}

/// A broken question as one JSON object on standard output, where JSON is asked for; beside the
/// text on standard error.
fn tell_json(error: &impl ToString) {
    let arguments: Vec<OsString> = std::env::args_os().collect();
    let is_asked = arguments.iter().any(|it| it == "--format=json")
        || arguments.windows(2).any(|two| two == ["--format", "json"]);
    if is_asked {
        let text = anstream::adapter::strip_str(error.to_string().trim_end()).to_string();
        let object = serde_json::json!({ "exit_code": 2, "error": text });
        // With standard output closed there is no reader left.
        let _ = writeln!(std::io::stdout(), "{object}");
    }
}

/// A first word that is neither a file nor a subcommand, but at most two letters away from one.
fn mistyped_subcommand() -> Option<Failure> {
    let typed = std::env::args_os().nth(1)?.into_string().ok()?;
    let command = CommandLine::command();
    let names = command.get_subcommands().map(|known| known.get_name());
    let distances = names.map(|name| (strsim::damerau_levenshtein(&typed, name), name));
    let (distance, meant) = distances.min()?;
    ((1..=2).contains(&distance) && !Path::new(&typed).exists()).then(|| Failure::Mistyped {
        meant: meant.to_owned(),
        typed,
    })
}

fn answer(line: CommandLine) -> Result<Answer, Failure> {
    match (line.command, line.plan) {
        (Some(Command::Check(arguments)), _) => check::run(&arguments),
        (Some(Command::Fly(arguments)), _) => fly::run(&arguments),
        (Some(Command::Export(arguments)), _) => export::run(&arguments),
        (Some(Command::Separation(arguments)), _) => separation::run(&arguments),
        (Some(Command::Air(arguments)), _) => air::run(&arguments),
        (Some(Command::Explain(arguments)), _) => explain::run(&arguments),
        (Some(Command::Compare(arguments)), _) => compare::run(&arguments),
        (Some(Command::Sweep(arguments)), _) => sweep::run(&arguments),
        (Some(Command::Serve(arguments)), _) => serve::run(&arguments),
        (Some(Command::Soak(arguments)), _) => soak::run(&arguments),
        (Some(Command::Schema(arguments)), _) => schema::run(&arguments),
        (Some(Command::Generate(arguments)), _) => generate::run(&arguments),
        (Some(Command::Bench(arguments)), _) => bench::run(&arguments),
        (Some(Command::Simulate(arguments)), _) => simulate::run(&arguments),
        (Some(Command::Calibrate(arguments)), _) => calibrate::run(&arguments),
        (Some(Command::Diagnose(arguments)), _) => diagnose::run(&arguments),
        (Some(Command::Prove(arguments)), _) => prove::run(&arguments),
        (None, Some(arguments)) => plan::run(&arguments),
        // `arg_required_else_help` has answered already.
        (None, None) => Err(Failure::NothingToDo),
    }
}

#[cfg(test)]
mod tests;
