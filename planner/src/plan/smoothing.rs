//! A path of straight pieces as it is flown: averaged over time twice, piecewise cubic.
//!
//! The mean of a path over `T1` and again over `T2 <= T1`, both centred, has finite acceleration
//! and jerk (L. Biagiotti and C. Melchiorri, "FIR filters for online trajectory planning with time-
//! and frequency-domain specifications", Control Engineering Practice 20, 2012). A change of
//! velocity `dv` at `t_k` becomes, with `t` counted from there, `h1 = (T1 + T2)/2` and
//! `h0 = (T1 - T2)/2`,
//!
//! ```text
//! acceleration  dv/T1 up to h0, from there linear to 0 at h1       so |a| <= |dv|/T1, |jerk| <= |dv|/(T1 T2)
//! deviation     dv (h1 - |t|)³/(6 T1 T2)                           h0 <= |t| <= h1
//!               dv (T2²/6 + T2 x/2 + x²/2)/T1,  x = h0 - |t|       |t| <= h0; at most |dv| (T1/8 + T2²/(24 T1))
//! ```
//!
//! and beyond `h1` nothing: there the path is flown as it is, at the same times. With `T1 = v/a`
//! and `T2 = 2a/j` acceleration stays within `a` wherever the velocity changes by at most `v`
//! within `T1`, and jerk within `j`.

use nalgebra::{Point3, Vector3};

use crate::plan::TrajectoryEntry;
use crate::plan::trajectory::SAME_TIME_S;

/// Break points this close are one (s), chosen here: jerk at most 1e3 m/s³ moves acceleration by a
/// thousandth of a m/s² in it.
const ONE_POINT_S: f64 = 1e-6;
/// Jerk that only rounding makes (m/s³): chosen here, a thousandth of what aircraft have.
const SAME_JERK_MPS3: f64 = 0.01;
/// A path is the one that was flown if it is flown within this (m): a micrometre.
const SAME_PATH_M: f64 = 1e-6;
/// Changes of velocity that only rounding makes (m/s).
const SAME_VELOCITY_MPS: f64 = 1e-9;

/// Over what times the path of one vehicle is averaged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    /// `T1` (s).
    first_s: f64,
    /// `T2`, no longer than the first (s).
    second_s: f64,
}

/// A change of velocity.
struct VelocityChange {
    at_s: f64,
    by_mps: Vector3<f64>,
}

impl Kernel {
    /// For a highest speed (m/s), acceleration (m/s²) and jerk (m/s³), all above 0.
    pub fn new(speed_mps: f64, acceleration_mps2: f64, jerk_mps3: f64) -> Kernel {
        let second_s = 2.0 * acceleration_mps2 / jerk_mps3;
        Kernel {
            first_s: (speed_mps / acceleration_mps2).max(second_s),
            second_s,
        }
    }

    /// `T1` (s): the least time between two changes of velocity of a turn or a stop.
    pub(crate) fn first_s(&self) -> f64 {
        self.first_s
    }

    /// `T1 + T2` (s): how long a drone stands in its path to be at rest for a moment.
    pub(crate) fn rest_s(&self) -> f64 {
        self.first_s + self.second_s
    }

    /// Half of it (s): how much earlier than in the path a change of velocity begins, and how much
    /// later it ends.
    pub fn half_s(&self) -> f64 {
        0.5 * self.rest_s()
    }

    /// How far what is flown may be from the path at the same time, at a change of velocity by so
    /// much (m/s), in m.
    pub(crate) fn deviation_m(&self, by_mps: f64) -> f64 {
        by_mps * (self.first_s / 8.0 + self.second_s * self.second_s / (24.0 * self.first_s))
    }

