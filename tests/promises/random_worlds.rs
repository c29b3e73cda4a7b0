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
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Instant;

use airflow::Superposition;
use planner::verify::verify;
use planner::{Control, Outcome};
use rayon::ThreadPoolBuilder;
use tools::instances::random::{RandomWorld, world};

use super::samples;

/// One world may take so long (s) of a machine that does nothing else, as `.ci/run` has it with the
/// feature `long`; builds for tests among other tests are slower by a multiple.
const LONGEST_S: f64 = match cfg!(debug_assertions) {
    true => samples(100.0, 20.0),
    false => 20.0,
};
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

/// How long the answer to a world takes (s), or what is wrong with it.
fn judged(made: &RandomWorld, by_other: Option<&str>) -> Result<f64, String> {
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
        return Ok(took_s);
    }
    // The other judge adds wakes by momentum, which is too much where the strongest alone counts;
    // with exit code 3 it says that there is a part, such as a mesh, that it does not judge.
    let Some(judge) = by_other.filter(|_| world.superposition != Superposition::Strongest) else {
        return Ok(took_s);
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
        Some(0 | 3) => Ok(took_s),
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
    let judged = |seed: u64| {
        let by_other = judge.as_deref().filter(|_| seed.is_multiple_of(one_in));
        judged(&world(seed), by_other)
    };
    // One to a core, each on one thread: a plan is the same on any number of them.
    let next = AtomicU64::new(0);
    let one_after_another = || {
        let pool = ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let seeds = std::iter::from_fn(|| {
            let index = next.fetch_add(1, Ordering::Relaxed);
            (index < count).then(|| first.wrapping_mul(1_000_000) + index)
        });
        let answers = seeds.map(|seed| (seed, pool.install(|| judged(seed))));
        answers.collect::<Vec<_>>()
    };
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let mut answers: Vec<_> = thread::scope(|scope| {
        let threads: Vec<_> = (0..cores).map(|_| scope.spawn(one_after_another)).collect();
        let threads = threads.into_iter();
        threads.flat_map(|it| it.join().unwrap()).collect()
    });
    answers.sort_unstable_by_key(|(seed, _)| *seed);
    let mut wrong = Vec::new();
    for (seed, answer) in answers {
        // What took too long so has the whole machine.
        let answer = match answer {
            Ok(took_s) if took_s > LONGEST_S => judged(seed),
            answer => answer,
        };
        let why = match answer {
            Ok(took_s) if took_s > LONGEST_S => format!("took {took_s:.1} s"),
            Ok(_) => continue,
            Err(why) => why,
        };
        let made = world(seed);
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
