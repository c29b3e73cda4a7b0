//! The slice of report.html that can be turned: samples in the wake's own cylinder, and the script
//! that draws those near a plane through its axis.

use serde::Serialize;

use super::words::escape;

/// Samples that a page holds at most: chosen here, some 150 kB.
const MOST: usize = 6_000;
/// Of places (motor distances): a hundredth.
const UNIT: f64 = 0.01;
const SCRIPT: &str = include_str!("slice.js");

/// One sample in the wake.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    /// Distance from the axis over the motor distance.
    pub(crate) r_over_l: f64,
    /// From x towards y (rad).
    pub(crate) azimuth_rad: f64,
    /// Depth over the motor distance.
    pub(crate) s_over_l: f64,
    pub(crate) recorded: f64,
    /// Recorded minus simulated.
    pub(crate) before: f64,
    /// Recorded minus corrected.
    pub(crate) after: f64,
}

/// Whole hundredths, and values to five digits.
#[derive(Default, Serialize)]
struct Data<'a> {
    unit: &'a str,
    x: Vec<i64>,
    y: Vec<i64>,
    s: Vec<i64>,
    recorded: Vec<f32>,
    before: Vec<f32>,
    after: Vec<f32>,
}

/// The slice as HTML, with its script; `None` without samples beside an axis.
pub(crate) fn html(unit: &str, samples: &[Placed]) -> Option<String> {
    let is_beside = |it: &&Placed| it.r_over_l > UNIT;
    samples.iter().find(is_beside)?;
    let every = samples.len().div_ceil(MOST);
    let mut data = Data {
        unit,
        ..Data::default()
    };
    let whole = |value: f64| (value / UNIT).round() as i64;
    // As many digits as a colour has steps, and more.
    let short = |value: f64| (value * 1e4).round() as f32 / 1e4;
    for it in samples.iter().step_by(every) {
        let (sin, cos) = it.azimuth_rad.sin_cos();
        data.x.push(whole(it.r_over_l * cos));
        data.y.push(whole(it.r_over_l * sin));
        data.s.push(whole(it.s_over_l));
        data.recorded.push(short(it.recorded));
        data.before.push(short(it.before));
        data.after.push(short(it.after));
    }
    let shown = data.x.len();
    let some = match every {
        1 => String::new(),
        _ => format!(" {shown} of {} samples are in the page.", samples.len()),
    };
    let json = serde_json::to_string(&data).expect("numbers and a word");
    Some(format!(
        "<div class=\"slice\"><p><label>Turn <input type=\"range\" min=\"0\" max=\"179\" value=\"0\" \
         aria-label=\"Azimuth of the slice in degrees\"></label> <output></output> \
         <select aria-label=\"What is shown\"><option value=\"residual\">recorded - simulated</option>\
         <option value=\"value\">recorded, simulated, corrected</option></select></p>\n\
         <canvas style=\"width:100%;touch-action:pan-y;cursor:ew-resize\"></canvas>\n\
         <script type=\"application/json\">{}</script></div>\n\
         <figcaption>A slice through the axis of the strongest wake at each sample: turn it by the \
         slider, by dragging, or by the arrow keys. Means by cell of the samples near the plane; grey: \
         none there.{}</figcaption>\n<script>\n{SCRIPT}</script>\n",
        json.replace("</", "<\\/"),
        escape(&some)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(r_over_l: f64, azimuth_rad: f64) -> Placed {
        Placed {
            r_over_l,
            azimuth_rad,
            s_over_l: 4.0,
            recorded: 2.0,
            before: 0.5,
            after: -0.1,
        }
    }

    #[test]
    fn places_are_those_of_the_samples_and_a_page_holds_no_more_than_it_says() {
        let east = placed(1.5, 0.0);
        let north = placed(2.0, std::f64::consts::FRAC_PI_2);
        let page = html("m/s", &[east, north]).expect("samples beside the axis");
        assert!(
            page.contains(r#""x":[150,0],"y":[0,200],"s":[400,400]"#),
            "{page}"
        );
        assert!(html("m/s", &[placed(0.0, 1.0)]).is_none());
        let many = html("m/s", &vec![east; 2 * MOST + 1]).expect("samples");
        assert!(many.contains(" 4001 of 12001 samples"));
    }
}
