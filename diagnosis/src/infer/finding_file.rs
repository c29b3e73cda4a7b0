//! The text of `finding.ron`: what a scenario cites to fly through the corrected air.

use std::fmt::Write as _;

use serde::Serialize;
use serde_json::Value;

use crate::forward::hypothesis::Sensor;
use crate::infer::candidates::Kind;
use crate::infer::finding::{Effect, Finding};

/// A finding as RON that a scenario cites: `air: (finding: "finding.ron")`.
///
/// ```text
/// Finding(
///     effects: (crossflow: (wind_mps: (0.38, 0.27))),   airflow::effects::Effects; all that is flown
///     sensor: (gain: 0.1),                              faults of instruments: never flown
///     ...                                               what else is known
/// )
/// ```
///
/// Only what was named is written, and only finite numbers: a payload without `since_s` was there
/// from the beginning. An effect of the air that an instrument would explain as well stands behind
/// the instrument, and is not flown.
#[must_use]
pub fn finding_ron(finding: &Finding) -> String {
    let mut text = String::from(
        "// What is missing in the simulation of a recording, as diagnosed.\n\
         // A scenario flies through the corrected air: air: (finding: \"finding.ron\")\n\
         Finding(\n",
    );
    // Rust and RON escape a text alike. Writing to a String cannot fail.
    let _ = writeln!(text, "    recordings: [{:?}],", finding.recording);
    let _ = writeln!(text, "    verdict: {},", finding.verdict.as_str());
    let _ = writeln!(
        text,
        "    // Of the air and of the drones in it: this is flown."
    );
    let flown = |name: &str| {
        let named = |effect: &Effect| effect.name == name && effect.kind == Some(Kind::Physics);
        finding.effects.iter().any(named)
    };
    let effects = entries(&finding.correction.effects, |name, _| flown(name));
    let _ = writeln!(text, "    effects: {},", ron(&effects, 1));
    let neutral = serde_json::to_value(Sensor::default()).unwrap_or_default();
    let sensor = entries(&finding.correction.sensor, |name, value| {
        neutral.get(name) != Some(value)
    });
    let _ = writeln!(
        text,
        "    // Of the instruments: this is not.\n    sensor: {},",
        ron(&sensor, 1)
    );
    let _ = writeln!(text, "    named: [");
    for effect in &finding.effects {
        named(&mut text, effect);
    }
    let _ = writeln!(text, "    ],");
    if let Some(expression) = finding
        .shape
        .as_ref()
        .and_then(|shape| shape.expression.as_ref())
    {
        let _ = writeln!(
            text,
            "    // Something more that has no name and is not flown.\n    outside: {expression:?},"
        );
    }
    let region = &finding.region;
    let _ = writeln!(text, "    region: {:?},", region.description);
    let _ = writeln!(text, "    share_of_samples: {},", number(region.share));
    let held_out = serde_json::to_value(finding.held_out).unwrap_or_default();
    let _ = writeln!(
        text,
        "    // Root mean square errors on what was not fitted."
    );
    let _ = writeln!(text, "    held_out: {},\n)", ron(&held_out, 1));
    text
}

fn named(text: &mut String, effect: &Effect) {
    let _ = writeln!(
        text,
        "        (\n            name: {:?},\n            alternatives: {:?},\n            equation: {:?},\n            story: {:?},\n            parameters: {{",
        effect.name, effect.alternatives, effect.equation, effect.description
    );
    for (name, estimate) in &effect.parameters {
        let ends = if estimate.low.is_finite() && estimate.high.is_finite() {
            format!(
                ", low: {}, high: {}",
                number(estimate.low),
                number(estimate.high)
            )
        } else {
            String::new()
        };
        let _ = writeln!(
            text,
            "                {name:?}: (value: {}{ends}, unit: {:?}),",
            number(estimate.value),
            estimate.unit
        );
    }
    text.push_str("            },\n        ),\n");
}

/// The members of a struct that are there and finite, and wanted. JSON has neither infinities nor
/// `None`: both come as null.
fn entries(of: &impl Serialize, wanted: impl Fn(&str, &Value) -> bool) -> Value {
    let mut members = match serde_json::to_value(of) {
        Ok(Value::Object(members)) => members,
        _ => return Value::Null,
    };
    members.retain(|name, value| !value.is_null() && wanted(name, value));
    Value::Object(members)
}

