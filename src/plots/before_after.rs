//! Recorded minus simulated over the wake, before and after a correction, with a region outlined.

use plotters::prelude::*;

use super::axes::{Sign, colour_bar, legend};
use super::colours::Scale;
use super::field::{frame_across, map};
use super::readings::{Grid, Reading};
use super::sheet::{Chart, Drawn, FAINT, HEAD, INK, PAPER, px, sheet};

const WIDTH: f64 = 1080.0;
const HEIGHT: f64 = 520.0;
const BAR: f64 = 210.0;

/// One sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    /// Depth below the rotor plane over the motor distance.
    pub(crate) s_over_l: f64,
    /// Distance from the axis over the motor distance, negative on the far side of what `across` says.
    pub(crate) across_over_l: f64,
    /// Recorded minus simulated.
    pub(crate) before: f64,
    /// Recorded minus corrected.
    pub(crate) after: f64,
    /// Residuals beyond it get a sign.
    pub(crate) noise: f64,
    pub(crate) inside: bool,
}

/// What the axes and the panels say.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Words<'a> {
    pub(crate) title: &'a str,
    pub(crate) subtitle: &'a str,
    /// Of the residuals, in brackets, with the space before it.
    pub(crate) unit: &'a str,
    pub(crate) across: &'a str,
    pub(crate) headings: [&'a str; 2],
}

/// `None` without spots.
pub(crate) fn draw(words: &Words, spots: &[Spot]) -> Option<String> {
    let Words { unit, .. } = words;
    let grid_of = |of: fn(&Spot) -> f64| {
        let readings: Vec<Reading> = spots
            .iter()
            .map(|spot| Reading {
                s_over_l: spot.s_over_l,
                across_over_l: spot.across_over_l,
                recorded: of(spot),
                simulated: 0.0,
                accuracy: spot.noise,
            })
            .collect();
        Grid::of(&readings)
    };
    let before = grid_of(|spot| spot.before)?;
    let after = grid_of(|spot| spot.after)?;
    let inside = grid_of(|spot| f64::from(u8::from(spot.inside)))?;
    // The largest tenth of the cells saturates: a few shallow ones would leave the rest pale.
    let mut sizes: Vec<f64> = before
        .cells
        .iter()
        .flatten()
        .map(|cell| cell.residual.abs())
        .collect();
    sizes.sort_by(f64::total_cmp);
    let largest = sizes.get((sizes.len() * 9 / 10).min(sizes.len().saturating_sub(1)))?;
    let scale = Scale::of_residuals(*largest);
    let size = (WIDTH, HEIGHT);
    Some(sheet(size, words.title, words.subtitle, |area| {
        let (panels, side) = area.split_horizontally(px(WIDTH - BAR));
        let panels = panels.split_evenly((1, 2));
        for ((panel, heading), grid) in panels.iter().zip(words.headings).zip([&before, &after]) {
            let mut chart = frame_across(panel, heading, words.across, grid)?;
            map(&mut chart, grid, &scale, |cell| cell.residual)?;
            signs(&mut chart, grid)?;
            outline(&mut chart, &inside)?;
        }
        let label = format!("recorded - simulated{unit}");
        colour_bar(&side, (14.0, 46.0), HEIGHT - HEAD - 190.0, &label, &scale)?;
        let entries = [
            (Sign::Nothing, "+ recorded above, - below,".to_owned()),
            (Sign::Nothing, "by more than twice the noise".to_owned()),
            (
                Sign::Line(INK, super::axes::Stroke::Solid),
                "region of the mismatch".to_owned(),
            ),
            (Sign::Patch(FAINT.mix(1.0)), "no samples".to_owned()),
        ];
        legend(&side, (14.0, HEIGHT - HEAD - 118.0), &entries)
    }))
}

/// A sign in every cell whose median is further off than one reading scatters.
pub(super) fn signs(chart: &mut Chart, grid: &Grid) -> Drawn {
    let area = chart.plotting_area().strip_coord_spec();
    let (xs, ys) = area.get_pixel_range();
    for row in 0..grid.rows {
        for column in 0..grid.columns {
            let Some(cell) = grid.at(row, column) else {
                continue;
            };
            if cell.residual.abs() <= cell.accuracy {
                continue;
            }
            let (from, to) = grid.corners(row, column);
            let centre = chart.backend_coord(&((from.0 + to.0) / 2.0, (from.1 + to.1) / 2.0));
            let (x, y) = (centre.0 - xs.start, centre.1 - ys.start);
            let arm = px(2.4);
            let mut stroke = vec![(x - arm, y), (x + arm, y)];
            if cell.residual > 0.0 {
                stroke.extend([(x, y), (x, y - arm), (x, y + arm)]);
            }
            area.draw(&PathElement::new(
                stroke,
                INK.stroke_width(px(0.75).unsigned_abs()),
            ))?;
        }
    }
    Ok(())
}

/// The border of the cells of which half the samples or more are inside. A cell without samples goes with its neighbours.
fn outline(chart: &mut Chart, grid: &Grid) -> Drawn {
    let sampled = |row: usize, column: usize| {
        let is_cell = row < grid.rows && column < grid.columns;
        let cell = is_cell.then(|| grid.at(row, column)).flatten();
        cell.map(|cell| cell.recorded >= 0.5)
    };
    let goes_with = |row: usize, column: usize| {
        let mut votes = 0_i32;
        for r in row.saturating_sub(1)..=row + 1 {
            for c in column.saturating_sub(1)..=column + 1 {
                votes += sampled(r, c).map_or(0, |inside| if inside { 1 } else { -1 });
            }
        }
        votes > 0
    };
    let is_in = |row: Option<usize>, column: Option<usize>| {
        let (Some(row), Some(column)) = (row, column) else {
            return false;
        };
        row < grid.rows
            && column < grid.columns
            && sampled(row, column).unwrap_or_else(|| goes_with(row, column))
    };
    let mut edges = Vec::new();
    for row in 0..grid.rows {
        for column in (0..grid.columns).filter(|&column| is_in(Some(row), Some(column))) {
            let ((left, top), (right, bottom)) = grid.corners(row, column);
            let around = [
                (
                    (row.checked_sub(1), Some(column)),
                    [(left, top), (right, top)],
                ),
                (
                    (Some(row + 1), Some(column)),
                    [(left, bottom), (right, bottom)],
                ),
                (
                    (Some(row), column.checked_sub(1)),
                    [(left, top), (left, bottom)],
                ),
                (
                    (Some(row), Some(column + 1)),
                    [(right, top), (right, bottom)],
                ),
            ];
            edges.extend(
                around
                    .into_iter()
                    .filter(|((row, column), _)| !is_in(*row, *column))
                    .map(|(_, edge)| edge.to_vec()),
            );
        }
    }
    for (colour, width) in [(PAPER, 3.6), (INK, 1.7)] {
        let style = colour.stroke_width(px(width).unsigned_abs());
        chart.draw_series(
            edges
                .iter()
                .map(|edge| PathElement::new(edge.clone(), style)),
        )?;
    }
    Ok(())
}
