//! What several figures draw: axes, lines, marks that differ in shape, heat maps and their colour bars, legends.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::colours::{SERIES, Scale};
use super::sheet::{Area, Chart, Drawn, FAINT, INK, PAPER, SOFT, anchored, font, px};

/// What an axis says and how far it goes.
#[derive(Clone, Copy)]
pub(super) struct Axis<'a> {
    pub(super) label: &'a str,
    pub(super) from: f64,
    pub(super) to: f64,
}

/// A frame with axes; a heading goes above it. `from` may be larger than `to`: depth grows downwards.
pub(super) fn axes<'a, 'b>(
    area: &'a Area<'b>,
    heading: &str,
    x: Axis,
    y: Axis,
) -> Drawn<Chart<'a, 'b>> {
    let mut chart = ChartBuilder::on(area)
        .margin_top(px(if heading.is_empty() { 6.0 } else { 24.0 }))
        .margin_right(px(14.0))
        .margin_left(px(4.0))
        .margin_bottom(px(4.0))
        .x_label_area_size(px(38.0))
        .y_label_area_size(px(50.0))
        .build_cartesian_2d(x.from..x.to, y.from..y.to)?;
    let (width, height) = chart.plotting_area().dim_in_pixel();
    let labels =
        |length: u32, each: f64| (f64::from(length) / f64::from(px(each))).max(2.0) as usize;
    chart
        .configure_mesh()
        .disable_mesh()
        .axis_style(INK.stroke_width(px(0.75).unsigned_abs()))
        .set_all_tick_mark_size(px(4.0))
        .x_labels(labels(width, 55.0))
        .y_labels(labels(height, 34.0))
        .x_label_formatter(&|value| tick(*value))
        .y_label_formatter(&|value| tick(*value))
        .label_style(font(11.0, INK))
        .axis_desc_style(font(12.0, INK))
        .x_desc(x.label)
        .y_desc(y.label)
        .draw()?;
    if !heading.is_empty() {
        let (xs, _) = chart.plotting_area().get_pixel_range();
        let (left, _) = area.get_pixel_range();
        area.draw(&Text::new(
            heading.to_owned(),
            (xs.start - left.start, px(5.0)),
            super::sheet::bold(12.0, INK),
        ))?;
    }
    Ok(chart)
}

/// A tick's number without idle zeros, and never `-0`.
fn tick(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}

/// How a line looks where colour does not show.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Stroke {
    Solid,
    Dashed,
}

/// A line through points, those outside the frame cut off by leaving them out.
pub(super) fn line(
    chart: &mut Chart,
    points: &[(f64, f64)],
    colour: RGBColor,
    width: f64,
    stroke: Stroke,
) -> Drawn {
    let style = colour.stroke_width(px(width).unsigned_abs());
    let points = points.iter().copied();
    match stroke {
        Stroke::Solid => chart.draw_series(LineSeries::new(points, style))?,
        Stroke::Dashed => {
            chart.draw_series(DashedLineSeries::new(points, px(5.0), px(3.0), style))?
        }
    };
    Ok(())
}

/// The area between two curves over the same abscissas.
pub(super) fn band(chart: &mut Chart, edges: &[(f64, f64, f64)], colour: RGBAColor) -> Drawn {
    if edges.len() < 2 {
        return Ok(());
    }
    let mut outline: Vec<(f64, f64)> = edges.iter().map(|&(x, low, _)| (x, low)).collect();
    outline.extend(edges.iter().rev().map(|&(x, _, high)| (x, high)));
    chart.draw_series(std::iter::once(Polygon::new(outline, colour.filled())))?;
    Ok(())
}

/// Corners of the marks and how far they reach, so that equal areas look equally heavy; no corners: a disc.
const SHAPES: [(&[(f64, f64)], f64); 7] = [
    (&[], 1.0),
    (&[(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)], 0.89),
    (&[(0.0, -1.2), (1.04, 0.6), (-1.04, 0.6)], 1.2),
    (&[(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)], 1.25),
    (&[(0.0, 1.2), (1.04, -0.6), (-1.04, -0.6)], 1.2),
    // A plus.
    (
        &[
            (-0.4, -1.2),
            (0.4, -1.2),
            (0.4, -0.4),
            (1.2, -0.4),
            (1.2, 0.4),
            (0.4, 0.4),
            (0.4, 1.2),
            (-0.4, 1.2),
            (-0.4, 0.4),
            (-1.2, 0.4),
            (-1.2, -0.4),
            (-0.4, -0.4),
        ],
        1.0,
    ),
    // An hourglass.
    (&[(-1.0, -1.1), (1.0, -1.1), (-1.0, 1.1), (1.0, 1.1)], 1.1),
];

/// A mark at a place, its shape by number; hollow marks say "not part of the fit".
pub(super) fn mark(
    chart: &mut Chart,
    (x, y): (f64, f64),
    series: usize,
    size: f64,
    hollow: bool,
) -> Drawn {
    let centre = chart.backend_coord(&(x, y));
    let area = chart.plotting_area().strip_coord_spec();
    let (xs, ys) = area.get_pixel_range();
    mark_at(
        &area,
        (centre.0 - xs.start, centre.1 - ys.start),
        series,
        size,
        hollow,
    )
}

