//! A flight logged by PX4, from its topics: everything brought to the times of the position.
//!
//! PX4's world is north-east-down and its body forward-right-down; half a turn about x makes of
//! them our world, **x north, y west, z up**, and our body of x forward, y left, z up. Heights are
//! above the place where the estimator started. One log, one vehicle.

use std::collections::BTreeMap;

use super::flight::{recording, vehicle};
use super::found::{Found, Place, listed};
use super::samples::{Attitude, Samples};
use super::topics::{Topic, Topics, from_tables, from_ulog};
use super::track::{Acceleration, Frame, Turns};
use super::written::Campaign;
use crate::record::problem::Problems;
use crate::record::recording::Recording;
use crate::record::remark::RemarkKind;

/// Farthest reading (s) that still speaks for a moment: attitude, acceleration and motors, which
/// are logged at 10 Hz or faster ...
const NEAR_S: f64 = 0.2;
/// ... and the battery, logged at 1 Hz or faster.
const BATTERY_NEAR_S: f64 = 3.0;
/// Pulse widths (µs) of a motor that stands and one that is given all there is: PX4's defaults
/// since servos were analogue.
const PULSE_US: [f64; 2] = [1000.0, 2000.0];

/// A recording from the bytes of a ULog. Of the campaign, frame and kind of acceleration are PX4's
/// own, whatever it says.
///
/// # Errors
/// Everything that keeps it from being read.
pub fn read_ulog(
    name: &str,
    file: &str,
    bytes: &[u8],
    campaign: &Campaign,
) -> Result<Recording, Problems> {
    let mut found = Found::default();
    let topics = from_ulog(file, bytes, &mut found);
    let read = topics.and_then(|topics| flight(name, file, &topics, campaign, &mut found));
    found.recording(read)
}

/// A recording from the tables that `ulog2csv` wrote of one log, by name.
///
/// # Errors
/// Everything that keeps it from being read.
pub fn read_ulog_tables(
    name: &str,
    files: &BTreeMap<String, Vec<u8>>,
    campaign: &Campaign,
) -> Result<Recording, Problems> {
    let mut found = Found::default();
    let topics = from_tables(files, &mut found);
    let read = flight(name, name, &topics, campaign, &mut found);
    found.recording(read)
}

fn flight(
    name: &str,
    file: &str,
    topics: &Topics,
    campaign: &Campaign,
    found: &mut Found,
) -> Option<Recording> {
    let campaign = Campaign {
        frame: Frame::NorthEastDown,
        acceleration: Some(Acceleration::SpecificForceInBody),
        quaternion: Turns::BodyToWorld,
        ..campaign.clone()
    };
    let (id, kind) = match campaign.vehicles.0.as_slice() {
        [(id, kind)] => (id, kind),
        several => match several.iter().find(|(id, _)| id == name) {
            Some((id, kind)) => (id, kind),
            None => {
                let ids = listed(campaign.vehicles.keys());
                let message = format!("is of one vehicle, and the campaign has several: {ids}");
                let help = format!(
                    "name the log after its vehicle, or list only one; this one is called `{name}`"
                );
                found.helped(Place::file(file), message, Some(help));
                return None;
            }
        },
    };
    let samples = samples(id, file, topics, found)?;
    let kind = campaign.types.get(kind)?;
    let vehicles = vehicle(id, file, samples, kind, &campaign, found);
    recording(name, file, vehicles.into_iter().collect(), &campaign, found)
}

/// All topics at the times of the position.
fn samples(id: &str, file: &str, topics: &Topics, found: &mut Found) -> Option<Samples> {
    const POSITION: &str = "vehicle_local_position";
    let Some(position) = topics.get(POSITION) else {
        found.problem(
            Place::field(file, POSITION),
            "is missing: there is no position in this log",
        );
        return None;
    };
    let Some(position_m) = position.columns(0) else {
        found.problem(Place::field(file, POSITION), "has no `x`, `y` and `z`");
        return None;
    };
    let start_us = position.t_us.first().copied().unwrap_or(0.0);
    let t_s = position.t_s(start_us);
    let position_m = only_valid(position, position_m);
    let at = |topic: &Topic| topic.t_s(start_us);
    let attitude = topics.get("vehicle_attitude").and_then(|topic| {
        let mut q = topic.columns(0)?;
        same_half(&mut q);
        let mut q = brought(&at(topic), &q, &t_s, NEAR_S);
        for [w, x, y, z] in &mut q {
            // Between two quaternions that are apart the chord is short.
            let norm = (*w * *w + *x * *x + *y * *y + *z * *z).sqrt();
            [*w, *x, *y, *z] = [*x / norm, *y / norm, *z / norm, *w / norm];
        }
        Some(Attitude::Quaternion(q))
    });
    let acceleration = ["vehicle_acceleration", "sensor_combined"]
        .into_iter()
        .find_map(|name| {
            let topic = topics.get(name)?;
            Some(averaged(&at(topic), &topic.columns(0)?, &t_s, NEAR_S))
        });
    let battery_v = topics.get("battery_status").and_then(|topic| {
        let volts = topic.columns::<1>(0)?;
        let volts = brought(&at(topic), &volts, &t_s, BATTERY_NEAR_S);
        Some(volts.into_iter().map(|[volts]| volts).collect())
    });
    let duty = duty(id, topics, &at, &t_s, found);
    for (what, is_there) in [
        (
            "acceleration (vehicle_acceleration, sensor_combined)",
            acceleration.is_some(),
        ),
        ("motors (actuator_motors, actuator_outputs)", duty.is_some()),
        ("battery (battery_status)", battery_v.is_some()),
    ] {
        if !is_there {
            let message = format!("the log has no {what}: no force can be told from it");
            found.remark(RemarkKind::Assumed, Some(id), message);
        }
    }
    Some(Samples {
        velocity_mps: position.columns(3),
        t_s,
        position_m,
        acceleration_mps2: acceleration,
        attitude,
        duty,
        battery_v,
        throttle_ratio: None,
        power_w: None,
    })
}

