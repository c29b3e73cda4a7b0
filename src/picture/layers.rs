//! What is drawn, layer by layer, the same for both views.

use nalgebra::Point3;
use planner::plan::{AtEnd, AtStart, DronePlan, Plan, ShapeEntry};

use super::canvas::{Canvas, escape};
use super::labels::{Labels, Style};
use super::line_style;
use super::view::{Eye, Layout, View};
use crate::wording::metres;

/// Ticks are at least this far apart (px).
const TICK_PX: f64 = 64.0;
const GREY: &str = "#52606d";

/// The room: its floor or its silhouette, with a metric grid.
pub(super) fn floor(canvas: &mut Canvas, view: &View) {
    let View {
        left_px: x,
        top_px: y,
        width_px: w,
        height_px: h,
        ..
    } = *view;
    canvas.put(format_args!(
        r##"<rect x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}" fill="#ffffff"/>"##
    ));
    let mut lines = String::new();
    for (at, _) in ticks(view, Axis::Right) {
        lines += &format!("M{at:.1} {y:.1}v{h:.1}");
    }
    for (at, _) in ticks(view, Axis::Up) {
        lines += &format!("M{x:.1} {at:.1}h{w:.1}");
    }
    canvas.put(format_args!(
        r##"<path d="{lines}" stroke="#e4e7eb" stroke-width="1" fill="none"/>"##
    ));
}

/// Solids in grey; from the side they let the lines behind them through.
pub(super) fn obstacles(canvas: &mut Canvas, view: &View, plan: &Plan) {
    let style = match view.eye {
        Eye::Above => r##"fill="#c3cad2" stroke="#7b8794" stroke-width="0.8""##,
        Eye::Side => r##"fill="#9aa5b1" fill-opacity="0.32" stroke="#7b8794" stroke-width="0.8""##,
    };
    canvas.group("obstacles", |canvas| {
        for obstacle in &plan.obstacles {
            let name = escape(&obstacle.name);
            match &obstacle.shape {
                ShapeEntry::Box { min_m, max_m } => rectangle(canvas, view, [min_m, max_m], style, &name),
                ShapeEntry::Cylinder { base_m, radius_m, height_m } => {
                    let (x, y) = view.at(base_m);
                    if view.eye == Eye::Above {
                        let r = radius_m * view.px_per_m;
                        canvas.put(format_args!(
                            r#"<circle cx="{x:.1}" cy="{y:.1}" r="{r:.1}" {style}><title>{name}</title></circle>"#
                        ));
                        continue;
                    }
                    let low = base_m - nalgebra::Vector3::new(*radius_m, 0.0, 0.0);
                    let high = base_m + nalgebra::Vector3::new(*radius_m, 0.0, *height_m);
                    rectangle(canvas, view, [&low, &high], style, &name);
                }
                ShapeEntry::Mesh { vertices_m, triangles, .. } => {
                    mesh(canvas, view, vertices_m, triangles, &name);
                }
            }
        }
    });
}

fn rectangle(
    canvas: &mut Canvas,
    view: &View,
    corners: [&Point3<f64>; 2],
    style: &str,
    name: &str,
) {
    let (left, bottom) = view.at(corners[0]);
    let (right, top) = view.at(corners[1]);
    canvas.put(format_args!(
        r#"<rect x="{left:.1}" y="{top:.1}" width="{:.1}" height="{:.1}" {style}><title>{name}</title></rect>"#,
        right - left,
        bottom - top
    ));
}

fn mesh(
    canvas: &mut Canvas,
    view: &View,
    vertices_m: &[Point3<f64>],
    triangles: &[[u32; 3]],
    name: &str,
) {
    let mut path = String::new();
    for triangle in triangles {
        let corners: Vec<String> = triangle
            .iter()
            .filter_map(|&index| vertices_m.get(index as usize))
            .map(|vertex| view.at(vertex))
            .map(|(x, y)| format!("{x:.1} {y:.1}"))
            .collect();
        path += &format!("M{}Z", corners.join("L"));
    }
    canvas.put(format_args!(
        r##"<path d="{path}" fill="#9aa5b1" fill-opacity="0.5" stroke="#7b8794" stroke-width="0.3"><title>{name}</title></path>"##
    ));
}

/// Places with a limit on their air.
pub(super) fn zones(canvas: &mut Canvas, view: &View, plan: &Plan, labels: &mut Labels) {
    let style = r##"fill="#e8a33d" fill-opacity="0.18" stroke="#b7791f" stroke-width="1.2" stroke-dasharray="5 3""##;
    for zone in &plan.zones {
        rectangle(
            canvas,
            view,
            [&zone.min_m, &zone.max_m],
            style,
            &escape(&zone.name),
        );
        let (x, y) = view.at(&nalgebra::center(&zone.min_m, &zone.max_m));
        let text = format!("{}: {} m/s", zone.name, metres(zone.air_limit_mps));
        labels.beside(
            canvas,
            (x, y),
            -6.0,
            &Style {
                size_px: 11.0,
                colour: "#8a5a10",
                weight: "normal",
            },
            &text,
        );
    }
}

