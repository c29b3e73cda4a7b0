//! Starts and goals that exclude one another, found before any search.
//!
//! Two sets are judged, each as if it lasted: everybody at its start at time 0, and everybody who stays
//! at its goal after the last arrival. Bodies, columns, wakes and zones are judged as
//! [`verify`](crate::verify::verify) judges them, with the clearance between bodies in addition: an
//! endpoint is chosen by the planner's rules. Where an endpoint lies (bounds, obstacles) is not asked
//! here, except of the places proposed instead.

mod fix;
mod sites;

use rayon::prelude::*;

use crate::plan::outcome::{Blocker, EndpointConflict, EndpointKind, Exclusion};
use crate::scenario::world::World;
use crate::verify::zone;
use sites::{Scene, Site, Sites};

/// Every pair of starts, and of goals at which drones stay, that no plan can have; and every drone that
/// hovers where it breaks a zone's limit.
///
/// A pair is named once, under the later of two bodies that touch and under the drone that suffers from
/// a column or a wake. Where only a sum of wakes exceeds a limit, the strongest of them is named.
pub fn check(world: &World) -> Vec<EndpointConflict> {
    let scene = Scene::new(world);
    [EndpointKind::Starts, EndpointKind::Goals]
        .into_iter()
        .flat_map(|when| check_set(&scene, when))
        .collect()
}

fn check_set(scene: &Scene<'_>, when: EndpointKind) -> Vec<EndpointConflict> {
    let sites = Sites::new(scene, when);
    let pairs: Vec<Vec<(usize, Blocker, Exclusion)>> = sites
        .all()
        .par_iter()
        .map(|site| exclusions(scene, &sites, site))
        .collect();
    let zones: Vec<Vec<(usize, Blocker, Exclusion)>> = (0..scene.world.zones.len())
        .into_par_iter()
        .map(|k| in_zone(scene, &sites, k))
        .collect();
    let found: Vec<_> = pairs.into_iter().chain(zones).flatten().collect();
    let mut conflicts: Vec<EndpointConflict> = found
        .into_par_iter()
        .map(|(drone, blocker, why)| {
            let nearest_fix_m = fix::nearest(scene, &sites, drone);
            EndpointConflict {
                drone,
                blocker,
                when,
                why,
                nearest_fix_m,
            }
        })
        .collect();
    conflicts.sort_by_key(|conflict| conflict.drone);
    conflicts
}

/// What excludes one site from being where it is, as far as it is the one to name it.
fn exclusions(
    scene: &Scene<'_>,
    sites: &Sites<'_>,
    site: &Site<'_>,
) -> Vec<(usize, Blocker, Exclusion)> {
    let mut found = Vec::new();
    let near = sites.near(site.place_m, site.drone);
    let mut named = Vec::new();
    for other in &near {
        if let Some(gap_m) = body_gap_m(scene, site, other) {
            named.push(other.drone);
            if other.drone < site.drone {
                let why = Exclusion::Bodies {
                    gap_m,
                    needs_m: scene.world.planning.clearance_m,
                };
                found.push((site.drone, Blocker::Drone(other.drone), why));
            }
        } else if scene.in_column(site, other) {
            named.push(other.drone);
            found.push((site.drone, Blocker::Drone(other.drone), Exclusion::Column));
        }
    }
    let air_mps = scene.air_mps(site, near.iter().copied());
    if !scene.over_limit(site, air_mps) {
        return found;
    }
    let why = Exclusion::Air {
        air_mps,
        alpha: air_mps / site.induced_velocity_mps,
        limit: site.air_limit,
    };
    let alone: Vec<(usize, f64)> = near
        .iter()
        .map(|&other| (other.drone, scene.air_mps(site, std::iter::once(other))))
        .collect();
    let before = found.len();
    for &(other, alone_mps) in &alone {
        if scene.over_limit(site, alone_mps) && !named.contains(&other) {
            found.push((site.drone, Blocker::Drone(other), why));
        }
    }
    let explained = found.len() > before || !named.is_empty();
    let strongest = alone
        .into_iter()
        .reduce(|a, b| if b.1 > a.1 { b } else { a });
    if let (false, Some((other, _))) = (explained, strongest) {
        found.push((site.drone, Blocker::Drone(other), why));
    }
    found
}

/// The gap between two bodies, if it is too small (m).
fn body_gap_m(scene: &Scene<'_>, one: &Site<'_>, other: &Site<'_>) -> Option<f64> {
    let gap_m = (one.place_m - other.place_m).norm() - one.body_radius_m - other.body_radius_m;
    // Rounding of a scenario's decimals is no conflict.
    (gap_m < scene.world.planning.clearance_m - crate::plan::trajectory::SAME_PLACE_M)
        .then_some(gap_m)
}

/// Who breaks a zone's limit: all who do so alone, or else the strongest.
fn in_zone(scene: &Scene<'_>, sites: &Sites<'_>, k: usize) -> Vec<(usize, Blocker, Exclusion)> {
    let all: Vec<&Site<'_>> = sites.all().iter().collect();
    let blows: Vec<zone::Blow<'_>> = all
        .iter()
        .filter_map(|site| scene.blow_into(site, k))
        .collect();
    let together: Vec<&zone::Blow<'_>> = blows.iter().collect();
    let Some(peak) = scene.zone_peak(k, &together) else {
        return Vec::new();
    };
    let why = Exclusion::Zone {
        air_mps: peak.air_mps,
        limit_mps: scene.world.zones[k].air_limit_mps,
    };
    let mut guilty: Vec<usize> = blows
        .iter()
        .filter(|blow| scene.zone_peak(k, &[*blow]).is_some())
        .map(|blow| blow.from)
        .collect();
    if guilty.is_empty() {
        guilty.extend(zone::strongest(&scene.field(), &together, &peak));
    }
    guilty
        .into_iter()
        .map(|drone| (drone, Blocker::Zone(k), why))
        .collect()
}
