//! Where all drones are at one of the two moments, and which of them are near a place.

use std::sync::Arc;

use airflow::Flown;
use airflow::{DiscPoints, Source, mean_over_discs_mps};
use nalgebra::Point3;

use crate::plan::outcome::EndpointKind;
use crate::plan::trajectory::{Motion, SAME_PLACE_M};
use crate::scenario::world::{AtEnd, AtStart, World};
use crate::verify::bounds::obstacles::{NamedSolid, Obstacles};
use crate::verify::bounds::wake::{BoundedWake, WakeCache};
use crate::verify::checks::air::ALPHA_TOLERANCE;
use crate::verify::checks::zone::{Downwash, Field, Peak};
use crate::verify::scene::Attached;
use crate::verify::{FAINTEST_WAKE_MPS, Places};

/// The world with its solids and its air made ready.
pub(super) struct EndpointJudge<'a> {
    /// Bounds, zones and drones.
    pub(super) world: &'a World,
    /// The world's solids, as the verifier takes them.
    pub(super) obstacles: Obstacles,
    /// What a finding adds to the hover jet.
    flown: Flown,
}

/// One drone at its endpoint.
#[derive(Clone)]
pub(super) struct Site {
    /// Index in the world's drones.
    pub(super) drone: usize,
    /// Where the scenario puts it (m).
    pub(super) nominal_m: Point3<f64>,
    /// Where it is: there, or on the ground below (m).
    pub(super) place_m: Point3<f64>,
    /// Has a wake, and is limited.
    pub(super) airborne: bool,
    /// Comes down to the support below its endpoint.
    pub(super) lands: bool,
    /// Goes away from there, or comes there, at some time.
    moves: bool,
    /// At which of its tasks, from 0; `None`: its start, or where it ends.
    pub(super) task: Option<usize>,
    /// It is there throughout (s); `None`: some time, it is not known when.
    during_s: Option<[f64; 2]>,
    /// Of the ball that must stay clear (m).
    pub(super) body_radius_m: f64,
    /// Highest mean air over its discs, over its induced velocity.
    pub(super) air_limit: f64,
    /// Over the receiver gain (m/s).
    pub(super) induced_velocity_mps: f64,
    /// From its centre to the tips of its rotors (m).
    tip_radius_m: f64,
    /// At its mass there.
    wake: Arc<BoundedWake>,
    /// Points of its rotor discs.
    discs: Arc<DiscPoints>,
    /// Solids on whose top its wake may end.
    stops: Vec<u32>,
}

impl<'a> EndpointJudge<'a> {
    /// A world, which has been checked, and a cache for the wakes in it.
    pub(super) fn new(world: &'a World) -> (EndpointJudge<'a>, WakeCache) {
        let deepest_m = world.bounds_m.max.z - world.bounds_m.min.z;
        // A world is checked: no effect in it is refused, and every obstacle has a shape.
        let flown = world.flown();
        let solids = world.obstacles.iter();
        let obstacles = Obstacles {
            floor_z_m: world.bounds_m.min.z,
            solids: (solids.filter_map(|it| NamedSolid::new(it).ok())).collect(),
        };
        let density = world.air.density_kg_per_m3();
        let judge = EndpointJudge {
            world,
            obstacles,
            flown,
        };
        let cache = WakeCache::new(density, world.jet, flown, deepest_m);
        (judge, cache)
    }

