//! Simulations as people read them: what was compared, how far off it is, what was noticed.

use std::path::PathBuf;

use airflow::Superposition;
use diagnosis::forward::residuals::{Axis, Region};
use diagnosis::forward::simulate::Channel;
use diagnosis::record::baseline::{Baseline, Delay, Observation, ReceiverAir, ReceiverLaw, Upper};

use super::Simulated;
use super::forces::Map;
use crate::report::page::Table;
use crate::report::words::count;
pub(super) use crate::report::words::{file_stem, quantity};

/// More remarks of a kind than these are counted, not printed; residuals.json has all.
const REMARKS_OF_A_KIND: usize = 6;

/// What the columns of its table end in.
pub(super) fn suffix(channel: Channel) -> &'static str {
    match channel {
        Channel::Speed => "mps",
        Channel::Throttle | Channel::Power => "over_hover",
        Channel::VerticalForce => "n",
    }
}

/// `1 recording, 2 drones (kolibri, offboard-1), 1240 samples, 1240 s`.
pub(super) fn what(all: &[Simulated]) -> String {
    let mut airframes: Vec<&str> = Vec::new();
    let (mut drones, mut samples, mut duration_s) = (0, 0, 0.0);
    for one in all {
        drones += one.recording.vehicles.len();
        samples += one.samples.len();
        for vehicle in &one.recording.vehicles {
            if !airframes.contains(&vehicle.airframe.name()) {
                airframes.push(vehicle.airframe.name());
            }
        }
        let times = || one.samples.iter().map(|sample| sample.t_s);
        let span_s =
            times().fold(f64::NEG_INFINITY, f64::max) - times().fold(f64::INFINITY, f64::min);
        duration_s += span_s.max(0.0);
    }
    format!(
        "{}, {} ({}), {} over {duration_s:.0} s",
        count(all.len(), "recording", "recordings"),
        count(drones, "flight of a drone", "flights of drones"),
        airframes.join(", "),
        count(samples, "sample", "samples"),
    )
}

/// What "simulated" means for these recordings.
pub(super) fn baseline(all: &[Simulated]) -> String {
    let mut kinds: Vec<(&Baseline, usize)> = Vec::new();
    for one in all {
        let declared = &one.recording.baseline;
        match kinds.iter_mut().find(|(known, _)| *known == declared) {
            Some((_, recordings)) => *recordings += 1,
            None => kinds.push((declared, 1)),
        }
    }
    let sentences: Vec<String> = kinds
        .iter()
        .map(|(declared, recordings)| {
            let sentence = sentence(declared);
            if kinds.len() == 1 {
                sentence
            } else {
                format!(
                    "{}: {sentence}",
                    count(*recordings, "recording", "recordings")
                )
            }
        })
        .collect();
    format!("Simulated as declared: {}.", sentences.join("; "))
}

fn sentence(declared: &Baseline) -> String {
    if !declared.wakes {
        return "every drone flies alone, no wakes".into();
    }
    let sum = match declared.superposition {
        Superposition::Linear => "speeds of wakes add",
        Superposition::Momentum => "momentum of wakes adds",
        Superposition::Strongest => "the strongest wake alone",
    };
    let delay = match declared.delay {
        Delay::None => "no delay".to_owned(),
        Delay::Transport { convection } => {
            format!("air travels at {convection:.2} of the centreline's speed")
        }
    };
    let upper = match declared.upper {
        Upper::FarFieldExtrapolated => "the far field extrapolated above 2.5 l",
        Upper::FourRotors => "four rotor jets above 2.5 l",
    };
    let receiver = match (declared.receiver_air, declared.receiver_law) {
        (ReceiverAir::Centre, ReceiverLaw::HoldsThrust { .. }) => {
            "receivers hold thrust in the air at their centre"
        }
        (ReceiverAir::Centre, ReceiverLaw::HoldsPower) => {
            "receivers hold power in the air at their centre"
        }
        (ReceiverAir::DiscMean, ReceiverLaw::HoldsThrust { .. }) => {
            "receivers hold thrust in the mean air of their discs"
        }
        (ReceiverAir::DiscMean, ReceiverLaw::HoldsPower) => {
            "receivers hold power in the mean air of their discs"
        }
    };
    let observation = match declared.observation {
        Observation::AxialAndAmbient => "probes read axial and ambient speed in quadrature",
        Observation::VelocityAndAmbient => {
            "probes read axial, radial and ambient speed in quadrature"
        }
    };
    [sum, &delay, upper, receiver, observation].join(", ")
}

