//! Simulations as people read them: what was compared, how far off it is, what was noticed.

use airflow::Superposition;
use diagnosis::forward::residuals::{Axis, Region};
use diagnosis::forward::simulate::Channel;
use diagnosis::record::baseline::{Baseline, Delay, Observation, ReceiverAir, ReceiverLaw, Upper};
use diagnosis::record::track::ThrustSource;
use diagnosis::thrust::maps::IdentifiedMap;

use super::simulated::{Printed, Simulated};
use super::skill::Skill;
use crate::commands::recordings::sentences;
use crate::report::sections::{Figure, Part, Report};
use crate::report::words::{channel_words, count, decimal, each_once, joined, tally};

/// What was compared, how, and how far off the simulation is.
pub(super) fn report(
    name: &str,
    all: &[Simulated],
    printed: &Printed,
    figures: Vec<Figure>,
) -> Report {
    let mut report = Report::new(
        format!("{name}: recorded and simulated"),
        what(all, printed),
    );
    let mut parts = vec![Part::Line(baseline(all))];
    parts.extend(figures.into_iter().map(Part::Figure));
    report.section("", parts);
    report.section(
        "Residuals by region",
        vec![
            Part::line("Recorded minus simulated: mean (bias), root mean square (rms), that of the recorded values for scale, and the rms over what the instrument's stated accuracy allows."),
            by_region(&printed.regions),
        ],
    );
    let maps = printed.thrust_maps.iter().map(map_words).collect();
    report.section("Thrust maps, identified in free flight", Part::list(maps));
    let held_out = printed
        .held_out
        .as_ref()
        .map(Skill::sentences)
        .unwrap_or_default();
    report.section(
        "Vertical force, whole flights held out",
        Part::list(held_out),
    );
    let remarks = sentences(&printed.remarks, "residuals.json");
    report.section("Remarks", Part::list(remarks));
    report
}

/// A thrust map, and how well it is known.
fn map_words(map: &IdentifiedMap) -> String {
    let found = &map.identification;
    let kind = match map.offset_only {
        true => "stated thrust map and an offset",
        false => "thrust map fitted",
    };
    let [low, high] = found.map.duty_range();
    let [least_v, most_v] = found.battery_range_v;
    let outside = format!("({} rows outside)", found.rows_outside);
    let (battery, range) = match map.source {
        ThrustSource::DutyCycle => (
            format!(", {:+.1} % thrust a volt", 100.0 * found.battery_per_v),
            format!(
                "duty cycles {low:.2} to {high:.2} {outside} and {least_v:.2} to {most_v:.2} V"
            ),
        ),
        ThrustSource::RotorSpeed => (
            String::new(),
            format!("tips of rotors at {low:.2} to {high:.2} of the speed of sound {outside}"),
        ),
        ThrustSource::Thrust | ThrustSource::ReadyForce => {
            (String::new(), format!("thrust as logged {outside}"))
        }
    };
    format!(
        "{}: {kind}, {:+.4} N at rest, lag {:.0} ms{battery}; leaves {:.4} N rms of {} rows in {} flights; for {range}",
        map.airframe,
        found.offset_n,
        1000.0 * found.map.lag_s(),
        found.scatter_n,
        found.rows,
        found.flights,
    )
}

/// `1 recording, 2 drones (kolibri, offboard-1), 1240 samples, 1240 s`.
fn what(all: &[Simulated], printed: &Printed) -> String {
    let vehicles = || all.iter().flat_map(|one| &one.recording.vehicles);
    let span_s = |one: &Simulated| {
        let times = || one.samples.iter().map(|sample| sample.t_s);
        let last_s = times().fold(f64::NEG_INFINITY, f64::max);
        (last_s - times().fold(f64::INFINITY, f64::min)).max(0.0)
    };
    format!(
        "{}, {} ({}), {} over {:.0} s",
        count(all.len(), "recording", "recordings"),
        count(vehicles().count(), "flight of a drone", "flights of drones"),
        each_once(vehicles().map(|vehicle| vehicle.airframe.name())),
        count(printed.samples, "sample", "samples"),
        all.iter().map(span_s).sum::<f64>(),
    )
}

/// What "simulated" means for these recordings.
fn baseline(all: &[Simulated]) -> String {
    let kinds = tally(all.iter().map(|one| &one.recording.baseline));
    let sentences = kinds.iter().map(|(declared, number)| match kinds.len() {
        1 => sentence(declared),
        _ => {
            let recordings = count(*number, "recording", "recordings");
            format!("{recordings}: {}", sentence(declared))
        }
    });
    format!("Simulated as declared: {}.", joined(sentences, "; "))
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
        Delay::None => "quasi-static".to_owned(),
        Delay::Transport { convection } => {
            format!("wakes advected at {convection:.2} of the centreline's speed")
        }
    };
    let upper = match declared.upper {
        Upper::FarFieldExtrapolated => "the far field extrapolated above 2.5 l",
        Upper::FourRotors => "four rotor jets above 2.5 l",
    };
    let holds = match declared.receiver_law {
        ReceiverLaw::HoldsThrust { .. } => "thrust",
        ReceiverLaw::HoldsPower => "power",
    };
    let air = match declared.receiver_air {
        ReceiverAir::Centre => "the air at their centre",
        ReceiverAir::DiscMean => "the mean air of their discs",
    };
    let receiver = format!("receivers hold {holds} in {air}");
    let observation = match declared.observation {
        Observation::AxialAndAmbient => "probes read axial and ambient speed in quadrature",
        Observation::VelocityAndAmbient => {
            "probes read axial, radial and ambient speed in quadrature"
        }
    };
    [sum, &delay, upper, &receiver, observation].join(", ")
}

/// One table for all channels: everywhere first, then along each coordinate.
fn by_region(regions: &[Region]) -> Part {
    let mut rows = Vec::new();
    let mut last: Option<(Channel, Option<Axis>)> = None;
    for region in regions {
        let now = (region.channel, region.axis);
        if last != Some(now) {
            rows.push(vec![match region.axis {
                None => channel_words(region.channel).quantity.to_owned(),
                Some(axis) => axis.label().to_owned(),
            }]);
            last = Some(now);
        }
        let within = match region.interval {
            None => "  everywhere".to_owned(),
            Some((from, to)) => match [from, to].map(decimal) {
                [from, _] if to.is_infinite() => format!("  from {from}"),
                [from, to] if from == to => format!("  at {from}"),
                [from, to] => format!("  {from} to {to}"),
            },
        };
        let accuracy = region.rms_over_accuracy;
        let accuracy = accuracy.map_or(String::new(), |ratio| format!("{ratio:.2}"));
        rows.push(vec![
            within,
            region.samples.to_string(),
            format!("{:+.4}", region.bias),
            format!("{:.4}", region.rms),
            format!("{:.4}", region.recorded_rms),
            accuracy,
        ]);
    }
    let headings = " | samples | bias | rms | recorded rms | rms / accuracy";
    Part::table("lrrrrr", headings, rows)
}
