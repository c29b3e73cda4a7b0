//! What calibrated slices of jets show against depth, drone by drone: half-width and centreline
//! with the jet through them (the paper's expansion figure), and in the near field how the rotors'
//! jets approach the axis.
//!
//! x: depth below the rotor plane over the motor distance; y: a length over the motor distance, or
//! a speed over U_H.

use airflow::{FAR_FIELD_FROM_S_OVER_L, Jet};
use diagnosis::calibrate::{Calibration, DroneFit, Estimate, FittedJet, SliceFit};

use super::axes::{BAND, Chart};
use super::canvas::{Canvas, HEAD, dashed, fill, polyline, solid};
use super::colours::{INK, SERIES, SOFT, series_colour};
use super::grid::DEPTH;
use super::legend::{Entry, LINE, sheet};
use super::readings::Spread;

const WIDTH: f64 = 980.0;
const PANEL_HEIGHT: f64 = 380.0;
const NEAR_WIDTH: f64 = 760.0;
/// Pieces of a curve: chosen here, at its size they do not show.
const STEPS: usize = 60;

/// What is drawn.
pub(super) struct Expansion<'a> {
    pub(super) title: (&'a str, &'a str),
    /// Its slices are the marks.
    pub(super) found: &'a Calibration,
    /// The jet through them, and what the legend calls it.
    pub(super) jet: (&'a Jet, &'a str),
    /// Whether the band of the calibrated jet is drawn: where it is the jet through them.
    pub(super) has_band: bool,
    /// Another jet to compare with, and its name.
    pub(super) other: (&'a Jet, &'a str),
}

/// One estimate of each slice of a drone, by depth over the motor distance.
type Slices = Vec<(f64, Estimate)>;

/// A curve of the jet along its depth by its constants `B`, `S` and `s₀`, and the estimate of one
/// slice that belongs to it.
struct Law {
    label: &'static str,
    value: fn([f64; 3], f64) -> f64,
    estimate: fn(&SliceFit) -> Estimate,
}

/// Eq. 6 of the paper.
const HALF_WIDTH: Law = Law {
    label: "half-width r_half / l",
    value: |[_, spreading, origin], s| spreading * (s - origin),
    estimate: |slice| slice.half_width,
};
/// Eq. 5 of the paper.
const CENTRELINE: Law = Law {
    label: "centreline speed U_C / U_H",
    value: |[centreline, _, origin], s| centreline / (s - origin),
    estimate: |slice| slice.centreline,
};

fn constants(jet: &Jet) -> [f64; 3] {
    [jet.centreline, jet.spreading, jet.origin]
}

impl Law {
    fn slices(&self, drone: &DroneFit) -> Slices {
        let profiles = drone.profiles.iter();
        let fits = profiles.filter_map(|profile| Some((profile.s_over_l, profile.fit.as_ref()?)));
        fits.map(|(s, fit)| (s, (self.estimate)(fit))).collect()
    }

    /// Half the 95 % interval that the constants of a jet leave at a depth, to first order.
    fn reach(&self, found: &FittedJet, s: f64) -> f64 {
        let estimates = [found.centreline, found.spreading, found.origin];
        let [b, s, origin] = [0, 1, 2].map(|moved| {
            let interval = estimates[moved].interval;
            let value = |end: f64| {
                let mut constants = estimates.map(|estimate| estimate.value);
                constants[moved] += end * (interval.high - interval.low) / 2.0;
                (self.value)(constants, s)
            };
            (value(1.0) - value(-1.0)) / 2.0
        });
        let with = &found.correlation;
        let products = b * s * with.centreline_spreading
            + b * origin * with.centreline_origin
            + s * origin * with.spreading_origin;
        let square = b * b + s * s + origin * origin + 2.0 * products;
        square.max(0.0).sqrt()
    }
}

/// Half-width and centreline; `None` without slices.
pub(super) fn draw(figure: &Expansion) -> Option<String> {
    let drones = &figure.found.drones;
    let depths = drones.iter().flat_map(|drone| HALF_WIDTH.slices(drone));
    let deepest = depths.map(|(s, _)| s).reduce(f64::max)?;
    let s_from = FAR_FIELD_FROM_S_OVER_L;
    let s_to = (deepest * 1.06).max(s_from + 1.0);
    let curve = |law: &Law, jet: &Jet| -> Vec<(f64, f64)> {
        let depth = |i: usize| s_from + (s_to - s_from) * i as f64 / STEPS as f64;
        let point = |s| (s, (law.value)(constants(jet), s));
        (0..=STEPS).map(depth).map(point).collect()
    };
    let size = (WIDTH, HEAD + 5.0 * LINE + PANEL_HEIGHT);
    let (mut canvas, below) = sheet(size, figure.title, &key(figure));
    for (panel, law) in below.grid(1, 2).into_iter().zip([HALF_WIDTH, CENTRELINE]) {
        let slices: Vec<Slices> = drones.iter().map(|drone| law.slices(drone)).collect();
        let through = curve(&law, figure.jet.0);
        let marks = slices.iter().flatten().map(|(_, estimate)| estimate.value);
        let values = marks.chain(through.iter().map(|(_, y)| *y));
        let y_to = 1.08 * values.fold(0.0, f64::max);
        let axes = [(DEPTH, (0.0, s_to)), (law.label, (0.0, y_to))];
        let chart = Chart::draw(&mut canvas, panel, "", axes);
        let begins = [0.0, y_to].map(|y| (s_from, y));
        chart.line(&mut canvas, begins, &dashed(SOFT, 0.8));
        if figure.has_band {
            let spread = |&(s, median): &(f64, f64)| {
                let reach = law.reach(&figure.found.jet, s);
                (s, Spread::new(median - reach, median, median + reach))
            };
            let band: Vec<(f64, Spread)> = through.iter().map(spread).collect();
            chart.band(&mut canvas, &band, &fill(INK, BAND));
        }
        let other = curve(&law, figure.other.0);
        chart.line(&mut canvas, other, &dashed(SERIES[2], 1.6));
        chart.line(&mut canvas, through, &solid(INK, 1.8));
        marks_of(&mut canvas, &chart, drones, &slices);
    }
    Some(canvas.finish())
}

