//! A flight that a Crazyflie wrote to its card (uSD deck), one vehicle a log. Little-endian, packed
//! (Crazyflie firmware, `tools/usdlog/cfusdlog.py`):
//!
//! ```text
//! 0xBC · u16 version, 1 or 2 · u16 count of event types
//! of each type: u16 id · name\0 · u16 count of variables · of each: name(type letter)\0
//! events: u16 id · u32 time in ms (version 1) or u64 in µs (version 2) · a value of each variable
//! u32 CRC-32 of all before it
//! ```

use super::binary::{size, value};
use super::campaign::Campaign;
use super::columns::{Role, Unit, meaning};
use super::crazyflie;
use super::flight::of_one;
use super::found::{Found, did_you_mean, listed};
use super::log::Log;
use super::series::{Sources, Stream, Thinning, joined};
use crate::record::problem::Problem;
use crate::record::recording::Recording;
use crate::record::remark::RemarkKind;

const SOURCES: Sources = Sources {
    acceleration: "acc.x, acc.y, acc.z",
    motors: "motor.m1 to motor.m4",
    battery: "pm.vbat",
};
/// Bytes of the checksum.
const CRC_BYTES: usize = 4;
/// Longest log. Chosen here: its checksum stands at its end, so that all of it is held; an hour of
/// all that a Crazyflie can log at 1 kHz.
const MOST_BYTES: u64 = 512 << 20;

pub(super) fn usd(mut log: Log<'_>, campaign: &Campaign, found: &mut Found) -> Option<Recording> {
    let file = log.file;
    let bytes = log.whole(MOST_BYTES, found)?;
    let mut types = match event_types(&bytes) {
        Ok(types) => types,
        Err(Broken { at, why }) => {
            found.problem(Problem::file(file), format!("at byte {at}: {why}"));
            return None;
        }
    };
    let names = || types.iter().flat_map(|of| &of.variables).map(|of| &of.name);
    let header: Vec<String> = names().cloned().collect();
    let campaign = crazyflie::completed(campaign, &header);
    let mut taken = Vec::new();
    for (ours, theirs) in &campaign.columns.0 {
        let Some((role, unit)) = meaning(ours).filter(|(role, _)| *role != Role::Time) else {
            continue; // times are the log's own
        };
        let all = types.iter_mut().flat_map(|of| &mut of.variables);
        let factor = match unit {
            Unit::Times(factor) => factor,
            Unit::Gravities => campaign.gravity_mps2(),
        };
        let mut named = all.filter(|of| of.name == *theirs);
        match named.next() {
            Some(variable) => variable.is = Some((role, factor)),
            None => {
                let message = format!("is not in the log, though `columns` takes `{ours}` from it");
                let help = did_you_mean(theirs, header.iter().map(String::as_str));
                found.helped(Problem::field(file, theirs), message, help);
            }
        }
        taken.push(theirs);
    }
    let unused = header.iter().filter(|name| !taken.contains(name));
    let unused: Vec<&str> = unused.map(String::as_str).collect();
    if !unused.is_empty() {
        let message = format!("variables of {file} that are not used: {}", listed(unused));
        found.remark(RemarkKind::Unused, None, message);
    }
    let streams = match events(&bytes, &types, found) {
        Ok(streams) => streams,
        Err(Broken { at, why }) => {
            found.problem(Problem::file(file), format!("at byte {at}: {why}"));
            return None;
        }
    };
    of_one(log.name, file, &campaign, found, |id, found| {
        let samples = joined(id, streams, &SOURCES, found);
        if samples.is_none() {
            let message = "no event has all three of a position";
            let help = "let the deck's config.txt log stateEstimate.x, stateEstimate.y and stateEstimate.z in one event, or name yours in `columns`";
            found.helped(Problem::file(file), message, Some(help.to_owned()));
        }
        samples
    })
}

/// Where a log is not what it should be.
#[derive(Debug, PartialEq)]
struct Broken {
    /// Offset in the file (bytes).
    at: usize,
    why: String,
}

/// One type of event, as the head of the log declares it.
#[derive(Debug, PartialEq)]
struct EventType {
    id: u16,
    variables: Vec<Variable>,
}

#[derive(Debug, PartialEq)]
struct Variable {
    name: String,
    letter: u8,
    /// What it is taken as, and what times it is SI.
    is: Option<(Role, f64)>,
}

/// Bytes yet to be read.
struct Cursor<'b> {
    bytes: &'b [u8],
    at: usize,
}

impl<'b> Cursor<'b> {
    fn broken<T>(&self, why: impl Into<String>) -> Result<T, Broken> {
        let (at, why) = (self.at, why.into());
        Err(Broken { at, why })
    }

    fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N], Broken> {
        match self.bytes[self.at..].first_chunk() {
            Some(chunk) => {
                self.at += N;
                Ok(*chunk)
            }
            None => self.broken(format!("the log ends within {what}")),
        }
    }

    fn u16(&mut self, what: &str) -> Result<u16, Broken> {
        self.take(what).map(u16::from_le_bytes)
    }

    fn name(&mut self, what: &str) -> Result<&'b str, Broken> {
        let rest = &self.bytes[self.at..];
        let Some(length) = rest.iter().position(|byte| *byte == 0) else {
            return self.broken(format!("{what} has no end"));
        };
        let Ok(name) = std::str::from_utf8(&rest[..length]) else {
            return self.broken(format!("{what} is no text"));
        };
        self.at += length + 1;
        Ok(name)
    }
}

