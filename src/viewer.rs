//! plan.html: a plan over time in one file that needs no network, with three.js and the page's own
//! script inside. [`scene`] is what the page shows, as data; [`air`] the air in it.

mod air;
mod scene;
mod waits;

use flight::FlightReport;
use planner::{Plan, World};

use crate::report::bottlenecks::Bottlenecks;
use crate::report::words::escape;
use air::AirOfPlan;
use scene::Scene;
use waits::Waits;
pub(crate) use waits::stops;

/// three.js 0.187 (MIT; THIRD_PARTY.md says how it is made), what of it the page uses.
const THREE: &str = include_str!("viewer/three.min.js");
const SCRIPT: &str = include_str!("viewer/page.js");
const STYLE: &str = include_str!("viewer/page.css");
const BODY: &str = include_str!("viewer/page.body.html");

/// A plan as it is looked at: its air, and its stops.
pub(crate) struct View<'a> {
    plan: &'a Plan,
    air: AirOfPlan<'a>,
    waits: Waits,
}

impl<'a> View<'a> {
    /// With its world the stops of a plan are told apart: dwells, and waits.
    pub(crate) fn of(plan: &'a Plan, world: Option<&World>) -> View<'a> {
        let air = AirOfPlan::new(plan);
        let waits = Waits::of(plan, world, &air);
        View { plan, air, waits }
    }

    /// Where and for whom the fleet waits most.
    pub(crate) fn bottlenecks(&self) -> Bottlenecks {
        self.waits.bottlenecks(self.plan)
    }
}

/// The whole page of a plan, and of how it was flown.
pub(crate) fn draw(view: &View<'_>, flown: Option<&FlightReport>) -> String {
    let View { plan, air, waits } = view;
    let scene = Scene::new(plan, (air, waits), flown);
    let data = serde_json::to_string(&scene).expect("a scene holds string keys alone");
    let title = escape(&plan.scenario);
    [
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; \
         script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:\">\n<title>",
        &title,
        "</title>\n<style>\n",
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests as sample;

    fn page(plan: &Plan) -> String {
        draw(&View::of(plan, None), None)
    }

    #[test]
    fn a_page_asks_for_nothing_and_its_texts_are_escaped() {
        let mut plan = sample::warehouse();
        plan.scenario = "a</script><b".into();
        let page = page(&plan);
        assert!(page.contains("a&lt;/script&gt;&lt;b"));
        assert_eq!(page.matches("</script>").count(), 3, "three scripts");
        for outside in ["src=\"http", "href=\"http", "@import", "url(http"] {
            assert!(!page.contains(outside), "{outside}");
        }
    }

    #[test]
    fn the_same_plan_gives_the_same_page() {
        let plan = sample::warehouse();
        assert!(page(&plan) == page(&plan));
    }

    #[test]
    fn a_thousand_drones_take_at_most_six_megabytes() {
        let plan = sample::hall(200);
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
