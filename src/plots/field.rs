//! Measured and simulated field side by side: a slice through the axis, the same colours on both.

use plotters::prelude::*;

use airflow::{FAR_FIELD_FROM_S_OVER_L, Jet};

use super::axes::{Axis, Cell, Stroke, axes, cells, colour_bar, ground, line};
use super::colours::Scale;
use super::readings::{Grid, Medians, Reading};
use super::sheet::{Chart, Drawn, HEAD, INK, PAPER, SOFT, font, px, sheet};

/// Speeds over U_H whose lines are drawn: they can be read without the colours.
const LINES: [f64; 4] = [0.1, 0.25, 0.5, 1.0];
const WIDTH: f64 = 980.0;
const HEIGHT: f64 = 560.0;
const BAR: f64 = 110.0;

/// Readings are speeds over U_H; `None` without any.
pub(crate) fn draw(
    title: &str,
    subtitle: &str,
    readings: &[Reading],
    jet: &Jet,
    extrapolated: bool,
) -> Option<String> {
    let grid = Grid::of(readings)?;
    let largest = grid
        .cells
        .iter()
        .flatten()
        .map(|cell| cell.recorded.max(cell.simulated))
        .fold(0.0, f64::max);
    let scale = Scale::of_speeds(largest.max(0.05));
    let lines_from = if extrapolated {
        0.0
    } else {
        FAR_FIELD_FROM_S_OVER_L
    };
    Some(sheet((WIDTH, HEIGHT), title, subtitle, |area| {
        let (panels, bar) = area.split_horizontally(px(WIDTH - BAR));
        let panels = panels.split_evenly((1, 2));
        type Value = fn(Medians) -> f64;
        let shown: [(&str, Value); 2] = [
            ("measured", |cell| cell.recorded),
            ("simulated at the same samples", |cell| cell.simulated),
        ];
        for (panel, (heading, value)) in panels.iter().zip(shown) {
            let mut chart = frame(panel, heading, &grid)?;
            map(&mut chart, &grid, &scale, value)?;
            iso_speeds(&mut chart, jet, &grid, &scale, lines_from)?;
        }
        colour_bar(
            &bar,
            (12.0, 46.0),
            HEIGHT - HEAD - 110.0,
            "speed / U_H",
            &scale,
        )
    }))
}

/// Axes of a slice along x, depth downwards.
pub(super) fn frame<'a, 'b>(
    area: &'a super::sheet::Area<'b>,
    heading: &str,
    grid: &Grid,
) -> Drawn<Chart<'a, 'b>> {
    let label = "distance from the axis r / l, signed by side of x";
    frame_across(area, heading, label, grid)
}

/// Axes of a slice whose direction `across` tells.
pub(super) fn frame_across<'a, 'b>(
    area: &'a super::sheet::Area<'b>,
    heading: &str,
    across: &str,
    grid: &Grid,
) -> Drawn<Chart<'a, 'b>> {
    let x = Axis {
        label: across,
        from: -grid.across_to,
        to: grid.across_to,
    };
    let y = Axis {
        label: "depth below the rotor plane s / l",
        from: grid.s_to,
        to: grid.s_from,
    };
    let mut chart = axes(area, heading, x, y)?;
    ground(&mut chart)?;
    Ok(chart)
}

pub(super) fn map(
    chart: &mut Chart,
    grid: &Grid,
    scale: &Scale,
    value: impl Fn(Medians) -> f64,
) -> Drawn {
    cells(
        chart,
        scale,
        (0..grid.rows).map(|row| {
            (0..grid.columns)
                .map(|column| {
                    let (from, to) = grid.corners(row, column);
                    let step = scale.step_of(value(grid.at(row, column)?));
                    Some(Cell { from, to, step })
                })
                .collect()
        }),
    )
}

/// Where the jet's axial speed is a round part of U_H: r = r_half √((√(U_C/U) - 1)/(√2 - 1)).
fn iso_speeds(chart: &mut Chart, jet: &Jet, grid: &Grid, scale: &Scale, from: f64) -> Drawn {
    for speed in LINES {
        let top = grid.s_from.max(from);
        // The line closes on the axis where U_C = U.
        let end = (jet.centreline / speed + jet.origin).min(grid.s_to);
        if end <= top {
            continue;
        }
        let side: Vec<(f64, f64)> = (0..=80)
            .map(|i| {
                let s = top + (end - top) * f64::from(i) / 80.0;
                let centreline = jet.centreline / (s - jet.origin);
                let xi2 =
                    ((centreline / speed).sqrt() - 1.0).max(0.0) / (std::f64::consts::SQRT_2 - 1.0);
                (jet.spreading * (s - jet.origin) * xi2.sqrt(), s)
            })
            .collect();
        let colour = if speed > 0.55 * scale.high {
            INK
        } else {
            PAPER
        };
        for sign in [-1.0, 1.0] {
            // In runs of what is inside the frame: nothing is drawn along its edge.
            for run in side.split(|(r, _)| *r > grid.across_to) {
                let run: Vec<(f64, f64)> = run.iter().map(|(r, s)| (sign * r, *s)).collect();
                // Light lines show on cells without samples by their edge.
                if colour == PAPER {
                    line(chart, &run, SOFT, 2.0, Stroke::Solid)?;
                }
                line(chart, &run, colour, 1.1, Stroke::Solid)?;
            }
        }
        let end_of_labels = grid.s_to - 0.06 * (grid.s_to - grid.s_from);
        // The label stands on the right branch, where it is widest and inside.
        let widest = side
            .iter()
            .copied()
            .filter(|(r, s)| *r < 0.86 * grid.across_to && *s < end_of_labels)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((r, s)) = widest {
            let label = Text::new(format!("{speed}"), (r, s), font(11.0, colour));
            chart.draw_series(std::iter::once(label))?;
        }
    }
    Ok(())
}
