//! Findings as people read them: where, what, how surely, and what to do next.

use diagnosis::candidates::Kind;
use diagnosis::finding::{Effect, Finding, HeldOut, Ranked, Smallest};
use diagnosis::prove::Verdict;
use diagnosis::recording::{Recording, Role};
use diagnosis::simulate::Channel;

use crate::page::Table;
use crate::wording::count;

/// Candidates shown at a terminal; the report and the JSON have all.
const SHOWN: usize = 8;
/// Columns of the smallest effects at a terminal.
const COLUMNS: usize = 2;

/// A heading with what stands below it, for the terminal and for the report.
pub(super) struct Section {
    pub(super) heading: &'static str,
    pub(super) parts: Vec<Part>,
    /// Name of the figure that belongs here.
    pub(super) figure: &'static str,
}

pub(super) enum Part {
    Line(String),
    Steps(Vec<String>),
    Table(Table),
}

/// The answer in a line.
pub(super) fn verdict(finding: &Finding) -> String {
    let first: Vec<&str> = finding
        .effects
        .iter()
        .map(|effect| effect.name.as_str())
        .collect();
    let first = first.join(" and ");
    match finding.verdict {
        Verdict::None => "no mismatch above noise".into(),
        Verdict::Library => format!("{first}, {}", explained(&finding.held_out)),
        Verdict::Ambiguous => {
            let or = finding.effects.iter().map(|effect| {
                let all = [&[effect.name.clone()], effect.alternatives.as_slice()].concat();
                all.join(" or ")
            });
            let or: Vec<String> = or.collect();
            format!("{}: the recording cannot tell", or.join("; and "))
        }
        Verdict::OutsideLibrary if first.is_empty() => {
            "a mismatch that no candidate explains".into()
        }
        Verdict::OutsideLibrary => format!("{first}, and a mismatch that no candidate explains"),
    }
}

/// `1240 readings of 1 probe below 1 drone (offboard-2), 1240 s`.
pub(super) fn what(recording: &Recording, finding: &Finding) -> String {
    let is_emitter = |role: Role| role != Role::Receiver;
    let mut emitters: Vec<&str> = Vec::new();
    let mut drones = 0;
    for vehicle in recording.vehicles.iter().filter(|v| is_emitter(v.role)) {
        drones += 1;
        if !emitters.contains(&vehicle.airframe.name()) {
            emitters.push(vehicle.airframe.name());
        }
    }
    let below = format!(
        "below {} ({})",
        count(drones, "drone", "drones"),
        emitters.join(", ")
    );
    let samples = finding.samples;
    match finding.channel {
        Channel::Speed => {
            let probes = recording.probes.iter().flat_map(|probes| &probes.samples);
            let mut ids: Vec<u32> = probes.map(|sample| sample.probe_id).collect();
            ids.sort_unstable();
            ids.dedup();
            format!(
                "{} of {} {below}",
                count(samples, "reading", "readings"),
                count(ids.len(), "probe", "probes")
            )
        }
        channel => format!(
            "{samples} values of a receiver's {} {below}",
            quantity(channel)
        ),
    }
}

fn quantity(channel: Channel) -> &'static str {
    match channel {
        Channel::Speed => "speed",
        Channel::Throttle => "throttle over hover",
        Channel::Power => "power over hover",
        Channel::VerticalForce => "vertical force",
    }
}

/// With the space before it; ratios have none.
pub(super) fn unit(channel: Channel) -> &'static str {
    match channel {
        Channel::Speed => " m/s",
        Channel::Throttle | Channel::Power => "",
        Channel::VerticalForce => " N",
    }
}

/// Three figures, never fewer than the whole number.
pub(super) fn figures(value: f64) -> String {
    let size = value.abs();
    if !value.is_finite() {
        return "unknown".into();
    }
    let text = if size >= 100.0 {
        format!("{value:.0}")
    } else if size >= 10.0 {
        format!("{value:.1}")
    } else if size >= 1.0 {
        format!("{value:.2}")
    } else {
        format!("{value:.3}")
    };
    if text
        .trim_start_matches('-')
        .chars()
        .all(|c| "0.".contains(c))
    {
        "0".into()
    } else {
        text
    }
}

fn measured(value: f64, unit: &str) -> String {
    match unit {
        "1" | "" => figures(value),
        unit => format!("{} {unit}", figures(value)),
    }
}

