//! `plan check`: the verifier alone, on a plan, a show or a log from anywhere.

use std::path::PathBuf;

use clap::Args;
use planner::Plan;
use planner::plan::file::PlanFile;
use planner::plan::{Violation, ViolationKind};
use planner::scenario::missing;
use planner::verify::CROWD;
use planner::verify::examination::{Difference, Examination, examine, examine_least};
use planner::verify::lateness::{FINE_S, LATEST_S, Lateness};
use serde_json::json;
use viewer::View;

use crate::commands::battery::Batteries;
use crate::commands::{ABOVE_0, fly, number, plan};
use crate::io::answer::{Answer, Format, print};
use crate::io::failure::{Failure, tell};
use crate::io::files::{self, OutFolder};
use crate::io::plans::Source;
use crate::report::words::{ALPHA, LIST_ALL_UP_TO, count, joined, place, wrote};

#[derive(Args)]
pub(crate) struct Arguments {
    /// What is checked
    #[command(flatten)]
    source: Source,
    /// Scenario whose drones, tasks, dwells, loads and limits the plan must answer
    #[arg(long, value_name = "SCENARIO.ron")]
    scenario: Option<PathBuf>,
    /// How to print what is found
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Folder for checked.json, the plan as it was read and with what was found, and plan.html
    /// [default: nothing is written]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Refuse a plan in which a drone takes more of its full battery (%)
    #[arg(long, value_name = "PERCENT", value_parser = number(ABOVE_0..=100.0, "%"))]
    battery: Option<f64>,
    /// Capacities of batteries and efficiencies of drives (RON; see docs/flight.md)
    #[arg(long, value_name = "SETUP.ron")]
    vehicles: Option<PathBuf>,
}

/// The file by which one knows a folder of this command.
const MAIN: &str = "checked.json";

/// Answers as the run did that wrote the plan: an unplanned drone is a no, a violation is a no, and
/// so is a figure that does not follow from the plan.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let file = arguments.source.read()?.file;
    let vehicles = fly::setup(arguments.vehicles.as_deref())?;
    let asked = arguments.scenario.as_deref();
    let asked = asked.map(|path| plan::read_world(path, None)).transpose()?;
    let out = arguments.out.clone();
    let out = out.map(|path| OutFolder::prepare(path, MAIN)).transpose()?;
    let drones = file.plan.drones.len();
    // Of a large fleet the text names the least alone.
    let is_brief = arguments.format == Format::Text && out.is_none() && drones > LIST_ALL_UP_TO;
    let found = match is_brief {
        true => examine_least(&file),
        false => examine(&file, true),
    };
    if let Some(setup) = &vehicles {
        fly::tell_unknown(setup, &found.plan);
    }
    let batteries = Batteries::of(&found.plan, arguments.battery, vehicles.as_ref());
    let missing = asked.map(|world| missing(&world, &found.plan));
    let violations = &found.plan.violations;
    let files = match &out {
        None => Vec::new(),
        Some(out) => {
            let page = View::of(&found.plan, None)
                .with_omitted(found.omitted)
                .page(None);
            let texts = vec![
                (MAIN.to_owned(), files::json(&found.plan)),
                ("plan.html".to_owned(), page),
            ];
            files::write_below(&out.path, texts)?
        }
    };
    print(&match arguments.format {
        Format::Json => files::json(&json!({
            "scenario": found.plan.scenario,
            "drones": found.plan.drones.len(),
            "unplanned": found.plan.unplanned.len(),
            "violations": violations,
            "first_exposure": first_exposure(&found),
            "examination": found,
            "missing": missing,
            "remarks": file.remarks,
            "batteries": batteries.charges,
            "files": files,
        })),
        Format::Text => {
            let battery = batteries.line().map(|it| format!("  {it}\n"));
            let battery = battery.unwrap_or_default();
            text_of(&file, &found, missing.as_deref()) + &battery + &wrote(&files)
        }
    })?;
    plan::tell_batteries(&batteries);
    let is_alpha = |it: &Violation| it.kind.without_margin() == ViolationKind::Air;
    if arguments.format == Format::Text && violations.iter().any(is_alpha) {
        tell(ALPHA);
    }
    let is_good = violations.is_empty()
        && found.differences.is_empty()
        && found.plan.unplanned.is_empty()
        && batteries.are_within()
        && missing.is_none_or(|it| it.is_empty());
    Ok(Answer::from(is_good))
}

/// Violations that are printed: chosen here, some screens' worth. As JSON there are more.
const MOST_LISTED: usize = 200;

fn text_of(file: &PlanFile, found: &Examination, missing: Option<&[String]>) -> String {
    let plan = &found.plan;
    let told = plan.violations.iter().take(MOST_LISTED);
    let violations = told.map(|it| format!("{it}\n"));
    let all = plan.violations.len() + found.omitted;
    let more = match all.saturating_sub(MOST_LISTED.min(plan.violations.len())) {
        0 => String::new(),
        more => format!("and {more} more\n"),
    };
    let differences = found
        .differences
        .iter()
        .map(|it: &Difference| format!("{it}\n"));
    let stay = match plan.unplanned.len() {
        0 => String::new(),
        some => {
            let stay = count(some, "drone stays", "drones stay");
            format!(", {stay} at the start")
        }
    };
    let differ = match found.differences.len() {
        0 if contradicts(plan) => ", figures not compared: the plan contradicts itself".to_owned(),
        0 if found.crowded > 0 => ", figures not compared".to_owned(),
        0 => String::new(),
        some => format!(", {}", count(some, "figure differs", "figures differ")),
    };
    let lacks = missing
        .unwrap_or_default()
        .iter()
        .map(|it| format!("{it}\n"));
    let answers = match missing {
        None => String::new(),
        Some([]) => ", answers its scenario".to_owned(),
        Some(some) => format!(", {} of its scenario", count(some.len(), "lack", "lacks")),
    };
    let mut text = format!(
        "{}{more}{}{}{}: {}, {}{differ}{stay}{answers}\n",
        joined(violations, ""),
        joined(differences, ""),
        joined(lacks, ""),
        match &plan.scenario[..] {
            "" => "the plan",
            name => name,
        },
        count(plan.drones.len(), "drone", "drones"),
        count(all, "violation", "violations")
    );
    for line in margins(found).into_iter().chain(notes(file)) {
        text += &format!("  {line}\n");
    }
    text
}

