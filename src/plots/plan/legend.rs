//! What the signs mean, below the drawing.

use planner::plan::{AtEnd, AtStart, DronePlan, Plan};

use super::canvas::Canvas;
use super::view::Layout;

/// Explains the signs that this plan's picture shows.
pub(super) fn draw(canvas: &mut Canvas, layout: &Layout, plan: &Plan, worst: bool) {
    let mut entries = vec![
        (
            r##"<circle cx="8" cy="-4" r="5" fill="#fcfcfa" stroke="#332288" stroke-width="1.6"/>"##,
            "start",
        ),
        (
            r##"<circle cx="8" cy="-4" r="3.8" fill="#332288"/>"##,
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
        let width = 22.0 + text.chars().count() as f64 * 5.7 + 18.0;
        if x + width > layout.width_px {
            (x, y) = (28.0, y + 22.0);
        }
        canvas.put(format_args!(
            r#"<g transform="translate({x:.1} {y:.1})">{sign}<text x="22">{text}</text></g>"#
        ));
        x += width;
    }
}
