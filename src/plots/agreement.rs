//! Recorded against predicted values, sample by sample, and over time.
//!
//! Squares: x the predicted, y the recorded value, in the quantity's unit. Strips: x time (s), y
//! the quantity.

use diagnosis::forward::simulate::Sample;

use super::axes::Chart;
use super::canvas::{Area, Canvas, HEAD, dashed, fill, solid};
use super::colours::{INK, PAPER, SERIES};
use super::legend::{Entry, LINE, sheet};
use super::readings::{Spread, sorted};

const SQUARE: f64 = 430.0;
const STRIP: f64 = 190.0;
const STRIPS_WIDTH: f64 = 680.0;
/// More strips than these would be too flat to read: the drones with the most simulated air come
/// first.
const STRIPS: usize = 4;
/// Moments drawn along a strip: chosen here, a strip is some hundreds of pixels wide.
const MOMENTS: usize = 260;
/// More points than these are counted in cells: chosen here, they would cover one another.
const POINTS: usize = 400;
/// Cells of a square along each axis: chosen here, some seven pixels each.
const CELLS: usize = 56;
/// Shades of the counts between paper and ink, each of them five times as many as the last.
const SHADES: [f64; 6] = [0.12, 0.27, 0.42, 0.57, 0.75, 1.0];
/// From one shade to the next.
const SHADE_RATIO: f64 = 5.0;
/// One value in so many may lie beyond either end of a square, chosen here; of a strip, none.
const BEYOND: usize = 2000;

/// One drone's channel over time; times rise.
#[derive(Clone, Debug)]
pub(super) struct Trace<'a> {
    pub(super) name: String,
    pub(super) samples: Vec<&'a Sample>,
}

impl Trace<'_> {
    /// Mean square of the simulated values about their mean: how much there is to see.
    fn variance(&self) -> f64 {
        let count = self.samples.len().max(1) as f64;
        let simulated = || self.samples.iter().map(|sample| sample.simulated);
        let mean = simulated().sum::<f64>() / count;
        simulated().map(|value| (value - mean).powi(2)).sum::<f64>() / count
    }
}

/// Two squares side by side: `(recorded, predicted)` of every sample, first as simulated, then
/// corrected, each with a heading. `quantity`: `speed (m/s)` and the like; `None` without samples.
pub(super) fn before_and_after(
    title: (&str, &str),
    quantity: &str,
    panels: [(&str, &[(f64, f64)]); 2],
) -> Option<String> {
    let ends = range(panels.iter().flat_map(|(_, pairs)| *pairs), BEYOND)?;
    let (mut canvas, below) = sheet((2.0 * SQUARE, HEAD + SQUARE), title, &[]);
    let words = ["simulated", "corrected"].map(|word| format!("{word} {quantity}"));
    for ((area, (heading, pairs)), x) in below.grid(1, 2).into_iter().zip(panels).zip(&words) {
        let y = &format!("recorded {quantity}");
        let chart = Chart::draw(&mut canvas, area, heading, [(x, ends), (y, ends)]);
        against(&mut canvas, &chart, pairs);
    }
    Some(canvas.finish())
}

/// Strips of the drones whose simulated values vary most, and one square of all samples; `None`
/// without samples.
pub(super) fn over_time(title: (&str, &str), quantity: &str, traces: &[Trace]) -> Option<String> {
    let long = traces.iter().filter(|trace| trace.samples.len() > 1);
    let mut shown: Vec<&Trace> = long.collect();
    shown.sort_by(|a, b| b.variance().total_cmp(&a.variance()));
    let samples = shown.iter().flat_map(|trace| &trace.samples);
    let pairs: Vec<(f64, f64)> = samples.map(|sample| pair(sample)).collect();
    let ends = range(&pairs, BEYOND)?;
    shown.truncate(STRIPS);
    let strips_height = STRIP * shown.len() as f64;
    let height = HEAD + LINE + 8.0 + strips_height.max(SQUARE);
    let size = (STRIPS_WIDTH + SQUARE, height);
    let recorded = "recorded (mean, band: middle 68 % of each moment)";
    let equal = "right: recorded = simulated; darker: more samples, fivefold a shade";
    let entries = [
        Entry::line(&solid(SERIES[3], 1.1), recorded),
        Entry::line(&dashed(INK, 1.4), "simulated"),
        Entry::line(&solid(SERIES[0], 1.4), equal),
    ];
    let (mut canvas, below) = sheet(size, title, &entries);
    let (strips, square) = below.split_right(SQUARE);
    let strips = strips.inset([0.0, 0.0, 0.0, strips.height - strips_height]);
    for (area, trace) in strips.grid(shown.len(), 1).into_iter().zip(&shown) {
        strip(&mut canvas, area, trace, quantity);
    }
    let square = square.inset([0.0, 0.0, 0.0, square.height - SQUARE]);
    let [x, y] = ["simulated", "recorded"].map(|word| format!("{word} {quantity}"));
    let heading = "recorded against simulated";
    let chart = Chart::draw(&mut canvas, square, heading, [(&x, ends), (&y, ends)]);
    against(&mut canvas, &chart, &pairs);
    Some(canvas.finish())
}

