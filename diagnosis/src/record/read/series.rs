//! What a log holds in several streams, each with its own times, brought to the times of the
//! position.

use std::collections::btree_map::Entry;

use super::checks::{OUT_OF_ORDER, in_order};
use super::columns::Role;
use super::found::{Found, RowRemarks, listed};
use super::samples::Samples;
use super::table::thin;
use crate::record::remark::RemarkKind;
use crate::statistics::quantile::median;

/// Farthest reading (s) that still speaks for a moment: attitude, acceleration and motors, which
/// are logged at 10 Hz or faster ...
const NEAR_S: f64 = 0.2;
/// ... and the battery, logged at 1 Hz or faster.
const BATTERY_NEAR_S: f64 = 3.0;

/// Longest median step (s) between speeds of rotors that go before what the motors are given.
/// Chosen here: forces are compared up to 3 Hz.
const SLOWEST_ROTORS_S: f64 = 0.11;

/// Records that share their times: as many entries in every column, in SI.
#[derive(Debug, Default)]
pub(super) struct Stream {
    /// Of its topic or message.
    pub(super) name: String,
    pub(super) t_s: Vec<f64>,
    pub(super) columns: Vec<(Role, Vec<f64>)>,
}

/// What a kind of log calls what a force needs.
pub(super) struct Sources {
    pub(super) acceleration: &'static str,
    pub(super) motors: &'static str,
    pub(super) battery: &'static str,
}

/// All streams of one vehicle at the times of the first that has a position; of two that say the
/// same the first is used, and the other reported. `None` where no stream has a position.
pub(super) fn joined(
    id: &str,
    mut streams: Vec<Stream>,
    sources: &Sources,
    found: &mut Found,
) -> Option<Samples> {
    let place = streams.iter().position(Stream::has_position)?;
    let Stream { name, t_s, columns } = streams.remove(place);
    let placed: Vec<&str> = (streams.iter().filter(|stream| stream.has_position()))
        .map(|stream| &stream.name[..])
        .collect();
    if !placed.is_empty() {
        let message = format!(
            "its positions are those of `{name}`, not those of {}",
            listed(placed)
        );
        found.remark(RemarkKind::Assumed, Some(id), message);
    }
    let mut samples = Samples::default();
    samples.columns.extend(columns);
    let is_of_duty = |stream: &Stream| stream.column(Role::Duty(0)).is_some();
    let has_duty = streams.iter().any(is_of_duty) || samples.columns.contains_key(&Role::Duty(0));
    for stream in streams {
        let stream = stream.in_order(id, found);
        let is_of_speed = stream.column(Role::RotorSpeed(0)).is_some() && !is_of_duty(&stream);
        if let (true, true, Some(step_s)) = (has_duty, is_of_speed, stream.median_step_s())
            && step_s > SLOWEST_ROTORS_S
        {
            let message = format!(
                "speeds of rotors are logged every {step_s:.2} s, too seldom: what the motors are given is used"
            );
            found.remark(RemarkKind::Unused, Some(id), message);
            continue;
        }
        let mut is_used = stream.columns.is_empty() || stream.has_position();
        for (role, column) in stream.at(&t_s) {
            if let Entry::Vacant(place) = samples.columns.entry(role) {
                place.insert(column);
                is_used = true;
            }
        }
        if !is_used {
            let message = format!("`{}` is not used: others say the same", stream.name);
            found.remark(RemarkKind::Unused, Some(id), message);
        }
    }
    samples.columns.insert(Role::Time, t_s);
    samples.settle(id, found);
    for (what, names, role) in [
        ("acceleration", sources.acceleration, Role::Acceleration(0)),
        ("motors", sources.motors, Role::Duty(0)),
        ("battery", sources.battery, Role::Battery),
    ] {
        let is_there = |role| samples.columns.contains_key(&role);
        let is_other = role == Role::Duty(0) && is_there(Role::RotorSpeed(0));
        // Speeds of rotors stand for both motors and battery.
        let is_other = is_other || role == Role::Battery && is_there(Role::RotorSpeed(0));
        if !is_there(role) && !is_other {
            let message = format!("the log has no {what} ({names}): no force can be told from it");
            found.remark(RemarkKind::Assumed, Some(id), message);
        }
    }
    Some(samples)
}

/// Most entries kept of a stream. Chosen here: three quarters of an hour at 100 Hz; all columns
/// that are known of as many take some hundred megabytes on their way.
const MOST_ENTRIES: usize = 1 << 18;

/// Which entries of a long stream are kept.
#[derive(Debug)]
pub(super) struct Thinning {
    stride: usize,
    met: usize,
}

impl Default for Thinning {
    fn default() -> Thinning {
        Thinning { stride: 1, met: 0 }
    }
}

impl Thinning {
    /// Whether the next entry is to be kept.
    pub(super) fn keeps(&mut self) -> bool {
        self.met += 1;
        (self.met - 1).is_multiple_of(self.stride)
    }

