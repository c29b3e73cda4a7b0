//! Findings over real flights as text: a report for the terminal, and rows of a table.

use std::fmt::Write;

use serde::Serialize;

use super::diagnose::CampaignFinding;
use super::hardware::{Effort, HardwareFinding, Normal};
use crate::recording::Recording;

/// Newton of a gram-force, in which forces on small drones are told.
const GRAM_N: f64 = 9.806_65e-3;

/// One row of the table of real flights.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TableRow {
    /// What the simulation was, on which flights.
    pub question: String,
    /// What was found, in the order in which it was taken.
    pub answer: String,
    /// Gain in held-out log density, with its standard error over flights.
    pub gain: String,
    /// Held-out skill before and after, with the interval over flights.
    pub held_out: String,
    /// What cannot be told apart, and what is left.
    pub not_sure: String,
}

/// A finding as a row; skill is told of the rows at `place` among [`CampaignFinding::skills`].
#[must_use]
pub fn row(question: &str, found: &CampaignFinding, place: usize) -> TableRow {
    let each = |text: &dyn Fn(usize) -> String| -> String {
        let all: Vec<String> = (0..found.taken.len()).map(text).collect();
        all.join("; ")
    };
    let answer = each(&|i| {
        let effect = &found.finding.effects[i];
        let parameters: Vec<String> = effect
            .parameters
            .iter()
            .map(|(name, e)| format!("{name} {:.2} [{:.2}, {:.2}]", e.value, e.low, e.high))
            .collect();
        format!("{} ({})", effect.name, parameters.join(", "))
    });
    let gain = each(&|i| {
        format!(
            "{:.0} ± {:.0}",
            found.taken[i].gain, found.taken[i].gain_error
        )
    });
    let skill = found.skills.get(place).or(found.skills.first());
    let held_out = skill.map_or_else(String::new, |skill| {
        let [low, after, high] = skill.r2_after;
        format!(
            "R² {:.2} → {after:.2} [{low:.2}, {high:.2}], rms {:.2} → {:.2} g; {}: {} rows, {} flights",
            skill.r2_before,
            skill.rms_before_n / GRAM_N,
            skill.rms_after_n[1] / GRAM_N,
            skill.rows_where,
            skill.rows,
            skill.flights
        )
    });
    let mut not_sure: Vec<String> = found
        .taken
        .iter()
        .filter(|taken| !taken.alternatives.is_empty())
        .map(|taken| format!("{} or {}", taken.name, taken.alternatives.join(" or ")))
        .collect();
    let [all, left] = found.flexible_gain;
    if left > 2.5 * found.flexible_gain_error && left > 0.0 {
        not_sure.push(format!(
            "trees still find {left:.0} ± {:.0} of their {all:.0}: no name here for that",
            found.flexible_gain_error
        ));
    }
    TableRow {
        question: question.to_owned(),
        answer: if answer.is_empty() {
            "nothing".into()
        } else {
            answer
        },
        gain,
        held_out,
        not_sure: not_sure.join("; "),
    }
}

/// Rows as a table in Markdown.
#[must_use]
pub fn markdown(rows: &[TableRow]) -> String {
    let mut text = String::from(
        "| simulation, flights | what is missing | held-out gain | held-out force | not sure about |\n| --- | --- | --- | --- | --- |\n",
    );
    for row in rows {
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} |",
            row.question, row.answer, row.gain, row.held_out, row.not_sure
        );
    }
    text
}

