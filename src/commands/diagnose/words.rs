//! Findings as people read them: where, what, how surely, and what to do next.

use diagnosis::forward::simulate::Channel;
use diagnosis::infer::candidates::Kind;
use diagnosis::infer::finding::{Effect, Finding, HeldOut, Ranked, Smallest, Verdict};
use diagnosis::infer::outside::Shape;
use diagnosis::record::recording::{Recording, Role};

use crate::report::words::{count, each_once, figures, quantity, unit};
use crate::report::{Figure, Part, Report, Table};

/// Candidates shown at a terminal; the page and the JSON have all.
const SHOWN: usize = 8;

/// Everything that is to be said of a finding: its figures stand with what they show.
pub(super) fn report(name: &str, what: String, finding: &Finding, drawn: Vec<Figure>) -> Report {
    let mut report = Report::new(format!("{name}: {}", verdict(finding)), what);
    let mut section = |heading, mut parts: Vec<Part>, figure| {
        let here = drawn.iter().find(|drawn| drawn.name == figure);
        parts.extend(here.cloned().map(Part::Figure));
        report.section(heading, parts);
    };
    section("Where", place(finding), "residuals");
    section("What", what_is_missing(finding), "signature");
    section("Candidates", candidates(finding), "");
    section("Fit", vec![Part::Line(fit(finding))], "agreement");
    section("Runners-up", runners_up(finding), "");
    section(
        "Minimum detectable effects",
        smallest(&finding.smallest),
        "",
    );
    report
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
                let all = [
                    std::slice::from_ref(&effect.name),
                    effect.alternatives.as_slice(),
                ]
                .concat();
                all.join(" or ")
            });
            let or: Vec<String> = or.collect();
            let who = match finding.channel {
                Channel::VerticalForce => "these flights",
                _ => "the recording",
            };
            format!("{}: {who} cannot tell", or.join("; and "))
        }
        Verdict::OutsideLibrary if first.is_empty() => {
            "a mismatch that no candidate explains".into()
        }
        Verdict::OutsideLibrary => format!("{first}, and a mismatch that no candidate explains"),
    }
}

