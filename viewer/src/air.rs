//! The air of a plan over time, at the moments that a page shows: where each wake ends, each
//! drone's exposure, and from which drones.
//!
//! It is for pictures: sampled, at one speed of the air. The verifier judges every moment and every
//! delay.

use airflow::{Airframe, Flown, Source, Superposition, Wake, mean_over_discs_mps};
use nalgebra::Point3;
use planner::WakeOutlines;
use planner::plan::{DronePlan, Plan, Sample};
use rayon::prelude::*;

/// Contributions below this are not listed (m/s), chosen here: they print as 0.0.
pub(crate) const FAINT_MPS: f64 = 0.05;
/// Steps towards when air left, chosen here: each divides the error by the ratio of a drone's
/// vertical speed to the air's, about a tenth.
const STEPS_BACK: usize = 4;

/// One wake that drones share: of an airframe at a mass.
pub(crate) struct SharedWake {
    pub(crate) wake: Wake,
    /// Farthest from a rotor centre that its air counts (m), level.
    reach_m: f64,
}

/// A drone as source and receiver of air.
struct AirMember<'a> {
    drone: &'a DronePlan,
    airframe: Option<Airframe>,
    /// Index into the kinds, for each break point.
    kinds: Vec<usize>,
    /// Its different kinds.
    different: Vec<usize>,
    /// Its highest place (m).
    top_m: f64,
    /// No faster than this (m/s).
    speed_mps: f64,
    leaves_s: Option<f64>,
}

/// The air of a whole plan.
pub(crate) struct AirOfPlan<'a> {
    pub(crate) kinds: Vec<SharedWake>,
    members: Vec<AirMember<'a>>,
    /// Of wakes, with the faces on which they end.
    outlines: WakeOutlines,
    flown: Flown,
    superposition: Superposition,
    /// Speed of the air over the centreline's; `None`: quasi-static.
    pub(crate) convection: Option<f64>,
    /// Heights that wakes may reach down (m).
    depth_m: f64,
}

/// A place (m) at a time (s).
pub(crate) type PlaceAndTime = (Point3<f64>, f64);

/// The exposure of one drone at one moment.
#[derive(Clone, Debug, Default)]
pub(crate) struct SampledExposure {
    /// Mean over its rotor discs (m/s).
    pub(crate) air_mps: f64,
    /// Drones whose wakes alone bring more than [`FAINT_MPS`], with that (m/s).
    pub(crate) from: Vec<(usize, f64)>,
}

