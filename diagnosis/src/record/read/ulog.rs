//! A flight logged by PX4, from its topics, of a ULog or of the tables that `ulog2csv` makes of
//! one: everything brought to the times of the position.
//!
//! PX4's world is north-east-down and its body forward-right-down; half a turn about x makes of
//! them our world, **x north, y west, z up**, and our body of x forward, y left, z up. Heights are
//! above the place where the estimator started. One log, one vehicle.

use std::collections::BTreeMap;
use std::io::{BufRead, Read as _};
use std::ops::Range;

use nalgebra::Vector3;
use px4_ulog::stream_parser::model::{
    DropoutMessage, FlattenedField, FlattenedFieldType, UlogParseError,
};
use px4_ulog::stream_parser::{DataMessage, LogParser};

use super::campaign::Campaign;
use super::checks::longest_step_s;
use super::columns::{Role, RoleOf};
use super::conventions::{Acceleration, Frame, Turns};
use super::flight::of_one;
use super::found::{Found, GPS_WITHIN_S, RowRemarks, Start};
use super::log::Log;
use super::origin::Origin;
use super::samples::Samples;
use super::series::{Sources, Stream, Thinning, joined};
use super::table::{Table, thin};
use crate::record::problem::{Problem, Problems};
use crate::record::recording::Recording;
use crate::record::remark::{Remark, RemarkKind};
use crate::statistics::quantile::{median, nearest_rank};

/// What `actuator_outputs` holds: in words, of a motor that stands, of one that is given all there
/// is, and the lowest and highest value that is such a one (PX4: `PWM_MAIN_MIN` and `PWM_MAIN_MAX`
/// 1000 and 2000 by default, 900 disarmed; DroneCAN's `RawCommand` 14 bits with a sign).
const OUTPUTS: [(&str, [f64; 2], [f64; 2]); 2] = [
    (
        "pulse widths of 1000 to 2000 us",
        [1000.0, 2000.0],
        [850.0, 2200.0],
    ),
    ("commands of 0 to 8191", [0.0, 8191.0], [0.0, 8192.0]),
];
/// Motors turn above this share of full, and, of another instance than the first, change by more
/// than the second. Chosen here: servos and outputs that stand do not both.
const TURNS: f64 = 0.1;
const CHANGES: f64 = 0.01;

/// rad/s of one turn a minute.
const RADPS_OF_RPM: f64 = std::f64::consts::TAU / 60.0;

/// A recording from the bytes of a ULog. Of the campaign, frame and kind of acceleration are PX4's
/// own, whatever it says.
pub(super) fn ulog(log: Log<'_>, campaign: &Campaign, found: &mut Found) -> Option<Recording> {
    let topics = from_ulog(log.file, log.bytes, found)?;
    flight(log.name, log.file, &topics, campaign, found)
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
    Found::recording(|found| flight(name, name, &from_tables(files, found), campaign, found))
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
    of_one(name, file, &campaign, found, |id, found| {
        samples(id, file, topics, found)
    })
}

const SOURCES: Sources = Sources {
    acceleration: "vehicle_acceleration, sensor_combined",
    motors: "actuator_motors, actuator_outputs, esc_status",
    battery: "battery_status",
};

