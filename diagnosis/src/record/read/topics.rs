//! Topics of a PX4 flight: which ones are read and which of their fields, from a ULog or from the
//! tables that `ulog2csv` makes of one.

use std::collections::BTreeMap;

use px4_ulog::stream_parser::model::{
    DropoutMessage, FlattenedField, FlattenedFieldType, UlogParseError,
};
use px4_ulog::stream_parser::{DataMessage, LogParser};

use super::found::{Found, Place};
use super::table::Table;
use crate::record::remark::{Remark, RemarkKind};

/// One topic over time.
#[derive(Clone, Debug, Default)]
pub(super) struct Topic {
    /// Time since the start of the autopilot (µs).
    pub(super) t_us: Vec<f64>,
    /// In the order of [`READ`], each as long as the times; shorter where some record lacks it.
    pub(super) fields: Vec<Vec<f64>>,
}

impl Topic {
    /// Times (s) since a start (µs).
    pub(super) fn t_s(&self, start_us: f64) -> Vec<f64> {
        let since_s = |t_us: &f64| (t_us - start_us) * 1e-6;
        self.t_us.iter().map(since_s).collect()
    }

    /// Several fields, from the given one on, as one column; `None` unless every record has all of
    /// them.
    pub(super) fn columns<const N: usize>(&self, from: usize) -> Option<Vec<[f64; N]>> {
        let fields = self.fields.get(from..from + N)?;
        let rows = self.t_us.len();
        let is_whole = fields.iter().all(|field| field.len() == rows);
        is_whole.then(|| {
            let row = |row: usize| std::array::from_fn(|axis| fields[axis][row]);
            (0..rows).map(row).collect()
        })
    }
}

/// Topics by name.
pub(super) type Topics = BTreeMap<&'static str, Topic>;

const TIMESTAMP: &str = "timestamp";

/// What is read, with the fields that a flight has; more are there, and the older of two topics
/// stands in for the newer.
pub(super) const READ: [(&str, &[&str]); 7] = [
    (
        "vehicle_local_position",
        &["x", "y", "z", "vx", "vy", "vz", "xy_valid", "z_valid"],
    ),
    ("vehicle_attitude", &["q[0]", "q[1]", "q[2]", "q[3]"]),
    ("vehicle_acceleration", &["xyz[0]", "xyz[1]", "xyz[2]"]),
    (
        "sensor_combined",
        &[
            "accelerometer_m_s2[0]",
            "accelerometer_m_s2[1]",
            "accelerometer_m_s2[2]",
        ],
    ),
    (
        "actuator_motors",
        &["control[0]", "control[1]", "control[2]", "control[3]"],
    ),
    (
        "actuator_outputs",
        &["output[0]", "output[1]", "output[2]", "output[3]"],
    ),
    ("battery_status", &["voltage_v"]),
];

