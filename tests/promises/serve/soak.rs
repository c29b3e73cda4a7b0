//! `plan soak`, shortened: a fleet lives, and all of it stays as it should be.

use serde_json::Value;

use crate::samples;

/// Drones, minutes, changes a second.
const SHORT: (usize, usize, usize) = (16, 1, 2);
const LONG: (usize, usize, usize) = (120, 5, 5);

#[test]
fn requests_are_a_day_apart_at_most() {
    let folder = tempfile::tempdir().unwrap();
    let (code, _, said) = crate::run(folder.path(), "soak --interval 100000");
    assert_eq!(code, Some(2), "{said}");
    assert!(
        said.contains("must be above 0 and at most 86400 s"),
        "{said}"
    );
}

#[test]
fn a_fleet_that_lives_for_a_while_is_planned_soundly_and_replays_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let (drones, minutes, rate) = samples(SHORT, LONG);
    let (code, text, said) = crate::run(
        folder.path(),
        &format!(
            "soak --drones {drones} --minutes {minutes} --rate {rate} --deadline 60 --replay --without-flight --format json"
        ),
    );
    let told: Value = serde_json::from_str(&text).unwrap_or_else(|it| panic!("{it}: {said}"));
    assert_eq!(code, Some(0), "{text}");
    assert_eq!(told["is_in_order"], true);
    assert_eq!(told["is_replayed"], true);
    assert_eq!(told["late"], 0);
    assert!(told["patches"].as_u64().unwrap() >= 50, "{text}");
    assert!(told["faults"].as_u64().unwrap() > 5, "{text}");
    for kind in ["late", "retask", "fail", "land", "remove"] {
        assert!(
            told["changes"][kind].as_u64().is_some(),
            "no {kind}: {text}"
        );
    }
}
