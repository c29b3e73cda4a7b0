//! plan.svg: the plan from above and from the side, with the wakes of whoever hovers and the moment
//! of the worst air.
//!
//! To scale, metres on the axes, z up. A light sheet of its own, so that it reads on dark pages too.

mod axes;
mod canvas;
mod labels;
mod layers;
mod legend;
mod view;
mod wakes;

use planner::plan::Plan;

use canvas::Canvas;
use labels::Labels;
use view::{Layout, View};
use wakes::{WorstMoment, hovering_wakes, worst_moment};

use crate::report::words::count;

/// Colours of Paul Tol's "muted" scheme for lines (personal.sron.nl/~pault), told apart by people
/// with any common colour vision; its sand and cyan are left out, too pale on this sheet.
const PALETTE: [&str; 7] = [
    "#332288", "#117733", "#882255", "#44AA99", "#CC6677", "#AA4499", "#999933",
];
/// Dashes told apart once the colours have gone round.
const DASHES: [&str; 3] = [
    "",
    " stroke-dasharray=\"6 3\"",
    " stroke-dasharray=\"2 2.5\"",
];

/// How a drone's line looks: colour first, then dashes.
fn line_style(index: usize) -> (&'static str, &'static str) {
    (
        PALETTE[index % PALETTE.len()],
        DASHES[index / PALETTE.len() % DASHES.len()],
    )
}

/// Draws the plan.
pub(crate) fn draw(plan: &Plan) -> String {
    let layout = Layout::of(&plan.bounds_m);
    let wakes = hovering_wakes(plan);
    let worst = worst_moment(plan);
    let mut canvas = Canvas::new(
        layout.width_px,
        layout.height_px,
        &title(plan),
        &subtitle(plan, worst.as_ref()),
    );
    for view in [&layout.above, &layout.side] {
        draw_view(&mut canvas, view, plan, &wakes, worst.as_ref());
    }
    legend::draw(&mut canvas, &layout, plan, worst.is_some());
    canvas.finish()
}

fn draw_view(
    canvas: &mut Canvas,
    view: &View,
    plan: &Plan,
    wakes: &[planner::Outline],
    worst: Option<&WorstMoment>,
) {
    axes::floor(canvas, view);
    layers::obstacles(canvas, view, plan);
    layers::zones(canvas, view, plan);
    canvas.group("wakes", |canvas| {
        for wake in wakes {
            wakes::draw(canvas, view, wake, wakes.len());
        }
    });
    layers::trajectories(canvas, view, plan);
    layers::markers(canvas, view, plan);
    if let Some(worst) = worst {
        wakes::draw_worst(canvas, view, worst);
    }
    axes::draw(canvas, view);
    // The most telling first: they choose their places.
    let mut labels = Labels::within(view);
    layers::keep_clear(view, plan, &mut labels);
    if let Some(worst) = worst {
        wakes::label_worst(view, worst, &mut labels);
    }
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
        Some(worst) => format!(
            "Worst air: {} meets {:.1} m/s at t = {:.1} s, {:.2} of its induced velocity; its limit is {:.2}",
            worst.name, worst.air_mps, worst.at_s, worst.alpha, worst.limit
        ),
        None => "Nobody meets air from above".into(),
    };
    if !plan.unplanned.is_empty() {
        text += &format!(
            ". {} at the start",
            count(plan.unplanned.len(), "drone stays", "drones stay")
        );
    }
    if !plan.violations.is_empty() {
        text += &format!(
            ". NOT SAFE: {}",
            count(plan.violations.len(), "violation", "violations")
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;

    #[test]
    fn the_same_plan_draws_the_same_picture() {
        assert_eq!(draw(&sample::warehouse()), draw(&sample::warehouse()));
    }

    #[test]
    fn every_drone_is_drawn_in_both_views_and_every_tag_is_closed() {
        for plan in [sample::warehouse(), sample::hall(200)] {
            let text = draw(&plan);
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
    fn names_are_escaped() {
        let mut plan = sample::warehouse();
        plan.scenario = "a<b & \"c\"".into();
        assert!(draw(&plan).contains("a&lt;b &amp; &quot;c&quot;"));
    }
}
