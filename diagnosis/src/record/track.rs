//! Where a vehicle was between two entries of its track.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use serde::Serialize;

use crate::record::recording::Track;

/// A moment between two entries: the entry before it and the share of the step that has passed, 0
/// to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// Index of the entry at or before it.
    pub entry: usize,
    /// Share of the step to the next entry.
    pub share: f64,
}

/// Throttle over that of hover, and mean duty cycle, below which a drone is taken to stand with
/// idle rotors and to have no wake. Chosen here: well above idle, and half of the least that holds
/// any drone in the air.
const IDLE_THROTTLE: f64 = 0.3;
const IDLE_DUTY: f64 = 0.2;
/// Mean speed of the rotors (rad/s) below which they are taken to idle or stand. Chosen here: a
/// fifth of what the largest that are flown turn in hover.
pub(crate) const IDLE_RADPS: f64 = 50.0;

/// The part of a track that gives its thrust.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ThrustSource {
    /// A force beyond thrust and weight, which needs none.
    ReadyForce,
    /// The thrust itself.
    Thrust,
    /// Speeds of the rotors: thrust goes with their square.
    RotorSpeed,
    /// Duty cycles of the motors and battery voltage.
    DutyCycle,
}

impl Moment {
    /// Of a column, what `mix` makes of the entries around it and the share.
    fn between<T: Copy>(self, column: &[T], mix: impl Fn(T, T, f64) -> T) -> T {
        let from = column[self.entry];
        match column.get(self.entry + 1) {
            Some(&to) if self.share > 0.0 => mix(from, to, self.share),
            _ => from,
        }
    }
}

impl Track {
    /// Where a time falls. `None` in gaps and more than half of the longest step before the first
    /// or after the last entry; closer than that the nearest entry answers.
    #[must_use]
    pub fn moment(&self, t_s: f64) -> Option<Moment> {
        // Most tracks are even but for some gaps.
        let (first_s, last_s) = (self.t_s.first()?, self.t_s.last()?);
        let step_s = (last_s - first_s) / (self.t_s.len() - 1) as f64;
        self.moment_near(t_s, ((t_s - first_s) / step_s) as usize)
    }

    /// The same, looked for from an entry that it may be near.
    #[must_use]
    pub fn moment_near(&self, t_s: f64, near: usize) -> Option<Moment> {
        let after = self.entries_until(t_s, near.saturating_add(1));
        let entry = after.saturating_sub(1);
        let since_s = t_s - self.t_s.get(entry)?;
        let next_s = self.t_s.get(after).filter(|_| after > 0);
        let Some(next_s) = next_s else {
            let is_near = since_s.abs() <= 0.5 * self.longest_step_s;
            return is_near.then_some(Moment { entry, share: 0.0 });
        };
        let step_s = next_s - self.t_s[entry];
        let is_known = since_s == 0.0 || step_s <= self.longest_step_s;
        let share = since_s / step_s;
        is_known.then_some(Moment { entry, share })
    }

    /// How many entries are at or before a time: about so many, from where steps that double lead
    /// beyond it.
    fn entries_until(&self, t_s: f64, about: usize) -> usize {
        let is_until = |entry_s: &f64| *entry_s <= t_s;
        let about = about.min(self.t_s.len());
        let (before, after) = self.t_s.split_at(about);
        let mut reach = 1;
        let (from, to) = if before.last().is_none_or(is_until) {
            while after.get(reach - 1).is_some_and(is_until) {
                reach *= 2;
            }
            (about + reach / 2, self.t_s.len().min(about + reach - 1))
        } else {
            while reach <= about && !is_until(&before[about - reach]) {
                reach *= 2;
            }
            (about.saturating_sub(reach), about - reach / 2)
        };
        from + self.t_s[from..to].partition_point(is_until)
    }

    /// Position at a moment (m), linear between entries.
    #[must_use]
    pub fn position_at(&self, moment: Moment) -> Point3<f64> {
        Track::place_at(&self.position_m, moment)
    }

    /// One of some places, one an entry, at a moment (m), linear between entries.
    #[must_use]
    pub fn place_at(places_m: &[Point3<f64>], moment: Moment) -> Point3<f64> {
        moment.between(places_m, |from_m, to_m, share| {
            from_m + (to_m - from_m) * share
        })
    }

    /// Velocity at a moment (m/s), linear between entries.
    #[must_use]
    pub fn velocity_at(&self, moment: Moment) -> Vector3<f64> {
        moment.between(&self.velocity_mps, |from, to, share| from.lerp(&to, share))
    }

    /// Attitude at a moment, along the shortest turn between entries.
    #[must_use]
    pub fn attitude_at(&self, moment: Moment) -> UnitQuaternion<f64> {
        // Opposite attitudes have no shortest turn between them.
        moment.between(&self.attitude, |from, to, share| {
            from.try_slerp(&to, share, 1e-9).unwrap_or(from)
        })
    }

    /// One of its columns at a moment, linear between entries.
    #[must_use]
    pub fn value_at(column: &[f64], moment: Moment) -> f64 {
        moment.between(column, |from, to, share| from + (to - from) * share)
    }

    /// What gives its thrust, of several what was measured nearest to the rotors; `None` where
    /// nothing does. Forces that were worked out already are the last, and all there is without an
    /// acceleration.
    #[must_use]
    pub fn thrust_source(&self) -> Option<ThrustSource> {
        let has_ready = self.force_n.is_some();
        let has_felt = self.specific_force_mps2.is_some() || !has_ready;
        let has_duty = self.duty.is_some() && self.battery_v.is_some();
        let has_speed = self.rotor_speed_radps.is_some();
        [
            (has_felt && has_speed, ThrustSource::RotorSpeed),
            (has_felt && has_duty, ThrustSource::DutyCycle),
            (has_felt && self.thrust_n.is_some(), ThrustSource::Thrust),
            (has_ready, ThrustSource::ReadyForce),
        ]
        .into_iter()
        .find_map(|(is_there, source)| is_there.then_some(source))
    }

