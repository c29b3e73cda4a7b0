//! Where everybody is at one of the two moments, and who is near a place.

use std::collections::HashMap;
use std::sync::Arc;

use airflow::{Airframe, DiscPoints, Source, Wake, mean_over_discs_mps};
use nalgebra::Point3;

use crate::plan::outcome::EndpointKind;
use crate::plan::trajectory::{Motion, SAME_PLACE_M};
use crate::scenario::world::{AtEnd, AtStart, Drone, Solid, World};
use crate::verify::FAINTEST_WAKE_MPS;
use crate::verify::air::ALPHA_TOLERANCE;
use crate::verify::solid::{RawShape, Solid as Body};
use crate::verify::wake_bound::BoundedWake;
use crate::verify::wake_end::Stops;
use crate::verify::zone::{self, Blow, Field, Peak, Wall};

/// The world with its wakes and solids made ready.
pub(super) struct Scene<'a> {
    pub(super) world: &'a World,
    pub(super) solids: Vec<Body>,
    stops: Stops,
    /// By airframe: its wake without payload and its discs.
    hangar: Vec<(Airframe, BoundedWake, Arc<DiscPoints>)>,
    /// Air without any wake (m/s).
    draught_mps: f64,
    wall: Option<Wall>,
    /// Factor on the air that receivers are exposed to.
    receiver_gain: f64,
}

/// One drone at its endpoint.
#[derive(Clone)]
pub(super) struct Site<'a> {
    /// Index in the world's drones.
    pub(super) drone: usize,
    /// Where the scenario puts it (m).
    pub(super) nominal_m: Point3<f64>,
    /// Where it is: there, or on the ground below (m).
    pub(super) place_m: Point3<f64>,
    /// Blows, and is limited.
    pub(super) airborne: bool,
    pub(super) lands: bool,
    pub(super) body_radius_m: f64,
    pub(super) tip_radius_m: f64,
    pub(super) air_limit: f64,
    pub(super) induced_velocity_mps: f64,
    wake: Arc<BoundedWake>,
    discs: &'a DiscPoints,
    stops: Vec<u32>,
}