/// Everything that the report says, in its order; `all` candidates or the first few.
pub(super) fn sections(finding: &Finding, all: bool) -> Vec<Section> {
    let mut sections = Vec::new();
    let mut add = |heading, figure, parts| {
        sections.push(Section {
            heading,
            parts,
            figure,
        });
    };
    if finding.verdict == Verdict::None {
        add("WHERE", "residuals", vec![Part::Line(
            "Nowhere: what is left of recorded minus simulated is noise, and what the instrument's maker allows.".into(),
        )]);
        add(
            "WHAT",
            "signature",
            vec![Part::Line(
                "Nothing is missing that would show here.".into(),
            )],
        );
    } else {
        add(
            "WHERE",
            "residuals",
            vec![Part::Line(place(finding)), Part::Line(error(finding))],
        );
        add("WHAT", "signature", what_is_missing(finding));
    }
    add("CANDIDATES", "", candidates(finding, all));
    add("FIT", "agreement", vec![Part::Line(fit(finding))]);
    add("NOT SURE ABOUT", "", not_sure(finding));
    add("SMALLEST", "", smallest(&finding.smallest, all));
    sections
}

fn place(finding: &Finding) -> String {
    let region = &finding.region;
    format!(
        "{}: {} of {} samples, {:.0} %.",
        region.description,
        region.sample_indices.len(),
        finding.samples,
        100.0 * region.share
    )
}

fn error(finding: &Finding) -> String {
    let region = &finding.region;
    let direction = if region.mean_error < 0.0 {
        "high"
    } else {
        "low"
    };
    format!(
        "There the simulation is {:.1} % too {direction} in the mean ({}{}); its error is {:.1} times the noise.",
        100.0 * region.relative_error.abs(),
        figures(region.mean_error.abs()),
        unit(finding.channel),
        region.error_over_noise
    )
}

fn what_is_missing(finding: &Finding) -> Vec<Part> {
    let mut parts = Vec::new();
    if finding.verdict == Verdict::OutsideLibrary {
        parts.push(Part::Line(
            "No candidate, and no two of them, predict what is left on blocks that were not fitted.".into(),
        ));
    }
    for effect in &finding.effects {
        parts.push(Part::Line(format!("{}: {}.", effect.name, effect.story)));
        parts.push(Part::Line(effect.equation.clone()));
        parts.push(Part::Table(parameters(effect)));
    }
    parts
}

fn parameters(effect: &Effect) -> Table {
    let rows = effect.parameters.iter().map(|(name, estimate)| {
        let interval = if estimate.low < estimate.high {
            format!("{} to {}", figures(estimate.low), figures(estimate.high))
        } else {
            String::new()
        };
        vec![
            format!("  {name}"),
            measured(estimate.value, &estimate.unit),
            interval,
        ]
    });
    Table {
        headings: ["", "value", "95 %"].map(str::to_owned).to_vec(),
        rows: rows.collect(),
    }
}

fn candidates(finding: &Finding, all: bool) -> Vec<Part> {
    let shown = if all { usize::MAX } else { SHOWN };
    let taken = |name: &str| finding.effects.iter().any(|effect| effect.name == name);
    let row = |ranked: &Ranked| {
        let values: Vec<String> = ranked
            .parameters
            .iter()
            .map(|(name, value)| format!("{name} {}", figures(*value)))
            .collect();
        let mark = match (taken(&ranked.name), ranked.practical) {
            (true, _) => "taken",
            (false, true) => "",
            (false, false) => "too small to matter",
        };
        vec![
            ranked.name.clone(),
            format!("{:+.1}", ranked.gain),
            format!("{:.1}", ranked.gain_error),
            values.join("  "),
            mark.to_owned(),
        ]
    };
    let headings = ["each alone", "gain", "+-", "fitted", ""];
    let table = Table {
        headings: headings.map(str::to_owned).to_vec(),
        rows: finding.candidates.iter().take(shown).map(row).collect(),
    };
    let mut parts = vec![
        Part::Line(
            "Gain: log likelihood of blocks that were not fitted, over that of the simulation as it is.".into(),
        ),
        Part::Table(table),
    ];
    let more = finding.candidates.len().saturating_sub(shown);
    if more > 0 {
        parts.push(Part::Line(format!("and {more} more: see the report.")));
    }
    parts
}

fn fit(finding: &Finding) -> String {
    let HeldOut {
        rms_before,
        rms_after,
        rms_after_low,
        rms_after_high,
        noise_floor,
    } = finding.held_out;
    let unit = unit(finding.channel);
    format!(
        "rms error on blocks that were not fitted: {}{unit} before, {}{unit} after ({} to {}); noise floor {}{unit}.",
        figures(rms_before),
        figures(rms_after),
        figures(rms_after_low),
        figures(rms_after_high),
        figures(noise_floor)
    )
}

/// How much of the error that noise does not make is gone.
fn explained(held_out: &HeldOut) -> String {
    let above = |rms: f64| (rms * rms - held_out.noise_floor * held_out.noise_floor).max(0.0);
    let before = above(held_out.rms_before);
    if before <= 0.0 {
        return "within the noise".into();
    }
    let share = (1.0 - above(held_out.rms_after) / before).clamp(0.0, 1.0);
    format!(
        "which explains {:.0} % of the error above noise",
        100.0 * share
    )
}