/// A finding as a report for the terminal.
#[must_use]
pub fn report(found: &CampaignFinding) -> String {
    let mut text = String::new();
    let region = &found.finding.region;
    let mut line = |words: String| {
        text.push_str(&words);
        text.push('\n');
    };
    line(format!(
        "{} flights, {} rows of vertical force; scatter in still air {:.2} g, flights differ by {:.2} g",
        found.flights,
        found.finding.samples,
        found.finding.held_out.noise_floor / GRAM_N,
        found.offset_n / GRAM_N
    ));
    if let Some(located) = &found.located {
        line(format!(
            "WHERE   {}: {:.0} % of the rows, {:+.1} g on average (p {:.3}, found without any candidate)",
            located.description,
            100.0 * located.share,
            located.mean_error_n / GRAM_N,
            located.p
        ));
    }
    if !region.bounds.is_empty() {
        line(format!(
            "        the correction matters at {}: {:.0} % of the rows",
            region.description,
            100.0 * region.share
        ));
    }
    if found.taken.is_empty() {
        line("WHAT    nothing that holds in flights which were not fitted".into());
    }
    for (taken, effect) in found.taken.iter().zip(&found.finding.effects) {
        line(format!("WHAT    {}: {}", taken.name, effect.story));
        line(format!("        {}", effect.equation));
        for (name, e) in &effect.parameters {
            line(format!(
                "        {name} = {:.3} {}, 95 % {:.3} to {:.3}",
                e.value, e.unit, e.low, e.high
            ));
        }
        line(format!(
            "        held-out gain {:.0} ± {:.0} over flights",
            taken.gain, taken.gain_error
        ));
        for (name, gain, error) in taken.rivals.iter().take(4) {
            line(format!(
                "          {name} in its place: {gain:.0} ± {error:.0}"
            ));
        }
        if !taken.alternatives.is_empty() {
            line(format!(
                "        not told apart from {}",
                taken.alternatives.join(", ")
            ));
        }
    }
    for skill in &found.skills {
        let [low, after, high] = skill.r2_after;
        line(format!(
            "FIT     {}: R² {:.3} → {after:.3} [{low:.3}, {high:.3}], rms {:.2} → {:.2} g ({} rows of {} flights, held out whole)",
            skill.rows_where,
            skill.r2_before,
            skill.rms_before_n / GRAM_N,
            skill.rms_after_n[1] / GRAM_N,
            skill.rows,
            skill.flights
        ));
    }
    line(format!(
        "LEFT    trees gain {:.0} on the baseline, {:.0} ± {:.0} on what is left",
        found.flexible_gain[0], found.flexible_gain[1], found.flexible_gain_error
    ));
    for curve in &found.curves {
        line(format!(
            "        {}: recorded, before, after (g)",
            curve.along
        ));
        for i in 0..curve.bins.len() {
            let [from, to] = curve.bins[i];
            line(format!(
                "        {from:5.2} to {to:5.2}  {:6.2}  {:6.2}  {:6.2} ± {:.2}  ({} rows)",
                curve.recorded_n[i] / GRAM_N,
                curve.before_n[i] / GRAM_N,
                curve.after_n[i] / GRAM_N,
                curve.error_n[i] / GRAM_N,
                curve.rows[i]
            ));
        }
    }
    text
}

/// Hardware of one flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HardwareRow {
    /// Name of the recording.
    pub flight: String,
    /// Whether it is one of the normal flights; it was then left out of what it is compared with.
    pub is_normal: bool,
    /// What it says.
    pub found: HardwareFinding,
    /// The answer in words.
    pub answer: String,
}

/// Every flight against the normal flights of the same drone: `drone_of` and `is_normal` by recording. A normal flight is compared with the
/// others, and left out of the scatter too. Flights without steady hover have no row.
#[must_use]
pub fn hardware_rows(
    recordings: &[Recording],
    drone_of: &[&str],
    is_normal: &[bool],
) -> Vec<HardwareRow> {
    let efforts: Vec<Option<Effort>> = recordings.iter().map(Effort::of).collect();
    let mut drones: Vec<&str> = drone_of.to_vec();
    drones.sort_unstable();
    drones.dedup();
    let normal_of = |drone: &str, but: usize| -> Vec<Effort> {
        (0..recordings.len())
            .filter(|&i| i != but && is_normal[i] && drone_of[i] == drone)
            .filter_map(|i| efforts[i])
            .collect()
    };
    let judge = |index: usize| {
        let effort = efforts[index]?;
        let by_drone: Vec<Vec<Effort>> = drones.iter().map(|d| normal_of(d, index)).collect();
        let own = normal_of(drone_of[index], index);
        if own.is_empty() {
            return None;
        }
        let found = Normal::of(&by_drone)?.judge(&effort, &own);
        Some(HardwareRow {
            flight: recordings[index].name.clone(),
            is_normal: is_normal[index],
            answer: in_words(&found),
            found,
        })
    };
    (0..recordings.len()).filter_map(judge).collect()
}

fn in_words(found: &HardwareFinding) -> String {
    if found.answers.is_empty() {
        return "nothing beyond the scatter of normal flights".into();
    }
    let all: Vec<String> = found
        .answers
        .iter()
        .map(|answer| {
            let motors: Vec<String> = answer.motors.iter().map(|m| format!("M{m}")).collect();
            match (answer.name.as_str(), motors.is_empty()) {
                ("payload_mass", true) => "payload_mass in the middle".into(),
                ("payload_mass", false) => format!("payload_mass near {}", motors.join(" and ")),
                (name, _) => format!("{name} {}", motors.join(" and ")),
            }
        })
        .collect();
    all.join(", or ")
}

/// Rows as a table in Markdown: changes of each motor's voltage in percent.
#[must_use]
pub fn hardware_markdown(rows: &[HardwareRow]) -> String {
    let mut text = String::from(
        "| flight | M1 to M4, % | total, turn, leans, % | chance | answer |\n| --- | --- | --- | --- | --- |\n",
    );
    let percent = |values: [f64; 4]| values.map(|x| format!("{:+.1}", 100.0 * x)).join(" ");
    for row in rows {
        let _ = writeln!(
            text,
            "| {} | {} | {} | {:.4} | {} |",
            row.flight,
            percent(row.found.motors),
            percent(row.found.modes),
            row.found.chance,
            row.answer
        );
    }
    text
}