/// Positions that the estimator itself does not trust are missing.
fn only_valid(topic: &Topic, mut position_m: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    // `xy_valid` and `z_valid`.
    for valid in topic.fields.iter().skip(6) {
        for (position_m, valid) in position_m.iter_mut().zip(valid) {
            if *valid == 0.0 {
                *position_m = [f64::NAN; 3];
            }
        }
    }
    position_m
}

/// Motors from 0 to 1: as commanded, or from the pulse widths of an older log.
fn duty(
    id: &str,
    topics: &Topics,
    at: &impl Fn(&Topic) -> Vec<f64>,
    t_s: &[f64],
    found: &mut Found,
) -> Option<Vec<[f64; 4]>> {
    if let Some(topic) = topics.get("actuator_motors") {
        let control = topic.columns(0)?;
        return Some(brought(&at(topic), &control, t_s, NEAR_S));
    }
    let topic = topics.get("actuator_outputs")?;
    let pulses_us = topic.columns::<4>(0)?;
    let [low_us, high_us] = PULSE_US;
    let message = format!("motors from pulse widths: {low_us} to {high_us} us are taken as 0 to 1");
    found.remark(RemarkKind::Assumed, Some(id), message);
    let duty = |pulse_us: f64| (pulse_us - low_us) / (high_us - low_us);
    let duties: Vec<[f64; 4]> = pulses_us
        .into_iter()
        .map(|motors| motors.map(duty))
        .collect();
    Some(brought(&at(topic), &duties, t_s, NEAR_S))
}

/// `q` and `-q` are the same attitude; neighbours are made to lie on the same side, so that between
/// them is between them.
fn same_half(quaternions: &mut [[f64; 4]]) {
    let mut last: Option<[f64; 4]> = None;
    for q in quaternions {
        let dot = last.map_or(1.0, |last| last.iter().zip(&*q).map(|(a, b)| a * b).sum());
        if dot < 0.0 {
            *q = q.map(|part| -part);
        }
        last = Some(*q);
    }
}

/// Values at other times, on the line between the two readings around each; NaN farther than
/// `near_s` from either.
fn brought<const N: usize>(
    at_s: &[f64],
    values: &[[f64; N]],
    to_s: &[f64],
    near_s: f64,
) -> Vec<[f64; N]> {
    to_s.iter()
        .map(|&t_s| {
            let after = at_s.partition_point(|&other_s| other_s < t_s);
            let before = after.checked_sub(1);
            let is_near = |at: usize| (at_s[at] - t_s).abs() <= near_s;
            let before = before.filter(|&at| is_near(at));
            let after = (after < at_s.len() && is_near(after)).then_some(after);
            match (before, after) {
                (Some(before), Some(after)) => {
                    let part = (t_s - at_s[before]) / (at_s[after] - at_s[before]);
                    std::array::from_fn(|axis| {
                        let from = values[before][axis];
                        from + part * (values[after][axis] - from)
                    })
                }
                (Some(one), None) | (None, Some(one)) => values[one],
                (None, None) => [f64::NAN; N],
            }
        })
        .collect()
}

/// Mean of the readings nearer to each time than to its neighbours, so that vibration does not
/// alias; where there is none, the line between those around it.
fn averaged<const N: usize>(
    at_s: &[f64],
    values: &[[f64; N]],
    to_s: &[f64],
    near_s: f64,
) -> Vec<[f64; N]> {
    let mut means = brought(at_s, values, to_s, near_s);
    for (index, mean) in means.iter_mut().enumerate() {
        let t_s = to_s[index];
        let before_s = index
            .checked_sub(1)
            .map_or(near_s, |before| t_s - to_s[before]);
        let after_s = to_s.get(index + 1).map_or(near_s, |after_s| after_s - t_s);
        let from = at_s.partition_point(|&other_s| other_s < t_s - 0.5 * before_s.min(near_s));
        let end = at_s.partition_point(|&other_s| other_s < t_s + 0.5 * after_s.min(near_s));
        if from < end {
            let count = (end - from) as f64;
            *mean = std::array::from_fn(|axis| {
                let sum: f64 = values[from..end].iter().map(|value| value[axis]).sum();
                sum / count
            });
        }
    }
    means
}

#[cfg(test)]
mod tests;
