//! The sections of a report on a finding: where, what, candidates, fit, doubts, and what would have been noticed.

use diagnosis::forward::simulate::Channel;
use diagnosis::infer::candidates::Kind;
use diagnosis::infer::finding::Verdict;
use diagnosis::infer::finding::{Effect, Finding, HeldOut, Ranked, Smallest};
use diagnosis::infer::outside::Shape;

use super::words::{amount, figures};
use crate::report::page::Table;

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
    let size = amount(region.mean_error.abs(), finding.channel);
    // A force has both signs: a share of its mean says nothing.
    let by = match finding.channel {
        Channel::VerticalForce => format!("too {direction} by {size} in the mean (up is positive)"),
        _ => format!(
            "{:.1} % too {direction} in the mean ({size})",
            100.0 * region.relative_error.abs()
        ),
    };
    format!(
        "There the simulation is {by}; its error is {:.1} times the noise. Chance of as much structure in noise alone: {}.",
        region.error_over_noise,
        chance(finding.chance)
    )
}

/// A probability; below a ten-thousandth only that it is.
fn chance(p: f64) -> String {
    if p < 1e-4 {
        "below 0.0001".into()
    } else if p < 0.01 {
        format!("{p:.4}")
    } else {
        format!("{p:.2}")
    }
}

fn what_is_missing(finding: &Finding) -> Vec<Part> {
    let mut parts = Vec::new();
    if let Some(shape) = &finding.shape {
        parts.extend(outside(shape).into_iter().map(Part::Line));
    }
    for effect in &finding.effects {
        parts.push(Part::Line(format!("{}: {}.", effect.name, effect.story)));
        parts.push(Part::Line(effect.equation.clone()));
        parts.push(Part::Table(parameters(effect)));
    }
    parts
}

/// Something without a name, in sentences.
fn outside(shape: &Shape) -> Vec<String> {
    let mut lines = vec![
        "No effect of the library, alone or with another, predicts this on blocks that were not fitted; something else that repeats does.".to_owned(),
    ];
    if let Some(period_s) = shape.period_s {
        lines.push(format!(
            "It pulsates with a period of {} s, on the clock of the air's release.",
            figures(period_s)
        ));
        return lines;
    }
    let on: Vec<String> = shape
        .depends_on
        .iter()
        .filter(|(_, share)| *share >= 0.005)
        .map(|(name, share)| format!("{name} ({:.0} %)", 100.0 * share))
        .collect();
    lines.push(format!("It depends on {}.", on.join(", ")));
    lines.push(match &shape.expression {
        Some(expression) => format!(
            "In short: {expression}, which explains {:.0} % of what can be predicted of it.",
            100.0 * shape.expression_share
        ),
        None => "No short expression predicts it.".to_owned(),
    });
    if let Some((name, share)) = &shape.nearest {
        lines.push(format!(
            "Nearest in the library: {name}, which explains {:.0} % of it.",
            100.0 * share
        ));
    }
    lines.push(
        "The correction that is drawn here holds where samples were taken and nowhere else; it cannot be flown."
            .to_owned(),
    );
    lines
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
        Part::Line(format!(
            "Gain: log likelihood of {} that were not fitted, over that of the simulation as it is.",
            parts_of(finding.channel)
        )),
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
    let amount = |value: f64| amount(value, finding.channel);
    format!(
        "rms error on {} that were not fitted: {} before, {} after ({} to {}); noise floor {}.",
        parts_of(finding.channel),
        amount(rms_before),
        amount(rms_after),
        amount(rms_after_low),
        amount(rms_after_high),
        amount(noise_floor)
    )
}

/// What is held out together: forces are judged over whole flights.
fn parts_of(channel: Channel) -> &'static str {
    match channel {
        Channel::VerticalForce => "flights",
        _ => "blocks",
    }
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
    if let (Some(perhaps), [effect, ..]) = (&finding.perhaps, finding.effects.as_slice()) {
        parts.push(Part::Line(format!(
            "Beside {}, {} would gain {:.1} +- {:.1} more on held-out blocks: too small a part of the whole to be told from an error in the form of the first, so it is not taken.",
            effect.name, perhaps.name, perhaps.gain, perhaps.gain_error
        )));
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

fn measured(value: f64, unit: &str) -> String {
    match unit {
        "1" | "" => figures(value),
        unit => format!("{} {unit}", figures(value)),
    }
}
