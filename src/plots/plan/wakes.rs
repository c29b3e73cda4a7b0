//! Where drones hover, the wakes below them (near-field column, half-width cone), and the moment of
//! the worst air.

use airflow::Flown;
use nalgebra::Point3;
use planner::plan::{DronePlan, Plan};
use planner::{Outline, WakeOutlines};

use super::labels::Labels;
use super::view::{Eye, View};
use crate::plots::canvas::{BOLD, Canvas, Letters, circle, dashed, fill, polyline, solid, stroke};
use crate::plots::colours::{AIR, Colour, PAPER, WORST};

/// A drone that stays this long in one place hovers there (s), chosen here: shorter stops would
/// fill the picture with the wakes of drones that wait.
const HOVERS_FROM_S: f64 = 3.0;
/// Less air than this (m/s) prints as 0.0 and has no worst moment.
const LEAST_AIR_MPS: f64 = 0.05;

/// The highest air over a drone's rotor discs, for what that drone tolerates.
pub(super) struct WorstMoment<'a> {
    pub(super) drone: &'a DronePlan,
    pub(super) at_s: f64,
    at_m: Point3<f64>,
    from: Option<(&'a str, Outline)>,
}

/// Wakes of all drones that hover at the goal, or elsewhere for a while.
pub(super) fn hovering_wakes(plan: &Plan) -> Vec<Outline> {
    let outlines = WakeOutlines::new(plan);
    let mut wakes = Vec::new();
    for drone in &plan.drones {
        let (from_s, until_s) = drone.airborne_s;
        let until_s = until_s.unwrap_or(f64::INFINITY);
        let path = &drone.trajectory;
        let points = path.t_s.len().min(path.position_m.len());
        let mut next = 0;
        // A dwell may hold several break points, one for each change of load.
        for stay in path.position_m[..points].chunk_by(|a, b| (a - b).norm() < 1e-6) {
            let arrives_s = path.t_s[next].max(from_s);
            next += stay.len();
            let stays = next == points;
            let leaves_s = if stays { until_s } else { path.t_s[next - 1] };
            if leaves_s.min(until_s) - arrives_s >= HOVERS_FROM_S {
                wakes.push(outlines.of(drone, stay[0], mass_kg(drone, next - 1)));
            }
        }
    }
    wakes
}

/// The mass that a drone has from a break point on.
fn mass_kg(drone: &DronePlan, point: usize) -> f64 {
    let mass_kg = drone.trajectory.mass_kg.get(point).copied();
    mass_kg.unwrap_or(drone.airframe.mass_kg)
}

/// The drone and moment with the most air for what the drone tolerates; the first of equals, in the
/// scenario's order.
pub(super) fn worst_moment(plan: &Plan) -> Option<WorstMoment<'_>> {
    let drones = plan.drones.iter();
    let exposed = drones
        .filter(|drone| drone.worst_air_mps >= LEAST_AIR_MPS && drone.worst_air_at_s.is_some());
    let flown = plan.flown();
    let alpha = |it: &DronePlan| alpha(&flown, it);
    let drone = exposed.reduce(|a, b| if alpha(b) > alpha(a) { b } else { a })?;
    let at_s = drone.worst_air_at_s?;
    let is_source = |other: &&DronePlan| Some(&other.name) == drone.worst_air_from.as_ref();
    let source = plan.drones.iter().find(is_source);
    Some(WorstMoment {
        drone,
        at_s,
        at_m: drone.trajectory.position_m(at_s)?,
        from: source.and_then(|source| {
            let path = &source.trajectory;
            let mass_kg = mass_kg(source, path.point_at(at_s).unwrap_or(0));
            let outline = WakeOutlines::new(plan).of(source, path.position_m(at_s)?, mass_kg);
            Some((&source.name[..], outline))
        }),
    })
}

/// Air over the drone's own induced velocity, both at its worst moment.
pub(super) fn alpha(flown: &Flown, drone: &DronePlan) -> f64 {
    let stated_mps = drone.hover_mps(drone.worst_air_at_s.unwrap_or(0.0));
    flown.alpha(drone.worst_air_mps, flown.hover_velocity_mps(stated_mps))
}