fn not_sure(finding: &Finding) -> Vec<Part> {
    let mut parts = Vec::new();
    for effect in &finding.effects {
        if effect.alternatives.is_empty() {
            continue;
        }
        let others = effect.alternatives.join(", ");
        parts.push(Part::Line(match effect.kind {
            Some(Kind::Sensor) => format!(
                "An instrument that does what {} says explains this as well as {others}: check the instrument first.",
                effect.name
            ),
            _ => format!("{} cannot be told from {others} here.", effect.name),
        }));
    }
    if parts.is_empty() {
        parts.push(Part::Line(match rival(finding) {
            Some(line) => line,
            None => "No rival is left to tell apart.".into(),
        }));
    }
    if !finding.advice.is_empty() {
        parts.push(Part::Line("To decide, measure:".into()));
        parts.push(Part::Steps(finding.advice.clone()));
    }
    parts
}

/// The best of those that were not taken, and how far behind it is.
fn rival(finding: &Finding) -> Option<String> {
    let [effect] = finding.effects.as_slice() else {
        return None;
    };
    let of = |name: &str| finding.candidates.iter().find(|c| c.name == name);
    let taken = of(&effect.name)?;
    let next = finding
        .candidates
        .iter()
        .filter(|c| c.practical && c.name != effect.name)
        .max_by(|a, b| a.gain.total_cmp(&b.gain))?;
    Some(format!(
        "The next best single, {}, gains {:.1} less.",
        next.name,
        taken.gain - next.gain
    ))
}

fn smallest(all: &[Smallest], in_rows: bool) -> Vec<Part> {
    let cells = |one: &Smallest| {
        [
            one.name.clone(),
            one.parameter.clone(),
            measured(one.departure, &one.unit),
        ]
    };
    let columns = if in_rows { 1 } else { COLUMNS };
    let headings = ["effect", "by", "smallest"].map(str::to_owned);
    let height = all.len().div_ceil(columns).max(1);
    let rows = (0..height.min(all.len())).map(|row| {
        let across = (0..columns).filter_map(|column| all.get(column * height + row));
        across.flat_map(cells).collect()
    });
    let table = Table {
        headings: std::iter::repeat_n(headings, columns).flatten().collect(),
        rows: rows.collect(),
    };
    vec![
        Part::Line("Each would have been noticed from this size on, alone (four times in five, at the 5 % level).".into()),
        Part::Table(table),
    ]
}

/// The report for the terminal.
pub(super) fn text(recording: &Recording, finding: &Finding) -> String {
    let mut text = format!(
        "{}: {}\n{}\n",
        recording.name,
        verdict(finding),
        what(recording, finding)
    );
    for section in sections(finding, false) {
        text += &format!("\n{}\n", section.heading);
        for part in &section.parts {
            match part {
                Part::Line(line) => text += &format!("  {line}\n"),
                Part::Steps(steps) => {
                    for (index, step) in steps.iter().enumerate() {
                        text += &format!("    {}. {step}\n", index + 1);
                    }
                }
                Part::Table(table) => text += &table.text(),
            }
        }
    }
    text
}

/// One line a recording.
pub(super) fn summary(found: &[(&Recording, Finding)]) -> String {
    let rows = found.iter().map(|(recording, finding)| {
        let held_out = &finding.held_out;
        let unit = unit(finding.channel);
        vec![
            recording.name.clone(),
            finding.samples.to_string(),
            finding.verdict.as_str().to_owned(),
            format!("{:.0} %", 100.0 * finding.region.share),
            format!("{}{unit}", figures(held_out.rms_before)),
            format!("{}{unit}", figures(held_out.rms_after)),
            format!("{}{unit}", figures(held_out.noise_floor)),
            names(finding),
        ]
    });
    let headings = [
        "recording",
        "samples",
        "verdict",
        "where",
        "before",
        "after",
        "noise",
        "what",
    ];
    let table = Table {
        headings: headings.map(str::to_owned).to_vec(),
        rows: rows.collect(),
    };
    let with = |verdict: Verdict| found.iter().filter(|(_, f)| f.verdict == verdict).count();
    format!(
        "{}\n  {}: {} with nothing missing, {} explained, {} ambiguous, {} unexplained\n  before, after: rms error on blocks that were not fitted\n",
        table.text(),
        count(found.len(), "recording", "recordings"),
        with(Verdict::None),
        with(Verdict::Library),
        with(Verdict::Ambiguous),
        with(Verdict::OutsideLibrary)
    )
}

/// `crossflow (or wake_tilt), payload_mass`.
fn names(finding: &Finding) -> String {
    let names = finding.effects.iter().map(|effect| {
        if effect.alternatives.is_empty() {
            effect.name.clone()
        } else {
            format!("{} (or {})", effect.name, effect.alternatives.join(", "))
        }
    });
    let names: Vec<String> = names.collect();
    names.join(", ")
}
