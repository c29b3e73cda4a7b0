//! Where a plan wants its drones: place, velocity, acceleration and mass at a time.

use nalgebra::{Point3, Vector3};
use planner::Plan;
use planner::plan::trajectory::{Motion, Piece, Tail, Trajectory};
use planner::plan::{AtEnd, AtStart, DronePlan};

/// A drone is sought on its path up to so much before and after a time (s), in steps of so much:
/// chosen here, several times as long as a controller is late, and a few centimetres at 2 m/s.
const ABOUT_S: f64 = 1.0;
const APART_S: f64 = 0.02;
/// A drone that moves less than this in a step stands (m): chosen here.
const STANDS_M: f64 = 1e-4;

/// What a controller is to follow at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reference {
    /// Centre of the rotor plane (m).
    pub(crate) position_m: Point3<f64>,
    /// m/s.
    pub(crate) velocity_mps: Vector3<f64>,
    /// m/s².
    pub(crate) acceleration_mps2: Vector3<f64>,
    /// With payload (kg).
    pub(crate) mass_kg: f64,
}

/// One drone of a plan as it is to be flown.
#[derive(Clone, Debug)]
pub(crate) struct ReferencePath {
    trajectory: Trajectory,
    first: Piece,
    last: Piece,
    /// When its rotors turn (s); from minus infinity where it begins in the air.
    pub(crate) airborne_s: (f64, f64),
    /// When it stands landed in between (s).
    pub(crate) landed_s: Vec<(f64, f64)>,
    /// When it is there (s).
    pub(crate) there_s: (f64, f64),
    /// Where it stands before it takes off, between flights, and after it has landed (m).
    pub(crate) pads_m: Vec<Point3<f64>>,
    /// Last time of the trajectory (s).
    pub(crate) last_s: f64,
    /// The highest of its break points (m).
    pub(crate) highest_m: f64,
    /// All that it weighs on its way, each once (kg).
    pub(crate) masses_kg: Vec<f64>,
}

impl ReferencePath {
    /// Of a drone of a plan.
    ///
    /// # Errors
    /// What keeps its trajectory from being read, in words.
    pub(crate) fn new(plan: &Plan, drone: &DronePlan) -> Result<ReferencePath, String> {
        let trajectory = Trajectory::new(&drone.trajectory, Tail::Gone);
        let trajectory = trajectory.map_err(|error| error.to_string())?;
        let (last_s, last_m) = (trajectory.last_s(), trajectory.last_m());
        let resting = |place_m: Point3<f64>, mass_kg: f64| Piece {
            motion: Motion::straight((last_s, last_s), place_m, place_m),
            mass_kg,
        };
        let masses_kg = &drone.trajectory.mass_kg;
        let ends = masses_kg.first().zip(masses_kg.last());
        let (first_kg, last_kg) = ends.ok_or("it has no mass")?;
        let first_m = drone.trajectory.position_m[0];
        let heights_m = drone.trajectory.position_m.iter().map(|it| it.z);
        let mut each_kg = masses_kg.clone();
        each_kg.sort_by(f64::total_cmp);
        each_kg.dedup();
        let (from_s, until_s) = drone.airborne_s;
        let is_landed = drone.at_start == AtStart::Landed;
        let enters_s = drone.enters_s.unwrap_or(f64::NEG_INFINITY);
        let until_s = until_s.unwrap_or(f64::INFINITY);
        let from_s = match from_s {
            never if until_s <= never => f64::INFINITY,
            start if start <= 0.0 && !is_landed => enters_s,
            later => later.max(enters_s),
        };
        let is_planned = !plan.is_unplanned(&drone.name);
        let leaves = drone.at_end == AtEnd::Leave && is_planned;
        let lands = drone.has_landed() && is_planned;
        let gone_s = if leaves { last_s } else { f64::INFINITY };
        let rests = drone.landed_s.iter();
        let rests_m = rests.filter_map(|rest_s| trajectory.position_m(0.5 * (rest_s.0 + rest_s.1)));
        let ends_m = [is_landed.then_some(first_m), lands.then_some(last_m)];
        Ok(ReferencePath {
            pads_m: ends_m.into_iter().flatten().chain(rests_m).collect(),
            first: resting(first_m, *first_kg),
            last: resting(last_m, *last_kg),
            airborne_s: (from_s, until_s.min(gone_s)),
            landed_s: drone.landed_s.clone(),
            there_s: (enters_s, gone_s),
            last_s,
            highest_m: heights_m.fold(f64::NEG_INFINITY, f64::max),
            masses_kg: each_kg,
            trajectory,
        })
    }

    /// At a time (s): at rest before the first break point and after the last.
    pub(crate) fn at(&self, t_s: f64) -> Reference {
        let pieces = self.trajectory.pieces();
        let begins_s = pieces.first().map_or(self.last_s, |it| it.motion.from_s);
        if t_s < begins_s {
            return at_rest(&self.first);
        }
        match self.trajectory.piece_index(t_s) {
            Some(k) if t_s < self.last_s => in_motion(&pieces[k], t_s),
            _ => at_rest(&self.last),
        }
    }