/// The log without its checksum, which is right.
fn checked(bytes: &[u8]) -> Result<&[u8], Broken> {
    let Some((body, stated)) = bytes.split_last_chunk::<CRC_BYTES>() else {
        let why = "the log ends before its checksum".to_owned();
        return Err(Broken {
            at: bytes.len(),
            why,
        });
    };
    let (stated, computed) = (u32::from_le_bytes(*stated), crc32fast::hash(body));
    if stated == computed {
        return Ok(body);
    }
    let why = format!(
        "the checksum is {stated:08x}, and that of all before it {computed:08x}: the log is damaged, or was not closed before power was cut"
    );
    Err(Broken {
        at: body.len(),
        why,
    })
}

/// The head of a log: its types of events.
fn event_types(bytes: &[u8]) -> Result<Vec<EventType>, Broken> {
    let bytes = checked(bytes)?;
    let mut cursor = Cursor { bytes, at: 0 };
    head(&mut cursor).map(|(types, _)| types)
}

/// Types of events, and the version of the log; the cursor stands at the first event.
fn head(cursor: &mut Cursor<'_>) -> Result<(Vec<EventType>, u16), Broken> {
    let [magic] = cursor.take("its head")?;
    let version = cursor.u16("its head")?;
    if magic != 0xBC || !(1..=2).contains(&version) {
        cursor.at = 0;
        return cursor.broken("is no log of a Crazyflie's card of version 1 or 2");
    }
    let count = cursor.u16("its head")?;
    let mut types: Vec<EventType> = Vec::new();
    for _ in 0..count {
        let id = cursor.u16("a type of event")?;
        if types.iter().any(|of| of.id == id) {
            cursor.at -= 2;
            return cursor.broken(format!("a second type of event has the number {id}"));
        }
        cursor.name("the name of a type of event")?;
        let count = cursor.u16("a type of event")?;
        let mut variables = Vec::new();
        for _ in 0..count {
            let from = cursor.at;
            let written = cursor.name("the name of a variable")?;
            let parts = written.strip_suffix(')').and_then(|of| of.rsplit_once('('));
            let (name, letter) = match parts {
                Some((name, letter)) if letter.len() == 1 => (name, letter.as_bytes()[0]),
                _ => ("", 0),
            };
            if size(letter).is_none() {
                cursor.at = from;
                return cursor.broken(format!("`{written}` has no type that is known"));
            }
            let name = name.to_owned();
            variables.push(Variable {
                name,
                letter,
                is: None,
            });
        }
        types.push(EventType { id, variables });
    }
    Ok((types, version))
}

/// Events by their types: what is taken of each, in SI.
fn events(bytes: &[u8], types: &[EventType], found: &mut Found) -> Result<Vec<Stream>, Broken> {
    let bytes = checked(bytes)?;
    let mut cursor = Cursor { bytes, at: 0 };
    let (_, version) = head(&mut cursor)?;
    let stream = |of: &EventType| {
        let taken = of.variables.iter().filter_map(|variable| variable.is);
        Stream {
            name: format!("events {}", of.id),
            t_s: Vec::new(),
            columns: taken.map(|(role, _)| (role, Vec::new())).collect(),
        }
    };
    let mut streams: Vec<Stream> = types.iter().map(stream).collect();
    let thinning = |_: &EventType| Thinning::default();
    let mut thinnings: Vec<Thinning> = types.iter().map(thinning).collect();
    while cursor.at < bytes.len() {
        let id = cursor.u16("an event")?;
        let Some(place) = types.iter().position(|of| of.id == id) else {
            cursor.at -= 2;
            return cursor.broken(format!("an event of the type {id}, which the head lacks"));
        };
        let t_s = match version {
            1 => f64::from(u32::from_le_bytes(cursor.take("an event")?)) * 1e-3,
            _ => u64::from_le_bytes(cursor.take("an event")?) as f64 * 1e-6,
        };
        let (stream, thinning) = (&mut streams[place], &mut thinnings[place]);
        let is_kept = thinning.keeps();
        if is_kept {
            stream.t_s.push(t_s);
        }
        let mut columns = stream.columns.iter_mut();
        for variable in &types[place].variables {
            let length = size(variable.letter).unwrap_or(0);
            let Some(raw) = bytes.get(cursor.at..cursor.at + length) else {
                return cursor.broken("the log ends within an event");
            };
            cursor.at += length;
            if is_kept
                && let Some((_, factor)) = variable.is
                && let Some((_, column)) = columns.next()
            {
                column.push(value(variable.letter, raw) * factor);
            }
        }
        stream.thin(thinning);
    }
    for thinning in &thinnings {
        thinning.tell("events of one type", found);
    }
    Ok(streams)
}

#[cfg(test)]
mod tests;