    /// What is flown of a path of straight pieces that begins at rest for at least
    /// [`Kernel::half_s`]; it ends as much after the last change of velocity, if the path does not.
    /// Masses step [`Kernel::half_s`] after they do in the path, once what is flown stands where
    /// the path does. `None`: it does not begin at rest.
    pub fn smooth(&self, path: &TrajectoryEntry) -> Option<TrajectoryEntry> {
        let changes = changes(path);
        let (first_s, last_s) = (*path.t_s.first()?, *path.t_s.last()?);
        let (Some(begins), Some(ends)) = (changes.first(), changes.last()) else {
            return Some(path.clone());
        };
        if begins.at_s - self.half_s() < first_s - SAME_TIME_S {
            return None;
        }
        let masses = self.masses(path);
        let stepped_s = masses.last().map_or(last_s, |(at_s, _)| *at_s);
        let last_s = last_s.max(ends.at_s + self.half_s()).max(stepped_s);
        let mut masses = masses.into_iter().peekable();
        let mut flown = TrajectoryEntry::default();
        let mut before: Option<(f64, Point3<f64>, Vector3<f64>)> = None;
        let mut mass_kg = *path.mass_kg.first()?;
        for t_s in self.cuts_s(path, &changes, last_s) {
            let (place_m, velocity_mps) = self.at(path, &changes, t_s)?;
            if let Some((before_s, before_m, before_mps)) = before {
                let third_s = (t_s - before_s) / 3.0;
                let bends = !self.under_way(&changes, 0.5 * (before_s + t_s)).is_empty();
                let inner_m = || {
                    vec![
                        before_m + before_mps * third_s,
                        place_m - velocity_mps * third_s,
                    ]
                };
                flown
                    .control_m
                    .push(if bends { inner_m() } else { Vec::new() });
            }
            while let Some((_, kg)) = masses.next_if(|(at_s, _)| *at_s <= t_s + ONE_POINT_S) {
                mass_kg = kg;
            }
            flown.t_s.push(t_s);
            flown.position_m.push(place_m);
            flown.mass_kg.push(mass_kg);
            before = Some((t_s, place_m, velocity_mps));
        }
        Some(flown)
    }

    /// When what is flown of a path has another mass (s), and which (kg).
    fn masses(&self, path: &TrajectoryEntry) -> Vec<(f64, f64)> {
        let steps = path.t_s.windows(2).zip(path.mass_kg.windows(2));
        let steps = steps.filter(|(_, kg)| kg[0] != kg[1]);
        steps
            .map(|(t_s, kg)| (t_s[1] + self.half_s(), kg[1]))
            .collect()
    }

    /// The times between which what is flown is one polynomial, those at which the mass changes and
    /// the last of the path included (s).
    fn cuts_s(&self, path: &TrajectoryEntry, changes: &[VelocityChange], last_s: f64) -> Vec<f64> {
        let (outer_s, inner_s) = (self.half_s(), 0.5 * (self.first_s - self.second_s));
        let of_change =
            |it: &VelocityChange| [-outer_s, -inner_s, inner_s, outer_s].map(|by_s| it.at_s + by_s);
        let turns = |at_s: &f64| {
            changes
                .iter()
                .any(|it| (it.at_s - at_s).abs() <= SAME_TIME_S)
        };
        let kept = path.t_s.iter().copied().filter(|at_s| !turns(at_s));
        let mut cuts_s: Vec<f64> = changes.iter().flat_map(of_change).chain(kept).collect();
        cuts_s.extend(self.masses(path).iter().map(|(at_s, _)| *at_s));
        cuts_s.extend([path.t_s[0], last_s]);
        // A change that begins with the path may by rounding begin before it.
        let begins_s = path.t_s[0];
        cuts_s
            .iter_mut()
            .for_each(|at_s| *at_s = at_s.max(begins_s));
        cuts_s.sort_by(f64::total_cmp);
        cuts_s.dedup_by(|b, a| *b - *a <= ONE_POINT_S);
        cuts_s
    }

