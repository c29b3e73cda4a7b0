//! Skybrush's binary show file of one drone: its checksum, its trajectory, its comment.

use super::{ReadError, compressed};
use crate::flown::Flown;

/// One drone, and what its comment says.
///
/// # Errors
///
/// Not such a file, another version, cut, or changed since its checksum was made.
pub fn read(bytes: &[u8]) -> Result<(Flown, String), ReadError> {
    if !bytes.starts_with(b"skyb") {
        return Err(ReadError::byte(0, "does not begin `skyb`"));
    }
    let Some(&[version, features]) = bytes.get(4..6).and_then(<[u8]>::first_chunk) else {
        return Err(ReadError::byte(bytes.len(), "ends within its header"));
    };
    if version != 2 {
        let what = format!("version {version}, this program reads 2");
        return Err(ReadError::byte(4, what));
    }
    let mut at = 6;
    if features & 1 == 1 {
        let Some(stated) = bytes.get(6..10).and_then(<[u8]>::first_chunk) else {
            return Err(ReadError::byte(bytes.len(), "ends within its header"));
        };
        if u32::from_le_bytes(*stated) != checksum(bytes) {
            return Err(ReadError::byte(6, "the checksum is not that of the file"));
        }
        at = 10;
    }
    let (mut flown, mut comment) = (None, String::new());
    while at < bytes.len() {
        let header = bytes.get(at..).and_then(<[u8]>::first_chunk);
        let Some(&[kind, low, high]) = header else {
            return Err(ReadError::byte(at, "ends within a block's header"));
        };
        let end = at + 3 + usize::from(u16::from_le_bytes([low, high]));
        let Some(body) = bytes.get(at + 3..end) else {
            return Err(ReadError::byte(at, "ends within a block"));
        };
        match (kind, body) {
            (1, [scale, rest @ ..]) => {
                let unit_m = f64::from(scale & 0x7F) / 1000.0;
                flown = Some(compressed::read(rest, unit_m)?);
            }
            (3, text) => comment = String::from_utf8_lossy(text).into_owned(),
            _ => {}
        }
        at = end;
    }
    let flown = flown.ok_or_else(|| ReadError::byte(at, "no trajectory"))?;
    Ok((flown, comment))
}

/// CRC-32, bit by bit: polynomial 0x04C11DB7 reflected, from 0, not inverted at the end; the bytes
/// of the checksum itself count as 0.
fn checksum(bytes: &[u8]) -> u32 {
    let mut rest = 0_u32;
    for (k, byte) in bytes.iter().enumerate() {
        rest ^= u32::from(if (6..10).contains(&k) { 0 } else { *byte });
        for _ in 0..8 {
            rest = rest >> 1 ^ if rest & 1 == 1 { 0xEDB8_8320 } else { 0 };
        }
    }
    rest
}
