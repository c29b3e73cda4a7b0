//! Findings as people read them: where, what, how surely, and what to do next.

use diagnosis::forward::simulate::Channel;
use diagnosis::infer::finding::Verdict;
use diagnosis::infer::finding::{Finding, HeldOut};
use diagnosis::record::recording::{Recording, Role};

use super::sections::{Part, Section};
use crate::report::page::Table;
use crate::report::words::count;
pub(super) use crate::report::words::figures;

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

/// A value of a channel with its unit; forces on small drones in thousandths.
pub(super) fn amount(value: f64, channel: Channel) -> String {
    match channel {
        Channel::VerticalForce => format!("{:.1} mN", 1e3 * value),
        _ => format!("{}{}", figures(value), unit(channel)),
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

/// The report for the terminal.
pub(super) fn text(name: &str, what: &str, finding: &Finding, sections: &[Section]) -> String {
    let mut text = format!("{name}: {}\n{what}\n", verdict(finding));
    for section in sections {
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