/// All topics at the times of the position.
fn samples(id: &str, file: &str, topics: &Topics, found: &mut Found) -> Option<Samples> {
    const NAME: &str = "vehicle_local_position";
    let first = |name: &'static str| topics.get(&(name, 0));
    let Some(position) = first(NAME) else {
        let message = "is missing: there is no position in this log";
        found.problem(Problem::field(file, NAME), message);
        return None;
    };
    let Some(position_m) = position.whole(0..3) else {
        found.problem(Problem::field(file, NAME), "has no `x`, `y` and `z`");
        return None;
    };
    let start_us = position.t_us.first().copied().unwrap_or(0.0);
    let seconds = |topic: &Topic| -> Vec<f64> {
        let since_s = |t_us: &f64| (t_us - start_us) * 1e-6;
        topic.t_us.iter().map(since_s).collect()
    };
    let stream = |topic: &Topic, role: RoleOf, columns: Vec<Vec<f64>>| {
        let columns = columns.into_iter().enumerate();
        Stream {
            name: topic.name.to_owned(),
            t_s: seconds(topic),
            columns: columns.map(|(axis, of)| (role(axis), of)).collect(),
        }
    };
    for ((name, _), topic) in topics {
        topic.thinning.tell(name, found);
    }
    let clocks = ["vehicle_gps_position", "sensor_gps"].into_iter();
    found.starts = clocks
        .filter_map(first)
        .find_map(|gps| starts(gps, start_us));
    let mut position_m = position_m.to_vec();
    let t_s = seconds(position);
    continued(id, (position, &t_s), &mut position_m, found);
    found.origin = origin(position, &position_m);
    let mut velocity_mps = position.whole(3..6).map(<[_]>::to_vec);
    let both = (&mut position_m[..], &mut velocity_mps);
    only_valid(id, (position, &t_s), both, found);
    let mut place = stream(position, Role::Position, position_m);
    let velocity_mps = velocity_mps.into_iter().flatten().enumerate();
    (place.columns).extend(velocity_mps.map(|(axis, of)| (Role::Velocity(axis), of)));
    let mut streams = vec![place];
    let whole = |name: &'static str, fields| {
        let topic = first(name)?;
        Some((topic, topic.whole(fields)?))
    };
    if let Some((topic, logged)) = whole("vehicle_attitude", 0..4) {
        let mut q = logged.to_vec();
        // Logged as w, x, y, z.
        q.rotate_left(1);
        streams.push(stream(topic, Role::Quaternion, q));
    }
    let accelerations = ["vehicle_acceleration", "sensor_combined"];
    let acceleration = accelerations.into_iter().find_map(|name| whole(name, 0..3));
    if let Some((topic, logged)) = acceleration {
        streams.push(stream(topic, Role::Acceleration, logged.to_vec()));
    }
    if let Some((topic, motors)) = motors(id, topics, found) {
        streams.push(stream(topic, Role::Duty, motors));
    }
    if let Some((topic, logged)) = whole("esc_status", 0..4) {
        // Of controllers that do not tell, all are 0.
        let turns = |motor: &Vec<f64>| motor.iter().any(|rpm| *rpm != 0.0);
        if logged.iter().all(turns) {
            let radps = |motor: &Vec<f64>| motor.iter().map(|rpm| rpm * RADPS_OF_RPM).collect();
            let speeds = logged.iter().map(radps).collect();
            streams.push(stream(topic, Role::RotorSpeed, speeds));
        }
    }
    if let Some((topic, logged)) = whole("battery_status", 0..1) {
        streams.push(stream(topic, |_| Role::Battery, logged.to_vec()));
    }
    joined(id, streams, &SOURCES, found)
}

/// When the autopilot's clock reads `start_us`, by its GPS receiver.
fn starts(gps: &Topic, start_us: f64) -> Option<Start> {
    let [utc_us] = gps.whole(0..1)? else {
        return None;
    };
    let both = utc_us.iter().zip(&gps.t_us);
    // 0 without a fix.
    let known = both.filter(|(utc_us, _)| **utc_us > 0.0);
    let mut ahead_us: Vec<f64> = known.map(|(utc_us, t_us)| utc_us - t_us).collect();
    let ahead_us = median(&mut ahead_us)?;
    Some(Start {
        at_s: (start_us + ahead_us) * 1e-6,
        within_s: GPS_WITHIN_S,
    })
}

