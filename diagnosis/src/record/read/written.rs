//! What a campaign file may hold, field by field, as its user writes it (RON). Every number is
//! checked in its own type, so that RON itself points at the character.

use std::fmt;
use std::marker::PhantomData;

use serde::Deserialize;
use serde::de::{Deserializer, Error, MapAccess, Visitor};

use super::declared::Declared;
use super::track::{Acceleration, Frame, Pitch, Turns};
use crate::record::recording::Origin;
use crate::record::thrust_map::{Term, ThrustMap, ThrustMapError};

/// A campaign: what the logs of some flights leave unsaid. All flights beside the file are read
/// with it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Campaign {
    /// What reports call it.
    pub name: String,
    /// Where the flights come from and under which licence; printed, not read.
    #[serde(default)]
    pub source: String,
    /// Frame of the logged positions and attitude: `ZUp` (default) or `NorthEastDown`.
    #[serde(default)]
    pub frame: Frame,
    /// What `ax ay az` are; needed if they are there. Their unit ends their names (`ax_mps2`,
    /// `ax_g`).
    #[serde(default)]
    pub acceleration: Option<Acceleration>,
    /// Which way `qx qy qz qw` turn: `BodyToWorld` (default) or `WorldToBody`. Their order is that
    /// of the columns' names.
    #[serde(default)]
    pub quaternion: Turns,
    /// Sign of a logged pitch: right-handed in the logs' frame unless this says `NoseUp` or
    /// `NoseDown`.
    #[serde(default)]
    pub pitch: Option<Pitch>,
    /// Clocks of the vehicles: `Shared`, or `Own(within_s: 0.03)`. Left out, shared is assumed, and
    /// a remark says so.
    #[serde(default)]
    pub clock: Option<WrittenClock>,
    /// Gravity (m/s²); default 9.81. Also what `ax_g` is in.
    #[serde(default)]
    pub gravity_mps2: Option<Positive>,
    /// Temperature and pressure. Left out, 20 °C at sea level is assumed, and a remark says so.
    #[serde(default)]
    pub air: Option<WrittenAir>,
    /// Height of the floor (m) in the logs' frame with z up. Left out: no floor.
    #[serde(default)]
    pub floor_z_m: Option<Finite>,
    /// Height of the ceiling (m). Left out: none.
    #[serde(default)]
    pub ceiling_z_m: Option<Finite>,
    /// Tilt (deg) that is a crash: the flight of that vehicle is cut half a second before. Default
    /// 45.
    #[serde(default)]
    pub crash_tilt_deg: Option<Positive>,
    /// What "simulation" means; what is left out is the planner's own air.
    #[serde(default)]
    pub baseline: Declared,
    /// Our name of a column, with its unit, and the logs' name for it: `{ "x_mm": "stateEstimate.x"
    /// }`. Columns that have our names need no entry.
    #[serde(default)]
    pub columns: Pairs<String>,
    /// Kinds of vehicles.
    pub types: Pairs<VehicleType>,
    /// Id in the logs and type of every vehicle. With one entry, logs need no column `vehicle`.
    pub vehicles: Pairs<String>,
    /// Ids of vehicles whose acceleration is not to be used.
    #[serde(default)]
    pub acceleration_unusable: Vec<String>,
}

/// One kind of vehicle.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VehicleType {
    /// Mass (kg) as flown.
    pub mass_kg: Sourced<Positive>,
    /// Propellers; default 4.
    #[serde(default = "four")]
    pub propellers: u32,
    /// Propeller diameter (m).
    pub propeller_diameter_m: Sourced<Positive>,
    /// Motor distance (m): the diagonal from motor to motor.
    pub motor_distance_m: Sourced<Positive>,
    /// Width of its jet over that of the paper's fit; default 1, for propellers that are not
    /// canted.
    #[serde(default = "one")]
    pub width_factor: Positive,
    /// From the logged point to the centre of the rotor plane, in the body: x forward, y left, z up
    /// (m). Left out, 0 is assumed, and a remark says so.
    #[serde(default)]
    pub rotor_offset_m: Option<Sourced<[Finite; 3]>>,
    /// Logged height (m, z up) below which it stands on the floor or touches it: such rows are cut.
    /// Left out: never.
    #[serde(default)]
    pub touch_z_m: Option<Finite>,
    /// From duty cycle to thrust. Left out, it is identified from the flights.
    #[serde(default)]
    pub thrust_map: Option<WrittenThrustMap>,
}

