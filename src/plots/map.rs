//! A map of the air below one drone: offset across, depth downwards, in metres; colour by value,
//! with lines on top.

use super::axes::Chart;
use super::canvas::{dashed, fill, solid};
use super::colours::{Colour, INK, PAPER, SERIES, Scale, WORST};
use super::legend::{Entry, colour_bar, sheet};
use crate::report::sections::Figure;

const SIZE: (f64, f64) = (760.0, 640.0);
const BAR: f64 = 110.0;
/// Cells across and down: chosen here, a few pixels each.
const CELLS: [usize; 2] = [120, 160];

/// What is drawn.
pub(crate) struct Map<'a> {
    /// Of the file.
    pub(crate) name: &'a str,
    pub(crate) title: (&'a str, &'a str),
    pub(crate) caption: &'a str,
    /// How far to both sides, and how deep (m).
    pub(crate) reach_m: [f64; 2],
    /// By depth and offset (m).
    pub(crate) value: &'a dyn Fn(f64, f64) -> f64,
    /// What the values are, for the bar.
    pub(crate) unit: &'a str,
    /// Places along lines, offset and depth (m), with their names; the right half alone.
    pub(crate) lines: Vec<(&'a str, Vec<[f64; 2]>)>,
}

pub(crate) fn draw(map: &Map<'_>) -> Figure {
    let looks = [
        solid(PAPER, 1.6),
        dashed(WORST, 1.8),
        solid(SERIES[6], 1.8),
        solid(INK, 1.2),
    ];
    let lines = || map.lines.iter().zip(looks.iter().cycle());
    // What is paper on the map is ink in the legend.
    let entries: Vec<Entry> = lines()
        .enumerate()
        .map(|(k, ((name, _), look))| match k % looks.len() {
            0 => Entry::line(&solid(INK, 1.6), name),
            _ => Entry::line(look, name),
        })
        .collect();
    let (mut canvas, below) = sheet(SIZE, map.title, &entries);
    let (area, side) = below.split_right(BAR);
    let [wide_m, deep_m] = map.reach_m;
    let [columns, rows] = CELLS;
    let across_m = |column: usize| wide_m * (2.0 * column as f64 / columns as f64 - 1.0);
    let down_m = |row: usize| deep_m * row as f64 / rows as f64;
    let mut values = Vec::with_capacity(columns * rows);
    for row in 0..rows {
        let depth_m = 0.5 * (down_m(row) + down_m(row + 1));
        // Both halves are one.
        let half = (0..columns / 2).map(|column| {
            let offset_m = 0.5 * (across_m(column) + across_m(column + 1));
            (map.value)(depth_m, offset_m.abs())
        });
        let half: Vec<f64> = half.collect();
        values.extend(half.iter());
        values.extend(half.iter().rev());
    }
    let scale = Scale::of_speeds(values.iter().copied().fold(1e-3, f64::max));
    let axes = [
        ("beside (m)", (-wide_m, wide_m)),
        ("below the rotor plane (m)", (deep_m, 0.0)),
    ];
    let chart = Chart::draw(&mut canvas, area, "", axes);
    let colours: Vec<Colour> = (0..scale.steps).map(|step| scale.colour(step)).collect();
    let steps: Vec<Option<usize>> = values.iter().map(|it| Some(scale.step_of(*it))).collect();
    chart.cells(
        &mut canvas,
        steps.chunks(columns),
        &colours,
        |row, column| {
            [
                (across_m(column), down_m(row)),
                (across_m(column + 1), down_m(row + 1)),
            ]
        },
    );
    chart.ground(&mut canvas, &solid(INK, 0.8));
    for (k, ((_, points), look)) in lines().enumerate() {
        let inside = |it: &&[f64; 2]| it[0] <= wide_m && it[1] <= deep_m;
        for sign in [-1.0, 1.0] {
            let line = || points.iter().filter(inside).map(|[r, z]| (sign * r, *z));
            if k % looks.len() == 0 {
                // Paper shows on light cells by its edge.
                chart.line(&mut canvas, line(), &solid(INK, 2.8));
            }
            chart.line(&mut canvas, line(), look);
        }
    }
    let drone = chart.at((0.0, 0.0));
    canvas.path(
        &super::canvas::rectangle(
            (drone.0 - 8.0, drone.1 - 2.0),
            (drone.0 + 8.0, drone.1 + 2.0),
        ),
        &fill(INK, 1.0),
    );
    let bar = side.inset([12.0, 36.0, 0.0, 64.0]);
    colour_bar(&mut canvas, bar, map.unit, &scale);
    Figure {
        name: map.name.to_owned(),
        svg: canvas.finish(),
        caption: map.caption.to_owned(),
        live: None,
    }
}