/// Duty cycles of four motors: of the instance of `actuator_motors`, else of `actuator_outputs`, in
/// which the first four outputs turn and change most.
fn motors<'t>(
    id: &str,
    topics: &'t Topics,
    found: &mut Found,
) -> Option<(&'t Topic, Vec<Vec<f64>>)> {
    let instances = |name: &'static str| {
        let of_name = topics.iter().filter(move |((of, _), _)| *of == name);
        of_name.filter_map(|((_, instance), topic)| Some((*instance, topic, topic.whole(0..4)?)))
    };
    // An empty place is not a number; it stands.
    let share = |values: &[f64], [low, high]: [f64; 2]| -> Vec<f64> {
        let of_full = |value: &f64| match value.is_finite() {
            true => ((value - low) / (high - low)).max(0.0),
            false => 0.0,
        };
        values.iter().map(of_full).collect()
    };
    let turning = |motors: &[Vec<f64>]| {
        let of_motor = |motor: &Vec<f64>| {
            let mut sorted = motor.clone();
            sorted.sort_by(f64::total_cmp);
            let at = |part| nearest_rank(&sorted, part).unwrap_or(0.0);
            (at(0.9) > TURNS).then(|| at(0.95) - at(0.05))
        };
        let changes: Option<Vec<f64>> = motors.iter().map(of_motor).collect();
        let least = changes?.into_iter().fold(f64::INFINITY, f64::min);
        Some(least)
    };
    let direct = instances("actuator_motors").map(|(instance, topic, logged)| {
        let motors: Vec<_> = logged.iter().map(|of| share(of, [0.0, 1.0])).collect();
        (instance, topic, motors, "shares of full")
    });
    let scaled = instances("actuator_outputs").filter_map(|(instance, topic, logged)| {
        let is_within = |[least, most]: [f64; 2]| {
            let mut all = logged.iter().flatten().filter(|value| value.is_finite());
            all.all(|value| *value == 0.0 || (least..=most).contains(value))
        };
        let (words, ends, _) = OUTPUTS.into_iter().find(|(.., range)| is_within(*range))?;
        let motors: Vec<_> = logged.iter().map(|of| share(of, ends)).collect();
        Some((instance, topic, motors, words))
    });
    let best = |candidates: Vec<(u8, &'t Topic, Vec<Vec<f64>>, &'static str)>| {
        let judged = candidates
            .into_iter()
            .filter_map(|of| Some((turning(&of.2)?, of)))
            .filter(|(changes, (instance, ..))| *instance == 0 || *changes > CHANGES);
        judged.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, of)| of)
    };
    let motors = match best(direct.collect()) {
        Some((instance, topic, motors, _)) => {
            if instance > 0 {
                let message = format!("motors from actuator_motors {instance}");
                found.remark(RemarkKind::Assumed, Some(id), message);
            }
            return Some((topic, motors));
        }
        None => best(scaled.collect()),
    };
    let (instance, topic, motors, words) = motors?;
    let message = format!("motors from actuator_outputs {instance}, taken as {words}");
    found.remark(RemarkKind::Assumed, Some(id), message);
    Some((topic, motors))
}

/// Positions across resets of the local origin, which move it at once: every later one moved back,
/// so that the flight is one.
/// Of several between two rows the log holds the last alone.
fn continued(
    id: &str,
    (topic, t_s): (&Topic, &[f64]),
    position_m: &mut [Vec<f64>],
    found: &mut Found,
) {
    // Twice as long as the longest step, to be a gap whatever else is left out.
    let hole_s = 2.0 * longest_step_s(t_s);
    // `xy_reset_counter`, `delta_xy`, `z_reset_counter`, `delta_z`.
    for (counter, deltas, axes) in [(8..9, 9..11, 0..2), (11..12, 12..13, 2..3)] {
        let Some(([counter], deltas)) = topic.whole(counter).zip(topic.whole(deltas)) else {
            continue;
        };
        let mut resets = 0.0;
        let mut in_part: Vec<usize> = Vec::new();
        let mut offsets_m = vec![0.0; axes.len()];
        for row in 1..counter.len() {
            // Eight bits.
            let steps = (counter[row] - counter[row - 1]).rem_euclid(256.0);
            if steps > 0.0 {
                resets += steps;
                if steps > 1.0 {
                    in_part.push(row);
                }
                let moved = offsets_m.iter_mut().zip(deltas);
                moved.for_each(|(offset_m, delta_m)| *offset_m += delta_m[row]);
            }
            for (axis, offset_m) in axes.clone().zip(&offsets_m) {
                position_m[axis][row] -= offset_m;
            }
        }
        for &row in &in_part {
            let near = |at: &usize| t_s[*at] - t_s[row - 1] <= hole_s;
            for at in (row..t_s.len()).take_while(near) {
                axes.clone()
                    .for_each(|axis| position_m[axis][at] = f64::NAN);
            }
        }
        if resets > 0.0 {
            let what = match axes.len() {
                2 => "horizontally",
                _ => "vertically",
            };
            let message = format!(
                "the estimator moved its origin {what} {resets} times: what follows is moved back"
            );
            found.remark(RemarkKind::Assumed, Some(id), message);
            let mut log = RowRemarks {
                found,
                subject: Some(id),
                noun: "row",
                t_s,
            };
            let what = format!(
                "before which the estimator moved its origin {what} more than once: all but the last is not known, what follows is off by it, and a gap is made there"
            );
            log.tell(RemarkKind::Gap, &in_part, &what);
        }
    }
}

