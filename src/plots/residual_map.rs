//! Recorded minus simulated over the wake: where, which way, and whether more than noise; before
//! and after a correction.
//!
//! Across: distance from the axis over the motor distance; down: depth over the motor distance;
//! colour: residual in its unit.

use airflow::Jet;
use diagnosis::statistics::quantile::quantile;

use super::axes::Chart;
use super::canvas::{Canvas, dashed, fill, polyline, solid};
use super::colours::{FAINT, INK, PAPER, Scale};
use super::grid::{Grid, SIGNED};
use super::legend::{Entry, LINE, colour_bar, legend, sheet};
use super::readings::{Reading, places, sorted};

const PANEL: f64 = 430.0;
const HEIGHT: f64 = 530.0;
const SIDE: f64 = 280.0;

/// What is drawn.
pub(super) struct ResidualMap<'a> {
    pub(super) title: (&'a str, &'a str),
    /// Of the residuals.
    pub(super) unit: &'a str,
    /// Label of the distance from the axis.
    pub(super) across: &'a str,
    /// Of each sample: distance from the axis with a sign, and depth, over the motor distance.
    pub(super) places: Vec<(f64, f64)>,
    /// Headings, each with a residual of every sample.
    pub(super) panels: Vec<(&'a str, Vec<f64>)>,
    /// Residuals beyond it get a sign; one of every sample, and in words.
    pub(super) noise: (Vec<f64>, &'a str),
    /// What is drawn above the cells.
    pub(super) above: Above<'a>,
}

/// What lies above the cells.
pub(super) enum Above<'a> {
    /// The border of a region: whether each sample lies in it.
    Region(Vec<bool>),
    /// The half-width of a jet.
    HalfWidth(&'a Jet),
}

impl<'a> ResidualMap<'a> {
    /// One panel of readings below a jet; `accuracy` is that of the readings, in words.
    pub(super) fn of_readings(
        title: (&'a str, &'a str),
        (unit, accuracy): (&'a str, &'a str),
        readings: &[Reading],
        jet: &'a Jet,
    ) -> ResidualMap<'a> {
        let of = |value: fn(&Reading) -> f64| readings.iter().map(value).collect();
        ResidualMap {
            title,
            unit,
            across: SIGNED,
            places: places(readings),
            panels: vec![("", of(|reading| reading.recorded - reading.simulated))],
            noise: (of(|reading| reading.accuracy), accuracy),
            above: Above::HalfWidth(jet),
        }
    }

    /// `None` without samples.
    pub(super) fn draw(&self) -> Option<String> {
        let grid = Grid::of(&self.places)?;
        let of_cells = |values: &[f64]| grid.medians(|index| values[index]);
        let noise = of_cells(&self.noise.0);
        let first = of_cells(&self.panels.first()?.1);
        let sizes = sorted(first.iter().flatten().map(|residual| residual.abs()));
        // Chosen here: the largest twentieth of the cells saturates, a few would leave the rest
        // pale.
        let scale = Scale::of_residuals(quantile(&sizes, 0.95)?);
        let panels = self.panels.len();
        let size = (PANEL * panels as f64 + SIDE, HEIGHT);
        let (mut canvas, below) = sheet(size, self.title, &[]);
        let (charts, side) = below.split_right(SIDE);
        for (area, (heading, residuals)) in charts.grid(1, panels).into_iter().zip(&self.panels) {
            let residuals = of_cells(residuals);
            let words = (*heading, self.across);
            let chart = grid.draw(&mut canvas, area, words, (&scale, &residuals));
            canvas.path(&signs(&chart, &grid, &residuals, &noise), &solid(INK, 0.8));
            match &self.above {
                Above::Region(inside) => {
                    let share = grid.medians(|index| f64::from(u8::from(inside[index])));
                    let border = border(&chart, &grid, &share);
                    for (colour, width) in [(PAPER, 3.6), (INK, 1.7)] {
                        let look = solid(colour, width) + r#" stroke-linecap="square""#;
                        canvas.path(&border, &look);
                    }
                }
                Above::HalfWidth(jet) => half_width(&mut canvas, &chart, jet),
            }
        }
        let (look, line) = match self.above {
            Above::Region(_) => (solid(INK, 1.7), "region of the mismatch"),
            Above::HalfWidth(_) => (dashed(INK, 1.2), "half-width of the simulated jet"),
        };
        let entries = [
            Entry::text("+ recorded above, - below, by more"),
            Entry::text(&format!("than {}", self.noise.1)),
            Entry::line(&look, line),
            Entry::patch(&fill(FAINT, 1.0), "no samples"),
        ];
        let signs = LINE * entries.len() as f64 + 24.0;
        let label = format!("recorded - simulated ({})", self.unit);
        let bar = side.inset([12.0, 36.0, 0.0, signs + 20.0]);
        colour_bar(&mut canvas, bar, &label, &scale);
        // Too narrow for two entries beside one another.
        let key = side.inset([12.0, side.height - signs, 120.0, 0.0]);
        legend(&mut canvas, key, &entries);
        Some(canvas.finish())
    }
}

