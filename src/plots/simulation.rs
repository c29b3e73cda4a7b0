//! The figures of a simulation, by channel: fields, residuals and profiles below drones; receivers over time.

use airflow::Jet;
use diagnosis::calibrate::{self, Calibration, Options};
use diagnosis::forward::simulate::{Channel, Sample};
use diagnosis::record::baseline::Upper;
use diagnosis::record::recording::Recording;

use super::Figure;
use super::expansion::{self, Expansion, ExpansionSlice};
use super::profiles::{self, Profile, ProfileSeries, Words};
use super::readings::{Reading, radial_slices};
use super::receiver::{self, Trace};
use super::{field, residual_map};
use crate::report::words::{count, file_stem, quantity, unit};

/// Panels and points of the radial profiles.
const SLICES: usize = 6;
const BINS: usize = 14;

/// A recording and its samples, simulated.
type Simulated<'a> = (&'a Recording, &'a [Sample]);

/// Every figure that the samples allow, in the order of the report; `scatter_n` of an airframe: what its thrust map leaves (N).
pub(crate) fn draw(
    name: &str,
    all: &[Simulated],
    scatter_n: impl Fn(&str) -> Option<f64>,
) -> Vec<Figure> {
    let samples: Vec<Sample> = all
        .iter()
        .flat_map(|(_, samples)| *samples)
        .copied()
        .collect();
    let jet = all
        .first()
        .map_or_else(Jet::default, |(recording, _)| recording.jet);
    let mut figures = Vec::new();
    if samples
        .iter()
        .any(|sample| sample.channel == Channel::Speed)
    {
        speeds(name, all, &jet, &mut figures);
    }
    for channel in [Channel::Throttle, Channel::Power, Channel::VerticalForce] {
        if samples.iter().any(|sample| sample.channel == channel) {
            receivers(name, channel, all, &scatter_n, &jet, &mut figures);
        }
    }
    figures
}

/// Speeds over the U_H of the drone whose wake they were read in.
pub(crate) fn speed_readings(recording: &Recording, samples: &[Sample]) -> Vec<Reading> {
    let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
    let hover_mps: Vec<f64> = recording
        .vehicles
        .iter()
        .map(|vehicle| {
            let airframe = &vehicle.airframe;
            airframe.hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3)
        })
        .collect();
    let accuracy = |sample: &Sample| {
        recording.probes.as_ref().map_or(f64::INFINITY, |probes| {
            let instrument = &probes.instrument;
            instrument.accuracy_abs_mps + instrument.accuracy_rel * sample.simulated
        })
    };
    samples
        .iter()
        .filter(|sample| sample.channel == Channel::Speed)
        .filter_map(|sample| {
            let hover_mps = hover_mps[sample.place?.emitter];
            reading(sample, accuracy(sample), hover_mps)
        })
        .collect()
}

/// `None` outside every wake.
fn reading(sample: &Sample, accuracy: f64, over: f64) -> Option<Reading> {
    let place = sample.place?;
    Some(Reading {
        s_over_l: place.s_over_l,
        across_over_l: place.r_over_l.copysign(place.azimuth_rad.cos()),
        recorded: sample.recorded / over,
        simulated: sample.simulated / over,
        accuracy: accuracy / over,
    })
}

/// Airframes that blow, with their U_H: what turns the figures' speeds into m/s.
fn hover_speeds(all: &[Simulated]) -> String {
    let mut known: Vec<(String, f64)> = Vec::new();
    for (recording, _) in all {
        let density_kg_per_m3 = recording.environment.air.density_kg_per_m3();
        for vehicle in &recording.vehicles {
            let airframe = &vehicle.airframe;
            if known.iter().all(|(name, _)| name != airframe.name()) {
                let hover_mps =
                    airframe.hover_induced_velocity_mps(airframe.mass_kg(), density_kg_per_m3);
                known.push((airframe.name().to_owned(), hover_mps));
            }
        }
    }
    let each: Vec<String> = known
        .iter()
        .map(|(name, hover_mps)| format!("{name} {hover_mps:.2} m/s"))
        .collect();
    format!("U_H: {}", each.join(", "))
}

