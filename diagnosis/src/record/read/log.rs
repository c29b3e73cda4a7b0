//! The kinds of flight logs that are read, in one table: how each is told from the others, and what
//! makes a recording of it.

use std::io::{BufRead, Read as _};

use super::campaign::Campaign;
use super::dataflash::dataflash;
use super::flight::flight;
use super::found::Found;
use super::mcap::{MAGIC, mcap};
use super::ulog::ulog;
use super::usd::usd;
use crate::record::problem::{Problem, Problems};
use crate::record::recording::Recording;

/// The bytes of one log, unpacked, as they come.
pub(super) struct Log<'b> {
    /// What the recording is called, and a vehicle that the log does not name.
    pub(super) name: &'b str,
    /// What messages call it.
    pub(super) file: &'b str,
    pub(super) bytes: &'b mut dyn BufRead,
}

struct LogKind {
    /// How its files' names end; empty where they have no ending of their own.
    ending: &'static str,
    /// What its files begin with; empty for texts.
    magic: &'static [u8],
    read: fn(Log<'_>, &Campaign, &mut Found) -> Option<Recording>,
}

/// Magic bytes: docs.px4.io, "ULog File Format"; mcap.dev, "MCAP format specification"; ArduPilot,
/// `libraries/AP_Logger/LogStructure.h`; Crazyflie firmware, `tools/usdlog/cfusdlog.py`.
const KINDS: [LogKind; 6] = [
    LogKind {
        ending: ".csv",
        magic: b"",
        read: flight,
    },
    LogKind {
        ending: ".ulg",
        magic: b"ULog\x01\x12\x35",
        read: ulog,
    },
    LogKind {
        ending: ".mcap",
        magic: MAGIC,
        read: mcap,
    },
    LogKind {
        ending: ".bin",
        magic: &[0xA3, 0x95, 0x80],
        read: dataflash,
    },
    LogKind {
        ending: "",
        magic: &[0xBC, 1, 0],
        read: usd,
    },
    LogKind {
        ending: "",
        magic: &[0xBC, 2, 0],
        read: usd,
    },
];
/// Ends the name of a packed file.
const PACKED: &str = ".gz";
/// As many of a file's first bytes tell what it is.
pub const LOG_HEAD_BYTES: usize = 8;

/// Which files are flight logs, in words.
pub const LOG_FILES: &str = ".csv, .ulg (PX4), .bin (ArduPilot) or .mcap (ROS 2), each also with .gz, or files that a Crazyflie wrote to its card";

/// What begins as logs of a kind do is one, whatever its name; other files go by their endings.
fn kind_of(file: &str, head: &[u8]) -> Option<&'static LogKind> {
    let begins = |kind: &&LogKind| !kind.magic.is_empty() && head.starts_with(kind.magic);
    let ends = |kind: &&LogKind| !kind.ending.is_empty() && file.ends_with(kind.ending);
    KINDS
        .iter()
        .find(begins)
        .or_else(|| KINDS.iter().find(ends))
}

/// The name of a log without what says its kind; `None` where `file` is no flight log. `head` are
/// the first [`LOG_HEAD_BYTES`] bytes, which need not be there.
///
/// ```
/// use diagnosis::record::read::log_name;
/// assert_eq!(log_name("night.csv.gz", b""), Some("night"));
/// assert_eq!(log_name("log07", &[0xBC, 2, 0, 1, 0]), Some("log07"));
/// assert_eq!(log_name("notes.txt", b"at dusk"), None);
/// ```
#[must_use]
pub fn log_name<'f>(file: &'f str, head: &[u8]) -> Option<&'f str> {
    let plain = file.strip_suffix(PACKED).unwrap_or(file);
    let kind = kind_of(plain, head)?;
    let stem = plain.strip_suffix(kind.ending).unwrap_or(plain);
    (!stem.is_empty() && !stem.starts_with('.')).then_some(stem)
}

/// A recording from the unpacked bytes of a log of any kind, read once from end to end; `file` is
/// what messages call it, and says by its ending what its bytes do not. What is kept of a log is
/// bounded whatever its length: of a long one every second entry, or fourth, which a remark tells.
///
/// # Errors
/// Everything that keeps it from being read.
pub fn read_log(
    name: &str,
    file: &str,
    mut bytes: impl BufRead,
    campaign: &Campaign,
) -> Result<Recording, Problems> {
    Found::recording(|found| read_into(name, file, &mut bytes, campaign, found))
}

/// As [`read_log`], with what was noticed.
pub(super) fn read_into(
    name: &str,
    file: &str,
    bytes: &mut dyn BufRead,
    campaign: &Campaign,
    found: &mut Found,
) -> Option<Recording> {
    let mut head = Vec::new();
    let first = bytes.take(LOG_HEAD_BYTES as u64).read_to_end(&mut head);
    if let Err(error) = first {
        found.problem(Problem::file(file), format!("cannot be read: {error}"));
        return None;
    }
    let kind = kind_of(file.strip_suffix(PACKED).unwrap_or(file), &head);
    let read = kind.map_or(flight as _, |kind| kind.read);
    let bytes = &mut head.as_slice().chain(bytes);
    read(Log { name, file, bytes }, campaign, found)
}

impl Log<'_> {
    /// All of its bytes, if they are not more than so many.
    pub(super) fn whole(&mut self, most: u64, found: &mut Found) -> Option<Vec<u8>> {
        let mut whole = Vec::new();
        let read = self.bytes.take(most + 1).read_to_end(&mut whole);
        let why = match read {
            Err(error) => format!("cannot be read: {error}"),
            Ok(length) if length as u64 > most => {
                format!("is longer than {} MiB", most >> 20)
            }
            Ok(_) => return Some(whole),
        };
        found.problem(Problem::file(self.file), why);
        None
    }
}

/// Whether a log without metadata may say by a header what it asks for.
pub(super) fn is_table(file: &str, bytes: &[u8]) -> bool {
    let kind = kind_of(file.strip_suffix(PACKED).unwrap_or(file), bytes);
    kind.is_none_or(|kind| kind.magic.is_empty())
}