/// The first time that a drone is exposed to more than its limit, or is in a near-field column.
fn first_exposure(found: &Examination) -> Option<&Violation> {
    let is_exposure = |it: &&Violation| {
        let kind = it.kind.without_margin();
        matches!(kind, ViolationKind::Air | ViolationKind::Column)
    };
    // They are in order of time.
    found.plan.violations.iter().find(is_exposure)
}

/// Nothing else of it was judged.
fn contradicts(plan: &Plan) -> bool {
    let mut violations = plan.violations.iter();
    violations.any(|it| it.kind == ViolationKind::Malformed)
}

/// How much room there is.
fn margins(found: &Examination) -> Vec<String> {
    let mut lines = Vec::new();
    if found.crowded > 0 {
        lines.push(format!(
            "{} more than {CROWD} others at once: a few of these pairs were judged, the others of that moment \
             counted; the air to and from these drones, zones, margins and figures were not judged",
            count(found.crowded, "drone touches", "drones touch")
        ));
    }
    if let Some(it) = &found.closest {
        let [one, other] = &it.drones;
        lines.push(format!(
            "closest approach: `{one}` and `{other}`, {:.2} m between the bodies at {:.2} s, at {}",
            it.gap_m,
            it.at_s,
            place(&it.position_m)
        ));
    } else if found.plan.drones.len() > 1 && !contradicts(&found.plan) {
        lines.push("closest approach: no drone flies while another is there".to_owned());
    }
    if let Some(first) = first_exposure(found) {
        lines.push(format!("first exposure over a limit: {first}"));
    }
    if let Some(it) = &found.worst_air {
        let from = it.from.iter().map(|from| format!(", mostly from `{from}`"));
        lines.push(format!(
            "worst air: `{}`, alpha {:.3} of {:.3} at {:.2} s, at {}{}",
            it.drone,
            it.alpha,
            it.limit,
            it.at_s,
            place(&it.position_m),
            joined(from, "")
        ));
    }
    for zone in &found.plan.zone_air {
        let from = zone.worst_air_from.as_ref();
        let from = from.map(|from| format!(", mostly from `{from}`"));
        let at = zone.worst_air_at_s.map(|at_s| format!(" at {at_s:.2} s"));
        let most_mps = zone.at_most_mps.unwrap_or(zone.worst_air_mps);
        lines.push(format!(
            "zone `{}`: at most {most_mps:.2} m/s of air; {:.2} m/s found{}{}",
            zone.zone,
            zone.worst_air_mps,
            at.unwrap_or_default(),
            from.unwrap_or_default()
        ));
    }
    let drones = found.plan.drones.iter().zip(&found.late);
    let late: Vec<(&str, &Lateness)> = drones
        .filter_map(|(drone, late)| Some((drone.name.as_str(), late.as_ref()?)))
        .collect();
    let Some((name, least)) = late.iter().min_by(|a, b| a.1.late_s.total_cmp(&b.1.late_s)) else {
        return lines;
    };
    let told = |it: &Lateness| match it.late_s >= LATEST_S {
        true => format!("{LATEST_S:.0} s and more"),
        false => format!("{:.2} s", it.late_s),
    };
    let then = least.breaks.as_ref().map(|(kind, with)| {
        let what = match kind {
            ViolationKind::Collision => "bodies touch",
            ViolationKind::Column => "a near-field column is entered",
            ViolationKind::Zone => "the air of a zone is too strong",
            _ => "a limit of air is exceeded",
        };
        format!("; then {what} (`{with}`)")
    });
    lines.push(format!(
        "smallest time margin: `{name}` may be {} late, all others on time{}",
        told(least),
        then.unwrap_or_default()
    ));
    if found.plan.drones.len() <= LIST_ALL_UP_TO {
        let each = late.iter().map(|(name, it)| format!("{name} {}", told(it)));
        lines.push(format!(
            "each may be late by (to {FINE_S} s): {}",
            joined(each, ", ")
        ));
    }
    lines
}

/// What was filled in, what was not judged.
fn notes(file: &PlanFile) -> Vec<String> {
    let mut lines = file.remarks.clone();
    let effects = file.plan.flown_effects();
    if !effects.is_empty() {
        lines.push(format!("judged in air with {}", effects.join(", ")));
    }
    if !file.filled.is_empty() {
        let filled = file.filled.iter();
        let filled =
            filled.map(|(key, some)| format!("{key} ({})", count(*some, "drone", "drones")));
        lines.push(format!("filled in: {}", joined(filled, ", ")));
    }
    let planned = file.planning_figures();
    if !planned.is_empty() {
        lines.push(format!(
            "not judged, as it would need planning: {}",
            joined(planned.iter().map(|it| (*it).to_owned()), ", ")
        ));
    }
    lines
}
