//! Nobody airborne with its centre in the near-field column of another: 0 to 2.5 motor distances below
//! its rotor plane, out to its rotor tips (wherever wind and tilt move the jet to above there), as far down as its wake reaches.

use std::collections::BTreeMap;

use super::Found;
use super::clock::{SHORTEST_S, join};
use super::flight::{Flight, Scene};
use super::window::{Emission, Window};
use crate::plan::trajectory::SAME_PLACE_M;
use crate::plan::{Violation, ViolationKind};

/// Spans in one emitter's column, and the moment nearest to its axis: window, time, distance.
#[derive(Default)]
struct Visit {
    parts: Vec<(f64, f64)>,
    nearest: Option<(usize, f64, f64)>,
}

pub(super) fn check(scene: &Scene<'_>, receiver: &Flight, windows: &[Window<'_>]) -> Vec<Found> {
    let mut visits: BTreeMap<usize, Visit> = BTreeMap::new();
    for (k, window) in windows.iter().enumerate() {
        for emission in &window.emissions {
            // On the rim is outside: a micrometre less on every side.
            let radius_m = emission.wake.wake.column_radius_m() - SAME_PLACE_M;
            let heights_m = (
                SAME_PLACE_M - emission.wake.wake.near_field_depth_m(),
                -SAME_PLACE_M,
            );
            for span_s in emission.relative.inside_cylinder_s(radius_m, heights_m) {
                let mut parts = Vec::new();
                felt_parts(window, emission, span_s, &mut parts);
                for part_s in parts {
                    let visit = visits.entry(emission.other).or_default();
                    let t_s = nearest_s(emission, part_s);
                    let off_axis_m = emission.relative.at_m(t_s).xy().norm();
                    if visit
                        .nearest
                        .is_none_or(|(_, _, known_m)| off_axis_m < known_m)
                    {
                        visit.nearest = Some((k, t_s, off_axis_m));
                    }
                    join(&mut visit.parts, part_s);
                }
            }
        }
    }
    let mut found = Vec::new();
    for (other, visit) in visits {
        let Some((k, t_s, off_axis_m)) = visit.nearest else {
            continue;
        };
        let position_m = windows[k].place_m(t_s);
        for (from_s, until_s) in visit.parts {
            found.push((
                receiver.index,
                Violation {
                    kind: ViolationKind::Column,
                    drone: receiver.name.clone(),
                    with: Some(scene.flights[other].name.clone()),
                    from_s,
                    until_s: scene.until(until_s),
                    position_m,
                    value: off_axis_m,
                    limit: scene.flights[other].column_radius_m(),
                    unit: "m".to_owned(),
                },
            ));
        }
    }
    found
}

/// The parts of a span in the column during which the wake reaches down to the receiver.
fn felt_parts(
    window: &Window<'_>,
    emission: &Emission<'_>,
    span_s: (f64, f64),
    parts: &mut Vec<(f64, f64)>,
) {
    if !window.may_stop(emission) {
        parts.push(span_s);
        return;
    }
    // A top face passes under the emitter: steps of a millisecond, as everywhere.
    let steps = ((span_s.1 - span_s.0) / SHORTEST_S).ceil().clamp(1.0, 1e5);
    let step_s = (span_s.1 - span_s.0) / steps;
    for k in 0..steps as usize {
        let from_s = span_s.0 + k as f64 * step_s;
        if window.felt_at(emission, from_s + 0.5 * step_s) {
            join(parts, (from_s, from_s + step_s));
        }
    }
}

/// When the receiver is nearest to the emitter's axis within a span: bisection on the convex distance.
fn nearest_s(emission: &Emission<'_>, span_s: (f64, f64)) -> f64 {
    let off_axis_m = |t_s: f64| emission.relative.at_m(t_s).xy().norm();
    let (mut low_s, mut high_s) = span_s;
    while high_s - low_s > 0.1 * SHORTEST_S {
        let (a_s, b_s) = (
            low_s + (high_s - low_s) / 3.0,
            high_s - (high_s - low_s) / 3.0,
        );
        if off_axis_m(a_s) <= off_axis_m(b_s) {
            high_s = b_s
        } else {
            low_s = a_s
        }
    }
    0.5 * (low_s + high_s)
}
