//! The table of real flights: what the diagnosis finds by itself in flights of others, beginning from what is known to be too little.

use std::path::Path;

use diagnosis::campaign::hardware::HardwareRow;
use diagnosis::campaign::{CampaignFinding, diagnose_campaign};

use super::{flights, hardware, words};
use crate::io::failure::Failure;
use crate::io::recordings;
use crate::report::words::count;

/// The sets, with what logs leave unsaid: by folder, and the file that ships.
const SWARM: [&str; 2] = ["neural_swarm2", "recordings/neural_swarm2.ron"];
const HARDWARE: [&str; 2] = ["crazypad", "recordings/crazypad.ron"];

/// One beginning, and what must come of it.
struct Question {
    flights: &'static str,
    from: &'static str,
    alone: bool,
    near_floor: bool,
    /// What must be named first, if anything is known to be missing.
    first: &'static str,
    /// Which rows the errors are of, by the beginning of their name.
    rows: &'static str,
}

const QUESTIONS: [Question; 3] = [
    Question {
        flights: "Neural-Swarm2",
        from: "each drone flies alone",
        alone: true,
        near_floor: false,
        first: "downwash",
        rows: "under another drone",
    },
    Question {
        flights: "Neural-Swarm2",
        from: "the hover jet",
        alone: false,
        near_floor: false,
        first: "",
        rows: "under another drone",
    },
    Question {
        flights: "Neural-Swarm2, near the floor",
        from: "the hover jet, no floor",
        alone: false,
        near_floor: true,
        first: "ground_effect_thrust",
        rows: "lower than 0.15 m",
    },
];

/// The table as Markdown, and whether everything that is known to be there was named; `campaigns` holds the campaign files that ship.
pub(crate) fn table(folder: &Path, campaigns: &Path) -> Result<(String, bool), Failure> {
    let read = |[set, campaign]: [&str; 2]| {
        recordings::read_all(&[folder.join(set)], Some(&campaigns.join(campaign)))
    };
    let swarm = read(SWARM)?;
    let mut text = String::from(
        "| flights | starting from | what it names, in this order | force held out, before → after (95 %) | noise floor |\n| --- | --- | --- | --- | --- |\n",
    );
    let mut is_named = true;
    for question in &QUESTIONS {
        let options = flights::options(&swarm, question.alone, question.near_floor)?;
        let found = diagnose_campaign(&swarm, &options)?;
        let first = found.taken.first().map_or("", |taken| &taken.name);
        is_named &= question.first.is_empty() || first == question.first;
        text += &row(question, &found);
    }
    let rows = hardware::judge(
        &read(HARDWARE)?,
        "normal_flight",
        &["__E8_".to_owned(), "__E9_".to_owned()],
    )?;
    is_named &= rows
        .iter()
        .all(|row| !row.is_normal || row.found.answers.is_empty());
    text += &changed(&rows);
    Ok((text, is_named))
}

/// One question and its answer.
fn row(question: &Question, found: &CampaignFinding) -> String {
    let named = found.finding.effects.iter().zip(&found.taken);
    let named: Vec<String> = named
        .map(|(effect, taken)| {
            let numbers: Vec<String> = effect
                .parameters
                .iter()
                .map(|(name, e)| {
                    let [value, low, high] = [e.value, e.low, e.high].map(words::figures);
                    format!("{name} {value} ({low} to {high})")
                })
                .collect();
            let or = match effect.alternatives.is_empty() {
                true => String::new(),
                false => format!(" or {}", effect.alternatives.join(" or ")),
            };
            format!(
                "`{}`{or}: {}; gain {:.0} ± {:.0}",
                effect.name,
                numbers.join(", "),
                taken.gain,
                taken.gain_error
            )
        })
        .collect();
    let place = found
        .skills
        .iter()
        .find(|skill| skill.rows_where.starts_with(question.rows));
    let fit = place.or(found.skills.first()).map_or_else(String::new, |skill| {
        let [low, after, high] = skill.rms_after_n.map(milli);
        let [r2_low, r2, r2_high] = skill.r2_after;
        format!(
            "{} → {after} mN ({low} to {high}), R² {:.2} → {r2:.2} ({r2_low:.2} to {r2_high:.2}); {}, {} rows of {}",
            milli(skill.rms_before_n),
            skill.r2_before,
            skill.rows_where,
            skill.rows,
            count(skill.flights, "flight", "flights")
        )
    });
    format!(
        "| {}, {} | {} | {} | {fit} | {} mN |\n",
        question.flights,
        found.flights,
        question.from,
        if named.is_empty() {
            "nothing".to_owned()
        } else {
            named.join("<br>")
        },
        milli(found.finding.held_out.noise_floor)
    )
}

