//! The cover of a jet that effects have moved or reshaped.

use airflow::Wake;
use nalgebra::Vector3;

use super::{PI, Section, Spindle};

/// Bearings at which the edge is searched for. Chosen here: between two the farthest point of a jet moved by less than ten of its
/// widths is missed by less than [`MARGIN`] allows for.
const BEARINGS: u32 = 72;
/// Depths searched in each section.
const LEVELS: u32 = 12;
/// The edge is searched for at this part of the limit: what lies between bearings and depths looked at. Chosen here, and checked by random
/// points.
const LIMIT_PART: f64 = 0.93;
/// On every radius, for the same reason.
const MARGIN: f64 = 1.02;
/// Farther than so many motor distances below nobody looks: the deepest halls are a tenth of it for the smallest drones.
const DEEPEST_L: f64 = 2000.0;

pub(super) fn spindle(wake: &Wake, limit_mps: f64, frusta: usize) -> Spindle {
    let near_m = wake.near_field_depth_m();
    let section = |from_depth_m: f64, to_depth_m: f64| {
        let radius_m = farthest_m(wake, from_depth_m, to_depth_m, LIMIT_PART * limit_mps)?;
        Some(Section {
            from_depth_m,
            to_depth_m,
            from_radius_m: MARGIN * radius_m,
            to_radius_m: MARGIN * radius_m,
        })
    };
    let end_m = end_m(wake, LIMIT_PART * limit_mps);
    // Cylinders are a coarser cover than cones: four for each.
    let count = 4 * frusta;
    let ratio = (end_m / near_m).max(1.0).powf(1.0 / count as f64);
    let depth_m = |k: usize| near_m * ratio.powi(k as i32);
    let far_field: Vec<Section> = (0..count)
        .filter(|_| end_m > near_m)
        .filter_map(|k| section(depth_m(k), depth_m(k + 1)))
        .collect();
    let exact_far_field_m3 = far_field
        .iter()
        .map(|section| PI * section.height_m() * (section.to_radius_m / MARGIN).powi(2))
        .sum();
    Spindle {
        limit_mps,
        near_field: section(0.0, near_m),
        far_field,
        exact_far_field_m3,
    }
}

/// Depth below which the jet is slower than a speed everywhere, in steps of a tenth.
fn end_m(wake: &Wake, speed_mps: f64) -> f64 {
    let near_m = wake.near_field_depth_m();
    let (mut depth_m, mut end_m) = (near_m, 0.0);
    while depth_m < DEEPEST_L * wake.motor_distance_m() {
        if farthest_m(wake, depth_m, depth_m, speed_mps).is_some() {
            end_m = 1.1 * depth_m;
        } else if depth_m > 4.0 * near_m {
            break;
        }
        depth_m *= 1.1;
    }
    end_m
}

/// Distance from below the drone of the farthest point between two depths that is as fast as a speed; `None`: none is.
fn farthest_m(wake: &Wake, from_m: f64, to_m: f64, speed_mps: f64) -> Option<f64> {
    let levels = if from_m == to_m { 0 } else { LEVELS };
    let mut farthest: Option<f64> = None;
    for level in 0..=levels {
        let share = f64::from(level) / f64::from(levels.max(1));
        let depth_m = (from_m + share * (to_m - from_m)).max(1e-9 * wake.near_field_depth_m());
        let (Some(axis_m), Some(spread_m)) = (wake.axis_m(depth_m), wake.spread_m(depth_m)) else {
            continue;
        };
        // From the way it leans, in which it is longest.
        let first_bearing = axis_m[1].atan2(axis_m[0]);
        for bearing in 0..BEARINGS {
            let angle = std::f64::consts::TAU * f64::from(bearing) / f64::from(BEARINGS);
            let (sin, cos) = (angle + first_bearing).sin_cos();
            let at = |radius_m: f64| {
                Vector3::new(
                    axis_m[0] + radius_m * cos,
                    axis_m[1] + radius_m * sin,
                    -depth_m,
                )
            };
            if let Some(radius_m) =
                edge_m(|r_m| wake.axial_speed_mps(at(r_m)) >= speed_mps, spread_m)
            {
                let at_m = at(radius_m);
                farthest = Some(farthest.unwrap_or(0.0).max(at_m.xy().norm()));
            }
        }
    }
    farthest
}

/// The outermost radius about the axis that is fast enough, from outside, in steps of a thirtieth of the spread.
fn edge_m(is_fast: impl Fn(f64) -> bool, spread_m: f64) -> Option<f64> {
    let mut outer_m = 2.0 * spread_m;
    while is_fast(outer_m) {
        outer_m *= 1.5;
    }
    let step_m = spread_m / 30.0;
    while outer_m > 0.0 {
        let inner_m = (outer_m - step_m).max(0.0);
        if is_fast(inner_m) {
            return Some(outer_m);
        }
        outer_m = inner_m;
    }
    None
}
