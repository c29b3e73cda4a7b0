//! What "simulation" means, from the words of the metadata: every word known, or refused with those
//! that are.

use airflow::Superposition;
use serde::Deserialize;

use super::found::{Found, listed};
use crate::record::baseline::{Baseline, Delay, Observation, ReceiverAir, ReceiverLaw, Upper};
use crate::record::problem::Problem;

/// The `baseline` of the metadata, in words; the same in JSON and RON.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Declared {
    /// How wakes add up: `momentum_sum`, `linear_sum`, `strongest`, or `none` (each drone flies
    /// alone).
    pub superposition: Option<String>,
    /// `none`, or `transport`: air arrives as late as the jet carries it.
    pub emitter_delay: Option<String>,
    /// With `transport`: convection speed over that of the centreline; 1 if it is not given.
    pub convection: Option<f64>,
    /// Above 2.5 motor distances: `four_rotors` or `far_field_extrapolated`.
    pub near_field: Option<String>,
    /// `disc_mean` or `centre`.
    pub receiver_air: Option<String>,
    /// `throttle = sqrt(beta)`, `throttle = beta^0.4`, `power = beta`, or `thrust at constant
    /// power`.
    pub receiver_law: Option<String>,
    /// `sqrt(U_axial^2 + ambient^2)` or `sqrt(U_axial^2 + V^2 + ambient^2)`.
    pub observation: Option<String>,
}

use Observation::{AxialAndAmbient, VelocityAndAmbient};

/// Words and what they mean.
type Words<T> = &'static [(&'static str, T)];

const SUPERPOSITIONS: Words<Option<Superposition>> = &[
    ("momentum_sum", Some(Superposition::Momentum)),
    ("momentum", Some(Superposition::Momentum)),
    ("linear_sum", Some(Superposition::Linear)),
    ("linear", Some(Superposition::Linear)),
    ("strongest", Some(Superposition::Strongest)),
    ("none", None),
];
const DELAYS: Words<bool> = &[("none", false), ("transport", true)];
const UPPERS: Words<Upper> = &[
    ("four_rotors", Upper::FourRotors),
    ("far_field_extrapolated", Upper::FarFieldExtrapolated),
];
const RECEIVER_AIRS: Words<ReceiverAir> = &[
    ("disc_mean", ReceiverAir::DiscMean),
    ("centre", ReceiverAir::Centre),
    ("center", ReceiverAir::Centre),
];
const OBSERVATIONS: Words<Observation> = &[
    ("sqrt(U_axial^2 + ambient^2)", AxialAndAmbient),
    ("sqrt(U_axial^2 + V^2 + ambient^2)", VelocityAndAmbient),
    (
        "sqrt(U_axial^2 + V_radial^2 + ambient^2)",
        VelocityAndAmbient,
    ),
];
/// The paper's square root. The power law alone says nothing of the throttle: it is taken for it.
const SQUARE_ROOT: ReceiverLaw = ReceiverLaw::HoldsThrust { exponent: 0.5 };
const LINEAR: ReceiverLaw = ReceiverLaw::HoldsThrust { exponent: 1.0 };
const RECEIVER_LAWS: Words<ReceiverLaw> = &[
    ("throttle = sqrt(beta)", SQUARE_ROOT),
    ("power = beta", SQUARE_ROOT),
    ("throttle = beta", LINEAR),
    ("thrust at constant power", ReceiverLaw::HoldsPower),
];
/// Before the exponent of a law of any power.
const POWER_LAW: &str = "throttle=beta^";

/// The baseline that is declared; what is left open stays as by default.
pub(super) fn baseline(file: &str, declared: &Declared, found: &mut Found) -> Baseline {
    let mut baseline = Baseline::default();
    let mut words = Spoken { file, found };
    let said = &declared.superposition;
    if let Some(sum) = words.word("superposition", said, SUPERPOSITIONS) {
        baseline.wakes = sum.is_some();
        baseline.superposition = sum.unwrap_or(baseline.superposition);
    }
    let delay = words.word("emitter_delay", &declared.emitter_delay, DELAYS);
    let convection = declared.convection.unwrap_or(1.0);
    let mut refuse = |message: String| {
        let place = Problem::field(file, "baseline.convection");
        words.found.problem(place, message);
    };
    if delay == Some(true) {
        baseline.delay = Delay::Transport { convection };
        if !(convection.is_finite() && convection > 0.0) {
            refuse(format!("is {convection}; it must be finite and above 0"));
        }
    } else if declared.convection.is_some() {
        refuse("means nothing unless `emitter_delay` is `transport`".to_owned());
    }
    let said = &declared.near_field;
    words.set(&mut baseline.upper, "near_field", said, UPPERS);
    let said = &declared.receiver_air;
    let air = &mut baseline.receiver_air;
    words.set(air, "receiver_air", said, RECEIVER_AIRS);
    if let Some(law) = words.receiver_law(&declared.receiver_law) {
        baseline.receiver_law = law;
    }
    let said = &declared.observation;
    words.set(&mut baseline.observation, "observation", said, OBSERVATIONS);
    baseline
}

