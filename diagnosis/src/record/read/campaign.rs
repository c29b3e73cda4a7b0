//! A campaign file: read, and checked against itself.

use airflow::Airframe;

use super::columns;
use super::declared::baseline;
use super::found::{Found, Place, did_you_mean, listed};
use super::written::Campaign;
use crate::record::baseline::Baseline;
use crate::record::problem::Problems;

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
        let mut found = Found::default();
        let ron = ron::Options::default()
            .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
        let campaign = match ron.from_str::<Campaign>(text) {
            Ok(campaign) => Some(campaign),
            Err(error) => {
                let line = u64::try_from(error.span.start.line).unwrap_or(0);
                let column = error.span.start.col;
                let message = format!("column {column}: {}", said(&error.code));
                found.problem(Place::file(file).line(line), message);
                None
            }
        };
        if let Some(campaign) = &campaign {
            campaign.check(file, text, &mut found);
        }
        found.into_result(campaign).map(|(campaign, _)| campaign)
    }

    /// What simulation means for its flights.
    #[must_use]
    pub fn baseline(&self) -> Baseline {
        // Checked while parsing.
        baseline("", &self.baseline, &mut Found::default())
    }

    fn check(&self, file: &str, text: &str, found: &mut Found) {
        let mut at = |field: &str, word: &str, message: String, help: Option<String>| {
            let place = Place {
                file,
                line: line_of(text, word),
                field: Some(field),
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
                let help = did_you_mean(kind, self.types.keys())
                    .or_else(|| Some(format!("known are {}", listed(self.types.keys()))));
                let message = format!("\"{kind}\" of `{id}` is not among the types");
                at("vehicles", &format!("\"{id}\""), message, help);
            }
        }
        for id in &self.acceleration_unusable {
            if self.vehicles.get(id).is_none() {
                let help = did_you_mean(id, self.vehicles.keys());
                let message = format!("\"{id}\" is not among the vehicles");
                at(
                    "acceleration_unusable",
                    "acceleration_unusable",
                    message,
                    help,
                );
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
            let problems = Airframe::problems(
                of.mass_kg.value().0,
                of.propellers,
                of.propeller_diameter_m.value().0,
                of.motor_distance_m.value().0,
                of.width_factor.0,
            );
            let map = of.thrust_map.as_ref();
            if let Some(problem) = map.and_then(|map| map.meaning().err()) {
                let message = format!("thrust map of `{name}`: {problem}");
                at("types", &format!("\"{name}\""), message, None);
            }
            for problem in problems {
                at(
                    "types",
                    &format!("\"{name}\""),
                    format!("`{name}`: {problem}"),
                    None,
                );
            }
        }
        if let (Some(floor), Some(ceiling)) = (self.floor_z_m, self.ceiling_z_m)
            && ceiling.0 <= floor.0
        {
            let message = format!("is {}, not above the floor at {}", ceiling.0, floor.0);
            at("ceiling_z_m", "ceiling_z_m", message, None);
        }
        baseline(file, &self.baseline, found);
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
