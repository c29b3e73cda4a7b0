//! `plan explain PLAN --drone NAME --at TIME`: what a drone does then; why it waits, and what would
//! break if it did not.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::Args;
use nalgebra::Point3;
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
use planner::plan::{DronePlan, Violation, ViolationKind};
use planner::{Plan, World};
use serde::Serialize;
use viewer::Stop;

use crate::commands::number;
use crate::commands::plan::read_world;
use crate::io::answer::{Answer, Format, print};
use crate::io::failure::Failure;
use crate::io::files;
use crate::io::plans::Source;
use crate::report::sections::{Part, Report};
use crate::report::words::{cell, first_few, place};

/// What is escaped in a link's fragment: all but the unreserved characters of RFC 3986, section
/// 2.3.
const NOT_PLAIN: &AsciiSet = &NON_ALPHANUMERIC
    .remove(b'-')
    .remove(b'.')
    .remove(b'_')
    .remove(b'~');
/// Seconds of waiting reported as outside of stops: chosen here, what is printed.
const LEAST_ELSEWHERE_S: f64 = 0.005;

/// Violations that are listed: chosen here, the first say why.
const MOST_LISTED: usize = 5;

#[derive(Args)]
pub(crate) struct Arguments {
    /// What is explained
    #[command(flatten)]
    source: Source,
    /// Which drone
    #[arg(long, value_name = "NAME")]
    drone: String,
    /// When (s)
    #[arg(long, value_name = "SECONDS", value_parser = number(0.0..=1e9, "s"), allow_negative_numbers = true)]
    at: f64,
    /// Its scenario: tells dwells from waits
    #[arg(long, value_name = "SCENARIO.ron")]
    scenario: Option<PathBuf>,
    /// How to print the answer
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

/// `explanation/1`.
#[derive(Serialize)]
struct Explained {
    format: &'static str,
    drone: String,
    at_s: f64,
    /// `null`: it is not there.
    position_m: Option<Point3<f64>>,
    speed_mps: f64,
    /// `wait`, `dwell`, `stop` where that is not known, `rests` (between two moves, for less than
    /// counts as a stop), `flies`, `stands` or `not there`.
    does: &'static str,
    /// Of a drone that is not planned, why.
    #[serde(skip_serializing_if = "Option::is_none")]
    unplanned: Option<String>,
    /// Of a stop or a rest (s): where it is still, or so slow that it stops.
    #[serde(skip_serializing_if = "Option::is_none")]
    span_s: Option<(f64, f64)>,
    /// Of a wait, how much later the drone is for it (s): its part of the drone's `waits_s`, and by
    /// how much earlier it is in `otherwise`. 0: it is no earlier at its goal, for it stays at an
    /// appointment on the way, or is done; in `otherwise` it does not wait at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    costs_s: Option<f64>,
    /// What the drone waits in all, as in plan.json (s).
    waits_s: f64,
    /// Of that what is in none of its stops, where they are told from dwells (s): in stops too
    /// short to be shown, and in slower flight.
    #[serde(skip_serializing_if = "Option::is_none")]
    waits_elsewhere_s: Option<f64>,
    /// Which drone it waits for: with which it would first break a rule, had it gone on at once.
    /// Of its own air in a zone: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    waits_for: Option<String>,
    /// What would break then that holds now, in order of time.
    otherwise: Vec<Violation>,
    /// All its stops: from, until (s), what, and what a wait costs (s).
    stops: Vec<(f64, f64, &'static str, Option<f64>)>,
    /// The page at that moment, where one lies beside the plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    page: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let plan = arguments.source.read()?.file.plan;
    let world = arguments.scenario.as_deref();
    let world = world.map(|path| world_of(&plan, path)).transpose()?;
    let at_s = arguments.at;
    let known = plan.drones.iter().position(|it| it.name == arguments.drone);
    let (Some(k), name) = (known, &arguments.drone) else {
        let names: Vec<&str> = plan.drones.iter().take(20).map(|it| &it.name[..]).collect();
        return Err(Failure::NoSuchDrone {
            path: arguments.source.path().to_owned(),
            name: arguments.drone.clone(),
            known: names.join(", "),
        });
    };
    let drone = &plan.drones[k];
    let Some(state) = drone.trajectory.state(at_s) else {
        let reason = format!("`{name}` has no trajectory");
        let path = arguments.source.path().to_owned();
        return Err(Failure::NotAPlan { path, reason });
    };
    let stops = viewer::stops(&plan, world.as_ref(), k);
    let is_there = is_there(&plan, drone, at_s);
    let speed_mps = state.velocity_mps.norm();
    let now = |it: &&Stop| is_there && it.from_s <= at_s && at_s < it.until_s;
    // Where it does not move yet at a stop's end it still stops.
    let ends = |it: &&Stop| is_there && it.until_s == at_s && speed_mps == 0.0;
    let stop = stops.iter().find(now).or(stops.iter().find(ends));
    let before_s = stops.iter().map(|it| it.until_s).filter(|it| *it <= at_s);
    let before_s = before_s.fold(0.0, f64::max);
    let rest_s = rest_s(drone, (at_s, state.position_m));
    let rest_s = rest_s.map(|(from_s, until_s)| (from_s.max(before_s), until_s));
    let does = match (stop, rest_s) {
        _ if !is_there => "not there",
        (Some(stop), _) => stop.what,
        _ if speed_mps > 0.0 => "flies",
        (None, Some(_)) => "rests",
        (None, None) => "stands",
    };
    let otherwise = match stop.filter(|it| it.what != "dwell") {
        Some(stop) => otherwise(&plan, k, stop),
        None => Vec::new(),
    };
    let other = |it: &Violation| match it.drone == *name {
        // It is its own wake that is in a zone.
        true if is_of_zone(it) => None,
        true => it.with.clone(),
        false => Some(it.drone.clone()),
    };
    let waits_for = otherwise.first().and_then(other);
    let folder = arguments.source.path().parent().unwrap_or(Path::new(""));
    let page = folder.join("plan.html");
    let explained = Explained {
        format: "explanation/1",
        drone: name.clone(),
        at_s,
        position_m: is_there.then_some(state.position_m),
        speed_mps,
        does,
        unplanned: plan
            .unplanned
            .iter()
            .find(|it| it.name == *name)
            .map(|it| it.reason.clone()),
        span_s: match does {
            "rests" => rest_s,
            _ => stop.map(|it| (it.from_s, it.until_s)),
        },
        costs_s: stop.and_then(|it| it.costs_s),
        waits_s: drone.waits_s,
        waits_elsewhere_s: world.as_ref().map(|_| {
            let told_s: f64 = stops.iter().filter_map(|it| it.costs_s).sum();
            (drone.waits_s - told_s).max(0.0)
        }),
        waits_for,
        otherwise,
        stops: stops
            .iter()
            .map(|it| (it.from_s, it.until_s, it.what, it.costs_s))
            .collect(),
        page: page.exists().then(|| {
            let name = utf8_percent_encode(name, NOT_PLAIN);
            format!("{}#t={at_s}&drone={name}", page.display())
        }),
    };
    print(&match arguments.format {
        Format::Json => files::json(&explained),
        Format::Text => report(&explained, &plan).text(),
    })?;
    Ok(Answer::Yes)
}

/// A plan's scenario; one of other drones is refused.
fn world_of(plan: &Plan, path: &Path) -> Result<World, Failure> {
    let world = read_world(path, None)?;
    let of_plan: BTreeSet<&str> = plan.drones.iter().map(|it| &it.name[..]).collect();
    let of_world: BTreeSet<&str> = world.drones.iter().map(|it| &it.name[..]).collect();
    let only = |one: &BTreeSet<&str>, other: &BTreeSet<&str>, of: &str| {
        let names: Vec<String> = one.difference(other).map(|it| format!("`{it}`")).collect();
        let shown = first_few(names.iter(), MOST_LISTED, ", ");
        let told = format!("only the {of} has {shown}");
        (!names.is_empty()).then_some(told)
    };
    let differ = [
        only(&of_world, &of_plan, "scenario"),
        only(&of_plan, &of_world, "plan"),
    ];
    let differ: Vec<String> = differ.into_iter().flatten().collect();
    if differ.is_empty() {
        return Ok(world);
    }
    let (path, differ) = (path.display(), differ.join(", "));
    let what = format!("--scenario {path}: not of this plan's drones: {differ}");
    Err(Failure::Inapplicable(vec![what]))
}

/// Whether a drone has come, and has not left: one that is not planned stays at its start.
fn is_there(plan: &Plan, drone: &DronePlan, at_s: f64) -> bool {
    let has_left = plan.leaves_s(drone).is_some_and(|it| at_s > it);
    !has_left && drone.enters_s.is_none_or(|enters_s| enters_s <= at_s)
}

/// How much earlier all that follows is, had a drone gone on at once (s): what the wait costs it,
/// or, where a stop may be a dwell, or makes it no later at its goal, what it takes.
fn saved_s((from_s, until_s): (f64, f64), costs_s: Option<f64>) -> f64 {
    costs_s.filter(|it| *it > 0.0).unwrap_or(until_s - from_s)
}

/// What breaks with others if a drone goes on at once and does all that follows so much earlier,
/// and does not break now: by the verifier. Where it only slows down, it is as much faster there.
/// At an appointment on the way it stays as much longer.
fn otherwise(plan: &Plan, k: usize, stop: &Stop) -> Vec<Violation> {
    let (from_s, until_s) = (stop.from_s, stop.until_s);
    let saved_s = saved_s((from_s, until_s), stop.costs_s);
    // What a smooth stop costs beyond its rest it costs before and after that, where the drone is
    // half as fast as it would be.
    let beside_s = (saved_s - (until_s - from_s)).max(0.0);
    let (from_s, until_s) = ((from_s - beside_s).max(0.0), until_s + beside_s);
    let earlier = |t_s: f64| earlier_s(t_s, (from_s, until_s), saved_s, stop.held_s);
    let mut without_wait = plan.clone();
    let drone = &mut without_wait.drones[k];
    drone
        .trajectory
        .t_s
        .iter_mut()
        .for_each(|it| *it = earlier(*it));
    let (airborne_s, landed_s) = drone.airborne_s;
    drone.airborne_s = (earlier(airborne_s), landed_s.map(earlier));
    for rest_s in &mut drone.landed_s {
        *rest_s = (earlier(rest_s.0), earlier(rest_s.1));
    }
    let name = drone.name.clone();
    // How it moves itself is not asked: no drone flies it like that.
    let concerns = |it: &Violation| {
        let is_between = it.kind != ViolationKind::Malformed && it.with.is_some();
        is_between && it.drone == name || it.with.as_ref() == Some(&name) || is_of_zone(it)
    };
    let now = planner::verify(plan).violations;
    let is_new = |it: &Violation| {
        let same =
            |old: &&Violation| old.kind == it.kind && old.drone == it.drone && old.with == it.with;
        !now.iter().any(|old| same(&old))
    };
    let then = planner::verify(&without_wait).violations.into_iter();
    then.filter(|it| concerns(it) && is_new(it)).collect()
}

/// When a drone is where it was at a time, had it gone on at once and saved so much (all s): never
/// before its stop began, and no earlier once it leaves the place where it stays then.
fn earlier_s(
    t_s: f64,
    (from_s, until_s): (f64, f64),
    saved_s: f64,
    held_s: Option<(f64, f64)>,
) -> f64 {
    let left = 1.0 - saved_s / (until_s - from_s);
    // When the stop is over then, and when what follows is.
    let over_s = (until_s - saved_s).max(from_s);
    let then_s = over_s + (t_s - until_s);
    match held_s {
        _ if t_s <= from_s => t_s,
        _ if t_s < until_s => (from_s + (t_s - from_s) * left).clamp(from_s, over_s),
        Some((_, leaves_s)) if t_s >= leaves_s => t_s,
        Some((there_s, leaves_s)) if t_s > there_s => {
            then_s + (t_s - then_s) * (t_s - there_s) / (leaves_s - there_s)
        }
        _ => then_s,
    }
}

fn is_of_zone(it: &Violation) -> bool {
    it.kind.without_margin() == ViolationKind::Zone
}

/// Places nearer to one another are one (m), chosen here: as of stops.
const SAME_PLACE_M: f64 = 1e-3;

/// From when until when (s) a drone is at the place (m) where it is at a time (s), if it comes from
/// another and goes on to another.
fn rest_s(drone: &DronePlan, (at_s, at_m): (f64, Point3<f64>)) -> Option<(f64, f64)> {
    let path = &drone.trajectory;
    let points = path.t_s.iter().zip(&path.position_m);
    let elsewhere = |m: &Point3<f64>| (m - at_m).norm() > SAME_PLACE_M;
    let comes = points
        .clone()
        .rposition(|(t_s, m)| *t_s < at_s && elsewhere(m))?;
    let goes = points
        .into_iter()
        .position(|(t_s, m)| *t_s > at_s && elsewhere(m))?;
    Some((
        *path.t_s.get(comes + 1)?,
        *path.t_s.get(goes.checked_sub(1)?)?,
    ))
}

/// Where a drone is that neither waits nor dwells: at its start, or at its end, or nowhere.
fn stands(explained: &Explained, plan: &Plan) -> String {
    let drone = plan.drone(&explained.drone);
    if explained.position_m.is_none() {
        let enters_s = drone.and_then(|it| it.enters_s);
        let last_s = drone.and_then(|it| it.trajectory.t_s.last());
        return match (enters_s.filter(|it| *it > explained.at_s), last_s) {
            (Some(enters_s), _) => format!("is not there: it comes at {enters_s:.2} s"),
            (None, last_s) => {
                let last_s = last_s.copied().unwrap_or(0.0);
                format!("is not there: it has left at {last_s:.2} s")
            }
        };
    }
    if explained.unplanned.is_some() {
        return "stands at its start: it is not planned".to_owned();
    }
    let path = drone.map(|it| it.trajectory.t_s.iter().zip(&it.trajectory.position_m));
    let here_m = explained.position_m.unwrap_or_default();
    let moves_on = |(t_s, at_m): (&f64, &Point3<f64>)| {
        *t_s > explained.at_s && (at_m - here_m).norm() > SAME_PLACE_M
    };
    let is_done = drone.is_none_or(|it| it.arrives_s <= explained.at_s);
    match path.is_some_and(|mut path| path.any(moves_on)) {
        true => "stands: it has not begun",
        false if is_done => "stands: it is done",
        false => "stands at its last task",
    }
    .to_owned()
}

fn report(explained: &Explained, plan: &Plan) -> Report {
    let name = &explained.drone;
    let at = explained.position_m.as_ref().map(place);
    let at = at.map_or(String::new(), |at| format!(", at {at}"));
    let what = match (explained.does, explained.span_s) {
        ("flies", _) => format!("flies at {:.2} m/s", explained.speed_mps),
        (does, Some((from_s, until_s))) => {
            let word = match does {
                "wait" => "waits",
                "dwell" => "dwells at its task",
                "rests" => "rests between two moves",
                _ => "stops",
            };
            format!(
                "{word} from {from_s:.2} s to {until_s:.2} s ({:.2} s)",
                until_s - from_s
            )
        }
        _ => stands(explained, plan),
    };
    let mut report = Report::new(
        format!("{}: `{name}` at {:.2} s", plan.scenario, explained.at_s),
        format!("It {what}{at}."),
    );
    if let Some(reason) = explained.unplanned.as_ref().filter(|it| !it.is_empty()) {
        report.section("Why", vec![Part::line(reason.clone())]);
    }
    let is_asked = !["dwell", "rests"].contains(&explained.does);
    if let Some((from_s, until_s)) = explained.span_s.filter(|_| is_asked) {
        let earlier = match explained.costs_s {
            Some(0.0) => "no earlier at its goal".to_owned(),
            costs_s => format!("{:.2} s earlier", saved_s((from_s, until_s), costs_s)),
        };
        let first = explained.otherwise.first();
        let zone = first.and_then(|it| it.with.as_ref().filter(|_| is_of_zone(it)));
        let reason = match (&explained.waits_for, zone) {
            (Some(other), _) => Some(format!("waits for `{other}`")),
            (None, Some(zone)) => Some(format!(
                "waits so that the air in zone `{zone}` keeps its limit"
            )),
            (None, None) => None,
        };
        let lines = match (reason, explained.otherwise.len()) {
            (Some(reason), all) => {
                let mut list: Vec<String> = explained
                    .otherwise
                    .iter()
                    .take(MOST_LISTED)
                    .map(ToString::to_string)
                    .collect();
                if all > MOST_LISTED {
                    list.push(format!("and {} more", all - MOST_LISTED));
                }
                let what = match explained.does {
                    "wait" => format!("It {reason}."),
                    _ => format!("It dwells, or {reason}: --scenario tells dwells from waits."),
                };
                vec![
                    Part::line(format!(
                        "{what} Had it gone on at once, it would be {earlier}, and the verifier finds, all others as planned:"
                    )),
                    Part::List(list),
                ]
            }
            (None, _) => {
                let because = match explained.does {
                    "wait" => {
                        "a wait that the search took over another path, or that keeps room for drones that are early or late"
                    }
                    _ => {
                        "a dwell, or a wait that the search took over another path: --scenario tells dwells from waits"
                    }
                };
                vec![Part::line(format!(
                    "Had it gone on at once, {earlier}, nothing would break as the others fly: it is {because}."
                ))]
            }
        };
        report.section("Why", lines);
    }
    let rows = explained
        .stops
        .iter()
        .map(|(from_s, until_s, what, costs_s)| {
            vec![
                format!("{from_s:.2}"),
                format!("{until_s:.2}"),
                format!("{:.2}", until_s - from_s),
                (*what).to_owned(),
                cell(*costs_s, 2),
            ]
        });
    let rows: Vec<Vec<String>> = rows.collect();
    if !rows.is_empty() {
        report.section(
            "All its stops",
            vec![Part::table(
                "rrrlr",
                "from (s)|until (s)|for (s)|what|costs (s)",
                rows,
            )],
        );
    }
    let elsewhere_s = explained.waits_elsewhere_s;
    if let Some(elsewhere_s) = elsewhere_s.filter(|it| *it >= LEAST_ELSEWHERE_S) {
        let line = format!(
            "Of {:.2} s that its plan counts as waiting, {elsewhere_s:.2} s are in none of its stops: in shorter ones, and in slower flight.",
            explained.waits_s
        );
        report.section("", vec![Part::line(line)]);
    }
    let page = explained.page.iter();
    let look = page.map(|page| Part::line(format!("Look: {page}")));
    report.section("", look.collect());
    report
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_time_runs_backwards_without_a_wait_and_an_appointment_is_left_when_it_was() {
        for k in 1..500 {
            let [from_s, for_s, on_s] = [0.1, 0.37, 0.73].map(|it| it * f64::from(k));
            let until_s = from_s + for_s;
            let held_s = (until_s + on_s, until_s + 2.0 * on_s);
            // What is waited may be rounded up.
            for saved_s in [for_s, until_s - from_s, for_s.next_up()] {
                for held in [None, Some(held_s)] {
                    let at_s = [
                        from_s,
                        0.5 * (from_s + until_s),
                        until_s,
                        held_s.0,
                        held_s.1,
                    ];
                    let then_s = at_s.map(|t_s| earlier_s(t_s, (from_s, until_s), saved_s, held));
                    assert!(then_s.is_sorted(), "{then_s:?}");
                    let last_s = at_s[4] - if held.is_some() { 0.0 } else { saved_s };
                    assert!(then_s[0] == from_s && (then_s[4] - last_s).abs() < 1e-9);
                }
            }
        }
    }
}
