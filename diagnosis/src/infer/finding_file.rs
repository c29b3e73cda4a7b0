//! The text of `finding.ron`: what a scenario cites to fly through the corrected air.

use airflow::effects::{EffectSpec, Effects, PayloadMass};
use ron::Options;
use ron::extensions::Extensions;
use ron::ser::PrettyConfig;
use serde::{Deserialize, Serialize};

use crate::forward::hypothesis::{Hypothesis, Sensor};
use crate::infer::candidates::{CLOCK, DRIFT, GAIN, Kind, LAG, OFFSET};
use crate::infer::finding::{Effect, Finding, HeldOut, Verdict};
use crate::infer::scopes::SATURATION;

/// The members of `Finding( ... )`, in their order.
#[derive(Serialize)]
struct File<'a> {
    recordings: &'a [&'a str],
    verdict: Verdict,
    effects: Effects,
    sensor: Sensor,
    named: &'a [Effect],
    #[serde(skip_serializing_if = "Option::is_none")]
    outside: Option<&'a str>,
    region: &'a str,
    share_of_samples: f64,
    held_out: HeldOut,
}

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
    let corrected = &finding.correction.effects;
    let is_flown = |spec: &&EffectSpec| {
        let is_it =
            |effect: &Effect| effect.name == spec.name && effect.kind == Some(Kind::Physics);
        finding.effects.iter().any(is_it)
    };
    let mut effects = Effects::default();
    for spec in corrected.specs().filter(is_flown) {
        spec.set(&mut effects, &spec.values(corrected).unwrap_or_default());
    }
    let shape = finding.shape.as_ref();
    let file = File {
        recordings: &[&finding.recording],
        verdict: finding.verdict,
        effects,
        sensor: finding.correction.sensor,
        named: &finding.effects,
        outside: shape.and_then(|shape| shape.expression.as_deref()),
        region: &finding.region.description,
        share_of_samples: finding.region.share,
        held_out: finding.held_out,
    };
    let options = Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
    // An estimate stands on one line.
    let pretty = PrettyConfig::new().depth_limit(4).escape_strings(false);
    let members = options.to_string_pretty(&file, pretty);
    let members = members.expect("numbers, texts and lists have a form in RON");
    let begins = finding
        .effects
        .iter()
        .any(|of| of.parameters.contains_key("t0"));
    let mut text = String::from(
        "// What is missing in the simulation of a recording, as diagnosed.\n\
         // A scenario flies through the corrected air: air: (finding: \"finding.ron\")\nFinding",
    );
    for line in members.lines().filter(|line| !line.ends_with(": None,")) {
        let member = line.trim_start();
        let indent = &line[..line.len() - member.len()];
        let key = member.split(':').next().unwrap_or_default();
        let effect = EffectSpec::named(key).filter(|_| indent.len() == 8);
        let above = effect.map(|spec| spec.equation).or(match key {
            _ if indent.len() != 4 => None,
            "effects" if begins => Some(
                "Of the air and of the drones in it: this is flown, from the first second on (t0 is a time of the recording).",
            ),
            "effects" => Some("Of the air and of the drones in it: this is flown."),
            "sensor" => Some("Of all instruments: this is not flown."),
            "outside" => Some("Outside the library: this is not flown."),
            "region" => {
                Some("Where the corrected simulation differs, and in what share of the samples.")
            }
            "held_out" => {
                Some("Root mean square errors on what was not fitted, in the channel's unit.")
            }
            _ => None,
        });
        text.extend(above.map(|above| format!("{indent}// {above}\n")));
        text.push_str(line);
        text.push('\n');
    }
    text
}

/// A text that is no finding: where and why, by line and column.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct NoFinding(ron::error::SpannedError);

/// What a `finding.ron` says: as a correction of a simulation, and in names.
#[derive(Clone, Debug)]
pub struct FindingFile {
    /// Every effect and fault that is named and applied.
    pub correction: Hypothesis,
    /// Names of those, whatever the file says of them beside.
    pub names: Vec<&'static str>,
    /// Names of the recordings that it was found in.
    pub recordings: Vec<String>,
    /// Those that began part-way through the recording that they were found in, each with when (s).
    /// Another recording's clock knows nothing of that: they are applied from its beginning on.
    pub begun: Vec<(String, f64)>,
    /// Faults of one probe, each with its number there. They are not applied: which probe of
    /// another recording it is, if any, is not known.
    pub of_one_probe: Vec<(String, u32)>,
    /// Whether it was found from drones that fly alone: the wake itself is among the effects.
    pub is_alone: bool,
}

/// The members of a finding that are applied.
#[derive(Deserialize)]
#[serde(rename = "Finding")]
struct Applied {
    #[serde(default)]
    recordings: Vec<String>,
    #[serde(default)]
    effects: Effects,
    #[serde(default)]
    sensor: Sensor,
    #[serde(default)]
    named: Vec<Effect>,
}

