//! A chart with linear axes, and what is drawn in it: lines, bands, marks that differ in shape,
//! heat maps.

use super::canvas::{
    Area, BOLD, CENTRED, Canvas, Letters, Spot, TO_THE_LEFT, circle, fill, polyline, rectangle,
    solid, stroke,
};
use super::colours::{Colour, FAINT, INK, PAPER, WHITE, round_step, series_colour};
use super::readings::Spread;
use crate::report::words::shortest;

/// What tick labels and axis labels take beside and below a chart (px).
const LEFT: f64 = 56.0;
const BOTTOM: f64 = 42.0;
/// What is left free on the right, and above; with a heading more (px).
const RIGHT: f64 = 14.0;
const TOP: f64 = 6.0;
const HEADING: f64 = 18.0;
/// Ticks are at least this far apart (px): numbers beside one another need more than stacked ones.
const TICK_ACROSS: f64 = 55.0;
const TICK_UP: f64 = 34.0;
/// Opacity of bands: several may lie above one another.
pub(super) const BAND: f64 = 0.16;

/// What an axis says, and the values at its ends: left and right, or below and above. Depth grows
/// downwards.
pub(super) type Axis<'a> = (&'a str, (f64, f64));

/// A rectangle of the sheet with linear coordinates, x to the right and y upwards.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chart {
    pub(super) area: Area,
    /// Values at the left and right edge.
    pub(super) x: (f64, f64),
    /// Values at the lower and upper edge.
    pub(super) y: (f64, f64),
}

impl Chart {
    /// A chart that fills an area, axes included; a heading goes above it.
    pub(super) fn draw(canvas: &mut Canvas, area: Area, heading: &str, [x, y]: [Axis; 2]) -> Chart {
        let heading_px = if heading.is_empty() { 0.0 } else { HEADING };
        let chart = Chart {
            area: area.inset([LEFT, TOP + heading_px, RIGHT, BOTTOM]),
            x: x.1,
            y: y.1,
        };
        chart.axes(canvas, heading, x.0, y.0);
        chart
    }

    /// The place of a point.
    pub(super) fn at(&self, (x, y): (f64, f64)) -> Spot {
        let part = |value: f64, (from, to): (f64, f64)| (value - from) / (to - from);
        let right = self.area.width * part(x, self.x);
        let up = self.area.height * part(y, self.y);
        (self.area.left + right, self.area.bottom() - up)
    }

    /// Round values along x and along y, each with its place along that axis (px). To one scale
    /// they have one step, unless that leaves too few.
    fn ticks(&self) -> [Vec<(f64, f64)>; 2] {
        let least = |(from, to): (f64, f64), px: f64, apart: f64| (to - from).abs() * apart / px;
        let across = least(self.x, self.area.width, TICK_ACROSS);
        let upwards = least(self.y, self.area.height, TICK_UP);
        let is_one_scale = (across / TICK_ACROSS - upwards / TICK_UP).abs() < 1e-9 * across;
        let is_high = (self.y.1 - self.y.0).abs() > 3.0 * across;
        let is_shared = is_one_scale && is_high;
        let upwards = if is_shared { across } else { upwards };
        let at_x = |value: f64| (self.at((value, self.y.0)).0, value);
        let at_y = |value: f64| (self.at((self.x.0, value)).1, value);
        [
            multiples(self.x, round_step(across)).map(at_x).collect(),
            multiples(self.y, round_step(upwards)).map(at_y).collect(),
        ]
    }

    /// The axes with their ticks and labels, and a heading above.
    pub(super) fn axes(&self, canvas: &mut Canvas, heading: &str, x_label: &str, y_label: &str) {
        let (area, right, bottom) = (self.area, self.area.right(), self.area.bottom());
        let (left, top) = (area.left, area.top);
        let mut lines = format!("M{left:.1} {top:.1}V{bottom:.1}H{right:.1}");
        let [across, upwards] = self.ticks();
        let letters = Letters::new(11.0, INK).with(CENTRED);
        for (x, value) in across {
            lines += &format!("M{x:.1} {bottom:.1}v4");
            canvas.text((x, bottom + 12.0), &shortest(value, 3), &letters);
        }
        let letters = Letters::new(11.0, INK).with(TO_THE_LEFT);
        for (y, value) in upwards {
            lines += &format!("M{left:.1} {y:.1}h-4");
            canvas.text((left - 7.0, y), &shortest(value, 3), &letters);
        }
        canvas.path(&lines, &solid(INK, 0.8));
        let label = Letters::new(12.0, INK);
        canvas.text((left, top - 13.0), heading, &label.clone().with(BOLD));
        let (x, y) = (left + area.width / 2.0, top + area.height / 2.0);
        canvas.text_upwards((left - 43.0, y), y_label, label.clone());
        canvas.text((x, bottom + 31.0), x_label, &label.with(CENTRED));
    }

    /// White ground, framed, with a grid through the ticks.
    pub(super) fn grid(&self, canvas: &mut Canvas) {
        let area = self.area;
        let [across, upwards] = self.ticks();
        let mut lines = String::new();
        for (x, _) in across {
            lines += &format!("M{x:.1} {:.1}v{:.1}", area.top, area.height);
        }
        for (y, _) in upwards {
            lines += &format!("M{:.1} {y:.1}h{:.1}", area.left, area.width);
        }
        self.ground(canvas, &fill(WHITE, 1.0));
        canvas.path(&lines, &solid(FAINT, 0.8));
        self.ground(canvas, &solid(INK, 0.8));
    }

