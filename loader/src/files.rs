//! Files up to an end, names in them, and folders by what wrote them.

use std::fs;
use std::io::{self, Read as _};
use std::path::Path;

/// Most bytes of a scenario and of what it names, of a campaign file: chosen here, thirty times the
/// scenario of ten thousand drones.
pub const MOST_SCENARIO_BYTES: u64 = 32 << 20;
/// Most bytes of a plan, and of a recording once it is unpacked: chosen here, several times the
/// plan of ten thousand drones.
pub const MOST_BYTES: u64 = 200 << 20;

/// The commands that write folders: the file by which one knows theirs, the command, and where it
/// writes unless it is told.
pub const WRITERS: [(&str, &str, &str); 14] = [
    ("plan.json", "plan SCENARIO", "out"),
    ("checked.json", "plan check", "out/check"),
    ("flight.json", "plan fly", "out/fly"),
    ("export.json", "plan export", "out/export"),
    ("separation.json", "plan separation", "out/separation"),
    ("comparison.json", "plan compare", "out/compare"),
    ("sweep.json", "plan sweep", "out/sweep"),
    ("air.json", "plan air", "out/air"),
    ("residuals.json", "plan simulate", "out/simulate"),
    ("calibration.json", "plan calibrate", "out/calibrate"),
    ("diagnosis.json", "plan diagnose", "out/diagnose"),
    ("judged.json", "plan diagnose --finding", "out/judged"),
    ("hardware.json", "plan diagnose --normal", "out/hardware"),
    ("marks.json", "plan prove", "out"),
];

/// What another command wrote to a folder that one is to write to whose main file this is: the file
/// by which one knows it, and the command.
#[must_use]
pub fn other_writer(folder: &Path, main: &str) -> Option<(&'static str, &'static str)> {
    let mut others = WRITERS.iter().filter(|(file, ..)| *file != main);
    let (file, command, _) = others.find(|(file, ..)| folder.join(file).exists())?;
    Some((file, command))
}

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
        let what = match most >> 20 {
            0 => format!("it is longer than {most} bytes"),
            mib => format!("it is longer than {mib} MiB"),
        };
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, what));
    }
    Ok(bytes)
}

/// Whether a name that a file states is one of a file or a folder, and no path.
#[must_use]
pub fn is_plain(name: &str) -> bool {
    Path::new(name).file_name().is_some_and(|it| it == name)
}
