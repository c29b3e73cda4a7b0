//! What the plan holds, layer by layer, the same for both views.

use nalgebra::{Point3, Vector3, center};
use planner::plan::{AtEnd, AtStart, DronePlan, Plan, Solid, UnplannedCause};
use viewer::Stop;

use super::labels::Labels;
use super::view::{Eye, View, line_style};
use crate::plots::canvas::{
    BOLD, Canvas, Letters, Spot, circle, dashed, fill, polyline, rectangle, solid, stroke,
};
use crate::plots::colours::{PAPER, SOLID, SOLID_EDGE, WORST, ZONE, ZONE_EDGE};
use crate::report::words::decimal;

/// Closer than this two spots are one (px).
const INVISIBLE_PX: f64 = 0.05;
/// Curves are drawn straight from place to place as near to them as this (m).
const CURVE_M: f64 = 0.01;
/// In larger fleets directions and waits would cover one another.
pub(super) const MARKED_UP_TO: usize = 60;
/// Larger fleets are named at their goals and from above only, in small letters.
const NAMED_UP_TO: usize = 40;
/// Still larger ones are not named: hardly a name would find a free place, and looking for it takes
/// a time that grows with the square of the fleet. Chosen here.
const NAMED_AT_ALL_UP_TO: usize = 150;

/// The look of a solid; from the side it lets the lines behind it through.
pub(super) fn solid_look(eye: Eye) -> String {
    let opacity = if eye == Eye::Above { 1.0 } else { 0.55 };
    fill(SOLID, opacity) + &stroke(SOLID_EDGE, 0.8)
}

