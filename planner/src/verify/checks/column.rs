//! No airborne centre in the near-field column of another drone: 0 to 2.5 motor distances below its
//! rotor plane, out to its rotor tips (wherever wind and tilt move the jet to above there), as far
//! down as its wake reaches.

use std::collections::BTreeMap;

use crate::plan::ViolationKind;
use crate::plan::trajectory::SAME_PLACE_M;
use crate::verify::extents::Span;
use crate::verify::scene::{Attached, Flight, Scene};
use crate::verify::time::spans::{SHORTEST_S, join};
use crate::verify::time::window::{Passing, Window};
use crate::verify::violation::{IndexedViolation, Worst};

/// Paths this short are not divided where a top face may stop the wake (m), chosen here: as for
/// bodies and solids.
pub(super) const SHORTEST_PATH_M: f64 = 1e-3;

/// Spans in one emitter's column, and the moment nearest to its axis: window, time, distance.
#[derive(Default)]
struct ColumnVisit {
    /// In order of time (s).
    parts: Vec<Span>,
    /// Window, time (s) and distance from the axis (m).
    nearest: Option<(usize, f64, f64)>,
}

/// Stays of one receiver in the columns of others, each with the moment nearest to the axis.
pub(super) fn check(
    scene: &Scene<'_>,
    receiver: &Flight,
    windows: &[Window<'_>],
) -> Vec<IndexedViolation> {
    let mut visits: BTreeMap<usize, ColumnVisit> = BTreeMap::new();
    for (k, window) in windows.iter().enumerate() {
        for passing in &window.passing {
            let (wake, relative) = (&passing.emitter.wake.wake, &passing.relative);
            // On the rim is outside: a micrometre less on every side.
            let radius_m = wake.column_radius_m() - SAME_PLACE_M;
            let heights_m = (SAME_PLACE_M - wake.near_field_depth_m(), -SAME_PLACE_M);
            let inside_s = relative.inside_cylinder_s(radius_m, heights_m);
            for part_s in inside_s.iter().flat_map(|it| reached(window, passing, *it)) {
                let visit = visits.entry(passing.emitter.from).or_default();
                let t_s = relative.nearest_to_axis_s(part_s);
                let off_axis_m = relative.at_m(t_s).xy().norm();
                if (visit.nearest).is_none_or(|(_, _, known_m)| off_axis_m < known_m) {
                    visit.nearest = Some((k, t_s, off_axis_m));
                }
                join(&mut visit.parts, part_s);
            }
        }
    }
    let mut found = Vec::new();
    for (other, visit) in visits {
        let Some((k, t_s, off_axis_m)) = visit.nearest else {
            continue;
        };
        for part_s in visit.parts {
            let worst = Worst {
                with: Some(scene.flights[other].name.clone()),
                position_m: windows[k].place_m(t_s),
                value: off_axis_m,
                limit: scene.flights[other].column_radius_m(),
            };
            found.push(scene.violation(receiver, ViolationKind::Column, part_s, worst));
        }
    }
    found
}

/// The parts of a span in the column during which the wake reaches down to the receiver.
fn reached(window: &Window<'_>, passing: &Passing<'_>, span_s: Span) -> Vec<Span> {
    if passing.emitter.stops.is_empty() {
        return vec![span_s];
    }
    let mut parts = Vec::new();
    reached_during(window, &passing.emitter, span_s, &mut parts);
    parts
}

/// Appends the parts of a span during which a wake may reach down to the receiver, by halves: a top
/// face passes under the emitter.
fn reached_during(
    window: &Window<'_>,
    emitter: &Attached<'_>,
    span_s: Span,
    parts: &mut Vec<Span>,
) {
    let (surely, maybe) = window.reaches(emitter, span_s);
    let middle_s = 0.5 * (span_s.0 + span_s.1);
    let is_short = span_s.1 - span_s.0 <= SHORTEST_S
        || window.longest_path_m(emitter, span_s) <= SHORTEST_PATH_M;
    if surely || maybe && is_short {
        join(parts, span_s);
    } else if maybe {
        reached_during(window, emitter, (span_s.0, middle_s), parts);
        reached_during(window, emitter, (middle_s, span_s.1), parts);
    }
}