fn fields_of(topic: &str) -> Option<(&'static str, &'static [&'static str])> {
    READ.into_iter().find(|(name, _)| *name == topic)
}

/// The topics of a ULog. What stands before a broken record is read; that it breaks off is a
/// remark.
pub(super) fn from_ulog(file: &str, bytes: &[u8], found: &mut Found) -> Option<Topics> {
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
            found.problem(Place::file(file), format!("is no ULog: {why}"));
            return None;
        }
    };
    if !parser.header_complete() {
        found.problem(Place::file(file), "is no ULog: it ends in its header");
        return None;
    }
    if let Some(how) = broken {
        let message = format!("the log ends {how}; what stands before is read");
        found.remark(RemarkKind::Gap, None, message);
    }
    if !dropouts_ms.is_empty() {
        let total_ms: u32 = dropouts_ms.iter().sum();
        let longest_ms = dropouts_ms.iter().max().copied().unwrap_or(0);
        found.remarks.push(Remark {
            kind: RemarkKind::Gap,
            subject: None,
            samples: dropouts_ms.len(),
            span_s: None,
            message: format!(
                "the logger lost data {} times, {total_ms} ms in all, {longest_ms} ms at the longest",
                dropouts_ms.len()
            ),
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
const HEAD_BYTES: usize = 59;

/// Parses a log: what was written in one go, then what was appended to it. Says whether the first
/// part ends with a whole record.
fn sections(bytes: &[u8], parser: &mut LogParser<'_>) -> Result<bool, String> {
    let said = |error: UlogParseError| error.description;
    let (head, rest) = bytes.split_at(bytes.len().min(HEAD_BYTES));
    parser.consume_bytes(head).map_err(said)?;
    let appended = parser.appended_offsets().iter().copied();
    let appended =
        appended.filter_map(|offset| usize::try_from(offset).ok()?.checked_sub(HEAD_BYTES));
    let mut cuts: Vec<usize> = appended
        .filter(|&cut| cut > 0 && cut < rest.len())
        .collect();
    cuts.sort_unstable();
    cuts.push(rest.len());
    let (mut from, mut is_whole) = (0, true);
    for cut in cuts {
        parser.consume_bytes(&rest[from..cut]).map_err(said)?;
        is_whole &= !parser.has_leftover();
        parser.clear_leftover();
        from = cut;
    }
    Ok(is_whole)
}

/// Adds a record to its topic; only the first instance of each.
fn gather(message: &DataMessage<'_>, topics: &mut Topics, others: &mut BTreeMap<String, usize>) {
    let name = message.flattened_format.message_name.as_str();
    let Some((name, wanted)) = fields_of(name) else {
        return;
    };
    if message.multi_id.value() != 0 {
        let label = format!("{name} {}", message.multi_id.value());
        *others.entry(label).or_default() += 1;
        return;
    }
    let Some(stamp) = &message.flattened_format.timestamp_field else {
        return; // without a time; the topic counts as missing
    };
    let Some(t_us) = bytes_at::<8>(message.data, stamp.offset).map(u64::from_le_bytes) else {
        return;
    };
    let topic = topics.entry(name).or_default();
    topic.fields.resize(wanted.len(), Vec::new());
    // Exact for the first 285 years after switching on.
    topic.t_us.push(t_us as f64);
    for (&field, values) in wanted.iter().zip(&mut topic.fields) {
        let mut there = message.flattened_format.fields.iter();
        let there = there.find(|of| of.flattened_field_name == field);
        values.extend(there.and_then(|of| value(of, message.data)));
    }
}

fn bytes_at<const N: usize>(data: &[u8], offset: u16) -> Option<[u8; N]> {
    let from = usize::from(offset);
    data.get(from..from + N)?.try_into().ok()
}

/// A field of the types that the topics above have had over the years.
fn value(field: &FlattenedField, data: &[u8]) -> Option<f64> {
    let at = field.offset;
    match field.field_type {
        FlattenedFieldType::Float => bytes_at(data, at).map(|b| f64::from(f32::from_le_bytes(b))),
        FlattenedFieldType::Double => bytes_at(data, at).map(f64::from_le_bytes),
        FlattenedFieldType::Bool | FlattenedFieldType::UInt8 => {
            bytes_at::<1>(data, at).map(|b| f64::from(b[0]))
        }
        FlattenedFieldType::UInt16 => bytes_at(data, at).map(|b| f64::from(u16::from_le_bytes(b))),
        FlattenedFieldType::Int16 => bytes_at(data, at).map(|b| f64::from(i16::from_le_bytes(b))),
        FlattenedFieldType::UInt32 => bytes_at(data, at).map(|b| f64::from(u32::from_le_bytes(b))),
        FlattenedFieldType::Int32 => bytes_at(data, at).map(|b| f64::from(i32::from_le_bytes(b))),
        _ => None,
    }
}

/// The topics of the tables that `ulog2csv` wrote of one log: `LOG_TOPIC_0.csv`.
pub(super) fn from_tables(files: &BTreeMap<String, Vec<u8>>, found: &mut Found) -> Topics {
    let mut topics = Topics::new();
    for (file, bytes) in files {
        let Some((_, name, instance)) = table_name(file) else {
            continue;
        };
        let Some((name, wanted)) = fields_of(name) else {
            continue;
        };
        if instance != 0 {
            let message = format!("{file} is not used: another instance is");
            found.remark(RemarkKind::Unused, None, message);
            continue;
        }
        let Some(table) = Table::open(file, bytes, found) else {
            continue;
        };
        let Some(stamp) = table.column(TIMESTAMP) else {
            found.problem(Place::field(file, TIMESTAMP).line(1), "is missing");
            continue;
        };
        let places: Vec<Option<usize>> = wanted.iter().map(|field| table.column(field)).collect();
        let there = places.iter().copied().flatten();
        let columns: Vec<usize> = std::iter::once(stamp).chain(there).collect();
        let mut numbers = table.read(&columns, None, found).numbers.into_iter();
        let topic = Topic {
            t_us: numbers.next().unwrap_or_default(),
            fields: places
                .iter()
                .map(|place| place.and_then(|_| numbers.next()).unwrap_or_default())
                .collect(),
        };
        topics.insert(name, topic);
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
