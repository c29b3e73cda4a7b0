//! A campaign file (RON): what the logs of some flights leave unsaid, field by field as its user
//! writes it; every number checked in its own type, so that RON itself points at the character.

use std::fmt;
use std::marker::PhantomData;

use airflow::{Air, Airframe, GRAVITY_MPS2};
use serde::Deserialize;
use serde::de::{Deserializer, Error, MapAccess, Visitor};

use super::columns;
use super::conventions::{Acceleration, Frame, Pitch, Turns};
use super::declared::{Declared, baseline};
use super::found::{Found, did_you_mean, listed};
use super::plausible;
use crate::record::baseline::Baseline;
use crate::record::checked::{Finite, NotNegative, Positive};
use crate::record::problem::{Problem, Problems};
use crate::record::recording::Clock;
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
    pub clock: Option<Clock>,
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
    /// Flights whose vehicles wrote a log each, on clocks of their own: name of the flight, and of
    /// each vehicle its log without its ending: `{ "noon": { "q1": "log_7", "q2": "log_9" } }`.
    #[serde(default)]
    pub joined: Pairs<Pairs<String>>,
    /// Of logs that are joined and have no clock in common: when the first row of each was written,
    /// on one that they are given (s).
    #[serde(default)]
    pub starts_s: Pairs<Finite>,
    /// Ids of vehicles whose acceleration is not to be used.
    #[serde(default)]
    pub acceleration_unusable: Vec<String>,
}

impl Campaign {
    /// Reads a campaign from RON; `file` is what messages call it.
    ///
    /// ```
    /// let text = r#"(
    ///     name: "my flights",
    ///     acceleration: SpecificForceInBody,
    ///     types: { "courier": (
    ///         mass_kg: Stated(1.6), propeller_diameter_m: Stated(0.2), motor_distance_m: Inferred(0.45),
    ///     ) },
    ///     vehicles: { "c1": "courier", "c2": "courier" },
    /// )"#;
    /// let campaign = diagnosis::record::read::Campaign::parse("campaign.ron", text).unwrap();
    /// assert_eq!(campaign.vehicles.get("c2").unwrap(), "courier");
    /// ```
    ///
    /// # Errors
    /// The first thing that is no campaign, at its line; or, of one that is, everything that
    /// contradicts itself.
    pub fn parse(file: &str, text: &str) -> Result<Campaign, Problems> {
        let ron = ron::Options::default()
            .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
        let mut found = Found::default();
        match ron.from_str::<Campaign>(text) {
            Ok(campaign) => {
                campaign.check(file, text, &mut found);
                if found.problems.is_empty() {
                    return Ok(campaign);
                }
            }
            Err(error) => {
                let start = error.span.start;
                let message = format!("column {}: {}", start.col, said(&error.code));
                found.problem(Problem::file(file).line(start.line as u64), message);
            }
        }
        Err(Problems(found.problems))
    }

    /// One that knows no vehicle.
    pub(super) fn of_no_one() -> Campaign {
        Campaign {
            name: String::new(),
            source: String::new(),
            frame: Frame::default(),
            acceleration: None,
            quaternion: Turns::default(),
            pitch: None,
            clock: None,
            gravity_mps2: None,
            air: None,
            floor_z_m: None,
            ceiling_z_m: None,
            crash_tilt_deg: None,
            baseline: Declared::default(),
            columns: Pairs::default(),
            types: Pairs::default(),
            vehicles: Pairs::default(),
            joined: Pairs::default(),
            starts_s: Pairs::default(),
            acceleration_unusable: Vec::new(),
        }
    }

    /// What simulation means for its flights.
    #[must_use]
    pub fn baseline(&self) -> Baseline {
        // Checked while parsing.
        baseline("", &self.baseline, &mut Found::default())
    }

    /// Gravity (m/s²) of its flights.
    pub(super) fn gravity_mps2(&self) -> f64 {
        self.gravity_mps2.map_or(GRAVITY_MPS2, |gravity| gravity.0)
    }