fn mark_at(area: &Area, at: (i32, i32), series: usize, size: f64, hollow: bool) -> Drawn {
    let colour = SERIES[series % SERIES.len()];
    // Equal areas look equally heavy.
    let (corners, reach) = SHAPES[series % SHAPES.len()];
    let line = colour.stroke_width(px(1.2).unsigned_abs());
    if corners.is_empty() {
        let radius = px(size * reach);
        if hollow {
            area.draw(&Circle::new(at, radius, PAPER.filled()))?;
            return area.draw(&Circle::new(at, radius, line));
        }
        return area.draw(&Circle::new(at, radius, colour.filled()));
    }
    let mut outline: Vec<(i32, i32)> = corners
        .iter()
        .map(|(x, y)| (at.0 + px(x * size * reach), at.1 + px(y * size * reach)))
        .collect();
    if !hollow {
        return area.draw(&Polygon::new(outline, colour.filled()));
    }
    area.draw(&Polygon::new(outline.clone(), PAPER.filled()))?;
    outline.push(outline[0]);
    outline.push(outline[1]);
    area.draw(&PathElement::new(outline, line))
}

/// A vertical bar through a mark: an interval.
pub(super) fn bar(chart: &mut Chart, x: f64, (low, high): (f64, f64), colour: RGBColor) -> Drawn {
    let style = colour.stroke_width(px(0.8).unsigned_abs());
    chart.draw_series(std::iter::once(PathElement::new(
        vec![(x, low), (x, high)],
        style,
    )))?;
    Ok(())
}

/// One entry of a legend.
pub(super) enum Sign {
    Mark { series: usize, hollow: bool },
    Line(RGBColor, Stroke),
    Patch(RGBAColor),
    Nothing,
}

/// Entries one below the other, from a place (px) in the area.
pub(super) fn legend(area: &Area, (x, y): (f64, f64), entries: &[(Sign, String)]) -> Drawn {
    for (index, (sign, text)) in entries.iter().enumerate() {
        let middle = y + 18.0 * index as f64;
        match sign {
            Sign::Mark { series, hollow } => {
                mark_at(area, (px(x + 11.0), px(middle)), *series, 3.6, *hollow)?;
            }
            Sign::Line(colour, stroke) => {
                let style = colour.stroke_width(px(1.8).unsigned_abs());
                let pieces: &[(f64, f64)] = match stroke {
                    Stroke::Solid => &[(0.0, 22.0)],
                    Stroke::Dashed => &[(0.0, 6.0), (8.0, 14.0), (16.0, 22.0)],
                };
                for (from, to) in pieces {
                    let ends = vec![(px(x + from), px(middle)), (px(x + to), px(middle))];
                    area.draw(&PathElement::new(ends, style))?;
                }
            }
            Sign::Patch(colour) => {
                let corners = [(px(x), px(middle - 6.0)), (px(x + 22.0), px(middle + 6.0))];
                area.draw(&Rectangle::new(corners, colour.filled()))?;
            }
            Sign::Nothing => {}
        }
        let indent = if matches!(sign, Sign::Nothing) {
            0.0
        } else {
            30.0
        };
        area.draw(&Text::new(
            text.clone(),
            (px(x + indent), px(middle)),
            anchored(font(12.0, INK), HPos::Left, VPos::Center),
        ))?;
    }
    Ok(())
}

/// The steps of a colour scale, upright, with their edges; from a place (px) in the area, so high (px).
pub(super) fn colour_bar(
    area: &Area,
    (x, y): (f64, f64),
    height: f64,
    label: &str,
    scale: &Scale,
) -> Drawn {
    let step_height = height / scale.steps as f64;
    let bottom = y + height;
    for step in 0..scale.steps {
        let (low, high) = (
            bottom - step_height * step as f64,
            bottom - step_height * (step + 1) as f64,
        );
        let corners = [(px(x), px(high)), (px(x + 16.0), px(low))];
        area.draw(&Rectangle::new(corners, scale.colour(step).filled()))?;
    }
    let outline = [(px(x), px(y)), (px(x + 16.0), px(bottom))];
    area.draw(&Rectangle::new(
        outline,
        SOFT.stroke_width(px(0.75).unsigned_abs()),
    ))?;
    for step in 0..=scale.steps {
        area.draw(&Text::new(
            signed_tick(scale.edge(step), scale.low < 0.0),
            (px(x + 22.0), px(bottom - step_height * step as f64)),
            anchored(font(10.5, INK), HPos::Left, VPos::Center),
        ))?;
    }
    area.draw(&Text::new(
        label.to_owned(),
        (px(x), px(y - 12.0)),
        anchored(font(12.0, INK), HPos::Left, VPos::Center),
    ))
}

fn signed_tick(value: f64, signed: bool) -> String {
    let text = tick(value);
    if signed && value > 0.0 {
        format!("+{text}")
    } else {
        text
    }
}

/// Cells of a heat map, a colour at a time; neighbours in a row with the same step become one.
pub(super) fn cells(
    chart: &mut Chart,
    scale: &Scale,
    rows: impl Iterator<Item = Vec<Option<Cell>>>,
) -> Drawn {
    let mut joined: Vec<Cell> = Vec::new();
    for row in rows {
        let mut open: Option<Cell> = None;
        for cell in row.into_iter().chain([None]) {
            open = match (open, cell) {
                (Some(left), Some(right)) if left.step == right.step => Some(Cell {
                    to: right.to,
                    ..left
                }),
                (left, right) => {
                    joined.extend(left);
                    right
                }
            };
        }
    }
    joined.sort_by_key(|cell| cell.step);
    chart.draw_series(joined.into_iter().map(|cell| {
        let colour = scale.colour(cell.step);
        Rectangle::new([cell.from, cell.to], colour.filled())
    }))?;
    Ok(())
}

/// One cell of a heat map, from corner to corner.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    pub(super) from: (f64, f64),
    pub(super) to: (f64, f64),
    pub(super) step: usize,
}

/// Where nothing was measured.
pub(super) fn ground(chart: &mut Chart) -> Drawn {
    chart.plotting_area().fill(&FAINT)
}
