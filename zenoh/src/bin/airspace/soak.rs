//! All areas of a site, one process each.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU16, Ordering};
use std::thread;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use clap::Args;
use planner::Plan;
use planner::plan::DronePlan;

use super::area::{Counted, Flown};
use super::forward::forward;
use super::{Broken, Place};

/// How long processes have to start (s): a fleet is planned first.
const STARTS_S: f64 = 4.0;
/// How long a killed planner is away, and one is cut off by default (s).
const AWAY_S: f64 = 4.0;
/// How long two planners may answer for a drone that changes hands, or none (s): until the next
/// borders have made good what was lost. Chosen here.
const CHANGES_HANDS_S: f64 = 5.0;

#[derive(Args, Debug)]
pub(super) struct Arguments {
    #[command(flatten)]
    place: Place,
    /// How long (s)
    #[arg(long, default_value_t = 60.0, value_parser = above_0)]
    seconds: f64,
    /// Kill one planner at a quarter of the time, and start it again 4 s later
    #[arg(long)]
    kill: bool,
    /// Cut one off for so long, at the middle of the time (s)
    #[arg(long, value_name = "SECONDS", value_parser = from_0)]
    cut: Option<f64>,
    /// Where journals and what was flown are kept
    #[arg(long, default_value = "out/airspace")]
    out: PathBuf,
    /// How often all plans together are judged (s)
    #[arg(long, default_value_t = 1.0, value_parser = above_0)]
    every: f64,
}

fn above_0(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number")?;
    match value.is_finite() && value > 0.0 {
        true => Ok(value),
        false => Err("must be above 0".to_owned()),
    }
}

fn from_0(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number")?;
    match value.is_finite() && value >= 0.0 {
        true => Ok(value),
        false => Err("must be 0 or more".to_owned()),
    }
}

/// A process of one area, and how to start it again.
struct Running {
    child: Child,
    says: BufReader<ChildStdout>,
    words: Vec<String>,
    /// Where what it has flown is kept, one file for each start.
    flown: Vec<PathBuf>,
}

