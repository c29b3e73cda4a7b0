//! Numbers as logs pack them, little-endian; types by the letters of Python's `struct`.

/// Bytes of a type, by its letter (Python's `struct`, without padding).
pub(super) fn size(letter: u8) -> Option<usize> {
    Some(match letter {
        b'c' | b'b' | b'B' | b'?' => 1,
        b'h' | b'H' | b'e' => 2,
        b'i' | b'I' | b'l' | b'L' | b'f' => 4,
        b'q' | b'Q' | b'd' => 8,
        _ => return None,
    })
}

/// A value of as many bytes as its letter has.
pub(super) fn value(letter: u8, raw: &[u8]) -> f64 {
    let mut bytes = [0; 8];
    bytes[..raw.len()].copy_from_slice(raw);
    let [b0, b1, b2, b3, ..] = bytes;
    let (two, four) = ([b0, b1], [b0, b1, b2, b3]);
    match letter {
        b'b' => i8::from_le_bytes([b0]).into(),
        b'h' => i16::from_le_bytes(two).into(),
        b'H' => u16::from_le_bytes(two).into(),
        b'e' => half(u16::from_le_bytes(two)),
        b'i' | b'l' => i32::from_le_bytes(four).into(),
        b'I' | b'L' => u32::from_le_bytes(four).into(),
        b'f' => f32::from_le_bytes(four).into(),
        b'q' => i64::from_le_bytes(bytes) as f64,
        b'Q' => u64::from_le_bytes(bytes) as f64,
        b'd' => f64::from_le_bytes(bytes),
        _ => b0.into(),
    }
}

/// Half precision (IEEE 754, binary16).
fn half(bits: u16) -> f64 {
    let sign = if bits >> 15 == 0 { 1.0 } else { -1.0 };
    let fraction = f64::from(bits & 0x3FF) / 1024.0;
    let exponent = i32::from(bits >> 10 & 0x1F);
    let size = match exponent {
        0 => fraction * 2_f64.powi(-14),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1.0 + fraction) * 2_f64.powi(exponent - 15),
    };
    sign * size
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_precision_is_read_as_ieee_754_has_it() {
        for (bits, is) in [
            (0x3C00, 1.0),
            (0xC000, -2.0),
            (0x0001, 2_f64.powi(-24)),
            (0x7BFF, 65504.0),
        ] {
            assert_eq!(half(bits), is);
        }
        assert_eq!(half(0x7C00), f64::INFINITY);
        assert!(half(0x7E00).is_nan());
    }
}