/// Reads what [`finding_ron`] writes.
///
/// # Errors
/// No finding: where and why, by line and column.
pub fn read_finding(text: &str) -> Result<FindingFile, NoFinding> {
    let options = Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
    let Applied {
        recordings,
        mut effects,
        sensor,
        named,
    } = options.from_str(text).map_err(NoFinding)?;
    // The wake of drones that were taken to fly alone is no effect of a jet.
    let wake = named.iter().find(|effect| effect.name == "downwash");
    let strength = wake.and_then(|effect| effect.parameters.get("f"));
    let moment = |effect: &Effect| {
        let at = effect.parameters.get("t0")?;
        Some((effect.name.clone(), at.value))
    };
    let mut begun: Vec<(String, f64)> = named.iter().filter_map(moment).collect();
    let since_s = effects.payload_mass.map(|payload| payload.since_s);
    if let Some(since_s) = since_s.filter(|it| it.is_finite() && *it > 0.0)
        && !begun.iter().any(|(name, _)| name == "payload_mass")
    {
        begun.push(("payload_mass".to_owned(), since_s));
    }
    let of_probe = |effect: &Effect| Some((effect.name.clone(), effect.probe?));
    let of_one_probe = named.iter().filter_map(of_probe).collect();
    // The one effect of the air that has its moment within.
    effects.payload_mass = effects
        .payload_mass
        .map(|payload| PayloadMass::always(payload.mass_factor));
    let of_effects = effects.treatments().into_iter().map(|(name, _)| name);
    let names = wake.map(|_| "downwash").into_iter().chain(of_effects);
    Ok(FindingFile {
        names: names.chain(faults(&sensor)).collect(),
        correction: Hypothesis {
            effects,
            sensor,
            downwash: strength.map(|estimate| estimate.value),
        },
        is_alone: wake.is_some(),
        begun,
        of_one_probe,
        recordings,
    })
}

/// Names of the faults that an instrument has.
fn faults(sensor: &Sensor) -> impl Iterator<Item = &'static str> {
    let drifts = sensor.gain_drift_per_h != 0.0 || sensor.offset_drift_per_h != 0.0;
    let faults = [
        (GAIN.name, sensor.gain != 0.0),
        (OFFSET.name, sensor.offset != 0.0),
        (DRIFT.name, drifts),
        (LAG.name, sensor.lag_s != 0.0),
        (SATURATION, sensor.saturation.is_finite()),
        (CLOCK.name, sensor.clock_s != 0.0),
    ];
    faults
        .into_iter()
        .filter_map(|(name, is_its)| is_its.then_some(name))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use airflow::effects::{Crossflow, EntrainmentRadial};

    use super::*;
    use crate::forward::simulate::Channel;
    use crate::infer::finding::{Estimate, Region};

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
            at_bound: false,
        };
        Effect {
            name: name.into(),
            kind: Some(kind),
            alternatives: vec!["wake_tilt".into()],
            equation: "a \"b\"".into(),
            description: "wind bends the jet".into(),
            parameters: BTreeMap::from([("wind_x".to_owned(), estimate)]),
            too_small: false,
            probe: None,
        }
    }

    fn finding(effects: Vec<Effect>, correction: Hypothesis) -> Finding {
        Finding {
            recording: "a".into(),
            channel: Channel::Speed,
            samples: 1,
            fitted_every: 1,
            withdrawn: None,
            verdict: Verdict::Ambiguous,
            effects,
            region: Region::default(),
            prediction: Vec::new(),
            errors_follow: false,
            held_out: HeldOut::default(),
            shape: None,
            p: 1.0,
            candidates: Vec::new(),
            remains: Default::default(),
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
    fn what_began_at_a_time_of_its_recording_is_applied_from_the_beginning_of_another() {
        let mut payload = effect("payload_mass", Kind::Physics);
        let at = Estimate::around(42.0, 0.0, "s");
        payload.parameters.insert("t0".to_owned(), at);
        let correction = Hypothesis {
            effects: Effects {
                payload_mass: Some(PayloadMass {
                    since_s: 42.0,
                    ..PayloadMass::always(1.2)
                }),
                ..Effects::default()
            },
            ..Hypothesis::default()
        };
        let text = finding_ron(&finding(vec![payload], correction));
        let file = read_finding(&text).expect("a finding");
        assert_eq!(file.begun, [("payload_mass".to_owned(), 42.0)]);
        let payload = file.correction.effects.payload_mass;
        assert_eq!(payload, Some(PayloadMass::always(1.2)));
    }

    #[test]
    fn what_is_applied_is_named_whatever_the_file_says_of_it_beside() {
        let text = "Finding(effects: (payload_mass: (mass_factor: 1.2, since_s: 500)), sensor: (gain: 0.1))";
        let file = read_finding(text).expect("a finding");
        assert_eq!(file.names, ["payload_mass", "sensor_gain"]);
        assert_eq!(file.begun, [("payload_mass".to_owned(), 500.0)]);
        let named = finding_ron(&finding(
            vec![effect("crossflow", Kind::Physics)],
            Hypothesis::default(),
        ));
        assert!(read_finding(&named).expect("a finding").names.is_empty());
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
    fn a_finding_reads_back_as_a_correction_and_the_wake_of_lonely_drones_with_it() {
        let mut wake = effect("downwash", Kind::Physics);
        let strength = Estimate::around(0.9, 0.1, "1");
        wake.parameters.insert("f".to_owned(), strength);
        let effects = Effects {
            crossflow: Some(Crossflow {
                wind_mps: [0.3, -0.1],
            }),
            ..Effects::default()
        };
        let correction = Hypothesis {
            effects,
            downwash: Some(0.9),
            ..Hypothesis::default()
        };
        let named = vec![wake, effect("crossflow", Kind::Physics)];
        let read = read_finding(&finding_ron(&finding(named, correction))).expect("a finding");
        assert_eq!(read.correction, correction);
        assert_eq!(read.names, ["downwash", "crossflow"]);
        assert!(read.is_alone);
        let failed = read_finding("Finding(effects: (crossflow: 3))");
        assert!(failed.is_err_and(|error| error.to_string().starts_with("1:")));
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
