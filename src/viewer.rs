//! plan.html: a plan over time in one file that needs no network, with three.js and the page's own
//! script inside. [`scene`] is what the page shows, as data; [`air`] the air in it.

mod air;
mod scene;

use flight::FlightReport;
use planner::{Plan, World};

use crate::report::words::escape;
use scene::Scene;
pub(crate) use scene::stops;

/// three.js 0.187 (MIT; THIRD_PARTY.md says how it is made), what of it the page uses.
const THREE: &str = include_str!("viewer/three.min.js");
const SCRIPT: &str = include_str!("viewer/page.js");
const STYLE: &str = include_str!("viewer/page.css");
const BODY: &str = include_str!("viewer/page.body.html");

/// The whole page. With its world the stops of a plan are told apart: dwells, and waits.
pub(crate) fn draw(plan: &Plan, world: Option<&World>, flown: Option<&FlightReport>) -> String {
    let scene = Scene::new(plan, world, flown);
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

    #[test]
    fn a_page_asks_for_nothing_and_its_texts_are_escaped() {
        let mut plan = sample::warehouse();
        plan.scenario = "a</script><b".into();
        let page = draw(&plan, None, None);
        assert!(page.contains("a&lt;/script&gt;&lt;b"));
        assert_eq!(page.matches("</script>").count(), 3, "three scripts");
        for outside in ["src=\"http", "href=\"http", "@import", "url(http"] {
            assert!(!page.contains(outside), "{outside}");
        }
    }

    #[test]
    fn the_same_plan_gives_the_same_page() {
        let plan = sample::warehouse();
        assert!(draw(&plan, None, None) == draw(&plan, None, None));
    }

    #[test]
    fn a_thousand_drones_take_at_most_six_megabytes() {
        let plan = sample::hall(200);
        let without = draw(
            &Plan {
                drones: Vec::new(),
                ..plan.clone()
            },
            None,
            None,
        )
        .len();
        let each = (draw(&plan, None, None).len() - without) / plan.drones.len();
        assert!(
            without + 1000 * each < 6_000_000,
            "{without} and {each} for each drone"
        );
    }
}