/// None is left behind: where one has failed the others end with the command.
impl Drop for Running {
    fn drop(&mut self) {
        // One that has ended has nothing to be told.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Running {
    /// Where it is reached: what it says first.
    fn port(&mut self) -> Result<u16, Broken> {
        let mut endpoint = String::new();
        self.says.read_line(&mut endpoint)?;
        let port = endpoint.trim_end().rsplit(':').next().unwrap_or_default();
        port.parse().map_err(|_| "a planner has not started".into())
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<bool, Broken> {
    let grid = arguments.place.grid();
    let site = grid.site(arguments.place.lead);
    let names: Vec<String> = site.areas.keys().cloned().collect();
    for name in &names {
        grid.scenario(name)?;
    }
    fs::create_dir_all(&arguments.out)?;
    for entry in fs::read_dir(&arguments.out)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.contains(".flown.") || name.ends_with(".journal") {
            fs::remove_file(&path)?;
        }
    }
    let unix_s = || {
        SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map(|it| it.as_secs_f64())
    };
    let begins_s = unix_s()? + STARTS_S;
    // Where each is reached; 0 while it is not.
    let ports: Vec<Arc<AtomicU16>> = names.iter().map(|_| Arc::default()).collect();
    let blocked: Vec<Arc<AtomicBool>> = names.iter().map(|_| Arc::default()).collect();
    let mut running = Vec::new();
    for (index, name) in names.iter().enumerate() {
        let mut words = vec!["area".to_owned()];
        words.extend(arguments.place.words());
        let journal = arguments.out.join(format!("{name}.journal"));
        words.extend([
            format!("--area={name}"),
            format!("--begins={begins_s}"),
            format!("--until={}", arguments.seconds),
            format!("--journal={}", journal.display()),
        ]);
        // Each pair has one link, which is blocked where either end is cut off.
        for other in 0..index {
            let port = forward(ports[other].clone(), blocked[index].clone())?;
            let port = forward(Arc::new(port.into()), blocked[other].clone())?;
            words.push(format!("--connect=tcp/127.0.0.1:{port}"));
        }
        running.push(started(arguments, name, words)?);
    }
    for (it, port) in running.iter_mut().zip(&ports) {
        port.store(it.port()?, Ordering::Relaxed);
    }
    // Gives when it is then.
    let wait_until = |at_s: f64| -> Result<f64, Broken> {
        let left_s = begins_s + at_s - unix_s()?;
        thread::sleep(Duration::from_secs_f64(left_s.max(0.0)));
        Ok(unix_s()? - begins_s)
    };
    // From when to when one was away, or cut off (s).
    let mut away_s = Vec::new();
    if arguments.kill {
        let from_s = wait_until(0.25 * arguments.seconds)?;
        let index = names.len() / 2;
        let it = &mut running[index];
        it.child.kill()?;
        it.child.wait()?;
        ports[index].store(0, Ordering::Relaxed);
        wait_until(0.25 * arguments.seconds + AWAY_S)?;
        let mut again = started(arguments, &names[index], it.words.clone())?;
        ports[index].store(again.port()?, Ordering::Relaxed);
        again.flown.splice(0..0, it.flown.drain(..));
        *it = again;
        away_s.push((from_s, wait_until(0.0)?));
    }
    if let Some(cut_s) = arguments.cut {
        let from_s = wait_until(0.5 * arguments.seconds)?;
        blocked[0].store(true, Ordering::Relaxed);
        let until_s = wait_until(0.5 * arguments.seconds + cut_s)?;
        blocked[0].store(false, Ordering::Relaxed);
        away_s.push((from_s, until_s));
    }
    let mut counted = Vec::new();
    let mut flown = BTreeMap::new();
    for (name, mut it) in names.iter().zip(running) {
        let mut text = String::new();
        it.says.read_to_string(&mut text)?;
        if !it.child.wait()?.success() {
            return Err(format!("the planner of {name} has failed").into());
        }
        let one: Counted = serde_json::from_str(&text)?;
        counted.push((name.clone(), one));
        flown.insert(name.clone(), std::mem::take(&mut it.flown));
    }
    let rules = rules(arguments)?;
    let found = judged(arguments, &rules, &flown, &away_s)?;
    Ok(told(arguments, &counted, &found))
}

fn started(arguments: &Arguments, name: &str, words: Vec<String>) -> Result<Running, Broken> {
    let mut files = (0..).map(|k| arguments.out.join(format!("{name}.flown.{k}")));
    let flown = files.find(|it| !it.exists()).unwrap_or_default();
    let mut command = Command::new(std::env::current_exe()?);
    command.args(&words).arg("--flown").arg(&flown);
    let mut child = command.stdout(Stdio::piped()).spawn()?;
    let says = child.stdout.take().ok_or("it cannot be read")?;
    Ok(Running {
        child,
        says: BufReader::new(says),
        words,
        flown: vec![flown],
    })
}

/// A plan of the whole site without drones.
fn rules(arguments: &Arguments) -> Result<Plan, Broken> {
    let grid = arguments.place.grid();
    let world = planner::read_world(&grid.scenario("a0-0")?).map_err(|it| it.to_string())?;
    let outcome = planner::plan_world(&world, &planner::Control::QUIET)?;
    let plan = outcome.into_planned().ok_or("no plan is safe")?.plan;
    Ok(Plan {
        bounds_m: grid.whole_m(),
        drones: Vec::new(),
        unplanned: Vec::new(),
        violations: Vec::new(),
        ..plan
    })
}

/// By how many planners each drone is answered for.
#[derive(Default)]
struct Answers {
    /// Every drone that there was; since when not one planner answers for it (s).
    seen: BTreeMap<String, Option<f64>>,
    /// Those that more than one answers for, since when (s).
    doubled: BTreeMap<String, f64>,
    /// Those that were doubled or missing for longer than it may be, with when that was first told.
    wrong: BTreeMap<String, String>,
}

impl Answers {
    /// Looks at a moment, given the drones of each planner, and from when to when planners were
    /// away (s): it may be longer by that, until the next borders.
    fn look<'a>(
        &mut self,
        at_s: f64,
        away_s: &[(f64, f64)],
        own: impl Iterator<Item = &'a BTreeSet<String>>,
    ) {
        let mut counts: BTreeMap<&String, usize> = BTreeMap::new();
        for name in own.flatten() {
            *counts.entry(name).or_default() += 1;
        }
        let is_doubled = |name: &String| counts.get(name).is_some_and(|it| *it > 1);
        self.doubled.retain(|name, _| is_doubled(name));
        for name in counts.keys() {
            self.seen.insert((*name).clone(), None);
            if is_doubled(name) {
                self.doubled.entry((*name).clone()).or_insert(at_s);
            }
        }
        for (name, missing_s) in &mut self.seen {
            if !counts.contains_key(name) {
                missing_s.get_or_insert(at_s);
            }
        }
        let is_away =
            |(from_s, until_s): &&(f64, f64)| (*from_s..=until_s + CHANGES_HANDS_S).contains(&at_s);
        let away_s = away_s.iter().filter(is_away);
        let most_s = CHANGES_HANDS_S
            + away_s
                .map(|(from_s, until_s)| until_s - from_s)
                .sum::<f64>();
        let is_long = |since_s: f64| at_s - since_s > most_s;
        let doubled = self.doubled.iter().filter(|(_, it)| is_long(**it));
        let doubled = doubled.map(|(name, _)| (name, "more than one planner"));
        let missing = self.seen.iter().filter(|(_, it)| it.is_some_and(is_long));
        let missing = missing.map(|(name, _)| (name, "no planner"));
        for (name, of) in doubled.chain(missing) {
            let told = || format!("at {at_s:.1} s: `{name}` is of {of}");
            self.wrong.entry(name.clone()).or_insert_with(told);
        }
    }
}

/// What is found in all plans together.
#[derive(Default)]
struct Found {
    violations: Vec<String>,
    /// Drones that more than one planner answers for, or not one, for too long.
    wrong_owners: Vec<String>,
    judged: usize,
    most_drones: usize,
    fewest_drones: usize,
}

fn judged(
    arguments: &Arguments,
    rules: &Plan,
    files: &BTreeMap<String, Vec<PathBuf>>,
    away_s: &[(f64, f64)],
) -> Result<Found, Broken> {
    let mut events: Vec<(String, Flown)> = Vec::new();
    for (area, files) in files {
        for file in files {
            for line in fs::read_to_string(file)?.lines() {
                // The last line of one that was killed may be torn.
                if let Ok(it) = serde_json::from_str(line) {
                    events.push((area.clone(), it));
                }
            }
        }
    }
    events.sort_by(|(_, a), (_, b)| a.at_s.total_cmp(&b.at_s));
    let mut events = events.into_iter().peekable();
    let mut now: BTreeMap<String, (BTreeSet<String>, BTreeMap<String, DronePlan>)> =
        BTreeMap::new();
    let mut found = Found {
        fewest_drones: usize::MAX,
        ..Found::default()
    };
    let mut at_s = arguments.every;
    let mut last = None;
    let mut answers = Answers::default();
    while at_s <= arguments.seconds {
        while let Some((area, it)) = events.next_if(|(_, it)| it.at_s <= at_s) {
            let (own, known) = now.entry(area).or_default();
            *own = it.own.into_iter().collect();
            known.extend(it.changed.into_iter().map(|it| (it.name.clone(), it)));
            known.retain(|name, _| own.contains(name));
        }
        let own = now.values().map(|(own, _)| own);
        answers.look(at_s, away_s, own);
        // A drone that two planners own, as its new owner has it.
        let mut drones: BTreeMap<&str, &DronePlan> = BTreeMap::new();
        for it in now.values().flat_map(|(_, known)| known.values()) {
            let ends_s = |it: &DronePlan| it.trajectory.t_s.last().copied();
            let known = drones.get(&it.name[..]);
            if known.is_none_or(|known| ends_s(known) < ends_s(it)) {
                drones.insert(&it.name, it);
            }
        }
        let plan = Plan {
            drones: drones.into_values().cloned().collect(),
            ..rules.clone()
        };
        let violations = planner::verify(&plan).violations.into_iter();
        let ahead = violations.filter(|it| it.matters_from(at_s));
        found
            .violations
            .extend(ahead.map(|it| format!("at {at_s:.1} s: {it}")));
        found.judged += 1;
        found.most_drones = found.most_drones.max(plan.drones.len());
        found.fewest_drones = found.fewest_drones.min(plan.drones.len());
        at_s += arguments.every;
        last = Some(plan);
    }
    found.wrong_owners = answers.wrong.into_values().collect();
    if let Some(plan) = last {
        write(&arguments.out.join("union.json"), &plan)?;
    }
    Ok(found)
}

fn write(path: &Path, plan: &Plan) -> Result<(), Broken> {
    Ok(fs::write(path, serde_json::to_string(plan)?)?)
}

fn told(arguments: &Arguments, counted: &[(String, Counted)], found: &Found) -> bool {
    let sum = |of: &dyn Fn(&Counted) -> u64| counted.iter().map(|(_, it)| of(it)).sum::<u64>();
    let mut agreed: Vec<f64> = counted
        .iter()
        .flat_map(|(_, it)| it.agreed_in_s.clone())
        .collect();
    agreed.sort_by(f64::total_cmp);
    let quantile_s = |share: f64| {
        let index = (share * agreed.len().saturating_sub(1) as f64).round() as usize;
        agreed.get(index).copied().unwrap_or(0.0)
    };
    let minutes = arguments.seconds / 60.0;
    let per_minute = |count: u64| count as f64 / minutes;
    let [sent, unsent] = [sum(&|it| it.messages[0]), sum(&|it| it.messages[1])];
    println!(
        "{} areas, {} to {} drones, {} s",
        counted.len(),
        found.fewest_drones,
        found.most_drones,
        arguments.seconds
    );
    println!(
        "changes flown: {} alone, {} of {} proposed",
        sum(&|it| it.alone),
        sum(&|it| it.flown),
        sum(&|it| it.proposed)
    );
    println!(
        "hand-overs: {}, {:.0} a minute",
        sum(&|it| it.taken),
        per_minute(sum(&|it| it.taken))
    );
    println!(
        "votes: {} for, {} against; agreed in p50 {:.3} s, p99 {:.3} s, longest {:.3} s",
        sum(&|it| it.votes[0]),
        sum(&|it| it.votes[1]),
        quantile_s(0.5),
        quantile_s(0.99),
        quantile_s(1.0)
    );
    println!(
        "messages: {sent}, {:.0} a minute; {unsent} not sent; gave way {} times",
        per_minute(sent),
        sum(&|it| it.gave_way)
    );
    let mut refused: BTreeMap<&str, u64> = BTreeMap::new();
    for (why, count) in counted.iter().flat_map(|(_, it)| &it.refused) {
        *refused.entry(why).or_default() += count;
    }
    println!("tasks not given: {refused:?}");
    let contradictions = counted.iter().flat_map(|(_, it)| &it.contradictions);
    let contradictions: Vec<&(String, String)> = contradictions.collect();
    println!("contradictions heard: {}", contradictions.len());
    for (from, what) in contradictions.iter().take(10) {
        println!("  {from}: {what}");
    }
    println!(
        "all plans together judged {} times: {} violations",
        found.judged,
        found.violations.len()
    );
    for it in found.violations.iter().take(20) {
        println!("  {it}");
    }
    println!(
        "drones of more than one planner, or of none, for too long: {}",
        found.wrong_owners.len()
    );
    for it in found.wrong_owners.iter().take(20) {
        println!("  {it}");
    }
    found.violations.is_empty() && found.wrong_owners.is_empty()
}

#[cfg(test)]
mod tests {
    use std::os::fd::AsFd as _;