    /// Where a drone is at its start, or at its goal; `None`: gone.
    fn site(&self, cache: &mut WakeCache, index: usize, at_goal: bool) -> Option<Site> {
        let drone = &self.world.drones[index];
        let idle = drone.tasks.is_empty();
        let landed_start = drone.at_start == AtStart::Landed;
        if drone.at_end == AtEnd::Leave && at_goal {
            return None;
        }
        let mut load_kg = 0.0;
        let (mut nominal_m, mut airborne, mut lands) = (drone.start_m, !landed_start, false);
        if at_goal {
            nominal_m = drone.tasks.last().map_or(drone.start_m, |task| task.to_m);
            let stays_landed = idle && landed_start;
            lands = drone.at_end == AtEnd::Land && !stays_landed;
            airborne = !stays_landed && !lands;
            let last_load_kg = drone.tasks.iter().rev().find_map(|task| task.load_kg);
            load_kg = last_load_kg.unwrap_or(0.0);
        }
        let airframe = &drone.vehicle.airframe;
        let (wake, discs) = cache.get(airframe, airframe.mass_kg() + load_kg);
        let site = Site {
            drone: index,
            nominal_m,
            place_m: nominal_m,
            airborne,
            lands,
            moves: !idle
                || lands
                || drone.at_end == AtEnd::Leave
                || !landed_start && drone.at_end == AtEnd::Land,
            task: None,
            during_s: Some(ALWAYS_S),
            body_radius_m: drone.vehicle.body_radius_m,
            air_limit: drone.air_limit,
            induced_velocity_mps: wake.wake.hover_velocity_mps() / self.flown.receiver_gain,
            tip_radius_m: airframe.tip_radius_m(),
            wake,
            discs,
            stops: Vec::new(),
        };
        Some(self.moved(&site, nominal_m))
    }

    /// Where a drone hovers at its tasks, or stays all the time if it has none.
    fn stays(&self, cache: &mut WakeCache, index: usize) -> Vec<Site> {
        let drone = &self.world.drones[index];
        let Some(start) = self.site(cache, index, false) else {
            return Vec::new();
        };
        if !start.moves {
            return vec![start];
        }
        let mut load_kg = 0.0;
        let mut stays = Vec::new();
        for (task, asked) in drone.tasks.iter().enumerate() {
            load_kg = asked.load_kg.unwrap_or(load_kg);
            let is_last = task + 1 == drone.tasks.len() && drone.at_end == AtEnd::Hover;
            let during_s = asked.during_s.map(|[from_s, until_s]| match is_last {
                true => [from_s, f64::INFINITY],
                false => [from_s, until_s],
            });
            // That it ends there is known of goals.
            if is_last && during_s.is_none() {
                continue;
            }
            let site = Site {
                task: Some(task),
                during_s,
                ..start.clone()
            };
            stays.push(self.hovering(cache, &site, (asked.to_m, load_kg)));
        }
        stays
    }

    /// Where a drone hovers at one of its tasks, with what it carries there.
    pub(super) fn hovers(&self, cache: &mut WakeCache, index: usize, task: usize) -> Option<Site> {
        let tasks = &self.world.drones[index].tasks;
        let load_kg = (tasks[..=task].iter().rev()).find_map(|it| it.load_kg);
        let start = self.site(cache, index, false)?;
        let there = (tasks[task].to_m, load_kg.unwrap_or(0.0));
        Some(self.hovering(cache, &start, there))
    }

    /// The same drone in the air elsewhere (m), with a load (kg).
    fn hovering(
        &self,
        cache: &mut WakeCache,
        site: &Site,
        (place_m, load_kg): (Point3<f64>, f64),
    ) -> Site {
        let airframe = &self.world.drones[site.drone].vehicle.airframe;
        let (wake, discs) = cache.get(airframe, airframe.mass_kg() + load_kg);
        let site = Site {
            airborne: true,
            lands: false,
            induced_velocity_mps: wake.wake.hover_velocity_mps() / self.flown.receiver_gain,
            wake,
            discs,
            ..site.clone()
        };
        self.moved(&site, place_m)
    }

    /// The same drone with another endpoint (m).
    pub(super) fn moved(&self, site: &Site, nominal_m: Point3<f64>) -> Site {
        let mut place_m = nominal_m;
        if site.lands {
            place_m.z = self.obstacles.support_z_m(&nominal_m) + site.body_radius_m;
        }
        let here_m = (place_m.coords, place_m.coords);
        Site {
            nominal_m,
            place_m,
            stops: self.obstacles.that_may_stop(&site.wake.wake, &here_m),
            ..site.clone()
        }
    }