/// A sign in every cell whose median is further off than noise is.
fn signs(chart: &Chart, grid: &Grid, residuals: &[Option<f64>], noise: &[Option<f64>]) -> String {
    let mut path = String::new();
    for (cell, pair) in residuals.iter().zip(noise).enumerate() {
        if let (Some(residual), Some(noise)) = pair
            && residual.abs() > *noise
        {
            let [from, to] = grid.corners(cell / grid.columns, cell % grid.columns);
            let (x, y) = chart.at(((from.0 + to.0) / 2.0, (from.1 + to.1) / 2.0));
            path += &format!("M{:.1} {y:.1}h4.8", x - 2.4);
            if *residual > 0.0 {
                path += &format!("M{x:.1} {:.1}v4.8", y - 2.4);
            }
        }
    }
    path
}

/// The border of the cells of which half the samples or more are inside. A cell without samples
/// goes with its neighbours.
fn border(chart: &Chart, grid: &Grid, share: &[Option<f64>]) -> String {
    let columns = grid.columns as i64;
    let rows = share.len() as i64 / columns;
    let is_cell = |(row, column)| (0..rows).contains(&row) && (0..columns).contains(&column);
    let sampled = |(row, column)| -> Option<bool> {
        let index = is_cell((row, column)).then_some(row * columns + column)?;
        Some(share[index as usize]? >= 0.5)
    };
    let is_inside = |(row, column)| {
        let around = (0..9).map(|i| (row - 1 + i / 3, column - 1 + i % 3));
        let votes = around.filter_map(sampled);
        let balance: i32 = votes.map(|inside| if inside { 1 } else { -1 }).sum();
        is_cell((row, column)) && sampled((row, column)).unwrap_or(balance > 0)
    };
    let mut border = String::new();
    let cells = (0..rows * columns).map(|index| (index / columns, index % columns));
    for (row, column) in cells.filter(|cell| is_inside(*cell)) {
        let [(left, top), (right, bottom)] = grid.corners(row as usize, column as usize);
        let sides = [
            ((row - 1, column), [(left, top), (right, top)]),
            ((row + 1, column), [(left, bottom), (right, bottom)]),
            ((row, column - 1), [(left, top), (left, bottom)]),
            ((row, column + 1), [(right, top), (right, bottom)]),
        ];
        for (_, ends) in sides.into_iter().filter(|(beside, _)| !is_inside(*beside)) {
            border += &polyline(ends.map(|end| chart.at(end)));
        }
    }
    border
}

fn half_width(canvas: &mut Canvas, chart: &Chart, jet: &Jet) {
    let ((_, across_to), (s_to, s_from)) = (chart.x, chart.y);
    for sign in [-1.0, 1.0] {
        let line = || {
            let depths = (0..=40).map(|i| s_from + (s_to - s_from) * f64::from(i) / 40.0);
            let points = depths.map(|s| (sign * jet.spreading * (s - jet.origin), s));
            points.filter(|(r, _)| r.abs() <= across_to)
        };
        chart.line(canvas, line(), &solid(PAPER, 2.6));
        chart.line(canvas, line(), &dashed(INK, 1.2));
    }
}