impl<'a> Scene<'a> {
    pub(super) fn new(world: &'a World) -> Scene<'a> {
        let solids: Vec<Body> = world
            .obstacles
            .iter()
            .filter_map(|obstacle| {
                let raw = match &obstacle.shape {
                    Solid::Box(bounds) => RawShape::Box {
                        min_m: bounds.min,
                        max_m: bounds.max,
                    },
                    Solid::Cylinder {
                        base_m,
                        radius_m,
                        height_m,
                    } => RawShape::Cylinder {
                        base_m: *base_m,
                        radius_m: *radius_m,
                        height_m: *height_m,
                    },
                    Solid::Mesh {
                        vertices_m,
                        triangles,
                        ..
                    } => RawShape::Mesh {
                        vertices_m,
                        triangles,
                    },
                };
                // A world is checked: every obstacle has a shape.
                Body::new(&obstacle.name, raw).ok()
            })
            .collect();
        let density = world.air.density_kg_per_m3();
        let deepest_m = world.bounds_m.max.z - world.bounds_m.min.z;
        // A world is checked: nothing in it is refused.
        let flown = world.effects.flown().unwrap_or_default();
        let mut hangar: Vec<(Airframe, BoundedWake, Arc<DiscPoints>)> = Vec::new();
        for drone in &world.drones {
            let airframe = &drone.vehicle.airframe;
            if !hangar.iter().any(|known| known.0 == *airframe) {
                let wake = Wake::new(airframe, airframe.mass_kg(), density, &world.jet);
                hangar.push((
                    airframe.clone(),
                    BoundedWake::new(flown.wake(&wake), deepest_m),
                    Arc::new(airframe.disc_points()),
                ));
            }
        }
        Scene {
            world,
            stops: Stops::new(world.bounds_m.min.z, &solids),
            solids,
            hangar,
            draught_mps: flown.draught_mps,
            wall: flown.wall.map(|effect| Wall {
                effect,
                floor_z_m: world.bounds_m.min.z,
            }),
            receiver_gain: flown.receiver_gain,
        }
    }

    /// Where a drone is at one of the two moments; `None`: gone.
    fn site(&'a self, index: usize, when: EndpointKind) -> Option<Site<'a>> {
        let drone = &self.world.drones[index];
        let idle = drone.tasks.is_empty();
        let landed_start = drone.at_start == AtStart::Landed;
        if drone.at_end == AtEnd::Leave && (idle || when == EndpointKind::Goals) {
            return None;
        }
        let (nominal_m, airborne, lands) = match when {
            EndpointKind::Starts => (drone.start_m, !landed_start, false),
            EndpointKind::Goals => {
                let goal_m = drone.tasks.last().map_or(drone.start_m, |task| task.to_m);
                let stays_landed = idle && landed_start;
                let lands = drone.at_end == AtEnd::Land && !stays_landed;
                (goal_m, !stays_landed && !lands, lands)
            }
        };
        let load_kg = match when {
            EndpointKind::Starts => 0.0,
            EndpointKind::Goals => last_load_kg(drone),
        };
        let airframe = &drone.vehicle.airframe;
        let (_, bare, discs) = self.hangar.iter().find(|known| known.0 == *airframe)?;
        let wake = if load_kg == 0.0 {
            bare.clone()
        } else {
            bare.with_mass(airframe.mass_kg() + load_kg)
        };
        let site = Site {
            drone: index,
            nominal_m,
            place_m: nominal_m,
            airborne,
            lands,
            body_radius_m: drone.vehicle.body_radius_m,
            tip_radius_m: airframe.tip_radius_m(),
            air_limit: drone.air_limit,
            induced_velocity_mps: wake.wake.hover_velocity_mps() / self.receiver_gain,
            wake: Arc::new(wake),
            discs,
            stops: Vec::new(),
        };
        Some(self.moved(&site, nominal_m))
    }

    /// The same drone with another endpoint.
    pub(super) fn moved(&self, site: &Site<'a>, nominal_m: Point3<f64>) -> Site<'a> {
        let mut place_m = nominal_m;
        if site.lands {
            let supports_m = self
                .solids
                .iter()
                .filter_map(|solid| solid.support_z_m(&nominal_m));
            place_m.z = supports_m.fold(self.world.bounds_m.min.z, f64::max) + site.body_radius_m;
        }
        let stops = self
            .stops
            .candidates(&site.wake.wake, &(place_m.coords, place_m.coords));
        Site {
            nominal_m,
            place_m,
            stops,
            ..site.clone()
        }
    }

    fn source<'s>(&self, site: &'s Site<'_>) -> Source<'s> {
        let wake = &site.wake.wake;
        Source {
            wake,
            position_m: site.place_m,
            ends_at_z_m: self.stops.end_z_m(wake, &site.place_m, &site.stops),
        }
    }

    /// Mean air over the receiver's discs from all airborne others, superposed (m/s).
    pub(super) fn air_mps<'s>(
        &self,
        receiver: &Site<'_>,
        others: impl Iterator<Item = &'s Site<'s>>,
    ) -> f64 {
        if !receiver.airborne {
            return 0.0;
        }
        let felt = others.filter(|other| other.airborne && receiver.place_m.z < other.place_m.z);
        let sources: Vec<Source<'_>> = felt.map(|other| self.source(other)).collect();
        if sources.is_empty() {
            return 0.0;
        }
        mean_over_discs_mps(
            &sources,
            receiver.discs,
            receiver.place_m,
            self.world.superposition,
        )
    }

    /// Whether that much air is too much for a site.
    pub(super) fn over_limit(&self, site: &Site<'_>, air_mps: f64) -> bool {
        air_mps > (site.air_limit + ALPHA_TOLERANCE) * site.induced_velocity_mps - self.draught_mps
    }

    /// Whether the receiver's centre is in the other's near-field column.
    pub(super) fn in_column(&self, receiver: &Site<'_>, other: &Site<'_>) -> bool {
        let depth_m = other.place_m.z - receiver.place_m.z;
        let off_axis_m = (other.place_m - receiver.place_m).xy().norm();
        receiver.airborne
            && other.airborne
            && depth_m > SAME_PLACE_M
            && depth_m < other.wake.wake.near_field_depth_m() - SAME_PLACE_M
            && off_axis_m < other.wake.wake.column_radius_m() - SAME_PLACE_M
            && receiver.place_m.z >= self.source(other).ends_at_z_m - SAME_PLACE_M
    }

    /// What zones are searched with.
    pub(super) fn field(&self) -> Field<'_> {
        Field {
            stops: &self.stops,
            superposition: self.world.superposition,
            wall: self.wall,
        }
    }

    /// The wake of a site, if it may be felt in a zone.
    pub(super) fn blow_into<'s>(&self, site: &'s Site<'_>, zone: usize) -> Option<Blow<'s>> {
        let motion = Motion::still((0.0, 0.0), site.place_m);
        let blow = Blow {
            from: site.drone,
            wake: &site.wake,
            motion,
            stops: &site.stops,
            // Whoever stands has been there for as long as its air needs.
            late: None,
        };
        let bounds_m = &self.world.zones[zone].bounds_m;
        let places_m = (bounds_m.min.coords, bounds_m.max.coords);
        let felt = site.airborne
            && zone::high_mps(&self.field(), &blow, &places_m, (0.0, 0.0)) > FAINTEST_WAKE_MPS;
        felt.then_some(blow)
    }

    /// The highest air in a zone, if it breaks the limit.
    pub(super) fn zone_peak(&self, zone: usize, blows: &[&Blow<'_>]) -> Option<Peak> {
        let zone = &self.world.zones[zone];
        let places_m = (zone.bounds_m.min.coords, zone.bounds_m.max.coords);
        zone::highest(
            &self.field(),
            blows,
            &places_m,
            (0.0, 0.0),
            zone.air_limit_mps - self.draught_mps,
        )
    }
}

/// Payload after the last task (kg).
fn last_load_kg(drone: &Drone) -> f64 {
    drone
        .tasks
        .iter()
        .rev()
        .find_map(|task| task.load_kg)
        .unwrap_or(0.0)
}

/// Everybody present at one of the two moments, in a level grid.
pub(super) struct Sites<'a> {
    sites: Vec<Site<'a>>,
    cell_m: f64,
    /// Read cell by cell, never walked: its order reaches nothing.
    cells: HashMap<(i64, i64), Vec<usize>>,
}

impl<'a> Sites<'a> {
    pub(super) fn new(scene: &'a Scene<'a>, when: EndpointKind) -> Sites<'a> {
        let sites: Vec<Site<'a>> = (0..scene.world.drones.len())
            .filter_map(|drone| scene.site(drone, when))
            .collect();
        let deepest_m = scene.world.bounds_m.max.z - scene.world.bounds_m.min.z;
        let greatest = |of: &dyn Fn(&Site<'a>) -> f64| sites.iter().map(of).fold(0.0, f64::max);
        let blown_m =
            greatest(&|site| site.wake.reach_m(deepest_m)) + greatest(&|site| site.tip_radius_m);
        let bodies_m =
            2.0 * greatest(&|site| site.body_radius_m) + scene.world.planning.clearance_m;
        // At least a millimetre, so that an empty set has cells too.
        let cell_m = blown_m.max(bodies_m).max(1e-3);
        let mut cells: HashMap<(i64, i64), Vec<usize>> = HashMap::new();
        for (k, site) in sites.iter().enumerate() {
            cells.entry(cell(site.place_m, cell_m)).or_default().push(k);
        }
        Sites {
            sites,
            cell_m,
            cells,
        }
    }

