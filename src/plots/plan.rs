//! plan.svg: the plan from above and from the side, with the wakes of hovering drones and the
//! moment of the worst air.
//!
//! From above: x (m) across, y (m) upwards; from the side: x (m) across, z (m) upwards; all to one
//! scale.

mod labels;
mod layers;
mod view;
mod wakes;

use planner::plan::{AtEnd, AtStart, DronePlan, Plan};
use planner::{Outline, World};
use viewer::Stop;

use super::canvas::{Canvas, MARGIN, circle, fill, polyline, rectangle, solid, stroke};
use super::colours::{AIR, PAPER, SERIES, WORST};
use super::legend::{Entry, LINE, legend, legend_height};
use crate::report::words::count;
use labels::Labels;
use view::{Eye, View, views};
use wakes::{WorstMoment, hovering_wakes, worst_moment};

/// Tick labels and axis title, and what is left free below the legend.
const BOTTOM_PX: f64 = 56.0 + LINE;
/// What is left free on the right.
const RIGHT_PX: f64 = 36.0;
/// Title and legend want this much, however narrow the drawing.
const NARROWEST_SHEET_PX: f64 = 760.0;

/// Draws the plan; with its world dwells and waits are distinguished.
pub(crate) fn draw(plan: &Plan, world: Option<&World>) -> String {
    let marked = match plan.drones.len() {
        drones @ ..=layers::MARKED_UP_TO => 0..drones,
        _ => 0..0,
    };
    let stops: Vec<_> = marked
        .map(|drone| viewer::stops(plan, world, drone))
        .collect();
    let views = views(&plan.bounds_m);
    let side = views[1].chart.area;
    let (worst, wakes) = (worst_moment(plan), hovering_wakes(plan));
    let width = (side.right() + RIGHT_PX).max(NARROWEST_SHEET_PX);
    let defs = wakes::fade("air", AIR, 1.0, 0.35) + &wakes::fade("worst-air", WORST, 0.5, 0.15);
    let key = key(plan, worst.is_some());
    let key_px = legend_height(width - 2.0 * MARGIN, &key);
    let size = (width, side.bottom() + BOTTOM_PX + key_px);
    let title = (&title(plan)[..], &subtitle(plan, worst.as_ref())[..]);
    let (mut canvas, sheet) = Canvas::new(size, title, &defs);
    for view in &views {
        draw_view(&mut canvas, view, (plan, &stops), (&wakes, worst.as_ref()));
    }
    let above = side.bottom() + 50.0 - sheet.top;
    let below = sheet.inset([MARGIN, above, MARGIN, 0.0]);
    legend(&mut canvas, below, &key);
    canvas.finish()
}

fn draw_view(
    canvas: &mut Canvas,
    view: &View,
    (plan, stops): (&Plan, &[Vec<Stop>]),
    (wakes, worst): (&[Outline], Option<&WorstMoment>),
) {
    view.chart.grid(canvas);
    layers::obstacles(canvas, view, plan);
    layers::zones(canvas, view, plan);
    canvas.group("wakes", |canvas| {
        for wake in wakes {
            wakes::draw(canvas, view, wake, wakes.len());
        }
    });
    let mut labels = Labels::within(view.chart.area);
    layers::drones(canvas, view, (plan, stops), &mut labels);
    if let Some(worst) = worst {
        wakes::draw_worst(canvas, view, worst);
    }
    layers::refused(canvas, view, plan);
    let (caption, up) = match view.eye {
        Eye::Above => ("from above", "y (m)"),
        Eye::Side => ("from the side, along y", "z (m)"),
    };
    view.chart.axes(canvas, caption, "x (m)", up);
    // The most telling first: they choose their places.
    if let Some(worst) = worst {
        wakes::label_worst(view, worst, &mut labels);
    }
    layers::label_refused(view, plan, &mut labels);
    layers::names(view, plan, &mut labels);
    labels.write(canvas);
}

fn title(plan: &Plan) -> String {
    format!(
        "{}: {}, makespan {:.1} s",
        plan.scenario,
        count(plan.drones.len(), "drone", "drones"),
        plan.fleet.makespan_s
    )
}

fn subtitle(plan: &Plan, worst: Option<&WorstMoment>) -> String {
    let mut text = match worst {
        Some(WorstMoment { drone, at_s, .. }) => format!(
            "Worst air: {} is exposed to {:.1} m/s at t = {at_s:.1} s, {:.2} of its induced velocity; its limit is {:.2}",
            drone.name,
            drone.worst_air_mps,
            wakes::alpha(&plan.flown(), drone),
            drone.air_limit
        ),
        None => "No drone is exposed to downwash".into(),
    };
    let (unplanned, violations) = (plan.unplanned.len(), plan.violations.len());
    if unplanned > 0 {
        let stay = count(unplanned, "drone stays", "drones stay");
        text += &format!(". {stay} at the start");
    }
    if violations > 0 {
        let found = count(violations, "violation", "violations");
        text += &format!(". NOT SAFE: {found}");
    }
    text
}