impl<'a> AirOfPlan<'a> {
    pub(crate) fn new(plan: &'a Plan) -> AirOfPlan<'a> {
        let flown = plan.flown();
        let depth_m = (plan.bounds_m.max.z - plan.bounds_m.min.z).max(1.0);
        let convection = plan.convection().map(|it| it.factors()[1]);
        let mut keys: Vec<(&str, u64)> = Vec::new();
        let mut kinds: Vec<SharedWake> = Vec::new();
        let mut members = Vec::with_capacity(plan.drones.len());
        for drone in &plan.drones {
            let airframe = drone.airframe.airframe().ok();
            let masses = drone.trajectory.mass_kg.iter();
            let kinds_of = masses.filter_map(|&mass_kg| {
                let airframe = airframe.as_ref()?;
                let key = (&drone.airframe.name[..], mass_kg.to_bits());
                let known = keys.iter().position(|it| *it == key);
                Some(known.unwrap_or_else(|| {
                    let wake = flown.wake(&Wake::new(
                        airframe,
                        mass_kg,
                        plan.air.density_kg_per_m3,
                        &plan.air.jet,
                    ));
                    keys.push(key);
                    let reach_m = reach_m(&wake, depth_m);
                    kinds.push(SharedWake { wake, reach_m });
                    kinds.len() - 1
                }))
            });
            let kinds_of: Vec<usize> = kinds_of.collect();
            let mut different = kinds_of.clone();
            different.sort_unstable();
            different.dedup();
            let path = &drone.trajectory;
            // A curve is no higher than its control points.
            let places_m = path
                .position_m
                .iter()
                .chain(path.control_m.iter().flatten());
            members.push(AirMember {
                drone,
                airframe,
                kinds: kinds_of,
                different,
                speed_mps: path.highest_speed_mps(),
                top_m: places_m.map(|it| it.z).fold(f64::NEG_INFINITY, f64::max),
                leaves_s: plan.leaves_s(drone),
            });
        }
        AirOfPlan {
            kinds,
            members,
            outlines: WakeOutlines::new(plan),
            flown,
            superposition: plan.air.superposition.parse().unwrap_or_default(),
            convection,
            depth_m,
        }
    }

    /// Index of a drone's wake from a break point on; `None`: of an airframe that cannot be.
    pub(crate) fn kind(&self, drone: usize, point: usize) -> Option<usize> {
        self.members[drone].kinds.get(point).copied()
    }

    /// A wake as its volumes have it, at levels down to the place's height: depth, radius, how far
    /// its axis is aside in x and y (m), and how long its air was under way (s).
    pub(crate) fn levels(&self, kind: &SharedWake, count: usize) -> Vec<[f64; 5]> {
        let wake = &kind.wake;
        let near_m = wake.near_field_depth_m();
        let column_m = wake.column_radius_m();
        let lag_s = |depth_m: f64| self.lag_s(wake, depth_m);
        let mut levels = vec![
            [0.0, column_m, 0.0, 0.0, 0.0],
            [near_m, column_m, 0.0, 0.0, lag_s(near_m)],
        ];
        let far_m = (self.depth_m - near_m).max(0.1);
        levels.extend((0..=count).map(|k| {
            let depth_m = near_m + far_m * k as f64 / count as f64;
            let moved = wake.axis_m(depth_m).zip(wake.spread_m(depth_m));
            let half_width_m = wake.half_width_m(depth_m);
            let ([x_m, y_m], radius_m) = match moved {
                Some(moved) if wake.is_shaped() => moved,
                _ => ([0.0; 2], half_width_m),
            };
            [depth_m, radius_m, x_m, y_m, lag_s(depth_m)]
        }));
        levels
    }

    /// Where a drone is whose air leaves at a time, and which wake; `None`: it makes none then.
    fn makes(&self, drone: usize, at_s: f64) -> Option<(Point3<f64>, usize)> {
        let member = &self.members[drone];
        // What hovers at the beginning has hovered before.
        let at_s = at_s.max(0.0);
        let (from_s, until_s) = member.drone.airborne_s;
        let has_left = member.leaves_s.is_some_and(|leaves_s| at_s > leaves_s);
        if has_left || at_s < from_s || until_s.is_some_and(|until_s| at_s >= until_s) {
            return None;
        }
        let path = &member.drone.trajectory;
        let kind = *member.kinds.get(path.point_at(at_s).unwrap_or(0))?;
        Some((path.position_m(at_s)?, kind))
    }

    /// How long the air of a wake is under way down to a depth (s).
    fn lag_s(&self, wake: &Wake, depth_m: f64) -> f64 {
        (self.convection).map_or(0.0, |factor| {
            wake.far_field().transport_time_s(depth_m, factor)
        })
    }

    /// Where a drone that has left was last (m), for as long as its air may be under way.
    fn left_m(&self, drone: usize, at_s: f64) -> Option<Point3<f64>> {
        let member = &self.members[drone];
        let gone_s = at_s - member.leaves_s?;
        let last_m = member.drone.trajectory.position_m.last().copied();
        let wakes = member.different.iter().map(|&kind| &self.kinds[kind].wake);
        let lags_s = wakes.map(|wake| self.lag_s(wake, self.depth_m));
        last_m.filter(|_| gone_s <= lags_s.fold(0.0, f64::max))
    }

    /// The height on which a drone's wake ends at each moment (m); `None`: it makes none.
    pub(crate) fn ends_z_m(&self, drone: usize, samples: &[Sample]) -> Vec<Option<f64>> {
        let mut last: Option<(Point3<f64>, usize, f64)> = None;
        let at = |sample: &Sample| {
            let (place_m, kind) = self.makes(drone, sample.t_s)?;
            let ends_z_m = match last {
                Some((before_m, of, ends_z_m)) if before_m == place_m && of == kind => ends_z_m,
                _ => self.end_z_m(kind, place_m),
            };
            last = Some((place_m, kind, ends_z_m));
            Some(ends_z_m)
        };
        samples.iter().map(at).collect()
    }

    /// The height (m) on which a wake of one kind ends from a place (m).
    fn end_z_m(&self, kind: usize, place_m: Point3<f64>) -> f64 {
        let wake = &self.kinds[kind].wake;
        let surfaces = self.outlines.surfaces();
        surfaces.wake_end_z_m(wake, &place_m, &place_m)
    }

    /// The exposure of all drones at each moment.
    pub(crate) fn met(&self, samples: &[Sample]) -> Vec<Vec<SampledExposure>> {
        let discs: Vec<_> = self
            .members
            .iter()
            .map(|member| {
                let airframe = member.airframe.as_ref()?;
                Some((airframe.disc_points(), airframe.tip_radius_m()))
            })
            .collect();
        let reaches_m = (0..self.members.len()).map(|index| self.farthest_m(index));
        let widest_m = reaches_m.fold(0.0, f64::max);
        let at = |sample: &Sample| -> Vec<SampledExposure> {
            // By x: most of a large fleet is far away.
            let mut sources: Vec<(Point3<f64>, usize)> = (0..self.members.len())
                .filter_map(|index| {
                    let there_m = sample.position_m[index];
                    let place_m = there_m.or_else(|| self.left_m(index, sample.t_s))?;
                    Some((place_m, index))
                })
                .collect();
            sources.sort_by(|a, b| a.0.x.total_cmp(&b.0.x));
            let of = |index: usize| {
                let Some((place_m, (discs, tips_m))) =
                    sample.position_m[index].zip(discs[index].as_ref())
                else {
                    return SampledExposure::default();
                };
                if self.makes(index, sample.t_s).is_none() {
                    return SampledExposure::default();
                }
                let first = sources.partition_point(|it| it.0.x < place_m.x - widest_m - tips_m);
                let near = sources[first..]
                    .iter()
                    .take_while(|it| it.0.x <= place_m.x + widest_m + tips_m);
                let near: Vec<(usize, Point3<f64>, Wake, f64)> = near
                    .filter(|&&(other_m, other)| {
                        let level_m = (other_m.xy() - place_m.xy()).norm();
                        let depth_m = self.members[other].top_m - place_m.z;
                        other != index && level_m <= self.reach_m(other, depth_m) + tips_m
                    })
                    .filter_map(|&(_, other)| {
                        let (from_m, wake, ends_z_m) = self.leaves(other, sample.t_s, place_m.z)?;
                        Some((other, from_m, wake, ends_z_m))
                    })
                    .collect();
                let sources: Vec<Source> = near
                    .iter()
                    .map(|it| Source {
                        wake: &it.2,
                        position_m: it.1,
                        ends_at_z_m: it.3,
                    })
                    .collect();
                let mean =
                    |of: &[Source]| mean_over_discs_mps(of, discs, place_m, self.superposition);
                let air_mps = mean(&sources);
                let alone = sources.iter().map(|one| match sources.len() {
                    1 => air_mps,
                    _ => mean(std::slice::from_ref(one)),
                });
                let from = near.iter().map(|it| it.0).zip(alone);
                SampledExposure {
                    air_mps,
                    from: from.filter(|it| it.1 > FAINT_MPS).collect(),
                }
            };
            (0..self.members.len()).map(of).collect()
        };
        samples.par_iter().map(at).collect()
    }

    /// The air of one drone (m/s) over the discs of another that were at a place (m) at a time (s):
    /// the mean, of that wake alone.
    pub(crate) fn brings_mps(&self, from: usize, to: usize, (place_m, at_s): PlaceAndTime) -> f64 {
        let leaves = self.leaves(from, at_s, place_m.z);
        self.alone_mps(leaves, to, place_m)
    }

    /// The air (m/s) over the discs of another where that is (m) at a time (s), if a drone were at
    /// a place (m) with a quasi-static wake.
    pub(crate) fn would_bring_mps(
        &self,
        (from, from_m): (usize, Point3<f64>),
        to: usize,
        (place_m, at_s): PlaceAndTime,
    ) -> f64 {
        let kind = self.makes(from, at_s).map(|(_, kind)| kind);
        let leaves = kind.filter(|_| from_m.z > place_m.z).map(|kind| {
            let ends_z_m = self.end_z_m(kind, from_m);
            (from_m, self.kinds[kind].wake.clone(), ends_z_m)
        });
        self.alone_mps(leaves, to, place_m)
    }

    fn alone_mps(
        &self,
        leaves: Option<(Point3<f64>, Wake, f64)>,
        to: usize,
        place_m: Point3<f64>,
    ) -> f64 {
        let Some(((from_m, wake, ends_z_m), airframe)) =
            leaves.zip(self.members[to].airframe.as_ref())
        else {
            return 0.0;
        };
        let source = Source {
            wake: &wake,
            position_m: from_m,
            ends_at_z_m: ends_z_m,
        };
        let discs = airframe.disc_points();
        mean_over_discs_mps(&[source], &discs, place_m, self.superposition)
    }

    /// How far from where a drone is now its air may count anywhere below it (m), level.
    pub(crate) fn farthest_m(&self, drone: usize) -> f64 {
        self.reach_m(drone, self.depth_m)
    }

    /// The same down to a depth below its highest place (m); none counts above that.
    fn reach_m(&self, drone: usize, depth_m: f64) -> f64 {
        if depth_m <= 0.0 {
            return f64::NEG_INFINITY;
        }
        let AirMember {
            different,
            speed_mps,
            ..
        } = &self.members[drone];
        let reaches_m = different.iter().map(|&kind| {
            let SharedWake { wake, reach_m } = &self.kinds[kind];
            reach_m + self.lag_s(wake, depth_m) * speed_mps
        });
        reaches_m.fold(0.0, f64::max)
    }

    /// Where the air was made that is at a height (m) at a time (s), the wake that it is of, and
    /// the height on which that ends (m).
    fn leaves(&self, drone: usize, at_s: f64, z_m: f64) -> Option<(Point3<f64>, Wake, f64)> {
        let mut left_s = at_s;
        if let Some(factor) = self.convection {
            for _ in 0..STEPS_BACK {
                let path = &self.members[drone].drone.trajectory;
                let place_m = path.position_m(left_s)?;
                let wake = &self.kinds[*self.members[drone].kinds.first()?].wake;
                left_s = at_s - wake.far_field().transport_time_s(place_m.z - z_m, factor);
            }
        }
        let (place_m, kind) = self.makes(drone, left_s)?;
        if place_m.z <= z_m {
            return None;
        }
        let wake = &self.kinds[kind].wake;
        let ends_z_m = self.end_z_m(kind, place_m);
        if !self.flown.depends_on_climb() {
            return Some((place_m, wake.clone(), ends_z_m));
        }
        let state = self.members[drone].drone.trajectory.state(left_s)?;
        let wake = self.flown.climbing(wake, state.velocity_mps.z);
        Some((place_m, wake, ends_z_m))
    }
}

/// Farthest from its drone, level, that a wake counts (m).
fn reach_m(wake: &Wake, depth_m: f64) -> f64 {
    let level = |k: u32| {
        let depth_m = depth_m * f64::from(k) / 16.0;
        let [x_m, y_m] = wake.axis_m(depth_m)?;
        let widened = wake.spread_m(depth_m)? / wake.half_width_m(depth_m).max(1e-3);
        let radius_m = wake
            .radius_at_speed_m(depth_m, FAINT_MPS / 4.0)
            .unwrap_or(0.0);
        Some(x_m.hypot(y_m) + widened.max(1.0) * radius_m)
    };
    (1..=16)
        .filter_map(level)
        .fold(wake.column_radius_m(), f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn air_is_met_that_left_before_its_drone_did_and_none_that_would_have_left_after() {
        let text = r#"{"format": "plan/2", "scenario": "s", "bounds_m": {"min": [0,0,0], "max": [9,9,9]},
            "quasi_static": false, "air_delay": {"convection": [1, 1]}, "drones": [
            {"name": "low", "airframe": "kolibri", "trajectory": {"t_s": [0, 12], "position_m": [[5,5,1],[5,5,1]]}},
            {"name": "up", "airframe": "matrice-300", "at_end": "leave",
                "trajectory": {"t_s": [0, 6], "position_m": [[5,5,8],[5,5,8]]}}]}"#;
        let mut plan = planner::plan::file::read(text).expect("a plan").plan;
        // Also of one whose stated wake never ends.
        for airborne_s in [(0.0, Some(6.0)), (0.0, None)] {
            plan.drones[1].airborne_s = airborne_s;
            let air = AirOfPlan::new(&plan);
            let wake = &air.kinds[air.kind(1, 0).expect("a wake")].wake;
            let until_s = 6.0 + wake.far_field().transport_time_s(7.0, 1.0);
            assert!(until_s > 6.5);
            let samples = plan.sample(10.0);
            for (sample, met) in samples.iter().zip(air.met(&samples)) {
                let is_met = sample.t_s < until_s;
                assert_eq!(met[0].air_mps > 1.0, is_met, "{} {until_s}", sample.t_s);
                assert_eq!(met[0].from.len(), usize::from(is_met));
            }
        }
    }
}
