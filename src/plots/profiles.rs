//! Radial profiles at several depths, all on the same axes: medians, the middle 68 %, and a curve.

use plotters::prelude::*;

use super::axes::{Axis, Sign, Stroke, axes, band, legend, line, mark};
use super::colours::{SERIES, round_step};
use super::readings::Spread;
use super::sheet::{HEAD, INK, px, sheet};

const COLUMNS: usize = 3;
const WIDTH: f64 = 980.0;
const PANEL_HEIGHT: f64 = 240.0;
const LEGEND: f64 = 34.0;

/// One panel.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    pub(crate) heading: String,
    pub(crate) series: Vec<ProfileSeries>,
    /// Rising in its first coordinate.
    pub(crate) curve: Vec<(f64, f64)>,
}

/// What one drone, or one recording, contributes to a panel.
#[derive(Clone, Debug)]
pub(crate) struct ProfileSeries {
    /// Chooses the mark.
    pub(crate) mark: usize,
    /// Beside the fit, not in it.
    pub(crate) hollow: bool,
    /// Abscissa and values, rising in the abscissa.
    pub(crate) points: Vec<(f64, Spread)>,
}

/// What the axes and the signs say.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Words<'a> {
    pub(crate) title: &'a str,
    pub(crate) subtitle: &'a str,
    pub(crate) x: &'a str,
    pub(crate) y: &'a str,
    /// Of the marks, in the order of their numbers, hollow or not.
    pub(crate) marks: &'a [(String, bool)],
    pub(crate) curve: &'a str,
}

/// `None` without profiles.
pub(crate) fn draw(words: &Words, profiles: &[Profile]) -> Option<String> {
    if profiles.is_empty() {
        return None;
    }
    let points = || {
        profiles
            .iter()
            .flat_map(|profile| &profile.series)
            .flat_map(|series| &series.points)
    };
    let curves = || profiles.iter().flat_map(|profile| &profile.curve);
    let x_to = points()
        .map(|(x, _)| *x)
        .chain(curves().map(|(x, _)| *x))
        .fold(0.1, f64::max);
    let highest = points()
        .map(|(_, spread)| spread.high)
        .chain(curves().map(|(_, y)| *y))
        .fold(0.05, f64::max);
    let lowest = points().map(|(_, spread)| spread.low).fold(0.0, f64::min);
    let rows = profiles.len().div_ceil(COLUMNS);
    let height = HEAD + LEGEND + PANEL_HEIGHT * rows as f64;
    Some(sheet(
        (WIDTH, height),
        words.title,
        words.subtitle,
        |area| {
            let (signs, panels) = area.split_vertically(px(LEGEND));
            let entries = words
                .marks
                .iter()
                .enumerate()
                .map(|(series, (name, hollow))| {
                    (
                        Sign::Mark {
                            series,
                            hollow: *hollow,
                        },
                        name.clone(),
                    )
                });
            let entries = entries.chain([
                (Sign::Patch(SERIES[0].mix(0.16)), "middle 68 %".to_owned()),
                (Sign::Line(INK, Stroke::Solid), words.curve.to_owned()),
            ]);
            let mut x = 20.0;
            for (sign, text) in entries {
                let width = 44.0 + text.chars().count() as f64 * 6.0;
                legend(&signs, (x, 8.0), &[(sign, text)])?;
                x += width;
            }
            for (panel, profile) in panels.split_evenly((rows, COLUMNS)).iter().zip(profiles) {
                let x = Axis {
                    label: words.x,
                    from: 0.0,
                    to: x_to * 1.03,
                };
                let y = Axis {
                    label: words.y,
                    from: lowest.min(0.0),
                    to: highest.max(round_step(highest / 6.0)) * 1.05,
                };
                let mut chart = axes(panel, &profile.heading, x, y)?;
                for series in &profile.series {
                    let edges: Vec<(f64, f64, f64)> = series
                        .points
                        .iter()
                        .map(|(x, spread)| (*x, spread.low, spread.high))
                        .collect();
                    band(
                        &mut chart,
                        &edges,
                        SERIES[series.mark % SERIES.len()].mix(0.16),
                    )?;
                }
                line(&mut chart, &profile.curve, INK, 1.6, Stroke::Solid)?;
                for series in &profile.series {
                    for (x, spread) in &series.points {
                        mark(
                            &mut chart,
                            (*x, spread.median),
                            series.mark,
                            2.6,
                            series.hollow,
                        )?;
                    }
                }
            }
            Ok(())
        },
    ))
}
