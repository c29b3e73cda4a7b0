//! Recorded minus simulated over the wake: where, which way, and whether more than the instrument could be off.

use plotters::prelude::*;

use super::axes::{Sign, Stroke, colour_bar, legend, line};
use super::before_after::signs;
use super::colours::Scale;
use super::field::{frame, map};
use super::readings::{Grid, Reading};
use super::sheet::{Chart, Drawn, FAINT, HEAD, INK, PAPER, px, sheet};
use airflow::Jet;

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 560.0;
const BAR: f64 = 330.0;

/// Readings in `unit`, `accuracy` in words; `None` without any.
pub(crate) fn draw(
    title: &str,
    subtitle: &str,
    (unit, accuracy): (&str, &str),
    readings: &[Reading],
    jet: &Jet,
) -> Option<String> {
    let grid = Grid::of(readings)?;
    // The largest few of the cells saturate.
    let mut sizes: Vec<f64> = grid
        .cells
        .iter()
        .flatten()
        .map(|cell| cell.residual.abs())
        .collect();
    sizes.sort_by(f64::total_cmp);
    let largest = sizes.get((sizes.len() * 97 / 100).min(sizes.len().saturating_sub(1)))?;
    let scale = Scale::of_residuals(*largest);
    Some(sheet((WIDTH, HEIGHT), title, subtitle, |area| {
        let (panel, side) = area.split_horizontally(px(WIDTH - BAR));
        let mut chart = frame(&panel, "", &grid)?;
        map(&mut chart, &grid, &scale, |cell| cell.residual)?;
        signs(&mut chart, &grid)?;
        half_width(&mut chart, &grid, jet)?;
        let label = format!("recorded - simulated ({unit})");
        colour_bar(&side, (12.0, 34.0), HEIGHT - HEAD - 120.0, &label, &scale)?;
        let entries = [
            (
                Sign::Nothing,
                "+ recorded above, - below, by more than".to_owned(),
            ),
            (Sign::Nothing, accuracy.to_owned()),
            (
                Sign::Line(INK, Stroke::Dashed),
                "half-width of the simulated jet".to_owned(),
            ),
            (Sign::Patch(FAINT.mix(1.0)), "no samples".to_owned()),
        ];
        legend(&side, (90.0, 60.0), &entries)
    }))
}

fn half_width(chart: &mut Chart, grid: &Grid, jet: &Jet) -> Drawn {
    for sign in [-1.0, 1.0] {
        let inside: Vec<(f64, f64)> = (0..=40)
            .map(|i| grid.s_from + (grid.s_to - grid.s_from) * f64::from(i) / 40.0)
            .map(|s| (sign * jet.spreading * (s - jet.origin), s))
            .filter(|(r, _)| r.abs() <= grid.across_to)
            .collect();
        line(chart, &inside, PAPER, 2.6, Stroke::Solid)?;
        line(chart, &inside, INK, 1.2, Stroke::Dashed)?;
    }
    Ok(())
}
