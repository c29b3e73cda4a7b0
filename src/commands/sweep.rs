//! `plan sweep SCENARIO --set SECTION.KEY=FROM:TO:STEP`: the same scenario planned for each value
//! of one setting.

use std::path::PathBuf;

use clap::Args;
use planner::scenario::{Problem, with_setting};
use planner::{Control, Outcome, World};
use serde::Serialize;

use crate::commands::answers::Wanted;
use crate::commands::plan::{found_in, read_source, world_of};
use crate::io::answer::Answer;
use crate::io::failure::Failure;
use crate::plots::curves;
use crate::report::sections::{Part, Report};
use crate::report::words::{first_few, joined, shortest};

/// Values of one sweep: chosen here, each is a whole plan.
const MOST_VALUES: usize = 100;
/// From here on a number of 64 bits is not every whole number: 2^53.
const BEYOND_WHOLE: f64 = 9_007_199_254_740_992.0;
/// Values that are named where something is wrong with them: chosen here.
const MOST_SHOWN: usize = 5;

#[derive(Args)]
pub(crate) struct Arguments {
    /// Scenario
    #[arg(value_name = "SCENARIO.ron")]
    scenario: PathBuf,
    /// Which setting of the scenario takes which values: planning.air_limit=0.1:0.6:0.1, or
    /// planning.cell_m=0.5,1,2; what drones set for themselves stays
    #[arg(long, value_name = "SECTION.KEY=VALUES", value_parser = setting)]
    set: Setting,
    #[command(flatten)]
    wanted: Wanted,
}

/// A setting and its values.
#[derive(Clone, Debug, PartialEq)]
struct Setting {
    section: String,
    key: String,
    values: Vec<f64>,
}

/// `sweep/1`.
#[derive(Serialize)]
struct Swept {
    scenario: String,
    setting: String,
    rows: Vec<SweptValue>,
}

/// One value.
#[derive(Serialize)]
struct SweptValue {
    value: f64,
    /// `safe`, `partial`, `unsafe` or `blocked`.
    status: &'static str,
    planned: usize,
    drones: usize,
    sum_of_arrivals_s: Option<f64>,
    makespan_s: Option<f64>,
    /// Highest mean air over any drone's discs (m/s).
    worst_air_mps: Option<f64>,
    /// Integral of the air over time, all drones (m).
    dose_m: Option<f64>,
    extra_energy_j: Option<f64>,
    /// What a reader of its plan should know: how cells were chosen, which rules were given up.
    notes: Vec<String>,
}

/// The file by which one knows a folder of this command.
const MAIN: &str = "sweep.json";

/// Sections of a scenario that hold several of a kind.
const LISTS: [&str; 5] = ["drones", "obstacles", "zones", "airframes", "formations"];

fn setting(text: &str) -> Result<Setting, String> {
    let form = "SECTION.KEY=FROM:TO:STEP or SECTION.KEY=A,B,C is asked for";
    let (name, values) = text.split_once('=').ok_or(form)?;
    let (section, key) = name.split_once('.').ok_or(form)?;
    let is_name =
        |it: &str| !it.is_empty() && it.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !is_name(section) || !is_name(key) {
        return Err(form.to_owned());
    }
    if LISTS.contains(&section) {
        return Err(format!(
            "`{section}` is a list; one setting of a section such as planning or air is asked for"
        ));
    }
    let number = |it: &str| {
        let value = it.trim().parse::<f64>().ok().filter(|it| it.is_finite());
        let value = value.ok_or_else(|| format!("`{it}` is no number; {form}"))?;
        match value.abs() < BEYOND_WHOLE {
            true => Ok(value),
            false => Err(format!(
                "`{it}` is too large: whole numbers are told apart below 2^53"
            )),
        }
    };
    let parts: Result<Vec<f64>, String> = values.split([':', ',']).map(number).collect();
    let values = match (values.contains(':'), &parts?[..]) {
        (false, listed) => listed.to_vec(),
        (true, &[from, to, step]) if step > 0.0 && to >= from => {
            // A rounding of the step adds no value and takes none.
            let count = ((to - from) / step + 1e-9).floor() as usize;
            let at = |k: usize| {
                let value: f64 = from + k as f64 * step;
                match value.fract() == 0.0 {
                    true => value,
                    false => (value * 1e9).round() / 1e9,
                }
            };
            (0..=count.min(MOST_VALUES)).map(at).collect()
        }
        (true, &[_, _, step]) if step <= 0.0 => return Err("STEP must be above 0".to_owned()),
        (true, [_, _, _]) => return Err("FROM must not be above TO".to_owned()),
        _ => return Err(form.to_owned()),
    };
    match values.len() {
        1..=MOST_VALUES => Ok(Setting {
            section: section.to_owned(),
            key: key.to_owned(),
            values,
        }),
        _ => Err(format!("at most {MOST_VALUES} values")),
    }
}

