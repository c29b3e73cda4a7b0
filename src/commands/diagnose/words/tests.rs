//! No sentence contradicts the numbers beside it: over findings that are drawn at random, whatever
//! they say together.

use std::collections::BTreeMap;

use diagnosis::forward::hypothesis::Hypothesis;
use diagnosis::infer::finding::{Detectable, Estimate, HeldOut, Region, RunnerUp};
use diagnosis::infer::outside::Remains;
use diagnosis::statistics::draws::Draws;

use super::*;

const FINDINGS: u64 = 4000;

fn estimate(random: &mut Draws) -> Estimate {
    let value = random.between(-2.0, 2.0);
    let half = random.between(0.0, 0.5);
    Estimate {
        value,
        low: value - half,
        high: value + half,
        unit: "m/s".into(),
        at_bound: random.uniform() < 0.2,
    }
}

fn effect(name: &str, random: &mut Draws) -> Effect {
    let is_tied = random.uniform() < 0.3;
    Effect {
        name: name.into(),
        kind: Some([Kind::Physics, Kind::Sensor][random.index(2)]),
        too_small: false,
        probe: None,
        alternatives: is_tied.then(|| "wander".to_owned()).into_iter().collect(),
        equation: "U -> q U".into(),
        description: "something happens".into(),
        parameters: BTreeMap::from([("q".to_owned(), estimate(random))]),
    }
}

fn shape(random: &mut Draws) -> Shape {
    let is_predictable = random.uniform() < 0.6;
    Shape {
        depends_on: vec![("xi".into(), random.uniform())],
        curve: vec![(0.0, 1.0), (1.0, 2.0)],
        expression: None,
        expression_share: 0.0,
        nearest: (random.uniform() < 0.8).then(|| ("buoyancy".into(), random.uniform())),
        period_s: (random.uniform() < 0.2).then_some(1.25),
        spans_s: match is_predictable || random.uniform() < 0.5 {
            true => Vec::new(),
            false => vec![[3.0, 9.0]],
        },
        is_predictable,
        part: 0.04,
        correction: Vec::new(),
        left: Vec::new(),
        tolerance: vec![[0.02, 0.01]],
    }
}

/// Any finding that a diagnosis may come to.
fn finding(seed: u64) -> Finding {
    let random = &mut Draws::new(seed);
    let names = ["crossflow", "payload_mass"];
    let count = random.index(3);
    let mut effects: Vec<Effect> = names[..count].iter().map(|n| effect(n, random)).collect();
    let shape = (random.uniform() < 0.3).then(|| shape(random));
    let before = random.between(0.05, 1.0);
    let factor = [random.between(0.05, 1.0), random.between(0.995, 1.01)][random.index(2)];
    let mut after = match effects.is_empty() && shape.is_none() {
        true => before,
        false => before * factor,
    };
    let mut withdrawn = None;
    // What rises by chance stands, where throttle and power tell of it.
    if after >= before && !effects.is_empty() && random.uniform() < 0.5 {
        withdrawn = Some(Withdrawn {
            effects: std::mem::take(&mut effects),
            rms_after: after,
            p: random.between(0.0, 0.05),
        });
        after = before;
    }
    let is_tied = effects.iter().any(|effect| !effect.alternatives.is_empty());
    let is_outside = shape.is_some() || withdrawn.is_some();
    let verdict = match (is_outside, effects.is_empty(), is_tied) {
        (true, ..) => Verdict::OutsideLibrary,
        (_, true, _) => Verdict::None,
        (.., true) => Verdict::Ambiguous,
        (.., false) => Verdict::Library,
    };
    let rows = match verdict == Verdict::None || withdrawn.is_some() && shape.is_none() {
        true => 0,
        false => 1 + random.index(90),
    };
    let mean_error = [0.0, -0.1, 0.4][random.index(3)];
    let advice = match verdict {
        Verdict::None => Vec::new(),
        _ => vec!["the weight on a scale".to_owned()],
    };
    let tried = ["crossflow", "wander", "buoyancy"];
    let candidates = tried.iter().filter(|_| random.uniform() < 0.8);
    let candidates: Vec<&str> = candidates.copied().collect();
    let ranked = |name: &&str| {
        let is_taken = effects.iter().any(|effect| effect.name == **name);
        Ranked {
            name: (**name).to_owned(),
            gain: random.between(-5.0, 900.0),
            gain_error: random.between(0.0, 100.0),
            practical: random.uniform() < 0.8,
            parameters: BTreeMap::from([("q".to_owned(), 1.0)]),
            at_bound: !is_taken && random.uniform() < 0.3,
            probe: None,
        }
    };
    let candidates = candidates.iter().map(ranked).collect();
    Finding {
        recording: "drawn".into(),
        verdict,
        channel: Channel::Speed,
        samples: 100,
        fitted_every: 1 + random.index(3),
        runner_up: (random.uniform() < 0.3).then(|| RunnerUp {
            name: "wander".into(),
            gain: 30.0,
            gain_error: 4.0,
        }),
        region: Region {
            description: "xi 0.10 to 0.90".into(),
            sample_indices: (0..rows).collect(),
            share: rows as f64 / 100.0,
            mean_error,
            relative_error: mean_error / [0.0, 0.05, 2.0][random.index(3)],
            rms_error: mean_error.abs().max(random.between(0.1, 1.0)),
            error_over_noise: 2.0,
            ..Region::default()
        },
        effects,
        withdrawn,
        errors_follow: random.uniform() < 0.5,
        p: random.uniform().powi(4),
        remains: Remains {
            gain: random.between(-50.0, 50.0),
            gain_error: 5.0,
            is_sure: random.uniform() < 0.3,
            rms: 0.1,
            share: 0.2,
            description: "xi 0.10 to 0.90".into(),
        },
        shape,
        held_out: HeldOut {
            rms_before: before,
            rms_after: after,
            rms_after_low: 0.9 * after,
            rms_after_high: 1.1 * after,
            noise_floor: after * random.between(0.2, 1.2),
            instruments: 1,
            tolerance_before: [random.between(-0.05, 0.05), 0.01],
            tolerance_after: [0.0, 0.0],
        },
        candidates,
        advice,
        detectable: vec![Detectable {
            name: "wander".into(),
            parameter: "w2".into(),
            departure: 0.1,
            unit: "1".into(),
        }],
        prediction: Vec::new(),
        correction: Hypothesis::default(),
    }
}

