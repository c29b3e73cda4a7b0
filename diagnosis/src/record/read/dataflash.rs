//! A flight logged by ArduPilot (DataFlash, `.bin`), one vehicle a log: a sequence of messages of
//! which each declares itself first (ArduPilot, `libraries/AP_Logger/LogStructure.h`).
//!
//! ```text
//! 0xA3 0x95 · u8 type · payload
//! type 128, FMT: u8 type · u8 length with these three bytes · name[4] · format[16] · labels[64]
//! ```
//!
//! The world is north-east-down from where the estimator started and the body forward-right-down;
//! both are turned into ours, **x north, y west, z up**, as PX4's are.

use std::collections::BTreeMap;
use std::io::{BufRead, ErrorKind};

use nalgebra::Vector3;

use super::binary;
use super::campaign::Campaign;
use super::columns::Role;
use super::conventions::{Acceleration, Frame, Turns};
use super::flight::of_one;
use super::found::{Found, GPS_WITHIN_S, Start};
use super::log::Log;
use super::origin::Origin;
use super::series::{Sources, Stream, Thinning, joined};
use crate::record::problem::Problem;
use crate::record::recording::Recording;
use crate::record::remark::RemarkKind;
use crate::statistics::quantile::median;

const SOURCES: Sources = Sources {
    acceleration: "IMU",
    motors: "RCOU",
    battery: "BAT",
};
const MAGIC: [u8; 2] = [0xA3, 0x95];
/// The message that declares others, and its payload (bytes).
const FMT: u8 = 128;
const FMT_BYTES: usize = 86;
const HEAD_BYTES: usize = 3;
const DEGREES: f64 = std::f64::consts::PI / 180.0;
/// Pulse widths (us) of a motor that stands and of one at full: ArduPilot's `MOT_PWM_MIN` and
/// `MOT_PWM_MAX` by default.
const PULSES_US: [f64; 2] = [1000.0, 2000.0];

