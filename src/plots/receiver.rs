//! A drone below others: what it recorded in time beside the simulation, and one against the other.

use plotters::prelude::*;

use super::axes::{Axis, Sign, Stroke, axes, band, legend, line, mark};
use super::colours::SERIES;
use super::readings::spread;
use super::sheet::{Area, Chart, Drawn, HEAD, INK, PAPER, px, sheet};

const WIDTH: f64 = 1100.0;
const SCATTER: f64 = 420.0;
const STRIP: f64 = 190.0;
const LEGEND: f64 = 28.0;
/// More strips than these would be too flat to read: the drones with the most simulated air come first.
const STRIPS: usize = 4;
/// Moments drawn along a strip.
const MOMENTS: usize = 260;
/// More points than these are counted in cells.
const POINTS: usize = 400;
/// Cells of the scatter along each axis.
const CELLS: usize = 56;
/// Shades of the counts between paper and ink, each of them five times as many as the last.
const SHADES: [f64; 6] = [0.12, 0.27, 0.42, 0.57, 0.75, 1.0];
/// From one shade to the next.
const SHADE_RATIO: f64 = 5.0;
/// One value in so many may lie beyond either end of the scatter; of a strip, none.
pub(super) const BEYOND: usize = 2000;

/// One drone's channel over time.
#[derive(Clone, Debug)]
pub(crate) struct Trace {
    pub(crate) name: String,
    /// Time (s), recorded, simulated; times rise.
    pub(crate) moments: Vec<(f64, f64, f64)>,
}

impl Trace {
    /// Mean square of the simulated values about their mean: how much there is to see.
    fn movement(&self) -> f64 {
        let count = self.moments.len().max(1) as f64;
        let mean = self
            .moments
            .iter()
            .map(|(_, _, simulated)| simulated)
            .sum::<f64>()
            / count;
        self.moments
            .iter()
            .map(|(_, _, simulated)| (simulated - mean).powi(2))
            .sum::<f64>()
            / count
    }
}

/// `quantity`: `vertical force (N)` and the like; `None` without moments.
pub(crate) fn draw(
    title: &str,
    subtitle: &str,
    quantity: &str,
    traces: &[Trace],
) -> Option<String> {
    let mut shown: Vec<&Trace> = traces
        .iter()
        .filter(|trace| trace.moments.len() > 1)
        .collect();
    shown.sort_by(|a, b| b.movement().total_cmp(&a.movement()));
    let all: Vec<(f64, f64)> = shown
        .iter()
        .flat_map(|trace| {
            trace
                .moments
                .iter()
                .map(|&(_, recorded, simulated)| (recorded, simulated))
        })
        .collect();
    let (low, high) = range(&all, BEYOND)?;
    shown.truncate(STRIPS);
    let height = HEAD + LEGEND + (STRIP * shown.len() as f64).max(SCATTER - 20.0);
    Some(sheet((WIDTH, height), title, subtitle, |area| {
        let (signs, panels) = area.split_vertically(px(LEGEND));
        let entries = [
            (
                20.0,
                Sign::Line(SERIES[3], Stroke::Solid),
                "recorded (mean, band: middle 68 % of each moment)",
            ),
            (370.0, Sign::Line(INK, Stroke::Dashed), "simulated"),
            (
                470.0,
                Sign::Line(SERIES[0], Stroke::Solid),
                "right: recorded = simulated; darker: more samples, fivefold a shade",
            ),
        ];
        for (x, sign, text) in entries {
            legend(&signs, (x, 6.0), &[(sign, text.to_owned())])?;
        }
        let (strips, scatter) = panels.split_horizontally(px(WIDTH - SCATTER));
        for (strip, trace) in strips.split_evenly((shown.len(), 1)).iter().zip(&shown) {
            time(strip, trace, quantity)?;
        }
        let (square, _) = scatter.split_vertically(px(SCATTER - 20.0));
        let heading = "recorded against simulated";
        against(&square, (heading, "simulated"), &all, quantity, (low, high))
    }))
}

/// The range that holds all but one of `beyond` values on each side, a little widened.
pub(super) fn range(all: &[(f64, f64)], beyond: usize) -> Option<(f64, f64)> {
    let mut values: Vec<f64> = all
        .iter()
        .flat_map(|&(recorded, simulated)| [recorded, simulated])
        .collect();
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    let (low, high) = (values[last / beyond], values[last - last / beyond]);
    let margin = 0.04 * (high - low).max(1e-6);
    Some((low - margin, high + margin))
}

