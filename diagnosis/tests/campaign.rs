//! Real flights, diagnosed together. They do not ship (one set has no licence): they are looked for beside the workspace, or where
//! `LEEWARD_RECORDINGS` points; without them every promise here says that it was skipped.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot go on should say where"
)]

use std::io::Read;
use std::path::{Path, PathBuf};

use diagnosis::campaign::table::{hardware_markdown, hardware_rows, markdown, report, row};
use diagnosis::campaign::{CampaignOptions, diagnose_campaign, near_floor};
use diagnosis::read::{Campaign, read_flight};
use diagnosis::recording::Recording;

/// Flights of a set whose names are wanted, by name; `None`, said aloud, where the set is not there.
fn flights(set: &str, wanted: impl Fn(&str) -> bool) -> Option<Vec<Recording>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = std::env::var_os("LEEWARD_RECORDINGS")
        .map_or_else(|| root.join("../shared/recordings"), PathBuf::from)
        .join(set)
        .join("flights");
    if !folder.is_dir() {
        eprintln!("skipped: no flights of {set} at {}", folder.display());
        return None;
    }
    let file = format!("recordings/{set}.ron");
    let text = std::fs::read_to_string(root.join(&file)).unwrap();
    let campaign = Campaign::parse(&file, &text).unwrap();
    let entries = std::fs::read_dir(&folder).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let read = |path: &PathBuf| {
        let name = path.file_name()?.to_str()?.trim_end_matches(".csv.gz");
        if !wanted(name) {
            return None;
        }
        let mut bytes = Vec::new();
        let file = std::fs::File::open(path).unwrap();
        flate2::read::GzDecoder::new(file)
            .read_to_end(&mut bytes)
            .unwrap();
        // A flight that never left the floor is none.
        read_flight(name, name, &bytes, &campaign).ok()
    };
    Some(paths.iter().filter_map(read).collect())
}

/// Every swap and the pairs of random walks of one collection: enough to name a wake, few enough for seconds.
fn is_of_one_day(name: &str) -> bool {
    name.starts_with("21_") && !name.contains("sss") && !name.contains("lll")
}

#[test]
fn from_drones_that_fly_alone_the_others_wake_is_named_first() {
    let Some(recordings) = flights("neural_swarm2", is_of_one_day) else {
        return;
    };
    let options = CampaignOptions {
        alone: true,
        most_rows: 3000,
        most_effects: 1,
        ..CampaignOptions::default()
    };
    let found = diagnose_campaign(&recordings, &options).unwrap();
    eprintln!("{}{}", report(&found), markdown(&[row("alone", &found, 1)]));
    let first = &found.taken[0];
    assert_eq!(first.name, "downwash");
    assert!(first.alternatives.is_empty());
    // Three standard errors over flights; everything else alone gains less than half as much.
    assert!(first.gain > 3.0 * first.gain_error);
    assert!(
        first
            .rivals
            .iter()
            .all(|(_, gain, _)| 2.0 * gain < first.gain)
    );
    // Found by no candidate at all: the box where the residual leaves the noise lies below another drone, and is pushed down.
    let located = found.located.as_ref().unwrap();
    assert!(located.description.contains("beside") && located.mean_error_n < 0.0);
    // Under another drone, in flights held out: more than half of the variance, at the lower end of the interval over flights.
    let under = &found.skills[1];
    assert!(under.r2_after[0] > 0.5 && under.r2_before < 0.1);
}

#[test]
fn near_the_floor_the_floor_is_named() {
    let is_wanted = |name: &str| {
        let low = ["_ground_", "takeoff", "randomwalk_l_", "randomwalk_s_"];
        low.iter().any(|kind| name.contains(kind)) || is_of_one_day(name)
    };
    let Some(recordings) = flights("neural_swarm2", is_wanted) else {
        return;
    };
    let options = CampaignOptions {
        judge: near_floor(&recordings),
        most_rows: 3000,
        most_effects: 1,
        ..CampaignOptions::default()
    };
    let found = diagnose_campaign(&recordings, &options).unwrap();
    eprintln!(
        "{}{}",
        report(&found),
        markdown(&[row("near the floor", &found, 1)])
    );
    let first = &found.taken[0];
    assert_eq!(first.name, "ground_effect_thrust");
    assert!(first.alternatives.is_empty() && first.gain > 3.0 * first.gain_error);
    assert!(
        first
            .rivals
            .iter()
            .all(|(_, gain, _)| 2.0 * gain < first.gain)
    );
    // It lifts, more the lower: the curve of the recorded force falls with height.
    let curve = found
        .curves
        .iter()
        .find(|c| c.along.contains("height"))
        .unwrap();
    assert!(curve.recorded_n.first() > curve.recorded_n.last());
    assert!(found.finding.effects[0].parameters["c_a"].low > 0.0);
}

#[test]
fn a_propeller_cut_by_four_millimetres_is_named_and_no_normal_flight_is_accused() {
    let Some(recordings) = flights("crazypad", |_| true) else {
        return;
    };
    let drone = |of: &Recording| match of.name.contains("__E8_") {
        true => "E8",
        false => "E9",
    };
    let drones: Vec<&str> = recordings.iter().map(drone).collect();
    let normal: Vec<bool> = recordings
        .iter()
        .map(|of| of.name.starts_with("normal_flight"))
        .collect();
    let rows = hardware_rows(&recordings, &drones, &normal);
    eprintln!("{}", hardware_markdown(&rows));
    for row in rows.iter().filter(|row| row.is_normal) {
        assert!(
            row.found.answers.is_empty(),
            "{}: {}",
            row.flight,
            row.answer
        );
    }
    let cut = || rows.iter().filter(|row| row.flight.contains("4mm_4mm"));
    assert_eq!(cut().count(), 2);
    for row in cut() {
        let best = &row.found.answers[0];
        assert_eq!(
            (best.name.as_str(), best.motors.as_slice()),
            ("damaged_propeller", &[3][..])
        );
    }
    // Two neighbouring propellers cannot be told from a weight between them: both are said.
    for row in rows.iter().filter(|row| row.flight.contains("3.5mm")) {
        let names: Vec<&str> = row.found.answers.iter().map(|a| a.name.as_str()).collect();
        assert!(names.contains(&"payload_mass") && names.contains(&"damaged_propeller"));
    }
}
