//! plan.html: a plan over time in one file that needs no network, with three.js and the page's own
//! script inside. `scene` is what the page shows, as data; `air` the air in it; `waits` which drone
//! stops for which, the source of [`Bottlenecks`].

mod air;
mod bottlenecks;
mod scene;
mod waits;

use flight::FlightReport;
use planner::{Plan, World};

use air::AirOfPlan;
use scene::PageData;
use waits::Waits;

pub use bottlenecks::{BottleneckDrone, BottleneckPlace, Bottlenecks};
pub use waits::{Stop, stops};

/// three.js 0.187 (MIT; THIRD_PARTY.md says how it is made), what of it the page uses.
const THREE: &str = include_str!("../page/three.min.js");
const SCRIPT: &str = include_str!("../page/page.js");
const STYLE: &str = include_str!("../page/page.css");
const BODY: &str = include_str!("../page/body.html");

/// A plan to be viewed: its air, and its stops.
pub struct View<'a> {
    plan: &'a Plan,
    air: AirOfPlan<'a>,
    waits: Waits,
    omitted: usize,
}

impl<'a> View<'a> {
    /// With its world the stops of a plan are classified: dwells, and waits.
    pub fn of(plan: &'a Plan, world: Option<&World>) -> View<'a> {
        let air = AirOfPlan::new(plan);
        let waits = Waits::of(plan, world, &air);
        View {
            plan,
            air,
            waits,
            omitted: 0,
        }
    }

    /// With so many violations more than the plan lists.
    pub fn with_omitted(self, omitted: usize) -> View<'a> {
        View { omitted, ..self }
    }

    /// Where and for which drones the fleet waits most.
    pub fn bottlenecks(&self) -> Bottlenecks {
        Bottlenecks::of(self.plan, &self.waits.stops)
    }

    /// The whole page as HTML, of the plan and of how it was flown.
    pub fn page(&self, flown: Option<&FlightReport>) -> String {
        let mut scene = PageData::new(self.plan, (&self.air, &self.waits), flown);
        scene.violation_count += self.omitted;
        let data = serde_json::to_string(&scene).expect("a scene holds string keys alone");
        [
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
             script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:\">\n\
             <title>plan</title>\n<style>\n",
            STYLE,
            "</style>\n</head>\n<body>\n",
            BODY,
            "<script id=\"scene\" type=\"application/json\">",
            // What would end the element early.
            &data.replace("</", "<\\/").replace("<!--", "<\\u0021--"),
            "</script>\n<script>\n/* three.js 0.187, MIT, Copyright three.js authors */\n",
            THREE,
            "</script>\n<script>\n",
            SCRIPT,
            "</script>\n</body>\n</html>\n",
        ]
        .concat()
    }
}

#[cfg(test)]
mod tests {
    use planner::Control;
    use planner::scenario::world::PathMotion;

    use super::*;

    /// Many drones in an empty hall, in straight motion with quasi-static wakes.
    pub(crate) fn hall(drones: usize) -> Plan {
        let text = tools::instances::Floor::Hall.scenario(drones, 1);
        let mut world = planner::read_world(&text.expect("they fit")).expect("in order");
        world.convection = None;
        world.planning.motion = PathMotion::Straight;
        let outcome = planner::plan_world(&world, &Control::QUIET).expect("in order");
        outcome.into_planned().expect("a plan").plan
    }

    fn page(plan: &Plan) -> String {
        View::of(plan, None).page(None)
    }

    #[test]
    fn a_page_asks_for_nothing_and_its_texts_are_escaped() {
        let mut plan = hall(4);
        plan.scenario = "a</script><b".into();
        let page = page(&plan);
        assert!(page.contains("a<\\/script><b"));
        assert_eq!(page.matches("</script>").count(), 3, "three scripts");
        for outside in ["src=\"http", "href=\"http", "@import", "url(http"] {
            assert!(!page.contains(outside), "{outside}");
        }
    }

    #[test]
    fn the_same_plan_gives_the_same_page() {
        let plan = hall(4);
        assert!(page(&plan) == page(&plan));
    }

    #[test]
    fn a_thousand_drones_take_at_most_six_megabytes() {
        let plan = hall(200);
        let empty = Plan {
            drones: Vec::new(),
            ..plan.clone()
        };
        let without = page(&empty).len();
        let each = (page(&plan).len() - without) / plan.drones.len();
        assert!(
            without + 1000 * each < 6_000_000,
            "{without} and {each} for each drone"
        );
    }
}