/// `1240 readings of 1 probe below 1 drone (offboard-2), 1240 s`.
pub(super) fn what(recording: &Recording, finding: &Finding) -> String {
    let emitters = recording.vehicles.iter();
    let emitters = || emitters.clone().filter(|v| v.role != Role::Receiver);
    let below = format!(
        "below {} ({})",
        count(emitters().count(), "drone", "drones"),
        each_once(emitters().map(|vehicle| vehicle.airframe.name()))
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

/// A value of a channel with its unit; forces on small drones in thousandths.
pub(super) fn amount(value: f64, channel: Channel) -> String {
    match channel {
        Channel::VerticalForce => format!("{:.1} mN", 1e3 * value),
        _ => measured(value, unit(channel)),
    }
}

fn measured(value: f64, unit: &str) -> String {
    match unit {
        "1" | "" => figures(value),
        unit => format!("{} {unit}", figures(value)),
    }
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

/// One line a recording.
pub(super) fn summary(found: &[(&Recording, Finding)]) -> Report {
    let row = |(recording, finding): &(&Recording, Finding)| {
        let held_out = &finding.held_out;
        let amount = |value| amount(value, finding.channel);
        vec![
            recording.name.clone(),
            finding.samples.to_string(),
            finding.verdict.as_str().to_owned(),
            format!("{:.0} %", 100.0 * finding.region.share),
            amount(held_out.rms_before),
            amount(held_out.rms_after),
            amount(held_out.noise_floor),
            names(finding),
        ]
    };
    let with = |verdict: Verdict| found.iter().filter(|(_, f)| f.verdict == verdict).count();
    let title = format!(
        "{}: {} with nothing missing, {} explained, {} ambiguous, {} unexplained",
        count(found.len(), "recording", "recordings"),
        with(Verdict::None),
        with(Verdict::Library),
        with(Verdict::Ambiguous),
        with(Verdict::OutsideLibrary)
    );
    let mut report = Report::new(title, String::new());
    report.section(
        "",
        vec![
            Part::table(Table::new(
                "lrlrrrrl",
                "recording | samples | verdict | where | before | after | noise | what",
                found.iter().map(row).collect(),
            )),
            Part::Line("before, after: rms error on blocks that were not fitted".into()),
        ],
    );
    report
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

fn place(finding: &Finding) -> Vec<Part> {
    let region = &finding.region;
    let mut lines = match finding.verdict {
        Verdict::None => vec![
            "Nowhere: what is left of recorded minus simulated is noise, and what the instrument's maker allows.".to_owned(),
        ],
        _ => vec![
            format!(
                "{}: {} of {} samples, {:.0} %.",
                region.description,
                region.sample_indices.len(),
                finding.samples,
                100.0 * region.share
            ),
            error(finding),
        ],
    };
    lines.push(format!(
        "Global lack-of-fit test: p-value {}.",
        p_value(finding.chance)
    ));
    lines.into_iter().map(Part::Line).collect()
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
        "There the simulation is {by}; its error is {:.1} times the noise.",
        region.error_over_noise
    )
}

/// Below a ten-thousandth only that it is.
fn p_value(p: f64) -> String {
    match p {
        ..1e-4 => "below 0.0001".into(),
        ..0.01 => format!("{p:.4}"),
        _ => format!("{p:.2}"),
    }
}

fn what_is_missing(finding: &Finding) -> Vec<Part> {
    if finding.verdict == Verdict::None {
        let nothing = "Nothing is missing that would show here.";
        return vec![Part::Line(nothing.into())];
    }
    let mut parts = Vec::new();
    if let Some(shape) = &finding.shape {
        parts.extend(outside(shape).into_iter().map(Part::Line));
    }
    for effect in &finding.effects {
        parts.push(Part::Line(format!("{}: {}.", effect.name, effect.story)));
        parts.push(Part::Line(effect.equation.clone()));
        parts.push(Part::table(parameters(effect)));
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
        let interval = match estimate.low < estimate.high {
            true => format!("{} to {}", figures(estimate.low), figures(estimate.high)),
            false => String::new(),
        };
        vec![
            format!("  {name}"),
            measured(estimate.value, &estimate.unit),
            interval,
        ]
    });
    Table::new("lrr", " | value | 95 %", rows.collect())
}

fn candidates(finding: &Finding) -> Vec<Part> {
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
    vec![
        Part::Line(format!(
            "Gain: log likelihood of {} that were not fitted, over that of the simulation as it is.",
            parts_of(finding.channel)
        )),
        Part::Table {
            table: Table::new(
                "lrrll",
                "each alone | gain | +- | fitted |",
                finding.candidates.iter().map(row).collect(),
            ),
            on_screen: SHOWN,
        },
    ]
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

fn runners_up(finding: &Finding) -> Vec<Part> {
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
            "Runner-up beside {}: {} would gain {:.1} +- {:.1} more on held-out blocks, too small a part of the whole to be told from an error in the form of the first, so it is not taken.",
            effect.name, perhaps.name, perhaps.gain, perhaps.gain_error
        )));
    }
    if parts.is_empty() {
        let none = || "No runner-up is left to tell apart.".into();
        parts.push(Part::Line(rival(finding).unwrap_or_else(none)));
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
        "Runner-up: {}, alone, gains {:.1} less.",
        next.name,
        taken.gain - next.gain
    ))
}

fn smallest(all: &[Smallest]) -> Vec<Part> {
    let row = |one: &Smallest| {
        vec![
            one.name.clone(),
            one.parameter.clone(),
            measured(one.departure, &one.unit),
        ]
    };
    vec![
        Part::Line(
            "Each alone would have been detected from this size on (power 80 %, at the 5 % level)."
                .into(),
        ),
        Part::table(Table::new(
            "llr",
            "effect | by | at least",
            all.iter().map(row).collect(),
        )),
    ]
}