    /// After one was kept, of so many: which of them stay, where that became too many.
    pub(super) fn leaves(&mut self, kept: usize) -> Option<Vec<bool>> {
        if kept < MOST_ENTRIES {
            return None;
        }
        self.stride *= 2;
        Some((0..kept).map(|entry| entry.is_multiple_of(2)).collect())
    }

    /// A remark, where not all are kept.
    pub(super) fn tell(&self, what: &str, found: &mut Found) {
        if self.stride > 1 {
            let message = format!("{what}: one entry in {} is kept", self.stride);
            found.remark(RemarkKind::Unused, None, message);
        }
    }
}

impl Stream {
    /// Leaves some entries, as a thinning says.
    pub(super) fn thin(&mut self, thinning: &mut Thinning) {
        if let Some(keep) = thinning.leaves(self.t_s.len()) {
            self.keep(&keep);
        }
    }

    pub(super) fn has_position(&self) -> bool {
        (0..3).all(|axis| self.column(Role::Position(axis)).is_some())
    }

    fn column(&self, role: Role) -> Option<&Vec<f64>> {
        let found = self.columns.iter().find(|(other, _)| *other == role);
        found.map(|(_, column)| column)
    }

    /// Without the records whose times do not rise, which are reported.
    fn in_order(mut self, id: &str, found: &mut Found) -> Stream {
        let (_, left_out) = in_order(&self.t_s);
        let mut log = RowRemarks {
            found,
            subject: Some(id),
            noun: "record",
            t_s: &self.t_s,
        };
        let what = format!("of `{}` left out: {OUT_OF_ORDER}", self.name);
        log.tell(RemarkKind::Impossible, &left_out, &what);
        let mut keep = vec![true; self.t_s.len()];
        left_out.into_iter().for_each(|row| keep[row] = false);
        self.keep(&keep);
        self
    }

    fn keep(&mut self, keep: &[bool]) {
        thin(&mut self.t_s, keep);
        let columns = self.columns.iter_mut();
        columns.for_each(|(_, column)| thin(column, keep));
    }

    fn median_step_s(&self) -> Option<f64> {
        let steps = self.t_s.windows(2).map(|pair| pair[1] - pair[0]);
        median(&mut steps.collect::<Vec<_>>())
    }

    /// Its columns at other times.
    fn at(&self, t_s: &[f64]) -> Vec<(Role, Vec<f64>)> {
        let quaternion: Vec<&Vec<f64>> = (0..4)
            .filter_map(|part| self.column(Role::Quaternion(part)))
            .collect();
        let mut turned = match quaternion.len() {
            4 => self.attitude_at(&quaternion, t_s),
            _ => Vec::new(),
        };
        let one = |(role, column): &(Role, Vec<f64>)| {
            let values = match role {
                Role::Quaternion(part) => std::mem::take(turned.get_mut(*part)?),
                Role::Acceleration(_) => averaged(&self.t_s, column, t_s, NEAR_S),
                Role::Battery => brought(&self.t_s, column, t_s, BATTERY_NEAR_S),
                Role::Angle(2) => {
                    let yaws = brought(&self.t_s, &unwrapped(column), t_s, NEAR_S);
                    begun_within_a_turn(yaws)
                }
                Role::Angle(_) => brought(&self.t_s, &unwrapped(column), t_s, NEAR_S),
                _ => brought(&self.t_s, column, t_s, NEAR_S),
            };
            Some((*role, values))
        };
        self.columns.iter().filter_map(one).collect()
    }

    fn attitude_at(&self, logged: &[&Vec<f64>], t_s: &[f64]) -> Vec<Vec<f64>> {
        let same = same_half(logged);
        let column = |values: &Vec<f64>| brought(&self.t_s, values, t_s, NEAR_S);
        let mut q: Vec<Vec<f64>> = same.iter().map(column).collect();
        for row in 0..t_s.len() {
            // Between two quaternions that are apart the chord is short.
            let square: f64 = q.iter().map(|part| part[row] * part[row]).sum();
            q.iter_mut().for_each(|part| part[row] /= square.sqrt());
        }
        q
    }
}

/// `q` and `-q` are the same attitude; neighbours are made to lie on the same side, so that between
/// them is between them.
fn same_half(logged: &[&Vec<f64>]) -> Vec<Vec<f64>> {
    let mut q: Vec<Vec<f64>> = logged.iter().map(|part| (*part).clone()).collect();
    for row in 1..q[0].len() {
        let dot: f64 = q.iter().map(|part| part[row - 1] * part[row]).sum();
        if dot < 0.0 {
            q.iter_mut().for_each(|part| part[row] = -part[row]);
        }
    }
    q
}

