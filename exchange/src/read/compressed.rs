//! Compressed pieces of a Crazyflie or a `.skyb`: Bernstein coefficients of degree 0, 1, 3 or 7.

use super::ReadError;
use crate::flown::{Flown, Span, powers};

/// Takes little-endian numbers off bytes, and knows where it is.
struct Cursor<'b> {
    bytes: &'b [u8],
    at: usize,
}

impl Cursor<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        let taken = self.bytes.get(self.at..).and_then(<[u8]>::first_chunk::<N>);
        let Some(taken) = taken else {
            return Err(ReadError::byte(self.bytes.len(), "ends within a piece"));
        };
        self.at += N;
        Ok(*taken)
    }

    fn coordinate(&mut self) -> Result<f64, ReadError> {
        self.take().map(|it| f64::from(i16::from_le_bytes(it)))
    }
}

/// One drone from bytes in units of so many metres, up to a piece of no duration or the end.
///
/// # Errors
///
/// They end within a piece, or say more after the last.
pub fn read(bytes: &[u8], unit_m: f64) -> Result<Flown, ReadError> {
    let mut cursor = Cursor { bytes, at: 0 };
    // x, y, z; yaw in a tenth of a degree.
    let mut now = [0.0; 4];
    for axis in &mut now {
        *axis = cursor.coordinate()?;
    }
    let mut flown = Flown::default();
    let mut now_ms: u64 = 0;
    while cursor.at < bytes.len() {
        let [types] = cursor.take()?;
        let duration_ms = u16::from_le_bytes(cursor.take()?);
        if duration_ms == 0 {
            if cursor.at != bytes.len() {
                return Err(ReadError::byte(cursor.at, "more after the last piece"));
            }
            break;
        }
        let duration_s = f64::from(duration_ms) / 1000.0;
        let mut axes: [Vec<f64>; 4] = Default::default();
        for (k, axis) in axes.iter_mut().enumerate() {
            let mut bernstein = vec![now[k]];
            for _ in 0..[0, 1, 3, 7][usize::from(types >> (2 * k) & 3)] {
                bernstein.push(cursor.coordinate()?);
            }
            now[k] = bernstein.last().copied().unwrap_or_default();
            bernstein.iter_mut().for_each(|it| *it *= unit_m);
            *axis = powers(&bernstein, duration_s);
        }
        let [x, y, z, _] = axes;
        flown.spans.push(Span {
            from_s: now_ms as f64 / 1000.0,
            until_s: (now_ms + u64::from(duration_ms)) as f64 / 1000.0,
            axes: [x, y, z],
        });
        now_ms += u64::from(duration_ms);
    }
    Ok(flown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_of_each_degree_is_read_and_a_cut_one_is_refused_where_it_ends() {
        let mut bytes = Vec::new();
        let put = |bytes: &mut Vec<u8>, values: &[i16]| {
            values.iter().for_each(|it| bytes.extend(it.to_le_bytes()));
        };
        put(&mut bytes, &[1000, -2000, 500, 0]);
        // x straight, y cubic, z of degree 7, yaw constant; 2 s.
        bytes.extend([0b00_11_10_01, 0xD0, 0x07]);
        put(&mut bytes, &[2000, -2000, -1000, -1000]);
        put(&mut bytes, &[500, 500, 500, 1500, 1500, 1500, 1500]);
        bytes.extend([0; 3]);
        let flown = read(&bytes, 0.001).expect("reads");
        let at = |t_s| flown.at_m(t_s).expect("has spans");
        assert!((at(0.0) - nalgebra::Point3::new(1.0, -2.0, 0.5)).norm() < 1e-12);
        assert!((at(1.0) - nalgebra::Point3::new(1.5, -1.5, 1.0)).norm() < 1e-9);
        assert!((at(9.0) - nalgebra::Point3::new(2.0, -1.0, 1.5)).norm() < 1e-9);
        let cut = read(&bytes[..20], 0.001).expect_err("it is cut");
        assert_eq!(cut.to_string(), "byte 20: ends within a piece");
        bytes.push(7);
        let more = read(&bytes, 0.001).expect_err("there is more");
        assert_eq!(more.to_string(), "byte 36: more after the last piece");
    }
}