    /// Temperature and pressure, where they are stated.
    pub(super) fn stated_air(&self) -> Option<Air> {
        self.air.map(|air| Air {
            temperature_c: air.temperature_c.0,
            pressure_pa: air.pressure_pa.0,
        })
    }

    /// Numbers that cannot be meant.
    fn doubt(&self, file: &str, text: &str, found: &mut Found) {
        let place = |field: &str| Problem {
            line: line_of(text, field),
            ..Problem::field(file, field)
        };
        if let Some(gravity) = self.gravity_mps2 {
            plausible::GRAVITY.holds(gravity.0, place("gravity_mps2"), found);
        }
        if let Some(air) = self.stated_air() {
            plausible::TEMPERATURE_C.holds(air.temperature_c, place("temperature_c"), found);
            plausible::PRESSURE.holds(air.pressure_pa, place("pressure_pa"), found);
        }
        for (name, of) in &self.types.0 {
            let airframe = Airframe::new(
                name,
                of.mass_kg.value().0,
                of.propellers,
                of.propeller_diameter_m.value().0,
                of.motor_distance_m.value().0,
                of.width_factor.0,
            );
            let place = |field: &str| Problem {
                line: line_of(text, &format!("\"{name}\"")),
                ..Problem::field(file, &format!("types.{name}.{field}"))
            };
            if let Ok(airframe) = airframe {
                plausible::airframe(&airframe, self.gravity_mps2(), place, found);
            }
        }
    }