/// Exit codes: 0 every value has a plan with all drones; 1: one has none.
pub(crate) fn run(arguments: &Arguments) -> Result<Answer, Failure> {
    let text = read_source(&arguments.scenario)?;
    let Setting {
        section,
        key,
        values,
    } = &arguments.set;
    // What is wrong with the scenario itself is told in its own text.
    let plain = world_of(&arguments.scenario, &text, None)?;
    let mut worlds = Vec::with_capacity(values.len());
    // What is wrong, and with which values.
    let mut wrong: Vec<(String, Vec<f64>)> = Vec::new();
    for &value in values {
        let changed = with_setting(&text, (section, key), value);
        match found_in(&arguments.scenario, &changed, None)? {
            Ok(world) => worlds.push((value, world)),
            Err(found) => {
                // The scenario itself is in order: the setting is not.
                for what in found.iter().map(in_words) {
                    match wrong.iter_mut().find(|it| it.0 == what) {
                        Some((_, values)) => values.push(value),
                        None => wrong.push((what, vec![value])),
                    }
                }
            }
        }
    }
    if !wrong.is_empty() {
        let told = wrong.iter().map(|(what, values)| {
            let shown = first_few(values.iter(), MOST_SHOWN, ",");
            format!("--set {section}.{key}={shown}: {what}")
        });
        return Err(Failure::Inapplicable(told.collect()));
    }
    let name = arguments.scenario.file_stem().unwrap_or_default();
    let name = format!("{}-{key}", name.to_string_lossy());
    let out = arguments.wanted.folder(&name, MAIN)?;
    let mut rows = Vec::with_capacity(values.len());
    for (value, world) in worlds {
        match planner::plan_world(&world, &Control::QUIET) {
            Ok(outcome) => rows.push(row(value, &world, &outcome)),
            Err(faults) => {
                out.abandon();
                return Err(Failure::Drawn(faults.to_string()));
            }
        }
    }
    let swept = Swept {
        scenario: plain.name.clone(),
        setting: format!("{section}.{key}"),
        rows,
    };
    let report = report(&swept);
    let json = (MAIN, 2, "sweep/1");
    (arguments.wanted).deliver_to(&out, &report, json, &swept)?;
    Ok(Answer::from(
        swept.rows.iter().all(|it| it.status == "safe"),
    ))
}

/// What is wrong with a setting, without its place in the text that it was put into.
fn in_words(found: &Problem) -> String {
    let Problem {
        message,
        label,
        help,
        ..
    } = found;
    let label = label.iter().map(|it| format!(": {it}"));
    let help = help.iter().map(|it| format!("\n  = help: {it}"));
    let more: String = label.chain(help).collect();
    format!("{message}{more}")
}