/// The signs that this plan's picture shows.
fn key(plan: &Plan, has_worst: bool) -> Vec<Entry> {
    let drone = SERIES[0];
    let dot = |radius| circle((11.0, 0.0), radius);
    let ring = fill(PAPER, 1.0) + &stroke(drone, 1.6);
    let wake = wakes::look(AIR, r#" fill="url(#air)" fill-opacity="0.4""#);
    let mut entries = vec![
        Entry::new(&dot(5.0), &ring, "start"),
        Entry::new(&dot(3.8), &fill(drone, 1.0), "goal"),
        Entry::new(
            "M8 -9h6v4h1l4 12h-16l4 -12h1z",
            &wake,
            "wake of a hovering drone: column, then half-width",
        ),
    ];
    let lands =
        |drone: &DronePlan| drone.at_start == AtStart::Landed || drone.at_end == AtEnd::Land;
    if plan.drones.iter().any(lands) {
        let square = rectangle((6.5, -4.5), (15.5, 4.5));
        entries.push(Entry::new(&square, &fill(drone, 1.0), "landed: no wake"));
    }
    if plan.drones.len() <= layers::MARKED_UP_TO {
        let arrow = polyline([(15.0, 0.0), (7.0, 4.0), (7.0, -4.0)]) + "z";
        entries.push(Entry::new(&arrow, &fill(drone, 1.0), "direction of flight"));
        let bars = "M8.6 -4.5V4.5M13.4 -4.5V4.5";
        entries.push(Entry::new(bars, &solid(drone, 2.0), "waits or dwells"));
    }
    if plan
        .unplanned
        .iter()
        .any(|it| it.cause.as_ref().is_some_and(|it| it.at_m.is_some()))
    {
        let cross = "M5.5 -5.5L16.5 5.5M5.5 5.5L16.5 -5.5";
        let refused =
            "as far as a drone without a path could get, or the place that it cannot have";
        entries.push(Entry::new(cross, &solid(WORST, 2.4), refused));
    }
    if has_worst {
        let worst = "worst air, and the wake it comes from";
        entries.push(Entry::new(&dot(6.0), &solid(WORST, 2.2), worst));
    }
    if !plan.obstacles.is_empty() {
        entries.push(Entry::patch(&layers::solid_look(Eye::Above), "obstacle"));
    }
    for (keep_out, what) in [
        (false, "zone with a limit"),
        (true, "zone that no body may enter"),
    ] {
        if plan.zones.iter().any(|zone| zone.keep_out == keep_out) {
            entries.push(Entry::patch(&layers::zone_look(keep_out), what));
        }
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests as sample;

    #[test]
    fn the_same_plan_draws_the_same_picture() {
        assert_eq!(
            draw(&sample::warehouse(), None),
            draw(&sample::warehouse(), None)
        );
    }

    #[test]
    fn every_drone_is_drawn_in_both_views_and_every_tag_is_closed() {
        for plan in [sample::warehouse(), sample::hall(200)] {
            let text = draw(&plan, None);
            for drone in &plan.drones {
                assert_eq!(
                    text.matches(&format!("<title>{}:", drone.name)).count(),
                    2,
                    "{}",
                    drone.name
                );
            }
            assert_eq!(text.matches("<g").count(), text.matches("</g>").count());
            assert!(!text.contains("NaN") && !text.contains("inf"));
        }
    }

    #[test]
    fn a_drone_that_stays_does_not_arrive_and_a_dwell_is_no_wait() {
        let text = r#"Scenario(name: "desk", bounds_m: (min: (0, 0, 0), max: (20, 10, 6)),
            zones: [(name: "desk", min_m: (8, 3, 0), max_m: (11, 6, 2), air_limit_mps: 1.5)],
            drones: [
                (name: "a", airframe: "kolibri", start_m: (1, 5, 1), tasks: [(to_m: (9, 5, 1), dwell_s: 5)]),
                (name: "b", airframe: "offboard-1", start_m: (18, 9, 2), tasks: [(to_m: (2, 9, 2), dwell_s: 2),
                    (to_m: (18, 9, 2))]),
            ])"#;
        let world = planner::read_world(text).expect("in order");
        let outcome = planner::plan_world(&world, &planner::Control::QUIET).expect("in order");
        let plan = outcome.into_planned().expect("a plan").plan;
        let text = draw(&plan, Some(&world));
        let titles: Vec<&str> = text.split("<title>").skip(1).collect();
        let told = |what: &str| titles.iter().filter(|it| it.starts_with(what)).count();
        assert_eq!(told("a: kolibri, stays<"), 2, "{titles:?}");
        assert_eq!(told("b dwells 2.0 s from t = "), 2, "{titles:?}");
        assert_eq!(told("b waits"), 0, "{titles:?}");
    }

    #[test]
    fn a_zone_that_keeps_bodies_out_is_not_said_to_limit_air() {
        let mut plan = sample::warehouse();
        let told = |plan: &Plan| {
            let text = draw(plan, None);
            ["zone with a limit", "zone that no body may enter"].map(|it| text.contains(it))
        };
        assert_eq!(told(&plan), [true, false]);
        plan.zones.iter_mut().for_each(|it| it.keep_out = true);
        assert_eq!(told(&plan), [false, true]);
    }

    #[test]
    fn names_are_escaped() {
        let mut plan = sample::warehouse();
        plan.scenario = "a<b & \"c\"".into();
        assert!(draw(&plan, None).contains("a&lt;b &amp; &quot;c&quot;"));
    }
}