    /// Whether it can be judged by the force on its drone, whatever else that may lack.
    #[must_use]
    pub fn is_of_a_force(&self) -> bool {
        self.thrust_source().is_some() || self.duty.is_some()
    }

    /// Columns that a force needs and that are missing, in words; empty where none is.
    #[must_use]
    pub fn missing_for_a_force(&self) -> Vec<&'static str> {
        if self.force_n.is_some() {
            return Vec::new();
        }
        let mut missing = Vec::new();
        if self.specific_force_mps2.is_none() {
            missing.push("an acceleration (ax, ay, az)");
        }
        match (self.thrust_source(), self.duty.is_some()) {
            (Some(_), _) => {}
            (None, true) => missing.push("the battery voltage (vbat)"),
            (None, false) => {
                missing.push("motors (pwm1 to pwm4 with vbat, rpm1 to rpm4, or thrust)");
            }
        }
        missing
    }

    /// Whether the rotors are idle at an entry, as far as throttle, duty cycle or speed show.
    #[must_use]
    pub fn is_idle(&self, entry: usize) -> bool {
        let throttle = self.throttle_ratio.as_ref().map(|column| column[entry]);
        let duty = self.duty.as_ref().map(|column| column[entry]);
        let rotors = self.rotor_speed_radps.as_ref();
        let rotors = rotors.map(|column| column[entry]);
        throttle.is_some_and(|ratio| ratio < IDLE_THROTTLE)
            || duty.is_some_and(|motors| motors.iter().sum::<f64>() / 4.0 < IDLE_DUTY)
            || rotors.is_some_and(|radps| radps.iter().sum::<f64>() / 4.0 < IDLE_RADPS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(t_s: &[f64]) -> Track {
        let along = |&t_s: &f64| Point3::new(t_s, 0.0, 1.0);
        Track {
            t_s: t_s.to_vec(),
            position_m: t_s.iter().map(along).collect(),
            velocity_mps: vec![Vector3::x(); t_s.len()],
            attitude: vec![UnitQuaternion::identity(); t_s.len()],
            longest_step_s: 0.5,
            ..Track::default()
        }
    }

    #[test]
    fn what_was_measured_nearest_to_the_rotors_tells_the_thrust() {
        let all = Track {
            specific_force_mps2: Some(vec![Vector3::z()]),
            force_n: Some(vec![Vector3::zeros()]),
            thrust_n: Some(vec![0.3]),
            rotor_speed_radps: Some(vec![[2e3; 4]]),
            duty: Some(vec![[0.5; 4]]),
            battery_v: Some(vec![3.8]),
            ..track(&[0.0])
        };
        assert_eq!(all.thrust_source(), Some(ThrustSource::RotorSpeed));
        let no_speed = Track {
            rotor_speed_radps: None,
            ..all
        };
        assert_eq!(no_speed.thrust_source(), Some(ThrustSource::DutyCycle));
        let no_battery = Track {
            battery_v: None,
            ..no_speed
        };
        assert_eq!(no_battery.thrust_source(), Some(ThrustSource::Thrust));
        // Nothing but the ready force tells what was felt.
        let no_acceleration = Track {
            specific_force_mps2: None,
            ..no_battery
        };
        let ready = Some(ThrustSource::ReadyForce);
        assert_eq!(no_acceleration.thrust_source(), ready);
    }

    #[test]
    fn an_uneven_track_has_the_same_entries_as_when_all_are_counted() {
        let steps_s = [0.1, 0.1, 0.1, 3.0, 0.1, 0.07, 0.0, 0.2, 0.1, 0.1, 40.0, 0.1];
        let mut t_s = vec![-1.0];
        for step_s in steps_s.iter().cycle().take(200) {
            t_s.push(t_s[t_s.len() - 1] + step_s);
        }
        let track = track(&t_s);
        let halves = t_s.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        let outside = [-2.0, -1e30, 1e30, f64::INFINITY, f64::NAN];
        for at_s in t_s.iter().copied().chain(halves).chain(outside) {
            let counted = t_s.partition_point(|entry_s| *entry_s <= at_s);
            for about in (0..2 * t_s.len()).step_by(7) {
                let found = track.entries_until(at_s, about);
                assert_eq!(found, counted, "{at_s} s from {about}");
            }
        }
        let alone = Track {
            t_s: vec![1.0],
            ..Track::default()
        };
        assert_eq!([0.5, 1.0].map(|at_s| alone.entries_until(at_s, 1)), [0, 1]);
    }

    #[test]
    fn between_entries_it_is_linear_and_in_gaps_there_is_no_answer() {
        let track = track(&[0.0, 0.4, 2.0, 2.4]);
        let x_m = |t_s| Some(track.position_at(track.moment(t_s)?).x);
        assert_eq!(x_m(0.4), Some(0.4));
        assert_eq!(x_m(0.1), Some(0.1));
        assert_eq!(x_m(1.0), None, "a gap");
        assert_eq!(x_m(2.0), Some(2.0));
        assert_eq!(x_m(2.6), Some(2.4), "within half a step of the last entry");
        assert_eq!(x_m(2.7), None);
        assert_eq!(x_m(-0.2), Some(0.0));
        assert_eq!(x_m(-0.3), None);
    }
}
