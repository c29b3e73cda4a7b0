//! What the plan holds, layer by layer, the same for both views.

use nalgebra::Point3;
use planner::plan::{AtEnd, AtStart, DronePlan, Plan, ShapeEntry};

use super::canvas::{Canvas, escape};
use super::labels::{Labels, Spot, Style};
use super::line_style;
use super::view::{Eye, View};
use crate::report::words::decimal;

/// Closer than this two spots are one (px).
const INVISIBLE_PX: f64 = 0.05;
/// Larger fleets are named at their goals and from above only, in small letters.
const NAMED_UP_TO: usize = 40;

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
pub(super) fn zones(canvas: &mut Canvas, view: &View, plan: &Plan) {
    let style = r##"fill="#e8a33d" fill-opacity="0.18" stroke="#b7791f" stroke-width="1.2" stroke-dasharray="5 3""##;
    for zone in &plan.zones {
        let title = format!("{}: at most {} m/s", zone.name, decimal(zone.air_limit_mps));
        rectangle(
            canvas,
            view,
            [&zone.min_m, &zone.max_m],
            style,
            &escape(&title),
        );
    }
}

/// Every path, in its drone's colour; pointing at one names it.
pub(super) fn trajectories(canvas: &mut Canvas, view: &View, plan: &Plan) {
    let (width, opacity) = match plan.drones.len() {
        ..=20 => (2.0, 0.85),
        21..=60 => (1.4, 0.8),
        _ => (0.9, 0.6),
    };
    canvas.group("paths", |canvas| {
        for (index, drone) in plan.drones.iter().enumerate() {
            let (colour, dashes) = line_style(index);
            let points: Vec<String> = spots(view, drone).iter().map(|(x, y)| format!("{x:.1} {y:.1}")).collect();
            canvas.put(format_args!(
                r#"<path d="M{}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round" stroke-opacity="{opacity}"{dashes}><title>{}</title></path>"#,
                points.join("L"),
                escape(&tooltip(drone))
            ));
        }
    });
}

/// The bends of a path as this view sees them: a stay, or a climb seen from above, is one spot, and
/// what lies straight between two others is none.
fn spots(view: &View, drone: &DronePlan) -> Vec<Spot> {
    let mut spots: Vec<Spot> = Vec::new();
    for point in &drone.trajectory.position_m {
        let here = view.at(point);
        if spots
            .last()
            .is_some_and(|last| distance_px(*last, here) < INVISIBLE_PX)
        {
            continue;
        }
        if let [.., before, last] = spots[..] {
            let straight =
                distance_px(before, last) + distance_px(last, here) - distance_px(before, here);
            if straight < 1e-3 {
                spots.pop();
            }
        }
        spots.push(here);
    }
    spots
}

fn distance_px(a: Spot, b: Spot) -> f64 {
    (a.0 - b.0).hypot(a.1 - b.1)
}

fn tooltip(drone: &DronePlan) -> String {
    format!(
        "{}: {}, arrives {:.1} s",
        drone.name, drone.airframe.name, drone.arrives_s
    )
}

/// Starts are rings, goals dots, so that a goal at another's start shows both; square where the
/// drone stands instead of hovering.
pub(super) fn markers(canvas: &mut Canvas, view: &View, plan: &Plan) {
    let radius = marker_px(plan);
    canvas.group("ends", |canvas| {
        for (index, drone) in plan.drones.iter().enumerate() {
            let Some((start, _)) = ends(view, drone) else {
                continue;
            };
            let (colour, _) = line_style(index);
            let ring = format!(
                r##"fill="#fcfcfa" stroke="{colour}" stroke-width="{:.1}""##,
                radius * 0.32
            );
            marker(
                canvas,
                start,
                radius,
                drone.at_start == AtStart::Landed,
                &ring,
            );
        }
        for (index, drone) in plan.drones.iter().enumerate() {
            let Some((_, end)) = ends(view, drone) else {
                continue;
            };
            if drone.trajectory.position_m.len() > 1 && drone.at_end != AtEnd::Leave {
                let dot = format!(
                    r##"fill="{}" stroke="#fcfcfa" stroke-width="0.8""##,
                    line_style(index).0
                );
                marker(
                    canvas,
                    end,
                    radius * 0.75,
                    drone.at_end == AtEnd::Land,
                    &dot,
                );
            }
        }
    });
}

/// What no label should cover, and what it should rather not.
pub(super) fn keep_clear(view: &View, plan: &Plan, labels: &mut Labels) {
    for drone in &plan.drones {
        for pair in spots(view, drone).windows(2) {
            labels.avoid_line(pair[0], pair[1]);
        }
        if let Some((start, end)) = ends(view, drone) {
            labels.keep_clear(start, marker_px(plan));
            labels.keep_clear(end, marker_px(plan));
        }
    }
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
    if plan.drones.len() <= NAMED_UP_TO {
        5.0
    } else {
        3.0
    }
}

fn ends(view: &View, drone: &DronePlan) -> Option<(Spot, Spot)> {
    let points = &drone.trajectory.position_m;
    Some((view.at(points.first()?), view.at(points.last()?)))
}

/// Names of zones, of drones at their goals, then at their starts, as far as there is room.
pub(super) fn names(view: &View, plan: &Plan, labels: &mut Labels) {
    for zone in &plan.zones {
        let style = Style {
            size_px: 11.0,
            colour: "#8a5a10",
            weight: "normal",
        };
        labels.centred(
            view.at(&nalgebra::center(&zone.min_m, &zone.max_m)),
            style,
            &zone.name,
        );
    }
    let many = plan.drones.len() > NAMED_UP_TO;
    if many && view.eye == Eye::Side {
        return;
    }
    let (gap_px, size_px) = (marker_px(plan) + 2.0, if many { 7.5 } else { 11.0 });
    for at_goal in [true, false] {
        for (index, drone) in plan.drones.iter().enumerate() {
            let Some((start, end)) = ends(view, drone) else {
                continue;
            };
            if !at_goal && (many || drone.trajectory.position_m.len() == 1) {
                continue;
            }
            let weight = if at_goal { "bold" } else { "normal" };
            let style = Style {
                size_px,
                colour: line_style(index).0,
                weight,
            };
            labels.beside(
                if at_goal { end } else { start },
                gap_px,
                style,
                &drone.name,
            );
        }
    }
}