/// Thrust of one motor (N): sum of terms `c u^i v^j` with duty cycle `u`, battery voltage over the
/// reference `v`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrittenThrustMap {
    /// Its terms.
    pub terms: Vec<WrittenTerm>,
    /// What the battery voltage is divided by (V).
    pub battery_reference_v: Positive,
    /// Time constant (s) of the motors; 0: none.
    pub lag_s: NotNegative,
    /// Duty cycles that it was fitted in; rows outside are reported.
    pub duty_range: [NotNegative; 2],
}

/// One term of a thrust map.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrittenTerm {
    /// Power of the duty cycle.
    #[serde(default)]
    pub duty_power: u8,
    /// Power of the battery voltage over the reference.
    #[serde(default)]
    pub battery_power: u8,
    /// Its coefficient.
    pub thrust: WrittenForce,
}

/// A force with its unit.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub enum WrittenForce {
    /// Newton.
    Newtons(Finite),
    /// Weight of a gram in standard gravity, 0.00980665 N.
    GramForce(Finite),
}

/// Clocks of the vehicles of one flight.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub enum WrittenClock {
    /// One for all.
    Shared,
    /// One each.
    Own {
        /// Unknown within plus or minus so many seconds.
        within_s: NotNegative,
    },
}

/// Temperature and pressure.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrittenAir {
    /// Temperature (°C).
    pub temperature_c: Finite,
    /// Absolute pressure (Pa); default 101 325.
    #[serde(default = "sea_level")]
    pub pressure_pa: Positive,
}

/// A value with how it is known.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub enum Sourced<T> {
    /// The source states it.
    Stated(T),
    /// Worked out from something that the source states.
    Inferred(T),
    /// Taken for lack of better.
    Assumed(T),
}

impl<T: Copy> Sourced<T> {
    /// The value.
    pub fn value(&self) -> T {
        match *self {
            Sourced::Stated(value) | Sourced::Inferred(value) | Sourced::Assumed(value) => value,
        }
    }

    /// How it is known.
    pub fn origin(&self) -> Origin {
        match self {
            Sourced::Stated(_) => Origin::Stated,
            Sourced::Inferred(_) => Origin::Inferred,
            Sourced::Assumed(_) => Origin::Assumed,
        }
    }
}

impl WrittenForce {
    /// In newtons.
    pub fn newtons(self) -> f64 {
        match self {
            WrittenForce::Newtons(newtons) => newtons.0,
            WrittenForce::GramForce(grams) => grams.0 * 9.806_65e-3,
        }
    }
}

impl WrittenThrustMap {
    /// As the rest of the crate uses it.
    ///
    /// # Errors
    /// What keeps the numbers from being a map.
    pub fn meaning(&self) -> Result<ThrustMap, ThrustMapError> {
        let term = |of: &WrittenTerm| {
            let term = Term::new(of.duty_power, of.battery_power);
            (term, of.thrust.newtons())
        };
        ThrustMap::new(
            self.terms.iter().map(term).collect(),
            self.battery_reference_v.0,
            self.lag_s.0,
            self.duty_range.map(|duty| duty.0),
        )
    }
}

fn four() -> u32 {
    4
}

fn one() -> Positive {
    Positive(1.0)
}

fn sea_level() -> Positive {
    Positive(101_325.0)
}

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

/// A map in the order of the file; a key given twice is an error.
#[derive(Clone, Debug, PartialEq)]
pub struct Pairs<T>(pub Vec<(String, T)>);

impl<T> Default for Pairs<T> {
    fn default() -> Pairs<T> {
        Pairs(Vec::new())
    }
}

impl<T> Pairs<T> {
    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&T> {
        let pair = self.0.iter().find(|(known, _)| known == key);
        pair.map(|(_, value)| value)
    }

    /// The keys in their order.
    pub fn keys(&self) -> impl Iterator<Item = &str> + Clone {
        self.0.iter().map(|(key, _)| key.as_str())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Pairs<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Pairs<T>, D::Error> {
        struct Reader<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Reader<T> {
            type Value = Pairs<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map `{ \"name\": value, ... }`")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Pairs<T>, A::Error> {
                let mut pairs = Pairs::default();
                while let Some(key) = map.next_key::<String>()? {
                    if pairs.get(&key).is_some() {
                        return Err(A::Error::custom(format!("`{key}` is given twice")));
                    }
                    let value = map.next_value()?;
                    pairs.0.push((key, value));
                }
                Ok(pairs)
            }
        }

        deserializer.deserialize_map(Reader(PhantomData))
    }
}