/// Where the estimator first says that its positions count from, which resets before may have moved
/// away from where those of the log do.
fn origin(topic: &Topic, continued_m: &[Vec<f64>]) -> Option<Origin> {
    let [latitude_deg, longitude_deg] = topic.whole(13..15)? else {
        return None;
    };
    let altitude_m = topic.whole(15..16);
    let logged_m = topic.whole(0..3)?;
    let at = |row: usize| {
        let [north_m, east_m, down_m] =
            [0, 1, 2].map(|axis: usize| continued_m[axis][row] - logged_m[axis][row]);
        let place_deg = [latitude_deg[row], longitude_deg[row]];
        let altitude_m = altitude_m.map(|of| of[0][row]);
        Origin::new(
            place_deg,
            altitude_m,
            Vector3::new(north_m, -east_m, -down_m),
        )
    };
    (0..topic.t_us.len()).find_map(at)
}

/// Positions that the estimator itself does not trust are missing, each axis for itself. Where it
/// never knew the horizontal ones, as indoors without a camera, heights are what is left: the
/// vehicle is taken to stay at one place.
fn only_valid(
    id: &str,
    (topic, t_s): (&Topic, &[f64]),
    (position_m, velocity_mps): (&mut [Vec<f64>], &mut Option<Vec<Vec<f64>>>),
    found: &mut Found,
) {
    let valid = |field: usize| topic.whole(field..field + 1).map(|of| of[0].as_slice());
    let (xy_valid, z_valid) = (valid(6), valid(7));
    let is_never = |valid: Option<&[f64]>| {
        valid.is_some_and(|rows| !rows.is_empty() && rows.iter().all(|row| *row == 0.0))
    };
    for (axis, valid, other) in [
        (0, xy_valid, z_valid),
        (1, xy_valid, z_valid),
        (2, z_valid, xy_valid),
    ] {
        if axis < 2 && is_never(valid) && !is_never(other) {
            position_m[axis].fill(0.0);
            if let Some(velocity_mps) = velocity_mps {
                velocity_mps[axis].fill(0.0);
            }
            if axis == 0 {
                let message = "its horizontal position is never valid: taken to stay at one place, and heights alone are used";
                found.remark(RemarkKind::Assumed, Some(id), message);
            }
            continue;
        }
        let valid = valid.unwrap_or_default();
        let is_untrusted = |row: &usize| valid[*row] == 0.0;
        let untrusted: Vec<usize> = (0..valid.len()).filter(is_untrusted).collect();
        untrusted
            .iter()
            .for_each(|&row| position_m[axis][row] = f64::NAN);
        let what = match axis {
            0 => "whose horizontal position the estimator says is not valid",
            2 => "whose height the estimator says is not valid",
            _ => continue, // with the other
        };
        let mut log = RowRemarks {
            found,
            subject: Some(id),
            noun: "row",
            t_s,
        };
        log.tell(RemarkKind::Impossible, &untrusted, what);
    }
}

