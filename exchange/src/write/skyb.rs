//! Skybrush's binary show file of one drone (`.skyb`, version 2): a trajectory, a light program
//! where there is one, and a comment, with a checksum.
//!
//! The layout is that of `src/formats/binary.c` in skybrush-io/libskybrush: `skyb`, version 2,
//! features (1: checksum), the checksum (u32), then blocks of a type, a length (u16) and a body,
//! little-endian. Written from the format's description; none of that program is in here.

use super::compressed::{self, OutOfRange};
use crate::course::Course;
use crate::lights::Lights;

/// Largest unit (mm): seven bits of a byte.
const MOST_UNIT_MM: u32 = 127;
/// Longest body of a block (bytes).
pub const MOST_BYTES: usize = 65_535;

/// A file, and how many bytes its trajectory takes, which must not be more than [`MOST_BYTES`].
#[derive(Clone, Debug, PartialEq)]
pub struct Skyb {
    /// The file.
    pub bytes: Vec<u8>,
    /// Of its trajectory.
    pub body: usize,
    /// A coordinate's step (mm).
    pub unit_mm: u32,
}

/// One drone with its light program and a comment.
///
/// # Errors
///
/// A coordinate is out of range at the largest unit.
pub fn file(course: &Course, lights: Option<&Lights>, comment: &str) -> Result<Skyb, OutOfRange> {
    let reach_mm = (compressed::farthest_m(course) * 1000.0).ceil();
    let unit_mm = ((reach_mm + 1.0) / 32_768.0)
        .ceil()
        .clamp(1.0, f64::from(MOST_UNIT_MM)) as u32;
    let pieces = compressed::pieces(course, unit_mm)?;
    let mut bytes = b"skyb\x02\x01\0\0\0\0".to_vec();
    let mut block = |kind: u8, parts: [&[u8]; 2]| {
        let length: usize = parts.iter().map(|it| it.len()).sum();
        bytes.push(kind);
        // The caller refuses a longer one.
        bytes.extend((length.min(MOST_BYTES) as u16).to_le_bytes());
        parts.iter().for_each(|it| bytes.extend(*it));
    };
    block(1, [&[unit_mm as u8], &pieces.bytes]);
    if let Some(lights) = lights {
        block(2, [lights.bytecode(), &[]]);
    }
    block(3, [comment.as_bytes(), &[]]);
    // Initial value 0 and no final inversion, where crc32fast inverts both.
    let mut hasher = crc32fast::Hasher::new_with_initial(u32::MAX);
    hasher.update(&bytes);
    bytes[6..10].copy_from_slice(&(!hasher.finalize()).to_le_bytes());
    Ok(Skyb {
        bytes,
        body: pieces.bytes.len() + 1,
        unit_mm,
    })
}