/// The look of a zone: one that keeps bodies out has dense dots around it.
pub(super) fn zone_look(keep_out: bool) -> String {
    let dashes = if keep_out { "1.5 1.5" } else { "5 3" };
    let edge = stroke(ZONE_EDGE, if keep_out { 2.0 } else { 1.2 });
    format!(r#"{}{edge} stroke-dasharray="{dashes}""#, fill(ZONE, 0.18))
}

pub(super) fn obstacles(canvas: &mut Canvas, view: &View, plan: &Plan) {
    canvas.group("obstacles", |canvas| {
        for obstacle in &plan.obstacles {
            let path = silhouette(view, &obstacle.shape);
            canvas.named(&path, &solid_look(view.eye), &obstacle.name);
        }
    });
}

/// The path around an obstacle; of a mesh, around each of its triangles.
fn silhouette(view: &View, shape: &Solid) -> String {
    match shape {
        Solid::Box { min_m, max_m } => view.rectangle(min_m, max_m),
        Solid::Cylinder {
            base_m,
            radius_m,
            height_m,
        } => {
            let aside_m = Vector3::new(*radius_m, 0.0, 0.0);
            let top_m = base_m + Vector3::new(0.0, 0.0, *height_m);
            match view.eye {
                Eye::Above => circle(view.at(base_m), radius_m * view.px_per_m),
                Eye::Side => view.rectangle(&(base_m - aside_m), &(top_m + aside_m)),
            }
        }
        Solid::Mesh {
            vertices_m,
            triangles,
            ..
        } => {
            let corner = |index: &u32| vertices_m.get(*index as usize);
            let around = |triangle: &[u32; 3]| {
                let corners = triangle.iter().filter_map(corner);
                polyline(corners.map(|vertex| view.at(vertex))) + "z"
            };
            triangles.iter().map(around).collect()
        }
    }
}

/// Places with a limit on their air, or that keep bodies out.
pub(super) fn zones(canvas: &mut Canvas, view: &View, plan: &Plan) {
    for entry in &plan.zones {
        let air = entry
            .air_limit_mps
            .map(|mps| format!("at most {} m/s", decimal(mps)));
        let bodies = entry.keep_out.then(|| "keep out".to_owned());
        let rules: Vec<String> = bodies.into_iter().chain(air).collect();
        let name = format!("{}: {}", entry.name, rules.join(", "));
        let path = view.rectangle(&entry.min_m, &entry.max_m);
        canvas.named(&path, &zone_look(entry.keep_out), &name);
    }
}

/// Every path in its drone's colour; pointing at one names it. Starts are rings, goals dots, so
/// that a goal at another's start shows both; square where the drone stands instead of hovering.
/// Labels keep clear of all of it.
pub(super) fn drones(
    canvas: &mut Canvas,
    view: &View,
    (plan, stops): (&Plan, &[Vec<Stop>]),
    labels: &mut Labels,
) {
    let (width, opacity) = match plan.drones.len() {
        ..=20 => (2.0, 0.85),
        21..=60 => (1.4, 0.8),
        _ => (0.9, 0.6),
    };
    let radius = marker_px(plan);
    let marker = |(x, y): Spot, radius: f64, is_square: bool| match is_square {
        true => rectangle((x - radius, y - radius), (x + radius, y + radius)),
        false => circle((x, y), radius),
    };
    let (mut starts, mut goals) = (Vec::new(), Vec::new());
    canvas.group("paths", |canvas| {
        for (index, drone) in plan.drones.iter().enumerate() {
            let Some((start, goal)) = start_and_goal(view, drone) else {
                continue;
            };
            let (colour, dashes) = line_style(index);
            let (line, bends) = (solid(colour, width), bends(view, drone));
            let look = format!(r#"{line} stroke-opacity="{opacity}"{dashes}"#);
            let (name, airframe) = (&drone.name, &drone.airframe.name);
            let arrives = match plan.is_unplanned(name) {
                true => "stays".to_owned(),
                false => format!("arrives {:.1} s", drone.arrives_s),
            };
            let name = format!("{name}: {airframe}, {arrives}");
            canvas.named(&polyline(bends.iter().copied()), &look, &name);
            labels.avoid_line(&bends);
            labels.keep_clear(start, radius);
            labels.keep_clear(goal, radius);
            let start = marker(start, radius, drone.at_start == AtStart::Landed);
            starts.push((start, fill(PAPER, 1.0) + &stroke(colour, radius * 0.32)));
            if drone.trajectory.position_m.len() > 1 && drone.at_end != AtEnd::Leave {
                let goal = marker(goal, radius * 0.75, drone.at_end == AtEnd::Land);
                goals.push((goal, fill(colour, 1.0) + &stroke(PAPER, 0.8)));
            }
        }
    });
    if plan.drones.len() <= MARKED_UP_TO {
        canvas.group("moves", |canvas| {
            for (index, drone) in plan.drones.iter().enumerate() {
                let (colour, _) = line_style(index);
                let arrows = arrows(&bends(view, drone), 3.2 + width);
                canvas.path(&arrows, &fill(colour, 1.0));
                let of_drone = stops.get(index).into_iter().flatten();
                for stop in of_drone.filter(|stop| goes_on(drone, stop)) {
                    let at = view.at(&stop.at_m);
                    let bars = [-2.4, 2.4].map(|x_px| {
                        polyline([(at.0 + x_px, at.1 - 4.5), (at.0 + x_px, at.1 + 4.5)])
                    });
                    canvas.path(&bars.concat(), &solid(PAPER, 4.2));
                    let name = format!("{} {}", drone.name, told(stop));
                    canvas.named(&bars.concat(), &solid(colour, 2.0), &name);
                    labels.keep_clear(at, 5.0);
                }
            }
        });
    }
    canvas.group("ends", |canvas| {
        for (path, look) in starts.iter().chain(&goals) {
            canvas.path(path, look);
        }
    });
}

/// Arrowheads of a size (px) in the middle of every piece that has room for one: which way it is
/// flown.
fn arrows(bends: &[Spot], size_px: f64) -> String {
    let heads = bends.windows(2).filter_map(|ends| {
        let ((x, y), (u, v)) = (ends[0], ends[1]);
        let (dx, dy) = (u - x, v - y);
        let length_px = dx.hypot(dy);
        if length_px < 6.0 * size_px {
            return None;
        }
        let (along, middle) = (
            (dx / length_px, dy / length_px),
            ((x + u) / 2.0, (y + v) / 2.0),
        );
        let at = |forward: f64, aside: f64| {
            (
                middle.0 + size_px * (forward * along.0 - aside * along.1),
                middle.1 + size_px * (forward * along.1 + aside * along.0),
            )
        };
        Some(polyline([at(1.2, 0.0), at(-0.8, 0.9), at(-0.8, -0.9)]) + "z")
    });
    heads.collect()
}

/// Whether a drone moves again after a stop; where it does not stands its goal.
fn goes_on(drone: &DronePlan, stop: &Stop) -> bool {
    let path = &drone.trajectory;
    let mut after = path.t_s.iter().zip(&path.position_m);
    after.any(|(t_s, at_m)| *t_s > stop.until_s && (at_m - stop.at_m).norm() > CURVE_M)
}

/// A stop in the words of plan.html.
fn told(stop: &Stop) -> String {
    let (from_s, lasts_s) = (stop.from_s, stop.until_s - stop.from_s);
    let later = stop.costs_s.filter(|_| stop.what == "wait");
    let later = later.map_or(String::new(), |it| format!(", later by {it:.1} s"));
    format!(
        "{}s {lasts_s:.1} s from t = {from_s:.1} s{later}",
        stop.what
    )
}

/// How far each drone without a path could get, and what blocks it.
pub(super) fn refused(canvas: &mut Canvas, view: &View, plan: &Plan) {
    canvas.group("refused", |canvas| {
        for (drone, at_m, cause) in refusals(plan) {
            let (x, y) = view.at(&at_m);
            if let Some(start_m) = drone.trajectory.position_m.first() {
                canvas.path(&polyline([view.at(start_m), (x, y)]), &dashed(WORST, 1.4));
            }
            let cross = polyline([(x - 5.5, y - 5.5), (x + 5.5, y + 5.5)])
                + &polyline([(x - 5.5, y + 5.5), (x + 5.5, y - 5.5)]);
            canvas.path(&cross, &solid(PAPER, 5.0));
            let by = cause.blocker.as_deref().unwrap_or("nothing that is known");
            let name = format!("{} gets no farther: {} of {by}", drone.name, cause.kind);
            canvas.named(&cross, &solid(WORST, 2.4), &name);
        }
    });
}

/// Names beside the crosses of [`refused`].
pub(super) fn label_refused(view: &View, plan: &Plan, labels: &mut Labels) {
    if plan.drones.len() > NAMED_AT_ALL_UP_TO {
        return;
    }
    for (drone, at_m, cause) in refusals(plan) {
        let at = view.at(&at_m);
        labels.keep_clear(at, 6.0);
        let by = cause.blocker.iter().map(|by| format!(" by {by}"));
        let text = format!("{} stopped{}", drone.name, by.collect::<String>());
        let letters = Letters::new(11.0, WORST).with(BOLD);
        labels.beside(at, 8.0, (letters, &text), true);
    }
}

/// The drones without a path of which it is known how far they could get (m).
fn refusals(plan: &Plan) -> impl Iterator<Item = (&DronePlan, Point3<f64>, &UnplannedCause)> {
    plan.unplanned.iter().filter_map(|entry| {
        let drone = plan.drone(&entry.name)?;
        let cause = entry.cause.as_ref()?;
        Some((drone, cause.at_m?, cause))
    })
}

/// The bends of a path as this view sees them: a stay, or a climb seen from above, is one spot, and
/// what lies straight between two others is none.
fn bends(view: &View, drone: &DronePlan) -> Vec<Spot> {
    let apart_px = |a: Spot, b: Spot| (a.0 - b.0).hypot(a.1 - b.1);
    let mut spots: Vec<Spot> = Vec::new();
    for point in drone.trajectory.outline_m(CURVE_M) {
        let here = view.at(&point);
        match spots[..] {
            [.., last] if apart_px(last, here) < INVISIBLE_PX => continue,
            [.., before, last] => {
                let around_px = apart_px(before, last) + apart_px(last, here);
                if around_px - apart_px(before, here) < 1e-3 {
                    spots.pop();
                }
            }
            _ => {}
        }
        spots.push(here);
    }
    spots
}

fn marker_px(plan: &Plan) -> f64 {
    let is_large = plan.drones.len() > NAMED_UP_TO;
    if is_large { 3.0 } else { 5.0 }
}

fn start_and_goal(view: &View, drone: &DronePlan) -> Option<(Spot, Spot)> {
    let points = &drone.trajectory.position_m;
    Some((view.at(points.first()?), view.at(points.last()?)))
}

/// Names of zones, of drones at their goals, then at their starts, as far as there is room.
pub(super) fn names(view: &View, plan: &Plan, labels: &mut Labels) {
    let letters = Letters::new(11.0, ZONE_EDGE);
    for zone in &plan.zones {
        let middle: Point3<f64> = center(&zone.min_m, &zone.max_m);
        labels.centred(view.at(&middle), (letters.clone(), &zone.name));
    }
    let drones = plan.drones.len();
    let is_large = drones > NAMED_UP_TO;
    if drones > NAMED_AT_ALL_UP_TO || is_large && view.eye == Eye::Side {
        return;
    }
    let (gap_px, size_px) = (marker_px(plan) + 2.0, if is_large { 7.5 } else { 11.0 });
    for at_goal in [true, false] {
        for (index, drone) in plan.drones.iter().enumerate() {
            let Some((start, goal)) = start_and_goal(view, drone) else {
                continue;
            };
            let letters = Letters::new(size_px, line_style(index).0);
            if at_goal {
                labels.beside(goal, gap_px, (letters.with(BOLD), &drone.name), false);
            } else if !is_large && drone.trajectory.position_m.len() > 1 {
                labels.beside(start, gap_px, (letters, &drone.name), false);
            }
        }
    }
}