    fn check(&self, file: &str, text: &str, found: &mut Found) {
        let mut at = |field: &str, word: &str, message: String, help: Option<String>| {
            let place = Problem {
                line: line_of(text, word),
                ..Problem::field(file, field)
            };
            found.helped(place, message, help);
        };
        if self.types.0.is_empty() {
            at("types", "types", "is empty".to_owned(), None);
        }
        if self.vehicles.0.is_empty() {
            at("vehicles", "vehicles", "is empty".to_owned(), None);
        }
        for (id, kind) in &self.vehicles.0 {
            if self.types.get(kind).is_none() {
                let known = || Some(format!("known are {}", listed(self.types.keys())));
                let help = did_you_mean(kind, self.types.keys()).or_else(known);
                let message = format!("\"{kind}\" of `{id}` is not among the types");
                at("vehicles", &format!("\"{id}\""), message, help);
            }
        }
        let joined = self.joined.0.iter().flat_map(|(flight, logs)| {
            let of = move |id| (flight, id);
            logs.keys().map(of)
        });
        for (flight, id) in joined {
            if self.vehicles.get(id).is_none() {
                let help = did_you_mean(id, self.vehicles.keys());
                let message = format!("\"{id}\" of `{flight}` is not among the vehicles");
                at("joined", &format!("\"{flight}\""), message, help);
            }
        }
        for id in &self.acceleration_unusable {
            if self.vehicles.get(id).is_none() {
                let help = did_you_mean(id, self.vehicles.keys());
                let message = format!("\"{id}\" is not among the vehicles");
                let field = "acceleration_unusable";
                at(field, field, message, help);
            }
        }
        let ours = columns::known_names();
        for (name, _) in &self.columns.0 {
            let is_vehicle = name == &ours[0];
            if !is_vehicle && columns::meaning(name).is_none() {
                let help = did_you_mean(name, ours.iter().map(String::as_str)).or_else(|| {
                    let known = listed(ours.iter().map(String::as_str));
                    Some(format!("known, with other units too, are {known}"))
                });
                let message =
                    format!("\"{name}\" is no name of ours, or has a unit that is not known");
                at("columns", &format!("\"{name}\""), message, help);
            }
        }
        for (name, of) in &self.types.0 {
            let mut at = |message: String| at("types", &format!("\"{name}\""), message, None);
            let map = of.thrust_map.as_ref();
            if let Some(problem) = map.and_then(|map| map.meaning().err()) {
                at(format!("thrust map of `{name}`: {problem}"));
            }
            for problem in Airframe::problems(
                of.mass_kg.value().0,
                of.propellers,
                of.propeller_diameter_m.value().0,
                of.motor_distance_m.value().0,
                of.width_factor.0,
            ) {
                at(format!("`{name}`: {problem}"));
            }
        }
        if let (Some(floor), Some(ceiling)) = (self.floor_z_m, self.ceiling_z_m)
            && ceiling.0 <= floor.0
        {
            let message = format!("is {}, not above the floor at {}", ceiling.0, floor.0);
            at("ceiling_z_m", "ceiling_z_m", message, None);
        }
        baseline(file, &self.baseline, found);
        self.doubt(file, text, found);
    }
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
    /// From duty cycle to thrust: kept but for an offset that is identified from the flights. Left
    /// out, all of it is.
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

/// Line (from 1) on which a word first stands.
fn line_of(text: &str, word: &str) -> Option<u64> {
    let before = &text[..text.find(word)?];
    u64::try_from(1 + before.matches('\n').count()).ok()
}

/// RON's own words, with the way out where it leaves one guessing.
fn said(code: &ron::error::Error) -> String {
    use ron::error::Error::{ExpectedNamedStructLike, InvalidIdentifier, SuggestRawIdentifier};
    match code {
        // A bare number where a word should stand.
        SuggestRawIdentifier(word) | InvalidIdentifier(word) if word.parse::<f64>().is_ok() => {
            format!(
                "{word} stands where a word should: write how the value is known, Stated({word}), Inferred({word}) or Assumed({word})"
            )
        }
        ExpectedNamedStructLike(_) => format!("{code}: write (key: value, ...)"),
        _ => code.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TYPES: &str = "types: {\"a\": (mass_kg: Stated(0.03), propeller_diameter_m: Inferred(0.046), motor_distance_m: Stated(0.09))}";

    fn said_of(text: &str) -> Vec<String> {
        let problems = Campaign::parse("c.ron", text).expect_err("is refused").0;
        problems
            .iter()
            .map(|problem| match &problem.help {
                Some(help) => format!("{problem}; {help}"),
                None => problem.to_string(),
            })
            .collect()
    }

    #[test]
    fn everything_that_contradicts_itself_is_said_at_once_with_its_line() {
        let text = format!(
            "(\nname: \"n\",\n{TYPES},\nvehicles: {{\"v\": \"aa\"}},\nacceleration_unusable: [\"w\"],\ncolumns: {{\"x_ft\": \"px\"}},\nfloor_z_m: 1, ceiling_z_m: 0.5,\nbaseline: (superposition: \"cubic\"),\n)"
        );
        let problems = said_of(&text);
        assert_eq!(problems.len(), 5, "{problems:#?}");
        assert_eq!(
            problems[0],
            "c.ron:4: `vehicles`: \"aa\" of `v` is not among the types; known are `a`"
        );
        assert!(
            problems[1]
                .starts_with("c.ron:5: `acceleration_unusable`: \"w\" is not among the vehicles")
        );
        assert!(problems[2].starts_with("c.ron:6: `columns`: \"x_ft\" is no name of ours"));
        assert_eq!(
            problems[3],
            "c.ron:7: `ceiling_z_m`: is 0.5, not above the floor at 1"
        );
        assert!(
            problems[4].starts_with("c.ron: `baseline.superposition`: is not known: \"cubic\"")
        );
    }

    #[test]
    fn ron_points_at_the_line_and_column() {
        for (text, said) in [
            (
                "(\nname: \"n\",\nnmae: 1)",
                "c.ron:3: column 1: Unexpected field named `nmae` in `Campaign`",
            ),
            (
                "(name: \"n\",\ngravity_mps2: -1)",
                "c.ron:2: column 15: -1 is not a finite number above 0",
            ),
            (
                "(name: \"n\",\ntypes: {\"a\": (mass_kg: 0.03)})",
                "c.ron:2: column 24: 0.03 stands where a word should: write how the value is known, Stated(0.03)",
            ),
            (
                "(name: \"n\",\nvehicles: {\"a\": \"b\",\n\"a\": \"c\"})",
                "c.ron:3: column 2: `a` is given twice",
            ),
        ] {
            let problems = said_of(text);
            assert!(problems[0].starts_with(said), "{problems:?}");
        }
    }
}
