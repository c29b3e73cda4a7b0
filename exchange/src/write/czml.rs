//! CZML, for Cesium: a packet a drone, its places on the Earth over time.
//!
//! The layout is that of AnalyticalGraphicsInc/czml-writer's CZML guide: a document with a clock,
//! then `position.cartographicDegrees` as time, longitude, latitude, height, straight in between.

use serde_json::{Value, json};

use crate::course::{Course, Piece};
use crate::frame::Georeference;

/// When time 0 is: CZML knows no time without a date. Chosen here.
pub const EPOCH: &str = "2000-01-01T00:00:00Z";
/// Longest straight part of a curve (s): chosen here; at 3 m/s2 it cuts 4 mm off.
const STEP_S: f64 = 0.1;

/// The file.
#[must_use]
pub fn file(name: &str, plan_id: &str, at: &Georeference, courses: &[Course]) -> Vec<u8> {
    let end_s = courses.iter().map(Course::until_s).fold(0.0, f64::max);
    let interval = format!("{EPOCH}/{}", date(end_s));
    let clock = json!({"interval": interval, "currentTime": EPOCH, "multiplier": 1});
    let mut packets = vec![json!({
        "id": "document", "version": "1.0", "name": name,
        "description": format!("plan {plan_id}; heights are above the ellipsoid"), "clock": clock,
    })];
    packets.extend(courses.iter().map(|it| packet(it, plan_id, at, end_s)));
    Value::from(packets).to_string().into_bytes()
}

fn packet(course: &Course, plan_id: &str, at: &Georeference, end_s: f64) -> Value {
    let mut numbers: Vec<f64> = Vec::new();
    let mut put = |t_s: f64, at_m| {
        let [longitude_deg, latitude_deg, height_m] = at.on_earth(at_m);
        let rounded = |value: f64, scale: f64| (value * scale).round() / scale + 0.0;
        // A tenth of a billionth of a degree is a hundredth of a millimetre.
        numbers.extend([
            rounded(t_s, 1e6),
            rounded(longitude_deg, 1e10),
            rounded(latitude_deg, 1e10),
            rounded(height_m, 1e5),
        ]);
    };
    put(0.0, course.start_m());
    for piece in &course.pieces {
        let parts = match piece.is_straight {
            true => vec![*piece],
            false => piece.parts(STEP_S),
        };
        parts
            .iter()
            .for_each(|it: &Piece| put(it.until_s, it.points_m[3]));
    }
    let from = date(course.enters_s.unwrap_or(0.0));
    let until = date(if course.leaves {
        course.until_s()
    } else {
        end_s
    });
    json!({
        "id": format!("{plan_id}/{}", course.name), "name": course.name,
        "availability": format!("{from}/{until}"),
        "position": {
            "epoch": EPOCH, "cartographicDegrees": numbers,
            "interpolationAlgorithm": "LINEAR", "interpolationDegree": 1,
            "forwardExtrapolationType": "HOLD",
        },
        "point": {"pixelSize": 8, "color": {"rgba": [0, 114, 178, 255]}},
        "path": {"width": 1, "leadTime": 0, "trailTime": 10},
    })
}

/// So long after the epoch (s, less than a month of 31 days; later times stay at its end).
fn date(after_s: f64) -> String {
    let ms = (after_s * 1000.0).ceil().min(31.0 * 86_400_000.0 - 1.0) as u64;
    let (day, hour) = (ms / 86_400_000 + 1, ms / 3_600_000 % 24);
    let (minute, second) = (ms / 60_000 % 60, ms / 1000 % 60);
    let ms = ms % 1000;
    format!("2000-01-{day:02}T{hour:02}:{minute:02}:{second:02}.{ms:03}Z")
}