/// Every path, in its drone's colour; pointing at one names it.
pub(super) fn trajectories(canvas: &mut Canvas, view: &View, plan: &Plan) {
    let width = if plan.drones.len() <= 20 { 2.0 } else { 1.2 };
    canvas.group("paths", |canvas| {
        for (index, drone) in plan.drones.iter().enumerate() {
            let (colour, dashes) = line_style(index);
            let mut path = String::new();
            let mut last = None;
            for point in &drone.trajectory.position_m {
                let (x, y) = view.at(point);
                let here = format!("{x:.1} {y:.1}");
                if last.as_ref() != Some(&here) {
                    path += if last.is_none() { "M" } else { "L" };
                    path += &here;
                }
                last = Some(here);
            }
            canvas.put(format_args!(
                r#"<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round" stroke-linecap="round" stroke-opacity="0.85"{dashes}><title>{}</title></path>"#,
                escape(&tooltip(drone))
            ));
        }
    });
}

fn tooltip(drone: &DronePlan) -> String {
    format!(
        "{}: {}, arrives {:.1} s",
        drone.name, drone.airframe.name, drone.arrives_s
    )
}

/// Starts hollow, goals filled; square where the drone stands instead of hovering.
pub(super) fn markers(canvas: &mut Canvas, view: &View, plan: &Plan, labels: &mut Labels) {
    let radius = marker_px(plan);
    canvas.group("ends", |canvas| {
        for (index, drone) in plan.drones.iter().enumerate() {
            let (Some(start), Some(end)) = ends(view, drone) else {
                continue;
            };
            let (colour, _) = line_style(index);
            let hollow = format!(r##"fill="#fcfcfa" stroke="{colour}" stroke-width="1.6""##);
            marker(
                canvas,
                start,
                radius,
                drone.at_start == AtStart::Landed,
                &hollow,
            );
            labels.keep_clear(start, radius);
            if drone.trajectory.position_m.len() > 1 && drone.at_end != AtEnd::Leave {
                let filled = format!(r##"fill="{colour}" stroke="#fcfcfa" stroke-width="0.8""##);
                marker(canvas, end, radius, drone.at_end == AtEnd::Land, &filled);
                labels.keep_clear(end, radius);
            }
        }
    });
}

fn marker(canvas: &mut Canvas, (x, y): (f64, f64), radius: f64, square: bool, style: &str) {
    if square {
        canvas.put(format_args!(
            r#"<rect x="{:.1}" y="{:.1}" width="{:.1}" height="{:.1}" {style}/>"#,
            x - radius,
            y - radius,
            2.0 * radius,
            2.0 * radius
        ));
    } else {
        canvas.put(format_args!(
            r#"<circle cx="{x:.1}" cy="{y:.1}" r="{radius:.1}" {style}/>"#
        ));
    }
}

fn marker_px(plan: &Plan) -> f64 {
    if plan.drones.len() <= 40 { 4.5 } else { 2.8 }
}

fn ends(view: &View, drone: &DronePlan) -> (Option<(f64, f64)>, Option<(f64, f64)>) {
    let points = &drone.trajectory.position_m;
    (
        points.first().map(|point| view.at(point)),
        points.last().map(|point| view.at(point)),
    )
}

/// Names at the goals, then at the starts, as far as there is room.
pub(super) fn names(canvas: &mut Canvas, view: &View, plan: &Plan, labels: &mut Labels) {
    let gap = marker_px(plan) + 2.0;
    let size_px = if plan.drones.len() <= 40 { 11.0 } else { 8.0 };
    canvas.group("names", |canvas| {
        for at_goal in [true, false] {
            for (index, drone) in plan.drones.iter().enumerate() {
                let (start, end) = ends(view, drone);
                let Some(at) = (if at_goal { end } else { start }) else {
                    continue;
                };
                let style = Style {
                    size_px,
                    colour: line_style(index).0,
                    weight: if at_goal { "bold" } else { "normal" },
                };
                labels.beside(canvas, at, gap, &style, &drone.name);
            }
        }
    });
}

/// Frame, ticks in metres, caption.
pub(super) fn axes(canvas: &mut Canvas, view: &View) {
    let View {
        left_px: x,
        top_px: y,
        width_px: w,
        height_px: h,
        ..
    } = *view;
    let (caption, up_name) = match view.eye {
        Eye::Above => ("from above", "y (m)"),
        Eye::Side => ("from the side, along y", "z (m)"),
    };
    canvas.put(format_args!(
        r##"<rect x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}" fill="none" stroke="#3e4c59" stroke-width="1.2"/><text x="{x:.1}" y="{:.1}" font-weight="bold">{caption}</text>"##,
        y - 9.0
    ));
    let bottom = y + h;
    for (at, label) in ticks(view, Axis::Right) {
        canvas.put(format_args!(
            r#"<text x="{at:.1}" y="{:.1}" text-anchor="middle" fill="{GREY}">{label}</text>"#,
            bottom + 16.0
        ));
    }
    for (at, label) in ticks(view, Axis::Up) {
        canvas.put(format_args!(
            r#"<text x="{:.1}" y="{:.1}" text-anchor="end" fill="{GREY}">{label}</text>"#,
            x - 7.0,
            at + 4.0
        ));
    }
    let (middle_x, middle_y) = (x + w / 2.0, y + h / 2.0);
    canvas.put(format_args!(
        r#"<text x="{middle_x:.1}" y="{:.1}" text-anchor="middle" fill="{GREY}">x (m)</text><text transform="translate({:.1} {middle_y:.1}) rotate(-90)" text-anchor="middle" fill="{GREY}">{up_name}</text>"#,
        bottom + 34.0,
        x - 38.0
    ));
    if view.eye == Eye::Above {
        scale_bar(canvas, view);
    }
}

fn scale_bar(canvas: &mut Canvas, view: &View) {
    let length_m = tick_step_m(view.px_per_m);
    let right = view.left_px + view.width_px;
    let (left, y) = (right - length_m * view.px_per_m, view.top_px - 10.0);
    canvas.put(format_args!(
        r##"<path d="M{left:.1} {:.1}v6M{left:.1} {y:.1}H{right:.1}M{right:.1} {:.1}v6" stroke="#3e4c59" stroke-width="1.5" fill="none"/><text x="{:.1}" y="{:.1}" text-anchor="end">{} m</text>"##,
        y - 3.0,
        y - 3.0,
        left - 6.0,
        y + 4.0,
        metres(length_m)
    ));
}

#[derive(Clone, Copy)]
enum Axis {
    Right,
    Up,
}

/// Places on the sheet (px) and their labels in metres.
fn ticks(view: &View, axis: Axis) -> Vec<(f64, String)> {
    let (low, high) = (&view.bounds_m.min, &view.bounds_m.max);
    let (low_m, high_m) = match axis {
        Axis::Right => (low.x, high.x),
        Axis::Up => (view.up(low), view.up(high)),
    };
    let step_m = tick_step_m(view.px_per_m);
    let first = (low_m / step_m - 1e-9).ceil() as i64;
    let last = (high_m / step_m + 1e-9).floor() as i64;
    (first..=last)
        .map(|number| {
            let at_m = number as f64 * step_m;
            let offset_px = (at_m - low_m) * view.px_per_m;
            let at_px = match axis {
                Axis::Right => view.left_px + offset_px,
                Axis::Up => view.top_px + view.height_px - offset_px,
            };
            (at_px, metres(at_m))
        })
        .collect()
}

/// 1, 2 or 5 times a power of ten (m).
fn tick_step_m(px_per_m: f64) -> f64 {
    let least_m = TICK_PX / px_per_m;
    let power = 10_f64.powf(least_m.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .find(|factor| factor * power >= least_m);
    factor.unwrap_or(10.0) * power
}

/// What the signs mean, below the drawing.
pub(super) fn legend(canvas: &mut Canvas, layout: &Layout, plan: &Plan, worst: bool) {
    let mut entries = vec![
        (
            r##"<circle cx="8" cy="-4" r="4.5" fill="#fcfcfa" stroke="#332288" stroke-width="1.6"/>"##,
            "start",
        ),
        (
            r##"<circle cx="8" cy="-4" r="4.5" fill="#332288"/>"##,
            "goal",
        ),
        (
            r##"<path d="M5 -14h6v4h1l4 12h-16l4 -12h1z" fill="url(#air)" fill-opacity="0.4" stroke="#2b7bba" stroke-opacity="0.6"/>"##,
            "wake of a hovering drone: column, then half-width",
        ),
    ];
    let lands =
        |drone: &DronePlan| drone.at_start == AtStart::Landed || drone.at_end == AtEnd::Land;
    if plan.drones.iter().any(lands) {
        entries.push((
            r##"<rect x="3.5" y="-8.5" width="9" height="9" fill="#332288"/>"##,
            "landed: no wake",
        ));
    }
    if worst {
        entries.push((
            r##"<circle cx="8" cy="-4" r="6" fill="none" stroke="#b3243b" stroke-width="2.2"/>"##,
            "worst air, and the wake it comes from",
        ));
    }
    if !plan.obstacles.is_empty() {
        entries.push((
            r##"<rect x="1" y="-10" width="14" height="11" fill="#c3cad2" stroke="#7b8794"/>"##,
            "obstacle",
        ));
    }
    if !plan.zones.is_empty() {
        entries.push((
            r##"<rect x="1" y="-10" width="14" height="11" fill="#e8a33d" fill-opacity="0.18" stroke="#b7791f" stroke-dasharray="4 2"/>"##,
            "zone with a limit on its air",
        ));
    }
    let (mut x, mut y) = (28.0, layout.height_px - 48.0);
    for (sign, text) in entries {
        // Sign, gap, letters of 12 px, gap.
        let width = 22.0 + text.chars().count() as f64 * 6.2 + 18.0;
        if x + width > layout.width_px {
            (x, y) = (28.0, y + 22.0);
        }
        canvas.put(format_args!(
            r#"<g transform="translate({x:.1} {y:.1})">{sign}<text x="22">{text}</text></g>"#
        ));
        x += width;
    }
}
