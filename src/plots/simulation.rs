//! The figures of `plan simulate`, by channel: fields, residuals, profiles and expansion below
//! drones; receivers over time.

use airflow::Jet;
use diagnosis::calibrate::{self, Options};
use diagnosis::forward::simulate::{Channel, Sample};
use diagnosis::record::baseline::Upper;
use diagnosis::record::recording::{Recording, Vehicle};

use super::agreement::{self, Trace};
use super::expansion::{self, Expansion};
use super::field;
use super::profiles::{self, Words};
use super::readings::Reading;
use super::residual_map::ResidualMap;
use crate::report::sections::Figure;
use crate::report::words::{channel_words, count, joined};

/// Panels and points of the radial profiles: chosen here.
const SLICES: usize = 6;
const BINS: usize = 14;

type Simulated<'a> = (&'a Recording, &'a [Sample]);

/// Every figure that the samples allow, in the order of the report; `scatter_n` of a vehicle:
/// what its thrust map leaves (N).
pub(crate) fn draw(
    name: &str,
    all: &[Simulated],
    scatter_n: impl Fn(&Vehicle) -> Option<f64>,
) -> Vec<Figure> {
    let mut figures = Vec::from(speeds(name, all));
    for channel in [Channel::Throttle, Channel::Power, Channel::VerticalForce] {
        figures.extend(receivers(name, channel, all, &scatter_n));
    }
    figures.into_iter().flatten().collect()
}

/// The jet of the simulation.
fn jet_of(all: &[Simulated]) -> Jet {
    let jet = all.first().map(|(recording, _)| recording.jet);
    jet.unwrap_or_default()
}

/// U_H (m/s) of a drone.
fn hover_mps(recording: &Recording, vehicle: &Vehicle) -> f64 {
    let airframe = &vehicle.airframe;
    let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
    airframe.hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3)
}

/// Speeds over the U_H of the drone whose wake they were read in.
pub(super) fn speed_readings(recording: &Recording, samples: &[Sample]) -> Vec<Reading> {
    let accuracy = |sample: &Sample| {
        recording.probes.as_ref().map_or(f64::INFINITY, |probes| {
            let instrument = &probes.instrument;
            instrument.accuracy_abs_mps + instrument.accuracy_rel * sample.simulated
        })
    };
    let reading = |sample: &Sample| {
        let emitter = &recording.vehicles[sample.place?.emitter];
        Reading::of(sample, accuracy(sample), hover_mps(recording, emitter))
    };
    let speeds = samples.iter().filter(|it| it.channel == Channel::Speed);
    speeds.filter_map(reading).collect()
}

/// Airframes with their U_H: what turns the figures' speeds into m/s.
fn hover_speeds(all: &[Simulated]) -> String {
    let mut each: Vec<(&str, f64)> = Vec::new();
    for (recording, _) in all {
        for vehicle in &recording.vehicles {
            let name = vehicle.airframe.name();
            if each.iter().all(|(known, _)| *known != name) {
                each.push((name, hover_mps(recording, vehicle)));
            }
        }
    }
    let words = each
        .iter()
        .map(|(name, speed_mps)| format!("{name} {speed_mps:.2} m/s"));
    format!("U_H: {}", joined(words, ", "))
}

fn speeds(name: &str, all: &[Simulated]) -> [Option<Figure>; 4] {
    let of_each = all
        .iter()
        .map(|(recording, samples)| speed_readings(recording, samples));
    let readings = of_each.collect::<Vec<_>>().concat();
    let are_extrapolated = all
        .iter()
        .all(|(recording, _)| recording.baseline.upper == Upper::FarFieldExtrapolated);
    let jet = jet_of(all);
    let hover = hover_speeds(all);
    let subtitle = &format!("{}; {hover}", count(readings.len(), "reading", "readings"));
    let title = |what: &str| format!("{what}: {name}");
    let of_field = title("Speed below the rotors");
    let of_residuals = title("Residuals of the speed");
    let unit = ("U_H", "the instrument's stated accuracy");
    let words = Words {
        title: (&title("Radial profiles at several depths"), subtitle),
        x: "distance from the axis r / l",
        y: "speed / U_H",
        marks: &["recorded: median"],
        curve: "simulated at the same samples: median",
    };
    let panels = profiles::of_slices(&readings, SLICES, BINS);
    [
        Figure::of(
            "field",
            field::draw((&of_field, subtitle), &readings, &jet, are_extrapolated),
            "Medians of the readings in each cell, in the strongest wake there, folded onto a plane through its axis: left of 0 lie readings on the side of negative x. \
             Lines: where the axial speed of the simulated jet is 0.1, 0.25, 0.5 and 1 U_H, the same on both sides. Rows reach half-way to the next depth that was measured. Grey: no samples.",
        ),
        Figure::of(
            "residuals",
            ResidualMap::of_readings((&of_residuals, subtitle), unit, &readings, &jet).draw(),
            "Median of recorded minus simulated in each cell. Blue: less air was recorded than simulated; red: more; signs where it is more than the instrument may be off.",
        ),
        Figure::of(
            "profiles",
            profiles::draw(&words, &panels),
            "As many readings in every panel, shallowest first. The band holds the middle 68 % of the recorded readings: turbulence, and the range of depths of the panel.",
        ),
        Figure::of(
            "expansion",
            expansion_of(name, all, &jet, &hover),
            "The paper's expansion figure. The dashed curve is fitted to these recordings; `plan calibrate` says how well it is known.",
        ),
    ]
}

