//! The nearest place at which one drone is in order with everybody else of its set.

use nalgebra::{Point3, Vector3};

use super::body_gap_m;
use super::sites::{Scene, Site, Sites};
use crate::plan::trajectory::SAME_PLACE_M;
use crate::verify::FAINTEST_WAKE_MPS;
use crate::verify::obstacle::TOUCH_M;

/// Spacing of the places tried (m), chosen here: what a person would move a goal by.
const STEP_M: f64 = 0.1;
/// How far is still near (m), chosen here: beyond it a person would rather choose anew.
const FARTHEST_M: f64 = 8.0;
/// Bearings tried at each distance, chosen here: 15 degrees apart.
const BEARINGS: usize = 24;

/// The nearest place for a drone, by rings of growing distance: level, up and down.
pub(super) fn nearest(scene: &Scene<'_>, sites: &Sites<'_>, drone: usize) -> Option<Point3<f64>> {
    let site = sites.of(drone)?;
    let rings = (FARTHEST_M / STEP_M) as usize;
    (1..=rings).find_map(|ring| {
        let distance_m = ring as f64 * STEP_M;
        directions()
            .map(|towards| site.nominal_m + towards * distance_m)
            .find(|&place_m| {
                let moved = scene.moved(site, place_m);
                in_order(scene, sites, &moved)
            })
    })
}

/// Level ones first, then up and down.
fn directions() -> impl Iterator<Item = Vector3<f64>> {
    let level = (0..BEARINGS).map(|k| {
        let bearing = k as f64 / BEARINGS as f64 * std::f64::consts::TAU;
        Vector3::new(bearing.cos(), bearing.sin(), 0.0)
    });
    level.chain([Vector3::z(), -Vector3::z()])
}

/// Whether a drone may be there: in bounds, clear of solids, in order with all others and the zones.
fn in_order(scene: &Scene<'_>, sites: &Sites<'_>, moved: &Site<'_>) -> bool {
    let bounds_m = &scene.world.bounds_m;
    let within = |place_m: &Point3<f64>| {
        (0..3).all(|k| {
            place_m[k] >= bounds_m.min[k] - SAME_PLACE_M
                && place_m[k] <= bounds_m.max[k] + SAME_PLACE_M
        })
    };
    let clear_by = |place_m: &Point3<f64>, needs_m: f64| {
        scene.solids.iter().all(|solid| {
            let here = (place_m.coords, place_m.coords);
            solid.box_distance_m(&here) >= needs_m || solid.distance_m(&place_m.coords) >= needs_m
        })
    };
    let clearance_m = if moved.airborne || moved.lands {
        scene.world.planning.clearance_m
    } else {
        -TOUCH_M
    };
    if !within(&moved.nominal_m) || !clear_by(&moved.nominal_m, moved.body_radius_m + clearance_m) {
        return false;
    }
    // What it stands on touches it.
    if moved.lands
        && !(within(&moved.place_m) && clear_by(&moved.place_m, moved.body_radius_m - TOUCH_M))
    {
        return false;
    }
    let near = sites.near(moved.place_m, moved.drone);
    let apart = near.iter().all(|other| {
        body_gap_m(scene, moved, other).is_none()
            && !scene.in_column(moved, other)
            && !scene.in_column(other, moved)
    });
    apart
        && !scene.over_limit(moved, scene.air_mps(moved, near.iter().copied()))
        && near.iter().all(|other| spares(scene, sites, moved, other))
        && (0..scene.world.zones.len()).all(|k| spares_zone(scene, sites, moved, k))
}

/// Whether another drone stays within its limit, or does not feel this one.
fn spares(scene: &Scene<'_>, sites: &Sites<'_>, moved: &Site<'_>, other: &Site<'_>) -> bool {
    if scene.air_mps(other, std::iter::once(moved)) <= FAINTEST_WAKE_MPS {
        return true;
    }
    let mut others = sites.near(other.place_m, other.drone);
    others.retain(|third| third.drone != moved.drone);
    let all = others.into_iter().chain(std::iter::once(moved));
    !scene.over_limit(other, scene.air_mps(other, all))
}

/// Whether a zone keeps its limit, or does not feel this drone.
fn spares_zone(scene: &Scene<'_>, sites: &Sites<'_>, moved: &Site<'_>, zone: usize) -> bool {
    let Some(own) = scene.blow_into(moved, zone) else {
        return true;
    };
    let others = sites.all().iter().filter(|site| site.drone != moved.drone);
    let mut blows: Vec<_> = others
        .filter_map(|site| scene.blow_into(site, zone))
        .collect();
    blows.push(own);
    scene
        .zone_peak(zone, &blows.iter().collect::<Vec<_>>())
        .is_none()
}