fn milli(newton: f64) -> String {
    format!("{:.1}", 1e3 * newton)
}

/// Changes that were seen, each in a row; those that were not, in one; and the flights that nothing was done to.
fn changed(rows: &[HardwareRow]) -> String {
    let is_quiet = |row: &&HardwareRow| row.found.answers.is_empty();
    let normal: Vec<&HardwareRow> = rows.iter().filter(|row| row.is_normal).collect();
    let floor = format!(
        "{:.1} %",
        100.0 * normal.iter().map(|row| farthest(row)).fold(0.0, f64::max)
    );
    let line = |what: &str, answer: &str, of: &[&HardwareRow]| {
        let range = |value: &dyn Fn(&HardwareRow) -> f64| {
            let values = || of.iter().map(|row| value(row));
            (
                values().fold(f64::INFINITY, f64::min),
                values().fold(0.0, f64::max),
            )
        };
        let (least, most) = range(&|row| 100.0 * farthest(row));
        let (unlikely, likely) = range(&|row| row.found.chance);
        format!(
            "| CrazyPAD, {what}, {} | the normal flights of the same drone | {answer} | largest change of a motor's voltage {least:.1} to {most:.1} %, chance of a normal flight {unlikely:.3} to {likely:.3} | {floor} |\n",
            of.len()
        )
    };
    let mut changes: Vec<&str> = Vec::new();
    for row in rows.iter().filter(|row| !row.is_normal) {
        if !changes.contains(&change(&row.flight)) {
            changes.push(change(&row.flight));
        }
    }
    let mut text = String::new();
    let (mut unseen, mut unseen_names) = (Vec::new(), Vec::new());
    for name in changes {
        let of: Vec<&HardwareRow> = rows
            .iter()
            .filter(|row| change(&row.flight) == name)
            .collect();
        let seen = of.iter().find(|row| !is_quiet(row));
        match seen {
            Some(first) => {
                let same = of
                    .iter()
                    .filter(|row| hardware::said(row) == hardware::said(first));
                let answer = format!(
                    "{} of {}: {}",
                    same.count(),
                    of.len(),
                    hardware::said(first)
                );
                text += &line(&format!("`{name}`"), &answer, &of);
            }
            None => {
                unseen_names.push(format!("`{name}`"));
                unseen.extend(of);
            }
        }
    }
    let nothing = |of: &[&HardwareRow]| {
        format!(
            "{} of {}: nothing",
            of.iter().copied().filter(|row| is_quiet(row)).count(),
            of.len()
        )
    };
    text += &line(&unseen_names.join(", "), &nothing(&unseen), &unseen);
    text += &line(
        "`normal_flight`, each left out by turns",
        &nothing(&normal),
        &normal,
    );
    text
}

/// Largest change of a motor's voltage.
fn farthest(row: &HardwareRow) -> f64 {
    row.found
        .motors
        .iter()
        .fold(0.0, |most, change| change.abs().max(most))
}

/// What was done to the drone, as its flights are called: all before the drone's own mark.
fn change(flight: &str) -> &str {
    flight.split("__").next().unwrap_or(flight)
}
