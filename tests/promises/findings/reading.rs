//! The file of a finding: cited or given, with every error at its place in it.

use airflow::effects::Effects;
use planner::read_world_with;
use planner::scenario::world::World;
use planner::scenario::{Files, Problems};

use super::wind;

fn scenario(air: &str) -> String {
    format!(
        r#"(name: "m", bounds_m: (min: (0, 0, 0), max: (20, 9, 9)), {air} drones: [
        (name: "a", airframe: "kolibri", start_m: (2, 2, 7), tasks: [(to_m: (17, 2, 7))])])"#
    )
}

fn reading(finding: &str) -> Result<World, Problems> {
    let files = |file: &str| match file {
        "finding.ron" => Ok(finding.to_owned()),
        other => Err(format!("no {other}")),
    };
    read_world_with(
        &scenario(r#"air: (finding: "finding.ron"),"#),
        &Files::new(&files),
    )
}

/// What stands at each error in the finding, beside the error in one line.
fn errors(finding: &str) -> Vec<(String, String)> {
    let problems = reading(finding).expect_err("wrong on purpose");
    let pointed = problems.iter().map(|problem| {
        let cited = problem.cited.as_ref().expect("in the cited file");
        let span = problem.span.clone().expect("at a place");
        (cited.text[span].to_owned(), problem.to_string())
    });
    pointed.collect()
}

const WHOLE: &str = r#"Finding(
    verdict: "library", recording: "hall", evidence: { "rms": [0.3, 0.1] }, smallest: [(name: "wander", departure: 0.4)],
    effects: (crossflow: Some((wind_mps: (0.38, 0.27)))),
)"#;

#[test]
fn a_finding_is_flown_and_what_else_its_file_says_is_left_alone() {
    let world = reading(WHOLE).unwrap();
    assert_eq!(world.effects, wind(0.38, 0.27));
    assert!(world.notes.is_empty());
    let short = reading("(effects: (crossflow: (wind_mps: (0.38, 0.27))))").unwrap();
    assert_eq!(short.effects, world.effects);
}

#[test]
fn the_command_line_s_finding_stands_before_the_scenario_s() {
    let files = |file: &str| match file {
        "cited.ron" => Ok("(effects: (wander: (growth: 1)))".to_owned()),
        _ => Ok(WHOLE.to_owned()),
    };
    let text = scenario(r#"air: (finding: "cited.ron"),"#);
    let world = read_world_with(&text, &Files::new(&files).with_finding("given.ron")).unwrap();
    assert_eq!(world.effects, wind(0.38, 0.27));
    assert!(
        read_world_with(&text, &Files::new(&files))
            .unwrap()
            .effects
            .wander
            .is_some()
    );
}

#[test]
fn a_payload_counts_from_the_beginning_unless_a_moment_is_given() {
    let flown = |finding: &str| reading(finding).unwrap();
    let always = flown("(effects: (payload_mass: (mass_factor: 1.3)))");
    assert_eq!(always.effects, super::heavier(1.3));
    let written_out = flown("(effects: (payload_mass: (mass_factor: 1.3, since_s: -inf)))");
    assert_eq!(written_out.effects, always.effects);
    let later = flown("(effects: (payload_mass: (mass_factor: 1.3, since_s: 40)))");
    assert!(
        later.notes[0].contains("heavier from the beginning"),
        "{:?}",
        later.notes
    );
}

#[test]
fn every_error_of_a_finding_is_at_its_place_in_it() {
    let found = errors(
        "Finding(effects: (crosflow: (wind_mps: (1, 1)), wander: (growth: 30), rotor_cant: (), wake_tilt: (lean: 3)))",
    );
    let pointed: Vec<&str> = found.iter().map(|(at, _)| at.as_str()).collect();
    assert_eq!(pointed, ["crosflow", "30", "()", "3"]);
    let all: String = found
        .iter()
        .map(|(_, words)| format!("{words}\n"))
        .collect();
    for words in [
        "`effects` has no field `crosflow`: unknown; did you mean `crossflow`?",
        "`growth` of `wander` is out of range: must be from -1 to 3",
        "`rotor_cant` has no `width_factor`: required here",
        "`lean` of `wake_tilt` must be (x, y)",
    ] {
        assert!(all.contains(words), "{words} in\n{all}");
    }
    assert_eq!(
        errors("Finding(verdict: \"none\")")[0].0,
        "Finding(verdict: \"none\")"
    );
}

#[test]
fn what_cannot_be_flown_is_refused_in_words() {
    let found =
        errors("(effects: (wake_transport: (lag_factor: 1.6), jet_merging: (exponent: 0.8)))");
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].0, "(exponent: 0.8)");
    assert!(
        found[0]
            .1
            .contains("the planner cannot fly `jet_merging` yet: jets that add up to more")
    );
    // A wind that the bent jet is not known for: 0.4 of 7.41 m/s.
    let problems = reading("(effects: (crossflow: (wind_mps: (3, 0))))").expect_err("too strong");
    let words = problems[0].to_string();
    assert!(
        words.contains("too strong for the jet of `kolibri`"),
        "{words}"
    );
    assert!(problems[0].span.is_some());
}

