//! `plan diagnose` on flights of others, as a person asks it. The flights do not ship: they are
//! looked for beside the project, or where `LEEWARD_RECORDINGS` points when the tests are built;
//! without them these promises are ignored.
//!
//! Neural-Swarm2: G. Shi, W. Hönig, X. Shi, Y. Yue, S.-J. Chung, IEEE T-RO 2021, arXiv:2012.05457.
//! CrazyPAD: K. Masalimov, T. Muslimov, E. Kozlov, R. Munasypov, Data 2024, 9, 79.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// The files of a set's flights whose names are wanted, sorted.
fn flights(set: &str, is_wanted: impl Fn(&str) -> bool) -> Vec<String> {
    let entries = std::fs::read_dir(super::shared(set).join("flights")).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| is_wanted(&file.file_name().unwrap().to_string_lossy()));
    files.sort();
    let names = files.iter().map(|file| file.display().to_string());
    names.collect()
}

/// The diagnosis of flights with the campaign file that ships.
fn diagnose(set: &str, files: &[String], more: &[&str]) -> Output {
    let desk = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let meta = root
        .join(format!("recordings/{set}.ron"))
        .display()
        .to_string();
    Command::new(env!("CARGO_BIN_EXE_plan"))
        .current_dir(desk.path())
        .arg("diagnose")
        .args(files)
        .args(["--meta", &meta])
        .args(more)
        .output()
        .unwrap()
}

/// Exit code 0, and the object printed.
fn json(output: &Output) -> Value {
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{errors}");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

/// What is taken first has no alternative, gains three of its standard errors over flights, and
/// twice what anything else gains in its place.
fn first_beyond_doubt(found: &Value) -> &str {
    let first = &found["taken"][0];
    assert_eq!(first["alternatives"], Value::Array(Vec::new()), "{first}");
    let gain = number(&first["gain"]);
    assert!(gain > 3.0 * number(&first["gain_error"]), "{first}");
    for rival in first["rivals"].as_array().unwrap() {
        assert!(2.0 * number(&rival[1]) < gain, "{first}");
    }
    first["name"].as_str().unwrap()
}

#[test]
#[cfg_attr(
    not(shared_recordings = "neural_swarm2"),
    ignore = "no recordings of neural_swarm2 beside the project"
)]
fn from_drones_that_fly_alone_the_others_wake_is_what_is_missing() {
    let is_a_swap = |name: &str| {
        ["_ss_", "_sl_", "_ll_"]
            .iter()
            .any(|pair| name.starts_with(&format!("21_swap{pair}")))
    };
    let files = flights("neural_swarm2", is_a_swap);
    let found = json(&diagnose(
        "neural_swarm2",
        &files,
        &["--alone", "--format", "json"],
    ));
    assert_eq!(found["format"], "diagnosis/1");
    assert_eq!(first_beyond_doubt(&found), "downwash");
    // Found by no candidate at all: the box where the residual leaves the noise lies about the axis
    // of another drone, and is pushed down.
    let located = &found["located"];
    assert!(
        located["description"]
            .as_str()
            .unwrap()
            .starts_with("beside"),
        "{located}"
    );
    assert!(number(&located["mean_error_n"]) < 0.0);
    // The wake of the paper, not another: half as strong to half as strong again.
    let strength = &found["effects"][0]["parameters"]["f"];
    assert!(
        number(&strength["low"]) > 0.5 && number(&strength["high"]) < 1.5,
        "{strength}"
    );
    // In flights held out whole, at the worse end of the interval over flights: less than half of
    // the error is left.
    let held_out = &found["heldout"];
    assert!(
        number(&held_out["rms_after_high"]) < 0.5 * number(&held_out["rms_before"]),
        "{held_out}"
    );
    assert_eq!(
        found["rows"].as_array().unwrap().len(),
        found["prediction"].as_array().unwrap().len()
    );
}

#[test]
#[cfg_attr(
    not(shared_recordings = "neural_swarm2"),
    ignore = "no recordings of neural_swarm2 beside the project"
)]
fn near_the_floor_the_floor_is_named() {
    let files = flights("neural_swarm2", |_| true);
    let found = json(&diagnose(
        "neural_swarm2",
        &files,
        &["--near-floor", "--format", "json"],
    ));
    assert_eq!(first_beyond_doubt(&found), "ground_effect_thrust");
    assert!(number(&found["effects"][0]["parameters"]["c_a"]["low"]) > 0.0);
    // It lifts, more the lower.
    let curves = found["curves"].as_array().unwrap();
    let heights = curves
        .iter()
        .find(|curve| curve["along"].as_str().unwrap().starts_with("height"));
    let recorded = heights.unwrap()["recorded_n"].as_array().unwrap();
    assert!(number(&recorded[0]) > number(recorded.last().unwrap()));
    // And the report says it in words.
    let output = diagnose("neural_swarm2", &files, &["--near-floor"]);
    let text = String::from_utf8(output.stdout).unwrap();
    for words in [
        "\nWHERE\n  height m",
        "\nWHAT\n  ground_effect_thrust: near the floor",
        "\nRUNNERS-UP\n",
    ] {
        assert!(text.contains(words), "{text}");
    }
}

#[test]
#[cfg_attr(
    not(shared_recordings = "crazypad"),
    ignore = "no recordings of crazypad beside the project"
)]
fn a_propeller_cut_by_four_millimetres_is_named_and_no_normal_flight_is_accused() {
    let files = flights("crazypad", |_| true);
    let more = [
        "--normal",
        "normal_flight",
        "--drones",
        "__E8_,__E9_",
        "--format",
        "json",
    ];
    let printed = json(&diagnose("crazypad", &files, &more));
    let named = |part: &str| -> Vec<(String, Vec<Value>)> {
        let flights = printed["flights"].as_array().unwrap().iter();
        let of_name = flights.filter(|flight| flight["flight"].as_str().unwrap().contains(part));
        of_name
            .map(|flight| {
                (
                    flight["flight"].to_string(),
                    flight["answers"].as_array().unwrap().clone(),
                )
            })
            .collect()
    };
    assert_eq!(named("normal_flight").len(), 8);
    for (flight, answers) in named("normal_flight") {
        assert!(answers.is_empty(), "{flight}: {answers:?}");
    }
    assert_eq!(named("4mm_4mm").len(), 2);
    for (flight, answers) in named("4mm_4mm") {
        assert_eq!(answers[0]["name"], "damaged_propeller", "{flight}");
        assert_eq!(answers[0]["motors"], serde_json::json!([3]), "{flight}");
    }
    // Two neighbouring propellers cannot be told from a weight between them: both are said.
    for (flight, answers) in named("3.5mm") {
        let names: Vec<&str> = answers
            .iter()
            .map(|answer| answer["name"].as_str().unwrap())
            .collect();
        assert!(
            names.contains(&"payload_mass") && names.contains(&"damaged_propeller"),
            "{flight}: {names:?}"
        );
    }
}
