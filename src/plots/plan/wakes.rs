//! Where drones hover and what they blow: near-field column, half-width cone, and the worst moment.

use nalgebra::Point3;
use planner::plan::{DronePlan, Plan};
use planner::{Outline, WakeOutlines};

use super::canvas::Canvas;
use super::labels::{Labels, Style};
use super::view::{Eye, View};

/// Who stays this long in one place hovers there (s), chosen here: shorter stops would fill the
/// picture with the wakes of drones that give way.
const HOVERS_FROM_S: f64 = 3.0;
/// Less air than this (m/s) prints as 0.0 and has no worst moment.
const LEAST_AIR_MPS: f64 = 0.05;

/// The worst moment.
const RED: &str = "#b3243b";

/// The highest air over anybody's rotor discs.
pub(super) struct WorstMoment {
    pub(super) name: String,
    pub(super) air_mps: f64,
    /// Over its induced velocity.
    pub(super) alpha: f64,
    pub(super) limit: f64,
    pub(super) at_s: f64,
    at_m: Point3<f64>,
    from: Option<(String, Outline)>,
}

/// Wakes of everybody who hovers at the goal for ever or anywhere for a while.
pub(super) fn hovering_wakes(plan: &Plan) -> Vec<Outline> {
    let outlines = &WakeOutlines::new(plan);
    plan.drones
        .iter()
        .flat_map(|drone| {
            let spots = hover_spots(drone).into_iter();
            spots.map(move |(at_m, mass_kg)| outlines.of(drone, at_m, mass_kg))
        })
        .collect()
}

/// Places where a drone hovers, each with the mass it has there.
fn hover_spots(drone: &DronePlan) -> Vec<(Point3<f64>, f64)> {
    let (from_s, until_s) = drone.airborne_s;
    let until_s = until_s.unwrap_or(f64::INFINITY);
    let path = &drone.trajectory;
    let points = path.t_s.len().min(path.position_m.len());
    let mass_kg = |index: usize| {
        path.mass_kg
            .get(index)
            .copied()
            .unwrap_or(drone.airframe.mass_kg)
    };
    let mut spots = Vec::new();
    let mut first = 0;
    while first < points {
        // The last break point of the same stay: a dwell may hold several, one per change of load.
        let stays = (first..points)
            .take_while(|&next| same_place(&path.position_m[next], &path.position_m[first]));
        let last = stays.last().unwrap_or(first);
        let leaves_s = if last + 1 == points {
            f64::INFINITY
        } else {
            path.t_s[last]
        };
        let hovers_s = leaves_s.min(until_s) - path.t_s[first].max(from_s);
        if hovers_s >= HOVERS_FROM_S {
            spots.push((path.position_m[last], mass_kg(last)));
        }
        first = last + 1;
    }
    spots
}

fn same_place(a: &Point3<f64>, b: &Point3<f64>) -> bool {
    (a - b).norm() < 1e-6
}

/// The drone and moment with the most air for what the drone can take.
pub(super) fn worst_moment(plan: &Plan) -> Option<WorstMoment> {
    let alpha = |drone: &DronePlan| drone.worst_air_mps / drone.airframe.hover_induced_velocity_mps;
    let worst = plan
        .drones
        .iter()
        .filter(|drone| drone.worst_air_mps >= LEAST_AIR_MPS && drone.worst_air_at_s.is_some());
    // The first of equals, in the scenario's order.
    let drone = worst.reduce(|best, next| {
        if alpha(next) > alpha(best) {
            next
        } else {
            best
        }
    })?;
    let at_s = drone.worst_air_at_s?;
    let emitter = drone
        .worst_air_from
        .as_ref()
        .and_then(|name| plan.drones.iter().find(|other| &other.name == name));
    Some(WorstMoment {
        name: drone.name.clone(),
        air_mps: drone.worst_air_mps,
        alpha: alpha(drone),
        limit: drone.air_limit,
        at_s,
        at_m: position_m(drone, at_s)?.0,
        from: emitter.and_then(|other| {
            let (at_m, mass_kg) = position_m(other, at_s)?;
            let outline = WakeOutlines::new(plan).of(other, at_m, mass_kg);
            Some((other.name.clone(), outline))
        }),
    })
}

/// Place and mass at a time; straight between break points.
fn position_m(drone: &DronePlan, at_s: f64) -> Option<(Point3<f64>, f64)> {
    let path = &drone.trajectory;
    let after = path.t_s.partition_point(|&t_s| t_s <= at_s);
    let before = after.saturating_sub(1);
    let from = path.position_m.get(before)?;
    let mass_kg = path
        .mass_kg
        .get(before)
        .copied()
        .unwrap_or(drone.airframe.mass_kg);
    let Some(to) = path.position_m.get(after) else {
        return Some((*from, mass_kg));
    };
    let share = ((at_s - path.t_s[before]) / (path.t_s[after] - path.t_s[before])).clamp(0.0, 1.0);
    Some((from + (to - from) * share, mass_kg))
}