fn row(value: f64, world: &World, outcome: &Outcome) -> SweptValue {
    let drones = world.drones.len();
    let plan = outcome.planned().map(|it| &it.plan);
    let of_plan = outcome.planned().map_or(&[][..], |it| &it.notes[..]);
    let of = |figure: &dyn Fn(&planner::Plan) -> f64| plan.map(figure);
    SweptValue {
        value,
        status: plan.map_or("blocked", |it| it.status.as_str()),
        planned: plan.map_or(0, |it| drones - it.unplanned.len().min(drones)),
        drones,
        sum_of_arrivals_s: of(&|it| it.fleet.sum_of_arrivals_s),
        makespan_s: of(&|it| it.fleet.makespan_s),
        worst_air_mps: of(&|it| {
            it.drones
                .iter()
                .map(|it| it.worst_air_mps)
                .fold(0.0, f64::max)
        }),
        dose_m: of(&|it| it.drones.iter().map(|it| it.dose_m).sum()),
        extra_energy_j: of(&|it| it.fleet.extra_energy_j),
        notes: [&world.notes[..], of_plan].concat(),
    }
}

/// Each note once, with the values whose plans it is of.
fn notes(swept: &Swept) -> Vec<String> {
    let rows = swept.rows.iter();
    let mut noted: Vec<(&str, Vec<f64>)> = Vec::new();
    for (note, value) in rows.flat_map(|row| row.notes.iter().map(move |it| (&it[..], row.value))) {
        match noted.iter_mut().find(|it| it.0 == note) {
            Some((_, values)) => values.push(value),
            None => noted.push((note, vec![value])),
        }
    }
    let told = noted.into_iter().map(|(note, values)| {
        if values.len() == swept.rows.len() {
            return format!("at each value: {note}");
        }
        let values = joined(values.iter().map(|it| shortest(*it, 6)), ", ");
        format!("at {values}: {note}")
    });
    told.collect()
}

const FEWER: &str =
    "Sums are over planned drones: where fewer are planned they are lower for that.";

fn report(swept: &Swept) -> Report {
    let setting = &swept.setting;
    let mut report = Report::new(
        format!("{}: {setting}", swept.scenario),
        "each value is planned from the beginning and verified".to_owned(),
    );
    let told =
        |it: Option<f64>, decimals: usize| it.map_or("-".to_owned(), |it| shortest(it, decimals));
    let rows = swept.rows.iter().map(|it| {
        vec![
            shortest(it.value, 6),
            it.status.to_owned(),
            format!("{} of {}", it.planned, it.drones),
            told(it.sum_of_arrivals_s, 1),
            told(it.makespan_s, 1),
            told(it.worst_air_mps, 2),
            told(it.dose_m, 2),
            told(it.extra_energy_j, 1),
        ]
    });
    let headings = format!(
        "{setting}|status|planned|sum of costs (s)|makespan (s)|worst air (m/s)|exposure (m)|energy by downwash (J)"
    );
    let mut costs = vec![Part::table("rlrrrrrr", &headings, rows)];
    if swept
        .rows
        .iter()
        .any(|it| it.planned != swept.rows[0].planned)
    {
        costs.push(Part::line(FEWER));
    }
    report.section("What it costs", costs);
    report.section("Notes", Part::list(notes(swept)));
    let points = |of: &dyn Fn(&SweptValue) -> Option<f64>| -> Vec<(f64, f64)> {
        let mut points: Vec<(f64, f64)> = swept
            .rows
            .iter()
            .filter_map(|it| Some((it.value, of(it)?)))
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    let curves = [
        ("sum of costs (s)", points(&|it| it.sum_of_arrivals_s)),
        ("exposure of all (m)", points(&|it| it.dose_m)),
        ("drones planned", points(&|it| Some(it.planned as f64))),
    ];
    let title = (
        &swept.scenario[..],
        "the same scenario planned for each value",
    );
    let figure = curves::draw("sweep", (title, FEWER), setting, &curves);
    report.section("", figure.into_iter().map(Part::Figure).collect());
    report
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_a_range_or_a_list() {
        let of = |text: &str| setting(text).map(|it| it.values);
        assert_eq!(
            of("planning.air_limit=0.1:0.6:0.1"),
            Ok(vec![0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
        );
        assert_eq!(of("planning.cell_m=2,0.5"), Ok(vec![2.0, 0.5]));
        for wrong in [
            "air_limit=1",
            "planning.air_limit",
            "planning.air_limit=1:0:1",
            "planning.x=a",
            "planning.x=0:1000:1",
            "planning.x=0:1:0",
            "drones.air_limit=0.1,0.2",
        ] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
