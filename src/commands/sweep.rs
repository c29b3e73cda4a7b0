//! `plan sweep SCENARIO --set SECTION.KEY=FROM:TO:STEP`: the same scenario planned for each value
//! of one setting.

use std::path::PathBuf;

use clap::Args;
use planner::{Control, Outcome};
use serde::Serialize;

use crate::commands::answers::Wanted;
use crate::commands::plan::{read_source, world_of};
use crate::io::answer::Answer;
use crate::io::failure::Failure;
use crate::plots::curves;
use crate::report::sections::{Part, Report};
use crate::report::words::shortest;

/// Values of one sweep: chosen here, each is a whole plan.
const MOST_VALUES: usize = 100;

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
    rows: Vec<Row>,
}

/// One value.
#[derive(Serialize)]
struct Row {
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
}

fn setting(text: &str) -> Result<Setting, String> {
    let form = "SECTION.KEY=FROM:TO:STEP or SECTION.KEY=A,B,C is asked for";
    let (name, values) = text.split_once('=').ok_or(form)?;
    let (section, key) = name.split_once('.').ok_or(form)?;
    let is_name =
        |it: &str| !it.is_empty() && it.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !is_name(section) || !is_name(key) {
        return Err(form.to_owned());
    }
    let number = |it: &str| {
        let value = it.trim().parse::<f64>().ok().filter(|it| it.is_finite());
        value.ok_or_else(|| format!("`{it}` is no number; {form}"))
    };
    let parts: Result<Vec<f64>, String> = values.split([':', ',']).map(number).collect();
    let values = match (values.contains(':'), &parts?[..]) {
        (false, listed) => listed.to_vec(),
        (true, &[from, to, step]) if step > 0.0 && to >= from => {
            // A rounding of the step adds no value and takes none.
            let count = ((to - from) / step + 1e-9).floor() as usize;
            let at = |k: usize| {
                let value: f64 = from + k as f64 * step;
                (value * 1e9).round() / 1e9
            };
            (0..=count.min(MOST_VALUES)).map(at).collect()
        }
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

/// A scenario's text with a setting at a value: in place of what it says, or added.
fn with_setting(text: &str, section: &str, key: &str, value: f64) -> Option<String> {
    let whole = record(text, 0..text.len(), None)?;
    let Some(inside) = record(text, whole.clone(), Some(section)) else {
        let mut changed = text.to_owned();
        changed.insert_str(whole.start, &format!("{section}: ({key}: {value}), "));
        return Some(changed);
    };
    let mut changed = text.to_owned();
    match value_of(text, inside.clone(), key) {
        Some(old) => changed.replace_range(old, &value.to_string()),
        None => changed.insert_str(inside.start, &format!("{key}: {value}, ")),
    }
    Some(changed)
}

/// Bytes of a text that are no comments and no strings, with how deep in brackets they are; depth
/// of an opening bracket: that outside it.
fn code(text: &str) -> Vec<(usize, u8, usize)> {
    let bytes = text.as_bytes();
    let mut found = Vec::with_capacity(bytes.len());
    let (mut at, mut depth) = (0, 0_usize);
    while at < bytes.len() {
        let rest = &text[at..];
        if rest.starts_with("//") {
            at += rest.find('\n').unwrap_or(rest.len());
        } else if rest.starts_with("/*") {
            at += rest.find("*/").map_or(rest.len(), |it| it + 2);
        } else if bytes[at] == b'"' {
            at += 1;
            while at < bytes.len() && bytes[at] != b'"' {
                at += if bytes[at] == b'\\' { 2 } else { 1 };
            }
            at += 1;
        } else {
            let byte = bytes[at];
            depth -= usize::from(b")]}".contains(&byte) && depth > 0);
            found.push((at, byte, depth));
            depth += usize::from(b"([{".contains(&byte));
            at += 1;
            while at < bytes.len() && !text.is_char_boundary(at) {
                at += 1;
            }
        }
    }
    found
}

/// What stands between the round brackets of a record: of the whole text, or of a key within one.
fn record(
    text: &str,
    within: std::ops::Range<usize>,
    key: Option<&str>,
) -> Option<std::ops::Range<usize>> {
    let from = match key {
        None => within.start,
        Some(key) => value_of(text, within.clone(), key)?.start,
    };
    let code = code(text);
    let mut after = code.iter().skip_while(|it| it.0 < from);
    let &(open, _, depth) = after.find(|it| it.1 == b'(')?;
    let &(close, ..) = after.find(|it| it.1 == b')' && it.2 == depth)?;
    Some(open + 1..close)
}

/// The value of a key of the record that a range is the inside of.
fn value_of(
    text: &str,
    inside: std::ops::Range<usize>,
    key: &str,
) -> Option<std::ops::Range<usize>> {
    let code: Vec<_> = code(text)
        .into_iter()
        .filter(|it| inside.contains(&it.0))
        .collect();
    let depth = code.iter().map(|it| it.2).min()?;
    let is_word = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'_';
    let starts =
        (0..code.len()).filter(|&k| code[k].2 == depth && (k == 0 || !is_word(code[k - 1].1)));
    for k in starts {
        let at = code[k].0;
        let Some(rest) = text[at..inside.end].strip_prefix(key) else {
            continue;
        };
        let Some(value) = rest.trim_start().strip_prefix(':') else {
            continue;
        };
        let value = value.trim_start();
        let from = inside.end - value.len();
        let end = code
            .iter()
            .find(|it| it.0 >= from && it.1 == b',' && it.2 == depth);
        let to = end.map_or(inside.end, |it| it.0);
        let told = text[from..to].trim_end();
        return Some(from..from + told.len());
    }
    None
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
    let mut rows = Vec::with_capacity(values.len());
    for &value in values {
        let changed = with_setting(&text, section, key, value).unwrap_or_else(|| text.clone());
        let world = world_of(&arguments.scenario, &changed, None)?;
        let outcome = planner::plan_world(&world, &Control::QUIET)
            .map_err(|faults| Failure::Drawn(faults.to_string()))?;
        rows.push(row(value, world.drones.len(), &outcome));
    }
    let swept = Swept {
        scenario: plain.name.clone(),
        setting: format!("{section}.{key}"),
        rows,
    };
    let report = report(&swept);
    let name = arguments.scenario.file_stem().unwrap_or_default();
    let name = format!("{}-{key}", name.to_string_lossy());
    let json = ("sweep.json", 2, "sweep/1");
    arguments.wanted.deliver((&name, &report), json, &swept)?;
    Ok(Answer::from(
        swept.rows.iter().all(|it| it.status == "safe"),
    ))
}

fn row(value: f64, drones: usize, outcome: &Outcome) -> Row {
    let plan = outcome.planned().map(|it| &it.plan);
    let of = |figure: &dyn Fn(&planner::Plan) -> f64| plan.map(figure);
    Row {
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
    }
}

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
    report.section(
        "What it costs",
        vec![Part::table("rlrrrrrr", &headings, rows)],
    );
    let points = |of: &dyn Fn(&Row) -> Option<f64>| -> Vec<(f64, f64)> {
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
    let caption = "Sums are over planned drones: where fewer are planned they are lower for that.";
    let figure = curves::draw("sweep", (title, caption), setting, &curves);
    report.section("", figure.into_iter().map(Part::Figure).collect());
    report
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_is_replaced_where_it_stands_and_added_where_it_does_not() {
        let text = r#"Scenario(name: "planning: (air_limit: 9)", // planning: (air_limit: 8)
            drones: [(air_limit: 0.2, tasks: [(to_m: (1, 2, 3))])],
            planning: (cell_m: 1, air_limit: 0.3 /* alpha */, seed: 0))"#;
        let changed = with_setting(text, "planning", "air_limit", 0.45).expect("changed");
        assert_eq!(
            changed,
            text.replace("air_limit: 0.3 /* alpha */", "air_limit: 0.45")
        );
        let added = with_setting(text, "planning", "clearance_m", 0.2).expect("changed");
        assert!(
            added.contains("planning: (clearance_m: 0.2, cell_m: 1"),
            "{added}"
        );
        let new = with_setting(text, "air", "temperature_c", 30.0).expect("changed");
        assert!(
            new.starts_with("Scenario(air: (temperature_c: 30), name:"),
            "{new}"
        );
    }

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
        ] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