/// The marks of each drone with their intervals, hollow where it is beside the fit.
fn marks_of(canvas: &mut Canvas, chart: &Chart, drones: &[DroneFit], slices: &[Slices]) {
    let (bottom, top) = chart.y;
    for (index, (drone, slices)) in drones.iter().zip(slices).enumerate() {
        let bar = |(s, estimate): &(f64, Estimate)| {
            let ends = [estimate.interval.low, estimate.interval.high];
            polyline(ends.map(|end| chart.at((*s, end.clamp(bottom, top)))))
        };
        let bars: String = slices.iter().map(bar).collect();
        canvas.path(&bars, &solid(series_colour(index), 0.8));
        let marks = slices.iter().map(|(s, estimate)| (*s, estimate.value));
        chart.marks(canvas, marks, (index, !drone.in_fit), 3.4);
    }
}

fn drone_entry((index, drone): (usize, &DroneFit)) -> Entry {
    let name = match drone.in_fit {
        true => drone.airframe.clone(),
        false => format!("{} (not in the fit)", drone.airframe),
    };
    Entry::mark(index, !drone.in_fit, &name)
}

fn key(figure: &Expansion) -> Vec<Entry> {
    let drones = figure.found.drones.iter().enumerate();
    let mut entries: Vec<Entry> = drones.map(drone_entry).collect();
    let (jet, name) = figure.jet;
    let [centreline, spreading, origin] = constants(jet);
    let sign = if origin < 0.0 { '+' } else { '-' };
    let sigma = format!("s/l {sign} {:.3}", origin.abs());
    let half_width = format!("r_half/l = {spreading:.5} ({sigma})");
    let laws = format!("{name}: {half_width}, U_C/U_H = {centreline:.2}/({sigma})");
    entries.push(Entry::line(&solid(INK, 1.8), &laws));
    if figure.has_band {
        entries.push(Entry::band(INK, "its 95 % interval"));
    }
    let (jet, name) = figure.other;
    let [centreline, spreading, origin] = constants(jet);
    let other = format!("{name}: {spreading:.5}, {centreline:.2}, origin {origin:.3}");
    entries.push(Entry::line(&dashed(SERIES[2], 1.6), &other));
    let begins = format!("{FAR_FIELD_FROM_S_OVER_L} l: the far field begins");
    entries.push(Entry::line(&dashed(SOFT, 0.8), &begins));
    entries
}

/// Where the maxima of the rotors' jets lie in the near field: their distance from the axis against
/// depth, with 95 % intervals; `None` without maxima.
pub(super) fn near_field(title: (&str, &str), drones: &[DroneFit]) -> Option<String> {
    let maxima = |drone: &DroneFit| -> Slices {
        let lobes = drone.lobes.iter();
        lobes.map(|lobe| (lobe.s_over_l, lobe.delta)).collect()
    };
    let lobes: Vec<Slices> = drones.iter().map(maxima).collect();
    let ends = lobes
        .iter()
        .flatten()
        .map(|(s, delta)| (*s, delta.interval.high));
    let (deepest, widest) = ends.reduce(|a, b| (a.0.max(b.0), a.1.max(b.1)))?;
    let seen = drones.iter().enumerate();
    let seen = seen.filter(|(_, drone)| !drone.lobes.is_empty());
    let mut entries: Vec<Entry> = seen.map(drone_entry).collect();
    let (hub, merges) = (dashed(SOFT, 0.9), solid(INK, 0.9));
    entries.push(Entry::line(&hub, "rotor hub, along x or y"));
    let merged = "1.5 l and 2.5 l: between them the paper sees the jets merge";
    entries.push(Entry::line(&merges, merged));
    let size = (NEAR_WIDTH, HEAD + 3.0 * LINE + PANEL_HEIGHT);
    let (mut canvas, below) = sheet(size, title, &entries);
    let x_to = 1.05 * deepest.max(FAR_FIELD_FROM_S_OVER_L);
    let y_to = 1.08 * widest.clamp(0.5, 1.0);
    let away = "distance of the maxima from the axis delta / l";
    let axes = [(DEPTH, (0.0, x_to)), (away, (0.0, y_to))];
    let chart = Chart::draw(&mut canvas, below, "", axes);
    // Where a rotor's hub stands, seen along an axis of the body: l/(2 √2) from the centre.
    let hub_over_l = 0.5 * std::f64::consts::FRAC_1_SQRT_2;
    chart.line(&mut canvas, [0.0, x_to].map(|s| (s, hub_over_l)), &hub);
    for s in [1.5, FAR_FIELD_FROM_S_OVER_L] {
        chart.line(&mut canvas, [0.0, y_to].map(|y| (s, y)), &merges);
    }
    marks_of(&mut canvas, &chart, drones, &lobes);
    Some(canvas.finish())
}
