//! Random worlds of everything that a scenario may hold: whatever the planner answers, its plan is
//! safe, says so truly, and took seconds; another judge agrees, where there is one.
//!
//! `WORLDS_SEED` asks for other worlds, `WORLDS` for another number of them, `PLAN_JUDGE` names a
//! program that judges a plan file: exit code 0 or 3 where it finds nothing, 1 for violations.
//! It judges one plan in ten, or in as many as `WORLDS_JUDGED` says.

use std::env;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::Command;
use std::time::Instant;

use airflow::Superposition;
use planner::verify::verify;
use planner::{Control, Outcome};
use tools::instances::random::{RandomWorld, world};

use super::samples;

/// One world may take so long (s) of a machine that does nothing else, as `.ci/run` has it; builds
/// for tests are slower by a multiple.
const LONGEST_S: f64 = if cfg!(debug_assertions) { 100.0 } else { 20.0 };
/// One plan in so many is judged by the other judge, where no number is asked for.
const JUDGED: u64 = 10;

fn number(name: &str, default: u64) -> u64 {
    match env::var(name) {
        Ok(typed) => typed
            .parse()
            .unwrap_or_else(|_| panic!("{name} is no number: {typed}")),
        Err(_) => default,
    }
}

/// What is wrong with the answer to a world, if anything.
fn judged(made: &RandomWorld, by_other: Option<&str>) -> Result<(), String> {
    let world = made
        .read()
        .map_err(|problems| format!("not in order: {problems}"))?;
    let started = Instant::now();
    // Too long by then; stopped, so that the next world has its turn.
    let control = Control {
        stop: &|| started.elapsed().as_secs_f64() > LONGEST_S + 1.0,
        ..Control::QUIET
    };
    let outcome = catch_unwind(AssertUnwindSafe(|| planner::plan_world(&world, &control)));
    let took_s = started.elapsed().as_secs_f64();
    let outcome = outcome
        .map_err(|_| "panics".to_owned())?
        .map_err(|faults| faults.to_string())?;
    let planned = match outcome {
        Outcome::Safe(planned) | Outcome::Partial(planned) => planned,
        Outcome::Unsafe(planned) => return Err(format!("unsafe: {:?}", planned.plan.violations)),
        Outcome::Infeasible { .. } => return Err("its starts exclude one another".to_owned()),
    };
    let text = serde_json::to_string(&planned.plan).map_err(|it| it.to_string())?;
    let read = serde_json::from_str(&text).map_err(|it| it.to_string())?;
    let found = verify(&read).violations;
    if !found.is_empty() {
        return Err(format!("violations once it is read again: {found:?}"));
    }
    if took_s > LONGEST_S {
        return Err(format!("took {took_s:.1} s"));
    }
    // The other judge adds wakes by momentum, which is too much where the strongest alone counts;
    // with exit code 3 it says that there is a part, such as a mesh, that it does not judge.
    let Some(judge) = by_other.filter(|_| world.superposition != Superposition::Strongest) else {
        return Ok(());
    };
    let folder = tempfile::tempdir().map_err(|it| it.to_string())?;
    let path = folder.path().join("plan.json");
    fs::write(&path, text).map_err(|it| it.to_string())?;
    let mut words = judge.split_whitespace();
    let mut command = Command::new(words.next().unwrap_or_default());
    let output = command
        .args(words)
        .arg(&path)
        .output()
        .map_err(|it| it.to_string())?;
    match output.status.code() {
        Some(0 | 3) => Ok(()),
        _ => Err(format!(
            "the other judge: {}",
            String::from_utf8_lossy(&output.stdout)
        )),
    }
}

#[test]
fn every_answer_to_a_random_world_is_safe_true_and_takes_seconds() {
    let (first, count) = (number("WORLDS_SEED", 1), number("WORLDS", samples(12, 100)));
    let judge = env::var("PLAN_JUDGE").ok();
    let one_in = number("WORLDS_JUDGED", JUDGED).max(1);
    println!("{count} random worlds from WORLDS_SEED={first} on");
    if judge.is_none() {
        println!("no other judge: PLAN_JUDGE is not set");
    }
    let mut wrong = Vec::new();
    for seed in (0..count).map(|index| first.wrapping_mul(1_000_000) + index) {
        let made = world(seed);
        let by_other = judge.as_deref().filter(|_| seed.is_multiple_of(one_in));
        let Err(why) = judged(&made, by_other) else {
            continue;
        };
        let folder = env::temp_dir().join(format!("random-world-{seed}"));
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("world.ron"), &made.scenario).unwrap();
        for (name, text) in &made.meshes {
            fs::write(folder.join(name), text).unwrap();
        }
        println!("{}: {why}", folder.display());
        wrong.push(format!("{}: {why}", folder.display()));
    }
    assert!(
        wrong.is_empty(),
        "{} of {count}:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
}