fn time(area: &Area, trace: &Trace, quantity: &str) -> Drawn {
    let values: Vec<(f64, f64)> = trace
        .moments
        .iter()
        .map(|&(_, recorded, simulated)| (recorded, simulated))
        .collect();
    let (Some(first), Some(last), Some((low, high))) = (
        trace.moments.first(),
        trace.moments.last(),
        range(&values, usize::MAX),
    ) else {
        return Ok(());
    };
    let x = Axis {
        label: "time (s)",
        from: first.0,
        to: last.0,
    };
    let y = Axis {
        label: quantity,
        from: low,
        to: high,
    };
    let mut chart = axes(area, &trace.name, x, y)?;
    let each = trace.moments.len().div_ceil(MOMENTS);
    let inside = |value: f64| value.clamp(low, high);
    let mut recorded = Vec::new();
    let mut simulated = Vec::new();
    let mut edges = Vec::new();
    for chunk in trace.moments.chunks(each) {
        let mean = |of: fn(&(f64, f64, f64)) -> f64| {
            chunk.iter().map(of).sum::<f64>() / chunk.len() as f64
        };
        let t_s = mean(|moment| moment.0);
        recorded.push((t_s, inside(mean(|moment| moment.1))));
        simulated.push((t_s, inside(mean(|moment| moment.2))));
        if let Some(found) = spread(chunk.iter().map(|moment| moment.1).collect()) {
            edges.push((t_s, inside(found.low), inside(found.high)));
        }
    }
    if each > 1 {
        band(&mut chart, &edges, SERIES[3].mix(0.25))?;
    }
    line(&mut chart, &recorded, SERIES[3], 1.1, Stroke::Solid)?;
    line(&mut chart, &simulated, INK, 1.4, Stroke::Dashed)
}

/// Headed by the first of two words, with the other on the axis of what is predicted.
pub(super) fn against(
    area: &Area,
    (heading, predicted): (&str, &str),
    all: &[(f64, f64)],
    quantity: &str,
    (low, high): (f64, f64),
) -> Drawn {
    let (x_label, y_label) = (
        format!("{predicted} {quantity}"),
        format!("recorded {quantity}"),
    );
    let x = Axis {
        label: &x_label,
        from: low,
        to: high,
    };
    let y = Axis {
        label: &y_label,
        from: low,
        to: high,
    };
    let mut chart = axes(area, heading, x, y)?;
    if all.len() <= POINTS {
        for &(recorded, simulated) in all {
            if (low..=high).contains(&recorded) && (low..=high).contains(&simulated) {
                mark(&mut chart, (simulated, recorded), 0, 1.5, false)?;
            }
        }
    } else {
        counts(&mut chart, all, (low, high))?;
    }
    line(
        &mut chart,
        &[(low, low), (high, high)],
        SERIES[0],
        1.4,
        Stroke::Solid,
    )
}

fn counts(chart: &mut Chart, all: &[(f64, f64)], (low, high): (f64, f64)) -> Drawn {
    let mut counts = vec![0_u32; CELLS * CELLS];
    let cell = |value: f64| {
        let place = (value - low) / (high - low) * CELLS as f64;
        (0.0..CELLS as f64)
            .contains(&place)
            .then_some(place as usize)
    };
    for &(recorded, simulated) in all {
        if let (Some(row), Some(column)) = (cell(recorded), cell(simulated)) {
            counts[row * CELLS + column] += 1;
        }
    }
    let edge = |index: usize| low + (high - low) * index as f64 / CELLS as f64;
    let mut shaded: Vec<(usize, usize)> = counts
        .iter()
        .enumerate()
        .filter(|(_, count)| **count > 0)
        .map(|(index, &count)| {
            let shade = f64::from(count).log(SHADE_RATIO) as usize;
            (shade.min(SHADES.len() - 1), index)
        })
        .collect();
    shaded.sort_unstable();
    chart.draw_series(shaded.into_iter().map(|(shade, index)| {
        let (row, column) = (index / CELLS, index % CELLS);
        let corners = [(edge(column), edge(row)), (edge(column + 1), edge(row + 1))];
        Rectangle::new(corners, blend(SHADES[shade]).filled())
    }))?;
    Ok(())
}

/// Between paper and ink.
fn blend(part: f64) -> RGBColor {
    let between = |from: u8, to: u8| {
        (f64::from(from) + part * (f64::from(to) - f64::from(from))).round() as u8
    };
    RGBColor(
        between(PAPER.0, INK.0),
        between(PAPER.1, INK.1),
        between(PAPER.2, INK.2),
    )
}