    /// Its wake, down to where it ends.
    fn source<'s>(&self, site: &'s Site) -> Source<'s> {
        let wake = &site.wake.wake;
        Source {
            wake,
            position_m: site.place_m,
            ends_at_z_m: self.obstacles.end_z_m(wake, &site.place_m, &site.stops),
        }
    }

    /// Mean air over the receiver's discs from all airborne others, superposed (m/s).
    pub(super) fn air_mps(&self, receiver: &Site, others: &[&Site]) -> f64 {
        if !receiver.airborne {
            return 0.0;
        }
        let above = |other: &&&Site| other.airborne && receiver.place_m.z < other.place_m.z;
        let sources = others.iter().filter(above).map(|other| self.source(other));
        let sources: Vec<Source<'_>> = sources.collect();
        let how = self.world.superposition;
        mean_over_discs_mps(&sources, &receiver.discs, receiver.place_m, how)
    }

    /// Whether that much air (m/s) is too much for a site.
    pub(super) fn over_limit(&self, site: &Site, air_mps: f64) -> bool {
        let limit_mps = (site.air_limit + ALPHA_TOLERANCE) * site.induced_velocity_mps;
        air_mps > limit_mps - self.flown.return_flow_mps
    }

    /// Whether the receiver's centre is in the other's near-field column.
    pub(super) fn in_column(&self, receiver: &Site, other: &Site) -> bool {
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
            obstacles: &self.obstacles,
            superposition: self.world.superposition,
            wall: self.flown.wall,
        }
    }

    /// The wake of a site, if it may reach a zone; it has lasted as long as its air needs.
    pub(super) fn downwash<'s>(&self, site: &'s Site, zone: usize) -> Option<Downwash<'s>> {
        let bounds = &self.world.zones[zone];
        let places_m = (bounds.min_m.coords, bounds.max_m.coords);
        let downwash = Downwash::Attached(Attached {
            from: site.drone,
            wake: &site.wake,
            motion: Motion::straight((0.0, 0.0), site.place_m, site.place_m),
            stops: &site.stops,
        });
        let high_mps = || self.field().high_mps(&downwash, &places_m, (0.0, 0.0));
        (site.airborne && high_mps() > FAINTEST_WAKE_MPS).then_some(downwash)
    }

    /// Gap that two bodies keep (m).
    pub(super) fn needs_m(&self, one: &Site, other: &Site) -> f64 {
        self.world
            .planning
            .gap_to_bodies_m(one.flying_beside(other))
    }

    /// The greatest tracking margin that a gap between two bodies bears (m); `None` where it would
    /// be too small without one.
    pub(super) fn bearable_tracking_m(&self, one: &Site, other: &Site, gap_m: f64) -> Option<f64> {
        let flying = one.flying_beside(other);
        let bears = flying > 0 && gap_m >= self.world.planning.clearance_m - SAME_PLACE_M;
        // To the millimetre, downwards: it is typed back.
        bears.then(|| (gap_m / flying as f64 * 1e3 + 1e-6).floor() / 1e3)
    }

    /// The highest air in a zone, if it breaks the limit.
    pub(super) fn zone_peak(&self, zone: usize, all: &[&Downwash<'_>]) -> Option<Peak> {
        let (places_m, limit_mps) = self.limited(zone)?;
        (self.field()).highest(all, &places_m, (0.0, 0.0), limit_mps)
    }

    /// Whether the air in a zone breaks its limit.
    pub(super) fn breaks_zone(&self, zone: usize, all: &[&Downwash<'_>]) -> bool {
        self.limited(zone).is_some_and(|(places_m, limit_mps)| {
            (self.field()).is_over(all, &places_m, (0.0, 0.0), limit_mps)
        })
    }

    /// A zone's box, and the limit of the wakes in it (m/s); `None`: it has none.
    fn limited(&self, zone: usize) -> Option<(Places, f64)> {
        let zone = &self.world.zones[zone];
        let limit_mps = zone.air_limit_mps? - self.flown.return_flow_mps;
        Some(((zone.min_m.coords, zone.max_m.coords), limit_mps))
    }
}

impl Site {
    /// How many of two fly while both are there, at the least: of those that stand, the first to
    /// go flies beside the other, as the last to come does.
    fn flying_beside(&self, other: &Site) -> usize {
        let [one, two] = [self, other].map(|it| usize::from(it.airborne));
        let first = [(self, two), (other, one)].into_iter();
        let moved = first.filter_map(|(it, beside)| it.moves.then_some(1 + beside));
        moved.min().unwrap_or(0).max(one + two)
    }

    /// Whether it is there as long as there are drones.
    pub(super) fn is_for_good(&self) -> bool {
        self.during_s
            .is_some_and(|[_, until_s]| until_s == f64::INFINITY)
    }

    /// From and until when both are there (s), if they are for certain; `Some(None)`: it is not
    /// known when.
    pub(super) fn together_s(&self, other: &Site) -> Option<Option<[f64; 2]>> {
        match (self.during_s, other.during_s) {
            _ if self.drone == other.drone => None,
            (Some(one_s), Some(other_s)) => {
                let both_s = [one_s[0].max(other_s[0]), one_s[1].min(other_s[1])];
                (both_s[0] < both_s[1]).then_some(Some(both_s))
            }
            (None, Some(always_s)) | (Some(always_s), None) => {
                (always_s == ALWAYS_S).then_some(None)
            }
            (None, None) => None,
        }
    }

    /// Whether two are one drone, at one of its tasks.
    pub(super) fn is_same(&self, other: &Site) -> bool {
        (self.drone, self.task) == (other.drone, other.task)
    }

    /// Whether it is there when another comes.
    fn is_there_before(&self, other: &Site) -> bool {
        let begins_s = |it: &Site| it.during_s.map_or(0.0, |[from_s, _]| from_s);
        let is_in_time =
            |both_s: Option<[f64; 2]>| both_s.is_none_or(|[from_s, _]| from_s <= begins_s(other));
        self.during_s.is_some() && self.together_s(other).is_some_and(is_in_time)
    }
}

/// A drone that never leaves (s).
const ALWAYS_S: [f64; 2] = [0.0, f64::INFINITY];

/// All drones present at one of the two moments, or at their tasks.
pub(super) struct Sites {
    /// In the world's order, of a drone by task.
    sites: Vec<Site>,
    /// Indices by x.
    by_x: Vec<usize>,
    /// Two sites farther apart than this do not meet (m).
    farthest_m: f64,
    /// They are those of tasks.
    are_tasks: bool,
}

impl Sites {
    /// Every drone that is there at one of the two moments, or at its tasks.
    pub(super) fn new(
        judge: &EndpointJudge<'_>,
        cache: &mut WakeCache,
        when: EndpointKind,
    ) -> Sites {
        let drones = 0..judge.world.drones.len();
        let sites = drones.flat_map(|drone| match when {
            EndpointKind::Starts => Vec::from_iter(judge.site(cache, drone, false)),
            EndpointKind::Goals => Vec::from_iter(judge.site(cache, drone, true)),
            EndpointKind::Tasks => judge.stays(cache, drone),
        });
        let sites: Vec<Site> = sites.collect();
        let deepest_m = judge.world.bounds_m.max.z - judge.world.bounds_m.min.z;
        let greatest = |of: &dyn Fn(&Site) -> f64| sites.iter().map(of).fold(0.0, f64::max);
        let air_m =
            greatest(&|site| site.wake.reach_m(deepest_m)) + greatest(&|site| site.tip_radius_m);
        let bodies_m =
            2.0 * greatest(&|site| site.body_radius_m) + judge.world.planning.gap_to_bodies_m(2);
        let mut by_x: Vec<usize> = (0..sites.len()).collect();
        by_x.sort_by(|&a, &b| sites[a].place_m.x.total_cmp(&sites[b].place_m.x));
        Sites {
            sites,
            by_x,
            farthest_m: air_m.max(bodies_m),
            are_tasks: when == EndpointKind::Tasks,
        }
    }

    /// In the world's order.
    pub(super) fn all(&self) -> &[Site] {
        &self.sites
    }

    pub(super) fn of(&self, drone: usize, task: Option<usize>) -> Option<&Site> {
        let sites = &self.sites;
        let at = sites.binary_search_by_key(&(drone, task), |site| (site.drone, site.task));
        at.ok().map(|k| &self.sites[k])
    }

    /// All others that are there at the same time and can touch a body or reach it with their
    /// wakes, or be reached from it, in the world's order.
    pub(super) fn near(&self, site: &Site) -> Vec<&Site> {
        let place_m = site.place_m;
        let x_m = |k: &usize| self.sites[*k].place_m.x;
        let from_m = place_m.x - self.farthest_m;
        let begins = self.by_x.partition_point(|k| x_m(k) < from_m);
        let beside = self.by_x[begins..].iter();
        let beside = beside.take_while(|k| x_m(k) <= place_m.x + self.farthest_m);
        let mut near: Vec<usize> = beside.copied().collect();
        near.sort_unstable();
        let near = near.into_iter().map(|k| &self.sites[k]);
        let is_near = |other: &&Site| {
            let apart_m = (other.place_m - place_m).xy().norm();
            // Of two that both stay for good the goals tell.
            let told = self.are_tasks && site.is_for_good() && other.is_for_good();
            apart_m <= self.farthest_m && !told && site.together_s(other).is_some()
        };
        near.filter(is_near).collect()
    }

    /// Which of those near a site are there at once with it: when it comes, and as each comes after
    /// it.
    pub(super) fn moments<'s>(&self, site: &Site, near: &[&'s Site]) -> Vec<Vec<&'s Site>> {
        if !self.are_tasks {
            return vec![near.to_vec()];
        }
        let present = |comes: &Site| {
            let there = near
                .iter()
                .filter(|it| it.is_same(comes) || it.is_there_before(comes));
            there.copied().collect()
        };
        let later = near.iter().filter(|it| !it.is_there_before(site));
        std::iter::once(present(site))
            .chain(later.map(|it| present(it)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::read_world;

    #[test]
    fn a_limit_is_broken_just_where_there_is_air_above_it() {
        let (mut broken, mut kept) = (0, 0);
        for k in 0..40 {
            let at = |n: u32| (f64::from(4 * k + n) * 0.754_877_666_246_69).fract();
            let drone = |n: u32| {
                let [x, y, z] = [at(n), at(n + 1), at(n + 2)].map(|share| 2.0 + 4.0 * share);
                format!(r#"(name: "d{n}", airframe: "kolibri", start_m: ({x}, {y}, {z}))"#)
            };
            let text = format!(
                r#"(name: "one", bounds_m: (min: (0, 0, 0), max: (8, 8, 8)),
                zones: [(name: "desk", min_m: (3, 3, 0), max_m: (5, 5, 1), air_limit_mps: {})],
                drones: [{}, {}])"#,
                0.5 + 3.0 * at(3),
                drone(0),
                drone(1),
            );
            let world = read_world(&text).expect("in order");
            let (judge, mut cache) = EndpointJudge::new(&world);
            let sites = Sites::new(&judge, &mut cache, EndpointKind::Starts);
            let all = sites.all().iter().filter_map(|it| judge.downwash(it, 0));
            let all: Vec<Downwash<'_>> = all.collect();
            let all: Vec<&Downwash<'_>> = all.iter().collect();
            let is_broken = judge.zone_peak(0, &all).is_some();
            assert_eq!(judge.breaks_zone(0, &all), is_broken, "case {k}");
            match is_broken {
                true => broken += 1,
                false => kept += 1,
            }
        }
        assert!(broken >= 5 && kept >= 5, "{broken} {kept}");
    }
}
