//! The figures of `plan calibrate`: expansion, profiles in similarity coordinates, what the jet
//! leaves, and the near field.

use airflow::Jet;
use diagnosis::calibrate::{Calibration, DroneFit};
use diagnosis::forward::simulate::simulate;
use diagnosis::record::recording::{Recording, Vehicle};
use rayon::prelude::*;

use super::expansion::{self, Expansion};
use super::profiles::{self, Profile, Words};
use super::readings::{Reading, Spread};
use super::residual_map::ResidualMap;
use super::simulation::speed_readings;
use crate::report::sections::Figure;
use crate::report::words::{count, joined};

/// Distance over half-width that the profiles show: chosen here.
const WIDEST_XI: f64 = 4.0;

/// Every figure that the calibration allows, the expansion first.
pub(crate) fn draw(name: &str, found: &Calibration, recordings: &[Recording]) -> Vec<Figure> {
    let expansion = expansion::draw(&Expansion {
        title: (
            &format!("Half-width and centreline against depth: {name}"),
            "marks: each slice of each drone fitted alone, with 95 % intervals; curves: one jet for all drones without cant",
        ),
        found,
        jet: (&found.jet.jet(), "calibrated"),
        has_band: true,
        other: (&Jet::default(), "the paper"),
    });
    let title = format!("Near field: the rotors' jets merge: {name}");
    let slices = "two maxima fitted along the body's y axis, slice by slice, with 95 % intervals";
    let near_field = expansion::near_field((&title, slices), &found.drones);
    let figures = [
        Figure::of(
            "expansion",
            expansion,
            "The paper's expansion figure. Solid: the calibrated jet with the 95 % band of its constants; dashed: the paper's. Canted drones are hollow and not in the fit. A slice's own gain of the probe (5 % by its stated accuracy) moves its centreline up or down, not its half-width.",
        ),
        Figure::of(
            "profiles",
            profiles_of(name, found),
            "Medians per radius with the band of 16 to 84 % of the readings (one standard deviation). Nothing is subtracted: a speed probe also reads radial and ambient speed, so readings stand above the curve far out. Hollow: not in the fit.",
        ),
        Figure::of(
            "residuals",
            residuals_of(name, found, recordings),
            "Median of recorded minus simulated with the calibrated jet in each cell, as the recordings declare the simulation; the gain of the probe in single flights is not taken off.",
        ),
        Figure::of(
            "near-field",
            near_field,
            "Distance delta of the two maxima from the axis. Where it falls to the width of the maxima they are one.",
        ),
    ];
    figures.into_iter().flatten().collect()
}

fn profiles_of(name: &str, found: &Calibration) -> Option<String> {
    let jet = found.jet.jet();
    let drones = found.drones.iter();
    let panels: Vec<Profile> = drones.filter_map(|drone| panel(drone, &jet)).collect();
    let words = Words {
        title: (
            &format!("Radial profiles over the calibrated jet: {name}"),
            "each drone's far field, distances over r_half and speeds over U_C of the calibrated jet at that depth",
        ),
        x: "distance from the axis over half-width xi",
        y: "speed / U_C",
        marks: &["shallowest slice", "slice between", "deepest slice"],
        curve: "the jet's profile",
    };
    profiles::draw(&words, &panels)
}

/// Shallowest, middle and deepest far-field slice of a drone; `None` without any.
fn panel(drone: &DroneFit, jet: &Jet) -> Option<Profile> {
    let slices = drone.profiles.iter();
    let far: Vec<_> = slices.filter(|profile| profile.fit.is_some()).collect();
    let last = far.len().checked_sub(1)?;
    let mut chosen = vec![(0, far[0]), (1, far[last / 2]), (2, far[last])];
    chosen.dedup_by(|a, b| std::ptr::eq(a.1, b.1));
    let series = chosen.iter().map(|(mark, profile)| {
        let sigma = profile.s_over_l - jet.origin;
        let (half_width, centreline) = (jet.spreading * sigma, jet.centreline / sigma);
        let points = profile.bins.iter().map(|bin| {
            let part = |speed: f64| speed / centreline;
            let spread = Spread::new(part(bin.low), part(bin.median), part(bin.high));
            (bin.r_over_l / half_width, spread)
        });
        let shown = points.filter(|(xi, _)| *xi <= WIDEST_XI);
        ((*mark, !drone.in_fit), shown.collect())
    });
    let curve = (0..=60).map(|i| {
        let xi = WIDEST_XI * f64::from(i) / 60.0;
        let widening = 1.0 + (std::f64::consts::SQRT_2 - 1.0) * xi * xi;
        (xi, widening.powi(-2))
    });
    let depths = chosen.iter().map(|(_, profile)| profile.s_over_l);
    let depths = joined(depths.map(|s_over_l| format!("{s_over_l:.1}")), ", ");
    Some(Profile {
        heading: format!("{}, s/l = {depths}", drone.airframe),
        series: series.collect(),
        curve: curve.collect(),
    })
}

/// What the fitted jet leaves of the readings of the drones in the fit, through the same
/// observation operator.
fn residuals_of(name: &str, found: &Calibration, recordings: &[Recording]) -> Option<String> {
    let jet = found.jet.jet();
    let is_canted = |drone: &Vehicle| drone.airframe.fit_excludes();
    let is_used = |recording: &&Recording| !recording.vehicles.iter().any(is_canted);
    let readings = recordings.par_iter().filter(is_used).map(|recording| {
        let mut calibrated = recording.clone();
        calibrated.jet = jet;
        speed_readings(&calibrated, &simulate(&calibrated).samples)
    });
    let readings: Vec<Reading> = readings.collect::<Vec<_>>().concat();
    let title = format!("What the calibrated jet leaves: {name}");
    let number = count(readings.len(), "reading", "readings");
    let subtitle = format!("{number} below drones without cant");
    let unit = ("U_H", "the instrument's stated accuracy");
    ResidualMap::of_readings((&title, &subtitle), unit, &readings, &jet).draw()
}