/// A gradient from above to below, by opacity.
pub(super) fn fade(id: &str, colour: Colour, above: f64, below: f64) -> String {
    format!(
        r#"
<linearGradient id="{id}" x1="0" y1="0" x2="0" y2="1"><stop stop-color="{colour}" stop-opacity="{above}"/><stop offset="1" stop-color="{colour}" stop-opacity="{below}"/></linearGradient>"#
    )
}

/// The look of a wake: filled, with a faint edge.
pub(super) fn look(edge: Colour, fill: &str) -> String {
    let edge = stroke(edge, 0.7);
    format!(r#"{fill}{edge} stroke-opacity="0.45""#)
}

/// A translucent wake; where there are many, each is fainter.
pub(super) fn draw(canvas: &mut Canvas, view: &View, wake: &Outline, of: usize) {
    let opacity = (1.6 / (of.max(1) as f64).sqrt()).clamp(0.2, 0.38);
    let fill = match view.eye {
        Eye::Above => fill(AIR, opacity),
        Eye::Side => format!(r#" fill="url(#air)" fill-opacity="{opacity:.2}""#),
    };
    draw_shape(canvas, view, wake, (AIR, &fill));
}

fn draw_shape(canvas: &mut Canvas, view: &View, wake: &Outline, (edge, fill): (Colour, &str)) {
    let (x, y) = view.at(&wake.at_m);
    let column = wake.column_radius_m * view.px_per_m;
    let section = |k: usize| {
        let [x_m, y_m] = wake.aside_m[k];
        let axis_m = Point3::new(wake.at_m.x + x_m, wake.at_m.y + y_m, wake.z_m[k]);
        (view.at(&axis_m), wake.half_width_m[k] * view.px_per_m)
    };
    let [((join_x, joins), upper), ((end_x, ends), lower)] = [0, 1].map(section);
    match view.eye {
        Eye::Above => {
            canvas.path(&circle((end_x, ends), lower), &look(edge, fill));
            canvas.path(&circle((x, y), column), fill);
        }
        Eye::Side => {
            let outline = [
                (x - column, y),
                (x + column, y),
                (x + column, joins),
                (join_x + upper, joins),
                (end_x + lower, ends),
                (end_x - lower, ends),
                (join_x - upper, joins),
                (x - column, joins),
            ];
            canvas.path(&(polyline(outline) + "z"), &look(edge, fill));
        }
    }
}

/// Marks the drone in the worst air, the drone whose wake that is, and where both are then.
pub(super) fn draw_worst(canvas: &mut Canvas, view: &View, worst: &WorstMoment) {
    let at = view.at(&worst.at_m);
    canvas.group("worst", |canvas| {
        if let Some((_, wake)) = &worst.from {
            let look = match view.eye {
                Eye::Above => fill(WORST, 0.2),
                Eye::Side => r#" fill="url(#worst-air)""#.into(),
            };
            draw_shape(canvas, view, wake, (WORST, &look));
            let (x, y) = view.at(&wake.at_m);
            canvas.path(&polyline([(x, y), at]), &dashed(WORST, 1.2));
            let arrow = polyline([(x, y + 4.5), (x + 5.5, y - 4.5), (x - 5.5, y - 4.5)]) + "z";
            canvas.path(&arrow, &(fill(WORST, 1.0) + &stroke(PAPER, 0.8)));
        }
        for (colour, width) in [(PAPER, 4.5), (WORST, 2.2)] {
            canvas.path(&circle(at, 7.0), &solid(colour, width));
        }
    });
}

/// Says which drone is exposed to how much air when, and whose wake it is.
pub(super) fn label_worst(view: &View, worst: &WorstMoment, labels: &mut Labels) {
    let letters = Letters::new(12.0, WORST).with(BOLD);
    let at = view.at(&worst.at_m);
    let from = worst.from.as_ref();
    let from = from.map(|(name, wake)| (name, view.at(&wake.at_m)));
    labels.keep_clear(at, 8.0);
    if let Some((_, spot)) = from {
        labels.keep_clear(spot, 6.0);
        labels.avoid_line(&[spot, at]);
    }
    let (name, air_mps) = (&worst.drone.name, worst.drone.worst_air_mps);
    let text = format!("{name}: {air_mps:.1} m/s at t = {:.1} s", worst.at_s);
    labels.beside(at, 10.0, (letters.clone(), &text), true);
    if let Some((name, spot)) = from {
        labels.beside(spot, 8.0, (letters, name), true);
    }
}