/// Recorded and simulated value.
fn pair(sample: &Sample) -> (f64, f64) {
    (sample.recorded, sample.simulated)
}

/// The range that holds all but one of `beyond` values on each side, a little widened.
fn range<'a>(pairs: impl IntoIterator<Item = &'a (f64, f64)>, beyond: usize) -> Option<(f64, f64)> {
    let values = sorted(pairs.into_iter().flat_map(|&(a, b)| [a, b]));
    let last = values.len().checked_sub(1)?;
    let (low, high) = (values[last / beyond], values[last - last / beyond]);
    let margin = 0.04 * (high - low).max(1e-6);
    Some((low - margin, high + margin))
}

fn strip(canvas: &mut Canvas, area: Area, trace: &Trace, quantity: &str) {
    let pairs: Vec<(f64, f64)> = trace.samples.iter().map(|sample| pair(sample)).collect();
    let ([first, .., last], Some(ends)) = (&trace.samples[..], range(&pairs, usize::MAX)) else {
        return;
    };
    let x = ("time (s)", (first.t_s, last.t_s));
    let chart = Chart::draw(canvas, area, &trace.name, [x, (quantity, ends)]);
    let each = trace.samples.len().div_ceil(MOMENTS);
    let (mut recorded, mut simulated, mut band) = (Vec::new(), Vec::new(), Vec::new());
    for moment in trace.samples.chunks(each) {
        let mean = |of: fn(&Sample) -> f64| {
            moment.iter().map(|sample| of(sample)).sum::<f64>() / moment.len() as f64
        };
        let t_s = mean(|sample| sample.t_s);
        recorded.push((t_s, mean(|sample| sample.recorded)));
        simulated.push((t_s, mean(|sample| sample.simulated)));
        let spread = Spread::of(moment.iter().map(|sample| sample.recorded));
        band.extend(spread.map(|spread| (t_s, spread)));
    }
    if each > 1 {
        chart.band(canvas, &band, &fill(SERIES[3], 0.25));
    }
    chart.line(canvas, recorded, &solid(SERIES[3], 1.1));
    chart.line(canvas, simulated, &dashed(INK, 1.4));
}

/// Samples in a square chart, `(recorded, predicted)`, and the line where both are equal.
fn against(canvas: &mut Canvas, chart: &Chart, pairs: &[(f64, f64)]) {
    if pairs.len() <= POINTS {
        let points = pairs
            .iter()
            .map(|&(recorded, predicted)| (predicted, recorded));
        chart.marks(canvas, points, (0, false), 1.5);
    } else {
        counts(canvas, chart, pairs);
    }
    let (from, to) = chart.x;
    chart.line(canvas, [(from, from), (to, to)], &solid(SERIES[0], 1.4));
}

/// How many samples lie in each cell, the darker the more.
fn counts(canvas: &mut Canvas, chart: &Chart, pairs: &[(f64, f64)]) {
    let (low, high) = chart.x;
    let mut counts = vec![0_u32; CELLS * CELLS];
    let cell = |value: f64| {
        let place = (value - low) / (high - low) * CELLS as f64;
        let is_inside = (0.0..CELLS as f64).contains(&place);
        is_inside.then_some(place as usize)
    };
    for &(recorded, predicted) in pairs {
        if let (Some(row), Some(column)) = (cell(recorded), cell(predicted)) {
            counts[row * CELLS + column] += 1;
        }
    }
    let edge = |index: usize| low + (high - low) * index as f64 / CELLS as f64;
    let shade = |count: u32| {
        let shade = f64::from(count).log(SHADE_RATIO) as usize;
        (count > 0).then_some(shade.min(SHADES.len() - 1))
    };
    let shades: Vec<Option<usize>> = counts.into_iter().map(shade).collect();
    let colours = SHADES.map(|shade| PAPER.towards(INK, shade));
    chart.cells(canvas, shades.chunks(CELLS), &colours, |row, column| {
        [(edge(column), edge(row)), (edge(column + 1), edge(row + 1))]
    });
}