/// A translucent wake; where there are many, each is fainter.
pub(super) fn draw(canvas: &mut Canvas, view: &View, wake: &Outline, of: usize) {
    let opacity = (1.6 / (of.max(1) as f64).sqrt()).clamp(0.2, 0.38);
    let fill = match view.eye {
        Eye::Above => "#2b7bba",
        Eye::Side => "url(#air)",
    };
    draw_shape(
        canvas,
        view,
        wake,
        &format!(r#"fill="{fill}" fill-opacity="{opacity:.2}""#),
        "#2b7bba",
    );
}

fn draw_shape(canvas: &mut Canvas, view: &View, wake: &Outline, fill: &str, edge: &str) {
    let (x, y) = view.at(&wake.at_m);
    let px = |length_m: f64| length_m * view.px_per_m;
    let column = px(wake.column_radius_m);
    let [upper, lower] = wake.half_width_m.map(px);
    let at = |k: usize| {
        let [x_m, y_m] = wake.aside_m[k];
        view.at(&Point3::new(
            wake.at_m.x + x_m,
            wake.at_m.y + y_m,
            wake.z_m[k],
        ))
    };
    let ((join_x, joins), (end_x, ends)) = (at(0), at(1));
    match view.eye {
        Eye::Above => canvas.put(format_args!(
            r#"<circle cx="{end_x:.1}" cy="{ends:.1}" r="{lower:.1}" {fill} stroke="{edge}" stroke-opacity="0.45" stroke-width="0.7"/><circle cx="{x:.1}" cy="{y:.1}" r="{column:.1}" {fill}/>"#
        )),
        Eye::Side => {
            canvas.put(format_args!(
                r#"<path d="M{:.1} {y:.1}H{:.1}V{joins:.1}H{:.1}L{:.1} {ends:.1}H{:.1}L{:.1} {joins:.1}H{:.1}Z" {fill} stroke="{edge}" stroke-opacity="0.45" stroke-width="0.7"/>"#,
                x - column,
                x + column,
                join_x + upper,
                end_x + lower,
                end_x - lower,
                join_x - upper,
                x - column
            ));
        }
    }
}

/// Marks who meets the worst air, from whom, and where both are then.
pub(super) fn draw_worst(canvas: &mut Canvas, view: &View, worst: &WorstMoment) {
    let (x, y) = view.at(&worst.at_m);
    canvas.group("worst", |canvas| {
        if let Some((_, wake)) = &worst.from {
            let fill = match view.eye {
                Eye::Above => format!(r#"fill="{RED}" fill-opacity="0.2""#),
                Eye::Side => r#"fill="url(#worst-air)""#.into(),
            };
            draw_shape(canvas, view, wake, &fill, RED);
            let (from_x, from_y) = view.at(&wake.at_m);
            canvas.put(format_args!(
                r#"<path d="M{from_x:.1} {from_y:.1}L{x:.1} {y:.1}" stroke="{RED}" stroke-width="1.2" stroke-dasharray="4 3" fill="none"/><path d="M{from_x:.1} {:.1}l5.5 -9h-11z" fill="{RED}" stroke="white" stroke-width="0.8"/>"#,
                from_y + 4.5
            ));
        }
        canvas.put(format_args!(
            r##"<circle cx="{x:.1}" cy="{y:.1}" r="7" fill="none" stroke="#fcfcfa" stroke-width="4.5"/><circle cx="{x:.1}" cy="{y:.1}" r="7" fill="none" stroke="{RED}" stroke-width="2.2"/>"##
        ));
    });
}

/// Says who meets how much when, and whose wake it is.
pub(super) fn label_worst(view: &View, worst: &WorstMoment, labels: &mut Labels) {
    let style = Style {
        size_px: 12.0,
        colour: RED,
        weight: "bold",
    };
    let at = view.at(&worst.at_m);
    let from = worst
        .from
        .as_ref()
        .map(|(name, wake)| (name, view.at(&wake.at_m)));
    labels.keep_clear(at, 8.0);
    if let Some((_, spot)) = from {
        labels.keep_clear(spot, 6.0);
        labels.avoid_line(spot, at);
    }
    let text = format!(
        "{}: {:.1} m/s at t = {:.1} s",
        worst.name, worst.air_mps, worst.at_s
    );
    labels.beside_at_any_price(at, 10.0, style, &text);
    if let Some((name, spot)) = from {
        labels.beside_at_any_price(spot, 8.0, style, name);
    }
}