fn speeds(name: &str, all: &[Simulated], jet: &Jet, figures: &mut Vec<Figure>) {
    let readings: Vec<Reading> = all
        .iter()
        .flat_map(|(recording, samples)| speed_readings(recording, samples))
        .collect();
    let extrapolated = all
        .iter()
        .all(|(recording, _)| recording.baseline.upper == Upper::FarFieldExtrapolated);
    let hover = hover_speeds(all);
    let subtitle = format!("{}; {hover}", count(readings.len(), "reading", "readings"));
    let field = field::draw(
        &format!("Speed below the rotors: {name}"),
        &subtitle,
        &readings,
        jet,
        extrapolated,
    );
    figures.extend(field.map(|svg| Figure {
        name: "field".into(),
        svg,
        caption: "Medians of the readings in each cell, in the wake that blows hardest there, folded onto a plane through its axis: left of 0 lie readings on the side of negative x. \
                  Lines: where the axial speed of the simulated jet is 0.1, 0.25, 0.5 and 1 U_H, the same on both sides. Rows reach half-way to the next depth that was measured. Grey: no samples.".into(),
    }));
    let residuals = residual_map::draw(
        &format!("Residuals of the speed: {name}"),
        &subtitle,
        ("U_H", "the instrument's stated accuracy"),
        &readings,
        jet,
    );
    figures.extend(residuals.map(|svg| Figure {
        name: "residuals".into(),
        svg,
        caption: "Median of recorded minus simulated in each cell. Blue: less air was recorded than simulated; red: more; signs where it is more than the instrument may be off.".into(),
    }));
    let marks = [("recorded: median".to_owned(), false)];
    let words = Words {
        title: &format!("Radial profiles at several depths: {name}"),
        subtitle: &subtitle,
        x: "distance from the axis r / l",
        y: "speed / U_H",
        marks: &marks,
        curve: "simulated at the same samples: median",
    };
    let panels: Vec<Profile> = radial_slices(&readings, SLICES, BINS)
        .iter()
        .map(|slice| Profile {
            heading: format!("s = {:.1} to {:.1} l", slice.s_from, slice.s_to),
            series: vec![ProfileSeries {
                mark: 0,
                hollow: false,
                points: slice
                    .bins
                    .iter()
                    .map(|bin| (bin.r_over_l, bin.recorded))
                    .collect(),
            }],
            curve: slice
                .bins
                .iter()
                .map(|bin| (bin.r_over_l, bin.simulated))
                .collect(),
        })
        .collect();
    figures.extend(profiles::draw(&words, &panels).map(|svg| Figure {
        name: "profiles".into(),
        svg,
        caption: "As many readings in every panel, shallowest first. The band holds the middle 68 % of the recorded readings: turbulence, and the range of depths of the panel.".into(),
    }));
    figures.extend(expansion_of(name, all, jet, &hover));
}

/// Half-width and centreline of what was recorded, slice by slice, beside the jet of the simulation.
fn expansion_of(name: &str, all: &[Simulated], jet: &Jet, hover: &str) -> Option<Figure> {
    let recordings: Vec<Recording> = all
        .iter()
        .map(|(recording, _)| (*recording).clone())
        .collect();
    // Without enough hover below a single drone there are no slices to show.
    let found = calibrate::calibrate(&recordings, &Options::default()).ok()?;
    let svg = expansion::draw(&Expansion {
        title: &format!("Half-width and centreline against depth: {name}"),
        subtitle: &format!(
            "marks: slices of what was recorded, each fitted alone, with 95 % intervals; {hover}"
        ),
        drones: &drones(&found),
        slices: &slices(&found),
        jet: (jet, "simulated"),
        uncertainty: None,
        other: Some((&found.jet.jet(), "all slices together")),
    })?;
    Some(Figure {
        name: "expansion".into(),
        svg,
        caption: "The paper's expansion figure. The dashed curve is fitted to these recordings; `plan calibrate` says how well it is known.".into(),
    })
}

