//! The room with a metric grid, ticks, captions and a scale bar.

use super::canvas::Canvas;
use super::view::{Eye, View};
use crate::report::words::decimal;

/// Ticks are at least this far apart (px): numbers beside one another need more than stacked ones.
const TICK_RIGHT_PX: f64 = 64.0;
const TICK_UP_PX: f64 = 36.0;
const GREY: &str = "#52606d";

/// The room: its floor or its silhouette, with a metric grid.
pub(super) fn floor(canvas: &mut Canvas, view: &View) {
    let View {
        left_px: x,
        top_px: y,
        width_px: w,
        height_px: h,
        ..
    } = *view;
    canvas.put(format_args!(
        r##"<rect x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}" fill="#ffffff"/>"##
    ));
    let mut lines = String::new();
    for (at, _) in ticks(view, Axis::Right) {
        lines += &format!("M{at:.1} {y:.1}v{h:.1}");
    }
    for (at, _) in ticks(view, Axis::Up) {
        lines += &format!("M{x:.1} {at:.1}h{w:.1}");
    }
    canvas.put(format_args!(
        r##"<path d="{lines}" stroke="#e4e7eb" stroke-width="1" fill="none"/>"##
    ));
}

/// Frame, ticks in metres, caption.
pub(super) fn draw(canvas: &mut Canvas, view: &View) {
    let View {
        left_px: x,
        top_px: y,
        width_px: w,
        height_px: h,
        ..
    } = *view;
    let (caption, up_name) = match view.eye {
        Eye::Above => ("from above", "y (m)"),
        Eye::Side => ("from the side, along y", "z (m)"),
    };
    canvas.put(format_args!(
        r##"<rect x="{x:.1}" y="{y:.1}" width="{w:.1}" height="{h:.1}" fill="none" stroke="#3e4c59" stroke-width="1.2"/><text x="{x:.1}" y="{:.1}" font-weight="bold">{caption}</text>"##,
        y - 9.0
    ));
    let bottom = y + h;
    for (at, label) in ticks(view, Axis::Right) {
        canvas.put(format_args!(
            r#"<text x="{at:.1}" y="{:.1}" text-anchor="middle" fill="{GREY}">{label}</text>"#,
            bottom + 16.0
        ));
    }
    for (at, label) in ticks(view, Axis::Up) {
        canvas.put(format_args!(
            r#"<text x="{:.1}" y="{:.1}" text-anchor="end" fill="{GREY}">{label}</text>"#,
            x - 7.0,
            at + 4.0
        ));
    }
    let (middle_x, middle_y) = (x + w / 2.0, y + h / 2.0);
    canvas.put(format_args!(
        r#"<text x="{middle_x:.1}" y="{:.1}" text-anchor="middle" fill="{GREY}">x (m)</text><text transform="translate({:.1} {middle_y:.1}) rotate(-90)" text-anchor="middle" fill="{GREY}">{up_name}</text>"#,
        bottom + 34.0,
        x - 38.0
    ));
    if view.eye == Eye::Above {
        scale_bar(canvas, view);
    }
}

fn scale_bar(canvas: &mut Canvas, view: &View) {
    let length_m = tick_step_m(view.px_per_m, TICK_RIGHT_PX);
    let right = view.left_px + view.width_px;
    let (left, y) = (right - length_m * view.px_per_m, view.top_px - 10.0);
    canvas.put(format_args!(
        r##"<path d="M{left:.1} {:.1}v6M{left:.1} {y:.1}H{right:.1}M{right:.1} {:.1}v6" stroke="#3e4c59" stroke-width="1.5" fill="none"/><text x="{:.1}" y="{:.1}" text-anchor="end">{} m</text>"##,
        y - 3.0,
        y - 3.0,
        left - 6.0,
        y + 4.0,
        decimal(length_m)
    ));
}

#[derive(Clone, Copy)]
enum Axis {
    Right,
    Up,
}

/// Places on the sheet (px) and their labels in metres.
fn ticks(view: &View, axis: Axis) -> Vec<(f64, String)> {
    let (low, high) = (&view.bounds_m.min, &view.bounds_m.max);
    let (low_m, high_m, apart_px) = match axis {
        Axis::Right => (low.x, high.x, TICK_RIGHT_PX),
        Axis::Up if view.eye == Eye::Side => (low.z, high.z, TICK_UP_PX),
        // Squares on the floor.
        Axis::Up => (low.y, high.y, TICK_RIGHT_PX),
    };
    let step_m = tick_step_m(view.px_per_m, apart_px);
    let first = (low_m / step_m - 1e-9).ceil() as i64;
    let last = (high_m / step_m + 1e-9).floor() as i64;
    (first..=last)
        .map(|number| {
            let at_m = number as f64 * step_m;
            let offset_px = (at_m - low_m) * view.px_per_m;
            let at_px = match axis {
                Axis::Right => view.left_px + offset_px,
                Axis::Up => view.top_px + view.height_px - offset_px,
            };
            (at_px, decimal(at_m))
        })
        .collect()
}

/// 1, 2 or 5 times a power of ten (m).
fn tick_step_m(px_per_m: f64, apart_px: f64) -> f64 {
    let least_m = apart_px / px_per_m;
    let power = 10_f64.powf(least_m.log10().floor());
    let factor = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .find(|factor| factor * power >= least_m);
    factor.unwrap_or(10.0) * power
}
