//! The paper's expansion figure: half-width and centreline against depth, drone by drone, with the jet through them.

use plotters::prelude::*;

use airflow::{FAR_FIELD_FROM_S_OVER_L, Jet};

use super::axes::{Axis, Sign, Stroke, axes, band, bar, legend, line, mark};
use super::colours::SERIES;
use super::sheet::{Chart, Drawn, INK, SOFT, px, sheet};

const WIDTH: f64 = 980.0;
const HEIGHT: f64 = 540.0;
const LEGEND: f64 = 92.0;
/// Points along a curve.
const STEPS: usize = 60;

/// What is drawn.
#[derive(Clone, Debug)]
pub(crate) struct Expansion<'a> {
    pub(crate) title: &'a str,
    pub(crate) subtitle: &'a str,
    /// Drones, hollow where they are beside the fit.
    pub(crate) drones: &'a [(String, bool)],
    pub(crate) slices: &'a [ExpansionSlice],
    /// The jet through them, and what the legend calls it.
    pub(crate) jet: (&'a Jet, &'a str),
    /// How well the jet is known, where that is known.
    pub(crate) uncertainty: Option<&'a Uncertainty>,
    /// Another jet to compare with, and its name.
    pub(crate) other: Option<(&'a Jet, &'a str)>,
}

/// Standard deviations of `B`, `S` and `s₀`, and the correlations of `B` with `S`, `B` with `s₀`, `S` with `s₀`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Uncertainty {
    pub(crate) deviations: [f64; 3],
    pub(crate) correlations: [f64; 3],
}

impl Uncertainty {
    /// Standard deviation of a quantity by its slopes in `B`, `S` and `s₀`, to first order.
    fn of(&self, slopes: [f64; 3]) -> f64 {
        let [b, s, origin] = [0, 1, 2].map(|i| slopes[i] * self.deviations[i]);
        let [b_s, b_origin, s_origin] = self.correlations;
        let variance = b * b
            + s * s
            + origin * origin
            + 2.0 * (b * s * b_s + b * origin * b_origin + s * origin * s_origin);
        variance.max(0.0).sqrt()
    }
}

/// One slice of one drone's jet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExpansionSlice {
    /// Which of the drones.
    pub(crate) drone: usize,
    pub(crate) s_over_l: f64,
    pub(crate) half_width_over_l: f64,
    pub(crate) centreline_over_u_h: f64,
    /// 95 % intervals, where they are known.
    pub(crate) half_width_interval: Option<(f64, f64)>,
    pub(crate) centreline_interval: Option<(f64, f64)>,
}

/// A curve of the jet along its depth, and its slopes in `B`, `S` and `s₀`.
#[derive(Clone, Copy)]
struct Law {
    value: fn(&Jet, f64) -> f64,
    slopes: fn(&Jet, f64) -> [f64; 3],
}

/// Eq. 6 of the paper.
const HALF_WIDTH: Law = Law {
    value: |jet, s| jet.spreading * (s - jet.origin),
    slopes: |jet, s| [0.0, s - jet.origin, -jet.spreading],
};
/// Eq. 5 of the paper.
const CENTRELINE: Law = Law {
    value: |jet, s| jet.centreline / (s - jet.origin),
    slopes: |jet, s| {
        let sigma = s - jet.origin;
        [1.0 / sigma, 0.0, jet.centreline / (sigma * sigma)]
    },
};
/// Of a normal distribution: 95 % lie within so many standard deviations.
const WITHIN_95: f64 = 1.96;

/// `None` without slices.
pub(crate) fn draw(figure: &Expansion) -> Option<String> {
    let deepest = figure
        .slices
        .iter()
        .map(|slice| slice.s_over_l)
        .reduce(f64::max)?;
    let s_to = (deepest * 1.06).max(FAR_FIELD_FROM_S_OVER_L + 1.0);
    Some(sheet(
        (WIDTH, HEIGHT),
        figure.title,
        figure.subtitle,
        |area| {
            let (signs, panels) = area.split_vertically(px(LEGEND));
            key(&signs, figure)?;
            let panels = panels.split_evenly((1, 2));
            panel(
                &panels[0],
                figure,
                s_to,
                "half-width r_half / l",
                HALF_WIDTH,
                |slice| (slice.half_width_over_l, slice.half_width_interval),
            )?;
            panel(
                &panels[1],
                figure,
                s_to,
                "centreline speed U_C / U_H",
                CENTRELINE,
                |slice| (slice.centreline_over_u_h, slice.centreline_interval),
            )
        },
    ))
}