    use super::*;

    #[test]
    fn a_drone_of_two_planners_or_of_none_is_told_where_that_lasts() {
        let own = |names: [&str; 2]| names.map(|it| BTreeSet::from([it.to_owned()]));
        let mut answers = Answers::default();
        let mut look = |at_s: f64, names: [&str; 2]| {
            answers.look(at_s, &[], own(names).iter());
            answers.wrong.values().cloned().collect::<Vec<String>>()
        };
        for (at_s, names) in [(1.0, ["a", "b"]), (2.0, ["a", "a"]), (7.0, ["a", "a"])] {
            assert_eq!(look(at_s, names), [""; 0]);
        }
        let told = [
            "at 7.5 s: `a` is of more than one planner",
            "at 7.5 s: `b` is of no planner",
        ];
        // Once, however often it is looked at.
        for (at_s, names) in [(7.5, ["a", "a"]), (8.0, ["a", "a"]), (8.5, ["b", "a"])] {
            assert_eq!(look(at_s, names), told);
        }
    }

    #[test]
    fn while_a_planner_is_away_and_no_longer_it_may_last_as_long() {
        let own = [BTreeSet::from(["a".to_owned()]), BTreeSet::new()];
        let [two, one] = [[0, 0], [0, 1]].map(|it| it.map(|it| own[it].clone()));
        for (since_s, first_s) in [(10.0, "15.5"), (20.0, "29.5"), (30.0, "35.5")] {
            let mut answers = Answers::default();
            for at_s in (2..80).map(|it| 0.5 * f64::from(it)) {
                let own = if at_s < since_s { &one } else { &two };
                answers.look(at_s, &[(20.0, 24.0)], own.iter());
            }
            let told = format!("at {first_s} s: `a` is of more than one planner");
            assert_eq!(answers.wrong["a"], told);
        }
    }

    #[test]
    fn times_between_two_looks_are_above_0_and_a_cut_may_take_none() {
        for wrong in ["0", "-1", "inf", "NaN", "x"] {
            assert!(above_0(wrong).is_err(), "{wrong}");
            assert_eq!(from_0(wrong).is_err(), wrong != "0", "{wrong}");
        }
        assert_eq!(above_0("0.5"), Ok(0.5));
    }

    #[test]
    fn a_planner_ends_with_the_command_that_started_it() {
        let mut command = Command::new("sleep");
        let mut child = command
            .arg("600")
            .stdout(Stdio::piped())
            .spawn()
            .expect("there is a sleep");
        let says = child.stdout.take().expect("it is piped");
        let still = says.as_fd().try_clone_to_owned().expect("it is open");
        drop(Running {
            child,
            says: BufReader::new(says),
            words: Vec::new(),
            flown: Vec::new(),
        });
        // It ends where no process writes any more.
        let mut text = String::new();
        (fs::File::from(still).read_to_string(&mut text)).expect("it says text, or nothing");
    }
}