/// One topic over time.
#[derive(Debug, Default)]
struct Topic {
    name: &'static str,
    /// Time since the start of the autopilot (µs).
    t_us: Vec<f64>,
    /// In the order of [`READ`], each as long as the times; shorter where some record lacks it.
    fields: Vec<Vec<f64>>,
    thinning: Thinning,
}

impl Topic {
    /// Some of its fields; `None` unless every record has all of them.
    fn whole(&self, fields: Range<usize>) -> Option<&[Vec<f64>]> {
        let fields = self.fields.get(fields)?;
        let is_whole = |field: &Vec<f64>| field.len() == self.t_us.len();
        fields.iter().all(is_whole).then_some(fields)
    }
}

/// Topics by name and instance.
type Topics = BTreeMap<(&'static str, u8), Topic>;

const TIMESTAMP: &str = "timestamp";

type Fields = &'static [&'static str];

const POSITION: Fields = &[
    "x",
    "y",
    "z",
    "vx",
    "vy",
    "vz",
    "xy_valid",
    "z_valid",
    "xy_reset_counter",
    "delta_xy[0]",
    "delta_xy[1]",
    "z_reset_counter",
    "delta_z",
    "ref_lat",
    "ref_lon",
    "ref_alt",
];
/// Topics of which every instance is looked at.
const EVERY_INSTANCE: [&str; 2] = ["actuator_motors", "actuator_outputs"];
const MOTORS: Fields = &["control[0]", "control[1]", "control[2]", "control[3]"];
const PULSES: Fields = &["output[0]", "output[1]", "output[2]", "output[3]"];
const TURNS_A_MINUTE: Fields = &[
    "esc[0].esc_rpm",
    "esc[1].esc_rpm",
    "esc[2].esc_rpm",
    "esc[3].esc_rpm",
];
const ACCELEROMETER: Fields = &[
    "accelerometer_m_s2[0]",
    "accelerometer_m_s2[1]",
    "accelerometer_m_s2[2]",
];

/// What is read, with the fields that a flight has; more are there, and the older of two topics
/// stands in for the newer.
const READ: [(&str, Fields); 10] = [
    ("vehicle_local_position", POSITION),
    ("vehicle_attitude", &["q[0]", "q[1]", "q[2]", "q[3]"]),
    ("vehicle_acceleration", &["xyz[0]", "xyz[1]", "xyz[2]"]),
    ("sensor_combined", ACCELEROMETER),
    ("actuator_motors", MOTORS),
    ("actuator_outputs", PULSES),
    ("battery_status", &["voltage_v"]),
    ("esc_status", TURNS_A_MINUTE),
    ("vehicle_gps_position", &["time_utc_usec"]),
    ("sensor_gps", &["time_utc_usec"]),
];

fn fields_of(topic: &str) -> Option<(&'static str, Fields)> {
    READ.into_iter().find(|(name, _)| *name == topic)
}

/// The topics of a ULog. What stands before a broken record is read; that it breaks off is a
/// remark.
fn from_ulog(file: &str, bytes: &mut dyn BufRead, found: &mut Found) -> Option<Topics> {
    let mut topics = Topics::new();
    let mut others: BTreeMap<String, usize> = BTreeMap::new();
    let mut dropouts_ms: Vec<u32> = Vec::new();
    let mut on_data = |message: &DataMessage<'_>| gather(message, &mut topics, &mut others);
    let mut on_dropout = |message: &DropoutMessage| dropouts_ms.push(message.duration_ms.into());
    let mut parser = LogParser::default();
    parser.set_data_message_callback(&mut on_data);
    parser.set_dropout_message_callback(&mut on_dropout);
    let broken = match sections(bytes, &mut parser) {
        Ok(is_whole) => (!is_whole).then(|| "in the middle of a record".to_owned()),
        Err(why) if parser.in_data() => Some(format!("at a broken record: {why}")),
        Err(why) => {
            found.problem(Problem::file(file), format!("is no ULog: {why}"));
            return None;
        }
    };
    if !parser.header_complete() {
        found.problem(Problem::file(file), "is no ULog: it ends in its header");
        return None;
    }
    if let Some(how) = broken {
        let message = format!("the log ends {how}; what stands before is read");
        found.remark(RemarkKind::Gap, None, message);
    }
    if !dropouts_ms.is_empty() {
        let (times, total_ms) = (dropouts_ms.len(), dropouts_ms.iter().sum::<u32>());
        let longest_ms = dropouts_ms.iter().max().copied().unwrap_or(0);
        let message = format!(
            "the logger lost data {times} times, {total_ms} ms in all, {longest_ms} ms at the longest"
        );
        found.remarks.push(Remark {
            samples: times,
            ..Remark::new(RemarkKind::Gap, None, message)
        });
    }
    for (topic, count) in others {
        let message = format!("{count} records of {topic} are not used: another instance is");
        found.remark(RemarkKind::Unused, None, message);
    }
    Some(topics)
}

