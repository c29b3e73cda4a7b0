//! A mismatch along the coordinates in which it shows most, with the fitted law through it.
//!
//! x: a coordinate of the samples, in its unit; y: recorded minus simulated, in the channel's unit.

use super::axes::{BAND, Chart};
use super::canvas::{fill, solid};
use super::colours::{FAINT, INK, SERIES};
use super::legend::{Entry, sheet};
use super::readings::Spread;

const SIZE: (f64, f64) = (1080.0, 470.0);
/// Bins of a curve, with as many samples each: chosen here.
const BINS: usize = 16;
/// Fewer samples than these in a bin say nothing about its median: chosen here.
const LEAST_IN_BIN: usize = 8;
/// Series of what is left after the correction.
const AFTER: usize = 1;

/// What is drawn of each sample.
pub(super) struct Mismatch {
    /// Recorded minus simulated.
    pub(super) before: Vec<f64>,
    /// Recorded minus corrected.
    pub(super) after: Vec<f64>,
    /// Corrected minus simulated.
    pub(super) law: Vec<f64>,
}

/// Samples that are neighbours in a coordinate, the mismatch as a spread, the rest as medians.
struct Bin {
    x: f64,
    before: Spread,
    after: f64,
    law: f64,
}

impl Mismatch {
    /// Bins that rise in a coordinate of the samples, which is not a number where it has none.
    fn along(&self, column: &[f64]) -> Vec<Bin> {
        let bin = |bin: &Vec<usize>| {
            let of = |values: &[f64]| Spread::of(bin.iter().map(|&index| values[index]));
            Some(Bin {
                x: of(column)?.median,
                before: of(&self.before)?,
                after: of(&self.after)?.median,
                law: of(&self.law)?.median,
            })
        };
        bins(column).iter().filter_map(bin).collect()
    }
}

/// One chart for each coordinate, with its label and its column; `y` says what is drawn, with its
/// unit; without a law only the mismatch is drawn. `None` without coordinates.
pub(super) fn draw(
    title: (&str, &str),
    (y, law): (&str, Option<&str>),
    coordinates: &[(&str, &[f64])],
    mismatch: &Mismatch,
) -> Option<String> {
    let along = |(label, column): &(_, &[f64])| (*label, mismatch.along(column));
    let curves: Vec<(&str, Vec<Bin>)> = coordinates.iter().map(along).collect();
    let bins = curves.iter().flat_map(|(_, bins)| bins);
    let ends = bins.map(|bin| (bin.before.low.min(bin.law), bin.before.high.max(bin.law)));
    let (low, high) = ends.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    let (low, high) = (low.min(0.0), high.max(0.0));
    let margin = 0.05 * (high - low).max(1e-6);
    let y = (y, (low - margin, high + margin));
    let law_look = solid(INK, 2.0);
    let mut entries = vec![
        Entry::mark(0, false, "recorded - simulated: median"),
        Entry::band(SERIES[0], "middle 68 %"),
    ];
    if let Some(law) = law {
        entries.push(Entry::line(&law_look, law));
        entries.push(Entry::mark(AFTER, true, "left after it: median"));
    }
    let (mut canvas, below) = sheet(SIZE, title, &entries);
    for (panel, (label, bins)) in below.grid(1, curves.len()).into_iter().zip(&curves) {
        let (Some(first), Some(last)) = (bins.first(), bins.last()) else {
            continue;
        };
        let room = 0.03 * (last.x - first.x).max(1e-6);
        let ends = (first.x - room, last.x + room);
        let chart = Chart::draw(&mut canvas, panel, "", [(label, ends), y]);
        let zero = [(ends.0, 0.0), (ends.1, 0.0)];
        chart.line(&mut canvas, zero, &solid(FAINT, 1.4));
        let band: Vec<(f64, Spread)> = bins.iter().map(|bin| (bin.x, bin.before)).collect();
        chart.band(&mut canvas, &band, &fill(SERIES[0], BAND));
        if law.is_some() {
            let left = bins.iter().map(|bin| (bin.x, bin.after));
            chart.marks(&mut canvas, left, (AFTER, true), 2.8);
            let fitted = bins.iter().map(|bin| (bin.x, bin.law));
            chart.line(&mut canvas, fitted, &law_look);
        }
        let medians = bins.iter().map(|bin| (bin.x, bin.before.median));
        chart.marks(&mut canvas, medians, (0, false), 3.4);
    }
    Some(canvas.finish())
}

/// Part of the values' variance that lies between the bins of a column.
pub(super) fn share(column: &[f64], values: &[f64]) -> f64 {
    let bins = bins(column);
    if bins.len() < 3 {
        return 0.0;
    }
    let inside = || bins.iter().flatten().map(|&index| values[index]);
    let mean = inside().sum::<f64>() / bins.iter().map(Vec::len).sum::<usize>() as f64;
    let all: f64 = inside().map(|value| (value - mean).powi(2)).sum();
    let between = |bin: &Vec<usize>| {
        let of_bin = bin.iter().map(|&index| values[index]).sum::<f64>() / bin.len() as f64;
        bin.len() as f64 * (of_bin - mean).powi(2)
    };
    let between: f64 = bins.iter().map(between).sum();
    if all > 0.0 { between / all } else { 0.0 }
}

/// Samples of a column in bins of as many each; fewer bins where many values are the same.
fn bins(column: &[f64]) -> Vec<Vec<usize>> {
    let all = 0..column.len();
    let mut order: Vec<usize> = all.filter(|&index| column[index].is_finite()).collect();
    order.sort_by(|&a, &b| column[a].total_cmp(&column[b]).then(a.cmp(&b)));
    let each = order.len().div_ceil(BINS).max(LEAST_IN_BIN);
    let mut bins: Vec<Vec<usize>> = Vec::new();
    for index in order {
        let is_same = |bin: &Vec<usize>| column[bin[bin.len() - 1]] == column[index];
        match bins.last_mut() {
            Some(bin) if bin.len() < each || is_same(bin) => bin.push(index),
            _ => bins.push(vec![index]),
        }
    }
    if bins.len() > 1 && bins.last().is_some_and(|bin| bin.len() < LEAST_IN_BIN) {
        bins.pop();
    }
    bins
}