    /// How far a place is from the path that is planned from [`ABOUT_S`] before a time (s) to as
    /// much after it; at both ends the path is extended straight, so that stopping too late adds
    /// nothing. An upper bound where that is no more than is `known_m` already.
    pub(crate) fn across_m(&self, t_s: f64, place_m: &Point3<f64>, known_m: f64) -> f64 {
        let there = self.at(t_s);
        let (off_m, along_mps) = (place_m - there.position_m, there.velocity_mps);
        let late_s = off_m.dot(&along_mps) / along_mps.norm_squared().max(f64::MIN_POSITIVE);
        let beside = self.at(t_s + late_s.clamp(-ABOUT_S, ABOUT_S));
        let bound_m = (place_m - beside.position_m).norm();
        if bound_m <= known_m {
            return bound_m;
        }
        let steps = -(ABOUT_S / APART_S) as i32..=(ABOUT_S / APART_S) as i32;
        let mut path_m: Vec<Point3<f64>> = steps
            .map(|step| self.at(t_s + f64::from(step) * APART_S).position_m)
            .collect();
        path_m.dedup_by(|next, known| (*next - *known).norm() < STANDS_M);
        let last = path_m.len() - 1;
        if last == 0 {
            return (place_m - path_m[0]).norm();
        }
        let beside = path_m.windows(2).enumerate().map(|(k, ends_m)| {
            let (way_m, off_m) = (ends_m[1] - ends_m[0], place_m - ends_m[0]);
            let least = if k == 0 { f64::NEG_INFINITY } else { 0.0 };
            let most = if k + 1 == last { f64::INFINITY } else { 1.0 };
            let share = (off_m.dot(&way_m) / way_m.norm_squared()).clamp(least, most);
            (off_m - way_m * share).norm()
        });
        beside.fold(f64::INFINITY, f64::min)
    }
}

fn at_rest(piece: &Piece) -> Reference {
    Reference {
        position_m: piece.motion.at_m(piece.motion.from_s).into(),
        velocity_mps: Vector3::zeros(),
        acceleration_mps2: Vector3::zeros(),
        mass_kg: piece.mass_kg,
    }
}

/// Exactly, straight or cubic.
fn in_motion(Piece { motion, mass_kg }: &Piece, t_s: f64) -> Reference {
    Reference {
        position_m: motion.at_m(t_s).into(),
        velocity_mps: motion.velocity_mps(t_s),
        acceleration_mps2: motion.acceleration_mps2(t_s),
        mass_kg: *mass_kg,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubic_pieces_are_followed_with_their_velocity_and_acceleration() {
        // x = t³ for a second, then straight on at 3 m/s.
        let text = r#"{"format": "plan/2", "bounds_m": {"min": [0, 0, 0], "max": [9, 9, 9]}, "drones": [
            {"name": "a", "airframe": "kolibri", "trajectory": {"t_s": [1, 2, 3],
             "position_m": [[0, 0, 1], [1, 0, 1], [4, 0, 1]], "control_m": [[[0, 0, 1], [0, 0, 1]], []]}}]}"#;
        let plan = planner::plan::file::read(text).expect("a plan").plan;
        let course = ReferencePath::new(&plan, &plan.drones[0]).expect("a course");
        let xs = |t_s: f64| {
            let at = course.at(t_s);
            [at.position_m.x, at.velocity_mps.x, at.acceleration_mps2.x]
        };
        let near = |t_s: f64, expected: [f64; 3]| {
            let found = xs(t_s);
            let off = (0..3).map(|k| (found[k] - expected[k]).abs());
            // Rounding.
            assert!(off.fold(0.0, f64::max) < 1e-12, "{t_s}: {found:?}");
        };
        near(-1.0, [0.0; 3]);
        near(0.5, [0.0; 3]);
        near(1.5, [0.125, 0.75, 3.0]);
        near(2.5, [2.5, 3.0, 0.0]);
        near(3.5, [4.0, 0.0, 0.0]);
    }

    #[test]
    fn early_and_late_is_along_the_path_and_not_across_it() {
        // 2 m/s along x, a corner, along y, and a stop.
        let text = r#"{"format": "plan/1", "bounds_m": {"min": [0, 0, 0], "max": [9, 9, 9]}, "drones": [
            {"name": "a", "airframe": "kolibri", "trajectory": {"t_s": [1, 3, 5],
             "position_m": [[0, 0, 1], [4, 0, 1], [4, 4, 1]]}}]}"#;
        let plan = planner::plan::file::read(text).expect("a plan").plan;
        let course = ReferencePath::new(&plan, &plan.drones[0]).expect("a course");
        let across = |t_s: f64, at_m: [f64; 3], expected: f64| {
            let found = course.across_m(t_s, &at_m.into(), -1.0);
            // Rounding; a place is sought between samples.
            assert!((found - expected).abs() < 1e-9, "{t_s}, {at_m:?}: {found}");
        };
        across(2.0, [1.7, 0.0, 1.0], 0.0);
        across(2.0, [1.7, 0.1, 1.2], 0.05_f64.sqrt());
        // Inside the corner, and past it.
        across(3.0, [3.9, 0.2, 1.0], 0.1);
        across(3.0, [4.3, -0.4, 1.0], 0.5);
        // Too far where it stops, and before it goes.
        across(5.5, [4.0, 4.3, 1.0], 0.0);
        across(5.5, [4.1, 4.3, 1.0], 0.1);
        across(0.5, [-0.2, 0.0, 1.1], 0.1);
        // Where it has long stood there is no path to be along.
        across(9.0, [4.0, 4.3, 1.0], 0.3);
    }
}