/// Half-width and centreline of what was recorded, slice by slice, beside the jet of the
/// simulation.
fn expansion_of(name: &str, all: &[Simulated], jet: &Jet, hover: &str) -> Option<String> {
    let recordings = all.iter().map(|(recording, _)| (*recording).clone());
    let recordings: Vec<Recording> = recordings.collect();
    // Without enough hover below a single drone there are no slices to show.
    let found = calibrate::calibrate(&recordings, &Options::default()).ok()?;
    let title = format!("Half-width and centreline against depth: {name}");
    let subtitle = format!(
        "marks: slices of what was recorded, each fitted alone, with 95 % intervals; {hover}"
    );
    expansion::draw(&Expansion {
        title: (&title, &subtitle),
        found: &found,
        jet: (jet, "simulated"),
        has_band: false,
        other: (&found.jet.jet(), "all slices together"),
    })
}

fn receivers(
    name: &str,
    channel: Channel,
    all: &[Simulated],
    scatter_n: &dyn Fn(&Vehicle) -> Option<f64>,
) -> [Option<Figure>; 2] {
    let (mut traces, mut readings) = (Vec::new(), Vec::new());
    for (recording, samples) in all {
        for (index, vehicle) in recording.vehicles.iter().enumerate() {
            let is_here = |it: &&Sample| it.channel == channel && it.subject as usize == index;
            let samples: Vec<&Sample> = samples.iter().filter(is_here).collect();
            if samples.is_empty() {
                continue;
            }
            let airframe = vehicle.airframe.name();
            let scatter_n = scatter_n(vehicle).filter(|_| channel == Channel::VerticalForce);
            let scatter = scatter_n.unwrap_or(f64::INFINITY);
            // Outside all wakes there is nothing to tell apart.
            let exposed = samples.iter().filter(|sample| sample.air_mps != 0.0);
            readings.extend(exposed.filter_map(|sample| Reading::of(sample, scatter, 1.0)));
            let name = format!("{}, {} ({airframe})", recording.name, vehicle.id);
            traces.push(Trace { name, samples });
        }
    }
    let words = channel_words(channel);
    let (quantity, stem) = (words.quantity, words.file_stem);
    let samples: usize = traces.iter().map(|trace| trace.samples.len()).sum();
    let title = format!("Recorded and simulated {quantity}: {name}");
    let subtitle = format!(
        "{} of {}; the drones whose simulated values vary most come first",
        count(samples, "sample", "samples"),
        count(traces.len(), "flight of a drone", "flights of drones")
    );
    let over_time = agreement::over_time((&title, &subtitle), quantity, &traces);
    let jet = jet_of(all);
    let title = format!("Residuals of the {quantity} below other drones: {name}");
    let number = count(readings.len(), "sample", "samples");
    let subtitle = format!("{number} in the wake of another drone");
    let unit = (words.unit, "the scatter in free flight");
    let residuals = ResidualMap::of_readings((&title, &subtitle), unit, &readings, &jet).draw();
    [
        Figure::of(
            stem,
            over_time,
            "Left: over time. Right: every sample of every drone; one value in two thousand may lie beyond the frame.",
        ),
        Figure::of(
            &format!("{stem}-residuals"),
            residuals,
            "Median of recorded minus simulated in each cell, by the receiver's place in the strongest wake there.",
        ),
    ]
}