fn text(finding: &Finding) -> String {
    report("drawn", "what".into(), finding, Vec::new()).text()
}

/// Over every drawn finding and what is printed of it.
fn holds(of: impl Fn(&Finding, &str) -> bool) {
    for seed in 0..FINDINGS {
        let finding = finding(seed);
        let text = text(&finding);
        assert!(of(&finding, &text), "seed {seed}: {finding:#?}\n{text}");
    }
}

#[test]
fn errors_above_the_noise_floor_are_not_called_noise() {
    holds(|finding, text| {
        let calls_it_noise =
            text.contains("Nowhere: what is left") || text.contains("no mismatch above noise");
        let is_noise = finding.held_out.rms_after <= UNQUIET * finding.held_out.noise_floor;
        !calls_it_noise || finding.verdict == Verdict::None && is_noise
    });
    holds(|finding, text| !finding.remains.is_sure || !text.contains("Nowhere: what is left"));
    holds(|finding, text| !is_unquiet(finding) || !text.contains("Nothing is missing that would"));
}

#[test]
fn nothing_is_said_not_to_repeat_beside_what_does() {
    holds(|finding, text| {
        let denies = [
            "nothing that repeats predicts",
            "no function of the covariates",
            "no mismatch that repeats",
        ];
        !finding.remains.is_sure || !denies.iter().any(|words| text.contains(words))
    });
}

#[test]
fn one_noise_floor_is_quoted() {
    holds(|_, text| text.contains("noise floor "));
    holds(|finding, text| {
        let floor = amount(finding.held_out.noise_floor, finding.channel);
        let quoted = text.split("noise floor ").skip(1);
        let mut figures = quoted.filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
        figures.all(|rest| rest.starts_with(&floor))
    });
}

#[test]
fn errors_that_differ_are_printed_so_and_what_is_explained_has_fallen() {
    holds(|finding, text| {
        let held_out = &finding.held_out;
        let line = text.lines().find(|line| line.contains(" before, "));
        let line = line.expect("every report has its fit");
        let (before, rest) = line.split_once(" before, ").expect("both errors");
        let before = before.rsplit(": ").next().expect("before");
        let after = rest.split(" after").next().expect("after");
        (before == after) == (held_out.rms_before == held_out.rms_after)
    });
    holds(|finding, text| {
        !text.contains("which explains") || finding.held_out.rms_after < finding.held_out.rms_before
    });
}

#[test]
fn an_answer_with_which_nothing_is_predicted_better_is_not_printed_as_one() {
    holds(|finding, text| match &finding.withdrawn {
        None => finding.effects.is_empty() || !text.contains("withdrawn"),
        Some(withdrawn) => {
            let names = withdrawn.effects.iter().map(|effect| &effect.name);
            let told = text.contains("is withdrawn: with it the rms error");
            told && names.into_iter().all(|name| text.contains(name.as_str()))
                && !text.contains(": 0 of 100 samples")
                && (finding.shape.is_some()
                    || text.starts_with("drawn: ")
                        && text
                            .lines()
                            .next()
                            .is_some_and(|title| title.contains("withdrawn")))
        }
    });
}

