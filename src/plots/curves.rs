//! Some quantities over one that was varied: a chart each, side by side.

use super::axes::Chart;
use super::canvas::{HEAD, solid};
use super::colours::SERIES;
use super::legend::sheet;
use crate::report::sections::Figure;

/// One chart (px).
const WIDTH: f64 = 340.0;
const HEIGHT: f64 = 300.0;

/// A label of the y axis, and points by rising x.
pub(crate) type Curve<'a> = (&'a str, Vec<(f64, f64)>);

/// The figure; `None` without points.
pub(crate) fn draw(
    name: &str,
    (title, caption): ((&str, &str), &str),
    x_label: &str,
    curves: &[Curve<'_>],
) -> Option<Figure> {
    let ends = |of: &mut dyn Iterator<Item = f64>| {
        of.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| {
            (low.min(it), high.max(it))
        })
    };
    let points = || curves.iter().flat_map(|it| &it.1);
    let (x_low, x_high) = ends(&mut points().map(|it| it.0));
    let svg = (x_low <= x_high).then(|| {
        let size = (WIDTH * curves.len() as f64, HEAD + 8.0 + HEIGHT);
        let (mut canvas, below) = sheet(size, title, &[]);
        let room = 0.04 * (x_high - x_low).max(1e-6);
        let x = (x_label, (x_low - room, x_high + room));
        for (k, (area, (label, points))) in below
            .grid(1, curves.len())
            .into_iter()
            .zip(curves)
            .enumerate()
        {
            let (_, high) = ends(&mut points.iter().map(|it| it.1));
            let y = (*label, (0.0, 1.08 * high.max(1e-3)));
            let chart = Chart::draw(&mut canvas, area, "", [x, y]);
            chart.grid(&mut canvas);
            let look = solid(SERIES[k % SERIES.len()], 1.6);
            chart.line(&mut canvas, points.iter().copied(), &look);
            chart.marks(&mut canvas, points.iter().copied(), (k, false), 3.4);
        }
        canvas.finish()
    });
    Figure::of(name, svg, caption)
}
