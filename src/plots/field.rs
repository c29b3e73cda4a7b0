//! Measured and simulated speed side by side: a slice through the axis of the wake, the same
//! colours on both.
//!
//! Across: distance from the axis over the motor distance; down: depth over the motor distance;
//! colour: speed over U_H.

use airflow::{FAR_FIELD_FROM_S_OVER_L, Jet};

use super::canvas::{Letters, solid};
use super::colours::{INK, PAPER, SOFT, Scale};
use super::grid::{Grid, SIGNED};
use super::legend::{colour_bar, sheet};
use super::readings::{Reading, places};

/// Speeds over U_H whose lines are drawn: they can be read without the colours.
const LINES: [f64; 4] = [0.1, 0.25, 0.5, 1.0];
const SIZE: (f64, f64) = (980.0, 560.0);
const BAR: f64 = 110.0;

/// Readings are speeds over U_H; the jet's lines begin where its far field does, unless it is
/// `extrapolated` upwards. `None` without readings.
pub(super) fn draw(
    title: (&str, &str),
    readings: &[Reading],
    jet: &Jet,
    extrapolated: bool,
) -> Option<String> {
    let grid = Grid::of(&places(readings))?;
    let measured = grid.medians(|index| readings[index].recorded);
    let simulated = grid.medians(|index| readings[index].simulated);
    let all = measured.iter().chain(&simulated).flatten();
    let scale = Scale::of_speeds(all.copied().fold(0.05, f64::max));
    let far_from = FAR_FIELD_FROM_S_OVER_L;
    let lines_from = if extrapolated { 0.0 } else { far_from };
    let (mut canvas, below) = sheet(SIZE, title, &[]);
    let (panels, side) = below.split_right(BAR);
    let headings = ["measured", "simulated at the same samples"];
    let shown = headings.iter().zip([measured, simulated]);
    for (panel, (heading, values)) in panels.grid(1, 2).into_iter().zip(shown) {
        let chart = grid.draw(&mut canvas, panel, (heading, SIGNED), (&scale, &values));
        let ((_, across_to), (s_to, s_from)) = (chart.x, chart.y);
        for speed in LINES {
            let side = iso_speed(jet, speed, (s_from.max(lines_from), s_to));
            let is_light = speed <= 0.55 * scale.high;
            let colour = if is_light { PAPER } else { INK };
            // In runs of what is inside the frame: nothing is drawn along its edge.
            for run in side.split(|(r, _)| *r > across_to) {
                for sign in [-1.0, 1.0] {
                    let line = || run.iter().map(|(r, s)| (sign * r, *s));
                    // Light lines show on cells without samples by their edge.
                    if is_light {
                        chart.line(&mut canvas, line(), &solid(SOFT, 2.0));
                    }
                    chart.line(&mut canvas, line(), &solid(colour, 1.1));
                }
            }
            // The label stands on the right branch, where it is widest and inside.
            let end_of_labels = s_to - 0.06 * (s_to - s_from);
            let inside = |(r, s): &(f64, f64)| *r < 0.86 * across_to && *s < end_of_labels;
            let labels = side.into_iter().filter(inside);
            if let Some(place) = labels.max_by(|a, b| a.0.total_cmp(&b.0)) {
                let (x, y) = chart.at(place);
                let letters = Letters::new(11.0, colour);
                canvas.text((x + 2.0, y + 8.0), &speed.to_string(), &letters);
            }
        }
    }
    let bar = side.inset([12.0, 36.0, 0.0, 64.0]);
    colour_bar(&mut canvas, bar, "speed / U_H", &scale);
    Some(canvas.finish())
}

/// Where the jet's axial speed is a part of U_H, by distance from the axis and depth: r = r_half
/// √((√(U_C/U) - 1)/(√2 - 1)). It closes on the axis where U_C = U.
fn iso_speed(jet: &Jet, speed: f64, (s_from, s_to): (f64, f64)) -> Vec<(f64, f64)> {
    let end = (jet.centreline / speed + jet.origin).min(s_to);
    if end <= s_from {
        return Vec::new();
    }
    let point = |i: i32| {
        let s = s_from + (end - s_from) * f64::from(i) / 40.0;
        let sigma = s - jet.origin;
        let part = (jet.centreline / sigma / speed).sqrt() - 1.0;
        let xi = (part.max(0.0) / (std::f64::consts::SQRT_2 - 1.0)).sqrt();
        (jet.spreading * sigma * xi, s)
    };
    (0..=40).map(point).collect()
}
