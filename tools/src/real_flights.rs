//! What the diagnosis names by itself in published flights, starting from a simulation that is
//! known to lack something.

use diagnosis::campaign::CampaignFinding;
use diagnosis::campaign::hardware::HardwareRow;
use diagnosis::infer::finding::{Effect, Estimate};

use crate::table::{Table, count, figures, joined};

/// A folder of published flights, and the campaign file that ships with what their logs leave
/// unsaid.
pub struct Set {
    /// Below the folder of all sets.
    pub folder: &'static str,
    /// Below the root of the project.
    pub campaign: &'static str,
}

/// Neural-Swarm2.
pub const SWARM: Set = Set {
    folder: "neural_swarm2",
    campaign: "recordings/neural_swarm2.ron",
};
/// CrazyPAD.
pub const HARDWARE: Set = Set {
    folder: "crazypad",
    campaign: "recordings/crazypad.ron",
};
/// How the normal flights of CrazyPAD begin, and the parts of names that tell its two drones apart.
pub const NORMAL: &str = "normal_flight";
/// See [`NORMAL`].
pub const DRONES: [&str; 2] = ["__E8_", "__E9_"];

/// What flights are simulated from, and what must come of it.
pub struct Question {
    flights: &'static str,
    from: &'static str,
    /// Each drone alone, without wakes.
    pub alone: bool,
    /// Flights near the floor only.
    pub near_floor: bool,
    /// What must be named first, where it is known what is missing.
    first: Option<&'static str>,
    /// Which rows the errors are of, by the beginning of their description.
    rows: &'static str,
}

/// Asked of Neural-Swarm2.
pub const QUESTIONS: [Question; 3] = [
    Question {
        flights: "Neural-Swarm2",
        from: "each drone flies alone",
        alone: true,
        near_floor: false,
        first: Some("downwash"),
        rows: "under another drone",
    },
    Question {
        flights: "Neural-Swarm2",
        from: "the hover jet",
        alone: false,
        near_floor: false,
        first: None,
        rows: "under another drone",
    },
    Question {
        flights: "Neural-Swarm2, near the floor",
        from: "the hover jet, no floor",
        alone: false,
        near_floor: true,
        first: Some("ground_effect_thrust"),
        rows: "lower than 0.15 m",
    },
];

/// One row a question with its answer, then the changes of hardware.
#[must_use]
pub fn table(found: &[CampaignFinding], hardware: &[HardwareRow]) -> Table {
    let mut rows: Vec<Vec<String>> = QUESTIONS.iter().zip(found).map(row).collect();
    rows.extend(changes(hardware));
    let headings = "flights | starting from | what it names, in this order | force held out, before → after (95 %) | noise floor";
    Table::new("lllll", headings, rows)
}

/// Whether everything that is known to be there was named, and no normal flight has a change.
#[must_use]
pub fn is_named(found: &[CampaignFinding], hardware: &[HardwareRow]) -> bool {
    let named = |(question, found): (&Question, &CampaignFinding)| {
        let first = found.taken.first().map(|taken| taken.name.as_str());
        question.first.is_none() || question.first == first
    };
    QUESTIONS.iter().zip(found).all(named)
        && hardware
            .iter()
            .all(|row| !row.is_normal || !row.found.change.is_seen())
}

