//! Radial profiles at several depths, all on the same axes: medians, the middle 68 %, and a curve.
//!
//! x: distance from the axis, over the motor distance or the half-width; y: speed over U_H or the
//! centreline's.

use diagnosis::statistics::quantile::quantile;

use super::axes::{BAND, Chart};
use super::canvas::{HEAD, fill, solid};
use super::colours::{INK, SERIES, series_colour};
use super::legend::{Entry, LINE, sheet};
use super::readings::{Reading, Spread, sorted};

const COLUMNS: usize = 3;
const WIDTH: f64 = 980.0;
const PANEL_HEIGHT: f64 = 240.0;

/// One panel.
#[derive(Clone, Debug)]
pub(super) struct Profile {
    pub(super) heading: String,
    pub(super) series: Vec<Series>,
    /// Rising in its first coordinate.
    pub(super) curve: Vec<(f64, f64)>,
}

/// What one drone, or one recording, contributes to a panel: the number of its mark, hollow where
/// it is beside the fit, and abscissas with their values, rising.
pub(super) type Series = ((usize, bool), Vec<(f64, Spread)>);

/// What the axes and the signs say.
#[derive(Clone, Copy, Debug)]
pub(super) struct Words<'a> {
    pub(super) title: (&'a str, &'a str),
    pub(super) x: &'a str,
    pub(super) y: &'a str,
    /// Of the marks, in the order of their numbers.
    pub(super) marks: &'a [&'a str],
    pub(super) curve: &'a str,
}

/// `None` without profiles.
pub(super) fn draw(words: &Words, profiles: &[Profile]) -> Option<String> {
    // All points that any panel has to hold.
    let mut ends: Vec<(f64, f64)> = vec![(0.1, 0.05)];
    for profile in profiles {
        let points = profile.series.iter().flat_map(|(_, points)| points);
        ends.extend(points.flat_map(|(x, spread)| [(*x, spread.low), (*x, spread.high)]));
        ends.extend(&profile.curve);
    }
    let x_to = ends.iter().map(|(x, _)| *x).fold(0.0, f64::max);
    let highest = ends.iter().map(|(_, y)| *y).fold(0.0, f64::max);
    let lowest = ends.iter().map(|(_, y)| *y).fold(0.0, f64::min);
    let x = (words.x, (0.0, 1.03 * x_to));
    let y = (words.y, (lowest, 1.05 * highest));
    let marks = words.marks.iter().enumerate();
    let marks = marks.map(|(series, name)| Entry::mark(series, false, name));
    let mut entries: Vec<Entry> = marks.collect();
    entries.push(Entry::band(SERIES[0], "middle 68 %"));
    entries.push(Entry::line(&solid(INK, 1.6), words.curve));
    let rows = profiles.len().div_ceil(COLUMNS);
    let height = HEAD + LINE + 8.0 + PANEL_HEIGHT * rows as f64;
    let (mut canvas, below) = sheet((WIDTH, height), words.title, &entries);
    for (panel, profile) in below.grid(rows, COLUMNS).into_iter().zip(profiles) {
        let chart = Chart::draw(&mut canvas, panel, &profile.heading, [x, y]);
        for ((mark, _), points) in &profile.series {
            chart.band(&mut canvas, points, &fill(series_colour(*mark), BAND));
        }
        chart.line(&mut canvas, profile.curve.iter().copied(), &solid(INK, 1.6));
        for (mark, points) in &profile.series {
            let medians = points.iter().map(|(x, spread)| (*x, spread.median));
            chart.marks(&mut canvas, medians, *mark, 2.6);
        }
    }
    (!profiles.is_empty()).then(|| canvas.finish())
}

/// Cuts readings into so many slices of as many readings each, shallowest first, and each slice
/// into bins of equal width. The curve is the median of the simulated values of the same readings.
pub(super) fn of_slices(readings: &[Reading], slices: usize, bins: usize) -> Vec<Profile> {
    let mut by_depth: Vec<&Reading> = readings.iter().collect();
    by_depth.sort_by(|a, b| a.s_over_l.total_cmp(&b.s_over_l));
    let slices = by_depth.chunks(by_depth.len().div_ceil(slices.max(1)).max(1));
    slices.map(|slice| of_slice(slice, bins)).collect()
}

fn of_slice(slice: &[&Reading], bins: usize) -> Profile {
    let r_over_l = |reading: &&Reading| reading.across_over_l.abs();
    let widest = quantile(&sorted(slice.iter().map(r_over_l)), 0.99);
    let widest = widest.unwrap_or_default().max(1e-6);
    let mut held: Vec<Vec<&Reading>> = vec![Vec::new(); bins];
    for reading in slice {
        let place = r_over_l(reading) / widest * bins as f64;
        if place <= bins as f64 {
            held[(place as usize).min(bins - 1)].push(reading);
        }
    }
    let (mut points, mut curve) = (Vec::new(), Vec::new());
    for bin in &held {
        let of = |value: fn(&Reading) -> f64| Spread::of(bin.iter().map(|reading| value(reading)));
        let r_over_l = of(|reading| reading.across_over_l.abs());
        let (recorded, simulated) = (of(|it| it.recorded), of(|it| it.simulated));
        if let (Some(r), Some(recorded), Some(simulated)) = (r_over_l, recorded, simulated) {
            points.push((r.median, recorded));
            curve.push((r.median, simulated.median));
        }
    }
    let ends = [slice.first(), slice.last()];
    let [from, to] = ends.map(|end| end.map_or(0.0, |reading| reading.s_over_l));
    Profile {
        heading: format!("s = {from:.1} to {to:.1} l"),
        series: vec![((0, false), points)],
        curve,
    }
}