/// One table for all channels: everywhere first, then along each coordinate.
pub(super) fn region_table(regions: &[Region]) -> Table {
    let heading = [
        "",
        "samples",
        "bias",
        "rms",
        "recorded rms",
        "rms / accuracy",
    ];
    let mut table = Table {
        headings: heading.map(str::to_owned).to_vec(),
        rows: Vec::new(),
    };
    let mut last: Option<(Channel, Option<Axis>)> = None;
    for region in regions {
        let now = (region.channel, region.axis);
        if last != Some(now) {
            table.rows.push(vec![match region.axis {
                None => quantity(region.channel).to_owned(),
                Some(axis) => axis.label().to_owned(),
            }]);
            last = Some(now);
        }
        let within = match region.interval {
            None => "  everywhere".to_owned(),
            Some((from, to)) if to.is_finite() => format!("  {} to {}", edge(from), edge(to)),
            Some((from, _)) => format!("  from {}", edge(from)),
        };
        let accuracy = region
            .rms_over_accuracy
            .map_or(String::new(), |ratio| format!("{ratio:.2}"));
        table.rows.push(vec![
            within,
            region.samples.to_string(),
            format!("{:+.4}", region.bias),
            format!("{:.4}", region.rms),
            format!("{:.4}", region.recorded_rms),
            accuracy,
        ]);
    }
    table
}

fn edge(value: f64) -> String {
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Every remark with its recording; of many of a kind the first few and a count.
pub(super) fn remarks(all: &[Simulated]) -> Vec<String> {
    let mut found: Vec<_> = all
        .iter()
        .flat_map(|one| {
            let name = one.recording.name.as_str();
            one.remarks
                .iter()
                .map(move |remark| (remark.kind, name, remark))
        })
        .collect();
    found.sort_by_key(|(kind, ..)| *kind);
    let mut sentences = Vec::new();
    for of_kind in found.chunk_by(|a, b| a.0 == b.0) {
        for (_, name, remark) in of_kind.iter().take(REMARKS_OF_A_KIND) {
            let subject = remark
                .subject
                .as_ref()
                .map_or(String::new(), |of| format!(", {of}"));
            sentences.push(format!("{name}{subject}: {}", remark.message));
        }
        if of_kind.len() > REMARKS_OF_A_KIND {
            sentences.push(format!(
                "and {} more of the kind, see residuals.json",
                of_kind.len() - REMARKS_OF_A_KIND
            ));
        }
    }
    sentences
}

/// The report for the terminal.
pub(super) fn text(
    name: &str,
    all: &[Simulated],
    regions: &[Region],
    maps: &[Map],
    held_out: &str,
) -> String {
    let mut text = format!("{name}: {}\n{}\n\n", what(all), baseline(all));
    text += &region_table(regions).text();
    if !maps.is_empty() {
        text += "\n  thrust maps, identified in free flight\n";
        for map in maps {
            text += &format!("    {}\n", map.sentence());
        }
    }
    if !held_out.is_empty() {
        text += &format!("\n{held_out}");
    }
    let remarks = remarks(all);
    if !remarks.is_empty() {
        text += "\n  noticed\n";
        for remark in remarks {
            text += &format!("    {remark}\n");
        }
    }
    text
}

/// The last line of a report: what was written, the folder once.
pub(crate) fn wrote(files: &[PathBuf]) -> String {
    let name = |path: &PathBuf| {
        path.file_name()
            .map(|name| name.to_string_lossy().into_owned())
    };
    let Some((first, others)) = files.split_first() else {
        return String::new();
    };
    let others: Vec<String> = others.iter().filter_map(name).collect();
    format!("\nwrote {}  {}\n", first.display(), others.join("  "))
}