fn row((question, found): (&Question, &CampaignFinding)) -> Vec<String> {
    let named = found.finding.effects.iter().zip(&found.taken);
    let named: Vec<String> = named
        .map(|(effect, taken)| {
            let (gain, error) = (taken.gain, taken.gain_error);
            let r2 = taken.r2_gained.map_or(String::new(), |[low, r2, high]| {
                format!(", R² {r2:+.3} ({low:+.3} to {high:+.3})")
            });
            format!("{}; gain {gain:.0} ± {error:.0}{r2}", in_words(effect))
        })
        .collect();
    let is_here = |rows: &str| rows.starts_with(question.rows);
    let here = found.skills.iter().find(|skill| is_here(&skill.rows_where));
    let fit = here.or(found.skills.first()).map(|skill| {
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
    vec![
        format!("{}, {}", question.flights, found.flights),
        question.from.to_owned(),
        match named.is_empty() {
            true => "nothing".to_owned(),
            false => named.join("<br>"),
        },
        fit.unwrap_or_default(),
        format!("{} mN", milli(found.finding.held_out.noise_floor)),
    ]
}

/// `` `downwash`: f 0.982 (0.928 to 1.04) ``.
fn in_words(effect: &Effect) -> String {
    let number = |(name, estimate): (&String, &Estimate)| {
        let [value, low, high] = [estimate.value, estimate.low, estimate.high].map(figures);
        format!("{name} {value} ({low} to {high})")
    };
    let numbers = joined(effect.parameters.iter().map(number), ", ");
    let or = effect.alternatives.iter().map(|name| format!(" or {name}"));
    format!("`{}`{}: {numbers}", effect.name, joined(or, ""))
}

fn milli(newton: f64) -> String {
    format!("{:.1}", 1e3 * newton)
}

/// Changes that were seen, each in a row; those that were not, in one; and the normal flights.
fn changes(rows: &[HardwareRow]) -> Vec<Vec<String>> {
    let (normal, changed): (Vec<&HardwareRow>, Vec<&HardwareRow>) =
        rows.iter().partition(|row| row.is_normal);
    let floor = normal.iter().map(|row| largest(row)).fold(0.0, f64::max);
    let line = |what: &str, answer: &str, of: &[&HardwareRow]| {
        let said = of.iter().filter(|row| said(row) == answer);
        let [least, most] = range(of.iter().map(|row| 100.0 * largest(row)));
        let [low, high] = range(of.iter().map(|row| row.found.change.p_value));
        vec![
            format!("CrazyPAD, {what}, {}", of.len()),
            "the normal flights of the same drone".to_owned(),
            format!("{} of {}: {answer}", said.count(), of.len()),
            format!(
                "largest change of a motor's voltage {least:.1} to {most:.1} %, p-value of a normal flight {low:.3} to {high:.3}"
            ),
            format!("{:.1} %", 100.0 * floor),
        ]
    };
    let mut names: Vec<&str> = changed.iter().map(|row| change(&row.flight)).collect();
    let mut known = std::collections::BTreeSet::new();
    names.retain(|name| known.insert(*name));
    let mut lines = Vec::new();
    let (mut unseen, mut unseen_names) = (Vec::new(), Vec::new());
    for name in names {
        let is_of = |row: &&&HardwareRow| change(&row.flight) == name;
        let of: Vec<&HardwareRow> = changed.iter().filter(is_of).copied().collect();
        match of.iter().find(|row| row.found.change.is_seen()) {
            Some(first) => lines.push(line(&format!("`{name}`"), &said(first), &of)),
            None => {
                unseen_names.push(format!("`{name}`"));
                unseen.extend(of);
            }
        }
    }
    lines.push(line(&unseen_names.join(", "), "nothing", &unseen));
    let each = format!("`{NORMAL}`, each left out by turns");
    lines.push(line(&each, "nothing", &normal));
    lines
}

fn said(row: &HardwareRow) -> String {
    match row.found.change.is_seen() {
        false => "nothing".to_owned(),
        true => row.found.to_string(),
    }
}

/// Least and most.
fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, 0.0], |[least, most], value| {
        [least.min(value), most.max(value)]
    })
}

/// Largest change of a motor's voltage.
fn largest(row: &HardwareRow) -> f64 {
    let changes = row.found.change.motors.iter().map(|change| change.abs());
    changes.fold(0.0, f64::max)
}

/// What was done to the drone, as its flights are called: all before the drone's own mark.
fn change(flight: &str) -> &str {
    flight.split("__").next().unwrap_or(flight)
}