/// A struct of structs and tuples of numbers.
fn ron(value: &Value, depth: usize) -> String {
    match value {
        Value::Object(members) => {
            let indent = "    ".repeat(depth + 1);
            let lines: Vec<String> = members
                .iter()
                .filter(|(_, value)| !value.is_null())
                .map(|(name, value)| format!("{indent}{name}: {},\n", ron(value, depth + 1)))
                .collect();
            if lines.is_empty() {
                return "()".into();
            }
            format!("(\n{}{})", lines.concat(), "    ".repeat(depth))
        }
        Value::Array(values) => {
            let values: Vec<String> = values.iter().map(|value| ron(value, depth)).collect();
            format!("({})", values.join(", "))
        }
        Value::Number(value) => value.as_f64().map_or_else(|| value.to_string(), number),
        other => other.to_string(),
    }
}

/// The shortest text that reads back as the same number.
fn number(value: f64) -> String {
    format!("{value:?}")
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use airflow::effects::{Crossflow, Effects, EntrainmentRadial, PayloadMass};
    use ron::Options;
    use ron::extensions::Extensions;
    use serde::Deserialize;

    use super::*;
    use crate::forward::hypothesis::Hypothesis;
    use crate::forward::simulate::Channel;
    use crate::infer::finding::Verdict;
    use crate::infer::finding::{Estimate, HeldOut, Region};

    /// What a reader needs of it.
    #[derive(Deserialize)]
    #[serde(rename = "Finding")]
    struct Read {
        verdict: Verdict,
        effects: Effects,
        sensor: Sensor,
        named: Vec<Effect>,
    }

    fn effect(name: &str, kind: Kind) -> Effect {
        let estimate = Estimate {
            value: 0.1 + 0.2,
            low: 1e-9,
            high: 1.0,
            unit: "m/s".into(),
        };
        Effect {
            name: name.into(),
            kind: Some(kind),
            alternatives: vec!["wake_tilt".into()],
            equation: "a \"b\"".into(),
            description: "wind bends the jet".into(),
            parameters: BTreeMap::from([("wind_x".to_owned(), estimate)]),
        }
    }

    fn finding(effects: Vec<Effect>, correction: Hypothesis) -> Finding {
        Finding {
            recording: "a".into(),
            channel: Channel::Speed,
            samples: 1,
            verdict: Verdict::Ambiguous,
            effects,
            region: Region::default(),
            prediction: Vec::new(),
            held_out: HeldOut::default(),
            shape: None,
            p: 1.0,
            candidates: Vec::new(),
            runner_up: None,
            advice: Vec::new(),
            detectable: Vec::new(),
            correction,
        }
    }

    fn read(text: &str) -> Read {
        let options = Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
        options
            .from_str(text)
            .unwrap_or_else(|error| panic!("{error}\n{text}"))
    }

    #[test]
    fn what_was_named_reads_back_as_it_was_fitted_and_a_payload_from_the_beginning_too() {
        let effects = Effects {
            crossflow: Some(Crossflow {
                wind_mps: [0.1 + 0.2, -1e-7],
            }),
            payload_mass: Some(PayloadMass::always(1.1)),
            ..Effects::default()
        };
        let correction = Hypothesis {
            effects,
            sensor: Sensor {
                gain: 0.25,
                ..Sensor::default()
            },
            ..Hypothesis::default()
        };
        let named = vec![
            effect("crossflow", Kind::Physics),
            effect("payload_mass", Kind::Physics),
        ];
        let text = finding_ron(&finding(named.clone(), correction));
        let read = read(&text);
        assert_eq!(read.verdict, Verdict::Ambiguous);
        assert_eq!(read.effects, effects);
        assert_eq!(read.sensor, correction.sensor);
        assert_eq!(read.named.len(), named.len());
        assert_eq!(read.named[0].parameters, named[0].parameters);
        assert!(!text.contains("inf") && !text.contains("NaN"), "{text}");
    }

    #[test]
    fn what_an_instrument_explains_as_well_is_not_flown() {
        let effects = Effects {
            entrainment_radial: Some(EntrainmentRadial { factor: 2.0 }),
            ..Effects::default()
        };
        let correction = Hypothesis {
            effects,
            ..Hypothesis::default()
        };
        let named = vec![effect("magnitude_sensor", Kind::Sensor)];
        assert_eq!(
            read(&finding_ron(&finding(named, correction))).effects,
            Effects::default()
        );
        assert_eq!(
            read(&finding_ron(&finding(Vec::new(), Hypothesis::default()))).effects,
            Effects::default()
        );
    }
}
