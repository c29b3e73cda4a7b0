//! A file of parameters: vehicles by airframe, gains of both controllers.

use std::collections::{BTreeMap, BTreeSet};

use airflow::Airframe;
use schemars::JsonSchema;
use serde::Deserialize;
use thiserror::Error;

use crate::controller::{Controller, Gains, PX4, RESEARCH};
use crate::vehicle::VehicleEntry;

/// What flies, and how it is controlled; omitted keys keep their defaults.
///
/// ```
/// let setup = flight::Setup::read(r#"(
///     airframes: {"kolibri": (thrust_to_weight: 3.5, motor_lag_s: 0.03)},
///     others: (max_tilt_deg: 25, rotor: Power),
///     px4: (position_per_s: (0.95, 1), velocity_per_s: (1.8, 4), integral_per_s2: (0.4, 2), damping: (0.2, 0)),
/// )"#)?;
/// assert_eq!(setup.entry("kolibri").max_tilt_deg, Some(25.0));
/// # Ok::<(), flight::SetupError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, rename = "Setup")]
pub struct Setup {
    /// By the name of an airframe.
    pub airframes: BTreeMap<String, VehicleEntry>,
    /// Of every airframe, where it is not said for its own.
    pub others: VehicleEntry,
    /// Gains of `px4`.
    pub px4: Option<Gains>,
    /// Gains of `research`.
    pub research: Option<Gains>,
}

/// Why a text is no file of parameters.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SetupError {
    /// Not RON, or a key that is unknown or of another kind.
    #[error("line {line}, column {column}: {what}")]
    Text {
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// What is wrong.
        what: String,
    },
    /// Values out of range, all of them.
    #[error("{}", .0.join("; "))]
    Values(Vec<String>),
}

impl Setup {
    /// Reads a file's text (RON).
    ///
    /// # Errors
    /// The first thing that is no RON or no key, with its place; else every value out of range.
    pub fn read(text: &str) -> Result<Setup, SetupError> {
        let options = ron::Options::default()
            .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
        let setup: Setup = options.from_str(text).map_err(|error| SetupError::Text {
            line: error.span.start.line,
            column: error.span.start.col,
            what: error.code.to_string(),
        })?;
        let of = |key: String, problems: Vec<String>| {
            problems.into_iter().map(move |it| format!("{key}: {it}"))
        };
        let airframes = setup.airframes.iter();
        let mut problems: Vec<String> = airframes
            .flat_map(|(name, entry)| of(format!("airframes, \"{name}\""), entry.problems()))
            .collect();
        problems.extend(of("others".to_owned(), setup.others.problems()));
        for (key, gains) in [("px4", &setup.px4), ("research", &setup.research)] {
            let found = gains.map(|it| it.problems());
            problems.extend(of(key.to_owned(), found.unwrap_or_default()));
        }
        match problems.is_empty() {
            true => Ok(setup),
            false => Err(SetupError::Values(problems)),
        }
    }

    /// What it says of an airframe.
    #[must_use]
    pub fn entry(&self, airframe: &str) -> VehicleEntry {
        match self.airframes.get(airframe) {
            Some(entry) => entry.or(&self.others),
            None => self.others.clone(),
        }
    }

    /// Airframes that it names and that neither these are nor any preset: misspelt, mostly.
    #[must_use]
    pub fn unknown<'a>(&'a self, flown: &BTreeSet<&str>) -> Vec<&'a str> {
        let names = self.airframes.keys().map(String::as_str);
        names
            .filter(|name| !flown.contains(name) && !Airframe::PRESETS.contains(name))
            .collect()
    }

    /// Gains of a controller.
    #[must_use]
    pub fn gains(&self, controller: Controller) -> Gains {
        match controller {
            Controller::Px4 => self.px4.unwrap_or(PX4),
            Controller::Research => self.research.unwrap_or(RESEARCH),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_is_reported_with_its_place_and_all_at_once() {
        let unknown = Setup::read("(\n  others: (thrust: 2),\n)").expect_err("unknown");
        assert!(
            unknown.to_string().starts_with("line 2, column"),
            "{unknown}"
        );
        assert!(unknown.to_string().contains("thrust"), "{unknown}");
        let text = r#"(airframes: {"k": (thrust_to_weight: 0.5, rotor: Blade(kappa: -1))},
            px4: (position_per_s: (-1, 1), velocity_per_s: (1, 1), integral_per_s2: (0, 0), damping: (0, 0)))"#;
        let Err(SetupError::Values(values)) = Setup::read(text) else {
            panic!("out of range");
        };
        assert_eq!(values.len(), 3, "{values:?}");
        assert!(values[0].starts_with(r#"airframes, "k": thrust_to_weight is 0.5"#));
        assert_eq!(Setup::read("()"), Ok(Setup::default()));
    }

    #[test]
    fn names_that_are_neither_flown_nor_presets_are_unknown() {
        let text = r#"(airframes: {"kolibry": (), "kolibri": (), "own": ()})"#;
        let setup = Setup::read(text).expect("in order");
        assert_eq!(setup.unknown(&BTreeSet::from(["own"])), ["kolibry"]);
    }
}
