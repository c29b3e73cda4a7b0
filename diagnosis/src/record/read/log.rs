//! The kinds of flight logs that are read, in one table: how each is told from the others, and what
//! makes a recording of it.

use super::campaign::Campaign;
use super::dataflash::dataflash;
use super::flight::flight;
use super::found::Found;
use super::ulog::ulog;
use super::usd::usd;
use crate::record::problem::Problems;
use crate::record::recording::Recording;

/// The bytes of one log, unpacked, all of them in memory.
#[derive(Clone, Copy)]
pub(super) struct Log<'b> {
    /// What the recording is called, and a vehicle that the log does not name.
    pub(super) name: &'b str,
    /// What messages call it.
    pub(super) file: &'b str,
    pub(super) bytes: &'b [u8],
}

struct LogKind {
    /// How its files' names end; empty where they have no ending of their own.
    ending: &'static str,
    /// What its files begin with; empty for texts.
    magic: &'static [u8],
    read: fn(&Log<'_>, &Campaign, &mut Found) -> Option<Recording>,
}

/// Magic bytes: docs.px4.io, "ULog File Format"; ArduPilot, `libraries/AP_Logger/LogStructure.h`;
/// Crazyflie firmware, `tools/usdlog/cfusdlog.py`.
const KINDS: [LogKind; 5] = [
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
pub const LOG_FILES: &str = ".csv, .ulg or .bin (ArduPilot), each also with .gz, or files that a Crazyflie wrote to its card";

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

/// A recording from the unpacked bytes of a log of any kind; `file` is what messages call it, and
/// says by its ending what its bytes do not.
///
/// # Errors
/// Everything that keeps it from being read.
pub fn read_log(
    name: &str,
    file: &str,
    bytes: &[u8],
    campaign: &Campaign,
) -> Result<Recording, Problems> {
    let log = Log { name, file, bytes };
    let kind = kind_of(file.strip_suffix(PACKED).unwrap_or(file), bytes);
    let read = kind.map_or(flight as _, |kind| kind.read);
    Found::recording(|found| read(&log, campaign, found))
}

/// Whether a log without metadata may say by a header what it asks for.
pub(super) fn is_table(file: &str, bytes: &[u8]) -> bool {
    let kind = kind_of(file.strip_suffix(PACKED).unwrap_or(file), bytes);
    kind.is_none_or(|kind| kind.magic.is_empty())
}