/// Header and flags of a ULog, which say where data were appended after a crash (bytes): 16, and 3
/// + 40 for the flags.
const HEAD_BYTES: u64 = 59;

/// Parses a log: what was written in one go, then what was appended to it. Says whether the first
/// part ends with a whole record.
fn sections(bytes: &mut dyn BufRead, parser: &mut LogParser<'_>) -> Result<bool, String> {
    let said = |error: UlogParseError| error.description;
    let mut head = Vec::new();
    let read = bytes.take(HEAD_BYTES).read_to_end(&mut head);
    read.map_err(|error| error.to_string())?;
    parser.consume_bytes(&head).map_err(said)?;
    let appended = parser.appended_offsets().iter().copied();
    let mut cuts: Vec<u64> = appended.filter(|&cut| cut > HEAD_BYTES).collect();
    cuts.sort_unstable();
    let mut cuts = cuts.into_iter().peekable();
    let (mut at, mut is_whole) = (HEAD_BYTES, true);
    loop {
        let piece = bytes.fill_buf().map_err(|error| error.to_string())?;
        if piece.is_empty() {
            return Ok(is_whole && !parser.has_leftover());
        }
        if cuts.next_if_eq(&at).is_some() {
            is_whole &= !parser.has_leftover();
            parser.clear_leftover();
        }
        // Cuts may stand twice.
        while cuts.next_if(|cut| *cut <= at).is_some() {}
        let to_cut = cuts.peek().and_then(|cut| usize::try_from(cut - at).ok());
        let length = piece.len().min(to_cut.unwrap_or(usize::MAX));
        parser.consume_bytes(&piece[..length]).map_err(said)?;
        bytes.consume(length);
        at += length as u64;
    }
}

/// Adds a record to its topic; of most only the first instance.
fn gather(message: &DataMessage<'_>, topics: &mut Topics, others: &mut BTreeMap<String, usize>) {
    let name = message.flattened_format.message_name.as_str();
    let Some((name, wanted)) = fields_of(name) else {
        return;
    };
    let instance = message.multi_id.value();
    if instance != 0 && !EVERY_INSTANCE.contains(&name) {
        let label = format!("{name} {instance}");
        *others.entry(label).or_default() += 1;
        return;
    }
    let Some(stamp) = &message.flattened_format.timestamp_field else {
        return; // without a time; the topic counts as missing
    };
    let Some(t_us) = bytes_at::<8>(message.data, stamp.offset).map(u64::from_le_bytes) else {
        return;
    };
    let topic = topics.entry((name, instance)).or_default();
    if !topic.thinning.keeps() {
        return;
    }
    topic.name = name;
    topic.fields.resize(wanted.len(), Vec::new());
    // Exact for the first 285 years after switching on.
    topic.t_us.push(t_us as f64);
    for (&field, values) in wanted.iter().zip(&mut topic.fields) {
        let mut there = message.flattened_format.fields.iter();
        let there = there.find(|of| of.flattened_field_name == field);
        values.extend(there.and_then(|of| value(of, message.data)));
    }
    if let Some(keep) = topic.thinning.leaves(topic.t_us.len()) {
        // A field that some record lacks counts as missing, and shall not look whole.
        let whole = topic.t_us.len();
        let is_lacking = |field: &&mut Vec<f64>| field.len() < whole;
        (topic.fields.iter_mut().filter(is_lacking)).for_each(Vec::clear);
        thin(&mut topic.t_us, &keep);
        topic.fields.iter_mut().for_each(|field| thin(field, &keep));
    }
}