    pub(super) fn ground(&self, canvas: &mut Canvas, look: &str) {
        let (left, top) = (self.area.left, self.area.top);
        let path = rectangle((left, top), (self.area.right(), self.area.bottom()));
        canvas.path(&path, look);
    }

    /// A line through points.
    pub(super) fn line(
        &self,
        canvas: &mut Canvas,
        points: impl IntoIterator<Item = (f64, f64)>,
        look: &str,
    ) {
        let spots = points.into_iter().map(|point| self.at(point));
        canvas.path(&polyline(spots), look);
    }

    /// The area between the ends of spreads over rising abscissas.
    pub(super) fn band(&self, canvas: &mut Canvas, spreads: &[(f64, Spread)], look: &str) {
        let low = spreads.iter().map(|(x, spread)| (*x, spread.low));
        let high = spreads.iter().rev().map(|(x, spread)| (*x, spread.high));
        self.line(canvas, low.chain(high), look);
    }

    /// Marks at points, their shape and colour by number; hollow marks say "not part of the fit".
    /// What lies beyond the chart is left out.
    pub(super) fn marks(
        &self,
        canvas: &mut Canvas,
        points: impl IntoIterator<Item = (f64, f64)>,
        (series, is_hollow): (usize, bool),
        size: f64,
    ) {
        let within = |value: f64, (from, to): (f64, f64)| (value - from) * (value - to) <= 0.0;
        let inside = |(x, y): &(f64, f64)| within(*x, self.x) && within(*y, self.y);
        let points = points.into_iter().filter(inside);
        let marks = points.map(|point| mark(self.at(point), series, size));
        canvas.path(&marks.collect::<String>(), &mark_look(series, is_hollow));
    }

    /// A heat map: cells row by row, each in one of the colours, or none; `corners` of a cell by
    /// its row and column.
    pub(super) fn cells(
        &self,
        canvas: &mut Canvas,
        rows: std::slice::Chunks<Option<usize>>,
        colours: &[Colour],
        corners: impl Fn(usize, usize) -> [(f64, f64); 2],
    ) {
        // Neighbours in a row with one colour are one rectangle, and all rectangles of one colour
        // one path.
        let mut paths = vec![String::new(); colours.len()];
        for (row, cells) in rows.enumerate() {
            let mut column = 0;
            for run in cells.chunk_by(|left, right| left == right) {
                let [from, _] = corners(row, column);
                column += run.len();
                let [_, to] = corners(row, column - 1);
                if let Some(colour) = run[0] {
                    paths[colour] += &rectangle(self.at(from), self.at(to));
                }
            }
        }
        // Crisp, or neighbours would show seams.
        for (path, colour) in paths.iter().zip(colours) {
            let look = fill(*colour, 1.0) + r#" shape-rendering="crispEdges""#;
            canvas.path(path, &look);
        }
    }
}

/// The multiples of a step between two values.
fn multiples((from, to): (f64, f64), step: f64) -> impl Iterator<Item = f64> {
    let (first, last) = (from.min(to) / step - 1e-6, from.max(to) / step + 1e-6);
    let numbers = first.ceil() as i64..=last.floor() as i64;
    numbers.map(move |number| number as f64 * step)
}

/// Corners of the marks, x and y in turn, over their size, so that all look equally heavy; no
/// corners: a disc.
const SHAPES: [&[f64]; 7] = [
    &[],
    &[-0.89, -0.89, 0.89, -0.89, 0.89, 0.89, -0.89, 0.89],
    &[0.0, -1.44, 1.25, 0.72, -1.25, 0.72],
    &[0.0, -1.25, 1.25, 0.0, 0.0, 1.25, -1.25, 0.0],
    &[0.0, 1.44, 1.25, -0.72, -1.25, -0.72],
    // A plus.
    &[
        -0.4, -1.2, 0.4, -1.2, 0.4, -0.4, 1.2, -0.4, 1.2, 0.4, 0.4, 0.4, 0.4, 1.2, -0.4, 1.2, -0.4,
        0.4, -1.2, 0.4, -1.2, -0.4, -0.4, -0.4,
    ],
    // An hourglass.
    &[-1.1, -1.21, 1.1, -1.21, -1.1, 1.21, 1.1, 1.21],
];

/// The path of one mark.
pub(super) fn mark((x, y): Spot, series: usize, size: f64) -> String {
    let corners = SHAPES[series % SHAPES.len()];
    if corners.is_empty() {
        return circle((x, y), size);
    }
    let corners = corners.chunks(2);
    polyline(corners.map(|corner| (x + size * corner[0], y + size * corner[1]))) + "z"
}

pub(super) fn mark_look(series: usize, is_hollow: bool) -> String {
    let colour = series_colour(series);
    match is_hollow {
        true => fill(PAPER, 1.0) + &stroke(colour, 1.2),
        false => fill(colour, 1.0),
    }
}
