//! The figures of a calibration: expansion, profiles in similarity coordinates, residuals of the fit, near-field lobes.

use airflow::Jet;
use diagnosis::calibrate::{Calibration, DroneFit, FittedJet};
use diagnosis::forward::simulate::simulate;
use diagnosis::record::recording::Recording;
use rayon::prelude::*;

use super::Figure;
use super::expansion::{self, Expansion, Uncertainty};
use super::near_field::{self, Lobe};
use super::profiles::{self, Profile, ProfileSeries, Words};
use super::readings::{Reading, Spread};
use super::residual_map;
use super::simulation::{drones, slices, speed_readings};
use crate::report::words::count;

/// Distance over half-width that the profiles show.
const WIDEST_XI: f64 = 4.0;
/// Half a 95 % interval of a normal distribution over its standard deviation.
const HALF_95: f64 = 1.96;

/// The expansion figure first.
pub(crate) fn draw(name: &str, found: &Calibration, recordings: &[Recording]) -> Vec<Figure> {
    [
        expansion_of(name, found),
        profiles_of(name, found),
        residuals_of(name, found, recordings),
        lobes_of(name, found),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn uncertainty(jet: &FittedJet) -> Uncertainty {
    let correlation = &jet.correlation;
    Uncertainty {
        deviations: [jet.centreline, jet.spreading, jet.origin]
            .map(|estimate| (estimate.interval.high - estimate.interval.low) / (2.0 * HALF_95)),
        correlations: [
            correlation.centreline_spreading,
            correlation.centreline_origin,
            correlation.spreading_origin,
        ],
    }
}

fn expansion_of(name: &str, found: &Calibration) -> Option<Figure> {
    let svg = expansion::draw(&Expansion {
        title: &format!("Half-width and centreline against depth: {name}"),
        subtitle: "marks: each slice of each drone fitted alone, with 95 % intervals; curves: one jet for all drones without cant",
        drones: &drones(found),
        slices: &slices(found),
        jet: (&found.jet.jet(), "calibrated"),
        uncertainty: Some(&uncertainty(&found.jet)),
        other: Some((&Jet::default(), "the paper")),
    })?;
    Some(Figure {
        name: "expansion".into(),
        svg,
        caption: "The paper's expansion figure. Solid: the calibrated jet with the 95 % band of its constants; dashed: the paper's. Canted drones are hollow and not in the fit. A slice's own gain of the probe (5 % by its stated accuracy) moves its centreline up or down, not its half-width.".into(),
    })
}

fn profiles_of(name: &str, found: &Calibration) -> Option<Figure> {
    let jet = found.jet.jet();
    let panels: Vec<Profile> = found
        .drones
        .iter()
        .filter_map(|drone| panel(drone, &jet))
        .collect();
    let marks =
        ["shallowest slice", "slice between", "deepest slice"].map(|mark| (mark.to_owned(), false));
    let words = Words {
        title: &format!("Radial profiles over the calibrated jet: {name}"),
        subtitle: "each drone's far field, distances over r_half and speeds over U_C of the calibrated jet at that depth",
        x: "distance from the axis over half-width xi",
        y: "speed / U_C",
        marks: &marks,
        curve: "the jet's profile",
    };
    let svg = profiles::draw(&words, &panels)?;
    Some(Figure {
        name: "profiles".into(),
        svg,
        caption: "Medians per radius with the band of 16 to 84 % of the readings (one standard deviation). Nothing is subtracted: a speed probe also reads radial and ambient speed, so readings stand above the curve far out. Hollow: not in the fit.".into(),
    })
}

/// Shallowest, middle and deepest far-field slice of a drone; `None` without any.
fn panel(drone: &DroneFit, jet: &Jet) -> Option<Profile> {
    let far: Vec<_> = drone
        .profiles
        .iter()
        .filter(|profile| profile.fit.is_some())
        .collect();
    let last = far.len().checked_sub(1)?;
    let mut chosen = vec![(0, far[0]), (1, far[last / 2]), (2, far[last])];
    chosen.dedup_by(|a, b| std::ptr::eq(a.1, b.1));
    let series: Vec<ProfileSeries> = chosen
        .iter()
        .map(|(mark, profile)| {
            let sigma = profile.s_over_l - jet.origin;
            let (half_width, centreline) = (jet.spreading * sigma, jet.centreline / sigma);
            let points = profile.bins.iter().map(|bin| {
                let spread = Spread {
                    median: bin.median / centreline,
                    low: bin.low / centreline,
                    high: bin.high / centreline,
                };
                (bin.r_over_l / half_width, spread)
            });
            ProfileSeries {
                mark: *mark,
                hollow: !drone.in_fit,
                points: points.filter(|(xi, _)| *xi <= WIDEST_XI).collect(),
            }
        })
        .collect();
    let curve = (0..=60).map(|i| {
        let xi = WIDEST_XI * f64::from(i) / 60.0;
        (
            xi,
            (1.0 + (std::f64::consts::SQRT_2 - 1.0) * xi * xi).powi(-2),
        )
    });
    let depths: Vec<String> = chosen
        .iter()
        .map(|(_, profile)| format!("{:.1}", profile.s_over_l))
        .collect();
    Some(Profile {
        heading: format!("{}, s/l = {}", drone.airframe, depths.join(", ")),
        series,
        curve: curve.collect(),
    })
}

/// What the fitted jet leaves of the readings of the drones in the fit, through the same observation operator.
fn residuals_of(name: &str, found: &Calibration, recordings: &[Recording]) -> Option<Figure> {
    let jet = found.jet.jet();
    let readings: Vec<Vec<Reading>> = recordings
        .par_iter()
        .filter(|recording| {
            let mut vehicles = recording.vehicles.iter();
            vehicles.all(|vehicle| !vehicle.airframe.fit_excludes())
        })
        .map(|recording| {
            let mut calibrated = recording.clone();
            calibrated.jet = jet;
            let samples = simulate(&calibrated).samples;
            speed_readings(&calibrated, &samples)
        })
        .collect();
    let readings = readings.concat();
    let svg = residual_map::draw(
        &format!("What the calibrated jet leaves: {name}"),
        &format!(
            "{} below drones without cant",
            count(readings.len(), "reading", "readings")
        ),
        ("U_H", "the instrument's stated accuracy"),
        &readings,
        &jet,
    )?;
    Some(Figure {
        name: "residuals".into(),
        svg,
        caption: "Median of recorded minus simulated with the calibrated jet in each cell, as the recordings declare the simulation; the gain of the probe in single flights is not taken off.".into(),
    })
}

fn lobes_of(name: &str, found: &Calibration) -> Option<Figure> {
    let mut lobes = Vec::new();
    for (drone, of) in found.drones.iter().enumerate() {
        for lobe in &of.lobes {
            lobes.push(Lobe {
                drone,
                s_over_l: lobe.s_over_l,
                delta_over_l: lobe.delta.value,
                interval: Some((lobe.delta.interval.low, lobe.delta.interval.high)),
            });
        }
    }
    let svg = near_field::draw(
        &format!("Near field: the rotors' jets merge: {name}"),
        "two maxima fitted along the body's y axis, slice by slice, with 95 % intervals",
        &drones(found),
        &lobes,
    )?;
    Some(Figure {
        name: "near-field".into(),
        svg,
        caption: "Distance delta of the two maxima from the axis. Where it falls to the width of the maxima they are one.".into(),
    })
}