    pub(super) fn all(&self) -> &[Site<'a>] {
        &self.sites
    }

    pub(super) fn of(&self, drone: usize) -> Option<&Site<'a>> {
        self.sites
            .binary_search_by_key(&drone, |site| site.drone)
            .ok()
            .map(|k| &self.sites[k])
    }

    /// Everybody but one drone who can touch a place or blow on it, or be blown on from it, in the world's order.
    pub(super) fn near(&self, place_m: Point3<f64>, except: usize) -> Vec<&Site<'a>> {
        let (x, y) = cell(place_m, self.cell_m);
        let mut near: Vec<usize> = (-1..=1)
            .flat_map(|dx| (-1..=1).map(move |dy| (x + dx, y + dy)))
            .filter_map(|cell| self.cells.get(&cell))
            .flatten()
            .copied()
            .filter(|&k| {
                self.sites[k].drone != except
                    && (self.sites[k].place_m - place_m).xy().norm() <= self.cell_m
            })
            .collect();
        near.sort_unstable();
        near.into_iter().map(|k| &self.sites[k]).collect()
    }
}

fn cell(place_m: Point3<f64>, cell_m: f64) -> (i64, i64) {
    (
        (place_m.x / cell_m).floor() as i64,
        (place_m.y / cell_m).floor() as i64,
    )
}