/// Names of the drones of a calibration, hollow where they are beside the fit.
pub(crate) fn drones(found: &Calibration) -> Vec<(String, bool)> {
    found
        .drones
        .iter()
        .map(|drone| (drone.airframe.clone(), !drone.in_fit))
        .collect()
}

/// Its slices that were fitted alone.
pub(crate) fn slices(found: &Calibration) -> Vec<ExpansionSlice> {
    let mut slices = Vec::new();
    for (drone, of) in found.drones.iter().enumerate() {
        for profile in &of.profiles {
            slices.extend(profile.fit.as_ref().map(|fit| ExpansionSlice {
                drone,
                s_over_l: profile.s_over_l,
                half_width_over_l: fit.half_width.value,
                centreline_over_u_h: fit.centreline.value,
                half_width_interval: Some((
                    fit.half_width.interval.low,
                    fit.half_width.interval.high,
                )),
                centreline_interval: Some((
                    fit.centreline.interval.low,
                    fit.centreline.interval.high,
                )),
            }));
        }
    }
    slices
}

fn receivers(
    name: &str,
    channel: Channel,
    all: &[Simulated],
    scatter_n: &dyn Fn(&str) -> Option<f64>,
    jet: &Jet,
    figures: &mut Vec<Figure>,
) {
    let (quantity, stem) = (quantity(channel), file_stem(channel));
    let mut traces = Vec::new();
    let mut readings = Vec::new();
    for (recording, samples) in all {
        for (index, vehicle) in recording.vehicles.iter().enumerate() {
            let of_vehicle: Vec<&Sample> = samples
                .iter()
                .filter(|sample| sample.channel == channel && sample.subject as usize == index)
                .collect();
            if of_vehicle.is_empty() {
                continue;
            }
            let scatter = match channel {
                Channel::VerticalForce => scatter_n(vehicle.airframe.name()),
                _ => None,
            };
            let scatter = scatter.unwrap_or(f64::INFINITY);
            // Where nobody blows there is nothing to tell apart.
            readings.extend(
                of_vehicle
                    .iter()
                    .filter(|sample| sample.air_mps != 0.0)
                    .filter_map(|sample| reading(sample, scatter, 1.0)),
            );
            traces.push(Trace {
                name: format!(
                    "{}, {} ({})",
                    recording.name,
                    vehicle.id,
                    vehicle.airframe.name()
                ),
                moments: of_vehicle
                    .iter()
                    .map(|sample| (sample.t_s, sample.recorded, sample.simulated))
                    .collect(),
            });
        }
    }
    let samples: usize = traces.iter().map(|trace| trace.moments.len()).sum();
    let subtitle = format!(
        "{} of {}; the drones that are simulated to meet most come first",
        count(samples, "sample", "samples"),
        count(traces.len(), "flight of a drone", "flights of drones")
    );
    let title = format!("Recorded and simulated {quantity}: {name}");
    let shown = receiver::draw(&title, &subtitle, quantity, &traces);
    figures.extend(shown.map(|svg| Figure {
        name: stem.into(),
        svg,
        caption: "Left: over time. Right: every sample of every drone; one value in two thousand may lie beyond the frame.".into(),
    }));
    let accuracy = "what the thrust map leaves in free flight";
    let residuals = residual_map::draw(
        &format!("Residuals of the {quantity} below other drones: {name}"),
        &format!(
            "{} in somebody's wake",
            count(readings.len(), "sample", "samples")
        ),
        (unit(channel), accuracy),
        &readings,
        jet,
    );
    figures.extend(residuals.map(|svg| Figure {
        name: format!("{stem}-residuals"),
        svg,
        caption: "Median of recorded minus simulated in each cell, by the receiver's place in the wake that blows hardest there.".into(),
    }));
}