struct Spoken<'a> {
    file: &'a str,
    found: &'a mut Found,
}

impl Spoken<'_> {
    fn word<T: Copy>(&mut self, key: &str, said: &Option<String>, words: Words<T>) -> Option<T> {
        let said = said.as_deref()?;
        let meant = words.iter().find(|(word, _)| plain(word) == plain(said));
        if meant.is_none() {
            let known = listed(words.iter().map(|(word, _)| *word));
            self.unknown(key, said, &known);
        }
        meant.map(|(_, meaning)| *meaning)
    }

    fn set<T: Copy>(&mut self, to: &mut T, key: &str, said: &Option<String>, words: Words<T>) {
        *to = self.word(key, said, words).unwrap_or(*to);
    }

    fn receiver_law(&mut self, said: &Option<String>) -> Option<ReceiverLaw> {
        let law = plain(said.as_deref()?);
        let Some(exponent) = law.strip_prefix(POWER_LAW) else {
            return self.word("receiver_law", said, RECEIVER_LAWS);
        };
        let exponent = exponent.trim_matches(['(', ')']).parse::<f64>().ok();
        let exponent = exponent.filter(|exponent| exponent.is_finite() && *exponent >= 0.0);
        if exponent.is_none() {
            let known = "`throttle = beta^` and a number, 0 or more";
            self.unknown("receiver_law", &law, known);
        }
        Some(ReceiverLaw::HoldsThrust {
            exponent: exponent?,
        })
    }

    fn unknown(&mut self, key: &str, said: &str, known: &str) {
        let field = format!("baseline.{key}");
        self.found.helped(
            Problem::field(self.file, &field),
            format!("is not known: \"{said}\""),
            Some(format!("known are {known}")),
        );
    }
}

/// Without blanks and capitals, which carry no meaning here.
fn plain(word: &str) -> String {
    word.chars()
        .filter(|letter| !letter.is_whitespace())
        .flat_map(char::to_lowercase)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(word: &str) -> Option<String> {
        Some(word.to_owned())
    }

    #[test]
    fn every_word_of_the_practice_recordings_is_understood() {
        let declared = Declared {
            superposition: said("linear_sum"),
            emitter_delay: said("none"),
            near_field: said("far_field_extrapolated"),
            receiver_air: said("centre"),
            receiver_law: said("throttle = sqrt(beta)"),
            observation: said("sqrt(U_axial^2 + ambient^2)"),
            convection: None,
        };
        let mut found = Found::default();
        let read = baseline("meta.json", &declared, &mut found);
        assert!(found.problems.is_empty());
        let meant = Baseline {
            wakes: true,
            superposition: Superposition::Linear,
            delay: Delay::None,
            upper: Upper::FarFieldExtrapolated,
            receiver_air: ReceiverAir::Centre,
            receiver_law: ReceiverLaw::HoldsThrust { exponent: 0.5 },
            observation: Observation::AxialAndAmbient,
        };
        assert_eq!(read, meant);
    }

    #[test]
    fn laws_of_any_power_and_delays_with_their_factor_are_understood() {
        let declared = Declared {
            superposition: said("none"),
            emitter_delay: said("transport"),
            convection: Some(0.6),
            receiver_law: said("throttle = beta^0.4"),
            ..Declared::default()
        };
        let mut found = Found::default();
        let read = baseline("meta.json", &declared, &mut found);
        assert!(found.problems.is_empty());
        assert!(!read.wakes);
        assert_eq!(read.delay, Delay::Transport { convection: 0.6 });
        assert_eq!(
            read.receiver_law,
            ReceiverLaw::HoldsThrust { exponent: 0.4 }
        );
    }

    #[test]
    fn unknown_words_are_errors_that_name_the_known_ones_all_at_once() {
        let declared = Declared {
            superposition: said("quadratic"),
            convection: Some(0.6),
            receiver_law: said("throttle = beta^x"),
            ..Declared::default()
        };
        let mut found = Found::default();
        baseline("meta.json", &declared, &mut found);
        let words: Vec<String> = found.problems.iter().map(ToString::to_string).collect();
        assert_eq!(
            words,
            [
                "meta.json: `baseline.superposition`: is not known: \"quadratic\"",
                "meta.json: `baseline.convection`: means nothing unless `emitter_delay` is `transport`",
                "meta.json: `baseline.receiver_law`: is not known: \"throttle=beta^x\"",
            ]
        );
        let help = found.problems[0].help.as_deref().expect("a way out");
        assert!(help.contains("`linear_sum`") && help.contains("`momentum_sum`"));
    }
}