#[test]
fn a_finding_about_a_sensor_alone_is_flown_as_the_plain_air_with_a_note() {
    let world = reading("Finding(verdict: \"library\", effects: ())").unwrap();
    assert_eq!(world.effects, Effects::default());
    assert_eq!(
        world.notes,
        [
            "the finding of finding.ron names nothing that moves the air a limit counts: the plan is flown in the air as it is"
        ]
    );
    let receiver = reading(
        "(effects: (battery_sag: (sensitivity: 1), recirculation: (speed_mps: 0.1, time_s: 300)))",
    );
    let notes = receiver.unwrap().notes;
    assert!(
        notes[0].contains("`recirculation` of finding.ron is bounded"),
        "{notes:?}"
    );
    assert!(
        notes[1].contains("`battery_sag` of finding.ron changes nothing here"),
        "{notes:?}"
    );
}

#[test]
fn an_effect_that_was_fitted_at_the_end_of_a_range_is_not_flown_in_silence() {
    let written = |at_bound: &str| {
        format!(
            "Finding(effects: (recirculation: (speed_mps: 0.1, time_s: 300)), named: [(name: \"recirculation\", parameters: {{
                \"e\": (value: 1.0, low: 0.9, high: 1.0, unit: \"1\"{at_bound}), \"u\": (value: 0.1, low: 0, high: 1, unit: \"m/s\"),
            }})])"
        )
    };
    let says = |written: &str| {
        let notes = reading(written).unwrap().notes;
        let mut notes = notes.iter();
        notes.any(|note| note.contains("was fitted with e at the end of its range"))
    };
    assert!(says(&written(", at_bound: true")));
    assert!(!says(&written("")));
}

#[test]
fn faults_of_instruments_are_accepted_and_change_nothing() {
    let world = reading("Finding(verdict: library, effects: (), sensor: (gain: 0.1))").unwrap();
    assert_eq!(world.effects, Effects::default());
    assert!(
        world.notes[1].contains("`sensor` of finding.ron changes nothing here"),
        "{:?}",
        world.notes
    );
}

#[test]
fn what_a_diagnosis_could_not_name_is_said_not_to_be_flown() {
    for effects in ["()", "(crossflow: (wind_mps: (0.38, 0.27)))"] {
        let written =
            format!("Finding(verdict: outside_library, effects: {effects}, outside: \"0.3 s\")");
        let world = reading(&written).unwrap();
        assert!(
            world.notes[0].contains("has no law here and is not flown"),
            "{:?}",
            world.notes
        );
        assert_eq!(world.effects.crossflow.is_some(), effects != "()");
    }
    let ambiguous = reading("Finding(verdict: ambiguous, effects: (wander: (growth: 1)))").unwrap();
    assert!(ambiguous.notes[0].contains("what would explain the recording as well is not"));
}