#[test]
fn a_parameter_at_its_bound_says_so_among_effects_and_candidates() {
    holds(|finding, text| {
        let effects = finding
            .effects
            .iter()
            .flat_map(|effect| effect.parameters.values());
        let of_effects = effects.filter(|estimate| estimate.at_bound).count();
        let of_candidates = finding.candidates.iter().filter(|one| one.at_bound).count();
        text.matches("at the end of its range").count() >= of_effects + of_candidates
    });
}

#[test]
fn a_large_p_value_beside_an_answer_is_explained() {
    holds(|finding, text| {
        let line = text
            .lines()
            .find(|line| line.contains("Global lack-of-fit test"));
        let line = line.expect("every report has the test");
        let is_explained = !line
            .trim_end()
            .ends_with(&format!("{}.", p_value(finding.p)));
        let asks = finding.verdict != Verdict::None && finding.p > ACCEPTED;
        is_explained == asks
    });
}

#[test]
fn nothing_is_called_foreign_to_the_library_beside_an_effect_that_predicts_nearly_all_of_it() {
    holds(|finding, text| {
        let nearest = finding
            .shape
            .as_ref()
            .and_then(|shape| shape.nearest.as_ref());
        let is_near = nearest.is_some_and(|(_, share)| *share >= NEARLY_ALL);
        !(is_near && text.contains("Nearest is"))
    });
}

#[test]
fn every_verdict_but_none_prints_its_advice_and_a_runner_up_gains_something() {
    holds(|finding, text| {
        finding
            .advice
            .iter()
            .all(|line| text.contains(line.as_str()))
    });
    holds(|finding, text| {
        let is_behind = |name: &str, words: &str| {
            let of = finding.candidates.iter().find(|one| one.name == name);
            !text.contains(words) || of.is_some_and(|one| one.gain > one.gain_error)
        };
        let names = ["wander", "buoyancy"].iter();
        names
            .map(|name| (name, format!("Runner-up: {name}, alone")))
            .all(|(name, words)| is_behind(name, &words))
    });
}

#[test]
fn no_share_of_nothing_is_reported_and_no_side_where_errors_have_none() {
    holds(|_, text| !["inf", "NaN", " 0.0 %"].iter().any(|no| text.contains(no)));
    holds(|finding, text| finding.region.mean_error != 0.0 || !text.contains("in the mean"));
}

#[test]
fn what_nothing_predicts_is_neither_placed_nor_corrected() {
    holds(|finding, text| {
        !is_unexplained(finding)
            || text.contains("Nowhere in particular") && !text.contains("It depends on")
    });
}

#[test]
fn flights_are_pointed_to_no_section_that_their_report_lacks() {
    for seed in 0..FINDINGS {
        let mut finding = finding(seed);
        finding.channel = Channel::VerticalForce;
        let text = text(&finding);
        assert!(!text.contains("under what remains") || text.contains("WHAT REMAINS"));
    }
}

#[test]
fn of_a_candidate_always_and_from_some_moment_on_the_one_that_was_taken_is_marked() {
    let random = &mut Draws::new(1);
    let mut finding = finding(1);
    let mut late = effect("crossflow", random);
    late.parameters.insert("t0".to_owned(), estimate(random));
    finding.effects = vec![late];
    let ranked = |gain: f64, names: &[&str]| Ranked {
        name: "crossflow".into(),
        gain,
        gain_error: 1.0,
        practical: true,
        parameters: names.iter().map(|name| ((*name).to_owned(), 1.0)).collect(),
        at_bound: false,
        probe: None,
    };
    finding.candidates = vec![ranked(90.0, &["q", "t0"]), ranked(40.0, &["q"])];
    let text = text(&finding);
    let mut rows = text.lines().filter(|line| line.ends_with("taken"));
    let row = rows.next().unwrap_or_default();
    assert!(row.contains("t0") && rows.next().is_none(), "{text}");
}

#[test]
fn errors_are_printed_with_the_gain_and_the_offset_that_they_contain() {
    holds(|finding, text| {
        let [gain, _] = finding.held_out.tolerance_before;
        let percent = format!("tolerance: {:+.1} % and +0.010 m/s before", 100.0 * gain);
        text.contains(&percent.replace("-0.0 %", "+0.0 %"))
    });
}

#[test]
fn what_a_shape_leaves_is_reported_as_what_names_leave() {
    holds(|finding, text| {
        let still = text.contains("are still");
        text.contains("WHAT REMAINS") && (!still || is_unquiet(finding))
    });
}

#[test]
fn no_runner_up_is_missed_where_nothing_is_named_and_nothing_is_detected_of_no_size() {
    holds(|finding, text| !text.contains("No runner-up is left") || finding.effects.len() == 1);
    let mut finding = finding(1);
    finding.detectable[0].departure = 0.0003;
    assert!(text(&finding).contains("below 0.001"), "{}", text(&finding));
}
