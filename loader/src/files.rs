//! Files up to an end, and names in them.

use std::fs;
use std::io::{self, Read as _};
use std::path::Path;

/// Most bytes of a scenario and of what it names, of a campaign file: chosen here, thirty times the
/// scenario of ten thousand drones.
pub const MOST_SCENARIO_BYTES: u64 = 32 << 20;
/// Most bytes of a plan, and of a recording once it is unpacked: chosen here, several times the
/// plan of ten thousand drones.
pub const MOST_BYTES: u64 = 200 << 20;

/// A text of at most so many bytes, from the beginning of a file to its end.
///
/// # Errors
///
/// The disk's, more bytes, and no UTF-8.
pub fn text(path: &Path, most: u64) -> io::Result<String> {
    text_of(fs::File::open(path)?, most)
}

/// A text of at most so many bytes, without a byte order mark.
///
/// # Errors
///
/// The source's, more bytes, and no UTF-8.
pub fn text_of(from: impl io::Read, most: u64) -> io::Result<String> {
    let bytes = bytes_of(from, most)?;
    let text = String::from_utf8(bytes).map_err(|_| {
        let what = "it is no text: not all of it is UTF-8";
        io::Error::new(io::ErrorKind::InvalidData, what)
    })?;
    match text.strip_prefix('\u{feff}') {
        Some(text) => Ok(text.to_owned()),
        None => Ok(text),
    }
}

/// The bytes of a file, if they are not more than so many.
///
/// # Errors
///
/// The source's, and more bytes.
pub fn bytes_of(from: impl io::Read, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let mib = most >> 20;
        let what = format!("it is longer than {mib} MiB");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, what));
    }
    Ok(bytes)
}

/// Whether a name that a file states is one of a file or a folder, and no path.
#[must_use]
pub fn is_plain(name: &str) -> bool {
    Path::new(name).file_name().is_some_and(|it| it == name)
}