    /// The changes of velocity that are felt at a time (s).
    fn under_way<'c>(&self, changes: &'c [VelocityChange], t_s: f64) -> &'c [VelocityChange] {
        let half_s = self.half_s() - SAME_TIME_S;
        let first = changes.partition_point(|it| it.at_s + half_s <= t_s);
        let end = changes.partition_point(|it| it.at_s - half_s < t_s);
        &changes[first..end.max(first)]
    }

    /// Place (m) and velocity (m/s) at a time (s) of what is flown.
    fn at(
        &self,
        path: &TrajectoryEntry,
        changes: &[VelocityChange],
        t_s: f64,
    ) -> Option<(Point3<f64>, Vector3<f64>)> {
        let state = path.state(t_s)?;
        let (mut place_m, mut velocity_mps) = (state.position_m, state.velocity_mps);
        for VelocityChange { at_s, by_mps } in self.under_way(changes, t_s) {
            let [deviation_s, share] = self.response(t_s - at_s);
            place_m += by_mps * deviation_s;
            // The path has the whole change from its moment on.
            let has = if *at_s <= t_s { 1.0 } else { 0.0 };
            velocity_mps += by_mps * (share - has);
        }
        Some((place_m, velocity_mps))
    }

    /// The path that a trajectory is flown of: [`Kernel::smooth`] backwards. `None`: it is flown of
    /// no path of straight pieces averaged over these times.
    ///
    /// A change of velocity begins with jerk where there was none: the rest of what it brings is
    /// known then.
    pub(crate) fn path_of(&self, flown: &TrajectoryEntry) -> Option<TrajectoryEntry> {
        if !flown.is_smooth() {
            return Some(flown.clone());
        }
        let mut changes: Vec<VelocityChange> = Vec::new();
        for motion in (0..flown.t_s.len()).filter_map(|k| flown.motion(k)) {
            let middle_s = 0.5 * (motion.from_s + motion.until_s);
            let known_mps3: Vector3<f64> = (self.under_way(&changes, middle_s).iter())
                .map(|it| it.by_mps * self.jerk_per_s2(middle_s - it.at_s))
                .sum();
            let new_mps3 = motion.jerk_mps3() - known_mps3;
            if new_mps3.norm() > SAME_JERK_MPS3 {
                changes.push(VelocityChange {
                    at_s: motion.from_s + self.half_s(),
                    by_mps: new_mps3 * (self.first_s * self.second_s),
                });
            }
        }
        let (first_s, last_s) = (*flown.t_s.first()?, *flown.t_s.last()?);
        let steps = (1..flown.t_s.len()).filter(|&k| flown.mass_kg[k] != flown.mass_kg[k - 1]);
        let mut t_s: Vec<f64> = changes.iter().map(|it| it.at_s).collect();
        let steps_s = steps.map(|k| (flown.t_s[k] - self.half_s()).max(first_s));
        t_s.extend(steps_s.chain([first_s, last_s]));
        t_s.sort_by(f64::total_cmp);
        t_s.dedup_by(|b, a| *b - *a <= ONE_POINT_S);
        let mut path = TrajectoryEntry::default();
        for at_s in t_s {
            let has_s = at_s + self.half_s() + ONE_POINT_S;
            let begun = flown.point_at(has_s).unwrap_or(0);
            let mut place_m = flown.position_m(at_s)?;
            for VelocityChange { at_s: of_s, by_mps } in self.under_way(&changes, at_s) {
                place_m -= by_mps * self.deviation_s(at_s - of_s);
            }
            path.t_s.push(at_s);
            path.position_m.push(place_m);
            path.mass_kg.push(flown.mass_kg[begun]);
        }
        let again = self.smooth(&path)?;
        let is_there = |(at_s, place_m): (&f64, &Point3<f64>)| {
            let there_m = again.position_m(*at_s);
            there_m.is_some_and(|it| (it - place_m).norm() <= SAME_PATH_M)
        };
        let all = flown.t_s.iter().zip(&flown.position_m);
        all.into_iter().all(is_there).then_some(path)
    }

    /// The jerk of a change of velocity by 1 m/s so long ago (s), in 1/s².
    fn jerk_per_s2(&self, ago_s: f64) -> f64 {
        let inner_s = 0.5 * (self.first_s - self.second_s);
        match ago_s.abs() {
            off_s if off_s < inner_s || off_s > self.half_s() => 0.0,
            _ => -ago_s.signum() / (self.first_s * self.second_s),
        }
    }

    /// How far what is flown deviates from the path so long after a change of velocity, or before
    /// it (s), over that change (s).
    pub(crate) fn deviation_s(&self, after_s: f64) -> f64 {
        self.response(after_s)[0]
    }

    /// Of a change of velocity by 1 m/s, so long ago (s): how far what is flown deviates from the
    /// path (m), and what share of the change it has made.
    fn response(&self, ago_s: f64) -> [f64; 2] {
        let (t1, t2) = (self.first_s, self.second_s);
        let to_end_s = (self.half_s() - ago_s.abs()).max(0.0);
        // Alike before and after: a share s before is 1 - s after, deviations are the same.
        let [deviation_s, share] = if to_end_s <= t2 {
            [
                to_end_s.powi(3) / (6.0 * t1 * t2),
                to_end_s * to_end_s / (2.0 * t1 * t2),
            ]
        } else {
            let x = to_end_s - t2;
            [
                (t2 * t2 / 6.0 + t2 * x / 2.0 + x * x / 2.0) / t1,
                (t2 / 2.0 + x) / t1,
            ]
        };
        [deviation_s, if ago_s < 0.0 { share } else { 1.0 - share }]
    }
}

