//! Numbers checked in their own type, so that a reader points at the character at fault.

use serde::{Deserialize, Deserializer};

macro_rules! checked_number {
    ($(#[$doc:meta])* $name:ident, $holds:expr, $must_be:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
        #[serde(try_from = "f64")]
        pub struct $name(pub f64);

        impl TryFrom<f64> for $name {
            type Error = String;

            fn try_from(value: f64) -> Result<$name, String> {
                let holds: fn(f64) -> bool = $holds;
                if value.is_finite() && holds(value) {
                    Ok($name(value))
                } else {
                    Err(format!(concat!("{} is not ", $must_be), value))
                }
            }
        }
    };
}

checked_number!(
    /// A finite number.
    Finite, |_| true, "a finite number"
);
checked_number!(
    /// A finite number above 0.
    Positive, |value| value > 0.0, "a finite number above 0"
);
checked_number!(
    /// A finite number, 0 or more.
    NotNegative, |value| value >= 0.0, "a finite number, 0 or more"
);

/// Reads a plain number as [`NotNegative`].
pub(super) fn not_negative<'de, D: Deserializer<'de>>(reader: D) -> Result<f64, D::Error> {
    Ok(NotNegative::deserialize(reader)?.0)
}