fn bytes_at<const N: usize>(data: &[u8], offset: u16) -> Option<[u8; N]> {
    let from = usize::from(offset);
    data.get(from..from + N)?.try_into().ok()
}

/// A field of the types that the topics above have had over the years.
fn value(field: &FlattenedField, data: &[u8]) -> Option<f64> {
    let at = field.offset;
    Some(match field.field_type {
        FlattenedFieldType::Float => f32::from_le_bytes(bytes_at(data, at)?).into(),
        FlattenedFieldType::Double => f64::from_le_bytes(bytes_at(data, at)?),
        FlattenedFieldType::Bool | FlattenedFieldType::UInt8 => bytes_at::<1>(data, at)?[0].into(),
        FlattenedFieldType::UInt16 => u16::from_le_bytes(bytes_at(data, at)?).into(),
        FlattenedFieldType::Int16 => i16::from_le_bytes(bytes_at(data, at)?).into(),
        FlattenedFieldType::UInt32 => u32::from_le_bytes(bytes_at(data, at)?).into(),
        // Exact below 2^53: a time of day in us is.
        FlattenedFieldType::UInt64 => u64::from_le_bytes(bytes_at(data, at)?) as f64,
        FlattenedFieldType::Int32 => i32::from_le_bytes(bytes_at(data, at)?).into(),
        _ => return None,
    })
}

/// The topics of the tables that `ulog2csv` wrote of one log: `LOG_TOPIC_0.csv`.
fn from_tables(files: &BTreeMap<String, Vec<u8>>, found: &mut Found) -> Topics {
    let mut topics = Topics::new();
    for (file, bytes) in files {
        let named = table_name(file);
        let named = named.and_then(|(_, name, instance)| Some((fields_of(name)?, instance)));
        let Some(((name, wanted), instance)) = named else {
            continue;
        };
        let instance = u8::try_from(instance).unwrap_or(u8::MAX);
        if instance != 0 && !EVERY_INSTANCE.contains(&name) {
            let message = format!("{file} is not used: another instance is");
            found.remark(RemarkKind::Unused, None, message);
            continue;
        }
        let Some(table) = Table::open(file, bytes.as_slice(), found) else {
            continue;
        };
        let Some(stamp) = table.column(TIMESTAMP) else {
            found.problem(Problem::field(file, TIMESTAMP).line(1), "is missing");
            continue;
        };
        let places: Vec<Option<usize>> = wanted.iter().map(|field| table.column(field)).collect();
        let there = places.iter().copied().flatten();
        let columns: Vec<usize> = std::iter::once(stamp).chain(there).collect();
        let mut numbers = table.read(&columns, None, found).numbers.into_iter();
        let t_us = numbers.next().unwrap_or_default();
        let field = |place: &Option<usize>| place.and_then(|_| numbers.next());
        let fields = places.iter().map(field).map(Option::unwrap_or_default);
        let fields = fields.collect();
        let thinning = Thinning::default();
        let topic = Topic {
            name,
            t_us,
            fields,
            thinning,
        };
        topics.insert((name, instance), topic);
    }
    topics
}

/// Log, topic and instance of the name of a table that `ulog2csv` wrote; `None` for topics that are
/// not read.
#[must_use]
pub fn table_name(file: &str) -> Option<(&str, &str, u32)> {
    let (stem, instance) = file.strip_suffix(".csv")?.rsplit_once('_')?;
    let instance = instance.parse().ok()?;
    READ.iter().find_map(|(topic, _)| {
        let log = stem.strip_suffix(topic)?.strip_suffix('_')?;
        Some((log, *topic, instance))
    })
}

#[cfg(test)]
mod tests;