fn key(area: &super::sheet::Area, figure: &Expansion) -> Drawn {
    let (jet, name) = figure.jet;
    let drones = figure
        .drones
        .iter()
        .enumerate()
        .map(|(series, (name, hollow))| {
            let name = if *hollow {
                format!("{name} (not in the fit)")
            } else {
                name.clone()
            };
            (
                Sign::Mark {
                    series,
                    hollow: *hollow,
                },
                name,
            )
        })
        .collect::<Vec<_>>();
    let mut columns: Vec<Vec<(Sign, String)>> = Vec::new();
    for entry in drones {
        match columns.last_mut() {
            Some(column) if column.len() < 4 => column.push(entry),
            _ => columns.push(vec![entry]),
        }
    }
    let mut lines = vec![(
        Sign::Line(INK, Stroke::Solid),
        format!(
            "{name}: r_half/l = {:.5} (s/l {}), U_C/U_H = {:.2}/(s/l {})",
            jet.spreading,
            minus(jet.origin),
            jet.centreline,
            minus(jet.origin)
        ),
    )];
    if figure.uncertainty.is_some() {
        lines.push((Sign::Patch(INK.mix(0.16)), "its 95 % interval".into()));
    }
    if let Some((jet, name)) = figure.other {
        lines.push((
            Sign::Line(SERIES[2], Stroke::Dashed),
            format!(
                "{name}: {:.5}, {:.2}, origin {:.3}",
                jet.spreading, jet.centreline, jet.origin
            ),
        ));
    }
    lines.push((
        Sign::Line(SOFT, Stroke::Dashed),
        "2.5 l: the far field begins".into(),
    ));
    let mut x = 20.0;
    for column in &columns {
        legend(area, (x, 10.0), column)?;
        let widest = column.iter().map(|(_, name)| name.chars().count()).max();
        x += 56.0 + 6.2 * widest.unwrap_or(0) as f64;
    }
    legend(area, (x, 10.0), &lines)
}

/// `- -5.8` as `+ 5.8`.
fn minus(origin: f64) -> String {
    if origin < 0.0 {
        format!("+ {:.3}", -origin)
    } else {
        format!("- {origin:.3}")
    }
}

fn panel(
    area: &super::sheet::Area,
    figure: &Expansion,
    s_to: f64,
    label: &str,
    law: Law,
    value: impl Fn(&ExpansionSlice) -> (f64, Option<(f64, f64)>),
) -> Drawn {
    let abscissas = |from: f64| -> Vec<f64> {
        (0..=STEPS)
            .map(|i| from + (s_to - from) * i as f64 / STEPS as f64)
            .collect()
    };
    let from = FAR_FIELD_FROM_S_OVER_L;
    let highest = figure
        .slices
        .iter()
        .map(|slice| value(slice).0)
        .chain([from, s_to].map(|s| (law.value)(figure.jet.0, s)))
        .fold(0.0, f64::max);
    let x = Axis {
        label: "depth below the rotor plane s / l",
        from: 0.0,
        to: s_to,
    };
    let y = Axis {
        label,
        from: 0.0,
        to: highest * 1.08,
    };
    let mut chart = axes(area, "", x, y)?;
    line(
        &mut chart,
        &[(from, 0.0), (from, highest * 1.08)],
        SOFT,
        0.8,
        Stroke::Dashed,
    )?;
    if let Some(uncertainty) = figure.uncertainty {
        let edge = |s: f64| {
            let middle = (law.value)(figure.jet.0, s);
            let reach = WITHIN_95 * uncertainty.of((law.slopes)(figure.jet.0, s));
            (s, middle - reach, middle + reach)
        };
        let edges: Vec<(f64, f64, f64)> = abscissas(from).into_iter().map(edge).collect();
        band(&mut chart, &edges, INK.mix(0.16))?;
    }
    let curve = |jet: &Jet| -> Vec<(f64, f64)> {
        abscissas(from)
            .into_iter()
            .map(|s| (s, (law.value)(jet, s)))
            .collect()
    };
    if let Some((jet, _)) = figure.other {
        line(&mut chart, &curve(jet), SERIES[2], 1.6, Stroke::Dashed)?;
    }
    line(&mut chart, &curve(figure.jet.0), INK, 1.8, Stroke::Solid)?;
    marks(&mut chart, figure, highest * 1.08, value)
}

fn marks(
    chart: &mut Chart,
    figure: &Expansion,
    top: f64,
    value: impl Fn(&ExpansionSlice) -> (f64, Option<(f64, f64)>),
) -> Drawn {
    for slice in figure.slices {
        let (middle, interval) = value(slice);
        if let Some((low, high)) = interval {
            let colour = SERIES[slice.drone % SERIES.len()];
            bar(chart, slice.s_over_l, (low.max(0.0), high.min(top)), colour)?;
        }
        if (0.0..=top).contains(&middle) {
            let hollow = figure
                .drones
                .get(slice.drone)
                .is_some_and(|(_, hollow)| *hollow);
            mark(chart, (slice.s_over_l, middle), slice.drone, 3.4, hollow)?;
        }
    }
    Ok(())
}
