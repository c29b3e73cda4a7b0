//! A finding at the command line and one that the scenario cites.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const FINDING: &str = include_str!("../../../scenarios/findings/draughty-hall.ron");

/// The shipped hall, with or without its citation.
fn hall(air: &str) -> String {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/draughty-hall.ron");
    let cites = "  air: (finding: \"findings/draughty-hall.ron\"),\n";
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains(cites));
    text.replace(cites, air)
}

fn plan(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plan"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn given_or_cited_a_finding_makes_the_same_plan_and_without_it_another() {
    let desk = tempfile::tempdir().unwrap();
    let path = |name: &str| desk.path().join(name);
    fs::write(path("finding.ron"), FINDING).unwrap();
    fs::write(path("plain.ron"), hall("")).unwrap();
    fs::write(
        path("citing.ron"),
        hall("  air: (finding: \"finding.ron\"),\n"),
    )
    .unwrap();
    let runs: [&[&str]; 3] = [
        &["plain.ron", "--finding", "finding.ron", "--out", "given"],
        &["citing.ron", "--out", "cited"],
        &["plain.ron", "--out", "plain"],
    ];
    for arguments in runs {
        let output = plan(desk.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
    }
    let made = |folder: &str| fs::read(path(folder).join("plan.json")).unwrap();
    assert!(made("given") == made("cited"), "the two plans differ");
    assert!(made("given") != made("plain"));
    let text = String::from_utf8(made("given")).unwrap();
    assert!(text.contains("crossflow") && text.contains("wind_mps"));

    // The check goes by the air that a plan names: the plain plan in the corrected air is exposed.
    let mut plain: serde_json::Value = serde_json::from_slice(&made("plain")).unwrap();
    let given: serde_json::Value = serde_json::from_slice(&made("given")).unwrap();
    plain["air"] = given["air"].clone();
    fs::write(path("moved.json"), plain.to_string()).unwrap();
    let moved = plan(desk.path(), &["check", "moved.json", "--format", "json"]);
    assert_eq!(moved.status.code(), Some(1));
    let moved: serde_json::Value = serde_json::from_slice(&moved.stdout).unwrap();
    let violations = moved["violations"].as_array().unwrap();
    let of_air = violations.iter().filter(|it| it["kind"] == "air");
    let exposed: BTreeSet<&str> = of_air.filter_map(|it| it["drone"].as_str()).collect();
    assert_eq!(
        exposed.into_iter().collect::<Vec<_>>(),
        ["courier-1", "courier-4"]
    );
    assert_eq!(
        plan(desk.path(), &["check", "given/plan.json"])
            .status
            .code(),
        Some(0)
    );
}

#[test]
fn the_report_names_only_effects_that_move_the_air_a_limit_counts() {
    let desk = tempfile::tempdir().unwrap();
    let one = r#"Scenario(name: "one", bounds_m: (min: (0, 0, 0), max: (6, 6, 4)), drones: [
        (name: "k", airframe: "kolibri", start_m: (1, 1, 1), tasks: [(to_m: (4, 4, 1))]),
    ])"#;
    fs::write(desk.path().join("one.ron"), one).unwrap();
    for (wind, told) in [
        ("", "6 x 6 x 4 m\n"),
        ("crossflow: (wind_mps: (0, 0.5)), ", "air with crossflow\n"),
    ] {
        let own = "own_motion: (climb: 1, forward: 0.2), body_drag: (area_over_l2: 0.1)";
        let finding = format!("Finding(verdict: library, effects: ({wind}{own}))");
        fs::write(desk.path().join("finding.ron"), finding).unwrap();
        let output = plan(
            desk.path(),
            &["one.ron", "--finding", "finding.ron", "--out", "out"],
        );
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let printed = String::from_utf8(output.stdout).unwrap();
        let title = printed.split_inclusive('\n').next().unwrap();
        assert!(title.ends_with(told), "{title}");
    }
}

#[test]
fn a_finding_that_cannot_be_flown_or_read_is_reported_with_exit_code_2() {
    let desk = tempfile::tempdir().unwrap();
    fs::write(desk.path().join("plain.ron"), hall("")).unwrap();
    let merging = "Finding(verdict: library, effects: (jet_merging: (exponent: 0.8)))";
    fs::write(desk.path().join("merging.ron"), merging).unwrap();
    for (file, told) in [
        ("merging.ron", "cannot fly `jet_merging` yet"),
        ("none.ron", "none.ron"),
    ] {
        let output = plan(desk.path(), &["plain.ron", "--finding", file]);
        assert_eq!(output.status.code(), Some(2));
        let words = String::from_utf8(output.stderr).unwrap();
        assert!(words.contains(told), "{words}");
    }
    assert!(!desk.path().join("out").exists());
}
