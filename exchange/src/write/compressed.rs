//! Compressed pieces, as a Crazyflie and a Skybrush drone hold them: Bernstein coefficients in
//! whole millimetres, or multiples of them.
//!
//! The layout is that of `pptraj_compressed.c` in bitcraze/crazyflie-firmware and of
//! `src/trajectory/` in skybrush-io/libskybrush: start as four i16 (x, y, z, yaw); each piece a
//! byte of two bits an axis (0 constant, 1 straight, 2 cubic), the duration as u16 (ms), and 0, 1
//! or 3 coefficients an axis as i16, the first left out because it is the last end. Little-endian.

use nalgebra::Point3;

use crate::course::Course;

/// Bytes that fit into a Crazyflie (`TRAJECTORY_MEMORY_SIZE` in `crtp_commander_high_level.c`).
pub const MOST_BYTES: usize = 4096;
/// Pieces that a Crazyflie is told of: their number is a byte.
pub const MOST_PIECES: usize = 255;
/// The longest piece (s): 65 535 ms; below it, so that both roundings of its ends fit.
const LONGEST_S: f64 = 65.5;
/// Largest coordinate (units).
const LARGEST: f64 = 32_767.0;

/// Pieces as bytes, and how many they are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Compressed {
    /// Start and pieces, without anything after the last.
    pub bytes: Vec<u8>,
    /// Pieces.
    pub pieces: usize,
}

/// A coordinate that a file cannot hold (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutOfRange {
    /// The farthest from 0 (m).
    pub reached_m: f64,
    /// What fits, both ways (m).
    pub most_m: f64,
}

/// The coordinate farthest from 0 of a course or its control points (m).
#[must_use]
pub fn farthest_m(course: &Course) -> f64 {
    let points_m = course.pieces.iter().flat_map(|it| it.points_m);
    let farthest = points_m.map(|at: Point3<f64>| at.coords.amax());
    farthest.fold(0.0, f64::max)
}

/// A course in units of so many millimetres; yaw is 0 throughout.
///
/// # Errors
///
/// A coordinate is out of range.
pub fn pieces(course: &Course, unit_mm: u32) -> Result<Compressed, OutOfRange> {
    let per_m = 1000.0 / f64::from(unit_mm);
    let reached_m = farthest_m(course);
    if (reached_m * per_m).round() > LARGEST {
        return Err(OutOfRange {
            reached_m,
            most_m: LARGEST / per_m,
        });
    }
    let units = |at: Point3<f64>| [at.x, at.y, at.z].map(|m| (m * per_m).round() as i16);
    let ms = |t_s: f64| (t_s * 1000.0).round() as u64;
    let mut now = units(course.start_m());
    let mut bytes: Vec<u8> = Vec::new();
    for value in now {
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend(0_i16.to_le_bytes());
    let mut count = 0;
    let parts = course.pieces.iter().flat_map(|it| it.parts(LONGEST_S));
    for piece in parts {
        // Times are rounded from 0, so that no error adds up.
        let duration_ms = ms(piece.until_s) - ms(piece.from_s);
        if duration_ms == 0 {
            continue;
        }
        let duration_ms = u16::try_from(duration_ms).expect("LONGEST_S is below 65.535 s");
        let [_, b, c, end] = piece.points_m.map(units);
        let mut types = 0;
        let mut body = Vec::new();
        for axis in 0..3 {
            let is_constant = now[axis] == end[axis]
                && (piece.is_straight || (b[axis] == end[axis] && c[axis] == end[axis]));
            let (kind, coefficients) = match (is_constant, piece.is_straight) {
                (true, _) => (0, &[][..]),
                (false, true) => (1, &[end[axis]][..]),
                (false, false) => (2, &[b[axis], c[axis], end[axis]][..]),
            };
            types |= kind << (2 * axis);
            for coefficient in coefficients {
                body.extend(coefficient.to_le_bytes());
            }
        }
        bytes.push(types);
        bytes.extend(duration_ms.to_le_bytes());
        bytes.extend(body);
        now = end;
        count += 1;
    }
    Ok(Compressed {
        bytes,
        pieces: count,
    })
}

/// What a Crazyflie is uploaded: millimetres, and a piece of no duration at the end.
///
/// # Errors
///
/// A coordinate is out of range.
pub fn crazyflie(course: &Course) -> Result<Compressed, OutOfRange> {
    let mut compressed = pieces(course, 1)?;
    compressed.bytes.extend([0; 3]);
    Ok(compressed)
}