/// The changes of velocity of a path of straight pieces, in order of time; before its first point
/// and after its last it is at rest.
fn changes(path: &TrajectoryEntry) -> Vec<VelocityChange> {
    let motions = (0..path.t_s.len()).filter_map(|k| path.motion(k));
    let mut velocity_mps = Vector3::zeros();
    let mut last_s = path.t_s.first().copied().unwrap_or(0.0);
    let mut changes = Vec::new();
    let mut push = |at_s: f64, by_mps: Vector3<f64>| {
        if by_mps.norm() > SAME_VELOCITY_MPS {
            changes.push(VelocityChange { at_s, by_mps });
        }
    };
    for motion in motions {
        let next_mps = motion.velocity_mps(motion.from_s);
        push(motion.from_s, next_mps - velocity_mps);
        (velocity_mps, last_s) = (next_mps, motion.until_s);
    }
    push(last_s, -velocity_mps);
    changes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(points: &[(f64, [f64; 3])]) -> TrajectoryEntry {
        TrajectoryEntry {
            t_s: points.iter().map(|it| it.0).collect(),
            position_m: points.iter().map(|it| it.1.into()).collect(),
            mass_kg: vec![1.0; points.len()],
            ..TrajectoryEntry::default()
        }
    }

    /// A start, a turn of 45 degrees, one of 60, a stop, a wait, and straight down.
    fn flight() -> TrajectoryEntry {
        let third = 3.0_f64.sqrt();
        path(&[
            (0.0, [0.0, 0.0, 5.0]),
            (1.0, [0.0, 0.0, 5.0]),
            (3.0, [4.0, 0.0, 5.0]),
            (3.0 + 2.0_f64.sqrt(), [6.0, 2.0, 5.0]),
            (
                4.0 + 2.0_f64.sqrt() + third,
                [6.0, 4.0 + 2.0 * third - 2.0, 5.0],
            ),
            (10.0, [6.0, 4.0 + 2.0 * third - 2.0, 5.0]),
            (12.0, [6.0, 4.0 + 2.0 * third - 2.0, 2.0]),
            (14.0, [6.0, 4.0 + 2.0 * third - 2.0, 2.0]),
        ])
    }

    #[test]
    fn it_is_the_path_averaged_over_both_times() {
        let kernel = Kernel::new(2.0, 4.0, 20.0);
        let (path, flown) = (
            flight(),
            kernel.smooth(&flight()).expect("it begins at rest"),
        );
        let steps = 400;
        let share = |k: u32| (f64::from(k) + 0.5) / f64::from(steps) - 0.5;
        for k in 0..140 {
            let t_s = f64::from(k) * 0.1;
            let mut mean = Vector3::zeros();
            for first in 0..steps {
                for second in 0..steps / 10 {
                    let second = (f64::from(second) + 0.5) / f64::from(steps / 10) - 0.5;
                    let at_s = t_s + kernel.first_s * share(first) + kernel.second_s * second;
                    mean += path.position_m(at_s).expect("points").coords;
                }
            }
            mean /= f64::from(steps * (steps / 10));
            let there_m = flown.position_m(t_s).expect("points").coords;
            assert!((there_m - mean).norm() < 2e-4, "{t_s}: {there_m} {mean}");
        }
    }

    #[test]
    fn place_velocity_and_acceleration_have_no_jumps_and_keep_their_limits() {
        for (speed, acceleration, jerk) in [(2.0, 4.0, 20.0), (2.0, 2.5, 8.0), (0.5, 4.0, 20.0)] {
            let kernel = Kernel::new(speed, acceleration, jerk);
            let scale = 2.0 / speed;
            let mut path = flight();
            // Slower over the same places; the steps stay longer than T1.
            path.t_s.iter_mut().for_each(|t_s| *t_s *= scale);
            let flown = kernel.smooth(&path).expect("it begins at rest");
            assert_eq!(flown.control_m.len() + 1, flown.t_s.len());
            let pieces: Vec<_> = (0..flown.t_s.len())
                .filter_map(|k| flown.motion(k))
                .collect();
            for pair in pieces.windows(2) {
                let t_s = pair[0].until_s;
                assert!((pair[0].at_m(t_s) - pair[1].at_m(t_s)).norm() < 1e-9);
                let velocities = [0, 1].map(|k| pair[k].velocity_mps(t_s));
                assert!(
                    (velocities[0] - velocities[1]).norm() < 1e-6,
                    "{velocities:?}"
                );
                let accelerations = [0, 1].map(|k| pair[k].acceleration_mps2(t_s));
                assert!((accelerations[0] - accelerations[1]).norm() < 1e-3, "{t_s}");
            }
            for piece in &pieces {
                for t_s in [piece.from_s, piece.until_s] {
                    // The descent is the fastest change: 1.5 m/s of 2.
                    assert!(piece.velocity_mps(t_s).norm() <= speed * (1.0 + 1e-9));
                    assert!(piece.acceleration_mps2(t_s).norm() <= acceleration * (1.0 + 1e-6));
                    assert!(piece.jerk_mps3().norm() <= jerk * (1.0 + 1e-6));
                }
            }
        }
    }

    #[test]
    fn away_from_changes_it_is_the_path_and_it_never_leaves_it_by_more_than_it_says() {
        let kernel = Kernel::new(2.0, 4.0, 20.0);
        let (path, flown) = (
            flight(),
            kernel.smooth(&flight()).expect("it begins at rest"),
        );
        let mut farthest_m = 0.0_f64;
        for k in 0..14_000 {
            let t_s = f64::from(k) * 1e-3;
            let apart_m = (path.position_m(t_s).expect("points")
                - flown.position_m(t_s).expect("points"))
            .norm();
            farthest_m = farthest_m.max(apart_m);
            if changes(&path)
                .iter()
                .all(|it| (it.at_s - t_s).abs() >= kernel.half_s())
            {
                assert!(apart_m < 1e-9, "{t_s}: {apart_m}");
            }
        }
        assert!(farthest_m <= kernel.deviation_m(2.0) + 1e-9, "{farthest_m}");
        assert!(farthest_m > 0.99 * kernel.deviation_m(2.0), "{farthest_m}");
        assert!((kernel.deviation_m(2.0) - 0.152).abs() < 0.01);
    }

    #[test]
    fn the_path_of_what_is_flown_is_found_again() {
        for (speed, acceleration, jerk) in [(2.0, 4.0, 20.0), (2.0, 2.5, 8.0)] {
            let kernel = Kernel::new(speed, acceleration, jerk);
            let flown = kernel.smooth(&flight()).expect("it begins at rest");
            let path = kernel.path_of(&flown).expect("it was flown of one");
            for (t_s, place_m) in flight().t_s.iter().zip(&flight().position_m) {
                let there_m = path.position_m(*t_s).expect("points");
                assert!((there_m - place_m).norm() < 1e-6, "{t_s}: {there_m}");
            }
            assert_eq!(path.t_s.len(), flight().t_s.len());
            let other = Kernel::new(speed, 0.9 * acceleration, jerk);
            assert_eq!(other.path_of(&flown), None);
        }
    }

    #[test]
    fn a_path_that_does_not_begin_at_rest_is_refused_and_one_without_motion_stays() {
        let kernel = Kernel::new(2.0, 4.0, 20.0);
        let moves = path(&[(0.0, [0.0; 3]), (1.0, [1.0, 0.0, 0.0])]);
        assert_eq!(kernel.smooth(&moves), None);
        let stands = path(&[(0.0, [0.0; 3])]);
        assert_eq!(kernel.smooth(&stands), Some(stands));
        // Half of this kernel's time is 0.82 s but for the last digit.
        let rounds = Kernel::new(4.96, 4.0, 20.0);
        let at_once = path(&[(0.0, [0.0; 3]), (0.82, [0.0; 3]), (2.0, [0.0, 0.0, 1.0])]);
        assert!(rounds.half_s() > 0.82);
        let flown = rounds.smooth(&at_once).expect("it begins at rest");
        assert_eq!(flown.t_s[0], 0.0);
        let (last_s, end_s) = (2.0, 2.0 + kernel.half_s());
        let stops_late = path(&[(0.0, [0.0; 3]), (1.0, [0.0; 3]), (last_s, [1.0, 0.0, 0.0])]);
        let flown = kernel.smooth(&stops_late).expect("it begins at rest");
        assert_eq!(flown.t_s.last(), Some(&end_s));
        assert_eq!(flown.position_m.last(), Some(&[1.0, 0.0, 0.0].into()));
    }
}