/// What is read of a message: its name, each field with what times it is SI (a pulse width is made
/// a share of full), and what comes of it.
type Wanted = (&'static str, &'static [(&'static str, Role, f64)]);

const WANTED: [Wanted; 5] = [
    (
        "XKF1",
        &[
            ("PN", Role::Position(0), 1.0),
            ("PE", Role::Position(1), 1.0),
            ("PD", Role::Position(2), 1.0),
            ("VN", Role::Velocity(0), 1.0),
            ("VE", Role::Velocity(1), 1.0),
            ("VD", Role::Velocity(2), 1.0),
        ],
    ),
    (
        "ATT",
        &[
            ("Roll", Role::Angle(0), DEGREES),
            ("Pitch", Role::Angle(1), DEGREES),
            ("Yaw", Role::Angle(2), DEGREES),
        ],
    ),
    (
        "IMU",
        &[
            ("AccX", Role::Acceleration(0), 1.0),
            ("AccY", Role::Acceleration(1), 1.0),
            ("AccZ", Role::Acceleration(2), 1.0),
        ],
    ),
    (
        "RCOU",
        &[
            ("C1", Role::Duty(0), 1.0),
            ("C2", Role::Duty(1), 1.0),
            ("C3", Role::Duty(2), 1.0),
            ("C4", Role::Duty(3), 1.0),
        ],
    ),
    ("BAT", &[("Volt", Role::Battery, 1.0)]),
];
/// Labels of the field that says which core or sensor speaks; the first does.
const INSTANCES: [&str; 4] = ["C", "I", "Inst", "Instance"];
const TIME: &str = "TimeUS";
/// The message by which logs of several vehicles share a clock, and its status, week and
/// millisecond.
const GPS: (&str, [&str; 3]) = ("GPS", ["Status", "GWk", "GMS"]);
/// The message that says where the estimator counts from; of the type 0, for others are of home.
const ORIGIN: (&str, [&str; 3]) = ("ORGN", ["Type", "Lat", "Lng"]);
/// Its label of the height, which old logs lack.
const ALTITUDE: &str = "Alt";
/// Seconds of a week, from the epoch of Unix to that of GPS, and what UTC is behind GPS by since
/// 2017 (IERS, Bulletin C).
const WEEK_S: f64 = 604_800.0;
const GPS_EPOCH_S: f64 = 315_964_800.0;
const LEAP_S: f64 = 18.0;
/// Fixes looked at. Chosen here: some minutes, of which the median is taken.
const MOST_FIXES: usize = 1000;

/// A recording from the bytes of a log. Of the campaign, frame and kind of acceleration are
/// ArduPilot's own, whatever it says.
pub(super) fn dataflash(log: Log<'_>, campaign: &Campaign, found: &mut Found) -> Option<Recording> {
    let campaign = Campaign {
        frame: Frame::NorthEastDown,
        acceleration: Some(Acceleration::SpecificForceInBody),
        quaternion: Turns::BodyToWorld,
        pitch: None,
        ..campaign.clone()
    };
    let file = log.file;
    let Read {
        messages,
        others,
        broken,
        gps_s,
        origin,
    } = messages(log.bytes, found);
    if let Some((at, why)) = broken {
        if messages.is_empty() {
            found.problem(Problem::file(file), format!("at byte {at}: {why}"));
            return None;
        }
        let message = format!("at byte {at}: {why}; what stands before is read");
        found.remark(RemarkKind::Gap, None, message);
    }
    for (name, count) in others {
        let message = format!("{count} messages {name} are not used: another instance is");
        found.remark(RemarkKind::Unused, None, message);
    }
    let mut gps_s = gps_s;
    let starts = median(&mut gps_s).map(|gps_s| Start {
        at_s: gps_s + GPS_EPOCH_S - LEAP_S,
        within_s: GPS_WITHIN_S,
    });
    found.starts = starts;
    found.origin = origin;
    of_one(log.name, file, &campaign, found, |id, found| {
        if messages.iter().any(|stream| stream.name == "RCOU") {
            let message = "motors from RCOU 1 to 4, taken as pulse widths of 1000 to 2000 us";
            found.remark(RemarkKind::Assumed, Some(id), message);
        }
        let samples = joined(id, messages, &SOURCES, found);
        if samples.is_none() {
            let message = "is missing: there is no position in this log";
            let help = "set EK3_ENABLE, AHRS_EKF_TYPE 3 and the bits of LOG_BITMASK for attitude and navigation";
            found.helped(Problem::field(file, "XKF1"), message, Some(help.to_owned()));
        }
        samples
    })
}

/// A field's place in the payload, and its letter.
type Field = (usize, u8);

/// A message as the log declares it.
struct Declared {
    /// Bytes with the head.
    length: usize,
    /// Which of [`WANTED`]; its fields' places and letters in the payload, as many as it wants.
    wanted: Option<(usize, Vec<Field>)>,
    time: Option<Field>,
    instance: Option<Field>,
    /// Status, week and millisecond, of a message of GPS.
    gps: Option<[Field; 3]>,
    /// Type, latitude and longitude, of a message of an origin, and its height.
    origin: Option<([Field; 3], Option<Field>)>,
}

/// What a log holds.
#[derive(Default)]
struct Read {
    messages: Vec<Stream>,
    /// How many of other instances are not used.
    others: BTreeMap<String, usize>,
    /// Where it breaks off, and why.
    broken: Option<(usize, String)>,
    /// Times of GPS (s since its epoch) less those of the log.
    gps_s: Vec<f64>,
    origin: Option<Origin>,
}

/// Fills a part of a message, or says why there is no more of it.
fn fill(bytes: &mut dyn BufRead, part: &mut [u8]) -> Result<(), String> {
    bytes.read_exact(part).map_err(|error| match error.kind() {
        ErrorKind::UnexpectedEof => "the log ends within a message".to_owned(),
        _ => error.to_string(),
    })
}

/// Messages that are wanted, one after the other.
fn messages(bytes: &mut dyn BufRead, found: &mut Found) -> Read {
    let mut read = Read::default();
    let mut declared: BTreeMap<u8, Declared> = BTreeMap::new();
    let mut streams: [(Stream, Thinning); WANTED.len()] = Default::default();
    let mut at = 0;
    let mut broken = None;
    loop {
        let mut head = [0; HEAD_BYTES];
        match bytes.fill_buf().map(<[u8]>::is_empty) {
            Ok(true) => break,
            Ok(false) => {}
            Err(error) => {
                broken = Some(error.to_string());
                break;
            }
        }
        if let Err(why) = fill(bytes, &mut head) {
            broken = Some(why);
            break;
        }
        let [first, second, kind] = head;
        if [first, second] != MAGIC {
            broken = Some("here no message begins".to_owned());
            break;
        }
        let length = match kind {
            FMT => HEAD_BYTES + FMT_BYTES,
            _ => declared.get(&kind).map_or(0, |of| of.length),
        };
        if length == 0 {
            broken = Some(format!("a message of the type {kind}, which none declares"));
            break;
        }
        // A message is at most as long as a byte can say.
        let mut payload = [0; 256];
        let payload = &mut payload[..length - HEAD_BYTES];
        if let Err(why) = fill(bytes, payload) {
            broken = Some(why);
            break;
        }
        let payload = &*payload;
        if kind == FMT {
            match declaration(payload) {
                Ok((of, declaration)) => drop(declared.insert(of, declaration)),
                Err(why) => {
                    broken = Some(why);
                    break;
                }
            }
        } else if let Some(declared) = declared.get(&kind) {
            gather(declared, payload, &mut streams, &mut read);
        }
        at += length;
    }
    for ((name, _), (stream, thinning)) in WANTED.iter().zip(streams) {
        thinning.tell(name, found);
        if !stream.t_s.is_empty() {
            let name = (*name).to_owned();
            read.messages.push(Stream { name, ..stream });
        }
    }
    read.broken = broken.map(|why| (at, why));
    read
}

/// What a message FMT declares, and of which type.
fn declaration(payload: &[u8]) -> Result<(u8, Declared), String> {
    let text = |range: std::ops::Range<usize>| {
        let raw = &payload[range];
        let end = raw.iter().position(|byte| *byte == 0).unwrap_or(raw.len());
        String::from_utf8_lossy(&raw[..end]).into_owned()
    };
    let (kind, length) = (payload[0], usize::from(payload[1]));
    let (name, format, labels) = (text(2..6), text(6..22), text(22..86));
    let mut places = BTreeMap::new();
    let mut end = 0;
    for (letter, label) in format.bytes().zip(labels.split(',')) {
        let Some(size) = size(letter) else {
            let letter = char::from(letter);
            return Err(format!(
                "{name}.{label} is declared of the type `{letter}`, which is not known"
            ));
        };
        places.insert(label, (end, letter));
        end += size;
    }
    if length < HEAD_BYTES + end {
        return Err(format!(
            "{name} is declared as {length} bytes, and its fields need {}",
            HEAD_BYTES + end
        ));
    }
    let wanted = WANTED.iter().position(|(wanted, _)| *wanted == name);
    let fields = wanted.and_then(|of| {
        let fields = WANTED[of].1.iter();
        let places: Option<Vec<_>> = fields
            .map(|(label, ..)| places.get(label).copied())
            .collect();
        Some((of, places?))
    });
    let instances = INSTANCES.iter().find_map(|label| places.get(label));
    let three = |(of, labels): (&str, [&str; 3])| {
        let [first, second, third] = labels.map(|label| places.get(label).copied());
        (name == of).then_some([first?, second?, third?])
    };
    let declared = Declared {
        length,
        wanted: fields,
        time: places.get(TIME).copied(),
        instance: instances.copied(),
        gps: three(GPS),
        origin: three(ORIGIN).map(|of| (of, places.get(ALTITUDE).copied())),
    };
    Ok((kind, declared))
}

/// Adds a message to its stream.
fn gather(
    declared: &Declared,
    payload: &[u8],
    streams: &mut [(Stream, Thinning); WANTED.len()],
    all: &mut Read,
) {
    let Some(time) = declared.time else {
        return;
    };
    let read = |(at, letter): (usize, u8)| value(letter, &payload[at..]);
    if let Some([status, week, millisecond]) = declared.gps {
        // Without a fix its time is its own.
        if read(status) >= 3.0 && all.gps_s.len() < MOST_FIXES {
            let gps_s = read(week) * WEEK_S + read(millisecond) * 1e-3;
            all.gps_s.push(gps_s - read(time) * 1e-6);
        }
    }
    if let Some(([kind, latitude, longitude], altitude)) = declared.origin
        && read(kind) == 0.0
        && all.origin.is_none()
    {
        let place_deg = [latitude, longitude].map(read);
        all.origin = Origin::new(place_deg, altitude.map(read), Vector3::zeros());
    }
    let Some((of, places)) = &declared.wanted else {
        return;
    };
    let (name, fields) = WANTED[*of];
    let read = |(at, letter): (usize, u8)| value(letter, &payload[at..]);
    if let Some(instance) = declared.instance.map(read).filter(|of| *of != 0.0) {
        *all.others.entry(format!("{name} {instance}")).or_default() += 1;
        return;
    }
    let (stream, thinning) = &mut streams[*of];
    if !thinning.keeps() {
        return;
    }
    stream.t_s.push(read(time) * 1e-6);
    let columns = fields.iter().map(|(_, role, _)| (*role, Vec::new()));
    if stream.columns.is_empty() {
        stream.columns = columns.collect();
    }
    let [low, high] = PULSES_US;
    for (((_, role, factor), place), (_, column)) in
        fields.iter().zip(places).zip(&mut stream.columns)
    {
        let raw = read(*place);
        column.push(match role {
            // 0: no pulse at all.
            Role::Duty(_) => ((raw - low) / (high - low)).max(0.0),
            _ => raw * factor,
        });
    }
    stream.thin(thinning);
}

/// A letter of ArduPilot's as one of Python's `struct`, and what it multiplies by: `c`, `C`, `e`
/// and `E` are hundredths, `L` ten-millionths of a degree.
fn number(letter: u8) -> Option<(u8, f64)> {
    Some(match letter {
        b'c' => (b'h', 0.01),
        b'C' => (b'H', 0.01),
        b'e' => (b'i', 0.01),
        b'E' => (b'I', 0.01),
        b'L' => (b'i', 1e-7),
        b'M' => (b'B', 1.0),
        b'b' | b'B' | b'h' | b'H' | b'i' | b'I' | b'q' | b'Q' | b'f' | b'd' => (letter, 1.0),
        _ => return None,
    })
}

/// Bytes of a field by its letter; texts and arrays have no number.
fn size(letter: u8) -> Option<usize> {
    match letter {
        b'n' => Some(4),
        b'N' => Some(16),
        b'a' | b'Z' => Some(64),
        _ => number(letter).and_then(|(letter, _)| binary::size(letter)),
    }
}

/// A number at the beginning of `raw`, which is long enough.
fn value(letter: u8, raw: &[u8]) -> f64 {
    let read = |(letter, factor)| {
        binary::value(letter, &raw[..binary::size(letter).unwrap_or(0)]) * factor
    };
    number(letter).map_or(f64::NAN, read)
}

#[cfg(test)]
mod tests;