/// Angles (rad) without their steps of a whole turn, so that between two of them is between them.
fn unwrapped(angles: &[f64]) -> Vec<f64> {
    let mut last = f64::NAN;
    let one = |&angle: &f64| {
        let turns = ((last - angle) / std::f64::consts::TAU).round();
        let near = match turns.is_finite() {
            true => angle + turns * std::f64::consts::TAU,
            false => angle,
        };
        if near.is_finite() {
            last = near;
        }
        near
    };
    angles.iter().map(one).collect()
}

/// The same yaws (rad), less whole turns so that the first lies within a turn of 0.
fn begun_within_a_turn(mut yaws: Vec<f64>) -> Vec<f64> {
    use std::f64::consts::TAU;
    if let Some(first) = yaws.iter().find(|yaw| yaw.is_finite()) {
        let turns = (first / TAU).trunc();
        yaws.iter_mut().for_each(|yaw| *yaw -= turns * TAU);
    }
    yaws
}

/// Values at other times, on the line between the two readings around each; NaN farther than
/// `near_s` from either.
fn brought(at_s: &[f64], values: &[f64], to_s: &[f64], near_s: f64) -> Vec<f64> {
    let one = |&t_s: &f64| {
        let after = at_s.partition_point(|&other_s| other_s < t_s);
        let near = |at: Option<usize>| at.filter(|&at| (at_s[at] - t_s).abs() <= near_s);
        let before = near(after.checked_sub(1));
        let after = near((after < at_s.len()).then_some(after));
        match (before, after) {
            (Some(before), Some(after)) => {
                let part = (t_s - at_s[before]) / (at_s[after] - at_s[before]);
                values[before] + part * (values[after] - values[before])
            }
            (one, other) => one.or(other).map_or(f64::NAN, |at| values[at]),
        }
    };
    to_s.iter().map(one).collect()
}

/// Mean of the readings nearer to each time than to its neighbours, so that vibration does not
/// alias; where there is none, the line between those around it.
fn averaged(at_s: &[f64], values: &[f64], to_s: &[f64], near_s: f64) -> Vec<f64> {
    let mut means = brought(at_s, values, to_s, near_s);
    for (index, mean) in means.iter_mut().enumerate() {
        let t_s = to_s[index];
        let before = index.checked_sub(1);
        let before_s = before.map_or(near_s, |before| t_s - to_s[before]);
        let after_s = to_s.get(index + 1).map_or(near_s, |after_s| after_s - t_s);
        let from = at_s.partition_point(|&other_s| other_s < t_s - 0.5 * before_s.min(near_s));
        let end = at_s.partition_point(|&other_s| other_s < t_s + 0.5 * after_s.min(near_s));
        if from < end {
            *mean = values[from..end].iter().sum::<f64>() / (end - from) as f64;
        }
    }
    means
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_two_angles_across_half_a_turn_is_between_them() {
        let stream = Stream {
            name: String::new(),
            t_s: vec![0.0, 0.1],
            columns: vec![(Role::Angle(2), vec![3.1, -3.1])],
        };
        let (_, yaw) = &stream.at(&[0.05])[0];
        assert!((yaw[0] - std::f64::consts::PI).abs() < 1e-12, "{yaw:?}");
    }

    #[test]
    fn a_yaw_begins_within_a_turn_where_it_is_first_asked_for() {
        let stream = Stream {
            name: String::new(),
            t_s: vec![0.0, 0.1, 0.2],
            columns: vec![(Role::Angle(2), vec![6.2, 0.1, 0.3])],
        };
        let (_, yaw) = &stream.at(&[0.1, 0.2])[0];
        let off = (yaw[0] - 0.1).abs().max((yaw[1] - 0.3).abs());
        assert!(off < 1e-12, "{yaw:?}");
    }

    #[test]
    fn one_record_with_a_wrong_time_is_left_out_and_told() {
        let times_s: Vec<f64> = (0..100).map(|tick| f64::from(tick) * 0.01).collect();
        let stream = |name: &str, roles: &[Role]| Stream {
            name: name.to_owned(),
            t_s: times_s.clone(),
            columns: (roles.iter().map(|role| (*role, times_s.clone()))).collect(),
        };
        for wrong_s in [3000.0, 0.2, f64::NAN] {
            let mut battery = stream("battery", &[Role::Battery]);
            battery.t_s[50] = wrong_s;
            let place = stream("place", &[0, 1, 2].map(Role::Position));
            let sources = Sources {
                acceleration: "",
                motors: "",
                battery: "",
            };
            let mut found = Found::default();
            let joined = joined("q1", vec![place, battery], &sources, &mut found);
            let joined = joined.expect("has a place");
            let both = joined.column(Role::Battery).iter().zip(&times_s);
            let off = both.map(|(read, written)| (read - written).abs());
            assert!(off.fold(0.0, f64::max) < 1e-12, "{wrong_s}");
            assert_eq!(
                found.remarks[0].message,
                "1 record of `battery` left out: their time is missing, repeats or goes back"
            );
        }
    }
}
